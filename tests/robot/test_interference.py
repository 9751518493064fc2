"""Where J2 and J3 may stand together: a polygon, convex or not, and half planes that keep small motions inside it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from compgen.core.exceptions import InterferenceError, JointLimitError
from compgen.core.polygons import signed_area
from compgen.core.units import DEG
from compgen.robot.interference import Interference, polygon_fault
from compgen.robot.joint_path import check_interference

NOTCHED = np.array([[-60, -80], [90, -80], [90, 60], [20, 60], [20, -10], [-10, -10], [-10, 60], [-60, 60]]) * DEG


def area_of(robot, corner, margin=0.0):
    return Interference(corner, np.linalg.inv(robot.pendant_map)[1:3], robot.pendant_zero, margin)


def thetas(robot, j2, j3):
    pendant = np.zeros((len(j2), 6))
    pendant[:, 1], pendant[:, 2] = j2, j3
    pendant[:, [0, 3, 4, 5]] = np.random.default_rng(0).uniform(-1, 1, (len(j2), 4))
    return robot.to_theta(pendant)


def winding(point, corner):
    """How often a polygon winds round a point: the angles under which it sees the edges, summed."""
    to = corner - point
    angle = np.arctan2(to[:, 1], to[:, 0])
    step = np.diff(np.append(angle, angle[0]))
    return round(float(((step + np.pi) % (2 * np.pi) - np.pi).sum() / (2 * np.pi)))


def nearest_of_many(point, corner, count=4001):
    """Distance from the edges, of points laid densely on them."""
    share = np.linspace(0, 1, count)[:, None, None]
    on_edges = corner + share * (np.roll(corner, -1, axis=0) - corner)
    return np.linalg.norm(on_edges - point, axis=2).min()


def star(seed, corners):
    """A polygon round the origin that is seen from it whole, mostly not convex; counter-clockwise."""
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, corners))
    radius = rng.uniform(0.3, 1.5, corners)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 12), st.sampled_from([0.0, 0.05]))
def test_the_clearance_is_the_distance_inside_and_its_negative_outside(robot, seed, corners, margin):
    corner = star(seed, corners)
    assume(signed_area(corner) > 1e-3 and not polygon_fault(corner))
    points = np.random.default_rng(seed + 1).uniform(-1.6, 1.6, (20, 2))
    clearance = area_of(robot, corner, margin).clearance(thetas(robot, *points.T))
    for point, value in zip(points, clearance, strict=True):
        distance = nearest_of_many(point, corner)
        sign = 1 if winding(point, corner) else -1
        assert value == pytest.approx(sign * distance - margin, abs=1e-3)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 12))
def test_what_the_half_planes_share_is_inside_and_reached_without_passing_an_edge(robot, seed, corners):
    corner = star(seed, corners)
    assume(signed_area(corner) > 1e-3 and not polygon_fault(corner))
    area, rng = area_of(robot, corner), np.random.default_rng(seed + 2)
    points = rng.uniform(-1.5, 1.5, (40, 2))
    theta = thetas(robot, *points.T)
    theta = theta[area.clearance(theta) > 0]
    assume(len(theta))
    reach = 0.4
    planes = area.half_planes(theta, reach)
    for row, x0 in enumerate(area.plane(theta)):
        assert ((planes.normal[row] * x0).sum(axis=1) >= planes.bound[row]).all()
        x = x0 + rng.uniform(-1, 1, (60, 2)) * reach / np.sqrt(2)
        kept = ((x @ planes.normal[row].T >= planes.bound[row]) | ~planes.near[row]).all(axis=1)
        assert kept.any()
        for point in x[kept]:
            assert winding(point, corner) == 1
            way = thetas(robot, *np.array([x0, point]).T)
            assert not area.crossed(way).any()


def test_near_an_edge_the_half_plane_is_the_edge(robot):
    area = area_of(robot, NOTCHED)
    planes = area.half_planes(thetas(robot, [0.0], [-10.5 * DEG]), 0.02)
    assert planes.near.sum() == 1
    k = int(np.argmax(planes.near[0]))
    assert_allclose(planes.normal[0, k], [0, -1], atol=1e-12)
    assert planes.bound[0, k] == pytest.approx(10 * DEG)
    on_edge = area.half_planes(thetas(robot, [0.0], [-10 * DEG]), 0.02)
    assert_allclose(on_edge.normal[0, int(np.argmax(on_edge.near[0]))], [0, -1], atol=1e-12)
    assert area_of(robot, NOTCHED, 0.01).half_planes(thetas(robot, [0.0], [-10.5 * DEG]), 0.02).bound[0, k] == (
        pytest.approx(10 * DEG + 0.01)
    )


def test_an_inner_corner_is_passed_on_the_side_of_the_pose(robot):
    """Beside the notch's corner the half plane stands square to the way to it: neither edge is prolonged."""
    area = area_of(robot, NOTCHED)
    planes = area.half_planes(thetas(robot, [20.5 * DEG], [-10.5 * DEG]), 0.02)
    assert planes.near.sum() == 2
    for k in np.flatnonzero(planes.near[0]):
        assert_allclose(planes.normal[0, k], [np.sqrt(0.5), -np.sqrt(0.5)], atol=1e-9)


def test_a_path_outside_or_through_a_notch_is_refused_with_its_waypoint(robot):
    inside = replace(robot, interference=area_of(robot, NOTCHED))
    ways = {"far": ([-30, -20, 0], [-50, -50, -50], None), "outside": ([-30, -20, 0], [-50, -50, 0], 3),
            "across the notch": ([-30, -11, 21, 40], [20, 20, 20, 20], 3)}  # fmt: skip
    for j2, j3, waypoint in ways.values():
        theta = thetas(robot, np.array(j2) * DEG, np.array(j3) * DEG)
        check_interference(robot, theta)  # no polygon: anywhere
        if waypoint is None:
            check_interference(inside, theta)
            continue
        with pytest.raises(InterferenceError) as refusal:
            check_interference(inside, theta)
        assert refusal.value.waypoint == waypoint
        assert refusal.value.exit_code == JointLimitError.exit_code == 3
        assert f"waypoint {waypoint}: J2 = " in str(refusal.value)
        assert len(str(refusal.value)) <= 300
    assert refusal.value.depth < 0  # inside at both ends
    assert "passes outside" in str(refusal.value)


@pytest.mark.parametrize(
    ("corners", "words"),
    [
        ([[0, 0], [1, 1]], "2 corners enclose nothing"),
        ([[0, 0], [1, 0], [1, 0], [0, 1]], "corner 2 and the next are the same"),
        ([[0, 0], [1, 1], [1, 0], [0, 1]], "edges behind corners 1 and 3 cross"),
        ([[0, 0], [1, 0], [2, 0]], "one line"),
    ],
)
def test_a_polygon_that_encloses_nothing_is_refused(corners, words):
    assert words in polygon_fault(np.array(corners, dtype=float))
    assert polygon_fault(NOTCHED) == ""
