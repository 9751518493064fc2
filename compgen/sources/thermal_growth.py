r"""Links lengthen as they warm: a -> a + g_a . rise, d -> d + g_d . rise.

g is the growth per kelvin of each node (``thermal.profiles``). A length that points against its axis (d4 and d6 of a
FANUC arm are negative) grows away from zero too: its g is negative.
"""

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from compgen.arrays import Array, own
from compgen.kinematics import Chain


@dataclass(frozen=True, eq=False, slots=True)
class ThermalGrowth:
    """Growth of each DH length per kelvin of each node."""

    a: Array  # (6, K) [m/K]
    d: Array  # (6, K) [m/K]

    def __post_init__(self) -> None:
        own(self, a=(6, "K"), d=(6, "K"))

    def distort(self, chain: Chain, rise: Any) -> Chain:
        """The chain with its lengths grown."""
        return replace(
            chain,
            a=tuple(a + _sum(g, rise) if g.any() else a for a, g in zip(chain.a, self.a)),
            d=tuple(d + _sum(g, rise) if g.any() else d for d, g in zip(chain.d, self.d)),
        )


def _sum(weights: Array, rise: Any) -> Any:
    return ca.dot(ca.DM(weights), rise)
