"""Times of the ways of a program, by hand."""

import numpy as np
import pytest
from ls_text import cartesian, program
from numpy.testing import assert_allclose

from compgen import fanuc
from compgen.fanuc.analysis.poses import read_poses
from compgen.fanuc.analysis.traversal import RAMP, read_traversal
from compgen.pipelines.files.robot_file import load_robot
from compgen.program.frames import default_frames

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
    poses = read_poses(read, arm, default_frames())
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


def test_a_turn_on_the_spot_takes_its_angle_over_its_rate(arm):
    _, drive = traversal(arm, "L P[2] 100mm/sec CNT100", "L P[3] 30deg/sec CNT100")
    assert_allclose(drive.length[2], 0.0, atol=1e-12)
    assert_allclose(drive.duration[2], 3.0)


def test_no_joint_outruns_its_speed_where_the_tool_turns_on_the_spot(arm):
    poses, drive = traversal(arm, "L P[2] 100mm/sec CNT100", "L P[3] 100mm/sec CNT100")
    assert_allclose(drive.duration[2], whole((np.abs(poses.theta[2] - poses.theta[1]) / arm.speed).max()))


def test_a_joint_motion_takes_its_longest_turn_over_its_share_of_the_speed(arm):
    poses, drive = traversal(arm, "J P[2] 20% CNT100")
    assert_allclose(drive.duration[1], (np.abs(poses.theta[1] - poses.theta[0]) / arm.speed).max() / 0.2)


def test_each_stop_adds_half_a_ramp(arm):
    """T = v / a + a / j of the joint that needs longest, at both ends of a way or at one; a way takes whole periods."""
    poses, free = traversal(arm, "L P[2] 100mm/sec CNT100", "L P[1] 100mm/sec CNT100")
    _, held = traversal(arm, "L P[2] 100mm/sec FINE", "L P[1] 100mm/sec CNT100")
    rate = np.abs(poses.theta[1] - poses.theta[0]) / 1.0  # in one second
    ramp = (rate / (RAMP * arm.acceleration)).max() + (arm.acceleration / arm.jerk).max()
    assert_allclose(free.duration[1:], 1.0)
    assert_allclose(held.duration[1:], whole(1.0 + ramp / 2))
