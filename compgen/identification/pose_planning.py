r"""Which poses are worth measuring: those that tell most of all parameters together.

D-optimal by exchange (Fedorov 1972): from many candidates inside limits and box, those poses are taken that raise

    log det ( sum_n A_n' A_n / s^2 + diag(1 / sigma^2) ),

A_n the slope of the places that an instrument sees at pose n, frames included; first one by one, then each against
every candidate until no exchange helps. The order of the poses is the shortest way through the joints that is found
by going to the nearest. After them the parameters are known as well as the inverse of that matrix says."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.exceptions import ImpossibleError, InputError
from compgen.core.units import MM
from compgen.identification.fit import FRAME_PRECISION, linearise
from compgen.identification.frames import InstrumentFrames
from compgen.identification.measurements import Measurements
from compgen.identification.model import ArmModel
from compgen.identification.pose_files import motion_directions
from compgen.robot.robot import Robot

CANDIDATES = 1500
DRAWS = 200_000
EXCHANGES = 3  # rounds over all poses


@dataclass(frozen=True, slots=True)
class Site:
    """What limits the poses: where the reflectors may be, and from where they are seen."""

    box: Array  # (2, 3) [m] World, low and high corner
    reflector: Array  # (R, 3) [m] in the flange
    instrument: Array | None  # (3,) [m] World; None: seen from anywhere
    view: float  # [rad] largest angle between the flange's own way out and the way to the instrument
    noise: float  # [m] of one coordinate
    share: float  # of each joint's range, about its middle, that poses may use


@dataclass(frozen=True, eq=False, slots=True)
class PosePlan:
    """Poses in the order to drive them, and what they will tell."""

    theta: Array  # (n, 6) [rad]
    position: Array  # (n, 3) [m] nominal flange
    sigma: Array  # (K,) [SI] of each parameter after measuring
    prior: Array  # (K,) [SI] before


def plan_poses(
    robot: Robot, model: ArmModel, nodes: int, site: Site, count: int, progress: Callable[[str, float], None]
) -> PosePlan:
    """Choose poses.

    Raises:
        ImpossibleError: No, or too few, poses inside limits and box can be seen.
        InputError: Fewer poses than two, or more than the candidates.
    """
    if not 2 <= count <= CANDIDATES // 2:
        raise InputError(f"-n {count}: must be 2 to {CANDIDATES // 2} poses")
    theta = _candidate_poses(robot, model, nodes, site, count)
    progress("candidates", 0.2)
    A = _jacobians(robot, model, nodes, site, theta)
    progress("slopes", 0.4)
    prior = np.concatenate(
        [np.ones(len(model.parameters)), np.full(A.shape[2] - len(model.parameters), FRAME_PRECISION)]
    )
    rows = _exchange(A, prior, count, progress)
    order = _nearest_neighbour_order(theta[rows], robot.pendant_zero)
    rows = rows[order]
    A = _jacobians(robot, model, nodes, site, theta[rows])  # again: each joint now comes from the pose before
    information = np.diag(prior) + np.einsum("nij,nik->jk", A, A)
    covariance = np.linalg.inv(information)
    sigma = np.sqrt(np.diag(covariance)[: len(model.parameters)]) * model.prior
    position, _ = model.pose(_measurements(theta[rows], nodes, site), np.zeros(len(model.parameters)))
    return PosePlan(theta[rows], position, sigma, model.prior)


def _candidate_poses(robot: Robot, model: ArmModel, nodes: int, site: Site, count: int) -> Array:
    """Poses inside limits whose reflectors lie in the box and are seen."""
    rng = np.random.default_rng(1)  # the same plan at every run
    middle, half = (robot.upper + robot.lower) / 2, (robot.upper - robot.lower) / 2
    half = np.minimum(half * site.share, np.pi)
    found: list[Array] = []
    have = tried = 0
    while have < CANDIDATES and tried < DRAWS:
        theta = middle + half * rng.uniform(-1, 1, (20_000, 6))
        tried += len(theta)
        good = theta[_visible(model, nodes, site, theta)]
        found.append(good)
        have += len(good)
    if have < 2 * count:
        low, high = site.box / MM
        raise ImpossibleError(
            f"plan-poses: {have} of {tried} random poses are in the box {low[0]:g} {low[1]:g} {low[2]:g} to "
            f"{high[0]:g} "
            f"{high[1]:g} {high[2]:g} mm and are seen; make the box larger, or --view wider"
        )
    return np.concatenate(found)[:CANDIDATES]


def _visible(model: ArmModel, nodes: int, site: Site, theta: Array) -> Array:
    position, rotation = model.pose(_measurements(theta, nodes, site), np.zeros(len(model.parameters)))
    places = position[:, None] + np.einsum("nij,rj->nri", rotation, site.reflector)
    inside = ((places >= site.box[0]) & (places <= site.box[1])).all(axis=(1, 2))
    if site.instrument is not None:
        way = site.instrument - places
        way /= np.linalg.norm(way, axis=2, keepdims=True)
        out = rotation[:, :, 2]
        inside &= (np.einsum("nri,ni->nr", way, out) >= np.cos(site.view)).all(axis=1)
    return np.asarray(inside)


def _measurements(theta: Array, nodes: int, site: Site) -> Measurements:
    M, R = len(theta), len(site.reflector)
    N = M * R
    return Measurements(
        theta=theta, rise=np.zeros((M, nodes)), direction=motion_directions(theta), time=np.arange(M, dtype=float),
        warm=np.zeros(M), pose=np.repeat(np.arange(M), R), instrument=np.zeros(N, dtype=int),
        reflector=np.tile(np.arange(R), M), position=np.zeros((N, 3)), rotation=np.full((N, 3, 3), np.nan),
        sigma=np.ones(N), label=("",) * N, reflectors=tuple(map(str, range(R))), instruments=("plan",),
        aligned=np.array([False]),
    )  # fmt: skip


def _jacobians(robot: Robot, model: ArmModel, nodes: int, site: Site, theta: Array) -> Array:
    """Slopes of all places at each candidate over the noise, (M, 3 R, D)."""
    active = np.ones(len(model.parameters), dtype=bool)
    frames = InstrumentFrames(np.eye(3)[None], np.zeros((1, 3)), site.reflector)
    data = _measurements(theta, nodes, site)
    linear = linearise(
        model,
        model.jacobian_function(active),
        data,
        active,
        np.zeros(len(active)),
        frames,
        np.tile(np.eye(3), (len(site.reflector), 1, 1)),
    )
    return np.asarray(linear.A.reshape(len(theta), -1, linear.A.shape[2]) / site.noise)


def _exchange(A: Array, prior: Array, count: int, progress: Callable[[str, float], None]) -> IntArray:
    """Rows of the best candidates."""
    size = A.shape[1]
    C = np.diag(1 / prior)
    chosen: list[int] = []
    for _ in range(count):  # one by one: log det grows by log det(I + A C A')
        best = _best_candidate(A, C, chosen)
        C = _covariance_with(C, A[best], size)
        chosen.append(best)
    progress("exchange", 0.6)
    for turn in range(EXCHANGES):
        changed = False
        for k in range(count):
            out = chosen[k]
            S = np.eye(size) - A[out] @ C @ A[out].T
            less = C + C @ A[out].T @ np.linalg.solve(S, A[out] @ C)
            rest = chosen[:k] + chosen[k + 1 :]
            best = _best_candidate(A, less, rest)
            if (
                best != out
                and _log_det_gain(A[best : best + 1], less)[0] > _log_det_gain(A[out : out + 1], less)[0] + 1e-9
            ):
                chosen[k], changed = best, True
                C = _covariance_with(less, A[best], size)
        progress("exchange", 0.6 + 0.3 * (turn + 1) / EXCHANGES)
        if not changed:
            break
    return np.array(chosen)


def _log_det_gain(A: Array, C: Array) -> Array:
    inner = np.eye(A.shape[1]) + (A @ C) @ np.swapaxes(A, 1, 2)
    return np.asarray(np.linalg.slogdet(inner)[1])


def _best_candidate(A: Array, C: Array, taken: list[int]) -> int:
    gain = _log_det_gain(A, C)
    gain[taken] = -np.inf
    return int(np.argmax(gain))


def _covariance_with(C: Array, rows: Array, size: int) -> Array:
    inner = np.eye(size) + rows @ C @ rows.T
    new = C - C @ rows.T @ np.linalg.solve(inner, rows @ C)
    return np.asarray((new + new.T) / 2)


def _nearest_neighbour_order(theta: Array, start: Array) -> IntArray:
    """From the start always to the nearest pose, by the largest joint motion."""
    left = list(range(len(theta)))
    here, order = start, []
    while left:
        k = min(left, key=lambda i: (float(np.abs(theta[i] - here).max()), i))
        order.append(k)
        left.remove(k)
        here = theta[k]
    return np.array(order)
