"""What all pages share: their templates and look, and words with the signs of a page."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from compgen.core.findings import in_reading_order
from compgen.core.version import __version__
from compgen.report.band_words import largest_unknown, rounded
from compgen.report.figure import div, library_text
from compgen.report.inputs import Inputs

#: A sign beside the words, for who does not see the colour.
MARKS = {"inside": "✓", "outside": "✗", "predicted": "≈", "warning": "!", "note": "•"}


@lru_cache(maxsize=1)
def style() -> str:
    """The look of every page, with the names of its colours; ``page.css`` has it."""
    return (files("compgen.report") / "page.css").read_text("utf-8")


@dataclass(frozen=True, slots=True)
class PageOptions:
    """What whoever asks for a page may choose."""

    date: str = ""  # on the page, as it shall read; "" for none
    script: str = ""  # where plotly.js lies, seen from the page; "" for inside the page
    labels: tuple[tuple[str, str], ...] = ()  # part, order and operator, of those that were named

    def labelled(self) -> dict[str, dict[str, str]]:
        """Part, order and operator for a record; nothing where none is named."""
        return {"labels": dict(self.labels)} if self.labels else {}


PLAIN = PageOptions()


def page(
    template: str,
    title: str,
    *,
    inputs: Inputs,
    remark: str = "",
    options: PageOptions = PLAIN,
    **shown: Any,
) -> bytes:
    """One page, the same bytes for the same inputs; of one file unless the options say where its script lies.

    Args:
        template: The file in ``templates/`` that lays it out; ``page.html`` is the bare shell.
        title: Its name.
        inputs: What it was made from.
        remark: What the result does not know, for its foot.
        options: Date and script.
        shown: What else the template shows: text is escaped, Markup is HTML.
    """
    return fragment(template, title=title, inputs=inputs, remark=remark, options=options, **shown).encode()


def fragment(template: str, **shown: Any) -> Markup:
    """A template with what it shows, as HTML."""
    return Markup(templates().get_template(template).render(shown) + "\n")


@lru_cache(maxsize=1)
def templates() -> Environment:
    """The templates: every text is escaped, and a name that nothing was given for is an exception."""
    made = Environment(
        loader=PackageLoader("compgen.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters |= {
        "in_reading_order": in_reading_order,
        "largest_unknown": largest_unknown,
        "fixed": fixed,
        "units": with_units,
        "words": page_words,
        "rounded": rounded,
    }
    made.globals |= {
        "div": div,
        "library": library_text,
        "marks": MARKS,
        "style": style,
        "version": __version__,
        "statistics_head": statistics_head,
        "error_rows": error_rows,
    }
    return made


def fixed(value: float, digits: int = 2) -> str:
    """A number with so many digits after the point."""
    return f"{value:.{digits}f}"


def page_words(text: str) -> Markup:
    """Plain words as a page has them: with a capital, and with the sign of the micrometre."""
    return with_units(text[:1].upper() + text[1:])


def with_units(text: str) -> Markup:
    """Plain words as HTML, with the sign of the micrometre after numbers."""
    return Markup(re.sub(r"(?<=[0-9]) um\b", " &micro;m", escape(text)))


def statistics_head(sides: Iterable[str]) -> list[str]:
    """Columns of largest, 99th percentile and rms for each side of an error."""
    return [f"{side} {statistic}" for side in sides for statistic in ("max", "p99", "rms")]


def error_rows(parts: Mapping[str, str], sides: Iterable[Mapping[str, Mapping[str, float]]]) -> list[list[str]]:
    """A row for each part of the error: its label, and largest, 99th percentile and rms of each side."""
    sides = list(sides)
    return [[label, *(fixed(v) for side in sides for v in side[part].values())] for part, label in parts.items()]
