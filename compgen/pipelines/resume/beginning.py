r"""How warm the robot is when a page starts: the day so far with a wait, or what a thermocouple log ends with.

Until the page the robot has done what its job says, from the last moment at which its state is known: the planned
start, or the beginning of pages that were written anew since. The state z there goes through the program's motion by
the model (``thermal.states_at``) and, where the page starts late, through standing with the servo on:

    z = goal + (z_n - goal) exp(-rate late) + air
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compgen.core.arrays import Array, own
from compgen.core.exceptions import InputError
from compgen.core.units import DAY
from compgen.pipelines.job import Job
from compgen.pipelines.resume.whole import Whole
from compgen.thermal import Ambient, state_after, states_at

MOST_LATE = 7 * DAY


@dataclass(frozen=True, eq=False, slots=True)
class Beginning:
    """The robot when a page starts."""

    state: Array  # (S,) of the thermal model
    clock: float  # [s] from the first duty of the job's [[before]] on, for the air
    air: Ambient  # from then on: its time zero is now
    stopped: Array  # (S,) when the page before stopped; the same where nobody knows of a wait
    why: str  # in words
    cause: dict[str, Any]  # the same for a record

    def __post_init__(self) -> None:
        own(self, state=("S",), stopped=("S",))


def known_state(whole: Whole, resumed: list[dict[str, Any]], page: int, first: int) -> tuple[Array, float]:
    """State and clock when a page would start if nobody waited from the last known moment on.

    Args:
        whole: The plan of the job.
        resumed: What was replaced, as the manifest has it; records of this page and later ones do not count.
        page: Its number from 1.
        first: The waypoint that it starts at.

    Returns:
        The state (S,), and the clock [s].
    """
    job, row, state, clock = whole.job, 0, whole.job.state(), whole.job.clock
    for entry in resumed:
        if int(entry["from_page"]) < page:
            row, state, clock = int(entry["first_waypoint"]), np.array(entry["state"]), float(entry["clock_s"])
    if len(state) != len(job.heat.rate):
        raise InputError("manifest: resumed.state is that of another thermal model; generate the job anew")
    motion = whole.motion_from(row)
    at = np.array([first - row], dtype=np.int64)
    after = states_at(job.heat, state, motion, at, job.history.air, clock)[0]
    return np.asarray(after), clock + float(motion.time[first - row])


def begin_late(whole: Whole, known: tuple[Array, float], late: float) -> Beginning:
    """The page starts so much later [s] than the page before stopped; the servo is on."""
    if not 0 <= late <= MOST_LATE:
        raise InputError(f"--late {late:g} s: outside 0 to {MOST_LATE:g} s; give how long the page waits, as 35min")
    job, (state, clock) = whole.job, known
    standing = replace(job.history.standing, duration=late)
    waited = state_after(job.heat, [standing], state, job.history.air, clock)
    air = _air_from(job, clock + late, whole)
    return Beginning(waited, clock + late, air, state, f"it starts {late:.0f} s late", {"late_s": late})


def begin_at(
    whole: Whole, known: tuple[Array, float], state: Array, air: float | None, why: str, cause: dict[str, Any]
) -> Beginning:
    """The page starts with a state that somebody has found; of the wait before it nothing is known.

    Args:
        whole: The plan of the job.
        known: State and clock by the plan: the clock is kept.
        state: That the robot is in, (S,).
        air: Rise of the air that stays from now on [K]; None: as the path file says.
        why: In words.
        cause: The same for a record.
    """
    clock = known[1]
    later = _air_from(whole.job, clock, whole) if air is None else Ambient(np.zeros(1), np.array([air]))
    return Beginning(state, clock, later, state, why, cause)


def _air_from(job: Job, clock: float, whole: Whole) -> Ambient:
    air = job.history.air
    span = 3 * MOST_LATE + float(whole.time[-1])
    return air if air.is_still else air.seen_from(np.array([clock]), span)
