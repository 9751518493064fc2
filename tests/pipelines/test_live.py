"""The living page's formula: what it shows is what the whole pipeline finds, wherever the sliders stand."""

import numpy as np
import pytest
from flawed import flawed_file
from shipped import path_file, quiet

from compgen.core.units import UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.pipelines.study.geometry import band_at_samples, plan_geometry
from compgen.pipelines.study.live_build import build_live, check_agreement
from compgen.pipelines.study.live_day import drawn_settings, history_at, overrides_of, planned_setting
from compgen.pipelines.study.live_places import at
from compgen.report.live import live_section
from compgen.verification.deviation import deviation_from_path

#: a schedule: runs of another program and a pause before, two shifts of own runs, air that swings
SCHEDULE = (
    'before=[{state="moving",program="line_x",repeat=40,dwell_s=30,dwell="off"},{state="idle",duration_h=0.5}]',
    'cycle=[{state="moving",repeat=12,dwell_s=120},{state="off",duration_h=0.5},{state="moving",repeat=3}]',
    'ambient={kind="wave",amplitude_K=3,value_degC=22}',
)
NETWORK = "robot.thermal.model=network"


def built(name, *overrides, robot=None):
    return build_live(path_file(name), robot, overrides, quiet)


@pytest.fixture(scope="module")
def spiral():
    return built("spiral_1300")


@pytest.fixture(scope="module")
def schedule():
    return built("line_y", *SCHEDULE, NETWORK)


def kinds(live_job):
    return [slider.kind for slider in live_job.live.day.sliders]


def moved(live_job, **values):
    """The planned setting with the first slider of some kinds at other values."""
    sliders = live_job.live.day.sliders
    first = {kind: next(n for n, s in enumerate(sliders) if s.kind == kind) for kind in values}
    setting = list(planned_setting(live_job.live.day))
    for kind, value in values.items():
        setting[first[kind]] = value
    return tuple(setting)


def test_the_formula_is_the_full_computation_on_the_spiral(spiral):
    agreement = check_agreement(spiral)
    assert len(agreement.settings) == 21
    assert agreement.largest < 0.1 * UM
    errors = [at(spiral.live, setting, spiral.live.after).max for setting in agreement.settings]
    assert min(errors) < 3 * UM < 100 * UM < max(errors)  # the settings lie far from each other


@pytest.mark.parametrize("heat", [(), (NETWORK,)])
@pytest.mark.parametrize("start", [(), ("start.run=2",)])
def test_standing_that_the_cycle_begins_with_is_before_the_first_run(heat, start):
    cycle = 'cycle=[{state="idle",duration_h=2},{state="moving",repeat=3,dwell_s=600}]'
    live = built("line_y", cycle, *start, *heat)
    assert "run" in kinds(live)
    assert check_agreement(live).largest < 0.1 * UM


@pytest.mark.parametrize("name", ["raster_1300", "spiral_1300"])
def test_the_band_of_some_samples_is_that_of_the_whole_path(name):
    job = load_job(path_file(name))
    whole = generate.predict(job, quiet).band_of_plan().largest
    assert band_at_samples(job, plan_geometry(job)).largest == pytest.approx(whole, abs=0.1 * UM)


def test_the_band_ends_with_the_last_waypoint_that_touches_however_far_the_next_one_is(tmp_path):
    rows = "".join(f"{x},0,0,0,0,1,{int(-210 < x < 210)}\n" for x in range(-300, 301, 20))
    (tmp_path / "coarse.csv").write_text(f"x_mm,y_mm,z_mm,i,j,k,contact\n{rows}")
    (tmp_path / "coarse.toml").write_text(
        'robot = "m710ic50"\n[path]\npattern = "points"\nfile = "coarse.csv"\n'
        "[frame]\nnumber = 1\nx_mm = 1200\ny_mm = -200\nz_mm = 150\n"
        '[process]\nfeed_mm_s = 100\n[[before]]\nstate = "moving"\nfeed_mm_s = 200\nduration_h = 6\n'
        "[bounds]\nmax_um = 5\n"
    )
    job = load_job(str(tmp_path / "coarse.toml"), overrides=["ambient.value_degC=10"])
    whole = generate.predict(job, quiet).band_of_plan().largest
    assert band_at_samples(job, plan_geometry(job)).largest == pytest.approx(whole, abs=0.1 * UM)


@pytest.mark.parametrize("name", ["line_y", "circle_1300", "raster_1300"])
def test_600_places_and_a_megabyte_are_as_good_as_every_sample(name):
    live_job = built(name)
    agreement = check_agreement(live_job)
    assert agreement.largest < 0.1 * UM
    assert np.abs(agreement.after[:, 0]).max() < 0.01 * UM  # the largest is among them, wherever it comes to lie
    assert max(len(places.arc) for places in (live_job.live.before, live_job.live.after)) <= 600
    assert len(live_section(live_job, agreement, f"paths/{name}.toml", None, ()).html) < 0.9e6


def test_the_formula_is_the_full_computation_in_a_schedule_by_the_network(schedule):
    assert kinds(schedule) == ["repeat", "feed", "duration", "air", "delay", "run", "cte"]
    assert check_agreement(schedule).largest < 0.02 * UM


def test_the_formula_is_the_full_computation_with_every_error_source(tmp_path):
    live_job = built("line_y", robot=flawed_file(tmp_path))
    assert "cte" not in kinds(live_job)
    assert any("a value for each length" in words for words in live_job.live.day.missing)
    assert check_agreement(live_job).largest < 0.2 * UM


def test_before_is_what_predict_says_with_the_overrides_of_the_setting(spiral):
    setting = moved(spiral, duration=2.5, feed=80.0, duty=0.6, air=23.0, delay=20.0, cte=13.0)
    overrides = overrides_of(spiral.live.day, setting)
    assert overrides == [
        "before.0.duration_h=2.5", "before.0.feed_mm_s=80.0", "before.0.duty=0.6", "ambient.value_degC=23.0",
        "start.delay_min=20.0", "robot.thermal.cte_um_m_K=13.0",
    ]  # fmt: skip
    planned = generate.predict(load_job(path_file("spiral_1300"), overrides=overrides), quiet)
    extent, shown = planned.deviation().on_part["total"], at(spiral.live, setting, spiral.live.before)
    assert shown.max == pytest.approx(extent.max, abs=0.1 * UM)
    assert shown.p99 == pytest.approx(extent.p99, abs=0.1 * UM)
    assert shown.rms == pytest.approx(extent.rms, abs=0.1 * UM)


def test_after_is_the_one_written_text_flown_in_the_other_state(schedule):
    setting = moved(schedule, run=14.0, delay=7.5, repeat=11.0, air=27.0)
    overrides = overrides_of(schedule.live.day, setting)
    assert overrides[-2:] == ["start.delay_min=7.5", "start.run=14"]
    job = load_job(path_file("line_y"), overrides=[*SCHEDULE, NETWORK, *overrides])
    prepared = schedule.after.geometry.prepared.reheated(schedule.corrected.twin, job.history.before, job.history.air)
    deviation = deviation_from_path(schedule.planned.path, prepared.chunks(), prepared.sample_count)
    shown = at(schedule.live, setting, schedule.live.after)
    assert shown.max == pytest.approx(deviation.on_part["total"].max, abs=0.02 * UM)
    assert shown.max > 5 * UM


def test_as_planned_before_and_after_are_the_report_s(spiral):
    setting = planned_setting(spiral.live.day)
    for places, deviation in (
        (spiral.live.before, spiral.planned.deviation()), (spiral.live.after, spiral.corrected.deviation),
    ):  # fmt: skip
        assert at(spiral.live, setting, places).max == pytest.approx(deviation.on_part["total"].max, abs=1e-10)
    assert overrides_of(spiral.live.day, setting) == []


def test_the_state_is_that_of_the_job_read_anew(schedule):
    setting = moved(schedule, run=14.0, repeat=11.0, feed=75.0)
    history, day = history_at(schedule.live.day, setting), schedule.live.day
    overrides = [*SCHEDULE, NETWORK, *overrides_of(day, setting)]
    job = load_job(path_file("line_y"), overrides=overrides)
    expected = job.history.state(job.heat)
    np.testing.assert_allclose(history.state(day.cell.heat), expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())
    assert history.clock == pytest.approx(job.history.clock)
    assert history.clock > schedule.job.history.runs[13]


def test_settings_are_drawn_the_same_every_time_and_inside_the_ranges(schedule):
    sliders = schedule.live.day.sliders
    assert drawn_settings(sliders) == drawn_settings(sliders)
    for setting in drawn_settings(sliders):
        assert all(
            s.low <= v <= s.high and (not s.stops or v in s.stops) for s, v in zip(sliders, setting, strict=True)
        )


#: two shifts, the first with breaks; runs and hours that keep to them, with what comes between
SHIFTS = "shift=[{from_h=6,to_h=14,breaks_h=[[9,9.25],[12,12.5]]},{from_h=22,to_h=30}]"
IN_SHIFTS = (
    SHIFTS,
    'before=[{state="off",duration_h=1},{state="moving",program="line_x",repeat=60,dwell_s=120,shifts=true},'
    '{state="moving",feed_mm_s=60,duration_h=29,duty=0.7,shifts=true}]',
    'ambient={kind="wave",amplitude_K=3,clock_h=5}',
)


@pytest.mark.parametrize("model", ["nodes", "network"])
def test_stretches_that_keep_to_the_shifts_have_their_sliders(model):
    live_job = built("line_y", *IN_SHIFTS, f"robot.thermal.model={model}")
    assert kinds(live_job)[:-3] == ["duration", "repeat", "feed", "duration", "feed", "duty"]
    assert check_agreement(live_job).largest < 0.02 * UM
    before = live_job.job.history.before
    assert history_at(live_job.live.day, planned_setting(live_job.live.day)).before == before
    assert {"moving", "idle", "off"} == {duty.state for duty in before}


def test_settings_that_the_files_refuse_are_not_compared_at():
    """Six hours from 5 o'clock on fall into the shift; a warm-up of less than one does not."""
    live_job = built("line_y", "shift=[{from_h=6,to_h=14}]", "before.0.shifts=true", "ambient.clock_h=5")
    hours = kinds(live_job).index("duration")
    drawn = [setting[hours] for setting in drawn_settings(live_job.live.day.sliders)]
    agreement = check_agreement(live_job)
    compared = [setting[hours] for setting in agreement.settings[1:]]
    assert compared == [h for h in drawn if h > 1] != drawn
    assert agreement.largest < 0.05 * UM


def test_a_late_start_can_be_moved_as_far_as_files_take_it():
    live_job = built("line_y", "start.delay_min=600")
    (slider,) = [slider for slider in live_job.live.day.sliders if slider.kind == "delay"]
    assert (slider.value, slider.high) == (600, 960)
    assert len(check_agreement(live_job).settings) == 21
    load_job(path_file("line_y"), overrides=["start.delay_min=960"])


def test_hours_that_would_move_the_shifts_of_the_cycle_have_no_slider():
    cycle = 'cycle=[{state="moving",repeat=40,dwell_s=600,shifts=true}]'
    live_job = built("line_y", SHIFTS, 'before=[{state="moving",program="line_x",repeat=60,shifts=true}]', cycle)
    assert kinds(live_job) == ["air", "delay", "run", "cte"]
    assert any("[[cycle]] keeps to the hours of [[shift]]" in words for words in live_job.live.day.missing)
    assert check_agreement(live_job).largest < 0.02 * UM


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["before=[]"], "no [[before]]"),
    ],
)
def test_a_slider_that_a_path_has_none_of_is_named_with_the_reason(overrides, words):
    live_job = built("line_y", *overrides)
    assert "duration" not in kinds(live_job)
    assert any(words in sentence for sentence in live_job.live.day.missing)
    assert any("no [[cycle]]" in sentence for sentence in live_job.live.day.missing)
    assert check_agreement(live_job).largest < 0.05 * UM


def test_a_file_for_several_starts_moves_from_their_mean():
    live_job = built("line_y", "compensation.average_over.delay_s=[0, 3600]")
    assert check_agreement(live_job).largest < 0.05 * UM
    late, early = (at(live_job.live, moved(live_job, delay=d), live_job.live.after).max for d in (60.0, 0.0))
    mean = at(live_job.live, moved(live_job, delay=30.0), live_job.live.after).max
    assert mean < min(late, early)


def test_a_start_of_the_path_file_is_where_its_sliders_stand():
    live_job = built("line_y", *SCHEDULE, "start.run=14", "start.delay_min=7.5")
    planned = dict(zip(kinds(live_job), planned_setting(live_job.live.day), strict=True))
    assert (planned["run"], planned["delay"]) == (14.0, 7.5)
    shown = at(live_job.live, planned_setting(live_job.live.day), live_job.live.before)
    assert shown.max == pytest.approx(live_job.planned.deviation().on_part["total"].max, abs=1e-10)
    assert overrides_of(live_job.live.day, moved(live_job, run=1.0)) == ["start.run=1"]
    assert check_agreement(live_job).largest < 0.05 * UM
