"""A corrected program in pages as it runs: its stations, and what the text of its pages in the folder leaves there."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, row_norms
from compgen.core.exceptions import InputError
from compgen.core.stages import Progress
from compgen.error_model.direction_memory import DirectionState
from compgen.job.job import Cell
from compgen.pipelines.correct import Correction
from compgen.pipelines.correct.program_pages import with_positions
from compgen.pipelines.correct.result import corrected_stations
from compgen.pipelines.correct.station_corrections import error_models
from compgen.pipelines.resume.beginning import Begun
from compgen.pipelines.resume.corrected_job import ANEW, CorrectedJob
from compgen.pipelines.resume.corrected_rest import (
    ResumedProgram,
    active_motions,
    corrected_first,
    last_writer,
    page_stations,
    resume_corrected,
)
from compgen.pipelines.resume.paged_run import LogZero, PagedRun
from compgen.pipelines.resume.written_job import WrittenJob
from compgen.program.directions import station_directions
from compgen.program.driven import NONE
from compgen.thermal import JointMotion, state_after, still_air
from compgen.thermal.model import with_losses
from compgen.thermal.rise_filter import STEP
from compgen.thermal.schedule import STANDING, History


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class CorrectedRun(PagedRun):
    """Of a corrected program with S stations."""

    job: CorrectedJob
    first: Correction  # that its pages were parted of
    judged: BoolArray  # (S,) stations that were corrected
    directions: DirectionState  # at each station
    theta: Array  # (S, 6) [rad] that the pages in the folder command

    def errors(self, page: int, cell: Cell, rows: IntArray, rise: Array) -> Array:
        """At the corrected stations of the page."""
        drive, station = self.first.plan.drive, np.searchsorted(self.places, rows)
        of_page = self.judged[station] & (rows > self.edges[page - 1])  # it begins where the page before stops
        station, rise = station[of_page], rise[of_page]
        pose = drive.pose[station]
        sizes = np.empty(len(station))
        for tool, model in error_models(cell, drive.at, pose).items():
            with_tool = drive.at.tool[pose] == tool
            some = station[with_tool]
            actual = model.actual_pose(self.theta[some], rise[with_tool], self.directions.at(some))
            sizes[with_tool] = row_norms(actual.position - drive.at.tcp.position[pose[with_tool]])
        return sizes

    def rewrite(self, page: int, begun: Begun, date: str, progress: Progress, loaded: int, done: int) -> ResumedProgram:
        """By the way of ``resume_corrected``."""
        return resume_corrected(
            self.job,
            page,
            lambda known: begun,
            date=date,
            progress=progress,
            loaded=loaded,
            done=done,
            first=self.first,
        )

    def reread(self, written: WrittenJob) -> Self:
        """The pages read again."""
        theta = commanded_by_pages(self.first, self.job, written)
        return replace(self, written=written, job=replace(self.job, written=written), theta=theta)


def corrected_run(job: CorrectedJob, progress: Progress) -> CorrectedRun:
    """A corrected program as it runs.

    Raises:
        InputError: The files make another program than it was.
    """
    first = corrected_first(job, progress)
    cell, drive = job.cell, first.plan.drive
    driven = drive.joint_motion()
    before = tuple(with_losses(cell.heat, job.before, driven))
    (standing,) = with_losses(cell.heat, [STANDING], driven)
    history = History(before=before, standing=standing, air=still_air(job.options.air))
    motion, rows = in_steps(driven)
    stations = [*page_stations(first, job), len(drive.pose)]
    reference = job.options.reference
    return CorrectedRun(
        written=job.written,
        cell=cell,
        plain=job.plain,
        heat=cell.heat,
        history=history,
        clock=history.clock,
        start=state_after(cell.heat, before, air=history.air),
        zero=LogZero(reference=reference, window=STEP, degC=reference),
        motion=motion,
        edges=tuple(rows[drive.reached[stations]].tolist()),
        places=rows[drive.reached[1:]],
        job=job,
        first=first,
        judged=corrected_stations(first.plan, first.shared),
        directions=station_directions(cell.robot, cell.sources, drive)[0],
        theta=commanded_by_pages(first, job, job.written),
    )


def in_steps(motion: JointMotion) -> tuple[JointMotion, IntArray]:
    """A motion with places on its way, no ``STEP`` apart, and the rows where its own places are then, (N,)."""
    pieces = np.ceil(np.diff(motion.time) / STEP).astype(np.int64).clip(1)
    rows = np.concatenate([[0], np.cumsum(pieces)])
    at, own = np.arange(rows[-1] + 1), np.arange(len(rows))
    share = np.interp(at, rows, own)
    time, *joints = (np.interp(share, own, column) for column in (motion.time, *motion.theta.T))
    return JointMotion(time, np.column_stack(joints), np.repeat(motion.driven, pieces)), rows


def commanded_by_pages(first: Correction, job: CorrectedJob, written: WrittenJob) -> Array:
    """Joints at each station of a program as its pages in a folder command them, (S, 6) [rad].

    A position may be in several pages, with other numbers in each; those that one call wrote agree.
    """
    drive, stations = first.plan.drive, [*page_stations(first, job), len(first.plan.drive.pose)]
    writers = [last_writer(written.resumed, page.number) for page in written.pages]
    theta, moves = np.full((len(drive.pose), 6), np.nan), active_motions(first)
    for writer in set(writers):
        pages = [page for page, by in zip(written.pages, writers, strict=True) if by == writer]
        parts = [(page.data, moves[page.first : page.last + 1]) for page in pages]
        _, now = first.around.drive(with_positions(first.written, parts), first.cell.robot)
        if len(now.pose) != len(drive.pose):
            raise InputError(f"{written.manifest_file}: its pages drive otherwise than the corrected program; {ANEW}")
        for page in pages:
            rows = np.arange(stations[page.number - 1], stations[page.number])
            rows = rows[now.pose[rows] != NONE]
            theta[rows] = now.at.theta[now.pose[rows]]
    return theta
