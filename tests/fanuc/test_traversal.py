"""Times of the ways of a program, by hand."""

from dataclasses import replace

import numpy as np
import pytest
from ls_text import cartesian, program
from numpy.testing import assert_allclose

from compgen import fanuc
from compgen.fanuc.analysis.poses import program_poses
from compgen.fanuc.analysis.traversal import read_traversal
from compgen.pipelines.files.robot_file import load_robot
from compgen.program.driven import NONE
from compgen.program.frames import default_frames
from compgen.robot.motion import ControllerMotion

DOWN = (180.0, 0.0, 0.0)
PLACES = [(1300.0, 0.0, 203.0, *DOWN), (1400.0, 0.0, 203.0, *DOWN), (1400.0, 0.0, 203.0, 180.0, 0.0, 90.0)]


def whole(seconds):
    """Up to the next whole interpolation period of 8 ms."""
    return np.ceil(seconds / 8e-3 - 1e-9) * 8e-3


@pytest.fixture(scope="module")
def arm():
    return load_robot("m710ic50")


def traversal(arm, *moves):
    text = program(["J P[1] 10% CNT100", *moves], [cartesian(n, p) for n, p in enumerate(PLACES, 1)])
    read = fanuc.loads(text)
    poses = program_poses(read, arm, default_frames())
    return poses, read_traversal(read, poses, arm)


@pytest.mark.parametrize(
    ("speed", "seconds"),
    [("100mm/sec", 1.0), ("60cm/min", 10.0), ("100.0inch/min", whole(100 / (100 * 25.4 / 60))), ("2.5sec", whole(2.5)),
     ("500msec", whole(0.5))],
)  # fmt: skip
def test_a_way_takes_its_length_over_its_speed_or_the_time_it_names(arm, speed, seconds):
    _, drive = traversal(arm, f"L P[2] {speed} CNT100")
    assert_allclose(drive.length[1], 0.1)
    assert_allclose(drive.duration[1], seconds)
    assert drive.untimed == ()


@pytest.mark.parametrize("option", ["INC", "ACC80 Incremental"])
def test_a_step_leads_to_no_place_and_its_way_is_not_told(arm, option):
    """The numbers of P[2] are added to where the robot stands; it was timed as if it drove to them, and back."""
    poses, drive = traversal(arm, f"L P[2] 1mm/sec CNT100 {option}", "L P[1] 1mm/sec CNT100", "L P[3] 1mm/sec CNT100")
    assert drive.pose.tolist() == [0, NONE, 0, 2]
    assert_allclose(drive.duration, [0, 0, 0, 100.0])
    assert len(drive.untimed) == 2
    assert np.isnan(poses.theta).any(axis=1).tolist() == [False, True, False]
    poses, drive = traversal(arm, f"L P[2] 1mm/sec CNT100 {option}", "L P[2] 1mm/sec CNT100")  # a place as well
    assert drive.pose.tolist() == [0, NONE, 1]
    assert np.isfinite(poses.theta).all()


def test_a_speed_that_run_time_decides_counts_as_100_mm_s_and_a_quarter_of_the_joints_speed(arm):
    poses, drive = traversal(arm, "L P[2] R[1]mm/sec CNT100", "J P[3] R[2]% CNT100")
    joints = (np.abs(poses.theta[2] - poses.theta[1]) / arm.speed).max() / 0.25
    assert_allclose(drive.duration[1:], [1.0, whole(joints)])
    assert len(drive.untimed) == 2


def test_a_program_without_motions_has_no_stations_and_waits(arm):
    read = fanuc.loads(program(["WAIT   2.50(sec)"], [cartesian(1, PLACES[0])]))
    drive = read_traversal(read, program_poses(read, arm, default_frames()), arm)
    assert len(drive.pose) == len(drive.via) == len(drive.stop) == 0
    assert drive.rest == 2.5


@pytest.mark.parametrize("option", ["TA .00sec,DO[1:INC FEED]=ON", "DB 5.0mm,DO[1:INC]=ON", "TB .50sec,CALL INC"])
def test_a_name_is_no_step(arm, option):
    """In brackets, or of a program that is called: the way there and from there was not timed, and untold."""
    poses, drive = traversal(arm, f"L P[2] 1mm/sec CNT100 {option}", "L P[1] 1mm/sec CNT100")
    assert drive.pose.tolist() == [0, 1, 0]
    assert_allclose(drive.duration[1:], 100.0)
    assert np.isfinite(poses.theta).all()


def test_a_motion_that_is_off_makes_no_step(arm):
    poses, drive = traversal(arm, "//L P[2] 1mm/sec CNT100 INC", "L P[3] 1mm/sec CNT100")
    assert drive.pose.tolist() == [0, 2]
    assert np.isfinite(poses.theta).all()


def test_a_turn_on_the_spot_takes_its_angle_over_its_rate(arm):
    back_and_forth = ("L P[3] 30deg/sec CNT100", "L P[2] 45deg/sec CNT100")
    _, drive = traversal(arm, "L P[2] 100mm/sec CNT100", *back_and_forth)
    assert_allclose(drive.length[2:], 0.0, atol=1e-12)
    assert_allclose(drive.duration[2:], [3.0, 2.0])


def test_no_joint_outruns_its_speed_where_the_tool_turns_on_the_spot(arm):
    poses, drive = traversal(arm, "L P[2] 100mm/sec CNT100", "L P[3] 100mm/sec CNT100")
    assert_allclose(drive.duration[2], whole((np.abs(poses.theta[2] - poses.theta[1]) / arm.speed).max()))


def test_a_joint_motion_takes_its_longest_turn_over_its_share_of_the_speed_in_whole_periods(arm):
    poses, drive = traversal(arm, "J P[2] 20% CNT100")
    longest = (np.abs(poses.theta[1] - poses.theta[0]) / arm.speed).max() / 0.2
    assert_allclose(drive.written[1], longest)
    assert_allclose(drive.duration[1], whole(longest))
    assert drive.duration[1] > drive.written[1]


def test_the_tool_goes_round_on_a_joint_motion_and_what_is_driven_is_that_way_over_its_time(arm):
    """J1 swings by 120 deg, 1300 mm from its axis; the straight way between both ends is 17 % shorter."""
    swung = (1300 * np.cos(2 * np.pi / 3), 1300 * np.sin(2 * np.pi / 3), 203.0, 180.0, 0.0, 120.0)
    text = program(["J P[1] 10% CNT100", "J P[2] 10% CNT100"], [cartesian(1, PLACES[0]), cartesian(2, swung)])
    read = fanuc.loads(text)
    drive = read_traversal(read, program_poses(read, arm, default_frames()), arm)
    assert_allclose(drive.length[1], 1.3 * 2 * np.pi / 3, rtol=3e-3)
    assert_allclose(drive.joint_motion().driven[-1], drive.length[1] / drive.duration[1])


def test_each_stop_adds_both_means_of_the_run_it_ends_to_lines_and_joint_motions(arm):
    """256 + 168 ms behind a first statement that lasts as long, 176 + 168 behind a shorter one."""
    known = replace(arm, motion=ControllerMotion(moving_averages=(0.176, 0.168), after_long=(0.256, 0.168)))
    moves = ["J P[2] 300msec FINE", "L P[1] 100mm/sec CNT100", "J P[2] 300msec FINE"]
    moves += ["J P[1] 300msec CNT50", "L P[2] 100mm/sec CNT0"]
    seconds = [0.304 + 0.344, 1.0, 0.304 + 0.424, 0.304, 1.0 + 0.344]  # where it comes from at first is not known
    _, drive = traversal(known, *moves)
    assert_allclose(drive.duration[1:], seconds)
    _, expected = traversal(arm, *moves)  # where it is not known, as of its class
    assert_allclose(expected.duration[1:], seconds)
    slower = drive.at_override(0.5)
    assert_allclose(slower.written, drive.written / 0.5)
    assert_allclose(slower.duration - slower.written, drive.duration - drive.written, atol=1e-15)


def test_nothing_settles_at_a_stop_where_the_robot_stood(arm):
    _, drive = traversal(arm, "L P[2] 100mm/sec FINE", "J P[2] 20% FINE", "L P[2] 100mm/sec FINE")
    assert_allclose(drive.duration[1:], [1.344, 0.008, 0.008])


def test_both_halves_of_an_arc_last_whole_periods_together(arm):
    _, drive = traversal(arm, "C P[2]\n    :  P[1] 1001msec CNT100")
    assert_allclose(drive.written[1:3], 0.5005)
    assert_allclose(drive.duration[1:3].sum(), 1.008)


def test_without_a_robot_lines_take_their_lengths_over_their_speeds_alone():
    read = fanuc.loads(
        program(["L P[1] 100mm/sec FINE", "L P[2] 100mm/sec FINE"], [cartesian(n, p) for n, p in enumerate(PLACES, 1)])
    )
    drive = read_traversal(read, program_poses(read, None, default_frames()), None)
    assert_allclose(drive.duration[1], 1.0)


def test_a_program_that_ends_on_an_arc_takes_the_arcs_time():
    """Half a circle of 50 mm: to the point between and from there, a quarter each."""
    corners = [(1300.0, 0.0, 203.0), (1350.0, 50.0, 203.0), (1400.0, 0.0, 203.0)]
    points = [cartesian(n, (*p, *DOWN)) for n, p in enumerate(corners, 1)]
    read = fanuc.loads(program(["L P[1] 100mm/sec FINE", "C P[2]\n    :  P[3] 100mm/sec FINE"], points))
    drive = read_traversal(read, program_poses(read, None, default_frames()), None)
    assert_allclose(drive.length[1:], 0.05 * np.pi / 2)
    assert_allclose(drive.duration[1:].sum(), 0.5 * np.pi, atol=0.02)


def test_a_way_from_a_place_that_is_not_known_has_no_origin_and_no_time(arm):
    _, drive = traversal(arm, "L P[2] 100mm/sec CNT100", "L P[9] 100mm/sec CNT100", "L P[3] 100mm/sec CNT100")
    assert drive.origin.tolist() == [NONE, 0, 1, NONE]
    assert np.isnan(drive.length).tolist() == [True, False, True, True]


@pytest.mark.parametrize(
    ("table", "lines"),
    [((0, 0, 0), ()), ((0, 90, 90), (5,)), ((0, 0, None), (6,)), ((None, None, None), ())],
)
def test_how_long_a_way_takes_on_which_another_group_moves_is_not_told(arm, table, lines):
    """A table that turns by 90 deg while the arm goes on by a millimetre took 0.01 s, without a word."""
    more = ["" if turn is None else f"\n   GP2:\n\tUF : 0, UT : 0,\n\tJ1= {turn:.3f} deg" for turn in table]
    points = [cartesian(n, p, more=e) for n, (p, e) in enumerate(zip(PLACES, more, strict=True), 1)]
    read = fanuc.loads(program(["J P[1] 10% FINE", "L P[2] 100mm/sec FINE", "L P[3] 100mm/sec FINE"], points))
    drive = read_traversal(read, program_poses(read, arm, default_frames()), arm)
    assert drive.untimed == lines


@pytest.mark.parametrize(
    ("axis", "carried"),
    [
        ((0, 0, 0), [False, False, False]),  # it stands wherever it is
        ((0, 0, 100), [True, False, True]),  # where the first way begins is not known
        ((0, 50, 50), [True, True, False]),
        ((None, None, None), [False, False, False]),
        ((5, None, 5), [False, False, True]),
    ],
)
def test_a_way_on_which_an_extended_axis_moves_carries_the_arm(arm, axis, carried):
    more = ["" if e is None else f",\n\tE1= {e:.3f}  mm" for e in axis]
    points = [cartesian(n, p, more=e) for n, (p, e) in enumerate(zip(PLACES, more, strict=True), 1)]
    read = fanuc.loads(program(["J P[1] 10% FINE", "L P[2] 100mm/sec FINE", "L P[3] 100mm/sec FINE"], points))
    drive = read_traversal(read, program_poses(read, arm, default_frames()), arm)
    assert drive.carried.tolist() == carried
