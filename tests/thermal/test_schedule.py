"""The language of duty: what a path file says of the cell's day, and what it refuses."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from shipped import path_file

from compgen.core.exceptions import InputError
from compgen.core.units import DAY, HOUR
from compgen.pipelines.files.path_file import load_job
from compgen.thermal import Ambient, rise_history, state_after, still_air
from compgen.thermal.schedule import Shift, Step, check_shifts, expand_steps

PATH = path_file("line_y")


def job_with(*overrides):
    return load_job(PATH, overrides=[*overrides])


def test_a_steady_duty_ratio_lies_between_idle_and_full():
    idle, half, full = (
        job_with(f'before=[{{state="moving", feed_mm_s=100, duration_h=2, duty={d}}}]').start_rise()
        for d in (0, 0.5, 1)
    )
    assert_allclose(half, (idle + full) / 2, rtol=1e-12)  # the models are linear in the heat
    assert_allclose(idle, job_with('before=[{state="idle", duration_h=2}]').start_rise())


def test_repeats_with_dwell_are_runs_and_rests_in_turn():
    job = job_with('before=[{state="moving", feed_mm_s=200, repeat=3, dwell_s=40}]')
    run, rest = job.history.before[0], job.history.before[1]
    assert [d.state for d in job.history.before] == ["moving", "idle"] * 3
    assert run.duration == pytest.approx(9, abs=3)  # s, the line's own time
    assert rest.duration == 40
    off = job_with('before=[{state="moving", feed_mm_s=200, repeat=3, dwell_s=40, dwell="off"}]')
    assert [d.state for d in off.history.before] == ["moving", "off"] * 3
    assert np.all(off.start_rise() < job.start_rise())


def test_short_cycles_warm_like_their_duty_ratio():
    cycles = job_with('before=[{state="moving", feed_mm_s=200, repeat=500, dwell_s=20}]')
    run = cycles.history.before[0].duration
    hours = 500 * (run + 20) / HOUR
    ratio = job_with(f'before=[{{state="moving", feed_mm_s=200, duration_h={hours!r}, duty={run / (run + 20)!r}}}]')
    assert_allclose(cycles.start_rise(), ratio.start_rise(), rtol=2e-3)


def test_a_named_program_runs_at_its_own_feed_unless_told():
    named = job_with('before=[{state="moving", program="circle_1300", duration_h=6}]')
    assert named.history.before[0].feed == 0.2
    slower = job_with('before=[{state="moving", program="circle_1300", feed_mm_s=50, duration_h=6}]')
    assert slower.history.before[0].feed == 0.05


def test_runs_with_a_dwell_keep_to_the_shifts_each_at_its_own_time():
    """Eight runs of half an hour, each with as long a dwell, from 8 h on: a shift from 6 to 14 h, a break at 10 h."""
    step = Step(key="k", state="moving", feed=0.1, repeat=8, dwell=0.5 * HOUR, shifts=True)
    shift = Shift(6 * HOUR, 14 * HOUR, ((10 * HOUR, 10.25 * HOUR),))
    duties = [duty for _, duty in expand_steps([step], [shift], 8 * HOUR, lambda s: 0.5 * HOUR)]
    hours = [(duty.state, duty.duration / HOUR) for duty in duties]
    pair = [("moving", 0.5), ("idle", 0.5)]
    assert hours == [*pair * 2, ("idle", 0.25), ("moving", 0.25), ("idle", 0.5), *pair * 3, *[("off", 0.5)] * 4]


def test_shifts_move_rest_in_breaks_and_switch_off_between():
    job = job_with(
        'before=[{state="moving", feed_mm_s=100, duration_h=24, shifts=true}]',
        "shift=[{from_h=6, to_h=14, breaks_h=[[9, 9.5]]}]",
    )
    assert [(d.state, d.duration / HOUR) for d in job.history.before] == [
        ("off", 6), ("moving", 3), ("idle", 0.5), ("moving", 4.5), ("off", 10)
    ]  # fmt: skip


def test_shifts_and_breaks_that_meet_do_not_overlap():
    """Work around the clock: each shift begins as the one before it ends, the first as the night's ends."""
    early = Shift(6 * HOUR, 14 * HOUR, ((8 * HOUR, 9 * HOUR), (9 * HOUR, 9.5 * HOUR)))
    around = [early, Shift(14 * HOUR, 22 * HOUR), Shift(22 * HOUR, 30 * HOUR)]
    check_shifts(around, "day")
    check_shifts(around[::-1], "day")
    for shifts, words in (
        ([*around[:2], Shift(22 * HOUR, 30.01 * HOUR)], "shift.2: 22 to 30.01 h overlaps shift.0"),
        ([Shift(22 * HOUR, 30.01 * HOUR), early], "shift.1: 6 to 14 h overlaps shift.0"),
        ([replace(early, breaks=((9 * HOUR, 10 * HOUR), (8 * HOUR, 9.01 * HOUR)))], "shift.0.breaks_h: the breaks"),
    ):
        with pytest.raises(InputError, match=words):
            check_shifts(shifts, "day")


def test_a_night_shift_goes_on_past_midnight():
    pieces = expand_steps(
        [Step(key="k", state="moving", feed=0.1, duration=DAY, shifts=True)],
        [Shift(22 * HOUR, 30 * HOUR)],
        0.0,
        lambda s: 0.0,
    )
    assert [(d.state, d.duration / HOUR) for _, d in pieces] == [("moving", 6), ("off", 16), ("moving", 2)]


@given(
    st.lists(st.tuples(st.floats(0.1, 60), st.booleans()), min_size=1, max_size=6),
    st.floats(0, 86399),
)
def test_stretches_add_up_to_what_was_said(steps, clock):
    entries = [Step(key="k", state="moving", feed=0.1, duration=h * HOUR, shifts=s) for h, s in steps]
    day = [Shift(6 * HOUR, 14 * HOUR, ((9 * HOUR, 9.5 * HOUR),)), Shift(22 * HOUR, 29 * HOUR)]
    pieces = expand_steps(entries, day, clock, lambda s: 0.0)
    assert sum(d.duration for _, d in pieces) == pytest.approx(sum(h for h, _ in steps) * HOUR, rel=1e-12)
    assert all(d.duration >= 0 for _, d in pieces)


def test_cycle_tells_when_each_run_begins():
    job = job_with(
        'cycle=[{state="moving", repeat=2, dwell_s=60}, {state="off", duration_h=1}, {state="moving", repeat=1}]',
        'after=[{state="off", duration_h=16}]',
    )
    run = job.history.cycle[0].duration
    assert_allclose(job.history.runs, [0, run + 60, 2 * (run + 60) + HOUR], rtol=1e-12)
    assert [d.state for d in job.history.after] == ["off"]
    assert job_with().history.runs == (0.0,)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("before.0.duty=1.5", ("before.0.duty", "less than or equal to 1")),
        ("before.0.duty=-0.1", ("before.0.duty", "greater than or equal to 0")),
        ("before.0.duration_h=-1", ("before.0.duration_h", "greater than or equal to 0")),
        ("before.0.repeat=3", ("duration_h", "conflicts")),
        ('before=[{state="moving", feed_mm_s=20}]', ("duration_h", "missing")),
        ('before=[{state="idle", duration_h=1, duty=0.5}]', ("before.0.duty", "idle")),
        ('before=[{state="moving", feed_mm_s=20, duration_h=1, dwell_s=2}]', ("dwell_s", "repeat")),
        ('before=[{state="moving", feed_mm_s=20, duration_h=1, dwell="off"}]', ("before.0.dwell:", "repeat")),
        ("shift=[{from_h=6, to_h=14}]", ("shift: no stretch", "shifts = true")),
        ('before=[{state="moving", program="nowhere", duration_h=1}]', ("nowhere", "unknown")),
        ("before.0.shifts=true", ("before.0.shifts", "[[shift]]")),
        ("shift=[{from_h=6, to_h=14}, {from_h=13, to_h=20}]", ("shift.1", "overlaps shift.0")),
        ("shift=[{from_h=20, to_h=30}, {from_h=5, to_h=7}]", ("shift.1", "overlaps")),
        ("shift=[{from_h=14, to_h=6}]", ("shift.0.to_h", "night shift")),
        ("shift=[{from_h=6, to_h=14, breaks_h=[[15, 16]]}]", ("breaks_h.0", "within")),
        ("ambient.value_degC=200", ("ambient.value_degC", "60")),
        ('ambient={kind="ramp", from_degC=20}', ("ambient.to_degC", "missing")),
        ('ambient={kind="constant", amplitude_K=3}', ("ambient.amplitude_K", "constant")),
        ('ambient={kind="csv", file="nowhere.csv"}', ("nowhere.csv", "cannot be read")),
        ("ambient.value_K=3", ("ambient.value_K", "unknown key")),
    ],
)
def test_what_is_wrong_is_said(text, words):
    with pytest.raises(InputError) as refusal:
        job_with(text)
    assert all(w in str(refusal.value) for w in words), refusal.value


@pytest.mark.parametrize(
    ("clock", "hours", "meets"), [(0, 6, False), (14, 16, False), (20, 6, False), (0, 6.1, True), (13.9, 6, True)]
)
def test_a_stretch_in_shifts_that_meets_none_is_refused(clock, hours, meets):
    """It would stand through its six hours switched off, a cold arm said to have moved."""
    moving = f'{{state="moving", feed_mm_s=20, duration_h={hours}, shifts=true}}'
    before = f'before=[{{state="off", duration_h={clock}}}, {moving}]'
    given = ("shift=[{from_h=6, to_h=14}]", before)
    if meets:
        assert any(duty.state == "moving" for duty in job_with(*given).history.before)
        return
    with pytest.raises(InputError, match=rf"before\.1\.shifts: no \[\[shift\]\].* {hours} h from {clock} o'clock"):
        job_with(*given)


def test_a_stretch_in_the_break_of_a_shift_meets_the_shift():
    """*No [[shift]] falls into its 0.25 h* was said of it."""
    before = 'before=[{state="moving", feed_mm_s=20, duration_h=0.25, shifts=true}]'
    shift = "shift=[{from_h=6, to_h=14, breaks_h=[[9, 9.5]]}]"
    (stretch,) = job_with(shift, before, "ambient.clock_h=9.1").history.before
    assert stretch.state == "idle"


# the air


RATES = np.array([1e-5, 4e-5, 3e-3])


@pytest.mark.parametrize(
    "air",
    [
        Ambient(np.zeros(1), np.array([3.0])),
        Ambient(np.array([0.0, 7200.0]), np.array([0.0, 5.0])),
        Ambient(np.zeros(1), np.array([1.0]), 2.0, DAY, 15 * HOUR),
        Ambient(np.array([0.0, 900.0, 950.0, 20000.0]), np.array([1.0, -3.0, 4.0, 0.0]), 0.7, 3 * HOUR, 100.0),
    ],
    ids=["constant", "ramp", "wave", "all"],
)
def test_the_airs_response_solves_its_equation(air):
    """Against a Runge-Kutta integration with the air read pointwise."""
    start, time = 333.0, np.array([333.0, 600.0, 925.0, 940.0, 5000.0, 30000.0])
    z, t, states = np.zeros(3), start, [np.zeros(3)]
    edges = air.time[(air.time > start)]
    for goal in time[1:]:
        stops = [*edges[(edges > t) & (edges < goal)], goal]
        for stop in stops:
            for a, b in pairwise(np.linspace(t, stop, 400)):
                h = b - a

                def f(s, y):
                    return RATES * (air.at(np.array([s]))[0] - y)

                k1 = f(a, z)
                k2 = f(a + h / 2, z + h / 2 * k1)
                k3 = f(a + h / 2, z + h / 2 * k2)
                k4 = f(b, z + h * k3)
                z = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            t = stop
        states.append(z)
    assert_allclose(air.response(RATES, start, time), states, atol=1e-7)


def test_a_robot_that_has_long_stood_in_the_air_is_in_balance_with_it():
    wave = Ambient(np.zeros(1), np.array([1.0]), 2.0, DAY, 15 * HOUR)
    later = wave.settled(RATES) * np.exp(-RATES * DAY) + wave.response(RATES, 0.0, np.array([DAY]))[0]
    assert_allclose(later, wave.settled(RATES), atol=1e-12)
    assert not still_air().settled(RATES).any()


def test_a_warmer_hall_warms_the_robot_by_as_much(job):
    warm = load_job(path_file("circle_1300"), overrides=["ambient.value_degC=23"])
    assert_allclose(warm.start_rise(), job.start_rise() + 3, atol=1e-12)


@pytest.mark.parametrize(
    ("first", "last", "said"),
    [
        (0, 21600, []),
        (0, 7200, ["air.csv: it ends at 2 of 6 h: 26 degC from then on"]),
        (90000, 93600, ["air.csv: it begins 25 h into the day: 20 degC until then"]),
    ],
)
def test_air_that_does_not_reach_over_the_day_is_told(tmp_path, first, last, said):
    (tmp_path / "air.csv").write_text(f"time_s,ambient_degC\n{first},20\n{last},26\n")
    (tmp_path / "p.toml").write_text(Path(PATH).read_text() + '\n[ambient]\nkind = "csv"\nfile = "air.csv"\n')
    assert [f.message for f in load_job(str(tmp_path / "p.toml")).input_findings] == said


def with_air_file(folder, rows, *overrides):
    """A job whose air is a table of its own."""
    (folder / "air.csv").write_text(rows)
    (folder / "p.toml").write_text(Path(PATH).read_text() + '\n[ambient]\nkind = "csv"\nfile = "air.csv"\n')
    return load_job(str(folder / "p.toml"), overrides=[*overrides])


@pytest.mark.parametrize("clock", [0, 6, 9.5])
def test_clock_times_of_the_air_are_those_of_the_day(tmp_path, clock):
    """Warm from noon to three; a day from six o'clock on was as cold as its morning."""
    hours = {6: 20, 11: 20, 12: 24, 15: 24, 16: 20, 23: 20}
    rows = "".join(f"{h:02}:00:00,{air}\n" for h, air in hours.items())
    off = [f"ambient.clock_h={clock}", f'before=[{{state="off", duration_h={14 - clock}}}]']
    by_clock = with_air_file(tmp_path, "Time,air [degC]\n" + rows, *off)
    seconds = "".join(f"{(h - clock) * 3600:g},{air}\n" for h, air in hours.items() if h >= clock)
    by_hand = with_air_file(tmp_path, f"time_s,ambient_degC\n{seconds}", *off)
    assert_allclose(by_clock.start_rise(), by_hand.start_rise(), atol=1e-12)
    assert by_clock.start_rise().min() > 0.3  # K, two hours after it became warm


@pytest.mark.parametrize("zone", ["", "Z"])
def test_dates_of_the_air_begin_with_their_first_day(tmp_path, zone):
    """A night shift from 22 to 6: clock times past midnight are told to write dates."""
    hours = {22: 20, 23: 23, 24: 25, 27: 25, 30: 21}
    rows = "".join(f"2026-11-{3 + h // 24:02} {h % 24:02}:00:00{zone},{air}\n" for h, air in hours.items())
    night = ("ambient.clock_h=22", 'before=[{state="off", duration_h=8}]')
    dated = with_air_file(tmp_path, "Time,air [degC]\n" + rows, *night)
    seconds = "".join(f"{(h - 22) * 3600},{air}\n" for h, air in hours.items())
    by_hand = with_air_file(tmp_path, f"time_s,ambient_degC\n{seconds}", *night)
    assert_allclose(dated.start_rise(), by_hand.start_rise(), atol=1e-9)
    assert dated.start_rise().min() > 0.3


@pytest.mark.parametrize("moment", ["2026-11-03 {}:00:00", "{}:00:00"])
def test_air_of_another_day_is_refused(tmp_path, moment):
    rows = "Time,air [degC]\n" + "".join(f"{moment.format(hour)},{air}\n" for hour, air in (("06", 20), ("09", 24)))
    day = ("ambient.clock_h=10", 'before=[{state="off", duration_h=8}]')
    with pytest.raises(
        InputError, match=r"air\.csv: its times, .* h from the first \[\[before\]\] on, are none of the day"
    ):
        with_air_file(tmp_path, rows, *day)
    for more in ((), ('cycle=[{state="off", duration_h=1}]',)):
        with pytest.raises(InputError, match="its times, 34 to 36 h"):
            with_air_file(tmp_path, "time_s,ambient_degC\n122400,20\n129600,24\n", *day, *more)
        with_air_file(tmp_path, "time_s,ambient_degC\n36000,20\n43200,24\n", *day, *more)


def test_ramp_and_csv_of_the_same_air_agree(tmp_path):
    (tmp_path / "air.csv").write_text("time_s,ambient_degC\n0,20\n7200,\n10800,26\n21600,26\n")
    (tmp_path / "p.toml").write_text(Path(PATH).read_text() + '\n[ambient]\nkind = "csv"\nfile = "air.csv"\n')
    from_file = load_job(str(tmp_path / "p.toml"))
    ramp = job_with('ambient={kind="ramp", from_degC=20, to_degC=26, over_h=3}')
    assert_allclose(from_file.start_rise(), ramp.start_rise(), atol=1e-12)
    assert np.all(ramp.start_rise() > job_with().start_rise() + 1)


def test_history_passes_through_the_states_after_each_duty(job):
    heat = job.heat
    day = job_with(
        'before=[{state="moving", feed_mm_s=100, duration_h=2}, {state="off", duration_h=1}, '
        '{state="moving", feed_mm_s=20, duration_h=3}]',
        'ambient={kind="wave", amplitude_K=1.5}',
    )
    ends = np.cumsum([d.duration for d in day.history.before])
    rises = rise_history(heat, day.history.before, np.concatenate([[0.0], ends]), air=day.history.air)
    for n in range(4):
        assert_allclose(rises[n], state_after(heat, day.history.before[:n], air=day.history.air), atol=1e-12)
    assert_allclose(rises[-1], day.start_rise())


def test_shifts_of_a_day_that_is_left_out_are_no_fault():
    """A log or a state stands in the place of all stretches; the shifts stay in the file."""
    assert job_with("shift=[{from_h=6, to_h=14}]", "before=[]").history.before == ()
