"""Figures of a study: the error over the values of a key, and over two keys as a map."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.unique_rows import grouped
from compgen.pipelines.study import Study, StudyRow
from compgen.report.curves import curves_in_words, rounded_number
from compgen.report.figure import (
    COOL,
    LIMIT,
    LINES,
    WARM,
    Figure,
    Limit,
    Trace,
    axis,
    colour_at,
    figure,
    horizontal_line,
    limit_label,
    scale,
    spans,
    trace,
)
from compgen.report.key_words import title_of, words_of
from compgen.report.study_tables import Grid, Value, grid_of, plain, value_words

MOST_LINES = 6  # values of a second key with a line and a name each; of more a colour bar tells them
MOST_DRAWN = 30  # lines
MARKED = 60  # points of a line, up to which each has a marker
MARK = "mark"  # of traces that are no curve
LABELLED = 120  # cells of a map, up to which each has its number
LOOKS = {"before": ("dash", "circle"), "after": ("solid", "diamond")}  # dash and marker of a side
SYMBOLS = ("circle", "square", "diamond", "triangle-up", "triangle-down", "star")  # of LINES, for who sees no colours
MAP_COLOURS = ("#f8fafc", "#fde68a", "#fdba74", "#fb923c", "#f87171")  # dark figures can be read on all of them
ON_MAP = "#111827"
PHONE_COLUMNS = 7  # of a map, up to which numbers in its cells can be read on a phone
MANY_COLOURS = ("#2f54dc", "#8b46e0", "#e0508c", "#f59e0b")  # seen on a light and a dark page, and as greys on paper


def error_against(study: Study, rows: list[StudyRow], key: str) -> Figure:
    """The largest error over the values of one key, a line for each value of another; before above, after below it."""
    return curves(grid_of(study.keys, rows), key)[0]


def curves(whole: Grid, key: str, limit: Limit | None = None) -> tuple[Figure, str]:
    """The largest error over a key, and the words of what is held where more than two keys were varied."""
    other = next((k for k in whole.varied if k != key), None) if whole.done else None
    grid, held = whole.held_at_worst([key, *([other] if other else [])]) if whole.done else (whole, "")
    colours, few = _colours(whole, other)
    groups = _rows_by(grid, other)
    traces: list[Trace] = []
    axes: dict[str, Any] = {}
    sides = whole.sides or ("before",)
    has_symbols = other is not None and len(colours) <= MOST_LINES
    for n, (side, span) in enumerate(zip(sides, reversed(spans(len(sides), 0.12)), strict=True)):
        which = "" if n == 0 else str(n + 1)
        look = {"xaxis": f"x{which}", "yaxis": f"y{which}", "showlegend": other is None or (n == 0 and has_symbols)}
        for k, (value, colour) in enumerate(colours.items()):
            name = side if other is None else plain(value)
            symbol = SYMBOLS[k] if has_symbols else LOOKS[side][1]
            ink = {"color": colour or (WARM, COOL)[side == "after"], "symbol": symbol}
            traces += _line(grid, key, groups.get(value, []), side=side, name=name, ink=ink, look=look)
        axes[f"yaxis{which}"] = axis(f"{side} [µm]", anchor=f"x{which}", domain=span, rangemode="tozero")
        shown = axis(title_of(key)) if n == len(sides) - 1 else {"matches": f"x{len(sides)}", "showticklabels": False}
        axes[f"xaxis{which}"] = {"anchor": f"y{which}", **_kind(whole, key), **shown}
    last = "" if len(sides) == 1 else str(len(sides))
    traces += _marks(grid, key, sides[-1], {"xaxis": f"x{last}", "yaxis": f"y{last}"})
    if other is not None and not has_symbols:
        traces.append(_colour_bar(whole, other))
    legend = {"title": {"text": title_of(other)}} if other is not None and has_symbols else {}
    top = 60 if any(one.get("showlegend", True) for one in traces) else 20
    drawn_curves = [t for t in traces if t.get("meta") != MARK]
    drawn = figure(
        traces,
        110 + 220 * len(sides),
        curves_in_words(f"Largest error against {words_of(key)}", drawn_curves, "µm"),
        {"legend": {"title": {"side": "top"}}},
        shapes=[] if limit is None else [horizontal_line(limit.um, last)],
        annotations=[] if limit is None else [limit_label(limit.label, limit.um, last)],
        legend={"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 0, **legend},
        margin={"l": 60, "r": 20, "t": top, "b": 45},
        **axes,
    )
    return drawn, f"{few}{held}".strip()


def _rows_by(grid: Grid, other: str | None) -> dict[Value, list[StudyRow]]:
    """The rows of each value of a key; all together where there is none."""
    return grouped(("" if other is None else grid.value(row, other), row) for row in grid.done)


def error_map(whole: Grid, x: str, y: str, side: str, limit: Limit | None = None) -> tuple[Figure, str]:
    """The largest error of a side over two keys, a cell for each pair of values; failed scenarios are crossed out."""
    grid, held = whole.held_at_worst([x, y])
    columns, lines = grid.values(x), grid.values(y)
    cells = np.full((len(lines), len(columns)), np.nan)
    for row in grid.done:
        if (error := row.get(f"{side}_on_part_max_um")) is not None:
            cells[lines.index(grid.value(row, y)), columns.index(grid.value(row, x))] = error
    unread = {"meta": {"phone": [{"texttemplate": ""}]}} if len(columns) > PHONE_COLUMNS else {}
    hover = f"{words_of(x)} %{{x}}<br>{words_of(y)} %{{y}}<br>%{{z:.2f}} µm<extra></extra>"
    at_x, at_y = ([plain(grid.value(row, key)) for row in grid.failed] for key in (x, y))
    traces = [
        _heat_map([plain(v) for v in columns], [plain(v) for v in lines], cells, hover, limit),
        *([_crosses(at_x, at_y, [row["reason"] for row in grid.failed])] if grid.failed else []),
    ]
    over = 0 if limit is None else int(np.count_nonzero(cells > limit.um))
    beyond = f", {over} of them over {limit.label}" if limit is not None else ""
    low, high = (np.unravel_index(int(f(cells)), cells.shape) for f in (np.nanargmin, np.nanargmax))
    at = [
        f"{words_of(x)} {value_words(x, columns[c])} and {words_of(y)} {value_words(y, lines[r])}"
        for r, c in (low, high)
    ]
    alt = (
        f"Largest error {side} of {np.count_nonzero(np.isfinite(cells))} scenarios{beyond}: from "
        f"{rounded_number(float(cells[low]))} µm at {at[0]} to {rounded_number(float(cells[high]))} µm at {at[1]}."
    )
    category: dict[str, Any] = {"type": "category", "showgrid": False}
    drawn = figure(
        traces,
        int(min(150 + 44 * len(lines), 620)),
        alt,
        xaxis=axis(title_of(x), **category),
        yaxis=axis(title_of(y), **category, automargin=True),
        showlegend=bool(grid.failed),
        narrow={"xaxis": {"tickangle": -45}},
        **unread,
    )
    note = "" if limit is None else f"▲ over {limit.label}. "
    return drawn, f"{note if over else ''}{held}".strip()


def _heat_map(columns: list[str], lines: list[str], cells: Array, hover: str, limit: Limit | None) -> Trace:
    """Cells (L, C) [um] by their colours, and by their numbers where these can be read."""
    labelled = {"texttemplate": "%{text}", "textfont": {"color": ON_MAP}} if cells.size <= LABELLED else {}
    return trace(
        "heatmap",
        columns,
        lines,
        [[None if v != v else v for v in line] for line in cells.tolist()],
        text=[[_cell(error, limit) for error in line] for line in cells.tolist()],
        colorscale=scale(MAP_COLOURS),
        colorbar={"title": {"text": "µm"}, "thickness": 12, "outlinewidth": 0},
        xgap=1,
        ygap=1,
        hovertemplate=hover,
        name="",
        **labelled,
    )


def _cell(error: float, limit: Limit | None) -> str:
    if error != error:
        return ""
    return f"{rounded_number(error)}{' ▲' if limit is not None and error > limit.um else ''}"


def _colours(grid: Grid, other: str | None) -> tuple[dict[Value, str], str]:
    """The values of a second key with a colour each, and words where only some are drawn.

    Without such a key one line, in the colour of its side.
    """
    if other is None:
        return {"": ""}, ""
    values = grid.values(other)
    if len(values) <= MOST_LINES:
        return dict(zip(values, LINES, strict=False)), ""
    count = len(values)
    rows = np.unique(np.linspace(0, count - 1, min(count, MOST_DRAWN)).round().astype(int)).tolist()
    few = "" if len(rows) == count else f"Lines for {len(rows)} of {count} values of {words_of(other)}. "
    return {values[n]: colour_at(MANY_COLOURS, n / (count - 1)) for n in rows}, few


def _line(
    grid: Grid, key: str, rows: Sequence[StudyRow], *, side: str, name: str, ink: dict[str, str], look: dict[str, Any]
) -> list[Trace]:
    """A line of one side through scenarios that differ in one key."""
    column, (dash, _) = f"{side}_on_part_max_um", LOOKS[side]
    points = [(grid.value(row, key), row[column]) for row in rows if column in row]
    if not points:
        return []
    order = {value: n for n, value in enumerate(grid.values(key))} if key not in grid.numeric else {}
    points.sort(key=lambda point: order.get(point[0], point[0]))
    x, y = ([point[k] for point in points] for k in range(2))
    line, marker = {"color": ink["color"], "dash": dash, "width": 1.6}, {"symbol": ink["symbol"], "size": 7}
    mode = "lines+markers" if len(points) <= MARKED else "lines"
    return [trace("scatter", x, y, mode=mode, name=name, legendgroup=name, line=line, marker=marker, **look)]


def _marks(grid: Grid, key: str, side: str, place: dict[str, str]) -> Iterator[Trace]:
    """Scenarios that failed, on the axis, and those outside their bounds, ringed."""
    outside = [row for row in grid.done if not row.get("inside", True) and f"{side}_on_part_max_um" in row]
    if outside:
        ring = {"symbol": "circle-open", "size": 14, "color": LIMIT, "line": {"width": 2}}
        xy = [_label(grid, row, key) for row in outside], [row[f"{side}_on_part_max_um"] for row in outside]
        text = [row.get("reason", "") for row in outside]
        yield trace("scatter", *xy, mode="markers", marker=ring, name="outside bounds", text=text, meta=MARK, **place)
    if grid.failed:
        x = [_label(grid, row, key) for row in grid.failed]
        reasons = [str(row["reason"]) for row in grid.failed]
        yield {**_crosses(x, [0] * len(x), reasons), **place}


def _crosses(x: list[Any], y: list[Any], reasons: list[str]) -> Trace:
    cross = {"symbol": "x", "size": 10, "color": LIMIT}
    look = {
        "mode": "markers",
        "marker": cross,
        "name": "failed",
        "cliponaxis": False,
        "hovertemplate": "failed: %{text}<extra></extra>",
    }
    return trace("scatter", x, y, text=reasons, meta=MARK, **look)


def _label(grid: Grid, row: StudyRow, key: str) -> Value:
    value = grid.value(row, key)
    return value if key in grid.numeric else plain(value)


def _kind(grid: Grid, key: str) -> dict[str, Any]:
    """An axis of numbers, or of words in their order."""
    if key in grid.numeric:
        return {}
    return {"type": "category", "categoryorder": "array", "categoryarray": [plain(v) for v in grid.values(key)]}


def _colour_bar(grid: Grid, other: str) -> Trace:
    """What tells the lines of many values apart: a bar with the key's name, without points."""
    values = grid.values(other)
    count = len(values)
    ticks = sorted({0, count // 2, count - 1})
    bar = {
        "title": {"text": title_of(other), "side": "right"},
        "thickness": 12,
        "outlinewidth": 0,
        "tickvals": ticks,
        "ticktext": [plain(values[n]) for n in ticks],
    }
    marker = {
        "color": [0],
        "cmin": 0,
        "cmax": count - 1,
        "colorscale": scale(MANY_COLOURS),
        "colorbar": bar,
        "showscale": True,
    }
    return trace("scatter", [None], [None], mode="markers", marker=marker, showlegend=False, meta=MARK)
