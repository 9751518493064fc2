"""Pose files: joints, and where an instrument measured the reflectors."""

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.csv_table import CsvTable, quote_cell
from compgen.core.exceptions import InputError
from compgen.core.pose import JOINT_KEYS, POSE_KEYS
from compgen.core.recorded.table import read_table
from compgen.core.rotations import rotation_matrix
from compgen.core.units import DEG, MM, UM
from compgen.identification.measurements import Measurements, blank_rows
from compgen.robot.inverse_kinematics import is_class
from compgen.robot.robot import Robot

PLACE = POSE_KEYS[:3]
TURN = ("rx_deg", "ry_deg", "rz_deg")
KNOWN = ("time_s", "order", "target", "instrument", *JOINT_KEYS, *PLACE, *TURN, "sigma_um")
FARTHEST = 1e8  # mm: a tracker measures 100 m at most, which someone may give in um
SAME = 1e-9  # rad: joints nearer than this are the same pose
STILL = 0.05 * DEG  # a joint that moves less than this does not move
LIMIT = 0.01 * DEG  # how far beyond its limit a joint may be printed
VISIT = 300.0  # s: rows further from their pose's first are another visit, where warmth counts
SMALL = 2.5 * DEG  # a joint's longest step within a reversal run
TRAVEL = 1e-5  # rad: a joint that turned less than this keeps the direction it had


def read_poses(
    source: str, robot: Robot, nodes: int, *, force: bool = False, timed: bool = False, frames_known: bool = False
) -> Measurements:
    """One file of poses, all by one instrument.

    Columns: ``time_s`` or ``order`` (else the rows' own order), ``target`` (the reflector; else one), ``j1_deg`` to
    ``j6_deg`` as the pendant shows them, ``x_mm y_mm z_mm`` in the instrument's frame, and where measured
    ``rx_deg ry_deg rz_deg`` (rotation vector), ``sigma_um`` and ``instrument``: one name is one frame, in all files.
    Rows of other reflectors at the same joints, one after the other in time, are one pose, at the time of its first.

    Args:
        source: A CSV file.
        robot: Whose pendant convention and limits the joints follow.
        nodes: How many nodes its heat model has.
        force: Go on with a joint that never moves.
        timed: Whether the poses' times are needed: then ``time_s`` must be there, and in seconds.
        frames_known: Whether instrument and reflectors are known, so that a reflector may be measured once.

    Raises:
        InputError: Anything wrong, naming file, line and column.
    """
    table = read_table(source, (*JOINT_KEYS, *PLACE), KNOWN)
    pendant = np.column_stack([table.numbers(c) for c in JOINT_KEYS])
    position = np.column_stack([table.numbers(c, largest=FARTHEST) for c in PLACE])
    instrument = _instrument(table)
    if timed and not table.has("time_s"):
        raise InputError(
            f"{source}: column time_s: missing; temperatures follow the clock, and neither order nor rows are seconds; "
            "give the seconds at which each pose was measured"
        )
    names = words_or(table, "target", "tcp")
    reflectors, reflector = numbered_names(names)
    clock_column = next((c for c in ("time_s", "order") if table.has(c)), None)
    time = None if clock_column is None else table.numbers(clock_column)
    rows = np.argsort(time, kind="stable") if time is not None else np.arange(len(pendant))
    first, pose = _poses(table, pendant, time, rows, reflector, VISIT if timed else np.inf)
    _check_duplicates(table, pose, reflector, names)
    if not frames_known:
        _check_measured_twice(table, reflectors, reflector)
    theta = robot.to_theta(pendant[first] * DEG)
    check_within_limits(robot, theta, lambda m, k: table.location(int(first[m]), JOINT_KEYS[k]))
    if timed and time is not None:
        _check_seconds(table, robot, pendant, time, first)
    check_moving(source, pendant, force=force)
    gaps = _gaps(time, first, pose) if time is not None and clock_column == "order" else None
    return replace(
        blank_rows(theta, pose, row_labels(table), nodes),
        direction=motion_directions(theta, gaps),
        time=time[first] if time is not None else np.arange(len(first), dtype=float),
        reflector=reflector,
        position=position * MM,
        rotation=_rotation(table),
        **relative_sigma(table),
        reflectors=reflectors,
        instruments=(instrument,),
        aligned=np.array([False]),
        notes=table.notes,
    )


def row_labels(table: CsvTable) -> list[str]:
    """File and line of each row."""
    return [table.location(n) for n in range(len(table.line))]


def joints_given(table: CsvTable, robot: Robot, rows: str) -> Array | None:
    """Joints of each row as a file gives them, (N, 6) [rad]; None where it leaves them to the closed form.

    Raises:
        InputError: It does, and this arm has none; ``rows`` says whose joints are missing.
    """
    missing = [c for c in JOINT_KEYS if not table.has(c)]
    if 0 < len(missing) < len(JOINT_KEYS):
        raise InputError(
            f"{table.source}: column {missing[0]}: missing; give all of {JOINT_KEYS[0]} to {JOINT_KEYS[-1]} or none"
        )
    if not missing:
        return robot.to_theta(np.column_stack([table.numbers(c) for c in JOINT_KEYS]) * DEG)
    if not is_class(robot):
        raise InputError(
            f"{table.source}: columns {JOINT_KEYS[0]} to {JOINT_KEYS[-1]}: missing; this arm has no closed-form "
            f"inverse kinematics here, so {rows} need their joints"
        )
    return None


def motion_directions(theta: Array, gaps: BoolArray | None = None) -> Array:
    """The direction each joint came with, from the pose before, (M, 6) of -1, 0, 1.

    A joint that stood still keeps the direction it had; before the first pose, and where poses in between are left out
    (``gaps`` (M,)), nothing is known. A run's joint that alone turned on, by a small step, turned on before it as well.
    """
    direction = np.zeros_like(theta)
    for m in range(1, len(theta)):
        step = theta[m] - theta[m - 1]
        moved = np.abs(step) > TRAVEL
        goes_on = moved.sum() == 1 and np.abs(step).max() < SMALL and (np.sign(step) == direction[m - 1])[moved].all()
        if gaps is None or not gaps[m] or goes_on:
            direction[m] = np.where(moved, np.sign(step), direction[m - 1])
    return direction


def _instrument(table: CsvTable) -> str:
    """The instrument whose frame the places are in; a file that names none has one of its own."""
    if not table.has("instrument"):
        return table.source
    names = table.words("instrument")
    mixed = (
        f"after {quote_cell(names[0], 'another')}: mixed instruments have frames of their own; give each its own file, "
        "with --poses once for each"
    )
    is_other, plain = np.array(names) != names[0], "letters, figures, '_', '.', '+' and '-'"
    table.refuse_first(is_other, "instrument", lambda n: f"{quote_cell(names[n])} {mixed}")
    table.refuse_first(
        np.array([not quote_cell(names[0], "")]), "instrument", lambda n: f"no plain name; give one of {plain}"
    )
    return names[0]


def _check_seconds(table: CsvTable, robot: Robot, pendant: Array, time: Array, first: IntArray) -> None:
    """Raises InputError where half of the ways between poses are too long for the time there is."""
    if len(first) < 3:
        return
    needed = (np.abs(np.diff(robot.to_theta(pendant[first] * DEG), axis=0)) / robot.speed).max(axis=1)
    missing = np.flatnonzero(np.diff(time[first]) < needed)
    if 2 * len(missing) <= len(needed):
        return
    m = int(missing[0])
    row, gap = int(first[m + 1]), float(time[first[m + 1]] - time[first[m]])
    raise InputError(
        f"{table.location(row, 'time_s')}: {gap:g} s after the pose before, where the joints need {needed[m]:.2f} s at "
        f"full speed, and so for {len(missing)} of {len(needed)} poses; are the times hours? multiply them by 3600"
    )


def _poses(
    table: CsvTable, pendant: Array, time: Array | None, rows: IntArray, reflector: IntArray, visit: float
) -> tuple[IntArray, IntArray]:
    """The first row of each pose in time, and the pose of each row.

    A row of the joints of the row before is of its pose, until a reflector comes again later: that is a new visit, as
    is what comes more than ``visit`` behind the pose's first row.
    """
    first: list[int] = []
    pose, seen = np.empty(len(pendant), dtype=int), set[int]()
    for before, i in zip([-1, *rows.tolist()[:-1]], rows.tolist(), strict=True):
        same_joints = before >= 0 and bool(np.abs(pendant[i] - pendant[before]).max() * DEG <= SAME)
        same_time = before >= 0 and (time is None or time[i] == time[before])
        if time is not None and same_time and not same_joints:
            column = JOINT_KEYS[int(np.argmax(np.abs(pendant[i] - pendant[before])))]
            raise InputError(
                f"{table.location(i, column)}: other joints at the time of line {table.line[before]}; "
                "give each pose its own time"
            )
        late = time is not None and before >= 0 and time[i] - time[first[-1]] > visit
        if not same_joints or (not same_time and (late or int(reflector[i]) in seen)):
            first.append(i)
            seen.clear()
        seen.add(int(reflector[i]))
        pose[i] = len(first) - 1
    return np.array(first), pose


def _gaps(order: Array, first: IntArray, pose: IntArray) -> BoolArray:
    """Before which poses others were left out, (M,): numbers are missing behind the last row of the pose before."""
    last = np.full(len(first), -np.inf)
    np.maximum.at(last, pose, order)
    return np.append(False, order[first[1:]] - last[:-1] > 1)


def _check_duplicates(table: CsvTable, pose: IntArray, reflector: IntArray, names: list[str]) -> None:
    refuse_doubled(
        table,
        zip(pose.tolist(), reflector.tolist(), strict=True),
        lambda n, line: (
            f"duplicate of line {line}: the same pose and target {quote_cell(names[n], 'name')}; remove one, or give "
            "times if it was measured again"
        ),
    )


def _check_measured_twice(table: CsvTable, reflectors: tuple[str, ...], reflector: IntArray) -> None:
    mend = (
        "so are all: if they are names of shots, remove the column"
        if len(reflectors) == len(reflector)
        else "measure it at two poses or more, or remove the row"
    )
    table.refuse_first(
        np.bincount(reflector)[reflector] < 2,
        "target",
        lambda n: (
            f"reflector {quote_cell(reflectors[reflector[n]], 'of this row')} is seen once, which only fixes where it "
            f"sits; {mend}"
        ),
    )


def check_within_limits(robot: Robot, theta: Array, location: Callable[[int, int], str]) -> None:
    """Raises InputError where a joint is outside its limits; ``location`` says where pose and joint were read."""
    for k in range(6):
        beyond = np.flatnonzero((theta[:, k] < robot.lower[k] - LIMIT) | (theta[:, k] > robot.upper[k] + LIMIT))
        if len(beyond):
            m = int(beyond[0])
            value, low, high = np.array([robot.as_quoted(theta[m]), *robot.quoted_limits])[:, k] / DEG
            raise InputError(
                f"{location(m, k)}: {robot.joint_names[k]} at {value:.3f} deg is outside its "
                f"limits {low:g} to {high:g} deg; the joints are those of the pendant: mend the row, or the robot file"
            )


def check_moving(source: str, pendant: Array, *, force: bool) -> None:
    """Raises InputError where a joint, of pendant angles (M, 6) [deg], never moves."""
    if force:
        return
    for k, span in enumerate(np.ptp(pendant, axis=0) * DEG):
        if span < STILL:
            raise InputError(
                f"{source}: column {JOINT_KEYS[k]}: constant at {pendant[0, k]:g} deg in all {len(pendant)} rows, so "
                f"nothing of joint {k + 1} can be identified; measure poses that move it, or --force holds its "
                "parameters at nominal"
            )


def _rotation(table: CsvTable) -> Array:
    """Measured orientations, (N, 3, 3); NaN where not measured."""
    vector = columns_together(table, TURN, f"an orientation needs {', '.join(TURN)}", "give all three or none")
    rotation = rotation_matrix(np.nan_to_num(vector) * DEG)
    rotation[np.isnan(vector[:, 0])] = np.nan
    return rotation


def columns_together(table: CsvTable, columns: Sequence[str], needs: str, mend: str) -> Array:
    """Columns of which a file has all or none, and a row too: numbers (N, C), NaN where there are none.

    Raises:
        InputError: One is missing (``needs`` says what for), or empty in a row that has others (``mend``).
    """
    missing = [c for c in columns if not table.has(c)]
    if len(missing) == len(columns):
        return np.full((len(table.line), len(columns)), np.nan)
    if missing:
        raise InputError(f"{table.source}: column {missing[0]}: missing; {needs}")
    values = np.column_stack([table.numbers(c, gaps=True) for c in columns])
    empty = np.isnan(values)
    for n in np.flatnonzero(empty.any(axis=1) & ~empty.all(axis=1)).tolist():
        raise InputError(f"{table.location(n, columns[int(np.argmax(empty[n]))])}: empty; {mend}")
    return values


def words_or(table: CsvTable, column: str, otherwise: str) -> list[str]:
    """A column of text; the same word in every row where the file has none."""
    return table.words(column) if table.has(column) else [otherwise] * len(table.line)


def numbers_or(table: CsvTable, column: str, otherwise: Array) -> Array:
    """A column of numbers, or others where the file has none."""
    return table.numbers(column) if table.has(column) else otherwise


def numbered_names(names: Sequence[str]) -> tuple[tuple[str, ...], IntArray]:
    """All names that occur, in their order, and the number of each among them."""
    known = tuple(dict.fromkeys(names))
    return known, np.array([known.index(name) for name in names], dtype=int)


def refuse_doubled(table: CsvTable, keys: Iterable[Hashable], fault: Callable[[int, int], str]) -> None:
    """Raises InputError for the first row whose key an earlier one has; ``fault`` is told it, and the earlier line."""
    rows: dict[Hashable, int] = {}
    first = np.array([rows.setdefault(key, n) for n, key in enumerate(keys)])
    table.refuse_first(first < np.arange(len(first)), "", lambda n: fault(n, table.line[first[n]]))


def sigmas(table: CsvTable, low: float, high: float, *, gaps: bool) -> Array:
    """Standard deviations as the file gives them, (N,) [um]; NaN where it does not.

    Raises:
        InputError: One is outside of low to high, or left out where there may be no gaps.
    """
    if not table.has("sigma_um"):
        return np.full(len(table.line), np.nan)
    sigma = table.numbers("sigma_um", gaps=gaps)
    limits = f"must be {low:g} to {high:g} um; give one standard deviation"
    table.refuse_first((sigma < low) | (sigma > high), "sigma_um", lambda n: f"{sigma[n]:g} {limits}")
    return sigma


def relative_sigma(table: CsvTable) -> dict[str, Any]:
    """How uncertain each row is beside the others, (N,), median 1, and by itself [m], as measurements."""
    if not table.has("sigma_um"):
        return {}
    sigma = sigmas(table, 1e-3, 1e5, gaps=False)
    return {"sigma": sigma / np.median(sigma), "stated_sigma": sigma * UM}
