"""Curves over one abscissa in rows below each other, each row on a scale and with a legend of its own."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from compgen.report.figure import DASHED, HALO, Figure, Trace, axis, figure, horizontal_line

ROW, GAP = 165, 62  # [px]
TOP, BOTTOM = 36, 50


@dataclass(frozen=True, eq=False, slots=True)
class Row:
    """Curves that share an axis, and a bound across them."""

    title: str  # of the axis
    traces: Sequence[Trace]
    bound: tuple[float, str] | None = None  # where, and its words
    options: dict[str, Any] = field(default_factory=dict)  # of the axis


def figure_in_rows(rows: Sequence[Row], x_title: str, alt: str, shapes: Sequence[dict[str, Any]] = ()) -> Figure:
    """Rows that are zoomed together along x."""
    count = len(rows)
    height = count * ROW + (count - 1) * GAP
    layout: dict[str, Any] = {"annotations": [], "shapes": list(shapes)}
    traces: list[Trace] = []
    for k, row in enumerate(rows):
        which = str(k + 1) if k else ""
        top = 1 - k * (ROW + GAP) / height
        layout[f"legend{which}"] = {"orientation": "h", "x": 0, "y": round(top, 5), "yanchor": "bottom"}
        domain = [round(max(top - ROW / height, 0.0), 5), round(top, 5)]
        layout[f"yaxis{which}"] = axis(row.title, anchor=f"x{which}", domain=domain, **row.options)
        layout[f"xaxis{which}"] = {"anchor": f"y{which}", "domain": [0.0, 1.0], "matches": "x", "showticklabels": False}
        place = {"xaxis": f"x{which}", "yaxis": f"y{which}", "legend": f"legend{which}"}
        traces += [{**one, **place} for one in row.traces]
        if row.bound is not None:
            level, words = row.bound
            layout["shapes"].append(horizontal_line(level, which))
            layout["annotations"].append(
                {"text": words, "x": 1, "xref": "paper", "xanchor": "right", "y": level, "yref": f"y{which}",
                 "yanchor": "bottom", "showarrow": False, "font": {"color": DASHED["color"], "shadow": HALO}}
            )  # fmt: skip
    last = f"xaxis{count if count > 1 else ''}"
    layout[last].update(axis(x_title), showticklabels=True)
    del layout["xaxis"]["matches"]
    margin = {"l": 64, "r": 16, "t": TOP, "b": BOTTOM}
    drawn = {key: value for key, value in layout.items() if value != []}
    return figure(traces, height + TOP + BOTTOM, alt, margin=margin, **drawn)
