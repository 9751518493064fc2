"""The robot as an anchored state has it: its warmth, its base, and what has drifted."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from compgen.core.exceptions import InputError
from compgen.core.units import MINUTE
from compgen.error_model.anchored_state import AnchoredState, state_text
from compgen.job.anchored_start import cell_with_state, load_state
from compgen.job.job import Cell
from compgen.pipelines.planned.job_results import Planned
from compgen.pipelines.resume.beginning import Beginning, Begun, Known, begin_at, unmoved
from compgen.pipelines.resume.from_log import path_tables
from compgen.thermal import Ambient, Duty, state_after


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
