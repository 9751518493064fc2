r"""How warm the robot is when a page starts: the day so far with a wait, or what a thermocouple log ends with.

Until the page the robot has done what its job says, from the last moment at which its state is known: the planned
start, or the beginning of pages that were written anew since. The state z there goes through the program's motion by
the model (``thermal.states_at``) and, where the page starts late, through standing with the servo on:

    z = goal + (z_n - goal) exp(-rate late) + air

The robot as a thermocouple log leaves it: the state that explains the readings, and the air.

The robot as an anchored state has it: its warmth, its base, and what has drifted.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from compgen.core.arrays import Array, owns
from compgen.core.exceptions import InputError
from compgen.core.files import read_regular
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.toml import check, override, read_toml
from compgen.core.units import DAY, MINUTE, limit_words
from compgen.error_model.anchored_state import AnchoredState, parse_state, state_text
from compgen.job.anchored_start import OTHER_VALUES, cell_with_log, cell_with_state, is_of_other_values, load_state
from compgen.job.job import Cell, Job
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.files.schema import PathFile
from compgen.pipelines.planned.job_results import Planned
from compgen.thermal import Ambient, Duty, JointMotion, state_after, states_at, still_air, tables
from compgen.thermal.log_end import end_of
from compgen.thermal.model import ThermalModel
from compgen.thermal.schedule import History
from compgen.thermal.state_from_log import TemperatureLog
from compgen.thermal.tables.schema import AmbientTable, LogTable
from compgen.thermal.temperature_log import read_growing_log
from compgen.thermal.uncertainty import Past

MOST_LATE = 7 * DAY


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(state=("S",))
class Begun:
    """The robot when a page starts, of a planned job or a corrected program."""

    cell: Cell  # with the base and the numbers that a state has moved, and how well its log is known
    state: Array  # (S,) of the thermal model
    clock: float  # [s] from the first duty of the job's [[before]] on, for the air
    why: str  # in words
    cause: dict[str, Any]  # the same for a record
    air: float | None = None  # [K] rise that stays from then on; None: as was planned
    past: Past | None = None  # since its warmth was known; None: it was known then


class Logged(NamedTuple):
    """What a job says of its air, and of its log."""

    ambient: AmbientTable
    log: LogTable | None

    @property
    def is_air_given(self) -> bool:
        """Whether the job says what the air does, so that what was found now does not stay."""
        return self.ambient.is_given


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(state=("S",))
class PromptStart:
    """The robot when a page would start if nobody waited from the last known moment on."""

    cell: Cell
    plain: Callable[[], Cell]  # as its robot file has it, without the state that its program may begin with
    heat: ThermalModel
    state: Array  # (S,)
    past: Past  # that led there
    clock: float  # [s]
    air: Ambient
    standing: Duty  # one second of it
    motion: Callable[[], JointMotion]  # of the whole program
    logged: Callable[[], Logged]
    earlier: tuple[Mapping[str, Any], ...]  # what was replaced before
    measured_air: float | None = None  # [K] rise by a log or a state of an earlier page, which stays

    def clock_after(self, late: float | None, option: str, file: str) -> float:
        """When the page starts [s]: asked for beside a log or a state where the air changes, and only there.

        Raises:
            InputError: ``late`` [s] is missing, or says what the file says already.
        """
        moves = self.air.moves_after(self.clock)
        if moves and late is None:
            raise InputError(
                f"{file}: it does not say how late the page starts, and [ambient] changes with time; add --late, how "
                "long the page waits after the one before: 35min"
            )
        if late is not None and not moves:
            raise InputError(
                f"resume: {option} and --late given; say with one of them what the robot is: both are for an "
                "[ambient] that changes with time"
            )
        return self.clock + (late or 0.0)


Begin = Callable[[PromptStart], Begun]


def known_state(whole: Planned, resumed: list[dict[str, Any]], page: int, first: int) -> PromptStart:
    """What the plan, and what was replaced since, say of the robot when a page starts.

    Args:
        whole: The plan of the job.
        resumed: What was replaced, as the manifest has it; records of this page and later ones do not count.
        page: Its number from 1.
        first: The waypoint that it starts at.
    """
    job, row, state, clock, cell = whole.job, 0, whole.job.state(), whole.job.clock, whole.job.cell
    measured_air = None
    earlier = [entry for entry in resumed if int(entry["from_page"]) < page]
    for entry in earlier:
        row, state, clock = int(entry["first_waypoint"]), np.array(entry["state"]), float(entry["clock_s"])
        if "state_toml" in entry:
            anchored = parse_state(str(entry["state_toml"]).encode(), "manifest: resumed.state_toml")
            cell = cell_with_state(unmoved(job), anchored, "manifest: resumed.state_toml")
        measured_air = entry.get("air_K")
    if len(state) != len(job.heat.rate):
        raise InputError("manifest: resumed.state is that of another thermal model; generate the job anew")
    air = job.history.air if measured_air is None else still_air(measured_air)
    motion = whole.joint_motion.between(row)
    at = np.array([first - row], dtype=np.int64)
    after = states_at(job.heat, state, motion, at, air, clock)[0]
    day, way = replace(job.history, before=job.duties_before()), whole.joint_motion.between(0).time
    pages = [(float(way[int(entry["first_waypoint"])]), entry) for entry in earlier]
    past = past_until(float(way[first]), pages, Past(job.cell.heat, day, job.feed))
    return PromptStart(
        cell=cell,
        plain=partial(unmoved, job),
        heat=job.heat,
        state=after,
        past=past,
        clock=clock + float(motion.time[first - row]),
        air=air,
        standing=job.history.standing,
        motion=lambda: whole.joint_motion,
        logged=partial(logged_by, job),
        earlier=tuple(earlier),
        measured_air=measured_air,
    )


def past_until(time: float, pages: Sequence[tuple[float, Mapping[str, Any]]], past: Past) -> Past:
    """What led to where a page begins.

    Args:
        time: When, of the program [s].
        pages: When each page that was written anew before it begins [s], and its record.
        past: Until the program began.
    """
    ran, standing = 0.0, past.history.standing
    for at, entry in pages:
        past, ran = past.then(Duty("moving", past.feed, at - ran)), at
        if "late_s" in entry:
            past = past.then(replace(standing, duration=float(entry["late_s"])))
        else:  # its warmth was found
            state = np.array(entry.get("state", np.zeros(len(past.heat.rate))))
            past = replace(past, heat=past.heat.starting(state), history=replace(past.history, before=()))
    return past.then(Duty("moving", past.feed, time - ran))


def unmoved(job: Job) -> Cell:
    """The cell as its robot file has it, without the state that a job may begin with."""
    if job.cell.state is None:
        return job.cell
    return load_cell(job.cell.robot_file, [o for o in job.overrides if o.startswith("robot.")])


def begin_late(known: PromptStart, late: float) -> Begun:
    """The page starts so much later [s] than the page before stopped; the servo is on."""
    if not 0 <= late <= MOST_LATE:
        raise InputError(f"--late {late:g} s: outside 0 to {MOST_LATE:g} s; give how long the page waits, as 35min")
    wait = replace(known.standing, duration=late)
    waited = state_after(known.heat, [wait], known.state, known.air, known.clock)
    why = f"it starts {limit_words(late)} late"
    clock, cause = known.clock + late, {"late_s": late}
    air, past = known.measured_air, known.past.then(wait)
    return Begun(cell=known.cell, state=waited, clock=clock, why=why, cause=cause, air=air, past=past)


def air_from(whole: Planned, begun: Begun) -> Ambient:
    """The air of a job from when a page starts; its time zero is then."""
    if begun.air is not None:
        return still_air(begun.air)
    air, span = whole.job.history.air, 3 * MOST_LATE + float(whole.time[-1])
    return air if air.is_still else air.seen_from(np.array([begun.clock]), span)


def path_tables(job: Job) -> PathFile:
    """The tables of a job's path file, overrides put in."""
    data = read_toml(Path(job.source), "paths")
    for item in job.overrides:
        if not item.startswith("robot."):
            override(data, item, item)
    return check(PathFile, data, job.source)


def logged_by(job: Job) -> Logged:
    """What a job's path file says of its air and its log."""
    path = path_tables(job)
    return Logged(path.ambient, path.log)


def read_rises(cell: Cell, logged: Logged, file: str) -> TemperatureLog:
    """A log as rises of a robot's nodes, which count from what its job says in [log] and [ambient].

    Raises:
        InputError: A bad file, an unknown sensor, readings that no robot has.
    """
    table = LogTable(file=file) if logged.log is None else logged.log.model_copy(update={"file": file})
    log = _whole_rows(cell, table, logged.ambient)
    return log or tables.log_of(table, cell.heat, cell.warmth, cell.sensors, logged.ambient, "log")


def _whole_rows(cell: Cell, table: LogTable, ambient: AmbientTable) -> TemperatureLog | None:
    """A log that somebody is still writing, without a last line that has no end; None for one with anything wrong."""
    log = read_growing_log(table.file, cell.heat.names, cell.sensors, table)
    if log.readings is None or log.left_out or log.gaps or log.set_back or len(log.readings.time) < 2:
        return None
    return tables.believed_rises(log.readings, table, cell.heat, cell.warmth, ambient)


def begin_with_log(known: PromptStart, file: str, late: float | None = None) -> Begun:
    """The page starts when a log ends.

    Args:
        known: The robot by the plan.
        file: The log so far.
        late: How much later [s] than the page before stopped, where the air changes with time.

    Raises:
        InputError: A bad file, too few readings, or the log that an earlier page starts at the end of.
    """
    logged, clock = known.logged(), known.clock_after(late, "--log", file)
    log, digest = read_rises(known.cell, logged, file), sha256(read_regular(file)).hexdigest()
    for entry in known.earlier:
        if entry.get("log_sha256") == digest:
            raise InputError(f"{file}: page {entry['from_page']} starts at the end of this log; give the log until now")
    end, name = float(log.time[-1]), Path(file).name
    wanted = end_of(log, known.cell.heat, known.cell.warmth, known.motion)
    return Begun(
        cell=cell_with_log(known.cell, wanted.warmth),
        state=wanted.state,
        clock=clock,
        why="; ".join([f"thermocouple log {name} until {end:.0f} s", *log.notes]),
        cause={"log": name, "log_sha256": digest, "log_end_s": end},
        air=None if logged.is_air_given else log.last_air if log.has_air else known.measured_air,
    )


def begin_with_state(known: PromptStart, file: str, age: float, late: float | None = None) -> Begun:
    """The page starts so long after a state was found, and the robot has stood since.

    Args:
        known: The robot by the plan.
        file: Of the state.
        age: How long ago it was [s].
        late: How much later [s] than the page before stopped, where the air changes with time.

    Raises:
        InputError: A bad file, of another robot, older than its window, no newer than one that an earlier page is for.
    """
    plain, clock = known.plain(), known.clock_after(late, "--state", file)
    state = load_state(file, plain, age, known.logged().ambient.counts_from)
    for entry in known.earlier:
        if entry.get("anchored") == state.digest:
            raise InputError(f"{file}: page {entry['from_page']} starts with this state; touch again, or say --late")
        if float(entry.get("state_time_s", state.time)) > state.time:
            raise InputError(
                f"{file}: state.time_s: {state.time:g} s, and page {entry['from_page']} is for a state of "
                f"{float(entry['state_time_s']):g} s already, a later one; touch again"
            )
    cell = cell_with_state(plain, state, file)
    standing = [replace(known.standing, duration=age)] if age > 0 else []
    air_stays = not known.logged().is_air_given
    air, begin = (still_air(state.air), 0.0) if air_stays else (known.air, clock - age)
    since = f", {age / MINUTE:.0f} min ago" if age else ""
    return Begun(
        cell=cell,
        state=state_after(cell.heat, standing, cell.heat.start, air, begin),
        past=Past(cell.heat, History(before=tuple(standing), air=air), known.past.feed),
        clock=clock,
        why=f"state {state.digest[:8]} says so {state.origin(since)}",
        cause={
            "anchored": state.digest,
            "state_verdict": state.verdict,
            "state_time_s": state.time,
            "state_age_s": age,
            "state_toml": state_text(state),
        },
        air=state.air if air_stays else None,
    )


def state_findings(begun: Begun) -> Iterator[Finding]:
    """A state that found more than warmth, or was found with another robot."""
    state = begun.cell.state
    if "state_toml" not in begun.cause or state is None:
        return
    for words in state_warnings(state, begun.cell):
        yield Finding(Level.WARNING, Code.STATE, f"{begun.why}{words}")


def state_warnings(state: AnchoredState, cell: Cell) -> Iterator[str]:
    """What a user must know of a state that a robot begins with, behind words that name the state."""
    if state.verdict == "something moved":
        yield ": the pages are for the base and the targets as touched; find what moved before they run"
    if is_of_other_values(state, cell):
        yield f"; {OTHER_VALUES}"
