"""The verdict: a deviation against the bounds that a path file promises, and the words for it.

Bounds with a probability, judged by what draws of an arm and a day come to on the whole path.

A draw is one arm on one day; it keeps the promise when it keeps every bound of it. As many draws may break one as
``draws_that_may_break`` allows: so share and confidence hold for all bounds together. Of each bound the report gives
the order statistic: the largest of the draws, or the next below it for each that may break.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import ceil, floor, isfinite, log10

import numpy as np

from compgen.core.arrays import Array, frozen, owns
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding, beyond_text
from compgen.core.units import MDEG, UM
from compgen.job.bounds import Bounds, Guarantee
from compgen.verification.deviation import COMPONENTS, Deviation, Extent

LAST_DIGIT = 1 + 1e-15  # a bound loses it where it comes from um: that of the report, given back, is kept


class Verdict(StrEnum):
    """What a run ends with, in the words of screen, page and JSON."""

    INSIDE = "inside"  # its bounds
    OUTSIDE = "outside"
    NOT_LOADABLE = "not loadable"  # the controller cannot take the program
    NOT_CORRECTED = "nothing corrected"
    NO_BOUNDS = "no bounds"  # corrected and proven; none was given to be judged by
    PREDICTED = "predicted"  # the error of the uncorrected program


def verdict_of(findings: Sequence[Finding]) -> Verdict:
    """What findings come to: nothing corrected, a broken bound, what the controller cannot load, no bound."""
    broken = {f.code for f in findings if f.level is Level.OUTSIDE}
    if not broken:
        return Verdict.INSIDE
    if Code.CORRECTION_NONE in broken:
        return Verdict.NOT_CORRECTED
    if broken <= {Code.CONTROLLER_SIZE, Code.BOUNDS_NONE}:
        return Verdict.NOT_LOADABLE if Code.CONTROLLER_SIZE in broken else Verdict.NO_BOUNDS
    return Verdict.OUTSIDE


def judge(deviation: Deviation, bounds: Bounds) -> list[Finding]:
    """One finding for each bound that is broken on the part, naming where it is worst; one where there is none at all.

    Where the tool is off the part (leads, turns, approach and retract) an error beyond a bound is a note.
    """
    findings: list[Finding] = []
    for level, extents in ((Level.OUTSIDE, deviation.on_part), (Level.NOTE, deviation.extents)):
        for key, extent, value, bound in checks(extents, bounds):
            of_bound = Code(f"bounds.{key}")
            code = of_bound if level is Level.OUTSIDE else Code.BOUNDS_OFF_PART
            if bound is None or value <= bound * LAST_DIGIT or {f.code for f in findings} & {code, of_bound}:
                continue
            factor, unit = bound_unit(key)
            size = beyond_text(value / factor, bound / factor, 3)
            message = f"{size} {unit} after correction is above bounds.{key} = {bound / factor:g}"
            message += f"; worst {extent.where:.3f} m along the path"
            can_be_kept = f"; {rounded_up(value / factor):g} can be kept"
            message += can_be_kept if level is Level.OUTSIDE else ", off the part, where no bound is judged"
            findings.append(Finding(level, code, message))
    if bounds == Bounds():
        message = "[bounds] of the path file gives none: nothing says whether this is good enough; give bounds.max_um"
        findings.append(Finding.of(Code.BOUNDS_NONE, message))
    return findings


def bound_unit(key: str) -> tuple[float, str]:
    """The unit that a bound's key names, in SI and as text."""
    unit = key.split("_")[1]
    return (MDEG if unit == "mdeg" else UM), unit


def rounded_up(value: float) -> float:
    """The next number of three digits."""
    if not isfinite(value) or value <= 0:
        return value
    step = 10.0 ** (floor(log10(value)) - 2)
    return ceil(value / step) * step


def checks(extents: dict[str, Extent], bounds: Bounds) -> list[tuple[str, Extent, float, float | None]]:
    """Key, extent, value and bound of each promise."""
    total, feed, cross, normal, angle = (extents[name] for name in COMPONENTS)
    return [
        ("max_um", total, total.max, bounds.max),
        ("p99_um", total, total.p99, bounds.p99),
        ("rms_um", total, total.rms, bounds.rms),
        ("feed_um", feed, feed.max, bounds.feed),
        ("cross_um", cross, cross.max, bounds.cross),
        ("normal_um", normal, normal.max, bounds.normal),
        ("axis_mdeg", angle, angle.max, bounds.axis),
    ]


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class JudgedResult:
    """A result that its findings judge."""

    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> Verdict:
        """What the findings come to: a broken bound weighs most, then what the controller cannot load."""
        return verdict_of(self.findings)

    @property
    def inside(self) -> bool:
        """Whether there are bounds, every one is kept, and the controller can load the program."""
        return self.verdict is Verdict.INSIDE


@dataclass(frozen=True, eq=False, slots=True)
@owns(values=("D",))
class DrawnBound:
    """One bound of a guarantee, and what D draws came to."""

    key: str
    bound: float  # [SI]
    values: Array  # (D,) [SI] on the part
    guaranteed: float  # [SI] what the promised share of arms and days stays within

    @property
    def breaking(self) -> int:
        """How many draws break it."""
        return int((self.values > self.bound).sum())


def drawn_bounds(draws: Sequence[dict[str, Extent]], guarantee: Guarantee) -> tuple[DrawnBound, ...]:
    """Each bound that is promised, with its order statistic.

    Args:
        draws: The extents on the part of each, by component.
        guarantee: The promise; as many draws as it says.
    """
    rows = [checks(extents, guarantee.bounds) for extents in draws]
    bounds = []
    for column in zip(*rows, strict=True):
        key, _, _, bound = column[0]
        if bound is not None:
            values = np.array([value for _, _, value, _ in column])
            bounds.append(DrawnBound(key, bound, frozen(values), float(np.sort(values)[-1 - guarantee.may_break])))
    return tuple(bounds)


def judge_draws(bounds: Sequence[DrawnBound], guarantee: Guarantee) -> list[Finding]:
    """A finding for each bound that the promised share does not keep; one where it keeps each, but not all at once."""
    findings = []
    promise = f"{100 * guarantee.share:g} % of arms and days"
    basis = f"{100 * guarantee.confidence:g} % confidence, {guarantee.draws} draws"
    for b in bounds:
        if b.guaranteed <= b.bound:
            continue
        factor, unit = bound_unit(b.key)
        message = (
            f"{b.guaranteed / factor:.3f} {unit} is what {promise} stay within ({basis}, {b.breaking} break it): above "
            f"bounds.guaranteed.{b.key} = {b.bound / factor:g}; {rounded_up(b.guaranteed / factor):g} can be kept"
        )
        findings.append(Finding(Level.OUTSIDE, Code(f"bounds.guaranteed.{b.key}"), message))
    together = int(np.any([b.values > b.bound for b in bounds], axis=0).sum())
    if not findings and together > guarantee.may_break:
        message = (
            f"{together} of {guarantee.draws} draws break one of the guaranteed bounds, {guarantee.may_break} may: "
            f"each is kept by {promise}, all at once are not; raise one of them"
        )
        findings.append(Finding.of(Code.BOUNDS_GUARANTEED_TOGETHER, message))
    return findings
