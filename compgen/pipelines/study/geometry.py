"""What scenarios share that differ in temperatures only: path, joints, timing and the controller's execution."""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.pose import Pose
from compgen.error_model.model import ErrorModel, build_error_model
from compgen.job.job import Job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned import generate
from compgen.pipelines.planned.program_text import planned_program
from compgen.planning.toolpath import ToolPath
from compgen.thermal import JointMotion
from compgen.verification.twin import Execution, PreparedProgram, prepare


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
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
        return self.at(np.unique(np.linspace(0, len(self.now) - 1, count).astype(int)))

    def at(self, some: IntArray) -> "Geometry":
        """At some of the samples only."""
        few = {n: getattr(self, n)[some] for n in ("segment", "fraction", "now", "theta")}
        return replace(self, **few)

    def rises(self, job: Job) -> Array:
        """Rises at the samples with a job's warmth, (M, K) [K]: the twin's clock and heat."""
        return self.rises_of(self.prepared.reheated(twin_of(job), job.history.before, job.history.air))

    def rises_of(self, prepared: PreparedProgram) -> Array:
        """Rises at the samples with the warmth of the same text prepared otherwise, (M, K) [K]."""
        return prepared.rise_and_growth(self.segment, self.fraction, self.now)[0]


def lay_out(job: Job) -> Geometry:
    """Plan a job and execute its uncorrected text once, pinocchio confirming."""
    planned = generate.predict(job, lambda stage, share: None)
    program = planned_program(job, planned.path, planned.theta, planned.trajectory)
    return executed(job, planned.path, prepare(twin_of(job), program, job.history.before, job.history.air))


def executed(job: Job, path: ToolPath, prepared: PreparedProgram) -> Geometry:
    """A prepared text of a path, executed once."""
    execution = prepared.execute()
    return Geometry(
        job=job,
        path=path,
        prepared=prepared,
        segment=execution.segment,
        fraction=execution.fraction,
        now=execution.time,
        theta=execution.theta,
    )


def execute_with(job: Job, geometry: Geometry) -> Execution:
    """The uncorrected text executed with another job's warmth: the twin's clock, heat and arm."""
    rise = geometry.rises(job)
    actual = flown_pose(job, geometry, rise)
    return Execution(
        segment=geometry.segment,
        fraction=geometry.fraction,
        time=geometry.now,
        rise=rise,
        theta=geometry.theta,
        actual=actual,
    )


def flown_pose(job: Job, geometry: Geometry, rise: Array) -> Pose:
    """Where the tool of an executed text is with a job's arm at rises (M, K) [K], of all samples.

    What the controller's motion does beside the path is that of the execution: it is known from the text alone.
    """
    actual = twin_of(job).actual_pose(geometry.theta, rise, lambda share: None)
    led = geometry.prepared.led
    return actual if led is None else led.moved(actual, slice(0, len(rise)))


def model_of(job: Job) -> ErrorModel:
    """The job's error model."""
    return build_error_model(job.robot, job.sources, len(job.heat.names), job.tool.pose)


def displacement(job: Job, geometry: Geometry, rise: Array) -> Array:
    """Error vectors at the samples for given rises (K,) or (M, K) [K], (M, 3) [m]: actual minus nominal."""
    model, theta = model_of(job), geometry.theta
    return np.asarray(model.actual_pose(theta, np.atleast_2d(rise)).position - model.nominal_pose(theta).position)
