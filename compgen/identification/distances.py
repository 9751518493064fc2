"""Files of measured distances: between two reflectors on the flange, or to a place that stands in the cell."""

from collections import Counter, defaultdict
from collections.abc import Hashable, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.csv_table import CsvTable, quote_cell
from compgen.core.exceptions import InputError
from compgen.core.pose import JOINT_KEYS
from compgen.core.recorded.table import read_table
from compgen.core.units import DEG, MM
from compgen.identification.measured_poses import (
    FARTHEST,
    SAME,
    check_moving,
    check_within_limits,
    columns_together,
    motion_directions,
    refuse_doubled,
    relative_sigma,
    row_labels,
    words_or,
)
from compgen.identification.measurements import DISTANCE, NONE, WORLD, FixedPlaces, Measurements, blank_rows, plain_ends
from compgen.robot.robot import Robot

NEAR = tuple(f"a_{name}" for name in JOINT_KEYS)
FAR = tuple(f"b_{name}" for name in JOINT_KEYS)
KNOWN = ("time_s", "a_target", *NEAR, "b_target", *FAR, "distance_mm", "sigma_um")
REFLECTOR, SOCKET = "tcp", "socket"  # where the file names none
UNKNOWNS = 3  # of a reflector or a fixed place


def read_distances(
    source: str, robot: Robot, nodes: int, *, force: bool = False, frames_known: bool = False
) -> Measurements:
    """One file of distances.

    Columns: ``a_j1_deg`` to ``a_j6_deg`` as the pendant shows them, where ``a_target`` (a reflector; else one) was;
    ``b_j1_deg`` to ``b_j6_deg`` and ``b_target``, the other end: left out or empty, it is a place that stands in the
    cell, as the socket of a ballbar, unknown and fitted along; ``distance_mm`` between the two, and where known
    ``time_s`` and ``sigma_um``. Rows with the same joints at the same time are one pose; without times, until joints
    return after others with two ends that were measured there before.

    Args:
        source: A CSV file.
        robot: Whose pendant convention and limits the joints follow.
        nodes: How many nodes its heat model has.
        force: Go on with a joint that never moves.
        frames_known: Whether reflectors and sockets are known, so that one distance is enough.

    Raises:
        InputError: Anything wrong, naming file, line and column.
    """
    table = read_table(source, (*NEAR, "distance_mm"), KNOWN)
    N = len(table.line)
    near = np.column_stack([table.numbers(c) for c in NEAR]) * DEG
    needs = f"the second end needs {FAR[0]} to {FAR[-1]}"
    far = columns_together(table, FAR, needs, "give all six joints of the second end, or none") * DEG
    carried: BoolArray = np.isfinite(far[:, 0])
    distance = _measured(table)
    time = table.numbers("time_s") if table.has("time_s") else None
    a_name = words_or(table, "a_target", REFLECTOR)
    b_name = table.words("b_target") if table.has("b_target") else [(SOCKET, REFLECTOR)[int(c)] for c in carried]
    reflectors, sockets = _named_ends(table, a_name, b_name, carried)
    targets = list(zip(a_name, b_name, strict=True))
    pose_a, pose_b, pendant, row_of_pose = _poses(near, far, carried, time, targets, distance)
    theta = robot.to_theta(pendant)
    check_within_limits(
        robot,
        theta,
        lambda m, k: table.location(int(row_of_pose[m]), (NEAR if pose_a[row_of_pose[m]] == m else FAR)[k]),
    )
    check_moving(source, pendant / DEG, force=force)
    clock = time if time is not None else np.arange(N, dtype=float)
    reflector = np.array([reflectors.index(name) for name in a_name])
    other = np.array([reflectors.index(name) if c else 0 for name, c in zip(b_name, carried, strict=True)])
    place = np.array([NONE if c else sockets.index(name) for name, c in zip(b_name, carried, strict=True)])
    _check_two_ends(table, pose_a, pose_b, reflector, other, distance)
    if not frames_known:
        _check_measured_enough(table, reflectors, sockets, reflector, other, place, carried)
    return replace(
        blank_rows(theta, pose_a, row_labels(table), nodes),
        direction=motion_directions(theta),
        time=clock[row_of_pose],
        instrument=np.full(N, WORLD),
        reflector=reflector,
        **relative_sigma(table),
        reflectors=reflectors,
        ends=replace(
            plain_ends(N),
            kind=np.full(N, DISTANCE),
            place=place,
            pose=pose_b,
            reflector=other,
            distance=distance,
        ),
        fixed=_unknown_places(sockets),
        timed=time is not None,
        notes=table.notes,
    )


def _measured(table: CsvTable) -> Array:
    """The distances, (N,) [m]."""
    distance = table.numbers("distance_mm", largest=FARTHEST)
    table.refuse_first(distance <= 0, "distance_mm", lambda n: f"{distance[n]:g} must be above 0; mend the row")
    return np.asarray(distance * MM)


def _unknown_places(names: tuple[str, ...]) -> FixedPlaces:
    """Places that stand in the cell, nobody knows where."""
    S = len(names)
    return FixedPlaces(names=names, frame=np.full(S, WORLD), place=np.full((S, 3), np.nan), sigma=np.zeros(S))


def _named_ends(
    table: CsvTable, a_name: list[str], b_name: list[str], carried: BoolArray
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the reflectors on the flange, and of the places that stand in the cell."""
    on_flange = [*a_name, *(name for name, c in zip(b_name, carried, strict=True) if c)]
    standing = [name for name, c in zip(b_name, carried, strict=True) if not c]
    table.refuse_first(
        np.isin(b_name, on_flange) & ~carried,
        FAR[0] if table.has(FAR[0]) else "b_target",
        lambda n: (
            f"{quote_cell(b_name[n], 'the target')} is on the flange in other rows, and stands in the cell where the "
            "second end has no joints; give the joints, or another name"
        ),
    )
    return tuple(dict.fromkeys(on_flange)), tuple(dict.fromkeys(standing))


def _poses(
    near: Array, far: Array, carried: BoolArray, time: Array | None, targets: Sequence[tuple[str, str]], distance: Array
) -> tuple[IntArray, IntArray, Array, IntArray]:
    """The pose of each row's ends, the poses' joints [rad] in the order driven, and the first row of each."""
    ends = [(near[n], far[n]) if carried[n] else (near[n],) for n in range(len(near))]
    at = [tuple(tuple(np.round(q / SAME).tolist()) for q in each) for each in ends]
    if time is None:
        order, when = range(len(ends)), _visits(at, targets, distance.tolist())
    else:
        order, when = np.argsort(time, kind="stable").tolist(), [(t, t) for t in time.tolist()]
    number, joints, rows = dict[Hashable, int](), list[Array](), list[int]()
    pose = np.full((2, len(ends)), NONE)
    for n in order:
        for end, q in enumerate(ends[n]):
            key = at[n][end], when[n][end]
            if key not in number:
                number[key] = len(joints)
                joints.append(q)
                rows.append(n)
            pose[end, n] = number[key]
    return pose[0], pose[1], np.array(joints), np.array(rows)


def _visits(
    at: Sequence[tuple[Hashable, ...]], targets: Sequence[tuple[str, str]], distance: Sequence[float]
) -> list[tuple[int, ...]]:
    """The how manieth visit to the joints of its ends each row without a time is of.

    Joints that return after others are the pose they were, but where the same two ends were measured there before, a
    new one: the arm may have come from another side. Copied rows are none.
    """
    visit, measured = Counter[Hashable](), defaultdict[Hashable, set[float]](set)
    visits = list[tuple[int, ...]]()
    for here, run in groupby(range(len(at)), at.__getitem__):
        lines, current = list(run), tuple(visit[end] for end in here)
        before = [measured[here, current, targets[n]] for n in lines]
        if any(before) and not all(distance[n] in values for n, values in zip(lines, before, strict=True)):
            visit.update(here)
        for n in lines:
            visits.append(tuple(visit[end] for end in here))
            measured[here, visits[-1], targets[n]].add(distance[n])
    return visits


def _check_two_ends(
    table: CsvTable, pose_a: IntArray, pose_b: IntArray, reflector: IntArray, other: IntArray, distance: Array
) -> None:
    """Raises InputError where the two ends of a row are one, or a row stands twice."""
    is_one, one = (pose_a == pose_b) & (reflector == other), "both ends are the same target at the same joints"
    table.refuse_first(is_one, FAR[0], lambda n: f"{one}; mend the row")
    ends = (pose_a, pose_b, reflector, other, distance)
    rows = zip(*(values.tolist() for values in ends), strict=True)
    refuse_doubled(table, rows, lambda n, line: f"duplicate of line {line}; remove one")


def _check_measured_enough(
    table: CsvTable,
    reflectors: tuple[str, ...],
    sockets: tuple[str, ...],
    reflector: IntArray,
    other: IntArray,
    place: IntArray,
    carried: BoolArray,
) -> None:
    """Raises InputError where an end has no more distances than unknowns."""
    count = np.bincount(place + 1)[place + 1]
    table.refuse_first(
        (count <= UNKNOWNS) & ~carried,
        "",
        lambda n: (
            f"{quote_cell(sockets[place[n]], 'the second end')} stands in the cell and is in {count[n]} distances, "
            "which only tell where; measure more to it, or give the joints of the second end"
        ),
    )
    for r, name in enumerate(reflectors):
        rows = (reflector == r) | (carried & (other == r))
        if rows.sum() <= UNKNOWNS:
            raise InputError(
                f"{table.location(int(np.flatnonzero(rows)[0]))}: reflector {quote_cell(name, 'of this row')} is in "
                f"{int(rows.sum())} distances, which only tell where it sits; measure more of them, or remove the row"
            )
