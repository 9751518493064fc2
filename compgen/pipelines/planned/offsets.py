"""One offset in place of a corrected program: the best that an operator can type in, and what it leaves of the path.

The uncorrected program is flown by the twin with every position moved as the controller would move it, beside the
same program as it is, and the corrected one. Of a program that exists ``pipelines.correct.program_offsets`` flies it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compgen.compensation.rigid_offset import best_frame, register_shift, register_turn
from compgen.core import stages
from compgen.core.arrays import Array
from compgen.core.commands import Command
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.pose import IDENTITY, POSE_KEYS, Pose
from compgen.core.rotations import from_wpr
from compgen.core.stages import Progress
from compgen.core.units import DEG, MDEG, MM, UM
from compgen.job.job import Job
from compgen.pipelines.files.twin_of_job import deviation_of, prepared_for
from compgen.pipelines.planned import generate
from compgen.pipelines.planned.job_results import Planned
from compgen.pipelines.planned.program_text import planned_program
from compgen.program.digits import pose_numbers
from compgen.program.pose_table import pose_of
from compgen.program.program import Program
from compgen.verification.deviation import Deviation, Sizes

NOTHING = "nothing"
SHIFT = "PR offset X Y Z"
REGISTER = "PR offset X Y Z W P R"
FRAME = "user frame"
FULL = "full correction"
USELESS = 0.95  # of what nothing leaves


@dataclass(frozen=True, slots=True)
class Left(Sizes):
    """What is left of a path on the part [m]."""

    turn: float  # [rad] largest tilt of the tool's axis


@dataclass(frozen=True, eq=False, slots=True)
class Offset:
    """What an operator types in, and what it leaves."""

    kind: str
    numbers: Array | None  # X Y Z [mm], W P R [deg]; None: nothing is typed
    left: Left

    def record(self) -> dict[str, Any]:
        """The way in plain types."""
        return {
            "kind": self.kind,
            "type_in": None if self.numbers is None else dict(zip(POSE_KEYS, self.numbers.tolist(), strict=True)),
            "leaves": {
                "rms_um": self.left.rms / UM,
                "p99_um": self.left.p99 / UM,
                "max_um": self.left.max / UM,
                "turn_mdeg": self.left.turn / MDEG,
            },
        }


@dataclass(frozen=True, eq=False, slots=True)
class Offsets:
    """All ways of doing with a program what a state asks for."""

    name: str
    uframe: int  # of the program's positions
    frame: Array  # X Y Z [mm], W P R [deg] of it as it is
    ways: tuple[Offset, ...]  # nothing, the three offsets, the correction
    findings: tuple[Finding, ...]

    def record(self) -> dict[str, Any]:
        """Everything that ``cgen offsets`` says, in plain types."""
        return {
            "command": Command.OFFSETS,
            "name": self.name,
            "uframe": self.uframe,
            "uframe_is": dict(zip(POSE_KEYS, self.frame.tolist(), strict=True)),
            "ways": [way.record() for way in self.ways],
            "findings": [f.record() for f in self.findings],
        }


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class FlownErrors:
    """A program whose positions are in one user frame, and how M of its points err."""

    name: str
    uframe: int
    frame: Pose  # of that number, in World
    place: Pose  # M, programmed in it
    error: Array  # (M, 3) [m] actual less target, World
    turn: Array  # (M, 3) [rad] rotation vector, World
    weight: Array  # (M,) length on the part that each stands for


def search_offsets(
    flown: FlownErrors, nothing: Left, full: Left, fly: Callable[[str, Array], Left], findings: Sequence[Finding]
) -> Offsets:
    """The best numbers of each kind, and what each leaves.

    Args:
        flown: The program as it errs.
        nothing: What is left without an offset.
        full: What the corrected program leaves.
        fly: What is left with numbers of a kind typed in.
        findings: What is known of the program already.
    """
    place, weight, axes = flown.place, flown.weight, flown.frame.rotation
    error, turn = flown.error @ axes, flown.turn @ axes
    shift = register_shift(error, weight)
    both = np.append(shift, register_turn(turn, place.rotation, weight))
    frame = best_frame(flown.frame, place.position, error, weight)
    typed = {SHIFT: np.append(shift, np.zeros(3)), REGISTER: both, FRAME: frame}
    offsets = [Offset(kind, numbers, fly(kind, numbers)) for kind, numbers in typed.items()]
    ways = (Offset(NOTHING, None, nothing), *offsets, Offset(FULL, None, full))
    now = pose_numbers(flown.frame.position[None], flown.frame.rotation[None])[0]
    return Offsets(flown.name, flown.uframe, now, ways, (*findings, *_offset_findings(flown.uframe, ways)))


def _offset_findings(uframe: int, ways: tuple[Offset, ...]) -> Iterator[Finding]:
    """What an operator must know before typing in."""
    if uframe == 0:
        yield Finding.of(
            Code.OFFSETS_WORLD,
            "the positions are in World (UFRAME 0), which takes no numbers: for the user frame teach them in a frame "
            "of their own, or use the position register",
        )
    useless = [way.kind for way in ways[1:-1] if way.left.rms > USELESS * ways[0].left.rms]
    if useless:
        yield Finding.of(
            Code.OFFSETS_USELESS, f"{', '.join(useless)}: leaves no less than nothing does: what errs is not one shift"
        )


def offsets_of_job(job: Job, progress: Progress) -> Offsets:
    """The best offsets for a planned program.

    Args:
        job: With its state, or its history.
        progress: Called with the stage and the share done.

    Raises:
        ImpossibleError: The robot cannot drive the path, or no legal correction exists.
        TwinError: The twin cannot drive the program, as it is or moved.
    """
    planned, corrected = generate.generate(job, progress)
    uframe = IDENTITY if job.frame is None else job.frame.register
    program = planned_program(job, planned.path, planned.theta, planned.trajectory)
    progress(stages.OFFSETS, 0.0)

    def fly(kind: str, numbers: Array) -> Left:
        prepared = prepared_for(job, with_offset(program, uframe, kind, numbers))
        if job.ensemble is not None:
            prepared = prepared.with_rise(planned.rise)
        return _left(deviation_of(planned.path, prepared))

    findings = [f for f in planned.findings if f.level is Level.WARNING]
    flown = _flown_errors(planned, uframe, program)
    return search_offsets(flown, _left(planned.deviation()), _left(corrected.deviation), fly, findings)


def with_offset(program: Program, uframe: Pose, kind: str, numbers: Array) -> Program:
    """A program with its positions where the controller drives to with an offset.

    Args:
        program: In its user frame.
        uframe: Which is there in World.
        kind: SHIFT, REGISTER or FRAME.
        numbers: That are typed in.
    """
    if kind == FRAME:
        pose = uframe.inverse() @ pose_of(numbers.tolist()) @ Pose(program.position, program.rotation)
        return replace(program, position=pose.position, rotation=pose.rotation)
    printed = pose_numbers(program.position, program.rotation, program.decimals) + numbers
    return replace(program, position=printed[:, :3] * MM, rotation=from_wpr(*(printed[:, 3:] * DEG).T))


def _flown_errors(planned: Planned, uframe: Pose, program: Program) -> FlownErrors:
    """At the waypoints on the part, or at all of a path that never touches, as the model predicts them."""
    job, path = planned.job, planned.path
    rows = path.rows_on_part()
    step = np.diff(path.arc, prepend=path.arc[0], append=path.arc[-1]) / 2
    error = planned.error()[rows]
    return FlownErrors(
        name=job.name,
        uframe=0 if job.frame is None else job.frame.number,
        frame=uframe,
        place=Pose(program.position[rows], program.rotation[rows]),
        error=error[:, :3],
        turn=np.einsum("nij,nj->ni", path.target.rotation[rows], error[:, 3:]),
        weight=(step[:-1] + step[1:])[rows],
    )


def _left(deviation: Deviation) -> Left:
    total, axis = deviation.on_part["total"], deviation.on_part["axis_angle"]
    return Left(total.max, total.p99, total.rms, axis.max)
