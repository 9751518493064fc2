"""What a controller's motion does to a listing, against its statements laid out and averaged by plain numpy."""

from dataclasses import replace

import numpy as np
import pytest
from motion_code import leg, spread
from numpy.testing import assert_allclose

from compgen.core.units import MM
from compgen.job.bounds import Bounds
from compgen.pipelines.files.program_course import course_of_text
from compgen.pipelines.files.robot_file import load_cell, load_robot
from compgen.pipelines.findings.motion_findings import motion_of_a_listing
from compgen.program.frames import default_frames
from compgen.robot.motion import ControllerMotion
from compgen.verification.course_motion import course_motion

ROBOT = load_robot("m710ic50")
PERIOD = 0.008
CORNERS = [(1300.0, 0.0, 0.0), (1300.0, 300.0, 0.0), (1500.0, 300.0, 0.0), (1500.0, 0.0, 100.0)]  # mm


def listing(words, places=CORNERS, speed=200):
    """A program of lines, by the format alone: a joint motion to the first place, lines to the others."""
    head = '/PROG  BENDS\n/ATTR\nCOMMENT = "";\nDEFAULT_GROUP = 1,*,*,*,*;\n/MN\n'
    lines = ["   1:J P[1] 10% FINE    ;"]
    lines += [f"{n:4d}:L P[{n}] {speed}mm/sec {word}    ;" for n, word in enumerate(words, 2)]
    body = [
        f"P[{n}]{{\n   GP1:\n\tUF : 0, UT : 0,\t\tCONFIG : 'N U T, 0, 0, 0',\n"
        f"\tX = {x:9.3f}  mm,\tY = {y:9.3f}  mm,\tZ = {z:9.3f}  mm,\n"
        "\tW =   180.000 deg,\tP =     0.000 deg,\tR =     0.000 deg\n};"
        for n, (x, y, z) in enumerate(places, 1)
    ]
    return (head + "\n".join(lines) + "\n/POS\n" + "\n".join(body) + "\n/END\n").encode()


def farthest(places, waits, means, speed=200.0, period=PERIOD):
    """Largest distance [mm] of the averaged motion from the polyline: statements of whole periods, 1 ms apart."""
    places = np.array(places)
    length = np.linalg.norm(np.diff(places, axis=0), axis=1)
    lasts = np.ceil(length / speed / period - 1e-9) * period
    arrive = np.concatenate([[0.0], np.cumsum(lasts + np.append(waits, 0.0))])
    leave = arrive.copy()
    arrive[1:-1] -= waits
    step = 1e-3
    time = np.arange(-1.0, arrive[-1] + 1.0, step)
    at = np.column_stack([arrive, leave]).ravel()
    x = np.column_stack([np.interp(time, at, np.repeat(column, 2)) for column in places.T])
    for mean in means:
        count = round(mean / step)
        x = np.column_stack(
            [
                np.convolve(np.pad(c, (count, 0), "edge"), np.ones(count) / count, "full")[count : count + len(c)]
                for c in x.T
            ]
        )
    away = np.full(len(x), np.inf)
    for a, b in zip(places[:-1], places[1:], strict=True):
        t = np.clip((x - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        away = np.minimum(away, np.linalg.norm(x - a - t[:, None] * (b - a), axis=1))
    return float(away[len(away) // 20 : -len(away) // 20].max())


def effect_of(text, motion=None):
    robot = replace(ROBOT, motion=motion)
    return course_motion(course_of_text(text, robot, default_frames()), robot)


@pytest.mark.parametrize("means", [(0.176, 0.168), (0.32, 0.32), (0.104,)])
@pytest.mark.parametrize(("word", "waiting"), [("CNT100", 0.0), ("CNT50", 1 - np.sqrt(0.5))])
def test_corners_are_cut_as_plain_numpy_says(means, word, waiting):
    effect = effect_of(listing([word, word, "FINE"]), ControllerMotion(moving_averages=means))
    wait = PERIOD * np.floor((round(sum(means) / PERIOD) - 1) * waiting)
    expected = farthest(CORNERS, np.full(2, wait), means)
    assert effect.largest / MM == pytest.approx(expected, rel=0.03)
    assert effect.near in ("P[2]", "P[3]")
    assert effect.speed == pytest.approx(0.2)


@pytest.mark.parametrize(("word", "waiting"), [("CNT100", 0.0), ("CNT50", 1 - np.sqrt(0.5))])
def test_each_line_has_means_by_how_far_the_arm_is_spread_on_it(word, waiting):
    """Added up leg by leg; behind a CNT the line before tells the wait. One pair for all is far off."""
    places, means, reach, at = CORNERS[::-1], np.array([0.2, 0.16]), 0.3, 2.5
    longer = 1 + reach * (np.maximum(spread(places)[:-1], spread(places)[1:]) - at)
    lines = np.diff(places, axis=0)
    lasts = PERIOD * np.ceil(np.linalg.norm(lines, axis=1) / 200 / PERIOD - 1e-9)
    waits = PERIOD * np.floor((longer[:-1] * means.sum() / PERIOD - 1) * waiting)
    begins = np.concatenate([[0.0], np.cumsum(lasts[:-1] + waits)])
    time = np.arange(0.0, begins[-1] + 3.0, 1e-3)
    flown = np.array(places[0]) + sum(
        leg(time - begin, last, *(means * each))[:, None] * line
        for begin, last, each, line in zip(begins, lasts, longer, lines, strict=True)
    )
    shares = [np.clip((flown - a) @ d / (d @ d), 0, 1) for a, d in zip(places[:-1], lines, strict=True)]
    ways = zip(places[:-1], shares, lines, strict=True)
    away = np.min([np.linalg.norm(flown - a - t[:, None] * d, axis=1) for a, t, d in ways], axis=0).max()
    motion = ControllerMotion(moving_averages=tuple(means.tolist()), reach=reach, reach_at=at)
    text = listing([word, word, "FINE"], places)
    assert effect_of(text, motion).largest / MM == pytest.approx(away, rel=0.03)
    assert abs(effect_of(text, replace(motion, reach=0.0)).largest / MM / away - 1) > 0.05
    assert not replace(motion, enabled=True).may_predistort


@pytest.mark.parametrize("seconds", [0.08, 0.4, 3600.0])
def test_a_corner_at_which_the_program_waits_is_cut_by_what_the_wait_leaves(seconds):
    """The robot stands there however its line ends: behind an hour it was led as far off as without."""
    line = b"   3:L P[3]"
    text = listing(["CNT100", "CNT100", "FINE"]).replace(line, b"    :  WAIT %.2f(sec) ;\n" % seconds + line)
    means, waits = (0.176, 0.168), np.array([min(seconds, 0.4), 0.0])
    effect, only_the_first = effect_of(text, ControllerMotion(moving_averages=means)), CORNERS[:3]
    alone = effect_of(text.replace(b"L P[3] 200mm/sec CNT100", b"L P[3] 200mm/sec FINE"), effect.motion)
    assert effect.largest / MM == pytest.approx(farthest(CORNERS, waits, means), rel=0.03)
    assert alone.largest / MM == pytest.approx(farthest(only_the_first, waits[:1], means), rel=0.03, abs=1e-3)


def test_a_stop_at_each_corner_leaves_nothing():
    assert effect_of(listing(["FINE"] * 3), ControllerMotion(moving_averages=(0.2, 0.1))).largest < 2e-7  # m: settled


def test_what_is_not_known_has_its_spread():
    seen = ROBOT.expected_motion
    effect = effect_of(listing(["CNT100", "CNT100", "FINE"]))
    sizes = [
        effect_of(listing(["CNT100", "CNT100", "FINE"]), m).largest for m in (seen.lowest, seen.expected, seen.highest)
    ]
    assert_allclose([effect.lowest, effect.largest, effect.highest], sizes)
    assert effect.expected is seen
    assert sizes == sorted(sizes)


@pytest.mark.parametrize("sum_of_windows", [3.0, 0.4])  # s: longer than the first line, and shorter
def test_a_run_that_begins_with_a_long_line_has_other_windows(sum_of_windows):
    program, short, long = listing(["CNT100", "CNT100", "FINE"]), (0.1, 0.1), (sum_of_windows / 2,) * 2
    effect = effect_of(program, ControllerMotion(moving_averages=short, after_long=long))
    same = effect_of(program, ControllerMotion(moving_averages=long if sum_of_windows < 1 else short))
    assert (effect.largest, effect.motion) == (same.largest, same.motion)


@pytest.mark.parametrize(("began", "unlogged"), [("long", False), ("short", True), (None, True)])
def test_a_run_that_begins_as_no_logged_one_did_is_told_so(began, unlogged):
    """Its first line lasts 1.5 s, the means 0.2."""
    runs = "" if began is None else f', runs_began="{began}"'
    identified = f'motion.identified={{robot="m710ic50", verdict="foretells"{runs}}}'
    robot = load_cell("m710ic50", ["motion.moving_average_ms=[100, 100]", identified]).robot
    effect = effect_of(listing(["CNT100", "CNT100", "FINE"]), robot.motion)
    assert effect.motion.unlogged is unlogged
    (finding,) = motion_of_a_listing(robot, effect, Bounds())
    assert finding.code == ("motion.runs" if unlogged else "motion.known")
    assert len(finding.message) <= 300
    assert unlogged is ("identify-motion again" in finding.message or "cgen plan-motion-log" in finding.message)


def test_motion_in_the_joints_is_not_looked_at():
    motion = ControllerMotion(space="joint", moving_averages=(0.2, 0.1))
    assert effect_of(listing(["CNT100", "CNT100", "FINE"]), motion) is None


def test_the_clocks_of_a_listing_tell_what_is_written_and_what_stops_cost():
    """A joint motion of 301 ms between two lines of 0.5 s; both runs begin with a long line and settle in 424 ms."""
    text = listing(["CNT50", "FINE", "FINE"], [CORNERS[0], (1300.0, 100.0, 0.0), (1300.0, 200.0, 0.0), CORNERS[1]])
    text = text.replace(b"L P[3] 200mm/sec", b"J P[3] 301msec")
    course = course_of_text(text, ROBOT, default_frames())
    assert_allclose(np.diff(course.cruise), [0.5, 0.301, 0.5], atol=1e-8)
    assert_allclose(np.diff(course.counted_clock()), [0.504, 0.304, 0.504], atol=1e-8)
    assert_allclose(np.diff(course.planned), [0.504, 0.304 + 0.424, 0.504 + 0.424], atol=1e-8)
    assert course.judged.tolist() == [True, False, True]
