"""The correction: what it reaches, which limits it keeps, and the general solver as its oracle."""

from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from numpy.testing import assert_allclose
from problems import problem_of
from shipped import path_file, quiet

from compgen.compensation import nonlinear_program, optimise, structured_solver
from compgen.compensation.optimise import Status
from compgen.compensation.problem import Settings
from compgen.core.pose import IDENTITY
from compgen.core.rotations import rotation_matrix
from compgen.core.units import DEG, UM
from compgen.error_model.model import build_error_model
from compgen.error_model.source import Source
from compgen.error_model.sources.thermal_growth import ThermalGrowth
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate

DENSE = "process.moves=arcs"  # waypoints as close as the chord asks, not whole periods apart


@pytest.fixture(scope="module")
def circle():
    return problem_of(generate.plan_uncorrected(load_job(path_file("circle_1300"), None, [DENSE]), quiet))


def part_of(problem, start=400, count=60):
    """Waypoints of the circle only: regular, no stop."""
    return problem.window(slice(start, start + count))


def test_the_error_cancels_and_the_correction_is_its_opposite(circle):
    solution = optimise.optimise(circle, Settings())
    assert solution.status is Status.CONVERGED
    assert np.linalg.norm(solution.residual[:, :3], axis=1).max() < 0.02 * UM
    before = circle.residual(np.zeros_like(solution.correction))
    assert_allclose(solution.correction[:, :3], -before[:, :3], atol=0.2 * UM)
    assert np.abs(before[:, :3]).max() > 100 * UM


def test_each_step_shrinks_about_a_thousandfold(circle):
    assert optimise.optimise(circle, Settings()).iterations <= 5


def test_what_a_further_step_would_change_is_known_without_it(circle):
    rise = circle.rise + np.random.default_rng(7).normal(size=circle.rise.shape)  # K, for smoothing to bite
    rough, settings = replace(circle, rise=rise), Settings(curvature_period=50e-3)
    lever = np.array([1, 1, 1, *3 * [settings.lever]])
    solution = optimise.optimise(rough, settings)
    assert solution.iterations == 2
    assert optimise.optimise(circle, Settings()).iterations == 1
    further = structured_solver.optimise(rough, settings, step_tolerance=solution.last_step / 2)
    assert further.iterations == 3
    moved = np.abs((further.correction - solution.correction) * lever).max()
    assert 1e-15 < moved <= 1.5 * solution.last_step <= 1.5e-11  # m


def test_no_error_gives_exactly_no_correction(circle):
    cold = replace(circle, rise=np.zeros_like(circle.rise))
    assert np.abs(optimise.optimise(cold, Settings()).correction).max() < 1e-12


def test_waypoints_move_together(circle):
    """A kink in the pointwise correction is rounded over the curvature period, not followed."""
    bumped = circle.rise.copy()
    bumped[700] += 5.0  # one waypoint alone 5 K warmer
    rough = replace(circle, rise=bumped)
    unsmoothed = circle.residual(np.zeros((len(bumped), 6))) - rough.residual(np.zeros((len(bumped), 6)))
    smoothed = optimise.optimise(rough, Settings()).correction - optimise.optimise(circle, Settings()).correction
    assert np.linalg.norm(unsmoothed[700, :3]) > 20 * UM
    assert np.linalg.norm(smoothed[700, :3]) < 0.75 * np.linalg.norm(unsmoothed[700, :3])
    assert np.linalg.norm(smoothed[699, :3]) > 0.1 * np.linalg.norm(unsmoothed[700, :3])


def test_fast_solution_is_the_general_solvers_optimum(circle):
    part = part_of(circle)
    part = replace(
        part, rise=part.rise + np.random.default_rng(6).normal(size=part.rise.shape)
    )  # K, for smoothing to bite
    settings = Settings(rate_period=5e-3, curvature_period=30e-3)
    fast = optimise.optimise(part, settings).correction
    slow = nonlinear_program.solve(part, settings, np.zeros_like(fast), np.ones(len(fast), dtype=bool)).correction
    assert np.abs((fast - slow)[:, :3]).max() < 1e-9  # m
    assert np.abs((fast - slow)[:, 3:]).max() < 4e-9  # rad
    pointwise = -part.residual(np.zeros_like(fast))
    assert np.abs(fast - pointwise)[:, :3].max() > 1e-6  # smoothing did something


def test_general_solver_keeps_a_tool_tilt_small(circle):
    """A tilting source: the oracle and the fast solution agree in rotation as well."""
    growth = circle.rise.shape[1]

    class Tilt:
        def distort(self, chain, state):
            theta = list(chain.theta)
            theta[4] = theta[4] + 1e-5 * state.rise[0]
            return replace(chain, theta=tuple(theta))

    model = build_error_model(circle.robot, [cast(Source, Tilt())], growth, IDENTITY)
    part = replace(part_of(circle), model=model)
    fast = optimise.optimise(part, Settings()).correction
    slow = nonlinear_program.solve(part, Settings(), np.zeros_like(fast), np.ones(len(fast), dtype=bool)).correction
    assert np.abs(fast[:, 3:]).max() > 5e-5
    assert np.abs(fast - slow).max() < 1e-9


def test_free_spin_leaves_the_turn_about_the_tool_alone(circle):
    class Spin:
        def distort(self, chain, state):
            theta = list(chain.theta)
            theta[5] = theta[5] + 1e-4 * state.rise[0]
            return replace(chain, theta=tuple(theta))

    model = build_error_model(circle.robot, [cast(Source, Spin())], 5, IDENTITY)
    part = replace(part_of(circle), model=model)
    tied = optimise.optimise(part, Settings()).correction
    free = optimise.optimise(part, Settings(free_spin=True))
    assert np.abs(tied[:, 5]).min() > 1e-3  # rad: 11 K x 1e-4
    assert np.abs(free.residual[:, :5]).max() < 1e-9
    assert free.status is Status.CONVERGED


def just_inside(problem, joint, fraction=0.3):
    """The robot with a lower limit that the plan keeps and the full correction breaks."""
    free = optimise.optimise(problem, Settings())
    plan, full = problem.theta[:, joint].min(), free.theta[:, joint].min()
    assert full < plan - 1e-7
    lower = problem.robot.lower.copy()
    lower[joint] = plan + fraction * (full - plan)
    return replace(problem, robot=replace(problem.robot, lower=lower)), free


def test_a_joint_limit_is_kept_and_named(circle):
    # to shorten the reach the elbow folds: theta_3 falls
    part = circle.window(slice(3, 200))
    tight, free = just_inside(part, 2)
    solution = optimise.optimise(tight, Settings())
    assert solution.status is Status.LIMITED
    assert np.all(solution.theta >= tight.robot.lower - 1e-12)
    limited = [n for n, limit in solution.active_limits if limit == "joint J2+J3 limit"]
    assert limited
    off = np.linalg.norm(solution.residual[:, :3], axis=1)
    assert off[np.array(limited) - 1].max() > 1 * UM
    assert off[np.array(limited) - 1].max() < np.linalg.norm(free.correction[:, :3], axis=1).max()
    far = np.ones(len(off), dtype=bool)
    far[max(0, min(limited) - 80) : max(limited) + 80] = False
    if far.any():
        assert off[far].max() < 0.05 * UM


def test_windowed_limits_are_the_whole_programs_optimum(circle):
    part = circle.window(slice(3, 150))
    tight, _ = just_inside(part, 2, 0.7)
    windowed = optimise.optimise(tight, Settings())
    assert windowed.status is Status.LIMITED
    whole = nonlinear_program.solve(tight, Settings(), np.zeros_like(windowed.correction), np.ones(147, dtype=bool))
    assert np.abs(windowed.correction - whole.correction)[:, :3].max() < 2e-9  # m


def test_best_legal_correction_is_no_worse_than_stopping_at_the_limit(circle):
    """Against a naive answer: full correction with the joint clipped."""
    part = circle.window(slice(3, 120))
    tight, free = just_inside(part, 2)
    solution = optimise.optimise(tight, Settings())
    clipped = np.maximum(free.theta, tight.robot.lower)
    naive = tight.model.error(clipped, tight.rise, tight.target)
    weight = np.array([1, 1, 1, 0.25, 0.25, 0.25])
    assert np.sum((solution.residual * weight) ** 2) < np.sum((naive * weight) ** 2)


def test_the_clamp_holds_and_is_named(circle):
    part = part_of(circle, 3, 100)
    solution = optimise.optimise(part, Settings(clamp_position=100 * UM))
    size = np.linalg.norm(solution.correction[:, :3], axis=1)
    assert solution.status is Status.LIMITED
    assert size.max() <= 100.001 * UM
    assert {limit for _, limit in solution.active_limits} == {"position clamp"}
    assert np.linalg.norm(solution.residual[:, :3], axis=1).max() == pytest.approx(22 * UM, abs=2 * UM)


def test_the_rate_limit_holds_and_is_named(circle):
    part = part_of(circle, 300, 50)
    free = optimise.optimise(part, Settings())
    slope = np.linalg.norm(np.diff(free.correction[:, :3], axis=0), axis=1) / np.diff(part.arc)
    solution = optimise.optimise(part, Settings(rate=0.6 * float(slope.max())))
    steepest = np.linalg.norm(np.diff(solution.correction[:, :3], axis=0), axis=1) / np.diff(part.arc)
    assert solution.status is Status.LIMITED
    assert steepest.max() <= 0.6001 * slope.max()
    assert any(limit == "rate limit" for _, limit in solution.active_limits)


def test_pose_differences_agree_with_the_numeric_error(circle):
    part = part_of(circle, 10, 5)
    function = nonlinear_program.build_pose_differences(part)
    rng = np.random.default_rng(5)
    correction = np.hstack([rng.normal(scale=1e-4, size=(5, 3)), rng.normal(scale=1e-3, size=(5, 3))])
    theta, _ = part.joints(correction)
    for n in range(5):
        target = part.target[n]
        pose = (target.position, target.rotation.T.ravel())
        c, e = function(theta[n], part.rise[n], np.zeros(6), np.zeros(3), *pose)
        assert_allclose(np.asarray(c).ravel(), correction[n], atol=1e-12)
        assert_allclose(np.asarray(e).ravel(), part.residual(correction)[n], atol=1e-12)


def test_commanded_pose_applies_rotation_in_tool_axes(circle):
    part = part_of(circle, 10, 1)
    turned = part.commanded(np.array([[0, 0, 0, 0, 0, 0.01]])).rotation[0]
    assert_allclose(turned, part.target.rotation[0] @ rotation_matrix(np.array([0, 0, 0.01])), atol=1e-15)


def test_growth_source_is_the_only_one_shipped(job):
    assert [type(s) for s in job.sources] == [ThermalGrowth]
    assert job.settings.clamp_rotation == pytest.approx(0.5 * DEG)
