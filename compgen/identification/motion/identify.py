"""Which controller a log shows, with a verdict on stretches of it that the fit has not seen.

Every third block of rows is held out. Of the kinds that foretell these as well as the best does, the plainest is taken;
where another of them is not a richer form of it, the log cannot tell which it is, and only sigma is known: that of a
filter's weights, by which a path is pulled inwards, v^2 sigma^2 / (2 R).

What is fitted foretells, and how far it is off is a row of the band, unless it is no better than the plain program or
two parts of the log disagree. It may be commanded against where its kind and its times are known besides, and where it
leaves little of what it takes away.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from compgen.core.arrays import Array, IntArray, norm, rms
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.pose import Pose
from compgen.core.units import MS, UM
from compgen.identification.motion.fit import (
    NOTHING,
    Kind,
    KindFit,
    Residuals,
    covariance,
    draws,
    fit_kind,
    motion_named,
    times_of,
    variance_of,
)
from compgen.identification.motion.speed_curves import SpeedStretch
from compgen.identification.motion.timed_windows import FIRST, first_motion, shares_of
from compgen.identification.motion.windows import Window, keeps_law, residuals
from compgen.robot.motion import ControllerMotion, MotionVerdict, RunBeginning
from compgen.robot.robot import Robot

HELD_OUT = 3  # one of so many blocks
#: of what it takes away, may be left on blocks held out to be commanded against: a mean and a lag leave an eighth
LEFT = 0.05
BETTER = 0.9  # of what the plain program leaves: what leaves more is no better
NOISE_MULTIPLE = 1.5  # of the log's noise, that is left without fault
SAMPLED = 0.1e-6  # [m] rms that straight lines between samples of a smoothed motion are off by
FLOOR = 0.5e-6  # [m] beside: straight lines between samples of a smoothed motion
APART = 1.1  # of what the plain program leaves of one half of a log: what the other half may leave of it
MOST_SLOWED = 0.6  # of the rows: where more seem slowed down, the law is not this one, and none is left out
LEAST_TIME = 2.0  # periods, below which one of two means is none
SAME = 0.02  # of the mean square: kinds that leave as much foretell as well
SURE = 3.0  # standard errors, beyond which one kind foretells better
UNSURE = 0.15  # of the mean square, beyond which it does too: few blocks may tell all
LEAST_BLOCKS = 6
NO_MORE = "used to predict, not to correct"
NONE_TRIED = "the controller smooths in none of the ways that were tried"
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
    plain: float  # [m] rms of one coordinate that the plain program leaves on blocks held out
    held_out: float  # [m] the same, by the controller
    p99: float  # [m] distances there
    largest: float  # [m]
    ramps: tuple[float, float]  # [m] rms along the curve near stops, by the plain program and by the controller
    blocks: int
    slowed: float  # share of the rows that are left out, where the motion had another speed
    unexplained: float  # [m] rms of one coordinate that the plain program leaves on these
    findings: tuple[Finding, ...]
    speeds: tuple[SpeedStretch, ...] = ()  # at a corner and at a stop
    runs_began: frozenset[RunBeginning] = frozenset()  # of those whose bends it explains

    @property
    def limit(self) -> float:
        """What blocks held out may leave for programs to be commanded against it [m]."""
        return limit_of(self.plain, self.held_out, self.noise)

    @property
    def seen(self) -> float:
        """What is more than the log's noise, of one coordinate [m]."""
        return limit_of(0.0, 0.0, self.noise)

    @property
    def misses_bends(self) -> bool:
        """Whether all rows that show bends are left out."""
        return self.plain <= self.seen < self.unexplained

    @property
    def verdict(self) -> MotionVerdict:
        """What it may be used for."""
        levels = {f.level for f in self.findings}
        if Level.REFUSED in levels:
            return MotionVerdict.REJECTED
        return MotionVerdict.FORETELLS if Level.WARNING in levels else MotionVerdict.COMMANDABLE


def limit_of(plain: float, left: float, noise: float) -> float:
    """What a controller may leave of what the plain program leaves, to be commanded against [m]."""
    return max(LEFT * (plain - left), NOISE_MULTIPLE * noise + FLOOR)


def identify(
    windows: Sequence[Window],
    robot: Robot,
    tool: Pose,
    noise: float,
    progress: Callable[[float], None] = lambda share: None,
    kinds: Sequence[Kind] = (),
    first: ControllerMotion | None = None,
) -> IdentifiedMotion:
    """Fit every kind of controller, and judge the best.

    Args:
        windows: Of a run.
        robot: Its arm and interpolation period.
        tool: TCP in the flange.
        noise: Of the log's positions, of one coordinate [m].
        progress: Called with the share done.
        kinds: To be tried: none, and another; default all whose times are alike on every line.
        first: By which it is seen where the motion is slowed down; default the first of two means that fits.
    """
    _, whole = np.unique(np.concatenate([w.block for w in windows]), return_inverse=True)
    kept = keeps_law(windows, robot, tool, first or first_motion(windows, robot, tool))
    kept = kept if kept.mean() > 1 - MOST_SLOWED else np.ones_like(kept)
    block = whole[kept]
    fitted = block % HELD_OUT != HELD_OUT - 1

    def function(motion: ControllerMotion) -> Array:
        return residuals(windows, robot, tool, motion)[kept]

    slowed = residuals(windows, robot, tool, ControllerMotion())[~kept]

    spaces = ("cartesian", "joint") if all(w.theta is not None for w in windows) else ("cartesian",)
    kinds = kinds or [NOTHING, *(Kind(s, f, n) for n in (1, 2) for s in spaces for f in ("means", "lags"))]  # type: ignore[arg-type]
    fits = []
    for k, kind in enumerate(kinds):
        fits.append(fit_kind(kind, function, fitted, block, shares=shares_of(windows, kind)))
        progress((k + 1) / (len(kinds) + 1))
    fits.sort(key=lambda fit: float(np.mean(fit.held_out)))
    alike = [fit for fit in fits if _as_well(fit, fits[0])]
    plainest = _believed(alike, robot.controller.period)
    chosen, intervals, sigma = _refitted(plainest, alike, function, block)
    if robot.controller.rounds_up_to_period and chosen.kind == FIRST:
        chosen, intervals = _in_whole_periods(chosen, intervals, function, robot.controller.period)
    left, plain = function(plainest.motion)[~fitted], function(ControllerMotion())[~fitted]
    away = norm(left[:, :3])
    progress(1.0)
    identified = IdentifiedMotion(
        chosen=chosen,
        motion=chosen.motion,
        intervals=intervals,
        sigma=sigma,
        tried=tuple(fits),
        alike=tuple(f.kind for f in alike),
        noise=noise,
        plain=rms(plain[:, :3]) * np.sqrt(3 / 2),
        held_out=rms(away) / np.sqrt(2),
        p99=float(np.quantile(away, 0.99)) if len(away) else 0.0,
        largest=float(away.max(initial=0.0)),
        ramps=(rms(plain[:, 3]), rms(left[:, 3])),
        blocks=len(np.unique(block)),
        slowed=1 - float(kept.mean()),
        unexplained=rms(slowed[:, :3]) * np.sqrt(3 / 2) if len(slowed) else 0.0,
        findings=(),
    )
    apart = _disagreement(plainest, function, block)
    return replace(identified, findings=tuple(_findings(identified, robot.controller.period, apart)))


def _disagreement(fit: KindFit, function: Residuals, block: IntArray) -> float:
    """What each half of a log leaves of the other, as a share of what the plain program leaves: the larger share.

    How times grow is the whole log's: a half may have one line alone, which does not tell it.
    """
    later = block > np.median(block)
    if not fit.kind.count or not later.any() or later.all():
        return 0.0
    reach, reach_at = fit.motion.reach, fit.motion.reach_at
    kind, plain = replace(fit.kind, reach_at=None), function(ControllerMotion())

    def growing(motion: ControllerMotion) -> Array:
        return function(replace(motion, reach=reach, reach_at=reach_at))

    shares = []
    for half in (later, ~later):
        other = fit_kind(kind, growing, half, block, fit.numbers[: kind.count])
        shares.append(rms(growing(other.motion)[~half]) / max(rms(plain[~half]), FLOOR))
    return max(shares)


def _believed(alike: Sequence[KindFit], period: float) -> KindFit:
    """Of fits that foretell as well, that of the maker's motion code if its times are some; else the plainest."""
    usual = next((fit for fit in alike if fit.kind == FIRST), None)
    if usual is not None and min(times_of(FIRST, usual.numbers)) > LEAST_TIME * period:
        return usual
    return min(alike, key=lambda fit: (fit.kind.count, float(np.mean(fit.held_out))))


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
    kind = plainest.kind
    if not kind.count:
        return plainest, np.zeros((0, 2)), np.array([0.0, _unseen(function, block)])
    everything = np.ones(len(block), dtype=bool)
    chosen = replace(plainest, numbers=fit_kind(kind, function, everything, block, plainest.numbers).numbers)
    # beside it none that is a richer or a plainer form of the same
    others = [fit for fit in alike if not (fit.kind.includes(kind) or kind.includes(fit.kind))]
    drawn = {fit.kind: draws(fit.numbers, covariance(fit, function, block)) for fit in (chosen, *others)}
    roots = [np.sqrt([variance_of(each, draw) for draw in of_kind]) for each, of_kind in drawn.items()]
    sigmas = np.percentile(roots, [2.5, 97.5], axis=1)
    times = np.array([times_of(kind, draw) for draw in drawn[kind]])
    return chosen, np.percentile(times, [2.5, 97.5], axis=0).T, np.array([sigmas.min(), sigmas.max()])


def _in_whole_periods(fit: KindFit, intervals: Array, function: Residuals, period: float) -> tuple[KindFit, Array]:
    """Two means of whole periods, as the maker's motion code has them, where they explain a log as well."""
    near = (period * np.array([np.floor(time / period), np.ceil(time / period)]) for time in fit.motion.moving_averages)
    pairs = [np.array(pair) ** 2 for pair in product(*near)]
    tried = [np.array([sum(pair), (np.diff(pair)[0] / sum(pair)) ** 2]) for pair in pairs]
    left = [rms(function(motion_named(FIRST, numbers))) for numbers in (fit.numbers, *tried)]
    best = int(np.argmin(left[1:]))
    if left[best + 1] ** 2 > (1 + SAME) * left[0] ** 2 + SAMPLED**2:
        return fit, intervals
    whole = replace(fit, numbers=tried[best])
    times = np.array(whole.motion.moving_averages)
    return whole, np.column_stack([np.minimum(intervals[:, 0], times), np.maximum(intervals[:, 1], times)])


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


def _findings(identified: IdentifiedMotion, period: float, apart: float) -> Iterator[Finding]:
    """What speaks against a controller, or against commanding by it, and that a lag is not seen."""
    kind = identified.chosen.kind
    known = f"sigma is {identified.sigma[0] / MS:.1f} to {identified.sigma[1] / MS:.1f} ms"
    yield from _refusals(identified, known, apart)
    if kind.count:
        yield from _reserves(identified, known, period)
    if identified.slowed > 0:
        yield Finding.of(
            Code.MOTION_SLOWED,
            f"{100 * identified.slowed:.0f} % of the rows are left out: there the robot had another speed than the "
            "program says, by the controller or by its operator",
        )
    yield Finding.of(Code.MOTION_LAG, "a delay of the whole motion does not show in a log, and moves no path")


def _refusals(identified: IdentifiedMotion, known: str, apart: float) -> Iterator[Finding]:
    """Why a controller foretells nothing."""
    kind = identified.chosen.kind
    if identified.blocks < LEAST_BLOCKS:
        message = f"{identified.blocks} blocks of rows are too few to keep some for the check; log a longer run"
        yield Finding.of(Code.MOTION_SHORT, message)
    if not kind.count and identified.sigma[1] > BLIND:
        yield Finding.of(
            Code.MOTION_BLIND,
            f"the path curves too little at its speed to show smoothing: {known}; log a program with corners at CNT100 "
            "or curvature that changes, at full speed",
        )
    elif not kind.count:
        yield Finding.of(
            Code.MOTION_NONE,
            "no smoothing seen: the log shows the programmed path itself; either the controller smooths nothing, or "
            f"the log has commanded positions from before the smoothing; {known}",
        )
    elif identified.misses_bends:
        yield Finding.of(
            Code.MOTION_HELD_OUT,
            f"{kind.words} explains how the robot starts and stops, but not its speed in bends "
            f"({100 * identified.slowed:.0f} % of the rows, all bends among them, are left out): {NONE_TRIED}",
        )
    elif _whole(identified, 1) > max(BETTER * _whole(identified, 0), identified.seen):
        yield Finding.of(
            Code.MOTION_HELD_OUT,
            f"on stretches held out of the fit {kind.words} leaves {identified.held_out / UM:.2f} um rms, the program "
            f"without smoothing {identified.plain / UM:.2f}: {NONE_TRIED}",
        )
    elif apart > APART:
        yield Finding.of(
            Code.MOTION_PARTS,
            f"two halves of the log disagree: the smoothing of one leaves {100 * apart:.0f} % of the other's error; "
            "log one run of one program again",
        )


def _whole(identified: IdentifiedMotion, which: int) -> float:
    """What the plain program (0) or the controller (1) leaves, off the path and along it [m]."""
    return float(np.hypot((identified.plain, identified.held_out)[which], identified.ramps[which]))


def _reserves(identified: IdentifiedMotion, known: str, period: float) -> Iterator[Finding]:
    """Why a controller foretells, and may not be commanded against."""
    kind, more = identified.chosen.kind, "log a program with corners at CNT100 or curvature that changes, at full speed"
    others = [other for other in identified.alike if not (other.includes(kind) or kind.includes(other))]
    if max(identified.plain, identified.unexplained) <= identified.seen:
        message = f"of what was fitted only starts and stops show smoothing, no bend: it is {NO_MORE}; {more}"
        yield Finding.of(Code.MOTION_UNSURE, message)
    elif identified.held_out > identified.limit:
        yield Finding.of(
            Code.MOTION_MISFIT,
            f"on stretches held out of the fit {kind.words} leaves {identified.held_out / UM:.2f} um rms of "
            f"{identified.plain / UM:.2f}, more than {identified.limit / UM:.2f}: it is {NO_MORE}",
        )
    if kind.reach_at is not None:
        yield Finding.of(Code.MOTION_UNSURE, f"the times differ from line to line: it is {NO_MORE}")
    if others:
        yield Finding.of(
            Code.MOTION_ALIKE,
            f"the log does not show whether it is {kind.words} or {others[0].words}; known is that {known}; {more}",
        )
    times = zip(times_of(kind, identified.chosen.numbers), identified.intervals.tolist(), strict=True)
    for time, (low, high) in times:
        if (high - low) / 2 > max(KNOWN * time, period):
            message = f"the time {time / MS:.0f} ms may be {low / MS:.0f} to {high / MS:.0f} ms (95 %); {known}; {more}"
            yield Finding.of(Code.MOTION_UNSURE, message)
            return
