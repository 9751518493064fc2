"""An arm as six turns about fixed lines: the model's own flange poses, cold and hot, and what is left out."""

import numpy as np
import pytest
from shipped import ROOT

from compgen.core.pose import Pose
from compgen.error_model.model import build_error_model
from compgen.error_model.rigid_chain import rigid_chain
from compgen.pipelines.files.robot_file import load_arm
from compgen.robot.kinematics import flange_pose

RNG = np.random.default_rng(5)


@pytest.mark.parametrize("name", ["m710ic50", "lrmate200id", "ur5", "irb120"])
def test_a_cold_arm_is_its_nominal_chain(name):
    arm = load_arm(name)
    chain = rigid_chain(arm.robot, (), np.zeros(0))
    q = RNG.uniform(-3, 3, (1000, 6))
    nominal = flange_pose(arm.robot, arm.robot.to_theta(np.zeros(6)) + q)
    assert np.abs(chain.flange_pose(q).position - nominal.position).max() < 1e-9
    assert np.abs(chain.flange_pose(q).rotation - nominal.rotation).max() < 1e-9
    assert chain.left_out == ()


@pytest.fixture(name="flawed")
def _flawed(tmp_path):
    text = (ROOT / "robots" / "m710ic50.toml").read_text() + (ROOT / "tests" / "flawed_sources.toml").read_text()
    (tmp_path / "flawed.toml").write_text(text)
    return load_arm(str(tmp_path / "flawed.toml"))


def test_a_hot_arm_with_errors_is_what_the_model_says(flawed):
    sources, rise = [known.source for known in flawed.known], np.array([11.0, 3.9, 13.0, 3.0, 2.3])
    chain = rigid_chain(flawed.robot, sources, rise)
    kept = [source for source in sources if source.NAME not in chain.left_out]
    assert kept
    assert chain.left_out
    q = RNG.uniform(-1, 1, (1000, 6))
    theta = flawed.robot.to_theta(np.zeros(6)) + q
    model = build_error_model(flawed.robot, kept, 5, Pose(np.zeros(3), np.eye(3)))
    expected = model.actual_pose(theta, np.tile(rise, (1000, 1)))
    assert np.abs(chain.flange_pose(q).position - expected.position).max() < 1e-9
    assert np.abs(chain.flange_pose(q).rotation - expected.rotation).max() < 1e-9
    assert 1e-6 < chain.off < 0.05


def test_heat_moves_the_chain_by_what_the_arm_grows():
    arm = load_arm("m710ic50")
    sources = [known.source for known in arm.known]
    cold, hot = (rigid_chain(arm.robot, sources, r) for r in (np.zeros(5), np.array([11.0, 3.9, 13.0, 3.0, 2.3])))
    assert np.abs(cold.flange.position - rigid_chain(arm.robot, (), np.zeros(0)).flange.position).max() < 1e-12
    assert 5e-5 < np.linalg.norm(hot.flange.position - cold.flange.position) < 3e-4


@pytest.mark.parametrize(
    ("table", "name", "least_um", "most_um"),
    [
        # 3 mdeg at 1.5 to 2.3 m from axis 1
        (
            "[sources.hysteresis]\nbacklash_mdeg = [3, 0, 0, 0, 0, 0]\nwidth_mdeg = [9, 9, 9, 9, 9, 9]",
            "hysteresis",
            78,
            121,
        ),
        # the reverse way at an end is 200 um off along x and 50 along z, the forward way 100 and 50
        (
            "[[sources.map]]\naxis = 'y'\nat_mm = [1350, 0, 203]\nstation_mm = [-700, 0, 700]\n"
            "forward_um = [[100, 0, 50], [0, 20, 0], [0, 0, 0]]\nreverse_um = [[200, 0, 50], [0, 20, 0], [0, 0, 0]]",
            "map",
            206.1,
            206.2,
        ),
    ],
)
def test_what_depends_on_the_side_that_joints_come_from_is_left_out(tmp_path, table, name, least_um, most_um):
    (tmp_path / "played.toml").write_text((ROOT / "robots" / "m710ic50.toml").read_text() + table + "\n")
    arm = load_arm(str(tmp_path / "played.toml"))
    chain = rigid_chain(arm.robot, [known.source for known in arm.known], np.zeros(5))
    assert chain.left_out == (name,)
    assert least_um < chain.off * 1e6 < most_um
