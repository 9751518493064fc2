"""A full circle, once around."""

from math import pi

from compgen.planning import curves
from compgen.planning.curves import PiecewiseCurve


def circle(diameter: float) -> PiecewiseCurve:
    """Counter-clockwise from the point of largest x."""
    return curves.spiral((0.0, 0.0), (diameter / 2, diameter / 2), (0.0, 2 * pi), stop=True)
