"""Test path after ISO 9283: a square, a large and a small circle, and sharp corners in one square plane."""

from itertools import pairwise
from math import pi

from compgen.planning import curves
from compgen.planning.curves import PiecewiseCurve


def iso9283(size: float) -> PiecewiseCurve:
    """Inside a square of side ``size`` [m], lengths in the standard's proportions.

    The square (four corners), circles of 0.8 and of 0.1 sides across about its centre, and
    a meander with right-angled and acute corners back to the start. Each corner is a stop.
    """
    h = size / 2
    big, small = 0.4 * size, 0.05 * size
    square = [(-h, -h), (h, -h), (h, h), (-h, h), (-h, -h)]
    to_circle = [(-h, -h), (0.0, -h), (0.0, -big)]
    to_small = [(0.0, -big), (0.0, -small)]
    meander = [
        (0.0, -small),
        (-0.2 * size, -small),
        (-0.2 * size, 0.1 * size),
        (-0.3 * size, 0.1 * size),
        (-0.3 * size, -0.1 * size),
        (-0.4 * size, 0.0),
        (-0.4 * size, -h),
        (-h, -h),
    ]
    return curves.join(
        _polyline(square),
        _polyline(to_circle),
        curves.spiral((0.0, 0.0), (big, big), (-pi / 2, 1.5 * pi), stop=True),
        _polyline(to_small),
        curves.spiral((0.0, 0.0), (small, small), (-pi / 2, 1.5 * pi), stop=True),
        _polyline(meander),
    )


def _polyline(points: list[tuple[float, float]]) -> PiecewiseCurve:
    """Straight lines from point to point [m], with a stop at each."""
    return curves.join(*(curves.line(a, b, stop=True) for a, b in pairwise(points)))
