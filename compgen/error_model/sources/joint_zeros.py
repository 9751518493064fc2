r"""Mastering is off: theta_i -> theta_i + delta_i.

Source: every calibration of a serial arm (Mooring, Roth and Driels 1991). Valid at any pose.
"""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

from compgen.core.units import MDEG
from compgen.error_model.sources.expressions import entries, plus
from compgen.error_model.sources.source import Parameter, State, settle
from compgen.robot.kinematics import Chain


@dataclass(frozen=True, eq=False, slots=True)
class JointZeros:
    """Constant errors of the joint angles."""

    offset: Any  # (6,) [rad] on theta

    NAME: ClassVar[str] = "joint_zeros"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter("offset", "offset_mdeg", (6,), MDEG, 50 * MDEG, "zero of each joint theta"),
    )

    def __post_init__(self) -> None:
        settle(self)

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with its joints turned."""
        return replace(chain, theta=tuple(plus(q, o) for q, o in zip(chain.theta, entries(self.offset, 6))))
