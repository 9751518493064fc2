"""The figures that stand in a page, read back from it: a file of a figure shows what the page shows."""

import json
import re
from html import unescape

from compgen.report.figure import Figure

_FIGURE = re.compile(
    r'<figure class="chart" role="img" aria-label="(?P<alt>[^"]*)">'
    r'<div id="(?P<key>[^"]+)" class="plotly-graph-div"></div>'
    r'(?:<div class="still">(?P<still>.*?)</div>)?<noscript>.*?<script>cgenFigures\.draw\("[^"]*",',
    re.DOTALL,
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
