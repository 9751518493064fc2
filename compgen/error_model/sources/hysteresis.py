r"""Backlash and friction: a joint that came from below stands behind one that came from above.

    theta_i -> theta_i - u_i (b_i + w_i sqrt(tau_i^2 + 1 (N m)^2))

b is half the backlash, w the windup of the gear under friction that grows with the load tau (``loads``), u in [-1, 1]
the direction that joint i has come from. u has a memory (``direction_memory``): after a reversal it changes over the
joint's own presliding distance. Source: Dahl (1968) for the blend that fades, the play operator (Krasnosel'skii and
Pokrovskii 1989) for the one that ends, Gautier and Khalil's load-dependent friction for w;
the reference study's hysteresis, 50 to 350 um, which it gives as a half-width. The repeatable part only.
"""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from compgen.core.arrays import Array
from compgen.core.units import MDEG, URAD
from compgen.error_model.expressions import entries
from compgen.error_model.loads import Loads, torque_expr
from compgen.error_model.schema import HysteresisTable
from compgen.error_model.source import (
    ArmFacts,
    DeclaredSource,
    Entry,
    Fact,
    Fitting,
    Law,
    Parameter,
    ReversalWidths,
    Shapes,
    State,
    Visibility,
)
from compgen.robot.kinematics import Chain, is_zero


@dataclass(frozen=True, eq=False, slots=True)
class Hysteresis(DeclaredSource):
    """Half-widths of each joint, and how far it must turn to be on the other side."""

    backlash: Any  # (6,) [rad] half-width
    windup: Any  # (6,) [rad/(N m)] half-width per load
    width: Array  # (6,) [rad] of the blend after a reversal
    loads: Loads
    law: Law = "dahl"  # how u follows the joint's motion

    NAME: ClassVar[str] = "hysteresis"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            field="backlash",
            key="backlash_mdeg",
            shape=(6,),
            unit=MDEG,
            prior=3 * MDEG,
            meaning="half the width, of each joint",
        ),
        Parameter(
            field="windup",
            key="windup_urad_Nm",
            shape=(6,),
            unit=URAD,
            prior=0.02 * URAD,
            meaning="half the width per load about the joint",
        ),
    )
    FACTS: ClassVar[tuple[Fact, ...]] = (Fact("width", "width_mdeg", MDEG), Fact("law", "law", None))
    FITTING: ClassVar[Fitting | None] = Fitting("joints", HysteresisTable(width_mdeg=6 * [200.0]))
    BUDGET: ClassVar[str] = "lost motion"
    ARRAYS: ClassVar[Shapes] = {"width": (6,)}

    @staticmethod
    def derive(table: HysteresisTable, arm: ArmFacts, key: str) -> dict[str, Any]:
        """What the joints carry."""
        return {"loads": arm.loads}

    def reversal_widths(self) -> ReversalWidths:
        """The joints' own; nothing depends on the TCP's travel."""
        return ReversalWidths(self.width, np.full(3, np.inf), self.law)

    def with_widths(self, factor: Array) -> "Hysteresis":
        """Its joints turn so many times as far to be on the other side."""
        return replace(self, width=self.width * factor)

    def entries_to_fit(self, visible: Visibility) -> list[Entry]:
        """The joints that move; windup only where they carry something."""
        fields = ("backlash", "windup") if self.loads.have_weight else ("backlash",)
        return [Entry(field, (i,)) for field in fields for i in visible.joints]

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with its joints behind by half their width."""
        lash, wind = entries(self.backlash, 6), entries(self.windup, 6)
        loaded = not all(is_zero(w) for w in wind)
        torque = torque_expr(self.loads, state.nominal) if loaded else 6 * [0.0]
        theta = []
        for i, (q, b, w, t) in enumerate(zip(chain.theta, lash, wind, torque, strict=True)):
            half = b if is_zero(w) else b + w * ca.sqrt(t * t + 1)
            theta.append(q if is_zero(half) else q - state.direction[i] * half)
        return replace(chain, theta=tuple(theta))
