"""Figures as plotly.js reads them, in plain types: traces, axes, colours, and the curves that several pages show."""

import json
from base64 import b64encode
from collections.abc import Sequence
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np
from plotly.offline import get_plotlyjs

from compgen.core.arrays import Array, IntArray

Trace = dict[str, Any]
Figure = dict[str, Any]  # data: traces, layout

POINTS = 4000  # of a curve: what a screen can show
WARM, COOL, GREY = "#c2410c", "#0f766e", "#64748b"
LINES = ("#c2410c", "#ca8a04", "#7c3aed", "#0f766e", "#1d4ed8", "#64748b")
DASHED = {"color": "#b91c1c", "dash": "dash", "width": 1}  # a limit
_TURBO = (
    "#30123b", "#4145ab", "#4675ed", "#39a2fc", "#1bcfd4", "#24eca6", "#61fc6c", "#a4fc3b", "#d1e834", "#f3c63a",
    "#fe9b2d", "#f36315", "#d93806", "#b11901", "#7a0402",
)  # fmt: skip
_RED_TO_BLUE = (
    "#67001f", "#b2182b", "#d6604d", "#f4a582", "#fddbc7", "#f7f7f7", "#d1e5f0", "#92c5de", "#4393c3", "#2166ac",
    "#053061",
)  # fmt: skip


def scale(colours: Sequence[str]) -> list[list[Any]]:
    """Colours at even steps from 0 to 1."""
    return [[i / (len(colours) - 1), colour] for i, colour in enumerate(colours)]


TURBO, RED_TO_BLUE = scale(_TURBO), scale(_RED_TO_BLUE)


def packed_array(values: Array) -> Any:
    """An array of any shape, packed as bytes, which plotly.js unpacks."""
    if not values.size:
        return []
    record = {"dtype": "f8", "bdata": b64encode(np.asarray(values, dtype="<f8").tobytes()).decode("ascii")}
    return record if values.ndim == 1 else {**record, "shape": ", ".join(map(str, values.shape))}


def trace(kind: str, *xyz: Any, **options: Any) -> Trace:
    """Points, bars or lines over x, y and perhaps z; names and numbers as lists, arrays as bytes."""
    columns = {k: packed_array(v) if isinstance(v, np.ndarray) else v for k, v in zip("xyz", xyz)}
    return {"type": kind, **columns, **options}


def axis(title: str, **options: Any) -> dict[str, Any]:
    """An axis with its title."""
    return {"title": {"text": title}, **options}


def horizontal_line(y: float, axis_number: str = "") -> dict[str, Any]:
    """A dashed line across a plot at a height; ``axis_number`` is the number of the plot's axes, from 2."""
    place = {"xref": f"x{axis_number} domain", "x0": 0, "x1": 1, "yref": f"y{axis_number}", "y0": y, "y1": y}
    return {"type": "line", "line": DASHED, **place}


def vertical_line(x: float, colour: str) -> dict[str, Any]:
    """A dashed line from bottom to top of a plot."""
    place = {"xref": "x", "x0": x, "x1": x, "yref": "y domain", "y0": 0, "y1": 1}
    return {"type": "line", "line": {**DASHED, "color": colour}, **place}


def spans(count: int, gap: float) -> list[list[float]]:
    """Equal shares of a page's width or height, with gaps between."""
    width = (1 - gap * (count - 1)) / count
    return [[i * (width + gap), i * (width + gap) + width] for i in range(count)]


def figure(traces: Sequence[Trace], height: int, **layout: Any) -> Figure:
    """Traces in the look that all figures share."""
    look = {
        "template": _template(),
        "height": height,
        "margin": {"l": 60, "r": 20, "t": 40, "b": 45},
        "legend": {"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 0},
        "font": {"family": "system-ui, sans-serif", "size": 12},
    }
    return {"data": list(traces), "layout": {**look, **layout}}


def rows_to_draw(values: Array) -> IntArray:
    """Rows of a curve to draw: from each of many bins the one with the largest value, and both ends."""
    count = len(values)
    if count <= POINTS:
        return np.arange(count)
    edges = np.linspace(0, count, POINTS + 1).astype(int)
    top = np.maximum.reduceat(values, edges[:-1])
    hits = np.flatnonzero(values == np.repeat(top, np.diff(edges)))
    first = hits[np.searchsorted(hits, edges[:-1]).clip(max=len(hits) - 1)]
    return np.unique(np.concatenate([[0], first, [count - 1]]))


def rise_figure(names: Sequence[str], time: Array, rise: Array, time_title: str) -> Figure:
    """Temperature rise of each node over time, rise (N, K) [K] at time (N,) [s]."""
    rows = rows_to_draw(np.arange(len(time), dtype=float))
    shown = np.round(time[rows], 3)
    traces = []
    for i, name in enumerate(names):
        line = {"color": LINES[i % len(LINES)], "width": 1.6}
        traces.append(trace("scatter", shown, np.round(rise[rows, i], 4), name=name, line=line))
    return figure(traces, 320, yaxis=axis("rise [K]", rangemode="tozero"), xaxis=axis(time_title))


def div(content: Figure, key: str) -> str:
    """A figure as an element of a page, ``key`` its id."""
    config = {"displaylogo": False, "modeBarButtonsToRemove": ["select2d", "lasso2d"], "responsive": True}
    parts = ",".join(_script(part) for part in (key, content["data"], content["layout"], config))
    return (
        f'<div id="{key}" class="plotly-graph-div" style="height:{content["layout"]["height"]}px; width:100%;"></div>'
        f"<script>Plotly.newPlot({parts})</script>"
    )


def library() -> bytes:
    """The script that draws: plotly.js."""
    return str(get_plotlyjs()).encode()


@lru_cache(maxsize=1)
def _template() -> Any:
    return json.loads((files("plotly") / "package_data" / "templates" / "plotly_white.json").read_bytes())


def _script(value: Any) -> str:
    """A value inside a script, escaped so that no text in it can end the script."""
    text = json.dumps(value, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("/", "\\u002f")
