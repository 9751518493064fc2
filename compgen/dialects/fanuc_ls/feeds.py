r"""Speeds as a program can say them, the rounding of each made good by those that follow.

A segment of length L and wanted speed v takes L / v; at n steps h of the chosen unit it takes L / (n h). Rounding down
is late by u, and one step more would win w:

    u = L / (n h) - L / v >= 0,        w = L / (n h) - L / ((n + 1) h) >= u

So each segment is written one step faster or not, such that the sum of all errors up to any segment stays within half
the largest w: error diffusion along the path. A speed that a unit says exactly has u = 0 and is left as it is.
"""

import numpy as np

from compgen.arrays import Array, BoolArray, IntArray
from compgen.dialects.fanuc_ls.write import EXACT, FEED_TOLERANCE, UNITS
from compgen.exceptions import InputError
from compgen.units import MM

STARTS = 9  # errors that each lane is tried with
_SLOWEST = 0.5  # of a wanted speed, below which a program cannot say it


def written_feeds(speed: Array, length: Array) -> Array:
    """Speeds that a program can say for wanted ones.

    The unit is the coarsest that says the speed exactly, else the coarsest whose step is at most 0.5 % of it, else the
    finest.

    Args:
        speed: Wanted, (S,) [m/s].
        length: Of the segments, (S,) [m].

    Returns:
        (S,) [m/s]; at most one step of the unit off the wanted.

    Raises:
        InputError: Slower or faster than any unit says.
    """
    step, number, highest, exact = _rounded_down(speed)
    low = number * step
    if len(speed) and np.any(low < _SLOWEST * speed):
        n = int(np.argmax(low < _SLOWEST * speed))
        raise InputError(
            f"waypoint {n + 2}: a speed of {speed[n] / MM:g} mm/s cannot be written on {length[n] / MM:.3g} mm"
            "; use 0.05 to 2000 mm/s"
        )
    free = ~exact & (number < highest)
    late = np.where(free | exact, length / low - length / speed, 0.0)  # what no unit says is not caught up
    win = np.where(free, length / low - length / (low + step), 0.0)
    return np.asarray((number + (diffused(late, win) & free)) * step)


def feed_errors(wanted: Array, written: Array, length: Array) -> tuple[float, float]:
    """Largest relative difference of a written speed from the wanted, and of the elapsed time anywhere [s]."""
    if not len(wanted):
        return 0.0, 0.0
    late = np.concatenate([[0.0], np.cumsum(length / written - length / wanted)])
    return float(np.abs(written / wanted - 1).max()), float(late.max() - late.min())


def diffused(late: Array, win: Array) -> BoolArray:
    """Which segments to write one step faster, so that lateness never adds up.

    Taken one after the other, a segment is made faster when that leaves the smaller error: the error then never leaves
    +-w/2 of the largest w. To do without a loop over segments they are cut into lanes, which run side by side, each
    from ``STARTS`` errors; a walk over the lanes then picks for each the start nearest to the error there. What that
    start is off is carried along, so it does not add up either.

    Args:
        late: Of each segment when rounded down, (S,) [s], from 0 to ``win``.
        win: What one step more wins, (S,) [s]; 0 where there is no step more.

    Returns:
        (S,); the error stays within w/2 + w/16 of the largest w.
    """
    S = len(late)
    if S == 0:
        return np.zeros(0, dtype=bool)
    width = int(np.ceil(np.sqrt(S)))
    lanes = -(-S // width)
    padded = np.zeros((2, lanes * width))
    padded[0, :S], padded[1, :S] = late, win
    u, w = padded.reshape(2, lanes, width)
    half = float(win.max()) / 2
    start = np.linspace(-half, half, STARTS)
    error = np.tile(start, (lanes, 1))  # (lanes, STARTS)
    faster = np.empty((width, lanes, STARTS), dtype=bool)
    for j in range(width):
        error = error + u[:, j, None]
        faster[j] = error > w[:, j, None] / 2
        error = error - np.where(faster[j], w[:, j, None], 0.0)
    chosen = np.zeros(lanes, dtype=np.int64)
    now = 0.0
    for k in range(lanes):
        chosen[k] = int(np.argmin(np.abs(start - now)))
        now += float(error[k, chosen[k]]) - float(start[chosen[k]])
    return np.asarray(faster[:, np.arange(lanes), chosen].T.reshape(-1)[:S])


def _rounded_down(speed: Array) -> tuple[Array, IntArray, IntArray, BoolArray]:
    """Each speed's unit step [m/s], how many of them, the most there are, and whether that is the speed, (S,) each."""
    steps = np.array([step for _, step, _, _ in UNITS])
    most = np.array([highest for _, _, _, highest in UNITS], dtype=np.int64)
    number = np.minimum(np.rint(speed[:, None] / steps).astype(np.int64), most)
    says = np.abs(number * steps - speed[:, None]) <= EXACT * speed[:, None]
    number = np.where(says, number, np.minimum((speed[:, None] / steps).astype(np.int64), most))
    fine = steps <= FEED_TOLERANCE * speed[:, None]
    exact = says.any(axis=1)
    unit = np.where(exact, np.argmax(says, axis=1), np.where(fine.any(axis=1), np.argmax(fine, axis=1), len(UNITS) - 1))
    rows = np.arange(len(speed))
    return steps[unit], number[rows, unit], most[unit], exact
