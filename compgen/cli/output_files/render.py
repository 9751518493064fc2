"""Figures drawn without a page, by kaleido in a browser without a window and without the network."""

import asyncio
import logging
import re
import sys
import warnings
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

WIDTH = 900  # [px]
SCALE = {"svg": 1, "pdf": 1, "png": 2}
PATIENCE = 60.0  # for one figure [s]
NOWHERE = "http://127.0.0.1:9"  # a proxy that is none: what asks the network gets no answer
_UNIQUE = re.compile(rb'id="defs-([0-9a-f]{6})"')
_NUMBERED = re.compile(rb'(?:id="[^"]*-|class="trace [a-z]+ trace)([0-9a-f]{6})"')
_DATE = re.compile(rb"\(D:\d{14}[+-]\d\d'\d\d'\)")


class NoRenderer(Exception):
    """Figures cannot be drawn here; says what is missing."""


def render(figures: Mapping[str, Mapping[str, Any]], kind: str) -> dict[str, bytes]:
    """Each figure as an SVG, PNG or PDF file, ``kind``; SVG and PDF without what differs from run to run.

    Raises:
        NoRenderer: kaleido or the browser that it needs is not installed, or fails.
    """
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
            drawn = asyncio.run(_drawn(kaleido, figures, kind))
    except ChromeNotFoundError:
        raise NoRenderer("kaleido finds no browser: install Chromium or Chrome") from None
    except (BrowserFailedError, BrowserClosedError, KaleidoError, OSError, TimeoutError) as failure:
        raise NoRenderer(f"the browser failed ({type(failure).__name__})") from failure
    return {key: without_chance(content, kind) for key, content in drawn.items()}


async def _drawn(kaleido: Any, figures: Mapping[str, Mapping[str, Any]], kind: str) -> dict[str, bytes]:
    script = files("plotly") / "package_data" / "plotly.min.js"
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
