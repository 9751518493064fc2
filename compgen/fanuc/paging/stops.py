"""Stops that a long program needs, so that it can be parted into pages.

A page ends where the robot stops. Where no stop of the path lies within what a page holds, one is put in: off the part
where it can be, since a tool that stands on the part removes more there; on the part only when that is allowed. Of all
waypoints that do not cost another page the calmest is taken, where the joints move least for a millimetre of path.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, own
from compgen.fanuc.memory import MEMORY_CALL, MEMORY_MOTION, MEMORY_POSITION, MEMORY_PROGRAM, MEMORY_REMARK
from compgen.fanuc.paging.capacity import Size, Store
from compgen.planning.toolpath import ToolPath
from compgen.robot.robot import Robot

FRAME_LINES = 2  # UFRAME_NUM and UTOOL_NUM
FRAME_MEMORY = 64.0  # bytes of their text, at most
FEWEST = 2  # positions of a page: its start and one more
ALIKE = 1e-6  # waypoints whose joints differ by less are equally calm; the last of them is taken


@dataclass(frozen=True, eq=False, slots=True)
class PageStops:
    """Where the robot stops."""

    stop: BoolArray  # (N,)
    added: BoolArray  # (N,) put in for the pages' sake
    on_the_part: int  # how many of those stand on the part
    why_not: str  # a page cannot be made; empty when all can

    def __post_init__(self) -> None:
        own(self, stop=("N",), added=("N",))


def store_of(robot: Robot) -> Store:
    """What the robot's controller holds."""
    c = robot.controller
    return Store(c.max_lines, c.max_positions, c.memory, c.name_length)


def capacity(store: Store, count: int, head_lines: int) -> int:
    """How many positions a page of compgen's own holds, its start among them; at least 2.

    Args:
        store: What the controller holds.
        count: Positions of the program.
        head_lines: Remarks at the head of a page.
    """
    lines = store.max_lines - head_lines - FRAME_LINES
    own_memory = MEMORY_PROGRAM + MEMORY_REMARK * head_lines + FRAME_MEMORY
    each = MEMORY_POSITION + MEMORY_MOTION
    n = max(FEWEST, min(lines, store.max_positions, count))
    for _ in range(20):  # the main program grows with the number of pages
        pages = -(-2 * count // (n - 1)) + 1  # each at least half full
        main = MEMORY_PROGRAM + MEMORY_CALL + pages * (store.name_length + MEMORY_CALL)
        fits = max(FEWEST, min(n, int((store.memory - main - own_memory) // each)))
        if fits == n:
            break
        n = fits
    return n


def place_page_stops(robot: Robot, path: ToolPath, theta: Array, rises: int, on_the_part: bool) -> PageStops | None:
    """The stops of a path whose program is more than one file holds; None for any other.

    Args:
        robot: The joints' speeds, and what its controller holds.
        path: As it is without pages.
        theta: Its joints, (N, 6) [rad].
        rises: How many rises the remarks at the head name.
        on_the_part: Whether the robot may be stopped on the part.
    """
    store, N, extra = store_of(robot), len(path.arc), head_lines(rises)
    if size(N, extra).within(store):
        return None
    holds = capacity(store, N, extra)
    if holds <= FEWEST:
        no = np.zeros(N, dtype=bool)
        return PageStops(path.stop, no, 0, "its limits leave no room for a page; raise them in the robot file")
    return put_stops(robot, path.arc, theta, path.stop, path.contact, holds, on_the_part)


def head_lines(rises: int) -> int:
    """How many remarks a program or a page of compgen's own has at its head."""
    return 4 + -(-rises // 2)


def size(positions: int, remarks: int) -> Size:
    """What a program of compgen's own asks of the controller, as one file."""
    memory = MEMORY_PROGRAM + positions * (MEMORY_POSITION + MEMORY_MOTION)
    return Size(positions + remarks + FRAME_LINES, positions, float(memory))


def put_stops(
    robot: Robot, arc: Array, theta: Array, stop: BoolArray, contact: BoolArray, holds: int, on_the_part: bool
) -> PageStops:
    """The stops of a path with those that its pages need.

    Args:
        robot: For the joints' speeds.
        arc: At the waypoints, (N,) [m].
        theta: Joints there, (N, 6) [rad].
        stop: Where the path stops, (N,).
        contact: Where the tool is on the part, (N,).
        holds: Positions that a page holds, see ``capacity``.
        on_the_part: Whether the robot may be stopped on the part.
    """
    rate = np.abs(np.diff(theta, axis=0) / np.diff(arc)[:, None] / robot.speed).max(axis=1)
    busy = np.maximum(np.append(rate, rate[-1:]), np.concatenate([rate[:1], rate]))
    found = np.array(stop)
    first, N = 0, len(stop)
    while N - first > holds:
        half, last = first + max(1, holds // 2), first + holds - 1
        later = -(-(N - 1 - first) // (holds - 1)) - 1  # pages that must follow at least
        late = np.arange(half, last + 1)
        own_stops = np.flatnonzero(found[first + 1 : last + 1]) + first + 1
        free = late[~contact[late]]
        if not len(free) and on_the_part:  # as few as can be: so late that no further page is needed
            free = np.arange(max(first + 1, N - 1 - later * (holds - 1)), last + 1)
        if len(own_stops) and (own_stops[-1] >= half or not len(free)):
            first = int(own_stops[-1])
        elif len(free):
            first = int(free[busy[free] <= busy[free].min() * (1 + ALIKE)][-1])
            found[first] = True
        else:
            told = f"the robot does not stop between waypoints {first + 2} and {last + 1}, all a page holds"
            return PageStops(np.array(stop), np.zeros(N, dtype=bool), 0, told)
    added = found & ~stop
    return PageStops(found, added, int((added & contact).sum()), "")
