"""What scenarios share that differ in temperatures only: path, joints, timing and the controller's execution."""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.evaluation import kept_with
from compgen.core.pose import Pose
from compgen.error_model.direction_memory import DirectionState, direction_states, reversal_widths
from compgen.job.job import Job
from compgen.job.uncertainty import JobUncertainty, quantities_of
from compgen.pipelines.files.twin_of_job import prepared_for, twin_of
from compgen.pipelines.planned import corrected_arcs, generate
from compgen.pipelines.planned.many_starts import planned_rises
from compgen.pipelines.planned.program_text import planned_program
from compgen.pipelines.uncertainty.band_columns import Places, columns_at
from compgen.pipelines.uncertainty.model_form import CONFIRMED
from compgen.planning.toolpath import ToolPath
from compgen.robot.kinematics import flange_pose
from compgen.thermal import JointMotion
from compgen.thermal.schedule import History
from compgen.verification.band import Band, band_of
from compgen.verification.twin import Execution, PreparedProgram

SAMPLES = 200  # of a band, evenly
DIRECTIONS = np.array([d for d in product((-1, 0, 1), repeat=3) if any(d)], dtype=float)


@dataclass(frozen=True, eq=False, slots=True, kw_only=True, weakref_slot=True)
class Geometry:
    """What scenarios share that differ in temperatures only: the uncorrected text, executed at M samples."""

    job: Job
    path: ToolPath
    prepared: PreparedProgram
    segment: IntArray  # (M,)
    fraction: Array  # (M,)
    now: Array  # (M,) [s]
    theta: Array  # (M, 6) [rad] as the controller commands
    position: Array  # (M, 3) [m] where the controller believes the tool is; no warmth moves it
    turns: DirectionState  # which way joints and tool have turned

    @property
    def motion(self) -> JointMotion:
        """The program at its positions."""
        return JointMotion(self.prepared.timing.time, self.prepared.theta, self.prepared.timing.driven)

    def thinned(self, count: int) -> "Geometry":
        """At some of the samples only, both ends among them."""
        return self.at(np.unique(np.linspace(0, len(self.now) - 1, count).astype(int)))

    def at(self, some: IntArray) -> "Geometry":
        """At some of the samples only."""
        few = {n: getattr(self, n)[some] for n in ("segment", "fraction", "now", "theta", "position")}
        return replace(self, turns=self.turns.at(some), **few)

    def rises(self, job: Job) -> Array:
        """Rises at the samples with a job's warmth, (M, K) [K]: the twin's clock and heat."""
        return self.rises_of(self.prepared.reheated(twin_of(job), job.history.before, job.history.air))

    def rises_as_planned(self, job: Job) -> Array:
        """The same; of a job whose file serves several starts their mean."""
        if job.ensemble is None:
            return self.rises(job)
        prepared = replace(self.prepared, twin=twin_of(job))
        return self.rises_of(prepared.with_rise(planned_rises(job, self.motion)))

    def rises_of(self, prepared: PreparedProgram) -> Array:
        """Rises at the samples with the warmth of the same text prepared otherwise, (M, K) [K]."""
        return prepared.rise_and_growth(self.segment, self.fraction, self.now)[0]


def plan_geometry(job: Job) -> Geometry:
    """Plan a job and execute its uncorrected text once, pinocchio confirming."""
    lines = generate.plan_lines(job, lambda stage, share: None)
    planned = corrected_arcs.at_program_positions(lines, lambda stage, share: None)
    program = planned_program(job, planned.path, planned.theta, planned.trajectory)
    return executed(job, planned.path, prepared_for(job, program))


def executed(job: Job, path: ToolPath, prepared: PreparedProgram) -> Geometry:
    """A prepared text of a path, executed once."""
    execution = prepared.execute()
    position = (flange_pose(job.robot, execution.theta) @ job.tool.pose).position
    return Geometry(
        job=job,
        path=path,
        prepared=prepared,
        segment=execution.segment,
        fraction=execution.fraction,
        now=execution.time,
        theta=execution.theta,
        position=position,
        turns=direction_states(reversal_widths(job.sources), execution.theta, position),
    )


def execute_with(job: Job, geometry: Geometry, rise: Array | None = None) -> Execution:
    """The uncorrected text executed with another job's warmth: the twin's clock, heat and arm.

    Args:
        job: With that warmth.
        geometry: Executed before.
        rise: At the samples, (M, K) [K]; None: as the job's run, the mean of its starts where one file serves several.
    """
    rise = geometry.rises_as_planned(job) if rise is None else rise
    return Execution(
        segment=geometry.segment,
        fraction=geometry.fraction,
        time=geometry.now,
        rise=rise,
        theta=geometry.theta,
        actual=flown_pose(job, geometry, rise),
    )


def flown_pose(job: Job, geometry: Geometry, rise: Array) -> Pose:
    """Where the tool of an executed text is with a job's arm at rises (M, K) [K], of all samples.

    What the controller's motion does beside the path is that of the execution: it is known from the text alone.
    """
    twin = replace(twin_of(job), confirmed=CONFIRMED)
    actual = twin.actual_pose(geometry.theta, rise, lambda share: None)
    led = geometry.prepared.led
    return actual if led is None else led.moved(actual, slice(0, len(rise)))


def displacement(job: Job, geometry: Geometry, rise: Array) -> Array:
    """Error vectors at the samples for given rises (K,) or (M, K) [K], (M, 3) [m]: actual minus nominal."""
    model, theta = job.cell.error_model(job.tool.pose), geometry.theta
    actual = model.actual_pose(theta, np.atleast_2d(rise), geometry.turns).position
    return np.asarray(actual - model.nominal_pose(theta).position)


def band_at_samples(job: Job, geometry: Geometry, history: History | None = None, rise: Array | None = None) -> Band:
    """What a job's files leave open at some samples of its path, wherever it touches.

    Args:
        job: Its warmth may be another than the geometry's.
        geometry: The path, executed.
        history: What went before, where it is not the job's until the last start that its file serves.
        rise: Then, (K,) or at the samples (n, K) [K]; None: as the job's rises run.
    """
    some = some_samples(geometry)
    thin = geometry.at(some)
    rises = thin.rises_as_planned(job) if rise is None else np.broadcast_to(rise, (len(some), rise.shape[-1]))
    places = Places(theta=thin.theta, time=thin.now, rise=rises, motion=thin.turns, tool=job.tool.pose)
    uncertainty = uncertainty_along(job, geometry)
    history = history or replace(job.history, before=job.duties_before())
    columns = columns_at(job.cell, history, job.feed, uncertainty, places, job.cell.error_model(job.tool.pose))
    return band_of([columns], np.arange(len(some)), part_weight(geometry, thin), job.cell.fit.scale)


def uncertainty_along(job: Job, geometry: Geometry) -> JobUncertainty:
    """What a job does not know, with the middle of its way for the middle of the part."""
    position = geometry.position
    return quantities_of(job, middle=(position.min(axis=0) + position.max(axis=0)) / 2)


@kept_with("geometry")
def some_samples(geometry: Geometry) -> IntArray:
    """Which samples of a geometry stand for its band: evenly where the tool touches, and what lies farthest out there.

    What is open is smooth along the part and largest at its rim: the farthest in each direction are among them, for
    either way that the tool goes, because play and friction follow it.
    """
    position = geometry.position
    rows = rows_on_part(geometry)
    along = np.gradient(position, axis=0)[rows] if len(rows) > 1 else np.zeros((1, 3))
    evenly = rows[np.linspace(0, len(rows) - 1, min(SAMPLES, len(rows))).astype(int)]
    ways = [rows[sign * along[:, axis] >= 0] for axis in range(3) for sign in (-1, 1)]
    rim = [way[np.argmax(position[way] @ DIRECTIONS.T, axis=0)] for way in ways if len(way)]
    return np.asarray(np.unique(np.concatenate([evenly, *rim])))


def rows_on_part(geometry: Geometry) -> IntArray:
    """Samples between waypoints that both touch; all of a path that nowhere does."""
    touching = np.flatnonzero(part_weight(geometry, geometry))
    return touching if len(touching) else np.arange(len(geometry.now))


def part_weight(geometry: Geometry, thin: Geometry) -> Array:
    """One between waypoints that both touch, zero elsewhere, at the samples of a thinned geometry.

    A job's band is of its touching waypoints: beyond the last of them it would be a little larger.
    """
    contact = geometry.path.contact
    both = contact[:-1] & contact[1:]
    return np.asarray((both if both.any() else contact[:-1] | contact[1:])[thin.segment].astype(float))
