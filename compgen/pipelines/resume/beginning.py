r"""How warm the robot is when a page starts: the day so far with a wait, or what a thermocouple log ends with.

Until the page the robot has done what its job says, from the last moment at which its state is known: the planned
start, or the beginning of pages that were written anew since. The state z there goes through the program's motion by
the model (``thermal.states_at``) and, where the page starts late, through standing with the servo on:

    z = goal + (z_n - goal) exp(-rate late) + air

The robot as a thermocouple log leaves it: the state that explains the readings, and the air.

The robot as an anchored state has it: its warmth, its base, and what has drifted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from compgen.core.arrays import Array, owns
from compgen.core.exceptions import InputError
from compgen.core.files import read_regular
from compgen.core.toml import check, override, read_toml
from compgen.core.units import DAY, MINUTE
from compgen.error_model.anchored_state import AnchoredState, parse_state, state_text
from compgen.job.anchored_start import cell_with_state, load_state
from compgen.job.job import Cell, Job
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.files.schema import PathFile
from compgen.pipelines.planned.job_results import Planned
from compgen.thermal import Ambient, Duty, state_after, states_at, tables
from compgen.thermal.log_doubt import refuse_doubtful
from compgen.thermal.log_end import LogEnd, end_of
from compgen.thermal.state_from_log import TemperatureLog
from compgen.thermal.tables.schema import LogTable
from compgen.thermal.temperature_log import read_growing_log

MOST_LATE = 7 * DAY


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(state=("S",))
class Beginning:
    """The robot when a page starts."""

    state: Array  # (S,) of the thermal model
    clock: float  # [s] from the first duty of the job's [[before]] on, for the air
    cell: Cell  # with the base and the numbers that a state has moved
    air: Ambient  # from then on: its time zero is now
    why: str  # in words
    cause: dict[str, Any]  # the same for a record


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Begun:
    """A robot as somebody has found it when a page starts, planned or corrected."""

    cell: Cell  # moved as a state says, with how well its log is known
    state: Array  # (S,) of the thermal model
    why: str  # in words
    cause: dict[str, Any]  # the same for a record
    air: float | None = None  # [K] rise that a state found; None: nobody says


@dataclass(frozen=True, eq=False, slots=True)
@owns(state=("S",))
class Known:
    """The robot when a page would start if nobody waited from the last known moment on."""

    state: Array  # (S,)
    clock: float  # [s]
    cell: Cell
    earlier: tuple[dict[str, Any], ...]  # what was replaced before


def known_state(whole: Planned, resumed: list[dict[str, Any]], page: int, first: int) -> Known:
    """What the plan, and what was replaced since, say of the robot when a page starts.

    Args:
        whole: The plan of the job.
        resumed: What was replaced, as the manifest has it; records of this page and later ones do not count.
        page: Its number from 1.
        first: The waypoint that it starts at.
    """
    job, row, state, clock, cell = whole.job, 0, whole.job.state(), whole.job.clock, whole.job.cell
    earlier = [entry for entry in resumed if int(entry["from_page"]) < page]
    for entry in earlier:
        row, state, clock = int(entry["first_waypoint"]), np.array(entry["state"]), float(entry["clock_s"])
        if "state_toml" in entry:
            anchored = parse_state(str(entry["state_toml"]).encode(), "manifest: resumed.state_toml")
            cell = cell_with_state(unmoved(job), anchored, "manifest: resumed.state_toml")
    if len(state) != len(job.heat.rate):
        raise InputError("manifest: resumed.state is that of another thermal model; generate the job anew")
    motion = whole.motion_from(row)
    at = np.array([first - row], dtype=np.int64)
    after = states_at(job.heat, state, motion, at, job.history.air, clock)[0]
    return Known(after, clock + float(motion.time[first - row]), cell, tuple(earlier))


def unmoved(job: Job) -> Cell:
    """The cell as its robot file has it, without the state that a job may begin with."""
    if job.cell.state is None:
        return job.cell
    return load_cell(job.cell.robot_file, [o for o in job.overrides if o.startswith("robot.")])


def begin_late(whole: Planned, known: Known, late: float) -> Beginning:
    """The page starts so much later [s] than the page before stopped; the servo is on."""
    if not 0 <= late <= MOST_LATE:
        raise InputError(f"--late {late:g} s: outside 0 to {MOST_LATE:g} s; give how long the page waits, as 35min")
    job, clock = whole.job, known.clock
    standing = replace(job.history.standing, duration=late)
    waited = state_after(job.heat, [standing], known.state, job.history.air, clock)
    air = _air_from(job, clock + late, whole)
    return Beginning(
        state=waited,
        clock=clock + late,
        cell=known.cell,
        air=air,
        why=f"it starts {late:.0f} s late",
        cause={"late_s": late},
    )


def begin_at(
    whole: Planned, known: Known, state: Array, air: float | None, why: str, cause: dict[str, Any]
) -> Beginning:
    """The page starts with a state that somebody has found; of the wait before it nothing is known.

    Args:
        whole: The plan of the job.
        known: The robot by the plan: its clock is kept, and its base.
        state: That the robot is in, (S,).
        air: Rise of the air that stays from now on [K]; None: as the path file says.
        why: In words.
        cause: The same for a record.
    """
    clock = known.clock
    later = _air_from(whole.job, clock, whole) if air is None else Ambient(np.zeros(1), np.array([air]))
    return Beginning(state=state, clock=clock, cell=known.cell, air=later, why=why, cause=cause)


def _air_from(job: Job, clock: float, whole: Planned) -> Ambient:
    air = job.history.air
    span = 3 * MOST_LATE + float(whole.time[-1])
    return air if air.is_still else air.seen_from(np.array([clock]), span)


def read_log(job: Job, file: str) -> tuple[TemperatureLog, bool]:
    """A log as rises of a job's nodes, and whether its last air is the air from now on.

    What rises count from is what the path file says in [log] and [ambient].

    Raises:
        InputError: A bad file, an unknown sensor, readings that no robot has.
    """
    path = path_tables(job)
    table = LogTable(file=file) if path.log is None else path.log.model_copy(update={"file": file})
    zero = path.ambient.reference_degC
    cell = job.cell
    log = _whole_rows(job, table, zero) or tables.log_of(table, cell.heat, cell.warmth, cell.sensors, zero, "log")
    return log, not path.ambient.model_fields_set - {"reference_degC", "clock_h"}


def _whole_rows(job: Job, table: LogTable, zero: float) -> TemperatureLog | None:
    """A log that somebody is still writing, without a last line that has no end; None for one with anything wrong."""
    log = read_growing_log(table.file, job.cell.heat.names, job.cell.sensors, table)
    if log.readings is None or log.left_out or log.gaps or log.set_back or len(log.readings.time) < 2:
        return None
    refuse_doubtful(log.readings, job.cell.heat, job.cell.warmth, zero)
    rises = log.readings.rises(zero if table.reference is None else table.reference, table.window_min * MINUTE)
    return replace(rises, notes=log.readings.notes)


def path_tables(job: Job) -> PathFile:
    """The tables of a job's path file, overrides put in."""
    data = read_toml(Path(job.source), "paths")
    for item in job.overrides:
        if not item.startswith("robot."):
            override(data, item, item)
    return check(PathFile, data, job.source)


def state_at_end(whole: Planned, log: TemperatureLog) -> LogEnd:
    """The robot when a log ends."""
    return end_of(log, whole.job.cell.heat, whole.job.cell.warmth, partial(whole.motion_from, 0))


def begin_with_log(whole: Planned, known: Known, file: str) -> Beginning:
    """The page starts when a log ends.

    Args:
        whole: The plan of the job.
        known: The robot by the plan.
        file: The log so far.

    Raises:
        InputError: A bad file, or too few readings.
    """
    log, keeps_air = read_log(whole.job, file)
    end = float(log.time[-1])
    cause: dict[str, Any] = {
        "log": Path(file).name,
        "log_sha256": sha256(read_regular(file)).hexdigest(),
        "log_end_s": end,
    }
    air = float(log.air[-1]) if keeps_air else None
    end_of_log = state_at_end(whole, log)
    known = replace(known, cell=replace(known.cell, warmth=end_of_log.warmth))
    why = "; ".join([f"thermocouple log {cause['log']} until {end:.0f} s", *log.notes])
    return begin_at(whole, known, end_of_log.state, air, why, cause)


def begin_anchored(plain: Cell, file: str, age: float, standing: Duty, earlier: Sequence[Mapping[str, Any]]) -> Begun:
    """A robot so long after a state was found, standing since.

    Args:
        plain: The robot as its file has it.
        file: Of the state.
        age: How long ago it was [s].
        standing: One second of it.
        earlier: What was replaced before, as the manifest has it.

    Raises:
        InputError: A bad file, of another robot, older than its window, or than one that an earlier page is for.
    """
    state = load_state(file, plain, age)
    for entry in earlier:
        if float(entry.get("state_time_s", state.time)) > state.time:
            raise InputError(
                f"{file}: state.time_s: {state.time:g} s, and page {entry['from_page']} is for a state of "
                f"{float(entry['state_time_s']):g} s already, a later one; touch again"
            )
    cell = cell_with_state(plain, state, file)
    start = cell.heat.start
    if start is None:
        raise InputError(f"{file}: rise: it says nothing of the warmth; anchor again")
    if age > 0:
        start = state_after(cell.heat, [replace(standing, duration=age)], start, air_of_state(state))
    since = f", {age / MINUTE:.0f} min ago" if age else ""
    return Begun(
        cell=cell,
        state=start,
        why=f"state {state.digest[:8]} says so ({state.verdict}, at {state.time:.0f} s{since})",
        cause={
            "anchored": state.digest,
            "verdict": state.verdict,
            "state_time_s": state.time,
            "state_age_s": age,
            "state_toml": state_text(state),
        },
        air=state.air,
    )


def air_of_state(state: AnchoredState) -> Ambient:
    """The air as a state has it, from then on."""
    return Ambient(np.zeros(1), np.array([state.air]))


def begin_with_state(whole: Planned, known: Known, file: str, age: float) -> Beginning:
    """A page of a planned job starts so long after a state was found; arguments and exceptions as above."""
    job = whole.job
    now = begin_anchored(unmoved(job), file, age, job.history.standing, known.earlier)
    is_air_given = bool(path_tables(job).ambient.model_fields_set - {"reference_degC", "clock_h"})
    begun = begin_at(whole, known, now.state, None if is_air_given else now.air, now.why, now.cause)
    return replace(begun, cell=now.cell)
