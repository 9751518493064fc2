"""Joint motions of random programs beside a second, naive reader of the percent word, with numpy alone.

It reads the text by ``naive_ls``, turns all joints steadily, lets the turn through two running means a millisecond at a
time, and looks when nothing turns any more. No ramp, no formula of how long a stop takes.
"""

from dataclasses import replace

import numpy as np
import pytest
from ls_text import joint_form, program
from naive_ls import read
from numpy.testing import assert_allclose

from compgen import fanuc
from compgen.fanuc.analysis.poses import program_poses
from compgen.fanuc.analysis.traversal import read_traversal
from compgen.pipelines.files.robot_file import load_robot
from compgen.program.frames import default_frames
from compgen.robot.motion import ControllerMotion

FASTEST = np.array([175, 175, 175, 250, 250, 355])  # deg/s of an M-710iC/50, the third of J2 + J3
PERIOD = 8  # ms
SHORT, LONG = (160, 120), (240, 152)  # ms, by how long a run's first motion lasts


def random_program(seed):
    """Joint motions by all words of time, to random joints."""
    random = np.random.default_rng(seed)
    low, high = np.array([-150, -40, -60, -180, -110, -180]), np.array([150, 60, 30, 180, 110, 180])
    joints = np.round(random.uniform(low, high, (9, 6)), 3)
    joints[1::3] = joints[::3] + np.round(random.uniform(-9, 9, (3, 6)), 3)  # short ones, too
    words = [f"{random.integers(1, 101)}%", f"{random.integers(2, 30) / 10:.1f}sec", f"{random.integers(50, 900)}msec"]
    moves = ["J P[1] 50% FINE"]
    for n in range(2, 10):
        word = words[random.choice(3, p=[0.7, 0.15, 0.15])] if n % 2 else f"{random.integers(1, 101)}%"
        moves.append(f"J P[{n}] {word} {random.choice(['FINE', 'CNT100', 'CNT100'])}")
    return program([*moves, "J P[1] 100% FINE"], [joint_form(n, q) for n, q in enumerate(joints, 1)])


def naive_clock(data):
    """How long each motion takes from the second on, and what the whole program does [ms]."""
    positions, moves = read(data)
    angles = []
    for move in moves:
        axes = positions[int(move.targets[0].strip("P[]"))].groups[1].axes
        q = np.array([axes[f"J{k}"] for k in range(1, 7)])
        q[2] += q[1]
        angles.append(q)
    lasts = [milliseconds(m.speed, b - a) for m, a, b in zip(moves[1:], angles[:-1], angles[1:], strict=True)]
    times, run = [], []
    for n, move in enumerate(moves[1:], 1):
        run.append(n)
        times.append(lasts[n - 1])
        if move.termination == "FINE":
            means = LONG if lasts[run[0] - 1] >= sum(LONG) else SHORT
            at_rest = rest([angles[k] - angles[k - 1] for k in run], [lasts[k - 1] for k in run], means)
            times[-1] += at_rest - sum(lasts[k - 1] for k in run)
            run = []
    return times


def milliseconds(word, turn):
    """Of a speed word, in whole periods."""
    if word.endswith("msec"):
        time = float(word[:-4])
    elif word.endswith("sec"):
        time = 1000 * float(word[:-3])
    else:
        time = max(1000 * abs(a) / (v * float(word[:-1]) / 100) for a, v in zip(turn, FASTEST, strict=True))
    return PERIOD * int(np.ceil(np.round(time / PERIOD, 6)))


def rest(turns, lasts, means):
    """The first period at which no joint turns any more, of motions back to back [ms]."""
    command = np.zeros((sum(lasts) + sum(means) + 10 * PERIOD, 6))
    begin = 0
    for turn, time in zip(turns, lasts, strict=True):
        command[begin : begin + time] += turn / time
        begin += time
    for window in means:
        command = np.column_stack([np.convolve(joint, np.ones(window) / window)[: len(command)] for joint in command.T])
    last = np.flatnonzero(np.abs(command).max(axis=1) > 1e-9)[-1] + 1
    return PERIOD * int(np.ceil(last / PERIOD))


@pytest.mark.parametrize("seed", range(6))
def test_joint_motions_take_what_a_naive_reader_of_their_words_lets_them_take(seed):
    short, long = (tuple(t / 1000 for t in means) for means in (SHORT, LONG))
    motion = ControllerMotion(moving_averages=short, after_long=long)
    arm = replace(load_robot("m710ic50"), motion=motion)
    data = random_program(seed)
    listing = fanuc.loads(data)
    drive = read_traversal(listing, program_poses(listing, arm, default_frames()), arm)
    naive = np.array(naive_clock(data)) / 1000
    assert_allclose(drive.duration[1:], naive, atol=1e-9)
    assert drive.joint.all()
    assert (naive > drive.written[1:] - 1e-9).all()


@pytest.mark.parametrize(("sister", "limits", "joints", "seconds", "flown"), [
    ("m710ic50", (160, 120, 120, 225, 225, 225), (-49.7, 4.3, -35.2, -20.9, -35.8, 52.1), 0.312 + 0.344, 0.756),
    ("m900ia260l", (100, 95, 95, 105, 105, 170), (38.3, 23.3, -34.0, 45.7, -101.9, -48.3), 0.440 + 0.608, 1.308),
])  # fmt: skip
def test_two_joint_motions_of_the_makers_motion_code_are_told_a_little_short(sister, limits, joints, seconds, flown):
    """At 100 %, until the next line begins, by fanuc_log.csv of hehonglu123/Motion-Primitive-Planning.

    The arms are an M-710iC/70 and an M-900iA/350 by their data sheets' limits, with the means of shipped sisters.
    """
    arm = replace(load_robot(sister), speed=np.radians(limits))
    positions = [joint_form(1, (0, 0, 0, 0, -90, 0)), joint_form(2, joints)]
    listing = fanuc.loads(program(["J P[1] 100% FINE", "J P[2] 100% FINE"], positions))
    drive = read_traversal(listing, program_poses(listing, arm, default_frames()), arm)
    assert_allclose(drive.duration[1], seconds)
    assert 0.8 < drive.duration[1] / flown < 0.9
