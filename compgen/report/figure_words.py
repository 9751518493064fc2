"""Figures in words: a sentence made from the numbers that a figure shows, for who does not see it."""

from collections.abc import Iterable

import numpy as np

from compgen.core.arrays import Array
from compgen.report.figure import Trace, unpacked

LEVEL, CLEAR_TREND = 0.1, 0.8  # of the largest value; of the rank correlation


def rounded_number(value: float) -> str:
    """Three figures, no exponent; all of them before the point, and 0.00 of what is smaller than that."""
    if not np.isfinite(value):
        return "unknown"
    size = abs(float(f"{value:.3g}"))
    digits = 2 if size < 1 else max(0, 2 - int(np.floor(np.log10(size))))
    return f"{value:,.{digits}f}"


def between(values: Array, unit: str) -> str:
    """The range of values, those unknown left out."""
    known = values[np.isfinite(values)]
    if not known.size:
        return "unknown"
    low, high = rounded_number(float(known.min())), rounded_number(float(known.max()))
    return f"{high} {unit}".strip() if low == high else f"between {low} and {high} {unit}".strip()


def trend(values: Array) -> str:
    """Whether values, in the order in which they are drawn, rise, fall, or keep their level; else nothing."""
    known = values[np.isfinite(values)]
    if len(known) < 3:
        return ""
    if np.ptp(known) <= LEVEL * np.abs(known).max():
        return "level"
    ranks = np.argsort(np.argsort(known, kind="stable"), kind="stable")
    correlation = float(np.corrcoef(ranks, np.arange(len(known)))[0, 1])
    return "" if abs(correlation) < CLEAR_TREND else "rising" if correlation > 0 else "falling"


def course(name: str, values: Array, unit: str) -> str:
    """A curve in words: its range, and whether it rises or falls."""
    return ", ".join(part for part in (f"{name} {between(values, unit)}", trend(values)) if part)


def sentence(subject: str, parts: Iterable[str]) -> str:
    """What a figure shows, and each of its curves."""
    return f"{subject}: {'; '.join(part for part in parts if part) or 'nothing'}."


def curves_in_words(subject: str, traces: Iterable[Trace], unit: str) -> str:
    """What a figure of curves or bars over x shows: of each its name, its range, and whether it rises."""
    parts = (course(str(one.get("name", "")), unpacked(one["y"]), unit).strip() for one in traces if "y" in one)
    return sentence(subject, parts)
