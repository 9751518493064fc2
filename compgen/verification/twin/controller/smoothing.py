r"""How a controller smooths samples of a commanded motion: moving means, first-order lags, a delay.

Rows x_k stand a step h apart; before the first row the motion stands at it. A moving mean of window T = n h, n >= 1,

    y_k = (x_k + ... + x_{k-m+1} + (n - m) x_{k-m}) / n,      m = floor(n)

is two looks into one cumulative sum. A first-order lag of time constant T,

    y_k = r y_{k-1} + (1 - r) x_k,      r = exp(-h / T)

is summed by doubling, S_{2j}(k) = S_j(k) + r^j S_j(k - j): no loop over samples. Each is linear, keeps a motion that
stands, and delays one that goes steadily by its mean. With the mean and the variance of the weights

    moving mean       (n - 1) h / 2          (n^2 - 1) h^2 / 12  ~ T^2 / 12       (of whole n)
    first-order lag   r h / (1 - r)          r h^2 / (1 - r)^2   ~ T^2

variances add up to sigma^2, and a circle of radius R at speed v, turning at w = v / R, is drawn smaller by
R (1 - |H(w)|) ~ v^2 sigma^2 / (2 R): ln |H(w)| = - w^2 sigma^2 / 2 + O(w^4).

That controllers smooth so is an assumption that fits what is published of them; see docs/motion.md.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array
from compgen.robot.motion import ControllerMotion

SETTLED = 16.0  # time constants after which a first-order lag has come to rest: 0.1 um of a metre
FADED = 40.0  # time constants after which what was before has left the digits


def smooth(rows: Array, step: float, motion: ControllerMotion) -> Array:
    """Rows as the controller smooths and delays them.

    Args:
        rows: Commanded, (M, C), a step apart; the motion stands at the first row before it.
        step: Between rows [s], the interpolation period or a multiple of it.
        motion: What the controller does.

    Returns:
        (M, C); what is still on its way after the last row is missing: end with ``settling_time`` of rows that stand.
    """
    for window in motion.moving_averages:
        rows = moving_mean(rows, window / step)
    for constant in motion.first_orders:
        rows = first_order(rows, constant / step)
    return delayed(rows, motion.lag / step)


def moving_mean(rows: Array, n: float) -> Array:
    """The mean of each row (M, C) and those before it, n in all; n need not be whole, one and fewer leave it."""
    if n <= 1 or not len(rows):
        return rows
    m, M = int(n), len(rows)
    mean = np.empty_like(rows)
    total = np.zeros(m + 2 + M)
    for column, out in zip(rows.T, mean.T, strict=True):
        np.cumsum(column - column[0], out=total[m + 2 :])  # total[m + 1 + k] is the sum before row k
        out[:] = total[m + 2 :] - (1 - (n - m)) * total[2 : 2 + M] - (n - m) * total[1 : 1 + M]
        out /= n
        out += column[0]
    return mean


def first_order(rows: Array, constant: float) -> Array:
    """Rows (M, C) behind a first-order lag of a time constant in steps."""
    if constant <= 0 or not len(rows):
        return rows
    ratio = float(np.exp(-1.0 / constant))
    total = (1 - ratio) * (rows - rows[:1])
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


def settling_time(motion: ControllerMotion) -> float:
    """How long after the command the motion is still under way [s]."""
    return float(sum(motion.moving_averages) + SETTLED * sum(motion.first_orders) + motion.lag)


class Moments(NamedTuple):
    """Of a smoothing's weights."""

    delay: float  # [s] mean: how late a steady motion comes
    variance: float  # [s2] sigma^2


def moments(motion: ControllerMotion, step: float) -> Moments:
    """By how much a steady motion comes late, and sigma^2 of the pull v^2 sigma^2 / (2 R)."""
    delay, variance = motion.lag, 0.0
    for window in motion.moving_averages:
        mean, spread = _moments_of_mean(window / step)
        delay, variance = delay + mean * step, variance + spread * step**2
    for constant in motion.first_orders:
        if constant > 0:
            ratio = float(np.exp(-step / constant))
            delay, variance = delay + ratio * step / (1 - ratio), variance + ratio * step**2 / (1 - ratio) ** 2
    return Moments(delay, variance)


def _moments_of_mean(n: float) -> tuple[float, float]:
    """Mean and variance of the ages in a mean over n rows, in rows: (n - 1) / 2 and (n^2 - 1) / 12 of whole n."""
    n = max(n, 1.0)
    m = int(n)
    first, second = m * (m - 1) / 2 + (n - m) * m, m * (m - 1) * (2 * m - 1) / 6 + (n - m) * m * m
    return first / n, second / n - (first / n) ** 2


def gain(motion: ControllerMotion, frequency: Array, step: float) -> Array:
    r"""What the smoothing passes of a wave, \|H(w)\|, (F,), at frequencies w (F,) [rad/s]."""
    passed = np.ones_like(frequency, dtype=float)
    turn = np.exp(-1j * np.asarray(frequency) * step)
    for window in motion.moving_averages:
        n = max(window / step, 1.0)
        m = int(n)
        weights = np.append(np.ones(m), n - m) / n
        passed = passed * np.abs(np.polyval(weights[::-1], turn))
    for constant in motion.first_orders:
        if constant > 0:
            ratio = np.exp(-step / constant)
            passed = passed * np.abs((1 - ratio) / (1 - ratio * turn))
    return np.asarray(passed)


def coarser(motion: ControllerMotion, period: float, samples: int) -> tuple[float, ControllerMotion]:
    r"""A step as coarse as leaves so many samples in the shortest time, and the motion that smooths alike with it.

    Its windows and time constants are those whose weights have the same variance a step h apart as the controller's
    have a period p apart; of a time constant T' that is sinh(h / 2 T') / h = sinh(p / 2 T) / p. So the pull is the
    same along a bend; a corner wants the controller's own step.
    """
    times = [t for t in (*motion.moving_averages, *motion.first_orders) if t > period]
    ratio = max(1, int(min(times, default=period) / samples / period + 1e-9))
    if ratio == 1:
        return period, motion
    step = period * ratio
    windows = tuple(
        step * _rows_of_variance(_moments_of_mean(t / period)[1] / ratio**2) for t in motion.moving_averages
    )
    constants = tuple(
        float(step / (2 * np.arcsinh(ratio * np.sinh(period / (2 * t))))) if t > 0 else 0.0 for t in motion.first_orders
    )
    return step, replace(motion, moving_averages=windows, first_orders=constants)


def _rows_of_variance(variance: float) -> float:
    """Over how many rows a moving mean has this variance of ages, by bisection."""
    low, high = 1.0, 2 + np.sqrt(1 + 12 * variance)
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if _moments_of_mean(middle)[1] < variance else (low, middle)
    return float(high)
