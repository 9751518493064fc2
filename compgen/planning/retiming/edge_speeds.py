r"""Speeds at the edges of blocks: one pass forwards and one back over blocks with their own limits.

ruckig drives one block from state to state; which speeds it may have at its edges follows from all the others. With
zero acceleration at every edge, a change of speed by dv within acceleration a and jerk j takes

    T = 2 sqrt(dv / j) up to dv = a^2 / j,    else T = dv / a + a / j,        over (v0 + v1) / 2 T of path
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray

TINY = 1e-300  # keeps divisors from being zero
ROUNDS = 60  # of Newton's steps
FIT = 1 - 1e-9  # of the highest speed, so that a block holds its change of speed in spite of rounding


@dataclass(frozen=True, eq=False, slots=True)
class BlockLimits:
    """What B blocks allow."""

    length: Array  # (B,) [m]
    v: Array  # (B,) [m/s]
    a: Array  # (B,) [m/s2]
    j: Array  # (B,) [m/s3]


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
    return np.maximum(v0, (v0 + np.where(reaches_a, (-p + np.sqrt(root)) / 2, j * x * x)) * FIT)


def edge_speeds(limits: BlockLimits, first: IntArray) -> Array:
    """Speed at the start of each block, and zero at the end of the last, (B + 1,) [m/s].

    Zero at the stops, and every change possible within its block. A block's end follows from its start, so the blocks
    after one that changed are computed again, all at once.

    Args:
        limits: Of the blocks.
        first: The first block after each stop, (R,).
    """
    length, V, A, J = limits.length, limits.v, limits.a, limits.j
    B = len(V)
    is_first, is_last = np.zeros(B, dtype=bool), np.zeros(B, dtype=bool)
    is_first[first] = True
    is_last[np.append(first[1:], B) - 1] = True
    v = np.concatenate([[0.0], np.minimum(V[:-1], V[1:]), [0.0]])  # v[b] at the start of block b
    v[first] = 0.0
    for step, bound in ((1, is_last), (-1, is_first)):
        goal = v.copy()
        todo = np.arange(B)
        while len(todo):
            near, far = (todo, todo + 1) if step > 0 else (todo + 1, todo)
            rises = goal[far] > v[near]
            new = goal[far].copy()
            rising = todo[rises]
            new[rises] = np.minimum(new[rises], reachable_speed(v[near[rises]], length[rising], A[rising], J[rising]))
            changed = new != v[far]
            v[far[changed]] = new[changed]
            todo = todo[changed & ~bound[todo]] + step
    return v
