"""Path simplification: the fewest waypoints within the tolerance, and no line too short to follow."""

import numpy as np
from numpy.testing import assert_allclose
from shipped import path_file, quiet
from toolpaths import laid

from compgen.compensation import simplify
from compgen.core.units import DEG, MM, UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.planning import curves, surfaces
from compgen.planning.boundaries import unbounded
from compgen.planning.own_points.space_curve import LocalPoints, Tolerance, space_curve


def test_simplification_keeps_the_fewest_that_stay_within_the_tolerance():
    table = curves.spiral((0, 0), (0.1, 0.3), (0, 6 * np.pi))
    surface = surfaces.plane(np.array([1.2, 0.0, 0.2]))
    settings = {"spin": 0.0, "chord": 0.05 * UM, "lift": 0.0, "spacing": 0.2 * MM}
    path = laid(table, surface, unbounded(), **settings)
    none, still = np.zeros((len(path.arc), 3)), np.zeros((len(path.arc), 6))
    rows = simplify.simplify(path, still, none, 1.5 * UM, 0.0)
    thin = path.subset(rows)
    assert len(rows) < len(path.arc) / 5
    chord = thin.exact.chord(thin.piece, thin.span)
    assert chord.max() <= 1.5 * UM
    # dropping any kept row, ends of pieces aside, would leave the tolerance
    inner = np.flatnonzero(thin.piece[1:] == thin.piece[:-1])
    span = np.column_stack([thin.span[inner, 0], thin.span[inner + 1, 1]])
    assert thin.exact.chord(thin.piece[inner], span).min() > 1.5 * UM
    # a correction that wriggles is followed
    wave = none.copy()
    wave[:, 2] = 20 * UM * np.sin(path.arc / 1e-3)
    assert len(simplify.simplify(path, still, wave, 1.5 * UM, 0.0)) > 1.3 * len(rows)
    # one that is the same everywhere, or changes evenly along the path, is said by the same rows
    even = np.outer(path.arc, [0.0, 2e-3, 1e-3]) + np.array([1e-3, 0.0, -2e-3])
    assert np.array_equal(simplify.simplify(path, still, even, 1.5 * UM, 0.0), rows)
    # no line too short to follow where there is another way
    long = simplify.simplify(path, still, none, 1.5 * UM, 0.5 * MM)
    assert np.diff(path.arc[long]).min() >= 0.5 * MM
    # the last line is never too short, and the two that share its way stay within the tolerance
    lengths = np.diff(thin.arc)
    shared = path.subset(simplify.simplify(path, still, none, 1.5 * UM, lengths[-1] * 1.01))
    assert len(shared.arc) == len(rows)
    assert_allclose(np.diff(shared.arc)[-2:], (lengths[-1] + lengths[-2]) / 2, atol=0.2 * MM)
    assert shared.exact.chord(shared.piece, shared.span).max() <= 1.5 * UM


def test_a_tool_that_turns_keeps_its_waypoints():
    x = np.linspace(0, 0.15, 61)
    tilt = np.column_stack([0 * x, 0.05 * np.sin(x / 3e-3), 0 * x])  # half of an angle
    yes, no = np.ones(61, dtype=bool), np.zeros(61, dtype=bool)
    points = LocalPoints(np.column_stack([1.2 + x, 0 * x, 0 * x]), tilt, yes, no, np.ones(61))
    tolerance = Tolerance(place=2 * UM, tilt=2e-4, corner=0.5, exact=False)
    path = laid(space_curve(points, tolerance).curve, surfaces.plane(np.zeros(3)), unbounded(), chord=1.5 * UM)
    thin = path.subset(simplify.simplify(path, np.zeros((len(path.arc), 6)), np.zeros((len(path.arc), 3)), 2 * UM, 0.0))
    assert len(thin.arc) < len(path.arc)
    segments = np.arange(len(thin.piece))
    start, middle, end = (thin.at(segments, np.full(len(segments), u))[0].rotation[:, :, 2] for u in (0.0, 0.5, 1.0))
    half_way = (start + end) / np.linalg.norm(start + end, axis=1)[:, None]
    assert np.linalg.norm(half_way - middle, axis=1).max() < 2e-4  # 11 mdeg


def test_a_line_ends_before_a_joint_turns_farther_than_the_twin_takes():
    """Thinned, a straight line of 1.3 m was refused: 'a joint turns by over 90 deg within one line'."""
    planned, corrected = generate.generate(load_job(path_file("line_x"), None, ["process.thin_um=5"]), quiet)
    steps, whole = np.abs(np.diff(planned.theta, axis=0)), np.abs(planned.theta[-1] - planned.theta[0])
    assert steps.max() < 86 * DEG < 90 * DEG < whole.max()
    assert len(corrected.program.position) == len(planned.theta) < 8
