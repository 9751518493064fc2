"""Patterns: each a function from its sizes [m] to a piecewise curve in the surface's local plane.

Adding one: a file with the function, a line here, its table in ``planning.tables``, a test.
"""

from compgen.planning.patterns.iso9283 import iso9283
from compgen.planning.patterns.raster import cross_hatch, one_way_raster, raster
from compgen.planning.patterns.spiral_circle_line import circle, line, spiral

__all__ = ["circle", "cross_hatch", "iso9283", "line", "one_way_raster", "raster", "spiral"]
