"""Lines and arcs of a program between its stations, by hand: which they are, the places on them, and the reach."""

from dataclasses import replace

import naive_arm
import numpy as np
import pytest
from ls_text import cartesian, program
from numpy.testing import assert_allclose

from compgen import fanuc
from compgen.core.pose import IDENTITY, Pose
from compgen.core.rotations import from_wpr
from compgen.core.units import DEG, MM
from compgen.fanuc.analysis.poses import program_poses
from compgen.fanuc.analysis.traversal import read_traversal
from compgen.pipelines.files.robot_file import load_robot
from compgen.program import ways
from compgen.program.frames import Frames, default_frames
from compgen.robot.inverse_kinematics import Posture, solve_flange

#: mm and deg: ahead, a half circle of 50 mm radius to the left, back on a line while the tool spins by 60 deg
PLACES = [
    (1300, 0, 203, 180, 0, 0),
    (1400, 0, 203, 180, 0, 0),
    (1450, 50, 203, 180, 0, 0),
    (1400, 100, 203, 180, 0, 0),
    (1200, 100, 203, 180, 0, 60),
    (1200, -100, 203, 180, 0, 0),
]
MOVES = ["J P[1] 10% FINE", "L P[2] 100mm/sec CNT100", "C P[3]\n    :  P[4] 100mm/sec CNT100"]
MOVES += ["L P[5] 100mm/sec CNT100", "J P[6] 10% FINE"]


@pytest.fixture(scope="module")
def arm():
    return load_robot("m710ic50")


def driven(arm, moves, places):
    text = program(moves, [cartesian(n, place) for n, place in enumerate(places, 1)])
    read = fanuc.loads(text)
    return ways.measure_reach(arm, read_traversal(read, program_poses(read, arm, default_frames()), arm))


@pytest.fixture(scope="module")
def drive(arm):
    return driven(arm, MOVES, PLACES)


def test_lines_and_arcs_between_known_places_are_told_apart(drive):
    assert ways.straight_lines(drive).tolist() == [False, True, False, False, True, False]
    assert ways.circular_ways(drive).tolist() == [False, False, True, True, False, False]
    assert ways.swept_angles(drive, np.array([2])) == pytest.approx([np.pi])
    assert ways.arcs_in_line(drive, np.array([2])).tolist() == [False]
    assert not drive.beyond.any()
    assert_allclose(drive.length[1:5] / MM, [100, 25 * np.pi, 25 * np.pi, 200])


def test_places_and_turns_on_the_way_are_those_of_the_line_and_of_the_circle(drive):
    station, fraction = ways.path_samples(drive, np.array([0.25, 0.5]))
    assert station.tolist() == [0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4, 5]
    assert fraction.tolist() == [1, *4 * [0.25, 0.5, 1], 1]
    poses = ways.interpolate_poses(drive, station, fraction)
    turned = np.radians([-67.5, -45, 0, 22.5, 45, 90])  # of the half circle, seen from its centre
    circle = np.array([1400, 50, 203]) + 50 * np.column_stack([np.cos(turned), np.sin(turned), 0 * turned])
    ahead, back = (
        [[x, y, 203] for x in line] for line, y in (((1300, 1325, 1350, 1400), 0), ((1350, 1300, 1200), 100))
    )
    assert_allclose(poses.position / MM, [*ahead, *circle, *back, [1200, -100, 203]], atol=1e-9)
    spin = np.array([[180, 0, r] for r in (*10 * [0], 15, 30, 60, 0)]) * DEG
    assert_allclose(poses.rotation, from_wpr(*spin.T), atol=1e-12)


def test_each_sample_stands_for_half_of_the_ways_beside_it_arcs_and_joint_motions_among_them(arm, drive):
    station, fraction = np.arange(6), np.ones(6)
    theta = drive.at.theta[drive.pose]
    share = np.linspace(0, 1, 400)[:, None]
    pendant = np.degrees(arm.to_pendant(theta[4] + share * (theta[5] - theta[4])))
    swung = np.array([naive_arm.flange(joints)[:3, 3] for joints in pendant])
    way = np.array([100, 25 * np.pi, 25 * np.pi, 200, np.linalg.norm(np.diff(swung, axis=0), axis=1).sum()])
    expected = (np.append(way, 0) + np.append(0, way)) / 2
    lengths = ways.way_lengths(arm, drive, station, fraction, np.ones(6, dtype=bool)) / MM
    assert_allclose(lengths, expected, rtol=3e-3)
    assert_allclose(lengths[:4], expected[:4], rtol=1e-9)
    some = ways.way_lengths(arm, drive, station, fraction, np.array([1, 1, 0, 1, 1, 0], dtype=bool)) / MM
    assert_allclose(some, [50, 50, 0, 100, 100, 0], rtol=1e-9)
    between = ways.path_samples(drive, np.array([0.5]))
    halves = ways.way_lengths(arm, drive, *between, np.ones(len(between[0]), dtype=bool)) / MM
    assert_allclose(halves[:8], [25, 50, 25 + way[1] / 4, *3 * [way[1] / 2], way[1] / 4 + 50, 100], rtol=1e-9)
    alone = ways.way_lengths(arm, drive, station, fraction, np.arange(6) % 2 == 0)
    assert alone.tolist() == [1, 0, 1, 0, 1, 0]


def test_three_places_in_one_line_make_no_arc(arm):
    straight = driven(arm, MOVES, [*PLACES[:2], (1450, 0, 203, 180, 0, 0), (1500, 0, 203, 180, 0, 0), *PLACES[4:]])
    assert ways.arcs_in_line(straight, np.array([2])).tolist() == [True]
    assert not ways.circular_ways(straight).any()


@pytest.mark.parametrize(
    ("second", "is_line"),
    [
        ({}, True),
        ({"letters": "F U T, 0, 0, 0"}, False),
        ({"ut": 2}, False),
        ({"letters": "F U T, 0, 0, 0", "ut": 2}, False),
    ],
)
def test_a_line_has_one_tool_and_one_posture_at_both_ends(arm, second, is_line):
    points = [cartesian(1, PLACES[0], ut=1), cartesian(2, PLACES[1], **{"ut": 1, **second})]
    read = fanuc.loads(program(MOVES[:2], points))
    frames = Frames({0: IDENTITY}, {0: IDENTITY, 1: IDENTITY, 2: IDENTITY})
    drive = read_traversal(read, program_poses(read, arm, frames), arm)
    assert ways.between_known_ends(drive).tolist() == [False, is_line]


@pytest.mark.parametrize("unknown", ["P[9]", "PR[1]"])
def test_an_arc_to_a_place_that_is_not_known_is_none(arm, unknown):
    moves = [*MOVES[:2], f"C P[3]\n    :  {unknown} 100mm/sec CNT100", *MOVES[3:]]
    assert not driven(arm, moves, PLACES).circular.any()


def reach(arm, x, y, z):
    """How far inside the reach places are with the tool straight down [m]."""
    down = np.tile(np.diag([1.0, -1.0, -1.0]), (len(x), 1, 1))
    return solve_flange(arm, Pose(np.column_stack([x, y, np.full(len(x), z)]) * MM, down), Posture())[1]


def test_a_line_past_the_shoulder_leaves_the_reach_where_the_arm_cannot_fold_so_far(arm):
    ends = [(200, y, -175, 180, 0, 0) for y in (-900, 900)]
    through = driven(arm, ["J P[1] 10% FINE", "L P[2] 100mm/sec FINE"], ends)
    y = np.linspace(-900, 900, 1001)
    margin = reach(arm, np.full(1001, 200.0), y, -175.0)
    assert through.beyond == pytest.approx([0, -margin.min()], abs=1e-6)
    assert through.beyond[1] > 0.1
    assert ways.between_known_ends(through).tolist() == [False, True]
    assert not ways.straight_lines(through).any()


def test_an_arc_that_bulges_out_of_the_reach_is_none_to_correct(arm):
    def around(degrees):
        turn = np.radians(degrees)
        return 100 + 1925 * np.cos(turn), 1925 * np.sin(turn)

    places = [(*around(turn), 203, 180, 0, 0) for turn in (-70, -40, 60)]
    bulging = driven(arm, ["J P[1] 10% FINE", "C P[2]\n    :  P[3] 100mm/sec FINE"], places)
    x, y = around(np.linspace(-40, 60, 2001))
    margin = reach(arm, x, y, 203.0)
    assert bulging.beyond == pytest.approx([0, 0, -margin.min()], abs=1e-5)
    assert bulging.beyond[2] > 5 * MM
    assert bulging.circular.tolist() == [False, True, True]
    assert not ways.circular_ways(bulging).any()


@pytest.mark.parametrize(("x", "told"), [(30.0, True), (-30.0, True), (500.0, False)])
def test_a_line_past_the_j1_axis_is_told_by_how_far_it_stays_from_it(arm, x, told):
    ends = [(x, y, 700, 180, 0, 0) for y in (-700, 700)]
    passing = driven(arm, ["J P[1] 10% FINE", "L P[2] 100mm/sec FINE"], ends)
    near = replace(arm, shoulder_margin=0.05, elbow_margin=0.0, wrist_margin=0.0)
    assert ways.singular_ways(near, passing) == [(1, "the J1 axis by 30.00 mm")] * told
    assert ways.singular_ways(replace(near, shoulder_margin=0.02), passing) == []


def test_a_short_way_that_comes_a_little_nearer_to_the_j1_axis_is_told_too(arm):
    """From 289 mm to 285 and back, where 288 are allowed."""
    passing = driven(arm, MOVES[:2], [(285, y, 700, 180, 0, 0) for y in (-50, 50)])
    near = replace(arm, shoulder_margin=0.288, elbow_margin=0.0, wrist_margin=0.0)
    assert ways.singular_ways(near, passing) == [(1, "the J1 axis by 285.00 mm")]
    assert ways.singular_ways(replace(near, shoulder_margin=0.284), passing) == []
