"""What a law misses builds up as a rise does; changed models run by the same integration as all others."""

from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.units import HOUR, MM
from compgen.pipelines.files.robot_file import load_cell
from compgen.thermal import Ambient, Duty, JointMotion, rises_during, state_after
from compgen.thermal.node_model import NodeModel
from compgen.thermal.schedule import History
from compgen.thermal.uncertainty import (
    DisturbedHeat,
    HeatChange,
    missed_rise,
    nothing_warms,
    rise_by_air,
    rise_by_model,
)

CELL = load_cell("m710ic50")
HEAT, WARMTH = cast(NodeModel, CELL.heat), CELL.warmth
K = len(HEAT.names)
REFERENCE = Duty("moving", 200 * MM, 6 * HOUR)
NOW = np.zeros(1)


def changed(**fields):
    return replace(HeatChange.none(K), **fields)


def test_after_the_reference_it_is_what_the_file_says():
    change = changed(rise=np.arange(1.0, K + 1))
    assert_allclose(missed_rise(WARMTH, HEAT, History(before=(REFERENCE,)), change, NOW)[0], np.arange(1, K + 1))


def test_a_cold_arm_misses_nothing_and_one_that_stands_off_forgets():
    change = changed(rise=np.ones(K))
    assert not missed_rise(WARMTH, HEAT, History(), change, NOW).any()
    after = History(before=(REFERENCE, Duty("off", 0.0, 5 * HOUR)))
    assert_allclose(missed_rise(WARMTH, HEAT, after, change, NOW)[0], np.exp(-5 * HOUR / HEAT.tau))


@pytest.mark.parametrize(
    ("duty", "share"),
    [(Duty("idle", 0.0, 1000 * HOUR), 0.05), (Duty("moving", 20 * MM, 1000 * HOUR, 0.4), 0.05 + 0.95 * 0.4)],
    ids=["idle", "part of the time"],
)
def test_standing_and_resting_build_up_their_share(duty, share):
    missed = missed_rise(WARMTH, HEAT, History(before=(duty,)), changed(rise=np.ones(K)), NOW)[0]
    assert_allclose(missed, share / -np.expm1(-6 * HOUR / HEAT.tau), rtol=1e-9)


def test_what_is_not_said_changes_nothing_and_a_cold_arm_has_no_band():
    none, cold = HeatChange.none(K), nothing_warms(HEAT)
    assert not none.changes_model
    assert not any(np.any(value) for value in (none.rise, none.start, none.air))
    assert not any((cold.law, cold.sensors, cold.air, cold.feed, cold.missing, cold.idle))
    assert (cold.own, cold.start, cold.hidden, cold.expansion, dict(cold.growth)) == (None, None, None, None, {})


def test_a_changed_model_is_that_of_a_hand():
    """Larger rises after the reference duty, longer time constants, and a feed that counts by its exponent."""
    scale, lag = np.linspace(-0.2, 0.3, K), np.linspace(0.4, -0.1, K)
    larger = DisturbedHeat(HEAT, WARMTH, changed(scale=scale))
    assert_allclose(larger.outputs @ state_after(larger, [REFERENCE]), HEAT.reference_rise * (1 + scale))
    cooling = DisturbedHeat(replace(HEAT, start=HEAT.reference_rise), WARMTH, changed(lag=lag))
    left = cooling.outputs @ state_after(cooling, [Duty("off", 0.0, HOUR)])
    assert_allclose(left, HEAT.reference_rise * np.exp(-HOUR / (HEAT.tau * np.exp(lag))))
    faster = DisturbedHeat(HEAT, WARMTH, changed(feed=0.1))
    moving = 0.05 + 0.95 * 1.1**HEAT.exponent
    assert_allclose(faster.outputs @ state_after(faster, [REFERENCE]), HEAT.reference_rise * moving)


def test_what_a_log_misses_fades():
    logged = replace(HEAT, start=np.full(K, 5.0))
    missed = missed_rise(WARMTH, logged, History(before=(Duty("off", 0.0, HOUR),)), changed(start=np.ones(K)), NOW)
    assert_allclose(missed[0], np.exp(-HOUR / HEAT.tau))


@pytest.mark.parametrize("model", ["nodes", "network"])
def test_every_change_is_what_the_changed_model_does(model):
    """Law, sensors and air exactly, the rest to first order, by the integration that the pipelines use."""
    cell = load_cell("m710ic50", [f"thermal.model={model}"])
    heat, warmth, count = cell.heat, cell.warmth, len(cell.heat.names)
    loss = (30.0, 60.0, 40.0, 5.0, 8.0, 4.0)
    before = (Duty("moving", 0.15, 2 * HOUR, 0.7, loss), Duty("idle", 0.0, HOUR, 1.0, loss))
    time = np.linspace(0, 600, 40)
    motion = JointMotion(time, np.linspace(0, 1, 40)[:, None] * np.ones(6), np.full(39, 0.15))
    air = Ambient(np.array([0.0, HOUR]), np.array([0.0, 1.5]))

    def rises(change, warmer=0.0):
        other = DisturbedHeat(heat, warmth, change)
        outside = replace(air, rise=air.rise + warmer)
        return rises_during(other, state_after(other, before, air=outside), motion, outside, 3 * HOUR).rise

    history, none = History(before=before, air=air), HeatChange.none(count)
    law = replace(none, rise=np.linspace(0.5, 1, count))
    missed = missed_rise(warmth, heat, history, law, time)
    assert_allclose(rises(law) - rises(none), missed, atol=1e-9)
    assert_allclose(rises(none, 0.3) - rises(none), 0.3 * rise_by_air(heat, history, time), atol=1e-9)
    for change in (
        replace(none, feed=0.01),
        replace(none, scale=np.full(count, 0.01)),
        replace(none, lag=np.full(count, 0.01)),
    ):
        expected = rise_by_model(warmth, heat, history, 0.15, change, time)
        assert_allclose(rises(change) - rises(none), expected, atol=2e-3)
        assert expected.any() == (model == "nodes")


def test_other_time_constants_change_nothing_of_an_arm_in_balance_with_the_air():
    history, time = History(before=(), air=Ambient(np.zeros(1), np.array([10.0]))), np.array([0.0, 4.0]) * HOUR
    slower = changed(lag=np.full(K, 0.1))
    plain = rise_by_model(WARMTH, HEAT, History(before=()), 0.1, slower, time)
    assert_allclose(rise_by_model(WARMTH, HEAT, history, 0.1, slower, time), plain, atol=1e-9)
