"""A lead-in turns every joint one way through its play, comes from above, and lays the tool upright onto the path."""

import numpy as np
import pytest
from changed import changed
from flawed import flawed_file
from numpy.testing import assert_allclose
from shipped import path_file, quiet

from compgen.core.exceptions import InputError
from compgen.core.units import DEG, MM, UM
from compgen.error_model.direction_memory import reversal_widths, unknown_share
from compgen.job.motion_plan import plan_motion
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate

PLAY = "robot.sources.hysteresis.backlash_mdeg=[2, 1.6, 2, 4, 4, 4]"
SMALL = {
    "spiral_1300": ("path.turns=1", "path.diameter_mm=300"),
    "circle_1300": ("path.diameter_mm=300",),
    "raster_1300": ("path.diameter_mm=200", "path.stepover_mm=100"),
    "line_y": (),
}


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    return flawed_file(tmp_path_factory.mktemp("robot"))


@pytest.fixture(params=sorted(SMALL))
def job(request, robot):
    return load_job(path_file(request.param), robot, (PLAY, *SMALL[request.param]))


def test_every_joint_turns_one_way_through_its_play(job):
    plan = plan_motion(job.plan, job.cell, job.feed, quiet)
    end = int(np.argmax(plan.path.stop[1:])) + 1  # where the lead-in stops
    turn = np.diff(plan.theta[: end + 1], axis=0)
    assert np.all((turn > 0).all(axis=0) | (turn < 0).all(axis=0))
    share = unknown_share(reversal_widths(job.sources), plan.theta, plan.path.target.position).at(np.array([end]))
    assert share.direction.max() < 0.06
    assert share.direction[0, 0] < 0.003  # J1 has by far the longest lever


def test_the_tool_comes_from_above_and_arrives_upright(job):
    plan = plan_motion(job.plan, job.cell, job.feed, quiet)
    end = int(np.argmax(plan.path.stop[1:])) + 1
    height = plan.path.target.position[: end + 1, 2] - plan.path.target.position[end, 2]
    assert height[0] >= job.plan.process.lift - 0.2 * MM
    assert np.all(np.diff(height) < 0)
    plain = plan_motion(changed(job, "plan.process.lead_in", False).plan, job.cell, job.feed, quiet).path
    assert_allclose(
        plan.path.target.rotation[end], plain.target.rotation[int(np.argmax(plain.stop[1:])) + 1], atol=1e-12
    )
    cosine = np.einsum("nij,ij->n", plan.path.target.rotation[: end + 1], plan.path.target.rotation[end]) / 2 - 0.5
    tilt = np.arccos(np.clip(cosine, -1, 1))
    assert 1 * DEG < tilt[0] < 30 * DEG
    assert np.all(np.diff(tilt[:-1]) < 0)


def test_nothing_is_left_unknown_where_the_part_begins(job):
    with_lead, corrected = generate.generate(job, quiet)
    assert "sources.start" not in {f.code for f in corrected.findings}
    assert corrected.inside
    on_part = np.flatnonzero(with_lead.path.contact)
    assert np.linalg.norm(corrected.solution.residual[on_part[:3], :3], axis=1).max() < 0.2 * UM
    _, plain = generate.generate(changed(job, "plan.process.lead_in", False), quiet)
    assert "sources.start" in {f.code for f in plain.findings}


def test_the_path_behind_the_lead_in_is_the_same(job):
    ahead = plan_motion(job.plan, job.cell, job.feed, quiet).path
    plain = plan_motion(changed(job, "plan.process.lead_in", False).plan, job.cell, job.feed, quiet).path
    ends = [path.arc[np.flatnonzero(path.stop)[1]] for path in (ahead, plain)]
    assert_allclose(ahead.arc[-1] - ends[0], plain.arc[-1] - ends[1], atol=1e-9)


def test_a_robot_without_play_comes_down_the_tool_axis():
    job = load_job(path_file("circle_1300"), None, ("path.diameter_mm=300",))
    plain = plan_motion(job.plan, job.cell, job.feed, quiet).path
    assert_allclose(
        plain.target.position[0, :2], plain.target.position[int(np.argmax(plain.stop[1:])) + 1, :2], atol=1e-12
    )
    asked = plan_motion(changed(job, "plan.process.lead_in", True).plan, job.cell, job.feed, quiet)
    end = int(np.argmax(asked.path.stop[1:])) + 1
    turn = np.diff(asked.theta[: end + 1], axis=0)
    assert np.abs(turn.sum(axis=0)).min() > 0.19 * DEG


def test_where_the_arm_cannot_come_from_the_paths_own_side_it_comes_from_another(robot):
    """The circle's first point lies near full stretch: from behind, the elbow would pass it."""
    job = load_job(path_file("circle_1300"), robot, (PLAY,))
    _, corrected = generate.generate(job, quiet)
    assert corrected.inside
    assert "sources.start" not in {f.code for f in corrected.findings}


def test_a_joint_at_rest_forgets_its_side_by_the_digits_of_the_text(robot):
    """J4 comes from one side and then stands: the text rounds it to and fro, the twin sees it forget."""
    job = load_job(path_file("spiral_1300"), robot, (PLAY, "path.turns=3", "path.diameter_mm=600"))
    planned, corrected = generate.generate(job, quiet)
    assert corrected.deviation.total().max() < 2.5 * UM
    assert abs(planned.motion.direction[-1, 3]) > 0.9  # what the plan alone would believe


def test_a_lead_in_needs_a_lift(robot):
    with pytest.raises(InputError, match="lift_mm"):
        load_job(path_file("circle_1300"), robot, (PLAY, "process.lead_in=true", "process.lift_mm=0"))


def test_sweeps_begin_so_early_that_their_reversals_are_over_on_the_part(robot):
    short = (PLAY, "robot.sources.hysteresis.width_mdeg=[200, 200, 200, 200, 200, 200]")
    small = (
        "path.diameter_mm=300",
        "path.stepover_mm=60",
        "compensation.rate_um_mm=10",
        "compensation.curvature_period_mm=10",
    )
    plain = load_job(path_file("raster_1300"), robot, (*short, *small, "process.lead_in=false"))
    job = load_job(path_file("raster_1300"), robot, (*short, *small))
    assert any(f.code == "path.lead_in" and "not 5 (path.lead_mm)" in f.message for f in job.input_findings)
    left = []
    for each in (plain, job):
        planned, corrected = generate.generate(each, quiet)
        left.append(np.linalg.norm(corrected.solution.residual[planned.path.contact, :3], axis=1).max())
        statuses = corrected.solution.status
    assert left[0] > 2 * UM
    assert left[1] < 0.3 * UM
    assert corrected.inside, statuses


def test_a_lead_stays_as_short_as_the_reach_asks(robot):
    job = load_job(path_file("raster_1300"), robot, (PLAY, "path.stepover_mm=100"))
    plan_motion(job.plan, job.cell, job.feed, quiet)  # 35 mm more would be out of reach
