"""What the twin's controller makes of samples: against closed forms, and against plain convolution on a fine grid."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import signal

from compgen.robot.motion import ControllerMotion
from compgen.verification.twin.controller.smoothing import (
    coarser,
    delayed,
    first_order,
    moments,
    moving_mean,
    smooth,
)

PERIOD = 0.008
TWO_MEANS = ControllerMotion(moving_averages=(0.2, 0.1))
LAGS = ControllerMotion(first_orders=(0.05, 0.02))
MIXED = ControllerMotion(moving_averages=(0.1,), first_orders=(0.03,), lag=0.013)
MODELS = pytest.mark.parametrize("motion", [TWO_MEANS, LAGS, MIXED], ids=["two means", "two lags", "mixed"])


def oracle(time, motion, command):
    """Box and exponential weights on a grid 40 times as fine, convolved; another delay."""
    fine = PERIOD / 40
    grid = np.arange(-3.0, time[-1] + fine / 2, fine)
    rows = command(np.maximum(grid, 0.0))
    for window in motion.moving_averages:
        n = round(window / fine)
        rows = signal.lfilter(np.r_[0.5, np.ones(n - 1), 0.5] / n, [1.0], rows - rows[0]) + rows[0]
    for constant in motion.first_orders:
        weights = np.exp(-fine * np.arange(20 * constant / fine) / constant)
        weights[0] /= 2
        rows = signal.fftconvolve(rows - rows[0], weights / weights.sum())[: len(rows)] + rows[0]
    return np.interp(time - motion.lag, grid, rows)


@MODELS
def test_smoothing_is_that_of_continuous_time(motion):
    """Of waves and of a start at full speed, 0.2 m/s: to what the corner between two samples is, v h^2 / T."""
    time = PERIOD * np.arange(400)
    chord = 0.05 * (4 * PERIOD) ** 2 / 8 if motion.lag else 0.0  # the delay between two samples is a straight line
    for command, atol in ((lambda t: 0.2 * t, 1e-5), (lambda t: 0.05 * np.sin(4 * t) * np.minimum(t, 1.0), 4e-6)):
        assert_allclose(
            smooth(command(time)[:, None], PERIOD, motion)[:, 0], oracle(time, motion, command), atol=atol + chord
        )


@MODELS
def test_what_stands_still_stays(motion):
    rows = np.tile([[0.3, -1.2]], (50, 1))
    assert_allclose(smooth(rows, PERIOD, motion), rows, atol=1e-15)


@MODELS
def test_a_straight_line_at_steady_speed_is_only_late(motion):
    time = PERIOD * np.arange(800, dtype=np.float64)
    late = smooth(0.2 * time[:, None], PERIOD, motion)[:, 0]
    settled = time > motion.settling + 2 * PERIOD
    assert_allclose(late[settled], 0.2 * (time[settled] - moments(motion).delay), atol=1e-9)


@MODELS
@pytest.mark.parametrize(("speed", "radius"), [(0.2, 0.65), (0.1, 0.65), (0.02, 0.05)])
def test_a_circle_is_drawn_smaller_by_the_pull(motion, speed, radius):
    w = speed / radius
    time = PERIOD * np.arange(int(4 / PERIOD))
    circle = radius * np.column_stack([np.cos(w * time), np.sin(w * time)])
    drawn = np.linalg.norm(smooth(circle, PERIOD, motion), axis=1)[time > 2]
    # the delay between two samples is a straight line there: a chord
    chord = speed**2 * PERIOD**2 / 8 / radius if motion.lag else 0.0
    pull = speed**2 * moments(motion).variance / (2 * radius)
    assert_allclose(radius - drawn, pull, rtol=2e-3, atol=chord)


def test_the_pull_of_the_study_s_circle_is_128_um():
    assert 0.2**2 * moments(TWO_MEANS).variance / (2 * 0.65) == pytest.approx(128.2e-6, abs=0.1e-6)


@pytest.mark.parametrize("step", [0.004, PERIOD, 0.02])
@MODELS
def test_delay_and_variance_are_those_of_continuous_time_at_every_step(motion, step):
    impulse = np.zeros((2000, 1))
    impulse[3] = 1.0
    weights = smooth(impulse, step, replace(motion, lag=0.0))[3:, 0]
    ages = step * np.arange(len(weights))
    assert weights.sum() == pytest.approx(1.0, abs=1e-12)
    delay = weights @ ages
    means, lags = sum(motion.moving_averages), sum(motion.first_orders)
    assert delay == pytest.approx(means / 2 + lags, rel=1e-9)
    variance = sum(t * t for t in motion.moving_averages) / 12 + sum(t * t for t in motion.first_orders)
    # half a step beyond whole ones (0.1 s of 8 ms) costs 0.02 of a step squared
    assert weights @ ages**2 - delay**2 == pytest.approx(variance, abs=0.03 * step**2)
    assert moments(motion).delay == pytest.approx(delay + motion.lag)
    assert moments(motion).variance == pytest.approx(variance)


def test_a_mean_over_no_more_than_a_step_and_no_time_constant_leave_the_rows():
    rows = np.random.default_rng(0).normal(size=(20, 2))
    assert moving_mean(rows, 0.5) is rows
    assert first_order(rows, 0.0) is rows
    assert delayed(rows, 0.0) is rows
    assert smooth(np.empty((0, 3)), PERIOD, TWO_MEANS).shape == (0, 3)


def test_a_long_way_from_the_origin_costs_no_digits():
    rows = 1e-6 * np.sin(np.arange(200_000)[:, None] / 500)
    assert_allclose(
        smooth(9.0 + rows, PERIOD, TWO_MEANS)[-50:] - 9.0, smooth(rows, PERIOD, TWO_MEANS)[-50:], atol=1e-12
    )


@pytest.mark.parametrize("samples", [4, 8])
def test_a_coarser_step_smooths_a_bend_alike(samples):
    step = coarser(TWO_MEANS, 0.001, samples)
    assert step == pytest.approx(int(0.1 / samples / 0.001 + 1e-9) * 0.001)
    drawn = [
        smooth(np.cos(3.0 * h * np.arange(int(6 / h)))[:, None], h, TWO_MEANS)[int(1 / h) :] for h in (step, 0.001)
    ]
    pulled, finely = (1 - np.ptp(wave) / 2 for wave in drawn)
    assert pulled == pytest.approx(finely, rel=0.05 / samples)


def test_a_step_is_never_finer_than_the_period():
    assert coarser(TWO_MEANS, 0.008, 100) == 0.008
    assert coarser(ControllerMotion(moving_averages=(0.2, 0.0)), 0.008, 5) == pytest.approx(0.04)


@pytest.mark.parametrize("lag", [0.0, 0.013])
def test_means_that_grow_from_line_to_line_are_those_of_each_line_and_add_up(lag):
    """Against each line's steps smoothed over the whole time; a line's spread may come back, and lines may be short."""
    rng = np.random.default_rng(8)
    line = np.sort(rng.integers(0, 40, 2000))
    spread = rng.choice(rng.uniform(0.5, 3.0, 25), 40)[line]
    rows = np.cumsum(rng.normal(0, 1e-3, (2000, 3)), axis=0)
    grown = ControllerMotion(moving_averages=(0.25, 0.17), reach=0.3, reach_at=2.0, lag=lag)
    expected = rows[:1].repeat(2000, axis=0)
    for each in np.unique(line):
        steps = np.where((line == each)[:, None], np.diff(rows, axis=0, prepend=rows[:1]), 0.0)
        longer = 1 + 0.3 * (spread[line == each][0] - 2.0)
        alike = ControllerMotion(moving_averages=(0.25 * longer, 0.17 * longer), lag=lag)
        expected += smooth(np.cumsum(steps, axis=0), 0.002, alike)
    assert_allclose(smooth(rows, 0.002, grown, spread), expected, atol=1e-13)


@pytest.mark.parametrize(("means", "shares"), [
    ((0.264, 0.204), [0.004021, 0.025764, 0.107854, 0.261727, 0.486854, 0.738273, 0.919656, 0.991451]),  # M-710iC/70
    ((0.300, 0.168), [0.004298, 0.027532, 0.111755, 0.262532, 0.486856, 0.737468, 0.915615, 0.990864]),  # M-900iA/350
])  # fmt: skip
def test_a_joint_motion_of_the_makers_motion_code_is_a_steady_turn_through_two_means_of_the_joints(means, shares):
    """Shares of a J move at 100 % that its joints have turned, of rpiRobotics/fanuc_motion_program_exec's log.

    It lasts 38 periods of 12 ms and the means; angles are written to 1e-4 deg, of turns of 45.7 and 52.1 deg.
    """
    lasts, step = 38 * 0.012, 0.001
    time = step * np.arange(1000)
    turned = smooth((time / lasts).clip(0, 1)[:, None], step, ControllerMotion(space="joint", moving_averages=means))
    row = 12 * np.array([7, 13, 21, 29, 38, 48, 58, 68])  # of the log, from the one before it moves
    assert_allclose(turned[row, 0], shares, atol=2.5e-6)
    assert turned[924 - 12, 0] < 1 - 1e-6
    assert_allclose(turned[924 + 1 :, 0], 1, atol=1e-12)
