"""Commanding a path off its targets against the controller's smoothing: what is inverted, what is not, and how well."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import path_file, quiet

from compgen.compensation.predistortion import Commanded, band_edges, inverted, passed, predistortion, variance
from compgen.core.pose import IDENTITY
from compgen.core.units import UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.robot.motion import ControllerMotion, MotionEvidence, MotionVerdict
from compgen.verification.twin.controller.smoothing import gain

ACCEPTED = MotionEvidence(
    robot="m710ic50", log_sha256="", program="", override=1.0, held_out=None, verdict=MotionVerdict.COMMANDABLE
)
TWO_MEANS = ControllerMotion(moving_averages=(0.2, 0.1), enabled=True, evidence=ACCEPTED)
LAG = ControllerMotion(first_orders=(0.05,), enabled=True, evidence=ACCEPTED)
MODELS = pytest.mark.parametrize("motion", [TWO_MEANS, LAG], ids=["two means", "first order"])
IN_FILE = [
    "robot.motion.moving_average_ms=[200, 100]",
    'robot.motion.identified={robot="m710ic50", verdict="accepted"}',
]
ENABLED = [*IN_FILE, "robot.motion.enabled=true"]


@MODELS
def test_planner_and_twin_have_one_gain_each_of_their_own(motion):
    w = np.linspace(0.1, 60, 50)
    assert_allclose(np.abs(passed(motion, w)), gain(motion, w, 1e-5), atol=1e-3)


@MODELS
def test_curvature_is_inverted_where_the_smoothing_passes_and_nowhere_else(motion):
    full, last = band_edges(motion)
    assert_allclose(passed(motion, np.array([full, last])), [0.97, 0.9], atol=1e-6)
    w = np.linspace(0.05, full, 30)
    led = w**2 * variance(motion) / 2 * inverted(motion, w)  # what is commanded against a wave of amplitude one
    assert_allclose((1 + led) * passed(motion, w), 1.0, atol=1e-6)
    assert np.all(inverted(motion, np.linspace(last, 100, 500)) < 1e-12)


def test_the_plain_iteration_diverges_where_this_commands_nothing():
    """c <- c + (target - S c): what is left of a wave is multiplied by 1 - H each time."""
    w = np.linspace(0.1, 120, 4000)
    factor = np.abs(1 - passed(TWO_MEANS, w))
    assert factor.max() > 1.05
    assert np.all(inverted(TWO_MEANS, w[factor >= 0.1 + 1e-3]) < 1e-9)
    left = np.abs(1 - passed(TWO_MEANS, w) * (1 + w**2 * variance(TWO_MEANS) / 2 * inverted(TWO_MEANS, w)))
    assert np.all(left <= np.abs(1 - passed(TWO_MEANS, w)) + 1e-9)  # no wave is made worse


def commanded(position, speed=0.2, stops=()):
    N = len(position)
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(position, axis=0), axis=1))])
    stop = np.isin(np.arange(N), [0, N - 1, *stops])
    return Commanded(
        position=position,
        theta=np.linspace(0, 1, N)[:, None] * np.ones(6),
        arc=arc,
        speed=np.full(N - 1, speed),
        stop=stop,
    )


def on_circle(radius, N=3000):
    angle = np.linspace(0, 2 * np.pi, N)
    return radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(N)])


@MODELS
@pytest.mark.parametrize("speed", [0.2, 0.1])
def test_a_circle_is_commanded_larger_by_what_it_is_drawn_smaller(robot, motion, speed):
    position, w = on_circle(0.65), speed / 0.65
    shift = predistortion(replace(robot, motion=motion), IDENTITY, commanded(position, speed), 3e-3)
    outward = (shift * position).sum(axis=1) / 0.65
    expected = 0.65 * (1 / passed(motion, np.array([w]))[0] - 1)
    assert_allclose(outward[1000:2000], expected, rtol=2e-3)
    assert_allclose(shift[[0, -1]], 0.0, atol=1e-12)


def test_lines_and_what_is_not_asked_for_are_commanded_as_they_are(robot):
    line = np.linspace([1.0, 0, 0], [1.0, 0.5, 0.1], 200)
    corner = np.concatenate([line, line[-1] + np.linspace([0, 0, 0.001], [0, 0, 0.3], 200)])
    for position in (line, corner):
        assert not predistortion(replace(robot, motion=TWO_MEANS), IDENTITY, commanded(position), 3e-3).any()
    for motion in (
        None,
        replace(TWO_MEANS, enabled=False),
        replace(TWO_MEANS, evidence=None),
        replace(TWO_MEANS, evidence=replace(ACCEPTED, verdict=MotionVerdict.REJECTED)),
        replace(TWO_MEANS, evidence=replace(ACCEPTED, verdict=MotionVerdict.FORETELLS)),
        ControllerMotion(lag=0.05, enabled=True, evidence=ACCEPTED),
    ):
        assert not predistortion(replace(robot, motion=motion), IDENTITY, commanded(on_circle(0.65)), 3e-3).any()


def test_a_small_circle_that_the_smoothing_does_not_pass_is_left_alone(robot):
    """R 20 mm at 200 mm/s turns by 10 rad/s: two means pass 0.8 of that."""
    position = np.tile(on_circle(0.02, 200)[:-1], (30, 1))
    shift = predistortion(replace(robot, motion=TWO_MEANS), IDENTITY, commanded(position), 3e-3)
    assert np.abs(shift[2000:4000]).max() < 0.02 * 0.02 * 0.2  # a fiftieth of what it is drawn smaller by


def test_nothing_goes_further_than_the_clamp(robot):
    shift = predistortion(replace(robot, motion=TWO_MEANS), IDENTITY, commanded(on_circle(0.65)), 50 * UM)
    assert np.linalg.norm(shift, axis=1).max() == pytest.approx(50 * UM)


@pytest.mark.parametrize(("space", "led", "left_um"), [("cartesian", 127, 3.0), ("joint", 240, 5.0)])
def test_the_study_s_circle_at_200_mm_s_is_drawn_within_3_um(space, led, left_um):
    """From stop to stop: 128 um (in joints 248) come down to 3 (5), at the written speed."""
    # lines of one period: of two, 1.0 um of the 3 were sag, to which the ends of the run add up to 3.02
    sets = [f'robot.motion.space="{space}"', "process.chord_um=1"]
    only_known = load_job(path_file("circle_1300"), None, [*IN_FILE, *sets])
    job = load_job(path_file("circle_1300"), None, [*ENABLED, *sets])
    _, left = generate.generate(only_known, quiet)
    _, done = generate.generate(job, quiet)
    assert left.deviation.on_part["total"].max > led * UM
    assert done.deviation.on_part["total"].max < left_um * UM
    assert done.written.at_feed == pytest.approx(left.written.at_feed, abs=2e-3)
    assert done.trajectory.utilisation.max() <= 1
