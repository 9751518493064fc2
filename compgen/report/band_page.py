"""A band on a page: a sentence, how to read it, a table of its sources, and bars."""

from typing import Any

import numpy as np
from markupsafe import Markup, escape

from compgen.core.arrays import Array
from compgen.core.units import UM
from compgen.error_model.unmeasured import NOT_LOOKED_AT
from compgen.report.band_words import PARTED, known_words, next_words, rounded, size_words, unknown_words
from compgen.report.curves import CurveRow, course, sentence
from compgen.report.figure import GREY, Figure, axis, figure, spans, trace
from compgen.report.page import with_units
from compgen.verification.band import ONE_SIDED

LEFT_OPEN = "uncertainty of the robot data"
MEANINGS = {  # of the sources of a budget, for who has not written the robot file
    "cte": "how much the arm grows per kelvin",
    "temperature log": "how warm the robot is when its temperature log ends",
    "thermocouples": "how well the warmth was measured",
    "thermal physics missing": "what any model of heat leaves out",
    "temperature law": "how well the model foretells the warmth",
    "air": "temperature of the air",
    "feed": "feed that is really driven",
    "profile shape": "how warmth is spread along a link",
    ONE_SIDED: "numbers somewhere between two limits, and the program's is not in their middle",
    "start delay": "starts later than planned",
    "identified parameters": "how well measuring told the robot's numbers",
    "lost motion": "play of the joints where they turn back",
    "fit noise": "scatter of what was measured",
    "the controller's motion": "what the log's stretches that were held out leave of it",
    "part's frame": "touches that taught the part's frame, and the probe",
}
STANDS = "of it: where the part stands", "what teaching the part's frame with this robot takes away"
WHEN_TAUGHT = "of it: the rest", "what is left when the frame is taught by the robot as warm as it works"
FILE = "#1d4ed8"  # what the file knows of: neither before nor after
#: a bar, and what it says beside it: hatched ground is not read
BAR = {"orientation": "h", "showlegend": False, "textposition": "outside", "textangle": 0, "cliponaxis": False}
HATCHED = {"color": GREY, "pattern": {"shape": "/", "fgopacity": 0.3}}
BAND, BAND_LINE = "rgba(100,116,139,0.25)", "#64748b"  # an area of what may be


def band_facts(record: dict[str, Any]) -> list[tuple[str, Markup]]:
    """What the robot file leaves open and what it does not know: names and HTML, for what stands under a verdict."""
    unknown = unknown_words(record)
    amount, comma, sources = known_words(record).partition(",")
    bold = "<b>{}</b>{}" if record["p95_um"] else "{}{}"
    left_open = Markup(bold).format(with_units(amount), with_units(comma + sources if record["p95_um"] else ""))
    rows = [("not measured on this robot", unknown), ("measure next, to make it smaller", next_words(record))]
    return [(LEFT_OPEN, left_open), *((name, with_units(words)) for name, words in rows if words)]


def band_rows(record: dict[str, Any]) -> list[list[str]]:
    """The table of a band's sources: what each leaves open, all together, and what is not known."""
    parts = zip(PARTED, (STANDS, WHEN_TAUGHT), strict=True)
    rows = [
        *(
            [_explained(source, MEANINGS.get(source, "")), rounded(size), rounded(record["budget_rms_um"][source])]
            for source, size in record["budget_um"].items()
        ),
        [Markup("<b>all that this file knows</b>"), Markup("<b>{}</b>").format(rounded(record["p95_um"])), ""],
        *([_explained(*what), rounded(record[key]), ""] for key, what in parts if key in record),
    ]
    for row in record["unknown"]:
        nothing = row["from"] if row["from"] == NOT_LOOKED_AT else "no figure"
        extent = nothing if row["size_um"] is None else size_words(row)
        origin = "" if extent == row["from"] else row["from"]
        rows.append([_explained(f"not known: {row['what']}", origin), extent, ""])
    return rows


def radius_row(time: Array, radius: Array) -> CurveRow:
    """How far off the tool may be, (K,) [m], as a row of a figure over time (K,) [s]."""
    look = {"mode": "lines", "fill": "tozeroy", "fillcolor": BAND, "line": {"color": BAND_LINE, "width": 1}}
    name = "may be off (95 %), as far as known"
    curve = trace("scatter", np.round(time, 4), np.round(radius / UM, 3), name=name, showlegend=True, **look)
    return CurveRow("may be off [µm]", [curve], course("may be off (95 %)", radius / UM, "µm"))


def budget_figure(record: dict[str, Any]) -> Figure:
    """Bars: what each source of the file leaves open, and beside them what is not known, with a scale of its own."""
    sources = list(record["budget_um"].items())[::-1]
    sized = [row for row in record["unknown"][::-1] if row["size_um"] is not None]
    left, right = spans(2, 0.24) if sized else ([0.0, 1.0], [])
    sizes = [size for _, size in sources]
    axes: dict[str, Any] = {
        "xaxis": axis("left open by the file [µm], 95 %", domain=left, range=[0, 1.15 * max(sizes, default=1.0)]),
        "yaxis": {"automargin": True},
    }
    known = trace(
        "bar", sizes, [name for name, _ in sources], text=[*map(rounded, sizes)], marker={"color": FILE}, **BAR
    )
    traces, words = [known], [f"{name} {rounded(size)} µm" for name, size in record["budget_um"].items()]
    height, narrow = 120 + 30 * max(len(sources), len(sized)), {}
    if sized:
        low, high = np.array([row["size_um"] for row in sized]).T
        names, extents = [row["what"] for row in sized], [size_words(row) for row in sized]
        brief = [size_words({**row, "expected_um": None}) for row in sized]  # a long one is cut at the edge
        place = {"xaxis": "x2", "yaxis": "y2", "base": low.tolist(), "text": brief}
        traces.append(trace("bar", (high - low).tolist(), names, **place, marker=HATCHED, **BAR))
        axes["xaxis2"] = axis("not known [µm]: another scale", domain=right, anchor="y2", range=[0, 1.5 * high.max()])
        axes["yaxis2"] = {"anchor": "x2", "automargin": True}
        words += [f"not known: {name}, {extent} µm" for name, extent in zip(names[::-1], extents[::-1], strict=True)]
        narrow = _below_each_other(len(sources), len(sized), [0, 2.4 * high.max()])
    return figure(traces, height, sentence("What the part will see beyond the arithmetic", words), narrow, **axes)


def _below_each_other(above: int, below: int, reach: list[float]) -> dict[str, Any]:
    """Two plots with so many bars for a phone, the lower with room for words beside long names."""
    height = 75 + 30 * below
    tall = 75 + 30 * above + height
    return {
        "height": tall + 60,
        "xaxis": {"domain": [0.0, 1.0], "title": {"text": "left open [µm], 95 %"}},
        "yaxis": {"domain": [height / tall, 1.0]},
        "xaxis2": {
            "domain": [0.0, 1.0],
            "range": reach,
            "nticks": 3,
            "tickangle": 0,
            "title": {"text": "not known [µm]"},
        },
        "yaxis2": {"domain": [0.0, max(height / tall - 75 / tall, 0.05)]},
    }


def _explained(name: str, meaning: str) -> Markup:
    return Markup("{} <small>{}</small>").format(name, meaning) if meaning else escape(name)
