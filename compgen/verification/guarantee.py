"""Bounds with a probability, judged by what draws of an arm and a day come to on the whole path.

A draw is one arm on one day; it keeps the promise when it keeps every bound of it. As many draws may break one as
``order_statistics`` allows: so share and confidence hold for all bounds together. Of each bound the report gives the
order statistic: the largest of the draws, or the next below it for each that may break.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, frozen, owns
from compgen.core.codes import Code, Level
from compgen.core.findings import Finding
from compgen.job.bounds import Guarantee
from compgen.verification.deviation import Extent
from compgen.verification.verdict import checks, rounded_up, unit_of


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
        factor, unit = unit_of(b.key)
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
        findings.append(Finding(Level.OUTSIDE, Code.BOUNDS_GUARANTEED_TOGETHER, message))
    return findings
