"""Which controller a log shows, with a verdict on stretches of it that the fit has not seen.

Every third block of rows is held out. Of the kinds that foretell these as well as the best does, the plainest is taken;
where another of them is not a richer form of it, the log cannot tell which it is, and only sigma is known: that of a
filter's weights, by which a path is pulled inwards, v^2 sigma^2 / (2 R).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.pose import Pose
from compgen.core.units import MS, UM
from compgen.identification.motion.fit import (
    NOTHING,
    Kind,
    KindFit,
    Residuals,
    covariance,
    fit_kind,
    times_of,
    variance_of,
)
from compgen.identification.motion.windows import Window, residuals
from compgen.robot.motion import ControllerMotion
from compgen.robot.robot import Robot

HELD_OUT = 3  # one of so many blocks
NOISE_MULTIPLE = 1.5  # of the log's noise, that may be left on blocks held out
FLOOR = 0.5e-6  # [m] beside: straight lines between samples of a smoothed motion
SAME = 0.02  # of the mean square: kinds that leave as much foretell as well
SURE = 3.0  # standard errors, beyond which one kind foretells better
UNSURE = 0.15  # of the mean square, beyond which it does too: few blocks may tell all
DRAWS = 400  # of the fitted numbers, for intervals of the times
LEAST_BLOCKS = 6
SCANNED = np.geomspace(3e-3, 0.3, 24)  # [s] sigma of a moving mean, tried where none is seen
BLIND = 0.02  # [s] sigma: a log that leaves more possible has not looked
KNOWN = 0.1  # of a time, or one interpolation period: how well it must be known, 95 %


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class IdentifiedMotion:
    """What a log tells of the controller's motion."""

    chosen: KindFit  # fitted to all of the log
    motion: ControllerMotion
    intervals: Array  # (p, 2) [s] 95 % of each time, the longer first
    sigma: Array  # (2,) [s] 95 % of the root of the smoothing's variance, over all kinds that foretell as well
    tried: tuple[KindFit, ...]  # the best first
    alike: tuple[Kind, ...]  # that foretell as well as the best
    noise: float  # [m] of the log
    limit: float  # [m] that blocks held out may leave
    held_out: float  # [m] rms that they leave, of one coordinate
    largest: float  # [m] that they leave at most
    blocks: int
    findings: tuple[Finding, ...]

    @property
    def accepted(self) -> bool:
        """Whether programs may be pre-distorted by it."""
        return not any(f.level is Level.REFUSED for f in self.findings)


def identify(
    windows: Sequence[Window],
    robot: Robot,
    tool: Pose,
    noise: float,
    progress: Callable[[float], None] = lambda share: None,
) -> IdentifiedMotion:
    """Fit every kind of controller, and judge the best.

    Args:
        windows: Of a run.
        robot: Its arm and interpolation period.
        tool: TCP in the flange.
        noise: Of the log's positions, of one coordinate [m].
        progress: Called with the share done.
    """
    block = np.concatenate([w.block for w in windows])
    fitted = block % HELD_OUT != HELD_OUT - 1

    def function(motion: ControllerMotion) -> Array:
        return residuals(windows, robot, tool, motion)

    spaces = ("cartesian", "joint") if all(w.theta is not None for w in windows) else ("cartesian",)
    kinds = [NOTHING, *(Kind(s, f, n) for n in (1, 2) for s in spaces for f in ("means", "lags"))]  # type: ignore[arg-type]
    fits = []
    for k, kind in enumerate(kinds):
        fits.append(fit_kind(kind, function, fitted, block))
        progress((k + 1) / (len(kinds) + 1))
    fits.sort(key=lambda fit: float(np.mean(fit.held_out)))
    alike = [fit for fit in fits if _as_well(fit, fits[0])]
    plainest = min(alike, key=lambda fit: (fit.kind.count, float(np.mean(fit.held_out))))
    chosen, intervals, sigma = _refitted(plainest, alike, function, block)
    left = function(plainest.motion)[~fitted]
    progress(1.0)
    identified = IdentifiedMotion(
        chosen=chosen,
        motion=chosen.motion,
        intervals=intervals,
        sigma=sigma,
        tried=tuple(fits),
        alike=tuple(f.kind for f in alike),
        noise=noise,
        limit=NOISE_MULTIPLE * max(noise, 1e-9) + FLOOR,
        held_out=plainest.rms,
        largest=float(np.sqrt((left**2).sum(axis=1).max(initial=0.0))),
        blocks=len(np.unique(block)),
        findings=(),
    )
    return replace(identified, findings=_verdict(identified, robot.controller.period))


def _as_well(fit: KindFit, best: KindFit) -> bool:
    """Whether a fit foretells blocks as well as the best one."""
    more = fit.held_out - best.held_out
    if np.mean(more) <= SAME * np.mean(best.held_out):
        return True
    error = float(np.std(more)) / np.sqrt(max(len(more) - 1, 1))
    return bool(np.mean(more) < SURE * error and np.mean(more) < UNSURE * np.mean(best.held_out))


def _refitted(
    plainest: KindFit, alike: Sequence[KindFit], function: Residuals, block: IntArray
) -> tuple[KindFit, Array, Array]:
    """The plainest kind fitted to all rows, the intervals of its times, and that of sigma over all that are alike."""
    everything = np.ones(len(block), dtype=bool)
    chosen = fit_kind(plainest.kind, function, everything, block, plainest.numbers) if plainest.kind.count else plainest
    chosen = KindFit(chosen.kind, chosen.numbers, plainest.held_out)
    sigmas, intervals = list[float](), np.zeros((plainest.kind.count, 2))
    if not plainest.kind.count:
        return chosen, intervals, np.array([0.0, _unseen(function, block)])
    for fit in alike:
        numbers = chosen.numbers if fit.kind == chosen.kind else fit.numbers
        if fit.kind.includes(chosen.kind) and fit.kind != chosen.kind:
            continue  # a richer form of the same
        spread = covariance(KindFit(fit.kind, numbers, fit.held_out), function, block)
        draws = _draws(numbers, spread)
        roots = np.sqrt([variance_of(fit.kind, draw) for draw in draws])
        sigmas += [float(v) for v in np.percentile(roots, [2.5, 97.5])]
        if fit.kind == chosen.kind:
            times = np.array([times_of(fit.kind, draw) for draw in draws])
            intervals = np.percentile(times, [2.5, 97.5], axis=0).T
    return chosen, intervals, np.array([min(sigmas), max(sigmas)])


def _unseen(function: Residuals, block: IntArray) -> float:
    """The largest sigma that doubles what is left in no block of rows [s]."""
    _, which = np.unique(block, return_inverse=True)
    count = np.bincount(which)

    def squares(motion: ControllerMotion) -> Array:
        return np.bincount(which, (function(motion) ** 2).sum(axis=1)) / count

    plain, unseen = squares(ControllerMotion()), float(SCANNED[0])
    for sigma in SCANNED:
        more = squares(ControllerMotion(moving_averages=(float(sigma * np.sqrt(12)),))) - plain
        if more.max() > plain.mean():
            break
        unseen = float(sigma)
    return unseen


def _draws(numbers: Array, spread: Array) -> Array:
    """Draws of fitted numbers, the same ones every time, (D, p)."""
    values, vectors = np.linalg.eigh((spread + spread.T) / 2)
    unit = np.random.default_rng(1).normal(size=(DRAWS, len(numbers)))
    draws = numbers + unit * np.sqrt(np.clip(values, 0, None)) @ vectors.T
    draws[:, 0] = np.clip(draws[:, 0], 0, None)
    if draws.shape[1] > 1:
        draws[:, 1] = np.clip(np.abs(draws[:, 1]), 0, 1)
    return np.asarray(draws)


def _verdict(identified: IdentifiedMotion, period: float) -> tuple[Finding, ...]:
    """What speaks against a controller, and that a lag is not seen."""
    findings, kind, limit = list[Finding](), identified.chosen.kind, identified.limit
    known = f"sigma is {identified.sigma[0] / MS:.1f} to {identified.sigma[1] / MS:.1f} ms"

    def refuse(code: Code, message: str) -> None:
        findings.append(Finding(Level.REFUSED, code, message))

    if identified.blocks < LEAST_BLOCKS:
        refuse(
            Code.MOTION_SHORT,
            f"{identified.blocks} blocks of rows away from stops are too few to hold some out; log a longer run",
        )
    if identified.held_out > limit:
        refuse(
            Code.MOTION_HELD_OUT,
            f"{kind.words} foretells stretches that it was not fitted to with {identified.held_out / UM:.2f} um rms, "
            f"above {limit / UM:.2f} ({NOISE_MULTIPLE:g} times the noise and {FLOOR / UM:g}): it is none of those "
            "tried",
        )
    elif not kind.count and identified.sigma[1] > BLIND:
        refuse(
            Code.MOTION_BLIND,
            f"the path curves too little at its speed to show smoothing: {known}; log a program with corners at CNT100 "
            "or curvature that changes, at full speed",
        )
    elif not kind.count:
        refuse(
            Code.MOTION_NONE,
            "no smoothing seen: the log shows the programmed path itself; either the controller smooths nothing, or "
            f"the log has commanded positions from before the smoothing; {known}",
        )
    else:
        others = [other for other in identified.alike if not other.includes(kind)]
        if others:
            refuse(
                Code.MOTION_ALIKE,
                f"the log cannot tell {kind.words} from {others[0].words}: only the smoothing's {known}; log a "
                "program with corners at CNT100 or curvature that changes, at full speed",
            )
        for time, (low, high) in zip(
            times_of(kind, identified.chosen.numbers), identified.intervals.tolist(), strict=True
        ):
            if (high - low) / 2 > max(KNOWN * time, period):
                refuse(
                    Code.MOTION_UNSURE,
                    f"a time of {time / MS:.0f} ms is known as {low / MS:.0f} to {high / MS:.0f} ms only; {known}; log "
                    "a program with corners at CNT100 or curvature that changes, at full speed",
                )
                break
    message = "a lag of the whole motion only shifts the log's clock: this log does not show it, and it moves no path"
    return (*findings, Finding(Level.NOTE, Code.MOTION_LAG, message))
