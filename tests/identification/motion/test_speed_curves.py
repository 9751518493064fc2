"""Speed at a corner and before a stop, logged and by the fit, against what two moving means make of them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen import fanuc
from compgen.identification.motion.log_program import motion_log_program
from compgen.identification.motion.speed_curves import shown_speeds
from compgen.identification.motion.timed_windows import timed_windows
from compgen.pipelines.executed.executed import Situation, judge_log, read_program_text
from compgen.pipelines.executed.simulated_log import Logger, simulated_log
from compgen.pipelines.files.robot_file import load_robot
from compgen.program.frames import default_frames
from compgen.robot.motion import ControllerMotion
from compgen.verification.executed.position_log import read_position_log

MOTION = ControllerMotion(moving_averages=(0.176, 0.168))
SPEED = 0.2


@pytest.fixture(scope="module")
def stretches(tmp_path_factory):
    robot = load_robot("m710ic50")
    there = Situation(robot, default_frames(), {}, lambda name: None)
    centre = np.array([1.3, 0.0, 0.3])
    text = fanuc.compose(motion_log_program(robot, "LOG", "26-01-01", centre, 0.3, SPEED))
    log = tmp_path_factory.mktemp("log") / "run.csv"
    log.write_bytes(simulated_log(text, there, MOTION, 1.0, Logger(noise=1e-6)))
    course = there.course(text)
    run = judge_log(read_program_text("LOG.LS", text), course, read_position_log(str(log)), there)
    return {s.what: s for s in shown_speeds(course, timed_windows(run, robot).windows, robot, course.tool, MOTION)}


def test_a_right_corner_is_passed_at_the_root_of_half_the_speed(stretches):
    """Where half of the weights are on each leg both speeds are v / 2, at right angles.

    The sides' lines of 15 mm are said at 200 mm/s, 9.4 periods, and take 10.
    """
    driven = 0.015 / 0.08
    corner = stretches["corner"]
    assert corner.at != "P[1]"
    for speed in (corner.logged, corner.modelled):
        assert speed.min() == pytest.approx(driven / np.sqrt(2), rel=0.01)
        assert np.median(speed) == pytest.approx(driven, rel=0.01)
    near = np.abs(corner.time) < 0.4  # half a side on there is another corner
    assert abs(corner.time[near][np.argmin(corner.logged[near])]) < 0.05
    # two means of T1 and T2 cut a right corner by v E|u| / 2 on each side, u of the weights' trapezoid
    u = np.linspace(-0.172, 0.172, 200_001)
    weight = np.clip((0.172 - np.abs(u)) / (0.172 - 0.004), 0, 1)
    cut = driven * float((np.abs(u) * weight).sum() / weight.sum()) / 2
    assert cut - 0.008 * driven / 2 <= corner.off <= cut + 1e-5  # rows stand a period apart


def test_before_a_stop_the_fit_is_as_fast_as_the_log(stretches):
    stop = stretches["stop"]
    assert stop.time[-1] == 0
    assert stop.logged[-1] < 0.1 * SPEED
    assert_allclose(stop.modelled[2:-2], stop.logged[2:-2], atol=0.01 * SPEED)
