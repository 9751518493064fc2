"""What a log says of poses: when the arm is warm, clocks that are off, units of times, and where a rise is too much."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError
from compgen.identification.measurements import blank_rows
from compgen.identification.warm_up import CLOCK_SHIFTS, as_warm_up, check_warms, read_log, with_temperatures
from compgen.pipelines.files.robot_file import load_arm

HOUR = 3600.0
AIR, NODES = 20.0, ["j2", "link1", "part_6", "wrist"]


@pytest.fixture(scope="module")
def arm():
    return load_arm("m710ic50")


def poses(arm, time):
    time = np.asarray(time, dtype=float)
    M = len(time)
    label = tuple(f"poses.csv: line {n + 2}" for n in range(M))
    return replace(blank_rows(np.zeros((M, 6)), np.arange(M), label, len(arm.nodes)), time=time)


def log_of(tmp_path, arm, time, air=True, **degrees):
    """A log, each column a number or as many as there are times."""
    columns = {"time_s": time} | ({"ambient_degC": AIR} if air else {}) | degrees
    names = [f"{n}_degC" if n in NODES else n for n in columns]
    table = np.column_stack([np.broadcast_to(np.asarray(c, dtype=float), len(time)) for c in columns.values()])
    file = tmp_path / "log.csv"
    lines = [",".join("" if np.isnan(v) else f"{v:.10g}" for v in row) for row in table]
    file.write_text("\n".join([",".join(names), *lines]) + "\n")
    return read_log(str(file), arm.heat, arm.sensors)


def warming(time, tau=2 * HOUR):
    return 1 - np.exp(-np.asarray(time) / tau)


def course(tmp_path, arm, begin=0.0):
    time = np.arange(0, 4 * HOUR + 1, 60.0)
    degrees = dict(zip(NODES, (AIR + k * warming(time) for k in (11, 4, 13, 3)), strict=True))
    return log_of(tmp_path, arm, time + begin, **degrees)


def with_log(tmp_path, arm, time, reference="start", at=(0.0, 600.0), **columns):
    log, heat = log_of(tmp_path, arm, time, **columns)
    return with_temperatures(poses(arm, at), log, heat, reference)


def test_the_rises_of_a_clock_that_is_off_are_those_of_poses_so_much_later(tmp_path, arm):
    """Of the face too, which no sensor tells and which begins cold with the log."""
    log, heat = course(tmp_path, arm)
    data = poses(arm, [2 * HOUR, 2.2 * HOUR, 2.5 * HOUR])
    found, _ = with_temperatures(data, log, heat, "start")
    assert found.shifted is not None
    assert CLOCK_SHIFTS.tolist() == [60 * m for m in (-180, -120, -60, -30, 30, 60, 120, 180)]
    for shifted, late in list(zip(found.shifted, CLOCK_SHIFTS, strict=True))[1:-2]:
        moved, _ = with_temperatures(replace(data, time=data.time + late), log, heat, "start")
        assert_allclose(shifted, moved.rise, atol=1e-9)
    assert np.abs(found.shifted[4] - found.rise).min() > 0.05


def test_warm_counts_from_the_logs_begin_once_a_part_is_half_a_kelvin_warmer(tmp_path, arm):
    """The warmest part is 0.45 K warm 253 s after the log began, and 0.8 K after 457 s."""
    log, heat = course(tmp_path, arm, begin=900.0)
    found, _ = with_temperatures(poses(arm, [900.0, 1153.0, 1357.0, 3000.0]), log, heat, "start")
    assert found.warm.tolist() == [0.0, 0.0, 457.0, 2100.0]


def test_a_warm_up_without_a_log_counts_from_its_first_pose_and_takes_ten_minutes_to_thirty_days(arm):
    assert as_warm_up(poses(arm, [500.0, 100.0, 700.0])).warm.tolist() == [400.0, 0.0, 600.0]
    assert as_warm_up(poses(arm, [0.0, 30 * 24 * HOUR])).warm[1] == 30 * 24 * HOUR
    for span, unit in (
        (599.0, "are the times minutes? multiply them by 60"),
        (2.9e6, "milliseconds"),
        (47.0, "hours"),
        (60.0, "minutes"),
    ):
        with pytest.raises(InputError, match=r"^poses.csv: column time_s: .* where an arm needs") as caught:
            as_warm_up(poses(arm, [0.0, span / 3, span]))
        assert unit in str(caught.value)
    with pytest.raises(InputError, match="give the times in seconds"):
        as_warm_up(poses(arm, [0.0, 1e-3]))
    with pytest.raises(InputError, match="rises by 1 from pose to pose"):
        as_warm_up(poses(arm, np.arange(900.0)))
    as_warm_up(poses(arm, [0.0, 1.0, 700.0]))


@pytest.mark.parametrize(
    ("log", "first", "last", "words"),
    [
        ((0, 9000), 8.0e6, 8.2e6, "are the poses' times milliseconds? multiply them by 0.001"),
        ((0, 9000), 8.0e6, 8.1e6, "both need one clock"),  # 1.1 % of it in another unit: by chance
        ((3000, 9000), 4.0e6, 4.15e6, "milliseconds"),
        ((3000, 9000), 2.0e6, 8.0e6, "both need one clock"),
        ((0, 9000), 9001, 9900, "both need one clock"),
        ((0, 9000), 100, 9001, "poses.csv: line 3, column time_s: 9001 is outside the log"),
        ((50, 150), 4000, 4200, "are the log's times minutes? multiply them by 60"),
        ((50, 150), 4000, 4118, "both need one clock"),
        ((50, 150), 1000, 8000, "both need one clock"),
        ((0, 2.5), 1000, 9000, "are the log's times hours? multiply them by 3600"),
        ((0, 9e6), -50, 9000, "both need one clock"),
        ((0, 10800), 180, 21600, "it ends too early, or both need one clock"),  # not: of 7 days, minutes
        ((0, 150), 100, 9000, "are the log's times minutes? multiply them by 60"),  # not: the poses' milliseconds
    ],
)
def test_poses_outside_a_log_are_refused_with_the_unit_that_puts_them_inside(tmp_path, arm, log, first, last, words):
    with pytest.raises(InputError, match="is outside the log") as caught:
        with_log(tmp_path, arm, np.linspace(log[0], log[1], 200), j2=AIR, at=(first, last))
    assert words in str(caught.value)


def test_poses_at_the_first_and_at_the_last_second_of_a_log_are_inside(tmp_path, arm):
    log, heat = course(tmp_path, arm)
    found, _ = with_temperatures(poses(arm, [0.0, 4 * HOUR]), log, heat, "start")
    assert found.rise[1, 0] == pytest.approx(11 * warming(4 * HOUR), abs=0.05)


def test_no_arm_warms_by_more_than_three_kelvin_in_ten_minutes(tmp_path, arm):
    def warmed(kelvin, span, least=AIR):
        time = np.linspace(0, span, 60)
        with_log(tmp_path, arm, time, 20.0, j2=least + kelvin * time / span, at=(0.0, span))

    warmed(2.9, 590)
    warmed(3.1, 600)
    warmed(2.9, 590, AIR + 4)  # what rises count from says nothing of how fast they come
    with pytest.raises(InputError, match=r"a rise of 3.1 K within 590 s: no arm warms so fast; are the times minutes"):
        warmed(3.1, 590)


def test_a_log_of_more_than_thirty_days_is_asked_whether_it_counts_milliseconds(tmp_path, arm):
    """All poses stood in its first seconds, cold, and the fit was accepted."""
    time = np.linspace(0, 6 * HOUR, 361)
    with pytest.raises(InputError, match="the log takes 250 days, 30 at most: are its times milliseconds"):
        with_log(tmp_path, arm, 1000 * time, 20.0, j2=AIR + 11 * warming(time), at=(180.0, 6 * HOUR))


def test_times_since_2000_outside_a_log_are_said_to_the_second(tmp_path, arm):
    with pytest.raises(InputError, match=r"848487600 is outside the log .*\(848473200 to 848487000 s\)"):
        with_log(tmp_path, arm, np.linspace(848473200, 848487000, 200), j2=AIR, at=(848473300, 848487600))


def test_a_warm_up_at_which_the_log_says_the_arm_is_cold_is_refused(tmp_path, arm):
    """With its times in minutes all of it stood in the first six minutes of the log, and the fit was accepted."""
    log, heat = course(tmp_path, arm)
    seconds = np.linspace(180, 4 * HOUR, 60)
    warm, _ = with_temperatures(poses(arm, seconds), log, heat, "start")
    cold, _ = with_temperatures(poses(arm, seconds / 60), log, heat, "start")
    check_warms([], log)
    check_warms([cold, warm], log)
    with pytest.raises(InputError, match=r"poses.csv: column time_s: by the log .* less than 0.5 K .* minutes\?"):
        check_warms([cold], log)
    log, heat = log_of(tmp_path, arm, [0.0, 2 * HOUR, 4 * HOUR], j2=AIR, link1=AIR)
    standing, _ = with_temperatures(poses(arm, seconds), log, heat, "start")
    with pytest.raises(InputError, match="give poses of a cold arm by --poses"):  # minutes would be outside the log
        check_warms([standing], log)


@pytest.mark.parametrize(("air", "other"), [(True, 0.0), (False, 0.0)])
def test_a_log_begins_cold_within_a_kelvin_and_a_half_of_the_air_or_of_its_own_coldest(tmp_path, arm, air, other):
    time = np.linspace(0, 2 * HOUR, 241)

    def begun(kelvin):
        return with_log(
            tmp_path, arm, time, air=air, j2=AIR + kelvin + warming(time), wrist=AIR + other + warming(time)
        )[1]

    assert not [f for f in begun(1.4) if f.code == "log.warm"]
    for kelvin in (1.6, 2.9) if air is False else (1.6, 2.9, -1.6):
        (finding,) = [f for f in begun(kelvin) if f.code == "log.warm"]
        assert f"j2_degC = {AIR + kelvin:g}" in finding.message
        assert ("the air 20" if air else "wrist_degC = 20") in finding.message
    with pytest.raises(InputError, match=r"line 2: the log does not begin cold \(j2_degC = 23.1"):
        begun(3.1)


def test_how_a_log_begins_is_the_median_of_its_first_half_minute(tmp_path, arm):
    """20, 24 and 24 degC within 30 s, 20 from then on; and a sensor that is silent until it has warmed."""
    time = np.arange(0, 3600.0, 15.0)
    with pytest.raises(InputError, match=r"does not begin cold \(j2_degC = 24, the air 20\)"):
        with_log(tmp_path, arm, time, j2=np.where((time > 0) & (time <= 30), AIR + 4, AIR))
    air = np.where(time > 0, AIR, AIR + 5)
    for silent in (0, 600):
        j2 = np.where(time < silent, np.nan, AIR + 5 * warming(time))
        assert not [f for f in with_log(tmp_path, arm, time, j2=j2, ambient_degC=air)[1] if f.code == "log.warm"]


def test_two_sensors_are_called_swapped_from_twice_their_proportion_and_two_kelvin_on(tmp_path, arm):
    """The file expects 11 K of J2 and 3 K of the wrist."""
    time = np.linspace(0, 4 * HOUR, 241)

    def swapped(j2, wrist, **more):
        columns = {"j2": AIR + j2 * time / time[-1], "wrist": AIR + wrist * time / time[-1]}
        return [f.message for f in with_log(tmp_path, arm, time, **columns | more)[1] if f.code == "log.swapped"]

    (message,) = swapped(3.0, 6.2)
    assert "are j2_degC and wrist_degC swapped? they rise by 2.9 and 5.9 K" in message  # but for their last twentieth
    assert "expects 11 to 3" in message
    assert not swapped(3.0, 5.8)
    assert not swapped(0.9, 2.0)
    assert swapped(0.9, 2.2)
    hours = AIR + 4.2 * time / time[-1]
    (message,) = swapped(2.1, 0.5, ambient_degC=hours)
    assert "are j2_degC and ambient_degC swapped? they change by 2.0 and 4.2 K" in message
    assert not swapped(2.3, 0.5, ambient_degC=hours)
    assert not swapped(1.9, 0.5, ambient_degC=AIR + 3.9 * time / time[-1])
    assert not swapped(
        1.9, 0.5, ambient_degC=hours, part_6=AIR + 1.8 * time / time[-1]
    )  # a hall, in which the arm stands
    assert swapped(1.9, 0.5, ambient_degC=hours, part_6=AIR + 2.5 * time / time[-1])


def test_poses_in_gaps_of_more_than_half_an_hour_are_counted(tmp_path, arm):
    """J2 is silent for 1800 s from 1200 s on, for 1860 s from 6000 s on, and from 10800 s on."""
    time = np.arange(0, 4 * HOUR + 1, 60.0)

    def counted(silent, *at):
        j2 = AIR + warming(time)
        for begin, end in silent:
            j2[(time > begin) & (time < end)] = np.nan
        _, findings = with_log(tmp_path, arm, time, 20.0, j2=j2, wrist=AIR + warming(time), at=at)
        return [f.message.split("around ")[1] for f in findings if f.code == "log.gap"]

    gaps = (1200, 3000), (6000, 7860), (10800, 1e9)
    assert counted(gaps, 2000, 6000, 7860, 12600) == []
    assert counted(gaps, 2000, 7000, 7001) == ["2 poses; its rise is modelled there"]
    assert counted(gaps, 0, 12601) == ["1 poses; its rise is modelled there"]
    assert counted([(-1, 2400)], 601, 2500) == []
    assert counted([(-1, 2400)], 599, 2500) == ["1 poses; its rise is modelled there"]
    assert counted([(0, 2400)], 1200, 2500) == ["1 poses; its rise is modelled there"]  # its first two readings
    assert counted([(10800, 14400)], 12000) == ["1 poses; its rise is modelled there"]  # its last two
    assert counted([(-1, 7200), (7200, 1e9)], 3600, 7200, 8000) == ["1 poses; its rise is modelled there"]


def test_a_sensor_that_goes_on_at_another_level_is_named_with_the_time(tmp_path, arm):
    """J2 by 11 K as the law says; from 7260 s on, or for ten minutes, another number of kelvin more or less."""
    time = np.arange(0, 4 * HOUR + 1, 60.0)

    def told(more, end=1e9, step=1):
        j2 = AIR + 11 * warming(time) + more * ((time >= 7260) & (time < end))
        at = slice(None, None, step)
        _, findings = with_log(tmp_path, arm, time[at], j2=j2[at], wrist=AIR + warming(time[at]), at=(600.0, 1200.0))
        return [f.message.split("log.csv: ")[1] for f in findings if f.code == "log.loose" and f.level == "warning"]

    assert told(0.0) == told(2.8) == []
    (message,) = told(4.0)
    assert message.startswith("j2_degC jumps by +4.1 K at 7260 s, as no part does")  # 0.1 K of it is warmth
    (message,) = told(-15.0, 7860)
    assert message.startswith("j2_degC jumps by +15.1 K at 7860 s")
    assert message.endswith("on one side (2 jumps)")
    assert told(30.0, 7300) == []  # a single reading: it is left out
    assert told(4.0, step=11) == []  # eleven minutes apart
