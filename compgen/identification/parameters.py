"""Which parameters of which sources can be fitted, and the candidate models, from the plainest to the richest."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast, get_args

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray
from compgen.error_model.loads import loads_of
from compgen.error_model.schema import LoadsTable
from compgen.error_model.source import ArmFacts, Entry, Extensible, LoadDependent, RiseDependent, Rung, Visibility
from compgen.error_model.sources import ORDER
from compgen.error_model.uncertain_sources import UncertainSource, prior_of, source_of
from compgen.identification.model import FreeParameter, SymbolicSource
from compgen.robot.robot import Robot


@dataclass(frozen=True, slots=True)
class CandidateModel:
    """A model that may explain the measurements: the groups of parameters that are free in it."""

    name: str
    groups: tuple[str, ...]


def candidate_models(groups: Sequence[str]) -> list[CandidateModel]:
    """Models from the plainest to the richest, as far as there are parameters for them.

    Parameters of the warm-up are in all but the first, or the cold parameters would take up its effect.
    """
    rung = {kind.NAME: kind.FITTING.rung for kind in ORDER if kind.FITTING} | {"warm_up": "temperature"}
    candidates = [CandidateModel("frames only", ())]
    active = [g for g in groups if rung[g.split(".")[0]] == "temperature"]
    for name in get_args(Rung)[1:]:
        added = [g for g in groups if rung[g.split(".")[0]] == name]
        if added:
            active = [*active, *added]
            candidates.append(CandidateModel(name, tuple(active)))
    return candidates


def symbolic_sources(
    robot: Robot,
    known: Sequence[UncertainSource],
    moved: BoolArray,
    *,
    warm: bool,
    log: bool = True,
    facts: ArmFacts | None = None,
    offered: Sequence[str] = (),
) -> list[SymbolicSource]:
    """The sources that can be fitted, with symbols, and the others of the robot file as they are.

    Left out is what the frames of instrument and reflector contain: the first d and zero, the last row, base and tool.
    Where two axes are parallel, beta takes the place of d. A prior of zero in the robot file holds an entry.

    Args:
        robot: The nominal arm.
        known: The robot file's sources: facts, priors, values.
        moved: Which joints the measurements move, (6,); parameters of the others stay fixed.
        warm: Whether a warm-up was measured.
        log: Whether its temperatures are known; else growth stays at the file's cte, and the rises are what is fitted.
        facts: What the robot file says of the arm: what it carries, and how it grows; None: what ``known`` tells of it.
        offered: Nodes that anything may follow in a warm-up, whether or not the robot file has a term for it.
    """
    of_file = {k.source.NAME: without_force(k) for k in known}
    arm = _facts_of(robot, of_file.values()) if facts is None else replace(facts, loads=facts.loads.without_force())
    visible = Visibility(robot, tuple(np.flatnonzero(moved).tolist()), warm, log)
    sources: list[SymbolicSource] = []
    for kind in ORDER:
        if kind.FITTING is None:
            continue
        entry = of_file.get(kind.NAME)
        if kind.FITTING.table is not None and (entry is None or kind.FITTING.replaces):
            source = source_of(kind, kind.FITTING.table, arm, kind.NAME)
            entry = UncertainSource(source, prior_of(source), {}, "")
        if entry is not None and isinstance(entry.source, Extensible) and warm and offered:
            entry = _extended(entry, arm, offered)
        if entry is not None:
            sources.append(_with_symbols(entry, entry.source.entries_to_fit(visible)))
    return sources


def warm_up_states(known: Sequence[UncertainSource]) -> tuple[int, ...]:
    """Nodes of unknown rise: those that a source depends on, each with its own time constant; one where none does."""
    used = set[int]().union(*(k.source.nodes() for k in known if isinstance(k.source, RiseDependent)))
    return tuple(sorted(used or {0}))


def _facts_of(robot: Robot, known: Iterable[UncertainSource]) -> ArmFacts:
    """What sources tell of the arm: its loads, no nodes."""
    loads = next((k.source.loads for k in known if isinstance(k.source, LoadDependent)), None)
    return ArmFacts(robot, (), (np.zeros((6, 0)), np.zeros((6, 0))), loads or loads_of(LoadsTable(), robot))


def _extended(known: UncertainSource, arm: ArmFacts, nodes: Sequence[str]) -> UncertainSource:
    """A source with all terms that physics knows of."""
    source, priors = cast(Extensible, known.source).extended(arm, nodes)
    return replace(known, source=source, prior={f: np.append(v, priors[f]) for f, v in known.prior.items()}, sigma={})


def without_force(known: UncertainSource) -> UncertainSource:
    """A source without the process force: nothing pushes on the tool while it is measured."""
    source: Any = known.source
    if not isinstance(known.source, LoadDependent):
        return known
    return replace(known, source=replace(source, loads=known.source.loads.without_force()))


def _with_symbols(known: UncertainSource, entries: Sequence[Entry]) -> SymbolicSource:
    """A source with symbols at the entries to fit, where their prior is not zero; the others stay as they are."""
    source: Any = known.source
    fields: dict[str, Any] = {}
    values: dict[str, Array] = {}
    symbols: list[Any] = []
    parameters: list[FreeParameter] = []
    for p in source.PARAMETERS:
        values_of_field = np.array(getattr(source, p.field))
        values[p.field] = values_of_field
        free = [e for e in entries if e.field == p.field and known.prior[p.field][e.index] > 0]
        if not free:
            continue
        filled = ca.SX(ca.DM(values_of_field))
        for entry in free:
            index = entry.index
            symbol = ca.SX.sym("_".join([source.NAME, p.field, *map(str, index)]))
            filled[index if len(index) > 1 else index[0]] = symbol
            parameters.append(
                FreeParameter(
                    source=source.NAME,
                    field=p.field,
                    index=index,
                    key=p.key,
                    unit=p.unit,
                    prior=float(known.prior[p.field][index]),
                    group=f"{source.NAME}.{entry.group or p.field}",
                    thermal=source.FITTING is not None and source.FITTING.rung == "temperature",
                    label=entry.label,
                )
            )
            symbols.append(symbol)
        fields[p.field] = filled
    return SymbolicSource(
        source=replace(source, **fields),
        original=source,
        symbols=ca.vertcat(*symbols) if symbols else ca.SX.zeros(0, 1),
        parameters=tuple(parameters),
        values=values,
        prior=known.prior,
    )
