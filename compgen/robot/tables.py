"""Tables of the nominal arm, its controller, its tool and its posture, and the robot made from them."""

from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, FiniteFloat

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.core.polygons import signed_area
from compgen.core.pose import Pose
from compgen.core.rotations import from_wpr, rotation_matrix
from compgen.core.toml import (
    Angle,
    AngleRange,
    Coordinate,
    NotNegative,
    Positive,
    SixAngles,
    SixCoordinates,
    SixFactors,
    SixRates,
    Table,
)
from compgen.core.units import DEG, KB, MM, MS
from compgen.robot.arm_geometry import in_class_rows
from compgen.robot.interference import Interference, polygon_fault
from compgen.robot.robot import Capacity, Controller, Robot, coupling_of

PayloadNumber = Annotated[int, Field(ge=1, le=10)]
AccPercent = Annotated[int, Field(ge=1, le=100)]


class DhTable(Table):
    """Standard Denavit-Hartenberg rows, joint 1 to 6, of any signs; World's origin is on the axis of joint 1."""

    d_mm: SixCoordinates
    """Offsets along the joint axes, signed."""
    a_mm: SixCoordinates
    """Link lengths along the common normals, signed."""
    alpha_deg: SixAngles
    """Twists between neighbouring joint axes."""


class PendantTable(Table):
    """From pendant angles to DH angles: theta = matrix * pendant + offset."""

    matrix: Annotated[list[SixFactors], Field(min_length=6, max_length=6)]
    """Rows: DH joints; columns: pendant joints."""
    offset_deg: SixAngles
    """DH angles at pendant zero."""


class InterferenceTable(Table):
    """Where the arm hits itself: what J2 and J3 may be together."""

    j2_j3_deg: list[Annotated[list[Angle], Field(min_length=2, max_length=2)]] = []
    """Corners, in their order, of the area of the pendant's J2 and J3 that is allowed; none: anywhere."""


class LimitsTable(Table):
    """Joint limits as the data sheet prints them, lower limit first, and the largest rates of the joints."""

    j1_deg: AngleRange
    """Range of the pendant's J1."""
    j2_deg: AngleRange
    """Range of the pendant's J2."""
    j2_plus_j3_deg: AngleRange | None = None
    """Range of J2 + J3, where the pendant's J3 is coupled to J2; this or j3_deg."""
    j3_deg: AngleRange | None = None
    """Range of J3, where the pendant is not coupled; this or j2_plus_j3_deg."""
    j4_deg: AngleRange
    """Range of the pendant's J4."""
    j5_deg: AngleRange
    """Range of the pendant's J5."""
    j6_deg: AngleRange
    """Range of the pendant's J6."""
    speed_deg_s: SixRates
    """Largest speed of each joint."""
    acceleration_deg_s2: SixRates
    """Largest acceleration of each joint."""
    jerk_deg_s3: SixRates
    """Largest jerk of each joint."""
    acceleration_known: bool = False
    """Whether accelerations and jerks are the maker's or measured; else assumed, and check --strict looks at them."""
    interference: InterferenceTable = InterferenceTable()


class SingularityTable(Table):
    """How near a singularity a program may come."""

    shoulder_mm: NotNegative
    """Least distance of the wrist centre from the axis of joint 1."""
    elbow_mm: NotNegative
    """Least distance of the wrist centre from the edge of its reach."""
    wrist_deg: NotNegative
    """Least angle of joint 5 from zero."""


class ControllerTable(Table):
    """What the controller does with a program, and how much it holds."""

    compensation: Literal["none", "signature", "unknown"]
    """Whether the controller corrects its own geometry; unknown is refused when a program is corrected."""
    signature: str = ""
    """Name of the calibration that is active on the controller; compensation = "signature" needs it."""
    identified_with: str = ""
    """Name of the calibration that was active when this file's error sources were identified."""
    interpolation_ms: Annotated[FiniteFloat, Field(ge=0.1, le=1000)]
    """Interpolation period."""
    rounds_up_to_period: bool = True
    """Whether each line takes a whole number of interpolation periods, its time rounded up; FANUC's do."""
    max_lines: Annotated[int, Field(gt=0)]
    """Most program lines in one file."""
    max_positions: Annotated[int, Field(gt=0)]
    """Most positions in one file."""
    memory_kB: Positive
    """Free memory for programs."""
    name_length: Annotated[int, Field(ge=8, le=36)]
    """Most characters in a program's name."""
    decimals: Annotated[int, Field(ge=3, le=6)] = 3
    """Decimals of the numbers in a position."""
    turn_joints: Annotated[list[Annotated[int, Field(ge=1, le=6)]], Field(min_length=3, max_length=3)]
    """Joints that the turn numbers of CONFIG count."""
    payload: PayloadNumber | None = None
    """PAYLOAD schedule of programs whose path file names none (tool.payload); default not said."""
    acc_percent: AccPercent | None = None
    """ACC of the motions of programs whose path file names none (process.acc_percent); default not said."""


#: the keys of a tool that say where its centre point is
TOOL_POSE = ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg", "length_mm", "tilt_deg")


class ToolTable(Table):
    """Tool centre point in the flange frame, in FANUC's X Y Z W P R."""

    number: Annotated[int, Field(ge=0, le=10)] | None = None
    """UTOOL number; default 0, the flange itself, when all offsets are 0, else 1."""
    payload: PayloadNumber | None = None
    """PAYLOAD schedule that holds this tool's mass on the controller; default the robot file's."""
    x_mm: Coordinate = 0.0
    """Tool centre point in the flange, x."""
    y_mm: Coordinate = 0.0
    """Tool centre point in the flange, y."""
    z_mm: Coordinate = 0.0
    """Tool centre point in the flange, z."""
    w_deg: Angle = 0.0
    """Rotation of the tool about the flange's x."""
    p_deg: Angle = 0.0
    """Rotation of the tool about the flange's y."""
    r_deg: Angle = 0.0
    """Rotation of the tool about the flange's z."""
    length_mm: Annotated[FiniteFloat, Field(ge=0, le=1e4)] = 0.0
    """Length along the tool's own axis, from x_mm, y_mm, z_mm to the tool centre point."""
    tilt_deg: Annotated[FiniteFloat, Field(ge=-150, le=150)] = 0.0
    """Lean of the tool's axis from the flange's z, towards x; in place of w_deg, p_deg, r_deg."""
    tilt_towards_deg: Angle = 0.0
    """Direction in the flange that tilt_deg leans to, from x about z: 90 is towards y."""
    sigma_um: Annotated[list[NotNegative], Field(min_length=3, max_length=3)] = [0.0, 0.0, 0.0]
    """Standard deviation of the tool centre point along the flange's x, y, z."""
    spin_deg: Angle = 0.0
    """Angle of the tool's x axis from World's x, or the frame's, counted about its z."""
    axisymmetric: bool = False
    """Whether the tool is round, so that a correction may turn it about its own axis."""


def tool_pose(table: ToolTable, file: str) -> Pose:
    """The tool centre point in the flange.

    Raises:
        InputError: Its orientation is said twice, or a direction without how far it leans.
    """
    angles = (table.w_deg, table.p_deg, table.r_deg)
    if table.tilt_deg and any(angles):
        raise InputError(f"{file}: tool.tilt_deg: w_deg, p_deg, r_deg say how the tool stands too; keep one of them")
    if table.tilt_towards_deg and "tilt_deg" not in table.model_fields_set:
        raise InputError(f"{file}: tool.tilt_towards_deg: nothing leans that way; give tilt_deg, or remove it")
    turn = from_wpr(*(np.array([angle * DEG]) for angle in angles))[0]
    if table.tilt_deg:  # about the axis in the flange's plane that is square to where it leans to
        towards = table.tilt_towards_deg * DEG
        turn = rotation_matrix(table.tilt_deg * DEG * np.array([-np.sin(towards), np.cos(towards), 0.0]))
    foot = np.array([table.x_mm, table.y_mm, table.z_mm])
    return Pose((foot + table.length_mm * turn[:, 2]) * MM, turn)


class PostureTable(Table):
    """Branch of the inverse kinematics, the same for the whole program."""

    arm: Literal["front", "back"] = "front"
    """Whether the wrist is before or behind the axis of joint 1."""
    elbow: Literal["up", "down"] = "up"
    """Whether the elbow is above or below the line from shoulder to wrist."""
    wrist: Literal["no flip", "flip"] = "no flip"
    """Sign of joint 5: flip where it is positive."""


def robot_from_tables(
    name: str,
    dh: DhTable,
    pendant: PendantTable,
    limits: LimitsTable,
    singularity: SingularityTable,
    controller: ControllerTable,
    file: str,
) -> Robot:
    """The nominal arm and its controller.

    Args:
        name: Of the robot.
        dh: As the file has it; so are the next four.
        pendant: The map between pendant and DH angles.
        limits: Of the joints.
        singularity: Distances to keep.
        controller: What it does and holds.
        file: Named in exceptions.

    Raises:
        InputError: Limits that do not rise, a pendant map that has no inverse, joints named twice.
    """
    matrix = np.array(pendant.matrix)
    bounds, third = _ranges(limits, file, coupling_of(matrix))
    zero = np.array(pendant.offset_deg) * DEG
    if abs(np.linalg.det(matrix)) < 1e-9:
        raise InputError(f"{file}: pendant.matrix: it cannot be inverted; each joint needs its row")
    ends = np.diag(matrix)[:, None] * bounds  # a pendant may count the other way
    robot = Robot(
        name=name,
        d=np.array(dh.d_mm) * MM,
        a=np.array(dh.a_mm) * MM,
        alpha=np.array(dh.alpha_deg) * DEG,
        pendant_map=matrix,
        pendant_zero=zero,
        lower=ends.min(axis=1) + zero,
        upper=ends.max(axis=1) + zero,
        joint_names=("J1", "J2", third, "J4", "J5", "J6"),
        speed=np.array(limits.speed_deg_s) * DEG,
        acceleration=np.array(limits.acceleration_deg_s2) * DEG,
        jerk=np.array(limits.jerk_deg_s3) * DEG,
        shoulder_margin=singularity.shoulder_mm * MM,
        elbow_margin=singularity.elbow_mm * MM,
        wrist_margin=singularity.wrist_deg * DEG,
        controller=_controller(controller, file),
        acceleration_known=limits.acceleration_known,
    )
    robot = in_class_rows(robot)
    return replace(robot, interference=_interference(limits.interference, robot.pendant_map, robot.pendant_zero, file))


def _ranges(limits: LimitsTable, file: str, coupling: int) -> tuple[Array, str]:
    """Ranges of the pendant's joints, (6, 2) [rad], and what the third of them is of, by how J2 counts in theta_3."""
    coupled = limits.j2_plus_j3_deg is not None
    third = limits.j2_plus_j3_deg if limits.j2_plus_j3_deg is not None else limits.j3_deg
    if third is None or (coupled and limits.j3_deg is not None):
        text = "missing" if third is None else "conflicts with limits.j3_deg"
        raise InputError(f"{file}: limits.j2_plus_j3_deg: {text}; give it, or j3_deg where the pendant is not coupled")
    if coupled and not coupling:
        raise InputError(
            f"{file}: limits.j2_plus_j3_deg: pendant.matrix does not couple J3 to J2; give j3_deg, or mend it"
        )
    if coupling and not coupled:
        raise InputError(f"{file}: limits.j3_deg: pendant.matrix couples J3 to J2; give j2_plus_j3_deg, or mend it")
    ranges = [limits.j1_deg, limits.j2_deg, third, limits.j4_deg, limits.j5_deg, limits.j6_deg]
    keys = ["j1_deg", "j2_deg", "j2_plus_j3_deg" if coupled else "j3_deg", "j4_deg", "j5_deg", "j6_deg"]
    for key, pair in zip(keys, ranges, strict=True):
        if pair[0] >= pair[1]:
            raise InputError(f"{file}: limits.{key}: {pair} must rise; give the lower limit first")
    return np.array(ranges) * DEG, ("J3", "J2+J3", "J3-J2")[coupling]


def _controller(table: ControllerTable, file: str) -> Controller:
    """What the controller does and holds."""
    first, second, third = table.turn_joints
    if len({first, second, third}) != 3:
        raise InputError(f"{file}: controller.turn_joints: {table.turn_joints} names a joint twice; name three")
    return Controller(
        compensation="signature" if table.compensation == "signature" else "none",
        signature=table.signature,
        period=table.interpolation_ms * MS,
        rounds_up_to_period=table.rounds_up_to_period,
        capacity=Capacity(table.max_lines, table.max_positions, table.memory_kB * KB, table.name_length),
        decimals=table.decimals,
        turn_joints=(first, second, third),
        payload=table.payload,
        acc=table.acc_percent,
    )


def _interference(table: InterferenceTable, matrix: Array, zero: Array, file: str) -> Interference | None:
    """The polygon of J2 and J3; None where none is given.

    Raises:
        InputError: It encloses nothing, or crosses itself.
    """
    if not table.j2_j3_deg:
        return None
    corner = np.array(table.j2_j3_deg) * DEG
    if len(corner) > 1 and (corner[0] == corner[-1]).all():
        corner = corner[:-1]  # data sheets close it
    if fault := polygon_fault(corner):
        raise InputError(f"{file}: limits.interference.j2_j3_deg: {fault}")
    return Interference.of(corner if signed_area(corner) > 0 else corner[::-1], matrix, zero)
