"""How long a robot may wait, servo on, before it moves on: until its warmth has changed by more than a drift allows."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.units import HOUR
from compgen.error_model.direction_memory import DirectionState
from compgen.error_model.model import ErrorModel
from compgen.job.job import Job
from compgen.thermal import Ambient
from compgen.thermal.model import advance

LONGEST = 16 * HOUR
SHORTEST = 60.0  # s, that the search begins with
HALVINGS = 40
OF_A_WAVE, OF_A_RAMP, LEAST_STEP = 1 / 16, 1200.0, 120.0  # how far the search looks ahead in air that moves: share, [s]
SAMPLES = 400  # waypoints that a window is judged at
TOGETHER = 64  # windows at a time


@dataclass(frozen=True, eq=False, slots=True)
class PromptMotion:
    """N places on a program's way as it is driven when nobody waits."""

    time: Array  # (N,) [s]
    theta: Array  # (N, 6) [rad] commanded
    rise: Array  # (N, K) [K]
    motion: DirectionState  # of the sources


def longest_waits(
    job: Job, model: ErrorModel, course: PromptMotion, first: IntArray, state: Array, together: int = TOGETHER
) -> Array:
    """How long the robot may wait at waypoints before that adds more than ``job.start_drift`` anywhere behind them.

    A delay changes the state there and the air on the way; both differences fade during what follows with each mode's
    rate. Every waypoint from there on is moved by what they do to the error.

    Args:
        job: For its heat, its air, and what standing does.
        model: The error.
        course: The whole program.
        first: Where the robot waits, (P,); each by itself, not one after the other.
        state: Thermal state there, (P, S).
        together: Places that are looked at side by side.

    Returns:
        (P,) [s]; at most ``LONGEST`` once it is reached.
    """
    parts = [slice(k, k + together) for k in range(0, len(first), together)]
    return np.concatenate([_windows(job, model, course, first[part], state[part]) for part in parts])


def _windows(job: Job, model: ErrorModel, course: PromptMotion, first: IntArray, state: Array) -> Array:
    """``longest_waits`` for a few places, by bisection of all at once."""
    samples = np.array([np.linspace(n, len(course.time) - 1, SAMPLES).astype(int) for n in first])  # (P, SAMPLES)
    rows = samples.ravel()
    begin, time = course.time[first], course.time[samples]
    now = model.actual_pose(course.theta[rows], course.rise[rows], course.motion.at(rows)).position

    def is_allowed(delay: Array, which: IntArray) -> Array:
        """Whether delays at some of the places are allowed."""
        rows = samples[which].ravel()
        late = late_rise(job, delay, time[which] - begin[which, None], state[which], job.clock + begin[which])
        rise = course.rise[rows] + late.reshape(len(rows), -1)
        moved = model.actual_pose(course.theta[rows], rise, course.motion.at(rows)).position
        drift = np.linalg.norm(moved.reshape(-1, SAMPLES, 3) - now.reshape(-1, SAMPLES, 3)[which], axis=2).max(axis=1)
        return np.asarray(drift <= job.start_drift)

    longest_step = _longest_step(job.history.air)
    low, high = np.zeros(len(first)), np.full(len(first), SHORTEST)
    unbounded, places = np.arange(len(first)), np.arange(len(first))
    while len(unbounded):
        unbounded = unbounded[is_allowed(high[unbounded], unbounded)]
        low[unbounded] = high[unbounded]
        high[unbounded] += np.minimum(high[unbounded], longest_step)
        unbounded = unbounded[low[unbounded] < LONGEST]
    bounded = places[low < LONGEST]
    low[low >= LONGEST] = LONGEST
    for _ in range(HALVINGS if len(bounded) else 0):
        middle = (low[bounded] + high[bounded]) / 2
        allowed = is_allowed(middle, bounded)
        low[bounded] = np.where(allowed, middle, low[bounded])
        high[bounded] = np.where(allowed, high[bounded], middle)
    return low


def _longest_step(air: Ambient) -> float:
    """How far apart delays may be that are looked at: in air that moves what a delay adds comes and goes [s]."""
    wave = OF_A_WAVE * air.period if air.amplitude else np.inf
    return max(min(wave, OF_A_RAMP if np.ptp(air.rise) else np.inf), LEAST_STEP)


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
    goal = heat.steady_state(job.history.standing)
    change = advance(heat.rate, state, goal, delay) - state
    later = np.exp(-time[..., None] * heat.rate)
    if job.history.air.is_still:
        return np.asarray((later * change[..., None, :]) @ heat.outputs.T)
    air = np.empty_like(later)
    for n, begin in np.ndenumerate(np.broadcast_to(clock, delay.shape)):
        behind = begin + delay[n]
        change[n] += heat.ambient * job.history.air.response(heat.rate, begin, np.array([behind]))[0]
        now, then = (job.history.air.response(heat.rate, start, start + time[n]) for start in (begin, behind))
        air[n] = heat.ambient * (then - now)
    return np.asarray((later * change[..., None, :] + air) @ heat.outputs.T)
