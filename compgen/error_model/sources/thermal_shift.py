r"""Thermal growth of tool and fixture: the tool reaches further out, or the part moves under it.

    p -> p + sum_k s_k rise_k axis

in the flange's frame along its z (tool and spindle: an air bearing grows 2 to 7 um axially, Gim 1997, study line 194),
or in World against the way that the fixture drifts. The state is a rise column of the heat model.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, IntArray, own
from compgen.core.exceptions import InputError
from compgen.core.toml import suggest
from compgen.error_model.expressions import entries
from compgen.error_model.schema import ThermalShiftTable
from compgen.error_model.source import ArmFacts, Entry, Fact, Fitting, Parameter, State, Visibility, freeze_parameters
from compgen.robot.kinematics import Chain, is_zero

FLANGE_AXIS = np.array([0.0, 0.0, 1.0])


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
    FACTS: ClassVar[tuple[Fact, ...]] = ()
    FITTING: ClassVar[Fitting | None] = None

    def __post_init__(self) -> None:
        freeze_parameters(self)
        own(self, row=("B",), axis=("B", 3), node=("B",))

    @staticmethod
    def derive(table: ThermalShiftTable, arm: ArmFacts, key: str) -> dict[str, Any]:
        """Row, axis and node of each shift.

        A fixture that moves takes the part away, so the tool is off the other way.
        """
        for name in ("node", "rate_um_K"):
            if len(getattr(table, name)) != len(table.of):
                raise InputError(
                    f"{key}.{name}: {len(getattr(table, name))} entries for {len(table.of)}; give one each"
                )
        for i, name in enumerate(table.node):
            if name not in arm.nodes:
                raise InputError(f"{key}.node.{i}: '{name}' is unknown{suggest(name, list(arm.nodes))}")
        tools = [of == "tool" for of in table.of]
        axes = [FLANGE_AXIS if of == "tool" else -np.eye(3)["xyz".index(of[-1])] for of in table.of]
        return {
            "row": np.where(tools, 6, 0).astype(int),
            "axis": np.array(axes).reshape(-1, 3),
            "node": np.array([arm.nodes.index(n) for n in table.node], dtype=int),
        }

    def entries_to_fit(self, visible: Visibility) -> list[Entry]:
        """None: the reflectors sit on the flange."""
        return []

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with its tool or its part moved."""
        for b, rate in enumerate(entries(self.rate, len(self.row))):
            if not is_zero(rate):
                shift = rate * state.rise[int(self.node[b])] * ca.DM(self.axis[b])
                chain = chain.inserted(int(self.row[b]), shift, ca.SX.eye(3))
        return chain
