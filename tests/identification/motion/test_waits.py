"""Where a run waits at corners of CNT n, in the windows that a motion is fitted to."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from compgen.core.pose import Pose
from compgen.identification.motion.windows import PARTS, Window, smoothed
from compgen.pipelines.files.robot_file import load_robot
from compgen.robot.motion import ControllerMotion
from compgen.verification.twin.controller.command import corner_wait

MOTION = ControllerMotion(moving_averages=(0.176, 0.168))


def test_a_run_waits_at_its_second_corner_when_it_has_come_there():
    """Along a line at 1 m/s: a metre of way a second, but while it waits."""
    robot, corner, kept = load_robot("m710ic50"), np.array([1.5, 4.0]), np.array([0.25, 0.25])
    wait = corner_wait(replace(robot, motion=MOTION), kept, np.full(2, MOTION.reach_at))
    assert wait[0] == wait[1] > 0.05
    time = np.arange(0, 6, robot.controller.period / PARTS)
    K, none = len(time), np.zeros(0)
    window = Window(
        position=np.column_stack([time, np.zeros((K, 2))]),
        theta=None,
        arc=time,
        time=time,
        corner=corner,
        kept=kept,
        before=np.full(2, MOTION.reach_at),
        spread=np.full(K, MOTION.reach_at),
        shown=none,
        place=np.zeros((0, 3)),
        row_arc=none,
        off=np.zeros((0, 3)),
        block=none.astype(int),
        ramp=none.astype(int),
        weight=1.0,
        run=(0, 1),
        rate=1.0,
        is_whole=True,
        first=0.0,
    )
    passed, _, way = smoothed(window, robot, Pose(np.zeros(3), np.eye(3)), MOTION)
    late = passed - way
    lag = late[np.searchsorted(passed, 1.4)]
    between = (passed > 1.5 + wait[0] + 0.4) & (passed < 4.0 + wait[0])
    behind = (passed > 4.0 + wait.sum() + 0.4) & (passed < 6.0)
    assert_allclose(late[between], lag + wait[0], atol=1e-9)
    assert_allclose(late[behind], lag + wait.sum(), atol=1e-9)
