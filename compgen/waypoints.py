r"""How close waypoints must be, so that straight lines between them carry the correction.

Between two waypoints the program is a line and so is what corrects it; an error that bends away from a line in between
stays. What it bends by falls with the square of the segment's length. A measured map, a harmonic or the blend after a
reversal asks for more waypoints than the path's own chord does; thermal growth never.
"""

import numpy as np

from compgen import ik, toolpath
from compgen.arrays import Array, norm
from compgen.job import Job
from compgen.predict import ErrorModel
from compgen.sources import STILL, ThermalGrowth, memory_of, motion_of
from compgen.toolpath import ToolPath

SAMPLES, ROUNDS = 4, 4  # places in a segment where its error is looked at, rounds of cutting
STRETCH = 4096  # segments at a time
CURVED = 0.3  # of the chord: how far the error may bend away from a line within a segment


def followed(job: Job, model: ErrorModel, path: ToolPath, feed: float, rise: Array) -> tuple[ToolPath, Array]:
    """The path with waypoints close enough for its errors, and its joints (N, 6) [rad].

    A segment is cut until its error bends away from a line by less than a share of the chord, or until it takes the
    controller's interpolation period.

    Args:
        job: The job.
        model: Its error model.
        path: As the chord asks for.
        feed: [m/s].
        rise: At the program's start, (K,) [K].

    Raises:
        ImpossibleError: The robot cannot drive the path.
    """
    theta = ik.follow(job.robot, *_flange(job, path.position, path.rotation), job.posture)
    if all(isinstance(source, ThermalGrowth) for source in job.sources):
        return path, theta
    for _ in range(ROUNDS):
        room = np.diff(path.arc) / (feed * job.robot.controller.period)
        wanted = np.sqrt(_bend(job, model, path, theta, rise) / (CURVED * job.chord))
        parts = np.ceil(np.minimum(wanted, np.maximum(np.floor(room), 1))).astype(np.int64)
        if not (parts > 1).any():
            break
        path = toolpath.refined(path, np.maximum(parts, 1))
        theta = ik.follow(job.robot, *_flange(job, path.position, path.rotation), job.posture)
    return path, theta


def _bend(job: Job, model: ErrorModel, path: ToolPath, theta: Array, rise: Array) -> Array:
    """How far each segment's error bends away from the line between its ends, (N - 1,) [m]."""
    S = len(path.arc) - 1
    memory, motion, found = memory_of(job.sources), STILL, np.empty(S)
    inner = np.arange(SAMPLES) / SAMPLES
    for at in range(0, S, STRETCH):
        some = np.arange(at, min(at + STRETCH, S))
        segment, fraction = np.append(np.repeat(some, SAMPLES), some[-1]), np.append(np.tile(inner, len(some)), 1.0)
        position, rotation, _ = path.at(segment, fraction)
        between = theta[segment] + fraction[:, None] * (theta[segment + 1] - theta[segment])
        joints = ik.nearest_turns(ik.solve(job.robot, *_flange(job, position, rotation), job.posture)[0], between)
        motion = motion_of(memory, joints, position, motion)
        error = model.actual_pose(joints, rise[None], motion)[0] - position
        ends = error[::SAMPLES]
        line = ends[:-1, None] + inner[:, None] * np.diff(ends, axis=0)[:, None]
        found[some] = norm(error[:-1].reshape(-1, SAMPLES, 3) - line).max(axis=1)
    return found


def _flange(job: Job, position: Array, rotation: Array) -> tuple[Array, Array]:
    return ik.flange_of(position, rotation, job.tool_position, job.tool_rotation)
