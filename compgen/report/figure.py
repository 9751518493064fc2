"""Figures as plotly.js reads them, in plain types: traces, axes, colours, and their place on a page.

A figure is ``data`` (traces), ``layout`` and ``alt``, a sentence made from its numbers for who does not see it; one
in space has ``still`` too, the same as a picture that needs no script. ``layout.meta.narrow`` is for a phone.
"""

import json
import re
from base64 import b64decode, b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from html import unescape
from importlib.resources import files
from typing import Any

import numpy as np
from markupsafe import Markup, escape
from plotly.offline import get_plotlyjs, get_plotlyjs_version

from compgen.core.arrays import Array, IntArray

Trace = dict[str, Any]
Figure = dict[str, Any]  # data: traces, layout, alt: a sentence; perhaps still: an SVG for each scene

POINTS = 4000  # of a curve: what a screen can show
WARM, COOL, GREY = "#c2410c", "#0f766e", "#64748b"
LINES = ("#c2410c", "#ca8a04", "#7c3aed", "#0f766e", "#1d4ed8", "#64748b")
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")  # of LINES, where colours cannot be told
GRID = "#e2e8f0"
CLEAR = "rgba(0,0,0,0)"
VARIABLES = {  # of a page's style, by the colour they have on a light page
    WARM: "--before",
    COOL: "--after",
    GREY: "--neutral",
    "#b91c1c": "--limit",
    "#ca8a04": "--amber",
    "#7c3aed": "--violet",
    "#1d4ed8": "--blue",
    GRID: "--grid",
    "#ebf0f8": "--grid",
    "#dfe8f3": "--grid",
    "#c8d4e3": "--grid",
    "#2a3f5f": "--text",
    "#506784": "--grid",
    "#94a3b8": "--neutral",
    "#cbd5e1": "--line",
}
#: a figure as ``div`` writes it
_FIGURE = re.compile(
    r'<figure class="chart" role="img" aria-label="(?P<alt>[^"]*)">'
    r'<div id="(?P<key>[^"]+)" class="plotly-graph-div"></div>'
    r'(?:<div class="still">(?P<still>.*?)</div>)?<noscript>.*?<script>cgenFigures\.draw\("[^"]*",',
    re.DOTALL,
)
LIMIT = "#b91c1c"
DASHED = {"color": LIMIT, "dash": "dash", "width": 1}  # a limit
HALO = ", ".join(["0 0 4px var(--ground)"] * 8)  # around words that may stand amid curves
# viridis without its ends, which a dark and a white page swallow; light is little: even greys on paper
LIGHT_TO_DARK = ("#b5de2b", "#6ece58", "#35b779", "#1f9e89", "#26828e", "#31688e")
_RED_TO_BLUE = (
    "#67001f",
    "#b2182b",
    "#d6604d",
    "#f4a582",
    "#fddbc7",
    "#f7f7f7",
    "#d1e5f0",
    "#92c5de",
    "#4393c3",
    "#2166ac",
    "#053061",
)


@dataclass(frozen=True, slots=True)
class Limit:
    """A size that an error is judged by."""

    label: str  # what says so, with the size and its unit
    um: float
    is_asked: bool = False  # on the command line, for whatever is computed; else a bound of what is corrected


def scale(colours: Sequence[str]) -> list[list[Any]]:
    """Colours at even steps from 0 to 1."""
    return [[i / (len(colours) - 1), colour] for i, colour in enumerate(colours)]


def colour_at(colours: Sequence[str], share: float) -> str:
    """The colour at a share of such a scale."""
    place = share * (len(colours) - 1)
    low = min(int(place), len(colours) - 2)
    ends = [[int(colours[k][i : i + 2], 16) for i in (1, 3, 5)] for k in (low, low + 1)]
    mixed = (round(a + (b - a) * (place - low)) for a, b in zip(*ends, strict=True))
    return "#" + "".join(f"{channel:02x}" for channel in mixed)


RED_TO_BLUE = scale(_RED_TO_BLUE)


def packed_array(values: Array | IntArray) -> Any:
    """An array of any shape, packed as bytes, which plotly.js unpacks."""
    if not values.size:
        return []
    record = {"dtype": "f8", "bdata": b64encode(np.asarray(values, dtype="<f8").tobytes()).decode("ascii")}
    return record if values.ndim == 1 else {**record, "shape": ", ".join(map(str, values.shape))}


def unpacked(values: Any) -> Array:
    """The numbers of a column of a trace, NaN for what is none."""
    if isinstance(values, dict):
        return np.frombuffer(b64decode(values["bdata"]), dtype="<f8")
    return np.array([v if isinstance(v, int | float) else np.nan for v in values], dtype=float)


def trace(kind: str, *xyz: Any, **options: Any) -> Trace:
    """Points, bars or lines over x, y and perhaps z; names and numbers as lists, arrays as bytes."""
    columns = {k: packed_array(v) if isinstance(v, np.ndarray) else v for k, v in zip("xyz", xyz, strict=False)}
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


def limit_label(text: str, y: float, axis_number: str) -> dict[str, Any]:
    """The words of a limit, at the right end of its line; ``axis_number`` is the number of the plot's axes, from 2."""
    place = {"xref": f"x{axis_number} domain", "x": 1, "yref": f"y{axis_number}", "y": y}
    font = {"color": LIMIT, "size": 11, "shadow": HALO}
    return {"text": text, **place, "showarrow": False, "xanchor": "right", "yanchor": "bottom", "font": font}


def spans(count: int, gap: float) -> list[list[float]]:
    """Equal shares of a page's width or height, with gaps between."""
    width = (1 - gap * (count - 1)) / count
    return [[i * (width + gap), i * (width + gap) + width] for i in range(count)]


def figure(
    traces: Sequence[Trace], height: int, alt: str, narrow: dict[str, Any] | None = None, **layout: Any
) -> Figure:
    """Traces in the look that all figures share.

    Args:
        traces: What is drawn.
        height: Of the figure [px].
        alt: A sentence made from the numbers, for who does not see the figure.
        narrow: What changes of the layout on a phone, merged into it.
        layout: More of plotly's layout.
    """
    look = {
        "template": _template(),
        "height": height,
        "margin": {"l": 60, "r": 20, "t": 40, "b": 45},
        "legend": {"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 0},
        "font": {"family": "system-ui, sans-serif", "size": 12},
        "paper_bgcolor": CLEAR,
        "plot_bgcolor": CLEAR,
    }
    meta = {**layout.pop("meta", {}), "narrow": {"margin": {"l": 52, "r": 8}, **(narrow or {})}}
    return {"data": list(traces), "layout": {**look, **layout, "meta": meta}, "alt": alt}


def rows_to_draw(values: Array) -> IntArray:
    """Rows of a curve to draw: from each of many bins those with the largest and the smallest value, and both ends."""
    count = len(values)
    if count <= POINTS:
        return np.arange(count)
    edges = np.linspace(0, count, POINTS // 2 + 1).astype(int)
    rows = [np.array([0, count - 1])]
    for extreme in (np.maximum, np.minimum):
        hits = np.flatnonzero(values == np.repeat(extreme.reduceat(values, edges[:-1]), np.diff(edges)))
        rows.append(hits[np.searchsorted(hits, edges[:-1]).clip(max=len(hits) - 1)])
    return np.unique(np.concatenate(rows))


def div(content: Figure, key: str) -> Markup:
    """A figure as an element of a page, ``key`` its id; without a script its words and its still picture."""
    parts = ",".join(_script(part) for part in (key, content["data"], content["layout"]))
    note = f"<p>{escape(content['note'])}</p>" if content.get("note") else ""
    still = f'<div class="still">{"".join(content["still"])}{note}</div>' if "still" in content else ""
    words = escape(content["alt"])
    return Markup(
        f'<figure class="chart" role="img" aria-label="{words}"><div id="{key}" class="plotly-graph-div"></div>{still}'
        f"<noscript><p>{words}</p></noscript></figure><script>cgenFigures.draw({parts})</script>"
    )


def figures_of_page(page: bytes) -> dict[str, Figure]:
    """Figures by their keys, in the order in which they stand."""
    text, decoder = page.decode(), json.JSONDecoder()
    figures: dict[str, Figure] = {}
    for match in _FIGURE.finditer(text):
        data, at = decoder.raw_decode(text, match.end())
        layout, _ = decoder.raw_decode(text, at + 1)
        figures[match["key"]] = {"data": data, "layout": layout, "alt": unescape(match["alt"])}
        if match["still"]:
            figures[match["key"]]["still"] = re.findall(r"<svg .*?</svg>", match["still"], re.DOTALL)
    return figures


def library() -> bytes:
    """``library_text`` as its file has it."""
    return library_text().encode()


def library_text() -> str:
    """The script that draws: plotly.js, and what adapts figures to a dark, narrow or printed page."""
    colours = f"const cgenColours={json.dumps(VARIABLES)};\n"
    adapting = (files("compgen.report") / "figure.js").read_text(encoding="utf-8")
    return f"{get_plotlyjs()}\n{colours}{adapting}"


@lru_cache(maxsize=1)
def library_name() -> str:
    """What the script's file is called where it lies outside the pages: its version, and what its bytes hash to."""
    return f"plotly-{get_plotlyjs_version()}-{sha256(library()).hexdigest()[:12]}.min.js"


@lru_cache(maxsize=1)
def _template() -> Any:
    template = json.loads((files("plotly") / "package_data" / "templates" / "plotly_white.json").read_bytes())
    for name in ("xaxis", "yaxis"):  # numbers a little off the axis: the zeros of both do not meet
        template["layout"][name] |= {"ticks": "outside", "ticklen": 4, "tickcolor": GRID}
        template["layout"][name] |= {"exponentformat": "none", "separatethousands": True}  # 5,000 s, not 5k
    return template


def _script(value: Any) -> str:
    """A value inside a script, escaped so that no text in it can end the script."""
    text = json.dumps(value, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("/", "\\u002f")
