"""A job in pages as it runs: what following it needs to know of a planned job, and of a corrected program."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, owns, row_norms
from compgen.core.pose import Pose
from compgen.core.recorded.layout import PLAIN, DialectTable
from compgen.core.stages import Progress
from compgen.core.units import MINUTE
from compgen.job.job import Cell
from compgen.pipelines.planned.job_results import Planned
from compgen.pipelines.planned.program_text import in_world
from compgen.pipelines.resume.beginning import Begun, PromptStart, path_tables, unmoved
from compgen.pipelines.resume.corrected_rest import ResumedProgram
from compgen.pipelines.resume.pages_anew import read_written
from compgen.pipelines.resume.result import Resumed
from compgen.pipelines.resume.resume import resume
from compgen.pipelines.resume.written_job import WrittenJob
from compgen.program.program import Program
from compgen.robot import inverse_kinematics, joint_path
from compgen.thermal import JointMotion
from compgen.thermal.model import ThermalModel
from compgen.thermal.rise_filter import STEP
from compgen.thermal.schedule import History
from compgen.thermal.temperature_log import Reference


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class LogZero:
    """What the readings of a log count from, and what the path file says of its form."""

    reference: Reference
    window: float  # [s] of its beginning, where that is what they count from
    degC: float  # at which the robot was calibrated
    dialect: DialectTable = PLAIN  # how it is written


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(start=("S",), places=("P",))
class PagedRun(ABC):
    """A job in pages and what it does, N rows of motion from its planned start on."""

    written: WrittenJob
    cell: Cell
    plain: Cell  # as its robot file has it, without the state that the job may begin with
    heat: ThermalModel
    history: History  # its air and how the robot stands
    clock: float  # [s] of the planned start, from the first duty before on
    start: Array  # (S,) thermal state then
    zero: LogZero
    motion: JointMotion
    edges: tuple[int, ...]  # rows at which the pages begin, and the last one ends
    places: IntArray  # rows of the places that the text names, rising

    @property
    def spans(self) -> tuple[float, ...]:
        """How long each page runs [s]."""
        return tuple(np.diff(self.motion.time[list(self.edges)]).tolist())

    def page_motion(self, page: int) -> JointMotion:
        """The motion of a page, from its own beginning on."""
        return self.motion.between(self.edges[page - 1], self.edges[page])

    @abstractmethod
    def errors(self, page: int, cell: Cell, rows: IntArray, rise: Array) -> Array:
        """What a page as it stands in the folder leaves where it is judged, (M,) [m].

        Args:
            page: From 1.
            cell: The robot.
            rows: Of places of the page, (P,).
            rise: There, (P, K) [K].
        """

    @abstractmethod
    def rewrite(
        self, page: int, begun: Begun, date: str, progress: Progress, loaded: int, done: int
    ) -> Resumed | ResumedProgram:
        """The pages from one on for how the robot begins; arguments and exceptions as those of ``resume``."""

    @abstractmethod
    def reread(self, written: WrittenJob) -> Self:
        """The same after some of its pages were written anew."""


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class PlannedRun(PagedRun):
    """Of a planned job."""

    whole: Planned
    programs: tuple[Program, ...]  # the pages as the controller reads them

    def errors(self, page: int, cell: Cell, rows: IntArray, rise: Array) -> Array:
        """On the part."""
        whole, job, begin = self.whole, self.whole.job, self.edges[page - 1]
        text = self.programs[page - 1]
        pose = Pose(text.position[rows - begin], text.rotation[rows - begin])
        joints = inverse_kinematics.solve_tool(job.robot, in_world(job, pose), job.tool.pose, job.posture).theta
        theta = joint_path.nearest_turns(joints, whole.theta[rows])
        model = whole.model if cell is self.cell else cell.error_model(job.tool.pose)
        actual = model.actual_pose(theta, rise, whole.motion.at(rows)).position
        return row_norms(actual - whole.path.target.position[rows])[on_part_rows(whole)[rows]]

    def rewrite(self, page: int, begun: Begun, date: str, progress: Progress, loaded: int, done: int) -> Resumed:
        """By the way of ``resume``."""

        def begin(known: PromptStart) -> Begun:
            return begun if begun.air is not None else replace(begun, air=known.measured_air)

        return resume(self.written, self.whole, page, begin, date, progress, loaded=loaded, done=done)

    def reread(self, written: WrittenJob) -> Self:
        """The pages read again."""
        return replace(self, written=written, programs=tuple(read_written(written, self.whole)))


def planned_run(written: WrittenJob, whole: Planned) -> PlannedRun:
    """A planned job as it runs.

    Raises:
        InputError: Its pages are not those of the plan.
    """
    job, tables = whole.job, path_tables(whole.job)
    reference: Reference = tables.ambient.reference_degC
    window = STEP
    if tables.log is not None:
        reference = reference if tables.log.reference is None else tables.log.reference
        window = tables.log.window_min * MINUTE
    return PlannedRun(
        written=written,
        cell=job.cell,
        plain=unmoved(job),
        heat=job.heat,
        history=job.history,
        clock=job.clock,
        start=job.state(),
        zero=LogZero(
            reference=reference, window=window, degC=tables.ambient.reference_degC, dialect=tables.log or PLAIN
        ),
        motion=whole.joint_motion,
        edges=(*(page.first for page in written.pages), written.pages[-1].last),
        places=np.arange(len(whole.theta)),
        whole=whole,
        programs=tuple(read_written(written, whole)),
    )


def on_part_rows(whole: Planned) -> BoolArray:
    """Waypoints where the tool touches, (N,)."""
    on_part = whole.path.segments_on_part()
    return np.asarray(np.append(on_part, on_part[-1]) | np.append(on_part[0], on_part))
