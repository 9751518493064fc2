"""Plane polygons: crossing edges, and areas."""

import numpy as np
from numpy.testing import assert_array_equal

from compgen.core.polygons import crossing, edges_of, signed_area

SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])


def test_area_is_positive_counter_clockwise():
    assert signed_area(SQUARE) == 4.0
    assert signed_area(SQUARE[::-1]) == -4.0


def test_edges_that_share_a_corner_do_not_cross():
    assert not crossing(edges_of(SQUARE), edges_of(SQUARE)).any()


def test_a_bow_tie_crosses_itself_once():
    edges = edges_of(SQUARE[[0, 2, 1, 3]])
    assert_array_equal(np.argwhere(np.triu(crossing(edges, edges))), [[0, 2]])
