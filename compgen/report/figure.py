"""Figures as plotly.js reads them, in plain types: a page needs its script and its template, none of its Python."""

import json
from base64 import b64encode
from collections.abc import Sequence
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from compgen.core.arrays import Array

Trace = dict[str, Any]
Figure = dict[str, Any]  # data: traces, layout

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
    """Colours evenly over what they stand for."""
    return [[i / (len(colours) - 1), colour] for i, colour in enumerate(colours)]


TURBO, RED_TO_BLUE = scale(_TURBO), scale(_RED_TO_BLUE)


def numbers(values: Array) -> Any:
    """An array of any shape, as bytes: an eighth of the work of printing it."""
    if not values.size:
        return []
    packed = {"dtype": "f8", "bdata": b64encode(np.asarray(values, dtype="<f8").tobytes()).decode("ascii")}
    return packed if values.ndim == 1 else {**packed, "shape": ", ".join(map(str, values.shape))}


def trace(kind: str, *xyz: Any, **more: Any) -> Trace:
    """Points, bars or lines over x, y and perhaps z; names and numbers as lists, arrays as bytes."""
    columns = {k: numbers(v) if isinstance(v, np.ndarray) else v for k, v in zip("xyz", xyz)}
    return {"type": kind, **columns, **more}


def axis(title: str, **more: Any) -> dict[str, Any]:
    """An axis with its title."""
    return {"title": {"text": title}, **more}


def level(y: float, which: str = "") -> dict[str, Any]:
    """A dashed line across a plot at a height; ``which`` counts the plot's axes from 2."""
    place = {"xref": f"x{which} domain", "x0": 0, "x1": 1, "yref": f"y{which}", "y0": y, "y1": y}
    return {"type": "line", "line": DASHED, **place}


def upright(x: float, colour: str) -> dict[str, Any]:
    """A dashed line from bottom to top."""
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


def div(drawn: Figure, key: str) -> str:
    """A figure as a part of a page."""
    config = {"displaylogo": False, "modeBarButtonsToRemove": ["select2d", "lasso2d"], "responsive": True}
    parts = ",".join(_script(part) for part in (key, drawn["data"], drawn["layout"], config))
    return (
        f'<div id="{key}" class="plotly-graph-div" style="height:{drawn["layout"]["height"]}px; width:100%;"></div>'
        f"<script>Plotly.newPlot({parts})</script>"
    )


def library() -> bytes:
    """The script that draws."""
    return (_package() / "plotly.min.js").read_bytes()


@lru_cache(maxsize=1)
def _template() -> Any:
    return json.loads((_package() / "templates" / "plotly_white.json").read_bytes())


def _package() -> Path:
    """Where plotly keeps its data; looked up without importing it, which takes as long as a short job's correction."""
    found = find_spec("plotly")
    if found is None or not found.submodule_search_locations:
        raise ModuleNotFoundError("plotly is not installed")
    return Path(found.submodule_search_locations[0]) / "package_data"


def _script(value: Any) -> str:
    """A value inside a script: no text of a user's can end it."""
    text = json.dumps(value, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("/", "\\u002f")
