"""The conduction network: integration, energy, losses, and the study's temperatures."""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from shipped import path_file

from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.rotations import rotation_matrix
from compgen.core.units import HOUR
from compgen.error_model.model import build_error_model
from compgen.error_model.sources.thermal_growth import ThermalGrowth
from compgen.job.motion_plan import plan_written_motion
from compgen.pipelines.files.path_file import load_job
from compgen.thermal import Ambient, Duty, JointMotion, drive_losses, rise_history, rises_during, state_after
from compgen.thermal.drive_losses import joint_torques, mean_losses, moving_losses
from compgen.thermal.model import extrapolations, with_losses
from compgen.thermal.network import Body, Housing, NetworkModel, assemble_volumes, modal_form

sys.path.insert(0, str(Path(__file__).parents[2] / "robots"))
import m710ic50_network_fit as network_fit

HOT = (15.0, 60.0, 20.0, 0.5, 4.0, 3.0)  # W


@pytest.fixture(scope="module")
def warm():
    return load_job(path_file("circle_1300"), overrides=["robot.thermal.model=network"])


@pytest.fixture(scope="module")
def heat(warm):
    return warm.heat


def derivative(heat, air=None):
    """dT/dt of the volumes, written down from the conduction equation: no modes."""
    v = heat.volumes

    def f(t, rise, power):
        u = 0.0 if air is None else air.at(np.array([t]))[0]
        return (-v.laplacian @ rise + v.film * (u - rise) + v.power @ power) / v.capacity

    return f


def test_agrees_with_a_stiff_solver(heat):
    air = Ambient(np.array([0.0, 2 * HOUR, 9 * HOUR]), np.array([0.0, 3.0, -1.0]), 0.5, 24 * HOUR, 15 * HOUR)
    duties = [
        Duty("moving", 0.2, 3 * HOUR, loss=HOT),
        Duty("off", 0.0, 2 * HOUR),
        Duty("moving", 0.1, 7 * HOUR, loss=tuple(0.4 * p for p in HOT)),
    ]
    f, rise, t = derivative(heat, air), heat.to_volumes @ state_after(heat, [], air=air), 0.0
    jacobian = -(heat.volumes.laplacian + np.diag(heat.volumes.film)) / heat.volumes.capacity[:, None]
    expected, times = [], []
    for duty in duties:
        power = np.array(duty.loss or (0.0,) * 6)
        now = np.linspace(t, t + duty.duration, 7)[1:]
        knots = [k for k in air.time if t < k < t + duty.duration]
        for end in [*knots, t + duty.duration]:
            at = now[(now > t) & (now <= end)]
            solution = solve_ivp(
                f, (t, end), rise, "Radau", np.unique([*at, end]), args=(power,), jac=lambda *_: jacobian,
                rtol=1e-9, atol=1e-10,
            )  # fmt: skip
            expected += [solution.y[:, np.searchsorted(solution.t, a)] for a in at]
            times += list(at)
            rise, t = solution.y[:, -1], end
    every = replace(heat, probe=np.eye(len(heat.rate)), reference_rise=np.ones(len(heat.rate)))
    assert np.max(expected) > 5
    assert_allclose(rise_history(every, duties, np.array(times), air=air), expected, atol=1e-6)  # K


def test_twelve_hours_of_a_hundred_volumes_every_second_are_a_hundred_times_faster(heat):
    """A working day as a robot lives it: 154 s of program, 40 s of rest, and so on; every volume at every second."""
    bodies = [
        Body(
            name=b.name,
            length=b.length,
            volumes=19 if b.name != "d6" else 20,
            capacity=b.capacity,
            conductance=b.conductance,
            film=b.film,
        )
        for b in heat.bodies
    ]
    volumes = assemble_volumes(bodies, heat.housings, heat.floor)
    assert len(volumes.capacity) == 100
    rate, shapes = modal_form(volumes)
    fine = replace(heat, volumes=volumes, rate=rate, to_volumes=shapes, probe=np.eye(100), reference_rise=np.ones(100))
    cycle = [Duty("moving", 0.2, 154.0, loss=HOT), Duty("idle", 0.0, 40.0, loss=(0.0, 25.0, 8.0, 0.0, 0.0, 0.0))]
    duties, times = cycle * 223, np.arange(12 * 3600 + 1.0)
    spent = []
    for _ in range(12):  # the least of them: neighbours on the machine cost a short run more than a long one
        begin = time.process_time()
        by_modes = rise_history(fine, duties, times)
        spent.append(time.process_time() - begin)
    f = derivative(fine)
    jacobian = -(volumes.laplacian + np.diag(volumes.film)) / volumes.capacity[:, None]
    some = 20 * len(cycle)  # stretches that the solver does: the rest costs it the same
    begin, rise, now, by_solver = time.process_time(), np.zeros(100), 0.0, []
    for duty in duties[:some]:
        end = now + duty.duration
        at = np.append(np.arange(np.ceil(now), end), end)
        solution = solve_ivp(
            f, (now, end), rise, "BDF", at, args=(np.array(duty.loss),), jac=lambda *_: jacobian, rtol=1e-9, atol=1e-9
        )
        rise, now = solution.y[:, -1], end
        by_solver.append(solution.y[:, :-1].T)
    solver = (time.process_time() - begin) * len(duties) / some
    solved = np.vstack(by_solver)
    assert_allclose(by_modes[: len(solved)], solved, atol=1e-6)  # K
    print(f"modes {min(spent):.3f} s, BDF {solver:.1f} s, ratio {solver / min(spent):.0f}")
    assert solver > 100 * min(spent)


def energy_balance(network, power, start, duration):
    """Heat in, heat out and heat stored over a stretch of constant losses in still air, exactly [J]."""
    goal = network.steady_state_of(power)
    approach = -np.expm1(-network.rate * duration)  # share of the way to the goal
    mean = goal * duration + (start - goal) * approach / network.rate
    lost = float(network.volumes.film @ (network.to_volumes @ mean))
    change = network.to_volumes @ ((goal - start) * approach)
    return float((network.volumes.power @ power).sum() * duration), lost, float(network.volumes.capacity @ change)


def test_energy_balance_closes(heat):
    power = np.array(HOT)
    for duration in (60.0, HOUR, 100 * HOUR):
        start = heat.state_of(np.linspace(-1, 8, len(heat.rate)))
        heat_in, heat_out, stored = energy_balance(heat, power, start, duration)
        assert heat_in == pytest.approx(sum(HOT) * duration, rel=1e-12)
        assert abs(heat_in - heat_out - stored) <= 1e-9 * (abs(heat_in) + abs(heat_out) + abs(stored))
    # what is stored and what leaves is seen by the outputs as well, not only by the same formula
    end = state_after(heat, [Duty("moving", 0.2, HOUR, loss=HOT)], start)
    _, heat_out, stored = energy_balance(heat, power, start, HOUR)
    assert heat.volumes.capacity @ heat.to_volumes @ (end - start) == pytest.approx(stored, rel=1e-9)
    every = replace(heat, probe=np.eye(len(heat.rate)), reference_rise=np.ones(len(heat.rate)))
    x, w = np.polynomial.legendre.leggauss(200)
    rises = rise_history(every.starting(start), [Duty("moving", 0.2, HOUR, loss=HOT)], (x + 1) / 2 * HOUR)
    assert heat_out == pytest.approx(float(w @ (rises @ heat.volumes.film)) * HOUR / 2, rel=1e-6)


def test_a_bar_heated_at_one_end_takes_its_textbook_shape():
    """A fin of 1 m, housings that weigh nothing at its ends: T = q cosh(m (L - x)) / (k A m sinh(m L))."""
    k, film, q = 2.0, 3.0, 10.0  # W m/K, W/K, W
    bodies = [
        Body(name="a", length=1e-3, volumes=1, capacity=1e-6, conductance=1e3, film=0.0),
        Body(name="fin", length=1.0, volumes=400, capacity=100.0, conductance=k, film=film),
    ]
    volumes = assemble_volumes(
        bodies, [Housing(name="end", capacity=1e-6, film=0.0, inward=1e-9, outward=1e9, drives=(0,))], 1e-12
    )
    matrix = volumes.laplacian + np.diag(volumes.film)
    rise = np.linalg.solve(matrix, volumes.power @ np.array([q, 0, 0, 0, 0, 0]))
    fin = volumes.part == 2
    m, x = np.sqrt(film / k), volumes.place[fin]
    assert_allclose(rise[fin], q * np.cosh(m * (1 - x)) / (k * m * np.sinh(m)), rtol=1e-5)


def test_quoted_temperatures_are_met(heat):
    off = network_fit.misses(heat)
    assert len(off) == 24
    assert np.sqrt(np.mean(off**2)) <= 0.55  # K
    assert np.abs(off).max() <= 1.15  # K


def test_shipped_parameters_are_the_fit(heat):
    best, _ = network_fit.fit(heat)
    drives = heat.drives
    for name in ("holding", "coulomb", "viscous"):
        assert getattr(drives, name) == pytest.approx(getattr(best.drives, name), rel=0.01)
    assert_allclose([b.film for b in heat.bodies], [b.film for b in best.bodies], rtol=0.01)
    assert_allclose([h.outward for h in heat.housings], [h.outward for h in best.housings], rtol=0.01)


def test_first_three_hours_are_linear_and_sixteen_cool(warm, heat):
    duty = warm.history.before[0]
    hours = np.linspace(0, 3, 60)
    rises = rise_history(heat, [replace(duty, duration=3 * HOUR)], hours * HOUR)
    for name in ("j2", "j3", "link1", "wrist"):
        rise = rises[:, heat.names.index(name)]
        assert np.abs(rise - np.polyval(np.polyfit(hours, rise, 1), hours)).max() <= 0.4  # K
    left = heat.outputs @ state_after(heat, [duty, Duty("off", 0.0, 16 * HOUR)])
    assert left[heat.names.index("j3")] <= 1.6  # K
    assert left[heat.names.index("j2")] <= 1.6


def test_doubling_the_speed_is_told_as_it_comes_out(heat):
    """Heisel: 1.5 times the steady rise, time constant unchanged. Not in the fit; the docs give these numbers."""
    ratios = network_fit.doubling(heat)
    assert ratios["j3"] == pytest.approx(1.39, abs=0.03)
    assert ratios["j2"] == pytest.approx(1.32, abs=0.03)


def test_torques_are_those_of_hanging_masses(warm, heat):
    """Gravity alone, by moving the joints: tau = d(potential energy)/dq from the closed chain."""
    rng = np.random.default_rng(3)
    theta = rng.uniform(-1.5, 1.5, (8, 6)) + warm.robot.pendant_zero
    still = np.zeros_like(theta)
    aside = np.array([0.05, -0.08, 0.0])  # off the flange's axis: which way J4 and J6 turn counts
    centre = heat.drives.payload_centre + aside
    load = replace(heat.drives, link_mass=np.zeros(6), payload_centre=centre)  # alone: its height is that of the tool
    twin_height = []
    model = build_error_model(warm.robot, (), 0, Pose(centre, np.eye(3)))
    for i in range(6):
        h = 1e-5
        ends = [model.nominal_pose(theta + s * h * np.eye(6)[i]).position[:, 2] for s in (1, -1)]
        twin_height.append((ends[0] - ends[1]) / (2 * h))
    expected = 9.81 * heat.drives.payload_mass * np.array(twin_height).T
    assert_allclose(joint_torques(warm.robot, load, theta, still, still), expected, atol=1e-4)


def test_losses_are_power_times_shares(warm, heat):
    """A joint turned at constant speed about the vertical: friction alone."""
    weightless = replace(heat.drives, link_mass=np.zeros(6), payload_mass=0.0)
    time_ = np.linspace(0, 10, 50)
    theta = np.zeros((50, 6)) + warm.robot.pendant_zero
    theta[:, 0] = 0.3 * time_
    motion = JointMotion(time_, theta, np.ones(49))
    moving, held = moving_losses(warm.robot, weightless, motion), mean_losses(warm.robot, weightless, motion).held
    share = 0.3 / warm.robot.speed[0]
    expected = 4300 * (heat.drives.coulomb * share + heat.drives.viscous * share**2)
    assert_allclose(moving[:, 0], expected, rtol=1e-9)
    assert_allclose(moving[:, 1:], 0, atol=1e-12)
    assert_allclose(held, 0, atol=1e-12)


def test_a_load_that_is_speeded_up_costs_its_inertia(warm, heat):
    """J1 turned about the vertical ever faster, at uneven waypoints: its torque is m r^2 times the acceleration."""
    bare = replace(heat.drives, link_mass=np.zeros(6), coulomb=0.0, viscous=0.0)
    time_ = np.cumsum(np.tile([0.01, 0.03], 40))
    theta = np.zeros((80, 6)) + warm.robot.pendant_zero
    tool = build_error_model(warm.robot, (), 0, Pose(bare.payload_centre, np.eye(3)))
    inertia = bare.payload_mass * np.sum(tool.nominal_pose(theta[:1]).position[0, :2] ** 2)
    most = warm.robot.acceleration[0]
    for asked, driven in ((0.4, 0.4), (-1.5, -1.5), (3 * most, most)):  # the last: a corner of the way
        theta[:, 0] = warm.robot.pendant_zero[0] + asked * time_**2 / 2
        loss = moving_losses(warm.robot, bare, JointMotion(time_, theta, np.ones(79)))[1:-1, 0]
        torque = inertia * driven
        assert_allclose(loss, bare.holding * torque**2 * bare.rated_speed[0] ** 2 / bare.rated_power[0], rtol=1e-6)


def test_mean_losses_of_a_long_program_are_the_means_over_its_time(warm, heat):
    rng = np.random.default_rng(5)
    time_ = np.cumsum(rng.uniform(0.01, 0.1, 5001))  # more segments than torques are worked out on
    theta = np.cumsum(rng.normal(0.0, 1e-3, (5001, 6)), axis=0) + warm.robot.pendant_zero
    motion = JointMotion(time_, theta, np.ones(5000))
    losses = moving_losses(warm.robot, heat.drives, motion)
    assert np.ptp(losses[:, 1]) > 1.0  # W: they vary
    mean = np.diff(time_) @ losses / (time_[-1] - time_[0])
    assert_allclose(mean_losses(warm.robot, heat.drives, motion).moving, mean, rtol=1e-9)


def test_a_duty_at_half_the_feed_has_the_losses_of_a_program_twice_as_long(warm, heat):
    time_ = np.linspace(0, 10, 41)
    theta = 0.3 * np.sin(time_[:, None] + np.arange(6)) + warm.robot.pendant_zero
    motion = JointMotion(time_, theta, np.append(np.full(20, 0.15), np.full(20, 0.05)))  # 0.1 m/s in the mean
    duties = [Duty("moving", 0.05, HOUR, 0.6), Duty("idle", 0.0, HOUR), Duty("off", 0.0, HOUR)]
    moving, idle, off = with_losses(heat, duties, motion)
    slow = mean_losses(warm.robot, heat.drives, JointMotion(2 * time_, theta, motion.driven / 2))
    assert slow.moving[0] < 0.9 * mean_losses(warm.robot, heat.drives, motion).moving[0]
    assert_allclose(moving.loss, 0.6 * np.array(slow.moving) + 0.4 * np.array(slow.held))
    assert_allclose(idle.loss, slow.held)
    assert replace(moving, loss=()) == duties[0]
    assert off == duties[2]


def test_what_a_program_waits_is_no_part_of_a_duty_that_moves(warm, heat):
    """An hour in the middle of ten seconds: at the feed of a duty the arm would have to race to make up for it."""
    time_ = np.linspace(0, 10, 41)
    theta = 0.3 * np.sin(time_[:, None] + np.arange(6)) + warm.robot.pendant_zero
    motion, duty = JointMotion(time_, theta, np.full(40, 0.1)), Duty("moving", 0.05, HOUR)
    later = np.insert(time_ + np.where(np.arange(41) > 20, HOUR, 0.0), 21, time_[20] + HOUR)
    waiting = JointMotion(later, np.insert(theta, 21, theta[20], axis=0), np.insert(motion.driven, 20, 0.0))
    (plain,), (waited,) = (with_losses(heat, [duty], each) for each in (motion, waiting))
    assert_allclose(waited.loss, plain.loss, rtol=0.02)


def test_between_the_segments_whose_torques_are_worked_out_heat_is_straight_in_time(warm, heat, monkeypatch):
    rng, bare = np.random.default_rng(5), replace(heat.drives, coulomb=0.0, viscous=0.0)
    time_ = np.cumsum(rng.uniform(0.01, 0.1, 5001))
    theta = np.cumsum(rng.normal(0.0, 1e-3, (5001, 6)), axis=0) + warm.robot.pendant_zero
    motion = JointMotion(time_, theta, np.ones(5000))
    sampled = moving_losses(warm.robot, bare, motion)
    monkeypatch.setattr(drive_losses, "SAMPLES", 10**5)
    whole = moving_losses(warm.robot, bare, motion)
    rows = np.unique(np.linspace(0, 4999, 2000).astype(int))
    middle = time_[:-1] + np.diff(time_) / 2
    assert_allclose(sampled, np.column_stack([np.interp(middle, middle[rows], w) for w in whole[rows].T]), rtol=1e-9)


def test_standing_in_a_programs_poses_costs_what_holds_them(warm, heat):
    rng = np.random.default_rng(6)
    time_ = np.cumsum(rng.uniform(0.01, 0.1, 41))
    theta = np.cumsum(rng.normal(0.0, 0.05, (41, 6)), axis=0) + warm.robot.pendant_zero
    still, d = np.zeros((40, 6)), heat.drives
    torque = joint_torques(warm.robot, d, (theta[1:] + theta[:-1]) / 2, still, still)
    loss = d.holding * torque**2 * d.rated_speed**2 / d.rated_power
    held = mean_losses(warm.robot, d, JointMotion(time_, theta, np.ones(40))).held
    assert held[1] > 1.0  # W
    assert_allclose(held, np.diff(time_) @ loss / (time_[-1] - time_[0]), rtol=1e-9)


def test_mean_of_a_program_warms_like_the_program(warm, heat):
    motion = plan_written_motion(warm.plan, warm.cell, warm.feed).joint_motion
    _, end = rises_during(heat, state_after(heat, warm.history.before), motion)
    mean = replace(warm.history.before[0], duration=float(motion.time[-1]))
    assert_allclose(heat.outputs @ end, heat.outputs @ state_after(heat, [*warm.history.before, mean]), atol=2e-3)  # K


def test_along_a_link_the_means_are_those_that_grow(heat, warm):
    state = warm.state()
    inside = heat.volumes.part == 2 * [body.name for body in heat.bodies].index("a2")
    x = (np.arange(2000) + 0.5) / 2000 * 0.87
    mean = np.interp(x, heat.volumes.place[inside], (heat.to_volumes @ state)[inside]).mean()
    assert mean == pytest.approx((heat.outputs @ state)[heat.names.index("a2")], rel=0.01)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("robot.thermal.network.housing.0.drives=[]", ("drives", "each of 1 to 6")),
        ("robot.thermal.network.body.2.length_mm=800", ("'a2'", "870")),
        ("robot.thermal.network.body.2.name=a9", ("'a2'", "add it")),
        ("robot.thermal.network.probe.0.part=nowhere", ("probe.0.part", "nowhere")),
        ("robot.thermal.network.floor_W_K=-1", ("floor_W_K", "greater")),
        ("robot.thermal.model=magic", ("thermal.model", "network")),
    ],
)
def test_what_is_wrong_in_a_network_is_said(change, words):
    with pytest.raises(InputError) as refusal:
        load_job(path_file("line_y"), overrides=["robot.thermal.model=network", change])
    assert all(w in str(refusal.value) for w in words), refusal.value


def test_a_column_that_the_network_heats_lifts_the_arm():
    """World's origin stands on top of the column, so the nominal d1 is zero and its profile says how tall it is."""
    column = 'robot.thermal.profile.3={length="d1",sections=[{to_mm=565,from="j2",to="j2",shape="linear"}]}'
    network = ["robot.thermal.model=network", "robot.thermal.network.body.0.name=d1", column]
    job = load_job(path_file("circle_1300"), overrides=network)
    (growth,) = job.sources
    assert isinstance(growth, ThermalGrowth)
    assert_allclose(growth.d[0, job.heat.names.index("d1")], 11.25e-6 * 0.565)  # m/K


def test_cold_is_outside_the_box_as_heat_is(heat):
    rise = np.full((1, len(heat.names)), -38.0)
    assert any("-38.0 K lies further below zero" in text for text in extrapolations(heat, [], 0.2, 60.0, rise))


def test_torques_are_those_of_the_same_masses_whatever_pose_the_pendant_calls_zero(warm, heat):
    """Centres are given as the arm stands at pendant zero: where it stands otherwise they are other numbers."""
    rng = np.random.default_rng(3)
    theta = rng.uniform(-1.5, 1.5, (8, 6))
    still = np.zeros_like(theta)
    zero = warm.robot.pendant_zero + np.array([0.4, 0, 0, 0, 0, 0])
    other = replace(warm.robot, pendant_zero=zero)
    turned = heat.drives.link_centre @ rotation_matrix(np.array([0, 0, 0.4])).T
    expected = joint_torques(warm.robot, heat.drives, theta, still, still)
    assert_allclose(
        joint_torques(other, replace(heat.drives, link_centre=turned), theta, still, still), expected, atol=1e-9
    )


@pytest.mark.parametrize(("gravity", "held"), [("[0, 0, -9.80665]", 0.0), ("[3, 0, 0]", 131.439 * 9.81)])
def test_drives_of_an_arm_on_a_wall_hold_it_against_its_own_gravity(gravity, held):
    """J1 held nothing, whatever the file said of gravity; the sum over links and payload is by hand, in kg m."""
    overrides = ["robot.thermal.model=network", f"robot.sources.loads.gravity_m_s2={gravity}"]
    job = load_job(path_file("circle_1300"), overrides=overrides)
    theta = job.robot.pendant_zero + np.pi / 2 * np.eye(6)[0]  # the arm lies across gravity
    still = np.zeros((1, 6))
    assert isinstance(job.heat, NetworkModel)
    torque = joint_torques(job.robot, job.heat.drives, theta[None], still, still)[0, 0]
    assert abs(torque) == pytest.approx(held, rel=1e-4, abs=1e-9)
