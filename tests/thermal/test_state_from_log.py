"""The thermocouple log: the state it ends with, its gaps and noise, and what it refuses."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import path_file

from compgen.core.exceptions import InputError
from compgen.core.units import HOUR
from compgen.pipelines.files.path_file import load_job
from compgen.thermal import Duty, rise_history
from compgen.thermal.state_from_log import TemperatureLog, fit_log

PARTS = {"part_3": "j2", "part_4": "link1", "part_6": "j3", "part_11": "wrist"}
SENSED = tuple(PARTS.values())
LOSS = (12.0, 55.0, 25.0, 0.5, 3.0, 2.0)


@pytest.fixture(scope="module", params=["nodes", "network"])
def heat(request):
    return load_job(path_file("circle_1300"), overrides=[f"robot.thermal.model={request.param}"]).heat


def truth(heat, time):
    """A day that the model itself lived: fast, then a rest, then slower."""
    slow = tuple(0.5 * p for p in LOSS)
    duties = [Duty("moving", 0.2, 3 * HOUR, loss=LOSS), Duty("off", 0.0, HOUR), Duty("moving", 0.05, HOUR, loss=slow)]
    return rise_history(heat, duties, time)


def log_of(heat, time, rises, names=SENSED):
    return TemperatureLog(time, np.zeros(len(time)), {n: rises[:, heat.names.index(n)].copy() for n in names})


def end_of(fit):
    return fit.rise[-1]


def test_a_clean_log_gives_back_the_state(heat):
    time = np.linspace(0, 5 * HOUR, 600)
    rises = truth(heat, time)
    fit = fit_log(log_of(heat, time, rises), heat, LOSS)
    sensors = [heat.names.index(n) for n in PARTS.values()]
    assert_allclose(end_of(fit)[sensors], rises[-1][sensors], atol=0.12)  # K
    assert_allclose(end_of(fit), rises[-1], atol=0.35)  # also what no sensor sees


def test_noise_gaps_and_outliers_hardly_matter(heat):
    rng = np.random.default_rng(7)
    time = np.linspace(0, 5 * HOUR, 3000)
    rises = truth(heat, time)
    log = log_of(heat, time, rises)
    for readings in log.readings.values():
        readings += rng.normal(0, 0.3, len(time))
        readings[rng.random(len(time)) < 0.2] = np.nan  # lost
        readings[rng.random(len(time)) < 0.01] += 40.0  # a loose contact
    log.readings["j3"][1200:1900] = np.nan  # an hour without
    log.readings["wrist"][-200:] = np.nan  # twenty minutes at the end without
    fit = fit_log(log, heat, LOSS)
    sensors = [heat.names.index(n) for n in PARTS.values()]
    assert_allclose(end_of(fit)[sensors], rises[-1][sensors], atol=0.25)  # K
    for name, readings in log.readings.items():
        off = readings - np.interp(log.time, fit.time, fit.rise[:, heat.names.index(name)])
        assert np.sqrt(np.nanmean(off**2)) < 5


@pytest.mark.parametrize("seed", range(3))
def test_uneven_times_are_readings_of_their_own_times(heat, seed):
    """A reading 0.5 s behind an even step counted as one of the next step: 0.09 K after five hours."""
    even = np.linspace(0, 5 * HOUR, 61)
    late = even + np.random.default_rng(seed).uniform(-100.0, 100.0, len(even)) * (even > 0) * (even < even[-1])
    ends = [end_of(fit_log(log_of(heat, time, truth(heat, time)), heat, LOSS)) for time in (even, late)]
    assert_allclose(ends[1], ends[0], atol=0.01)


def test_a_log_of_many_readings_gives_what_every_tenth_gives(heat):
    time = np.linspace(0, 5 * HOUR, 18_001)
    rises = truth(heat, time)
    ends = [end_of(fit_log(log_of(heat, time[::n], rises[::n]), heat, LOSS)) for n in (1, 10)]
    assert_allclose(ends[0], ends[1], atol=0.003)


def test_it_goes_on_from_there(heat):
    """A log to the third hour, then the model alone, against the model that lived through all of it."""
    time = np.linspace(0, 3 * HOUR, 400)
    first = [Duty("moving", 0.2, 3 * HOUR, loss=LOSS)]
    later = [Duty("off", 0.0, 2 * HOUR)]
    fit = fit_log(log_of(heat, time, rise_history(heat, first, time)), heat, LOSS)
    whole = rise_history(heat, [*first, *later], np.array([5 * HOUR]))[0]
    sensors = [heat.names.index(n) for n in PARTS.values()]
    assert_allclose(
        rise_history(replace(heat, start=fit.state), later, np.array([2 * HOUR]))[0][sensors], whole[sensors], atol=0.15
    )


def test_two_sensors_still_give_a_whole_profile(heat):
    time = np.linspace(0, 5 * HOUR, 600)
    rises = truth(heat, time)
    fit = fit_log(log_of(heat, time, rises, ("j2", "j3")), heat, LOSS)
    assert_allclose(end_of(fit), rises[-1], atol=1.6)  # K: from a working robot's proportions
    assert not np.allclose(end_of(fit)[heat.names.index("wrist")], 0, atol=0.2)


def write(folder, header, rows, **keys):
    (folder / "log.csv").write_text(header + "\n" + "\n".join(rows) + "\n")
    keys_text = "".join(f"{k} = {v!r}\n" if not isinstance(v, str) else f'{k} = "{v}"\n' for k, v in keys.items())
    text = Path(path_file("line_y")).read_text().split("[[before]]")
    after = text[1].split("[bounds]")[1]
    (folder / "p.toml").write_text(f'{text[0]}[log]\nfile = "log.csv"\n{keys_text}\n[bounds]{after}')
    return str(folder / "p.toml")


HEAD = "time_s,ambient_degC,part_3_degC,part_4_degC,part_6_degC,part_11_degC"


def rows_of(rise, ambient=20.0, zero=20.0):
    return [
        f"{60 * n},{ambient},{zero + rise[0]},{zero + rise[1]},{zero + rise[2]},{zero + rise[3]}" for n in range(60)
    ]


def test_a_program_starts_from_the_real_state(tmp_path):
    job = load_job(write(tmp_path, HEAD, rows_of((6.0, 2.0, 8.0, 1.5))))
    rises = dict(zip(job.heat.names, job.start_rise(), strict=True))
    assert rises["j2"] == pytest.approx(6, abs=0.02)
    assert rises["j3"] == pytest.approx(8, abs=0.02)
    assert 0.8 < rises["face"] < 1.5  # no sensor: follows the wrist as in the study, 2.3 to 3
    warm = load_job(write(tmp_path, HEAD, rows_of((6.0, 2.0, 8.0, 1.5))), overrides=["robot.thermal.model=network"])
    assert dict(zip(warm.heat.names, warm.start_rise(), strict=True))["j3"] == pytest.approx(8, abs=0.05)


@pytest.mark.parametrize(
    ("ambient", "zero", "reference"), [(23.0, 20.0, 20.0), (18.0, 18.0, "ambient"), (24.0, 25.0, "start")]
)
def test_rises_count_from_the_reference(tmp_path, ambient, zero, reference):
    rise = (0.0,) * 4 if reference == "start" else (6.0, 2.0, 8.0, 1.5)
    rows = rows_of(rise, ambient, zero)
    job = load_job(write(tmp_path, HEAD, rows, reference=reference))
    assert_allclose(job.start_rise()[:4], rise, atol=0.05)


def test_an_arm_that_warms_at_once_is_cold_at_the_first_reading_only(tmp_path):
    """The median of a longer beginning would be warm already, and all rises too low by it."""
    t = np.arange(0, 7201, 60.0)
    rows = [f"{a:g},20,{r:.4f}" for a, r in zip(t, 20 + 12 * (1 - np.exp(-t / 2400)), strict=True)]
    job = load_job(write(tmp_path, "time_s,ambient_degC,part_6_degC", rows, reference="start"))
    assert dict(zip(job.heat.names, job.start_rise(), strict=True))["j3"] == pytest.approx(
        12 * (1 - np.exp(-3)), abs=0.1
    )


def test_sensors_are_named_by_part_or_by_node_and_the_air_may_miss(tmp_path):
    rows = [f"{60 * n},26,28" for n in range(60)]
    by_part = load_job(write(tmp_path, "time_s,part_3_degC,part_6_degC", rows)).start_rise()
    by_node = load_job(write(tmp_path, "time_s,j2_degC,j3_degC", rows)).start_rise()
    assert_allclose(by_part, by_node)
    assert by_part[0] == pytest.approx(6, abs=0.02)
    with pytest.raises(InputError, match="ambient_degC: missing"):
        load_job(write(tmp_path, "time_s,j2_degC", ["0,20", "60,20"], reference="ambient"))


def test_the_air_stays_as_the_log_left_it_unless_told(tmp_path):
    file = write(tmp_path, HEAD, rows_of((3.0,) * 4, ambient=23.0))
    assert load_job(file).history.air.at(np.array([0.0]))[0] == pytest.approx(3.0)
    assert load_job(file, overrides=["ambient.value_degC=21"]).history.air.at(np.array([0.0]))[0] == pytest.approx(1.0)


@pytest.mark.parametrize("wrong", [31.0, 9.0])
def test_one_wrong_reading_of_the_air_is_not_the_air_that_follows(tmp_path, wrong):
    """The last cell alone was taken: 11 K of air too warm over all that the program does, without a word."""
    rows = rows_of((3.0,) * 4, ambient=23.0)
    rows[-1] = rows[-1].replace(",23.0,", f",{wrong},")
    job = load_job(write(tmp_path, HEAD, rows))
    assert job.history.air.at(np.array([0.0]))[0] == pytest.approx(3.0)


@pytest.mark.parametrize("reference", [12.0, "start", "ambient"])
def test_a_log_and_the_air_of_the_day_count_from_one_temperature(tmp_path, reference):
    """In a hall at 12 degC a log counted from 12 and the air from 20: by 8 K too cold for all that follows."""
    rise = (0.0,) * 4 if reference == "start" else (6.0, 2.0, 8.0, 1.5)
    file = write(tmp_path, HEAD, rows_of(rise, 12.0, 12.0), reference=reference)
    air = ["ambient.value_degC=12", "ambient.kind='constant'"]
    with pytest.raises(
        InputError, match=r"count from 12\.0 degC, the air from 20; give ambient.reference_degC = 12\.0"
    ):
        load_job(file, overrides=air)
    for overrides in ([], [*air, "ambient.reference_degC=12.0"]):
        job = load_job(file, overrides=overrides)
        assert job.history.air.at(np.zeros(1))[0] == pytest.approx(0.0)
        assert_allclose(job.start_rise()[:4], rise, atol=0.05)


@pytest.mark.parametrize("wrong", [31.0, 9.0])
@pytest.mark.parametrize("every", [10, 40])
def test_rows_between_readings_of_the_air_are_no_readings(tmp_path, wrong, every):
    """Rows of 15 s, the air in some of them: forty rows on the way to one wrong cell outvoted the readings."""
    air = [("23.0" if n % every == 0 else "") for n in range(241)]
    air[-1] = str(wrong)
    job = load_job(write(tmp_path, HEAD, [f"{15 * n},{cell},23,22,23,21.5" for n, cell in enumerate(air)]))
    assert job.history.air.at(np.array([0.0]))[0] == pytest.approx(3.0)


@pytest.mark.parametrize("off", [0.8, -0.8, 3.0, -3.0])
@pytest.mark.parametrize(
    ("head", "reference"), [(HEAD, "start"), (HEAD.replace("ambient_degC,", ""), "start"), (HEAD, "ambient")]
)
def test_sensors_that_are_off_alike_are_no_other_air(tmp_path, off, head, reference):
    def job_of(off):
        rise = np.outer(1 - np.exp(-np.arange(241) / 120), (0.0, 6.0, 2.0, 8.0, 1.5)[5 - head.count(",") :])
        rows = [",".join(map(str, [60 * n, *(20 + off + row)])) for n, row in enumerate(rise)]
        air = ["ambient.value_degC=20", "ambient.kind='constant'"]
        return load_job(write(tmp_path, head, rows, reference=reference), overrides=air)

    assert_allclose(job_of(off).start_rise(), job_of(0.0).start_rise(), atol=1e-6)
    assert job_of(off).history.air.at(np.zeros(1))[0] == 0.0
    words = f"count from {20 + off:.1f} degC, the air from 20: taken for one, as sensors may be off alike"
    assert any(words in f.message for f in job_of(off).input_findings)


@pytest.mark.parametrize(("step", "air"), [(60.0, 4.95), (200.0, 4.985), (400.0, 4.99), (1200.0, 5.0)])
def test_the_air_that_follows_is_that_of_the_log_s_last_readings_within_half_an_hour(step, air):
    """Readings rise by 0.01 K each, those every twenty minutes by 1 K: the median of few would be of an hour ago."""
    n = np.arange(61.0)
    time, rising = step * n, np.array(5.0 - (60 - n) * (0.01 if step < 1200 else 1.0))
    assert TemperatureLog(time, rising, {}).last_air == pytest.approx(air)


def test_the_log_is_an_input_like_any_other(tmp_path):
    one = load_job(write(tmp_path, HEAD, rows_of((3.0,) * 4))).inputs_hash
    assert load_job(write(tmp_path, HEAD, rows_of((3.5,) * 4))).inputs_hash != one


@pytest.mark.parametrize(
    ("header", "rows", "words"),
    [
        (HEAD, ["0,20,20,20,20,20", "60,20,20,20,20,20", "30,20,20,20,20,20"], ("line 4", "time must rise")),
        (HEAD, ["-5,20,20,20,20,20", "60,20,20,20,20,20"], ("line 2", "negative")),
        (
            HEAD.replace("part_4", "prt_4"),
            ["0,20,20,20,20,20", "1,20,20,20,20,20"],
            ("prt_4_degC", "unknown", "part_4"),
        ),
        (HEAD, ["0,20,20,nan,20,20", "60,20,20,,20,20"], ("part_4_degC", "no number at all")),
        (HEAD, ["0,200,20,20,20,20", "60,20,20,20,20,20"], ("line 2", "ambient_degC = 200")),
        (HEAD, ["0,20,20,20,900,20", "60,20,20,20,20,20"], ("line 2", "part_6_degC = 900")),
        (HEAD, ["0,20,20,x,20,20", "60,20,20,20,20,20"], ("line 2", "column part_4_degC: 'x'")),
        (HEAD, ["0,20,20,20,20"], ("line 2", "5 cells")),
        (HEAD, [], ("no rows",)),
        (HEAD, ["0,20,20,20,20,20"], ("one row",)),
        ("time_s,part_3_degC,j2_degC", ["0,20,20", "1,20,20"], ("part_3_degC and j2_degC", "keep one")),
        ("time_s,elbow_degC", ["0,20", "1,20"], ("column elbow_degC", "unknown", "part_3_degC", "wrist_degC")),
        ("time_s,ambient_degC", ["0,20", "1,20"], ("no sensor", "part_3_degC")),
        ("time_s,ambient_degC,part_3_degC,part_3_degC", ["0,20,20,20", "1,20,20,20"], ("part_3_degC", "twice")),
    ],
)
def test_what_is_wrong_in_a_log_is_said(tmp_path, header, rows, words):
    with pytest.raises(InputError) as refusal:
        load_job(write(tmp_path, header, rows))
    assert all(w in str(refusal.value) for w in ("log.csv", *words)), refusal.value


def test_a_sensor_that_the_others_contradict_moves_no_program(tmp_path):
    with pytest.raises(InputError, match=r"log\.csv: column part_3_degC: reads 60\.0 degC .*mend the sensor"):
        load_job(write(tmp_path, HEAD, rows_of((40.0, 3.5, 11.6, 2.7))))


def test_a_log_needs_readings(heat):
    with pytest.raises(InputError, match="two readings"):
        fit_log(TemperatureLog(np.array([0.0, 1.0]), np.zeros(2), {}), heat)
    with pytest.raises(InputError, match="no such rise"):
        fit_log(TemperatureLog(np.array([0.0, 1.0]), np.zeros(2), {"elbow": np.zeros(2)}), heat)
    assert replace(heat, start=None).start is None
