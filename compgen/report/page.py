"""What all pages share: their look, the script that draws, findings, tables of the error."""

from collections.abc import Iterable, Mapping
from html import escape

from compgen.core.findings import Finding, Level
from compgen.report.figure import Figure, div, library

STYLE = """
body{font:15px/1.5 system-ui,sans-serif;color:#1e293b;max-width:1080px;margin:2rem auto;padding:0 1rem}
h1{font-size:1.5rem;margin:0}h2{font-size:1.1rem;margin:2rem 0 .5rem}
.lead{color:#64748b;margin:.2rem 0 1rem}
.big{font-size:1.15rem;margin:1rem 0;padding:.7rem 1rem;border-left:5px solid}
.inside{border-color:#0f766e;background:#f0fdfa}.outside{border-color:#b91c1c;background:#fef2f2}
.predicted{border-color:#c2410c;background:#fff7ed}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}
th,td{padding:.3rem .6rem;text-align:right;border-bottom:1px solid #e2e8f0}
th:first-child,td:first-child{text-align:left}thead th{color:#64748b;font-weight:600}
li.outside{color:#b91c1c;font-weight:600;background:none}li.warning{color:#b45309}li.note{color:#475569}
footer{color:#64748b;font-size:.85rem;margin:2rem 0;overflow-wrap:anywhere}
"""


def page(title: str, body: str) -> bytes:
    """One self-contained page, the same bytes for the same inputs."""
    head = f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
    rest = f"</script></head><body><h1>{escape(title)}</h1>{body}</body></html>\n"
    return b"".join((f"{head}<style>{STYLE}</style><script>".encode(), library(), rest.encode()))


def section(title: str, content: str) -> str:
    """A heading and what stands under it."""
    return f"<h2>{title}</h2>{content}"


def figure_section(title: str, figure: Figure, key: str, text: str = "") -> str:
    """A heading, words if there are any, and a figure, ``key`` its id."""
    return section(title, text + div(figure, key))


def verdict(kind: str, text: str) -> str:
    """A sentence in large letters, marked as ``inside``, ``outside`` or ``predicted``."""
    return f'<p class="big {kind}">{text}</p>'


def findings_list(findings: Iterable[Finding]) -> str:
    """Findings as a list under a heading."""
    rows = "".join(
        f'<li class="{Level.OUTSIDE if f.level is Level.REFUSED else f.level}">{f.level}: {escape(f.message)}</li>'
        for f in findings
    )
    return section("Findings", f"<ul>{rows or '<li class=note>none</li>'}</ul>")


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
    head = "".join(f"<th>{side} {statistic}</th>" for side, _ in sides for statistic in ("max", "p99", "rms"))
    rows = ""
    for part, label in labels.items():
        cells = "".join(f"<td>{value:.2f}</td>" for _, statistics in sides for value in statistics[part].values())
        rows += f"<tr><td>{label}</td>{cells}</tr>"
    table = f"<table><thead><tr><th>{corner}</th>{head}</tr></thead><tbody>{rows}</tbody></table>"
    return section("Error of the tool centre point", table)
