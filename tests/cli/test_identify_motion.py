"""``cgen identify-motion`` as a user meets it: a controller written into a robot file, and logs that tell none."""

import json
import tomllib

import executed_logs as logs
import numpy as np
import pytest
from command_line import refused, run
from shipped import ROOT

from compgen.identification.motion.identify import identify as motion_of_log
from compgen.identification.motion.timed_windows import timed_windows
from compgen.pipelines.executed.executed import Situation, judge_log, read_program_text
from compgen.pipelines.files.program_course import course_of_text
from compgen.pipelines.files.robot_file import load_robot
from compgen.program.frames import default_frames
from compgen.robot.motion import MotionVerdict
from compgen.verification.executed.position_log import read_position_log

ROBOT = (ROOT / "robots" / "m710ic50.toml").read_text()


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "PART.LS").write_bytes(logs.part())
    (tmp_path / "mine.toml").write_text(ROBOT)
    return tmp_path


def write(folder, robot, means=(), lags=(), text=None, hold=(), **logger):
    course = course_of_text(text or logs.part(), robot, default_frames())
    run_of = logs.Run(ramp=0.0, means=means, lags=lags, hold=hold)
    time, places, turn, _ = logs.log_rows(course, run_of, logs.Logger(**{"noise": 2e-6, **logger}))
    (folder / "log.csv").write_text(logs.csv(time, places, turn))


def identify(folder, *more):
    return run("identify-motion", "PART.LS", "--log", "log.csv", "--robot", "mine.toml", *more, cwd=folder)


def test_two_moving_means_are_written_into_a_copy_that_keeps_all_else(folder, robot):
    write(folder, robot, means=(0.2, 0.1), offset=50.0, rate=2e-4, jitter=1e-3)
    result = identify(folder, "-o", "new.toml")
    assert result.returncode == 0, result.stderr
    written = (folder / "new.toml").read_text()
    data = tomllib.loads(written)
    np.testing.assert_allclose(data["motion"]["moving_average_ms"], [200, 100], atol=1.5)
    assert data["motion"]["space"] == "cartesian"
    assert data["motion"]["enabled"] is False
    assert data["motion"]["identified"]["verdict"] == "may be commanded against"
    assert data["motion"]["identified"]["program"] == "PART"
    assert written.startswith(ROBOT.rstrip("\n"))
    motion = load_robot(str(folder / "new.toml")).motion
    assert motion is not None
    assert motion.evidence is not None
    assert motion.evidence.accepted
    report = json.loads((folder / "new.json").read_text())
    for (low, high), true in zip(report["motion"]["interval_ms"], (200, 100), strict=True):
        assert low - 1 < true < high + 1
    assert "cgenFigures.draw(" in (folder / "new.html").read_text()


def test_a_clock_that_ticks_more_coarsely_than_the_rows_shows_speeds_without_gaps(folder, robot):
    """Rows every 8 ms with times to 10 ms: every fifth row has the time of the one before."""
    write(folder, robot, means=(0.2, 0.1))
    head, *rows = (folder / "log.csv").read_text().splitlines()
    times = [float(row.partition(",")[0]) for row in rows]
    coarse = [f"{np.floor(t * 100) / 100:.2f},{row.partition(',')[2]}" for t, row in zip(times, rows, strict=True)]
    assert len(set(coarse)) > len({row.partition(",")[0] for row in coarse})
    (folder / "log.csv").write_text("\n".join([head, *coarse, ""]))
    assert identify(folder, "-o", "new.toml").returncode == 0
    report = json.loads((folder / "new.json").read_text())
    assert all(0 <= v < 1e3 for place in report["speeds"] for v in place["logged_mm_s"])


def test_first_order_lags_are_told_from_means(folder, robot):
    write(folder, robot, lags=(0.05, 0.02))
    assert identify(folder, "-o", "new.toml").returncode == 0
    motion = tomllib.loads((folder / "new.toml").read_text())["motion"]
    assert motion["moving_average_ms"] == []
    np.testing.assert_allclose(motion["first_order_ms"], [50, 20], atol=1)


def test_a_log_of_the_path_itself_shows_no_smoothing_and_nothing_is_written(folder, robot):
    write(folder, robot)
    refused(identify(folder, "-o", "new.toml"), 1, "no smoothing seen", "new.toml not written")
    assert not (folder / "new.toml").exists()
    assert json.loads((folder / "new.json").read_text())["verdict"] == "rejected"


def test_one_constant_curvature_tells_only_the_sum_of_squares(folder, robot):
    """Without its ramps: v^2 sigma^2 / (2 R) is all that a circle at one speed shows."""
    circle = logs.circle()
    write(folder, robot, means=(0.2, 0.1), text=circle, start=0.3, end=0.7)
    (folder / "PART.LS").write_bytes(circle)
    refused(identify(folder, "-o", "new.toml"), 2, "log.csv", "a part of the program's path only")
    around = Situation(robot, default_frames(), {}, lambda name: None)
    run = judge_log(
        read_program_text(str(folder / "PART.LS"), circle),
        around.course(circle),
        read_position_log(folder / "log.csv"),
        around,
    )
    known = motion_of_log(timed_windows(run, robot).windows, robot, run.course.tool, run.deviation.noise)
    assert known.verdict is MotionVerdict.FORETELLS
    low, high = known.sigma * 1e3
    assert low - 0.5 < np.sqrt((200**2 + 100**2) / 12) < high + 0.5


def test_ramps_between_stops_tell_the_times_that_a_circle_does_not(folder, robot):
    circle = logs.circle()
    (folder / "PART.LS").write_bytes(circle)
    write(folder, robot, means=(0.2, 0.1), text=circle)
    assert identify(folder, "-o", "new.toml").returncode == 0
    motion = tomllib.loads((folder / "new.toml").read_text())["motion"]
    np.testing.assert_allclose(motion["moving_average_ms"], [200, 100], atol=2)


def test_lines_that_last_as_written_are_no_whole_periods_in_the_copy(folder, robot):
    """Chords of 5.24 mm take 52.4 ms at 100 mm/s, 56 where they are rounded up, as the robot file has it."""
    circle = logs.circle()
    (folder / "PART.LS").write_bytes(circle)
    write(folder, robot, means=(0.2, 0.1), text=circle)
    assert "rounds_up_to_period = true" in ROBOT
    result = identify(folder, "-o", "new.toml")
    assert result.returncode == 0, result.stderr
    assert tomllib.loads((folder / "new.toml").read_text())["controller"]["rounds_up_to_period"] is False
    assert "does not round the time of each line up" in result.stdout
    assert "set controller.rounds_up_to_period = false in the robot file" in result.stdout
    again = run("identify-motion", "PART.LS", "--log", "log.csv", "--robot", "new.toml", "-o", "third.toml", cwd=folder)
    assert "rounds_up_to_period" not in again.stdout


def test_a_run_that_was_held_is_named_as_what_is_not_fitted(folder, robot):
    """Of a circle on which the operator held the robot *no bend* was said, or that its override was not left alone."""
    write(folder, robot, means=(0.2, 0.1), hold=((6.0, 2.0),))  # on the sweeps: the circle is fitted
    result = identify(folder, "-o", "new.toml")
    assert result.returncode == 0, result.stderr
    assert "note: the robot was held near " in result.stdout
    assert "from the stop before it to the next one nothing is fitted; log a run that nobody holds" in result.stdout
    write(folder, robot, means=(0.2, 0.1))
    assert "held" not in identify(folder, "-o", "other.toml").stdout
    circle = logs.circle()
    (folder / "PART.LS").write_bytes(circle)
    write(folder, robot, means=(0.2, 0.1), text=circle, hold=((2.0, 2.0),))
    refused(identify(folder, "-o", "third.toml"), 2, "at one override and without being held; log a longer run that")


def test_a_corner_that_all_but_turns_back_is_passed_where_the_program_leads(folder, robot):
    """Rows beside its tip were laid on the wrong side of it: *near P[20] the robot passed 957 um from ...*, refused."""
    # two runs of a program as users have them, and one whose second line all but turns back (161 deg)
    first = [
        (1591, -164, 123),
        (1673, -331, 215),
        (1692, -91, 380),
        (1697, -237, 335),
        (1632, -38, 251),
        (1807, 124, 302),
    ]
    second = [(1743, 335, 506), (1743, 193, 547), (1717, 15, 403), (1647, 432, 353), (1587, 602, 141), (1658, 490, 230)]
    points = np.array([*first, *second]) * 1e-3 - [0.4, 0.1, 0.1]
    fine = np.isin(np.arange(len(points)), [0, 5, 8, 9, 11])
    text = logs.listing(points, fine, speed=0.25)
    (folder / "PART.LS").write_bytes(text)
    write(folder, robot, means=(0.176, 0.168), text=text)
    result = identify(folder, "-o", "new.toml")
    assert result.returncode == 0, result.stderr
    report = json.loads((folder / "new.json").read_text())
    assert report["held_out"]["max_um"] < 10  # of 2 um of noise


def test_a_controller_of_another_kind_is_not_commanded_against_and_foretells(folder, robot):
    write(folder, robot, means=(0.1,), lags=(0.03,))
    result = identify(folder, "-o", "new.toml")
    assert result.returncode == 0
    assert "it is used to predict, not to correct" in result.stdout
    motion = tomllib.loads((folder / "new.toml").read_text())["motion"]
    assert motion["identified"]["verdict"] == "foretells"
    held = json.loads((folder / "new.json").read_text())["held_out"]
    assert held["p99_um"] <= motion["identified"]["held_out_um"]
    assert motion["identified"]["held_out_rms_um"] == pytest.approx(held["rms_um"], abs=1e-3)
    assert held["rms_um"] < 0.2 * held["plain_um"]


def test_a_robot_file_that_is_there_is_not_replaced(folder, robot):
    write(folder, robot, means=(0.2, 0.1))
    refused(identify(folder, "-o", "mine.toml"), 2, "mine.toml", "identify-motion")
    assert (folder / "mine.toml").read_text() == ROBOT
    refused(run("identify-motion", "PART.LS", cwd=folder), 2, "--log")


def test_the_table_that_a_file_has_is_updated_in_place(folder, robot):
    old = '\n[motion] # ours\nenabled = false\nspace = "joint" # guessed\nmoving_average_ms = [300]\nlag_ms = 12\n'
    (folder / "mine.toml").write_text(ROBOT + old)
    write(folder, robot, means=(0.15,))
    assert identify(folder, "-o", "new.toml").returncode == 0
    text = (folder / "new.toml").read_text()
    motion = tomllib.loads(text)["motion"]
    assert "[motion] # ours" in text
    assert motion["lag_ms"] == 12
    np.testing.assert_allclose(motion["moving_average_ms"], [150], atol=1)
