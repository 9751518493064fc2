"""A job's day: each run is met by the warmth of its own moment."""

from pathlib import Path

import numpy as np
import pytest
from naive_heat import rises
from numpy.testing import assert_allclose
from shipped import path_file, quiet

from compgen.core.exceptions import InputError
from compgen.core.units import HOUR, UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.pipelines.study import timeline
from compgen.report.heat_page import heat_sentences

FEED = 100  # mm/s


@pytest.fixture(scope="module")
def job():
    """Two hours of warming up, then three runs, an hour of standing after each."""
    before = f'before=[{{state="moving", feed_mm_s={FEED}, duration_h=2}}]'
    cycle = 'cycle=[{state="moving", repeat=3, dwell_s=3600}]'
    return load_job(path_file("line_y"), overrides=[before, cycle, f"process.feed_mm_s={FEED}"])


@pytest.fixture(scope="module")
def day(job):
    return timeline(job)


def test_runs_begin_after_what_went_before(job, day):
    assert day.start == 2 * HOUR
    one = day.run[1] - day.run[0] - HOUR  # a run and its dwell
    assert 10 < one < 100
    assert_allclose(day.run, 2 * HOUR + (one + HOUR) * np.arange(3), rtol=1e-12)


def test_each_run_has_the_rises_of_its_own_start(job, day):
    one = (day.run[1] - day.run[0] - HOUR) / HOUR
    duties = [("moving", FEED, 2.0)]
    for row in day.run_rise:
        by_hand = rises(duties)
        assert_allclose(row, [by_hand[name] for name in job.heat.names], atol=1e-9)
        duties += [("moving", FEED, one), ("idle", 0, 1.0)]


def test_a_file_for_the_first_run_leaves_more_in_each_later_one(day):
    assert day.residual[0] == 0
    assert np.all(np.diff(day.residual) > 1 * UM)
    assert np.all(np.diff(day.error) < 0)  # standing, the arm cools


def test_what_a_run_adds_to_rounding_and_chords_is_said_to_be_beside_them(job, day):
    """The file leaves some 0.7 um in its own run, where the day says 0."""
    left = f"is off by up to {day.residual[2] / UM:.2f} um besides rounding and chords (run 3)"
    assert left in heat_sentences(job, day)[1]


def test_one_file_for_all_runs_leaves_less_than_that_of_the_first(job, day):
    overrides = [*job.overrides, 'compensation.average_over={runs="all"}']
    served = timeline(load_job(path_file("line_y"), overrides=overrides))
    assert_allclose(served.error, day.error)
    assert 0.4 * day.residual.max() < served.residual.max() < 0.7 * day.residual.max()
    assert served.residual[0] > 1 * UM


def test_the_day_ends_with_its_last_duty_and_misses_no_edge(job, day):
    end = sum(d.duration for d in (*job.history.before, *job.history.cycle))
    assert_allclose([day.time[0], day.time[-1]], [0, end])
    assert set(np.round(day.run[1:], 6)) <= set(np.round(day.time, 6))
    assert_allclose(day.rise[np.searchsorted(day.time, day.start)], day.run_rise[0], atol=1e-9)


@pytest.mark.parametrize("model", ["nodes", "network"])
def test_a_program_without_a_cycle_runs_once_in_its_day(model):
    """As warm behind it as the program is planned to be at its end, and colder an hour later."""
    day = ["before=[]", 'after=[{state="off", duration_h=1}]', f'robot.thermal.model="{model}"']
    job = load_job(path_file("line_y"), overrides=[*day, "process.feed_mm_s=0.5"])
    planned = generate.predict(job, quiet)
    heated, lasts = timeline(job), planned.deviation().time[-1]
    assert lasts > HOUR / 2
    assert_allclose(heated.time[-1], lasts + HOUR, rtol=1e-6)
    behind = [np.interp(lasts, heated.time, rise) for rise in heated.rise.T]
    assert_allclose(behind, planned.rise[-1], rtol=0.03, atol=1e-3)
    assert np.all(heated.rise[-1, [0, 2]] < behind[0:3:2])


SHIFT = ("shift=[{from_h=6,to_h=14}]", "before=[]")


@pytest.mark.parametrize(
    ("overrides", "count", "apart"),
    [
        (["before=[]", 'cycle=[{state="moving", duration_h=1, duty=0.5}]'], 30, 2.0),
        ([*SHIFT, "ambient.clock_h=13.99", 'cycle=[{state="moving", duration_h=17, shifts=true}]'], 60, 1.0),
        (["before=[]", 'cycle=[{state="moving", duration_h=0.001}]'], 1, 0.0),
    ],
)
def test_runs_are_whole_and_spread_by_their_duty(overrides, count, apart):
    """A line of an hour's sixtieth: in the 36 s before a shift ends there is time for none; one there is always."""
    of_one = load_job(path_file("line_y"), overrides=["process.feed_mm_s=23"])
    one = float(generate.predict(of_one, quiet).deviation().time[-1])
    assert HOUR / 62 < one < HOUR / 60
    runs = load_job(path_file("line_y"), overrides=[*overrides, "process.feed_mm_s=23"]).history.runs
    assert len(runs) == count
    assert_allclose(runs, apart * one * np.arange(count), rtol=2e-3)


@pytest.mark.parametrize("part", ["before", "cycle", "after"])
@pytest.mark.parametrize(
    ("clock", "step", "words"),
    [
        (0, "repeat=12, duty=0.5", "repeat: 6 of 12 runs fit into its duty; give a duration_h"),
        (0, "repeat=12, duty=0.5, dwell_s=1", "repeat: 0 of 12 runs fit into its duty"),
        (0, 'repeat=12, duty=0.5, program="line_x"', "repeat: 6 of 12 runs fit into its duty"),
        (13.99, "repeat=40, shifts=true", r"repeat: \d+ of 40 runs fit into its shifts"),
    ],
)
def test_runs_that_their_day_has_no_time_for_are_refused(part, clock, step, words):
    """Before and after a cycle the robot was warmed by half of the runs, in half of their hours, without a word."""
    shift = SHIFT if clock else SHIFT[1:]
    day = [*shift, f"ambient.clock_h={clock}", f'{part}=[{{state="moving", feed_mm_s=20, {step}}}]']
    with pytest.raises(InputError, match=rf"{part}\.0\.{words}"):
        load_job(path_file("line_y"), overrides=day)


def test_a_cycle_that_names_its_own_path_file_has_the_runs_of_one_that_names_none(tmp_path):
    """It was one run, that of a day without a cycle; what the job overrides is its program's."""
    (tmp_path / "own.toml").write_text(Path(path_file("line_y")).read_text())

    def runs(program):
        cycle = f'cycle=[{{state="moving", repeat=5, dwell_s=600{program}}}]'
        return load_job(str(tmp_path / "own.toml"), overrides=["process.feed_mm_s=23", cycle]).history.runs

    assert len(runs("")) == 5
    assert runs(', program="own"') == runs("")
    assert runs(', program="own.toml", feed_mm_s=23') == runs("")
