"""How a log of a run is judged: the program's text with what lies beside it, the log followed along it, the verdict."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path

from compgen.core.exceptions import naming_file
from compgen.core.files import PROVENANCE
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.json_text import read_record
from compgen.identification.motion.stray_corner import stray_corner
from compgen.identification.motion.timed_windows import FittedWindows
from compgen.pipelines.correct.program_file import planned_in
from compgen.pipelines.files.program_course import course_of_text, listing_of
from compgen.program.frames import Frames
from compgen.program.registers import Register
from compgen.robot.robot import Robot
from compgen.verification.executed.course import ProgramCourse
from compgen.verification.executed.followed_log import follow_log
from compgen.verification.executed.judgement import ExecutedRun, findings_of_run, measure
from compgen.verification.executed.path_deviation import Likeness, likeness
from compgen.verification.executed.position_log import PositionLog

#: that say already that another program was run, or this one elsewhere
IDENTITY = {Code.EXECUTED_ANOTHER, Code.EXECUTED_OTHER, Code.EXECUTED_OLDER, Code.EXECUTED_OFFSET}
INPUTS = "inputs "  # how the remark begins that names what a program was made from


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgramText:
    """A program as it was given, and what lies beside it."""

    file: str
    content: bytes
    name: str
    sha256: str
    inputs: str | None  # hash of what it was made from, as its remark has it
    planned: bytes | None  # the program before its correction, where its provenance is beside it
    findings: tuple[Finding, ...]


def read_program_text(file: str, content: bytes) -> ProgramText:
    """A program with the records beside it: a provenance file, a report of the job that wrote it.

    Raises:
        InputError: Not a program.
    """
    program = listing_of(content, file)
    checksum = sha256(content).hexdigest()
    inputs = next((r.removeprefix(INPUTS).strip() for r in program.remarks if r.startswith(INPUTS)), None)
    folder, findings, planned = Path(file).parent, list[Finding](), None
    for record_file in sorted(folder.glob(f"*{PROVENANCE}")):
        record = read_record(record_file)
        if record.get("corrected_sha256") == checksum:
            planned = planned_in(record)
        elif record.get("program") == program.name and record.get("planned_sha256") != checksum:
            message = (
                f"{record_file.name} beside it is of another text of {program.name}: an older correction, or the "
                "program was edited since; give the one that the record was written with"
            )
            findings.append(Finding.of(Code.EXECUTED_RECORD, message))
    made_from = read_record(folder / "report.json").get("provenance")
    report_inputs = made_from.get("inputs_sha256") if isinstance(made_from, dict) else None
    if inputs and isinstance(report_inputs, str) and not report_inputs.startswith(inputs):
        message = (
            f"report.json beside it is of inputs {report_inputs[:12]}, the program's remark says {inputs[:12]}: it is "
            "an older program, or another one's report"
        )
        findings.append(Finding.of(Code.EXECUTED_RECORD, message))
    return ProgramText(
        file=file,
        content=content,
        name=program.name,
        sha256=checksum,
        inputs=inputs,
        planned=planned,
        findings=tuple(findings),
    )


@dataclass(frozen=True, slots=True)
class Situation:
    """What a program relies on and does not say."""

    robot: Robot
    frames: Frames
    registers: dict[int, Register]
    find_program: Callable[[str], bytes | None]  # beside the program of which the log is
    world: bool = False  # whether Cartesian positions of logs are in World

    def course(self, content: bytes) -> ProgramCourse:
        """The course of a program's text."""
        return course_of_text(content, self.robot, self.frames, self.registers, self.find_program)


def judge_log(
    text: ProgramText,
    course: ProgramCourse,
    log: PositionLog,
    situation: Situation,
    also: Sequence[tuple[str, ProgramCourse]] = (),
    bound: float | None = None,
) -> ExecutedRun:
    """Judge a log against a program's text.

    Args:
        text: The program.
        course: Of that text (``Situation.course``).
        log: Of the run.
        situation: Robot, frames, and what the program calls.
        also: Names and courses of other programs that may have been run instead, each with what lies beside it.
        bound: Largest deviation allowed [m].

    Raises:
        InputError: Not a program, or a log that is not of it.
    """
    return judge_and_fit(text, course, log, situation, also, bound)[0]


def judge_and_fit(
    text: ProgramText,
    course: ProgramCourse,
    log: PositionLog,
    situation: Situation,
    also: Sequence[tuple[str, ProgramCourse]] = (),
    bound: float | None = None,
) -> tuple[ExecutedRun, FittedWindows | None]:
    """``judge_log``, with the windows of the log as far as the judgement fitted them: no need to fit them twice."""
    if log.is_joints or situation.world:
        course = replace(course, several_frames=False)  # such a log is in no user frame
    followed = follow_log(log, course, situation.robot, world=situation.world)
    deviation, clock = measure(course, followed)
    others = list(also)
    if text.planned is not None:
        with naming_file(planned := "the planned program"):
            others.append((planned, situation.course(text.planned)))
    likenesses, findings = list[Likeness](), list[Finding]()
    for name, other in others:
        like = likeness(course, deviation, followed, name, other)
        if like is not None:
            likenesses.append(like)
            continue
        findings.append(Finding.of(Code.EXECUTED_UNLIKE, f"{name} is another path; the robot did not follow it"))
    findings += [*findings_of_run(course, followed, deviation, clock, likenesses, bound), *text.findings]
    run = ExecutedRun(
        course=course,
        followed=followed,
        deviation=deviation,
        clock=clock,
        likeness=tuple(likenesses),
        findings=(),
    )
    stray, fitted = None, None
    if IDENTITY.isdisjoint(f.code for f in findings):
        stray, fitted = stray_corner(run, situation.robot)
    findings += [stray] if stray is not None else []
    order = list(Level)
    return replace(run, findings=tuple(sorted(findings, key=lambda f: order.index(f.level)))), fitted
