"""At which override a log was driven whose lines last whole periods: its times come from the motion code's formula."""

from dataclasses import replace

import numpy as np
import pytest
from motion_code import PERIOD, driven, program

from compgen.pipelines.executed.executed import Situation, judge_log, read_program_text
from compgen.program.frames import default_frames
from compgen.verification.executed.position_log import read_position_log

LINES = {
    "3.2 mm": np.full(300, 3.2),  # two periods at 200 mm/s: what 67 to 99 % drive alike
    "16 mm": np.full(80, 16.0),
    "20.8 mm": np.full(60, 20.8),
    "22 mm": np.full(60, 22.0),
    "any": np.random.default_rng(1).uniform(10, 40, 80),
}


def chords(lengths, radius=200.0):
    """Places (N, 3) [mm] on a circle, chords apart, in the digits of a program."""
    angle = np.concatenate([[0.0], np.cumsum(2 * np.arcsin(lengths / 2 / radius))])
    return np.round(np.column_stack([1100 + radius * np.cos(angle), radius * np.sin(angle), 0 * angle + 100]), 3)


def judged(folder, robot, points, speed, fine, words=None, missing=0.0, **run):
    text = program(points.tolist(), speed, fine)
    time, place = driven(points, speed if words is None else words, fine, **run)
    rows = np.column_stack([time, np.round(place, 3), np.tile([180.0, 0.0, 0.0], (len(place), 1))])
    rows = rows[np.random.default_rng(1).random(len(rows)) >= missing]
    head = "time_s,x_mm,y_mm,z_mm,w_deg,p_deg,r_deg"
    (folder / "log.csv").write_text("\n".join([head, *(",".join(f"{v:.3f}" for v in row) for row in rows), ""]))
    around = Situation(robot, default_frames(), {}, lambda name: None)
    content = read_program_text(str(folder / "RUN.LS"), text)
    return judge_log(content, around.course(text), read_position_log(folder / "log.csv"), around)


def lasts(points, speed, override):
    words = np.linalg.norm(np.diff(points, axis=0), axis=1) / speed if np.isscalar(speed) else speed
    return PERIOD * np.ceil(words / override / PERIOD - 1e-6)


@pytest.fixture
def counting(robot):
    return replace(robot, controller=replace(robot.controller, rounds_up_to_period=True))


@pytest.mark.parametrize("unit", ["mm/sec", "sec"])
@pytest.mark.parametrize("which", LINES)
@pytest.mark.parametrize("percent", [30, 50, 60, 80, 100])
def test_overrides_of_equal_and_other_lines_are_right_or_named_with_those_that_drive_alike(
    tmp_path, counting, which, unit, percent
):
    points = chords(LINES[which])
    words = np.linalg.norm(np.diff(points, axis=0), axis=1) / 200
    speed = 200 if unit == "mm/sec" else np.round(words, 2)
    fine = [True, *[False] * (len(points) - 2), True]
    run = judged(tmp_path, counting, points, speed, fine, override=percent / 100)
    (stretch,) = run.clock.stretches
    took = lasts(points, speed, percent / 100).sum()
    alike = [p for p in range(1, 101) if abs(lasts(points, speed, p / 100).sum() / took - 1) < 1e-3]
    assert stretch.alike == (alike[0], alike[-1])
    plain = [p for p in alike if p % 10 == 0]
    if plain == [percent] or percent == 100:
        assert stretch.override == percent / 100
    assert f"{stretch.override:.0%}".replace("%", "") in {str(p) for p in alike}
    assert run.clock.took == pytest.approx(run.clock.expected, rel=2e-3)
    if len(alike) > 1 and stretch.override != 1:
        (finding,) = [f for f in run.findings if f.code == "executed.override"]
        assert f"({alike[0]} to {alike[-1]} % drive these lines alike)" in finding.message
    assert not {"executed.periods", "executed.override_changed"} & {f.code for f in run.findings}


def test_the_override_that_is_said_is_one_of_those_that_drive_alike(tmp_path, counting):
    """Lines of two periods, and of three, each a period longer than at any override: *69 % (57 to 66 %)* was said."""
    points = chords(LINES["3.2 mm"])
    fine = [True, *[False] * (len(points) - 2), True]
    run = judged(tmp_path, counting, points, 200, fine, lasts(points, 200, 1.0) + PERIOD)
    (stretch,) = run.clock.stretches
    low, high = stretch.alike
    assert low < high
    assert low <= 100 * stretch.override <= high
    (finding,) = [f for f in run.findings if f.code == "executed.override"]
    assert f"at {100 * stretch.override:.0f} % ({low} to {high} % drive these lines alike)" in finding.message


def test_a_change_of_override_is_seen_where_each_half_rounds_otherwise(tmp_path, counting):
    """A hundred lines of 13.75 periods at 60 % (23 periods) and as many at 100 % (14), without a stop between."""
    points = chords(np.full(200, 22.0))
    words = np.full(200, 0.11) / np.repeat([0.6, 1.0], 100)
    fine = [True, *[False] * 199, True]
    run = judged(tmp_path, counting, points, 200, fine, words)
    assert [s.override for s in run.clock.stretches] == [0.6, 1.0]
    assert run.clock.stretches[1].begin == pytest.approx(1.0 + 100 * 23 * PERIOD, abs=0.3)
    assert run.clock.took == pytest.approx(run.clock.expected, rel=2e-3)


@pytest.mark.parametrize("missing", [0.0, 0.2])
def test_corners_before_short_lines_are_no_change_of_override(tmp_path, counting, missing):
    """Sides of a square, whose corners are cut, and then a circle that 88 to 100 % drive alike."""
    strokes = [(60.0 * (k % 2), 0.0, 0.0) for k in range(7)]
    square = [(80.0 * x, 80.0 * y, 0.0) for x, y in [(1, 0), (1, 1), (0, 1), (0, 0)] * 4]
    turn = np.linspace(0, 4 * np.pi, 181)[1:]
    circle = np.column_stack([50 * np.sin(turn), 50 - 50 * np.cos(turn), 0 * turn])
    points = np.round(np.vstack([strokes, square, circle]) + np.array([1200.0, 0.0, 100.0]), 3)
    fine = [k < 7 or k in (22, len(points) - 1) for k in range(len(points))]
    run = judged(tmp_path, counting, points, 100, fine, missing=missing, means=(0.176, 0.168))
    assert [s.override for s in run.clock.stretches] == [1.0]
    assert "executed.override_changed" not in {f.code for f in run.findings}


def test_a_run_that_is_all_ramp_tells_no_override(tmp_path, counting):
    """Strokes of 20 mm take 0.104 s at 200 mm/s, and the means 0.208: the written speed is never reached."""
    points = np.array([(1300.0 - 20 * (k % 2), 0.0, 100.0) for k in range(13)])
    run = judged(tmp_path, counting, points, 200, [True] * 13)
    assert not run.clock.stretches
    assert "executed.no_clock" in {f.code for f in run.findings}


@pytest.mark.parametrize(
    ("length", "is_told"), [(60.0, False), (90.0, False), (120.0, True), (150.0, True), (200.0, True)]
)
def test_lines_shorter_than_the_smoothing_tell_no_override(tmp_path, robot, length, is_told):
    """Moving means of 0.344 s: of lines of 0.3 and 0.45 s no quarter is steady (86 to 99 % were said of 100)."""
    points = np.array([(1300.0 - length * (k % 2), 0.0, 100.0) for k in range(9)])
    run = judged(tmp_path, robot, points, 200, [True] * 9, means=(0.176, 0.168))
    assert [s.override for s in run.clock.stretches] == ([1.0] if is_told else [])
