"""A robot file from a URDF file: what that knows of the arm, and conservative guesses of the rest, each marked."""

import re
import tomllib
from pathlib import Path

import numpy as np

from compgen.core.exceptions import InputError, naming_file
from compgen.core.units import DEG, MM
from compgen.pipelines.files.robot_file import arm_of
from compgen.robot.arm_geometry import ClassArm
from compgen.robot.urdf import UrdfArm, read_urdf

TIME_TO_SPEED = 0.875  # [s] that full speed takes, as assumed for the shipped arms
TIME_TO_ACCELERATION = 0.2  # [s]
LARGEST = 30.0  # [rad], [rad/s]: no joint turns so far or so fast, and degrees are more
NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,30}")
CONTROLLER = """# Settings of your controller: set them from its status screen. [assumed]
[controller]
compensation = "none"  # "none", or "signature" when it corrects geometry itself
interpolation_ms = 8
rounds_up_to_period = true  # as FANUC's; false where lines last as long as length over speed
max_lines = 9999
max_positions = 32767
memory_kB = 1000
name_length = 32
decimals = 3
turn_joints = [1, 4, 6]
"""

TEXT = """#:schema ./robot.schema.json
# {name}: nominal arm without heat, from {source}; the same flange at 1,000 poses to {off:.1g} mm.
# [urdf] from that file; [assumed] chosen conservatively. Compare with the pendant before you trust it.

name = "{name}"

# World: on the axis of joint 1 at the height of joint 2, {height:g} mm above the file's base. [urdf]
[dh]
d_mm = {d}
a_mm = {a}
alpha_deg = {alpha}

# theta = matrix pendant + offset, {joint_3}. [assumed] compare the position screen
[pendant]
matrix = [
{rows}
]
offset_deg = {offset}

[limits]
{limits}
speed_deg_s = {speed}
acceleration_deg_s2 = {acceleration}  # [assumed]
jerk_deg_s3 = {jerk}  # [assumed]

# How near a singularity a program may come. [assumed]
[singularity]
shoulder_mm = 20
elbow_mm = 1
wrist_deg = 1

"""


def robot_from_urdf(source: str, *, coupled: bool) -> tuple[str, str]:
    """A robot file's name and text.

    Args:
        source: A URDF file.
        coupled: Whether the file's joint 3 is the pendant's J2 + J3, as ROS-Industrial's of FANUC arms is.

    Raises:
        InputError: What ``read_urdf`` refuses; a joint without limits or speed, or with them in degrees; a name
            that no robot can have.
    """
    read = read_urdf(source)
    arm = read.arm
    name = re.sub(r"[^a-z0-9_-]", "_", Path(source).stem.lower())
    if not NAME.fullmatch(name):
        raise InputError(f"{source}: its name gives the robot's, which has letters, digits, - and _; rename the file")
    for joint, limits in zip(read.joints, read.limits, strict=True):
        for key, value in zip(("lower", "upper", "velocity"), limits.tolist(), strict=True):
            if np.isnan(value) or (key == "velocity" and value <= 0):
                given = "missing; add it" if np.isnan(value) else f"{value:g}: no joint turns so; give it"
                raise InputError(f"{source}: joint '{joint[:40]}': limit {key}: {given} from the data sheet")
        lower, upper = limits[:2].tolist()
        if lower >= upper:
            raise InputError(
                f"{source}: joint '{joint[:40]}': limit lower {lower:g} is not below upper {upper:g}; mend them"
            )
    _check_radians(source, read)
    if coupled and (arm.sign[1] < 0 or arm.sign[2] < 0):
        cause = "joints 2 and 3 do not count as FANUC's do"
        if (arm.sign[1:3] < 0).all() and _reaches_back(arm):
            cause = "axis 2 lies behind axis 1, seen to where the arm reaches (a1 is negative), as in no FANUC arm"
        raise InputError(f"{source}: {cause}, whose joint 3 is J2 + J3; say --j3 alone")
    text = _text(read, name, Path(source).name, coupled=coupled)
    with naming_file(source):
        arm_of(tomllib.loads(text), text, "its robot file")  # one that would not load is refused here
    return name, text


def _reaches_back(arm: ClassArm) -> bool:
    """Whether the flange of the pose that an arm was read in lies behind axis 1, seen from there to axis 2."""
    x, y, _ = arm.flange_pose(np.zeros((1, 6))).position[0]
    return bool(x * np.cos(arm.zero[0]) + y * np.sin(arm.zero[0]) < 0)


def _check_radians(source: str, read: UrdfArm) -> None:
    """Raises InputError where a limit can only be in degrees."""
    joint, k = np.unravel_index(int(np.abs(read.limits).argmax()), read.limits.shape)
    value = float(read.limits[joint, k])
    if abs(value) > LARGEST:
        key, unit = (("lower", "rad"), ("upper", "rad"), ("velocity", "rad/s"))[int(k)]
        name = read.joints[int(joint)][:40]
        raise InputError(
            f"{source}: joint '{name}': limit {key}: {value:g} {unit} is beyond {LARGEST:g}; is it in degrees? a URDF "
            "has radians"
        )


def _text(read: UrdfArm, name: str, source: str, *, coupled: bool) -> str:
    arm = read.arm
    matrix = np.diag(arm.sign)
    if coupled:
        matrix[2, 1] = 1.0
    rows = "\n".join(f"    [{', '.join(f'{v + 0.0:g}' for v in row)}]," for row in matrix)
    keys = ["j1_deg", "j2_deg", "j2_plus_j3_deg" if coupled else "j3_deg", "j4_deg", "j5_deg", "j6_deg"]
    limits = "\n".join(f"{key} = {_list(row[:2] / DEG)}" for key, row in zip(keys, read.limits, strict=True))
    speed = read.limits[:, 2] / DEG
    acceleration = np.maximum(np.floor(speed / TIME_TO_SPEED / 10) * 10, 10.0)
    text = TEXT.format(
        name=name,
        source=source,
        off=read.off / MM,
        height=arm.origin[2] / MM,
        d=_list(arm.d / MM),
        a=_list(arm.a / MM),
        alpha=_list(arm.alpha / DEG),
        joint_3="the file's joint 3 being J2 + J3" if coupled else "J3 counting alone",
        rows=rows,
        offset=_list(arm.zero / DEG),
        limits=limits,
        speed=_list(speed),
        acceleration=_list(acceleration),
        jerk=_list(acceleration / TIME_TO_ACCELERATION),
    )
    return text + CONTROLLER


def _list(values: np.ndarray) -> str:
    return "[" + ", ".join(f"{round(float(v), 9) + 0.0:.10g}" for v in values) + "]"
