"""Where limits bind: only there, as far as their influence goes, window by window, and the optimum of the whole."""

import resource
from dataclasses import replace

import numpy as np
import pytest
from problems import problem_of
from shipped import path_file, quiet

from compgen.compensation import limits, nonlinear_program, optimise, structured_solver
from compgen.compensation.problem import Settings
from compgen.core.pose import Pose
from compgen.core.units import UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.robot.interference import Interference

ATOL_M = 1e-9

DENSE = "process.moves=arcs"  # waypoints as close as the chord asks, not whole periods apart


@pytest.fixture(scope="module")
def circle():
    problem = problem_of(generate.plan_uncorrected(load_job(path_file("circle_1300"), None, [DENSE]), quiet))
    wave = 5 * np.sin(2 * np.pi * problem.arc / 0.5)  # K: so that the unlimited correction meets a limit at a slope
    return replace(problem, rise=problem.rise + wave[:, None])


def position_norm(correction):
    return np.linalg.norm(correction[:, :3], axis=1)


def clamp_of(problem, share):
    """A clamp that this share of the waypoints keeps without being asked to."""
    return float(np.quantile(position_norm(optimise.optimise(problem, Settings()).correction), share))


def slope_of(problem, share):
    c = optimise.optimise(problem, Settings()).correction
    return float(np.quantile(np.linalg.norm(np.diff(c[:, :3], axis=0), axis=1) / np.diff(problem.arc), share))


def solve_whole(problem, settings):
    """The optimum with every waypoint in one system."""
    N = len(problem.arc)
    whole = limits.solve_stretch(problem, settings, np.zeros((N, 6)), np.ones(N, dtype=bool))
    assert whole.converged
    return whole.correction


def dense(problem, start, count, factor):
    """A stretch of a problem's path in shorter steps: waypoints between, with their arc, targets and rises."""
    part = problem.window(slice(start, start + count))
    at = np.linspace(0, count - 1, factor * (count - 1) + 1)

    def fill(rows):
        flat = rows.reshape(count, -1)
        filled = np.column_stack([np.interp(at, np.arange(count), column) for column in flat.T])
        return filled.reshape(len(at), *rows.shape[1:])

    target = Pose(fill(part.target.position), np.repeat(part.target.rotation[:1], len(at), axis=0))
    fields = {name: fill(getattr(part, name)) for name in ("theta", "rise", "arc")}
    return replace(part, target=target, stop=np.zeros(len(at), dtype=bool), **fields)


def test_each_kind_of_limit_that_a_correction_breaks_is_seen(circle):
    """By a thousandth, at one waypoint or all; a rate of change at both waypoints of its line."""
    settings = Settings(clamp_position=1e-3, clamp_rotation=1e-3, rate=0.05)
    N, more, less = len(circle.arc), 1.001, 0.999

    def seen(correction):
        return np.flatnonzero(limits.find_violations(circle, settings, correction)).tolist()

    for part, clamp in ((slice(0, 3), settings.clamp_position), (slice(3, 6), settings.clamp_rotation)):
        at_all = np.zeros((N, 6))
        at_all[:, part] = clamp / np.sqrt(3)
        assert seen(less * at_all) == []
        assert seen(more * at_all) == list(range(N))
    rising = np.zeros((N, 6))
    rising[8:, 2] = settings.rate * (circle.arc[8] - circle.arc[7])
    assert seen(less * rising) == []
    assert seen(more * rising) == [7, 8]
    lower = circle.robot.lower.copy()
    lower[0] = np.sort(circle.theta[:, 0])[N // 2]
    turned = replace(circle, robot=replace(circle.robot, lower=lower))
    broken = limits.find_violations(turned, settings, np.zeros((N, 6)))
    assert broken.tolist() == (circle.theta[:, 0] < lower[0] - 1e-12).tolist()
    assert 0.4 < broken.mean() < 0.6


def test_each_limit_that_a_correction_reaches_is_named_with_its_waypoint(circle):
    """A joint within 1e-7 rad of its limit, a clamp or a rate to a ten-thousandth; twice as far off none binds."""
    N, robot, settings = len(circle.arc), circle.robot, Settings(clamp_position=1e-3, clamp_rotation=1e-3, rate=0.05)
    none = np.zeros((N, 6))
    theta = circle.joints(none).theta
    low, high = int(theta[:, 0].argmin()), int(theta[:, 2].argmax())

    def active(correction, room):
        lower = np.where(np.arange(6) == 0, theta[low, 0] - room * 1e-7, robot.lower)
        upper = np.where(np.arange(6) == 2, theta[high, 2] + room * 1e-7, robot.upper)
        near = replace(circle, robot=replace(robot, lower=lower, upper=upper, interference=None))
        return set(limits.active_limits(near, settings, correction))

    names = {(low + 1, f"joint {robot.joint_names[0]} limit"), (high + 1, f"joint {robot.joint_names[2]} limit")}
    assert names <= active(none, 0.9)
    assert active(none, 2.0) == set()
    for part, clamp, name in ((slice(0, 3), 1e-3, "position clamp"), (slice(3, 6), 1e-3, "rotation clamp")):
        for share, binding in ((1 - 0.9e-4, True), (1 - 2e-4, False)):
            correction = none.copy()
            correction[:, part] = share * clamp / np.sqrt(3)
            assert {n for n in active(correction, 1e4) if n[1] == name} == (
                {(n, name) for n in range(1, N + 1)} if binding else set()
            )
    rising = none.copy()
    rising[8:, 2] = 0.05 * (circle.arc[8] - circle.arc[7])
    assert active((1 - 0.9e-4) * rising, 1e4) == {(8, "rate limit")}
    assert active((1 - 2e-4) * rising, 1e4) == set()


@pytest.mark.parametrize("factor", [1, 20])
def test_the_stretch_around_a_limit_is_as_long_as_its_influence_whatever_the_spacing(circle, factor):
    """Counted in waypoints it would be too short on a dense path."""
    part = dense(circle, 400, 1000 if factor == 1 else 300, factor)
    settings = Settings(clamp_position=clamp_of(part, 0.9))
    solution = optimise.optimise(part, settings)
    assert solution.status is optimise.Status.LIMITED
    limited = np.array([n for n, _ in solution.active_limits])
    assert 0.02 < len(set(limited)) / len(part.arc) < 0.2
    if factor == 1:  # elsewhere nothing was touched at all
        far = np.abs(part.arc[:, None] - part.arc[limited - 1]).min(axis=1) > 2 * limits.influence_length(settings)
        assert far.any()
        assert np.array_equal(solution.correction[far], optimise.optimise(part, Settings()).correction[far])
    assert np.abs(solution.correction - solve_whole(part, settings))[:, :3].max() < ATOL_M


def test_windows_give_the_optimum_of_the_whole(circle, monkeypatch):
    part = circle.window(slice(3, 1003))
    settings = Settings(clamp_position=clamp_of(part, 0.5))
    one = optimise.optimise(part, settings)
    lengths, solve = [], limits.solve_stretch

    def watched(part, settings, start, free_rows, progress):
        lengths.append(len(free_rows))
        return solve(part, settings, start, free_rows, progress)

    monkeypatch.setattr(limits, "solve_stretch", watched)
    many = structured_solver.optimise(part, settings, window=40, max_window=40)
    assert len(lengths) > 4
    assert max(lengths) < 100
    assert np.abs(many.correction - one.correction)[:, :3].max() < ATOL_M
    assert many.active_limits == one.active_limits


def test_windows_end_where_nothing_is_solved(circle):
    """A rate that binds for long without a break carries influence along: it is not cut there."""
    part = circle.window(slice(3, 1003))
    settings = Settings(rate=slope_of(part, 0.5))
    solution = structured_solver.optimise(part, settings, window=100, max_window=1000)
    assert solution.status is optimise.Status.LIMITED
    assert np.abs(solution.correction - solve_whole(part, settings))[:, :3].max() < ATOL_M


def test_a_rate_that_needs_a_longer_way_gets_it(circle):
    """The correction cannot come back to the free one within the first window: it is widened until it can."""
    part = circle.window(slice(3, 1003))
    settings = Settings(rate=slope_of(part, 0.8))
    solution = optimise.optimise(part, settings)
    assert solution.status is optimise.Status.LIMITED
    step = np.linalg.norm(np.diff(solution.correction[:, :3], axis=0), axis=1)
    assert np.all(step <= settings.rate * np.diff(part.arc) * (1 + 1e-6))
    assert np.abs(solution.correction - solve_whole(part, settings))[:, :3].max() < ATOL_M


def test_a_limit_broken_for_a_twentieth_of_a_long_program_costs_little():
    """1e5 waypoints: legal everywhere, the free solution elsewhere, and memory for a window only."""
    job = load_job(path_file("optic_spiral"), None, [DENSE, "path.stepover_mm=20.65", "process.chord_um=0.2"])
    problem = problem_of(generate.plan_uncorrected(job, quiet))
    N, arc = len(problem.arc), problem.arc
    assert N > 100_000
    free = optimise.optimise(problem, Settings())
    settings = Settings(clamp_position=float(np.quantile(position_norm(free.correction), 0.95)))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    solution = optimise.optimise(problem, settings)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 150e3  # kB
    assert solution.status is optimise.Status.LIMITED
    assert position_norm(solution.correction).max() <= settings.clamp_position * (1 + 1e-6)
    limited = np.unique([n for n, _ in solution.active_limits]) - 1
    assert 0.045 < len(limited) / N < 0.055
    away = np.ones(N, dtype=bool)
    distance = 2 * limits.influence_length(settings)
    for first, last in zip(arc[limited] - distance, arc[limited] + distance, strict=True):
        away[np.searchsorted(arc, first) : np.searchsorted(arc, last, "right")] = False
    assert away.mean() > 0.8
    assert np.array_equal(solution.correction[away], free.correction[away])
    rows = slice(max(0, limited[0] - 300), limited[0] + 300)
    alone = optimise.optimise(problem.window(rows), settings).correction
    assert np.abs(alone - solution.correction[rows])[100:-100, :3].max() < ATOL_M
    assert np.abs(solution.correction - free.correction)[:, :3].max() > 0.1 * UM  # the limit bites


def test_a_program_that_breaks_a_limit_for_a_twentieth_of_its_length():
    planned = generate.plan_uncorrected(load_job(path_file("circle_1300"), None, [DENSE]), quiet)
    part = problem_of(planned, slice(3, 1500))
    unlimited = optimise.optimise(part, Settings())
    clamp = float(np.quantile(np.linalg.norm(unlimited.correction[:, :3], axis=1), 0.95))
    solution = optimise.optimise(part, Settings(clamp_position=clamp))
    assert solution.status is optimise.Status.LIMITED
    assert np.linalg.norm(solution.correction[:, :3], axis=1).max() <= clamp * (1 + 1e-6)
    limited = np.array([n for n, _ in solution.active_limits])
    assert 0.03 < len(limited) / 1497 < 0.08
    at_clamp = np.flatnonzero(np.linalg.norm(solution.correction[:, :3], axis=1) > clamp * limits.ACTIVE)
    assert (limited - 1).tolist() == at_clamp.tolist()
    assert {limit for _, limit in solution.active_limits} == {"position clamp"}
    far = np.setdiff1d(np.arange(1497), (limited[:, None] - 1 + np.arange(-90, 91)).ravel())
    assert np.linalg.norm(solution.residual[far, :3], axis=1).max() < 0.05 * UM


def test_a_neighbourhood_is_a_distance_or_two_rows():
    arc = np.arange(20.0)
    marked = np.zeros(20, dtype=bool)
    marked[[1, 10]] = True
    for distance, near in ((0.0, [0, 1, 2, 3, 8, 9, 10, 11, 12]), (3.0, [0, 1, 2, 3, 4, 7, 8, 9, 10, 11, 12, 13])):
        assert np.flatnonzero(limits.neighbourhood(arc, marked, distance)).tolist() == near


def test_limits_are_drawn_in_by_rounding_where_a_joint_comes_near(circle):
    """By less than a hundredth of a degree, of the joint that comes near one, on that side only."""
    steps = (1e-6, 1e-3 * np.pi / 180)
    assert limits.with_rounding_margin(circle, steps) is circle
    robot = circle.robot
    upper = np.where(np.arange(6) == 1, circle.theta[:, 1].max() + limits.NEAR_LIMIT / 2, robot.upper)
    near = limits.with_rounding_margin(replace(circle, robot=replace(robot, upper=upper)), steps)
    drawn_in = upper - near.robot.upper
    assert 0 < drawn_in[1] < 1e-2 * np.pi / 180
    assert not np.delete(drawn_in, 1).any()
    assert np.array_equal(near.robot.lower, robot.lower)


def test_limits_are_drawn_in_by_what_joints_would_turn_to_follow_an_error(circle):
    """An error of one sigma along a line: as far as the joints of a target moved by it turn, times the sigmas."""
    robot, sigma = circle.robot, np.array([30e-6, -20e-6, 50e-6])
    lower = np.where(np.arange(6) == 2, circle.theta[:, 2].min() - limits.NEAR_LIMIT / 2, robot.lower)
    tight = replace(circle, robot=replace(robot, lower=lower))
    rows = np.arange(0, len(circle.arc), 3)
    moment = np.tile([sigma[i] * sigma[j] for i in range(3) for j in range(i, 3)], (len(rows), 1))
    turned = circle.joints(np.tile(np.append(sigma, np.zeros(3)), (len(circle.arc), 1))).theta - circle.theta
    near = rows[circle.theta[rows, 2] < lower[2] + limits.NEAR_LIMIT]
    drawn_in = limits.with_uncertainty_margin(tight, rows, moment, 3.0).robot
    assert len(near) > 3
    assert drawn_in.lower[2] - lower[2] == pytest.approx(3 * np.abs(turned[near, 2]).max(), rel=1e-3)
    assert np.array_equal(np.delete(drawn_in.lower, 2), np.delete(lower, 2))
    assert np.array_equal(drawn_in.upper, robot.upper)
    assert limits.with_uncertainty_margin(circle, rows, moment, 3.0) is circle


@pytest.mark.parametrize("kind", ["joint", "clamp", "rate", "two stretches"])
def test_the_interior_point_is_the_general_solvers_optimum(kind):
    planned = generate.plan_uncorrected(load_job(path_file("circle_1300")), quiet)
    part, settings = problem_of(planned, slice(3, 103) if kind == "joint" else slice(300, 400)), Settings()
    unlimited = optimise.optimise(part, settings)
    free_rows = np.ones(100, dtype=bool)
    if kind == "clamp":
        settings = Settings(clamp_position=60 * UM)
    elif kind == "two stretches":
        settings = Settings(clamp_position=60 * UM)
        free_rows[[0, 1, 98, 99]] = False
        free_rows[40:52] = False
    elif kind == "rate":
        slope = np.linalg.norm(np.diff(unlimited.correction[:, :3], axis=0), axis=1) / np.diff(part.arc)
        settings = Settings(rate=0.6 * float(slope.max()))
    else:
        lower = part.robot.lower.copy()
        lower[2] = 0.3 * part.theta[:, 2].min() + 0.7 * unlimited.theta[:, 2].min()
        part = replace(part, robot=replace(part.robot, lower=lower))
    start = np.zeros((100, 6))
    fast = limits.solve_stretch(part, settings, start, free_rows)
    slow = nonlinear_program.solve(part, settings, start, free_rows)
    assert fast.converged
    assert slow.converged
    apart = np.abs(fast.correction - slow.correction)
    assert apart[:, :3].max() < 1e-9  # m
    assert apart[:, 3:].max() < 4e-9  # rad
    assert np.array_equal(fast.correction[~free_rows], start[~free_rows])
    assert np.abs(fast.correction - unlimited.correction)[:, :3].max() > 1 * UM  # the limit bites


def rectangle(robot, low, high):
    """The polygon of the pendant's J2 and J3 between two corners [rad]."""
    (a, b), (c, d) = low, high
    corner = np.array([[a, b], [c, b], [c, d], [a, d]])
    return Interference.of(corner, robot.pendant_map, robot.pendant_zero)


def test_the_polygon_of_j2_and_j3_is_drawn_in_by_what_they_would_turn_to_follow_an_error(circle):
    """As far at least as they turn together for three sigmas, and not three times as far."""
    plane = rectangle(circle.robot, (-9, -9), (9, 9)).plane(circle.theta)
    area = rectangle(circle.robot, (-9, -9), (9, plane[:, 1].max() + limits.NEAR_LIMIT / 2))
    near = replace(circle, robot=replace(circle.robot, interference=area))
    sigma, rows = np.array([30e-6, -20e-6, 50e-6]), np.arange(len(circle.arc))
    moment = np.tile([sigma[i] * sigma[j] for i in range(3) for j in range(i, 3)], (len(rows), 1))
    turned = circle.joints(np.tile(np.append(sigma, np.zeros(3)), (len(rows), 1))).theta - circle.theta
    at_edge = area.clearance(circle.theta) < limits.NEAR_LIMIT
    moved = 3 * np.linalg.norm(turned[at_edge] @ area.to_plane.T, axis=1).max()
    drawn_in = limits.with_uncertainty_margin(near, rows, moment, 3.0).robot
    assert drawn_in.interference is not None
    assert 0.999 * moved <= drawn_in.interference.margin <= 3 * moved
    assert moved > 1e-5
    assert np.array_equal(drawn_in.lower, circle.robot.lower)
    assert np.array_equal(drawn_in.upper, circle.robot.upper)


def test_a_correction_stops_at_an_edge_of_the_polygon_of_j2_and_j3(circle):
    """Where the unlimited one would cross it, and nowhere else."""
    part = circle.window(slice(300, 400))
    unlimited = optimise.optimise(part, Settings())
    plane = rectangle(part.robot, (-9, -9), (9, 9)).plane
    edge = 0.3 * plane(part.theta)[:, 1].min() + 0.7 * plane(unlimited.theta)[:, 1].min()
    area = rectangle(part.robot, (-9, edge), (9, 9))
    limited = replace(part, robot=replace(part.robot, interference=area))
    crossing = limits.find_violations(limited, Settings(), unlimited.correction)
    assert np.array_equal(crossing, plane(unlimited.theta)[:, 1] < edge)
    assert 0 < crossing.sum() < 100
    solution = optimise.optimise(limited, Settings())
    assert solution.status is optimise.Status.LIMITED
    assert area.clearance(solution.theta).min() == pytest.approx(0, abs=1e-9)
    assert {name for _, name in solution.active_limits} == {"J2/J3 interference"}
