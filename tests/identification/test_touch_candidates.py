"""Ways to touch spheres, judged by the study's arm a second time and by fine steps along each way."""

from dataclasses import replace

import numpy as np
import pytest
from naive_arm import flange
from numpy.testing import assert_allclose

from compgen.core.pose import Pose
from compgen.identification.touch_candidates import Probe, Search, Targets, reachable_ways
from compgen.pipelines.files.robot_file import load_robot
from compgen.robot.interference import Interference
from compgen.robot.inverse_kinematics import Posture

PLACES = np.array([[700, -680, 203], [2000, -680, 203], [1900, 500, 203.0]])  # mm
RADIUS, BALL, LENGTH = 15.0, 3.0, 150.0  # mm


@pytest.fixture(scope="module")
def arm():
    return load_robot("m710ic50")


UNFLIPPED, FLIPPED = Posture(), Posture(flip=True)


def ways(arm, places=PLACES, centres=False, posture=UNFLIPPED):
    count = len(places)
    spheres = Targets(tuple("abcdef"[:count]), places / 1e3, np.full(count, RADIUS / 1e3), np.full((count, 3), np.nan))
    return ways_to(arm, spheres, centres, posture)


def ways_to(arm, targets, centres=False, posture=UNFLIPPED):
    probe = Probe(Pose(np.array([0, 0, LENGTH / 1e3]), np.eye(3)), BALL / 1e3)
    near = arm.to_theta(np.zeros((1, 6)))[0]
    return reachable_ways(arm, posture, near, targets, probe, Search(0.02, 0.003, centres))


def ball(arm, theta):
    """The ball's centre [mm] and the flange's axis, by the second arm."""
    pose = flange(np.degrees(arm.to_pendant(theta)))
    return (pose @ np.array([0, 0, LENGTH, 1]))[:3], pose[:3, 2]


def test_the_ball_meets_the_sphere_and_comes_along_the_direction(arm):
    all_ways = ways(arm)
    assert set(all_ways.target.tolist()) == {0, 1, 2}
    for k in range(0, len(all_ways.target), 37):
        place, n = PLACES[all_ways.target[k]], all_ways.normal[k]
        lifted, before, touch, beyond = (ball(arm, theta)[0] for theta in all_ways.theta[k])
        assert_allclose(touch, place - (RADIUS + BALL) * n, atol=1e-6)
        assert_allclose(before, touch - 20 * n, atol=1e-6)
        assert_allclose(beyond, touch + 3 * n, atol=1e-6)
        assert_allclose(lifted, before - 150 * ball(arm, all_ways.theta[k, 0])[1], atol=1e-6)


def test_stems_stay_out_of_spheres_and_of_what_they_stand_on(arm):
    """The nearest point of each stem to each sphere and to the vertical below it, from 400 points."""
    all_ways, share = ways(arm), np.linspace(0, 1, 400)[:, None]
    for k in range(0, len(all_ways.target), 37):
        for theta in all_ways.theta[k, 1:3]:
            tip, axis = ball(arm, theta)
            stem = tip - share * LENGTH * axis
            for s, place in enumerate(PLACES):
                off, least = stem - place, RADIUS + BALL - 1e-6
                if s != all_ways.target[k]:  # 0.5 mm for a stem looked at in steps
                    off[:, 2], least = np.maximum(off[:, 2], 0), RADIUS + BALL + 5 - 0.5
                assert np.linalg.norm(off, axis=1).min() >= least


def test_every_way_keeps_posture_limits_and_distance_from_singularities(arm):
    all_ways = ways(arm)
    theta = all_ways.theta.reshape(-1, 6)
    assert (theta >= arm.lower).all()
    assert (theta <= arm.upper).all()
    assert (np.degrees(arm.to_pendant(theta))[:, 4] < -1).all()  # wrist not flipped
    assert np.abs(np.diff(all_ways.theta, axis=1)).max() < np.radians(60)
    flipped = ways(arm, posture=FLIPPED)
    assert len(flipped.target)
    assert (np.degrees(arm.to_pendant(flipped.theta.reshape(-1, 6)))[:, 4] > 1).all()


def test_centres_are_located_from_above_in_three_coordinates(arm):
    all_ways = ways(arm, centres=True)
    assert np.isnan(all_ways.normal).all()
    assert len(all_ways.target) > 100
    for k in range(0, len(all_ways.target), 37):
        assert_allclose(ball(arm, all_ways.theta[k, 2])[0], PLACES[all_ways.target[k]], atol=1e-6)


def test_a_sphere_out_of_reach_has_no_way(arm):
    all_ways = ways(arm, np.vstack([PLACES, [3500.0, 0, 203]]))
    assert set(all_ways.target.tolist()) == {0, 1, 2}


def test_a_neighbour_in_the_way_takes_ways(arm):
    beside = np.array([PLACES[0], PLACES[0] + [55.0, 0, 0]])
    assert (ways(arm, beside).target == 0).sum() < (ways(arm, PLACES[:1]).target == 0).sum()


def test_ways_beyond_a_limit_or_near_a_singularity_are_not_taken(arm):
    """An arm of narrower limits, and one that keeps far from its singularities."""

    def pendant(some_arm):
        return np.degrees(some_arm.to_pendant(ways(some_arm).theta))

    lower, upper = arm.lower + np.radians([0, 0, 0, 0, 0, 310]), arm.upper - np.radians([0, 0, 0, 300, 0, 0])
    wide, narrow = pendant(arm), pendant(replace(arm, lower=lower, upper=upper))
    assert wide[..., 3].max() > 60 > narrow[..., 3].max()
    assert wide[..., 5].min() < -50 < narrow[..., 5].min()
    assert wide[..., 4].max() > -60 > pendant(replace(arm, wrist_margin=np.radians(60)))[..., 4].max()
    corner = np.radians([[-60, -90], [60, -90], [60, 20], [-60, -20]])  # J2 and J3
    plane = np.linalg.inv(arm.pendant_map)[1:3]
    held = replace(arm, interference=Interference(corner, plane, arm.pendant_zero))
    assert (held.interference.clearance(ways(held).theta.reshape(-1, 6)) > 0).all()
    assert 0 < len(ways(held).target) < len(ways(arm).target)
    for margin, value in (("shoulder_margin", 1.0), ("elbow_margin", 0.3)):
        assert 0 < len(ways(replace(arm, **{margin: value})).target) < len(ways(arm).target)


def test_a_plane_is_touched_at_its_point_along_its_normal(arm):
    place, normal = np.array([[1500.0, 0, 100]]), np.array([[0.6, 0, 0.8]])
    plane = Targets(("top",), place / 1e3, np.zeros(1), normal)
    all_ways = ways_to(arm, plane)
    assert len(all_ways.target) > 10
    assert_allclose(all_ways.normal, np.tile(-normal, (len(all_ways.target), 1)))
    for k in range(0, len(all_ways.target), 7):
        assert_allclose(ball(arm, all_ways.theta[k, 2])[0], place[0] + BALL * normal[0], atol=1e-6)
    assert not len(ways_to(arm, plane, centres=True).target)
