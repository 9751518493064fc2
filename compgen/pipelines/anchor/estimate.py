r"""The most likely state by one hypothesis, and what it leaves open along the path.

    x = C y,   C = P H^T V^-1,      cov(x) = P - C H P

What else touches tell of this path (identified parameters, what the thermal physics leaves out) no number of x can
say; on a part it is nearly one shift and one turn, so the base carries it: b = B^+ E[rest | y], B what the base does
along the path. With L y all that the state then corrects, G x + rest what is really there,

    cov = cov(G x + rest) - 2 cov(G x + rest, y) L^T + L V L^T

Columns fade along the path with the lag of each node. Source: linear minimum-variance estimation (Kay 1993, chapter
12).

The path is taken as places evenly along the part. Where much stays open on it, those targets are named that would
shrink that most.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import naming_file
from compgen.core.pose import Pose
from compgen.error_model.direction_memory import NO_DIRECTION, DirectionState
from compgen.error_model.model import build_error_model
from compgen.identification.touches import Artefact
from compgen.job.job import Job
from compgen.job.motion_plan import COARSE
from compgen.pipelines.anchor.forecast import Forecast
from compgen.pipelines.anchor.hypotheses import Hypothesis, Innovation, Prior
from compgen.pipelines.anchor.touching import Touched, missing_of, smooth
from compgen.pipelines.anchor.unknowns import Unknowns
from compgen.planning import toolpath
from compgen.planning.exact_path import MAX_SPACING
from compgen.robot import inverse_kinematics, joint_path
from compgen.robot.inverse_kinematics import solve_tool
from compgen.robot.kinematics import flange_pose

PLACES = 200


@dataclass(frozen=True, eq=False, slots=True)
class PathPlaces:
    """M places along the part, evenly."""

    position: Array  # (M, 3) [m] World
    theta: Array  # (M, 6) [rad]
    time: Array  # (M,) [s] from the program's start, at its feed

    @property
    def middle(self) -> Array:
        """Of the part, (3,) [m]."""
        return np.asarray((self.position.min(axis=0) + self.position.max(axis=0)) / 2)

    @property
    def radius(self) -> float:
        """Farthest place from the middle [m]."""
        return float(np.linalg.norm(self.position - self.middle, axis=1).max())


def path_places(job: Job, count: int = PLACES) -> PathPlaces:
    """Places along a job's part.

    Raises:
        ImpossibleError: The robot cannot drive the path.
    """
    plan, tool = job.plan.path, job.tool
    with naming_file(job.source):
        path = toolpath.plan_tool_path(
            plan.pattern,
            plan.surface,
            plan.boundary,
            spin=tool.spin,
            chord=COARSE,
            lift=0.0,
            spacing=MAX_SPACING,
            frame=plan.place,
        )
        flange = inverse_kinematics.flange_from_tool(path.target, tool.pose)
        theta = joint_path.follow_branch(job.robot, flange, job.posture)
    on = np.flatnonzero(path.contact if path.contact.any() else np.ones_like(path.contact))
    along = np.cumsum(np.diff(path.arc, prepend=path.arc[0])[on])
    some = on[np.unique(np.searchsorted(along, np.linspace(0.0, along[-1], count)).clip(max=len(on) - 1))]
    return PathPlaces(path.target.position[some], theta[some], path.arc[some] / job.feed)


@dataclass(frozen=True, eq=False, slots=True)
class PathColumns:
    """What each unknown does to M places of a path."""

    G: Array  # (M, 3, X)
    N: Array  # (M, 3, Q)
    missed: Array  # (M,) [m] what the thermal physics leaves out
    field: Array  # (M, R) [m^2] covariance of that with what it leaves out of each coordinate, along it
    carried: Array  # (6, 3 M) the base that carries a displacement of the path


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Estimate:
    """A state, as differences from the forecast."""

    hypothesis: Hypothesis
    x: Array  # (X,)
    gain: Array  # (X, R) of the coordinates used: x = gain y
    covariance: Array  # (X, X)
    V: Array  # (R, R) of the coordinates used
    before: Array  # (M,) [m] standard deviation of the path's place without it, all directions together
    after: Array  # (M,) [m] with it
    correction: Array  # (M, 3) [m] by which it moves the predicted path


def path_columns(
    job: Job, forecast: Forecast, unknowns: Unknowns, seen: Touched, innovation: Innovation, path: PathPlaces
) -> PathColumns:
    """Columns along a path that begins when the state holds."""
    cell = forecast.cell
    M, K = len(path.theta), len(cell.heat.names)
    rise = np.broadcast_to(forecast.rise, (M, K))
    motion = DirectionState(np.zeros((M, 6)), np.zeros((M, 3)))
    G, N = unknowns.columns(forecast, path.theta, rise, motion, job.tool.pose)
    G = G.copy()
    G[:, :, :K] *= np.exp(-path.time[:, None, None] / cell.warmth.lag)
    model = build_error_model(cell.robot, cell.sources, K, job.tool.pose)
    warm, cold = (model.actual_pose(path.theta, r, NO_DIRECTION).position for r in (rise, 0 * rise))
    kappa = missing_of(forecast)
    missed = kappa * np.linalg.norm(warm - cold, axis=1)
    alike = smooth(path.position, seen.actual)[:, innovation.touch]
    field = alike * np.outer(missed, kappa * seen.thermal[innovation.touch])
    base = G[:, :, K : K + 6].reshape(3 * M, 6)
    return PathColumns(G, N, missed, field, np.asarray(np.linalg.pinv(base, rcond=1e-6)))


def estimate(innovation: Innovation, prior: Prior, h: Hypothesis, columns: PathColumns, nodes: int) -> Estimate:
    """The most likely state if a hypothesis holds."""
    keep = innovation.used(h)
    if len(keep) < len(innovation.y):
        innovation = innovation.rows(keep)
        columns = PathColumns(columns.G, columns.N, columns.missed, columns.field[:, keep], columns.carried)
    P, V = prior.of(h), innovation.covariance(prior, h)
    K = np.linalg.inv(V)
    C = P @ innovation.H.T @ K
    M = len(columns.G)
    G, N = columns.G.reshape(3 * M, -1), columns.N.reshape(3 * M, -1)
    e = innovation.along
    rest = N @ innovation.N.T + (columns.field[:, None, :] * e.T[None]).reshape(3 * M, -1)  # with y
    T = C.copy()
    T[nodes : nodes + 6] += columns.carried @ rest @ K
    L = G @ T
    with_y = G @ P @ innovation.H.T + rest
    before = (np.einsum("ax,xy,ay->a", G, P, G) + (N**2).sum(axis=1)).reshape(M, 3).sum(axis=1) + 3 * columns.missed**2
    change = (-2 * (with_y * L).sum(axis=1) + ((L @ V) * L).sum(axis=1)).reshape(M, 3).sum(axis=1)
    covariance = P - C @ innovation.H @ P
    return Estimate(
        hypothesis=h,
        x=T @ innovation.y,
        gain=T,
        covariance=(covariance + covariance.T) / 2,
        V=V,
        before=np.sqrt(np.maximum(before, 0.0)),
        after=np.sqrt(np.maximum(before + change, 0.0)),
        correction=(L @ innovation.y).reshape(M, 3),
    )


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
