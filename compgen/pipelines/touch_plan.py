"""Plan touches for a path: which of all that the arm reaches tell most of where the path will be."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import ImpossibleError, InputError
from compgen.core.findings import Finding, Level, Progress
from compgen.core.pose import Pose
from compgen.core.units import MM, UM
from compgen.identification.touch_candidates import Probe, Search, Targets, Ways, reachable_ways, stem_gap
from compgen.identification.touch_planning import PathDrift, TouchPlan, path_weight, plan_touches
from compgen.identification.touches import Artefact
from compgen.pipelines.averaging import planned_rises
from compgen.pipelines.drift_model import DriftPrior, drift_columns, forecast_prior
from compgen.pipelines.job import Job
from compgen.pipelines.motion_plan import plan_motion
from compgen.pipelines.touch_targets import targets_of, unreached
from compgen.planning.toolpath import ToolPath

MOST_TOUCHES = 100
POINTS = 1000  # of the path, evenly along the part
USEFUL = 0.01  # of the path's rms: a touch that gains less is named
TURNING = 40  # poses that are looked at between two touches
NEAR = 5 * MM  # from a target: a way between touches that comes so near is named


@dataclass(frozen=True, eq=False, slots=True)
class PlannedTouches:
    """n touches, the most telling first."""

    job: Job
    artefact: Artefact
    targets: Targets
    ways: Ways  # (n,)
    plan: TouchPlan
    rms: Array  # (n + 1,) [m] of the path's drift before the first and after each
    p99: tuple[float, float]  # [m] of the path's standard deviation before and after
    column: Array  # (M, 3, Q) what drifts, at points of the path
    length: Array  # (M,) [m] that each of them stands for
    sigma: float  # [m] of one coordinate of a touch
    frame: Pose  # in World, that the program's positions are in
    uframe: int
    findings: tuple[Finding, ...]

    @property
    def next_gain(self) -> float:
        """By how much one more touch would lower the path's rms, relative."""
        return 1 - float(np.sqrt(max(self.plan.next_variance, 0.0))) / self.rms[-1] if self.rms[-1] > 0 else 0.0


def plan_path_touches(
    job: Job,
    artefact: Artefact,
    frame: tuple[int, Pose],
    count: int,
    sigma: float,
    search: Search,
    centres: bool,
    progress: Progress,
    prior: DriftPrior | None = None,
) -> PlannedTouches:
    """The touches that shrink the variance of a job's path most.

    Args:
        job: Its path, robot and warmth.
        artefact: What can be touched.
        frame: Number and place in World of the frame that the artefact's places are in.
        count: How many touches.
        sigma: Of one coordinate of a touch [m].
        search: How a touch is driven.
        centres: Whether a touch locates the centre of a sphere.
        progress: Called with the stage and the share done.
        prior: What is known of the state; None: what the forecast leaves open.

    Raises:
        InputError: Targets that cannot anchor anything.
        ImpossibleError: The arm reaches none, or fewer ways than touches.
    """
    if not 1 <= count <= MOST_TOUCHES:
        raise InputError(f"-n {count}: must be 1 to {MOST_TOUCHES}; 8 to 16 do for most paths")
    targets, place_sigma, notes = targets_of(artefact, frame[1], centres)
    probe = Probe(Pose(artefact.probe, np.eye(3)), artefact.probe_diameter / 2)
    motion = plan_motion(job.plan, job.cell, job.feed, progress, pages=False)
    rise = planned_rises(job, motion.joint_motion)
    progress("touches in reach", 0.0)
    near = motion.theta[len(motion.theta) // 2]
    ways = reachable_ways(job.robot, job.posture, near, targets, probe, search, centres)
    notes += unreached(artefact, targets, ways)
    if len(ways.target) < count:
        raise ImpossibleError(
            f"{artefact.source}: {len(ways.target)} ways to touch {', '.join(targets.name)} are in the arm's reach in "
            f"the program's posture, -n {count} asks for more; move the artefact, or give fewer"
        )
    progress("touches that tell most", 0.3)
    rows, weight = _path_rows(motion.path)
    later = motion.trajectory.time[rows]
    column = drift_columns(job.cell, motion.theta[rows], rise[rows], later, job.tool.pose)
    prior = forecast_prior(job) if prior is None else prior
    start = np.broadcast_to(job.start_rise(), (len(ways.target), rise.shape[1]))
    touch = drift_columns(job.cell, ways.theta[:, 2], start, np.zeros(len(start)), probe.centre)
    H = _with_places(touch, ways, len(targets.name))
    Q = len(prior.covariance)
    P = np.zeros((H.shape[2], H.shape[2]))
    P[:Q, :Q] = prior.covariance
    P[Q:, Q:] = np.diag(np.repeat(place_sigma, 3) ** 2)
    W = np.zeros_like(P)
    W[:Q, :Q] = path_weight(column, weight)
    if not centres:
        H = np.einsum("ki,kiq->kq", ways.normal, H)[:, None]
    noise = np.broadcast_to(sigma**2 * np.eye(H.shape[1]), (len(H), H.shape[1], H.shape[1]))
    plan = plan_touches(PathDrift(P, W), H, noise, count)
    chosen = ways.subset(plan.chosen)
    rms = np.sqrt(np.maximum(plan.variance, 0.0))
    notes += [*_little_gain(rms, count), *_tight_ways(job, probe, targets, chosen), *job.unlikely]
    sizes = [_p99(column, S[:Q, :Q], weight) for S in (P, plan.covariance)]
    return PlannedTouches(
        job, artefact, targets, chosen, plan, rms, (sizes[0], sizes[1]), column, weight, sigma, frame[1], frame[0],
        tuple(notes),
    )  # fmt: skip


def _path_rows(path: ToolPath) -> tuple[Array, Array]:
    """Waypoints evenly along the part, and the length that each stands for, (M,) [m]."""
    on = path.contact if path.contact.any() else np.ones_like(path.contact)
    rows = np.flatnonzero(on)
    step = np.diff(path.arc, append=path.arc[-1])
    length = np.cumsum(step[rows])
    at = np.unique(np.searchsorted(length, np.linspace(0.0, length[-1], POINTS + 1)[1:]).clip(max=len(rows) - 1))
    return rows[at], np.diff(length[at], prepend=0.0)


def _with_places(touch: Array, ways: Ways, count: int) -> Array:
    """Columns of touches (K, 3, Q) beside those of the targets' places, (K, 3, Q + 3 S)."""
    places = np.zeros((len(touch), 3, count, 3))
    places[np.arange(len(touch)), :, ways.target] = -np.eye(3)
    return np.concatenate([touch, places.reshape(len(touch), 3, -1)], axis=2)


def _p99(column: Array, S: Array, weight: Array) -> float:
    """What 99 % of the path's length stay below: the standard deviation of each point, all directions together [m]."""
    size = np.sqrt(np.maximum(np.einsum("miq,qr,mir->m", column, S, column), 0.0))
    order = np.argsort(size)
    share = np.cumsum(weight[order]) / weight.sum()
    return float(size[order][np.searchsorted(share, 0.99).clip(max=len(size) - 1)])


def _little_gain(rms: Array, count: int) -> list[Finding]:
    gain = 1 - rms[1:] / np.maximum(rms[:-1], 1e-15)
    useful = int(np.argmax(gain < USEFUL)) if (gain < USEFUL).any() else count
    if useful == count:
        return []
    message = (
        f"from touch {useful + 1} on each gains less than {USEFUL:.0%}: -n {max(useful, 1)} leaves "
        f"{rms[max(useful, 1)] / UM:.1f} um where {count} leave {rms[-1] / UM:.1f}"
    )
    return [Finding(Level.NOTE, "touches.more_than_useful", message)]


def _tight_ways(job: Job, probe: Probe, targets: Targets, ways: Ways) -> list[Finding]:
    """Names the joint motions between touches on which the probe passes near a target."""
    findings = []
    share = np.linspace(0.0, 1.0, TURNING)[:, None]
    for n, (a, b) in enumerate(pairwise(ways.theta[:, 0]), 1):
        gap = stem_gap(job.robot, targets, probe, a + (b - a) * share)
        s = int(np.argmin(gap))
        if gap[s] < NEAR:
            message = (
                f"between touches {n} and {n + 1} the probe passes {max(gap[s], 0.0) / MM:.0f} mm from "
                f"{targets.name[s]}: teach a position between"
            )
            findings.append(Finding(Level.WARNING, "touches.way", message))
    return findings
