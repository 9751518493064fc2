r"""Which poses to measure: those that determine all parameters together best.

D-optimal by exchange (``choice_by_exchange``): from many candidates inside limits and box, those poses are
taken that raise

    log det ( sum_n A_n' A_n / s^2 + diag(1 / sigma^2) ),

A_n the Jacobian of the positions measured at pose n, frames included; first one by one, then each against every
candidate until no exchange helps. The poses are ordered by going to the nearest. The covariance of the parameters
after measuring is the inverse of that matrix."""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core import stages
from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.exceptions import ImpossibleError, InputError
from compgen.core.stages import Progress
from compgen.core.units import DEG, MM
from compgen.identification.choice_by_exchange import Choice
from compgen.identification.instrument_frames import InstrumentFrames
from compgen.identification.linearisation import FRAME_PRECISION, linearise
from compgen.identification.measured_poses import motion_directions
from compgen.identification.measurements import Measurements, blank_rows
from compgen.identification.model import ArmModel
from compgen.robot.robot import Robot

CANDIDATES = 1500
DRAWS = 200_000
EXCHANGES = 3  # rounds over all poses
GAIN = 1e-9  # of log det: an exchange that gains less is none
#: of a reversal run, from its turn: small ones where play is run through, large ones that show the curve
REVERSAL_STEPS = np.array([0.004, 0.015, 0.03, 0.07, 0.13, 0.25, 0.5, 1.2]) * DEG
REVERSAL_ENTRY = 1.0 * DEG  # from where a run comes to its turn


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """What limits the poses: where the reflectors may be, and the line of sight to the instrument."""

    box: Array  # (2, 3) [m] World, low and high corner
    reflector: Array  # (R, 3) [m] in the flange
    instrument: Array | None  # (3,) [m] World; None: visible from anywhere
    view: float  # [rad] largest angle between the flange's axis and the line of sight
    noise: float  # [m] of one coordinate
    share: float  # of each joint's range, about its middle, that poses may use


@dataclass(frozen=True, eq=False, slots=True)
class PosePlan:
    """Poses in the order to drive them, and the expected sigmas of the parameters."""

    theta: Array  # (n, 6) [rad]
    sigma: Array  # (K,) [SI] of each parameter after measuring
    prior: Array  # (K,) [SI] before


def plan_poses(robot: Robot, model: ArmModel, nodes: int, site: Site, count: int, progress: Progress) -> PosePlan:
    """Choose poses by D-optimal exchange, and order them.

    Raises:
        ImpossibleError: No, or too few, poses inside limits and box can be seen.
        InputError: Fewer poses than two, or more than the candidates.
    """
    if not 2 <= count <= CANDIDATES // 2:
        raise InputError(f"-n {count}: must be 2 to {CANDIDATES // 2} poses")
    theta = _candidate_poses(robot, model, nodes, site, count)
    progress(stages.CANDIDATES, 0.2)
    A = _jacobians(model, nodes, site, theta)
    progress(stages.SLOPES, 0.4)
    prior = np.concatenate(
        [np.ones(len(model.parameters)), np.full(A.shape[2] - len(model.parameters), FRAME_PRECISION)]
    )
    noise = np.broadcast_to(np.eye(A.shape[1]), (len(A), A.shape[1], A.shape[1]))
    choice = Choice(np.diag(1 / prior), A, noise, _log_det_gain)
    start = choice.greedy(count)
    progress(stages.EXCHANGE, 0.6)
    rows = np.array(choice.exchanged(start, EXCHANGES, GAIN))
    progress(stages.EXCHANGE, 0.9)
    rows = rows[_nearest_neighbour_order(theta[rows], robot.pendant_zero)]
    A = _jacobians(model, nodes, site, theta[rows])  # again: each joint now comes from the pose before
    information = np.diag(prior) + np.einsum("nij,nik->jk", A, A)
    covariance = np.linalg.inv(information)
    sigma = np.sqrt(np.diag(covariance)[: len(model.parameters)]) * model.prior
    return PosePlan(theta[rows], sigma, model.prior)


def plan_reversals(robot: Robot, model: ArmModel, nodes: int, site: Site, plan: PosePlan) -> list[tuple[Array, int]]:
    """Reversal runs: for each joint a turn in small steps, both ways, all others standing.

    Each begins on the pose of the plan where the joint moves a reflector farthest, if the whole run is inside limits
    and seen: it comes from below, goes down in growing steps and up in growing steps.

    Returns:
        Poses (18, 6) [rad] and the reflector, of each joint that has such a pose.
    """
    offsets = np.concatenate([[-REVERSAL_STEPS[-1] - REVERSAL_ENTRY, 0.0], -REVERSAL_STEPS])
    offsets = np.concatenate([offsets, REVERSAL_STEPS - REVERSAL_STEPS[-1]])
    runs = []
    for joint in range(6):
        steps = np.zeros((len(offsets), 6))
        steps[:, joint] = offsets
        ahead = plan.theta + REVERSAL_STEPS[0] * np.eye(6)[joint]
        moved = _reflectors(model, nodes, site, ahead)[0] - _reflectors(model, nodes, site, plan.theta)[0]
        lever = np.linalg.norm(moved, axis=2)  # (n, R)
        for m in np.argsort(-lever.max(axis=1), kind="stable"):
            poses = plan.theta[m] + steps
            inside = (poses >= robot.lower).all() and (poses <= robot.upper).all() and robot.is_clear(poses).all()
            if inside and visible_poses(model, nodes, site, poses).all():
                runs.append((poses, int(np.argmax(lever[m]))))
                break
    return runs


def _reflectors(model: ArmModel, nodes: int, site: Site, theta: Array) -> tuple[Array, Array]:
    """Where the reflectors are at poses, (M, R, 3) [m], and the flange's axis there, (M, 3)."""
    position, rotation = model.pose(_measurements(theta, nodes, site), np.zeros(len(model.parameters)))
    return position[:, None] + np.einsum("nij,rj->nri", rotation, site.reflector), rotation[:, :, 2]


def _candidate_poses(robot: Robot, model: ArmModel, nodes: int, site: Site, count: int) -> Array:
    """Random poses inside the limits whose reflectors are visible, (n, 6) [rad]."""
    rng = np.random.default_rng(1)  # the same plan at every run
    middle, half = (robot.upper + robot.lower) / 2, (robot.upper - robot.lower) / 2
    half = np.minimum(half * site.share, np.pi)
    batches: list[Array] = []
    count_visible = drawn = 0
    while count_visible < CANDIDATES and drawn < DRAWS:
        theta = middle + half * rng.uniform(-1, 1, (20_000, 6))
        drawn += len(theta)
        seen: BoolArray = visible_poses(model, nodes, site, theta)
        visible = theta[seen & robot.is_clear(theta)]
        batches.append(visible)
        count_visible += len(visible)
    if count_visible < 2 * count:
        low, high = site.box / MM
        raise ImpossibleError(
            f"plan-poses: {count_visible} of {drawn} random poses are in the box {low[0]:g} {low[1]:g} {low[2]:g} to "
            f"{high[0]:g} {high[1]:g} {high[2]:g} mm and are seen; make the box larger, or --view wider"
        )
    return np.concatenate(batches)[:CANDIDATES]


def visible_poses(model: ArmModel, nodes: int, site: Site, theta: Array) -> BoolArray:
    """Which poses have all reflectors in the box and facing the instrument, (M,)."""
    position, axis = _reflectors(model, nodes, site, theta)
    visible = ((position >= site.box[0]) & (position <= site.box[1])).all(axis=(1, 2))
    if site.instrument is not None:
        line_of_sight = site.instrument - position
        line_of_sight /= np.linalg.norm(line_of_sight, axis=2, keepdims=True)
        visible &= (np.einsum("nri,ni->nr", line_of_sight, axis) >= np.cos(site.view)).all(axis=1)
    return np.asarray(visible)


def _measurements(theta: Array, nodes: int, site: Site) -> Measurements:
    """Measurements of all reflectors at each pose, positions at zero."""
    M, R = len(theta), len(site.reflector)
    return replace(
        blank_rows(theta, np.repeat(np.arange(M), R), ("",) * (M * R), nodes),
        direction=motion_directions(theta),
        reflector=np.tile(np.arange(R), M),
        position=np.zeros((M * R, 3)),
        reflectors=tuple(map(str, range(R))),
        instruments=("plan",),
        aligned=np.array([False]),
    )


def _jacobians(model: ArmModel, nodes: int, site: Site, theta: Array) -> Array:
    """Jacobian of all positions at each pose over the noise, (M, 3 R, D)."""
    active = np.ones(len(model.parameters), dtype=bool)
    frames = InstrumentFrames(np.eye(3)[None], np.zeros((1, 3)), site.reflector)
    data = _measurements(theta, nodes, site)
    linear = linearise(
        model,
        data,
        active,
        np.zeros(len(active)),
        frames,
        np.tile(np.eye(3), (len(site.reflector), 1, 1)),
    )
    return np.asarray(linear.A.reshape(len(theta), -1, linear.A.shape[2]) / site.noise)


def _log_det_gain(S: Array, A: Array, noise: Array) -> Array:
    """Growth of log det of the information by each pose, (M,), after the covariance S; noise is one."""
    return np.asarray(np.linalg.slogdet(noise + (A @ S) @ np.swapaxes(A, 1, 2))[1])


def _nearest_neighbour_order(theta: Array, start: Array) -> IntArray:
    """Order of the poses, (n,): from the start always to the nearest, by the largest joint motion."""
    remaining = list(range(len(theta)))
    current, order = start, []
    while remaining:
        k = min(remaining, key=lambda i: (float(np.abs(theta[i] - current).max()), i))
        order.append(k)
        remaining.remove(k)
        current = theta[k]
    return np.array(order)
