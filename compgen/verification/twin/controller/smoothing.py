r"""How a controller smooths a commanded motion: moving means, first-order lags, a delay, on samples of it.

In continuous time, with the weights' mean (how late a steady motion comes) and variance sigma^2,

    moving mean of window T          y(t) = (1 / T) integral of x over [t - T, t]        T / 2    T^2 / 12
    first-order lag of constant T    T dy/dt + y = x                                     T        T^2

Both are linear and keep a motion that stands; means and variances add up. A circle of radius R at speed v, turning at
w = v / R, is drawn smaller by R (1 - |H(w)|) ~ v^2 sigma^2 / (2 R): ln |H(w)| = - w^2 sigma^2 / 2 + O(w^4).

Rows x_k stand a step h apart; before the first the motion stands at it. A mean over n = T / h of them is the integral
by trapezoids, less what these have too much of a bend (after Euler and Maclaurin), with g_k = x_k - x_{k-1}:

    y_k = (C_k - C_{k-n} - b (g_k - g_{k-n+1})) / n,    C_k = sum_{j<=k} (x_{j-1} + x_j) / 2,    b = n / (12 (n - 1))

and a lag is y_k = r y_{k-1} + (1 - r) (b x_k + (1 - b) x_{k-1}), b = 1 / (1 - r) - T / h, r = exp(-h / T') with
T'^2 = T^2 - h^2 / 6, summed by doubling: S_{2j}(k) = S_j(k) + r^j S_j(k - j), no loop over samples. Mean and variance
of these weights are those above for every step, so a coarser one smooths bends alike. FANUC's motion code has two means
of whole periods: see docs/motion.md.
"""

from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array
from compgen.robot.motion import ControllerMotion

FADED = 40.0  # time constants after which what was before has left the digits


def smooth(rows: Array, step: float, motion: ControllerMotion, spread: Array | None = None) -> Array:
    """Rows as the controller smooths and delays them.

    Args:
        rows: Commanded, (M, C), a step apart; the motion stands at the first row before it.
        step: Between rows [s].
        motion: What the controller does.
        spread: How far the arm is spread on the line that leads to each row, (M,) [m2]: where the means grow by it,
            each line has its own and what they make of them adds up. Default as the motion's means.

    Returns:
        (M, C); what is still on its way after the last row is missing: end with its ``settling`` of rows that stand.
    """
    if motion.reach and spread is not None:
        moved = np.diff(rows, axis=0, prepend=rows[:1])
        gone, begins = np.zeros_like(moved), np.flatnonzero(np.diff(spread, prepend=np.nan))
        for first, after in zip(begins.tolist(), [*begins[1:].tolist(), len(rows)], strict=True):
            on_line = motion.on_line(float(spread[first]))
            end = after + int(np.ceil(on_line.settling / step)) + 2  # where nothing of it is under way
            steps = np.concatenate([np.zeros_like(moved[:1]), moved[first:after], np.zeros_like(moved[after:end])])
            gone[first:end] += smooth(steps, step, on_line)[1:]
        return np.asarray(rows[:1] + np.cumsum(gone, axis=0))
    for window in motion.moving_averages:
        rows = moving_mean(rows, window / step)
    for constant in motion.first_orders:
        rows = first_order(rows, constant / step)
    return delayed(rows, motion.lag / step)


def moving_mean(rows: Array, n: float) -> Array:
    """The mean of rows (M, C) over the n steps before each; n need not be whole, below one they are left."""
    if n < 1 or not len(rows):
        return rows
    m, M = int(n), len(rows)
    share, bent = n - m, n / (12 * n - 12) if n >= 2 else 0.0
    # by trapezoids, less what the rows bend by at both ends: weights of the rows around the first, and up to the last
    before, after = share**2 / 2 - bent * share, bent * (1 - share)
    x = np.zeros((m + 3 + M, rows.shape[1]))
    x[m + 3 :] = rows - rows[0]
    first = before * x[2 : 2 + M] + (0.5 + share - before - after) * x[3 : 3 + M] + after * x[4 : 4 + M]
    last = bent * x[m + 2 : m + 2 + M] - (0.5 + bent) * x[m + 3 :]
    total = np.cumsum(x, axis=0)
    return np.asarray((total[m + 3 :] - total[3 : 3 + M] + (first + last)) / n + rows[0])


def first_order(rows: Array, constant: float) -> Array:
    """Rows (M, C) behind a first-order lag of a time constant in steps; of less than one they are left."""
    if constant < 1 or not len(rows):
        return rows
    ratio = float(np.exp(-1 / np.sqrt(constant**2 - 1 / 6)))
    own = 1 / (1 - ratio) - constant  # share of a row in what comes in, the one before has the rest
    moved = rows - rows[:1]
    total = (1 - ratio) * (own * moved + (1 - own) * np.concatenate([moved[:1], moved[:-1]]))
    reach = 1
    while reach < min(FADED * constant, len(rows)):
        total[reach:] = total[reach:] + ratio**reach * total[:-reach]
        reach *= 2
    return np.asarray(rows[:1] + total)


def delayed(rows: Array, n: float) -> Array:
    """Rows (M, C) that come n steps late; n need not be whole."""
    if n <= 0 or not len(rows):
        return rows
    m = int(n)
    padded = np.concatenate([np.repeat(rows[:1], m + 1, axis=0), rows])[: len(rows) + 1]
    return np.asarray((1 - (n - m)) * padded[1:] + (n - m) * padded[:-1])


class Moments(NamedTuple):
    """Of a smoothing's weights."""

    delay: float  # [s] mean: how late a steady motion comes
    variance: float  # [s2] sigma^2


def moments(motion: ControllerMotion) -> Moments:
    """By how much a steady motion comes late, and sigma^2 of the pull v^2 sigma^2 / (2 R)."""
    means, lags = motion.moving_averages, motion.first_orders
    delay = sum(means) / 2 + sum(lags) + motion.lag
    return Moments(delay, sum(t * t for t in means) / 12 + sum(t * t for t in lags))


def coarser(motion: ControllerMotion, period: float, samples: int) -> float:
    """A step of whole periods [s] as coarse as leaves so many samples in the shortest time."""
    times = [t for t in (*motion.moving_averages, *motion.first_orders) if t > period]
    return period * max(1, int(min(times, default=period) / samples / period + 1e-9))
