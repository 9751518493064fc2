"""The filter of what a forecast misses: against batch least squares, and by hand."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.units import HOUR
from compgen.pipelines.resume.follow import steps_of_readings
from compgen.thermal.rise_filter import (
    MEMORY,
    STEP,
    Anchor,
    Readings,
    RiseFilter,
    misses,
    steadied,
    transition,
)

LAG = np.array([7.0, 0.5]) * HOUR


@pytest.fixture
def rises():
    return RiseFilter(lag=LAG, law=np.array([0.9, 0.6]), start=np.array([1.2, 0.8]), sensors=0.4)


def readings(steps, seed=0):
    rng = np.random.default_rng(seed)
    out = []
    for step in range(steps):
        which = np.flatnonzero(rng.random(2) < 0.7)
        if len(which):
            out.append(Readings(step, which, rng.normal(size=len(which)), rng.uniform(0.05, 0.3, len(which))))
    return out


def test_the_filter_is_batch_least_squares(rises):
    """All states of all steps as unknowns: start, every step's own noise, every reading, weighed and solved at once."""
    T, X = 40, 5
    rows = readings(T)
    forecast = np.random.default_rng(1).normal(size=(T, 2))
    course = misses(rises, rows, forecast, 0)
    F, Q = transition(tuple(rises.lag.tolist()), tuple(rises.law.tolist()), STEP)
    Q = Q + 1e-14 * np.eye(X)  # the offset of the sensors has no noise at all
    blocks, values = [], []

    def add(block, value, covariance):
        root = np.linalg.inv(np.linalg.cholesky(covariance))
        blocks.append(root @ block)
        values.append(root @ value)

    start = np.zeros((X, T * X))
    start[:, :X] = np.eye(X)
    add(start, np.zeros(X), rises.begin().covariance)
    for t in range(1, T):
        block = np.zeros((X, T * X))
        block[:, t * X : (t + 1) * X], block[:, (t - 1) * X : t * X] = np.eye(X), -F
        add(block, np.zeros(X), Q)
    for r in rows:
        block = np.zeros((len(r.which), T * X))
        block[np.arange(len(r.which)), r.step * X + r.which] = 1.0
        block[:, r.step * X + X - 1] = 1.0
        add(block, r.value - forecast[r.step][r.which], np.diag(r.sigma**2))
    A, y = np.vstack(blocks), np.concatenate(values)
    solution = np.linalg.lstsq(A, y, rcond=None)[0][-X:]
    last = np.linalg.inv(np.linalg.qr(A, mode="r"))[-X:]
    covariance = last @ last.T
    assert_allclose(course[-1].mean, solution, atol=2e-5)
    assert_allclose(course[-1].covariance, covariance, atol=2e-5)
    assert np.abs(solution).max() > 0.1


def test_a_step_is_exact_for_any_length(rises):
    """Two steps are one of their sum; in the limit m is as unsure as a first-order node driven by b."""
    one, two = rises.ahead(rises.begin(), 2 * HOUR), rises.ahead(rises.ahead(rises.begin(), HOUR), HOUR)
    assert_allclose(one.covariance, two.covariance, rtol=1e-9, atol=1e-12)
    rate, slow = 1 / MEMORY, 1 / LAG
    ever = rises.ahead(rises.begin(), 200 * HOUR).covariance
    assert_allclose(np.diag(ever)[:2], rises.law**2 * slow / (slow + rate), rtol=1e-6)
    assert_allclose(np.diag(ever)[2:4], rises.law**2, rtol=1e-9)


def test_without_readings_the_forecast_stands(rises):
    course = misses(rises, [], np.zeros((100, 2)), 0)
    assert_allclose(course[-1].mean, 0)
    assert np.all(np.isfinite(course[-1].sigma))


def test_a_law_that_is_off_is_found_and_goes_on_being_off(rises):
    """Readings that leave the forecast by (1 - exp(-t / lag)): so does what is foretold two hours later."""
    T = int(6 * HOUR / STEP)
    t = np.arange(T) * STEP
    missed = 0.8 * (1 - np.exp(-t[:, None] / LAG))
    rows = [Readings(k, np.array([0, 1]), missed[k], np.full(2, 0.05)) for k in range(T)]
    exact = RiseFilter(lag=rises.lag, law=rises.law, start=np.full(2, 0.01), sensors=0.0)
    miss = misses(exact, rows, np.zeros((T, 2)), 0)[-1]
    assert_allclose(miss.rise, missed[-1], atol=0.02)
    later = exact.ahead(miss, 0.5 * HOUR).rise
    assert later[0] > miss.rise[0]


def test_an_offset_of_all_sensors_is_told_from_warmth_by_their_number(rises):
    """Two sensors off alike: more of it is the sensors' than where only one is off."""
    both = misses(rises, [Readings(0, np.array([0, 1]), np.ones(2), np.full(2, 0.05))], np.zeros((1, 2)), 0)[-1]
    one = misses(rises, [Readings(0, np.array([0, 1]), np.array([1.0, 0.0]), np.full(2, 0.05))], np.zeros((1, 2)), 0)[
        -1
    ]
    assert both.mean[-1] > one.mean[-1]
    assert_allclose(both.rise + both.mean[-1], 1, atol=0.02)


def test_an_anchor_stands_in_place_of_what_was_before(rises):
    rows = readings(20)
    anchor = Anchor(19, np.array([0, 1]), np.array([3.0, 2.0]), np.diag([1e-4, 4e-4]))
    forecast = np.ones((20, 2))
    miss = misses(rises, rows, forecast, 0, [anchor])[-1]
    assert_allclose(miss.rise, [2.0, 1.0])
    assert_allclose(miss.sigma, [0.01, 0.02])


def test_a_loose_contact_is_left_out_and_a_warm_up_is_not():
    def reading(step, value):
        return Readings(step, np.array([0]), np.array([value]), np.array([0.1]))

    ramp = [reading(k, 0.05 * k) for k in range(200)]
    assert len(steadied(ramp)) == 200
    loose = [*ramp[:50], reading(50, 90.0), *ramp[51:]]
    assert [r.step for r in steadied(loose)] == [k for k in range(200) if k != 50]
    later = [*ramp[:10], reading(100, 20.0)]  # after a long gap nothing is known
    assert len(steadied(later)) == 11


def test_a_cold_morning_is_of_the_arm_and_not_of_its_sensors():
    true = -6.0 * np.exp(-np.arange(20)[:, None] * STEP / LAG)
    rows = [Readings(step, np.arange(2), true[step], np.full(2, 0.1)) for step in range(20)]
    for night, least, most in ((6.0, 0.0, 0.1), (0.0, 1.0, 6.0)):
        cold = RiseFilter(lag=LAG, law=np.array([0.9, 0.6]), start=np.array([1.2, 0.8]), sensors=0.5, night=night)
        off = misses(cold, rows, np.zeros((20, 2)), 0)[-1].rise - true[-1]
        assert least <= np.abs(off).max() < most  # K


def test_a_warm_hall_that_nobody_measured_is_of_the_arm_and_not_of_its_sensors():
    true = 3.0 * -np.expm1(-np.arange(240)[:, None] * STEP / LAG)
    rows = [Readings(step, np.arange(2), true[step], np.full(2, 0.05)) for step in range(240)]
    for air, least, most in ((3.0, 0.0, 1.0), (0.0, 1.5, 3.0)):
        warm = RiseFilter(
            lag=LAG, law=np.array([0.9, 0.6]), start=np.array([1.2, 0.8]), sensors=0.5, night=3.0, air=air
        )
        miss = misses(warm, rows, np.zeros((240, 2)), 0)[-1]
        assert least <= np.abs(miss.rise - true[-1]).max() < most  # K
        assert least <= abs(miss.offset) < most


def test_whole_degrees_are_known_to_their_digit():
    time = np.arange(0.0, 600.0, 10.0)
    sigma = {}
    for digits in (0, 2):
        values = np.round(20 + time / 300 + np.random.default_rng(0).normal(0, 0.1, len(time)), digits)
        sigma[digits] = np.array([r.sigma[0] for r in steps_of_readings(["j2"], {"j2": values}, time, 0)])
    assert sigma[0].min() >= 12**-0.5
    assert sigma[2].max() < 0.11
