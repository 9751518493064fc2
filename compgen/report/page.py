"""What all pages share: their shell and look, the script that draws, findings, tables of the error."""

from collections.abc import Iterable, Mapping
from functools import lru_cache
from html import escape
from importlib.resources import files

from compgen.core.findings import Finding, Level
from compgen.report.figure import Figure, div, library
from compgen.report.table import table

#: A sign beside the words, for who does not see the colour.
MARKS = {"inside": "✓", "outside": "✗", "predicted": "≈", "warning": "!", "note": "·"}
VIEWPORT = '<meta name="viewport" content="width=device-width, initial-scale=1">'


@lru_cache(maxsize=1)
def style() -> str:
    """The look of every page, with the names of its colours; ``page.css`` has it."""
    return (files("compgen.report") / "page.css").read_text("utf-8")


def page(title: str, body: str) -> bytes:
    """One self-contained page, the same bytes for the same inputs."""
    head = f'<!doctype html><html lang="en"><head><meta charset="utf-8">{VIEWPORT}<title>{escape(title)}</title>'
    rest = f"</script></head><body><main><h1>{escape(title)}</h1>{body}</main></body></html>\n"
    return b"".join((f"{head}<style>{style()}</style><script>".encode(), library(), rest.encode()))


def section(title: str, content: str) -> str:
    """A heading and what stands under it."""
    return f"<section><h2>{title}</h2>{content}</section>"


def figure_section(title: str, figure: Figure, key: str, text: str = "") -> str:
    """A heading, words if there are any, and a figure, ``key`` its id."""
    return section(title, text + div(figure, key))


def verdict(kind: str, text: str) -> str:
    """A sentence in large letters, marked as ``inside``, ``outside`` or ``predicted``."""
    return f'<p class="big {kind}">{_mark(kind)} {text}</p>'


def findings_list(findings: Iterable[Finding]) -> str:
    """Findings as a list under a heading: a sign, the word for how bad it is, and the message."""
    rows = "".join(
        f'<li class="{kind}">{_mark(kind)}{f.level}: {escape(f.message)}</li>'
        for f in findings
        for kind in ("outside" if f.level in (Level.REFUSED, Level.OUTSIDE) else str(f.level),)
    )
    return section("Findings", f'<ul class="findings">{rows or "<li class=note>none</li>"}</ul>')


def error_table(
    corner: str, sides: Iterable[tuple[str, Mapping[str, Mapping[str, float]]]], labels: Mapping[str, str]
) -> str:
    """Largest, 99th percentile and rms of each part of the error, before and after.

    Args:
        corner: Heading of the first column.
        sides: Name, and statistics by part of the error.
        labels: Part of the error to the text of its row.
    """
    sides = list(sides)
    head = [corner, *(f"{side} {statistic}" for side, _ in sides for statistic in ("max", "p99", "rms"))]
    rows = [
        [label, *(f"{value:.2f}" for _, statistics in sides for value in statistics[part].values())]
        for part, label in labels.items()
    ]
    return section("Error of the tool centre point", table(head, rows))


def _mark(kind: str) -> str:
    return f'<span class="mark" aria-hidden="true">{MARKS[kind]}</span>'
