"""A log that is still being written: whatever a logger, a disk or a clock does to it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError
from compgen.thermal.tables.schema import LogTable
from compgen.thermal.temperature_log import check_live, read_growing_log, read_temperature_log, readings_in_steps

NODES, SENSORS = ("j2", "face"), {"part_3": "j2"}
HEAD = "time_s,ambient_degC,part_3_degC\n"


def read(text):
    return read_growing_log("log.csv", NODES, SENSORS, data=text.encode() if isinstance(text, str) else text)


def rows(*pairs):
    return HEAD + "".join(f"{t},20,{v}\n" for t, v in pairs)


def test_whole_rows_are_read_and_a_row_without_an_end_is_not_yet_one():
    log = read(rows((0, 21), (10, 22)) + "20,20,2")
    assert_allclose(log.readings.time, [0, 10])
    assert_allclose(log.readings.readings["j2"], [21, 22])
    assert (log.left_out, log.gaps, log.set_back) == (0, 0, 0)
    grown = read(rows((0, 21), (10, 22)) + "20,20,23\n")
    assert_allclose(grown.readings.readings["j2"], [21, 22, 23])


@pytest.mark.parametrize(
    "text", ["", "time_s,part_3_degC", HEAD, HEAD + "0,20", "\n\n# only a remark\n", HEAD + "0,20,\n"]
)
def test_a_log_without_a_reading_is_none_yet(text):
    assert read(text).readings is None


def test_rows_that_cannot_be_read_are_left_out_and_told():
    log = read(HEAD + "0,20,21\nx,20,21\n10,20\n-5,20,21\n20,20,22,9\n30,20,23\n")
    assert_allclose(log.readings.time, [0, 30])
    assert log.left_out == 4


def test_readings_that_no_robot_has_are_gaps():
    log = read(rows((0, 21), (10, 2500), (20, "nan"), (30, "open"), (40, ""), (50, 22)))
    assert np.isnan(log.readings.readings["j2"][1:5]).all()
    assert log.gaps == 3  # an empty cell is one that the logger meant


def test_the_coldest_and_the_hottest_that_are_allowed_are_read(tmp_path):
    file = tmp_path / "log.csv"
    file.write_text(HEAD + "0,-20,-20\n10,60,120\n")
    for log in (read(file.read_bytes()).readings, read_temperature_log(file, NODES, SENSORS)):
        assert log.ambient is not None
        assert_allclose(log.ambient, [-20, 60])
        assert_allclose(log.readings["j2"], [-20, 120])


@pytest.mark.parametrize(
    ("time", "words"),
    [
        ((0, 10, 10), "10 after 10: time must rise; write the times with their seconds"),
        ((0, 10, 5), "5 after 10: time must rise; sort the log"),
        ((-1, 10, 20), "-1 is negative; begin at 0"),
    ],
)
def test_a_whole_log_whose_time_does_not_rise_is_refused(tmp_path, time, words):
    file = tmp_path / "log.csv"
    file.write_text(rows(*((t, 21) for t in time)))
    with pytest.raises(InputError, match=words):
        read_temperature_log(file, NODES, SENSORS)


def test_a_clock_that_is_set_back_goes_on_where_it_was():
    log = read(rows((3600, 21), (3610, 22), (20, 23), (30, 24), (40, 25)))
    assert_allclose(log.readings.time, [3600, 3610, 3620, 3630, 3640])
    assert log.set_back == 3600
    assert_allclose(read(rows((0, 21), (7200, 22))).readings.time, [0, 7200])  # forward it is a gap


def test_other_readings_of_the_same_second_do_not_move_the_clock():
    """Two rows a second, the clock in whole seconds: it went on twice as fast."""
    log = read(rows(*((t // 2 * 30, 21 + t) for t in range(40))))
    assert_allclose(log.readings.time, [t // 2 * 30 for t in range(40)], atol=0.0011)
    assert (np.diff(log.readings.time) > 0).all()
    assert (log.left_out, log.set_back) == (0, 0.0)


@pytest.mark.parametrize("often", [1, 2])
def test_a_clock_that_hangs_is_moved_on_by_its_usual_step(often):
    """10 s from row to row, told to so many rows: it ended with the second at which the clock stood."""
    true = [10.0 * n for n in range(240)]
    told = [min(t // (10 * often) * 10 * often, 180.0) for t in true]
    values = [21 + n / 100 for n in range(240)]
    log = read(rows(*zip(told, values, strict=True)))
    assert_allclose(log.readings.time[18:], true[18:], atol=0.2)  # 1 ms of each pair
    assert log.set_back == pytest.approx(2390 - 180, abs=0.2)
    caught_up = read(rows(*zip([*told, 2400, 2410], [*values, 24, 25], strict=True)))
    assert_allclose(caught_up.readings.time[-2:], [2400, 2410])
    fast = read(rows(*((n // 50, 21 + n / 100) for n in range(500))))  # 50 rows in each second are no hanging clock
    assert fast.readings.time[-1] == pytest.approx(9, abs=0.1)
    assert fast.set_back == 0


@pytest.mark.parametrize("digits", [1, 2])
def test_rows_alike_under_a_clock_that_hangs_are_no_copies(digits):
    """Sensors of 0.1 K, 10 s from row to row: of 220 rows of 190 s those alike were left out, of all alike each."""
    true = [10.0 * n for n in range(240)]
    values = [round(21 + n / 100, digits) for n in range(240)]
    for readings in (values, [21.0] * 240):
        log = read(rows(*zip(np.minimum(true, 190.0), readings, strict=True)))
        assert_allclose(log.readings.time, true)
        assert (log.left_out, log.has_no_clock) == (0, False)
        assert log.set_back == 2390 - 190
    copies = [*zip(true[:40], values[:40], strict=True), (390.0, values[39]), (390.0, values[39]), (400.0, 22.0)]
    assert (read(rows(*copies)).left_out, read(rows(*copies)).readings.time[-1]) == (2, 400)
    hung = [*zip(np.minimum(true[:40], 190.0), values[:40], strict=True)]
    again = read(rows(*hung, *hung))  # the whole file once more
    assert_allclose(again.readings.time, true[:40])
    assert again.left_out == 40


def test_a_clock_that_hangs_from_the_first_row_is_no_clock():
    for values in ([21 + n / 100 for n in range(60)], [21.0] * 60):
        assert read(rows(*((7.0, v) for v in values))).has_no_clock
        assert not read(rows(*((7.0 + n, v) for n, v in enumerate(values)))).has_no_clock
    assert not read(rows((7.0, 21), (7.0, 21.1))).has_no_clock


def test_a_growing_log_in_seconds_keeps_its_clock_however_its_cells_are_parted():
    data = b"time_s;ambient_degC;part_3_degC\n18600;20,0;21,5\n18630;20,0;21,75\n"
    for text in (data, data.replace(b"18600", b"310").replace(b"18630", b"310,5").replace(b"time_s", b"time_min")):
        log = read(text)
        assert_allclose(log.readings.time, [18600, 18630])
        assert_allclose(log.readings.readings["j2"], [21.5, 21.75])


def test_a_file_that_was_begun_anew_or_copied_away_is_read_from_its_own_head():
    again = rows((0, 21), (10, 22)) + rows((20, 23))
    assert_allclose(read(again).readings.time, [0, 10, 20])
    holes = b"\0" * 500 + rows((500, 23), (510, 24)).encode()
    assert_allclose(read(holes).readings.time, [500, 510])


def test_a_sensor_that_no_reading_shows_yet_is_not_there_yet():
    log = read("time_s,part_3_degC,face_degC\n0,21,\n10,22,\n")
    assert log.readings is not None
    assert set(log.readings.readings) == {"j2"}


@pytest.mark.parametrize(("text", "word"), [("a,b\n1,2\n", "time_s"), ("time_s,part_9_degC\n0,20\n", "part_9_degC")])
def test_a_log_of_something_else_is_refused(text, word):
    with pytest.raises(InputError, match=word):
        read(text)


def test_readings_by_steps_are_medians_of_what_lies_within():
    time = np.array([1.0, 10.0, 30.0, 31.0, 200.0])
    steps, values, count = readings_in_steps(np.array([1.0, 9.0, 2.0, np.nan, 5.0]), time, 30.0)
    assert steps.tolist() == [1, 7]
    assert values.tolist() == [2.0, 5.0]
    assert count.tolist() == [3, 1]


def test_rows_that_were_written_before_are_left_out():
    rows = [f"{10 * n},2{n % 3}.{n}" for n in range(9)]
    text = "\n".join(["time_s,j3_degC", *rows[:6], *rows[2:6], rows[5], *rows[6:]]) + "\n"
    log = read_growing_log("log.csv", ("j3",), {}, data=text.encode())
    assert (log.left_out, log.set_back) == (5, 0.0)
    assert log.readings is not None
    assert log.readings.time.tolist() == [10.0 * n for n in range(9)]


TWELVE = "time_s," + ",".join(f"part_{n}_degC" for n in range(1, 13))


def test_parts_that_no_rise_is_of_are_left_out_and_said(tmp_path):
    (tmp_path / "log.csv").write_text("\n".join([TWELVE, *(f"{t}" + ",21.5" * 12 for t in (0, 60))]) + "\n")
    log = read_temperature_log(tmp_path / "log.csv", NODES, SENSORS)
    assert set(log.readings) == {"j2"}
    assert "left out: part_1_degC, part_2_degC, part_4_degC" in log.notes[0]
    log = read_temperature_log(tmp_path / "log.csv", NODES, {**SENSORS, "part_4": "base"})  # of the other heat model
    assert set(log.readings) == {"j2"}
    (tmp_path / "log.csv").write_text("time_s,part_3_degC,prt_4_degC\n0,21,21\n1,21,21\n")
    with pytest.raises(InputError, match="prt_4_degC: unknown sensor"):
        read_temperature_log(tmp_path / "log.csv", NODES, SENSORS)


LOGGER = """Gerät;Logger 5
Zeit;TC 01;TC 03;TC 09
;°C;°C;°C
22.11.2026 08:15:00;20,5;21,5;3
22.11.2026 08:15:30;20,5;--;3
"""


def test_a_loggers_own_columns_are_those_that_the_path_file_or_the_robot_file_names(tmp_path):
    (tmp_path / "log.csv").write_bytes(LOGGER.encode("cp1252"))
    columns = LogTable(file="log.csv", columns={"j2": "TC 03", "ambient": "TC 01"})
    log = read_temperature_log(tmp_path / "log.csv", NODES, SENSORS, columns)
    assert_allclose(log.readings["j2"], [21.5, np.nan])
    assert log.ambient is not None
    assert_allclose(log.ambient, 20.5)
    assert "read as: semicolon, decimal comma, degC, dates and times without a zone" in log.notes[0]
    assert "left out: TC 09" in log.notes[0]
    log = read_temperature_log(tmp_path / "log.csv", NODES, {"TC 03": "j2"})
    assert_allclose(log.readings["j2"], [21.5, np.nan])


def test_a_growing_log_of_a_loggers_form_counts_from_its_first_row_and_waits_for_the_end_of_its_last():
    data = LOGGER.encode("cp1252") + b"22.11.2026 08:16:00;2"
    log = read_growing_log("log.csv", NODES, {"TC 03": "j2"}, data=data)
    assert log.readings is not None
    assert_allclose(log.readings.time, [0, 30])


def test_a_log_whose_sensors_nobody_named_says_how_to_name_them(tmp_path):
    (tmp_path / "log.csv").write_bytes(LOGGER.encode("cp1252"))
    with pytest.raises(InputError) as caught:
        read_temperature_log(tmp_path / "log.csv", NODES, SENSORS)
    message = str(caught.value)
    line = 'columns = { j2 = "TC 03" }'
    assert f'no sensor; name it in log.csv.toml as {line}, unit = "degC", or in thermal.sensors of the' in message
    assert "there are: TC 01, TC 03, TC 09" in message
    assert len(message) - len(str(tmp_path)) <= 300
    (tmp_path / "log.csv.toml").write_text(f'{line}\nunit = "degC"\n')
    assert read_temperature_log(tmp_path / "log.csv", NODES, SENSORS).readings.keys() == {"j2"}


def test_of_sensors_whose_names_hold_a_rises_the_line_is_said_whole(tmp_path):
    (tmp_path / "log.csv").write_text("Zeit;Kanal 1 [°C] J2;Temp_Face [°C]\n22.11.2026 08:15:00;20,5;21,5\n")
    with pytest.raises(InputError) as caught:
        read_temperature_log(tmp_path / "log.csv", NODES, SENSORS)
    line = 'columns = { j2 = "Kanal 1 [°C] J2", face = "Temp_Face [°C]" }'
    assert f"name it in log.csv.toml as {line}, or in thermal.sensors" in str(caught.value)
    (tmp_path / "log.csv.toml").write_text(line)
    log = read_temperature_log(tmp_path / "log.csv", NODES, SENSORS)
    assert {name: values.tolist() for name, values in log.readings.items()} == {"j2": [20.5], "face": [21.5]}


def test_a_trend_with_a_row_for_each_series_is_read(tmp_path):
    rows = [f'"{name}";"2026-11-22 08:{n:02}:00";"{20 + n}"\n' for name in ("j2 [C]", "face [C]") for n in range(3)]
    (tmp_path / "log.csv").write_text('"Series";"Time";"Value"\n' + "".join(rows))
    log = read_temperature_log(tmp_path / "log.csv", NODES, SENSORS)
    assert {name: values.tolist() for name, values in log.readings.items()} == {
        "j2": [20, 21, 22],
        "face": [20, 21, 22],
    }


def warming(tau_h, step_s, digit, noise=0.05, hours=6.0, seed=0):
    """A part that warms by 25 K [s], [degC], as a logger of a digit writes it; 0: as many as it has."""
    time = np.arange(0.0, hours * 3600 + 1, step_s)
    value = 20 + 25 * (1 - np.exp(-time / (tau_h * 3600)))
    value += np.random.default_rng(seed).normal(0, noise, len(time))
    return time, np.round(value / digit) * digit if digit else value


def checked(tmp_path, time, value, beside=None):
    """A log of that value, and of another part that takes three hours to warm unless given, looked at."""
    other = warming(3.0, time[1] - time[0], 0, hours=time[-1] / 3600, seed=9)[1] if beside is None else beside
    file = tmp_path / "log.csv"
    lines = [f"{t},{o},{'' if np.isnan(v) else repr(float(v))}" for t, o, v in zip(time, other, value, strict=True)]
    file.write_text("\n".join(["time_s,face_degC,part_3_degC", *lines, ""]))
    check_live(read_temperature_log(str(file), NODES, SENSORS))


@pytest.mark.parametrize("digit", [0, 0.01, 0.1])
@pytest.mark.parametrize("step_s", [10.0, 60.0, 300.0])
@pytest.mark.parametrize("again", [None, 300])
def test_a_sensor_that_hangs_while_its_part_warms_is_refused(tmp_path, digit, step_s, again):
    time, value = warming(2.0, step_s, digit)
    hangs = (time >= 6000) & (time <= (60 * again if again else np.inf))
    value[hangs] = value[hangs][0]
    with pytest.raises(
        InputError, match=r"log.csv: column part_3_degC: stands at one value for an hour and more from (59|60)\d\d s"
    ):
        checked(tmp_path, time, value)


@pytest.mark.parametrize("digit", [0, 0.01, 0.1, 0.5, 1.0])
@pytest.mark.parametrize("step_s", [10.0, 60.0, 300.0, 1200.0])
@pytest.mark.parametrize("tau_h", [0.5, 1.0, 3.0])
def test_a_part_that_comes_to_rest_is_believed(tmp_path, digit, step_s, tau_h):
    for seed, noise in enumerate((0.0, 0.02, 0.2)):
        time, value = warming(tau_h, step_s, digit, noise, 12.0, seed)
        checked(tmp_path, time, value)
        checked(tmp_path, time, np.where((time > 4000) & (time < 9000), np.nan, value))
    checked(tmp_path, time, np.full(len(time), 21.0))


def test_parts_that_all_come_to_rest_at_once_are_a_log_that_somebody_wrote_and_are_believed(tmp_path):
    time = np.arange(0.0, 4 * 3600 + 1, 60.0)
    checked(tmp_path, time, 20 + 25 * np.minimum(time / 7000, 1), 20 + 9 * np.minimum(time / 7000, 1))


@pytest.mark.parametrize("header", ["time_s,j2_degF,ambient_degF", "time_s,j2_K,ambient_K"])
def test_a_growing_log_in_another_unit_is_read_in_it_on_its_own_clock(header):
    """It was refused, and named its column as if degC had to be written over it."""
    cells = "86,68\n3660,86,68\n" if "degF" in header else "303.15,293.15\n3660,303.15,293.15\n"
    readings = read(f"{header}\n3600,{cells}").readings
    assert readings.time.tolist() == [3600.0, 3660.0]
    assert_allclose(readings.readings["j2"], 30.0)
    assert_allclose(readings.ambient, 20.0)


def test_an_unknown_column_of_a_growing_log_is_refused_by_name():
    with pytest.raises(InputError, match="column spindle_degC: unknown sensor"):
        read("time_s,j2_degC,spindle_degC\n0,20,20\n60,20,20\n")
