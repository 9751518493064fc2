"""Stops that a long program needs so that it can be split into pages.

A page ends where the robot stops. Where the path has no stop within what a page holds, one is added: off the workpiece
where possible, since a tool that stands on it removes more there; on it only when that is allowed. Of all waypoints
that do not cost another page, the one is taken at which the joints move least for a millimetre of path.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, owns
from compgen.planning.toolpath import ToolPath
from compgen.program.pages import (
    MEMORY_CALL,
    MEMORY_MOTION,
    MEMORY_POSITION,
    MEMORY_PROGRAM,
    MEMORY_REMARK,
    ProgramSize,
    estimated_memory,
)
from compgen.robot.robot import Capacity, Robot

FRAME_LINES = 2  # UFRAME_NUM and UTOOL_NUM
FRAME_MEMORY = 64.0  # [bytes] of their text, at most
MIN_POSITIONS = 2  # of a page: its start and one more
EQUAL_RATES = 1e-6  # waypoints whose joint rates differ by less count as equal; the last of them is taken


@dataclass(frozen=True, eq=False, slots=True)
@owns(stop=("N",), added=("N",))
class PageStops:
    """Where the robot stops."""

    stop: BoolArray  # (N,)
    added: BoolArray  # (N,) only so that the program can be split
    on_the_part: int  # how many of the added ones are on the workpiece
    obstacle: str  # why the program cannot be split; empty when it can

    def at(self, rows: IntArray) -> "PageStops":
        """Of the waypoints at some rows."""
        return replace(self, stop=self.stop[rows], added=self.added[rows])


def positions_per_page(capacity: Capacity, count: int, remarks: int) -> int:
    """How many positions a page of a canonical program holds, its start among them; at least 2.

    Args:
        capacity: What the controller holds.
        count: Positions of the program.
        remarks: Remarks at the head of a page.
    """
    lines = capacity.max_lines - remarks - FRAME_LINES
    head_memory = MEMORY_PROGRAM + MEMORY_REMARK * remarks + FRAME_MEMORY
    each = MEMORY_POSITION + MEMORY_MOTION
    n = max(MIN_POSITIONS, min(lines, capacity.max_positions, count))
    for _ in range(20):  # the main program grows with the number of pages
        pages = -(-2 * count // (n - 1)) + 1  # each at least half full
        main = MEMORY_PROGRAM + MEMORY_CALL + pages * (capacity.name_length + MEMORY_CALL)
        fitting = max(MIN_POSITIONS, min(n, int((capacity.memory - main - head_memory) // each)))
        if fitting == n:
            break
        n = fitting
    return n


def place_page_stops(
    robot: Robot,
    path: ToolPath,
    theta: Array,
    nodes: int,
    *,
    on_the_part: bool,
    payload: bool,
    growth: float = 1.0,
) -> PageStops | None:
    """The stops of a path whose program is more than one file holds; None for any other.

    Args:
        robot: Its joint speeds, and what its controller holds.
        path: As it is without pages.
        theta: Its joints, (N, 6) [rad].
        nodes: How many temperature rises the remarks at the head name.
        on_the_part: Whether the robot may be stopped on the workpiece.
        payload: Whether the program says its payload.
        growth: How many times as many positions the program may have as the path.
    """
    capacity, remarks = robot.controller.capacity, head_line_count(nodes, payload=payload)
    N = int(np.ceil(growth * len(path.arc)))
    if canonical_size(N, remarks).within(capacity):
        return None
    per_page = positions_per_page(capacity, N, remarks)
    if per_page <= MIN_POSITIONS:
        obstacle = "its limits leave no room for a page; raise them in the robot file"
        return PageStops(path.stop, np.zeros(len(path.arc), dtype=bool), 0, obstacle)
    per_page = max(MIN_POSITIONS, int(per_page / growth))
    return add_stops(
        joint_rates(robot, path.arc, theta),
        stop=path.stop,
        contact=path.contact,
        per_page=per_page,
        on_the_part=on_the_part,
        via=path.via,
    )


def head_line_count(nodes: int, *, payload: bool = False) -> int:
    """How many lines the head of a canonical program or page has beside its frames.

    Six remarks, two temperature rises a line, and the payload where it is said.
    """
    return 6 + -(-nodes // 2) + payload


def canonical_size(positions: int, remarks: int) -> ProgramSize:
    """Size of a canonical program in one file."""
    return ProgramSize(positions + remarks + FRAME_LINES, positions, estimated_memory(positions))


def joint_rates(robot: Robot, arc: Array, theta: Array) -> Array:
    """Share of a joint's speed that each waypoint takes for a metre a second along the path, (N,): the larger side's.

    Args:
        robot: Its joint speeds.
        arc: At the waypoints, (N,) [m].
        theta: Joints there, (N, 6) [rad].
    """
    rate = np.abs(np.diff(theta, axis=0) / np.diff(arc)[:, None] / robot.speed).max(axis=1)
    return np.asarray(np.maximum(np.append(rate, rate[-1:]), np.concatenate([rate[:1], rate])))


def add_stops(
    joint_rate: Array,
    stop: BoolArray,
    contact: BoolArray,
    per_page: int,
    *,
    on_the_part: bool,
    via: BoolArray | None = None,
) -> PageStops:
    """The stops of a path with those that its pages need.

    Args:
        joint_rate: How fast joints turn at the waypoints, (N,); see ``joint_rates``.
        stop: Where the path stops, (N,).
        contact: Where the tool is on the workpiece, (N,).
        per_page: Positions that a page holds, see ``positions_per_page``.
        on_the_part: Whether the robot may be stopped on the workpiece.
        via: Middles of arcs, (N,), where it cannot stop; default nowhere.
    """
    stops = np.array(stop)
    first, N = 0, len(stop)
    while N - first > per_page:
        half, last = first + max(1, per_page // 2), first + per_page - 1
        may_stop = np.ones(N, dtype=bool) if via is None else ~via
        later = -(-(N - 1 - first) // (per_page - 1)) - 1  # pages that must follow at least
        late = np.arange(half, last + 1)
        late = late[may_stop[late]]
        path_stops = np.flatnonzero(stops[first + 1 : last + 1]) + first + 1
        candidates = late[~contact[late]]
        if not len(candidates) and on_the_part:  # as few as can be: so late that no further page is needed
            candidates = np.arange(max(first + 1, N - 1 - later * (per_page - 1)), last + 1)
            candidates = candidates[may_stop[candidates]]
            candidates = candidates if len(candidates) else late[-1:]  # the middle of an arc alone: its start
        if len(path_stops) and (path_stops[-1] >= half or not len(candidates)):
            first = int(path_stops[-1])
        elif len(candidates):
            rates = joint_rate[candidates]
            first = int(candidates[rates <= rates.min() * (1 + EQUAL_RATES)][-1])
            stops[first] = True
        else:
            obstacle = f"the robot does not stop between waypoints {first + 2} and {last + 1}, all a page holds"
            return PageStops(np.array(stop), np.zeros(N, dtype=bool), 0, obstacle)
    added = stops & ~stop
    return PageStops(stops, added, int((added & contact).sum()), "")
