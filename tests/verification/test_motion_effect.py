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
    assert seen.highest / seen.largest == pytest.approx(WINDOWS[2] / WINDOWS[1], rel=0.02)  # their squares: 2.56


def test_of_a_known_motion_there_is_one_size(job):
    known = effect(job, ControllerMotion(moving_averages=(0.2, 0.2)))
    assert known.known
    assert known.lowest == known.largest == known.highest == pytest.approx(beside_a_corner(0.2), abs=DIGIT)


def test_of_fewer_positions_each_segment_has_the_farthest_of_those_that_it_stands_for(job):
    seen = replace(effect(job), off=np.array([1.0, 5.0, 2.0, 3.0]))
    assert seen.at(np.array([0, 2, 3, 4])).off.tolist() == [5.0, 2.0, 3.0]
