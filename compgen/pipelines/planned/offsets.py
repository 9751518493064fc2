"""One offset in place of a corrected program: the best that an operator can type in, and what it leaves of the path.

The uncorrected program is flown by the twin with every position moved as the controller would move it, beside the
same program as it is, and the corrected one.
"""

from dataclasses import replace

import numpy as np

from compgen.core import stages
from compgen.core.arrays import Array
from compgen.core.codes import Level
from compgen.core.pose import IDENTITY, Pose
from compgen.core.rotations import from_wpr
from compgen.core.stages import Progress
from compgen.core.units import DEG, MM
from compgen.fanuc.canonical.writer import pose_numbers
from compgen.job.job import Job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned import generate
from compgen.pipelines.planned.job_results import Planned
from compgen.pipelines.planned.offset_kinds import (
    FRAME,
    FULL,
    NOTHING,
    Errors,
    Left,
    Offset,
    Offsets,
    best_offsets,
    offset_findings,
)
from compgen.pipelines.planned.program_text import planned_program
from compgen.program.program import Program
from compgen.verification.deviation import Deviation, deviation_from_path
from compgen.verification.twin import prepare


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
    numbers = best_offsets(_errors_of(planned, uframe, program), uframe)
    flown = [
        Offset(kind, values, _left(_fly(planned, moved(program, uframe, kind, values)))) for kind, values in numbers
    ]
    number = 0 if job.frame is None else job.frame.number
    ways = (
        Offset(NOTHING, None, _left(planned.deviation())),
        *flown,
        Offset(FULL, None, _left(corrected.deviation)),
    )
    findings = [f for f in planned.findings if f.level is Level.WARNING]
    frame = pose_numbers(uframe.position[None], uframe.rotation[None])[0]
    return Offsets(job.name, number, frame, ways, (*findings, *offset_findings(number, ways)))


def moved(program: Program, uframe: Pose, kind: str, numbers: Array) -> Program:
    """A program with its positions where the controller drives to with an offset.

    Args:
        program: In its user frame.
        uframe: Which is there in World.
        kind: SHIFT, REGISTER or FRAME.
        numbers: That are typed in.
    """
    if kind == FRAME:
        typed = Pose(numbers[:3] * MM, from_wpr(*(numbers[3:] * DEG)[:, None])[0])
        pose = uframe.inverse() @ typed @ Pose(program.position, program.rotation)
        return replace(program, position=pose.position, rotation=pose.rotation)
    printed = pose_numbers(program.position, program.rotation, program.decimals) + numbers
    return replace(program, position=printed[:, :3] * MM, rotation=from_wpr(*(printed[:, 3:] * DEG).T))


def _errors_of(planned: Planned, uframe: Pose, program: Program) -> Errors:
    """At the waypoints on the part, or at all of a path that never touches, as the model predicts them."""
    path = planned.path
    rows = np.flatnonzero(path.contact if path.contact.any() else np.ones_like(path.contact))
    step = np.diff(path.arc, prepend=path.arc[0], append=path.arc[-1]) / 2
    error = planned.error()[rows]
    target = path.target.rotation[rows]
    axes = uframe.rotation
    return Errors(
        program.position[rows],
        program.rotation[rows],
        error[:, :3] @ axes,
        np.einsum("nij,nj->ni", target, error[:, 3:]) @ axes,
        (step[:-1] + step[1:])[rows],
    )


def _fly(planned: Planned, program: Program) -> Deviation:
    """What the twin does with a program of the planned path."""
    job = planned.job
    prepared = prepare(twin_of(job), program, job.history.before, job.history.air)
    if job.ensemble is not None:
        prepared = prepared.with_rise(planned.rise)
    return deviation_from_path(planned.path, prepared.chunks(), prepared.sample_count)


def _left(deviation: Deviation) -> Left:
    total, axis = deviation.on_part["total"], deviation.on_part["axis_angle"]
    return Left(total.rms, total.p99, total.max, axis.max)
