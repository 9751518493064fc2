"""What a path file promises."""

from compgen.core.quantities import Positive
from compgen.core.toml import Table
from compgen.core.units import MDEG, UM
from compgen.verification.deviation import Bounds


class BoundsTable(Table):
    """The promise: largest values allowed after correction."""

    max_um: Positive | None = None
    p99_um: Positive | None = None
    rms_um: Positive | None = None
    feed_um: Positive | None = None
    cross_um: Positive | None = None
    normal_um: Positive | None = None
    axis_mdeg: Positive | None = None


def bounds_of(table: BoundsTable) -> Bounds:
    """In SI."""

    def um(value: float | None) -> float | None:
        return None if value is None else value * UM

    axis = None if table.axis_mdeg is None else table.axis_mdeg * MDEG
    return Bounds(
        um(table.max_um), um(table.p99_um), um(table.rms_um), um(table.feed_um), um(table.cross_um),
        um(table.normal_um), axis,
    )  # fmt: skip
