r"""The direction that each joint, and the TCP, has come from: a state with a memory, known off-line.

Joint i that turns by d theta takes its state u_i towards the side it moves to (Dahl 1968),

    du_i = (sign(d theta_i) - u_i) |d theta_i| / w_i                        law "dahl"
    u_i <- min(max(u_i + d theta_i / w_i, -1), 1)                           law "play" (the play operator)

and keeps it while it stands, so that u does not depend on speed, stays within [-1, 1], and has no step at a reversal:
after it, by Dahl 63 % of the change is done over w_i, 95 % over 3 w_i, with play half over w_i and all over 2 w_i. At a
FINE stop u has the value of the motion before it;
a reversal there changes it during the motion after it. The TCP's travel t follows the unit vector e along its path over
a width W, dt = (e - t) ds / W. Before the first waypoint nothing is known and both are zero: they settle within three
widths of motion (``unknown_share`` says how much is still unknown).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compgen.core.arrays import Array, IntArray, owns
from compgen.error_model.source import DirectionDependent, Law, ReversalWidths, Source

ROUNDS = 12  # of directions by Dahl
STEEPEST = 0.02  # of a width: what is left of it where a joint loses as much as it turns


@dataclass(frozen=True, eq=False, slots=True)
@owns(direction=("N", 6), travel=("N", 3))
class DirectionState:
    """Direction of motion at N waypoints, or one row for all."""

    direction: Array  # (N, 6) [-1, 1] of the joints
    travel: Array  # (N, 3) [-1, 1] of the TCP along World axes

    def at(self, rows: slice | IntArray) -> "DirectionState":
        """Only these waypoints; one row serves all."""
        return self if len(self.direction) == 1 else DirectionState(self.direction[rows], self.travel[rows])


NO_DIRECTION = DirectionState(np.zeros((1, 6)), np.zeros((1, 3)))


def reversal_widths(sources: Sequence[Source]) -> ReversalWidths | None:
    """The shortest widths that some sources ask for; None when none depends on a direction."""
    widths = [source.reversal_widths() for source in sources if isinstance(source, DirectionDependent)]
    if not widths:
        return None
    law: Law = "play" if any(w.law == "play" for w in widths) else "dahl"
    return ReversalWidths(np.min([w.joint for w in widths], axis=0), np.min([w.travel for w in widths], axis=0), law)


def direction_states(
    widths: ReversalWidths | None, theta: Array, position: Array, before: DirectionState = NO_DIRECTION
) -> DirectionState:
    """Direction of motion along a program.

    Args:
        widths: From ``reversal_widths``; None gives no direction.
        theta: Planned joints, (N, 6) [rad].
        position: Planned TCP, (N, 3) [m].
        before: What the way to the first waypoint has made of u and t: its last row.

    Returns:
        u and t at each waypoint.
    """
    if widths is None:
        return NO_DIRECTION
    turn, step = np.diff(theta, axis=0), np.diff(position, axis=0)
    length = np.linalg.norm(step, axis=1, keepdims=True)
    tangent = step / np.where(length > 0, length, 1.0)
    if widths.law == "play":
        direction = play_operator(turn / widths.joint, before.direction[-1])
    else:
        direction = first_order_lag(np.sign(turn), np.exp(-np.abs(turn) / widths.joint), before.direction[-1])
    return DirectionState(direction, first_order_lag(tangent, np.exp(-length / widths.travel), before.travel[-1]))


def unknown_share(widths: ReversalWidths | None, theta: Array, position: Array) -> DirectionState:
    """How much of the unknown motion before the first waypoint is left in u and t, (N, 6) and (N, 3) [0, 1]."""
    if widths is None:
        return NO_DIRECTION
    length = np.linalg.norm(np.diff(position, axis=0, prepend=position[:1]), axis=1).cumsum()
    if widths.law == "play":  # how far the two farthest states before are still apart
        turn = np.diff(theta, axis=0) / widths.joint
        joint = (play_operator(turn, np.ones(6)) - play_operator(turn, -np.ones(6))) / 2
    else:
        joint = np.exp(-np.abs(np.diff(theta, axis=0, prepend=theta[:1])).cumsum(axis=0) / widths.joint)
    shares = joint, np.exp(-length[:, None] / widths.travel)
    return DirectionState(
        *(np.where(np.isinf(w), 0.0, x) for w, x in zip((widths.joint, widths.travel), shares, strict=True))
    )


def command_directions(
    sources: Sequence[Source], theta: Array, position: Array, made_up: DirectionState, before: DirectionState
) -> DirectionState:
    """Directions of a command that makes up for the play, as they are where it makes up for them.

    A joint that shall be at a is commanded c = a + b u, and u follows c. By the play operator, while u changes,

        w du = dc = da + b du,    so    du = da / (w - b)

    u follows a as it follows c, over the width w - b. By Dahl this is where some rounds begin, each a share of the way
    from u to the u of a + b u. Of joints that move by little more than their play the command turns round where a does
    not: the directions of a first command are not those of the next.

    Args:
        sources: Of the arm, one or more of which have a direction.
        theta: Joints c of a first command, (N, 6) [rad].
        position: Of its TCP, (N, 3) [m].
        made_up: Directions that it makes up for.
        before: What the way to it has made of them.
    """
    widths = reversal_widths(sources)
    half = sum((getattr(s, "backlash", 0.0) for s in sources), np.zeros(6))
    if widths is None:
        return made_up
    wanted, least = theta - half * made_up.direction, STEEPEST * widths.joint
    state = direction_states(replace(widths, joint=np.maximum(widths.joint - half, least)), wanted, position, before)
    for _ in range(ROUNDS if widths.law == "dahl" else 0):
        followed = direction_states(widths, wanted + half * state.direction, position, before)
        moved = (followed.direction - state.direction) / (1 + np.abs(half) / widths.joint)
        state = replace(followed, direction=state.direction + moved)
    return state


def play_operator(step: Array, start: Array | float) -> Array:
    """x_0 = start, x_{n+1} = min(max(x_n + step_n, -1), 1), for all n at once, (N - 1, k) to (N, k).

    Two such steps, one after the other, are one shift with two bounds again: composed in stretches as below.
    """
    shift = _in_stretches(step, 0.0)
    low, high = np.full_like(shift, -1.0), np.full_like(shift, 1.0)
    for n in range(1, len(shift)):
        low[n], high[n] = (np.clip(bound[n - 1] + shift[n], -1, 1) for bound in (low, high))
        shift[n] += shift[n - 1]
    return _states(lambda x, at: np.clip(x + shift[at], low[at], high[at]), start, len(step), shift.shape)


def first_order_lag(goal: Array, keep: Array, start: Array | float) -> Array:
    """x_0 = start, x_{n+1} = goal_n + keep_n (x_n - goal_n), for all n at once, (N - 1, k) to (N, k).

    Each step is an affine map. The steps are cut into about sqrt(N) stretches of equal length: all stretches are
    composed side by side, then the state at the end of each is handed to the next.
    """
    factor, offset = _in_stretches(np.broadcast_to(keep, goal.shape), 1.0), _in_stretches((1 - keep) * goal, 0.0)
    for n in range(1, len(factor)):
        offset[n] += factor[n] * offset[n - 1]
        factor[n] *= factor[n - 1]
    return _states(lambda x, at: offset[at] + factor[at] * x, start, len(goal), factor.shape)


def _in_stretches(rows: Array, pad: float) -> Array:
    """Rows (N, k) in about sqrt(N) stretches, side by side: (in the stretch, stretch, k); the last is filled up."""
    steps, k = rows.shape
    size = max(1, int(np.sqrt(steps)))
    count = -(-steps // size)
    padded = np.full((count * size, k), pad)
    padded[:steps] = rows
    return np.swapaxes(padded.reshape(count, size, k), 0, 1).copy()


def _states(composed: Callable[[Array, Any], Array], start: Array | float, steps: int, shape: tuple[int, ...]) -> Array:
    """x at the start and after each of ``steps`` steps, (steps + 1, k).

    Args:
        composed: x after the steps of its stretch up to ``at``, of the x that the stretch begins with.
        start: x_0.
        steps: N.
        shape: Of ``_in_stretches``.
    """
    _, count, k = shape
    begin = np.empty((count + 1, k))
    begin[0] = start
    for n in range(count):
        begin[n + 1] = composed(begin[n], (-1, n))
    x = np.empty((steps + 1, k))
    x[0] = start
    x[1:] = np.swapaxes(composed(begin[:-1], ...), 0, 1).reshape(-1, k)[:steps]
    return x
