"""Plan touches for a path: which of all that the arm reaches tell most of where the path will be."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from compgen.core import stages
from compgen.core.arrays import Array
from compgen.core.codes import Code, Level
from compgen.core.exceptions import ImpossibleError, InputError
from compgen.core.findings import Finding
from compgen.core.pose import Pose
from compgen.core.stages import Progress
from compgen.core.units import MM, UM
from compgen.identification.touch_candidates import Probe, Search, Targets, Ways, reachable_ways, stem_gap
from compgen.identification.touch_planning import TouchPlan, plan_touches
from compgen.identification.touches import Artefact
from compgen.job.job import Job
from compgen.pipelines.anchor.mistakes import LEAST_COORDINATES
from compgen.pipelines.anchor.path_places import path_places
from compgen.pipelines.anchor.touch_model import TouchModel, left_by_anchoring, touch_model
from compgen.pipelines.anchor.touch_targets import targets_of, unreached

MOST_TOUCHES = 100
PLACES = 400  # of the path, evenly along the part
USEFUL = 0.01  # of the path's rms: a touch that gains less is named
TURNING = 40  # poses that are looked at between two touches
NEAR = 5 * MM  # from a target: a way between touches that comes so near is named


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class PlannedTouches:
    """n touches, the most telling first."""

    job: Job
    artefact: Artefact
    targets: Targets
    ways: Ways  # (n,)
    all_ways: Ways  # (K,) that the arm reaches
    plan: TouchPlan
    rms: Array  # (n + 1,) [m] of the path's drift before the first and after each
    next_rms: float  # [m] after one more
    p99: tuple[float, float]  # [m] of the path's standard deviation before and after
    model: TouchModel  # of all ways
    by_anchoring: float | None  # [m] rms that cgen anchor will leave; None: too few touches for a state
    sigma: float  # [m] of one coordinate of a touch
    frame: Pose  # in World, that the program's positions are in
    uframe: int
    findings: tuple[Finding, ...]

    @property
    def next_gain(self) -> float:
        """By how much one more touch would lower the path's rms, relative."""
        return float(1 - self.next_rms / self.rms[-1]) if self.rms[-1] > 0 else 0.0


def plan_path_touches(
    job: Job,
    artefact: Artefact,
    frame: tuple[int, Pose],
    count: int,
    sigma: float,
    search: Search,
    centres: bool,
    progress: Progress,
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

    Raises:
        InputError: Targets that cannot anchor anything.
        ImpossibleError: The arm reaches none, or fewer ways than touches.
    """
    if not 1 <= count <= MOST_TOUCHES:
        raise InputError(f"-n {count}: must be 1 to {MOST_TOUCHES}; 8 to 16 do for most paths")
    targets, place_sigma, notes = targets_of(artefact, frame[1], centres)
    probe = Probe(Pose(artefact.probe, np.eye(3)), artefact.probe_diameter / 2)
    path = path_places(job, PLACES)
    progress(stages.TOUCHES_IN_REACH, 0.0)
    near = path.theta[len(path.theta) // 2]
    ways = reachable_ways(job.robot, job.posture, near, targets, probe, search, centres)
    notes += unreached(artefact, targets, ways)
    if len(ways.target) < count:
        raise ImpossibleError(
            f"{artefact.source}: {len(ways.target)} ways to touch {', '.join(targets.name)} are in the arm's reach in "
            f"the program's posture, -n {count} asks for more; move the artefact, or give fewer"
        )
    progress(stages.TOUCHES_THAT_TELL, 0.3)
    model = touch_model(job, artefact, targets, place_sigma, probe, ways, path)
    H = model.rows if centres else np.einsum("ki,kiq->kq", ways.normal, model.rows)[:, None]
    noise = np.broadcast_to(sigma**2 * np.eye(H.shape[1]), (len(H), H.shape[1], H.shape[1]))
    plan = plan_touches(model.drift, H, noise, count)
    chosen = ways.subset(plan.chosen)
    left = float(model.left.mean())
    rms = np.sqrt(np.maximum(plan.variance, 0.0) + left)
    notes += [
        *_too_few(count, centres),
        *_little_gain(rms, count),
        *_tight_ways(job, probe, targets, chosen),
        *job.input_findings,
    ]
    p99 = _p99(model, model.prior), _p99(model, plan.covariance)
    by_anchoring = None
    if _coordinates(count, centres) >= LEAST_COORDINATES:
        by_anchoring = left_by_anchoring(job, artefact, frame[1], chosen, sigma, path)[1]
    next_rms = float(np.sqrt(max(plan.next_variance, 0.0) + left))
    return PlannedTouches(
        job=job,
        artefact=artefact,
        targets=targets,
        ways=chosen,
        all_ways=ways,
        plan=plan,
        rms=rms,
        next_rms=next_rms,
        p99=p99,
        model=model,
        by_anchoring=by_anchoring,
        sigma=sigma,
        frame=frame[1],
        uframe=frame[0],
        findings=tuple(notes),
    )


def _p99(model: TouchModel, S: Array) -> float:
    """What 99 % of the path stays below: the standard deviation of each place, all directions together [m]."""
    variance = np.einsum("miq,qr,mir->m", model.column, S, model.column) + model.left
    return float(np.quantile(np.sqrt(np.maximum(variance, 0.0)), 0.99, method="higher"))


def _coordinates(count: int, centres: bool) -> int:
    return 3 * count if centres else count


def _too_few(count: int, centres: bool) -> list[Finding]:
    coordinates = _coordinates(count, centres)
    if coordinates >= LEAST_COORDINATES:
        return []
    message = f"{coordinates} coordinates: cgen anchor asks for {LEAST_COORDINATES} at least; plan more touches"
    return [Finding(Level.WARNING, Code.TOUCHES_TOO_FEW, message)]


def _little_gain(rms: Array, count: int) -> list[Finding]:
    gain = 1 - rms[1:] / np.maximum(rms[:-1], 1e-15)
    useful = int(np.argmax(gain < USEFUL)) if (gain < USEFUL).any() else count
    if useful == count:
        return []
    message = (
        f"from touch {useful + 1} on each gains less than {USEFUL:.0%}: -n {max(useful, 1)} leaves "
        f"{rms[max(useful, 1)] / UM:.1f} um where {count} leave {rms[-1] / UM:.1f}"
    )
    return [Finding(Level.NOTE, Code.TOUCHES_MORE_THAN_USEFUL, message)]


def _tight_ways(job: Job, probe: Probe, targets: Targets, ways: Ways) -> list[Finding]:
    """Names the joint motions between touches on which the probe passes near a target."""
    findings = []
    share = np.linspace(0.0, 1.0, TURNING)[:, None]
    for n, (a, b) in enumerate(pairwise(ways.theta[:, 0]), 1):
        way = a + (b - a) * share
        if job.robot.interference is not None and (job.robot.interference.clearance(way) < 0).any():
            message = f"between touches {n} and {n + 1} J2 and J3 leave their polygon: teach a position between"
            findings.append(Finding(Level.WARNING, Code.TOUCHES_WAY, message))
        gap = stem_gap(job.robot, targets, probe, way)
        s = int(np.argmin(gap))
        if gap[s] < NEAR:
            message = (
                f"between touches {n} and {n + 1} the probe passes {max(gap[s], 0.0) / MM:.0f} mm from "
                f"{targets.name[s]}: teach a position between"
            )
            findings.append(Finding(Level.WARNING, Code.TOUCHES_WAY, message))
    return findings
