"""Axis tests: commanded positions on a line, driven both ways, and the deviations of the tool from them."""

from dataclasses import replace

import numpy as np

from compgen.core.arrays import Array, IntArray, norm
from compgen.core.csv_table import CsvTable, quote_cell
from compgen.core.exceptions import CompgenError, InputError
from compgen.core.pose import JOINT_KEYS, POSE_KEYS, Pose
from compgen.core.recorded.table import read_table
from compgen.core.rotations import from_wpr
from compgen.core.units import DEG, MM, UM
from compgen.identification.measured_poses import (
    FARTHEST,
    check_within_limits,
    joints_given,
    numbered_names,
    numbers_or,
    relative_sigma,
    row_labels,
    words_or,
)
from compgen.identification.measurement_checks import (
    BETTER,
    FEWEST,
    SUSPECT,
    better_reading,
    nearest_mean,
    refuse_radians,
)
from compgen.identification.measurements import Measurements, blank_rows
from compgen.robot.inverse_kinematics import Posture, flange_from_tool
from compgen.robot.joint_path import follow_branch
from compgen.robot.kinematics import flange_pose
from compgen.robot.robot import Robot, coupling_of

PLACE, TURN = POSE_KEYS[:3], POSE_KEYS[3:]
DEVIATION = ("dx_um", "dy_um", "dz_um")
TOOL = ("tool_x_mm", "tool_y_mm", "tool_z_mm")
KNOWN = ("line", "run", "direction", "time_s", *PLACE, *DEVIATION, *TURN, *TOOL, *JOINT_KEYS, "sigma_um")


def read_axis_tests(source: str, robot: Robot, nodes: int) -> Measurements:
    """One file of axis tests in World.

    Columns: ``direction`` (1 towards larger coordinates, -1 back), commanded ``x_mm y_mm z_mm`` of the tool, measured
    deviations ``dx_um dy_um dz_um`` (those not measured stay empty), and where it matters ``line`` (rows with a common
    zero; else one), ``run``, ``w_deg p_deg r_deg`` of the tool (else pointing down), ``tool_x_mm tool_y_mm tool_z_mm``
    (else the flange), ``sigma_um``, or the joints ``j1_deg`` to ``j6_deg`` themselves. Each line has its own zero and
    is aligned with World to about 1 mrad: both are fitted along.

    Raises:
        InputError: Anything wrong, naming file, line and column.
    """
    table = read_table(source, ("direction", *PLACE), KNOWN)
    if not any(table.has(c) for c in DEVIATION):
        raise InputError(f"{source}: column {DEVIATION[0]}: missing; give at least one of {', '.join(DEVIATION)}")
    position = np.column_stack([table.numbers(c, largest=FARTHEST) for c in PLACE]) * MM
    N = len(position)
    deviation = np.column_stack(
        [table.numbers(c, gaps=True) if table.has(c) else np.full(N, np.nan) for c in DEVIATION]
    )
    direction = table.numbers("direction")
    table.refuse_first(np.abs(direction) != 1, "direction", lambda n: f"{direction[n]:g} must be 1 or -1")
    if np.nanmax(np.abs(deviation), initial=0.0) > 5e4:
        raise InputError(f"{source}: columns d*_um: deviations beyond 50 mm; they are in um")
    lines, line = numbered_names(words_or(table, "line", "1"))
    theta = _joints(table, robot, position)
    return replace(
        blank_rows(theta, np.arange(N), row_labels(table), nodes),
        direction=_motion(table, line, lines, position, theta) * direction[:, None],
        instrument=line,
        position=position + deviation * UM,
        reflectors=(f"tool of {source}",),
        instruments=tuple(f"{source}: line {name}" for name in lines),
        aligned=np.ones(len(lines), dtype=bool),
        notes=table.notes,
        **relative_sigma(table),
    )


def _motion(table: CsvTable, line: IntArray, lines: tuple[str, ...], position: Array, theta: Array) -> Array:
    """Signs of the joints' speeds towards larger coordinates of each row's line, (N, 6), by a cubic along it.

    Raises:
        InputError: A line of fewer than three rows.
    """
    motion, count = np.zeros(theta.shape), np.bincount(line)[line]
    table.refuse_first(
        count < 3,
        "line",
        lambda n: f"line {quote_cell(lines[line[n]], 'of this row')} has {count[n]} rows; give 3 or more",
    )
    for rows in (line == k for k in range(len(lines))):
        axis = np.linalg.svd(position[rows] - position[rows].mean(axis=0))[2][0]
        axis = axis * np.sign(axis[np.argmax(np.abs(axis))])
        s = position[rows] @ axis
        cubic = np.array([np.polyfit(s, theta[rows, i], min(3, len(np.unique(s)) - 1)) for i in range(6)])
        rate = np.array([np.polyval(np.polyder(c), s) for c in cubic]).T
        motion[rows] = np.where(np.abs(rate) > 1e-4, np.sign(rate), 0.0)
    return motion


def _joints(table: CsvTable, robot: Robot, tcp: Array) -> Array:
    """Joints of each row: as given, or by the closed form."""
    if (given := joints_given(table, robot, "lines")) is not None:
        _check_given(table, robot, tcp, given)
        return given
    angles = [numbers_or(table, c, np.full(len(tcp), d)) * DEG for c, d in zip(TURN, (180.0, 0.0, 0.0), strict=True)]
    tool = Pose(np.array([_constant(table, c) for c in TOOL]) * MM, np.eye(3))
    flange = flange_from_tool(Pose(tcp, from_wpr(*angles)), tool)
    try:
        theta = follow_branch(robot, flange, Posture())
    except CompgenError as exception:
        raise InputError(f"{table.source}: {exception}") from exception
    if np.abs(flange_pose(robot, theta).position - flange.position).max() > 1e-6:
        raise InputError(f"{table.source}: the commanded places are out of reach; check x_mm y_mm z_mm are of World")
    return theta


def _check_given(table: CsvTable, robot: Robot, tcp: Array, theta: Array) -> None:
    """Raises InputError where joints are outside their limits, or have the tool elsewhere than it was commanded.

    Where the tool sits in the flange is not told: it is where most rows have it. Both are the controller's own, so
    that a calibration error is in neither.
    """
    check_within_limits(robot, theta, lambda m, k: table.location(m, JOINT_KEYS[k]))
    pendant = robot.to_pendant(theta)

    def distance_of(angles: Array) -> Array:
        flange = flange_pose(robot, robot.to_theta(angles))
        tool = np.einsum("nji,nj->ni", flange.rotation, tcp - flange.position)
        return norm(tool - np.median(tool, axis=0))

    as_given = nearest_mean(distance_of(pendant))
    if as_given <= SUSPECT or len(theta) < FEWEST:
        return
    where = f"{table.source}: columns {JOINT_KEYS[0]} to {JOINT_KEYS[-1]}"
    refuse_radians(where, pendant, lambda angles: nearest_mean(distance_of(angles)) * BETTER < as_given)
    if better := better_reading(pendant, distance_of, as_given, coupling_of(robot.pendant_map)):
        raise InputError(
            f"{table.source}: the joints have the tool {as_given / MM:.0f} mm from x_mm y_mm z_mm, "
            f"{better[1] / MM:.1f} mm where {better[0]}; mend the columns or the pendant table of robot "
            f"'{robot.name}'; both are as commanded, in World"
        )


def _constant(table: CsvTable, column: str) -> float:
    if not table.has(column):
        return 0.0
    values = table.numbers(column)
    changes = "changes within the file; give each tool its own file"
    table.refuse_first(values != values[0], column, lambda n: changes)
    return float(values[0])
