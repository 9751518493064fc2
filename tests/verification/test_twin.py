"""The twin: its own timing and heat, and what it refuses."""

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import path_file, quiet

from compgen.core.pose import IDENTITY
from compgen.core.rotations import rotation_matrix
from compgen.fanuc import loads
from compgen.fanuc.analysis.poses import program_poses
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned import generate
from compgen.program.frames import Frames
from compgen.program.pages import excerpt
from compgen.thermal import Duty, JointMotion, rises_during
from compgen.verification.twin import TwinError, execute, prepare
from compgen.verification.twin.timing import ramp_duration


@pytest.fixture(scope="module")
def generated():
    job = load_job(path_file("line_y"))
    planned, corrected = generate.generate(job, quiet)
    return job, planned, corrected


def test_a_ramp_takes_what_its_limits_allow():
    a, j = np.array([2.0, 2.0]), np.array([10.0, 10.0])
    v = np.array([0.2, 1.0])  # below and above a^2 / j = 0.4 m/s
    assert_allclose(ramp_duration(v, a, j), [2 * np.sqrt(0.02), 0.5 + 0.2])
    # the integral of the acceleration over the ramp is the speed
    T = ramp_duration(v, a, j)
    assert_allclose(j[0] * (T[0] / 2) ** 2, v[0])
    assert_allclose(a[1] * (T[1] - a[1] / j[1]), v[1])


def test_the_timing_is_near_the_plan_and_not_the_plan(generated):
    _, planned, corrected = generated
    ratio = corrected.execution().time[-1] / corrected.trajectory.time[-1]
    assert ratio != 1
    assert ratio == pytest.approx(1, abs=0.2)
    assert planned.trajectory.time[-1] == pytest.approx(corrected.trajectory.time[-1], rel=1e-4)


def test_acc_stretches_the_ramps_of_plan_and_text():
    """A line with a stop at each end: half of each ramp v / a + a / j is added to length / v."""
    alone = [generate.generate(load_job(path_file("line_y"), None, o), quiet) for o in ([], ["process.acc_percent=40"])]
    planned = [p.trajectory.time[-1] for p, _ in alone]
    flown = [c.execution().time[-1] for _, c in alone]
    assert [c.program.acc for _, c in alone] == [None, 40]
    assert alone[1][1].inside
    assert planned[1] > planned[0] + 0.05
    assert flown[1] - flown[0] == pytest.approx(planned[1] - planned[0], rel=0.35)
    assert flown[1] == prepare_with_acc(alone[0], 40)


def prepare_with_acc(made, percent):
    """Time of the text whose motions say an ACC, on an arm whose accelerations and jerks are that share."""
    planned, corrected = made
    job = planned.job
    share = percent / 100
    arm = replace(job.robot, acceleration=share * job.robot.acceleration, jerk=share * job.robot.jerk)
    twin = replace(twin_of(job), robot=arm)
    return execute(twin, corrected.program, job.history.before, air=job.history.air).time[-1]


@pytest.mark.parametrize("rounds_up", [False, True])
def test_half_the_override_takes_twice_as_long_or_the_whole_periods_of_that(generated, rounds_up):
    job, _, corrected = generated
    twin = twin_of(job)
    controller = replace(twin.robot.controller, rounds_up_to_period=rounds_up)
    twin = replace(twin, robot=replace(twin.robot, controller=controller, motion=None))
    full = prepare(twin, corrected.program, job.history.before, job.history.air)
    half = full.at_override(0.5)
    took = 2 * np.diff(full.timing.unrounded)
    if rounds_up:
        took = np.ceil(took / controller.period - 1e-6) * controller.period
    assert_allclose(np.diff(half.timing.time), took, atol=1e-9)
    assert_allclose(half.timing.unrounded, 2 * full.timing.unrounded, atol=1e-9)
    slower = np.diff(full.timing.time) / took
    assert_allclose(half.timing.driven, full.timing.driven * slower, rtol=1e-9)
    assert_allclose(half.timing.highest, full.timing.highest * slower, rtol=1e-9)
    assert_allclose(half.written_path().time, full.written_path().time, atol=1e-9)  # which are those of its text


@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize("is_lower", [True, False])
def test_a_joint_beyond_its_limit_is_named_with_the_position_where_it_is_farthest(generated, joint, is_lower):
    job, _, corrected = generated
    twin = twin_of(job)
    robot, lower, upper = twin.robot, np.array(twin.robot.lower), np.array(twin.robot.upper)
    theta = prepare(twin, corrected.program, job.history.before, job.history.air).theta[:, joint]
    row = int(theta.argmin() if is_lower else theta.argmax())
    if is_lower:
        lower[joint] = theta[row] + 1e-3
    else:
        upper[joint] = theta[row] - 1e-3
    narrow = replace(twin, robot=replace(robot, lower=lower, upper=upper))
    name = re.escape(robot.joint_names[joint])
    with pytest.raises(TwinError, match=rf"^P\[{row + 1}\]: joint {name} is beyond its limit"):
        prepare(narrow, corrected.program, job.history.before, job.history.air)


@pytest.mark.parametrize("degrees", [85, 95])
def test_a_line_on_which_a_joint_turns_by_more_than_a_quarter_is_refused(generated, degrees):
    job, _, corrected = generated
    down = np.diag([1.0, -1.0, -1.0])
    spun = down @ rotation_matrix(np.radians([[0, 0, degrees]]))[0]
    spinning = replace(
        excerpt(corrected.program, 0, 1),
        position=np.array([[1.2, 0.0, 0.2], [1.21, 0.0, 0.2]]),
        rotation=np.array([down, spun]),
        turns=np.zeros((2, 3), dtype=np.int64),
    )
    if degrees > 90:
        with pytest.raises(TwinError, match=r"^P\[1\] to P\[2\]: a joint turns by over 90 deg"):
            prepare(twin_of(job), spinning, job.history.before, job.history.air)
    else:
        prepare(twin_of(job), spinning, job.history.before, job.history.air)


def test_between_two_positions_a_network_warms_in_a_straight_line():
    job = load_job(path_file("line_y"), None, ['robot.thermal.model="network"'])
    _, corrected = generate.generate(job, quiet)
    prepared = prepare(twin_of(job), corrected.program, job.history.before, job.history.air)
    assert prepared.twin.heat.law is None
    segment = np.array([0, 0, 0, 1])
    rise, growth = prepared.rise_and_growth(segment, np.array([0.0, 0.25, 1.0, 1.0]), np.zeros(4))
    a, b, c = prepared.rise[:3]
    assert_allclose(rise, [a, 0.75 * a + 0.25 * b, b, c], atol=1e-13)
    assert np.abs(b - a).max() > 1e-9
    assert_allclose(growth, prepared.twin.growth(rise))


@pytest.mark.parametrize("model", ["nodes", "network"])
def test_on_its_way_the_arm_is_as_warm_as_at_its_positions_in_air_that_moves_too(model):
    air = ["ambient.kind=wave", "ambient.amplitude_K=3", "ambient.peak_h=6"]
    job = load_job(path_file("line_y"), None, [f'robot.thermal.model="{model}"', *air])
    _, corrected = generate.generate(job, quiet)
    prepared = prepare(twin_of(job), corrected.program, job.history.before, job.history.air)
    assert not prepared.air.is_still
    rows = np.arange(len(corrected.program.position) - 1)
    time = prepared.timing.time
    for fraction, at in ((0.0, rows), (1.0, rows + 1)):
        rise, growth = prepared.rise_and_growth(rows, np.full(len(rows), fraction), time[at])
        assert_allclose(rise, prepared.rises_at(at), atol=1e-9)
        assert_allclose(growth, prepared.twin.growth(rise), atol=1e-15)


def test_many_stops_are_timed_to_a_tenth():
    job = load_job(path_file("raster_1300"), None, ["path.stepover_mm=5"])
    _, corrected = generate.generate(job, quiet)
    assert corrected.execution().time[-1] == pytest.approx(corrected.trajectory.time[-1], rel=0.1)
    assert corrected.inside
    assert corrected.deviation.total().max() < 1.0e-6  # straight sweeps: rounding and little else


def test_heat_is_the_nodes_own_equation(generated):
    job, _, corrected = generated
    execution = corrected.execution()
    assert_allclose(execution.rise[0], [11, 3.9, 13, 3, 2.3], atol=1e-12)
    speeds = np.linalg.norm(np.diff(corrected.program.position, axis=0), axis=1)
    at = np.append(np.flatnonzero(execution.fraction == 0), len(execution.time) - 1)
    # against the closed sum of the planner, at the twin's own times and driven speeds
    length, spent = speeds, np.diff(execution.time[at])
    motion = JointMotion(execution.time[at], execution.theta[at], length / spent)
    expected, _ = rises_during(job.heat, execution.rise[0], motion)
    assert_allclose(execution.rise[at], expected, atol=1e-9)


def test_a_longer_wait_before_is_another_state(generated):
    job, _, corrected = generated
    twin = twin_of(job)
    late = execute(twin, corrected.program, (*job.history.before, Duty("off", 0.0, 3600.0)))
    assert np.all(late.rise[0] < corrected.execution().rise[0])


def test_another_posture_in_config_is_refused(generated):
    job, _, corrected = generated
    other = replace(corrected.program, posture=replace(corrected.program.posture, up=False))
    with pytest.raises(TwinError, match="beyond its limit"):
        execute(twin_of(job), other, job.history.before)


def test_a_wrong_turn_is_refused(generated):
    job, _, corrected = generated
    turns = corrected.program.turns.copy()
    j6 = corrected.solution.theta[:, 5]
    assert j6.min() < -0.1
    turns[np.argmin(j6), 2] = 1
    with pytest.raises(TwinError, match="over 90 deg"):
        execute(twin_of(job), replace(corrected.program, turns=turns), job.history.before)


def test_a_place_out_of_reach_is_refused(generated):
    job, _, corrected = generated
    position = corrected.program.position.copy()
    position[7] = [2.5, 0, 0.2]
    with pytest.raises(TwinError, match="P\\[8\\]"):
        execute(twin_of(job), replace(corrected.program, position=position), job.history.before)


@pytest.mark.parametrize("spin", [0.0, 90.0, 179.9999999, 180.0, -180.0])
def test_joint_6_at_half_a_turn_is_written_and_read_the_same(spin):
    """The line passes y = 0, so J6 passes the spin angle itself."""
    job = load_job(path_file("line_y"), None, [f"tool.spin_deg={spin}", "path.y_mm=0", "path.length_mm=400"])
    _, corrected = generate.generate(job, quiet)
    assert corrected.inside


def test_a_coupled_joint_beyond_half_a_turn_is_legal_for_plan_twin_and_reader():
    words = ["path.x_mm=900", "path.y_mm=0", "path.z_mm=800", "path.length_mm=100", "tool.p_deg=90", "tool.number=1"]
    job = load_job(path_file("line_y"), None, [*words, 'posture.elbow="down"'])
    planned, corrected = generate.generate(job, quiet)
    assert planned.theta[:, 2].max() > np.pi  # J2 + J3 may go to 280 deg
    assert corrected.inside
    assert_allclose(corrected.execution().theta[corrected.samples], corrected.solution.theta, atol=1e-5)
    frames = Frames({0: IDENTITY}, {1: job.tool.pose})
    poses = program_poses(loads(corrected.text), job.robot, frames)
    assert_allclose(poses.theta, corrected.execution().theta[corrected.samples], atol=1e-9)
