r"""Elastic turn of gears and bearings about the joint axes: theta_i -> theta_i + k_i tau_i.

tau is the torque of gravity, on arm and payload, and of the process force about the joint (``loads``). Gravity shows
only the product of compliance and mass, so masses are facts and compliances parameters. Source: Dumas et al.
(2011), Klimchik et al. (2013): joints hold most of a serial arm's compliance, links and bearings little. Linear; valid
within the rated payload.
"""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

from compgen.core.units import URAD
from compgen.error_model.expressions import entries, plus
from compgen.error_model.loads import Loads, torque_expr
from compgen.error_model.schema import ComplianceTable
from compgen.error_model.source import (
    ArmFacts,
    DeclaredSource,
    Entry,
    Fitting,
    Parameter,
    State,
    Visibility,
)
from compgen.robot.kinematics import Chain, is_zero


@dataclass(frozen=True, eq=False, slots=True)
class JointCompliance(DeclaredSource):
    """Turn of each joint per torque about it."""

    compliance: Any  # (6,) [rad/(N m)]
    loads: Loads

    NAME: ClassVar[str] = "compliance"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            field="compliance",
            key="compliance_urad_Nm",
            shape=(6,),
            unit=URAD,
            prior=URAD,
            meaning="turn of each joint per torque about it",
        ),
    )
    FITTING: ClassVar[Fitting | None] = Fitting("joints", ComplianceTable())

    @staticmethod
    def derive(table: ComplianceTable, arm: ArmFacts, key: str) -> dict[str, Any]:
        """What the joints carry."""
        return {"loads": arm.loads}

    def entries_to_fit(self, visible: Visibility) -> list[Entry]:
        """All joints that gravity loads: not the first, which stands upright; none where no mass is known."""
        return [Entry("compliance", (i,)) for i in range(1, 6)] if self.loads.have_weight else []

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with its joints turned by what they carry."""
        give = entries(self.compliance, 6)
        if all(is_zero(k) for k in give):
            return chain
        torque = torque_expr(self.loads, state.nominal)
        theta = [q if is_zero(k) else plus(q, k * t) for q, k, t in zip(chain.theta, give, torque, strict=True)]
        return replace(chain, theta=tuple(theta))
