r"""Where a controller's smoothing leads the tool beside the written path.

The commanded motion and the way that it has gone are smoothed alike. When the smoothed way is s, the tool should be at
the place p(s) of the path, the nearest one but at corners behind first-order lags (there up to some 4 % farther): a
motion that is only late is on its path. With x the smoothed place and t the path's direction there,

    d = x - p(s),      along = d . t,      across = d - along t

``across`` is how far the tool is from the path. ``along`` is no error of form but tells where a way out and back is cut
short, and ``lag`` how far the tool is behind its command. Of the orientation the rotation vectors of the way are added
up and smoothed, which is right for the small angles in the smoothing's reach; smoothed joints go through the nominal
arm.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from math import inf
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, frozen, own
from compgen.core.evaluation import IndexedRows, evaluate, kept_with
from compgen.core.pose import Pose
from compgen.core.rotations import rotation_matrix
from compgen.robot.motion import ControllerMotion
from compgen.robot.robot import Robot
from compgen.verification.twin.controller.command import (
    CommandClock,
    CommandedMotion,
    WrittenPath,
    command_at,
    command_clock,
    first_statements,
)
from compgen.verification.twin.controller.smoothing import coarser, moments, smooth
from compgen.verification.twin.nominal_arm import LENGTHS, build_grown_pose

BLOCK = 1 << 16  # samples in time that are smoothed at once
TURNING = 2e-5  # [rad] of the tool's axes, as much as the third decimal of W P R: below, nothing is told
SAMPLES = 10  # in the shortest window or time constant, at least
SHARP = 0.1  # [rad] change of direction from one segment to the next: a corner
EDGE = 3  # samples that a cubic needs beyond its own
ROUNDED = 1.1  # of a bound in continuous time: samples and cubics


@dataclass(frozen=True, eq=False, slots=True)
class MotionDeviation:
    """Where the tool is beside its path at K places of a program, in the order of the path."""

    across: Array  # (K, 3) [m] in World
    along: Array  # (K,) [m]
    turn: Array | None  # (K, 3) [rad] rotation vector in World; None: the tool does not turn on its way
    lag: float  # [m] behind the command at the highest speed

    def __post_init__(self) -> None:
        own(self, across=("K", 3), along=("K",))
        if self.turn is not None:
            own(self, turn=(len(self.along), 3))

    def moved(self, pose: Pose, rows: slice) -> Pose:
        """Poses at some of the places, led beside the path."""
        position = pose.position + self.across[rows]
        if self.turn is None:
            return Pose(frozen(position), pose.rotation)
        return Pose(frozen(position), frozen(rotation_matrix(self.turn[rows]) @ pose.rotation))


def motion_deviation(
    robot: Robot,
    tool: Pose,
    path: WrittenPath,
    counts: IntArray,
    override: float = 1.0,
    *,
    places_only: bool = False,
    blocks: BoolArray | None = None,
) -> MotionDeviation | None:
    """Where the controller's motion leads the tool, in each run by the windows that it has.

    None where nothing is smoothed or nothing is known of it; a run of a single segment has no bend.

    Args:
        robot: With its motion and interpolation period.
        tool: TCP in the flange.
        path: The program, N positions.
        counts: How many places each segment has, its start among them, evenly in length, (N - 1,); the end is one more.
        override: Share of all written speeds.
        places_only: Of the places alone.
        blocks: Which blocks of time are looked at, (J,) as ``most_in_blocks`` has them; the places that are passed
            in others are left at zero.
    """
    known = robot.motion
    if known is None or not known.is_smooth:
        return None
    if known.after_long:
        segments = np.diff(np.flatnonzero(path.program.fine))
        long = (first_statements(robot, path, override) > known.long) & (segments > 1)
        of_run = partial(motion_deviation, places_only=places_only, blocks=blocks)
        usual, *other = (
            of_run(replace(robot, motion=known.in_run(first)), tool, path, counts, override)
            for first in ((0.0, inf) if long.any() else (0.0,))
        )
        return _by_place(np.repeat(np.repeat(long, segments), counts), usual, other[0]) if other else usual
    motion = replace(known, lag=0.0)  # a lag of all alike leaves the path as it is
    step, arc = _step(robot, path, motion), path.arcs()
    turned = np.zeros((0, 3)) if places_only else path.turned()
    in_joints = motion.space == "joint"
    turning = in_joints or bool(turned.any())
    clock = command_clock(robot, path, override).on_samples(step)
    first = np.concatenate([[0], np.cumsum(counts)])
    K = int(first[-1]) + 1
    across, along, turn = np.zeros((K, 3)), np.zeros(K), np.zeros((K if turning else 0, 3))
    for rows, command, way in _blocks(path, clock, motion, step, first, blocks):
        segment, fraction = _on_segments(np.arange(rows.start, rows.stop), first, counts)
        at = np.interp(arc[segment] + fraction * path.sweep.length[segment], way, np.arange(len(way), dtype=float))
        if in_joints:
            position, rotation = _led_by_joints(robot, tool, path, motion, command)
            turn[rows] = small_turn(cubic(rotation, at).reshape(-1, 3, 3), path.rotations(segment, fraction))
        else:
            position = smooth(command.position, step, motion)
        if turning and not in_joints:
            way_turned = smooth(_between(turned, command.segment, command.fraction), step, motion)
            turn[rows] = cubic(way_turned, at) - _between(turned, segment, fraction)
        across[rows], along[rows] = _beside(path, position, at, segment, fraction)
    lag = moments(known).delay * override * float(path.program.speed.max())
    turns = np.abs(turn).max(initial=0.0) > TURNING
    return MotionDeviation(frozen(across), frozen(along), frozen(turn) if turns else None, lag)


def _by_place(
    places: BoolArray, usual: MotionDeviation | None, other: MotionDeviation | None
) -> MotionDeviation | None:
    """The other deviation at some places, (K - 1,) and the end as the last; the usual one where either has none."""
    if usual is None or other is None:
        return usual
    there = np.append(places, places[-1])
    turns = [np.zeros_like(led.across) if led.turn is None else led.turn for led in (other, usual)]
    return MotionDeviation(
        frozen(np.where(there[:, None], other.across, usual.across)),
        frozen(np.where(there, other.along, usual.along)),
        None if usual.turn is None and other.turn is None else frozen(np.where(there[:, None], *turns)),
        max(usual.lag, other.lag),
    )


def _beside(path: WrittenPath, position: Array, at: Array, segment: IntArray, fraction: Array) -> tuple[Array, Array]:
    """How far smoothed places (M, 3), by ``cubic`` at their numbers (K,), are across and along from places of the path.

    Args:
        path: The program.
        position: The smoothed places [m].
        at: Their numbers.
        segment: Of the places, (K,).
        fraction: Of it, (K,).
    """
    k = np.clip(at.astype(np.int64), 0, len(position) - 2)
    padded = np.concatenate([position[:1], position, position[-1:]])
    around = np.lib.stride_tricks.sliding_window_view(padded.ravel(), 12)[::3]
    has_arcs, way = bool(path.program.via.any()), IndexedRows(path.sweep.straight, segment)
    if has_arcs:
        begin, end = int(segment[0]), int(segment[-1]) + 1
        way = IndexedRows(path.sweep.rows(begin, end), segment - begin)
    across, along = evaluate(
        _build_beside(arcs=has_arcs), IndexedRows(around, k), (at - k)[:, None],
        IndexedRows(path.program.position, segment), way, fraction[:, None],
    )  # fmt: skip
    return across, along[:, 0]


@lru_cache(maxsize=2)
def _build_beside(*, arcs: bool) -> Any:
    """(four smoothed places (12), how far between the middle two; a segment's start (3) and straight (3), with ``arcs``
    also angle (1), along (3) and inwards (3), and a fraction of it) -> across (3), along (1).
    """
    sizes = {"around": 12, "u": 1, "start": 3, "way": 10 if arcs else 3, "fraction": 1}
    symbols = [ca.SX.sym(name, size) for name, size in sizes.items()]
    around, u, start, way, fraction = symbols
    before, begin, end, after = ca.vertsplit(around, 3)
    m, n = (end - before) / 2, (after - begin) / 2
    smoothed = begin + u * (m + u * (3 * (end - begin) - 2 * m - n + u * (m + n - 2 * (end - begin))))
    place, ahead = start + fraction * way[:3], way[:3]
    if arcs:
        part = fraction * way[3]
        place = place + ca.sin(part) * way[4:7] + 2 * ca.sin(part / 2) ** 2 * way[7:10]
        ahead = ahead + ca.cos(part) * way[4:7] + ca.sin(part) * way[7:10]
    ahead = ahead / ca.fmax(ca.norm_2(ahead), 1e-12)
    along = ca.dot(smoothed - place, ahead)
    return ca.Function("beside", symbols, ca.cse([smoothed - place - along * ahead, along]))


def most_in_blocks(robot: Robot, path: WrittenPath, motion: ControllerMotion, override: float = 1.0) -> Array:
    r"""How far the tool may be led off at most in each block of time, (J,) [m]: a bound that costs little.

    A smoothed place is a mean of places p(s) around it, those of arc lengths s around the smoothed one S, whose mean
    square distance is (v sigma)^2 at most: no command is faster than v. Where the direction u of travel turns by
    theta at most on each piece of length b = v sigma / 2, it turns by theta (\|s - S\| / b + 2) at most between:

        \|d\| = \|mean of p(s) - p(S) - (s - S) u(S)\| <= theta ((v sigma)^2 / (2 b) + 2 v sigma) = 3 theta v sigma

    Infinite where this is not so: on arcs, and where joints are smoothed.

    Args:
        robot: Its interpolation period.
        path: The program.
        motion: The smoothing.
        override: Share of all written speeds.
    """
    motion = replace(motion, lag=0.0)
    step, arc = _step(robot, path, motion), path.arcs()
    clock = command_clock(replace(robot, motion=motion), path, override).on_samples(step)
    begin = step * np.arange(0, int(np.ceil(clock.end / step)) + EDGE, BLOCK, dtype=float)
    if motion.space == "joint" or path.sweep.angle.any():
        return np.full(len(begin), np.inf)
    passed = np.interp(
        clock.position_numbers(np.append(begin, begin[-1] + BLOCK * step)), np.arange(len(arc), dtype=float), arc
    )
    fastest = override * float(path.program.speed.max())
    reach, spread = 2 * fastest * motion.settling, fastest * np.sqrt(moments(motion).variance)
    turn = np.arccos(np.clip(_bends(path), -1.0, 1.0))
    theta = np.bincount((arc[1:-1] / (spread / 2)).astype(np.int64), turn, minlength=1)
    low, high = (
        (at / (spread / 2)).astype(np.int64) for at in (np.maximum(passed[:-1] - reach, 0), passed[1:] + reach)
    )
    most = [theta[a : b + 1].max(initial=0.0) for a, b in zip(low, high, strict=True)]
    return np.asarray(ROUNDED * 3 * spread * np.array(most))


def _step(robot: Robot, path: WrittenPath, motion: ControllerMotion) -> float:
    """Between samples [s]."""
    period = robot.controller.period
    return period if has_corners(path) else coarser(motion, period, SAMPLES)


def _blocks(
    path: WrittenPath,
    clock: CommandClock,
    motion: ControllerMotion,
    step: float,
    first: IntArray,
    chosen: BoolArray | None,
) -> Iterator[tuple[slice, CommandedMotion, Array]]:
    """Block by block of samples in time: the places that are passed in it, the command, and the smoothed way (M,) [m].

    Each begins so early that what was before no longer counts; ``first`` are the first places of positions, (N,). Of
    those that are not ``chosen`` nothing is told.
    """
    M, halo = int(np.ceil(clock.end / step)) + EDGE, int(np.ceil(motion.settling / step)) + 2 * EDGE
    arc, done = path.arcs(), 0
    for n, begin in enumerate(range(0, M, BLOCK)):
        if chosen is not None and not chosen[n]:
            continue
        samples = step * np.arange(max(begin - halo, 0), min(begin + BLOCK, M) + EDGE, dtype=float)
        command = command_at(path, arc, clock.position_numbers(samples), samples, step)
        way = np.maximum.accumulate(smooth(command.arc[:, None], step, motion)[:, 0])
        if n and chosen is not None and not chosen[n - 1]:
            done = _places_before(float(way[min(begin, halo)]), arc, first)
        end = int(first[-1]) + 1 if begin + BLOCK >= M else _places_before(float(way[-EDGE]), arc, first)
        if end > done:
            yield slice(done, end), command, way
            done = end


def _on_segments(place: IntArray, first: IntArray, counts: IntArray) -> tuple[IntArray, Array]:
    """Segments and fractions of places by number, (M,) each, of the first on each segment and how many it has."""
    segment = np.minimum(np.searchsorted(first, place, side="right") - 1, len(counts) - 1)
    return segment, (place - first[segment]) / counts[segment]


def _between(rows: Array, segment: IntArray, fraction: Array) -> Array:
    """Straight between rows (N, C) at the ends of segments (M,), (M, C)."""
    return np.asarray(rows[segment] + fraction[:, None] * (rows[segment + 1] - rows[segment]))


def has_corners(path: WrittenPath) -> bool:
    """Whether the program turns sharply anywhere without a stop."""
    return bool(np.any(_bends(path) < np.cos(SHARP)))


@kept_with("path")
def _bends(path: WrittenPath) -> Array:
    """Cosine of the change of direction at each position between the ends, (N - 2,); one at a stop."""
    inner = np.flatnonzero(~path.program.fine[1:-1])
    before, after = path.directions(inner, np.ones(len(inner))), path.directions(inner + 1, np.zeros(len(inner)))
    cosine = np.ones(len(path.program.fine) - 2)
    cosine[inner] = np.einsum("ij,ij->i", before, after)
    return cosine


def _places_before(way: float, arc: Array, first: IntArray) -> int:
    """How many places are passed when a way [m] is done, of positions at arc (N,) [m] and their first places (N,)."""
    segment = min(int(np.searchsorted(arc, way, side="right")) - 1, len(arc) - 2)
    share = (way - arc[segment]) / max(arc[segment + 1] - arc[segment], 1e-12)
    return int(first[segment] + np.floor(min(share, 1.0) * (first[segment + 1] - first[segment])))


def cubic(rows: Array, at: Array) -> Array:
    """Rows (M, C) between each other, at numbers of them (K,): the cubic that has their central differences."""
    k = np.clip(at.astype(np.int64), 0, len(rows) - 2)
    u = (at - k)[:, None]
    before, after = rows[np.maximum(k - 1, 0)], rows[np.minimum(k + 2, len(rows) - 1)]
    start, end = rows[k], rows[k + 1]
    m, n = (end - before) / 2, (after - start) / 2
    return np.asarray(start + u * (m + u * (3 * (end - start) - 2 * m - n + u * (m + n - 2 * (end - start)))))


def small_turn(mean: Array, written: Array) -> Array:
    """Rotation vector in World (K, 3) [rad] from written rotations to means of rotations near them, (K, 3, 3) each.

    A mean of rotations is no rotation, but a turn times less than one; its skew part has the axis.
    """
    w = np.einsum("nik,njk->nij", mean, written)
    skew = np.column_stack([w[:, 2, 1] - w[:, 1, 2], w[:, 0, 2] - w[:, 2, 0], w[:, 1, 0] - w[:, 0, 1]]) / 2
    return np.asarray(skew * (3 / np.trace(w, axis1=1, axis2=2))[:, None])


def _led_by_joints(
    robot: Robot, tool: Pose, path: WrittenPath, motion: ControllerMotion, command: CommandedMotion
) -> tuple[Array, Array]:
    """Places of the TCP (M, 3) [m] and its rotations (M, 9), row by row, where the joints are smoothed."""
    joints = smooth(path.joints(robot, tool, command.segment, command.fraction), command.step, motion)
    position, rotation = evaluate(build_grown_pose(robot, tool), joints, np.zeros((1, len(LENGTHS))))
    return position, rotation
