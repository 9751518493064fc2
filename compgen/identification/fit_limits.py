r"""What a fit leaves that its parameters' covariance does not say, and how well the whole foretells later measurements.

Rows of a pose share what the arm does there and no model says. From how residuals differ between poses and within them,

    within: s^2,   between: s^2 (1 + n rho),        tau^2 + s_r^2 = rho s^2

s is the instrument's, s_r what poses driven to again tell (repeatability), tau what is left: fit noise.

In time's order the last two thirds of the poses are foretold, block by block, from all before, with the fit's scales
and the noise that poses had until then. Blocks that are warmer than what they are foretold from tell what thermal
physics misses, kappa of what warmth does, g:

    |e|^2 / 3 = (expected) + kappa^2 g^2        by least squares over the poses, weighted by their variances v
    kappa^2 = sum x g^2 / v  /  sum g^4 / v,    sigma^2 = 1 / sum g^4 / v,    x = |e|^2 / 3 - (expected)

Neither rho nor tau^2 nor kappa^2 is below nothing, so the mean given that is taken: an arm that happens to show none is
not free of it, and no other share is assumed beside what was measured.

and lambda is the rms over blocks of the mean deviation m of a block over all that is known of it,

    lambda^2 = mean_b  m_b' S_b^-1 m_b / 3,     S_b = cov(m_b) from C, s, rho and kappa
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import log_ndtr

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.units import PERCENT, UM
from compgen.identification.evidence import NU
from compgen.identification.fit import SETTLED, Fit, pose_noise
from compgen.identification.measurements import NONE, PLACE, Measurements
from compgen.identification.model import ArmModel
from compgen.job.tables import FitLimits

KNOWN_FIRST = 1 / 3  # share of the poses that is never foretold
MOST_BLOCKS = 12
LEAST_POSES = 3  # of a block
FEW_BLOCKS = 8  # fewer say little of lambda
LARGEST_SCALE = 3.0  # of lambda: beyond, the fit does not foretell
WARMTH = 20e-6  # [m] that warmth must move some pose by, to tell kappa
SAME_POSE = 1e-4  # [rad] of each joint
SAME_RISE = 0.3  # [K]
WIDEST = 2.0  # times, that few numbers widen the scale of a group
NOTHING = 1e-18  # [m^2] of a variance's standard deviation
LEAST_REPEATS = 9.0  # degrees of freedom of poses driven to again


@dataclass(frozen=True, eq=False, slots=True)
class _Forecast:
    """A block's rows as they are foretold."""

    pose: IntArray  # (n,) of each row
    measured: BoolArray  # (n, 3) which coordinates; a distance stands in the first
    deviation: Array  # (n, 3) [m]
    covariance: Array  # (3 n, 3 n) [m^2] without kappa


@dataclass(frozen=True, slots=True)
class _Repeats:
    """What visits to the same poses tell."""

    variance: float  # [m^2] of a coordinate between visits, less the instrument's
    spread: float  # [m^2] its standard deviation
    share: float  # of the numbers by which poses tell what their rows share

    def spread_of_rest(self, spread: float) -> float:
        """Standard deviation of what is left of a variance known to +- spread, in which the visits count, [m^2].

        cov = share spread_visits^2, so that spread^2 + (1 - 2 share) spread_visits^2 is that of the difference.
        """
        square = spread**2 + (1 - 2 * self.share) * self.spread**2
        return max(float(np.sqrt(max(square, 0.0))), (1 - self.share) * self.spread, NOTHING)


def assess_fit_limits(model: ArmModel, data: Measurements, fitted: Fit, *, temperatures: bool) -> FitLimits:
    """What a fit leaves, from its residuals and from forecasts.

    Args:
        model: The arm with symbols.
        data: What was measured.
        fitted: The fit that was selected.
        temperatures: Whether those of the warm-up were measured; else nothing warm is known.
    """
    (shared, spread), repeats = _pose_variance(data, fitted), _repeat_variance(data, fitted)
    again = repeats or _Repeats(0.0, 0.0, 0.0)
    forecasts = _forecasts(model, data, fitted)
    warmth = _warmth(model, data, fitted)
    missing = _missing(forecasts, warmth) if temperatures and warmth.max(initial=0.0) > WARMTH else None
    scores = [_score(f, (missing or 0.0) * warmth) for f in forecasts]
    return FitLimits(
        noise=float(np.sqrt(mean_if_not_negative(shared - again.variance, again.spread_of_rest(spread)))),
        missing=missing,
        repeatability=None if repeats is None else float(np.sqrt(repeats.variance)),
        scale=max(float(np.sqrt(np.mean(scores))), 1.0) if scores else 1.0,
        blocks=len(scores),
    )


def with_uncertain_scales(model: ArmModel, data: Measurements, fitted: Fit) -> Fit:
    r"""A fit whose covariance counts that the scales of its groups are known from few numbers.

    With n numbers that tell a scale, what a parameter is about nominal follows Student's t with n degrees of freedom,
    whose variance is that of the Gaussian with the scale learnt, times n / (n - 2):

        lambda_g -> lambda_g n_g / (n_g - 2),    n_g = nu + sum_g gamma,    at most WIDEST times, below its ceiling

    Values stay. It matters where a scale is all that holds a combination: what a gear does about the middle of a
    joint's range turns World as its zero would, and no pose tells them apart.

    Args:
        model: The arm with symbols.
        data: What was measured.
        fitted: The fit; its values stay.
    """
    K = int(fitted.active.sum())
    if not K:
        return fitted
    problem, scales = fitted.problem(model, data), fitted.posterior.scales
    n = NU + np.bincount(problem.prior.group, fitted.posterior.gamma, len(scales.group))
    factor = np.minimum(n / np.maximum(n - 2, 1e-9), WIDEST)
    wider = np.minimum(scales.group * factor, np.maximum(model.ceiling, scales.group))
    solution = replace(problem, scales=replace(scales, group=wider)).solve()
    sigma, gamma = fitted.sigma.copy(), fitted.gamma.copy()
    sigma[fitted.active] = model.prior[fitted.active] * np.sqrt(np.diag(solution.covariance)[:K])
    gamma[fitted.active] = solution.gamma
    return replace(fitted, posterior=replace(solution, x=fitted.posterior.x), sigma=sigma, gamma=gamma)


def fit_limits_record(limits: FitLimits) -> dict[str, float | int]:
    """As the robot file has them; what is not known is left out."""
    values = {
        "fit_noise_um": limits.noise / UM,
        "thermal_missing_percent": None if limits.missing is None else limits.missing / PERCENT,
        "repeatability_um": None if limits.repeatability is None else limits.repeatability / UM,
        "forecast_scale": min(limits.scale, 100.0),
    }
    numbers: dict[str, float | int] = {key: float(f"{v:.4g}") for key, v in values.items() if v is not None}
    return {**numbers, "forecast_blocks": limits.blocks}


def forecast_findings(limits: FitLimits, *, warm: bool) -> list[Finding]:
    """What a user must know of the forecasts; a fit of a warm arm that does not foretell is refused.

    Of a cold one it is a warning: over many poses even a small misfit of the model, the same at neighbouring poses, is
    far above what is known of a block's mean, and the band is scaled by it.
    """
    scale, blocks = limits.scale, limits.blocks
    if scale > LARGEST_SCALE:
        message = (
            f"{blocks} blocks of measurements, each foretold from those before, lie {scale:.1f} times further off than "
            f"all that is known of the fit allows ({LARGEST_SCALE:g} may be): did instrument, reflector or base move, "
            "is the log another warm-up's? measure again"
        )
        if not warm:
            return [Finding(Level.WARNING, Code.FORECAST, f"{message}; the band is scaled by it")]
        return [Finding(Level.REFUSED, Code.FORECAST, message)]
    if blocks < FEW_BLOCKS:
        poses = round(FEW_BLOCKS * LEAST_POSES / (1 - KNOWN_FIRST))
        message = (
            f"{blocks} blocks of measurements could be foretold from those before; {FEW_BLOCKS} or more say how far "
            f"the fit's own band may be trusted (scaled by {scale:.2f}): measure {poses} poses or more"
        )
        return [Finding.of(Code.FORECAST_FEW, message)]
    return []


def _pose_variance(data: Measurements, fitted: Fit) -> tuple[float, float]:
    """Variance of what the rows of a pose share, as found, and its standard deviation, of a coordinate [m^2].

    All noise where poses have one row each; how well that is known counts for nothing.
    """
    rows = ~fitted.outlier & (data.kind == PLACE)
    noise = pose_noise(data, fitted.linear.z, rows, float(fitted.gamma.sum()))
    return (fitted.noise**2, 0.0) if noise is None else (noise.rho * noise.variance, noise.spread * noise.variance)


def mean_if_not_negative(value: float, sigma: float) -> float:
    r"""Mean of what was found as value +- sigma, given that it is not below nothing.

    Of a normal distribution that is cut off at zero:

        value + sigma phi(z) / Phi(z),    z = value / sigma

    Args:
        value: As found, of either sign.
        sigma: Its standard deviation, above nothing.
    """
    z = value / sigma
    return max(value + sigma * float(np.exp(-(z**2) / 2 - log_ndtr(z)) / np.sqrt(2 * np.pi)), 0.0)


def _repeat_variance(data: Measurements, fitted: Fit) -> _Repeats | None:
    """What visits to the same poses tell; None with too few of them."""
    same = np.round(np.column_stack([data.theta / SAME_POSE, data.rise / SAME_RISE, np.sign(data.direction)]))
    _, group = np.unique(same, axis=0, return_inverse=True)
    kept = ~fitted.outlier & (data.kind == PLACE)
    visits = np.unique(np.column_stack([group.ravel()[data.pose[kept]], data.pose[kept]]), axis=0)
    several = np.flatnonzero(np.bincount(visits[:, 0]) > 1).tolist()
    squares = freedom = instrument = 0.0
    for g in several:
        rows = [np.flatnonzero(kept & (data.pose == m)) for m in visits[visits[:, 0] == g, 1]]
        means = np.array([fitted.linear.z[row].mean(axis=0) for row in rows])
        squares += float(((means - means.mean(axis=0)) ** 2).sum())
        freedom += 3.0 * (len(rows) - 1)
        of_mean = [float((data.sigma[row] ** 2).sum()) / len(row) ** 2 for row in rows]
        instrument += 3.0 * (len(rows) - 1) * float(np.mean(of_mean))
    if freedom < LEAST_REPEATS:
        return None
    variance = (squares - instrument * float(fitted.posterior.scales.noise[PLACE])) / freedom
    spread = squares / freedom * float(np.sqrt(2 / freedom))
    return _Repeats(max(variance, 0.0), spread, freedom / (3 * len(visits)))


def forecast_blocks(data: Measurements) -> tuple[IntArray, int]:
    """The block of each pose in time, (M,), and how many are foretold; -1 before the first, -2 where nothing is."""
    measured = np.unique(data.pose)
    order = measured[np.argsort(data.time[measured], kind="stable")]
    first = round(KNOWN_FIRST * len(order))
    later = order[first:]
    count = min(MOST_BLOCKS, len(later) // LEAST_POSES)
    block = np.full(len(data.theta), -2)
    block[order[:first]] = -1
    block[later] = np.arange(len(later)) * count // max(len(later), 1)
    return block, count


def _forecasts(model: ArmModel, data: Measurements, fitted: Fit) -> list[_Forecast]:
    problem, scales = fitted.problem(model, data), fitted.posterior.scales
    of_pose, count = forecast_blocks(data)
    # a distance between two poses is known with the later one
    later = of_pose[np.where(data.ends.pose == NONE, data.pose, data.ends.pose)]
    block = np.maximum(of_pose[data.pose], later)

    result = []
    for b in range(count):
        before, rows = block < b, (block == b) & ~fitted.outlier
        if not rows.any() or not before.any():
            continue
        rho, known = scales.rho, problem.solve(problem.equations(before))
        places = before & ~fitted.outlier & (data.kind == PLACE)
        noise = pose_noise(data, problem.left(known.x), places, float(known.gamma.sum()))
        until_then = rho if noise is None else mean_if_not_negative(noise.rho, noise.spread)
        if abs(until_then - rho) > SETTLED * (1 + rho):
            rho, known = until_then, problem.solve(problem.equations(before, until_then))
        A, pose, kind = problem.linear.A[rows], data.pose[rows], data.kind[rows]
        flat = A.reshape(-1, A.shape[2])
        together = (pose[:, None] == pose) & (kind[:, None] == PLACE) & (kind == PLACE)
        of_rows = np.sqrt(np.outer(scales.noise[kind], scales.noise[kind]))
        of_rows *= np.diag(data.sigma[rows] ** 2) + rho * together
        covariance = flat @ known.covariance @ flat.T + np.kron(of_rows, np.eye(3))
        result.append(_Forecast(pose, A.any(axis=2), problem.left(known.x, rows), covariance))
    return result


def _warmth(model: ArmModel, data: Measurements, fitted: Fit) -> Array:
    """How far warmth moves the flange at each pose, (M,) [m]."""
    cold = replace(data, rise=0 * data.rise, lag=0 * data.lag, warm=0 * data.warm)
    return np.asarray(np.linalg.norm(model.pose(data, fitted.p)[0] - model.pose(cold, fitted.p)[0], axis=1))


def _missing(forecasts: list[_Forecast], warmth: Array) -> float | None:
    """kappa, from poses of which all coordinates were measured; None without any."""
    product = square = 0.0
    for forecast in forecasts:
        for m in np.unique(forecast.pose[forecast.measured.all(axis=1)]):
            mean, covariance = _mean(forecast, forecast.pose == m)
            excess = (float(mean @ mean) - float(np.trace(covariance))) / 3
            variance = 2 * float((covariance**2).sum()) / 9
            product += excess * warmth[m] ** 2 / variance
            square += warmth[m] ** 4 / variance
    return float(np.sqrt(mean_if_not_negative(product / square, square**-0.5))) if square > 0 else None


def _score(forecast: _Forecast, missing: Array) -> float:
    """m' S^-1 m of a block, over its numbers; ``missing`` [m] is what thermal physics may miss at each pose, (M,)."""
    mean, covariance = _mean(forecast, np.ones(len(forecast.pose), dtype=bool))
    share = np.bincount(forecast.pose, minlength=len(missing)) / len(forecast.pose)
    covariance = covariance + float((share**2 * missing**2).sum()) * np.eye(len(mean))
    return float(mean @ np.linalg.solve(covariance, mean)) / len(mean)


def _mean(forecast: _Forecast, rows: BoolArray) -> tuple[Array, Array]:
    """Mean deviation of some rows along each coordinate that was measured, (c,) [m], and its covariance."""
    share = forecast.measured * rows[:, None]
    share = share[:, share.any(axis=0)] / share.sum(axis=0)[share.any(axis=0)]
    pick = np.eye(3)[(forecast.measured & rows[:, None]).any(axis=0)]
    M = np.einsum("nc,cd->cnd", share, pick).reshape(len(pick), -1)
    return M @ forecast.deviation.ravel(), M @ forecast.covariance @ M.T
