r"""A link that is warmer on one side bends: to a circle, as far as the gradient along it is even.

Over a link vector L (from its begin to its end) that bends by the angle phi about the unit axis n, the end turns by
phi n and moves aside by half of that lever:

    phi = sum_k b_k rise_k,      end -> end + phi n x L / 2,      R -> R(phi n)

The frame is put at the link's end (L lies behind it), or at its begin with the shift -phi n x L / 2, which ends at the
same place. The state is a rise column of the heat model, best a gradient. Source: Heisel
et al. (1997), cited by the reference study (line 266): -28.8 arcsec for 12 K at the second axis of a six-axis arm, 2.16
to 2.4 arcsec/K. Valid for turns far below a degree.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca

from compgen.core.arrays import Array, IntArray, own
from compgen.error_model.sources.expressions import cross, entries, rotation_expr
from compgen.error_model.sources.source import Parameter, State, settle
from compgen.robot.kinematics import Chain, is_zero

ARCSEC = 4.84813681109536e-06  # rad


@dataclass(frozen=True, eq=False, slots=True)
class ThermalBend:
    """Bends of links, each about an axis with one state."""

    rate: Any  # (B,) [rad/K]
    row: IntArray  # (B,) the frame it is put behind, 0 World
    axis: Array  # (B, 3) unit vector there
    lever: Array  # (B, 3) [m] there: L / 2 at a link's end, -L / 2 at its begin
    node: IntArray  # (B,) column of the rises

    NAME: ClassVar[str] = "thermal_bend"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter("rate", "rate_arcsec_K", ("B",), ARCSEC, 3 * ARCSEC, "turn of the link's end per kelvin"),
    )

    def __post_init__(self) -> None:
        settle(self)
        own(self, row=("B",), axis=("B", 3), lever=("B", 3), node=("B",))

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with its links bent."""
        for b, rate in enumerate(entries(self.rate, len(self.row))):
            if is_zero(rate):
                continue
            w = rate * state.rise[int(self.node[b])] * ca.DM(self.axis[b])
            chain = chain.inserted(int(self.row[b]), cross(w, ca.DM(self.lever[b])), rotation_expr(w, 2))
        return chain
