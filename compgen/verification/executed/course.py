"""The course of a program: where its text leads, and when, as a polyline that a log can be laid along.

N nodes with N - 1 ways between them. Three clocks run along it:

    cruise    every way at its written speed, nothing lost at stops
    counted   the same, each statement rounded up to whole interpolation periods
    planned   with what stops cost and with the program's own waits

A log's override is the rate of a clock between stops; what a stop costs beside is planned less that clock.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from compgen.core.arcs import arcs_through
from compgen.core.arrays import Array, BoolArray, IntArray, cumulated, dot, interpolated, norm, numbered, owns, unit
from compgen.core.pose import Pose
from compgen.core.rotations import interpolate_rotation
from compgen.robot.joint_path import arm_spread
from compgen.robot.robot import SAME_PERIOD, Robot

CHORD = 2e-7  # [m] of an arc, between the nodes that stand for it
LONGEST_DIVISION = 4000  # nodes of one arc
NODE = 1e-9  # m; s: less than any two nodes are apart
STRAIGHT = 0.9995  # chord over way, from which a way has no corner
LEAST_WAY = 1e-12  # [m] of a way: one without length
SAME_SPREAD = 0.05  # [m2] of an arm: a fifth of a period of means


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(
    position=("N", 3),
    rotation=("N", 3, 3),
    arc=("N",),
    judged=("S",),
    cruise=("N",),
    statement=("S",),
    kept=("N",),
    planned=("N",),
    stop=("N",),
    wait=("N",),
    waits=("N",),
    number=("N",),
    theta=("N", 6),
)
class ProgramCourse:
    """N nodes in World; ``frame`` and ``tool`` are those that the program runs in."""

    position: Array  # (N, 3) [m]
    rotation: Array  # (N, 3, 3)
    arc: Array  # (N,) [m]
    judged: BoolArray  # (N - 1,) straight or circular, and surely driven: else any way may lead there
    cruise: Array  # (N,) [s]
    statement: IntArray  # (N - 1,) number of the motion that drives each way, rising
    kept: Array  # (N,) n / 100 of CNT n, 0 where it stops
    planned: Array  # (N,) [s]
    stop: BoolArray  # (N,)
    wait: Array  # (N,) [s] that the program waits there, as far as it tells
    waits: BoolArray  # (N,) where it waits, for seconds, a signal or an operator
    number: IntArray  # (N,) n of P[n], 0 between the ends of an arc
    theta: Array  # (N, 6) [rad], NaN where they are not known
    frame: Pose  # the user frame in World
    tool: Pose  # the TCP in the flange
    numbers: tuple[int, int]  # of frame and tool on the controller
    period: float  # [s] of interpolation
    counted: bool = False  # whether ``planned`` counts lines by whole periods
    several_frames: bool = False  # whether ways lead in other user frames, too
    several_tools: bool = False  # whether some are of other tools
    elsewhere: tuple[float, float] = (0.0, 0.0)  # [m] at its begin and end, to places of another tool: no log has them
    flow: tuple[int, ...] = ()  # lines of statements that may change the order
    settles: bool = False  # whether stops cost what smoothing takes to settle, at any override; else ramps

    @property
    def rests(self) -> BoolArray:
        """Nodes at which the program stops, or waits behind CNT, (N,)."""
        return self.stop | self.waits

    @property
    def length(self) -> float:
        """Of the whole course [m]."""
        return float(self.arc[-1])

    def share(self, first: float, last: float) -> float:
        """Of the course, less what is ``elsewhere``, what lies between two arc lengths [m]."""
        begin, end = self.elsewhere[0], self.length - self.elsewhere[1]
        return max(min(last, end) - max(first, begin), 0.0) / max(end - begin, LEAST_WAY)

    @property
    def places_hint(self) -> str:
        """What a log should be in and hold, where the program drives in several user frames or with several tools."""
        frames = "; it drives in several user frames: log joints, or positions in World with --in-world"
        tools = f"; it drives with several tools: cut the log to a run of motions with UTOOL {self.numbers[1]}"
        return (frames if self.several_frames else "") + (tools if self.several_tools else "")

    @property
    def order_hint(self) -> str:
        """What a log should hold, where the program may drive otherwise than in the order of its text."""
        if not self.flow:
            return ""
        return f"; it jumps, calls or loops (line {self.flow[0]}): cut the log to one pass of its motions as listed"

    def way(self, arc: Array) -> IntArray:
        """The way on which each arc length (M,) [m] lies."""
        return np.asarray(np.clip(np.searchsorted(self.arc, arc, side="right") - 1, 0, len(self.arc) - 2))

    def at(self, clock: Array, arc: Array) -> Array:
        """What a clock of the nodes shows at arc lengths, (M,) [s]."""
        return np.interp(arc, self.arc, clock)

    def counted_clock(self, override: float | Array = 1.0) -> Array:
        """The clock of statements in whole periods, times their override: one, or each way's (N - 1,), (N,) [s]."""
        duration = np.diff(self.cruise)
        whole = np.bincount(self.statement, duration)[self.statement] / override
        counted = np.ceil(whole / self.period - SAME_PERIOD) * self.period
        return cumulated(duration * np.where(whole > 0, counted / np.where(whole > 0, whole, 1.0), 1.0))

    def spreads(self, robot: Robot) -> Array:
        """How far the arm is spread at most on each way's motion, (N - 1,) [m2]; NaN where joints are not known."""
        node, widest = arm_spread(robot, self.theta), np.zeros(int(self.statement[-1]) + 1)
        with np.errstate(invalid="ignore"):
            np.maximum.at(widest, self.statement, np.maximum(node[:-1], node[1:]))
        return np.asarray(SAME_SPREAD * np.round(widest / SAME_SPREAD))[self.statement]

    def on_way(self, arc: Array) -> tuple[IntArray, Array]:
        """The way on which each arc length (M,) [m] lies, and the share of it that is behind, (M,)."""
        k = self.way(arc)
        return k, (arc - self.arc[k]) / np.maximum(np.diff(self.arc)[k], LEAST_WAY)

    def place(self, arc: Array) -> Array:
        """Positions at arc lengths, (M, 3) [m]."""
        return interpolated(arc, self.arc, self.position)

    def rotation_at(self, arc: Array) -> Array:
        """Orientations at arc lengths (M,) [m], turning steadily over each way, (M, 3, 3)."""
        k, share = self.on_way(arc)
        return interpolate_rotation(self.rotation[k], self.rotation[k + 1], share)

    def tangents(self) -> Array:
        """Direction of each way, (N - 1, 3); of a way without length that of the one before."""
        return tangents_of(self.position)

    def point_name(self, arc: float) -> str:
        """The position that is nearest along the course, as ``P[n]``."""
        named = np.flatnonzero(self.number > 0)
        at = int(named[np.argmin(np.abs(self.arc[named] - arc))]) if len(named) else 0
        return f"P[{self.number[at]}]"


def divided(position: Array, via: BoolArray) -> tuple[Array, Array]:
    """Nodes on arcs, close enough for straight ways between them.

    Args:
        position: Of the motions' ends and vias, (N, 3) [m].
        via: The middle of a circular motion, (N,).

    Returns:
        Numbers of nodes (M,), rising: n is position n, n + 1/3 a third of the way from it to the next; their places.
    """
    middle = np.flatnonzero(via)
    arcs = arcs_through(position[middle - 1], position[middle], position[middle + 1])
    sweep = np.diff(arcs.angle, prepend=0.0, axis=1)
    in_line = ~np.isfinite(sweep)
    step = 2 * np.sqrt(2 * CHORD / np.where(in_line, 1.0, arcs.radius[:, None]))
    count = np.where(in_line, 1, np.clip(np.ceil(np.where(in_line, 0.0, sweep) / step), 1, LONGEST_DIVISION))
    count = count.astype(np.int64).ravel()
    half, nth = numbered(count - 1)  # of each new node
    share = (nth + 1) / count[half]
    arc, second = half // 2, half % 2
    places = arcs.on_halves(arc, second == 1, share)
    number = np.concatenate([np.arange(len(position), dtype=float), middle[arc] - 1 + second + share])
    order = np.argsort(number, kind="stable")
    return number[order], np.concatenate([position, places])[order]


def at_numbers(values: Array, number: Array) -> Array:
    """What nodes (N, ...) have at numbers between them (M,): straight between neighbours."""
    base = np.minimum(np.floor(number).astype(np.int64), len(values) - 1)
    after = np.minimum(base + 1, len(values) - 1)
    share = (number - base).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(values[base] + share * (values[after] - values[base]))


def tangents_of(position: Array) -> Array:
    """Direction of each way of a polyline (N, 3), (N - 1, 3); of a way without length that of the one before."""
    step = np.diff(position, axis=0)
    moving = np.flatnonzero(dot(step, step) > 0)
    if not len(moving):
        return np.tile([1.0, 0.0, 0.0], (len(step), 1))
    way = np.full(len(step), moving[0])
    way[moving] = moving
    return unit(step.take(np.maximum.accumulate(way), axis=0))


class PlannedRuns(NamedTuple):
    """R runs by the plan."""

    alone: Array  # (R,) [s] at written speeds
    planned: Array  # (R,) [s] with ramps, without waits
    is_line: BoolArray  # (R,) one straight line


def planned_runs(course: ProgramCourse, edges: Array) -> PlannedRuns:
    """Runs between edges, (R + 1,) [m]; of one edge there are none, and all is of one of no time."""
    if len(edges) < 2:
        return PlannedRuns(np.zeros(1), np.zeros(1), np.zeros(1, dtype=bool))
    clock = course.counted_clock() if course.counted else course.cruise
    waited = cumulated(course.wait)[np.searchsorted(course.arc, edges - NODE)]
    chord = norm(np.diff(course.place(edges), axis=0))
    return PlannedRuns(
        np.diff(course.at(clock, edges)),
        np.diff(course.at(course.planned, edges)) - np.diff(waited),
        chord >= STRAIGHT * np.diff(edges),
    )
