r"""When a program passes its positions: CNT through the points at the written speeds, ramps where the speed changes.

A change of speed by D takes D / a + a / j, or 2 sqrt(D / j) where a is not reached, at an even acceleration of D over
that time, on the faster side of where the written speed changes. a and j are what the joints allow along the path where
it begins (upwards) or ends (downwards). Words that go on rising are one change while the lines are too short for their
part of it; a change that the next one breaks off is as large as it gets. Line by line, run by run, in plain numbers.
Each line then takes the next whole number of interpolation periods.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np

from audit import study

NO_CHANGE, FALLS = 1.005, 0.995  # one word over the one before, between which it is rounding
ROUNDS = 80
SAME = 1e-6  # of a period: a line that lasts longer by less is as long


def ramp(speed, a, j):
    """Time of a change of speed [s]."""
    return speed / a + a / j if speed * j > a * a else 2 * sqrt(speed / j)


class Passages(NamedTuple):
    """When a program of N positions passes them, and how fast it drives between."""

    time: np.ndarray  # (N,) [s]
    driven: np.ndarray  # (N - 1,) [mm/s] mean
    steady: np.ndarray  # (N - 1,) [mm] of each line that is driven at its written speed


def passages(length, speed, stop, theta):
    """When a program passes its positions.

    Args:
        length: Of the lines between N positions, (N - 1,) [mm].
        speed: Written, (N - 1,) [mm/s].
        stop: Where the robot stops, (N,).
        theta: (N, 6) [rad].
    """
    stops = np.flatnonzero(stop)
    slope = np.abs(np.diff(theta, axis=0)) / np.maximum(length, 1e-6)[:, None] + 1e-15  # rad/mm
    a_all = study.RAMP_ACCELERATION * (np.radians(study.ACCELERATION_DEG_S2) / slope).min(axis=1)
    j_all = study.RAMP_JERK * (np.radians(study.JERK_DEG_S3) / slope).min(axis=1)
    taken, steady = np.empty(len(speed)), np.empty(len(speed))
    for first, last in zip(stops[:-1], stops[1:], strict=True):
        lines = [x[first:last].tolist() for x in (np.maximum(length, 1e-6), speed, a_all, j_all)]
        taken[first:last], steady[first:last] = drive(*lines)
    taken = study.PERIOD_S * np.maximum(np.ceil(taken / study.PERIOD_S - SAME), 1.0)
    return Passages(np.concatenate([[0.0], np.cumsum(taken)]), np.maximum(length, 1e-6) / taken, steady)


def drive(length, speed, a, j):
    """Time and steady length of each line of a run from stop to stop, lists."""
    up, down = changes(length, speed, a, j), changes(*(x[::-1] for x in (length, speed, a, j)))
    for _ in range(ROUNDS):
        gain = accelerations(up, a, j)
        loss = accelerations(down, a[::-1], j[::-1])[::-1]
        at = [0.0]
        for n, L in enumerate(length):
            limit = min(speed[n], speed[n + 1]) if n + 1 < len(speed) else 0.0
            at.append(min(limit, sqrt(at[n] ** 2 + 2 * gain[n] * L)))
        for n in reversed(range(len(length))):
            at[n] = min(at[n], sqrt(at[n + 1] ** 2 + 2 * loss[n] * length[n]))
        peak = []
        for n, L in enumerate(length):
            # where the line of rising speed and that of falling speed meet: at x from the line's start
            x = (at[n + 1] ** 2 - at[n] ** 2 + 2 * loss[n] * L) / 2 / (gain[n] + loss[n])
            peak.append(min(speed[n], max(at[n], at[n + 1], sqrt(max(0.0, at[n] ** 2 + 2 * gain[n] * x)))))
        more, fewer = reach(up, at[:-1], peak), reach(down, at[:0:-1], peak[::-1])
        settled = all(abs(b[1] - d[1]) <= 1e-10 * d[1] for b, d in zip(more + fewer, up + down, strict=True))
        up, down = more, fewer
        if settled:
            break
    time, steady = [], []
    for n, L in enumerate(length):
        rise, fall = peak[n] - at[n], peak[n] - at[n + 1]
        rest = max(0.0, L - rise * (peak[n] + at[n]) / 2 / gain[n] - fall * (peak[n] + at[n + 1]) / 2 / loss[n])
        time.append(rise / gain[n] + fall / loss[n] + rest / peak[n])
        steady.append(rest if peak[n] > speed[n] * (1 - 1e-9) else 0.0)
    return time, steady


def changes(length, speed, a, j):
    """Pairs of the line where the speed begins to rise, and by how much it rises without a pause."""
    pairs: list[list[float]] = []
    start = before = under_way = 0.0
    for n, v in enumerate(speed):
        if v < before * FALLS:
            under_way = 0.0
        if v > before * NO_CHANGE:
            if under_way > 0:
                pairs[-1][1] = v - start
            else:
                pairs.append([n, v - before])
                start = before
            under_way = (v + before) / 2 * ramp(v - before, a[n], j[n])
        under_way -= length[n]
        before = v
    return pairs


def accelerations(pairs, a, j):
    """The acceleration on each line: that of the last change that began."""
    starts = [n for n, _ in pairs] + [len(a)]
    each = []
    for (n, rise), end in zip(pairs, starts[1:], strict=False):
        each += [rise / ramp(rise, a[n], j[n])] * (end - n)
    return each


def reach(pairs, start, peak):
    """The changes with what they come to before the next one begins."""
    ends = [n for n, _ in pairs[1:]] + [len(peak)]
    return [[n, min(rise, max(max(peak[n:end]) - start[n], 1e-6))] for (n, rise), end in zip(pairs, ends, strict=True)]
