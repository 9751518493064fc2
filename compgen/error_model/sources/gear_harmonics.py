r"""Transmission error of the gears, first and second order: once and twice a turn of an eccentric part.

    theta_i -> theta_i + sum_{n = 1, 2} [ s_in sin(n N_i theta_i) + c_in cos(n N_i theta_i) ]

at the commanded theta. N_i is how often the eccentric part turns for one turn of the joint: 1 for the joint's own
gear wheel and encoder, the gear ratio for the motor's side. Source: transmission error of harmonic and cycloidal drives
(Tuttle and Seering 1996). Errors with periods in the tool's mid-spatial band (N_i of some hundred) are not corrected:
the correction is smooth there.
"""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import casadi as ca

from compgen.core.arrays import Array, own
from compgen.core.units import MDEG
from compgen.error_model.schema import GearHarmonicsTable
from compgen.error_model.source import (
    Entry,
    Fact,
    Fitting,
    Parameter,
    State,
    TableSource,
    Visibility,
    freeze_parameters,
)
from compgen.robot.kinematics import Chain, is_zero


@dataclass(frozen=True, eq=False, slots=True)
class GearHarmonics(TableSource):
    """First and second order of each joint's transmission error."""

    sine: Any  # (6, 2) [rad]
    cosine: Any  # (6, 2) [rad]
    cycles: Array  # (6,) N

    NAME: ClassVar[str] = "gear_harmonics"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            field="sine",
            key="sine_mdeg",
            shape=(6, 2),
            unit=MDEG,
            prior=5 * MDEG,
            meaning="first and second order, of each joint",
        ),
        Parameter(
            field="cosine",
            key="cosine_mdeg",
            shape=(6, 2),
            unit=MDEG,
            prior=5 * MDEG,
            meaning="first and second order, of each joint",
        ),
    )
    FACTS: ClassVar[tuple[Fact, ...]] = (Fact("cycles", "cycles", 1.0),)
    FITTING: ClassVar[Fitting | None] = Fitting("joints", GearHarmonicsTable())

    def __post_init__(self) -> None:
        freeze_parameters(self)
        own(self, cycles=(6,))

    def entries_to_fit(self, visible: Visibility) -> list[Entry]:
        """Both orders of the joints that move; each order has a scale of its own."""
        return [
            Entry(field, (i, n), group=str(n + 1))
            for field in ("sine", "cosine")
            for i in visible.joints
            for n in range(2)
        ]

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with first and second orders added to its joints."""
        theta = []
        for i, (q, commanded) in enumerate(zip(chain.theta, state.nominal.theta, strict=True)):
            for n in (1, 2):
                angle = n * float(self.cycles[i]) * commanded
                for size, wave in ((self.sine[i, n - 1], ca.sin), (self.cosine[i, n - 1], ca.cos)):
                    if not is_zero(size):
                        q = q + size * wave(angle)
            theta.append(q)
        return replace(chain, theta=tuple(theta))
