r"""What touches tell of a path, as anchoring takes it: one linear model of robot, places and physics left out.

    s = (x, q, u, f)       path  C = (G, N, 0, A),    touch of target s  H = (H, N, -I_s, I_s)

with x what a state says, q what else is not known of the robot (unit variance), u where S targets stand, and f what the
thermal physics leaves out there: a smooth field of covariance K, whose share that the targets tell of a place along the
path is A = k^T K^-1; what they do not is left whatever is touched.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from compgen.core.arrays import Array, rms
from compgen.core.pose import Pose
from compgen.error_model.direction_memory import NO_DIRECTION, DirectionState
from compgen.error_model.model import build_error_model
from compgen.identification.touch_candidates import Probe, Targets, Ways
from compgen.identification.touch_planning import PathDrift, path_weight
from compgen.identification.touches import Artefact, Touches
from compgen.job.job import Job
from compgen.pipelines.anchor.estimate import estimate, path_columns
from compgen.pipelines.anchor.forecast import Forecast, forecast_now
from compgen.pipelines.anchor.hypotheses import AS_FORECAST
from compgen.pipelines.anchor.path_places import PathPlaces
from compgen.pipelines.anchor.touching import innovation_of, missing_of, smooth, taught_rises, touched
from compgen.pipelines.anchor.unknowns import Unknowns, unknowns_of

RIDGE = 1e-9  # of the field's variance
TINY = 1e-18  # [m^2] of a field that is none


@dataclass(frozen=True, eq=False, slots=True)
class TouchModel:
    """The linear model of K ways to touch and M places of a path."""

    prior: Array  # (Q, Q) covariance of s
    column: Array  # (M, 3, Q) C
    left: Array  # (M,) [m^2] variance that no touch lowers, all directions together
    rows: Array  # (K, 3, Q) H

    @property
    def drift(self) -> PathDrift:
        """For the choice of touches, every place alike."""
        return PathDrift(self.prior, path_weight(self.column, np.ones(len(self.column))))


def touch_model(
    job: Job, artefact: Artefact, targets: Targets, place_sigma: Array, probe: Probe, ways: Ways, path: PathPlaces
) -> TouchModel:
    """The model of ways to touch and a path.

    Args:
        job: Its robot and its forecast, at the program's start.
        artefact: Whose targets they are.
        targets: S of them.
        place_sigma: Of their places, (S,) [m].
        probe: What touches.
        ways: K of them.
        path: M places.
    """
    forecast = forecast_now(job, _touches(artefact, ways))
    touch, thermal = _thermal(forecast, ways.theta[:, 2], probe.centre)
    along, warm = _thermal(forecast, path.theta, job.tool.pose)
    unknowns = unknowns_of(job, forecast, path.middle, path.radius, missing_of(forecast) * rms(thermal))
    H, N = _columns(forecast, unknowns, artefact, ways.theta[:, 2], probe.centre)
    still = DirectionState(np.zeros((len(along), 6)), np.zeros((len(along), 3)))
    rise = np.broadcast_to(forecast.rise, (len(along), len(forecast.rise)))
    G, N_path = unknowns.columns(forecast, path.theta, rise, still, job.tool.pose)
    nodes, faded = len(forecast.rise), np.exp(-path.time[:, None, None] / job.cell.warmth.lag)
    G = np.concatenate([G[:, :, :nodes] * faded, G[:, :, nodes:]], axis=2)
    share, field, left = _field(forecast, targets, ways, thermal, along, warm)
    S, M, K = len(targets.name), len(along), len(touch)
    of_target = np.einsum("ks,ij->kisj", np.eye(S)[ways.target], np.eye(3)).reshape(K, 3, -1)
    on_path = np.einsum("ms,ij->misj", share, np.eye(3)).reshape(M, 3, -1)
    places = np.diag(np.repeat(place_sigma**2, 3))
    return TouchModel(
        block_diag(unknowns.prior.forecast, np.eye(N.shape[2]), places, np.kron(field, np.eye(3))),
        np.concatenate([G, N_path, np.zeros((M, 3, 3 * S)), on_path], axis=2),
        left,
        np.concatenate([H, N, -of_target, of_target], axis=2),
    )


def left_by_anchoring(
    job: Job, artefact: Artefact, frame: Pose, ways: Ways, sigma: float, path: PathPlaces
) -> tuple[float, float]:
    """The path's rms before and after anchoring by some ways, as ``cgen anchor`` will expect it [m].

    A state has no word for what touches tell of a robot's geometry, but for what of it the base can carry: it leaves
    a little more than touches tell.

    Args:
        job: Its robot and its forecast.
        artefact: Whose targets they are.
        frame: Place in World of the frame that the artefact's places are in.
        ways: That are touched.
        sigma: Of one coordinate [m].
        path: M places.

    Raises:
        InputError: Too few touches for a state.
    """
    touches = replace(_touches(artefact, ways), sigma=np.full(len(ways.target), sigma))
    forecast = forecast_now(job, touches)
    seen = touched(artefact, touches, frame, forecast)
    missed = missing_of(forecast) * rms(seen.thermal)
    unknowns = unknowns_of(job, forecast, path.middle, path.radius, missed)
    innovation = innovation_of(seen, forecast, unknowns)
    columns = path_columns(job, forecast, unknowns, seen, innovation, path)
    expected = estimate(innovation, unknowns.prior, AS_FORECAST, columns, len(forecast.rise))
    return rms(expected.before), rms(expected.after)


def _touches(artefact: Artefact, ways: Ways) -> Touches:
    """The ways as touches at the time of the forecast."""
    count = len(ways.target)
    return Touches(
        label=("planned",) * count,
        time=np.zeros(count),
        timed=False,
        target=ways.target,
        theta=ways.theta[:, 2],
        normal=ways.normal,
        deflection=np.zeros(count),
        sigma=np.full(count, np.nan),
    )


def _thermal(forecast: Forecast, theta: Array, tool: Pose) -> tuple[Array, Array]:
    """Where a tool is (M, 3) [m], and by how much the rises move it, (M,) [m]."""
    cell = forecast.cell
    model = build_error_model(cell.robot, cell.sources, len(cell.heat.names), tool)
    rise = np.broadcast_to(forecast.rise, (len(theta), len(forecast.rise)))
    warm, cold = (model.actual_pose(theta, r, NO_DIRECTION).position for r in (rise, 0 * rise))
    return warm, np.linalg.norm(warm - cold, axis=1)


def _columns(
    forecast: Forecast, unknowns: Unknowns, artefact: Artefact, theta: Array, probe: Pose
) -> tuple[Array, Array]:
    """H (K, 3, X) and N (K, 3, Q) of touches; of targets that the robot taught, less what they were then."""
    still = DirectionState(np.zeros((len(theta), 6)), np.zeros((len(theta), 3)))
    rise = np.broadcast_to(forecast.rise, (len(theta), len(forecast.rise)))
    H, N = unknowns.columns(forecast, theta, rise, still, probe)
    if artefact.taught is None:
        return H, N
    then = np.broadcast_to(taught_rises(artefact, forecast.cell.heat.names), rise.shape)
    H_then, N_then = unknowns.columns(forecast, theta, then, still, probe, then=True)
    grown = slice(len(forecast.rise) + 6, H.shape[2] - len(forecast.cell.drifting.numbers))
    H = H.copy()
    H[:, :, grown] -= H_then[:, :, grown]
    return H, N - N_then


def _field(
    forecast: Forecast, targets: Targets, ways: Ways, thermal: Array, along: Array, warm: Array
) -> tuple[Array, Array, Array]:
    """A (M, S), K (S, S) [m^2], and what of the field no target tells along the path, (M,) [m^2]."""
    kappa, noise = missing_of(forecast), forecast.cell.fit.noise
    count = np.bincount(ways.target, minlength=len(targets.name))
    at_targets = kappa * np.bincount(ways.target, thermal, len(targets.name)) / np.maximum(count, 1)
    alike = smooth(targets.place, targets.place)
    K = alike * (np.outer(at_targets, at_targets) + noise**2)
    K += RIDGE * max(float(K.max()), TINY) * np.eye(len(K))
    missed = kappa * warm
    cross = smooth(along, targets.place) * np.outer(missed, at_targets)
    share = np.asarray(np.linalg.solve(K, cross.T).T, dtype=np.float64)
    left = 3 * np.maximum(missed**2 - np.einsum("ms,ms->m", share, cross), 0.0)
    return share, np.asarray(K), np.asarray(left)
