"""What the twin's controller commands in time: lengths over speeds, ramps, stops, whole periods, overrides."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.program.program import Program
from compgen.robot.inverse_kinematics import Posture
from compgen.robot.motion import ControllerMotion
from compgen.verification.twin.circular_motion import sweeps
from compgen.verification.twin.controller.command import (
    WrittenPath,
    command_clock,
    corner_wait,
    run_law,
    sample_command,
)

PERIOD = 0.008


def program(points, speed, fine):
    N = len(points)
    down = np.tile(np.diag([1.0, -1.0, -1.0]), (N, 1, 1))
    speeds = np.broadcast_to(np.asarray(speed, dtype=float), (N - 1,)).copy()
    return Program(
        name="TEST",
        comment="",
        date="26-01-01",
        remarks=(),
        uframe=0,
        utool=1,
        position=np.asarray(points, dtype=float),
        rotation=down,
        posture=Posture(),
        turns=np.zeros((N, 3), dtype=int),
        speed=speeds,
        fine=np.asarray(fine, dtype=bool),
    )


def path_of(text, ramp):
    """With a clock as the twin's: the time of the statements and, at each stop, a ramp."""
    spent = np.linalg.norm(np.diff(text.position, axis=0), axis=1) / text.speed
    time = np.concatenate([[0.0], np.cumsum(spent)])
    return WrittenPath(text, sweeps(text), time + ramp * (np.cumsum(text.fine) - 1), np.zeros((len(time), 6)))


LINE = program([[1, 0, 0], [1, 0.4, 0], [1, 1.0, 0]], 0.2, [True, False, True])


def test_without_ramps_each_statement_takes_its_length_over_its_speed(robot):
    command = sample_command(robot, path_of(LINE, 0.0))
    inside = command.time < 5.0
    assert_allclose(command.position[inside, 1], 0.2 * command.time[inside], atol=1e-12)
    assert_allclose(command.arc, command.position[:, 1], atol=1e-12)
    assert set(command.segment[command.time < 1.99]) == {0}
    assert set(command.segment[command.time > 2.01]) == {1}
    assert_allclose(np.diff(command.time), PERIOD)


def test_a_run_with_ramps_starts_and_ends_at_rest_and_takes_the_clock_s_time(robot):
    command = sample_command(robot, path_of(LINE, 0.3))
    speed = np.diff(command.position[:, 1]) / PERIOD
    assert command.position[-1, 1] == 1.0
    assert command.position[command.time < 5.3 - PERIOD, 1].max() < 1.0
    assert speed[0] < 1e-3
    assert speed[int(5.29 / PERIOD)] < 1e-3
    middle = (command.time > 0.31) & (command.time < 4.98)
    assert_allclose(speed[middle[:-1]], 0.2, rtol=1e-9)


def test_a_run_too_short_for_its_ramps_never_reaches_its_speed():
    time = np.linspace(0, 1, 1001)
    done = run_law(time, np.full(1001, 1.0), np.full(1001, 0.2))
    rate = np.diff(done) / np.diff(time)
    assert done[0] == 0
    assert done[-1] == pytest.approx(0.2)
    assert rate.max() == pytest.approx(0.4, rel=1e-3)
    assert (rate >= 0).all()


def test_half_the_override_takes_twice_as_long(robot):
    full, half = (sample_command(robot, path_of(LINE, 0.3), override=share) for share in (1.0, 0.5))
    assert_allclose(np.interp(2 * full.time, half.time * 1.0, half.position[:, 1]), full.position[:, 1], atol=2e-6)


def test_statements_last_whole_periods_where_the_controller_rounds_up(robot):
    """16 ms and a little at 200 mm/s become 24 ms: 133 mm/s."""
    steps = program([[1, 0.00321 * n, 0] for n in range(500)], 0.2, [True, *[False] * 498, True])
    rounding = replace(robot, controller=replace(robot.controller, rounds_up_to_period=True))
    exact, rounded = (command_clock(r, path_of(steps, 0.0)).end for r in (robot, rounding))
    assert exact == pytest.approx(499 * 0.00321 / 0.2)
    assert rounded == pytest.approx(499 * 3 * PERIOD)


SMOOTHED = ControllerMotion(moving_averages=(0.2, 0.1))
CORNER = program([[1, 0, 0], [1, 0.2, 0], [1.2, 0.2, 0]], 0.2, [True, False, True])


def test_a_stop_waits_until_the_smoothing_has_come_to_rest_and_nothing_more(robot):
    """1 s and 1 s of statements, and 0.3 s at each stop behind one; the ramps of the unknown do not count."""
    smoothing = replace(robot, motion=SMOOTHED)
    assert SMOOTHED.settling == pytest.approx(0.3)
    clock = command_clock(smoothing, path_of(CORNER, 0.7))
    assert clock.end == pytest.approx(2.3)
    assert_allclose(clock.position_numbers(np.array([0.0, 0.25, 0.5, 1.0, 1.5, 1.9])), [0, 0.25, 0.5, 1.0, 1.5, 1.9])
    stopped = replace(CORNER, fine=np.ones(3, dtype=bool))
    assert command_clock(smoothing, path_of(stopped, 0.7)).end == pytest.approx(2.6)


@pytest.mark.parametrize(("means", "n", "waited_ms"), [
    ((0.296, 0.296), 75, 72), ((0.296, 0.296), 50, 168), ((0.296, 0.296), 25, 288), ((0.208, 0.288), 50, 136),
    ((0.296, 0.296), 100, 0), ((0.296, 0.296), 0, 584),
])  # fmt: skip
def test_cnt_waits_as_in_logs_of_the_maker_s_motion_code(robot, means, n, waited_ms):
    """Corners of an M-900iA/350 at 1000 mm/s, on the maker's virtual controller; CNT0 and CNT100 by the formula."""
    smoothing = replace(robot, motion=ControllerMotion(moving_averages=means))
    assert corner_wait(smoothing, np.array([n / 100]), np.zeros(1)) == pytest.approx(waited_ms / 1000)


@pytest.mark.parametrize("n", [10, 25, 50, 75, 90])
def test_cnt_n_never_falls_below_n_percent_on_a_straight_way(robot, n):
    """Two jumps of speed, the second a wait after the first, through two means of plain numpy."""
    one = round(0.296 / PERIOD)
    smoothing = replace(robot, motion=ControllerMotion(moving_averages=(0.296, 0.296)))
    waited = round(float(corner_wait(smoothing, np.array([n / 100]), np.zeros(1))[0]) / PERIOD)
    speed = np.ones(600)
    speed[250 : 250 + waited] = 0.0
    for _ in range(2):
        speed = np.convolve(speed, np.ones(one) / one, mode="valid")
    assert n / 100 <= speed.min() < n / 100 + 0.03
