r"""Speeds as a program can say them, the rounding of each made good by those that follow.

A segment of length L and wanted speed v takes L / v; at n steps h of the chosen unit it takes L / (n h). Rounding down
is late by u, and one step more would win w:

    u = L / (n h) - L / v >= 0,        w = L / (n h) - L / ((n + 1) h) >= u

So each segment is written one step faster or not, such that the sum of all errors up to any segment stays within half
the largest w: error diffusion along the path. A speed that a unit says exactly has u = 0 and is left as it is.
"""

import numpy as np

from compgen.core.arrays import Array, BoolArray, cumulated
from compgen.core.evaluation import map_rows
from compgen.core.exceptions import InputError
from compgen.core.units import INCH, MINUTE, MM

FEED_TOLERANCE = 0.005  # a unit is fine enough when it meets the speed this nearly
EXACT = 1e-6  # so near, a unit says the speed itself
STARTS = 9  # errors that each lane is tried with
_SLOWEST = 0.5  # of a wanted speed, below which a program cannot say it

#: unit, m/s of one step, decimals, highest value
UNITS = (("mm/sec", MM, 0, 2000), ("cm/min", 10 * MM / MINUTE, 0, 12000), ("inch/min", 0.1 * INCH / MINUTE, 1, 47244))


def speed_text(speed: float) -> str:
    """The coarsest unit that says a speed [m/s] well enough, never faster than asked.

    Raises:
        InputError: Slower or faster than any unit says.
    """
    choices = [
        (unit, step, decimals, min(int(speed / step + 1e-6), highest)) for unit, step, decimals, highest in UNITS
    ]
    texts = [(f"{n * 10.0**-decimals:.{decimals}f}{unit}", n * step) for unit, step, decimals, n in choices]
    best = max(texts, key=lambda s: s[1])
    for tolerance in (FEED_TOLERANCE, EXACT):  # an exact unit comes before a fine enough one
        best = next((s for s in texts if abs(s[1] - speed) <= tolerance * speed), best)
    if best[1] < _SLOWEST * speed:
        raise InputError(f"program: a speed of {speed / MM:g} mm/s cannot be written; use 0.05 to 2000 mm/s")
    return best[0]


def parse_speed(text: str) -> float:
    """m/s of a speed's text."""
    for unit, step, decimals, _ in UNITS:
        if text.endswith(unit):
            return float(text[: -len(unit)]) * step * 10.0**decimals
    raise ValueError(text)


def writable_speed(speed: float) -> float:
    """The speed that a program says for a wanted one [m/s].

    Raises:
        InputError: Slower or faster than any unit says.
    """
    return parse_speed(speed_text(speed))


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
    if not len(speed):
        return np.zeros(0)
    number, step, late, win, free = map_rows(_rounded_down, speed, length).T
    slow = number * step < _SLOWEST * speed
    if slow.any():
        n = int(np.argmax(slow))
        raise InputError(
            f"waypoint {n + 2}: a speed of {speed[n] / MM:g} mm/s cannot be written on {length[n] / MM:.3g} mm"
            "; use 0.05 to 2000 mm/s"
        )
    return np.asarray((number + (diffuse_errors(late, win) & (free > 0))) * step)


def feed_errors(wanted: Array, written: Array, length: Array) -> tuple[float, float]:
    """Largest relative difference of a written speed from the wanted, and of the elapsed time anywhere [s]."""
    if not len(wanted):
        return 0.0, 0.0
    late = cumulated(length / written - length / wanted)
    return float(np.abs(written / wanted - 1).max()), float(late.max() - late.min())


def diffuse_errors(late: Array, win: Array) -> BoolArray:
    """Which segments to write one step faster, so that lateness never adds up.

    Taken one after the other, a segment is made faster when that leaves the smaller error: the error then never leaves
    +-w/2 of the largest w. To do without a loop over segments they are cut into lanes, which run side by side, each
    from ``STARTS`` errors; a walk over the lanes then picks for each the start nearest to the error there. What that
    start is off is carried along, so it does not add up either.

    Args:
        late: Of each segment when rounded down, (S,) [s], from 0 to ``win``; one at least.
        win: What one step more wins, (S,) [s]; 0 where there is no step more.

    Returns:
        (S,); the error stays within w/2 + w/16 of the largest w.
    """
    S = len(late)
    width = int(np.ceil(np.sqrt(S)))
    lanes = -(-S // width)
    padded = np.zeros((2, lanes * width))
    padded[0, :S], padded[1, :S] = late, win
    u, w = np.ascontiguousarray(padded.reshape(2, lanes, width).transpose(0, 2, 1))  # (width, lanes)
    half = float(win.max()) / 2
    start = np.linspace(-half, half, STARTS)
    error = np.repeat(start[:, None], lanes, axis=1)  # (STARTS, lanes)
    faster = np.empty((width, STARTS, lanes), dtype=bool)
    for late_row, win_row, faster_row in zip(u, w, faster, strict=True):
        error += late_row
        np.greater(error, win_row / 2, out=faster_row)
        error -= faster_row * win_row
    best_start = np.zeros(lanes, dtype=np.int64)
    error_so_far = 0.0
    for k in range(lanes):
        best_start[k] = int(np.argmin(np.abs(start - error_so_far)))
        error_so_far += float(error[best_start[k], k]) - float(start[best_start[k]])
    return np.asarray(faster[:, best_start, np.arange(lanes)].T.reshape(-1)[:S])


_STEPS = np.array([step for _, step, _, _ in UNITS])
_MOST = np.array([float(highest) for _, _, _, highest in UNITS])


def _rounded_down(speed: Array, length: Array) -> Array:
    """Each speed as steps of its unit: how many, the step [m/s], lateness and win [s], if one more may be; (S, 5)."""
    unit = np.full(len(speed), len(UNITS) - 1)
    for k in reversed(range(len(UNITS))):
        np.copyto(unit, k, where=_STEPS[k] <= FEED_TOLERANCE * speed)
    exact = np.zeros(len(speed), dtype=bool)
    for k in reversed(range(len(UNITS))):
        nearest = np.minimum(np.rint(speed / _STEPS[k]), _MOST[k])
        says = np.abs(nearest * _STEPS[k] - speed) <= EXACT * speed
        np.copyto(unit, k, where=says)
        exact |= says
    step, most = _STEPS[unit], _MOST[unit]
    number = speed / step
    number = np.minimum(np.where(exact, np.rint(number), np.trunc(number)), most)
    low = number * step
    free = ~exact & (number < most)
    with np.errstate(divide="ignore", invalid="ignore"):  # none is so slow that its number is 0: that is refused
        late = np.where(free | exact, length / low - length / speed, 0.0)  # what no unit says is not caught up
        win = np.where(free, length / low - length / (low + step), 0.0)
    return np.column_stack([number, step, late, win, free])
