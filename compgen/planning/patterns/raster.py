"""Parallel sweeps along x, there and back, clipped to the part; they turn outside it."""

from math import ceil

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.planning import curves
from compgen.planning.boundaries import Boundary
from compgen.planning.curves import PiecewiseCurve

#: Initial speed of a smooth turn over its stepover: a turn about half as deep as it is wide.
TURN_REACH = 1.6


def raster(boundary: Boundary, stepover: float, lead: float, smooth: bool) -> PiecewiseCurve:
    """Sweeps from -y to +y, each longer than the part by ``lead`` at both ends [m].

    Where the part widens or narrows, both sweeps of a turn run past all of the part that lies between them, so the
    step lies outside the edge. Square turns stop at both corners; smooth ones do not.

    Raises:
        InputError: No sweep meets the part.
    """
    half = boundary.half_height()
    count = max(1, ceil(2 * half / stepover - 1e-9))
    y: Array = stepover * (np.arange(count, dtype=float) - (count - 1) / 2)
    span = boundary.clip(y)
    y, span = y[~np.isnan(span[:, 0])], span[~np.isnan(span[:, 0])]
    n = len(y)
    if not n:
        raise InputError("path.stepover_mm: no sweep meets the part; make it smaller")
    ahead = np.arange(n) % 2 == 0  # towards larger x
    # a turn's two ends share an x outside all of the part between them
    longer = span + np.array([-lead, lead])
    ends = np.where(ahead[:, None], longer, longer[:, ::-1])
    x_range = boundary.x_range(y[:-1], y[1:])
    ends[:-1, 1] = ends[1:, 0] = np.where(ahead[:-1], x_range[:, 1] + lead, x_range[:, 0] - lead)

    leave, arrive = (np.column_stack([ends[1:, 0], level]) for level in (y[:-1], y[1:]))
    if smooth:
        heading = np.column_stack([np.where(ahead[:-1], 1.0, -1.0), np.zeros(n - 1)])
        across = curves.u_turns(leave, arrive, heading, TURN_REACH * stepover)
    else:
        across = curves.lines(leave, arrive, np.full(n - 1, True), np.full(n - 1, True))
    # each sweep is cut where it crosses the edge
    x = np.column_stack([ends[:, 0], np.where(ahead[:, None], span, span[:, ::-1]), ends[:, 1]])
    sweep = np.repeat(np.arange(n), 3)
    a, b = (np.column_stack([x[:, k : k + 3].ravel(), y[sweep]]) for k in (0, 1))
    stop = (b[:, 0] == ends[sweep, 1]) & ((sweep == n - 1) | (not smooth))
    along = curves.lines(a, b, stop, np.full(3 * n, True))
    # the way to each sweep but the first, then its parts that have a length
    order = np.column_stack([np.arange(n) - 1, n - 1 + np.arange(3 * n).reshape(n, 3)])
    has_length = np.column_stack([np.arange(n) > 0, (a[:, 0] != b[:, 0]).reshape(n, 3)])
    return curves.join(across, along).subset(order[has_length])
