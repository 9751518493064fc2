r"""Bending of a link that is warmer on one side: to a circle, if the gradient is even along it.

Over a link vector L (from its begin to its end) that bends by the angle phi about the unit axis n, the end turns by
phi n and moves aside by half of that lever:

    phi = sum_k b_k rise_k,      end -> end + phi n x L / 2,      R -> R(phi n)

The frame is put at the link's end (L lies behind it), or at its begin with the shift -phi n x L / 2, which ends at the
same place. The state is a rise column of the heat model, best a gradient; the difference of two nodes is two terms, of
one rate with opposite signs. Identification offers every link, plane and node. Source: Heisel et al. (1997), cited by
the reference study (line 266): -28.8 arcsec for 12 K at the second axis of a six-axis arm, 2.16 to 2.4 arcsec/K. Valid
for turns far below a degree.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import Any, ClassVar, get_args

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.exceptions import InputError
from compgen.core.units import MM
from compgen.error_model.expressions import cross, entries, rotation_expr
from compgen.error_model.schema import Link, ThermalBendTable
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
from compgen.robot.kinematics import Chain, frames_at_zero, is_zero
from compgen.robot.robot import Robot

ARCSEC = 4.84813681109536e-06  # rad


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class ThermalBend(DeclaredSource):
    """Bends of links, each about an axis with one state."""

    rate: Any  # (B,) [rad/K]
    link: tuple[str, ...]  # (B,)
    plane: tuple[str, ...]  # (B,)
    node_name: tuple[str, ...]  # (B,)
    column: Array  # () [m] height of World above the column's foot
    row: IntArray  # (B,) the frame it is put behind, 0 World
    axis: Array  # (B, 3) unit vector there
    lever: Array  # (B, 3) [m] there: L / 2 at a link's end, -L / 2 at its begin
    node: IntArray  # (B,) column of the rises

    NAME: ClassVar[str] = "thermal_bend"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            field="rate",
            key="rate_arcsec_K",
            shape=("B",),
            unit=ARCSEC,
            prior=3 * ARCSEC,
            meaning="turn of the link's end per kelvin",
        ),
    )
    FACTS: ClassVar[tuple[Fact, ...]] = (
        Fact("link", "link", None),
        Fact("plane", "plane", None),
        Fact("node_name", "node", None),
        Fact("column", "column_mm", MM),
    )
    FITTING: ClassVar[Fitting | None] = Fitting(
        "temperature", ThermalBendTable(link=[], plane=[], node=[], rate_arcsec_K=[])
    )
    BUDGET: ClassVar[str] = "bends and drift"
    ARRAYS: ClassVar[Shapes] = {
        "column": (),
        "row": ("B",),
        "axis": ("B", 3),
        "lever": ("B", 3),
        "node": ("B",),
    }

    @staticmethod
    def derive(table: ThermalBendTable, arm: ArmFacts, key: str) -> dict[str, Any]:
        """Row, axis, lever and node of each bend; positive rates turn as joint 2 does, or about World x and y."""
        count = len(table.link)
        check_terms(table, count, " links", ("plane", "node", "rate_arcsec_K"), arm, key)
        for i, (link, plane) in enumerate(zip(table.link, table.plane, strict=True)):
            if plane != "twist" and (link == "column") != (plane in "xy"):
                fit = "'x' or 'y'" if link == "column" else "'arm' or 'side'"
                raise InputError(f"{key}.plane.{i}: '{plane}' does not fit the link '{link}'; say {fit}")
            if link != "column" and not _has_length(link, arm.robot):
                raise InputError(f"{key}.link.{i}: {link} has no length in this arm; name one that has")
        terms = zip(table.link, table.plane, strict=True)
        bends = [_bend_of(link, plane, arm.robot, table.column_mm * MM) for link, plane in terms]
        return {
            "row": np.array([row for row, _, _ in bends], dtype=int),
            "axis": np.array([axis for _, axis, _ in bends]).reshape(count, 3),
            "lever": np.array([lever for _, _, lever in bends]).reshape(count, 3),
            "node": np.array([arm.nodes.index(n) for n in table.node], dtype=int),
        }

    def nodes(self) -> set[int]:
        """Nodes that something bends with."""
        return set(self.node.tolist())

    def entries_to_fit(self, visible: Visibility) -> list[Entry]:
        """All bends, in a warm-up; those of a link in a plane share the scale of their prior."""
        if not visible.warm_up:
            return []
        terms = enumerate(zip(self.link, self.plane, self.node_name, strict=True))
        return [Entry("rate", (i,), group=" ".join(term[:2]), label=" ".join(term)) for i, term in terms]

    def extended(self, arm: ArmFacts, nodes: Sequence[str]) -> tuple["ThermalBend", dict[str, Array]]:
        """With the bends and the twist of every link that has a length, following each of some nodes."""
        present = set(zip(self.link, self.plane, self.node_name, strict=True))
        added = [
            (link, plane, node)
            for link in get_args(Link)
            if link == "column" or _has_length(link, arm.robot)
            for plane in (("x", "y", "twist") if link == "column" else ("arm", "side", "twist"))
            for node in nodes
            if (link, plane, node) not in present
        ]
        terms = [*zip(self.link, self.plane, self.node_name, strict=True), *added]
        link, plane, node = (tuple(term[i] for term in terms) for i in range(3))
        table = ThermalBendTable.model_construct(
            link=list(link),
            plane=list(plane),
            node=list(node),
            column_mm=float(self.column) / MM,
            rate_arcsec_K=[0.0] * len(link),
        )
        rate = np.append(self.rate, np.zeros(len(added)))
        bend = ThermalBend(
            rate=rate, link=link, plane=plane, node_name=node, column=self.column, **self.derive(table, arm, self.NAME)
        )
        return bend, {"rate": np.full(len(added), self.PARAMETERS[0].prior)}

    def only(self, terms: BoolArray) -> "ThermalBend":
        """Some of the terms."""
        words: dict[str, Any] = {n: tuple(compress(getattr(self, n), terms)) for n in ("link", "plane", "node_name")}
        return replace(
            self, **words, **{name: getattr(self, name)[terms] for name in ("rate", "row", "axis", "lever", "node")}
        )

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with its links bent, each plane of a link once."""
        first: dict[tuple[str, str], int] = {}  # of the bends of a link in a plane
        turn: dict[int, Any] = {}
        for b, (rate, key) in enumerate(
            zip(entries(self.rate, len(self.row)), zip(self.link, self.plane, strict=True), strict=True)
        ):
            if not is_zero(rate):
                k = first.setdefault(key, b)
                turn[k] = turn.get(k, 0.0) + rate * state.rise[int(self.node[b])]
        for k, angle in turn.items():
            w = angle * ca.DM(self.axis[k])
            chain = chain.inserted(int(self.row[k]), cross(w, ca.DM(self.lever[k])), rotation_expr(w, 2))
        return chain


def _has_length(link: str, robot: Robot) -> bool:
    return bool(robot.d[3] if link == "d4" else robot.a[int(link[1]) - 1])


def _bend_of(link: str, plane: str, robot: Robot, column: float) -> tuple[int, Array, Array]:
    """Row, axis and lever of a link's bend in the frame it is put into."""
    if link == "column":
        if plane == "twist":
            return 0, np.eye(3)[2], np.zeros(3)
        return 0, np.eye(3)["xy".index(plane)], np.array([0.0, 0.0, column / 2])
    axes = frames_at_zero(robot).rotation
    index = int(link[1])
    if link == "d4":  # begins at frame 3, before joint 4 turns it
        row, vector, lever = 3, np.array([0.0, 0.0, robot.d[3]]), -0.5
    else:  # ends at its own frame
        row, vector, lever = index, np.array([robot.a[index - 1], 0.0, 0.0]), 0.5
    if plane == "twist":
        return row, vector / np.linalg.norm(vector), np.zeros(3)
    joint = axes[1 if link == "a1" else row - 1][:, 2]
    turn = axes[row].T @ joint * (-1.0 if joint @ axes[1][:, 2] < 0 else 1.0)
    if plane == "side":
        turn = np.cross(vector / np.linalg.norm(vector), turn)
    return row, np.round(turn, 15), lever * vector
