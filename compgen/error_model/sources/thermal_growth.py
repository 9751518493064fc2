r"""Thermal growth of the links: a -> a + (1 + x_a) g_a . rise, d -> d + (1 + x_d) g_d . rise.

g is the growth per kelvin of each node at the robot file's cte (``thermal.profiles``), x the excess of each length's
own cte over it: an identified cte is (1 + x) times the file's. A length that points against its axis (d4 and d6 of a
FANUC arm are negative) grows away from zero too: its g is negative. Row 1's d is the base column. Source: the reference
study, equation 8; valid inside the thermal box of the robot file.
"""

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from compgen.core.arrays import Array
from compgen.error_model.expressions import entries, weighted_sum
from compgen.error_model.schema import ThermalGrowthTable
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
from compgen.robot.robot import DH_LENGTHS, LengthName


@dataclass(frozen=True, eq=False, slots=True)
class ThermalGrowth(DeclaredSource):
    """Growth of each DH length per kelvin of each node."""

    a: Array  # (6, K) [m/K]
    d: Array  # (6, K) [m/K]
    excess_a: Any = field(default_factory=lambda: np.zeros(6))  # (6,) own cte over the file's, less one
    excess_d: Any = field(default_factory=lambda: np.zeros(6))  # (6,)

    NAME: ClassVar[str] = "thermal_growth"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            field="excess_a",
            key="excess_a",
            shape=(6,),
            unit=1.0,
            prior=0.3,
            meaning="own cte of each a over the file's, less one",
        ),
        Parameter(
            field="excess_d",
            key="excess_d",
            shape=(6,),
            unit=1.0,
            prior=0.3,
            meaning="own cte of each d over the file's, less one",
        ),
    )
    FITTING: ClassVar[Fitting | None] = Fitting("temperature")
    BUDGET: ClassVar[str] = "cte"
    ARRAYS: ClassVar[Shapes] = {"a": (6, "K"), "d": (6, "K")}

    @staticmethod
    def derive(table: ThermalGrowthTable, arm: ArmFacts, key: str) -> dict[str, Any]:
        """The growth that the thermal profiles give."""
        return dict(zip(("a", "d"), arm.growth, strict=True))

    def nodes(self) -> set[int]:
        """Nodes that some length grows with."""
        return set(np.flatnonzero(self.a.any(axis=0) | self.d.any(axis=0)).tolist())

    def entries_to_fit(self, visible: Visibility) -> list[Entry]:
        """Lengths that grow, in a warm-up with known temperatures."""
        if not (visible.warm_up and visible.temperatures):
            return []
        rows = (("excess_a", self.a), ("excess_d", self.d))
        return [Entry(field, (i,)) for field, growth in rows for i in range(6) if growth[i].any()]

    def expansions(self) -> dict[LengthName, Entry]:
        """The excess of each length that grows."""
        return {
            name: Entry(f"excess_{parameter}", (row,))
            for name, (parameter, row) in DH_LENGTHS.items()
            if getattr(self, parameter)[row].any()
        }

    def without(self, length: LengthName) -> "ThermalGrowth":
        """The growth of all lengths but one."""
        parameter, row = DH_LENGTHS[length]
        growth = np.array(getattr(self, parameter))
        growth[row] = 0.0
        return replace(self, **{parameter: growth})

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with its lengths grown."""
        return replace(
            chain,
            a=_grown(chain.a, self.a, entries(self.excess_a, 6), state.rise),
            d=_grown(chain.d, self.d, entries(self.excess_d, 6), state.rise),
        )


def _grown(lengths: tuple[Any, ...], growth: Array, excess: list[Any], rise: Any) -> tuple[Any, ...]:
    grown = []
    for length, g, x in zip(lengths, growth, excess, strict=True):
        if g.any():
            increase = weighted_sum(g, rise)
            length = length + (increase if is_zero(x) else (1 + x) * increase)
        grown.append(length)
    return tuple(grown)
