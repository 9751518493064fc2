"""Numbers of a corrected position: of all ways to print a rotation the one that the program had."""

import numpy as np
import pytest
from ls_text import cartesian, program
from naive_arm import frame
from numpy.testing import assert_allclose

from compgen.core.pose import Pose
from compgen.fanuc import loads
from compgen.fanuc.analysis.poses import program_poses
from compgen.fanuc.analysis.traversal import read_traversal
from compgen.fanuc.editing.insertion import target_number_span
from compgen.fanuc.editing.numbers import NewPoses, nearest_wpr, number_edits, round_joints
from compgen.pipelines.files.robot_file import load_robot
from compgen.program.frames import default_frames


def turned(old, by):
    """Rotations of W P R (n, 3) [deg] moved a little, and the triples."""
    moved = np.asarray(old, dtype=float) + by
    return np.array([frame(0, 0, 0, *t)[:3, :3] for t in moved]), moved


@pytest.mark.parametrize("old", [(10, 20, 30), (190, 20, 30), (-170, 160, 210), (179.99, 0, -180), (370, -20, 30)])
def test_a_small_turn_changes_the_numbers_a_little(old):
    """Also of triples beyond half a turn, and of those with P beyond 90 deg."""
    rotation, moved = turned([old], [0.02, -0.03, 0.01])
    assert_allclose(nearest_wpr(rotation, np.array([old], dtype=float)), moved, atol=1e-9)


@pytest.mark.parametrize("p", [90.0, -90.0])
def test_where_p_is_square_r_stays_and_w_takes_the_change(p):
    """Only W -/+ R is fixed there: a turn of R by 0.4 deg is one of W by as much, and the rotation is the same."""
    old = np.array([[25.0, p, 70.0], [-175.0, p, -40.0]])
    rotation, _ = turned(old, [0.1, 0, 0.4])
    printed = nearest_wpr(rotation, old)
    assert_allclose(printed[:, 2], old[:, 2])
    assert_allclose(printed[:, 0], old[:, 0] + 0.1 - 0.4 * np.sign(p), atol=1e-9)
    assert_allclose([frame(0, 0, 0, *t)[:3, :3] for t in printed], rotation, atol=1e-12)


@pytest.mark.parametrize(("other", "printed"), [("0.500", "0.250"), (".500", ".250"), ("-.500", ".250")])
def test_a_zero_before_the_point_stands_where_the_program_has_it(other, printed):
    arm, places = load_robot("m710ic50"), [("1300.000", y, "203.000", 180.0, 0.0, 30.0) for y in ("5.000", other)]
    read = loads(program(["L P[1] 100mm/sec FINE"], [cartesian(n, p) for n, p in enumerate(places, 1)]))
    poses = program_poses(read, arm, default_frames())
    moved = Pose(poses.tcp.position[:1] - [0.0, 4.75e-3, 0.0], poses.tcp.rotation[:1])
    new = NewPoses(
        rows=np.zeros(1, int), tcp=moved, theta=poses.theta[:1], nudge=np.zeros((1, 3), int), marked=np.zeros(1, bool)
    )
    (text,) = number_edits(read, poses, arm, new).values()
    assert text.strip() == printed.encode()


def test_the_number_of_each_station_stands_where_its_target_does():
    moves = ["J P[1] 10% FINE", "L P[20] 100mm/sec FINE", "C P[3]\n    :  P[4] 100mm/sec FINE"]
    places = {1: (1300, 0), 20: (1400, 0), 3: (1450, 50), 4: (1500, 0)}
    read = loads(program(moves, [cartesian(n, (x, y, 203, 180, 0, 30)) for n, (x, y) in places.items()]))
    drive = read_traversal(read, program_poses(read, None, default_frames()), None)
    spans = [target_number_span(read, drive, station) for station in range(4)]
    assert [read.data[a:b] for a, b in spans] == [b"1", b"20", b"3", b"4"]


def test_joints_are_rounded_within_their_limits():
    """J5 wanted at -124.9997 deg, limit 125: -125.001 was nearer for the tool, and written."""
    robot, rng = load_robot("m710ic50"), np.random.default_rng(3)
    wanted = np.column_stack([rng.uniform(-90, 90, (20, 2)), rng.uniform(-40, 0, 20), rng.uniform(-90, 90, 20)])
    wanted = np.column_stack([wanted, np.full(20, -124.9997), rng.uniform(-90, 90, 20)])
    step, tcp = np.full((20, 6), 1e-3), np.tile([0.0, 0.0, 0.2], (20, 1))
    rounded = round_joints(robot, wanted, step, tcp, np.full(20, 0.01), np.zeros(20, dtype=bool))
    assert rounded[:, 4].min() >= -125 - 1e-9
    assert np.abs(rounded - wanted).max() < 2.6e-3
