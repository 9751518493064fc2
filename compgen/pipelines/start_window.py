"""How long a robot may wait, servo on, before it moves on: until its warmth has changed by more than a drift allows."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.units import HOUR
from compgen.error_model.model import ErrorModel
from compgen.error_model.sources import DirectionState
from compgen.pipelines.job import Job

LONGEST = 16 * HOUR
SHORTEST = 60.0  # s, that the search begins with
HALVINGS = 40
SAMPLES = 400  # waypoints that a window is judged at
TOGETHER = 64  # windows at a time


@dataclass(frozen=True, eq=False, slots=True)
class Course:
    """A program as it is driven when nobody waits."""

    time: Array  # (N,) [s]
    theta: Array  # (N, 6) [rad] commanded
    rise: Array  # (N, K) [K]
    motion: DirectionState  # of the sources


def windows(job: Job, model: ErrorModel, course: Course, first: IntArray, state: Array) -> Array:
    """How long the robot may wait at waypoints before that adds more than ``job.start_drift`` anywhere behind them.

    A delay changes the state there and the air on the way; both differences fade during what follows with each mode's
    rate. Every waypoint from there on is moved by what they do to the error.

    Args:
        job: For its heat, its air, and what standing does.
        model: The error.
        course: The whole program.
        first: Where the robot waits, (P,); each by itself, not one after the other.
        state: Thermal state there, (P, S).

    Returns:
        (P,) [s]; at most ``LONGEST`` once it is reached.
    """
    parts = [slice(k, k + TOGETHER) for k in range(0, len(first), TOGETHER)]
    return np.concatenate([_windows(job, model, course, first[part], state[part]) for part in parts])


def _windows(job: Job, model: ErrorModel, course: Course, first: IntArray, state: Array) -> Array:
    """The same, searched for side by side."""
    some = np.array([np.linspace(n, len(course.time) - 1, SAMPLES).astype(int) for n in first])  # (P, SAMPLES)
    begin, time = course.time[first], course.time[some]
    now, _ = model.actual_pose(course.theta[some.ravel()], course.rise[some.ravel()], course.motion.at(some.ravel()))

    def holds(delay: Array, which: IntArray) -> Array:
        """Whether delays at some of the places are allowed."""
        rows = some[which].ravel()
        late = late_rise(job, delay, time[which] - begin[which, None], state[which], job.clock + begin[which])
        rise = course.rise[rows] + late.reshape(len(rows), -1)
        moved, _ = model.actual_pose(course.theta[rows], rise, course.motion.at(rows))
        drift = np.linalg.norm(moved.reshape(-1, SAMPLES, 3) - now.reshape(-1, SAMPLES, 3)[which], axis=2).max(axis=1)
        return np.asarray(drift <= job.start_drift)

    low, high = np.zeros(len(first)), np.full(len(first), SHORTEST)
    open_, places = np.arange(len(first)), np.arange(len(first))
    while len(open_):
        open_ = open_[holds(high[open_], open_)]
        low[open_], high[open_] = high[open_], 2 * high[open_]
        open_ = open_[low[open_] < LONGEST]
    found = places[low < LONGEST]
    low[low >= LONGEST] = LONGEST
    for _ in range(HALVINGS if len(found) else 0):
        middle = (low[found] + high[found]) / 2
        allowed = holds(middle, found)
        low[found] = np.where(allowed, middle, low[found])
        high[found] = np.where(allowed, high[found], middle)
    return low


def late_rise(job: Job, delay: Array | float, time: Array, state: Array, clock: Array | float) -> Array:
    """What a start delayed by ``delay`` [s] adds to the rises after it, for any number of starts at once.

    Args:
        job: For its heat, its air, and what standing does.
        delay: (...,) [s].
        time: From the start on, (..., M) [s].
        state: In which the robot begins to wait, (..., S).
        clock: When it does, from the first duty on, (...,) [s].

    Returns:
        (..., M, K) [K].
    """
    heat, delay = job.heat, np.asarray(delay)
    goal = heat.goal(job.standing)
    change = goal + (state - goal) * np.exp(-delay[..., None] * heat.rate) - state
    later = np.exp(-time[..., None] * heat.rate)
    if job.air.is_still:
        return np.asarray((later * change[..., None, :]) @ heat.outputs.T)
    air = np.empty_like(later)
    for n, begin in np.ndenumerate(np.broadcast_to(clock, delay.shape)):
        behind = begin + delay[n]
        change[n] += heat.ambient * job.air.response(heat.rate, begin, np.array([behind]))[0]
        now, then = (job.air.response(heat.rate, start, start + time[n]) for start in (begin, behind))
        air[n] = heat.ambient * (then - now)
    return np.asarray((later * change[..., None, :] + air) @ heat.outputs.T)
