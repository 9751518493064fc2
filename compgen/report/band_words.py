"""A band, and bounds with a probability, as data and in words, for people who never heard of a covariance."""

from collections.abc import Sequence
from typing import Any

from compgen.core.finding_codes import Code
from compgen.core.units import UM, limit_words, span_words
from compgen.error_model.unmeasured import NOT_LOOKED_AT, OF_WARMTH, Unknown
from compgen.pipelines.uncertainty.draws import FlownDraws
from compgen.report.next_measurements import STEPS, STEPS_OF_PROGRAM, next_steps
from compgen.verification.band import Band
from compgen.verification.verdict import bound_unit

DRAWN = ("share", "confidence", "draws", "seed")  # of the draws beside a band
PARTED = ("part_stands_um", "when_taught_um")  # where an identified robot's part is in no frame that it has taught
TINY_UM = 0.05  # a size that one digit does not show
LISTED = 4  # sources in a sentence
LEAST = 0.05  # of the whole, that a source must be to stand there
LEAST_GAIN = 1.05  # times
NAMED = 3  # of what is not measured, on the screen
NO_BAND = "not stated (the robot file gives no number a sigma)"


def band_record(
    band: Band, unknown: Sequence[Unknown], draws: FlownDraws | None = None, *, of_job: bool = True
) -> dict[str, Any]:
    """A band as JSON has it; docs/report.md has the keys. Without draws it is the linear band alone.

    Args:
        band: Along what was written.
        unknown: What it leaves out.
        draws: Flown beside it.
        of_job: Of a path file, whose keys a measurement may go into; else of a program that exists.
    """
    promised = None if draws is None else draws.guarantee
    stands, rest = band.parted or (0.0, band)
    parted = {} if band.parted is None else dict(zip(PARTED, (_um(stands), _um(rest.largest)), strict=True))
    return {
        "p95_um": _um(band.largest),
        **parted,
        **{key: getattr(promised, key, None) for key in DRAWN},
        "budget_um": _budget_um(band),
        "budget_rms_um": {share.source: _um(share.rms) for share in band.budget},
        "unknown": [
            {
                "what": row.what,
                "size_um": None if row.size is None else [_um(size) for size in row.size],
                "expected_um": None if row.expected is None else _um(row.expected),
                "from": row.origin,
            }
            for row in unknown
        ],
        "next": next_steps(
            _um(band.largest),
            _budget_um(rest),
            STEPS if of_job else STEPS_OF_PROGRAM,
            taught_um=_um(rest.largest),
        ),
    }


def known_words(record: dict[str, Any]) -> str:
    """How far the part may be off by what the file knows: ``41 um (95 %), mostly cte 31``."""
    if not record["p95_um"]:
        return NO_BAND
    sources = [(name, size) for name, size in record["budget_um"].items() if size >= LEAST * record["p95_um"]]
    named = [f"{name} {rounded(size)}" for name, size in sources[:LISTED]]
    share = "mostly" if len(record["budget_um"]) > len(named) else "from"
    inside = f", {share} {', '.join(named)}" if named else ""
    parted = [rounded(record[key]) for key in PARTED if key in record]
    taught = f"; {parted[0]} um where the part stands, {parted[1]} um when its frame is taught" if parted else ""
    return f"{rounded(record['p95_um'])} um (95 %){inside}{taught}"


def unknown_words(record: dict[str, Any]) -> str:
    """What the band leaves out: ``play (55 to 175 um); without a figure: tool length``; empty where nothing is."""
    open_rows = [row["what"] for row in record["unknown"] if row["size_um"] is None and row["from"] != NOT_LOOKED_AT]
    sized = ", ".join(row["what"] + _size(row) for row in record["unknown"] if row["what"] not in open_rows)
    without = f"without a figure: {', '.join(open_rows)}" if open_rows else ""
    return "; ".join(part for part in (sized, without) if part)


def unknown_in_short(record: dict[str, Any]) -> str:
    """The same for a screen: the largest with their sizes, the rest counted; the words of few rows are whole."""
    sized = sorted((row for row in record["unknown"] if row["size_um"]), key=lambda row: -row["size_um"][1])
    if len(record["unknown"]) <= NAMED + 1:
        return unknown_words(record)
    named = [f"{row['what']} ({size_words(row)} um)" for row in sized[:NAMED]]
    smaller = f"{len(sized) - NAMED} more of up to {rounded(sized[NAMED]['size_um'][1])} um" if sized[NAMED:] else ""
    rest = len(record["unknown"]) - len(sized)
    without = f"{rest} without a figure" if rest else ""
    return f"{', '.join(part for part in (*named, smaller, without) if part)}: --verbose names each"


def largest_unknown(record: dict[str, Any]) -> str:
    """The largest of what the band leaves out, and how many more: ``play (up to 175 um) and 3 more``."""
    if not record["unknown"]:
        return ""
    most = max(record["unknown"], key=lambda row: row["size_um"][1] if row["size_um"] else 0.0)
    size = f" (up to {rounded(most['size_um'][1])} um)" if most["size_um"] else ""
    more = f" and {len(record['unknown']) - 1} more" if len(record["unknown"]) > 1 else ""
    return f"{most['what']}{size}{more}"


def next_words(record: dict[str, Any]) -> str:
    """What to measure next: ``more poses: -13 um (cgen plan-poses ...); ...``; empty where nothing takes much off."""
    if not record["next"]:
        return ""
    named = "; ".join(_step_words(step) for step in record["next"])
    words = f"{named}; all of these leave {rounded(record['next'][-1]['left_um'])} um of the band"
    larger = _larger_than_band(record)
    return words + (f"; larger than the band, so first: {', '.join(larger)}" if larger else "")


def _step_words(step: dict[str, Any]) -> str:
    own = "then, with your own values, " if "=" in step["command"] else ""  # those that stand there are examples
    return f"{step['what']}: -{rounded(step['takes_um'])} um ({own}{step['command']})"


def _larger_than_band(record: dict[str, Any]) -> list[str]:
    return [row["what"] for row in record["unknown"] if row["size_um"] and row["size_um"][1] > record["p95_um"]]


def not_known_words(record: dict[str, Any], *, verbose: bool = True) -> str:
    """What the file leaves open, what is not measured, and on a line of its own what to measure next.

    Without ``verbose`` as a screen has it: the largest by name, the rest counted, and the first step alone.
    """
    unknown = unknown_words(record) if verbose else unknown_in_short(record)
    words = f"Uncertainty of the robot data: {known_words(record)}."
    words += f" Not measured on your robot: {unknown}." if unknown else ""
    if not record["next"]:
        return words
    following, band = next_words(record) if verbose else _step_words(record["next"][0]), rounded(record["p95_um"])
    if not verbose and _larger_than_band(record):
        return (
            f"{words}\nMeasure next: first what is larger than these {band} um. Then, to make them smaller: {following}"
        )
    return f"{words}\nMeasure next, to make these {band} um smaller: {following}"


def before_and_after(summary: dict[str, Any]) -> str:
    """The largest error before, and what calculation leaves of it; or what a robot file needs to be corrected."""
    before, after = summary["before"]["total"]["max_um"], summary["after"]
    if nothing := [f["message"] for f in summary["findings"] if f["code"] == Code.CORRECTION_NONE]:
        return f"Nothing was corrected: {nothing[0]}."
    if after is None:
        return f"Largest error {before:.1f} um, uncorrected."
    return f"Largest error {before:.1f} um before. After: {rounded(after['total']['max_um'])} um left by calculation."


def is_corrected(summary: dict[str, Any]) -> bool:
    """Whether anything was corrected."""
    return bool(summary["ratio"]) and all(f["code"] != Code.CORRECTION_NONE for f in summary["findings"])


def start_limit(summary: dict[str, Any]) -> str:
    """How late the program may start, rounded down; empty without a correction, or where warmth is not known."""
    window = summary["thermal"].get("start_window_s")
    if window is None or not is_corrected(summary):
        return ""
    is_cold = any(row["what"] == OF_WARMTH.what for row in summary["band"]["unknown"])
    return "" if is_cold else limit_words(window)


def gain_words(summary: dict[str, Any]) -> str:
    """How many times smaller the error is, and for how long; empty where nothing was corrected."""
    start = start_limit(summary)
    within = f" Start within {start} of the planned time." if start else ""
    return f" {times_words(summary['ratio'])}.{within}" if is_corrected(summary) else ""


def times_words(ratio: float) -> str:
    """How many times smaller, in two digits at least: ``52 times smaller``."""
    if ratio < LEAST_GAIN:
        return "No smaller"
    return f"{ratio:.0f} times smaller" if ratio >= 9.95 else f"{ratio:.1f} times smaller"


def headline(summary: dict[str, Any]) -> str:
    """The largest error before and after, what the files leave open and do not know; and a line of what to measure."""
    return f"{before_and_after(summary)} {not_known_words(summary['band'])}"


def guaranteed_record(draws: FlownDraws | None) -> dict[str, Any] | None:
    """Bounds with a probability, and what the draws came to."""
    if draws is None:
        return None
    promised, bounds = draws.guarantee, {}
    for b in draws.bounds:
        factor, _ = bound_unit(b.key)
        bounds[b.key] = {"bound": round(b.bound / factor, 9), "value": b.guaranteed / factor, "breaking": b.breaking}
    return {
        "bounds": bounds,
        "share": promised.share,
        "confidence": promised.confidence,
        "draws": promised.draws,
        "may_break": promised.may_break,
        "seed": promised.seed,
        "linearity": draws.linearity,
        "linearity_worst_draw": float(draws.disagreement.max()),
    }


def guaranteed_text(record: dict[str, Any]) -> str:
    """Bounds with a probability in one sentence."""
    values = ", ".join(
        f"{key} = {value['value']:.3g} (bound {value['bound']:g})" for key, value in record["bounds"].items()
    )
    return (
        f"guaranteed: {100 * record['share']:g} % of arms and days stay within {values}; "
        f"{100 * record['confidence']:g} % confidence, {record['draws']} draws, seed {record['seed']}"
    )


def rounded(um: float) -> str:
    """As many digits as a band is worth."""
    return f"{um:.0f}" if um >= 9.95 else f"{um:.1f}"


def size_words(row: dict[str, Any]) -> str:
    """From the least to the largest of a size that is not known: ``300 to 746``, ``expected 194, 154 to 237``."""
    least, largest = row["size_um"]
    if largest < TINY_UM:
        return "below 0.1"
    if row["expected_um"] is None:
        return f"{rounded(least) if least else '0'} to {rounded(largest)}"
    expected = rounded(row["expected_um"])
    return f"expected {expected}, {span_words(expected, rounded(least), rounded(largest))}"


def _size(row: dict[str, Any]) -> str:
    if row["size_um"] is None:
        return f" ({NOT_LOOKED_AT})" if row["from"] == NOT_LOOKED_AT else ""
    return f" ({size_words(row)} um{'' if row['expected_um'] is None else ', from ' + row['from']})"


def _budget_um(band: Band) -> dict[str, float]:
    return {share.source: _um(share.largest) for share in band.budget}


def _um(value: float) -> float:
    return float(f"{value / UM:.6g}")
