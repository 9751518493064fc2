"""Logs laid along courses that come back on their own way, lie beside themselves, or are driven in part."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.arrays import lengths_along
from compgen.core.pose import IDENTITY
from compgen.verification.executed.course import ProgramCourse, divided
from compgen.verification.executed.followed_log import best_motion, constant_offset, shape_elsewhere
from compgen.verification.executed.tracking import components, fits, follow, project, travelled_way


def course(points):
    points = np.asarray(points, dtype=float)
    N, arc = len(points), lengths_along(points)
    clock = arc / 0.1
    stop = np.zeros(N, dtype=bool)
    stop[[0, -1]] = True
    down = np.tile(np.diag([1.0, -1.0, -1.0]), (N, 1, 1))
    return ProgramCourse(
        position=points,
        rotation=down,
        arc=arc,
        judged=np.ones(N - 1, dtype=bool),
        cruise=clock,
        statement=np.arange(N - 1),
        kept=np.where(stop, 0.0, 1.0),
        period=0.008,
        planned=clock,
        stop=stop,
        wait=np.zeros(N),
        waits=np.zeros(N, dtype=bool),
        number=np.arange(1, N + 1),
        theta=np.full((N, 6), np.nan),
        frame=IDENTITY,
        tool=IDENTITY,
        numbers=(0, 0),
    )


def raster(sweeps=10, step=0.002, length=0.2):
    points = []
    for k in range(sweeps):
        ends = [(0.0, k * step, 0.0), (length, k * step, 0.0)]
        points += ends if k % 2 == 0 else ends[::-1]
    return course(points)


def laid(path, arc, noise=0.0, seed=0):
    """Expected and found arc lengths of a log that is at arc lengths (M,)."""
    place = path.place(arc) + noise * np.random.default_rng(seed).normal(size=(len(arc), 3))
    travelled = travelled_way(place, noise)
    track = follow(path, place, travelled)
    return track, project(path, place, travelled, track)


def test_a_raster_is_followed_sweep_by_sweep():
    path = raster()
    arc = np.linspace(0, path.length, 20_000)
    track, projection = laid(path, arc, 3e-6)
    assert track.share == 1
    assert_allclose(projection.arc, arc, atol=3e-5)
    assert np.sqrt(np.mean(projection.distance**2)) == pytest.approx(3e-6 * np.sqrt(2), rel=0.05)


def test_a_way_that_comes_back_on_itself_is_two_ways():
    path = course([(0, 0, 0), (0.3, 0, 0), (0, 0, 0), (0.3, 0, 0)])
    arc = np.linspace(0, 0.9, 9001)
    _, projection = laid(path, arc)
    assert_allclose(projection.arc, arc, atol=1e-9)


def test_a_part_of_a_raster_is_found_where_it_is():
    path = raster()
    arc = np.linspace(0.37 * path.length, 0.61 * path.length, 5000)
    track, projection = laid(path, arc, 1e-6)
    assert fits(path, track)
    assert_allclose(projection.arc, arc, atol=2e-5)


def test_a_robot_that_stands_does_not_travel():
    place = np.repeat([[0.5, 0.0, 0.0]], 2000, axis=0) + 2e-6 * np.random.default_rng(1).normal(size=(2000, 3))
    assert travelled_way(place, 2e-6)[-1] < 1e-4
    moved = np.column_stack([np.linspace(0, 1, 5001), np.zeros(5001), np.zeros(5001)])
    assert travelled_way(moved, 2e-6)[-1] == pytest.approx(1.0, rel=1e-6)


def test_another_path_in_the_same_place_does_not_fit():
    path = raster()
    across = path.place(np.linspace(0, path.length, 5000))[:, [1, 0, 2]] * [10, 0.1, 1]
    assert not fits(path, follow(path, across, travelled_way(across, 0.0)))


def test_a_shape_elsewhere_comes_back_with_its_motion():
    path = raster(step=0.01)
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    place = path.place(np.linspace(0, path.length, 4000))
    there = place @ turned.T + [0.4, -0.2, 0.7]
    motion = shape_elsewhere(path, there, travelled_way(there, 0.0))
    assert motion is not None
    assert_allclose(motion.act(there), place, atol=2e-4)
    assert_allclose(best_motion(there, place).rotation, turned.T, atol=1e-9)
    assert shape_elsewhere(path, there * [1.0, 0.3, 1.0], travelled_way(there, 0.0)) is None


def test_an_offset_is_known_where_the_path_has_several_directions():
    path = course([(0, 0, 0), (0.2, 0, 0), (0.2, 0.2, 0), (0.2, 0.2, 0.1)])
    arc = np.linspace(0, path.length, 3000)
    place = path.place(arc) + np.array([2e-4, -1e-4, 3e-4])
    travelled = travelled_way(place, 0.0)
    projection = project(path, place, travelled, follow(path, place, travelled))
    offset = constant_offset(path, projection.way, projection.off)
    assert offset is not None
    assert_allclose(offset.vector, [2e-4, -1e-4, 3e-4], atol=3e-6)
    line = course([(0, 0, 0), (0.5, 0, 0)])
    assert constant_offset(line, np.zeros(50, dtype=int), np.tile([0.0, 1e-4, 0.0], (50, 1))) is None


def test_across_is_to_the_side_and_normal_is_off_the_surface():
    """Travel along x, the tool's axis down: y is across, up is normal."""
    path = course([(0, 0, 0), (0.5, 0, 0)])
    place = path.place(np.linspace(0, 0.5, 100)) + np.array([0, 2e-5, 5e-5])
    travelled = travelled_way(place, 0.0)
    projection = project(path, place, travelled, follow(path, place, travelled))
    across, normal = components(path, projection, slice(None))
    assert_allclose(across, 2e-5, atol=1e-12)
    assert_allclose(normal, 5e-5, atol=1e-12)


def test_nodes_on_an_arc_lie_on_its_circle_and_close_enough():
    angle = np.radians([0, 60, 170])
    points = np.column_stack([0.3 * np.cos(angle), 0.3 * np.sin(angle), np.zeros(3)])
    number, places = divided(points, np.array([False, True, False]))
    assert_allclose(np.linalg.norm(places, axis=1), 0.3, atol=1e-12)
    assert_allclose(places[np.isin(number, [0, 1, 2])], points)
    chord = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert (chord**2 / 8 / 0.3).max() < 2.1e-7
    assert_allclose(
        np.interp([0.5, 1.5], number, np.degrees(np.arctan2(places[:, 1], places[:, 0]))), [30, 115], atol=0.1
    )


@pytest.mark.parametrize("passes", [8, 21])
@pytest.mark.parametrize("noise", [1e-6, 2e-5, 1e-4])
def test_passes_to_and_fro_over_one_line_are_paired_in_order(passes, noise):
    """Each place is passed in both directions, and what digits leave may lie nearer to another pass.

    Nearer to a tip than the gate the two sides of this one reversal may be taken for each other.
    """
    path = course([(0.4 * (k % 2), 0.0, 0.0) for k in range(passes + 1)])
    arc = np.linspace(0, path.length, 1000 * passes + 1)
    for seed in range(4):
        track, projection = laid(path, arc, noise, seed)
        assert track.on.all()
        at_tip = np.abs(arc - 0.4 * np.round(arc / 0.4)) < 5e-3
        assert (np.abs(projection.arc - arc) < np.where(at_tip, 1e-2, 6 * noise + 1e-4)).all()


def test_a_row_beyond_a_reversal_is_not_of_an_earlier_pass():
    """Strokes of other lengths: behind the tip of a short one the next way but one passes the very place."""
    path = course([(x, 0.0, 0.0) for x in (1.3, 0.9, 1.2, 1.0, 1.3, 1.1, 1.25, 0.9)])
    arc = np.linspace(0, path.length, 8000)
    for seed in range(4):
        _, projection = laid(path, arc, 2e-5, seed)
        assert np.abs(projection.arc - arc).max() < 4e-4


def test_a_joint_motion_that_passes_beside_a_later_line_is_not_on_that_line():
    points = [(0, 0, 0), (0.3, 0, 0), (0.3, 0, -0.2), (0.15, 0.2, -0.2), (0.15, 0.2, 0), (0.15, 0.0355, 0)]
    path = replace(course(points), judged=np.array([False, True, True, True, True]))
    bow = course([(0, 0, 0), (0, 0.03, 0), (0.32, 0.03, 0), (0.3, 0, 0)])  # 5.5 mm beside the last line
    bow_place = bow.place(np.linspace(0, bow.length, 401))
    place = np.concatenate([bow_place, path.place(np.linspace(0.3, path.length, 3001))])
    travelled = travelled_way(place, 0.0)
    track = follow(path, place, travelled)
    assert fits(path, track)
    assert project(path, place, travelled, track).arc[: len(bow_place)].max() < 0.301
