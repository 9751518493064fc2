"""One scenario to one row: what is shared between scenarios is done once.

Path, joints, timing and the controller's execution depend on the geometry keys only; heat, growth and the error are
then a few array operations on its samples. A scenario that only changes temperatures costs those.
"""

from collections import OrderedDict
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.exceptions import CompgenError
from compgen.core.findings import Level
from compgen.error_model.model import ErrorModel, build_error_model
from compgen.pipelines import generate
from compgen.pipelines.job import Job
from compgen.pipelines.path_file import load_job
from compgen.pipelines.program_text import planned_program
from compgen.pipelines.study.scenarios import Scenario, Study
from compgen.pipelines.twin_of_job import twin_of
from compgen.planning.toolpath import ToolPath
from compgen.thermal import JointMotion
from compgen.verification.deviation import Deviation, deviation_from_path, statistics
from compgen.verification.twin import Execution, PreparedProgram, prepare

Row = dict[str, Any]
KEPT = 4  # geometries at a time
#: tables whose keys leave path, joints and timing alone
WARM = ("before", "cycle", "after", "shift", "ambient", "log", "bounds", "compensation", "title", "robot.thermal")


@dataclass(frozen=True, eq=False, slots=True)
class Geometry:
    """What scenarios share that differ in temperatures only: the uncorrected text, executed at M samples."""

    job: Job
    path: ToolPath
    prepared: PreparedProgram
    segment: IntArray  # (M,)
    fraction: Array  # (M,)
    now: Array  # (M,) [s]
    theta: Array  # (M, 6) [rad] as the controller commands

    @property
    def motion(self) -> JointMotion:
        """The program at its positions."""
        return JointMotion(self.prepared.time, self.prepared.theta, self.prepared.driven)

    def thinned(self, count: int) -> "Geometry":
        """At some of the samples only, both ends among them."""
        some = np.unique(np.linspace(0, len(self.now) - 1, count).astype(int))
        few = {n: getattr(self, n)[some] for n in ("segment", "fraction", "now", "theta")}
        return replace(self, **few)

    def rises(self, job: Job) -> Array:
        """Rises at the samples with a job's warmth, (M, K) [K]: the twin's clock and heat."""
        reheated = self.prepared.reheated(twin_of(job), job.history.before, job.history.air)
        return reheated.rise_and_growth(self.segment, self.fraction, self.now)[0]


class Shared:
    """Geometries by their keys; the last few are kept."""

    def __init__(self, study: Study) -> None:
        """For one study."""
        self._study = study
        self._kept: OrderedDict[tuple[tuple[str, str], ...], Geometry | CompgenError] = OrderedDict()

    def of(self, scenario: Scenario, job: Job) -> Geometry:
        """The geometry of a scenario.

        Raises:
            CompgenError: The robot cannot drive it.
        """
        key = geometry_key(scenario)
        if key not in self._kept:
            try:
                self._kept[key] = lay_out(job)
            except CompgenError as failure:
                self._kept[key] = failure
            if len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        geometry = self._kept[key]
        if isinstance(geometry, CompgenError):
            raise geometry
        return geometry


def geometry_key(scenario: Scenario) -> tuple[tuple[str, str], ...]:
    """The values that path, joints and timing depend on."""
    return tuple((k, v) for k, v in scenario.values if not any(k == w or k.startswith(f"{w}.") for w in WARM))


def lay_out(job: Job) -> Geometry:
    """Plan a job and execute its uncorrected text once, pinocchio confirming."""
    planned = generate.predict(job, lambda stage, share: None)
    program = planned_program(job, planned.path, planned.theta, planned.trajectory)
    prepared = prepare(twin_of(job), program, job.history.before, job.history.air)
    execution = prepared.execute()
    return Geometry(job, planned.path, prepared, execution.segment, execution.fraction, execution.time, execution.theta)


def execute_with(job: Job, geometry: Geometry) -> Execution:
    """The uncorrected text executed with another job's warmth: the twin's clock, heat and arm."""
    rise, theta = geometry.rises(job), geometry.theta
    actual = twin_of(job).actual_pose(theta, rise, lambda share: None)
    return Execution(geometry.segment, geometry.fraction, geometry.now, rise, theta, actual)


def model_of(job: Job) -> ErrorModel:
    """The job's error model."""
    return build_error_model(job.robot, job.sources, len(job.heat.names), job.tool.pose)


def evaluate(study: Study, scenario: Scenario, shared: Shared) -> Row:
    """A scenario's row: its values with their results, or why it failed."""
    row: Row = {"index": scenario.index, **{key: value.strip('"') for key, value in scenario.values}}
    try:
        job = load_job(study.path, study.robot, [*study.base, *scenario.overrides()])
        geometry = shared.of(scenario, job)
        execution = execute_with(job, geometry)
        before = deviation_from_path(geometry.path, [execution], len(execution.time))
        row |= {"state": "done"} | _numbers("before", before)
        row |= {
            "duration_s": _round(float(execution.time[-1])),
            "waypoints": len(geometry.path.arc),
        } | {f"start_{n}_K": _round(float(r)) for n, r in zip(job.heat.names, execution.rise[0])}
        if study.correct:
            _, corrected = generate.generate(job, lambda stage, share: None)
            row |= _numbers("after", corrected.deviation)
            row |= {"inside": corrected.inside, "start_window_s": _round(corrected.start_window)}
            if not corrected.inside:
                row["reason"] = next(f.message for f in corrected.findings if f.level is Level.OUTSIDE)
    except CompgenError as failure:
        row |= {"state": "failed", "reason": " ".join(str(failure).split())}
    return row


def _numbers(side: str, deviation: Deviation) -> Row:
    table = statistics(deviation)
    out = {f"{side}_{k}": _round(v) for k, v in table["total"].items()}
    return out | {f"{side}_normal_max_um": _round(table["normal"]["max_um"])}


def _round(value: float) -> float:
    return float(f"{value:.6g}")


def displacement(job: Job, geometry: Geometry, rise: Array) -> Array:
    """Error vectors at the samples for given rises (K,) or (M, K) [K], (M, 3) [m]: actual minus nominal."""
    model, theta = model_of(job), geometry.theta
    return np.asarray(model.actual_pose(theta, np.atleast_2d(rise)).position - model.nominal_pose(theta).position)
