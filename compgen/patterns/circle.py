"""A full circle, once around."""

from math import pi

from compgen import pieces
from compgen.pieces import Pieces


def circle(diameter: float) -> Pieces:
    """Counter-clockwise from the point of largest x."""
    return pieces.spiral((0.0, 0.0), (diameter / 2, diameter / 2), (0.0, 2 * pi), stop=True)
