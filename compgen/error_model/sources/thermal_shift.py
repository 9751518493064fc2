r"""What holds the tool or the part grows: the tool stands further out, or the part moves under it.

    p -> p + sum_k s_k rise_k axis

in the flange's frame along its z (tool and spindle: an air bearing grows 2 to 7 um axially, Gim 1997, study line 194),
or in World against the way that the fixture drifts. The state is a rise column of the heat model.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca

from compgen.core.arrays import Array, IntArray, own
from compgen.error_model.sources.expressions import entries
from compgen.error_model.sources.source import Parameter, State, settle
from compgen.robot.kinematics import Chain, is_zero


@dataclass(frozen=True, eq=False, slots=True)
class ThermalShift:
    """Shifts along axes, each with one state."""

    rate: Any  # (B,) [m/K]
    row: IntArray  # (B,) the frame it is put behind: 6 the flange, 0 World
    axis: Array  # (B, 3) unit vector there
    node: IntArray  # (B,) column of the rises

    NAME: ClassVar[str] = "thermal_shift"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter("rate", "rate_um_K", ("B",), 1e-6, 3e-6, "shift per kelvin"),
    )

    def __post_init__(self) -> None:
        settle(self)
        own(self, row=("B",), axis=("B", 3), node=("B",))

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with its tool or its part moved."""
        for b, rate in enumerate(entries(self.rate, len(self.row))):
            if not is_zero(rate):
                shift = rate * state.rise[int(self.node[b])] * ca.DM(self.axis[b])
                chain = chain.inserted(int(self.row[b]), shift, ca.SX.eye(3))
        return chain
