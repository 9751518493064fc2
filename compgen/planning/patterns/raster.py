"""Parallel sweeps along x, clipped to the part: there and back, or all one way; they turn outside it."""

from collections.abc import Sequence
from itertools import pairwise
from math import ceil

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.planning import curves
from compgen.planning.boundaries import Boundary
from compgen.planning.curves import PiecewiseCurve

#: Initial speed of a smooth turn over its stepover: a turn about half as deep as it is wide.
TURN_REACH = 1.6
CENTRED = 1e-9  # m that a part may lie off the centre and be in the middle


def raster(boundary: Boundary, stepover: float, lead: float, *, smooth: bool) -> PiecewiseCurve:
    """Sweeps from -y to +y, each longer than the part by ``lead`` at both ends [m].

    Where the part widens or narrows, both sweeps of a turn run past all of the part that lies between them, so the
    step lies outside the edge. Square turns stop at both corners; smooth ones do not.

    Raises:
        InputError: No sweep meets the part.
    """
    low, high = boundary.y_range()
    count = max(1, ceil((high - low) / stepover - 1e-9))
    middle = (low + high) / 2 if abs(low + high) > CENTRED else 0.0
    y: Array = middle + stepover * (np.arange(count, dtype=float) - (count - 1) / 2)
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
        across = curves.lines(leave, arrive, np.ones(n - 1, dtype=bool), np.ones(n - 1, dtype=bool))
    # each sweep is cut where it crosses the edge
    x = np.column_stack([ends[:, 0], np.where(ahead[:, None], span, span[:, ::-1]), ends[:, 1]])
    sweep = np.repeat(np.arange(n), 3)
    a, b = (np.column_stack([x[:, k : k + 3].ravel(), y[sweep]]) for k in (0, 1))
    stop = (b[:, 0] == ends[sweep, 1]) & ((sweep == n - 1) | (not smooth))
    along = curves.lines(a, b, stop, np.ones(3 * n, dtype=bool))
    # the way to each sweep but the first, then its parts that have a length
    order = np.column_stack([np.arange(n) - 1, n - 1 + np.arange(3 * n).reshape(n, 3)])
    has_length = np.column_stack([np.arange(n) > 0, (a[:, 0] != b[:, 0]).reshape(n, 3)])
    return curves.join(across, along).subset(order[has_length])


def one_way_raster(boundary: Boundary, stepover: float, lead: float, lift: float) -> PiecewiseCurve:
    """Sweeps towards larger x, from -y to +y; the tool goes back to the next at a height [m].

    Raises:
        InputError: No sweep meets the part.
    """
    there_and_back = raster(boundary, stepover, lead, smooth=False)
    along = np.flatnonzero(there_and_back.poly[:, 1, 0] != 0)
    starts, _, _ = there_and_back.derivatives(along, np.zeros(len(along)))
    ends, _, _ = there_and_back.derivatives(along, np.ones(len(along)))
    sweeps: list[PiecewiseCurve] = []
    for y in np.unique(starts[:, 1]):
        rows = np.flatnonzero(starts[:, 1] == y)
        x = np.unique(np.concatenate([starts[rows, 0], ends[rows, 0]]))
        x = x[np.diff(x, prepend=-np.inf) > CENTRED]  # an end and the start behind it may differ in the last digit
        places = np.column_stack([x, np.full(len(x), y)])
        stop = np.arange(1, len(x)) == len(x) - 1
        sweeps.append(curves.lines(places[:-1], places[1:], stop, np.ones(len(stop), dtype=bool)))
    return curves.join(*_over_the_part(sweeps, lift))


def cross_hatch(first: PiecewiseCurve, second: PiecewiseCurve, lift: float) -> PiecewiseCurve:
    """One raster, then another, with a way between them at a height [m]."""
    return curves.join(*_over_the_part([first, second], lift))


def _over_the_part(parts: Sequence[PiecewiseCurve], lift: float) -> list[PiecewiseCurve]:
    """Curves with a way up, across and down between each two.

    Raises:
        InputError: There is no way up.
    """
    if lift == 0 and len(parts) > 1:
        raise InputError("process.lift_mm: 0, and the tool goes over the part between sweeps; lift it off")
    joined = [parts[0]]
    for part in parts[1:]:
        end, start = joined[-1].end()[0], part.start()[0]
        high_end, high_start = (np.append(p[:2], lift) for p in (end, start))
        joined += [curves.line(a, b, stop=True, working=False) for a, b in pairwise([end, high_end, high_start, start])]
        joined.append(part)
    return joined
