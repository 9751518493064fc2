"""The sliders of a what-if page, its numbers, its two figures, and the commands that reproduce what it shows."""

import json
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from html import escape
from importlib.resources import files
from typing import Any

import numpy as np

from compgen.core.codes import Level
from compgen.core.findings import first_message
from compgen.core.units import UM
from compgen.pipelines.findings.motion_findings import with_motion
from compgen.pipelines.study.live_band import band_at
from compgen.pipelines.study.live_build import BOUND, Agreement, LiveJob
from compgen.pipelines.study.live_day import Slider, planned_setting
from compgen.pipelines.study.live_places import LivePlaces, at
from compgen.pipelines.uncertainty.band import not_known
from compgen.report.band_words import band_record, rounded, unknown_words
from compgen.report.figure import LIGHT_TO_DARK
from compgen.report.live.record import live_record, sources_of
from compgen.report.page import section, with_units
from compgen.report.table import table

UNITS = {"degC": "&deg;C", "um/(m K)": "&micro;m/(m K)"}
STATISTICS = (("largest", "largest"), ("p99", "99 % of the part below"), ("rms", "rms"))
TITLE = "Move the day"


@lru_cache(maxsize=2)
def _file(name: str) -> str:
    return (files("compgen.report.live") / name).read_text("utf-8")


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
    return LiveSection(section(TITLE, f'<p class="missing">{escape(words)}</p>'), {"missing": reason}, words)


def live_section(
    live_job: LiveJob, agreement: Agreement, path: str, robot: str | None, overrides: Sequence[str]
) -> LiveSection:
    """The living section of a page, and what it comes to."""
    setting = planned_setting(live_job.live.day)
    before, after = (at(live_job.live, setting, places) for places in (live_job.live.before, live_job.live.after))
    count, apart = len(agreement.settings) - 1, agreement.largest / UM
    record = {
        "before_max_um": float(f"{before.largest / UM:.6g}"), "after_max_um": float(f"{after.largest / UM:.6g}"),
        "sliders": [slider.key for slider in live_job.live.day.sliders],
        "missing_sliders": list(live_job.live.day.missing), "settings_checked": count,
        "largest_difference_um": float(f"{apart:.3g}"), "is_close": agreement.is_close,
    }  # fmt: skip
    sentence = (
        f"sliders: largest error on the part {before.largest / UM:.1f} um before, {after.largest / UM:.1f} um after; "
        f"the page is within {apart:.3f} um of the full computation at {count} drawn settings"
    )
    warning = "" if agreement.is_close else (
        f"whatif.html: its sliders are up to {apart:.2f} um from the full computation, above {BOUND / UM:g} um; for "
        "numbers that count take the commands that it shows"
    )  # fmt: skip
    return LiveSection(_html(live_job, agreement, path, robot, overrides), record, sentence, warning)


def _html(live_job: LiveJob, agreement: Agreement, path: str, robot: str | None, overrides: Sequence[str]) -> str:
    """The section.

    Args:
        live_job: Its numbers.
        agreement: How far they are from the full computation.
        path: The path file as the user wrote it.
        robot: The robot as the user named it.
        overrides: As the user gave them.
    """
    live = live_job.live
    words = [path, *(["--robot", robot] if robot else []), *(w for item in overrides for w in ("--set", item))]
    command = " ".join(shlex.quote(word) for word in words)
    program = f"outputs/{live_job.job.name}/{live_job.corrected.delivery.files[-1][0]}"
    record = {**live_record(live_job), "command": command, "program": shlex.quote(program)}
    data = json.dumps({"live": record}, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    rows = "".join(_row(n, slider) for n, slider in enumerate(live.day.sliders))
    parts = [
        f"<style>{_file('live.css')}</style>",
        '<p class="lead">The program is corrected once, for the planned state. Move a slider: what would the planned '
        "program do in that state, and what would <b>the same corrected file</b> do? (Corrected anew for that state "
        "it would be as good as now.) Rises and errors follow at once, in this page alone.</p>",
        f'<form onsubmit="return false">{rows}'
        '<button type="button" id="live-reset" disabled>Back to the planned state</button></form>',
        _missing(live_job),
        _not_written(live_job),
        '<p class="big predicted" id="live-sentence"></p>'
        '<p class="live-silent" role="status" aria-live="polite" id="live-announcement"></p>'
        '<p id="live-beyond" hidden></p>',
        _numbers(live_job),
        _figures(live_job),
        _band(live_job),
        _commands(live_job, command, program),
        _agreement(agreement),
        f'<script type="application/json" id="live-data">{data}</script><script>{_file("live.js")}</script>'
        "<noscript><p>The sliders need JavaScript; the numbers are those of the planned state.</p></noscript>",
    ]
    return f'<div id="live">{section(TITLE, "".join(parts))}</div>'


def _row(n: int, slider: Slider) -> str:
    label, unit = escape(slider.label), UNITS.get(slider.unit, escape(slider.unit))
    value = f"{slider.value:g}" if slider.value == float(f"{slider.value:g}") else repr(slider.value)
    if slider.stops:
        reach = f'min="0" max="{len(slider.stops) - 1}" step="1" value="{slider.stops.index(slider.value)}"'
        number = f'<output id="live-number-{n}" for="live-{n}">{value}</output>'
    else:
        step = "1" if slider.kind == "repeat" else "any"
        reach = f'min="{slider.low:g}" max="{slider.high:g}" step="{step}" value="{value}"'
        number = (  # as text: a field of numbers reads 3,5 as 35 in some languages
            f'<input type="text" id="live-number-{n}" value="{value}" inputmode="decimal" autocomplete="off" '
            f'aria-label="{label}, typed" aria-describedby="live-note-{n}">'
        )
    when = f'<p class="live-when" id="live-when-{n}"></p>' if slider.kind == "run" else ""
    return (
        f'<div class="live-row"><label for="live-{n}">{label}</label><input type="range" id="live-{n}" {reach} '
        f'data-kind="{slider.kind}" autocomplete="off" aria-describedby="live-note-{n}">{number}'
        f'<span class="live-unit">{unit}</span>{when}<p class="live-note" id="live-note-{n}"></p></div>'
    )


def _missing(live_job: LiveJob) -> str:
    words = live_job.live.day.missing
    stops = any(slider.kind == "feed" and slider.stops for slider in live_job.live.day.sliders)
    notes = [f"No slider: {escape(w[:1].lower() + w[1:])}" for w in words]
    if stops:
        notes.append(
            "The warm-up's feed stops at feeds for which its program was planned anew: what it gives off at others, or "
            "how long it takes, is not guessed."
        )
    return "".join(f'<p class="lead">{note}</p>' for note in notes)


def _not_written(live_job: LiveJob) -> str:
    """What stands against the one corrected program, as planned."""
    corrected = live_job.corrected
    if corrected.inside:
        return ""
    if corrected.is_as_planned:
        return '<p class="lead">The files know of no error of this arm: the program is written as planned.</p>'
    broken = first_message(Level.OUTSIDE, corrected.findings) or "it is outside its bounds"
    return f'<p class="lead">The corrected program is written with --force only: {escape(broken)}.</p>'


def _numbers(live_job: LiveJob) -> str:
    live, setting = live_job.live, planned_setting(live_job.live.day)
    head = ["error on the part [&micro;m]", *(words for _, words in STATISTICS)]
    rows = []
    for key, words, places in (
        ("before", "before: the planned program", live.before), ("after", "after: the same corrected file", live.after),
    ):  # fmt: skip
        shown = at(live, setting, places)
        cells = (f'<span id="live-{key}-{part}">{getattr(shown, part) / UM:.2f}</span>' for part, _ in STATISTICS)
        rows.append([words, *cells])
    return table(head, rows)


def _views(places: LivePlaces) -> list[tuple[str, str]]:
    """Pairs of World's axes, those along which the path extends most first."""
    extent = np.ptp(places.position, axis=0)
    pairs = [("01", "from above"), ("02", "from the side"), ("12", "from the front")]
    return sorted(pairs, key=lambda pair: -float(np.prod(np.sort(extent[[int(c) for c in pair[0]]]) + 1e-9)))


def _figures(live_job: LiveJob) -> str:
    colours = "".join(
        f'<label><input type="radio" name="live-colour" value="{key}"{" checked" if key == "after" else ""} '
        f'autocomplete="off"> {words}</label>'
        for key, words in (("after", "after, the same file"), ("before", "before"))
    )
    views = "".join(
        f'<label><input type="radio" name="live-view" value="{axes}"{" checked" if n == 0 else ""} '
        f'autocomplete="off"> {words}</label>'
        for n, (axes, words) in enumerate(_views(live_job.live.before))
    )
    shades = ",".join(LIGHT_TO_DARK)
    path = (
        f"<fieldset><legend>Colour by the error</legend>{colours}</fieldset>"
        f"<fieldset><legend>Seen</legend>{views}</fieldset>"
        '<figure><svg viewBox="0 0 640 440" role="img" aria-label="The path, coloured by the error at each place; the '
        'table above has its largest, and the curves below where along the path it is."><g id="live-path"></g></svg>'
        f'<div class="live-scale"><span>0</span><i style="background:linear-gradient(90deg,{shades})"></i>'
        '<span id="live-scale-top"></span></div><figcaption>The path on the part, '
        '<span id="live-axes"></span>.</figcaption></figure>'
    )
    curves = "".join(
        f'<figure><svg viewBox="0 0 640 118" role="img" aria-label="The error {key} along the path, on a scale of its '
        f'own that ends at the largest"><path class="live-axis" d="M52 8V96H632"/><text x="46" y="19" '
        f'text-anchor="end" id="live-top-{key}"></text><text x="46" y="98" text-anchor="end">0</text>'
        f'<text x="52" y="113">start</text><text x="632" y="113" text-anchor="end">end of the path</text>'
        f'<path id="live-curve-{key}" d="M0 0"/></svg><figcaption>{words} [&micro;m], on its own scale</figcaption>'
        "</figure>"
        for key, words in (("before", "Before (dashed)"), ("after", "After with the same file (solid)"))
    )
    return path + curves


def _band(live_job: LiveJob) -> str:
    live, job = live_job.live, live_job.job
    shown = band_at(live, live_job.band, planned_setting(live.day))
    sizes = {share.source: share.largest for share in shown.budget}
    rows = [
        [escape(name), f'<span id="live-source-{n}">{rounded(sizes.get(name, 0.0) / UM)}</span>']
        for n, name in enumerate(sources_of(live_job.band))
    ]
    rows.append(["<b>all that the files know</b>", f'<b><span id="live-band">{rounded(shown.largest / UM)}</span></b>'])
    planned = live_job.planned
    band = planned.band_of_plan()
    record = band_record(band, with_motion(not_known(job.cell, band), planned.written().effect))
    unknown = unknown_words(record)
    words = "<p>What the files leave open beside the numbers above, in this state: on 95 of 100 robots and days that "
    words += "they may be talking of, the tool stays within it of where it is said to be.</p>"
    not_in = f'<p class="lead">Not known, and on top: {with_units(unknown)}.</p>' if unknown else ""
    return words + table(["source", "largest on the part [&micro;m]"], rows) + not_in


def _commands(live_job: LiveJob, command: str, program: str) -> str:
    start = ""
    if live_job.job.ensemble is not None:
        start = " The file serves several starts; the one that the sliders stand at is said alone, with no average."
    return (
        "<p>The same from the command line, largest error in <code>on_part.before.total.max_um</code>:</p>"
        f'<pre><code id="live-command-before">cgen predict {escape(command)} --json</code></pre>'
        f"<p>and after with the same file, which <code>cgen generate {escape(command)}</code> writes, in "
        "<code>on_part.after.total.max_um</code>:</p>"
        f'<pre><code id="live-command-after">cgen check {escape(command)} --written {escape(program)} --json</code>'
        "</pre>"
        f'<p class="lead">Only sliders that were moved are said.{start}</p>'
    )


def _agreement(agreement: Agreement) -> str:
    count = len(agreement.settings) - 1
    words = (
        f"Checked when this page was made, at the planned state and {count} drawn ones: its numbers and its band are "
        f'within <b id="live-agreement">{max(agreement.largest / UM, 0.001):.3f}</b> &micro;m of the full computation, '
        "which reads the files anew and flies both texts with the twin"
    )
    if agreement.is_close:
        words += f" (at most {BOUND / UM:g} is promised)"
    else:
        words += f". <b>That is more than the {BOUND / UM:g} &micro;m that such a page promises: use the commands</b>"
    shown = 'One move of a slider took <span id="live-ms"></span> here.'
    return f'<p class="lead">{words}. {shown}</p>'
