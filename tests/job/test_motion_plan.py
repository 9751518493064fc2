"""One plan of motion: what warms the robot is the very motion that the program will have."""

from pathlib import Path

import numpy as np
import pytest
from flawed import flawed_file
from numpy.testing import assert_allclose
from shipped import ROOT, path_file, quiet

from compgen.job.motion_plan import plan_motion
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned.generate import generate, predict

REPEATS = 3
PATHS = ("line_y", "circle_1300")


@pytest.fixture(scope="module")
def flawed(tmp_path_factory):
    return flawed_file(tmp_path_factory.mktemp("robot"))


@pytest.mark.parametrize("spacing_mm", [0.5, 2.0, 10.0])
@pytest.mark.parametrize("name", PATHS)
def test_a_run_before_lasts_as_long_as_the_run_itself(name, spacing_mm):
    feed = load_job(path_file(name)).feed * 1e3
    own = f'before=[{{state="moving",feed_mm_s={feed!r},repeat={REPEATS}}}]'
    job = load_job(path_file(name), None, [own, f"process.spacing_mm={spacing_mm}"])
    planned = predict(job, quiet)
    assert_allclose(job.history.clock, REPEATS * planned.trajectory.time[-1], rtol=1e-12)
    if name == "line_y" and spacing_mm == 0.5:
        assert planned.trajectory.time[-1] > 20  # s: waypoints closer than the controller's period slow it down


def test_so_it_does_for_a_program_of_another_file(tmp_path):
    dense = Path(path_file("line_y")).read_text().replace("[process]", "[process]\nspacing_mm = 0.5")
    (tmp_path / "dense.toml").write_text(dense)
    first = tmp_path / "first.toml"
    first.write_text(Path(path_file("circle_1300")).read_text())
    robot = str(ROOT / "robots" / "m710ic50.toml")
    job = load_job(str(first), robot, ['before=[{state="moving",program="dense",repeat=2}]'])
    alone = predict(load_job(str(tmp_path / "dense.toml"), robot), quiet)
    assert_allclose(job.history.clock, 2 * alone.trajectory.time[-1], rtol=1e-12)


@pytest.mark.parametrize("name", PATHS)
def test_so_it_does_where_sources_ask_for_more_waypoints(name, flawed):
    job = load_job(path_file(name), flawed, [f'before=[{{state="moving",program="{name}",repeat={REPEATS}}}]'])
    planned = predict(job, quiet)
    plain = load_job(path_file(name))
    assert len(planned.theta) > len(plan_motion(plain.plan, plain.cell, plain.feed, quiet).theta)
    assert_allclose(job.history.clock, REPEATS * planned.trajectory.time[-1], rtol=1e-12)


def test_so_it_does_where_waypoints_are_thinned():
    own = 'before=[{state="moving",feed_mm_s=200,repeat=1}]'
    job = load_job(path_file("line_y"), None, [own, "process.spacing_mm=0.5", "process.thin_um=1.0"])
    _, corrected = generate(job, quiet)
    assert_allclose(job.history.clock, corrected.trajectory.time[-1], rtol=1e-3)
    assert corrected.trajectory.time[-1] < 10  # s


def test_the_plan_does_not_depend_on_warmth(flawed):
    cold = load_job(path_file("circle_1300"), flawed, ["before=[]"])
    warm = load_job(path_file("circle_1300"), flawed)
    assert warm.start_rise().max() > 5
    plans = [plan_motion(job.plan, job.cell, job.feed, quiet) for job in (cold, warm)]
    assert np.array_equal(plans[0].theta, plans[1].theta)
    assert np.array_equal(plans[0].trajectory.time, plans[1].trajectory.time)
