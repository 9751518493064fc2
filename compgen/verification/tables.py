"""The path file's table ``[bounds]``, and the bounds made from it."""

from compgen.core.quantities import Positive
from compgen.core.toml import Table
from compgen.core.units import MDEG, UM
from compgen.verification.verdict import Bounds


class BoundsTable(Table):
    """Largest residual of the written program on the part; the bounds that are given are verified."""

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


def bounds_of(table: BoundsTable) -> Bounds:
    """The bounds in SI."""

    def um(value: float | None) -> float | None:
        return None if value is None else value * UM

    axis = None if table.axis_mdeg is None else table.axis_mdeg * MDEG
    return Bounds(
        um(table.max_um), um(table.p99_um), um(table.rms_um), um(table.feed_um), um(table.cross_um),
        um(table.normal_um), axis,
    )  # fmt: skip
