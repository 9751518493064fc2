r"""Times of a controller's smoothing from a log, of each kind of controller that is tried, on some of the log's blocks.

Least squares on the distance of rows from the smoothed curve. Two times T_1, T_2 of one kind are fitted as

    s = T_1^2 + T_2^2,      q = ((T_1^2 - T_2^2) / s)^2

s is what a steady circle shows, v^2 sigma^2 / (2 R) with sigma^2 = s / 12 of means and s of lags; q only shows where
curvature changes: T_1^4 + T_2^4 = s^2 (1 + q) / 2, so equal times, q = 0, are no special place of the fit. Their
uncertainty is that of blocks of rows that scatter together.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from scipy.optimize import least_squares
from scipy.special import ndtri, stdtrit

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.units import UM
from compgen.robot.motion import ControllerMotion

Residuals = Callable[[ControllerMotion], Array]

LONGEST = {"means": 0.8, "lags": 0.25}  # [s] root of s
STARTS = (0.03, 0.1, 0.25, 0.5)  # of that, as shares, from which a fit begins
CLOSE, TRIED = tuple(np.linspace(0.1, 0.9, 41).tolist()), 4  # the same where motions wait by steps: behind CNT n < 100
ACROSS = 2  # coordinates square to the path that a row has
FEWEST = 2.5  # blocks that tell a number
STEP = 1e-3  # of the two numbers, for slopes
EVEN = 0.3  # q from which the fit of two times begins
ALIKE, GROWS = 0.03, 0.03  # q, and [1/m2], from which that of two means that grow begins: an M-900iA/350's
DRAWS = 400  # of the fitted numbers, for intervals of the times


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of controller: how many moving means or first-order lags, and in which space."""

    space: Literal["cartesian", "joint"]
    filters: Literal["means", "lags"]
    count: int
    reach_at: float | None = None  # [m2] spread of the arm by which the times grow from line to line; None: all alike

    @property
    def words(self) -> str:
        """The kind for a reader."""
        if not self.count:
            return "no smoothing"
        number = "one" if self.count == 1 else "two"
        filters = "moving mean" if self.filters == "means" else "first-order lag"
        space = "joints" if self.space == "joint" else "Cartesian"
        grow = "" if self.reach_at is None else ", where the arm is spread widest; shorter elsewhere"
        return f"{number} {filters}{'s' if self.count > 1 else ''} in {space}{grow}"

    def includes(self, other: "Kind") -> bool:
        """Whether every controller of another kind is one of this."""
        if not other.count:
            return True
        return (other.space, other.filters) == (self.space, self.filters) and other.count <= self.count


NOTHING = Kind("cartesian", "means", 0)


@dataclass(frozen=True, eq=False, slots=True)
class KindFit:
    """The best controller of a kind, on some blocks."""

    kind: Kind
    numbers: Array  # (p,) s [s2] and, of two times, q; then by what share they grow [1/m2]
    held_out: Array  # (B,) mean square of the residual in each block that was held out [m2]

    @property
    def motion(self) -> ControllerMotion:
        """The controller."""
        return motion_named(self.kind, self.numbers)

    @property
    def rms(self) -> float:
        """On the blocks held out, of one coordinate square to the path [m]."""
        return float(np.sqrt(np.mean(self.held_out) / 2))


def motion_named(kind: Kind, numbers: Array) -> ControllerMotion:
    """The controller of a kind that numbers name."""
    times = times_of(kind, numbers)
    if kind.filters == "means":
        if kind.reach_at is None:
            return ControllerMotion(space=kind.space, moving_averages=times)
        return ControllerMotion(moving_averages=times, reach=float(numbers[2]), reach_at=kind.reach_at)
    return ControllerMotion(space=kind.space, first_orders=times)


def times_of(kind: Kind, numbers: Array) -> tuple[float, ...]:
    """The times, the longer first [s]."""
    if not kind.count:
        return ()
    s = max(float(numbers[0]), 0.0)
    if kind.count == 1:
        return (float(np.sqrt(s)),)
    d = float(np.sqrt(np.clip(numbers[1], 0.0, 1.0)))
    return float(np.sqrt(s * (1 + d) / 2)), float(np.sqrt(s * (1 - d) / 2))


def variance_of(kind: Kind, numbers: Array) -> float:
    """Sigma^2 of the smoothing [s2]: s / 12 of moving means, s of first-order lags."""
    return float(numbers[0]) / (12 if kind.filters == "means" else 1) if kind.count else 0.0


def fit_kind(
    kind: Kind,
    residuals: Residuals,
    fitted: BoolArray,
    block: IntArray,
    start: Array | None = None,
    shares: Sequence[float] = STARTS,
) -> KindFit:
    """The best controller of a kind on fitted rows, and what it leaves in the others' blocks.

    Args:
        kind: To fit.
        residuals: Of a controller, (R, k) [m].
        fitted: Rows to fit, (R,).
        block: Of each row, (R,).
        start: Numbers to begin with; default several.
        shares: Of the longest, from which those begin; of many the best few are solved.
    """
    numbers = np.zeros(0)
    if kind.count:
        size = kind.count + (kind.reach_at is not None)
        even, tried = (EVEN, 1) if shares == STARTS else (ALIKE, TRIED)
        usual = [np.array([(share * LONGEST[kind.filters]) ** 2, even, GROWS][:size]) for share in shares]
        cost = partial(_cost, kind, residuals, fitted)
        starts = sorted(usual, key=cost)[:tried] if start is None else [start]
        solved = [_solve(kind, residuals, fitted, each) for each in starts]
        numbers = solved[0] if len(solved) == 1 else min(solved, key=cost)
    left = residuals(motion_named(kind, numbers))
    squares = (left**2).sum(axis=1)[~fitted]
    _, which = np.unique(block[~fitted], return_inverse=True)
    return KindFit(kind, numbers, np.bincount(which, squares) / np.maximum(np.bincount(which), 1))


def _cost(kind: Kind, residuals: Residuals, fitted: BoolArray, numbers: Array) -> float:
    return float((residuals(motion_named(kind, numbers))[fitted] ** 2).sum())


def _solve(kind: Kind, residuals: Residuals, fitted: BoolArray, start: Array) -> Array:
    """Least squares in the root of s and in q."""
    longest = LONGEST[kind.filters]

    def function(x: Array) -> Array:
        return residuals(motion_named(kind, _scaled(x, longest)))[fitted].ravel() / UM

    x = np.array([np.sqrt(start[0]) / longest, *start[1:]])
    solved = least_squares(function, x, bounds=(0.0, 1 + 1e-9), diff_step=STEP, xtol=1e-6, ftol=1e-9)
    return _scaled(solved.x, longest)


def _scaled(x: Array, longest: float) -> Array:
    return np.array([(x[0] * longest) ** 2, *np.clip(x[1:], 0.0, 1.0)])


def covariance(fit: KindFit, residuals: Residuals, block: IntArray) -> Array:
    """Covariance of a fit's numbers, (p, p): blocks of rows scatter together, and rows for themselves.

    A bend that few blocks have tells a time by few of them: Student's t for their number, as a normal's.
    """
    base = residuals(fit.motion)
    slopes = []
    for k in range(len(fit.numbers)):
        step = np.zeros(len(fit.numbers))
        step[k] = STEP * max(float(fit.numbers[k]), 0.05 if k else 1e-5)
        if k and fit.numbers[k] + step[k] > 1:
            step[k] = -step[k]
        slopes.append((residuals(motion_named(fit.kind, fit.numbers + step)) - base).ravel() / step[k])
    A = np.column_stack(slopes)
    scale = np.sqrt((A**2).sum(axis=0))
    scale = np.where(scale > 0, scale, 1.0)
    A /= scale
    inverse = np.linalg.pinv(A.T @ A, rcond=1e-12)
    _, which = np.unique(np.repeat(block, base.shape[1]), return_inverse=True)
    sums, shares = (
        np.column_stack([np.bincount(which, column) for column in each.T]) for each in (A * base.ravel()[:, None], A**2)
    )
    meat = sums.T @ sums + A.T @ A * float((base**2).sum()) / len(base) / ACROSS  # rows that scatter for themselves
    telling = np.maximum(1 / np.maximum((shares**2).sum(axis=0), 1 / len(shares)), FEWEST)  # blocks that tell each
    few = stdtrit(telling - 1, 0.975) / ndtri(0.975)
    spread = inverse @ meat @ inverse * np.outer(few, few)
    return np.asarray(spread / np.outer(scale, scale))


def draws(numbers: Array, spread: Array) -> Array:
    """Draws of fitted numbers, the same ones every time, (D, p)."""
    values, vectors = np.linalg.eigh((spread + spread.T) / 2)
    unit = np.random.default_rng(1).normal(size=(DRAWS, len(numbers)))
    draws = numbers + unit * np.sqrt(np.clip(values, 0, None)) @ vectors.T
    draws[:, 0] = np.clip(draws[:, 0], 0, None)
    if draws.shape[1] > 1:
        draws[:, 1] = np.clip(draws[:, 1], 0, 1)
    return np.asarray(draws)
