"""The law of an arm's nodes from a warm-up: what one load cannot explain is the arm's, and later logs are believed."""

from dataclasses import replace

import numpy as np
import pytest
from shipped import path_file
from wider_arm import NODES, WiderArm

from compgen.core.units import HOUR
from compgen.pipelines.files.path_file import load_job
from compgen.thermal.law_fit import falling_part, fit_law
from compgen.thermal.log_doubt import doubt_of
from compgen.thermal.state_from_log import TemperatureLog

COLUMNS = {n: f"{n}_degC" for n in NODES}
ARMS = range(12)
GAIN, LAG = np.array([0.9, 1.15, 1.1, 1.0, 0.9]), np.array([0.5, 0.6, 0.4, 0.6, 0.5])


@pytest.fixture(scope="module")
def cell():
    return load_job(path_file("circle_1300")).cell


def first_order(cell, gain, lag, load=1.0, hours=6.0, seed=0):
    """A log of nodes that follow a constant load from cold: A (1 - exp(-t / tau)), A so that 6 h reach the rise."""
    time = np.arange(0.0, hours * HOUR + 1, 60.0)
    tau = cell.heat.tau * lag
    rise = load * gain * cell.heat.reference_rise * np.expm1(-time[:, None] / tau) / np.expm1(-6 * HOUR / tau)
    return logged(time, rise + np.random.default_rng(seed).normal(0, 0.05, rise.shape))


def logged(time, rise, names=NODES):
    readings = {n: r for n, r in zip(NODES, rise.T, strict=True) if n in names}
    return TemperatureLog(time, np.zeros(len(time)), readings, np.zeros(len(time), bool))


def day(seed, hours, zero=0.0, names=NODES):
    """What sensors of an arm show whose nodes have two time constants each."""
    time = np.arange(0.0, hours * HOUR + 1, 60.0)
    rise = WiderArm(seed).rises(time) + np.random.default_rng([seed, 9]).normal(0, 0.05, (len(time), 5))
    return logged(time, rise + zero, names)


def believed(cell, fitted, log):
    warmth = replace(cell.warmth, lag=fitted.law.tau, own=fitted.sigma)
    return not doubt_of(log, fitted.law, warmth, COLUMNS, 20.0)


def test_rises_and_time_constants_are_those_of_the_arm(cell):
    fitted = fit_law(first_order(cell, GAIN, LAG), cell.heat, cell.warmth)
    ratio = fitted.law.reference_rise / cell.heat.reference_rise / GAIN
    assert fitted.is_plausible
    assert np.abs(np.log(ratio / ratio.mean())).max() < 0.12
    assert np.abs(np.log(fitted.law.tau / cell.heat.tau / LAG)).max() < 0.45
    off = np.abs(fitted.law.reference_rise - ratio.mean() * GAIN * cell.heat.reference_rise)
    assert (off < 2 * fitted.sigma).all()
    assert (fitted.sigma > np.hypot(0.49, 0.05 * fitted.law.reference_rise)).all()  # another program heats otherwise
    assert (fitted.sigma < 0.09 * fitted.law.reference_rise + 0.5).all()


@pytest.mark.parametrize("load", [0.7, 1.0, 1.2])
def test_what_all_nodes_do_alike_is_the_loads(cell, load):
    fitted = fit_law(first_order(cell, np.ones(5), np.ones(5), load), cell.heat, cell.warmth)
    assert np.abs(np.log(fitted.law.reference_rise / cell.heat.reference_rise)).max() < 0.12


def test_right_logs_after_five_hours_are_believed(cell):
    """The file's law refuses some of them: the set-up bites."""
    fits = [fit_law(day(seed, 6.0), cell.heat, cell.warmth) for seed in ARMS]
    assert all(fitted.is_plausible for fitted in fits)
    logs = [day(seed, 5.0, zero=2.0) for seed in ARMS]
    assert all(believed(cell, fitted, log) for fitted, log in zip(fits, logs, strict=True))
    refused = [bool(doubt_of(log, cell.heat, cell.warmth, COLUMNS, 20.0)) for log in logs]
    assert sum(refused) >= 4


def exchanged(log, a, b):
    return log.readings | {a: log.readings[b], b: log.readings[a]}


@pytest.mark.parametrize(
    ("least", "wrong"),
    [
        (10, lambda log: exchanged(log, "j2", "link1")),
        (12, lambda log: exchanged(log, "j3", "wrist")),
        (12, lambda log: {n: 1.8 * v + 48 for n, v in log.readings.items()}),  # degF above 20 degC
        (12, lambda log: log.readings | {"j3": log.readings["j3"] + 15}),
        (12, lambda log: log.readings | {"link1": log.readings["link1"] - 15}),
        (12, lambda log: log.readings | {"j2": np.full(len(log.time), 2.0)}),  # hangs in the air
    ],
)
def test_wrong_logs_are_not_believed(cell, least, wrong):
    fits = [fit_law(day(seed, 6.0), cell.heat, cell.warmth) for seed in ARMS]
    logs = [day(seed, 5.0, zero=2.0) for seed in ARMS]
    caught = [not believed(cell, f, replace(log, readings=wrong(log))) for f, log in zip(fits, logs, strict=True)]
    assert sum(caught) >= least


def test_a_node_that_was_not_shown_rises_as_before(cell):
    seen = ("j2", "link1", "j3")
    fitted = fit_law(day(0, 6.0, names=seen), cell.heat, cell.warmth)
    assert np.isnan(fitted.sigma).tolist() == [n not in seen for n in NODES]
    assert fitted.law.reference_rise[3:].tolist() == cell.heat.reference_rise[3:].tolist()
    shared = np.log(fitted.law.tau / cell.heat.tau)
    assert shared[3] == pytest.approx(shared[4])
    assert shared[:3].min() <= shared[3] < -0.2  # the lag that all nodes of this arm share
    assert sum(believed(cell, fitted, day(0, 5.0, zero=2.0, names=names)) for names in (seen, NODES)) == 2


@pytest.mark.parametrize("names", [("j3",), ("wrist",)])
def test_one_node_alone_tells_nothing(cell, names):
    fitted = fit_law(day(0, 6.0, names=names), cell.heat, cell.warmth)
    assert np.isnan(fitted.sigma).all()
    assert fitted.law.tau.tolist() == cell.heat.tau.tolist()


@pytest.mark.parametrize("names", [NODES[::-1], ("wrist", "link1", "j3")])
def test_the_order_of_a_logs_columns_says_nothing(cell, names):
    log = day(1, 6.0)
    kept = {n: log.readings[n] for n in NODES if n in names}
    logs = [replace(log, readings=kept), replace(log, readings={n: kept[n] for n in names})]
    one, other = (fit_law(each, cell.heat, cell.warmth) for each in logs)
    one_way, other_way = (np.stack([f.law.reference_rise, f.law.tau, f.sigma, f.ratio]) for f in (one, other))
    np.testing.assert_allclose(one_way, other_way, rtol=1e-6)
    assert np.isnan(one.sigma).tolist() == [n not in names for n in NODES]


def test_what_no_law_explains_widens_its_own_node(cell):
    """Half of the swing may pass for another law or load, which moves the others' rises and with them their sigmas."""
    log, rms, k = first_order(cell, GAIN, LAG), 1.5, NODES.index("wrist")
    swing = rms * 2**0.5 * np.sin(2 * np.pi * log.time / (1.5 * HOUR))
    logs = [log, replace(log, readings=log.readings | {"wrist": log.readings["wrist"] + swing})]
    before, after = (fit_law(each, cell.heat, cell.warmth).sigma ** 2 for each in logs)
    assert (0.5 * rms) ** 2 < after[k] - before[k] < (1.2 * rms) ** 2
    assert np.delete(after - before, k).max() < (after - before)[k] / 4


def test_a_short_warm_up_tells_less(cell):
    first, half, whole = (fit_law(day(0, h), cell.heat, cell.warmth).sigma for h in (0.1, 1.0, 6.0))
    assert np.isnan(first).all()
    assert half[2] > 2 * whole[2]


def test_a_sensor_on_another_part_is_no_law(cell):
    log = day(0, 6.0)
    fitted = fit_law(replace(log, readings=exchanged(log, "j3", "wrist")), cell.heat, cell.warmth)
    assert not fitted.is_plausible
    assert {NODES[k] for k in np.argsort(fitted.ratio)[-2:]} == {"j3", "wrist"}


@pytest.mark.parametrize("names", [NODES, ("j2", "j3"), ("j3",)])
@pytest.mark.parametrize(("step_s", "digit"), [(10.0, 1.0), (60.0, 0.01), (300.0, 0.1), (1200.0, 1.0)])
def test_parts_that_cool_are_no_warm_up_and_right_logs_are(names, step_s, digit):
    """Cooling; against warm-ups, one with a pause, a day to its end, a weekend in colder air, and a second warm-up."""
    for seed in range(3):
        arm = WiderArm(seed)

        def course(hours, rises, arm=arm, seed=seed):
            time = np.arange(0.0, hours * HOUR + 1, step_s)
            rise = rises(arm, time) + np.random.default_rng(seed).normal(0, 0.05, (len(time), 5))
            return falling_part(logged(time, np.round(rise / digit) * digit, names))

        part, fall = course(4, lambda arm, time: arm.rises(time + 6 * HOUR))
        assert part in ("j2", "j3")
        assert fall > 4
        assert course(6, lambda arm, time: arm.rises(time)) is None
        assert course(24, lambda arm, time: arm.rises(time) - 4 * time[:, None] / (24 * HOUR)) is None
        assert course(7, lambda arm, time: arm.rises(time, 3) + later(arm, time, 4)) is None
        assert course(66, lambda arm, time: later(arm, time, 60) - 6 * time[:, None] / (66 * HOUR)) is None
        assert course(9, lambda arm, time: arm.rises(time + 6 * HOUR) + later(arm, time, 2)) is None
        assert course(66, lambda arm, time: arm.rises(time + 6 * HOUR) + 0.8 * later(arm, time, 60)) is None


def later(arm, time, hours):
    """Rises by work that begins so much later."""
    return np.where(time[:, None] > hours * HOUR, arm.rises(np.maximum(time - hours * HOUR, 0.0), 24), 0.0)


def test_air_that_grows_colder_cools_no_part():
    time = np.arange(0.0, 6 * HOUR + 1, 60.0)
    air = -5 * time / time[-1]
    log = logged(time, np.tile(air[:, None], (1, 5)))
    fallen = falling_part(log)
    assert fallen is not None
    assert fallen[0] == "j2"
    assert fallen[1] == pytest.approx(5, abs=0.1)
    assert falling_part(replace(log, air=air)) is None
    assert falling_part(logged(time, np.tile(0.7 * air[:, None], (1, 5)))) is None
