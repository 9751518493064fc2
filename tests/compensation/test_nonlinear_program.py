"""ipopt in windows: the optimum of the structured solver, whatever binds and however long."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from problems import problem_of
from shipped import path_file, quiet

from compgen.compensation import nonlinear_program, optimise, structured_solver
from compgen.compensation.problem import Settings, Solution, Solver, Status
from compgen.core.units import UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.findings import job_findings
from compgen.pipelines.planned import generate

ATOL_M, ATOL_RAD = 1e-9, 4e-9


@pytest.fixture(scope="module")
def problem():
    whole = problem_of(generate.plan_uncorrected(load_job(path_file("circle_1300")), quiet), slice(300, 700))
    wave = 5 * np.sin(2 * np.pi * whole.arc / 0.25)  # K: so that the unlimited correction meets limits at slopes
    return replace(whole, rise=whole.rise + wave[:, None])


@pytest.fixture
def windows(monkeypatch):
    """First and end of the rows of each window, by their arc lengths, in the order in which they are solved."""
    solved, solve = [], nonlinear_program.solve

    def recorded(part, settings, start, free, *others):
        solved.append((float(part.arc[free][0]), float(part.arc[-1]), len(part.arc)))
        return solve(part, settings, start, free, *others)

    monkeypatch.setattr(nonlinear_program, "solve", recorded)
    return solved


def slopes(problem, correction):
    return np.linalg.norm(np.diff(correction[:, :3], axis=0), axis=1) / np.diff(problem.arc)


def assert_same_optimum(one, other):
    assert one.status is other.status
    assert np.abs(one.correction - other.correction)[:, :3].max() < ATOL_M
    assert np.abs(one.correction - other.correction)[:, 3:].max() < ATOL_RAD
    assert set(one.active_limits) == set(other.active_limits)


def test_windows_without_a_limit_are_the_whole(problem, windows):
    one = nonlinear_program.optimise(problem, Settings(), window=90)
    assert_same_optimum(one, structured_solver.optimise(problem, Settings()))
    assert one.status is Status.CONVERGED
    assert len(windows) > 3
    assert max(size for _, _, size in windows) < 150


def test_a_rate_that_binds_for_long_makes_windows_grow(problem, windows):
    free = structured_solver.optimise(problem, Settings()).correction
    settings = Settings(rate=float(np.quantile(slopes(problem, free), 0.5)))
    one = nonlinear_program.optimise(problem, settings, window=60)
    assert_same_optimum(one, structured_solver.optimise(problem, settings))
    assert one.status is Status.LIMITED
    assert len(one.active_limits) > 250  # of 399 changes
    assert max(size for _, _, size in windows) > 200
    assert one.last_step < ATOL_M


def test_windows_end_where_a_clamp_lets_go(problem, windows):
    free = structured_solver.optimise(problem, Settings()).correction
    settings = Settings(clamp_position=float(np.quantile(np.linalg.norm(free[:, :3], axis=1), 0.8)))
    one = nonlinear_program.optimise(problem, settings, window=90)
    assert_same_optimum(one, structured_solver.optimise(problem, settings))
    assert one.status is Status.LIMITED
    assert len(windows) > 2
    assert max(size for _, _, size in windows) < 400


def test_a_limit_behind_a_window_that_reaches_back_into_it_is_not_missed(problem, windows):
    """Nothing binds in the first window; a step behind it makes a ramp that begins inside."""
    step = np.where(np.arange(400) < 100, 0.0, 10.0)  # K
    stepped = replace(problem, rise=problem.rise[:1] + step[:, None])
    settings = Settings(rate=0.4e-3)
    one = nonlinear_program.optimise(stepped, settings, window=95)
    assert_same_optimum(one, structured_solver.optimise(stepped, settings))
    assert one.status is Status.LIMITED
    begins = [begin for begin, _, _ in windows]
    assert min(np.diff(begins)) < 0  # a window before was solved again
    assert min(n for n, _ in one.active_limits) < 95


def test_the_settings_name_the_solver(problem, windows):
    part = problem.window(slice(0, 40))
    structured, ipopts = optimise.optimise(part, Settings()), optimise.optimise(part, Settings(solver=Solver.IPOPT))
    assert len(windows) == 1
    assert_same_optimum(structured, ipopts)


def test_progress_comes_with_every_iteration_and_ends_at_one(problem):
    shares: list[float] = []
    solution = nonlinear_program.optimise(problem.window(slice(0, 200)), Settings(), shares.append, window=60)
    assert len(shares) > solution.iterations > 10
    assert 0 < shares[0] < 0.2
    assert shares[-1] == 1
    assert np.mean(np.diff(shares) > 0) > 0.8


class Cancelled(BaseException):
    pass


def test_what_progress_raises_ends_the_solution(problem):
    def cancel(share):
        shares.append(share)
        if len(shares) == 3:
            raise Cancelled

    shares: list[float] = []
    with pytest.raises(Cancelled):
        nonlinear_program.optimise(problem, Settings(), cancel)
    assert len(shares) == 3


def test_a_window_that_does_not_converge_is_named_with_the_way_out(problem, monkeypatch):
    monkeypatch.setattr(nonlinear_program, "solve", partial(nonlinear_program.solve, max_iterations=2))
    solution = nonlinear_program.optimise(problem, Settings(clamp_position=60 * UM), window=100)
    assert solution.status is Status.STOPPED
    assert not solution.status.is_legal
    assert solution.unsolved == (1, 100)
    sentence = job_findings.why_uncorrected(solution)
    assert sentence == f"waypoints 1 to 100: {Status.STOPPED.value}"
    assert 'compensation.solver = "structured"' in sentence


def test_limits_that_leave_no_way_fail_with_both_solvers(problem):
    """A joint limit a hundred times farther than the clamp lets the correction go."""
    part = problem.window(slice(0, 30))
    lower = part.robot.lower.copy()
    lower[2] = part.theta[:, 2].max() + 1e-3
    stuck = replace(part, robot=replace(part.robot, lower=lower))
    settings = Settings(clamp_position=10 * UM)
    for solve in (structured_solver.optimise, nonlinear_program.optimise):
        solution = solve(stuck, settings)
        assert isinstance(solution, Solution)
        assert not solution.status.is_legal
        assert job_findings.why_uncorrected(solution).startswith("waypoint")


def test_a_program_by_ipopt_is_the_structured_solvers_program():
    few = ["path.length_mm=60", "process.spacing_mm=2", "process.lift_mm=0"]
    one, other = (
        generate.generate(load_job(path_file("line_y"), None, [*few, f'compensation.solver="{name}"']), quiet)[1]
        for name in ("structured", "ipopt")
    )
    assert np.array_equal(one.program.position, other.program.position)
    assert np.abs(one.solution.correction - other.solution.correction)[:, :3].max() < ATOL_M
    assert [f.code for f in other.findings if f not in one.findings] == ["compensation.solver"]
