"""A straight line along one axis, through the centre."""

from compgen.planning import curves
from compgen.planning.curves import PiecewiseCurve


def line(axis: str, length: float) -> PiecewiseCurve:
    """Along x or y centred on the origin; along z upwards from it."""
    h = length / 2
    ends: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
        "x": ((-h, 0.0), (h, 0.0)),
        "y": ((0.0, -h), (0.0, h)),
        "z": ((0.0, 0.0, 0.0), (0.0, 0.0, length)),
    }
    return curves.line(*ends[axis], stop=True)
