"""Fewer points where they stand closer than the controller can follow."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compgen import thinning
from compgen.exceptions import InputError
from compgen.thinning import thin
from compgen.units import MM, UM


def circle(radius, spacing, count):
    """Points on a circle, exactly; their arc lengths."""
    angle = np.arange(count) * spacing / radius
    return angle * radius, np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(count)])


def ends(count, *more):
    stay = np.zeros(count, dtype=bool)
    stay[[0, -1, *more]] = True
    return stay


def farthest(points, keep):
    """Naively: the largest distance of a point from the line that replaces it."""
    worst, stays = 0.0, np.flatnonzero(keep)
    for a, b in zip(stays[:-1], stays[1:]):
        for n in range(a + 1, b):
            u, v = points[b] - points[a], points[n] - points[a]
            t = min(max(v @ u / (u @ u), 0.0), 1.0)
            worst = max(worst, float(np.linalg.norm(v - t * u)))
    return worst


def test_a_circle_keeps_the_chord_of_its_sagitta():
    """0.2 mm apart at 200 mm/s: 1.6 mm can be followed, and its sagitta of s^2 / 8 R is 0.64 um."""
    arc, points = circle(0.5, 0.2 * MM, 4001)
    found = thin(arc, points, ends(4001), 1.6 * MM, 1.5 * UM)
    assert found.short_before == 4000
    assert found.short_left == 0
    assert np.unique(np.round(np.diff(arc[found.keep]) / MM, 6)).tolist() == [1.6]
    assert found.saved == 3500
    assert found.chord == pytest.approx((1.6 * MM) ** 2 / 8 / 0.5, rel=1e-4)


def test_a_tight_curve_keeps_the_points_it_needs_and_says_so():
    arc, points = circle(5 * MM, 0.2 * MM, 401)
    found = thin(arc, points, ends(401), 1.6 * MM, 1.5 * UM)
    assert found.short_left > 0
    assert found.chord <= 1.5 * UM
    assert found.saved == 0  # 0.4 mm would bulge by 4 um
    looser = thin(arc, points, ends(401), 1.6 * MM, 5 * UM)
    assert looser.saved == 200
    assert looser.chord == pytest.approx((0.4 * MM) ** 2 / 8 / (5 * MM), rel=1e-3)


def test_the_bulge_between_points_counts():
    """Two segments of which no inner point is off: three points in line on a wave."""
    arc, points = circle(0.1, 1 * MM, 101)
    bulge = (2 * MM) ** 2 / 8 / 0.1
    assert thin(arc, points, ends(101), 1.5 * MM, 0.99 * bulge).saved == 0
    assert thin(arc, points, ends(101), 1.5 * MM, 1.01 * bulge).saved == 50


def test_a_straight_line_keeps_only_what_must_stay():
    arc = np.linspace(0, 1, 1001)
    points = np.column_stack([arc, np.zeros((1001, 2))])
    found = thin(arc, points, ends(1001, 300), np.inf)
    assert np.flatnonzero(found.keep).tolist() == [0, 300, 1000]
    assert found.chord < 1e-12


def test_corners_that_must_stay_are_not_smoothed():
    """A right angle: with its corner kept both legs thin out; the spline does not cut it."""
    leg = np.linspace(0, 0.1, 101)
    points = np.vstack([np.column_stack([leg, 0 * leg]), np.column_stack([0 * leg + 0.1, leg])[1:]])
    arc = np.concatenate([leg, 0.1 + leg[1:]])
    found = thin(arc, points, ends(201, 100), np.inf, 1 * UM)
    assert np.flatnonzero(found.keep).tolist() == [0, 100, 200]


def test_what_is_long_enough_is_left_alone():
    arc, points = circle(0.5, 2 * MM, 200)
    found = thin(arc, points, ends(200), 1.6 * MM)
    assert found.keep.all()
    assert (found.saved, found.short_before, found.short_left, found.chord) == (0, 0, 0, 0.0)


def test_only_the_dense_stretch_loses_points():
    step = np.concatenate([np.full(100, 2 * MM), np.full(400, 0.1 * MM), np.full(100, 2 * MM)])
    arc = np.concatenate([[0], np.cumsum(step)])
    points = np.column_stack([0.5 * np.cos(arc / 0.5), 0.5 * np.sin(arc / 0.5)])
    found = thin(arc, points, ends(601), 1.6 * MM)
    assert found.keep[:100].all()
    assert found.keep[501:].all()
    assert found.short_left == 0
    assert 370 <= found.saved <= 380


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 200), st.floats(0.2, 20), st.floats(0, 20), st.integers(2, 6))
def test_the_tolerance_is_kept_on_any_curve(seed, count, shortest_mm, tolerance_um, dimensions):
    rng = np.random.default_rng(seed)
    arc = np.cumsum(rng.uniform(0.05, 2, count)) * MM
    wave = rng.uniform(20, 200, dimensions)
    points = np.column_stack([arc, *(3e-4 * np.sin(arc * w + w) for w in wave[1:])])
    stay = rng.random(count) < 0.05
    found = thin(arc, points, stay, shortest_mm * MM, tolerance_um * UM)
    assert found.keep[stay].all()
    assert found.keep[[0, -1]].all()
    assert found.saved == count - found.keep.sum()
    assert farthest(points, found.keep) <= tolerance_um * UM + 1e-12
    assert farthest(points, found.keep) <= found.chord + 1e-12
    assert found.chord <= tolerance_um * UM + 1e-12
    left = np.diff(arc[found.keep]) < shortest_mm * MM * (1 - 1e-9)
    assert left.sum() == found.short_left <= found.short_before
    # nothing more could go: each short segment's ends must stay, or would bulge too far
    again = thin(arc[found.keep], points[found.keep], stay[found.keep], shortest_mm * MM, 0.0)
    assert again.saved == 0 or tolerance_um == 0 or again.chord <= 1e-12


def test_many_points_take_as_few_passes_as_few(monkeypatch):
    """No loop over points: twenty times as many take the same passes, each over all at once."""
    passes = []
    real = thinning._chords
    monkeypatch.setattr(thinning, "_chords", lambda *rows: passes.append(1) or real(*rows))
    took = []
    for count in (10_001, 200_001):
        arc, points = circle(0.65, 0.2 * MM, count)
        passes.clear()
        assert thin(arc, points, ends(count), 1.6 * MM).short_left == 0
        took.append(len(passes))
    assert took[0] == took[1] <= 8


@pytest.mark.parametrize("count", [0, 1, 2])
def test_few_points_stay(count):
    found = thin(np.arange(count) * MM, np.zeros((count, 3)), np.zeros(count, dtype=bool), 1.0)
    assert found.keep.all()


def test_bad_input_is_refused():
    with pytest.raises(InputError, match="points 2 and 3"):
        thin(np.array([0.0, 1, 1]), np.zeros((3, 3)), ends(3), 1.0)
    with pytest.raises(InputError, match="tolerance"):
        thin(np.array([0.0, 1, 2]), np.zeros((3, 3)), ends(3), 1.0, -1.0)
