"""One offset for a program that exists, flown by the twin: registers add to its numbers, a user frame moves them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from compgen.core import stages
from compgen.core.arrays import Array, IntArray, rms
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.pose import Pose
from compgen.core.rotations import rotation_vector
from compgen.core.stages import Progress
from compgen.job.job import Cell
from compgen.pipelines.correct.correct import correct
from compgen.pipelines.correct.result import Correction, Options
from compgen.pipelines.files.twin_of_job import twin_of_cell
from compgen.pipelines.planned.offsets import FRAME, FlownErrors, Left, Offsets, search_offsets
from compgen.program.driven import NONE
from compgen.program.frames import Frames
from compgen.program.pose_table import pose_of
from compgen.program.registers import Register
from compgen.program.ways import interpolate_poses
from compgen.thermal import Duty
from compgen.verification.deviation import percentile99
from compgen.verification.flight import PoseErrors, fly, pose_errors


def offsets_of_program(  # noqa: PLR0913  as ``correct``
    data: bytes,
    cell: Cell,
    frames: Frames,
    before: Sequence[Duty],
    progress: Progress,
    find_program: Callable[[str], bytes | None] = lambda name: None,
    registers: Mapping[int, Register] | None = None,
    air: float = 0.0,
) -> Offsets:
    """The best offsets for a program that exists; arguments as ``correct`` has them.

    Raises:
        InputError: What ``correct`` refuses, a corrected program among it; no position, or positions in several frames.
        TwinError: The twin cannot drive the program, as it is or moved.
    """
    full = correct(data, cell, frames, before, Options(air=air), progress, find_program, registers=registers)
    progress(stages.OFFSETS, 0.0)
    target = interpolate_poses(full.plan.drive, full.execution.station, full.execution.fraction)
    flown = _flown_errors(full, target)

    def fly_anew(kind: str, numbers: Array) -> Left:
        return _left(full, _fly(full, target, flown.uframe, kind, numbers))

    findings = [*(f for f in full.findings if f.level is Level.WARNING), *_not_shifted(full)]
    return search_offsets(flown, _left(full, full.error), _left(full, full.residual), fly_anew, findings)


def _flown_errors(full: Correction, target: Pose) -> FlownErrors:
    """What the twin misses of the program as it is, in the user frame of its positions."""
    actual = fly(twin_of_cell(full.cell), full.plan.drive, full.before, air=full.options.air).actual
    judged = np.flatnonzero(full.judged & (full.length > 0))
    number, uframe = _frame_of(full, judged)
    return FlownErrors(
        name=full.name,
        uframe=number,
        frame=uframe,
        place=uframe.inverse() @ target[judged],
        error=(actual.position - target.position)[judged],
        turn=rotation_vector(actual.rotation[judged] @ np.swapaxes(target.rotation[judged], 1, 2)),
        weight=full.length[judged],
    )


def _frame_of(full: Correction, judged: IntArray) -> tuple[int, Pose]:
    """Number and place of the one user frame that all judged positions are in."""
    poses, program = full.plan.poses, full.plan.program
    if not len(judged):
        raise InputError(f"program {program.name}: no position that could be corrected: no offset does any good")
    rows = np.unique(full.plan.drive.pose[full.execution.station[judged]])
    rows = rows[~poses.joint_form[rows]]
    if not len(rows):
        raise InputError(f"program {program.name}: its positions are in joint form, which no offset of X Y Z moves")
    numbers = np.unique(program.positions.uframe[poses.row[rows]]).tolist()
    bases = np.unique(poses.base[rows])
    if len(bases) > 1 or bases[0] == NONE:
        raise InputError(
            f"program {program.name}: positions in user frames {', '.join(map(str, numbers))}: one offset is of one "
            "frame; part the program"
        )
    return int(numbers[0]), poses.bases[int(bases[0])]


def _fly(full: Correction, target: Pose, number: int, kind: str, numbers: Array) -> PoseErrors:
    """The errors of the program with an offset, at the samples of its proof."""
    program, around, cell = full.plan.program, full.around, full.cell
    if kind == FRAME:
        table = replace(around.frames, uframe={**around.frames.uframe, number: pose_of(numbers.tolist())})
        around = replace(around, frames=table)
    else:
        value = np.array(program.positions.value)
        value[:, :6] += numbers
        program = replace(program, positions=replace(program.positions, value=value))
    _, drive = around.drive(program, cell.robot)
    drive = replace(drive, beyond=full.plan.drive.beyond)
    execution = fly(twin_of_cell(cell), drive, full.before, air=full.options.air)
    return pose_errors(execution, target)


def _left(full: Correction, errors: PoseErrors) -> Left:
    judged = full.judged & (full.length > 0)
    size, length = errors.distance[judged], full.length[judged]
    return Left(float(size.max()), percentile99(size, length), rms(size, length), float(errors.angle[judged].max()))


def _not_shifted(full: Correction) -> Iterator[Finding]:
    """What an offset does not move, or moves already."""
    poses = full.plan.poses
    if joints := int(poses.joint_form.sum()):
        yield Finding.of(
            Code.OFFSETS_JOINT_FORM, f"{joints} positions in joint form: no offset and no user frame moves them"
        )
    if poses.placements.of_motion:
        message = "some motions have an Offset or a frame of their own already: add the register's numbers to theirs"
        yield Finding.of(Code.OFFSETS_DOUBLED, message)
