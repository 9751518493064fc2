r"""When a program passes its positions: CNT through the points at the written speeds, ramps from and to its stops.

A ramp to speed v takes v / a + a / j, or 2 sqrt(v / j) where a is not reached, half of which is lost against driving at
v; a run too short for both reaches the speed p with p^2 / a + p a / j its length, or 2 p sqrt(p / j), and takes twice
the ramp to it. a and j are what the joints allow along the path at the stop.
"""

from typing import NamedTuple

import numpy as np

from tests.audit import study


def ramp(speed, a, j):
    """Time from rest to speeds, (M,) [s]."""
    return np.where(speed * j > a * a, speed / a + a / j, 2 * np.sqrt(speed / j))


class Passages(NamedTuple):
    """When a program of N positions passes them, and how fast it drives between."""

    time: np.ndarray  # (N,) [s]
    driven: np.ndarray  # (N - 1,) [mm/s] mean
    ramps: np.ndarray  # (R, 2) [mm] length of the ramps from and to the stops of each run


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
    time, driven, lost = np.zeros(len(stop)), np.empty(len(speed)), []
    for first, last in zip(stops[:-1], stops[1:]):
        run, ends = slice(first, last), np.array([first, last - 1])
        v, a, j = speed[ends], a_all[ends], j_all[ends]
        total, cruise = length[run].sum(), (length[run] / speed[run]).sum()
        ramps = ramp(v, a, j)
        lost.append((v * ramps / 2).tolist())
        if sum(lost[-1]) < total:
            taken = cruise + ramps.sum() / 2
        else:
            a, j = a.min(), j.min()
            peak = (-a * a / j + np.sqrt((a * a / j) ** 2 + 4 * a * total)) / 2
            peak = peak if peak * j > a * a else (total**2 * j / 4) ** (1 / 3)
            taken = 2 * float(ramp(np.array(min(peak, v.min())), a, j))
        driven[run] = speed[run] * cruise / taken
        time[first + 1 : last + 1] = time[first] + np.cumsum(length[run] / driven[run])
    return Passages(time, driven, np.array(lost))
