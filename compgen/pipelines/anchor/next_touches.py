"""Which targets to touch as well: those that would shrink what stays open along the path most."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array
from compgen.core.pose import Pose
from compgen.error_model.direction_memory import DirectionState
from compgen.identification.touches import Artefact
from compgen.job.job import Job
from compgen.pipelines.anchor.estimate import Estimate, PathColumns
from compgen.pipelines.anchor.forecast import Forecast
from compgen.pipelines.anchor.touching import Touched
from compgen.pipelines.anchor.unknowns import Unknowns
from compgen.robot.inverse_kinematics import solve_tool
from compgen.robot.kinematics import flange_pose


@dataclass(frozen=True, slots=True)
class NextTouch:
    """A target, the axis of World along which it tells most, and the path's rms after locating it [m]."""

    target: str
    axis: str
    rms: float


def next_touches(
    job: Job, artefact: Artefact, frame: Pose, forecast: Forecast, unknowns: Unknowns, seen: Touched,
    chosen: Estimate, columns: PathColumns, count: int = 2,
) -> list[NextTouch]:  # fmt: skip
    """The targets that tell most, the best first; in the orientation of the first touch."""
    place = frame.act(artefact.place)
    known = [t for t in range(len(place)) if np.isfinite(place[t, 0])]
    robot = job.robot
    rotation = flange_pose(robot, seen.touches.theta[:1]).rotation
    poses = Pose(place[known], np.repeat(rotation, len(known), axis=0))
    theta, margin = solve_tool(robot, poses, seen.probe, job.posture)
    rise = np.broadcast_to(forecast.rise, (len(known), len(forecast.rise)))
    still = DirectionState(np.zeros((len(known), 6)), np.zeros((len(known), 3)))
    H, _ = unknowns.columns(forecast, theta, rise, still, seen.probe)
    M, sigma = len(columns.G), float(np.median(seen.sigma))
    G, P = columns.G.reshape(3 * M, -1), chosen.covariance
    touches_ = []
    for k, t in enumerate(known):
        if margin[k] < 0:
            continue
        S = H[k] @ P @ H[k].T + (sigma**2 + seen.place_sigma[t] ** 2) * np.eye(3)
        cross = G @ P @ H[k].T
        fall = float(np.einsum("ai,ij,aj->", cross, np.linalg.inv(S), cross)) / M
        left = max(float(np.mean(chosen.after**2)) - fall, 0.0)
        each = (cross**2).sum(axis=0) / np.diag(S)
        touches_.append(NextTouch(artefact.names[t], "xyz"[int(np.argmax(each))], float(np.sqrt(left))))
    return sorted(touches_, key=lambda n: n.rms)[:count]


def moved_target(y: Array, weight: Array, along: Array, cross: float) -> tuple[Array, Array]:
    """Where a knocked target stands against the artefact's file, and how well that is known, (3,) [m] each.

    Args:
        y: Coordinates of its touches against what the rest says (n,) [m].
        weight: Inverse covariance of them, (n, n).
        along: Unit vectors (n, 3).
        cross: Standard deviation beforehand [m].
    """
    information = along.T @ weight @ along + np.eye(3) / cross**2
    covariance = np.linalg.inv(information)
    return -covariance @ along.T @ weight @ y, np.sqrt(np.diag(covariance))
