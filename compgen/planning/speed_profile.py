r"""Changes of speed along the arc with limited acceleration and jerk, for many blocks at once.

Every block begins and ends with zero acceleration. A change of speed by dv takes

    T = 2 sqrt(dv / j) up to dv = a^2 / j,    else T = dv / a + a / j,        over (v0 + v1) / 2 T of path

and a block goes up to the highest speed it can still leave at its end, holds it, and goes down. ruckig solves a sample
of the blocks of every run again, state to state, and must need the same time.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.exceptions import ImpossibleError
from compgen.planning.ruckig_check import first_mismatch

TINY = 1e-300  # keeps divisors from being zero
ROUNDS = 60  # of a root's search


@dataclass(frozen=True, eq=False, slots=True)
class Blocks:
    """B stretches of path: where, how long, the speeds at both ends, and the limits inside."""

    start: Array  # (B,) [m]
    length: Array  # (B,) [m]
    v0: Array  # (B,) [m/s] at the start
    v1: Array  # (B,) [m/s] at the end
    v: Array  # (B,) [m/s] at most
    a: Array  # (B,) [m/s2] at most
    j: Array  # (B,) [m/s3] at most


def change_duration(dv: Array, a: Array, j: Array) -> Array:
    """Time of a change of speed by dv >= 0 [m/s] within acceleration a and jerk j, (B,) [s]."""
    return np.where(dv > a * a / j, dv / a + a / j, 2 * np.sqrt(dv / j))


def reachable_speed(v0: Array, length: Array, a: Array, j: Array) -> Array:
    """Highest speed at the end of a length, from v0, with zero acceleration at both ends [m/s].

    (v0 + dv / 2) T = length: a square where a is reached, else j x^3 + 2 v0 x = length with x = sqrt(dv / j).
    """
    edge = a * a / j
    reaches_a = (v0 + edge / 2) * 2 * a / j < length
    p = 2 * v0 + edge
    root = np.maximum(p * p - 4 * (2 * v0 * a * a / j - 2 * length * a), 0.0)
    x = np.where(reaches_a, 0.0, a / j)
    for _ in range(ROUNDS):  # Newton from above
        step = np.where(reaches_a, 0.0, (j * x * x * x + 2 * v0 * x - length) / (3 * j * x * x + 2 * v0 + TINY))
        x = x - step
        if not np.any(np.abs(step) > 1e-15 * x):
            break
    return (v0 + np.where(reaches_a, (-p + np.sqrt(root)) / 2, j * x * x)) * (1 - 1e-9)


def rising_root(f: Callable[[Array], tuple[Array, Array]], low: Array, high: Array, guess: Array) -> Array:
    """Roots of rising functions between bounds, (K,): Newton's steps, halving the bounds where they lead outside.

    Args:
        f: Value and slope at (K,).
        low: Where no value is above zero, (K,).
        high: Where none is below, (K,).
        guess: Where to begin, (K,).
    """
    x = guess
    for _ in range(ROUNDS):
        value, slope = f(x)
        low, high = np.where(value < 0, x, low), np.where(value < 0, high, x)
        with np.errstate(divide="ignore", invalid="ignore"):
            new = x - value / slope
        new = np.where((new >= low) & (new <= high), new, (low + high) / 2)
        converged = np.abs(new - x) <= 1e-15 * high
        x = new
        if converged.all():
            break
    return x


def constant_jerk_phases(blocks: Blocks) -> tuple[Array, Array, Array, Array, Array, IntArray]:
    """Stretches of constant jerk in order: duration, s, v, a and j at the start, and the block, (P,) each.

    Raises:
        ImpossibleError: A block cannot be driven between its speeds, or ruckig finds another time.
    """
    b = blocks
    top = np.maximum(b.v0, b.v1)
    impossible = np.flatnonzero(_length_needed(b, top)[0] > b.length * (1 + 1e-9))
    if len(impossible):
        s = b.start[impossible[0]]
        raise ImpossibleError(
            f"timing: no motion at {s:.4f} m along the path within the joint limits; lower process.feed_mm_s"
        )
    peak = np.maximum(b.v, top)
    tight = np.flatnonzero(_length_needed(b, peak)[0] > b.length)
    if len(tight):
        tight_blocks = Blocks(*(getattr(b, name)[tight] for name in Blocks.__slots__))

        def excess(peak: Array) -> tuple[Array, Array]:
            length, slope = _length_needed(tight_blocks, peak)
            return length - tight_blocks.length, slope

        root = rising_root(excess, top[tight], peak[tight], peak[tight])
        peak[tight] = np.maximum(top[tight], root * (1 - 4e-15))  # below the root, where the block surely holds it

    up, down = (_jerk_times(peak - v, b.a, b.j) for v in (b.v0, b.v1))
    hold = np.maximum(b.length - _length_needed(b, peak)[0], 0.0) / peak
    times = np.column_stack([up[0], up[1], up[0], hold, down[0], down[1], down[0]])
    jerk = np.multiply.outer(b.j, np.array([1.0, 0, -1, 0, -1, 0, 1]))
    _check(b, peak, times.sum(axis=1))
    s, v, a = b.start, b.v0, np.zeros(len(b.v0))
    states = np.empty((len(b.v0), 7, 3))
    for k in range(7):
        if k == 3:  # exactly, where nothing changes
            v, a = peak, np.zeros_like(a)
        t, j = times[:, k], jerk[:, k]
        states[:, k] = np.column_stack([s, v, a])
        s = s + t * (v + t * (a / 2 + t * j / 6))
        v, a = v + t * (a + t * j / 2), a + t * j
        if k in (2, 6):
            a = np.zeros_like(a)
    keep = np.flatnonzero(times.ravel() > 0)
    s, v, a = states.reshape(-1, 3)[keep].T
    return times.ravel()[keep], s, v, a, jerk.ravel()[keep], keep // 7


def _length_needed(b: Blocks, peak: Array) -> tuple[Array, Array]:
    """Length that going up to a speed and down again takes [m], and how it grows with that speed [s]."""
    length, slope = np.zeros_like(peak), np.zeros_like(peak)
    for v in (b.v0, b.v1):
        time = change_duration(peak - v, b.a, b.j)
        time_slope = 1 / np.maximum(np.minimum(b.a, np.sqrt(b.j * (peak - v))), TINY)
        length += (v + peak) / 2 * time
        slope += time / 2 + (v + peak) / 2 * time_slope
    return length, slope


def _jerk_times(dv: Array, a: Array, j: Array) -> tuple[Array, Array]:
    """Time of the jerk, and of the constant acceleration between its two halves [s]."""
    reaches_a = dv > a * a / j
    return np.where(reaches_a, a / j, np.sqrt(dv / j)), np.where(reaches_a, dv / a - a / j, 0.0)


def _check(b: Blocks, peak: Array, time: Array) -> None:
    """Raises ImpossibleError where ruckig, solving some blocks again, refuses or needs another time."""
    mismatch = first_mismatch(b.length, b.v0, b.v1, b.v, peak, b.a, b.j, time)
    if mismatch is not None:
        raise _impossible(b.start[mismatch.block], mismatch.reason)


def _impossible(s: float, reason: str) -> ImpossibleError:
    return ImpossibleError(
        f"timing: no motion at {s:.4f} m along the path within the joint limits: {reason}; lower process.feed_mm_s"
    )
