"""What the files say of the nominal arm, its controller, its tool and its posture."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, FiniteFloat

from compgen.core.exceptions import InputError
from compgen.core.quantities import (
    Angle,
    AngleRange,
    NotNegative,
    Place,
    Positive,
    SixAngles,
    SixNumbers,
    SixPlaces,
    SixRates,
)
from compgen.core.toml import Table
from compgen.core.units import DEG, KB, MM, MS
from compgen.robot.robot import Controller, Robot


class DhTable(Table):
    """Standard DH rows."""

    d_mm: SixPlaces
    a_mm: SixPlaces
    alpha_deg: SixAngles


class PendantTable(Table):
    """theta = matrix pendant + offset."""

    matrix: Annotated[list[SixNumbers], Field(min_length=6, max_length=6)]
    offset_deg: SixAngles


class LimitsTable(Table):
    """Joint limits as the data sheet prints them, and speeds."""

    j1_deg: AngleRange
    j2_deg: AngleRange
    j2_plus_j3_deg: AngleRange | None = None  # of theta_3, where the pendant's J3 is coupled to J2
    j3_deg: AngleRange | None = None  # of theta_3 elsewhere
    j4_deg: AngleRange
    j5_deg: AngleRange
    j6_deg: AngleRange
    speed_deg_s: SixRates
    acceleration_deg_s2: SixRates
    jerk_deg_s3: SixRates


class SingularityTable(Table):
    """How near a singularity a program may come."""

    shoulder_mm: NotNegative
    elbow_mm: NotNegative
    wrist_deg: NotNegative


class ControllerTable(Table):
    """What the controller does with a program, and holds."""

    compensation: Literal["none", "signature", "unknown"]
    signature: str = ""  # the calibration that is active on the controller
    identified_with: str = ""  # the calibration that was active when this file's errors were identified
    interpolation_ms: Annotated[FiniteFloat, Field(ge=0.1, le=1000)]
    max_lines: Annotated[int, Field(gt=0)]
    max_positions: Annotated[int, Field(gt=0)]
    memory_kB: Positive
    name_length: Annotated[int, Field(ge=8, le=36)]
    decimals: Annotated[int, Field(ge=3, le=6)] = 3
    turn_joints: Annotated[list[Annotated[int, Field(ge=1, le=6)]], Field(min_length=3, max_length=3)]


class ToolTable(Table):
    """The TCP in the flange frame, FANUC's X Y Z W P R; all zero is the flange itself (UT 0)."""

    number: Annotated[int, Field(ge=0, le=10)] | None = None
    x_mm: Place = 0.0
    y_mm: Place = 0.0
    z_mm: Place = 0.0
    w_deg: Angle = 0.0
    p_deg: Angle = 0.0
    r_deg: Angle = 0.0
    spin_deg: Angle = 0.0
    axisymmetric: bool = False


class PostureTable(Table):
    """The branch of the inverse kinematics, for the whole program."""

    arm: Literal["front", "back"] = "front"
    elbow: Literal["up", "down"] = "up"
    wrist: Literal["no flip", "flip"] = "no flip"


def robot_from_tables(
    name: str,
    dh: DhTable,
    pendant: PendantTable,
    limits: LimitsTable,
    singularity: SingularityTable,
    controller: ControllerTable,
    where: str,
) -> Robot:
    """A robot's nominal facts.

    Raises:
        InputError: Limits that do not rise, a pendant map that has no inverse, joints named twice.
    """
    coupled = limits.j2_plus_j3_deg is not None
    third = limits.j2_plus_j3_deg if limits.j2_plus_j3_deg is not None else limits.j3_deg
    if third is None or (coupled and limits.j3_deg is not None):
        told = "missing" if third is None else "conflicts with limits.j3_deg"
        raise InputError(f"{where}: limits.j2_plus_j3_deg: {told}; give it, or j3_deg where the pendant is not coupled")
    ranges = [limits.j1_deg, limits.j2_deg, third, limits.j4_deg, limits.j5_deg, limits.j6_deg]
    keys = ["j1_deg", "j2_deg", "j2_plus_j3_deg" if coupled else "j3_deg", "j4_deg", "j5_deg", "j6_deg"]
    for key, pair in zip(keys, ranges):
        if pair[0] >= pair[1]:
            raise InputError(f"{where}: limits.{key}: {pair} must rise; give the lower limit first")
    bounds = np.array(ranges) * DEG
    zero = np.array(pendant.offset_deg) * DEG
    matrix = np.array(pendant.matrix)
    if abs(np.linalg.det(matrix)) < 1e-9:
        raise InputError(f"{where}: pendant.matrix: it cannot be inverted; each joint needs its row")
    if len(set(controller.turn_joints)) != 3:
        raise InputError(f"{where}: controller.turn_joints: {controller.turn_joints} names a joint twice; name three")
    robot = Robot(
        name=name,
        d=np.array(dh.d_mm) * MM,
        a=np.array(dh.a_mm) * MM,
        alpha=np.array(dh.alpha_deg) * DEG,
        pendant_map=matrix,
        pendant_zero=zero,
        lower=bounds[:, 0] + zero,
        upper=bounds[:, 1] + zero,
        joint_names=("J1", "J2", "J2+J3" if coupled else "J3", "J4", "J5", "J6"),
        speed=np.array(limits.speed_deg_s) * DEG,
        acceleration=np.array(limits.acceleration_deg_s2) * DEG,
        jerk=np.array(limits.jerk_deg_s3) * DEG,
        shoulder_margin=singularity.shoulder_mm * MM,
        elbow_margin=singularity.elbow_mm * MM,
        wrist_margin=singularity.wrist_deg * DEG,
        controller=Controller(
            compensation="signature" if controller.compensation == "signature" else "none",
            signature=controller.signature,
            period=controller.interpolation_ms * MS,
            max_lines=controller.max_lines,
            max_positions=controller.max_positions,
            memory=controller.memory_kB * KB,
            name_length=controller.name_length,
            decimals=controller.decimals,
            turn_joints=(controller.turn_joints[0], controller.turn_joints[1], controller.turn_joints[2]),
        ),
    )
    return robot
