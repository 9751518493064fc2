"""What all pages share: a look, the script that draws, findings, curves no longer than a screen shows."""

from collections.abc import Iterable
from html import escape

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.findings import Finding
from compgen.report.figure import library

POINTS = 4000  # of a curve: what a screen can show
WARM, COOL, GREY = "#c2410c", "#0f766e", "#64748b"
LINES = ("#c2410c", "#ca8a04", "#7c3aed", "#0f766e", "#1d4ed8", "#64748b")

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


def findings_list(findings: Iterable[Finding]) -> str:
    """Findings as a list."""
    rows = "".join(f'<li class="{f.level}">{f.level}: {escape(f.message)}</li>' for f in findings)
    return f"<h2>Findings</h2><ul>{rows or '<li class=note>none</li>'}</ul>"


def thin(values: Array) -> IntArray:
    """Rows to draw: from each of many bins the one with the largest value, and both ends."""
    count = len(values)
    if count <= POINTS:
        return np.arange(count)
    edges = np.linspace(0, count, POINTS + 1).astype(int)
    top = np.maximum.reduceat(values, edges[:-1])
    hits = np.flatnonzero(values == np.repeat(top, np.diff(edges)))
    first = hits[np.searchsorted(hits, edges[:-1]).clip(max=len(hits) - 1)]
    return np.unique(np.concatenate([[0], first, [count - 1]]))
