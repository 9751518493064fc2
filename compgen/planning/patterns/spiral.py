"""Archimedean spiral from the centre outwards."""

from math import pi

from compgen.planning import curves
from compgen.planning.curves import PiecewiseCurve


def spiral(diameter: float, turns: float) -> PiecewiseCurve:
    r"""r = (D / 2) f / (2 pi turns): pitch D / (2 turns) a turn, radius of curvature pitch / (4 pi) at the centre."""
    return curves.spiral((0.0, 0.0), (0.0, diameter / 2), (0.0, 2 * pi * turns), stop=True)
