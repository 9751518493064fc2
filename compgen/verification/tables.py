"""The path file's table ``[bounds]``, and the bounds made from it."""

from typing import Annotated

from pydantic import Field, FiniteFloat

from compgen.core.exceptions import InputError
from compgen.core.quantities import Positive
from compgen.core.toml import Table
from compgen.core.units import MDEG, UM
from compgen.verification.order_statistics import draws_needed, draws_that_may_break
from compgen.verification.verdict import Bounds, Guarantee

MOST_DRAWS = 10_000

Probability = Annotated[FiniteFloat, Field(gt=0, lt=1)]


class LargestTable(Table):
    """Largest residual of the written program on the part."""

    max_um: Positive | None = None
    """Largest distance from the target."""
    p99_um: Positive | None = None
    """99th percentile of the distance, over the length of the path."""
    rms_um: Positive | None = None
    """Root mean square of the distance, over the length of the path."""
    feed_um: Positive | None = None
    """Largest residual along the feed."""
    cross_um: Positive | None = None
    """Largest residual across the feed, in the surface."""
    normal_um: Positive | None = None
    """Largest residual along the surface normal."""
    axis_mdeg: Positive | None = None
    """Largest tilt of the tool axis."""


class GuaranteedTable(LargestTable):
    """Bounds that a share of all arms and days keeps on the whole path, verified by draws that the twin flies."""

    share: Probability = 0.95
    """Share of arms and days that keep the bounds."""
    confidence: Probability = 0.95
    """With which the draws verify that."""
    draws: Annotated[int, Field(json_schema_extra={"minimum": 1, "maximum": MOST_DRAWS})] | None = None
    """Flights of the whole path; default the fewest that share and confidence need, 59 for 0.95 and 0.95."""
    seed: Annotated[int, Field(ge=0, le=999_999_999)] = 0
    """Of the draws."""


class BoundsTable(LargestTable):
    """Largest residual of the written program on the part; the bounds that are given are verified."""

    guaranteed: GuaranteedTable | None = None


def bounds_of(table: BoundsTable, where: str) -> Bounds:
    """The bounds in SI.

    Raises:
        InputError: A bound with a probability and too few draws for it, or a probability without a bound.
    """
    guaranteed = None if table.guaranteed is None else _guarantee_of(table.guaranteed, f"{where}: bounds.guaranteed")
    return _largest(table, guaranteed)


def _guarantee_of(table: GuaranteedTable, key: str) -> Guarantee:
    bounds = _largest(table)
    if bounds == Bounds():
        raise InputError(f"{key}: it gives no bound; add max_um, or remove the table")
    needed = draws_needed(table.share, table.confidence)
    if needed > MOST_DRAWS:
        raise InputError(
            f"{key}.share: {table.share} with confidence {table.confidence} needs {needed} draws, {MOST_DRAWS} can be "
            "flown; lower share or confidence"
        )
    draws = needed if table.draws is None else table.draws
    may_break = draws_that_may_break(draws, table.share, table.confidence) if needed <= draws <= MOST_DRAWS else None
    if may_break is None:
        promise = f"share {table.share} with confidence {table.confidence}"
        raise InputError(f"{key}.draws: {draws}: {promise} needs {needed} to {MOST_DRAWS}; give such, or leave it out")
    return Guarantee(
        bounds=bounds, share=table.share, confidence=table.confidence, draws=draws, may_break=may_break, seed=table.seed
    )


def _largest(table: LargestTable, guaranteed: Guarantee | None = None) -> Bounds:
    def um(value: float | None) -> float | None:
        return None if value is None else value * UM

    axis = None if table.axis_mdeg is None else table.axis_mdeg * MDEG
    return Bounds(
        max=um(table.max_um),
        p99=um(table.p99_um),
        rms=um(table.rms_um),
        feed=um(table.feed_um),
        cross=um(table.cross_um),
        normal=um(table.normal_um),
        axis=axis,
        guaranteed=guaranteed,
    )
