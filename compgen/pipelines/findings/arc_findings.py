"""What is not sure of how a controller drives a program's arcs."""

import numpy as np

from compgen.core.arrays import norm
from compgen.core.codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.rotations import interpolate_rotation, rotation_vector
from compgen.core.units import MDEG
from compgen.fanuc import Program
from compgen.job.job import Job

SAME_TURN = 1 * MDEG  # a digit of W, P and R


def orientation_on_arcs(job: Job, program: Program) -> list[Finding]:
    """How far the tool is turned at vias if the controller turns it evenly from start to end and ignores the via's."""
    via = np.flatnonzero(program.via)
    if not len(via):
        return []
    length, rotation = program.lengths(), program.rotation
    share = length[via - 1] / (length[via - 1] + length[via])
    even = interpolate_rotation(rotation[via - 1], rotation[via + 1], share)
    off = norm(rotation_vector(np.swapaxes(even, 1, 2) @ rotation[via]))
    if off.max() <= SAME_TURN:
        return []
    bound = job.bounds.axis
    message = (
        f"at P[{int(via[np.argmax(off)]) + 1}] the tool is {off.max() / MDEG:.1f} mdeg off if the controller ignores "
        "the orientation of an arc's via, which is not published; here it turns through it"
    )
    level = Level.WARNING if bound is not None and off.max() > bound else Level.NOTE
    return [Finding(level, Code.PATH_ARCS_ORIENTATION, message)]
