r"""Thermal shifts: a length of the arm grows, its base moves, the tool reaches further out, the part moves under it.

    p -> p + sum_k s_k rise_k axis

of ``d1`` the base column upwards, of ``a1`` to ``d6`` a link along itself, away from zero (beside what
``thermal_growth`` gives it by a profile), of ``base x`` and ``base y`` the base in World; of the tool in the flange's
frame along its z (tool and spindle: an air bearing grows 2 to 7 um axially, Gim 1997, study line 194); of the fixture
in World against the way that it drifts. The state is a rise column of the heat model. A length L grows by cte L per
kelvin: 6.4 um/K for a column of 565 mm.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import Any, ClassVar, cast

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.exceptions import InputError
from compgen.core.units import UM
from compgen.error_model.expressions import entries
from compgen.error_model.schema import ThermalShiftTable
from compgen.error_model.source import (
    ArmFacts,
    DeclaredSource,
    Entry,
    Fact,
    Fitting,
    Parameter,
    Shapes,
    State,
    Visibility,
    check_terms,
)
from compgen.robot.kinematics import Chain, is_zero
from compgen.robot.robot import DH_LENGTHS, LengthName, Robot, dh_length

FLANGE_AXIS = np.array([0.0, 0.0, 1.0])
STEEL = 11.5e-6  # [1/K] what a length without a profile may grow by: the prior of its rate, times the length
BASE = 6e-6  # [m/K] prior of the column, whose height no table needs to give, and of the base's drift
OFFERED = ("d1", "base x", "base y")  # beside the lengths that have no profile


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class ThermalShift(DeclaredSource):
    """Shifts along axes, each with one state."""

    rate: Any  # (B,) [m/K]
    of: tuple[str, ...]  # (B,)
    node_name: tuple[str, ...]  # (B,)
    row: IntArray  # (B,) the frame it is put behind: 6 the flange, 0 World
    axis: Array  # (B, 3) unit vector there
    node: IntArray  # (B,) column of the rises

    NAME: ClassVar[str] = "thermal_shift"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter(field="rate", key="rate_um_K", shape=("B",), unit=UM, prior=3 * UM, meaning="shift per kelvin"),
    )
    FACTS: ClassVar[tuple[Fact, ...]] = (Fact("of", "of", None), Fact("node_name", "node", None))
    FITTING: ClassVar[Fitting | None] = Fitting("temperature", ThermalShiftTable(of=[], node=[], rate_um_K=[]))
    BUDGET: ClassVar[str] = "bends and drift"
    ARRAYS: ClassVar[Shapes] = {"row": ("B",), "axis": ("B", 3), "node": ("B",)}

    @staticmethod
    def derive(table: ThermalShiftTable, arm: ArmFacts, key: str) -> dict[str, Any]:
        """Row, axis and node of each shift.

        A fixture that moves takes the part away, so the tool is off the other way.
        """
        check_terms(table, len(table.of), "", ("node", "rate_um_K"), arm, key)
        for i, of in enumerate(table.of):
            if of in DH_LENGTHS and of != "d1" and not dh_length(arm.robot, cast(LengthName, of)):
                raise InputError(f"{key}.of.{i}: {of} has no length in this arm; name one that has")
        places = [_place_of(of, arm.robot) for of in table.of]
        return {
            "row": np.array([row for row, _ in places], dtype=int),
            "axis": np.array([axis for _, axis in places]).reshape(-1, 3),
            "node": np.array([arm.nodes.index(n) for n in table.node], dtype=int),
        }

    def nodes(self) -> set[int]:
        """Nodes that something of the arm shifts with."""
        return {int(k) for k, of in zip(self.node, self.of, strict=True) if _of_the_arm(of)}

    def entries_to_fit(self, visible: Visibility) -> list[Entry]:
        """Those of the arm, in a warm-up; reflectors sit on the flange and say nothing of tool and fixture."""
        if not visible.warm_up:
            return []
        terms = enumerate(zip(self.of, self.node_name, strict=True))
        return [Entry("rate", (i,), group=of, label=f"{of} {node}") for i, (of, node) in terms if _of_the_arm(of)]

    def extended(self, arm: ArmFacts, nodes: Sequence[str]) -> tuple["ThermalShift", dict[str, Array]]:
        """With the base, and every length that no profile heats, following each of some nodes."""
        present = set(zip(self.of, self.node_name, strict=True))
        lengths = [n for n in DH_LENGTHS if n not in OFFERED and dh_length(arm.robot, n) and not _heated(n, arm)]
        offered = (*(n for n in OFFERED if n != "d1" or not _heated("d1", arm)), *lengths)
        added = [(of, node) for of in offered for node in nodes if (of, node) not in present]
        terms = [*zip(self.of, self.node_name, strict=True), *added]
        of, node = (tuple(term[i] for term in terms) for i in range(2))
        table = ThermalShiftTable.model_construct(of=list(of), node=list(node), rate_um_K=[0.0] * len(of))
        rate = np.append(self.rate, np.zeros(len(added)))
        prior = [BASE if n in OFFERED else STEEL * abs(dh_length(arm.robot, cast(LengthName, n))) for n, _ in added]
        return ThermalShift(rate=rate, of=of, node_name=node, **self.derive(table, arm, self.NAME)), {
            "rate": np.array(prior)
        }

    def only(self, terms: BoolArray) -> "ThermalShift":
        """Some of the terms."""
        words: dict[str, Any] = {n: tuple(compress(getattr(self, n), terms)) for n in ("of", "node_name")}
        return replace(self, **words, **{name: getattr(self, name)[terms] for name in ("rate", "row", "axis", "node")})

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with its links, its base, its tool or its part moved."""
        shift: dict[int, Any] = {}  # of each row
        for b, rate in enumerate(entries(self.rate, len(self.row))):
            if not is_zero(rate):
                row = int(self.row[b])
                shift[row] = shift.get(row, 0.0) + rate * state.rise[int(self.node[b])] * ca.DM(self.axis[b])
        for row, total in shift.items():
            chain = chain.inserted(row, total, ca.SX.eye(3))
        return chain


def _of_the_arm(of: str) -> bool:
    return of != "tool" and not of.startswith("fixture")


def _heated(name: LengthName, arm: ArmFacts) -> bool:
    """Whether a profile lets a length grow already."""
    parameter, row = DH_LENGTHS[name]
    return bool(arm.growth[0 if parameter == "a" else 1][row].any())


def _place_of(of: str, robot: Robot) -> tuple[int, Array]:
    """The frame that a shift is put behind, and its axis there."""
    if of == "tool":
        return 6, FLANGE_AXIS
    if of.startswith("fixture"):
        return 0, -np.eye(3)["xyz".index(of[-1])]
    if of == "d1" or of.startswith("base"):
        return 0, np.eye(3)[2 if of == "d1" else "xy".index(of[-1])]
    name = cast(LengthName, of)
    parameter, row = DH_LENGTHS[name]
    sign = np.sign(dh_length(robot, name))
    # a lies along x of the frame behind its row, d along z of the frame before it
    return (row + 1, sign * np.eye(3)[0]) if parameter == "a" else (row, sign * np.eye(3)[2])
