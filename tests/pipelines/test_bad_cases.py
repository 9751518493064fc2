"""What goes wrong in long programs: limits that bind far and wide, places too close, texts that round over a limit."""

import os
import re
import resource
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from forked import code_of, run_forked
from ls_text import cartesian, program
from problems import problem_of
from shipped import ROOT, path_file, quiet

from compgen.compensation import limits, optimise
from compgen.compensation.optimise import Status
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.findings import job_findings
from compgen.pipelines.planned.generate import generate, predict
from compgen.robot.inverse_kinematics import flange_from_tool, solve_flange

SAME = 1e-9  # m, of two optima


@pytest.fixture(scope="module")
def spiral():
    """A spiral of some 4000 waypoints and its free solution."""
    job = load_job(path_file("optic_spiral"), None, ["path.stepover_mm=200"])
    run = predict(job, quiet, pages=False)
    problem = problem_of(run)
    return problem, job.settings, optimise.optimise(problem, job.settings).correction


def without_compiler_note(stderr):
    """What a command says on any machine."""
    return "".join(line for line in stderr.splitlines(keepends=True) if "note: no C compiler" not in line)


@pytest.mark.parametrize("share", [0.1, 0.3, 0.95])
def test_a_rate_that_binds_far_along_the_path_is_kept_as_the_whole_program_would(spiral, share):
    """A stretch whose neighbours leave it no room takes in more of them, in the end all."""
    problem, settings, free = spiral
    step = np.linalg.norm(np.diff(free[:, :3], axis=0), axis=1) / np.diff(problem.arc)
    tight = replace(settings, rate=float(np.quantile(step, share)))
    found = optimise.optimise(problem, tight)
    assert found.status is Status.LIMITED
    assert len(found.active_limits) > 0.9 * (1 - share) * len(step)
    slope = np.linalg.norm(np.diff(found.correction[:, :3], axis=0), axis=1) / np.diff(problem.arc)
    assert slope.max() <= tight.rate * (1 + 1e-6)
    whole = limits.solve_stretch(problem, tight, free, np.ones(len(free), dtype=bool))
    assert whole.converged
    assert np.abs(found.correction - whole.correction)[:, :3].max() < SAME


def test_a_joint_held_at_its_limit_is_inside_it_in_the_text():
    """Rounding moves a joint by some ten microradians: the limit is kept by what the controller reads."""
    job = load_job(
        path_file("optic_spiral"),
        None,
        [
            "path.stepover_mm=100",
            "robot.sources.joint_zeros.offset_mdeg=[0,0,0,0,-150,0]",
            "robot.limits.j5_deg=[-125,-52.06]",
        ],
    )
    planned, done = generate(job, quiet)
    assert done.solution.status is Status.LIMITED
    held = {n for n, limit in done.solution.active_limits if limit == "joint J5 limit"}
    assert 0.02 < len(held) / len(planned.theta) < 0.5
    told = next(f.message for f in done.findings if f.code == "compensation.limited")
    assert "joint J5 limit at waypoints" in told
    assert len(told) < 300
    flange = flange_from_tool(Pose(done.program.position, done.program.rotation), job.tool.pose)
    theta, _ = solve_flange(job.robot, flange, job.posture)
    assert theta[:, 4].max() <= job.robot.upper[4]
    assert theta[:, 4].max() > job.robot.upper[4] - 1e-4  # rad: no farther inside than rounding asks for


def test_limits_that_no_joint_comes_near_are_left_alone(spiral):
    from compgen.compensation.limits import with_rounding_margin

    assert with_rounding_margin(spiral[0], (1e-6, 1e-5)) is spiral[0]


@pytest.mark.parametrize(
    ("path", "override", "told"),
    [
        # 10^5 turns: refused before any waypoint is computed
        ("optic_spiral", "path.stepover_mm=0.005", r"path.stepover_mm: over 10000 turns"),
    ],
)
def test_what_is_too_small_is_refused_in_one_line_that_says_where(path, override, told):
    with pytest.raises(InputError, match=told):
        generate(load_job(path_file(path), None, [override]), quiet)


@pytest.mark.parametrize("lift", [0.0, 1e-6, 1e-5])
def test_a_lift_of_nanometres_is_no_lift(lift):
    job = load_job(path_file("circle_1300"), None, [f"process.lift_mm={lift}", "path.diameter_mm=100"])
    planned, done = generate(job, quiet)
    assert done.inside
    assert np.diff(planned.path.arc).min() > 1e-4


def test_places_that_the_text_rounds_to_one_are_driven():
    """Waypoints a tenth of a micrometre apart, a micrometre between what a text can say; warnings are errors here."""
    small = ["path.diameter_mm=0.005", "process.chord_um=0.01", "process.spacing_mm=0.001", "process.lift_mm=0.5"]
    job = load_job(path_file("circle_1300"), None, [*small, "process.feed_mm_s=0.5"])
    _, done = generate(job, quiet)
    assert np.linalg.norm(np.diff(done.program.position, axis=0), axis=1).min() == 0
    assert done.inside


def test_a_correction_that_does_not_settle_says_where_and_what_to_try(spiral):
    none = np.zeros((3, 6))
    stuck = optimise.Solution(
        correction=none,
        theta=none,
        residual=np.eye(3, 6, 1) * [[1e-9], [3e-9], [2e-9]],
        status=Status.UNSETTLED,
        iterations=20,
        last_step=1e-9,
        active_limits=(),
    )
    words = job_findings.why_uncorrected(stuck)
    assert words.startswith("waypoint 2: ")
    assert "raise process.chord_um" in words


@pytest.mark.parametrize("apart", [1e-6, 1e-7, 1e-9, 1e-11])
def test_waypoints_next_to_each_other_change_nothing_elsewhere(spiral, apart):
    """Stiffness grows with the inverse cube of a segment's length: a nanometre would drown all others by 8 um."""
    problem, settings, free = spiral
    rows = np.sort(np.concatenate([np.arange(len(free)), np.repeat([0, 700, 2500, len(free) - 1], 3)]))
    again = np.concatenate([[0], np.cumsum(np.diff(rows) == 0)]) * apart
    close = replace(problem.window(rows), arc=problem.arc[rows] + again)
    found = optimise.optimise(close, settings)
    assert found.status is Status.CONVERGED
    assert np.abs(found.correction - free[rows])[:, :3].max() < SAME


#: what a full disk says: a file may not grow
NO_ROOM = """
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (50, 50))
"""


@pytest.mark.parametrize(
    "command",
    [
        "generate paths/optic_spiral.toml -q -o {out} --set path.stepover_mm=100 --set robot.controller.max_lines=1000",
        "predict paths/line_x.toml -q -o {out}",
        "correct {folder}/PART.LS --robot m710ic50 -q -o {out}",
        "pages {folder}/PART.LS --robot m710ic50 -q -o {out} --set robot.controller.max_lines=60",
        "heat paths/line_x.toml -q -o {out}",
        "whatif paths/line_x.toml -q --vary process.feed_mm_s=20:200:50 --workers 1 -o {out}",
        "check paths/line_x.toml -q --junit {out}",
    ],
)
@pytest.mark.parametrize("older", [False, True])
def test_a_full_disk_is_told_in_one_line_and_nothing_is_left_or_lost(tmp_path, command, older):
    points = [cartesian(n, (1300 + n, 20, 200, 180, 0, 0)) for n in range(1, 100)]
    (tmp_path / "PART.LS").write_bytes(
        program([f"L P[{n}] 100mm/sec FINE" for n in range(1, 100)], points, name="PART")
    )
    out = tmp_path / "deep" / "out"
    if older:
        out.parent.mkdir()
        if "junit" in command:
            out.write_text("<testsuite>earlier</testsuite>")
        else:
            out.mkdir()
            (out / "mine.txt").write_text("mine")
    before = {p: p.is_dir() or p.read_bytes() for p in tmp_path.rglob("*")}
    if "junit" in command and not older:
        out.parent.mkdir()
        before[out.parent] = True
    done = run_forked(NO_ROOM + code_of(command.format(out=out, folder=tmp_path).split()), CC="no-compiler")
    assert (done.returncode, done.stdout) == (2, "")
    told = [line for line in done.stderr.splitlines() if "note: no C compiler" not in line]
    assert len(told) == 1
    assert "cannot be written: File too large; give another" in told[0]
    assert {p: p.is_dir() or p.read_bytes() for p in tmp_path.rglob("*")} == before


LONG = ("--set", "path.stepover_mm=20.65", "--set", "process.chord_um=0.2")  # 1e5 waypoints
MILLION = ("--set", "path.stepover_mm=2.065", "--set", "process.chord_um=0.2")


def generate_in_shell(out, *more, **surroundings):
    call = [sys.executable, "-m", "compgen", "generate", "paths/optic_spiral.toml", "-o", str(out), *more]
    return subprocess.run(
        call, cwd=ROOT, capture_output=True, text=True, check=False, env={**os.environ, **surroundings}
    )


@pytest.mark.parametrize(
    ("override", "told"),
    [
        (
            "path.x_mm=1400",
            r"cgen: paths/optic_spiral.toml: waypoint \d{6} \(flange at X .*\) is out of reach: .*; move the path",
        ),
        (
            "robot.limits.j1_deg=[-20,180]",
            r"cgen: paths/optic_spiral.toml: waypoint \d{6}: joint J1 needs .* beyond its limits .*; move",
        ),
    ],
)
def test_a_million_waypoints_that_leave_the_robot_half_way_are_refused_within_seconds(tmp_path, override, told):
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = generate_in_shell(tmp_path / "out", *MILLION, "--set", override)
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before < 10
    assert done.returncode == 3
    assert re.fullmatch(told + ".*\n", without_compiler_note(done.stderr))
    assert not list(tmp_path.iterdir())


def long_run(out, workers):
    """A long run by some workers, with a hash seed of its own: its folder."""
    done = generate_in_shell(out, *LONG, "--workers", str(workers), PYTHONHASHSEED=str(workers))
    assert (done.returncode, without_compiler_note(done.stderr)) == (0, "")
    return out


@pytest.fixture(scope="module")
def one_worker(tmp_path_factory):
    return long_run(tmp_path_factory.mktemp("long") / "1", 1)


def test_a_long_run_is_the_same_to_the_byte_for_any_workers_and_any_hash_seed(one_worker, tmp_path):
    folders = (one_worker, long_run(tmp_path / "3", 3))
    one, other = ({p.name: p.read_bytes() for p in folder.iterdir()} for folder in folders)
    assert len(one) > 10
    assert one == other


def test_a_long_run_without_a_compiler_says_so_once_and_writes_the_same_program(one_worker, tmp_path):
    for compiler, told in (("/bin/false", "the C compiler failed"), ("no-such-compiler", "no C compiler")):
        done = generate_in_shell(tmp_path / "without", *LONG, CC=compiler, XDG_CACHE_HOME=str(tmp_path / "cache"))
        assert done.returncode == 0
        assert re.fullmatch(f"cgen: note: {told}: numpy evaluates instead, .*\n", done.stderr)
        for written in one_worker.glob("*.LS"):
            one, other = written.read_bytes(), (tmp_path / "without" / written.name).read_bytes()
            differ = sum(a != b for a, b in zip(one.split(), other.split(), strict=True))
            assert differ <= 3, written.name  # a last printed digit
        assert not list((tmp_path / "cache").rglob("*-*"))
