"""The polygon of J2 and J3 from the robot file: planned, corrected and flown inside it, or refused by name."""

import json
import re

import numpy as np
import pytest
from command_line import refused, run
from shipped import ROOT, path_file, quiet

from compgen.compensation.problem import Solver
from compgen.core.exceptions import InterferenceError
from compgen.core.units import DEG, UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned import generate
from compgen.verification.twin import TwinError, execute

#: The planned J2 of the line is 18.2534 deg at least, in its middle, and its correction would lower it by 4 mdeg there.
LOWEST = 18.252
AREA = f"[[{LOWEST}, -90], [135, -90], [135, 60], [80, 60], [80, 40], [60, 40], [60, 60], [{LOWEST}, 60]]"
DENSE = ("process.spacing_mm=1", "bounds.max_um=200")


def overrides(area, *others):
    return [f"robot.limits.interference.j2_j3_deg={area}", *others]


def pendant(job, theta):
    return job.robot.to_pendant(theta) / DEG


@pytest.fixture(scope="module")
def free():
    return generate.generate(load_job(path_file("line_y"), None, DENSE), quiet)


@pytest.fixture(scope="module")
def held():
    return generate.generate(load_job(path_file("line_y"), None, overrides(AREA, *DENSE)), quiet)


def test_without_a_polygon_the_correction_goes_beyond_this_edge(free):
    planned, corrected = free
    assert pendant(planned.job, planned.theta)[:, 1].min() > LOWEST
    assert pendant(planned.job, corrected.solution.theta)[:, 1].min() < LOWEST - 2e-3


def test_the_correction_stays_inside_and_says_what_binds(held, free):
    planned, corrected = held
    flown = pendant(planned.job, corrected.execution().theta)[:, 1]
    assert LOWEST - 1e-9 <= flown.min() < LOWEST + 1e-3  # what rounding may move a joint is kept clear
    limited = next(f for f in corrected.findings if f.code == "compensation.limited")
    assert "J2/J3 interference at waypoints" in limited.message
    near = pendant(planned.job, corrected.solution.theta)[:, 1] < LOWEST + 1e-3
    assert 5 < near.sum() < 100
    far = np.abs(planned.path.arc[:, None] - planned.path.arc[near]).min(axis=1) > 0.5
    assert far.any()
    assert np.array_equal(corrected.solution.correction[far], free[1].solution.correction[far])


def test_ipopt_finds_the_same_held_correction(held):
    job = load_job(path_file("line_y"), None, overrides(AREA, *DENSE, "compensation.solver=ipopt"))
    assert job.settings.solver is Solver.IPOPT
    _, ipopt = generate.generate(job, quiet)
    assert np.abs(ipopt.solution.correction - held[1].solution.correction)[:, :3].max() < 0.02 * UM


def test_a_path_in_the_area_is_refused_with_waypoint_and_joints():
    area = "[[-90, -38], [135, -38], [135, 60], [-90, 60]]"
    job = load_job(path_file("circle_1300"), None, overrides(area))
    with pytest.raises(InterferenceError) as refusal:
        generate.predict(job, quiet)
    n = refusal.value.waypoint
    free = generate.predict(load_job(path_file("circle_1300")), quiet)
    below = np.flatnonzero(pendant(job, free.theta)[:, 2] < -38)
    assert n == below[0] + 1
    arguments = ["generate", path_file("circle_1300"), "--set", overrides(area)[0]]
    refused(run(*arguments), 3, f"waypoint {n}: J2 = ", "with J3 = -38.0", "limits.interference.j2_j3_deg")


def test_the_twin_refuses_a_text_that_passes_the_edge(free):
    """Also between two positions: the tip of a notch, thinner than the way between two samples of the plan."""
    planned, corrected = generate.generate(load_job(path_file("line_y")), quiet)
    flown = corrected.execution()
    job, theta = planned.job, pendant(planned.job, flown.theta)
    between = int(np.flatnonzero((flown.fraction > 0.4) & (flown.fraction < 0.6) & (theta[:, 1] < 22))[0])
    j2, j3 = theta[between, 1:3]
    for tip, passes in ((j3 - 0.02, True), (j3 + 0.002, False)):
        sides = f"[{j2 - 0.002},-90],[{j2 - 0.002},{tip}],[{j2 + 0.002},{tip}],[{j2 + 0.002},-90]"
        area = f"[[-90,-90],{sides},[135,-90],[135,90],[-90,90]]"
        twin = twin_of(load_job(path_file("line_y"), None, overrides(area)))
        if passes:
            execute(twin, corrected.program, job.history.before)
            continue
        with pytest.raises(TwinError, match=rf"P\[{flown.segment[between] + 1}\]: J2 = .* with J3 = .*interference"):
            execute(twin, corrected.program, job.history.before)
        with pytest.raises(InterferenceError):  # and so does the planner
            generate.predict(load_job(path_file("line_y"), None, overrides(area)), quiet)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("[[0, 0], [10, 10]]", "2 corners"),
        ("[[0, 0], [10, 10], [10, 0], [0, 10]]", "cross"),
        ("[[0, 0, 0], [1, 1], [2, 0]]", "j2_j3_deg"),
        ("[[0, nan], [1, 1], [2, 0]]", "j2_j3_deg"),
        ("'none'", "j2_j3_deg"),
    ],
)
def test_a_bad_polygon_is_refused_in_one_line(value, words):
    refused(run("predict", path_file("line_y"), "--set", overrides(value)[0]), 2, "limits.interference", words)


def test_a_closed_polygon_and_one_given_clockwise_mean_the_same():
    areas = ("[[0,0],[9,0],[9,9]]", "[[0,0],[9,0],[9,9],[0,0]]", "[[9,9],[9,0],[0,0]]")
    robots = [load_job(path_file("line_y"), None, overrides(area)).robot for area in areas]
    theta = robots[0].to_theta(np.random.default_rng(1).uniform(-0.3, 0.3, (50, 6)))
    values = []
    for robot in robots:
        assert robot.interference is not None
        values.append(robot.interference.clearance(theta))
    assert np.array_equal(values[0], values[1])
    assert np.allclose(values[0], values[2], atol=1e-15)


def test_a_program_that_exists_is_held_there_and_inspect_says_so(tmp_path):
    made = run("generate", path_file("line_y"), "-o", tmp_path / "out", "-q")
    assert made.returncode == 0
    text = (tmp_path / "out" / "LINE_Y.LS").read_bytes()
    plain = tmp_path / "PLAIN.LS"
    plain.write_bytes(re.sub(rb" *\d+:  !(?:compgen|inputs)[^\n]*\n", b"", text))
    robot = tmp_path / "arm.toml"
    content = (ROOT / "robots" / "m710ic50.toml").read_text()
    assert "j2_j3_deg = []" in content
    robot.write_text(content.replace("j2_j3_deg = []", "j2_j3_deg = [[-90, -90], [25, -90], [25, 90], [-90, 90]]"))
    frames = tmp_path / "frames.toml"
    frames.write_text("[utool.1]\nx_mm = 0\ny_mm = 0\nz_mm = 250\nw_deg = 0\np_deg = 0\nr_deg = 0\n")
    done = run("inspect", plain, "--robot", robot, "--frames", frames, "--json")
    report = json.loads(done.stdout)
    assert report["limits"]["J2/J3 interference"]["room_deg"] == pytest.approx(25 - 27.986, abs=0.01)
    assert any("hits itself (interference)" in u["reason"] for u in report["unsafe"])
    assert "J2/J3 interference: -2.9" in run("inspect", plain, "--robot", robot, "--frames", frames).stdout
