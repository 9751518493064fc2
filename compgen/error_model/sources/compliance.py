r"""Elastic turn of gears and bearings about the joint axes: theta_i -> theta_i + (k_i + h_i |tau_i|) tau_i.

tau is the torque of gravity, on arm and payload, and of the process force about the joint (``loads``). Gravity shows
only the product of compliance and mass, so masses are facts and compliances parameters. Source: Dumas et al.
(2011), Klimchik et al. (2013): joints hold most of a serial arm's compliance, links and bearings little.
Gears grow stiffer under load (makers give two or three stiffnesses by torque): h < 0, to first order, with |tau| as
sqrt(tau^2 + (1 N m)^2). Valid within the loads that were measured.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from compgen.core.arrays import Array
from compgen.core.units import NRAD, URAD
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

UPRIGHT = 0.01  # gravity's share across the first axis, of that along it, which loads no first joint to speak of
SURE = 3  # standard deviations below zero that no joint gives by
AGAINST = (
    "{} would give against the load: gravity pulls otherwise than sources.loads.gravity_m_s2 says (an arm on a wall or "
    "a ceiling), or the masses are others; say so in [sources.loads], and identify again"
)


@dataclass(frozen=True, eq=False, slots=True)
class JointCompliance(DeclaredSource):
    """Turn of each joint per torque about it, and how that changes with the torque."""

    compliance: Any  # (6,) [rad/(N m)]
    hardening: Any  # (6,) [rad/(N m)^2]
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
        Parameter(
            field="hardening",
            key="hardening_nrad_Nm2",
            shape=(6,),
            unit=NRAD,
            prior=0.1 * NRAD,
            meaning="change of that per torque; negative where a joint grows stiffer under load",
        ),
    )
    FITTING: ClassVar[Fitting | None] = Fitting("joints", ComplianceTable())

    @staticmethod
    def derive(table: ComplianceTable, arm: ArmFacts, key: str) -> dict[str, Any]:
        """What the joints carry."""
        return {"loads": arm.loads}

    def entries_to_fit(self, visible: Visibility) -> list[Entry]:
        """All joints that gravity loads: not the first where it stands upright; none where no mass is known."""
        fields = ("compliance", "hardening") if self.loads.have_weight else ()
        along, across = abs(self.loads.gravity[2]), np.hypot(*self.loads.gravity[:2])
        return [Entry(field, (i,)) for field in fields for i in range(0 if across > UPRIGHT * along else 1, 6)]

    def doubt(self, sigma: Mapping[str, Array]) -> str:
        """Joints that would rise under their load."""
        below = np.flatnonzero(self.compliance < -SURE * sigma.get("compliance", np.full(6, np.inf)))
        return AGAINST.format(", ".join(f"J{i + 1}" for i in below.tolist())) if len(below) else ""

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with its joints turned by what they carry."""
        give = list(zip(entries(self.compliance, 6), entries(self.hardening, 6), strict=True))
        if all(is_zero(k) and is_zero(h) for k, h in give):
            return chain
        torque = torque_expr(self.loads, state.nominal)
        theta = [plus(q, _turn(k, h, t)) for q, (k, h), t in zip(chain.theta, give, torque, strict=True)]
        return replace(chain, theta=tuple(theta))


def _turn(compliance: Any, hardening: Any, torque: Any) -> Any:
    """Of a joint by the torque about it [rad]."""
    turn: Any = 0.0 if is_zero(compliance) else compliance * torque
    return turn if is_zero(hardening) else plus(turn, hardening * torque * ca.sqrt(torque**2 + 1))
