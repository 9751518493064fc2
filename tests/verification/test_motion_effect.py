"""How far the tool is expected to be led off a program whose controller's motion is not known."""

from dataclasses import replace

import numpy as np
import pytest

from compgen.core.units import MM
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.program.program import Program
from compgen.robot.inverse_kinematics import Posture
from compgen.robot.motion import ControllerMotion, ExpectedMotion
from compgen.verification.motion_effect import motion_effect
from compgen.verification.twin import prepare

SPEED = 0.2  # m/s
WINDOWS = 0.104, 0.2, 0.32  # [s] of both means: lowest, expected, highest
DIGIT = 0.02 * MM  # what samples that are a period apart miss of a corner


def corner():
    """A right angle between two lines of 200 mm, passed without a stop."""
    at = np.array([[1.1, 0, 0.2], [1.3, 0, 0.2], [1.3, 0.2, 0.2]])
    return Program(
        name="CORNER",
        comment="",
        date="26-01-01",
        remarks=(),
        uframe=0,
        utool=1,
        position=at,
        rotation=np.tile(np.diag([1.0, -1.0, -1.0]), (3, 1, 1)),
        posture=Posture(),
        turns=np.zeros((3, 3), dtype=int),
        speed=np.full(2, SPEED),
        fine=np.array([True, False, True]),
    )


def effect(job, motion=None):
    means = [ControllerMotion(moving_averages=(window, window)) for window in WINDOWS]
    seen = ExpectedMotion(lowest=means[0], expected=means[1], highest=means[2], evidence="simulated", source="a test")
    twin = twin_of(job)
    twin = replace(twin, robot=replace(twin.robot, motion=motion, expected_motion=seen))
    prepared = prepare(twin, corner(), job.history.before, job.history.air)
    return motion_effect(prepared, np.zeros(2, dtype=bool))


def test_samples_touch_on_both_ends_of_lines_that_do(job):
    """The corner ends the first line and begins the second."""
    prepared = prepare(twin_of(job), corner(), job.history.before, job.history.air)
    before, along = prepared.samples_per_segment[0], np.arange(prepared.sample_count)
    for touching, expected in (
        ((True, False), along <= before), ((False, True), along >= before), ((False, False), along >= 0),
        ((True, True), along >= 0),
    ):  # fmt: skip
        assert np.array_equal(prepared.touching_samples(np.array(touching)), expected)


def beside_a_corner(window):
    """How far two means of a window lead the tool off its lines, by a convolution on a grid of 0.1 ms [m].

    The commanded way is s(t); the place beside which the tool is judged is that of the smoothed way.
    """
    step = 1e-4
    way = SPEED * step * (np.arange(40001) - 20000.0)
    command = np.column_stack([np.minimum(way, 0), np.maximum(way, 0)])
    one = np.ones(round(window / step)) * step / window
    weights = np.convolve(one, one)
    x, y = (np.convolve(column, weights, mode="valid") for column in command.T)
    s = np.convolve(way, weights, mode="valid")
    return np.where(s < 0, np.abs(y), np.abs(x)).max()


def test_a_corner_is_flown_with_the_lowest_and_the_highest_too_and_goes_with_the_windows_not_their_squares(job):
    seen = effect(job)
    assert not seen.known
    assert (seen.lowest, seen.largest, seen.highest) == pytest.approx([*map(beside_a_corner, WINDOWS)], abs=DIGIT)
    assert seen.off == pytest.approx([beside_a_corner(WINDOWS[1])] * 2, abs=DIGIT)  # the end of one line, too
    assert seen.highest / seen.largest == pytest.approx(WINDOWS[2] / WINDOWS[1], rel=0.02)  # their squares: 2.56


def two_runs(first, second):
    """From a stop a line of a length [mm] and a right angle, twice; a stop between."""
    x, y = first * MM + 0.9, second * MM + 0.1
    at = np.array([[0.9, -0.1, 0.2], [x, -0.1, 0.2], [x, 0.1, 0.2], [x, y, 0.2], [x + 0.2, y, 0.2]])
    return replace(
        corner(),
        position=at,
        rotation=np.tile(np.diag([1.0, -1.0, -1.0]), (5, 1, 1)),
        turns=np.zeros((5, 3), dtype=int),
        speed=np.full(4, SPEED),
        fine=np.array([True, False, True, False, True]),
        via=np.zeros(5, dtype=bool),
    )


LONG = 0.3  # [s] each of two windows after a first statement of 0.6 s, 120 mm


@pytest.mark.parametrize(("first", "second", "windows"), [
    (118, 100, (0.2, 0.2)), (120, 100, (LONG, 0.2)), (100, 121, (0.2, LONG)), (150, 150, (LONG, LONG)),
])  # fmt: skip
def test_each_run_has_the_windows_that_go_with_how_long_its_first_statement_lasts(job, first, second, windows):
    motion = ControllerMotion(moving_averages=(0.2, 0.2), after_long=(LONG, LONG))
    twin = twin_of(job)
    seen = ExpectedMotion(lowest=motion, expected=motion, highest=motion, evidence="simulated", source="a test")
    twin = replace(twin, robot=replace(twin.robot, motion=None, expected_motion=seen))
    prepared = prepare(twin, two_runs(first, second), job.history.before, job.history.air)
    effect = motion_effect(prepared, np.zeros(4, dtype=bool))
    corners = effect.off.reshape(2, 2).max(axis=1)
    assert corners == pytest.approx([beside_a_corner(window) for window in windows], abs=2 * DIGIT)
    assert effect.largest == pytest.approx(corners.max())
    assert effect.motion.moving_averages == (max(windows), max(windows))
    assert effect.motion.after_long == ()


@pytest.mark.parametrize(("first", "second", "windows"), [
    (118, 100, (0.2, 0.2)), (120, 100, (LONG, 0.2)), (100, 121, (0.2, LONG)), (150, 150, (LONG, LONG)),
])  # fmt: skip
def test_a_known_motion_has_its_windows_by_run_where_the_tool_goes_and_how_long_it_takes(job, first, second, windows):
    motion = ControllerMotion(moving_averages=(0.2, 0.2), after_long=(LONG, LONG))
    twin = twin_of(job)
    twin = replace(twin, robot=replace(twin.robot, motion=motion))
    prepared = prepare(twin, two_runs(first, second), job.history.before, job.history.air)
    effect = motion_effect(prepared, np.zeros(4, dtype=bool))
    assert effect.off.reshape(2, 2).max(axis=1) == pytest.approx([*map(beside_a_corner, windows)], abs=2 * DIGIT)
    lasts = 0.008 * np.ceil(np.array([[first, 200], [second, 200]]) / 200 / 0.008 - 1e-6)
    ends = np.cumsum(lasts.sum(axis=1) + 2 * np.array(windows))
    assert prepared.timing.time[[2, 4]] == pytest.approx(ends, abs=1e-6)  # as long as its statements and both means
    assert prepared.timing.rounded_up == pytest.approx(prepared.timing.time[-1])


def test_of_a_known_motion_there_is_one_size(job):
    known = effect(job, ControllerMotion(moving_averages=(0.2, 0.2)))
    assert known.known
    assert known.lowest == known.largest == known.highest == pytest.approx(beside_a_corner(0.2), abs=DIGIT)
