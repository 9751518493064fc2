r"""What is not known, one quantity at a time: a number, and what it changes.

A quantity q has an amount a_q: standard normal, or anything between two limits as likely as anything else (GUM,
type B). One unit of it changes parameters of the sources, the warmth, how far joints turn to forget a reversal, when
the program starts: its cause. Causes add, so a draw of all amounts is one cause, and the position error at waypoint n
moves to first order by

    sum_q a_q c_q(n),      c_q(n) = A(n) dp_q + B(n) drise_q(t_n) + D(n) du_q(n)
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from compgen.core.arrays import Array, owns
from compgen.thermal.uncertainty import HeatChange, Interval


@dataclass(frozen=True, eq=False, slots=True)
@owns(parameters=("P",), width=(6,))
class Cause:
    """How the world differs from what the files say."""

    parameters: Array  # (P,) [SI] of the sources
    heat: HeatChange
    width: Array  # (6,) change of the logarithm of the way over which each joint forgets a reversal
    delay: float = 0.0  # [s] that the program starts late


@dataclass(frozen=True, eq=False, slots=True)
class Quantity:
    """A number that is not known."""

    name: str
    source: str | None  # under which it stands in the budget; None: its parameters' sources
    cause: Cause  # of one unit
    limits: Interval | None = None  # of the amount; None: standard normal

    @property
    def mean(self) -> float:
        """Of the amount."""
        return 0.0 if self.limits is None else (self.limits[0] + self.limits[1]) / 2

    @property
    def deviation(self) -> float:
        """Standard deviation of the amount."""
        return 1.0 if self.limits is None else float((self.limits[1] - self.limits[0]) / np.sqrt(12))

    def amount(self, z: float) -> float:
        """The amount that is as likely to be exceeded as a standard normal number z."""
        if self.limits is None:
            return z
        return float(self.limits[0] + (self.limits[1] - self.limits[0]) * ndtr(z))


def combined(quantities: Sequence[Quantity], amounts: Sequence[float]) -> Cause:
    """The cause of all quantities at some amounts."""
    parts = [(amount, q.cause) for amount, q in zip(amounts, quantities, strict=True)]
    heat = HeatChange(
        rise=np.sum([a * c.heat.rise for a, c in parts], axis=0),
        start=np.sum([a * c.heat.start for a, c in parts], axis=0),
        scale=np.sum([a * c.heat.scale for a, c in parts], axis=0),
        lag=np.sum([a * c.heat.lag for a, c in parts], axis=0),
        air=sum(a * c.heat.air for a, c in parts),
        feed=sum(a * c.heat.feed for a, c in parts),
    )
    return Cause(
        parameters=np.sum([a * c.parameters for a, c in parts], axis=0),
        heat=heat,
        width=np.sum([a * c.width for a, c in parts], axis=0),
        delay=sum(a * c.delay for a, c in parts),
    )
