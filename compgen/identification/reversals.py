r"""How far a joint turns until its play is through: half-width and width from reversal runs, and the law between them.

A reversal run turns one joint in small steps to either side of a turn while all others stand. On it a reflector moves
along a curve of the joint's angle, which a cubic follows to a micrometre over some degrees; what the joint lags behind
moves it along the curve's tangent:

    y(theta) = sum_{k=0}^{3} c_k theta^k - b u(theta; w) y'(theta)

u is the memory of the joint's motion (``direction_memory``) for the width w and a law. Each run and reflector has its
own c, and both c and b, which are linear or nearly so, are integrated out. The posterior of log w stands on a grid: its
mean is the width, its spread the width's uncertainty. The law is the one that all joints' rows give more evidence.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, get_args

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.units import DEG, MDEG
from compgen.error_model.direction_memory import direction_states, reversal_widths
from compgen.error_model.source import DirectionDependent, Law, ReversalWidths
from compgen.identification.measurements import PLACE, TOUCH, Measurements
from compgen.identification.model import SymbolicSource
from compgen.robot.robot import Robot

STEP = 2.5 * DEG  # a joint's longest step within a run
STILL = 1e-5  # rad: joints that turn less stand
LEAST_POSES = 8  # of a run
THROUGH = 0.95  # of a side: beyond, play is run through
DEGREE = 3  # of the curve
GRID = np.exp(np.linspace(np.log(0.01), np.log(1.0), 47)) * DEG  # of widths
KNOWN = 0.35  # largest sigma of a width's logarithm that is known, and of a half-width over itself
ASSUMED = 0.2 * DEG  # the width of a joint before any run
SPREAD = 0.7  # and the standard deviation of its logarithm
HALF = 8 * MDEG  # standard deviation of half-widths before any run


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class LostMotion:
    """What reversal runs tell of each joint."""

    law: Law
    width: Array  # (6,) [rad]; the one given where there is no run
    width_sigma: Array  # (6,) of its logarithm; infinite where runs do not tell
    half_width: Array  # (6,) [rad] b; NaN where it was not measured
    half_sigma: Array  # (6,) [rad]
    rows: IntArray  # (6,) measured places in runs of each joint

    @property
    def widths(self) -> ReversalWidths:
        """As the memory of a joint's motion takes them."""
        return ReversalWidths(self.width, np.full(3, np.inf), self.law)

    @property
    def measured(self) -> BoolArray:
        """Which joints' widths are known from runs, (6,)."""
        return np.asarray(np.isfinite(self.width_sigma))


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
    known = np.array([f.sigma < KNOWN and f.half > f.half_sigma / KNOWN for f in best])
    return LostMotion(
        law=law,
        width=np.where([f.rows > 0 for f in best], [f.width for f in best], assumed.joint),
        width_sigma=np.where(known, [f.sigma for f in best], np.inf),
        half_width=np.where(known, [f.half for f in best], np.nan),
        half_sigma=np.array([f.half_sigma for f in best]),
        rows=np.array([f.rows for f in best]),
    )


def has_runs(data: Measurements) -> bool:
    """Whether there are reversal runs among some measurements."""
    return next(_runs(data), None) is not None


def directions(theta: Array, motion: Array, widths: ReversalWidths) -> Array:
    """Direction of each joint at poses in the order driven, (M, 6) [-1, 1].

    Args:
        theta: (M, 6) [rad].
        motion: What ``pose_files.motion_directions`` says: rows of zeros begin anew.
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


def without_run_interiors(data: Measurements) -> Measurements:
    """Measurements without the poses of reversal runs on which a joint is between its sides.

    A run tells of one joint in one place: all its poses together would weigh that place as much as half a campaign.
    Those at which its joint is through its play count as any others.
    """
    inner = [m for joint, poses in _runs(data) for m in poses if abs(data.direction[m, joint]) < THROUGH]
    return data.subset(~np.isin(data.pose, inner))


def with_lost_motion(sources: Sequence[SymbolicSource], motion: LostMotion) -> list[SymbolicSource]:
    """The sources with the widths and the law that were measured, in the one that the joints' directions move."""

    def measured(source: Any) -> Any:
        joints = isinstance(source, DirectionDependent) and np.isfinite(source.reversal_widths().joint).all()
        return replace(source, width=motion.width, law=motion.law) if joints else source

    return [replace(s, source=measured(s.source), original=measured(s.original)) for s in sources]


def lost_motion_findings(robot: Robot, motion: LostMotion | None, fitted: Sequence[SymbolicSource]) -> list[Finding]:
    """What is said of widths: those that runs tell, and those that are held; nothing where no play was fitted."""
    widths = reversal_widths([s.original for s in fitted])
    if widths is None:
        return []
    names = robot.joint_names
    measured = motion.measured if motion is not None else np.zeros(6, dtype=bool)
    findings = []
    if motion is not None and measured.any():
        amounts = ", ".join(
            f"{names[i]} {motion.half_width[i] / MDEG:.2g} over {motion.width[i] / MDEG:.0f}"
            for i in np.flatnonzero(measured)
        )
        message = f"lost motion by reversal runs, half-width over width [mdeg], law {motion.law}: {amounts}"
        findings.append(Finding(Level.NOTE, Code.REVERSALS_WIDTH, message))
    held = np.flatnonzero(~measured)
    if len(held):
        amounts = ", ".join(f"{names[i]} {widths.joint[i] / MDEG:.0f}" for i in held)
        message = (
            "no reversal in small steps (plan-poses writes reversals.csv) tells how far these joints turn until their "
            f"play is through; held [mdeg]: {amounts}"
        )
        findings.append(Finding(Level.NOTE, Code.REVERSALS_HELD, message))
    return findings


def _runs(data: Measurements) -> Iterator[tuple[int, IntArray]]:
    """Joint and poses, in order, of each run: one joint alone moves, in small steps, and turns back on the way.

    An instrument saw all of its places: distances and touches tell no curve.
    """
    seen = np.isin(np.arange(len(data.theta)), data.pose[data.kind == PLACE])
    turn = np.diff(data.theta, axis=0)
    moves = np.abs(turn) > STILL
    alone = (moves.sum(axis=1) == 1) & (np.abs(turn).max(axis=1, initial=0.0) < STEP) & data.direction[1:].any(axis=1)
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
    parts = [part for poses in runs for part in _curves(data, poses, joint)]
    rows = sum(len(y) for *_, y in parts)
    free = 3 * rows - 3 * (DEGREE + 1) * len(parts) - 2
    if free < 3:
        return _JointFit(width=ASSUMED, sigma=np.inf, half=0.0, half_sigma=1.0, likelihood=0.0, rows=rows)
    sums = np.array([_sums(data, parts, joint, ReversalWidths(np.full(6, w), np.full(3, np.inf), law)) for w in GRID])
    square, product, lever = sums.T  # of y, of y and u y', and of u y', all without what the cubics take
    noise2 = float((square - product**2 / np.maximum(lever, 1e-30)).min()) / free
    weight = lever * HALF**2 / noise2
    chi2 = (square - product**2 / (lever + noise2 / HALF**2)) / noise2
    log_width = np.log(GRID)
    log = -0.5 * chi2 - 0.5 * np.log1p(weight) - 0.5 * ((log_width - np.log(ASSUMED)) / SPREAD) ** 2
    share = np.exp(log - log.max())
    share /= share.sum()
    middle = float(share @ log_width)
    halves = product / (lever + noise2 / HALF**2)
    half = float(share @ halves)
    spread = share @ (noise2 / (lever + noise2 / HALF**2) + (halves - half) ** 2)
    evidence = float(log.max() + np.log(np.exp(log - log.max()).sum()) - 1.5 * rows * np.log(noise2))
    sigma = float(np.sqrt(share @ (log_width - middle) ** 2))
    return _JointFit(
        width=float(np.exp(middle)),
        sigma=sigma,
        half=half,
        half_sigma=float(np.sqrt(spread)),
        likelihood=evidence,
        rows=rows,
    )


def _curves(data: Measurements, poses: IntArray, joint: int) -> Iterator[tuple[IntArray, Array, Array]]:
    """Of each reflector seen on a run: its poses, the joint's angle about their middle, and its places (n, 3)."""
    inside = np.isin(data.pose, poses)
    pairs = np.column_stack([data.reflector, data.instrument])
    for pair in np.unique(pairs[inside], axis=0):
        rows = np.flatnonzero(inside & (pairs == pair).all(axis=1))
        rows = rows[np.argsort(data.pose[rows], kind="stable")]
        if len(rows) > DEGREE + 3:
            yield data.pose[rows], data.theta[data.pose[rows], joint], data.position[rows]


def _sums(
    data: Measurements, parts: Sequence[tuple[IntArray, Array, Array]], joint: int, widths: ReversalWidths
) -> tuple[float, float, float]:
    """y.y, y.l and l.l of places y and what a half-width of one radian moves them by, l, cubics taken out of both."""
    side = directions(data.theta, data.direction, widths)[:, joint]
    square = product = lever = 0.0
    for poses, angle, place in parts:
        span = max(float(np.ptp(angle)), STILL)
        powers = ((angle - angle.mean()) / span)[:, None] ** np.arange(DEGREE + 1)
        c = np.linalg.lstsq(powers, place, rcond=None)[0]
        tangent = (powers[:, :-1] * np.arange(1, DEGREE + 1)) @ c[1:] / span
        keep = np.eye(len(angle)) - powers @ np.linalg.pinv(powers)
        left, moved = keep @ place, keep @ (-side[poses, None] * tangent)
        square += float((left**2).sum())
        product += float((left * moved).sum())
        lever += float((moved**2).sum())
    return square, product, lever
