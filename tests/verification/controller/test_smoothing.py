"""What the twin's controller makes of samples: against closed forms, and against plain convolution on a fine grid."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import signal

from compgen.robot.motion import ControllerMotion
from compgen.verification.twin.controller.smoothing import (
    coarser,
    delayed,
    first_order,
    gain,
    moments,
    moving_mean,
    settling_time,
    smooth,
)

PERIOD = 0.008
TWO_MEANS = ControllerMotion(moving_averages=(0.2, 0.1))
LAGS = ControllerMotion(first_orders=(0.05, 0.02))
MIXED = ControllerMotion(moving_averages=(0.1,), first_orders=(0.03,), lag=0.013)
MODELS = pytest.mark.parametrize("motion", [TWO_MEANS, LAGS, MIXED], ids=["two means", "two lags", "mixed"])


def oracle(rows, step, motion):
    """Weights written out and convolved; another first-order recursion; the delay between two samples."""
    for window in motion.moving_averages:
        n = window / step
        weights = np.append(np.ones(int(n)), n - int(n)) / n
        padded = np.concatenate([np.repeat(rows[:1], len(weights), axis=0), rows])
        rows = np.column_stack([np.convolve(column, weights)[: len(padded)] for column in padded.T])[len(weights) :]
    for constant in motion.first_orders:
        a = np.exp(-step / constant)
        filtered = signal.lfilter([1 - a], [1, -a], rows - rows[0], axis=0)
        rows = rows[0] + filtered
    times = step * np.arange(len(rows))
    return np.column_stack([np.interp(times - motion.lag, times, column) for column in rows.T])


@MODELS
def test_smoothing_is_a_plain_convolution(motion):
    rows = np.cumsum(np.random.default_rng(3).normal(size=(900, 4)), axis=0) + 1000.0
    assert_allclose(smooth(rows, PERIOD, motion), oracle(rows, PERIOD, motion), atol=1e-9)


@MODELS
def test_what_stands_still_stays(motion):
    rows = np.tile([[0.3, -1.2]], (50, 1))
    assert_allclose(smooth(rows, PERIOD, motion), rows, atol=1e-15)


@MODELS
def test_a_straight_line_at_steady_speed_is_only_late(motion):
    time = PERIOD * np.arange(800, dtype=np.float64)
    late = smooth(0.2 * time[:, None], PERIOD, motion)[:, 0]
    settled = time > settling_time(motion)
    assert_allclose(late[settled], 0.2 * (time[settled] - moments(motion, PERIOD).delay), atol=1e-9)


@MODELS
@pytest.mark.parametrize(("speed", "radius"), [(0.2, 0.65), (0.1, 0.65), (0.02, 0.05)])
def test_a_circle_is_drawn_smaller_by_the_pull(motion, speed, radius):
    w = speed / radius
    time = PERIOD * np.arange(int(4 / PERIOD))
    circle = radius * np.column_stack([np.cos(w * time), np.sin(w * time)])
    drawn = np.linalg.norm(smooth(circle, PERIOD, motion), axis=1)[time > 2]
    # the delay between two samples is a straight line there: a chord
    chord = speed**2 * PERIOD**2 / 8 / radius if motion.lag else 0.0
    assert_allclose(drawn, radius * gain(motion, np.array([w]), PERIOD)[0], atol=1e-10 + chord)
    pull = radius * (1 - gain(motion, np.array([w]), PERIOD)[0])
    assert_allclose(pull, speed**2 * moments(motion, PERIOD).variance / (2 * radius), rtol=2e-3)


def test_the_pull_of_the_study_s_circle_is_128_um():
    w = 0.2 / 0.65
    assert 0.65 * (1 - gain(TWO_MEANS, np.array([w]), PERIOD)[0]) == pytest.approx(128e-6, abs=0.5e-6)
    fine = 0.65 * (1 - gain(TWO_MEANS, np.array([w]), 1e-5)[0])
    assert fine == pytest.approx(0.2**2 * (0.2**2 + 0.1**2) / 12 / (2 * 0.65), rel=1e-3)


def test_variances_are_those_of_the_impulse_response():
    for motion in (TWO_MEANS, LAGS):
        impulse = np.zeros((4000, 1))
        impulse[1] = 1.0
        weights = smooth(impulse, PERIOD, motion)[1:, 0]
        ages = PERIOD * np.arange(len(weights))
        assert weights.sum() == pytest.approx(1.0, abs=1e-12)
        delay = weights @ ages
        assert moments(motion, PERIOD).delay == pytest.approx(delay, rel=1e-9)
        assert moments(motion, PERIOD).variance == pytest.approx(weights @ ages**2 - delay**2, rel=1e-9)


def test_moments_tend_to_those_of_continuous_time():
    assert moments(TWO_MEANS, 1e-5).variance == pytest.approx((0.2**2 + 0.1**2) / 12, rel=1e-3)
    assert moments(LAGS, 1e-5).variance == pytest.approx(0.05**2 + 0.02**2, rel=1e-3)
    assert moments(MIXED, 1e-5).delay == pytest.approx(0.05 + 0.03 + 0.013, rel=1e-3)


def test_a_mean_over_no_more_than_a_step_and_no_time_constant_leave_the_rows():
    rows = np.random.default_rng(0).normal(size=(20, 2))
    assert moving_mean(rows, 0.5) is rows
    assert first_order(rows, 0.0) is rows
    assert delayed(rows, 0.0) is rows
    assert smooth(np.empty((0, 3)), PERIOD, TWO_MEANS).shape == (0, 3)


def test_a_long_way_from_the_origin_costs_no_digits():
    rows = 9.0 + 1e-6 * np.sin(np.arange(200_000)[:, None] / 500)
    assert_allclose(smooth(rows, PERIOD, TWO_MEANS)[-50:], oracle(rows, PERIOD, TWO_MEANS)[-50:], atol=1e-12)


@MODELS
@pytest.mark.parametrize("samples", [2, 5])
def test_a_coarser_step_smooths_alike(motion, samples):
    step, coarse = coarser(motion, 0.001, samples)
    assert step > 0.003
    assert moments(coarse, step).variance == pytest.approx(moments(motion, 0.001).variance, rel=1e-9)
    w = np.array([0.3, 3.0])
    assert_allclose(1 - gain(coarse, w, step), 1 - gain(motion, w, 0.001), rtol=0.05 / samples)


def test_a_step_is_never_finer_than_the_period():
    assert coarser(TWO_MEANS, 0.008, 100) == (0.008, TWO_MEANS)
    assert coarser(ControllerMotion(moving_averages=(0.2, 0.0)), 0.008, 5)[0] == pytest.approx(0.04)
