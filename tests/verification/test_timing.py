"""The twin's clock: by hand, against the audit's clock that goes line by line, and in whole interpolation periods."""

from dataclasses import replace
from math import ceil

import numpy as np
import pytest
from audit import clock, study
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from compgen.program.program import Program
from compgen.robot.inverse_kinematics import Posture
from compgen.robot.motion import ControllerMotion
from compgen.verification.twin.timing import RAMP_ACCELERATION, RAMP_JERK, ramp_duration, time_program

PER_METRE = 1.2  # rad, of every joint
ATOL_S = 1e-9


def straight(lengths, speeds, stops=()):
    """Lines along x [m], [m/s], with a stop at both ends and at some positions."""
    x = np.concatenate([[0.0], np.cumsum(lengths)])
    N = len(x)
    fine = np.zeros(N, dtype=bool)
    fine[[0, -1, *stops]] = True
    position = np.column_stack([x, np.zeros(N), np.zeros(N)])
    program = Program(
        name="P",
        comment="",
        date="26-01-01",
        remarks=(),
        uframe=0,
        utool=1,
        position=position,
        rotation=np.tile(np.eye(3), (N, 1, 1)),
        posture=Posture(),
        turns=np.zeros((N, 3), dtype=int),
        speed=np.asarray(speeds, dtype=float),
        fine=fine,
    )
    return program, np.outer(x * PER_METRE, np.ones(6))


def clocked(robot, lengths, speeds, stops=()):
    program, theta = straight(lengths, speeds, stops)
    return time_program(robot, program, np.asarray(lengths, dtype=float), theta)


def limits(robot):
    """Acceleration and jerk of a ramp along the lines above."""
    return (RAMP_ACCELERATION * robot.acceleration.min() / PER_METRE, RAMP_JERK * robot.jerk.min() / PER_METRE)


def rounding_up(robot, period=None):
    controller = replace(robot.controller, rounds_up_to_period=True, period=period or robot.controller.period)
    return replace(robot, controller=controller)


def test_a_change_of_speed_on_the_way_takes_what_its_ramp_is_late(robot):
    """From v to w on the line at w: T lasts a mean of (v + w) / 2, late by T (w - v) / 2 w; the same downwards."""
    a, j = limits(robot)
    v, w = 0.05, 0.2
    ends = 0.5 * (ramp_duration(np.array([v, v]), a, j)).sum()
    change = float(ramp_duration(np.array([w - v]), a, j)[0])
    timing = clocked(robot, [0.5, 1.0, 0.5], [v, w, v])
    assert_allclose(timing.time[-1], 0.5 / v + 1 / w + 0.5 / v + ends + 2 * change * (w - v) / (2 * w), atol=1e-6)
    assert change * (w - v) / w > 0.01  # s: not a little


def test_words_that_rise_from_line_to_line_are_one_change(robot):
    """Stairs of 1 mm up to a speed take the time of the whole change."""
    words, at_once = [0.12, 0.14, 0.16, 0.18], clocked(robot, [0.5, 0.504], [0.1, 0.2])
    for lines in (1, 2):  # a stair
        stairs = clocked(robot, [0.5, *np.full(4 * lines, 1e-3 / lines), 0.5], [0.1, *np.repeat(words, lines), 0.2])
        assert_allclose(stairs.time[-1], at_once.time[-1], atol=1e-6)  # no stair is lower than the ramp is there


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_words_are_one_change_on_a_line_shorter_than_the_first_of_them_takes_alone(robot, share):
    """T(m - v) at a mean of (m + v) / 2 is the way that the first takes; a longer line makes it a change of its own."""
    a, j = limits(robot)
    v, m, w = 0.1, 0.15, 0.2

    def duration(change):
        return float(ramp_duration(np.array([change]), a, j)[0])

    length = share * duration(m - v) * (m + v) / 2
    rises = [w - v, w - v] if share < 1 else [m - v, w - m]
    first, second = (rise / duration(rise) for rise in rises)  # mean accelerations
    on_first = (m - v) / first + (length - (m**2 - v**2) / (2 * first)) / m
    on_second = (w - m) / second + (0.5 - (w**2 - m**2) / (2 * second) - duration(w) * w / 2) / w + duration(w)
    timing = clocked(robot, [0.5, length, 0.5], [v, m, w])
    assert_allclose(np.diff(timing.time), [0.5 / v + duration(v) / 2, on_first, on_second], rtol=1e-6)


def test_a_run_too_short_for_its_ramps_reaches_what_they_allow(robot):
    """p T(p) = length, in 2 T(p)."""
    a, j = limits(robot)
    timing = clocked(robot, [0.004, 0.006], [0.2, 0.2])
    p = timing.highest.max()
    T = float(ramp_duration(np.array([p]), a, j)[0])
    assert p < 0.2
    assert_allclose(p * T, 0.01, rtol=1e-6)
    assert_allclose(timing.time[-1], 2 * T, rtol=1e-6)
    assert timing.at_word.sum() == 0


@pytest.mark.parametrize("backwards", [False, True])
def test_a_change_on_the_way_that_is_broken_off_is_of_what_it_comes_to(robot, backwards):
    """From v on the way up to p and down to a stop: T(p - v) at a mean of (p + v) / 2, T(p) at one of p / 2."""
    a, j = limits(robot)
    v, p, word = 0.1, 0.14, 0.2
    at_first, up, down = (float(ramp_duration(np.array([change]), a, j)[0]) for change in (v, p - v, p))
    lengths, words = [0.5, up * (p + v) / 2 + down * p / 2], [v, word]
    timing = clocked(robot, lengths[::-1] if backwards else lengths, words[::-1] if backwards else words)
    assert_allclose(timing.highest[0 if backwards else 1], p, rtol=1e-6)
    assert_allclose(timing.time[-1], 0.5 / v + at_first / 2 + up + down, rtol=1e-6)
    assert_allclose(timing.at_word.sum(), 0.5 - at_first * v / 2, rtol=1e-6)  # of the first line alone


run = st.lists(
    st.tuples(st.floats(5e-4, 0.3), st.sampled_from([0.01, 0.05, 0.0504, 0.15, 0.2])), min_size=1, max_size=6
)


@given(runs=st.lists(run, min_size=1, max_size=3))
def test_the_clock_is_the_audits_that_goes_line_by_line(robot, runs):
    lengths = np.array([length for lines in runs for length, _ in lines])
    speeds = np.array([speed for lines in runs for _, speed in lines])
    stops = np.cumsum([len(lines) for lines in runs])[:-1]
    program, theta = straight(lengths, speeds, stops)
    timing = time_program(rounding_up(robot), program, lengths, theta)
    passed = clock.passages(lengths * 1e3, speeds * 1e3, program.fine, theta)
    assert study.RAMP_ACCELERATION == RAMP_ACCELERATION
    assert_allclose(timing.time, passed.time, atol=1e-6)
    assert_allclose(timing.at_word, passed.steady * 1e-3, atol=1e-6)


@given(
    lengths=st.lists(st.floats(1e-4, 0.02), min_size=1, max_size=40),
    speed=st.sampled_from([0.02, 0.1, 0.2]),
    period=st.sampled_from([0.004, 0.008, 0.012]),
)
def test_rounding_up_counts_every_line_by_whole_periods(robot, lengths, speed, period):
    speeds = np.full(len(lengths), speed)
    as_written = clocked(robot, lengths, speeds)
    timing = clocked(rounding_up(robot, period), lengths, speeds)
    assert_allclose(timing.unrounded, as_written.time, atol=ATOL_S)
    whole = [max(1, ceil(t / period - 1e-6)) * period for t in np.diff(as_written.time).tolist()]
    assert_allclose(np.diff(timing.time), whole, atol=ATOL_S)
    assert_allclose(timing.driven, lengths / np.diff(timing.time), rtol=1e-9)


@pytest.mark.parametrize(("spacing", "lowest", "highest"), [(3.19, 199.0, 200.0), (3.2, 155.0, 163.0)])
def test_3_19_mm_hold_the_feed_on_a_controller_that_rounds_up_and_3_2_do_not(robot, spacing, lowest, highest):
    """200 mm/s at 8 ms: of lines of 3.2 mm the rounding of positions to 1 um makes every other one a period longer."""
    angle = spacing / 650 * np.arange(1200)
    circle = np.round(650 * np.column_stack([np.cos(angle), np.sin(angle)]), 3) * 1e-3
    lengths = np.linalg.norm(np.diff(circle, axis=0), axis=1)
    timing = clocked(rounding_up(robot), lengths, np.full(len(lengths), 0.2))
    middle = slice(100, 1100)
    feed = lengths[middle].sum() / np.diff(timing.time)[middle].sum() * 1e3
    assert lowest < feed < highest
    assert_allclose(timing.unrounded[-1], lengths.sum() / 0.2, rtol=0.02)


@pytest.mark.parametrize(("length", "highest"), [(1.0, 0.2), (0.02, 0.1), (0.01, 0.05)])
def test_smoothing_reaches_the_word_on_a_long_line_and_a_share_of_it_on_a_short_one(robot, length, highest):
    """By means over 200 and 100 ms: a line that is commanded for 100 or 50 ms at 200 mm/s is spread over 200 ms."""
    smoothing = replace(robot, motion=ControllerMotion(moving_averages=(0.2, 0.1)))
    timing = clocked(smoothing, [length, length], [0.2, 0.2], stops=[1])
    assert_allclose(timing.highest, highest, rtol=2e-3)
    assert_allclose(timing.driven, length / np.diff(timing.time), rtol=1e-12)
    assert_allclose(timing.at_word, max(length - 0.3 * 0.2, 0.0), atol=1e-9)  # less what passes while it settles
