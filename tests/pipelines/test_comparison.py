"""Distances to a path and to its arcs, by closed forms."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.pipelines.comparison.texts import CHORD, TextPositions, distance_to_path, drawn


def brute_force(points, path):
    """Every point against every segment."""
    a, d = path[:-1], np.diff(path, axis=0)
    along = np.clip(((points[:, None] - a) * d).sum(axis=2) / np.maximum((d**2).sum(axis=1), 1e-300), 0, 1)
    return np.linalg.norm(points[:, None] - a - along[..., None] * d, axis=2).min(axis=1)


@pytest.mark.parametrize("length", [2, 3, 40])
def test_distance_to_a_path_is_that_to_its_nearest_segment(length):
    rng = np.random.default_rng(length)
    path = rng.uniform(-0.3, 0.3, (length, 3))
    path[-1] = path[-2]  # a segment of no length
    points = rng.uniform(-0.4, 0.4, (300, 3))
    assert_allclose(distance_to_path(points, path), brute_force(points, path), atol=1e-12)
    assert_allclose(distance_to_path(path, path), 0, atol=1e-15)


def test_short_segments_do_not_hide_a_long_one():
    """A straight lead ends where a fine curve begins: the point is on the lead."""
    angle = np.linspace(0, 1, 2000)
    curve = 0.002 * np.column_stack([np.sin(angle), 1 - np.cos(angle), 0 * angle])
    path = np.vstack([[[0, 0, 0.02]], curve])
    point = np.array([[0, 0, 0.000149]])
    assert_allclose(distance_to_path(point, path), 0, atol=1e-12)


def test_a_path_that_stands_still_is_a_point():
    assert_allclose(distance_to_path(np.eye(3), np.zeros((4, 3))), 1)


def test_distance_to_one_point_is_to_it():
    assert_allclose(distance_to_path(np.eye(3), np.zeros((1, 3))), 1)


def program(position, via):
    count = len(position)
    rotation, joints = np.tile(np.eye(3), (count, 1, 1)), np.full((count, 6), np.nan)
    return TextPositions(np.arange(1, count + 1), position, rotation, np.array(via, dtype=bool), joints)


def test_an_arc_is_drawn_on_its_circle():
    """A straight lead, three quarters of a circle in two statements, a straight end."""
    angle = np.deg2rad([0, 60, 135, 200, 270])
    circle = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    position = np.vstack([[[1, -1, 0]], circle, [[1, -1, 0]]])
    path = drawn(program(position, [0, 0, 1, 0, 1, 0, 0]))
    assert_allclose(path[[0, 1, -2, -1]], position[[0, 1, -2, -1]], atol=1e-12)
    on_circle = path[1:-1]
    assert_allclose(np.linalg.norm(on_circle, axis=1), 1, atol=1e-12)
    assert np.linalg.norm((on_circle[1:] + on_circle[:-1]) / 2, axis=1).min() > 1 - 1.01 * CHORD
    swept = np.unwrap(np.arctan2(on_circle[:, 1], on_circle[:, 0]))
    assert np.all(np.diff(swept) >= 0)
    assert swept[-1] - swept[0] == pytest.approx(1.5 * np.pi)


def test_a_path_without_arcs_is_its_positions():
    position = np.random.default_rng(0).uniform(size=(5, 3))
    assert_allclose(drawn(program(position, [0] * 5)), position, rtol=0)
    in_line = np.outer(np.arange(3.0), np.ones(3))
    assert_allclose(drawn(program(in_line, [0, 1, 0])), in_line, rtol=0)
