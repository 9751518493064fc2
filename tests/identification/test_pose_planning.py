"""Which poses can be measured, which are chosen and in what order, and what they promise, by the judge's arm."""

from dataclasses import replace

import numpy as np
import pytest
from naive_arm import flange
from numpy.testing import assert_allclose

from compgen.core.exceptions import ImpossibleError, InputError
from compgen.identification import pose_planning
from compgen.identification.model import build_model
from compgen.identification.parameters import symbolic_sources
from compgen.identification.pose_planning import Site, plan_poses, plan_reversals, visible_poses
from compgen.pipelines.files.robot_file import load_arm, load_robot


def seen(reflector, box, instrument=None, view=90.0, joints=(0, 20, -10, 0, -60, 0)):
    robot = load_robot("m710ic50")
    site = Site(
        box=np.array(box) / 1e3,
        reflector=np.array([reflector]) / 1e3,
        instrument=instrument,
        view=np.radians(view),
        noise=1e-5,
        share=0.8,
    )
    theta = robot.to_theta(np.radians([joints]))
    return bool(visible_poses(build_model(robot, (), 0), 0, site, theta)[0])


def test_the_box_holds_the_reflector_and_not_the_flange():
    """The judge's arm says where a reflector 200 mm beside and 300 mm before the flange is."""
    place = flange((0, 20, -10, 0, -60, 0)) @ np.array([200.0, 0, 300.0, 1])
    box = place[:3] + np.array([[-5.0] * 3, [5.0] * 3])
    assert seen((200, 0, 300), box)
    for axis in range(3):
        away = box + 12 * np.eye(3)[axis]
        assert not seen((200, 0, 300), away)


def test_the_instrument_is_seen_within_the_view_only():
    pose = flange((0, 20, -10, 0, -60, 0))
    everywhere = [[-1e5] * 3, [1e5] * 3]
    before = (pose @ np.array([0.0, 0, 3000, 1]))[:3] / 1e3  # straight out of the flange
    beside = (pose @ np.array([3000 * np.sin(0.5), 0, 3000 * np.cos(0.5), 1]))[:3] / 1e3  # 28.6 deg off its axis
    assert seen((0, 0, 0), everywhere, before, 1.0)
    assert seen((0, 0, 0), everywhere, beside, 29.0)
    assert not seen((0, 0, 0), everywhere, beside, 28.0)


@pytest.fixture(scope="module")
def planned():
    """Twelve poses for four zeros, of two reflectors in a box: those of the first and last joint are of the frames."""
    arm = load_arm("m710ic50")
    parts = symbolic_sources(arm.robot, arm.known, np.ones(6, bool), warm=False)
    model = build_model(arm.robot, [part for part in parts if part.original.NAME == "joint_zeros"], len(arm.nodes))
    site = Site(
        box=np.array([[0.6, -1.0, -0.6], [2.0, 1.0, 1.2]]),
        reflector=np.array([[0.06, 0.2, 0.1], [-0.1, 0.1, 0.15]]),
        instrument=np.array([4.0, 0.5, 0.3]),
        view=np.radians(80),
        noise=2e-5,
        share=0.8,
    )
    return arm.robot, model, site, plan_poses(arm.robot, model, len(arm.nodes), site, 12, lambda stage, share: None)


def reflectors_at(robot, site, theta):
    """Where the judge's arm has the reflectors at each pose, (M, R, 3) [m]."""
    frames = [flange(pendant) for pendant in np.degrees(robot.to_pendant(theta))]
    return np.array([[(T @ [*r * 1e3, 1])[:3] / 1e3 for r in site.reflector] for T in frames])


def slopes_at(robot, site, theta):
    """Of all reflectors by the zeros of J2 to J5, the instrument's turns and shifts, and the reflectors, (M, 3R, D)."""
    step, place = 1e-6, reflectors_at(robot, site, theta)
    columns = [(reflectors_at(robot, site, theta + step * np.eye(6)[k]) - place) / step for k in range(1, 5)]
    columns += [np.cross(np.eye(3)[k], place) for k in range(3)]
    columns += [np.broadcast_to(np.eye(3)[k], place.shape) for k in range(3)]
    for r in range(len(site.reflector)):
        for k in range(3):
            apart = site.reflector + step * np.eye(3)[k] * (np.arange(len(site.reflector)) == r)[:, None]
            columns.append((reflectors_at(robot, replace(site, reflector=apart), theta) - place) / step)
    return np.stack([column.reshape(len(theta), -1) for column in columns], axis=2)


def information(robot, model, site, theta):
    A = slopes_at(robot, site, theta)
    A[:, :, :4] *= model.prior
    rows = A.reshape(-1, A.shape[2]) / site.noise
    return rows.T @ rows + np.diag([1.0] * 4 + [100.0] * (A.shape[2] - 4))  # frames and reflectors to 0.1


def test_planned_poses_are_driven_from_the_nearest_to_the_nearest(planned):
    robot, _, _, plan = planned
    here, left = robot.pendant_zero, list(plan.theta)
    for pose in plan.theta:
        far = [np.abs(other - here).max() for other in left]
        assert np.abs(pose - here).max() == min(far)
        left.pop(int(np.argmin(far)))
        here = pose


def test_what_a_plan_promises_of_each_parameter_is_what_its_slopes_give(planned):
    """By difference quotients on the judge's arm."""
    robot, model, site, plan = planned
    assert len(plan.theta) == 12
    assert (plan.prior == model.prior).all()
    spread = np.sqrt(np.diag(np.linalg.inv(information(robot, model, site, plan.theta))))[:4]
    assert plan.sigma == pytest.approx(spread * model.prior, rel=1e-4)


def test_planned_poses_are_allowed_and_tell_more_than_poses_at_random(planned):
    robot, model, site, plan = planned
    middle, half = (robot.upper + robot.lower) / 2, (robot.upper - robot.lower) / 2
    assert (np.abs(plan.theta - middle) <= np.minimum(0.8 * half, np.pi) + 1e-12).all()
    assert (np.abs(plan.theta - middle).max(axis=0) > 0.5 * np.minimum(0.8 * half, np.pi)).all()
    assert visible_poses(model, 0, site, plan.theta).all()
    draws = np.random.default_rng(3).uniform(-0.8, 0.8, (20_000, 6)) * np.minimum(half, np.pi) + middle
    draws = draws[visible_poses(model, 0, site, draws)]
    best = np.linalg.slogdet(information(robot, model, site, plan.theta))[1]
    for n in range(8):
        assert np.linalg.slogdet(information(robot, model, site, draws[12 * n : 12 * n + 12]))[1] < best - 3


def test_reversal_runs_begin_where_the_joint_moves_a_reflector_farthest(planned):
    robot, model, site, plan = planned
    runs = plan_reversals(robot, model, 0, site, plan)
    assert len(runs) == 6
    steps = np.array([0.004, 0.015, 0.03, 0.07, 0.13, 0.25, 0.5, 1.2])
    offsets = np.radians([-2.2, 0, *-steps, *(steps - 1.2)])  # from below to the turn, down from it, and up again
    for joint, (poses, reflector) in enumerate(runs):
        moves = np.zeros((18, 6))
        moves[:, joint] = offsets
        tiny = 1e-5 * np.eye(6)[joint]
        lever = np.linalg.norm(
            reflectors_at(robot, site, plan.theta + tiny) - reflectors_at(robot, site, plan.theta), axis=2
        )
        fits = []
        for pose, moved in zip(plan.theta, lever, strict=True):
            run = pose + moves
            inside = (run >= robot.lower).all() and (run <= robot.upper).all()
            if inside and visible_poses(model, 0, site, run).all():
                fits.append(moved.max())
        n = int(np.abs(plan.theta - poses[1]).max(axis=1).argmin())
        assert_allclose(poses, plan.theta[n] + moves, atol=1e-12)
        assert lever[n].max() == pytest.approx(max(fits), rel=1e-6)  # of J6 all are alike
        assert reflector == np.argmax(lever[n])


def test_a_run_that_would_leave_a_joints_range_begins_on_another_pose(planned):
    robot, model, site, plan = planned
    poses, _ = plan_reversals(robot, model, 0, site, plan)[0]
    lower = robot.lower.copy()
    lower[0] = poses[1, 0] - np.radians(2.1)  # the run comes from 2.2 degrees below
    others = [theta for theta in plan.theta if theta[0] > poses[1, 0]]
    assert others
    instead, _ = plan_reversals(replace(robot, lower=lower), model, 0, site, plan)[0]
    assert any((instead[1] == theta).all() for theta in others)


def test_a_plan_is_of_two_poses_at_least_and_of_half_of_what_is_drawn_at_most(planned, monkeypatch):
    robot, model, site, _ = planned
    monkeypatch.setattr(pose_planning, "CANDIDATES", 40)

    def plan(count):
        return plan_poses(robot, model, 0, site, count, lambda stage, share: None)

    assert len(plan(2).theta) == 2
    assert len(plan(20).theta) == 20
    for count in (1, 21):
        with pytest.raises(InputError, match=rf"-n {count}: must be 2 to 20 poses"):
            plan(count)


def test_a_box_that_no_pose_is_in_is_said_with_its_corners(planned, monkeypatch):
    monkeypatch.setattr(pose_planning, "DRAWS", 20_000)
    robot, model, site, _ = planned
    nowhere = replace(site, box=site.box + np.array([9.0, 0, 0]))
    with pytest.raises(ImpossibleError, match="0 of 20000 random poses are in the box 9600 -1000 -600 to 11000 1000"):
        plan_poses(robot, model, 0, nowhere, 2, lambda stage, share: None)


def test_twice_as_many_poses_must_be_seen_as_are_planned(planned, monkeypatch):
    robot, model, site, _ = planned
    monkeypatch.setattr(pose_planning, "DRAWS", 20_000)
    narrow = replace(site, box=np.array([[1.0, -0.25, 0.1], [1.5, 0.25, 0.6]]))

    def plan(count):
        return plan_poses(robot, model, 0, narrow, count, lambda stage, share: None)

    with pytest.raises(ImpossibleError) as caught:
        plan(700)
    seen = int(str(caught.value).split()[1])
    assert 6 < seen < 200
    assert len(plan(seen // 2).theta) == seen // 2
    with pytest.raises(ImpossibleError, match=f"{seen} of 20000 random poses"):
        plan(seen // 2 + 1)
