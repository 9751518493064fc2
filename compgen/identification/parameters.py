"""Which parameters of which sources measurements may move, and in which order models grow."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray
from compgen.core.units import DEG, HOUR
from compgen.error_model.sources import (
    GearHarmonics,
    Hysteresis,
    JointCompliance,
    JointCoupling,
    JointRipple,
    JointZeros,
    Known,
    LinkOffsets,
    Loads,
    ThermalBend,
    ThermalGrowth,
    parallel,
    prior_of,
)
from compgen.identification.model import Part, Term, WarmState
from compgen.robot.robot import Robot

RIPPLE = tuple(range(3, 33))  # orders above the first two
WIDTH = 0.2 * DEG  # over which a reversal is done, where the robot file says nothing
WARM_RISE = 8.0  # K: typical of a node in a warm-up without temperatures
WARM_TAU = 2 * HOUR  # s: typical; its logarithm has a prior of 1


@dataclass(frozen=True, slots=True)
class Candidate:
    """A step of the ladder of models: its own groups come on top of those before."""

    name: str
    groups: tuple[str, ...]


def ladder(groups: Sequence[str]) -> list[Candidate]:
    """Models from the plainest to the richest, as far as there are parameters for them.

    What the warm-up shows is in all but the first, or the cold parameters would answer for it.
    """
    steps = (
        ("joint zeros", ("joint_zeros",)),
        ("geometry", ("link_offsets",)),
        ("joints", ("compliance", "hysteresis", "gear_harmonics", "joint_coupling")),
        ("ripple", ("joint_ripple",)),
    )
    found = [Candidate("frames only", ())]
    kept = [g for g in groups if g.split(".")[0] in ("thermal_growth", "thermal_bend", "warm_up")]
    for name, sources in steps:
        own = [g for g in groups if g.split(".")[0] in sources]
        if own:
            kept = [*kept, *own]
            found.append(Candidate(name, tuple(kept)))
    return found


def parts_of(robot: Robot, known: Sequence[Known], moved: BoolArray, warm: bool, log: bool = True) -> list[Part]:
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
    have = {type(k.source): k for k in known}
    joints = np.flatnonzero(moved).tolist()
    hayati = parallel(robot.alpha)
    loads = next((k.source.loads for k in known if isinstance(k.source, (JointCompliance, Hysteresis))), None)
    heavy = loads is not None and bool(loads.mass.any() or loads.payload)
    have = {kind: unpushed(own) for kind, own in have.items()}
    parts: list[Part] = []
    growth = have.get(ThermalGrowth)
    if growth is not None:
        grown = {
            f: [(i,) for i in range(6) if getattr(growth.source, f[-1])[i].any()] for f in ("excess_a", "excess_d")
        }
        parts.append(_part(growth.source, growth.prior, grown if warm and log else {}, False))
    parts.append(
        _of(have, LinkOffsets(*np.zeros((4, 6))), {
            "d": [(i,) for i in range(1, 5) if not hayati[i]],
            "a": [(i,) for i in range(5)],
            "alpha": [(i,) for i in range(5)],
            "beta": [(i,) for i in np.flatnonzero(hayati).tolist()],
        }, False)
    )  # fmt: skip
    parts.append(_of(have, JointZeros(np.zeros(6)), {"offset": [(i,) for i in joints if 0 < i < 5]}, True))
    ratios = [(i, j) for i in range(6) for j in joints]
    parts.append(_of(have, JointCoupling(np.zeros((6, 6)), robot.pendant_zero), {"ratio": ratios}, True))
    if heavy and loads is not None:
        loads = replace(loads, force=np.zeros(3))
        give = [(i,) for i in range(1, 6)]
        parts.append(_of(have, JointCompliance(np.zeros(6), loads), {"compliance": give}, True))
    first = [(i, h) for i in joints for h in range(2)]
    waves = GearHarmonics(np.zeros((6, 2)), np.zeros((6, 2)), np.ones(6))
    parts.append(_of(have, waves, {"sine": first, "cosine": first}, True, ("1", "2")))
    more = [(i, h) for i in joints for h in range(len(RIPPLE))]
    zeros = np.zeros((6, len(RIPPLE)))
    ripple = JointRipple(zeros, zeros, np.array(RIPPLE))
    parts.append(_part(ripple, prior_of(ripple), {"sine": more, "cosine": more}, True, [str(n) for n in RIPPLE]))
    light = Loads(np.zeros(6), np.zeros((6, 3)), 0.0, np.zeros(3), np.zeros(3), np.zeros(3))
    lash = Hysteresis(np.zeros(6), np.zeros(6), np.full(6, WIDTH), loads if loads is not None else light)
    lags = {"backlash": [(i,) for i in joints], "windup": [(i,) for i in joints] if heavy else []}
    parts.append(_of(have, lash, lags, True))
    bend = have.get(ThermalBend)
    if bend is not None:
        bent = {"rate": [(i,) for i in range(len(bend.prior["rate"]))]} if warm else {}
        parts.append(_part(bend.source, bend.prior, bent, False))
    return parts


def warm_states(known: Sequence[Known], nodes: int) -> tuple[WarmState, ...]:
    """Unknown states of the nodes that something grows or bends with; each with its own clock."""
    used = np.zeros(nodes, dtype=bool)
    for k in known:
        if isinstance(k.source, ThermalGrowth):
            used |= (k.source.a != 0).any(axis=0) | (k.source.d != 0).any(axis=0)
        elif isinstance(k.source, ThermalBend):
            used[k.source.node] = True
    return tuple(WarmState(k, WARM_RISE, WARM_TAU, str(k)) for k in np.flatnonzero(used).tolist())


def unpushed(known: Known) -> Known:
    """The same without the process force: nothing pushes on the tool while it is measured."""
    source = known.source
    if not isinstance(source, (JointCompliance, Hysteresis)):
        return known
    return replace(known, source=replace(source, loads=replace(source.loads, force=np.zeros(3))))


def _of(
    have: Mapping[type, Known], usual: Any, free: Mapping[str, Sequence[tuple[int, ...]]], joint: bool,
    orders: Sequence[str] | None = None,
) -> Part:  # fmt: skip
    """A part from the robot file's own source, or from the usual one."""
    own = have.get(type(usual))
    if own is None:
        return _part(usual, prior_of(usual), free, joint, orders)
    return _part(own.source, own.prior, free, joint, orders)


def _part(
    source: Any,
    prior: Mapping[str, Array],
    free: Mapping[str, Sequence[tuple[int, ...]]],
    joint: bool,
    orders: Sequence[str] | None = None,
) -> Part:
    """A source with symbols at the free entries; zero, nominal, at the others of a fitted field."""
    fields: dict[str, Any] = {}
    numbers: dict[str, Array] = {}
    symbols: list[Any] = []
    terms: list[Term] = []
    for p in source.PARAMETERS:
        value = np.array(getattr(source, p.field))
        index = [i for i in free.get(p.field, ()) if prior[p.field][i] > 0]
        numbers[p.field] = value
        if not index:
            continue
        filled = ca.SX(ca.DM(value))
        for place in index:
            symbol = ca.SX.sym("_".join([source.NAME, p.field, *map(str, place)]))
            filled[place if len(place) > 1 else place[0]] = symbol
            group = f"{source.NAME}.{orders[place[1]]}" if orders else f"{source.NAME}.{p.field}"
            spread = float(prior[p.field][place])
            terms.append(Term(source.NAME, p.field, place, p.key, p.unit, spread, group, place[0] if joint else None))
            symbols.append(symbol)
        fields[p.field] = filled
    made = replace(source, **fields) if fields else source
    return Part(made, source, ca.vertcat(*symbols) if symbols else ca.SX.zeros(0, 1), tuple(terms), numbers)
