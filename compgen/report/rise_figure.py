"""Temperature rise of each part of the robot over time, as a figure."""

from collections.abc import Sequence

import numpy as np

from compgen.core.arrays import Array
from compgen.report.figure import DASHES, LINES, Figure, axis, figure, rows_to_draw, trace
from compgen.report.figure_words import curves_in_words


def rise_figure(names: Sequence[str], time: Array, rise: Array, time_title: str) -> Figure:
    """Temperature rise of each node over time, rise (N, K) [K] at time (N,) [s]."""
    rows = rows_to_draw(np.arange(len(time), dtype=float))
    shown = np.round(time[rows], 3)
    traces = []
    for i, name in enumerate(names):
        line = {"color": LINES[i % len(LINES)], "dash": DASHES[i % len(DASHES)], "width": 1.6}
        traces.append(trace("scatter", shown, np.round(rise[rows, i], 4), name=name, line=line))
    alt = curves_in_words("Temperature rise of each part of the robot", traces, "K")
    return figure(traces, 320, alt, yaxis=axis("rise [K]", rangemode="tozero"), xaxis=axis(time_title))
