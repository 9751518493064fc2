"""The faults of the real arm in the twin's own terms: plain numbers in SI, each zero on a perfect arm."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from compgen.core.arrays import Array, owns


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class ThermalDistortion:
    """A link that bends about an axis, or shifts along it, with the rise of a node."""

    bend: float  # [rad/K]
    row: int  # of the DH table whose frame moves; 0 is World
    axis: Array  # (3,)
    lever: Array  # (3,) [m]
    node: int
    shift: float = 0.0  # [m/K]


@dataclass(frozen=True, eq=False, slots=True)
class AxisDeviation:
    """Deviations of the TCP measured along a World axis, both ways."""

    axis: int
    station: Array  # (S,) [m]
    forward: Array  # (S, 3) [m]
    reverse: Array  # (S, 3) [m]
    width: float  # [m] over which the direction of travel turns


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(
    link_offsets=(6, 4),
    joint_zeros=(6,),
    joint_coupling=(6, 6),
    compliance=(6,),
    hardening=(6,),
    gear_harmonics=(6, 2, 2),
    gear_cycles=(6,),
    joint_ripple=(6, "H", 2),
    ripple_orders=("H",),
    backlash=(6,),
    windup=(6,),
    reversal_width=(6,),
    base_frame=(6,),
    tool_frame=(6,),
    mass=(7,),
    centre=(7, 3),
    gravity=(3,),
    force=(3,),
)
class Faults:
    """What is wrong with an arm; what is left out is perfect."""

    cte_excess: Mapping[str, float] = field(default_factory=dict)  # own cte of a length over the file's, less one
    link_offsets: Array = field(default_factory=lambda: np.zeros((6, 4)))  # d [m], a [m], alpha [rad], beta [rad]
    joint_zeros: Array = field(default_factory=lambda: np.zeros(6))  # [rad]
    joint_coupling: Array = field(default_factory=lambda: np.zeros((6, 6)))
    compliance: Array = field(default_factory=lambda: np.zeros(6))  # [rad/(N m)]
    hardening: Array = field(default_factory=lambda: np.zeros(6))  # [rad/(N m)^2]
    gear_harmonics: Array = field(default_factory=lambda: np.zeros((6, 2, 2)))  # [rad] joint, order, (sine, cosine)
    gear_cycles: Array = field(default_factory=lambda: np.ones(6))  # a turn
    joint_ripple: Array = field(default_factory=lambda: np.zeros((6, 0, 2)))  # [rad] joint, order, (sine, cosine)
    ripple_orders: Array = field(default_factory=lambda: np.zeros(0))  # cycles a turn
    backlash: Array = field(default_factory=lambda: np.zeros(6))  # [rad]
    windup: Array = field(default_factory=lambda: np.zeros(6))  # [rad/(N m)]
    reversal_width: Array = field(default_factory=lambda: np.ones(6))  # [rad]
    reversal_law: str = "dahl"  # or "play"
    base_frame: Array = field(default_factory=lambda: np.zeros(6))  # position [m], rotation vector [rad] in World
    tool_frame: Array = field(default_factory=lambda: np.zeros(6))  # position [m], rotation vector [rad] in the flange
    thermal_distortions: tuple[ThermalDistortion, ...] = ()
    axis_deviations: tuple[AxisDeviation, ...] = ()
    mass: Array = field(default_factory=lambda: np.zeros(7))  # [kg] links, payload
    centre: Array = field(default_factory=lambda: np.zeros((7, 3)))  # [m] behind each row; of the payload in the flange
    gravity: Array = field(default_factory=lambda: np.zeros(3))  # [m/s2]
    force: Array = field(default_factory=lambda: np.zeros(3))  # [N] in tool axes

    @property
    def only_growth(self) -> bool:
        """Whether the arm grows as no profile says, and is perfect beside."""
        numbers = (
            self.link_offsets, self.joint_zeros, self.joint_coupling, self.compliance, self.gear_harmonics,
            self.hardening, self.joint_ripple, self.backlash, self.windup, self.base_frame, self.tool_frame,
        )  # fmt: skip
        return not (any(x.any() for x in numbers) or self.thermal_distortions or self.axis_deviations)
