r"""Where a program comes from: one move onto the path that leaves no joint on an unknown side of its play.

A joint with play stands on the side from which it has last turned. Before a program's first waypoint nobody knows which
that is, and an approach along the tool axis turns some joints against the way they will go on, others not at all. On a
lead-in joint i turns from theta_i(0) - s_i m_i to theta_i(0), all of them together and each one way only. The amounts m
are the smallest that run the play through and let the TCP come from above the part:

    min sum_i m_i      with   m_i >= least_i,      -n^T J (s m) >= lift,      J = d TCP / d theta

s_i is the side to which the path itself turns the joint first, so that it goes on as it came; a joint that the path
does not turn goes to the side that lifts. Where the arm cannot come from there (a limit, a singularity, the reach) the
nearest other choice of sides is taken: as well known, but with a reversal where the path begins. The move is one line
of the TCP, along which the tool turns upright.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from compgen.core.arrays import Array, BoolArray, owns
from compgen.core.pose import Pose
from compgen.core.rotations import rotation_vector
from compgen.planning import curves
from compgen.planning.exact_path import ExactPath

STILL = 1e-4  # [rad] a joint that turns less is not turned by the path
MAX_TURN = 0.5  # [rad] of any joint on the lead-in
STEP = 1e-6  # [rad] of the differences that J is made of
ROUNDS = 6  # in which what J does not see of lift and length is made up
NEAR = 1e-4  # [m] of them that need not be made up
SAMPLES = np.linspace(0, 1, 21)  # of the line, where the arm is asked whether it can drive it


@dataclass(frozen=True, eq=False, slots=True)
@owns(start=(3,), tilt=(3,))
class LeadIn:
    """The line on which a program comes to its path, in the local frame of the path's surface."""

    start: Array  # (3,) [m] x, y along the surface and the height above it, where the line begins
    tilt: Array  # (3,) [-] of the tool there, in its own axes: a Gibbs vector, as ``curves.tilted`` takes it


@dataclass(frozen=True, eq=False, slots=True)
class LeadInArm:
    """What a lead-in asks of the arm."""

    tcp: Callable[[Array], Pose]  # nominal TCP of joints (N, 6) [rad]
    can_drive: Callable[[Pose], bool]  # whether it can follow N poses of the TCP
    lower: Array  # (6,) [rad] limits of the joints
    upper: Array  # (6,) [rad]


def plan_lead_in(
    arm: LeadInArm, theta: Array, least: Array, travel: float, exact: ExactPath, lift: float
) -> LeadIn | None:
    """The lead-in onto a path.

    Args:
        arm: That shall drive it.
        theta: Joints at the first waypoints of the path itself, (M, 6) [rad].
        least: How far each joint turns at least, (6,) [rad].
        travel: Length that the TCP goes at least [m].
        exact: The path; its first piece begins at the first waypoint.
        lift: How high above the surface the program begins, at least [m].

    Returns:
        None where the arm can drive no such move.
    """
    tcp = arm.tcp(theta[:1])[0]
    offsets = STEP * np.vstack([np.eye(6), -np.eye(6)])
    ahead, back = np.split(arm.tcp(theta[0] + offsets).position @ -tcp.rotation[:, 2], 2)
    rate = (ahead - back) / (2 * STEP)  # n^T J
    turned = np.abs(theta - theta[0]) > STILL
    moves = turned.any(axis=0)
    first = theta[np.argmax(turned, axis=0), np.arange(6)]
    side = np.where(moves, np.sign(first - theta[0]), np.where(rate > 0, -1.0, 1.0))
    for flipped in _choices(moves):
        tried = np.where(flipped, -side, side)
        start = _start(arm, theta[0], tcp.position, rate, tried, (least, travel, lift), exact)
        if start is None:
            continue
        place, tilt = exact.curve.start()
        line = curves.tilted(curves.line(start.start, place), start.tilt, tilt)
        poses, _ = replace(exact, curve=line).pose(np.zeros(len(SAMPLES), dtype=np.int64), SAMPLES)
        if arm.can_drive(poses):
            return start
    return None


def _choices(moves: BoolArray) -> list[BoolArray]:
    """Which joints to turn the other way, (6,) each: none first, then as few as can be of those that the path turns."""
    flips = [np.array(flip) for flip in product((False, True), repeat=6)]
    return sorted(flips, key=lambda flip: (int((flip & moves).sum()), int(flip.sum())))


def _start(
    arm: LeadInArm,
    theta: Array,
    place: Array,
    rate: Array,
    side: Array,
    needed: tuple[Array, float, float],
    exact: ExactPath,
) -> LeadIn | None:
    """Where joints that turn to these sides (6,) come from; None beyond their limits, or where nothing lifts."""
    from scipy.optimize import linprog  # loaded by runs that need it

    least, travel, lift = needed
    height, local = lift, np.zeros(3)
    for _ in range(ROUNDS):
        turns = linprog(np.ones(6), A_ub=(rate * side)[None], b_ub=[-height], bounds=[(m, MAX_TURN) for m in least])
        if not turns.success:
            return None
        before = theta - side * turns.x
        if np.any(before < arm.lower) or np.any(before > arm.upper):
            return None
        begin = arm.tcp(before[None])[0]
        local = exact.local(begin.position)
        short = max(lift - local[2], travel - float(np.linalg.norm(begin.position - place)))
        if short < NEAR:
            break
        height += short
    else:
        return None
    below = curves.line(local, (*local[:2], 0.0))
    standing, _ = replace(exact, curve=below).pose(np.zeros(1, dtype=np.int64), np.zeros(1))
    turn = rotation_vector(standing.rotation[0].T @ begin.rotation)
    angle = float(np.linalg.norm(turn))
    return LeadIn(local, turn * (np.tan(angle / 2) / angle if angle > 0 else 0.5))
