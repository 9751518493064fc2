"""Each figure of a page as a file beside it, where it is asked for: ``--figures svg``.

Figures are drawn without the page, by kaleido in a browser without a window and without the network.
"""

import logging
import os
import re
import sys
import warnings
from base64 import b64encode
from collections.abc import Iterable, Mapping
from enum import StrEnum
from html import escape, unescape
from importlib import resources
from pathlib import Path
from typing import Annotated, Any

import typer

from compgen.core.exceptions import InputError
from compgen.core.findings import one_line


class FigureFormat(StrEnum):
    """What a figure's file is."""

    SVG = "svg"
    PNG = "png"
    PDF = "pdf"


FiguresOption = Annotated[
    FigureFormat | None,
    typer.Option("--figures", help="Write every figure of the page as a file beside it, too: svg, png or pdf."),
]
_NAMES = re.compile(rb'<meta name="figures" content="([^"]*)">')
HEAD = 4096  # of a page: where the names of its figures' files stand [bytes]

WIDTH = 900  # [px]
SCALE = {"svg": 1, "pdf": 1, "png": 2}
PATIENCE = 60.0  # for one figure [s]
NOWHERE = "http://127.0.0.1:9"  # a proxy that is none: what asks the network gets no answer
_UNIQUE = re.compile(rb'id="defs-([0-9a-f]{6})"')
_NUMBERED = re.compile(rb'(?:id="[^"]*-|class="trace [a-z]+ trace)([0-9a-f]{6})"')
_DATE = re.compile(rb"\(D:\d{14}[+-]\d\d'\d\d'\)")

Content = bytes | Iterable[bytes]


def with_figures(folder: Path, files: Mapping[str, Content], kind: FigureFormat | None) -> dict[str, Content]:
    """The files of a run, and those of the figures of its page; figures that cannot be drawn are said on stderr.

    The page names its figures' files: a later run replaces or removes these, and no others.

    Args:
        folder: Where they will be.
        files: Name to content, a page among them.
        kind: None where no figures are asked for.

    Raises:
        InputError: A file with the name of a figure is there that no page names.
    """
    if kind is None:
        return dict(files)
    name = next(name for name in files if name.endswith(".html"))
    page = files[name]
    if not isinstance(page, bytes):
        page = b"".join(page)
    stem = Path(name).stem
    drawn = {f"{stem}_{key}.{kind}": content for key, content in _drawn(page, kind).items()}
    own = earlier_figures(folder / name)
    foreign = next((figure for figure in drawn if figure not in own and os.path.lexists(folder / figure)), None)
    if foreign is not None:
        raise InputError(f"{folder / foreign}: it is there, and no page names it as its figure; move it away")
    meta = f'<meta name="figures" content="{escape(" ".join(drawn))}">'.encode()
    return {**files, name: page.replace(b"<title>", meta + b"<title>", 1), **drawn}


def earlier_figures(page: Path) -> set[str]:
    """Names of the files of figures that a page which is there names; none where it is not there."""
    try:
        with page.open("rb") as file:
            match = _NAMES.search(file.read(HEAD))
    except OSError:
        return set()
    names = unescape(match[1].decode(errors="replace")).split() if match else []
    stem = re.escape(page.stem)
    return {name for name in names if re.fullmatch(rf"{stem}_\w+\.(svg|png|pdf)", name)}


def _drawn(page: bytes, kind: FigureFormat) -> dict[str, bytes]:
    """Content by the figure's key, of those that can be drawn."""
    from compgen.report.figure import figures_of_page
    from compgen.report.still_picture import side_by_side

    figures = figures_of_page(page)
    stills = {key: side_by_side(figure["still"], _note(figure)) for key, figure in figures.items() if "still" in figure}
    done = {key: svg.encode() for key, svg in stills.items() if kind is FigureFormat.SVG}
    open_ones = {key: figure for key, figure in figures.items() if key not in done}
    pictures = {key: _picture(stills[key]) if key in stills else figure for key, figure in open_ones.items()}
    try:
        done |= render(pictures, kind.value) if pictures else {}
    except NoRenderer as missing:
        left_out = f"{len(pictures)} of {len(figures)} figures not written"
        sys.stderr.write(f"{one_line(f'cgen: warning: --figures {kind}: {left_out}: {missing}')}\n")
    return {key: done[key] for key in figures if key in done}


def _picture(svg: str) -> dict[str, Any]:
    """A picture that is drawn already, as a figure of nothing else."""
    width, height = (int(v) for v in re.findall(r'(?:width|height)="(\d+)"', svg)[:2])
    image = {
        "source": f"data:image/svg+xml;base64,{b64encode(svg.encode()).decode()}", "xref": "paper", "yref": "paper",
        "x": 0, "y": 1, "sizex": 1, "sizey": 1, "layer": "above",
    }  # fmt: skip
    axis = {"visible": False}
    margin = {"l": 0, "r": 0, "t": 0, "b": 0}
    layout = {"width": width, "height": height, "margin": margin, "images": [image], "xaxis": axis, "yaxis": axis}
    return {"data": [], "layout": layout}


def _note(figure: Mapping[str, Any]) -> str:
    notes = figure["layout"].get("annotations", [])
    return str(notes[0]["text"]) if notes else ""


class NoRenderer(Exception):
    """Figures cannot be drawn here; says what is missing."""


def render(figures: Mapping[str, Mapping[str, Any]], kind: str) -> dict[str, bytes]:
    """Each figure as an SVG, PNG or PDF file, ``kind``; SVG and PDF without what differs from run to run.

    Raises:
        NoRenderer: kaleido or the browser that it needs is not installed, or fails.
    """
    import asyncio  # takes its time, and few ask for figures

    arguments, sys.argv = sys.argv, sys.argv[:1]  # kaleido's logger reads them as its own, and ends on --log
    try:
        import kaleido
        from kaleido.errors import BrowserClosedError, BrowserFailedError, ChromeNotFoundError, KaleidoError
    except ImportError:
        raise NoRenderer("kaleido is not installed: pip install 'compgen[figures]'") from None
    finally:
        sys.argv = arguments
    for name in ("kaleido", "choreographer"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            drawn = asyncio.run(_in_browser(kaleido, figures, kind))
    except ChromeNotFoundError:
        raise NoRenderer("kaleido finds no browser: install Chromium or Chrome") from None
    except (BrowserFailedError, BrowserClosedError, KaleidoError, OSError, TimeoutError) as failure:
        raise NoRenderer(f"the browser failed ({type(failure).__name__})") from failure
    return {key: without_chance(content, kind) for key, content in drawn.items()}


async def _in_browser(kaleido: Any, figures: Mapping[str, Mapping[str, Any]], kind: str) -> dict[str, bytes]:
    script = resources.files("plotly") / "package_data" / "plotly.min.js"
    drawn = {}
    async with kaleido.Kaleido(plotlyjs=str(script), mathjax=False, timeout=PATIENCE, proxy_server=NOWHERE) as browser:
        for key, figure in figures.items():
            layout = {**figure["layout"], "paper_bgcolor": "#ffffff"}
            size = {"width": layout.get("width", WIDTH), "height": layout["height"], "scale": SCALE[kind]}
            content = {"data": figure["data"], "layout": layout}
            drawn[key] = await browser.calc_fig(content, opts={"format": kind, **size})
    return drawn


def without_chance(content: bytes, kind: str) -> bytes:
    """Without the random names of a drawing, its traces and patterns, and the time of its making."""
    if kind == "svg" and (name := _UNIQUE.search(content)):
        content = content.replace(name[1], b"figure")
        for k, pattern in enumerate(dict.fromkeys(_NUMBERED.findall(content))):
            content = re.sub(rb"(-|trace)" + pattern, rb"\g<1>%d" % k, content)
    if kind == "pdf":
        content = _DATE.sub(b"(D:20260101000000+00'00')", content)
    return content
