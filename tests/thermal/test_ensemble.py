"""Rises averaged over starts: against the mean of very many of them, each driven by itself."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import path_file

from compgen.pipelines.files.path_file import load_job
from compgen.thermal import Ambient, Duty, JointMotion, rises_during, state_after
from compgen.thermal.ensemble import Ensemble, Start, duties_before, mean_rises, rises_at, rises_of, states_at_runs

BEFORE = 'before=[{state="moving", feed_mm_s=150, duration_h=2}, {state="idle", duration_h=0.4}]'
CYCLE = (
    'cycle=[{state="moving", repeat=3, dwell_s=900}, {state="off", duration_h=0.7}, {state="moving", repeat=4}, '
    '{state="moving", repeat=2, dwell_s=300, dwell="off"}]'
)
ATOL_K = 1e-9
AIRS = {
    "still": Ambient(np.zeros(1), np.zeros(1)),
    "warm": Ambient(np.zeros(1), np.array([3.0])),
    "ramp": Ambient(np.array([0.0, 9000.0]), np.array([0.0, 5.0])),
    "wave": Ambient(np.zeros(1), np.array([1.0]), 2.5, 20000.0, 4000.0),
    "knots": Ambient(np.arange(0.0, 20000.0, 700.0), np.sin(np.arange(29.0)) * 2, 0.5, 8000.0, 0.0),
}


@pytest.fixture(scope="module", params=["nodes", "network"])
def job(request):
    return load_job(path_file("line_y"), overrides=[BEFORE, CYCLE, f"robot.thermal.model={request.param}"])


@pytest.fixture(scope="module")
def motion():
    """A slow program of twenty minutes, so that much happens while it runs."""
    time = np.concatenate([[0.0], np.cumsum(np.linspace(20, 40, 40))])
    theta = np.column_stack([0.3 * np.sin(time / 90 + k) for k in range(6)])
    return JointMotion(time, theta, np.linspace(0.05, 0.2, 40))


def one_start(heat, history, start, motion):
    """By the duties that the cell really does: nothing averaged, nothing linear."""
    duties = duties_before(history, start)
    state = state_after(heat, duties, air=history.air)
    driven = JointMotion(motion.time / start.override, motion.theta, motion.driven * start.override)
    return rises_during(heat, state, driven, history.air, sum(d.duration for d in duties)).rise


@pytest.mark.parametrize("air", AIRS)
def test_the_mean_over_delays_runs_and_overrides_is_that_of_very_many_starts(job, motion, air):
    history = replace(job.history, air=AIRS[air])
    low, high = 300.0, 4000.0
    nodes, weights = np.polynomial.legendre.leggauss(12)
    edges = np.unique(np.concatenate([np.linspace(low, high, 8)]))
    total = np.zeros((len(motion.time), len(job.heat.names)))
    for begin, end in zip(edges[:-1], edges[1:], strict=True):
        for node, weight in zip(nodes, weights, strict=True):
            delay = float((begin + end) / 2 + (end - begin) / 2 * node)
            for run in range(2, 7):
                for share in (0.4, 1.0):
                    rise = one_start(job.heat, history, Start(run, delay, share), motion)
                    total += rise * weight / 2 * (end - begin) / (high - low) / 10
    mean = mean_rises(job.heat, history, Ensemble((low, high), (0.4, 1.0), (2, 6)), motion)
    # a ramp's corner is no polynomial: there the quadrature is what errs
    assert_allclose(mean, total, atol={"knots": 2e-5, "ramp": 2e-5}.get(air, 1e-8))
    assert np.abs(mean - one_start(job.heat, history, Start(2, low, 1.0), motion)).max() > 0.1


@pytest.mark.parametrize("air", AIRS)
def test_a_start_alone_is_its_own_mean(job, motion, air):
    history = replace(job.history, air=AIRS[air])
    which = np.array([0, 7, 39, 40])
    starts = [Start(), Start(3, 0.0, 0.5), Start(8, 1234.5, 1.0), Start(0, 60.0, 0.9)]
    some = rises_at(job.heat, history, starts, motion, which)
    for start, rises in zip(starts, some, strict=True):
        by_duties = one_start(job.heat, history, start, motion)
        assert_allclose(rises_of(job.heat, history, start, motion), by_duties, atol=ATOL_K)
        assert_allclose(rises, by_duties[which], atol=ATOL_K)


def test_an_interval_of_delays_that_shrinks_becomes_its_middle(job, motion):
    at_middle = rises_of(job.heat, job.history, Start(0, 1000.0), motion)
    for width in (0.0, 1e-9, 0.5, 2.0):
        around = Ensemble((1000.0 - width / 2, 1000.0 + width / 2))
        assert_allclose(mean_rises(job.heat, job.history, around, motion), at_middle, atol=1e-5)


def test_the_first_start_is_the_history_as_it_is(job, motion):
    assert duties_before(job.history, Start()) == job.history.before
    assert_allclose(states_at_runs(job.heat, job.history, np.array([0]))[0], job.state(), atol=ATOL_K)
    plain = rises_during(job.heat, job.state(), motion, job.history.air, job.history.clock).rise
    assert_allclose(rises_of(job.heat, job.history, Start(), motion), plain, atol=ATOL_K)


def test_duties_before_a_run_last_until_it_begins(job):
    history = job.history
    for run, begin in enumerate(history.runs):
        duties = duties_before(history, Start(run, 17.0))
        assert sum(d.duration for d in duties) == pytest.approx(history.clock + begin + 17.0)
        assert duties[-1] == replace(history.standing, duration=17.0)
    assert len(history.runs) == 9
    without = replace(history, cycle=(), runs=(0.0,))
    assert duties_before(without, Start(0, 5.0)) == (*history.before, replace(history.standing, duration=5.0))
    assert Duty("off", 0.0, 0.7 * 3600) in duties_before(history, Start(4))
