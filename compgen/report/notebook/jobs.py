"""A planned program in a notebook: its job, its prediction, its correction."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from compgen.core.arrays import Array, BoolArray, frozen
from compgen.core.dates import DEFAULT_DATE, checked_date
from compgen.core.exceptions import RESULT, refuse_changes
from compgen.core.findings import Finding
from compgen.core.stages import Progress
from compgen.job.anchored_start import seconds_of_age, state_overrides
from compgen.job.job import Job
from compgen.pipelines.files.path_file import load_job as read_job
from compgen.pipelines.files.robot_file import load_robot as read_robot
from compgen.pipelines.planned import generate as pipeline
from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.pipelines.planned.many_starts import Averaged
from compgen.report.job_page import FIGURES, job_figures, job_reports
from compgen.report.job_summary import job_band, job_summary
from compgen.report.notebook.arguments import (
    STATE,
    File,
    Overrides,
    assignments,
    file_name,
    instance,
    optional_name,
    progress_of,
    remember,
    require_unchanged,
    text_of,
)
from compgen.report.notebook.machine import data_frame, log_result, machine, plotly_figure
from compgen.report.page import PLAIN, PageOptions
from compgen.report.waypoints_csv import at_waypoints, waypoint_columns
from compgen.robot.robot import Robot
from compgen.verification.verdict import Verdict

ROBOT = "a robot's name, as 'm710ic50', or its file"
JOB = "give what compgen.load_job returns"


def load_job(
    path: File,
    robot: File | None = None,
    overrides: Overrides | None = None,
    state: File | None = None,
    state_age: str | None = None,
) -> Job:
    """Read a path file, its robot's file, and what shall be different from both.

    Args:
        path: A path file, as ``paths/spiral_1300.toml``.
        robot: Name or file of a robot; by default what the path file says.
        overrides: Keys of the path file and their values, as ``{"process.feed_mm_s": 100, "before.0.duty": 0.5}``;
            ``robot.`` leads into the robot file. Or texts ``key=value``, as ``cgen --set`` takes them.
        state: What ``cgen anchor`` wrote: how the robot begins, in place of ``before`` and a log.
        state_age: How long before the start that was, the robot standing since, as ``"20min"``.

    Returns:
        The job, which does not change: another feed or duty is another job.

    Raises:
        InputError: Anything wrong, naming file and key.
    """
    name = file_name(path, "path", "a path file, as 'paths/spiral_1300.toml'")
    age = seconds_of_age(optional_name(state_age, "state_age", "a time, as '20min'"))
    of_state = state_overrides(name, optional_name(state, "state", STATE), age)
    return remember(read_job(name, optional_name(robot, "robot", ROBOT), [*assignments(overrides), *of_state]))


def load_robot(robot: File) -> Robot:
    """A robot's nominal facts: lengths, limits, controller.

    Args:
        robot: Name or file of a robot.

    Raises:
        InputError: Unknown, or anything wrong in its file.
    """
    return read_robot(file_name(robot, "robot", ROBOT))


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class _OfJob:
    """What a job's plan says, corrected or not."""

    job: Job
    planned: Planned  # the whole plan, for who needs more
    corrected: Corrected | None
    report: dict[str, Any]  # as report.json has it
    error: Array  # (N, 6) without correction, against target: [m] in World, rotation vector [rad] in tool axes

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What a user must know."""
        return (self.corrected or self.planned).findings

    @property
    def position(self) -> Array:
        """Targets of the TCP in World, (N, 3) [m]."""
        return self.planned.path.target.position

    @property
    def rotation(self) -> Array:
        """Targets of the tool's axes, as columns, (N, 3, 3)."""
        return self.planned.path.target.rotation

    @property
    def contact(self) -> BoolArray:
        """Whether the tool is on the part, (N,)."""
        return self.planned.path.contact

    @property
    def rise(self) -> Array:
        """Temperature of each node above the reference, (N, K) [K]."""
        return frozen(self.planned.rise)

    @property
    def nodes(self) -> tuple[str, ...]:
        """Names of the K nodes."""
        return self.job.heat.names

    def band(self) -> Array:
        """Half-widths of what the robot file leaves open, k = 2, at each waypoint: World x, y, z, feed, cross, normal.

        Returns:
            (N, 6) [m].
        """
        return frozen(job_band(self.planned, self.corrected).half_widths(self.planned.path))

    def to_dataframe(self) -> Any:
        """The table of ``waypoints.csv`` with all digits, as a pandas DataFrame: a row a waypoint.

        Raises:
            InputError: pandas is not installed.
        """
        with machine(None):
            return data_frame(waypoint_columns(self.planned, self.corrected))

    def plot(self, which: str = "time") -> Any:
        """A plotly Figure: the error over ``time`` or in ``space``, the ``band``, its ``budget``, ``heat``, ``joints``.

        Of a file that serves many starts, also the ``average``: the error at each of them.

        Raises:
            InputError: No such figure.
        """
        return plotly_figure(job_figures(self.planned, self.corrected, self.report), FIGURES, which)


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Prediction(_OfJob):
    """What would go wrong if the planned program ran as it is: N waypoints, K nodes of the heat model."""

    @property
    def verdict(self) -> Verdict:
        """``predicted``: nothing has been corrected."""
        return Verdict.PREDICTED

    @property
    def time(self) -> Array:
        """When the planned motion is at each waypoint, (N,) [s]."""
        return self.planned.trajectory.time

    @property
    def theta(self) -> Array:
        """Joints of the positions as the planned program names them, DH angles, (N, 6) [rad]."""
        return self.planned.written().theta

    def files(self) -> dict[str, bytes]:
        """Name to content of what ``cgen predict`` writes, byte for byte; nothing is written."""
        return _report_files(self.planned, None)

    def __repr__(self) -> str:
        return f"<Prediction of {self.job.name}: {len(self.time)} waypoints, {_largest(self.report, 'before')}>"


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class GeneratedProgram(_OfJob):
    """A corrected program, proven from its text: N positions, K nodes of the heat model."""

    corrected: Corrected  # the whole result, for who needs more
    error_after: Array  # (N, 3) [m] in World: what the twin did with the written text
    options: PageOptions = PLAIN  # of its page: the date that was given

    @property
    def text(self) -> bytes:
        """The program that the operator starts: all of it, or the main program of its pages."""
        return self.corrected.text

    @property
    def programs(self) -> dict[str, bytes]:
        """Name to content of every file for the controller, whatever the verdict."""
        return dict(self.corrected.delivery.files)

    @property
    def verdict(self) -> Verdict:
        """What the findings come to."""
        return self.corrected.verdict

    @property
    def inside(self) -> bool:
        """Whether there are bounds, every one is kept, and the controller can load the program."""
        return self.corrected.inside

    @property
    def time(self) -> Array:
        """When the written text is at each position, (N,) [s]."""
        return self.corrected.written.time

    @property
    def correction(self) -> Array:
        """Commanded against target, (N, 6): [m] in World, rotation vector [rad] in tool axes.

        Lines leave a curve to both sides: the half of their sag by which their ends stand off it is in here.
        """
        correction = np.array(self.corrected.solution.correction)
        correction[:, :3] += self.planned.path.balance
        return frozen(correction)

    @property
    def theta(self) -> Array:
        """Joints of the positions as they are written, DH angles, (N, 6) [rad]."""
        return self.corrected.written.theta

    @property
    def start_window(self) -> float:
        """How late the program may start [s]."""
        return self.corrected.start_window

    @property
    def averaged(self) -> Averaged | None:
        """What the file leaves over the starts of ``compensation.average_over``; None where it serves one."""
        return self.corrected.averaged

    def files(self, *, force: bool = False) -> dict[str, bytes]:
        """Name to content of what ``cgen generate`` writes, byte for byte; nothing is written.

        Args:
            force: Give the program also outside its bounds.
        """
        written = self.corrected.is_usable or force
        return {
            **(self.programs if written else {}),
            **_report_files(self.planned, self.corrected, self.options, with_program=written),
        }

    def __repr__(self) -> str:
        before, after = (_largest(self.report, side) for side in ("before", "after"))
        return f"<GeneratedProgram {self.corrected.program.name}: {before}, {after} after correction, {self.verdict}>"


refuse_changes(Prediction, *RESULT)
refuse_changes(GeneratedProgram, *RESULT)


def predict(job: Job, progress: Progress | None = None, workers: int | None = None) -> Prediction:
    """What would go wrong if the planned program ran as it is; the same as ``cgen predict``.

    Args:
        job: The planned program.
        progress: Called with the stage and the share of it that is done, 0 to 1; what it raises ends the run.
        workers: Threads; all cores unless said. The numbers are the same for any number.

    Raises:
        InputError: An argument of a wrong kind, or a job that was changed since it was read.
        ImpossibleError: The robot cannot drive the path.
        TwinError: The twin cannot drive it.
    """
    require_unchanged(instance(job, Job, "predict", JOB))
    report_progress = progress_of(progress)
    with machine(workers):
        planned = pipeline.predict(job, report_progress)
        result = Prediction(job, planned, None, job_summary(planned, None), frozen(planned.error()))
    log_result(job.name, result)
    return result


def generate(
    job: Job,
    date: str | None = None,
    *,
    pages: bool = True,
    progress: Progress | None = None,
    workers: int | None = None,
) -> GeneratedProgram:
    """The corrected program, proven from its text; the same as ``cgen generate``, and nothing is written.

    Args:
        job: The planned program.
        date: In the program's header and on the page, YY-MM-DD; None: the header has 26-01-01, the page none.
        pages: Whether a program that is more than the controller holds in one file becomes pages.
        progress: Called with the stage and the share of it that is done, 0 to 1; what it raises ends the run.
        workers: Threads; all cores unless said. The numbers are the same for any number.

    Raises:
        InputError: An argument of a wrong kind, or a job that was changed since it was read.
        ImpossibleError: The robot cannot drive the path, or no legal correction exists.
        JoinError: Pages, read back, are not the program.
        TwinError: The twin cannot drive the program.
    """
    require_unchanged(instance(job, Job, "generate", JOB))
    instance(pages, bool, "pages", "give True or False")
    given = "" if date is None else checked_date(text_of(date, "date", "give YY-MM-DD, as '26-01-31'"))
    report_progress = progress_of(progress)
    with machine(workers):
        planned, corrected = pipeline.generate(job, report_progress, given or DEFAULT_DATE, pages=pages)
        result = GeneratedProgram(
            job,
            planned,
            corrected,
            job_summary(planned, corrected),
            frozen(planned.error()),
            frozen(at_waypoints(corrected, slice(None))),
            PageOptions(f"20{given}") if given else PLAIN,
        )
    log_result(job.name, result)
    return result


def _report_files(
    planned: Planned, corrected: Corrected | None, options: PageOptions = PLAIN, *, with_program: bool = True
) -> dict[str, bytes]:
    with machine(None):
        reports = job_reports(planned, corrected, options, with_program=with_program)
        return {name: _joined(content) for name, content in reports.items()}


def _joined(content: bytes | Iterable[bytes]) -> bytes:
    return content if isinstance(content, bytes) else b"".join(content)


def _largest(report: dict[str, Any], side: str) -> str:
    return f"{report[side]['total']['max_um']:.2f} um"
