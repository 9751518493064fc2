r"""How warm the robot is when a page starts: the day so far with a wait, or what a thermocouple log ends with.

Until the page the robot has done what its job says, from the last moment at which its state is known: the planned
start, or the beginning of pages that were written anew since. The state z there goes through the program's motion by
the model (``thermal.states_at``) and, where the page starts late, through standing with the servo on:

    z = goal + (z_n - goal) exp(-rate late) + air
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compgen.core.arrays import Array, owns
from compgen.core.exceptions import InputError
from compgen.core.units import DAY
from compgen.error_model.anchored_state import parse_state
from compgen.job.anchored_start import cell_with_state
from compgen.job.job import Cell, Job
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.planned.job_results import Planned
from compgen.thermal import Ambient, state_after, states_at

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
