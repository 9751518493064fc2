"""Rotations against scipy, the matrix exponential and hand-written products."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm
from scipy.spatial.transform import Rotation, Slerp

from compgen.core.rotations import (
    cross_matrix,
    from_wpr,
    interpolate_rotation,
    rotation_matrix,
    rotation_vector,
    to_wpr,
)

ATOL_RAD = 1e-12
ATOL = 1e-14  # of a matrix entry [-]


def directions(count, seed=710):
    v = np.random.default_rng(seed).normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def uniform(limit, shape, seed=1):
    """Angles between the limits -/+ [rad]."""
    return np.random.default_rng(seed).uniform(-limit, limit, shape)


def vectors():
    """Zero, tiny, ordinary and nearly half turns about many axes."""
    sizes = np.concatenate([[0.0, 1e-300, 1e-15, 1e-9, 1e-8, 1e-4], np.linspace(0.01, np.pi - 1e-3, 200)])
    return sizes[:, None] * directions(len(sizes))


def about(axis, angle):
    """Turn about x, y or z, written out."""
    c, s = np.cos(angle), np.sin(angle)
    return {
        "x": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
        "y": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
        "z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]),
    }[axis]


def test_cross_matrix_is_the_cross_product():
    w, v = directions(20), directions(20, seed=711)
    assert_allclose((cross_matrix(w) @ v[:, :, None])[:, :, 0], np.cross(w, v), atol=ATOL)


def test_matrix_is_the_exponential_of_the_cross_matrix():
    w = vectors()[::6]
    assert_allclose(rotation_matrix(w), expm(cross_matrix(w)), atol=1e-13)


def test_matrix_agrees_with_scipy():
    w = vectors()
    assert_allclose(rotation_matrix(w), Rotation.from_rotvec(w).as_matrix(), atol=ATOL)


def test_quarter_turn_about_z_takes_x_to_y():
    assert_allclose(rotation_matrix(np.array([0, 0, np.pi / 2])) @ [1, 0, 0], [0, 1, 0], atol=ATOL)


def test_rotation_vector_round_trip():
    w = vectors()
    assert_allclose(rotation_vector(rotation_matrix(w)), w, atol=ATOL_RAD)


def test_rotation_vector_agrees_with_scipy():
    rotation = Rotation.random(300, random_state=5)
    assert_allclose(rotation_vector(rotation.as_matrix()), rotation.as_rotvec(), atol=ATOL_RAD)


def test_small_rotation_vector_keeps_its_relative_size():
    w = 1e-11 * directions(10)  # an error of 10 prad must not drown in the arc cosine
    assert_allclose(rotation_vector(rotation_matrix(w)), w, rtol=1e-12)


@pytest.mark.parametrize("gap_rad", [1e-4, 1e-6, 1e-8, 1e-10])
def test_rotation_vector_holds_just_below_half_a_turn(gap_rad):
    w = (np.pi - gap_rad) * directions(50)
    # the axis is known from sin(angle) ~ gap alone: machine precision over the gap
    assert_allclose(rotation_vector(rotation_matrix(w)), w, atol=np.pi * (1e-15 / gap_rad) + ATOL_RAD)


def test_between_starts_and_ends_where_it_says():
    start, end = rotation_matrix(vectors()), rotation_matrix(0.3 * vectors()[::-1])
    zero = np.zeros(len(start))
    assert_allclose(interpolate_rotation(start, end, zero), start, atol=1e-13)
    assert_allclose(interpolate_rotation(start, end, zero + 1), end, atol=1e-12)


def test_between_turns_evenly_like_slerp():
    ends = Rotation.from_rotvec([[0.1, -0.2, 0.3], [1.0, 0.8, -1.1]])
    fraction = np.linspace(0, 1, 11)
    expected = Slerp([0, 1], ends)(fraction).as_matrix()
    start, end = (np.repeat(m[None], 11, axis=0) for m in ends.as_matrix())
    assert_allclose(interpolate_rotation(start, end, fraction), expected, atol=1e-13)


def test_wpr_is_rz_ry_rx():
    for w, p, r in uniform(np.pi, (50, 3)):
        computed = from_wpr(*(np.array([a]) for a in (w, p, r)))[0]
        assert_allclose(computed, about("z", r) @ about("y", p) @ about("x", w), atol=ATOL)


def test_wpr_agrees_with_scipys_fixed_axes():
    angles = uniform(np.pi, (100, 3))
    assert_allclose(from_wpr(*angles.T), Rotation.from_euler("xyz", angles).as_matrix(), atol=ATOL)


def test_wpr_180_0_0_points_the_tool_down():
    computed = from_wpr(np.array([np.pi]), np.array([0.0]), np.array([0.0]))[0]
    assert_allclose(computed, np.diag([1, -1, -1]), atol=ATOL)


def test_wpr_angles_round_trip():
    w, r = uniform(np.pi, (2, 500))
    p = uniform(np.pi / 2 - 0.01, 500, seed=2)
    assert_allclose(np.array(to_wpr(from_wpr(w, p, r))), [w, p, r], atol=ATOL_RAD)


@pytest.mark.parametrize("side", [1, -1])
def test_wpr_round_trip_with_w_near_180(side):
    gap = np.array([1e-3, 1e-6, 1e-9, 1e-12])
    w, p, r = side * (np.pi - gap), np.array([0.0, 1e-3, -1e-3, 0.2]), np.array([0.3, -0.3, 3.0, -3.0])
    computed = np.array(to_wpr(from_wpr(w, p, r)))
    assert_allclose(computed, [w, p, r], atol=ATOL_RAD)
    assert np.all(np.sign(computed[0]) == side)  # -180 does not come back as 180 while it is not reached


def test_w_of_exactly_180_comes_back_as_a_half_turn():
    w, p, r = to_wpr(from_wpr(np.array([np.pi]), np.array([0.0]), np.array([0.4])))
    assert_allclose([abs(w[0]), p[0], r[0]], [np.pi, 0, 0.4], atol=ATOL_RAD)


@pytest.mark.parametrize("side", [1, -1])
def test_at_p_of_90_only_one_angle_is_left_and_r_is_zero(side):
    w, r = uniform(np.pi / 2, (2, 200))
    rotation = from_wpr(w, np.full(200, side * np.pi / 2), r)
    w2, p2, r2 = to_wpr(rotation)
    assert_allclose(p2, side * np.pi / 2, atol=ATOL_RAD)
    assert not r2.any()
    assert_allclose(w2, w - side * r, atol=ATOL_RAD)  # Ry(90) Rx(w) = Rz(-w) Ry(90)
    assert_allclose(from_wpr(w2, p2, r2), rotation, atol=ATOL_RAD)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("gap_rad", [1e-3, 1e-6, 1e-8, 5e-10, 1e-12])
def test_near_p_of_90_the_rotation_round_trips(side, gap_rad):
    w, r = uniform(np.pi, (2, 200))
    rotation = from_wpr(w, np.full(200, side * (np.pi / 2 - gap_rad)), r)
    assert_allclose(from_wpr(*to_wpr(rotation)), rotation, atol=1e-9)  # 1e-9 rad: 1 nm at 1 m
