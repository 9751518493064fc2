"""Patterns of one curve: a spiral, a circle, a line."""

from math import pi

from compgen.planning import curves
from compgen.planning.curves import PiecewiseCurve


def spiral(diameter: float, turns: float) -> PiecewiseCurve:
    r"""r = (D / 2) f / (2 pi turns): pitch D / (2 turns) a turn, radius of curvature pitch / (4 pi) at the centre."""
    return curves.spiral((0.0, 0.0), (0.0, diameter / 2), (0.0, 2 * pi * turns), stop=True)


def circle(diameter: float) -> PiecewiseCurve:
    """Counter-clockwise from the point of largest x."""
    return curves.spiral((0.0, 0.0), (diameter / 2, diameter / 2), (0.0, 2 * pi), stop=True)


def line(axis: str, length: float) -> PiecewiseCurve:
    """Along x or y centred on the origin; along z upwards from it."""
    h = length / 2
    ends: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
        "x": ((-h, 0.0), (h, 0.0)),
        "y": ((0.0, -h), (0.0, h)),
        "z": ((0.0, 0.0, 0.0), (0.0, 0.0, length)),
    }
    return curves.line(*ends[axis], stop=True)
