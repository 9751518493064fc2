"""The curve, or the bars, behind an answer to a question about a path's warmth."""

from typing import Any

import numpy as np

from compgen.core.units import UM
from compgen.pipelines.study import Answer
from compgen.report.curves import curves_in_words, rounded_number
from compgen.report.figure import (
    COOL,
    GREY,
    WARM,
    Figure,
    Trace,
    axis,
    figure,
    horizontal_line,
    limit_label,
    spans,
    trace,
)
from compgen.report.key_words import title_of, words_of

TITLES = {
    "warmup": "Drift within one program after a warm-up",
    "validity": "What a late start, or another ambient, adds to one corrected file",
    "contributions": "Where the error comes from",
    "steady": "The way to the steady state",
    "passes": "Orders and feeds of the passes",
}
HEIGHT = 320
BEYOND = 6  # times the limit: as far as curves are shown that are about where they cross it
MOST_PASSES = 24  # in the table under their figure; the CSV file has all
_LOOKS = ((WARM, "solid"), (COOL, "dash"))  # of the curves of one plot


def answer_figure(answer: Answer) -> Figure:
    """The curve, or the bars, behind an answer, with the limit that it is about."""
    if answer.key == "contributions":
        return _contributions(answer)
    return _passes(answer) if answer.key == "passes" else _curves(answer)


def _curves(answer: Answer) -> Figure:
    """Columns over the first; of two abscissas, in plots side by side."""
    side_by_side = answer.key == "validity"
    pairs = [(0, 1), (2, 3)] if side_by_side else [(0, k) for k in range(1, len(answer.columns))]
    traces: list[Trace] = []
    axes: dict[str, Any] = {}
    for n, (x, y) in enumerate(pairs):
        known = ~np.isnan(answer.table[:, x])
        which = "2" if side_by_side and n else ""
        colour, dash = _LOOKS[n]
        xy = (np.round(answer.table[known, k], 4) for k in (x, y))
        look = {"name": words_of(answer.columns[y]), "line": {"color": colour, "width": 1.8, "dash": dash}}
        traces.append(trace("scatter", *xy, xaxis=f"x{which}", yaxis=f"y{which}", **look))
        span = spans(2, 0.08)[n] if side_by_side else [0.0, 1.0]
        axes[f"xaxis{which}"] = axis(title_of(answer.columns[x]), anchor=f"y{which}", domain=span)
    title = f"{words_of(answer.columns[1])} [µm]" if len(answer.columns) == 2 else "error [µm]"
    axes["yaxis"] = axis(title, rangemode="tozero", anchor="x", domain=[0.0, 1.0])
    if side_by_side:
        axes["yaxis2"] = {"anchor": "x2", "domain": [0.0, 1.0], "matches": "y", "showticklabels": False}
    alt = curves_in_words(TITLES[answer.key], traces, "µm")
    lines = _limit(answer, ("", "2") if side_by_side else ("",))
    if side_by_side and answer.limit is not None:
        for part, shown in _around_the_limit(answer, pairs, answer.limit / UM).items():
            axes[part] |= shown
    return figure(traces, HEIGHT, alt, showlegend=len(traces) > 1, **lines, **axes)


def _around_the_limit(answer: Answer, pairs: list[tuple[int, int]], limit: float) -> dict[str, dict[str, Any]]:
    """The parts of two plots with one height in which their curves cross a limit [um], where they go far beyond it."""
    top = BEYOND * limit
    if np.nanmax(answer.table[:, [y for _, y in pairs]]) <= top:
        return {}
    ranges: dict[str, dict[str, Any]] = {"yaxis": {"range": [0, top]}, "yaxis2": {"range": [0, top]}}
    for which, (x, y) in zip(("", "2"), pairs, strict=False):
        at, size = answer.table[:, x], answer.table[:, y]
        beyond = np.abs(at[size > top])
        if len(beyond):
            reach = float(beyond.min())
            ranges[f"xaxis{which}"] = {"range": [-reach if np.nanmin(at) < 0 else 0, reach]}
    return ranges


def _contributions(answer: Answer) -> Figure:
    looks = {1: {"color": WARM, "pattern": {"shape": ""}}, 2: {"color": GREY, "pattern": {"shape": "/"}}}
    labels, columns = list(answer.labels), answer.columns
    traces = [
        trace("bar", labels, np.round(answer.table[:, k], 3), name=words_of(columns[k]), marker=look)
        for k, look in looks.items()
    ]
    alt = curves_in_words(TITLES[answer.key], traces, "µm")
    return figure(traces, HEIGHT, alt, yaxis=axis("error [µm]"), xaxis={"automargin": True})


def _passes(answer: Answer) -> Figure:
    """A point for each order and feed, how long it takes and how large its error gets, by whether it is within."""
    minutes, error = answer.table[:, 1], answer.table[:, 2]
    within = np.ones(len(error), bool) if answer.limit is None else error <= answer.limit / UM
    text = np.array(
        [f"{order}, {feed:g} mm/s" for order, feed in zip(answer.labels, answer.table[:, 0], strict=True)],
        dtype=object,
    )
    traces = [
        trace(
            "scatter",
            np.round(minutes[rows], 4),
            np.round(error[rows], 4),
            mode="markers",
            name=name,
            text=text[rows].tolist(),
            marker={"color": colour, "symbol": symbol, "size": 9},
            hovertemplate="%{text}<br>%{x:.1f} min, %{y:.2f} µm<extra></extra>",
        )
        for name, rows, colour, symbol in (
            ("within the limit", within, COOL, "circle"),
            ("beyond it", ~within, WARM, "x"),
        )
        if rows.any()
    ]
    best = int(np.argmin(np.where(within, minutes, np.inf))) if within.any() else int(np.argmin(error))
    alt = (
        f"{TITLES[answer.key]}: {np.count_nonzero(within)} of {len(error)} stay within the limit; "
        f"{'the quickest of them' if within.any() else 'the least error'}, {text[best]}, takes "
        f"{rounded_number(float(minutes[best]))} min and errs by {rounded_number(float(error[best]))} µm."
    )
    axes = {"xaxis": axis("duration of all passes [min]"), "yaxis": axis("largest error [µm]", rangemode="tozero")}
    return figure(traces, HEIGHT, alt, showlegend=len(traces) > 1, **_limit(answer, ("",)), **axes)


def passes_rows(answer: Answer) -> tuple[list[list[str]], int]:
    """Orders and feeds of the passes, those within the limit first and among them the quickest; how many more."""
    limit = np.inf if answer.limit is None else answer.limit / UM
    order = np.lexsort((answer.table[:, 1], np.maximum(answer.table[:, 2], limit)))
    rows = [
        [answer.labels[k].replace(" > ", ", "), f"{feed:g}", f"{minutes:.1f}", f"{error:.1f}"]
        for k, (feed, minutes, error) in ((k, answer.table[k]) for k in order[:MOST_PASSES].tolist())
    ]
    return rows, len(order) - MOST_PASSES


def _limit(answer: Answer, plots: tuple[str, ...]) -> dict[str, Any]:
    """The limit of the question as a dashed line across each plot."""
    if answer.limit is None:
        return {}
    size = answer.limit / UM
    label = limit_label(f"limit {size:g} µm", size, plots[-1])
    return {"shapes": [horizontal_line(size, which) for which in plots], "annotations": [label]}
