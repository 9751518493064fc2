r"""Coupling between the motions of joints, and errors of gear ratios.

    theta_i -> theta_i + sum_j c_ij (theta_j - theta_0j)

with theta the commanded angles and theta_0 those at pendant zero, so that the mastered arm stays as it is. c_ij with
i != j is a coupling (wrists; J2 to J3 where a linkage or a gear ties them), c_ii the error of joint i's own ratio.
Source: the transmission errors of Everett, Driels and Mooring (1987); linear, valid over the whole range.
"""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import casadi as ca

from compgen.core.arrays import Array
from compgen.core.units import PPM
from compgen.error_model.expressions import plus
from compgen.error_model.schema import JointCouplingTable
from compgen.error_model.source import (
    ArmFacts,
    DeclaredSource,
    Entry,
    Fitting,
    Parameter,
    Shapes,
    State,
    Visibility,
)
from compgen.robot.kinematics import Chain, is_zero


@dataclass(frozen=True, eq=False, slots=True)
class JointCoupling(DeclaredSource):
    """Ratios between the commanded motion of each joint and the error of each."""

    ratio: Any  # (6, 6) [rad/rad], row: the joint that errs
    zero: Array  # (6,) [rad] theta at pendant zero

    NAME: ClassVar[str] = "joint_coupling"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            field="ratio",
            key="ratio_ppm",
            shape=(6, 6),
            unit=PPM,
            prior=200 * PPM,
            meaning="error of the row's joint per motion of the column's",
        ),
    )
    FITTING: ClassVar[Fitting | None] = Fitting("joints", JointCouplingTable())
    ARRAYS: ClassVar[Shapes] = {"zero": (6,)}

    @staticmethod
    def derive(table: JointCouplingTable, arm: ArmFacts, key: str) -> dict[str, Any]:
        """Where the arm is mastered."""
        return {"zero": arm.robot.pendant_zero}

    def entries_to_fit(self, visible: Visibility) -> list[Entry]:
        """Of every joint, what follows a joint that moves."""
        return [Entry("ratio", (i, j)) for i in range(6) for j in visible.joints]

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with its joints driven by others."""
        turned = [q - float(z) for q, z in zip(state.nominal.theta, self.zero, strict=True)]
        theta = []
        for i, q in enumerate(chain.theta):
            for j, t in enumerate(turned):
                c = self.ratio[i, j]
                if not is_zero(c):
                    q = plus(q, (c if isinstance(c, ca.SX) else float(c)) * t)
            theta.append(q)
        return replace(chain, theta=tuple(theta))
