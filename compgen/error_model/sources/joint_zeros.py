r"""Error of mastering: theta_i -> theta_i + delta_i.

Source: every calibration of a serial arm (Mooring, Roth and Driels 1991). Valid at any pose.
"""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

from compgen.core.units import MDEG
from compgen.error_model.expressions import entries, plus
from compgen.error_model.schema import JointZerosTable
from compgen.error_model.source import DeclaredSource, Entry, Fitting, Parameter, State, Visibility
from compgen.robot.kinematics import Chain


@dataclass(frozen=True, eq=False, slots=True)
class JointZeros(DeclaredSource):
    """Constant errors of the joint angles."""

    offset: Any  # (6,) [rad] on theta

    NAME: ClassVar[str] = "joint_zeros"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            field="offset",
            key="offset_mdeg",
            shape=(6,),
            unit=MDEG,
            prior=50 * MDEG,
            meaning="zero of each joint theta",
        ),
    )
    FITTING: ClassVar[Fitting | None] = Fitting("joint zeros", JointZerosTable())

    def entries_to_fit(self, visible: Visibility) -> list[Entry]:
        """Joints that move, less the first and the last: the frames of instrument and reflectors hold those."""
        return [Entry("offset", (i,)) for i in visible.joints if 0 < i < 5]

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with constants added to its joints."""
        return replace(
            chain, theta=tuple(plus(q, o) for q, o in zip(chain.theta, entries(self.offset, 6), strict=True))
        )
