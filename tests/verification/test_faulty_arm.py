"""The twin's faults against the optimiser's chain: two codes for the same physics, source by source and together."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from flawed import COUNT, flawed_file

from compgen.core.pose import Pose
from compgen.core.rotations import rotation_matrix
from compgen.core.units import UM
from compgen.error_model.direction_memory import DirectionState, direction_states, reversal_widths
from compgen.error_model.model import build_error_model
from compgen.error_model.sources import ORDER
from compgen.error_model.sources.hysteresis import Hysteresis
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.files.twin_of_job import faults_of
from compgen.verification.twin import Twin
from compgen.verification.twin.direction_history import DirectionHistory, joint_side, recurrence
from compgen.verification.twin.faulty_arm import TwinError, build_faulty_arm

TOOL = Pose(np.array([0.05, -0.03, 0.25]), rotation_matrix(np.array([0.2, -0.4, 0.1])))
ATOL_M, ATOL_RAD = 1e-10, 1e-11


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    return load_cell(flawed_file(tmp_path_factory.mktemp("robot")))


def motion(cell, count=400):
    """A smooth random motion with many reversals, and rises."""
    rng = np.random.default_rng(7)
    t = np.linspace(0, 20, count)[:, None]
    middle, half = (cell.robot.upper + cell.robot.lower) / 2, (cell.robot.upper - cell.robot.lower) / 2
    theta = middle + 0.4 * half * np.sin(t * rng.uniform(0.3, 1.5, 6) + rng.uniform(0, 6, 6))
    return theta, rng.uniform(-5, 14, (count, 5))


def chain_and_twin(cell, sources, theta, rise):
    model = build_error_model(cell.robot, sources, 5, TOOL)
    nominal = model.nominal_pose(theta).position
    chain = model.actual_pose(theta, rise, direction_states(reversal_widths(sources), theta, nominal))
    twin = Twin(robot=cell.robot, heat=cell.heat, profiles=cell.profiles, tool=TOOL, faults=faults_of(sources))
    return chain, twin.actual_pose(theta, rise, lambda share: None), nominal


def test_chain_and_twin_agree_with_every_source_on(cell):
    chain, twin_pose, nominal = chain_and_twin(cell, cell.sources, *motion(cell))
    assert np.abs(chain.position - twin_pose.position).max() < ATOL_M
    assert np.abs(chain.rotation - twin_pose.rotation).max() < ATOL_RAD
    assert np.linalg.norm(chain.position - nominal, axis=1).min() > 100 * UM  # the set-up bites


@pytest.mark.parametrize("number", range(COUNT))
def test_chain_and_twin_agree_on_each_source_alone(cell, number):
    theta, rise = motion(cell, 60)
    one = tuple(cell.sources[k] for k in sorted({0, number}))  # the twin always grows
    chain, twin_pose, _ = chain_and_twin(cell, one, theta, rise)
    assert np.abs(chain.position - twin_pose.position).max() < ATOL_M
    assert np.abs(chain.rotation - twin_pose.rotation).max() < ATOL_RAD
    if number:
        without, *_ = chain_and_twin(cell, one[:1], theta, rise)
        assert np.abs(chain.position - without.position).max() > 5 * UM  # the source does something


def test_all_sources_are_in_the_test(cell):
    assert len(cell.sources) == COUNT
    assert {type(s) for s in cell.sources} == set(ORDER)


def test_the_faults_come_from_the_motion_executed(cell):
    """Backwards over the same places, the arm stands elsewhere: by twice its half-widths."""
    theta, rise = motion(cell)
    forwards = chain_and_twin(cell, cell.sources, theta, rise)[1].position
    backwards = chain_and_twin(cell, cell.sources, theta[::-1], rise[::-1])[1].position
    assert np.linalg.norm(forwards - backwards[::-1], axis=1).max() > 30 * UM


def test_chain_and_twin_agree_on_the_play_law(cell):
    play = tuple(replace(s, law="play") if isinstance(s, Hysteresis) else s for s in cell.sources)
    theta, rise = motion(cell)
    chain, twin_pose, _ = chain_and_twin(cell, play, theta, rise)
    assert np.abs(chain.position - twin_pose.position).max() < ATOL_M
    dahl = chain_and_twin(cell, cell.sources, theta, rise)[0]
    assert np.abs(chain.position - dahl.position).max() > 5 * UM  # the law does something


@pytest.mark.parametrize("parts", [1, 2, 7])
def test_play_walked_in_parts_is_the_recursion(parts):
    rng = np.random.default_rng(4)
    theta, width = rng.normal(size=(101, 6)).cumsum(axis=0), np.full(6, 1.5)
    u = np.clip(rng.normal(size=6), -1, 1)
    expected = [u]
    for step in np.diff(theta, axis=0):
        expected.append(np.clip(expected[-1] + step / width, -1, 1))
    walked, state = [u[None]], u
    for rows in np.array_split(np.arange(100), parts):
        walked.append(joint_side(theta[rows[0] : rows[-1] + 2], width, state, "play")[1:])
        state = walked[-1][-1]
    np.testing.assert_allclose(np.vstack(walked), expected, atol=1e-13)
    assert (np.abs(expected) == 1).any()


def test_the_side_a_joint_came_from_is_the_dahl_state():
    theta = np.array([[0.0], [1.0], [1.0], [0.5]]) * np.ones(6)
    u = joint_side(theta, np.full(6, 0.25), np.zeros(6))
    first = 1 - np.exp(-4)
    np.testing.assert_allclose(u[:, 0], [0, first, first, (1 + first) * np.exp(-2) - 1], atol=1e-15)


def test_a_wrong_fault_in_the_twin_is_seen(cell):
    theta, rise = motion(cell, 50)
    model = build_error_model(cell.robot, cell.sources, 5, TOOL)
    nominal = model.nominal_pose(theta).position
    chain = model.actual_pose(theta, rise, direction_states(reversal_widths(cell.sources), theta, nominal)).position
    faults = faults_of(cell.sources)
    assert faults is not None
    for name in (
        "joint_zeros",
        "joint_coupling",
        "compliance",
        "gear_harmonics",
        "backlash",
        "base_frame",
        "tool_frame",
        "link_offsets",
        "force",
        "mass",
    ):
        wrong = replace(faults, **{name: 1.1 * getattr(faults, name)})
        twin = Twin(robot=cell.robot, heat=cell.heat, profiles=cell.profiles, tool=TOOL, faults=wrong)
        assert np.abs(twin.actual_pose(theta, rise, lambda share: None).position - chain).max() > 1 * UM


def test_a_still_arm_has_no_direction(cell):
    theta = np.tile(motion(cell, 3)[0][:1], (4, 1))
    assert not joint_side(theta, np.full(6, 0.01), np.zeros(6)).any()
    still = direction_states(reversal_widths(cell.sources), theta, np.zeros((4, 3)))
    assert not still.direction.any()
    assert not still.travel.any()
    assert isinstance(still, DirectionState)


def test_states_that_keep_a_share_are_walked_side_by_side_as_one_by_one():
    rng = np.random.default_rng(3)
    for steps in (0, 1, 2, 3, 17, 400):
        left, more, now = rng.random((steps, 1)), rng.normal(size=(steps, 3)), rng.normal(size=3)
        plain = [now]
        for share, gain in zip(left, more, strict=True):
            plain.append(share * plain[-1] + gain)
        assert np.allclose(recurrence(left, more, now), plain, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("moved", [3, 6])
def test_an_arm_that_pinocchio_does_not_confirm_is_refused(cell, moved):
    theta, rise = motion(cell, 60)
    faults = faults_of(cell.sources)
    assert faults is not None
    arm = build_faulty_arm(cell.robot, faults)
    tool = Pose.stack([TOOL])
    arm.actual_pose(theta, {}, rise, tool, DirectionHistory(), 1)
    bent = arm.model.copy()
    bent.jointPlacements[moved] = bent.jointPlacements[moved] * pin.SE3(np.eye(3), np.array([0, 0, 1e-9]))
    with pytest.raises(TwinError, match="cannot be trusted"):
        replace(arm, model=bent).actual_pose(theta, {}, rise, tool, DirectionHistory(), 1)


def test_chain_and_twin_agree_whatever_pose_the_pendant_calls_zero(tmp_path):
    file = tmp_path / "other.toml"
    text = Path(flawed_file(tmp_path)).read_text()
    old = "offset_deg = [0, -90, 0, 0, 0, 0]"
    assert old in text
    file.write_text(text.replace(old, "offset_deg = [20, -60, 35, -15, 0, 180]"))
    cell = load_cell(str(file))
    chain, twin_pose, _ = chain_and_twin(cell, cell.sources, *motion(cell))
    assert np.abs(chain.position - twin_pose.position).max() < ATOL_M
    assert np.abs(chain.rotation - twin_pose.rotation).max() < ATOL_RAD


def test_a_length_below_zero_grows_away_from_zero_on_both_sides(tmp_path):
    """The twin drew an elbow that hangs below its axis nearer: right programs were 'outside', by twice its growth."""
    file = tmp_path / "other.toml"
    text = Path(flawed_file(tmp_path)).read_text()
    assert "a_mm = [150, 870, 170, 0" in text
    file.write_text(text.replace("a_mm = [150, 870, 170, 0", "a_mm = [150, 870, -170, 0"))
    cell = load_cell(str(file))
    chain, twin_pose, _ = chain_and_twin(cell, cell.sources, *motion(cell))
    assert np.abs(chain.position - twin_pose.position).max() < ATOL_M


def test_an_arm_of_three_tonnes_is_confirmed(cell):
    """Gravity turns J1 by the rounding of what it turns J2 by: *the twin cannot be trusted* was said."""
    theta, rise = motion(cell)
    faults = faults_of(cell.sources)
    assert faults is not None
    beside = faults.centre + np.array([0.1, 0.2, 0.1])
    heavy = replace(faults, force=np.zeros(3), mass=10 * faults.mass, centre=beside)
    arm = build_faulty_arm(cell.robot, heavy)
    arm.actual_pose(theta, {}, rise, Pose.stack([TOOL]), DirectionHistory(), 1)
