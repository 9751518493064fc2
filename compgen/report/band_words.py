"""A band, and bounds with a probability, as data and in words, for people who never heard of a covariance."""

from collections.abc import Sequence
from typing import Any

from compgen.core.units import UM
from compgen.error_model.unknown import NOT_LOOKED_AT, Unknown
from compgen.pipelines.uncertainty.draws import FlownDraws
from compgen.report.next_steps import next_steps
from compgen.verification.band import Band
from compgen.verification.verdict import unit_of

DRAWN = ("share", "confidence", "draws", "seed")  # of the draws beside a band
PARTED = ("part_stands_um", "when_taught_um")  # where an identified robot's part is in no frame that it has taught
TINY_UM = 0.05  # a size that one digit does not show
LISTED = 4  # sources in a sentence
LEAST = 0.05  # of the whole, that a source must be to stand there
NO_BAND = "no band: the file says of no number how well it is known"


def band_record(band: Band, unknown: Sequence[Unknown], draws: FlownDraws | None = None) -> dict[str, Any]:
    """A band as JSON has it; docs/report.md has the keys. Without draws it is the linear band alone."""
    promised = None if draws is None else draws.guarantee
    budget_um = {share.source: _um(share.largest) for share in band.budget}
    return {
        "p95_um": _um(band.largest),
        **dict(zip(PARTED, map(_um, band.parted or ()), strict=False)),
        **{key: getattr(promised, key, None) for key in DRAWN},
        "budget_um": budget_um,
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
        "next": next_steps(_um(band.largest), budget_um),
    }


def known_words(record: dict[str, Any]) -> str:
    """How far the part may be off by what the file knows: ``41 um (95 %) of what this file knows (cte 31, ...)``."""
    if not record["p95_um"]:
        return NO_BAND
    sources = [(name, size) for name, size in record["budget_um"].items() if size >= LEAST * record["p95_um"]]
    named = [f"{name} {rounded(size)}" for name, size in sources[:LISTED]]
    if len(record["budget_um"]) > len(named):
        named.append("...")
    inside = f" ({', '.join(named)})" if named else ""
    parted = [rounded(record[key]) for key in PARTED if key in record]
    taught = f": {parted[0]} um where the part stands, {parted[1]} um when its frame is taught" if parted else ""
    return f"{rounded(record['p95_um'])} um (95 %) of what this file knows{inside}{taught}"


def unknown_words(record: dict[str, Any]) -> str:
    """What the band leaves out: ``play (55 to 175 um); without a figure: tool length``; empty where nothing is."""
    open_rows = [row["what"] for row in record["unknown"] if row["size_um"] is None and row["from"] != NOT_LOOKED_AT]
    sized = ", ".join(row["what"] + _size(row) for row in record["unknown"] if row["what"] not in open_rows)
    without = f"without a figure: {', '.join(open_rows)}" if open_rows else ""
    return "; ".join(part for part in (sized, without) if part)


def next_words(record: dict[str, Any]) -> str:
    """What to measure next: ``one hot length: -13 um (cgen identify ...); ...``; empty where nothing takes much off."""
    if not record["next"]:
        return ""
    named = "; ".join(f"{step['what']}: -{rounded(step['takes_um'])} um ({step['command']})" for step in record["next"])
    words = f"{named}; all of these leave {rounded(record['next'][-1]['left_um'])} um of the band"
    larger = [row["what"] for row in record["unknown"] if row["size_um"] and row["size_um"][1] > record["p95_um"]]
    return words + (f"; larger than the band, so first: {', '.join(larger)}" if larger else "")


def band_sentence(largest_um: float, record: dict[str, Any], of: str = "of arithmetic") -> str:
    """What is proven, what the file leaves open, and what it does not know, after one another."""
    unknown = unknown_words(record)
    return f"{rounded(largest_um)} um {of}, {known_words(record)}" + (f"; not known: {unknown}" if unknown else "")


def headline(summary: dict[str, Any]) -> str:
    """The largest error before and after, what the files leave open and do not know; and a line of what to measure."""
    before, band, following = summary["before"]["total"]["max_um"], summary["band"], next_words(summary["band"])
    to_measure = f"\nmeasure next: {following}" if following else ""
    if summary["after"] is None:
        return f"largest error: {band_sentence(before, band, 'uncorrected')}{to_measure}"
    after = band_sentence(summary["after"]["total"]["max_um"], band)
    return f"largest error {before:.1f} um before; after: {after}{to_measure}"


def guaranteed_record(draws: FlownDraws | None) -> dict[str, Any] | None:
    """Bounds with a probability, and what the draws came to."""
    if draws is None:
        return None
    promised, bounds = draws.guarantee, {}
    for b in draws.bounds:
        factor, _ = unit_of(b.key)
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
    expected = "" if row["expected_um"] is None else f"expected {rounded(row['expected_um'])}, "
    return f"{expected}{rounded(least) if least else '0'} to {rounded(largest)}"


def _size(row: dict[str, Any]) -> str:
    if row["size_um"] is None:
        return f" ({NOT_LOOKED_AT})" if row["from"] == NOT_LOOKED_AT else ""
    return f" ({size_words(row)} um{'' if row['expected_um'] is None else ', from ' + row['from']})"


def _um(value: float) -> float:
    return float(f"{value / UM:.6g}")
