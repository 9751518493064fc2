r"""The most likely state by one hypothesis, and what it leaves open along the path.

    x = C y,   C = P H^T V^-1,      cov(x) = P - C H P

What else touches tell of this path (identified parameters, what the thermal physics leaves out) no number of x can
say; on a part it is nearly one shift and one turn, so the base carries it: b = B^+ E[rest | y], B what the base does
along the path. With L y all that the state then corrects, G x + rest what is really there,

    cov = cov(G x + rest) - 2 cov(G x + rest, y) L^T + L V L^T

Columns fade along the path with the lag of each node. Source: linear minimum-variance estimation (Kay 1993, chapter
12).
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array
from compgen.error_model.direction_memory import NO_DIRECTION, DirectionState
from compgen.error_model.model import build_error_model
from compgen.job.job import Job
from compgen.pipelines.anchor.forecast import Forecast
from compgen.pipelines.anchor.hypotheses import Hypothesis, Innovation, Prior
from compgen.pipelines.anchor.path_places import PathPlaces
from compgen.pipelines.anchor.touching import Touched, missing_of, smooth
from compgen.pipelines.anchor.unknowns import Unknowns


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
