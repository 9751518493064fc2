"""The sliders of a what-if page, its numbers, its two figures, and the commands that reproduce what it shows."""

import json
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np
from markupsafe import Markup

from compgen.core.finding_codes import Level
from compgen.core.findings import first_message
from compgen.core.units import UM
from compgen.pipelines.findings.motion_findings import with_motion
from compgen.pipelines.study.live_band import band_at
from compgen.pipelines.study.live_build import BOUND, Agreement, LiveJob
from compgen.pipelines.study.live_day import Slider, planned_setting
from compgen.pipelines.study.live_places import LivePlaces, at
from compgen.report.band_words import band_record, rounded, unknown_words
from compgen.report.figure import LIGHT_TO_DARK
from compgen.report.key_words import with_signs
from compgen.report.live.record import live_record, sources_of
from compgen.report.page import fragment
from compgen.verification.band import Band
from compgen.verification.deviation import Sizes

STATISTICS = {"largest": "max", "p99": "p99", "rms": "rms"}  # what a size is called on the page
#: numbers that the script finds by their ids
NUMBER = Markup('<span id="live-{}">{}</span>')
ALL = Markup('<b><span id="live-band">{}</span></b>')


@lru_cache(maxsize=2)
def _file(name: str) -> Markup:
    return Markup((files("compgen.report.live") / name).read_text("utf-8"))


@dataclass(frozen=True, slots=True)
class LiveSection:
    """The part of a page that lives, and what else tells of it."""

    html: str
    record: dict[str, Any] | None  # for whatif.json
    sentence: str = ""
    warning: str = ""  # where it is further from the full computation than it may be


NONE = LiveSection("", None)


def without_sliders(reason: str) -> LiveSection:
    """In place of the sliders, why there are none."""
    words = f"No sliders: {reason}" + ("" if reason.endswith(".") else ".")
    return LiveSection(fragment("no_sliders.html", words=words), {"missing": reason}, words)


def live_section(
    live_job: LiveJob, agreement: Agreement, path: str, robot: str | None, overrides: Sequence[str]
) -> LiveSection:
    """The living section of a page, and what it comes to."""
    setting = planned_setting(live_job.live.day)
    before, after = (at(live_job.live, setting, places) for places in (live_job.live.before, live_job.live.after))
    count, apart = len(agreement.settings) - 1, agreement.largest / UM
    record = {
        "before_max_um": float(f"{before.max / UM:.6g}"),
        "after_max_um": float(f"{after.max / UM:.6g}"),
        "sliders": [slider.key for slider in live_job.live.day.sliders],
        "missing_sliders": list(live_job.live.day.missing),
        "settings_checked": count,
        "largest_difference_um": float(f"{apart:.3g}"),
        "is_close": agreement.is_close,
    }
    sentence = (
        f"sliders: largest error on the part {before.max / UM:.1f} um before, {after.max / UM:.1f} um after; "
        f"the page is within {apart:.3f} um of the full computation at {count} drawn settings"
    )
    beyond = (
        f"whatif.html: its sliders are up to {apart:.2f} um from the full computation, above {BOUND / UM:g} um; for "
        "numbers that count take the commands that it shows"
    )
    warning = "" if agreement.is_close else beyond
    return LiveSection(_html(live_job, agreement, path, robot, overrides), record, sentence, warning)


def _number_row(key: str, words: str, shown: Sizes) -> list[str | Markup]:
    """The numbers of one text with the sliders as planned."""
    sizes = {part: getattr(shown, name) for part, name in STATISTICS.items()}
    return [words, *(NUMBER.format(f"{key}-{part}", f"{size / UM:.2f}") for part, size in sizes.items())]


def _html(live_job: LiveJob, agreement: Agreement, path: str, robot: str | None, overrides: Sequence[str]) -> Markup:
    """The section.

    Args:
        live_job: Its numbers.
        agreement: How far they are from the full computation.
        path: The path file as the user wrote it.
        robot: The robot as the user named it.
        overrides: As the user gave them.
    """
    live, job, planned = live_job.live, live_job.job, live_job.planned
    words = [path, *(["--robot", robot] if robot else []), *(w for item in overrides for w in ("--set", item))]
    command = " ".join(shlex.quote(word) for word in words)
    program = shlex.quote(f"outputs/{job.name}/{live_job.corrected.delivery.files[-1][0]}")
    record = {**live_record(live_job), "command": command, "program": program}
    data = json.dumps({"live": record}, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    setting, planned_band = planned_setting(live.day), planned.band_of_plan()
    band = band_at(live, live_job.band, setting)
    unknown = with_motion(planned.not_known(planned_band), planned.effect(live_job.corrected.written))
    return fragment(
        "live.html",
        data=Markup(data),
        file=_file,
        sliders=[_slider(slider) for slider in live.day.sliders],
        notes=[f"No slider: {w[:1].lower()}{w[1:]}" for w in live.day.missing],
        has_stops=any(slider.kind == "feed" and slider.stops for slider in live.day.sliders),
        not_written=_not_written(live_job),
        number_rows=[
            _number_row("before", "before: the planned program", at(live, setting, live.before)),
            _number_row("after", "after: the same corrected file", at(live, setting, live.after)),
        ],
        views=_views(live.before),
        shades=",".join(LIGHT_TO_DARK),
        source_rows=_source_rows(live_job, band),
        unknown=unknown_words(band_record(planned_band, unknown)),
        command=command,
        program=program,
        serves_several=job.ensemble is not None,
        apart=max(agreement.largest / UM, 0.001),
        is_close=agreement.is_close,
        count=len(agreement.settings) - 1,
        bound=f"{BOUND / UM:g}",
    )


def _source_rows(live_job: LiveJob, band: Band) -> list[list[str | Markup]]:
    """What each source leaves open with the sliders as planned, and all of them together."""
    sizes = {share.source: share.largest for share in band.budget}
    rows: list[list[str | Markup]] = [
        [name, NUMBER.format(f"source-{n}", rounded(sizes.get(name, 0.0) / UM))]
        for n, name in enumerate(sources_of(live_job.band))
    ]
    return [*rows, [Markup("<b>all that the files know</b>"), ALL.format(rounded(band.largest / UM))]]


def _slider(slider: Slider) -> dict[str, Any]:
    """What a row of the form says: label, unit, value as it is typed, and of the range its ends, step and value."""
    value = f"{slider.value:g}" if slider.value == float(f"{slider.value:g}") else repr(slider.value)
    step = "1" if slider.kind == "repeat" else "any"
    reach: dict[str, str | int] = {"min": f"{slider.low:g}", "max": f"{slider.high:g}", "step": step, "value": value}
    if slider.stops:
        reach = {"min": 0, "max": len(slider.stops) - 1, "step": 1, "value": slider.stops.index(slider.value)}
    return {
        "label": slider.label,
        "unit": with_signs(slider.unit),
        "kind": slider.kind,
        "value": value,
        "reach": reach,
        "is_typed": not slider.stops,
    }


def _not_written(live_job: LiveJob) -> str:
    """What stands against the one corrected program, as planned."""
    corrected = live_job.corrected
    if corrected.inside:
        return ""
    if corrected.is_as_planned:
        return "The files know of no error of this arm: the program is written as planned."
    broken = first_message(Level.OUTSIDE, corrected.findings) or "it is outside its bounds"
    return f"The corrected program is written with --force only: {broken}."


def _views(places: LivePlaces) -> list[tuple[str, str]]:
    """Pairs of World's axes, those along which the path extends most first."""
    extent = np.ptp(places.position, axis=0)
    pairs = [("01", "from above"), ("02", "from the side"), ("12", "from the front")]
    return sorted(pairs, key=lambda pair: -float(np.prod(np.sort(extent[[int(c) for c in pair[0]]]) + 1e-9)))
