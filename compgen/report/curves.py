"""Curves over one abscissa in rows below each other, each row on a scale and with a legend of its own, and in words."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.report.figure import (
    DASHED,
    DASHES,
    HALO,
    LINES,
    Figure,
    Trace,
    axis,
    figure,
    horizontal_line,
    rows_to_draw,
    trace,
    unpacked,
)

ROW, GAP = 165, 62  # [px]
TOP, BOTTOM = 36, 50
LEVEL, CLEAR_TREND = 0.1, 0.8  # of the largest value; of the rank correlation


@dataclass(frozen=True, eq=False, slots=True)
class CurveRow:
    """Curves that share an axis, and a bound across them."""

    title: str  # of the axis
    traces: Sequence[Trace]
    words: str  # of its curves
    bound: float | None = None
    options: dict[str, Any] = field(default_factory=lambda: {"rangemode": "tozero"})  # of the axis


def size_row(name: str, x: Array, size: Array, bound: float | None = None, **look: Any) -> CurveRow:
    """A row of one curve of sizes, (K,) [um] over x (K,), with the bound [um] that they are judged by."""
    return CurveRow(
        f"{name} [µm]", [trace("scatter", x, size, **{"name": name, **look})], course(name, size, "µm"), bound
    )


def figure_in_rows(rows: Sequence[CurveRow], x_title: str, subject: str) -> Figure:
    """Rows that are zoomed together along x."""
    count = len(rows)
    height = count * ROW + (count - 1) * GAP
    layout: dict[str, Any] = {"annotations": [], "shapes": []}
    traces: list[Trace] = []
    words = []
    for k, row in enumerate(rows):
        which = str(k + 1) if k else ""
        top = 1 - k * (ROW + GAP) / height
        layout[f"legend{which}"] = {"orientation": "h", "x": 0, "y": round(top, 5), "yanchor": "bottom"}
        domain = [round(max(top - ROW / height, 0.0), 5), round(top, 5)]
        layout[f"yaxis{which}"] = axis(row.title, anchor=f"x{which}", domain=domain, **row.options)
        layout[f"xaxis{which}"] = {"anchor": f"y{which}", "domain": [0.0, 1.0], "matches": "x", "showticklabels": False}
        place = {"xaxis": f"x{which}", "yaxis": f"y{which}", "legend": f"legend{which}"}
        traces += [{**one, **place} for one in row.traces]
        words.append(row.words)
        if row.bound is not None:
            words.append(f"bound {row.bound:g} µm")
            layout["shapes"].append(horizontal_line(row.bound, which))
            at = {"x": 1, "xref": "paper", "xanchor": "right", "y": row.bound, "yref": f"y{which}", "yanchor": "bottom"}
            font = {"color": DASHED["color"], "shadow": HALO}
            layout["annotations"].append({"text": words[-1], **at, "showarrow": False, "font": font})
    last = f"xaxis{count if count > 1 else ''}"
    layout[last].update(axis(x_title), showticklabels=True)
    del layout["xaxis"]["matches"]
    margin = {"l": 64, "r": 16, "t": TOP, "b": BOTTOM}
    drawn = {key: value for key, value in layout.items() if value != []}
    return figure(traces, height + TOP + BOTTOM, sentence(subject, words), margin=margin, **drawn)


def rise_figure(names: Sequence[str], time: Array, rise: Array, time_title: str) -> Figure:
    """Temperature rise of each node over time, rise (N, K) [K] at time (N,) [s]."""
    rows = rows_to_draw(np.arange(len(time), dtype=float))
    shown = np.round(time[rows], 3)
    traces = [
        trace("scatter", shown, np.round(rise[rows, i], 4), name=name, line={**line_style(i), "width": 1.6})
        for i, name in enumerate(names)
    ]
    alt = curves_in_words("Temperature rise of each part of the robot", traces, "K")
    return figure(traces, 320, alt, yaxis=axis("rise [K]", rangemode="tozero"), xaxis=axis(time_title))


def line_style(number: int) -> dict[str, Any]:
    """The colour and the dash of one of many lines."""
    return {"color": LINES[number % len(LINES)], "dash": DASHES[number % len(DASHES)]}


def rounded_number(value: float) -> str:
    """Three figures, no exponent; all of them before the point, and 0.00 of what is smaller than that."""
    if not np.isfinite(value):
        return "unknown"
    size = abs(float(f"{value:.3g}"))
    digits = 2 if size < 1 else max(0, 2 - int(np.floor(np.log10(size))))
    return f"{value:z,.{digits}f}"


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
