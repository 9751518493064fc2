"""``cgen.toml``: which one a job takes, what it gives, that it loosens nothing, and what is wrong in one."""

import json
import re
from hashlib import sha256

import pytest
from command_line import refused, run
from shipped import ROOT

from compgen.core.finding_codes import Code
from compgen.pipelines.files.path_file import load_job

LINE = (ROOT / "paths" / "line_y.toml").read_text()
BOUNDS = re.search(r"^\[bounds\]\n(?:\w.*\n?)*", LINE, re.MULTILINE)
assert BOUNDS
BARE = re.sub(r"^robot *=.*\n", "", LINE.replace(BOUNDS[0], ""), flags=re.MULTILINE)
UM = 1e-6


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A repository with a path file that says neither robot nor bound, worked on in its paths' folder."""
    (tmp_path / "shop" / "paths").mkdir(parents=True)
    (tmp_path / "shop" / ".git").mkdir()
    monkeypatch.chdir(tmp_path / "shop" / "paths")
    return tmp_path / "shop"


def job_of(project, text, bounds="", robot=None, overrides=()):
    """A job of a path file in a project whose file is given."""
    (project / "cgen.toml").write_text(text)
    (project / "paths" / "a.toml").write_text(f"{BARE}\n[bounds]\n{bounds}\n")
    return load_job(str(project / "paths" / "a.toml"), robot, overrides)


def said(job):
    return [(f.level.value, f.message) for f in job.input_findings if f.code is Code.PROJECT_FILE]


def test_a_path_file_that_says_nothing_takes_robot_and_bounds(project):
    job = job_of(project, 'robot = "m20ia"\n[bounds]\nmax_um = 40\nrms_um = 9\n')
    assert job.cell.robot.name.lower().startswith("m-20ia") or job.cell.robot_file.endswith("m20ia.toml")
    assert (job.bounds.max, job.bounds.rms, job.bounds.p99) == pytest.approx((40 * UM, 9 * UM, None))
    assert said(job) == [("note", "../cgen.toml gives robot = m20ia, bounds.max_um = 40, bounds.rms_um = 9")]


def test_a_path_file_without_the_table_takes_bounds_and_another_may_name_it_in_its_day(project):
    (project / "cgen.toml").write_text("[bounds]\nmax_um = 3\n")
    (project / "paths" / "b.toml").write_text(BARE)
    assert load_job(str(project / "paths" / "b.toml")).bounds.max == pytest.approx(3 * UM)
    day = '\n[[before]]\nstate = "moving"\nprogram = "b"\nduration_h = 1\n'
    job = job_of(project, "[bounds]\nmax_um = 3\n", bounds=f"rms_um = 2\n{day}")
    assert (job.bounds.max, job.bounds.rms) == pytest.approx((3 * UM, 2 * UM))


@pytest.mark.parametrize(
    ("own", "limit", "holds", "level"),
    [(2.5, 10, 2.5, "warning"), (10, 2.5, 2.5, "note"), (4, 4, 4, "note")],
)
def test_of_two_bounds_the_tighter_holds_whichever_file_has_it(project, own, limit, holds, level):
    job = job_of(project, f"[bounds]\nmax_um = {limit}\n", f"max_um = {own}")
    assert job.bounds.max == pytest.approx(holds * UM)
    ((how, message),) = said(job)
    assert how == level
    assert ("looser" in message) == (limit > own)
    assert (f"path file: {own}" in message) == (own > limit)


def test_what_is_typed_holds_and_the_file_says_nothing_of_it(project):
    text = 'robot = "m20ia"\n[bounds]\nmax_um = 3\n'
    job = job_of(project, text, "max_um = 5", "m710ic50", ["bounds.max_um=50"])
    assert job.bounds.max == pytest.approx(50 * UM)
    assert "m710ic50" in job.cell.robot_file
    assert said(job) == []


def test_a_path_file_s_own_robot_holds(project):
    text = 'robot = "m20ia"\n'
    (project / "cgen.toml").write_text(text)
    (project / "paths" / "c.toml").write_text(f'robot = "m710ic50"\n{BARE}\n[bounds]\n')
    job = load_job(str(project / "paths" / "c.toml"))
    assert "m710ic50" in job.cell.robot_file
    assert said(job) == []


def test_a_robot_file_lies_from_the_project_s_file(project):
    (project / "arms").mkdir()
    (project / "arms" / "mine.toml").write_text((ROOT / "robots" / "m20ia.toml").read_text())
    job = job_of(project, 'robot = "arms/mine.toml"\n')
    assert job.cell.robot_file.endswith("arms/mine.toml")


def test_the_file_is_an_input_with_its_hash(project):
    text = "[bounds]\nmax_um = 3\n"
    job, again = job_of(project, text, "max_um = 2"), job_of(project, text, "max_um = 2")
    digest = sha256(text.encode()).hexdigest()
    assert job.inputs["files"]["project"] == {"file": "../cgen.toml", "sha256": digest}
    assert again.inputs_hash == job.inputs_hash
    assert job_of(project, "[bounds]\nmax_um = 4\n", "max_um = 2").inputs_hash != job.inputs_hash
    (project / "cgen.toml").unlink()
    alone = load_job(str(project / "paths" / "a.toml"))
    assert alone.inputs_hash != job.inputs_hash
    assert "project" not in alone.inputs["files"]


def test_the_nearest_file_is_taken_and_none_above_the_repository(project, monkeypatch):
    (project.parent / "cgen.toml").write_text("[bounds]\nmax_um = 1\n")
    file = project / "paths" / "a.toml"
    file.write_text(f"{BARE}\n[bounds]\n")
    assert load_job(str(file)).bounds.max is None
    assert job_of(project, "[bounds]\nmax_um = 3\n").bounds.max == pytest.approx(3 * UM)
    (project / "paths" / "cgen.toml").write_text("[bounds]\nmax_um = 7\n")
    assert load_job(str(file)).bounds.max == pytest.approx(7 * UM)
    away = project.parent / "away"
    away.mkdir()
    monkeypatch.chdir(away)  # the path file's own project, wherever one stands
    assert load_job(str(file)).bounds.max == pytest.approx(7 * UM)


def test_a_path_file_of_no_project_takes_that_of_the_working_folder(project, monkeypatch):
    other = project.parent / "other" / "deep" / "a.toml"
    other.parent.mkdir(parents=True)
    other.write_text(f"{BARE}\n[bounds]\n")
    (project / "cgen.toml").write_text("[bounds]\nmax_um = 3\n")
    assert load_job(str(other)).bounds.max == pytest.approx(3 * UM)
    monkeypatch.chdir(other.parent)
    assert load_job(str(other)).bounds.max is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("\nrobt = 'm20ia'", "cgen.toml: line 2: robt: unknown key; did you mean 'robot'?"),
        ("[bounds]\nmax_um = -1", "cgen.toml: line 2: bounds.max_um: -1: must be greater than 0"),
        ("[bounds]\n\nmax = 1", "cgen.toml: line 3: bounds.max: unknown key; did you mean 'max_um'?"),
        ("[bounds.guaranteed]\nmax_um = 1", "cgen.toml: line 1: bounds.guaranteed: unknown key"),
        ("assets = 'near'", "cgen.toml: line 1: assets: 'near': must be"),
        ("bounds = 3", "cgen.toml: line 1: bounds: 3 must be a table"),
        ("[bounds", "cgen.toml: not TOML: "),
        ("robot = 'nobody'", "cgen.toml: robot 'nobody' is unknown"),
        ("robot = 'nobody.toml'", "nobody.toml: no such file"),
        ("robot = ''\x00", "cgen.toml: "),
    ],
)
def test_what_is_wrong_in_it_is_one_line_that_names_it(project, text, words):
    (project / "cgen.toml").write_text(text)
    (project / "paths" / "a.toml").write_text(f"{BARE}\n[bounds]\n")
    refused(run("check", "a.toml", cwd=project / "paths"), 2, words)


@pytest.mark.parametrize("value", ['"2"', "nan", "inf", "-1"])
def test_a_bound_of_the_path_file_that_is_none_is_refused_as_before(project, value):
    (project / "cgen.toml").write_text("[bounds]\nmax_um = 3\n")
    (project / "paths" / "a.toml").write_text(f"{BARE}\n[bounds]\nmax_um = {value}\n")
    refused(run("check", "a.toml", cwd=project / "paths"), 2, "a.toml: bounds.max_um: ")


def test_screen_report_and_page_say_it(project):
    (project / "cgen.toml").write_text('assets = "shared"\n[bounds]\nmax_um = 90000\n')
    (project / "paths" / "a.toml").write_text(f"{BARE}\n[bounds]\n")
    done = run("predict", "paths/a.toml", cwd=project)
    assert done.returncode == 0, done.stderr
    assert "cgen.toml gives bounds.max_um = 90000" in done.stdout
    report = json.loads((project / "outputs" / "a_predict" / "report.json").read_text())
    assert "project.file" in [finding["code"] for finding in report["findings"]]
    assert [file.name for file in (project / "outputs").glob("*.js")]  # shared, above the page's folder
    again = run("predict", "paths/a.toml", "--assets", "inline", "-q", "-o", "alone/out", cwd=project)
    assert again.returncode == 0, again.stderr
    assert not list((project / "alone").glob("*.js"))


def test_a_folder_of_path_files_is_without_the_project_s(project):
    (project / "cgen.toml").write_text("")
    refused(run("check", ".", cwd=project), 2, "no path file (.toml) in this folder")
