"""What a run comes to: the planned job, and the corrected one with its proof."""

from dataclasses import dataclass, replace

import numpy as np

from compgen.compensation.problem import Solution
from compgen.core.arrays import Array, IntArray
from compgen.core.evaluation import Background, failed
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.error_model.direction_memory import DirectionState, direction_states, reversal_widths
from compgen.error_model.unmeasured import Unknown
from compgen.job.job import Job
from compgen.job.motion_plan import MotionPlan
from compgen.job.uncertainty import is_taught_with
from compgen.pipelines.planned.delivery import Delivery
from compgen.pipelines.planned.many_starts import Averaged, planned_rises
from compgen.pipelines.uncertainty.band_columns import WaypointProgram, band_along
from compgen.pipelines.uncertainty.draws import FlownDraws
from compgen.pipelines.uncertainty.model_form import ModelForm
from compgen.pipelines.uncertainty.not_known import not_known, setting_of
from compgen.planning.retiming import Trajectory
from compgen.planning.toolpath import ToolPath
from compgen.program.program import Program
from compgen.thermal import Ambient, Duty
from compgen.verification.band import Band
from compgen.verification.deviation import Deviation
from compgen.verification.motion_effect import MotionEffect
from compgen.verification.twin import Execution, Twin, execute
from compgen.verification.verdict import JudgedResult
from compgen.verification.written_motion import WrittenMotion


@dataclass(frozen=True, eq=False, slots=True)
class DenseCorrection:
    """The N waypoints that a correction was found on, where the program names fewer positions."""

    path: ToolPath
    theta: Array  # (N, 6) [rad] corrected
    correction: Array  # (N, 6) [m] and [rad]


@dataclass(frozen=True, eq=False, slots=True, kw_only=True, weakref_slot=True)
class Planned(MotionPlan):
    """The job before any correction: its motion, and how warm it is on the way."""

    job: Job
    motion: DirectionState  # where joints and TCP come from, at each waypoint
    rise: Array  # (N, K) [K]
    twin_result: Background[tuple[Deviation, WrittenMotion]]  # of the twin that drives the uncorrected text
    findings: tuple[Finding, ...]
    rows: IntArray  # which of the waypoints that were planned these are
    dense: DenseCorrection | None = None  # where the program has arcs, what they were fitted to
    band: Band | None = None  # what the files leave open; of a corrected program it stands there

    def deviation(self) -> Deviation:
        """Of the uncorrected text; waits until the twin has driven it.

        Raises:
            TwinError: The twin cannot drive it.
        """
        return self.twin_result.result()[0]

    def written(self) -> WrittenMotion:
        """Of the uncorrected text; waits as well."""
        return self.twin_result.result()[1]

    def effect(self, written: WrittenMotion) -> MotionEffect | None:
        """Of the controller's motion on a text that came of the plan; one of all its lines has the plan's."""
        if written.effect is not None or self.job.robot.motion is not None:
            return written.effect
        return self.written().effect

    def band_of_plan(self) -> Band:
        """What the files leave open while nothing is corrected."""
        return self.band if self.band is not None else band_along(self.driven(self.theta, self.motion))

    def not_known(self, band: Band) -> tuple[Unknown, ...]:
        """What a band of the program leaves out because nothing is known of it."""
        places, tool, cell = self.path.target.position, self.job.tool.pose, self.job.cell
        taught = is_taught_with(tool, self.job.frame, cell)
        return not_known(cell, band, setting_of(places, tool.position[None], self.rise, is_tool_taught=taught))

    def driven(self, theta: Array, motion: DirectionState) -> WaypointProgram:
        """The program with some commanded joints (N, 6) [rad] that come from somewhere, for its band."""
        time = self.trajectory.time
        return WaypointProgram(
            job=self.job, model=self.model, path=self.path, theta=theta, time=time, rise=self.rise, motion=motion
        )

    @property
    def time(self) -> Array:
        """When the planned motion is at each waypoint, (N,) [s]."""
        return self.trajectory.time

    def at(self, rows: IntArray, path: ToolPath | None = None) -> "Planned":
        """The plan at some of its waypoints, rising; given the path of these, where it has arcs."""
        stops = self.page_stops
        return replace(
            self,
            path=self.path.subset(rows) if path is None else path,
            page_stops=stops and stops.at(rows),
            theta=self.theta[rows],
            motion=self.motion.at(rows),
            trajectory=self.trajectory.at(rows),
            rise=self.rise[rows],
            rows=rows,
        )

    def error_at(self, rows: slice) -> Array:
        """Predicted and uncorrected, of some of the waypoints, (M, 6) [m] and [rad]."""
        return self.model.error(self.theta[rows], self.rise[rows], self.path.target[rows], self.motion.at(rows))

    def error(self) -> Array:
        """Predicted and uncorrected, of all waypoints, (N, 6) [m] and [rad]."""
        return self.error_at(slice(None))


def plan_of(job: Job, plan: MotionPlan) -> Planned:
    """A job with its motion and its warmth, before the twin flies it."""
    return Planned(
        job=job,
        feed=plan.feed,
        path=plan.path,
        page_stops=plan.page_stops,
        model=plan.model,
        theta=plan.theta,
        motion=direction_states(reversal_widths(job.sources), plan.theta, plan.path.target.position),
        trajectory=plan.trajectory,
        rise=planned_rises(job, plan.joint_motion),
        twin_result=failed(InputError("the plan of a whole job is not flown; resume it from a page on")),
        findings=(),
        rows=np.arange(len(plan.theta)),
    )


def solution_at(solution: Solution, rows: IntArray) -> Solution:
    """A solution at some of its waypoints."""
    return replace(
        solution,
        correction=solution.correction[rows],
        theta=solution.theta[rows],
        residual=solution.residual[rows],
    )


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Corrected(JudgedResult):
    """The job with its correction, its text and the proof."""

    solution: Solution
    trajectory: Trajectory
    program: Program
    delivery: Delivery
    twin: Twin
    before: tuple[Duty, ...]
    air: Ambient
    samples: IntArray  # (N,) which sample of ``deviation`` is at each position
    deviation: Deviation
    written: WrittenMotion
    start_window: float  # [s] how late the program may start
    mid_spatial: float  # [m] rms that the correction puts onto the surface at periods of 1 to 20 mm
    band: Band  # what the files leave open
    model_form: ModelForm | None  # None: the robot file has no other heat model, or it cannot be driven
    draws: FlownDraws | None  # what the bounds with a probability are judged by; None: there are none
    averaged: Averaged | None = None  # what the file leaves over its starts, where it was made for several

    def execution(self) -> Execution:
        """What the twin does with the text at every sample, executed anew."""
        return execute(self.twin, self.program, self.before, air=self.air)

    @property
    def text(self) -> bytes:
        """The file that the operator starts: the program, or the main program of its pages."""
        return self.delivery.text

    @property
    def is_as_planned(self) -> bool:
        """Whether nothing was corrected for its files know of no error, and nothing else stands against the program."""
        return {f.code for f in self.findings if f.level is Level.OUTSIDE} == {Code.CORRECTION_NONE}

    @property
    def is_usable(self) -> bool:
        """Whether the program is written unasked: inside its bounds, or nothing was there to correct."""
        return self.inside or self.is_as_planned
