"""The robot as an anchored state has it: its warmth, its base, and what has drifted."""

from dataclasses import replace

import numpy as np

from compgen.core.exceptions import InputError
from compgen.core.units import MINUTE
from compgen.error_model.anchored_state import state_text
from compgen.job.anchored_start import cell_with_state, load_state
from compgen.pipelines.resume.beginning import Beginning, Known, begin_at, unmoved
from compgen.pipelines.resume.from_log import path_tables
from compgen.pipelines.resume.whole import Whole
from compgen.thermal import Ambient, state_after


def begin_with_state(whole: Whole, known: Known, file: str, age: float) -> Beginning:
    """The page starts so long after a state was found, the robot standing since.

    Args:
        whole: The plan of the job.
        known: The robot by the plan.
        file: Of the state.
        age: How long ago it was [s].

    Raises:
        InputError: A bad file, of another robot, older than its window, or than one that an earlier page is for.
    """
    job, cell = whole.job, unmoved(whole.job)
    state = load_state(file, cell, age)
    for entry in known.earlier:
        if float(entry.get("state_time_s", state.time)) > state.time:
            raise InputError(
                f"{file}: state.time_s: {state.time:g} s, and page {entry['from_page']} is for a state of "
                f"{float(entry['state_time_s']):g} s already, a later one; touch again"
            )
    cell = cell_with_state(cell, state, file)
    start = cell.heat.start
    if start is None:
        raise InputError(f"{file}: rise: it says nothing of the warmth; anchor again")
    air = Ambient(np.zeros(1), np.array([state.air]))
    if age > 0:
        start = state_after(cell.heat, [replace(job.history.standing, duration=age)], start, air)
    is_air_given = bool(path_tables(job).ambient.model_fields_set - {"reference_degC", "clock_h"})
    since = f", {age / MINUTE:.0f} min ago" if age else ""
    why = f"state {state.digest[:8]} says so ({state.verdict}, at {state.time:.0f} s{since})"
    cause = {
        "anchored": state.digest,
        "verdict": state.verdict,
        "state_time_s": state.time,
        "state_age_s": age,
        "state_toml": state_text(state),
    }
    begun = begin_at(whole, known, start, None if is_air_given else state.air, why, cause)
    return replace(begun, cell=cell)
