r"""The most likely state by one hypothesis, and what it leaves open along the path.

    x = C y,   C = P H^T V^-1,      cov(x) = P - C H P

What else touches tell of this path (identified parameters, what the thermal physics leaves out) no number of x can
say; on a part it is nearly one shift and one turn, so the base carries it: b = B^+ E[rest | y], B what the base does
along the path. With L y all that the state then corrects, G x + rest what is really there,

    cov = cov(G x + rest) - 2 cov(G x + rest, y) L^T + L V L^T

Where the touches lie farther off than V allows, all of it is as much too small: every covariance counts

    max(1, y^T V^-1 y / R)                                           Birge (1932)

Columns fade along the path with the lag of each node. Source: linear minimum-variance estimation (Kay 1993, chapter
12).

The path is taken as places evenly along the part. Where much stays open on it, those targets are named that would
shrink that most.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, rms
from compgen.core.exceptions import naming_file
from compgen.core.pose import Pose
from compgen.error_model.rigid_share import rigid_share
from compgen.identification.touches import Artefact, Touches
from compgen.job.job import Job
from compgen.job.motion_plan import COARSE
from compgen.pipelines.anchor.forecast import Forecast, forecast_now
from compgen.pipelines.anchor.hypotheses import Hypothesis, Innovation, TouchPrior
from compgen.pipelines.anchor.touching import Touched, innovation_of, thermal_shift, touched
from compgen.pipelines.anchor.unknowns import Unknowns, unknowns_of, with_open_world
from compgen.planning import toolpath
from compgen.robot import inverse_kinematics, joint_path
from compgen.robot.inverse_kinematics import solve_tool
from compgen.robot.kinematics import flange_pose
from compgen.verification.band import field_correlation

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
        path = toolpath.plan_tool_path(plan.exact(tool.spin), toolpath.LayoutSettings(COARSE))
        flange = inverse_kinematics.flange_from_tool(path.target, tool.pose)
        theta = joint_path.follow_branch(job.robot, flange, job.posture)
    on = path.rows_on_part()
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

    x: Array  # (X,)
    gain: Array  # (X, R) of the coordinates used: x = gain y
    covariance: Array  # (X, X)
    V: Array  # (R, R) of the coordinates used
    before: Array  # (M,) [m] standard deviation of the path's place without it, all directions together
    after: Array  # (M,) [m] with it
    correction: Array  # (M, 3) [m] by which it moves the predicted path


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Compared:
    """Touches of a job's robot beside its forecast, and what they and the path may tell."""

    job: Job
    forecast: Forecast
    path: PathPlaces
    seen: Touched
    unknowns: Unknowns
    innovation: Innovation
    columns: PathColumns

    @property
    def prior(self) -> TouchPrior:
        """Of the unknowns."""
        return self.unknowns.prior

    @property
    def nodes(self) -> int:
        """How many rises, K: the first of the unknowns."""
        return len(self.forecast.rise)


def compare(job: Job, artefact: Artefact, touches: Touches, frame: Pose, path: PathPlaces) -> Compared:
    """Touches against the forecast of a job's robot.

    Args:
        job: Its history or its log.
        artefact: What was touched.
        touches: On the clock of the log, else from the first duty of [[before]] on.
        frame: Place in World of the frame that the artefact's places are in.
        path: M places, from where the state holds on.

    Raises:
        InputError: Touches of another hour, or that are not of their targets.
    """
    forecast = forecast_now(job, touches)
    seen = touched(artefact, touches, frame, forecast)
    unknowns = unknowns_of(job, forecast, path.middle, path.radius, forecast.cell.missing * rms(seen.thermal))
    innovation = innovation_of(seen, forecast, unknowns)
    columns = _path_columns(job, forecast, unknowns, seen, innovation, path)
    if seen.taught is None and job.cell.posterior is not None:
        unknowns = with_open_world(unknowns, columns.N, path.position)
    return Compared(
        job=job,
        forecast=forecast,
        path=path,
        seen=seen,
        unknowns=unknowns,
        innovation=innovation,
        columns=columns,
    )


@dataclass(frozen=True, eq=False, slots=True)
class TaughtPlaces:
    """Where the robot itself taught targets, and how warm it was."""

    theta: Array  # (N, 6) [rad]
    probe: Pose
    rise: Array  # (K,) [K]


def path_columns(
    job: Job, forecast: Forecast, unknowns: Unknowns, path: PathPlaces, taught: TaughtPlaces | None
) -> tuple[Array, Array]:
    """G (M, 3, X) and N (M, 3, Q) along a path, on which rises fade with the lag of each node.

    Where the robot taught the targets, the path is in a frame that it taught so too: N is less the rigid motion that
    fits what it was at the targets then.
    """
    G, N, _ = unknowns.columns(forecast, path.theta, job.tool.pose)
    G, K = G.copy(), len(forecast.rise)
    G[:, :, :K] *= np.exp(-path.time[:, None, None] / forecast.cell.warmth.lag)
    if taught is not None:
        rise = np.broadcast_to(taught.rise, (len(taught.theta), K))
        then = unknowns.columns(forecast, taught.theta, taught.probe, rise, then=True)[1]
        share = rigid_share((flange_pose(job.robot, taught.theta) @ taught.probe).position)
        N = share.left(N, share.motion(then), path.position)
    return G, N


def _path_columns(
    job: Job, forecast: Forecast, unknowns: Unknowns, seen: Touched, innovation: Innovation, path: PathPlaces
) -> PathColumns:
    taught = None if seen.taught is None else TaughtPlaces(seen.touches.theta, seen.probe, seen.taught)
    G, N = path_columns(job, forecast, unknowns, path, taught)
    kappa, K, noise = forecast.cell.missing, len(forecast.rise), forecast.cell.fit.noise
    warm = kappa * thermal_shift(forecast, path.theta, job.tool.pose)[1]
    alike = field_correlation(path.position, seen.actual)[:, innovation.touch]
    shared = noise**2 if seen.taught is None else 0.0
    field = alike * (np.outer(warm, kappa * seen.thermal[innovation.touch]) + shared)
    base = G[:, :, K : K + 6].reshape(3 * len(G), 6)
    return PathColumns(G, N, np.hypot(warm, noise), field, np.asarray(np.linalg.pinv(base, rcond=1e-6)))


def estimate(beside: Compared, h: Hypothesis) -> Estimate:
    """The most likely state if a hypothesis holds."""
    innovation, columns, nodes = beside.innovation, beside.columns, beside.nodes
    keep = innovation.used(h)
    if len(keep) < len(innovation.y):
        innovation = innovation.rows(keep)
        columns = PathColumns(columns.G, columns.N, columns.missed, columns.field[:, keep], columns.carried)
    P, V = beside.prior.of(h), innovation.covariance(beside.prior, h)
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
        x=T @ innovation.y,
        gain=T,
        covariance=(covariance + covariance.T) / 2,
        V=V,
        before=np.sqrt(np.maximum(before, 0.0)),
        after=np.sqrt(np.maximum(before + change, 0.0)),
        correction=(L @ innovation.y).reshape(M, 3),
    )


def birge_ratio(chi2: float, coordinates: int) -> float:
    """By how much all covariances are too small where touches lie farther off than these allow."""
    return max(chi2 / coordinates, 1.0)


def widened(chosen: Estimate, y: Array) -> Estimate:
    """An estimate as open as the touches' coordinates (R,) [m] that it used say that it is."""
    larger = birge_ratio(float(y @ np.linalg.solve(chosen.V, y)), len(y))
    wider = np.sqrt(larger)
    return replace(
        chosen, covariance=larger * chosen.covariance, before=wider * chosen.before, after=wider * chosen.after
    )


@dataclass(frozen=True, slots=True)
class NextTouch:
    """A target, the axis of World along which it tells most, and the path's rms after locating it [m]."""

    target: str
    axis: str
    rms: float


def next_touches(beside: Compared, artefact: Artefact, frame: Pose, chosen: Estimate) -> list[NextTouch]:
    """The two targets that tell most, the best first; in the orientation of the first touch."""
    job, seen, columns = beside.job, beside.seen, beside.columns
    place = frame.act(artefact.place)
    known = np.flatnonzero(np.isfinite(place[:, 0]))
    rotation = flange_pose(job.robot, seen.touches.theta[:1]).rotation
    theta, margin = solve_tool(
        job.robot, Pose(place[known], np.repeat(rotation, len(known), axis=0)), seen.probe, job.posture
    )
    H, _, _ = beside.unknowns.columns(beside.forecast, theta, seen.probe)
    M, sigma = len(columns.G), float(np.median(seen.sigma))
    G, P = columns.G.reshape(3 * M, -1), chosen.covariance
    ranked = []
    for k, t in enumerate(known.tolist()):
        if margin[k] < 0:
            continue
        S = H[k] @ P @ H[k].T + (sigma**2 + seen.place_sigma[t] ** 2) * np.eye(3)
        cross = G @ P @ H[k].T
        fall = float(np.einsum("ai,ij,aj->", cross, np.linalg.inv(S), cross)) / M
        left = max(float(np.mean(chosen.after**2)) - fall, 0.0)
        each = (cross**2).sum(axis=0) / np.diag(S)
        ranked.append(NextTouch(artefact.names[t], "xyz"[int(np.argmax(each))], float(np.sqrt(left))))
    return sorted(ranked, key=lambda n: n.rms)[:2]


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
