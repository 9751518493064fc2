"""A start of the program that is not its first: the same day, seen from there."""

import naive_heat
import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import path_file

from compgen.core.exceptions import InputError
from compgen.core.units import HOUR, MINUTE
from compgen.pipelines.files.path_file import load_job
from compgen.thermal.ensemble import Start, duties_before, started
from compgen.thermal.integration import state_after

CYCLE = (
    'cycle=[{state="moving", repeat=4, dwell_s=1200}, {state="off", duration_h=0.5}, {state="moving", duration_h=1}]'
)
NO_TEMPERATURE = 1e-12  # [K]


@pytest.fixture(scope="module")
def job():
    return load_job(path_file("circle_1300"), overrides=[CYCLE, "ambient={kind='wave', amplitude_K=3}"])


def test_the_runs_that_are_left_begin_when_they_did(job):
    whole, late = job.history, started(job.history, Start(4, 0.0))
    assert len(late.runs) == len(whole.runs) - 4
    assert_allclose(np.array(late.runs) + whole.runs[4], whole.runs[4:])
    assert late.clock == pytest.approx(whole.clock + whole.runs[4])
    assert sum(d.duration for d in late.cycle) == pytest.approx(sum(d.duration for d in whole.cycle) - whole.runs[4])


@pytest.mark.parametrize("run", [0, 2, 4, 5])
def test_each_later_run_begins_as_warm_as_in_the_whole_day(job, run):
    whole, late = job.history, started(job.history, Start(run, 0.0))
    for further in range(len(late.runs)):
        duties = duties_before(late, Start(further))
        expected = state_after(job.heat, duties_before(whole, Start(run + further)), air=whole.air)
        assert_allclose(state_after(job.heat, duties, air=late.air), expected, rtol=0, atol=NO_TEMPERATURE)


@pytest.mark.parametrize("start", [(), ("start.run=1",)])
def test_standing_that_the_cycle_begins_with_is_before_the_first_run(start):
    """By the nodes' own law, of six hours at 200 mm/s and two of standing; the runs behind it begin when they did."""
    cycle = 'cycle=[{state="idle", duration_h=2}, {state="moving", repeat=3, dwell_s=600}]'
    job = load_job(path_file("raster_1300"), overrides=[cycle, *start])
    rises = naive_heat.rises([("moving", 200.0, 6.0), ("idle", 0.0, 2.0)])
    assert_allclose(job.start_rise(), [rises[name] for name in job.heat.names], atol=1e-9)
    assert job.clock == 8 * HOUR
    assert job.history.runs[0] == 0
    assert [duty.state for duty in job.history.cycle[:2]] == ["moving", "idle"]


def test_a_file_says_it_by_run_and_minutes(job):
    overrides = [CYCLE, "ambient={kind='wave', amplitude_K=3}", "start.run=3", "start.delay_min=90"]
    late = load_job(path_file("circle_1300"), overrides=overrides).history
    expected = started(job.history, Start(2, 90 * MINUTE))
    assert late.before == expected.before
    assert late.runs == expected.runs
    assert late.before[-1].state == "idle"
    assert late.before[-1].duration == 1.5 * HOUR


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["start.run=2"], "start.run: there is no run 2; runs are 1 alone"),
        ([CYCLE, "start.run=4000"], "start.run: there is no run 4000; runs are 1 to"),
        (["start.run=0"], "start.run: 0"),
        (["start.delay_min=-1"], "start.delay_min: -1"),
        (["start.delay_min=961"], "start.delay_min: 961"),
        (["start.delay_s=3"], "start.delay_s: unknown key; did you mean 'delay_min'?"),
    ],
)
def test_a_start_that_there_is_none_of_is_refused(overrides, words):
    with pytest.raises(InputError) as refusal:
        load_job(path_file("circle_1300"), overrides=overrides)
    assert words in str(refusal.value)
