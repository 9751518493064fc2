"""A short run of the campaign of random jobs; tests/campaigns/jobs.py has the long one."""

import jobs
import numpy as np
import pytest
from naive_arm import dh_angles, flange
from naive_heat import NODES
from scipy.interpolate import CubicSpline
from shipped import path_file, quiet

from compgen.error_model.sources import ORDER
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate

SEEDS = range(1000, 1006)
WARM_CIRCLE = [
    'path={pattern="circle", diameter_mm=200, x_mm=1200, y_mm=100, z_mm=300}',
    'before=[{state="moving", feed_mm_s=200, duration_h=6}]',
    "robot.thermal.cte_um_m_K=11.25",
]


@pytest.mark.parametrize("seed", SEEDS)
def test_no_random_job_is_worse_than_told(seed):
    result, reason = jobs.judged(jobs.drawn(seed))
    assert result != "wrong", reason


def test_the_drawn_jobs_stand_at_every_edge_and_have_every_source():
    seeds = range(200)
    assert {jobs.edge_of(seed) for seed in seeds} == {"", *jobs.EDGES}
    text = "\n".join(line for seed in seeds for line in jobs.drawn(seed))
    for name in (*(source.NAME for source in ORDER), "loads"):
        assert f"robot.sources.{name}=" in text


def test_the_judges_spline_is_the_natural_one():
    x, y, at = np.array([0.0, 1, 3, 4]), np.array([1.0, -2, 0, 5]), np.linspace(0, 4, 50)
    np.testing.assert_allclose(jobs.natural_spline(x, y, at), CubicSpline(x, y, bc_type="natural")(at), atol=1e-12)


def test_the_judges_real_arm_without_errors_is_the_nominal_one():
    pendant = np.random.default_rng(5).uniform([-170, -40, -40, -170, 10, -170], [170, 80, 60, 170, 110, 170], (50, 6))
    cold = dict.fromkeys(NODES, np.zeros(50))
    real = jobs.tool_poses(dh_angles(np.radians(pendant)), cold, 11.0, {}, np.eye(4))
    np.testing.assert_allclose(real, [flange(q) for q in pendant], atol=1e-8)


def test_the_judge_bites():
    """The arm that a program was made for is on its path; one with another coefficient or another zero is not."""
    planned, corrected = generate.generate(load_job(path_file("circle_1300"), overrides=WARM_CIRCLE), quiet)
    target, contact = 1000 * planned.path.target.position, planned.path.contact

    def largest(*changes):
        tables = jobs.tables_of([*WARM_CIRCLE, *changes])
        return jobs.largest_um(jobs.drive(corrected.text, tables), tables, target, contact)

    assert largest() < 2.5  # um
    assert largest("robot.sources.joint_zeros={offset_mdeg=[0, 2, 0, 0, 0, 0]}") > 20
    assert largest("robot.sources.base_frame={position_um=[0, 0, 10]}") > 8
    bend = '{link=["a2"], plane=["side"], node=["j2"], rate_arcsec_K=[2]}'
    assert largest(f"robot.sources.thermal_bend={bend}") > 10
    line = '{axis="x", at_mm=[1200, 0, 0], station_mm=[0, 2000], forward_um=%s, reverse_um=%s}'
    level, straight = [[0, 0, 20], [0, 0, 20]], [[0, 0, 0], [0, 0, 0]]
    assert largest(f"robot.sources.map=[{line % (level, level)}]") > 15
    assert 5 < largest(f"robot.sources.map=[{line % (level, straight)}]") < 22
    cold = jobs.tables_of([WARM_CIRCLE[0], "before=[]", WARM_CIRCLE[2]])
    assert jobs.largest_um(jobs.drive(corrected.text, cold), cold, target, contact) > 50
