"""Which parameters of which sources measurements may move, and in which order models grow."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, get_args

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray
from compgen.core.units import HOUR
from compgen.error_model.loads import loads_of
from compgen.error_model.reader import source_of
from compgen.error_model.schema import LoadsTable
from compgen.error_model.source import ArmFacts, Entry, LoadDependent, RiseDependent, Rung, Visibility
from compgen.error_model.sources import ORDER
from compgen.error_model.uncertainty import UncertainSource, prior_of
from compgen.identification.model import FreeParameter, SymbolicSource, WarmUpState
from compgen.robot.robot import Robot

WARM_RISE = 8.0  # K: typical of a node in a warm-up without temperatures
WARM_TAU = 2 * HOUR  # s: typical; its logarithm has a prior of 1


@dataclass(frozen=True, slots=True)
class CandidateModel:
    """A step of the ladder of models: its own groups come on top of those before."""

    name: str
    groups: tuple[str, ...]


def candidate_models(groups: Sequence[str]) -> list[CandidateModel]:
    """Models from the plainest to the richest, as far as there are parameters for them.

    What the warm-up shows is in all but the first, or the cold parameters would answer for it.
    """
    rung = {kind.NAME: kind.FITTING.rung for kind in ORDER if kind.FITTING} | {"warm_up": "temperature"}
    candidates = [CandidateModel("frames only", ())]
    kept = [g for g in groups if rung[g.split(".")[0]] == "temperature"]
    for name in get_args(Rung)[1:]:
        own = [g for g in groups if rung[g.split(".")[0]] == name]
        if own:
            kept = [*kept, *own]
            candidates.append(CandidateModel(name, tuple(kept)))
    return candidates


def symbolic_sources(
    robot: Robot, known: Sequence[UncertainSource], moved: BoolArray, warm: bool, log: bool = True
) -> list[SymbolicSource]:
    """The sources that can be fitted, with symbols, and the others of the robot file as they are.

    Left out are what the frames of instrument and reflector hold already: the first d and zero, the last row, base and
    tool. Where two axes are parallel, beta takes the place of d. A prior of zero in the robot file holds an entry.

    Args:
        robot: The nominal arm.
        known: The robot file's sources: facts, priors, values.
        moved: Which joints the measurements move, (6,); what only a moving joint shows is held for the others.
        warm: Whether a warm-up was measured.
        log: Whether its temperatures are known; else growth stays at the file's cte, and the rises are what is fitted.
    """
    own = {k.source.NAME: without_force(k) for k in known}
    loads = next((k.source.loads for k in own.values() if isinstance(k.source, LoadDependent)), None)
    unloaded = loads_of(LoadsTable(), robot)
    arm = ArmFacts(robot, (), (np.zeros((6, 0)), np.zeros((6, 0))), unloaded if loads is None else loads)
    visible = Visibility(robot, tuple(np.flatnonzero(moved).tolist()), warm, log)
    parts: list[SymbolicSource] = []
    for kind in ORDER:
        if kind.FITTING is None:
            continue
        start = own.get(kind.NAME)
        if kind.FITTING.table is not None and (start is None or kind.FITTING.replaces):
            source = source_of(kind, kind.FITTING.table, arm, kind.NAME)
            start = UncertainSource(source, prior_of(source), {}, "")
        if start is not None:
            parts.append(_with_symbols(start, start.source.entries_to_fit(visible)))
    return parts


def warm_up_states(known: Sequence[UncertainSource], nodes: int) -> tuple[WarmUpState, ...]:
    """Unknown states of the nodes that something grows or bends with; each with its own clock."""
    used = set[int]().union(*(k.source.nodes() for k in known if isinstance(k.source, RiseDependent)))
    return tuple(WarmUpState(k, WARM_RISE, WARM_TAU, str(k)) for k in sorted(used))


def without_force(known: UncertainSource) -> UncertainSource:
    """A source without the process force: nothing pushes on the tool while it is measured."""
    source: Any = known.source
    if not isinstance(known.source, LoadDependent):
        return known
    return replace(known, source=replace(source, loads=known.source.loads.without_force()))


def _with_symbols(start: UncertainSource, entries: Sequence[Entry]) -> SymbolicSource:
    """A source with symbols at the entries to fit, where their prior is not zero; the others stay as they are."""
    source: Any = start.source
    fields: dict[str, Any] = {}
    numbers: dict[str, Array] = {}
    symbols: list[Any] = []
    terms: list[FreeParameter] = []
    for p in source.PARAMETERS:
        value = np.array(getattr(source, p.field))
        numbers[p.field] = value
        free = [e for e in entries if e.field == p.field and start.prior[p.field][e.index] > 0]
        if not free:
            continue
        filled = ca.SX(ca.DM(value))
        for entry in free:
            index = entry.index
            symbol = ca.SX.sym("_".join([source.NAME, p.field, *map(str, index)]))
            filled[index if len(index) > 1 else index[0]] = symbol
            group = f"{source.NAME}.{entry.group or p.field}"
            deviation = float(start.prior[p.field][index])
            terms.append(FreeParameter(source.NAME, p.field, index, p.key, p.unit, deviation, group, entry.joint))
            symbols.append(symbol)
        fields[p.field] = filled
    fitted = replace(source, **fields) if fields else source
    return SymbolicSource(fitted, source, ca.vertcat(*symbols) if symbols else ca.SX.zeros(0, 1), tuple(terms), numbers)
