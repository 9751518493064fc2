r"""Parameters of the sources as symbols: how the actual position moves with each, at every waypoint.

    A = d p_actual / d p  (3, P)      B = d p_actual / d rise  (3, K)      D = d p_actual / d direction  (3, 6)

of the very expressions that predict the error (``model``). The parameters are those of the robot file's sources, and
the displacements of base and tool: a part that stands elsewhere is a base that does, the other way.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array
from compgen.core.evaluation import evaluate, kept_with
from compgen.core.pose import Pose
from compgen.error_model.direction_memory import DirectionState
from compgen.error_model.source import Source, State
from compgen.error_model.sources import ORDER
from compgen.error_model.sources.frames import BaseFrame, ToolFrame
from compgen.robot.kinematics import nominal_chain
from compgen.robot.robot import Robot


@dataclass(frozen=True, slots=True)
class SourceEntry:
    """One number of one source."""

    source: int  # place in the row of sources
    field: str
    index: tuple[int, ...]


@dataclass(frozen=True, eq=False, slots=True, weakref_slot=True)
class SourceParameters:
    """The P numbers of some sources that may be off."""

    sources: tuple[Source, ...]  # as the robot file has them, with the frames of base and tool
    entries: tuple[SourceEntry, ...]  # (P,)

    def at(self, source: int, field: str, index: tuple[int, ...]) -> int:
        """The number of an entry, from 0."""
        return self.entries.index(SourceEntry(source, field, index))

    def base(self) -> tuple[list[int], list[int]]:
        """Numbers of the displacement of the base and of its turn."""
        k = next(k for k, source in enumerate(self.sources) if isinstance(source, BaseFrame))
        return [self.at(k, "position", (i,)) for i in range(3)], [self.at(k, "rotation", (i,)) for i in range(3)]

    def tool(self) -> list[int]:
        """Numbers of the displacement of the tool."""
        k = next(k for k, source in enumerate(self.sources) if isinstance(source, ToolFrame))
        return [self.at(k, "position", (i,)) for i in range(3)]

    def budgets(self) -> tuple[str, ...]:
        """Under which name each stands in a budget, (P,)."""
        return tuple(self.sources[entry.source].BUDGET for entry in self.entries)

    def moved(self, change: Array) -> tuple[Source, ...]:
        """The sources with other values: a change (P,) [SI] is added; frames that nothing displaces are left out."""
        fields: dict[tuple[int, str], Array] = {}
        for entry, value in zip(self.entries, change.tolist(), strict=True):
            key = entry.source, entry.field
            fields.setdefault(key, np.array(getattr(self.sources[entry.source], entry.field)))[entry.index] += value
        changed = []
        for k, source in enumerate(self.sources):
            values: dict[str, Any] = {field: array for (number, field), array in fields.items() if number == k}
            changed.append(replace(source, **values) if values else source)  # type: ignore[type-var]
        frames = (BaseFrame, ToolFrame)
        return tuple(s for s in changed if not (isinstance(s, frames) and not (s.position.any() or s.rotation.any())))


@dataclass(frozen=True, eq=False, slots=True, weakref_slot=True)
class Slopes:
    """One CasADi function of theta, rise, direction, travel -> A (3 P), B (3 K), D (18), column by column."""

    function: Any

    def __call__(self, theta: Array, rise: Array, directions: DirectionState) -> tuple[Array, Array, Array]:
        """A (M, 3, P), B (M, 3, K) and D (M, 3, 6) at M waypoints."""
        columns = evaluate(self.function, theta, rise, directions.direction, directions.travel)
        A, B, D = (np.swapaxes(c.reshape(len(c), -1, 3), 1, 2) for c in columns)
        return A, B, D


def parameters_of(sources: Sequence[Source]) -> SourceParameters:
    """All numbers of some sources, and the displacements of base and tool."""
    present = [type(source) for source in sources]
    frames = [kind(np.zeros(3), np.zeros(3)) for kind in (BaseFrame, ToolFrame) if kind not in present]
    ordered = sorted([*sources, *frames], key=lambda source: ORDER.index(type(source)))
    entries = [
        SourceEntry(k, parameter.field, index)
        for k, source in enumerate(ordered)
        for parameter in source.PARAMETERS
        for index in product(*map(range, np.shape(getattr(source, parameter.field))))
    ]
    return SourceParameters(tuple(ordered), tuple(entries))


@kept_with("parameters")
def build_slopes(robot: Robot, parameters: SourceParameters, which: tuple[int, ...], nodes: int, tool: Pose) -> Slopes:
    """The derivatives of the actual position at the robot file's values.

    Args:
        robot: The nominal arm.
        parameters: Of its sources.
        which: Numbers of the P parameters that are asked for.
        nodes: Of the heat model.
        tool: TCP in the flange.
    """
    theta, rise = ca.SX.sym("theta", 6), ca.SX.sym("rise", max(nodes, 1))
    direction, travel = ca.SX.sym("direction", 6), ca.SX.sym("travel", 3)
    symbols, values = ca.SX.sym("p", len(which)), []
    fields: dict[tuple[int, str], Any] = {}
    for k, number in enumerate(which):
        entry = parameters.entries[number]
        own_value = np.asarray(getattr(parameters.sources[entry.source], entry.field), dtype=float)
        filled = fields.setdefault((entry.source, entry.field), ca.SX(ca.DM(own_value)))
        filled[entry.index if len(entry.index) > 1 else entry.index[0]] = symbols[k]
        values.append(float(own_value[entry.index]))
    chain = nominal_chain(robot, theta, tool)
    state = State(chain, rise, direction, travel)
    for k, source in enumerate(parameters.sources):
        symbolic: dict[str, Any] = {field: value for (number, field), value in fields.items() if number == k}
        chain = (replace(source, **symbolic) if symbolic else source).distort(chain, state)  # type: ignore[type-var]
    position = chain.tcp_expr()[0]
    slopes = [ca.densify(ca.jacobian(position, x)) for x in (symbols, rise, direction)]
    at_values = ca.substitute(slopes, [symbols], [ca.DM(values)]) if values else slopes
    return Slopes(ca.Function("slopes", [theta, rise, direction, travel], ca.cse(at_values)))
