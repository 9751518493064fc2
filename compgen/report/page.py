"""What all pages share: their shell and look, the script that draws, findings, tables of the error."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from html import escape
from importlib.resources import files

from compgen.core.codes import Level
from compgen.core.findings import Finding
from compgen.report.figure import Figure, div, library
from compgen.report.inputs import Inputs, inputs_html, provenance_html
from compgen.report.table import table

#: A sign beside the words, for who does not see the colour.
MARKS = {"inside": "✓", "outside": "✗", "predicted": "≈", "warning": "!", "note": "•"}
HEAD = (
    '<!doctype html><html lang="en"><head><meta charset="utf-8">'
    '<meta name="viewport" content="width=device-width, initial-scale=1">'
)
NO_SCRIPTS = (
    "<noscript><p class=lead>The figures of this page are drawn by a script, and this browser runs none. Every result "
    "stands in the words and tables.</p></noscript>"
)
#: Stands in for the script of figures where its file is not found: words in place of each figure.
MISSING = """<script>typeof cgenFigures=="undefined"&&(window.cgenFigures={draw(key){
const place=document.getElementById(key);place.classList.add("missing");place.textContent="This figure is drawn by "+
"%s, which is not found: it belongs into the folder above this page's. Copy it there, or write the page anew "+
"with --assets inline. Every result stands in the words and tables."}})</script>"""
SIGNATURE = '<div class="sign"><span>name</span><span>date</span><span>signature</span></div>'


@lru_cache(maxsize=1)
def style() -> str:
    """The look of every page, with the names of its colours; ``page.css`` has it."""
    return (files("compgen.report") / "page.css").read_text("utf-8")


@dataclass(frozen=True, slots=True)
class PageOptions:
    """What whoever asks for a page may choose."""

    date: str = ""  # on the page, as it shall read; "" for none
    script: str = ""  # where plotly.js lies, seen from the page; "" for inside the page


PLAIN = PageOptions()


def page(
    title: str,
    body: str,
    opening: str = "",
    inputs: Inputs | None = None,
    remark: str = "",
    options: PageOptions = PLAIN,
) -> bytes:
    """One page, the same bytes for the same inputs; of one file unless the options say where its script lies.

    Args:
        title: Its name.
        body: Its sections, as HTML.
        opening: The lead and the verdict, as HTML: they stand before the inputs.
        inputs: What it was made from.
        remark: What the result does not know, as HTML, for its foot.
        options: Date and script.
    """
    made = Inputs() if inputs is None else inputs
    head = f"{HEAD}<title>{escape(title)}</title><style>{style()}</style>".encode()
    draws = 'class="plotly-graph-div"' in body
    content = (
        f"</head><body><main><h1>{escape(title)}</h1>{opening}{inputs_html(made, options.date)}"
        f"{NO_SCRIPTS if draws else ''}{body}{SIGNATURE}</main>{provenance_html(made, remark)}</body></html>\n"
    )
    return b"".join((head, *(_drawing(options.script) if draws else ()), content.encode()))


def _drawing(script: str) -> Iterable[bytes]:
    """The script of figures itself, or where it lies and what to say when it is not there."""
    if not script:
        return b"<script>", library(), b"</script>"
    name = script.rsplit("/", 1)[-1]
    return (f'<script src="{escape(script)}"></script>{MISSING % name}'.encode(),)


def section(title: str, content: str) -> str:
    """A heading and what stands under it."""
    return f"<section><h2>{title}</h2>{content}</section>"


def figure_section(title: str, figure: Figure, key: str, text: str = "") -> str:
    """A heading, words if there are any, and a figure, ``key`` its id."""
    return section(title, text + div(figure, key))


def verdict(kind: str, text: str, facts: Iterable[tuple[str, str]] = ()) -> str:
    """A sentence in large letters, and what belongs to it under names, all HTML; ``kind`` is one of ``MARKS``."""
    rows = "".join(f"<dt>{name}</dt><dd>{words}</dd>" for name, words in facts)
    return f'<div class="big {kind}"><p>{_mark(kind)} {text}</p>{f"<dl>{rows}</dl>" if rows else ""}</div>'


def in_words(text: str) -> str:
    """Plain words as a page has them: with a capital, and with the sign of the micrometre."""
    return with_units(text[:1].upper() + text[1:])


def with_units(text: str) -> str:
    """Plain words as HTML, with the sign of the micrometre after numbers."""
    return re.sub(r"(?<=[0-9]) um\b", " &micro;m", escape(text))


def findings_list(findings: Iterable[Finding]) -> str:
    """Findings as a list under a heading: a sign, the word for how bad it is, and the message."""
    rows = "".join(finding_item(f.level, f"{f.level}: {f.message}") for f in findings)
    return section("Findings", f'<ul class="findings">{rows or "<li class=note>none</li>"}</ul>')


def finding_item(level: str, words: str) -> str:
    """One line of such a list."""
    kind = "outside" if level in (Level.REFUSED, Level.OUTSIDE) else escape(level)
    return f'<li class="{kind}">{_mark(kind)}{with_units(words)}</li>'


def error_table(
    corner: str,
    sides: Iterable[tuple[str, Mapping[str, Mapping[str, float]]]],
    labels: Mapping[str, str],
    title: str = "Error of the tool centre point",
) -> str:
    """Largest, 99th percentile and rms of each part of the error, before and after.

    Args:
        corner: Heading of the first column.
        sides: Name, and statistics by part of the error.
        labels: Part of the error to the text of its row.
        title: Of the section.
    """
    sides = list(sides)
    head = [corner, *(f"{side} {statistic}" for side, _ in sides for statistic in ("max", "p99", "rms"))]
    rows = [
        [label, *(f"{value:.2f}" for _, statistics in sides for value in statistics[part].values())]
        for part, label in labels.items()
    ]
    return section(title, table(head, rows))


def _mark(kind: str) -> str:
    return f'<span class="mark" aria-hidden="true">{MARKS.get(kind, MARKS["note"])}</span>'
