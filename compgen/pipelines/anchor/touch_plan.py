"""Plan touches for a path: which of all that the arm reaches tell most of where the path will be.

Their program is proven from its text: every pose in reach, in its posture, as planned.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from compgen.core import stages
from compgen.core.arrays import Array
from compgen.core.exceptions import ImpossibleError, InputError
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.pose import IDENTITY, Pose
from compgen.core.stages import Progress
from compgen.core.units import DEG, MM, UM
from compgen.fanuc.analysis.poses import program_poses
from compgen.fanuc.listing.listing import loads
from compgen.fanuc.measuring_programs import touch_program
from compgen.identification.choice_by_exchange import TouchPlan, plan_touches
from compgen.identification.touch_candidates import Probe, Search, Targets, Ways, reachable_ways, stem_gap
from compgen.identification.touches import Artefact
from compgen.job.job import Job
from compgen.pipelines.anchor.estimate import path_places
from compgen.pipelines.anchor.touch_model import TouchModel, left_by_anchoring, targets_of, touch_model, unreached
from compgen.pipelines.anchor.touching import LEAST_COORDINATES, THROUGH
from compgen.program.digits import resolution
from compgen.program.frames import Frames
from compgen.program.program import Signal, TouchPositions
from compgen.robot.configuration import turn_digits
from compgen.robot.inverse_kinematics import ALL_POSTURES

MOST_TOUCHES = 100
PLACES = 400  # of the path, evenly along the part
USEFUL = 0.01  # of the path's rms: a touch that gains less is named
TURNING = 40  # poses that are looked at between two touches
NEAR = 5 * MM  # from a target: a way between touches that comes so near is named
SAME = 0.02 * DEG  # by which the digits of a position may turn a joint
DRIVEN = (0, 1, 3)  # of the stages of a way: lifted, approach, beyond
STOPPED = (0, 1, 2)  # and where the program stops at the touch


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
        progress: Called with the stage and the share done.

    Raises:
        InputError: Targets that cannot anchor anything.
        ImpossibleError: The arm reaches none, or fewer ways than touches.
    """
    if not 1 <= count <= MOST_TOUCHES:
        raise InputError(f"-n {count}: must be 1 to {MOST_TOUCHES}; 8 to 16 do for most paths")
    targets, place_sigma, notes = targets_of(artefact, frame[1], centres=search.centres)
    probe = Probe(Pose(artefact.probe, np.eye(3)), artefact.probe_diameter / 2)
    path = path_places(job, PLACES)
    progress(stages.TOUCHES_IN_REACH, 0.0)
    ways = reachable_ways(job.robot, job.posture, path.theta[len(path.theta) // 2], targets, probe, search)
    notes += unreached(artefact, targets, ways)
    _require_ways(ways, artefact, targets, count)
    progress(stages.TOUCHES_THAT_TELL, 0.3)
    model = touch_model(job, artefact, targets, place_sigma, probe, ways, path)
    along = np.broadcast_to(np.eye(3), (len(ways.target), 3, 3)) if search.centres else ways.normal[:, None]
    H, play = along @ model.rows, along @ model.play
    noise = sigma**2 * np.eye(H.shape[1]) + play @ np.swapaxes(play, 1, 2)
    plan = plan_touches(model.drift, H, noise, count)
    chosen = ways.subset(plan.chosen)
    left, coordinates = float(model.left.mean()), count * H.shape[1]
    rms = np.sqrt(np.maximum(plan.variance, 0.0) + left)
    notes += [
        *_gain_findings(coordinates, rms, count),
        *_tight_ways(job, probe, targets, chosen),
        *job.input_findings,
    ]
    can_anchor = coordinates >= LEAST_COORDINATES
    return PlannedTouches(
        job=job,
        artefact=artefact,
        targets=targets,
        ways=chosen,
        all_ways=ways,
        plan=plan,
        rms=rms,
        next_rms=float(np.sqrt(max(plan.next_variance, 0.0) + left)),
        p99=(_p99(model, model.prior), _p99(model, plan.covariance)),
        model=model,
        by_anchoring=left_by_anchoring(job, artefact, frame[1], chosen, sigma, path) if can_anchor else None,
        sigma=sigma,
        frame=frame[1],
        uframe=frame[0],
        findings=tuple(notes),
    )


def _require_ways(ways: Ways, artefact: Artefact, targets: Targets, count: int) -> None:
    """Raises ImpossibleError where the arm reaches fewer ways than touches are asked for."""
    if len(ways.target) < count:
        raise ImpossibleError(
            f"{artefact.source}: {len(ways.target)} ways to touch {', '.join(targets.name)} are in the arm's reach in "
            f"the program's posture, -n {count} asks for more; move the artefact, or give fewer"
        )


def _p99(model: TouchModel, S: Array) -> float:
    """What 99 % of the path stays below: the standard deviation of each place, all directions together [m]."""
    variance = np.einsum("miq,qr,mir->m", model.column, S, model.column) + model.left
    return float(np.quantile(np.sqrt(np.maximum(variance, 0.0)), 0.99, method="higher"))


def _gain_findings(coordinates: int, rms: Array, count: int) -> Iterator[Finding]:
    """Touches that are too few for a state, or more than gain much."""
    if coordinates < LEAST_COORDINATES:
        message = f"{coordinates} coordinates: cgen anchor asks for {LEAST_COORDINATES} at least; plan more touches"
        yield Finding.of(Code.TOUCHES_TOO_FEW, message)
    gain = 1 - rms[1:] / np.maximum(rms[:-1], 1e-15)
    useful = int(np.argmax(gain < USEFUL)) if (gain < USEFUL).any() else count
    if useful < count:
        yield Finding.of(
            Code.TOUCHES_MORE_THAN_USEFUL,
            f"from touch {useful + 1} on each gains less than {USEFUL:.0%}: -n {max(useful, 1)} leaves "
            f"{rms[max(useful, 1)] / UM:.1f} um where {count} leave {rms[-1] / UM:.1f}",
        )


def _tight_ways(job: Job, probe: Probe, targets: Targets, ways: Ways) -> Iterator[Finding]:
    """Names the joint motions between touches on which the probe passes near a target."""
    share = np.linspace(0.0, 1.0, TURNING)[:, None]
    lifted = ways.theta[:, 0]
    for n, after in [(beginning(ways), 0), *pairwise(range(len(lifted)))]:
        way = lifted[n] + (lifted[after] - lifted[n]) * share
        if job.robot.interference is not None and (job.robot.interference.clearance(way) < 0).any():
            message = f"between touches {n + 1} and {after + 1} J2 and J3 leave their polygon: teach a position between"
            yield Finding.of(Code.TOUCHES_WAY, message)
        gap = stem_gap(job.robot, targets, probe, way)
        s = int(np.argmin(gap))
        if gap[s] < NEAR:
            yield Finding.of(
                Code.TOUCHES_WAY,
                f"between touches {n + 1} and {after + 1} the probe passes {max(gap[s], 0.0) / MM:.0f} mm from "
                f"{targets.name[s]}: teach a position between",
            )


def beginning(ways: Ways) -> int:
    """Above which touch the program begins: on the way from there to the first most joints turn through their play."""
    turn = np.abs(ways.theta[:, 0] - ways.theta[0, 0])
    return int(np.minimum(turn, THROUGH).sum(axis=1).argmax())


def positions_of(planned: PlannedTouches, utool: int, *, stops: bool) -> TouchPositions:
    """The positions of the program, in its user frame."""
    job, ways = planned.job, planned.ways
    stages = list(STOPPED if stops else DRIVEN)
    rotation = np.repeat(ways.rotation, 3, axis=0)
    in_world = Pose(ways.position[:, stages].reshape(-1, 3), rotation)
    theta = ways.theta[:, stages].reshape(-1, 6)
    return TouchPositions(
        name=tuple(planned.targets.name[s] for s in ways.target.tolist()),
        begin=beginning(ways),
        pose=planned.frame.inverse() @ in_world,
        posture=job.posture,
        turns=turn_digits(job.robot, theta),
        uframe=planned.uframe,
        utool=utool,
        decimals=job.robot.controller.decimals,
    )


def write_touches(planned: PlannedTouches, name: str, date: str, utool: int, signal: Signal | None) -> bytes:
    """The program's text, proven.

    Args:
        planned: The touches.
        name: As the controller takes it.
        date: "YY-MM-DD".
        utool: Number of the probe's tool.
        signal: That ends a search; None: the program pauses at each touch.

    Raises:
        ImpossibleError: The text, read back, is not what was planned; names the position.
    """
    stops = signal is None
    text = touch_program(name, date, positions_of(planned, utool, stops=stops), signal)
    prove_touches(planned, text, utool, list(STOPPED if stops else DRIVEN))
    return text


def prove_touches(planned: PlannedTouches, text: bytes, utool: int, stages: list[int]) -> None:
    """Raises ImpossibleError where a text, read back, is not what was planned; names the position."""
    robot, ways = planned.job.robot, planned.ways
    probe = Pose(planned.artefact.probe, np.eye(3))
    frames = Frames({0: IDENTITY, planned.uframe: planned.frame}, {0: IDENTITY, utool: probe})
    poses = program_poses(loads(text), robot, frames)
    theta, position = ways.theta[:, stages].reshape(-1, 6), ways.position[:, stages].reshape(-1, 3)
    step, _ = resolution(robot.controller.decimals)
    same = np.linalg.norm(poses.tcp.position - position, axis=1) <= 2 * step
    same &= (np.abs(poses.theta - theta) <= SAME).all(axis=1) & (poses.margin > robot.elbow_margin)
    same &= (poses.theta >= robot.lower).all(axis=1) & (poses.theta <= robot.upper).all(axis=1)
    same &= poses.posture == ALL_POSTURES.index(planned.job.posture)
    if not same.all():
        n = int(np.argmin(same))
        raise ImpossibleError(
            f"the text's P[{n + 1}] is not the planned pose of touch {n // 3 + 1}; this is a fault of compgen"
        )
