"""Long programs: what holds at a thousand waypoints holds at a million, and what is refused is refused at once."""

import time
from dataclasses import replace

import numpy as np
import pytest
from forked import code_of, run_forked
from numpy.testing import assert_allclose
from shipped import path_file, quiet
from toolpaths import laid

from compgen.cli.this_machine import find_machine
from compgen.core.exceptions import CompgenError, ImpossibleError, UnreachableError
from compgen.core.json_text import json_text
from compgen.core.pose import Pose
from compgen.core.units import MM, UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.planning import curves, exact_path, retiming, surfaces
from compgen.planning.boundaries import unbounded
from compgen.report import job_summary, waypoints_blocks, waypoints_csv
from compgen.robot import joint_path
from compgen.verification.deviation import statistics

ROBOT = load_job(path_file("circle_1300")).robot


def on_plane(pattern, **more):
    settings = {"spin": 0.0, "chord": 1.5 * UM, "lift": 0.0, **more}
    return laid(pattern, surfaces.plane(np.array([1.2, 0.0, 0.2])), unbounded(), **settings)


def test_a_million_with_one_out_of_reach_is_named_within_seconds():
    job = load_job(path_file("circle_1300"))
    N = 1_000_000
    turn = np.linspace(0, 6, N)
    position = np.column_stack([1.2 + 0.3 * np.cos(turn), 0.3 * np.sin(turn), np.full(N, 0.2)])
    position[543_210] = [9.0, 0.0, 0.2]
    rotation = np.tile(np.diag([1.0, -1.0, -1.0]), (N, 1, 1))
    flange = Pose(position, rotation)
    begin = time.process_time()
    with pytest.raises(UnreachableError, match="waypoint 543211"):
        joint_path.follow_branch(job.robot, flange, job.posture)
    assert time.process_time() - begin < 10


def test_nothing_is_written_when_a_long_path_leaves_the_reach(tmp_path):
    call = ["generate", path_file("optic_spiral"), "-o", tmp_path / "out", "-q", "--set", "path.x_mm=1600"]
    done = run_forked(code_of([*call, "--set", "path.stepover_mm=40"]))
    assert done.returncode == 3
    assert done.stderr.count("\n") == 1
    assert "waypoint" in done.stderr
    assert not list(tmp_path.iterdir())


def test_a_full_disk_leaves_nothing(tmp_path):
    """A limit on the size of a file stands for the disk that is full."""
    limit = """
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))
"""
    done = run_forked(limit + code_of(["generate", path_file("line_y"), "-o", tmp_path / "out", "-q"]))
    assert done.returncode == 2
    assert "cannot be written" in done.stderr
    assert not list(tmp_path.iterdir())


def test_a_spiral_through_its_own_centre_is_driven_and_proven():
    """Zero radius and infinite curvature at its start."""
    job = load_job(path_file("optic_spiral"), None, ["path.stepover_mm=100", "boundary.corner_to_corner_mm=400"])
    planned, done = generate.generate(job, quiet)
    assert done.inside
    assert np.linalg.norm(planned.path.target.position[1, :2] - [1.2, -0.03]) < 1e-9
    assert np.all(np.isfinite(done.solution.correction))


def test_waypoints_that_coincide_are_refused_and_a_nanometre_apart_are_driven():
    arc = np.concatenate([np.linspace(0, 0.2, 101), 0.2 + 1e-9 * np.arange(1, 6), np.linspace(0.21, 0.4, 100)])
    theta = np.outer(arc, np.linspace(0.1, 0.5, 6))
    stop = np.zeros(len(arc), dtype=bool)
    stop[[0, -1]] = True
    motion = retiming.retime(ROBOT, arc, theta, stop, 0.2)
    assert motion.utilisation.max() <= 1
    assert np.diff(motion.time).min() > 0
    twice = np.insert(arc, 50, arc[50])
    with pytest.raises(ImpossibleError, match="waypoints 51 and 52 coincide"):
        retiming.retime(ROBOT, twice, np.insert(theta, 50, theta[50], axis=0), np.insert(stop, 50, False), 0.2)


def test_a_hundred_thousand_sharp_corners_are_timed_together():
    seconds = []
    for corners in (10_000, 100_000):
        arc = np.linspace(0, corners * 10 * MM, 4 * corners + 1)
        theta = np.zeros((len(arc), 6))
        theta[:, 0] = 0.02 * np.abs((arc / 20e-3) % 1 - 0.5)
        stop = np.zeros(len(arc), dtype=bool)
        stop[::4] = True
        begin = time.process_time()
        motion = retiming.retime(ROBOT, arc, theta, stop, 0.02)
        seconds.append(time.process_time() - begin)
    assert seconds[1] < 20 * seconds[0]
    assert motion.utilisation.max() <= 1
    passed = motion.phases.time(motion.phases.locate(arc[stop]))  # phases are of the motion that is not rounded
    jerk = ROBOT.jerk[0] / np.abs(np.diff(theta[:, 0]) / np.diff(arc)).max()
    rounded = jerk / 2 * (6 * np.spacing(arc[-1]) / jerk) ** (2 / 3)  # s = jerk t^3 / 6 before a stop, to its last bit
    assert_allclose(motion.phases.at(passed)[1], 0, atol=rounded)
    one = retiming.retime(ROBOT, arc[:5], theta[:5], stop[:5], 0.02)
    assert_allclose(np.diff(motion.time[stop]), one.time[-1], rtol=1e-6)


def test_the_cubic_from_length_to_parameter_is_newtons():
    table = curves.join(
        curves.spiral((0, 0), (0.2, 0.25), (0, 2 * np.pi)), curves.line((0.25, 0.0), (0.4, 0.0)),
        curves.u_turns(np.array([[0.4, 0.0]]), np.array([[0.4, 0.02]]), np.array([[1.0, 0.0]]), 0.032),
    )  # fmt: skip
    path = on_plane(table)
    segment = np.random.default_rng(5).integers(0, len(path.piece), 4000)
    fraction = np.random.default_rng(6).random(4000)
    even = np.isfinite(path.slope[:, 0])
    assert 0.1 < even.mean() < 1
    quick = path.at(segment, fraction)[0].position
    newton = replace(path, slope=np.full_like(path.slope, np.nan)).at(segment, fraction)[0].position
    assert np.abs(quick - newton).max() < 1e-12  # m
    assert np.array_equal(quick[~even[segment]], newton[~even[segment]])


def test_a_thinned_program_stays_within_its_bounds_and_says_what_it_left_out():
    job = load_job(path_file("spiral_1300"), None, ["process.spacing_mm=0.5", "process.thin_um=1.5", "path.turns=1"])
    planned, done = generate.generate(job, quiet)
    assert done.inside
    assert len(done.program.position) == len(planned.path.arc) < planned.rows[-1] / 3
    assert statistics(done.deviation)["total"]["max_um"] <= 2.5
    assert any(f.code == "path.thinned" and "left out" in f.message for f in done.findings)
    table = b"".join(waypoints_blocks(planned, done)).decode().splitlines()
    assert len(table) == len(done.program.position) + 1


def test_the_tables_text_is_what_formatting_each_number_gives():
    rng = np.random.default_rng(7)
    wide = 10.0 ** rng.uniform(-7, 4.9, (500, 3)) * rng.choice([-1, 1], (500, 3))
    wide[:3] = [[0.0, -0.0, -1e-9], [0.5e-6, -0.5e-6, 99999.0], [1.0, -1.0, 0.1]]
    rows = (9_998, 10_498)
    tables = [(wide, 6), (wide, 4), (None, 4), (wide[:, :2], 5), (np.ones((500, 1), dtype=np.int64), 0)]
    assert waypoints_csv.csv_lines(*rows, tables) == waypoints_csv.long_csv_lines(*rows, tables)
    big = [(wide * 1e4, 6)]
    assert waypoints_csv.csv_lines(*rows, big) == waypoints_csv.long_csv_lines(*rows, big)


def test_workers_and_stretches_change_no_byte():
    from compgen.core import evaluation

    runs = []
    for workers in (1, 2, 3):
        evaluation.configure(*find_machine(workers))  # with what the command line has compiled already
        job = load_job(path_file("optic_spiral"), None, ["path.stepover_mm=60"])
        planned, done = generate.generate(job, quiet)
        runs.append((done.text, json_text(job_summary(planned, done)), b"".join(waypoints_blocks(planned, done))))
    evaluation.configure(None)
    assert runs[0] == runs[1] == runs[2]


def test_one_text_means_one_pose_in_a_file_of_any_length():
    """Pages are short and may go by numpy where the whole is compiled: still they meet to the last bit."""
    from compgen.core import evaluation
    from compgen.core.rotations import from_wpr

    angles = np.random.default_rng(10).uniform(-3, 3, (3, 5000))
    evaluation.configure(*find_machine(1))
    whole = from_wpr(*angles)
    assert np.array_equal(whole[100:200], from_wpr(*angles[:, 100:200]))
    evaluation.configure(None)
    assert np.array_equal(whole, from_wpr(*angles))


def test_geometry_of_nothing_but_length_is_even():
    path = on_plane(curves.line((0.0, 0.0), (0.3, 0.0), stop=True))
    assert np.isfinite(path.slope).all()
    assert exact_path.EVEN[0] < 1


def test_refusals_are_one_kind():
    assert issubclass(ImpossibleError, CompgenError)
