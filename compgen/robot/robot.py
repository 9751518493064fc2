r"""A robot's nominal facts: what its maker publishes and its controller believes.

Joint angles here and everywhere inside are DH angles theta [rad]; the pendant shows other numbers, related by

    theta = M pendant + theta_0

with M one matrix per robot (FANUC counts J3 against the horizontal: theta_3 = J2 + J3). Limits hold on theta, so a
limit on the coupled angle J2 + J3 is a plain limit on theta_3.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from compgen.core.arrays import Array, BoolArray, owns
from compgen.core.units import DEG
from compgen.robot.interference import Interference
from compgen.robot.motion import ANY_ARM, ControllerMotion, ExpectedMotion

STANDING = np.array([0, -90, 0, 0, 0, 0]) * DEG  # theta of an arm of the class, upper arm upright, forearm level ahead
SAME_PERIOD = 1e-6  # of a period: a line that is longer by less lasts whole periods
CLEAR = 1e-9  # [rad] past an edge of the polygon of J2 and J3 that is none

#: a length of the arm by name
LengthName = Literal["d1", "a1", "a2", "a3", "d4", "d6"]

#: the parameter, and its row from 0
DH_LENGTHS: dict[LengthName, tuple[Literal["a", "d"], int]] = {
    "d1": ("d", 0),
    "a1": ("a", 0),
    "a2": ("a", 1),
    "a3": ("a", 2),
    "d4": ("d", 3),
    "d6": ("d", 5),
}


@dataclass(frozen=True, slots=True)
class Capacity:
    """What a controller holds."""

    max_lines: int  # of one program
    max_positions: int  # of one program
    memory: float  # [bytes] of all programs together
    name_length: int


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Controller:
    """What the controller does with a program, and what it holds."""

    compensation: Literal["none", "signature"]  # does it correct geometry of its own?
    signature: str  # the calibration that is active on it
    period: float  # [s] interpolation
    rounds_up_to_period: bool  # does a line take a whole number of periods?
    capacity: Capacity
    decimals: int  # of the numbers in a position
    turn_joints: tuple[int, int, int]  # which joints (from 1) the three digits of CONFIG count
    payload: int | None = None  # schedule of programs that name none
    acc: int | None = None  # [%] of programs that name none

    def whole_periods(self, duration: Array) -> Array:
        """How many periods lines of some durations last when they are rounded up, (S,) [s] to (S,)."""
        return np.maximum(np.ceil(duration / self.period - SAME_PERIOD), 1.0)

    def line_time(self, duration: Array) -> Array:
        """How long the controller takes for lines of some durations, (S,) [s]."""
        return self.whole_periods(duration) * self.period if self.rounds_up_to_period else duration


@dataclass(frozen=True, eq=False, slots=True, weakref_slot=True, kw_only=True)
@owns(
    pendant_map=(6, 6),
    **dict.fromkeys(("d", "a", "alpha", "pendant_zero", "lower", "upper", "speed", "acceleration", "jerk"), (6,)),
)
class Robot:
    """A six-axis arm with a spherical wrist, standard DH: T = prod Rz(theta) Tz(d) Tx(a) Rx(alpha)."""

    name: str
    d: Array  # (6,) [m]
    a: Array  # (6,) [m]
    alpha: Array  # (6,) [rad]
    pendant_map: Array  # (6, 6) M
    pendant_zero: Array  # (6,) [rad] theta_0
    lower: Array  # (6,) [rad] on theta
    upper: Array  # (6,) [rad] on theta
    joint_names: tuple[str, ...]  # of theta, as limits are quoted: J1 J2 J2+J3 J4 J5 J6
    speed: Array  # (6,) [rad/s]
    acceleration: Array  # (6,) [rad/s2]
    jerk: Array  # (6,) [rad/s3]
    shoulder_margin: float  # [m] the wrist centre keeps this distance from the J1 axis
    elbow_margin: float  # [m] the arm keeps this distance from being stretched or folded
    wrist_margin: float  # [rad] J5 keeps this distance from zero
    controller: Controller
    motion: ControllerMotion | None = None  # what it makes of a commanded motion; None: not known
    expected_motion: ExpectedMotion = ANY_ARM  # what such arms do, where that is not known
    acceleration_known: bool = False  # accelerations and jerks are the controller's own; otherwise assumed
    interference: Interference | None = None  # where J2 and J3 may stand together; None: anywhere

    def at_acceleration(self, percent: int | None) -> "Robot":
        """The arm at a share of its accelerations, and of its jerks [assumed], as ACC asks; None: all of them."""
        if percent is None or percent == 100:
            return self
        share = percent / 100
        return replace(self, acceleration=share * self.acceleration, jerk=share * self.jerk)

    def is_clear(self, theta: Array) -> BoolArray:
        """Which joints (N, 6) [rad] have J2 and J3 where the arm does not hit itself, (N,)."""
        if self.interference is None:
            return np.ones(len(theta), dtype=bool)
        return ~(self.interference.clearance(theta) < -CLEAR)  # joints that are not known are not found out

    def to_pendant(self, theta: Array) -> Array:
        """Pendant angles of DH angles, (N, 6) [rad]."""
        return np.asarray((theta - self.pendant_zero) @ np.linalg.inv(self.pendant_map).T)

    @property
    def pendant_way(self) -> Array:
        """1 for a joint whose pendant counts as its DH angle, -1 for one that counts the other way, (6,)."""
        return np.sign(np.diag(self.pendant_map))

    def as_quoted(self, theta: Array) -> Array:
        """DH angles (..., 6) [rad] as limits are quoted: from pendant zero, each the way its pendant counts."""
        return np.asarray((theta - self.pendant_zero) * self.pendant_way)

    @property
    def quoted_limits(self) -> Array:
        """The limits, lower and upper, as the data sheet prints them, (2, 6) [rad]."""
        return np.sort([self.as_quoted(self.lower), self.as_quoted(self.upper)], axis=0)

    def to_theta(self, pendant: Array) -> Array:
        """DH angles of pendant angles, (N, 6) [rad]."""
        return np.asarray(pendant @ self.pendant_map.T + self.pendant_zero)


def coupling_of(pendant_map: Array) -> int:
    """How J2 counts in theta_3 where J3 counts upwards: 1 or -1 against the horizontal, 0 not at all."""
    return int(np.sign(pendant_map[2, 1] * pendant_map[2, 2]))


def dh_length(robot: Robot, name: LengthName) -> float:
    """The nominal length with its sign, negative where the link points against its axis [m]."""
    parameter, row = DH_LENGTHS[name]
    return float((robot.a if parameter == "a" else robot.d)[row])
