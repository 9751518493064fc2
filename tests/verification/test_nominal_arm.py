"""The twin's nominal arm is confirmed by pinocchio, and refused where the two differ."""

import numpy as np
import pytest
from shipped import path_file, quiet

from compgen.core.evaluation import evaluate
from compgen.core.pose import Pose
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.verification.twin import TwinError, nominal_arm
from compgen.verification.twin.nominal_arm import AGREEMENT, build_grown_pose, pinocchio_difference


@pytest.mark.parametrize("wrong", [2e-12, np.nan])
def test_pinocchio_finds_one_wrong_sample_and_what_is_no_number(robot, wrong):
    rng = np.random.default_rng(4)
    theta, growth = rng.uniform(-1, 1, (40, 6)), 1e-4 * rng.normal(size=(40, 6))
    tool = Pose(np.array([0.1, 0.02, 0.3]), np.eye(3))
    pose = Pose.from_rows(*evaluate(build_grown_pose(robot, tool), theta, growth))
    assert pinocchio_difference(robot, tool, theta, growth, pose) < 1e-14
    position, rotation = pose.position.copy(), pose.rotation.copy()
    position[17, 1] += wrong
    rotation[17, 0, 1] += wrong
    for off in (Pose(position, pose.rotation), Pose(pose.position, rotation)):
        assert not pinocchio_difference(robot, tool, theta, growth, off) <= AGREEMENT


def test_an_arm_that_pinocchio_does_not_know_is_refused(monkeypatch):
    """The confirmation bites: a length wrong by a nanometre in the twin's own expression."""
    job = load_job(path_file("line_y"))
    nominal_lengths = nominal_arm.nominal_lengths
    calls = []

    def wrong(robot):
        calls.append(1)
        lengths = list(nominal_lengths(robot))
        lengths[2] += 1e-9 if len(calls) <= 24 else 0.0  # while the expressions are built, not in pinocchio's arm
        return tuple(lengths)

    monkeypatch.setattr(nominal_arm, "nominal_lengths", wrong)
    with pytest.raises(TwinError, match="cannot be trusted"):
        generate.predict(job, quiet)


@pytest.mark.parametrize("zero", [[0, 0, 0, 0, 0, 0], [20, -60, 35, -15, 40, 180]])
def test_a_pendant_with_another_zero_is_the_same_arm_at_the_same_places(zero):
    """Other makers count J2 from other poses; the twin refused them: *the inverse kinematics cannot be trusted*."""
    limits = [f"robot.limits.j{i}_deg=[-300, 300]" for i in (1, 2, 4, 5, 6)]
    override = f"robot.pendant.offset_deg={zero}"
    other = generate.predict(load_job(path_file("line_y"), overrides=[override, *limits]), quiet)
    usual = generate.predict(load_job(path_file("line_y"), overrides=limits), quiet)
    assert np.abs(other.deviation().error - usual.deviation().error).max() < 1e-12
