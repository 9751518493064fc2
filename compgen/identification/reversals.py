r"""How far a joint turns until its play is through: half-width and width from reversal runs, and the law between them.

A reversal run turns one joint in small steps to either side of a turn while all others stand. On it a reflector moves
along a curve of the joint's angle, which a cubic follows to a micrometre over some degrees; what the joint lags behind
moves it along the curve's tangent:

    y(theta) = sum_{k=0}^{3} c_k theta^k - b u(theta; w) y'(theta)

u is the memory of the joint's motion (``direction_memory``) for the width w and a law. Each run and reflector has its
own c, and both c and b, which are linear or nearly so, are integrated out. The posterior of log w stands on a grid: its
mean is the width, its spread the width's uncertainty. The law is the one that all joints' rows give more evidence.
A place that Gaussian noise leaves so far from the best of all widths with 1 % chance on its run is set aside first.

A run tells of one joint in one posture, and what no model says there is the same at all its poses. In the fit of
everything else it counts as two poses, the farthest apart at which its joint is through its play, and as what it says
of the half-width,

    z = (b_run - b) / sigma,    sigma^2 = sigma_run^2 + (0.1 b_run)^2

the last for another load in another posture.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, get_args

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.units import DEG, MDEG
from compgen.error_model.direction_memory import direction_states, reversal_widths
from compgen.error_model.source import DirectionDependent, Law, ReversalWidths
from compgen.identification.measured_poses import SMALL
from compgen.identification.measurements import PLACE, TOUCH, Measurements
from compgen.identification.model import SymbolicSource
from compgen.identification.outliers import outlier_threshold
from compgen.robot.robot import Robot

STILL = 1e-5  # rad: joints that turn less stand
LEAST_POSES = 8  # of a run
THROUGH = 0.95  # of a side: beyond, play is run through
DEGREE = 3  # of the curve
GRID = np.exp(np.linspace(np.log(0.003), np.log(1.0), 59)) * DEG  # of widths
KNOWN = 0.35  # largest sigma of a width's logarithm that is known, and of a half-width over itself
ASSUMED = 0.2 * DEG  # the width of a joint before any run
SPREAD = 1.2  # and the standard deviation of its logarithm: full ways of 10 to 400 mdeg are usual
HALF = 8 * MDEG  # standard deviation of half-widths before any run
POSTURE = 0.1  # of a half-width: standard deviation between one posture and others [assumed]


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class LostMotion:
    """What reversal runs tell of each joint."""

    law: Law
    width: Array  # (6,) [rad]; the one given where there is no run
    width_sigma: Array  # (6,) of its logarithm; infinite where there is no run
    half_width: Array  # (6,) [rad] b; NaN where there is no run
    half_sigma: Array  # (6,) [rad]

    @property
    def widths(self) -> ReversalWidths:
        """As the memory of a joint's motion takes them."""
        return ReversalWidths(self.width, np.full(3, np.inf), self.law)

    @property
    def measured(self) -> BoolArray:
        """Which joints' widths are known from runs, (6,)."""
        return np.asarray((self.width_sigma < KNOWN) & (np.abs(self.half_width) > self.half_sigma / KNOWN))


def fit_lost_motion(data: Measurements, assumed: ReversalWidths | None) -> LostMotion | None:
    """Width, half-width and law from the reversal runs among some measurements; None where there is no run.

    Args:
        data: With the joints of each pose in the order in which they were measured.
        assumed: For the joints without a run; None where no play can be fitted.
    """
    runs = list(_runs(data))
    if not runs or assumed is None:
        return None
    fitted = {
        law: [_fit_joint(data, [r for j, r in runs if j == joint], joint, law) for joint in range(6)]
        for law in get_args(Law)
    }
    likelihood = {law: sum(f.likelihood for f in joints) for law, joints in fitted.items()}
    law: Law = "play" if likelihood["play"] > likelihood["dahl"] else "dahl"
    best = fitted[law]
    return LostMotion(
        law=law,
        width=np.where([f.rows > 0 for f in best], [f.width for f in best], assumed.joint),
        width_sigma=np.array([f.sigma for f in best]),
        half_width=np.where([f.rows > 0 for f in best], [f.half for f in best], np.nan),
        half_sigma=np.array([f.half_sigma for f in best]),
    )


def has_runs(data: Measurements) -> bool:
    """Whether there are reversal runs among some measurements."""
    return next(_runs(data), None) is not None


def directions(theta: Array, motion: Array, widths: ReversalWidths) -> Array:
    """Direction of each joint at poses in the order driven, (M, 6) [-1, 1].

    Args:
        theta: (M, 6) [rad].
        motion: What ``measured_poses.motion_directions`` says: rows of zeros begin anew.
        widths: Over which the joints turn round.
    """
    result = np.zeros_like(theta)
    starts = [*np.flatnonzero(~motion.any(axis=1)).tolist(), len(theta)]
    for first, end in zip(starts[:-1], starts[1:], strict=True):
        result[first:end] = direction_states(widths, theta[first:end], np.zeros((end - first, 3))).direction
    return result


def with_directions(data: Measurements, widths: ReversalWidths) -> Measurements:
    """Measurements whose poses say how far each joint is through its play.

    A probe that touches from one side has come along its direction, however the pose before was.
    """
    direction = directions(data.theta, data.direction, widths)
    probing = data.pose[(data.kind == TOUCH) & (data.numbers == 1)]
    direction[probing] = data.direction[probing]
    return replace(data, direction=direction)


def with_runs_as_poses(data: Measurements, motion: LostMotion) -> Measurements:
    """Measurements in which a reversal run is two poses, through the play of its joint, and a half-width.

    All its poses together would weigh one place as much as half a campaign, and agree there better than any model.
    """
    runs, inner = list(_runs(data)), list[int]()
    data = with_directions(data, motion.widths)
    for joint, poses in runs:
        through = poses[np.abs(data.direction[poses, joint]) >= THROUGH]
        order = through[np.argsort(data.theta[through, joint])]
        inner += np.setdiff1d(poses, order[[0, -1]] if len(order) else poses[-1]).tolist()
    half_width = np.column_stack([motion.half_width, np.hypot(motion.half_sigma, POSTURE * motion.half_width)])
    return replace(data.subset(~np.isin(data.pose, inner)), half_width=half_width)


def with_lost_motion(sources: Sequence[SymbolicSource], motion: LostMotion) -> list[SymbolicSource]:
    """The sources with the widths and the law that were measured, in the one that the joints' directions move."""

    def measured(source: Any) -> Any:
        joints = isinstance(source, DirectionDependent) and np.isfinite(source.reversal_widths().joint).all()
        return replace(source, width=motion.width, law=motion.law) if joints else source

    return [replace(s, source=measured(s.source), original=measured(s.original)) for s in sources]


def lost_motion_findings(
    robot: Robot, motion: LostMotion | None, fitted: Sequence[SymbolicSource]
) -> Iterator[Finding]:
    """What is said of widths: those that runs tell, and those that are held; nothing where no play was fitted."""
    widths = reversal_widths([s.original for s in fitted])
    if widths is None:
        return
    names = robot.joint_names
    measured = motion.measured if motion is not None else np.zeros(6, dtype=bool)
    if motion is not None and measured.any():
        amounts = ", ".join(
            f"{names[i]} {motion.half_width[i] / MDEG:.2g} over {motion.width[i] / MDEG:.0f}"
            for i in np.flatnonzero(measured)
        )
        message = f"lost motion by reversal runs, half-width over width [mdeg], law {motion.law}: {amounts}"
        yield Finding.of(Code.REVERSALS_WIDTH, message)
    has_run = np.zeros(6, dtype=bool) if motion is None else np.isfinite(motion.half_width)
    for joints, reason in (
        (
            ~has_run,
            f"held, for want of reversals in small steps with all others of {', '.join(names)} at rest, as "
            "reversals.csv of plan-poses has them",
        ),
        (has_run & ~measured, "likely by their reversals, which show too little play for the noise"),
    ):
        if joints.any():
            amounts = ", ".join(f"{names[i]} {widths.joint[i] / MDEG:.0f}" for i in np.flatnonzero(joints))
            yield Finding.of(
                Code.REVERSALS_HELD,
                f"how far joints turn until their play is through [mdeg]: {amounts}: {reason}",
            )


def _runs(data: Measurements) -> Iterator[tuple[int, IntArray]]:
    """Joint and poses, in order, of each run: one joint alone moves, in small steps, and turns back on the way.

    An instrument saw all of its places: distances and touches tell no curve.
    """
    seen = np.isin(np.arange(len(data.theta)), data.pose[data.kind == PLACE])
    turn = np.diff(data.theta, axis=0)
    moves = np.abs(turn) > STILL
    alone = (moves.sum(axis=1) == 1) & (np.abs(turn).max(axis=1, initial=0.0) < SMALL) & data.direction[1:].any(axis=1)
    joint = np.where(alone, np.argmax(moves, axis=1), -1)
    begin = 0
    for m in range(1, len(joint) + 1):
        if m < len(joint) and joint[m] == joint[begin]:
            continue
        poses = np.arange(begin, m + 1)
        i = int(joint[begin])
        if i >= 0 and seen[poses].all() and len(poses) >= LEAST_POSES and len(set(np.sign(turn[begin:m, i]))) == 2:
            yield i, poses
        begin = m


@dataclass(frozen=True, slots=True, kw_only=True)
class _JointFit:
    width: float
    sigma: float  # of the logarithm of the width
    half: float
    half_sigma: float
    likelihood: float
    rows: int


def _fit_joint(data: Measurements, runs: Sequence[IntArray], joint: int, law: Law) -> _JointFit:
    """One joint's width by its runs."""
    sides = {each: _sides(data, joint, each) for each in get_args(Law)}
    rows, curve = _without_wild(data, *_curves(data, runs), joint, np.concatenate(list(sides.values())))
    free = _free(curve)
    if free < 3:
        return _JointFit(width=ASSUMED, sigma=np.inf, half=0.0, half_sigma=1.0, likelihood=0.0, rows=0)
    left, moved, _ = _without_cubics(data, rows, curve, joint, sides[law])
    square, product, lever = (float((left**2).sum()), (left * moved).sum(axis=(1, 2)), (moved**2).sum(axis=(1, 2)))
    noise2 = float((square - product**2 / np.maximum(lever, 1e-30)).min()) / free
    chi2 = (square - product**2 / (lever + noise2 / HALF**2)) / noise2
    log_width = np.log(GRID)
    log = -0.5 * chi2 - 0.5 * np.log1p(lever * HALF**2 / noise2) - 0.5 * ((log_width - np.log(ASSUMED)) / SPREAD) ** 2
    share = np.exp(log - log.max())
    share /= share.sum()
    middle = float(share @ log_width)
    halves = product / (lever + noise2 / HALF**2)
    half = float(share @ halves)
    spread = share @ (noise2 / (lever + noise2 / HALF**2) + (halves - half) ** 2)
    return _JointFit(
        width=float(np.exp(middle)),
        sigma=float(np.sqrt(share @ (log_width - middle) ** 2)),
        half=half,
        half_sigma=float(np.sqrt(spread)),
        likelihood=float(log.max() + np.log(np.exp(log - log.max()).sum()) - 1.5 * len(rows) * np.log(noise2)),
        rows=len(rows),
    )


def _curves(data: Measurements, runs: Sequence[IntArray]) -> tuple[IntArray, IntArray]:
    """Rows of the places on runs, (n,), and the curve of each: that of a reflector on a run."""
    run = np.full(len(data.theta), -1)
    for number, poses in enumerate(runs):
        run[poses] = number
    rows = np.flatnonzero(run[data.pose] >= 0)
    columns = run[data.pose[rows]], data.reflector[rows], data.instrument[rows]
    _, curve, count = np.unique(np.column_stack(columns), axis=0, return_inverse=True, return_counts=True)
    long = count[curve.ravel()] > DEGREE + 3
    return rows[long], curve.ravel()[long]


def _sides(data: Measurements, joint: int, law: Law) -> Array:
    """Direction of a joint at all poses for each width of the grid, (W, M)."""
    widths = [ReversalWidths(np.full(6, width), np.full(3, np.inf), law) for width in GRID]
    return np.array([directions(data.theta, data.direction, w)[:, joint] for w in widths])


def _free(curve: IntArray) -> int:
    """How many numbers are left beside cubics, a width and a half-width."""
    return 3 * len(curve) - 3 * (DEGREE + 1) * len(np.unique(curve)) - 2


def _without_cubics(
    data: Measurements, rows: IntArray, curve: IntArray, joint: int, sides: Array
) -> tuple[Array, Array, Array]:
    """What the cubic of each curve leaves of places (n, 3), of what a half-width moves them by, and of itself.

    Args:
        data: Whose rows they are.
        rows: (n,).
        curve: Of each row, (n,).
        joint: That moves.
        sides: Where it is in its play at all poses, (W, M).

    Returns:
        Places (n, 3) [m]; per radian of half-width (W, n, 3) [m]; the share of a row that is not taken up, (n,).
    """
    angle, place, of_curve = data.theta[data.pose[rows], joint], data.position[rows], np.eye(curve.max() + 1)[curve]
    angle = angle - (angle @ of_curve / np.maximum(of_curve.sum(axis=0), 1))[curve]
    span = max(float(np.ptp(angle)), STILL)
    powers = (angle / span)[:, None] ** np.arange(DEGREE + 1)
    slopes = np.column_stack([0 * angle, np.arange(1, DEGREE + 1) * powers[:, :-1] / span])
    cubics, tangents = ((p[:, None, :] * of_curve[:, :, None]).reshape(len(rows), -1) for p in (powers, slopes))
    inverse = np.linalg.pinv(cubics)
    keep = np.eye(len(rows)) - cubics @ inverse
    moved = -sides[:, data.pose[rows], None] * (tangents @ (inverse @ place))
    return keep @ place, keep @ moved, np.diag(keep)


def _without_wild(
    data: Measurements, rows: IntArray, curve: IntArray, joint: int, sides: Array
) -> tuple[IntArray, IntArray]:
    """Rows and their curves without places that no width explains, the wildest first.

    Without a row that leaves e, of which a cubic takes h up, the sum of squares is |e|^2 / (1 - h) less.
    """
    while (free := _free(curve) - 3) > 0:
        left, moved, share = _without_cubics(data, rows, curve, joint, sides)
        half = (left * moved).sum(axis=(1, 2)) / np.maximum((moved**2).sum(axis=(1, 2)), 1e-30)
        squares = ((left - half[:, None, None] * moved) ** 2).sum(axis=2)
        best = squares[np.argmin(squares.sum(axis=1))]
        n = int(np.argmax(best / share))
        wild = best[n] / share[n]
        if wild * free <= outlier_threshold(len(rows)) * (best.sum() - wild):
            break
        rows, curve = np.delete(rows, n), np.delete(curve, n)
    return rows, curve
