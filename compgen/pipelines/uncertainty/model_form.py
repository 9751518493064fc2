"""Cross flight: what one heat model corrected, driven on the arm that the robot file's other heat model describes.

Both models answer the same measured temperatures and differ in between, along the links: what they differ by at the
tool is *model form*, an error that no parameter of either knows of. The joints are those of the text's positions, the
times the twin's; the day before is planned anew for the other model.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, IntArray, rms, row_norms
from compgen.core.exceptions import CompgenError
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.units import UM
from compgen.job.job import Job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.thermal import JointMotion, states_at
from compgen.thermal.ensemble import mean_rises
from compgen.verification.deviation import Deviation
from compgen.verification.twin import PreparedProgram

POSITIONS = 2000  # of the text, spread over it: the models differ smoothly along it
STRETCH = 65536  # waypoints whose heat is at hand at a time
CONFIRMED = 100  # of the positions that pinocchio repeats; it has repeated the flight itself


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class ModelForm:
    """What the other heat model leaves of a correction."""

    corrected: str  # "nodes" or "network"
    driven: str  # the other
    largest: float  # [m] distance from the target on it
    rms: float  # [m] of that
    displacement: float  # [m] rms, of the tool by the other model from where the own one has it
    thermal: float  # [m] rms, of the tool by the warmth of the own model

    @property
    def share(self) -> float:
        """What the models differ by, over what the warmth does: kappa of a robot that was never identified."""
        return self.displacement / max(self.thermal, 1e-12)


def plan_other_day(job: Job, driven: JointMotion | None) -> tuple[Job | None, list[Finding]]:
    """A job on the robot file's other heat model; None where the file has one only, or, as it is said, it has faults.

    Args:
        job: On its own.
        driven: How its program is driven, where that is what its file says; else it is planned.
    """
    try:
        return None if job.on_other_heat_model is None else job.on_other_heat_model(driven), []
    except CompgenError as failure:
        return None, [_not_known(failure)]


def fly_across(
    job: Job, other: Job, prepared: PreparedProgram, deviation: Deviation, stretch: int = STRETCH
) -> ModelForm:
    """A text on the other heat model.

    Args:
        job: The text was corrected for its heat.
        other: The same on the other.
        prepared: The text, of N positions.
        deviation: Of the text on the job's own heat.
        stretch: Waypoints whose heat is at hand at a time.

    Raises:
        CompgenError: The other model cannot be driven.
    """
    rows = np.unique(np.linspace(0, len(prepared.timing.time) - 1, POSITIONS).astype(int))
    rises = prepared.rises_at(rows) if job.ensemble is None else _rises(job, prepared, rows, stretch)
    own_place = _places(job, prepared, rows, rises)
    other_place = _places(other, prepared, rows, _rises(other, prepared, rows, stretch))
    moved, arc = other_place - own_place, deviation.arc[prepared.first_samples()[rows]]
    square = np.zeros(len(deviation.arc))
    for own, column in zip(deviation.error.T, moved.T, strict=True):  # one after the other, for a program is long
        square += (own + np.interp(deviation.arc, arc, column)) ** 2
    error = np.sqrt(square)
    cold = np.zeros((len(rows), len(job.heat.names)))
    thermal = own_place - _places(job, prepared, rows, cold)
    return ModelForm(
        corrected=job.cell.heat.kind,
        driven=other.cell.heat.kind,
        largest=float(error.max()),
        rms=rms(error),
        displacement=rms(row_norms(moved)),
        thermal=rms(row_norms(thermal)),
    )


def cross_flight(
    job: Job, other: Job | None, prepared: PreparedProgram, deviation: Deviation
) -> tuple[ModelForm | None, list[Finding]]:
    """``fly_across``, and what it means in words: also where the other model cannot be driven; without one, nothing."""
    if other is None:
        return None, []
    try:
        form = fly_across(job, other, prepared, deviation)
    except CompgenError as failure:
        return None, [_not_known(failure)]
    message = (
        f"model form: if the robot file's other heat model, '{form.driven}', is the true one, this program is up "
        f"to {form.largest / UM:.1f} um off ({form.rms / UM:.1f} rms), {100 * form.share:.0f} % of what the warmth "
        "does; only a measurement of the warm arm tells which is nearer"
    )
    return form, [Finding.of(Code.THERMAL_MODEL_FORM, message)]


def _not_known(failure: CompgenError) -> Finding:
    """Why nobody can say what the other model differs by."""
    message = f"model form is not known, the robot file's other heat model cannot be driven: {failure}"
    return Finding.of(Code.THERMAL_MODEL_FORM, message)


def _places(job: Job, prepared: PreparedProgram, rows: IntArray, rise: Array) -> Array:
    """Where the job's arm has the TCP at some positions and their rises, (P, 3) [m] World."""
    twin = replace(twin_of(job), confirmed=CONFIRMED)
    return twin.actual_pose(prepared.theta[rows], rise, lambda share: None).position


def _rises(job: Job, prepared: PreparedProgram, rows: IntArray, stretch: int) -> Array:
    """Rises of the job's heat model at some positions, (P, K) [K], a stretch at a time; of many starts their mean."""
    heat, air, time = job.heat, job.history.air, prepared.timing.time
    if job.ensemble is not None:
        whole = JointMotion(time, prepared.theta, prepared.timing.driven)
        return mean_rises(heat, job.history, job.ensemble, whole)[rows]
    state, states = job.state(), []
    for first in range(0, len(time) - 1, stretch):
        last = min(first + stretch, len(time) - 1)
        part = slice(first, last + 1)
        motion = JointMotion(time[part] - time[first], prepared.theta[part], prepared.timing.driven[first:last])
        between = rows[(rows >= first) & ((rows < last) | (last == len(time) - 1))] - first
        at = states_at(heat, state, motion, np.append(between, last - first), air, job.clock + time[first])
        states.append(at[:-1])
        state = at[-1]
    return np.asarray(np.vstack(states) @ heat.outputs.T)
