"""A path of the user's own points: from a file to points, and from points to a piecewise curve.

Each reader (``csv_points``, ``apt``, ``gcode``) gives ``GivenPoints``; ``space_curve`` lays a curve through them.
"""

from compgen.planning.own_points.given_points import GivenPoints

__all__ = ["GivenPoints"]
