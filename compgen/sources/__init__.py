"""Error sources: each a function from a symbolic chain to a symbolic chain.

Adding one: a file with the source, a line here, its table in ``config``, a test (zero, hand formula, differences).
"""

from typing import Any, Protocol

from compgen.kinematics import Chain
from compgen.sources.thermal_growth import ThermalGrowth

__all__ = ["Source", "ThermalGrowth"]


class Source(Protocol):
    """What makes the real arm differ from the nominal one."""

    def distort(self, chain: Chain, rise: Any) -> Chain:
        """The chain with this error in it; ``rise`` (K, 1) [K] are the node rises as symbols."""
        ...
