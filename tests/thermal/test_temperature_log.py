"""A log that is still being written: whatever a logger, a disk or a clock does to it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError
from compgen.thermal.temperature_log import growing_log, readings_in_steps

NODES, SENSORS = ("j2", "face"), {"part_3": "j2"}
HEAD = "time_s,ambient_degC,part_3_degC\n"


def read(text):
    return growing_log(text.encode() if isinstance(text, str) else text, "log.csv", NODES, SENSORS)


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


def test_a_clock_that_is_set_back_goes_on_where_it_was():
    log = read(rows((3600, 21), (3610, 22), (20, 23), (30, 24), (40, 25)))
    assert_allclose(log.readings.time, [3600, 3610, 3620, 3630, 3640])
    assert log.set_back == 3600
    assert_allclose(read(rows((0, 21), (7200, 22))).readings.time, [0, 7200])  # forward it is a gap


def test_a_file_that_was_begun_anew_or_copied_away_is_read_from_its_own_head():
    again = rows((0, 21), (10, 22)) + rows((20, 23))
    assert_allclose(read(again).readings.time, [0, 10, 20])
    holes = b"\0" * 500 + rows((500, 23), (510, 24)).encode()
    assert_allclose(read(holes).readings.time, [500, 510])


def test_a_sensor_that_no_reading_shows_yet_is_not_there_yet():
    log = growing_log(b"time_s,part_3_degC,face_degC\n0,21,\n10,22,\n", "log.csv", NODES, SENSORS)
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
    log = growing_log(text.encode(), "log.csv", ("j3",), {})
    assert (log.left_out, log.set_back) == (5, 0.0)
    assert log.readings is not None
    assert log.readings.time.tolist() == [10.0 * n for n in range(9)]
