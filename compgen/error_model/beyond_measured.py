"""Findings where a program leaves the range in which the error sources were measured."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, column_extremes
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.units import DEG, MM, UM
from compgen.error_model.direction_memory import DirectionState, reversal_widths, unknown_share
from compgen.error_model.model import ErrorModel
from compgen.error_model.source import Source
from compgen.error_model.sources.measured_map import AxisMap
from compgen.robot.robot import Robot

TOLERANCE = 1e-6  # m, rad
NEGLIGIBLE = 1e-6  # m of unknown hysteresis at the tool
SETTLED = 1e-7  # m of it that one joint or axis may leave
PLAYED = 2.2  # widths of motion after which the play operator is through: two, and some for rounding
LEAST_DEPTH = 3.0  # widths of motion, also where play moves the TCP by next to nothing and turns the tool alone


def map_findings(sources: Sequence[Source], position: Array, number: IntArray | None = None) -> Iterator[Finding]:
    """Where TCPs (N, 3) [m] leave the box that the measured lines span; ``number`` (N,) says which they are, from 0."""
    lines = [s for s in sources if isinstance(s, AxisMap)]
    if not lines:
        return
    corners = np.vstack([np.where(np.arange(3) == s.axis, end, s.place) for s in lines for end in s.station[[0, -1]]])
    low, high = corners.min(axis=0), corners.max(axis=0)
    least, most = column_extremes(position)
    worst = np.maximum(low - least, most - high)
    if worst.max() <= TOLERANCE:
        return
    outside = (np.maximum(low - position, position - high) > TOLERANCE).any(axis=1)
    ranges = ", ".join(
        f"{'xyz'[i]} by up to {worst[i] / MM:.1f} mm ({low[i] / MM:g} to {high[i] / MM:g} measured)"
        for i in range(3)
        if worst[i] > TOLERANCE
    )
    first = int(np.argmax(outside))
    first = 1 + (first if number is None else int(number[first]))
    yield Finding.of(
        Code.SOURCES_MAP,
        f"{int(outside.sum())} of {len(position)} positions, first {first}, leave the measured map's hull in {ranges}; "
        "the map's value at its edge is taken there: measure lines that reach further, or move the path",
    )


def joint_box_findings(robot: Robot, joint_box: Array | None, theta: Array) -> Iterator[Finding]:
    """Where joints (N, 6) [rad] leave the box that the parameters were identified in."""
    if joint_box is None:
        return
    least, most = column_extremes(robot.to_pendant(theta))
    over = np.maximum(joint_box[:, 0] - least, most - joint_box[:, 1])
    if over.max() <= TOLERANCE:
        return
    ranges = ", ".join(
        f"J{i + 1} by up to {over[i] / DEG:.1f} deg ({low / DEG:g} to {high / DEG:g})"
        for i, (low, high) in enumerate(joint_box)
        if over[i] > TOLERANCE
    )
    message = f"the program leaves the joints that the errors were identified in: {ranges}; measure poses there"
    yield Finding.of(Code.SOURCES_BOX, message)


def joint_halves(model: ErrorModel, theta: Array) -> Array:
    """How far each joint's half-width moves the TCP at joints theta (N, 6) [rad], (N, 6) [m]."""
    return _moved_by_sides(model, theta, np.eye(9)[:6])


def _moved_by_sides(model: ErrorModel, theta: Array, sides: Array) -> Array:
    """How far states of direction and travel (S, 9) move the TCP from where none is, cold, at theta (N, 6), (N, S)."""
    N, S = len(theta), len(sides) + 1
    states = np.tile(np.vstack([np.zeros(9), sides]), (N, 1))
    cold = np.zeros((N * S, model.actual.size1_in(1)))
    place = model.actual_pose(np.repeat(theta, S, axis=0), cold, DirectionState(states[:, :6], states[:, 6:])).position
    place = place.reshape(N, S, 3)
    return np.asarray(np.linalg.norm(place[:, 1:] - place[:, :1], axis=2))


def settling(sources: Sequence[Source], model: ErrorModel, theta: Array) -> tuple[Array, float]:
    """How far joints and TCP must move at joints theta (6,) [rad] until where they came from no longer matters.

    Of x, by which a joint's half-width moves the TCP, e^(-turn / width) stays: the turn is width ln(x / settled).

    Returns:
        The turn of each joint, (6,) [rad], and the TCP's travel [m]; zero where nothing depends on it.
    """
    widths = reversal_widths(sources)
    if widths is None:
        return np.zeros(6), 0.0
    halves = _moved_by_sides(model, theta[None], np.eye(9))[0]
    depth = np.maximum(np.log(np.maximum(halves / SETTLED, 1.0)), LEAST_DEPTH)
    turn, travel = (np.where(np.isfinite(w), w, 0.0) for w in (widths.joint, widths.travel))
    if widths.law == "play":
        depth[:6] = PLAYED
    return turn * depth[:6], float((travel * depth[6:]).max())


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class DrivenPoses:
    """N poses in the order driven, and what the error hangs on there."""

    theta: Array  # (N, 6) [rad]
    position: Array  # (N, 3) [m] of the TCP
    rise: Array  # (N, K) [K]
    directions: DirectionState
    contact: BoolArray  # (N,) on the part; none counts as all


def unknown_start_findings(
    robot: Robot, sources: Sequence[Source], model: ErrorModel, driven: DrivenPoses
) -> Iterator[Finding]:
    """How much hysteresis is unknown where the part begins, since the motion before the first waypoint is unknown.

    Args:
        robot: For the names of its joints.
        sources: Of its error.
        model: The error model.
        driven: From the first waypoint on.
    """
    widths = reversal_widths(sources)
    if widths is None:
        return
    n = int(np.argmax(driven.contact))
    share = unknown_share(widths, driven.theta, driven.position).at(np.array([n]))
    assumed = driven.directions.at(np.array([n]))
    changes = np.diag(np.concatenate([share.direction[0], share.travel[0]]))  # one joint or axis a row
    changed = DirectionState(assumed.direction + changes[:, :6], assumed.travel + changes[:, 6:])
    q, r = np.tile(driven.theta[n], (9, 1)), np.tile(driven.rise[n], (9, 1))
    displacement = model.actual_pose(q, r, changed).position - model.actual_pose(q, r, assumed).position
    distance = np.linalg.norm(displacement, axis=1)
    if distance.sum() <= NEGLIGIBLE:
        return
    names = (*robot.joint_names, "x", "y", "z")
    amounts = ", ".join(f"{names[i]} {distance[i] / UM:.1f} um" for i in np.flatnonzero(distance > NEGLIGIBLE / 10))
    yield Finding.of(
        Code.SOURCES_START,
        f"the side that joints come from is not known before they have moved: where the part begins, {amounts} of "
        "half-width are left unknown; lead in with a longer move, always from the same side",
    )
