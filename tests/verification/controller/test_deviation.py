"""Where the twin's controller leads the tool beside its path: closed forms, and brute force on a grid of 0.1 ms."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree

from compgen.core.pose import Pose
from compgen.core.rotations import rotation_matrix
from compgen.core.units import UM
from compgen.program.program import Program
from compgen.robot.inverse_kinematics import Posture, solve_tool
from compgen.robot.kinematics import flange_pose
from compgen.robot.motion import ControllerMotion
from compgen.verification.twin.circular_motion import sweeps
from compgen.verification.twin.controller import deviation
from compgen.verification.twin.controller.command import WrittenPath
from compgen.verification.twin.controller.deviation import cubic, most_in_blocks, motion_deviation

TWO_MEANS = ControllerMotion(moving_averages=(0.2, 0.1))
DOWN = np.diag([1.0, -1.0, -1.0])


def program(points, speed, fine=None, rotation=None):
    N = len(points)
    fine = np.isin(np.arange(N), [0, N - 1]) if fine is None else fine
    rotation = np.tile(DOWN, (N, 1, 1)) if rotation is None else rotation
    speeds = np.broadcast_to(np.asarray(speed, dtype=float), (N - 1,)).copy()
    turns = np.zeros((N, 3), dtype=int)
    return Program(
        name="T",
        comment="",
        date="26-01-01",
        remarks=(),
        uframe=0,
        utool=1,
        position=np.asarray(points),
        rotation=rotation,
        posture=Posture(),
        turns=turns,
        speed=speeds,
        fine=fine,
    )


def led(robot, motion, text, period=0.008, override=1.0, counts=4):
    """The deviation without ramps, the joints by the closed-form inverse; and the arc length of its places."""
    robot = replace(robot, motion=motion, controller=replace(robot.controller, period=period))
    length = np.linalg.norm(np.diff(text.position, axis=0), axis=1)
    time = np.concatenate([[0.0], np.cumsum(length / text.speed)])
    theta, _ = solve_tool(robot, Pose(text.position, text.rotation), TOOL, text.posture)
    counts = np.full(len(length), counts)
    arc = np.concatenate([[0.0], np.cumsum(np.repeat(length / counts, counts))])
    return arc, motion_deviation(robot, TOOL, WrittenPath(text, sweeps(text), time, theta), counts, override)


TOOL = Pose(np.array([0.0, 0.0, 0.1]), np.eye(3))


def circle(radius, turns=1.0, N=2000):
    angle = np.linspace(0, 2 * np.pi * turns, N)
    return np.column_stack([1.2 + radius * np.cos(angle), radius * np.sin(angle), np.full(N, 0.2)])


@pytest.mark.parametrize(("speed", "override"), [(0.2, 1.0), (0.2, 0.5), (0.02, 1.0)])
def test_a_circle_is_pulled_to_its_centre_by_v2_sigma2_over_2r(robot, speed, override):
    text = program(circle(0.3), speed)
    arc, deviation = led(robot, TWO_MEANS, text, override=override)
    middle = (arc > 0.2) & (arc < arc[-1] - 0.2)
    outward = (deviation.across @ np.eye(3)[:, :2])[middle]
    place = np.interp(arc[middle], arc[::4], np.arange(len(text.position)))
    angle = 2 * np.pi * place / (len(text.position) - 1)
    pull = -(outward * np.column_stack([np.cos(angle), np.sin(angle)])).sum(axis=1)
    variance = (0.2**2 + 0.1**2) / 12
    assert_allclose(pull, (speed * override) ** 2 * variance / 0.6, rtol=3e-3, atol=0.3 * UM)


def test_a_straight_line_is_only_late(robot):
    text = program([[1.0, -0.3, 0.2], [1.1, 0.3, 0.3], [1.15, 0.6, 0.35]], 0.1)
    _, deviation = led(robot, TWO_MEANS, text)
    assert np.abs(deviation.across).max() < 1e-12
    assert deviation.lag == pytest.approx(0.1 * 0.3 / 2, rel=1e-6)
    assert deviation.turn is None


def test_on_a_circle_the_bound_is_three_to_four_times_v2_sigma2_over_2r(robot):
    text = program(circle(0.3, N=20_000), 0.2)
    robot = replace(robot, motion=TWO_MEANS, controller=replace(robot.controller, period=0.008))
    path = WrittenPath(text, sweeps(text), np.zeros(20_000), np.zeros((20_000, 6)))
    variance = (0.2**2 + 0.1**2) / 12
    (most,) = most_in_blocks(robot, path, TWO_MEANS)
    assert 3.0 < most / (0.2**2 * variance / 0.6) < 4.0
    arcs = replace(path, sweep=path.sweep._replace(angle=np.full(19_999, 1e-4)))
    assert np.isinf(most_in_blocks(robot, arcs, TWO_MEANS)).all()


@pytest.mark.parametrize("motion", [TWO_MEANS, ControllerMotion(first_orders=(0.03, 0.02), lag=0.01)])
@pytest.mark.parametrize("seed", range(6))
def test_no_block_of_time_leads_farther_off_than_its_bound(robot, monkeypatch, motion, seed):
    """Circles and waves with noise of the digits, at changing speeds, with corners of any angle and a stop."""
    monkeypatch.setattr(deviation, "BLOCK", 64)
    rng = np.random.default_rng(seed)
    bend = circle(rng.uniform(0.02, 0.3), rng.uniform(0.2, 1.0), 300)
    bend[:, 2] += rng.uniform(0, 0.01) * np.sin(np.linspace(0, 20, 300))
    legs = bend[-1] + np.cumsum(rng.normal(0, 0.05, (8, 3)), axis=0)
    points = np.round(np.vstack([bend, legs]), 6)
    points[:, :2] *= 0.5
    points[:, 0] += 0.7
    text = program(points, rng.uniform(0.05, 0.3, len(points) - 1), np.isin(np.arange(308), [0, 303, 307]))
    robot = replace(robot, motion=motion, controller=replace(robot.controller, period=0.008))
    path = WrittenPath(text, sweeps(text), np.zeros(308), np.zeros((308, 6)))

    def off(blocks=None):
        led_off = motion_deviation(robot, TOOL, path, np.full(307, 4), places_only=True, blocks=blocks)
        assert led_off is not None
        return np.linalg.norm(led_off.across, axis=1)

    most = most_in_blocks(robot, path, motion)
    assert len(most) > 5
    each = np.array([off(np.arange(len(most)) == n) for n in range(len(most))])
    assert np.all(each.max(axis=1) <= most)
    assert each.max() > most.max() / 100
    assert_allclose(each.max(axis=0), off(), rtol=0, atol=1e-9)


@pytest.mark.parametrize(("motion", "farther"), [
    (TWO_MEANS, 0.005),
    (ControllerMotion(moving_averages=(0.15,), lag=0.02), 0.005),
    (ControllerMotion(first_orders=(0.03, 0.02)), 0.04),  # uneven weights: at a corner not quite the nearest place
], ids=["two means", "mean and lag", "first orders"])  # fmt: skip
@pytest.mark.parametrize("stopped", [False, True])
def test_corners_and_bends_are_those_of_brute_force(robot, motion, farther, stopped):
    """Box kernels and exponentials convolved at 0.1 ms, and the nearest of all points of the path."""
    bend = circle(0.1, 0.25, 200) - circle(0.1)[0] + [1.1, 0.0, 0.2]
    last, end = bend[-1] - [0.1, 0.0, 0.0], bend[-1] - [0.1, 0.0, -0.15]
    points = np.array([[1.1, -0.15, 0.2], *bend, last, end])
    fine = np.isin(np.arange(len(points)), [0, len(points) - 1, *([len(points) - 2] if stopped else [])])
    text = program(points, 0.1, fine)
    _, deviation = led(robot, motion, text, period=0.0005)
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    step, wait = 1e-4, 2.0
    time = wait + way / 0.1
    if stopped:
        time = np.append(np.insert(time[:-1], len(time) - 1, time[-2] + wait), time[-1] + wait)
        points = np.insert(points, len(points) - 1, points[-2], axis=0)
    grid = np.arange(0, time[-1] + wait, step)
    x = np.column_stack([np.interp(grid, time, column) for column in points.T])
    for kernel in kernels(motion, step):
        rows = np.concatenate([np.repeat(x[:1], len(kernel), axis=0), x])
        x = np.column_stack([np.convolve(column, kernel)[len(kernel) : len(rows)] for column in rows.T])
    dense = np.column_stack([np.interp(np.linspace(0, way[-1], 400_001), way, c) for c in text.position.T])
    distance = cKDTree(dense).query(x)[0].max()
    assert distance > 50 * UM
    largest = np.linalg.norm(deviation.across, axis=1).max()
    assert distance * 0.995 < largest < distance * (1 + farther)


def kernels(motion, step):
    for window in motion.moving_averages:
        yield np.full(round(window / step), step / window)
    for constant in motion.first_orders:
        weights = np.exp(-step * np.arange(round(16 * constant / step)) / constant)
        yield weights / weights.sum()
    if motion.lag:
        yield np.eye(1, round(motion.lag / step) + 1, round(motion.lag / step))[0]


def test_smoothed_joints_lead_the_nominal_arm(robot):
    """Joints at every period by the inverse, plain means of them, and the arm: the same place beside the path."""
    text = program(circle(0.25, 0.5, 1200), 0.2)
    arc, deviation = led(robot, replace(TWO_MEANS, space="joint"), text)
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(text.position, axis=0), axis=1))])
    along = np.clip(0.2 * 0.008 * np.arange(-50, int(way[-1] / 0.0016) + 60), 0, way[-1])
    place = np.column_stack([np.interp(along, way, c) for c in text.position.T])
    theta, _ = solve_tool(robot, Pose(place, np.tile(DOWN, (len(place), 1, 1))), TOOL, text.posture)
    weights = np.convolve(np.full(25, 0.04), np.r_[np.ones(12), 0.5] / 12.5)
    rows = np.column_stack([np.convolve(column, weights) for column in np.column_stack([theta, along]).T])
    rows = rows[40:-40]
    drawn = (flange_pose(robot, rows[:, :6]) @ TOOL).position
    inside = (rows[:, 6] > 0.1) & (rows[:, 6] < way[-1] - 0.1)
    drawn, at = drawn[inside], rows[inside, 6]
    target = np.column_stack([np.interp(at, way, column) for column in text.position.T])
    outward = (target - [1.2, 0.0, 0.2]) / 0.25
    for direction in (outward, np.array([0.0, 0.0, 1.0])):
        led_to = np.column_stack([np.interp(at, arc, column) for column in deviation.across.T])
        expected = ((drawn - target) * direction).sum(axis=1)
        assert np.abs(expected).max() > 50 * UM
        assert_allclose((led_to * direction).sum(axis=1), expected, atol=1.0 * UM)


@pytest.mark.parametrize("space", ["cartesian", "joint"])
def test_a_turning_tool_lags_no_further_than_its_way(robot, space):
    """Turned steadily along a line it is only late; a bend in how fast it turns is smoothed by rate^2's change."""
    N = 400
    y = np.linspace(-0.3, 0.3, N)
    tilt = np.column_stack([0.2 * y**2 / 0.09, np.zeros(N), np.zeros(N)])
    rotation = DOWN @ rotation_matrix(tilt)
    text = program(np.column_stack([np.full(N, 1.1), y, np.full(N, 0.2)]), 0.1, rotation=rotation)
    arc, deviation = led(robot, replace(TWO_MEANS, space=space), text)
    middle = (arc > 0.1) & (arc < arc[-1] - 0.1)
    variance = (0.2**2 + 0.1**2) / 12
    expected = 0.5 * variance * 0.4 / 0.09 * 0.1**2  # half of sigma^2 times the tool's angular acceleration
    bent = 0.05 if space == "cartesian" else 0.12  # what joints add that bend although their pose does not
    assert_allclose(deviation.turn[middle, 0], expected, rtol=bent)
    if space == "cartesian":
        assert np.abs(deviation.turn[middle, 1:]).max() < 1e-3 * expected
        assert np.abs(deviation.across[middle]).max() < 1e-9
    else:
        assert np.linalg.norm(deviation.across[middle], axis=1).max() > UM


def test_what_is_not_known_or_smooths_nothing_leads_nowhere(robot):
    text = program(circle(0.3), 0.2)
    for motion in (None, ControllerMotion(lag=0.05), ControllerMotion(moving_averages=(0.0,))):
        assert led(robot, motion, text)[1] is None


def test_blocks_of_time_are_one_motion(robot, monkeypatch):
    text = program(circle(0.3), 0.05)
    _, whole = led(robot, TWO_MEANS, text)
    monkeypatch.setattr("compgen.verification.twin.controller.deviation.BLOCK", 700)
    _, parts = led(robot, TWO_MEANS, text)
    assert_allclose(parts.across, whole.across, atol=1e-12)
    assert_allclose(parts.along, whole.along, atol=1e-12)


def test_a_cubic_goes_through_its_rows_and_meets_a_parabola():
    rows = (np.arange(10.0)[:, None] - 3) ** 2
    assert_allclose(cubic(rows, np.arange(10.0)), rows, atol=1e-12)
    assert_allclose(cubic(rows, np.array([4.5, 6.25]))[:, 0], [2.25, 10.5625], atol=1e-12)
