"""A band on a page: a sentence, how to read it, a table of its sources, and bars."""

from html import escape
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.units import UM
from compgen.error_model.unknown import NOT_LOOKED_AT
from compgen.report.band_words import known_words, rounded, unknown_words
from compgen.report.figure import GREY, Figure, axis, figure, spans, trace
from compgen.report.figure_rows import Row
from compgen.report.figure_words import sentence
from compgen.report.page import with_units
from compgen.report.table import table
from compgen.verification.band import ONE_SIDED

LEFT_OPEN = "left open by the robot file"
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
    "fit noise": "scatter of what was measured",
}
FILE = "#1d4ed8"  # what the file knows of: neither before nor after
BESIDE = {"textposition": "outside", "textangle": 0, "cliponaxis": False}  # what a bar says: hatched ground is not read
BAND, BAND_LINE = "rgba(100,116,139,0.25)", "#64748b"  # an area of what may be


def band_facts(record: dict[str, Any]) -> list[tuple[str, str]]:
    """What the robot file leaves open and what it does not know: names and HTML, for what stands under a verdict."""
    unknown = unknown_words(record)
    amount, _, sources = known_words(record).partition(" of what this file knows")
    left_open = f"<b>{with_units(amount)}</b>{with_units(sources)}" if record["p95_um"] else with_units(amount)
    return [(LEFT_OPEN, left_open), *([("not known of this robot", with_units(unknown))] if unknown else [])]


def band_explained(record: dict[str, Any]) -> str:
    """What the numbers mean, and the table of sources."""
    whole = rounded(record["p95_um"])
    text = (
        "<p>The error above is right if the robot is exactly what its file says. It is not: each number of the file is "
        f"known so well and no better. At its worst place on the part the tool stays within <b>{whole} &micro;m</b> of "
        "it in 95 of 100 cases. The sources below add up as squares do: the largest ones count. What nobody has "
        "measured on this robot comes on top; it is named, with the size that others found.</p>"
    )
    rows = [
        [_explained(source, MEANINGS.get(source, "")), rounded(size), rounded(record["budget_rms_um"][source])]
        for source, size in record["budget_um"].items()
    ]
    rows.append(["<b>all that this file knows</b>", f"<b>{whole}</b>", ""])
    for row in record["unknown"]:
        size = row["size_um"]
        nothing = row["from"] if row["from"] == NOT_LOOKED_AT else "nobody said"
        extent = nothing if size is None else f"{rounded(size[0]) if size[0] else '0'} to {rounded(size[1])}"
        origin = "" if extent == row["from"] else row["from"]
        rows.append([_explained(f"not known: {row['what']}", origin), extent, ""])
    return text + table(["source", "largest on the part [&micro;m]", "rms [&micro;m]"], rows)


def radius_row(time: Array, radius: Array) -> Row:
    """How far off the tool may be, (K,) [m], as a row of a figure over time (K,) [s]."""
    look = {"mode": "lines", "fill": "tozeroy", "fillcolor": BAND, "line": {"color": BAND_LINE, "width": 1}}
    name = "may be off (95 %), as far as known"
    curve = trace("scatter", np.round(time, 4), np.round(radius / UM, 3), name=name, showlegend=True, **look)
    return Row("may be off [µm]", [curve], options={"rangemode": "tozero"})


def budget_figure(record: dict[str, Any]) -> Figure:
    """Bars: what each source of the file leaves open, and beside them what is not known, with a scale of its own."""
    sources = list(record["budget_um"].items())[::-1]
    sized = [row for row in record["unknown"][::-1] if row["size_um"] is not None]
    largest = max((size for _, size in sources), default=1.0)
    left, right = spans(2, 0.24) if sized else ([0.0, 1.0], [])
    traces = [
        trace(
            "bar",
            [size for _, size in sources],
            [name for name, _ in sources],
            orientation="h",
            showlegend=False,
            marker={"color": FILE},
            text=[rounded(size) for _, size in sources],
            **BESIDE,
        )
    ]
    layout: dict[str, Any] = {
        "xaxis": axis("left open by the file [µm], 95 %", domain=left, range=[0, 1.15 * largest]),
        "yaxis": {"automargin": True},
    }  # fmt: skip
    height, narrow = 120 + 30 * max(len(sources), len(sized)), {}
    words = [f"{name} {rounded(size)} µm" for name, size in record["budget_um"].items()]
    if sized:
        low, high = zip(*(row["size_um"] for row in sized), strict=True)
        extents = [f"{rounded(a) if a else '0'} to {rounded(b)}" for a, b in zip(low, high, strict=True)]
        traces.append(
            trace(
                "bar",
                [b - a for a, b in zip(low, high, strict=True)],
                [row["what"] for row in sized],
                base=list(low),
                orientation="h",
                showlegend=False,
                xaxis="x2",
                yaxis="y2",
                text=extents,
                marker={"color": GREY, "pattern": {"shape": "/", "fgopacity": 0.3}},
                **BESIDE,
            )
        )
        layout["xaxis2"] = axis("not known [µm]: another scale", domain=right, anchor="y2", range=[0, 1.5 * max(high)])
        layout["yaxis2"] = {"anchor": "x2", "automargin": True}
        words += [
            f"not known: {row['what']}, {extent} µm" for row, extent in zip(sized[::-1], extents[::-1], strict=True)
        ]
        below = 75 + 30 * len(sized)
        tall = 75 + 30 * len(sources) + below
        split = below / tall
        narrow = {
            "height": tall + 60,
            "xaxis": {"domain": [0.0, 1.0]}, "yaxis": {"domain": [split, 1.0]},
            "xaxis2": {"domain": [0.0, 1.0], },
            "yaxis2": {"domain": [0.0, max(split - 75 / tall, 0.05)]},
        }  # fmt: skip
    alt = sentence("What the part will see beyond the arithmetic", words)
    return figure(traces, height, alt, narrow, **layout)


def _explained(name: str, meaning: str) -> str:
    return escape(name) + (f" <small>{escape(meaning)}</small>" if meaning else "")
