"""A state in place of history: the cell that begins with it, its base moved and its drifting numbers changed."""

import json
import os
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.dates import duration
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.toml import dotted_keys, toml_value
from compgen.core.units import MINUTE, limit_words
from compgen.error_model.anchored_state import ACCEPTED, BASE, AnchoredState, read_state
from compgen.error_model.parameter_slopes import SourceParameters, parameters_of
from compgen.error_model.posterior import KnownParameter, known_numbers
from compgen.job.job import Cell
from compgen.thermal import Duty
from compgen.thermal.ambient import Ambient, still_air
from compgen.thermal.model import state_with_rises
from compgen.thermal.schedule import STANDING, History
from compgen.thermal.tables.schema import AmbientTable
from compgen.thermal.uncertainty import ThermalUncertainty

ROBOT_FILE, OVERRIDES = "robot_file", "robot_overrides"  # keys in what a state was made from
OF_ARM = ("dh.", "pendant.", "thermal.", "sources.", "identified.")  # tables of a robot file that a state rests on
OTHER_VALUES = "it was found with other values of the robot file (--set robot.KEY=VALUE): give the same here"
ALIKE = 0.01  # [K] by which rises may differ that a state says twice


def load_state(source: str, cell: Cell, age: float = 0.0, reference: float | None = None) -> AnchoredState:
    """A state that may stand in place of a cell's history.

    Args:
        source: Its file.
        cell: That shall begin with it.
        age: How long ago it was [s].
        reference: What rises and air count from [degC]; None: nobody says, so as the state has it.

    Raises:
        InputError: Wrong, of another robot file or heat model, counted from another temperature, older than its
            window, or with no verdict to go by.
    """
    state = read_state(source)
    if state.verdict not in ACCEPTED:
        raise InputError(
            f"{source}: state.verdict: '{state.verdict}': it does not say what the robot is; touch what cgen anchor "
            "names and anchor again, or use [[before]] or a log"
        )
    made_for = state.made_from.get(ROBOT_FILE, "")
    if made_for != cell.robot_file_hash:
        raise InputError(
            f"{source}: made_from.{ROBOT_FILE}: {made_for[:12] or 'nothing'}, {cell.robot_file} is "
            f"{cell.robot_file_hash[:12]}: of another robot file; take that one, or anchor again with this one"
        )
    if not (set(state.nodes) <= set(cell.heat.names) or set(cell.heat.names) <= set(state.nodes)):
        raise InputError(
            f"{source}: rise.node: {', '.join(state.nodes)}; {cell.robot_file} has {', '.join(cell.heat.names)}; "
            "anchor again with this heat model"
        )
    if reference is not None and state.reference not in (None, reference):
        raise InputError(
            f"{source}: state.reference_degC: it counts from {state.reference:g} degC, here rises and air count from "
            f"{reference:g} (ambient.reference_degC): give both the temperature at which the robot was calibrated"
        )
    refuse_outlived(state, source, age)
    return state


def refuse_outlived(state: AnchoredState, source: str, latest: float, why: str = "--state-age") -> None:
    """Raises InputError for a state that is so old [s] when the program starts that it holds no more.

    Args:
        state: It.
        source: Its file, or the option that gives it.
        latest: Its age at the latest start [s].
        why: What says so.
    """
    if latest > state.window:
        raise InputError(
            f"{source}: state.window_s: it holds {limit_words(state.window)}, and is {latest / MINUTE:.0f} min old "
            f"({why}): touch again and anchor anew"
        )


def cell_with_state(cell: Cell, state: AnchoredState, source: str) -> Cell:
    """The cell as a state has it: its heat begins there, its base and what drifts are where they are.

    Raises:
        InputError: A drifting number that the robot file does not have, or modes that show other rises than it says.
    """
    parameters = parameters_of(cell.sources)
    change = np.zeros(len(parameters.entries))
    change[base_rows(parameters)] = state.base
    for name, value in zip(state.drifting, state.drift.tolist(), strict=True):
        row, unit = drifting_row(cell, parameters, name, f"{source}: drifting.parameter")
        change[row] += value * unit
    moved = parameters.moved(change)
    kept = [k for k in cell.known if any(k.source is s for s in moved)]
    new = [s for s in moved if not any(k.source is s for k in kept)]
    by_name = {s.NAME: s for s in new}
    base = parameters.sources[parameters.entries[base_rows(parameters)[0]].source].NAME
    known = [
        k if k in kept else replace(k, source=by_name[k.source.NAME])
        for k in cell.known
        if (k in kept or k.source.NAME in by_name) and k.source.NAME != base  # how well that is known the state says
    ]
    heat = cell.heat
    start, (which, of_state) = state.modal, _common(cell, state)
    if start is None or heat.law is not None or len(start) != len(heat.rate) or is_of_other_values(state, cell):
        start = state_with_rises(heat, which, state.rise[of_state])
    elif (apart := np.abs(heat.outputs[which] @ start - state.rise[of_state])).max() > ALIKE:
        name = heat.names[which[int(apart.argmax())]]
        raise InputError(
            f"{source}: rise.modal: shows {name} {apart.max():.3g} K from what rise.K has; take the file as cgen "
            "anchor wrote it, or remove modal: the likeliest one then counts"
        )
    warmth = replace(cell.warmth, start=None, hidden=None)
    return replace(cell, heat=heat.starting(start), warmth=warmth, known=tuple(known), sources=moved, state=state)


def cell_with_log(cell: Cell, warmth: ThermalUncertainty) -> Cell:
    """The cell whose warmth a log tells: of a state, the base and what drifts are as it found them."""
    if (state := cell.state) is None:
        return replace(cell, warmth=warmth)
    of_rises = np.arange(len(state.covariance)) < len(state.nodes)
    covariance = np.where(of_rises | of_rises[:, None], 0.0, state.covariance)
    return replace(cell, warmth=warmth, state=replace(state, covariance=covariance))


def _common(cell: Cell, state: AnchoredState) -> tuple[IntArray, IntArray]:
    """Numbers of the rises that both a cell's heat model and a state name: of the one, and of the other."""
    names = [name for name in cell.heat.names if name in state.nodes]
    return np.array([cell.heat.names.index(n) for n in names]), np.array([state.nodes.index(n) for n in names])


def base_rows(parameters: SourceParameters) -> list[int]:
    """Numbers of the base's shift and turn among a cell's parameters, (6,)."""
    shift, turn = parameters.base()
    return [*shift, *turn]


def drifting_row(cell: Cell, parameters: SourceParameters, name: str, where: str) -> tuple[int, float]:
    """Which of a cell's parameters a name as ``joint_zeros.offset_mdeg[2]`` means, and the unit that it says [SI].

    Raises:
        InputError: The robot file has none of that name.
    """
    numbers: dict[str, tuple[KnownParameter, float]] = known_numbers(cell.known)
    if name not in numbers:
        near = [n for n in numbers if n.partition(".")[0] == name.partition(".")[0]] or list(numbers)
        raise InputError(
            f"{where}: '{name}' is no number of {cell.robot_file}; write it as in "
            f"{near[0] if near else 'joint_zeros.offset_mdeg[2]'}"
        )
    parameter, _ = numbers[name]
    places = [k for k, source in enumerate(parameters.sources) if source.NAME == parameter.table]
    return parameters.at(places[0], parameter.field, parameter.index), parameter.unit


def drifting_rows(cell: Cell, parameters: SourceParameters) -> list[int]:
    """Which of a cell's parameters its state knows: the robot file's own sigma of them no longer counts."""
    return [row for row, _ in _drifting(cell, parameters)]


def _drifting(cell: Cell, parameters: SourceParameters) -> list[tuple[int, float]]:
    names = () if cell.state is None else cell.state.drifting
    return [drifting_row(cell, parameters, name, "state: drifting.parameter") for name in names]


def state_columns(cell: Cell, parameters: SourceParameters) -> tuple[Array, Array]:
    """What a cell's state leaves open: columns of parameters (R, P) [SI] and of rises (R, K) [K]."""
    state = cell.state
    if state is None:
        return np.zeros((0, len(parameters.entries))), np.zeros((0, len(cell.heat.names)))
    factor, K = state.factor.T, len(state.nodes)
    rises = factor[:, :K]
    if state.nodes != cell.heat.names:
        which, of_state = _common(cell, state)
        rises = rises[:, of_state] @ (cell.heat.outputs @ cell.heat.state_gain(which)).T
    columns = np.zeros((len(factor), len(parameters.entries)))
    columns[:, base_rows(parameters)] = factor[:, K : K + BASE]
    for d, (row, unit) in enumerate(_drifting(cell, parameters)):
        columns[:, row] += factor[:, K + BASE + d] * unit
    return columns, rises


def history_from_state(history: History, state: AnchoredState, age: float, air: Ambient | None) -> History:
    """A history that begins with a state: the cell has stood since.

    Args:
        history: With what was before, which no longer counts.
        state: In its place.
        age: How long ago it was [s].
        air: From the first duty of the old ``before`` on, where the path file says it; None: as the state has it.
    """
    clock = history.clock
    air = still_air(state.air) if air is None else air.since(clock - age)
    standing = (replace(history.standing, duration=age),) if age > 0 else ()
    return replace(history, before=standing, air=air)


def seconds_of_age(text: str | None) -> float:
    """An age as it is typed, ``20min``, ``90s`` or ``1h30min``, in seconds; none of None.

    Raises:
        InputError: Not a duration.
    """
    return 0.0 if text is None else duration(text, "--state-age")


class Before(NamedTuple):
    """What was before a program that exists, as it is typed."""

    duties: tuple[Duty, ...] = ()
    air: float | None = None  # [K] above the reference, then and while it runs; None: nobody says
    reference: float | None = None  # [degC] at which the robot was calibrated; None: nobody says


class Beginning(NamedTuple):
    """The cell of a program that exists, and what was before it."""

    cell: Cell
    before: tuple[Duty, ...]
    air: float  # [K] above the reference, then and while it runs
    reference: float  # [degC] at which it was calibrated


def begin(cell: Cell, before: Before, source: str | None, age: str | None) -> Beginning:
    """A cell with what was before a program that exists, in words or by a state.

    Args:
        cell: The robot.
        before: What it did; air and reference that nobody says are as the state has them, or as usual.
        source: A state's file in place of that; None: there is none.
        age: How long ago it was, as it is typed.

    Raises:
        InputError: Both a history and a state, or a state that cannot stand in its place.
    """
    since = seconds_of_age(age)
    if source is None:
        state_overrides("", None, since)
        return Beginning(cell, before.duties, before.air or 0.0, _reference_of(before.reference))
    if before.duties:
        raise InputError(f"--before: a state stands in place of history (--state {source}); leave one of them out")
    state = load_state(source, cell, since, before.reference)
    cell = cell_with_state(cell, state, source)
    cell = replace(cell, input_findings=(*cell.input_findings, state_note(state, since, "", cell)))
    standing = (replace(STANDING, duration=since),) if since > 0 else ()
    air = state.air if before.air is None else before.air
    return Beginning(cell, standing, air, _reference_of(before.reference, state.reference))


def _reference_of(*references: float | None) -> float:
    """What rises count from [degC]: the first that is given, else as usual."""
    return next((r for r in references if r is not None), AmbientTable().reference_degC)


def state_overrides(path_file: str, state: str | None, age: float) -> list[str]:
    """``state.file`` and ``state.age_min`` of a path file, as overrides ``key=value``.

    Args:
        path_file: Whose folder the key counts from.
        state: A state's file; None: there is none.
        age: How long ago it was [s].

    Raises:
        InputError: An age without a state.
    """
    if state is None:
        if age:
            raise InputError(f"--state-age {age / MINUTE:g}min: is of a state; name its file with --state")
        return []
    if state == "":
        raise InputError("--state: an empty name; give the file that cgen anchor wrote")
    file = os.path.relpath(state, Path(path_file).parent)
    return [f"state.file={toml_value(file)}", *([f"state.age_min={age / MINUTE!r}"] if age else [])]


def made_from_robot(cell: Cell) -> dict[str, str]:
    """sha256 of a cell's robot file, and of values of the arm that override it, however they are typed."""
    keys = [item.partition("=")[0].strip().removeprefix("robot.") + "." for item in cell.overrides]
    values = {
        key: value
        for key, value in dotted_keys(cell.inputs).items()
        if key.startswith(OF_ARM) and any(f"{key}.".startswith(k) or k.startswith(f"{key}.") for k in keys)
    }
    overrides = sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()
    return {ROBOT_FILE: cell.robot_file_hash, OVERRIDES: overrides}


def is_of_other_values(state: AnchoredState, cell: Cell) -> bool:
    """Whether a state says that it was found with other values of the robot file than a cell's."""
    own = made_from_robot(cell)[OVERRIDES]
    return state.made_from.get(OVERRIDES, own) != own


def state_note(state: AnchoredState, age: float, replaced: str, cell: Cell, air: Ambient | None = None) -> Finding:
    """What a state stands in place of, and how long it holds; a warning where it was found with another robot.

    Args:
        state: It.
        age: How long ago it was [s].
        replaced: What it stands in place of, in words; empty: nothing.
        cell: That begins with it.
        air: From the state's time on, where a path file says it; None: it is the state's.
    """
    since = f", {age / MINUTE:.0f} min ago" if age else ""
    instead = f" in place of {replaced}" if replaced else ""
    message = (
        f"the robot begins as {state.digest[:8]} has it {state.origin(since)}{instead}; it "
        f"holds {limit_words(state.window)} from then, standing"
    )
    then = state.air if air is None else float(air.at(np.zeros(1))[0])
    if air is not None and (air.moves_after(0.0) or abs(then - state.air) > ALIKE):
        message += (
            f"; the air goes on as [ambient] has it at the planned start, {then:+.1f} K from the reference at the "
            f"state's time ({state.air:+.1f} by the state)"
        )
    is_other = is_of_other_values(state, cell)
    if is_other:
        message += f"; {OTHER_VALUES}"
    level = Level.WARNING if is_other or state.verdict == "something moved" else Level.NOTE
    return Finding(level, Code.STATE, message)
