"""``resume`` at the command line: what it says, what it writes, what it leaves alone, and when it is stopped."""

import json
import math
import os
import shutil

import kills
import pytest
from command_line import refused, run
from naive_heat import NODES, steady_rise
from shipped import path_file
from states import state_of, written

from compgen.cli.output_files import figure_files, replace_together
from compgen.core.dates import duration
from compgen.core.exceptions import InputError
from compgen.pipelines.files.path_file import load_job

SMALL = ("--set", "path.stepover_mm=240", "--set", "robot.controller.max_positions=200")
RESUME = ("--from-page", "3", "--late", "35min", "--date", "2026-01-31")
PAGE = "OPTIC_RASTER_{:02d}.LS".format
HEAD = "time_s,ambient_degC,part_3_degC,part_4_degC,part_6_degC,part_11_degC"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("made") / "out"
    assert run("generate", "paths/optic_raster.toml", *SMALL, "-q", "-o", out).returncode == 0
    return out


@pytest.fixture
def job(made, tmp_path):
    return shutil.copytree(made, tmp_path / "out")


def contents(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def on_disk(world):
    """What is in a folder and beside it, whatever the names of what is half done."""
    return sorted(p.read_bytes() for place in world.glob("*out*") for p in place.rglob("*") if p.is_file())


def changed(before, after):
    return {name for name in {*before, *after} if before.get(name) != after.get(name)}


def test_it_writes_the_rest_says_so_and_leaves_all_else(job):
    (job / "mine.csv").write_text("mine")
    before, place = contents(job), os.stat(job / PAGE(1)).st_ino
    result = run("resume", job, *RESUME)
    assert result.returncode == 0, result.stderr
    after = contents(job)
    rest = {name for name in before if name.startswith("OPTIC_RASTER_") and name > PAGE(2)}
    assert changed(before, after) == {"compgen.json", "OPTIC_RASTER.pages.json", "resume.json", "resume.html"} | rest
    assert os.stat(job / PAGE(1)).st_ino == place  # not even written again
    text = " ".join(result.stdout.split())
    for words in ("because it starts 35 minutes late", "OPTIC_RASTER_03.LS", "um off the part: ", "before max"):
        assert words in text
    report = json.loads(after["resume.json"])
    assert report["pages"][0]["before"]["max_um"] > 5 > 1 > report["pages"][0]["after"]["max_um"]
    page = after["resume.html"].decode()
    for words in (
        "OPTIC_RASTER_03.LS",
        "it starts 35 min late",
        "the job&#39;s pages so far",
        "bound 2.5",
        "rise of j2 [K]",
        "not measured on this robot",
    ):
        assert words in page
    assert "the robot starts cold" not in page
    again = run("resume", job, "--from-page", "3", "--late", "35min")
    assert again.returncode == 0
    assert "nothing to do" in again.stdout
    assert contents(job) == after
    as_json = json.loads(run("resume", job, *RESUME, "--json").stdout)
    assert {**as_json, "replaced": report["replaced"], "pages": report["pages"]}["verdict"] == "inside"
    assert as_json["replaced"] == []


def test_a_comparison_says_that_pages_are_newer_than_their_report(made, job):
    assert "anew" not in run("compare", made, job).stdout
    assert run("resume", job, *RESUME, "-q").returncode == 0
    result = run("compare", made, job)
    assert "pages from 3 on were written anew since its report: positions are theirs" in " ".join(result.stdout.split())


def test_a_state_leaves_the_verdict_to_the_pages(job, tmp_path):
    state = written(state_of(load_job(path_file("optic_raster"))), tmp_path)
    given = ("--from-page", "3", "--state", state, "--date", "2026-01-31")
    result = run("resume", job, *given)
    assert result.returncode == 0, result.stderr
    report = json.loads((job / "resume.json").read_bytes())
    assert (report["verdict"], report["state_verdict"]) == ("inside", "anchored")
    assert "(anchored, at " in (job / "resume.html").read_text()


def figures_in(folder):
    return {p.name for p in folder.iterdir() if p.name.startswith("resume_")}


@pytest.mark.parametrize("beside", [False, True])
def test_its_figures_are_files_and_go_with_their_page(job, monkeypatch, beside):
    """Also where a folder beside the files keeps them from changing places at once."""
    monkeypatch.setattr(figure_files, "render", lambda figures, kind: {key: kind.encode() for key in figures})
    if beside:
        (job / "mine").mkdir()
    assert run("resume", job, *RESUME, "-q", "--figures", "png").returncode == 0
    first = figures_in(job)
    assert first
    assert all(name.endswith(".png") for name in first)
    (job / "resume_mine.png").write_text("somebody's")
    assert run("resume", job, "--from-page", "3", "--late", "55min", "-q", "--figures", "pdf").returncode == 0
    assert figures_in(job) == {name.replace(".png", ".pdf") for name in first} | {"resume_mine.png"}
    assert run("generate", "paths/optic_raster.toml", *SMALL, "-q", "-o", job).returncode == 0
    assert figures_in(job) == {"resume_mine.png"}


def test_generate_takes_the_report_of_a_resume_away_with_its_pages(job):
    assert run("resume", job, *RESUME, "-q").returncode == 0
    assert run("generate", "paths/optic_raster.toml", *SMALL, "-q", "-o", job).returncode == 0
    assert not (job / "resume.json").exists()
    assert not (job / "resume.html").exists()


def test_what_is_outside_is_not_written_but_by_force(made, tmp_path):
    out = tmp_path / "out"
    tight = ("--set", "bounds.max_um=0.5", "--force")
    assert run("generate", "paths/optic_raster.toml", *SMALL, *tight, "-q", "-o", out).returncode == 1
    before = contents(out)
    result = run("resume", out, *RESUME, "-q")
    refused(result, 1, "outside bounds: ", "bounds.max_um", "--force")
    assert contents(out) == before
    record = json.loads(run("resume", out, *RESUME, "--json").stdout)
    assert (record["replaced"], {page["replaced"] for page in record["pages"]}) == ([], {False})
    assert run("resume", out, *RESUME, "-q", "--force").returncode == 1
    record = json.loads((out / "resume.json").read_text())
    assert set(record["replaced"]) == {page["file"] for page in record["pages"] if page["replaced"]}
    assert set(record["replaced"]) < changed(before, contents(out))


def test_a_log_says_what_the_robot_is(job, tmp_path):
    log = tmp_path / "log.csv"
    rows = [f"{t},20,{28.4},{23.4},{30.4},{22.6}" for t in range(0, 3600, 60)]
    log.write_text("\n".join([HEAD, *rows, "3600,20,2"]))  # a logger is still at it
    result = run("resume", job, "--from-page", "3", "--log", log, "--json")
    assert result.returncode == 0, result.stderr
    report = json.loads(result.stdout)
    assert report["why"] == "thermocouple log log.csv until 3540 s"
    start = report["thermal"]["start_K"]
    for name, rise in {"j2": 8.4, "link1": 3.4, "j3": 10.4, "wrist": 2.6}.items():
        assert start[name] == pytest.approx(rise, abs=0.02)
    assert json.loads((job / "OPTIC_RASTER.pages.json").read_bytes())["resumed"][0]["log"] == "log.csv"


def test_the_air_that_a_log_found_stays_for_later_pages(job, tmp_path):
    """A hall of 26 degC: a later page waits in that air, by the law of a node that stands."""
    hot = tmp_path / "hot.csv"
    hot.write_text("\n".join([HEAD, *(f"{t},26,33,29,35,28" for t in range(0, 7200, 60)), ""]))
    assert run("resume", job, "--from-page", "2", "--log", hot, "-q").returncode == 0
    assert json.loads((job / "OPTIC_RASTER.pages.json").read_bytes())["resumed"][0]["air_K"] == pytest.approx(6)
    at_once, late = (
        json.loads(run("resume", job, "--from-page", "4", "--late", wait, "--json").stdout) for wait in ("0s", "1h")
    )
    assert at_once["replaced"] == []
    refused(run("resume", job, "--from-page", "4", "--log", hot), 2, "hot.csv", "page 2", "until now")
    for name, node in NODES.items():
        keep, steady = math.exp(-1 / node["tau_h"]), 6 + steady_rise(node, "idle", 0)
        wanted = steady + (at_once["thermal"]["start_K"][name] - steady) * keep
        assert late["thermal"]["start_K"][name] == pytest.approx(wanted, abs=1e-6)
    again = json.loads(run("resume", job, "--from-page", "6", "--late", "0s", "--json").stdout)
    assert again["replaced"] == []


def test_a_log_does_not_tell_how_late_it_is_in_air_that_changes(tmp_path):
    out, log = tmp_path / "out", tmp_path / "log.csv"
    ramp = ("--set", "ambient={kind='ramp', from_degC=20, to_degC=28, over_h=10}")
    assert run("generate", "paths/optic_raster.toml", *SMALL, *ramp, "-q", "-o", out).returncode == 0
    log.write_text("\n".join([HEAD, *(f"{t},26,33,29,35,28" for t in range(0, 7200, 60)), ""]))
    refused(run("resume", out, "--from-page", "1", "--log", log), 2, "log.csv", "how late", "[ambient]", "--late")
    result = run("resume", out, "--from-page", "1", "--log", log, "--late", "2h", "-q")
    assert result.returncode == 0, result.stderr
    (entry,) = json.loads((out / "OPTIC_RASTER.pages.json").read_bytes())["resumed"]
    assert entry["clock_s"] == pytest.approx((5 + 2) * 3600)
    assert "air_K" not in entry


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--from-page", "3"), ("--log", "--late")),
        (("--from-page", "3", "--late", "35min", "--log", "x.csv"), ("--log and --late",)),
        (("--from-page", "3", "--late", "35"), ("35min",)),
        (("--from-page", "3", "--late", "-5min"), ("not a duration",)),
        (("--from-page", "3", "--late", "900h"), ("outside 0 to",)),
        (("--from-page", "30", "--late", "35min"), ("pages 1 to",)),
        (("--from-page", "3", "--late", "35min", "--loaded", "3"), ("handed",)),
        (("--from-page", "3", "--late", "35min", "--done", "4"), ("have run",)),
        (("--from-page", "3", "--late", "35min", "--date", "soon"), ("not a date",)),
        (("--from-page", "3", "--log", "nowhere.csv"), ("nowhere.csv",)),
        (("--from-page", "3", "--late", "35min", "--path", "paths/line_x.toml"), ("another than this",)),
        (("--from-page", "3", "--late", "35min", "--robot", "irb120"), ("irb120",)),
    ],
)
def test_bad_calls_are_refused_and_change_nothing(job, arguments, words):
    before = contents(job)
    refused(run("resume", job, *arguments), 2, *words)
    assert contents(job) == before


def test_a_folder_that_is_none_and_one_without_pages_are_refused(tmp_path):
    refused(run("resume", tmp_path / "no", *RESUME), 2, "no such folder")
    refused(run("resume", tmp_path, *RESUME), 2, "holds no pages")
    (tmp_path / "loop").symlink_to("loop")
    refused(run("resume", tmp_path / "loop", *RESUME), 2, "no such folder")


@pytest.mark.parametrize(("text", "seconds"), [("35min", 2100), ("1h30min", 5400), ("90s", 90), ("1.5h", 5400)])
def test_durations_are_what_a_shift_says(text, seconds):
    assert duration(text, "--late") == seconds


@pytest.mark.parametrize("text", ["", "min", "3", "3 m", "30min1h", "1h1h", "1h-3min", "1e3s", "nan s"])
def test_what_is_no_duration_is_refused(text):
    with pytest.raises(InputError, match="--late"):
        duration(text, "--late")


# Stopped ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("beside", [{}, {"mine.csv": b"mine"}, {"deep/er.txt": b"deep"}])
def test_killed_at_any_step_the_old_pages_stand_or_the_new_and_the_next_call_ends_it(made, tmp_path, beside):
    """Each step of writing by its number; beside a folder of others the next call brings a killed one to its end.

    One run is copied at all of its steps. One more is killed half way: it leaves what was copied there.
    """
    inputs = made.parent.parent / "inputs"
    if not inputs.exists():
        inputs.mkdir()
        for folder in ("paths", "robots"):
            shutil.copytree(kills.ROOT / folder, inputs / folder)
    line = ["resume", "../out", *RESUME, "-q"]

    def world(name):
        shutil.rmtree(tmp_path / name, ignore_errors=True)
        shutil.copytree(inputs, tmp_path / name / "in")
        shutil.copytree(made, tmp_path / name / "out")
        for file, data in beside.items():
            (tmp_path / name / "out" / file).parent.mkdir(exist_ok=True)
            (tmp_path / name / "out" / file).write_bytes(data)
        return tmp_path / name

    place = world("whole")
    old = contents(place / "out")
    whole = kills.run(line, place, kills.Stop(kills.COPIES))
    assert whole.code == 0, whole.error
    new = contents(place / "out")
    assert len(changed(old, new)) > 3
    for file, data in beside.items():
        assert new[file] == data
    steps = len(whole.steps)
    assert steps > 5
    assert kills.run(line, world("killed"), kills.Stop("SIGKILL", steps // 2)).code == -9
    left, copied = (on_disk(tmp_path / name) for name in ("killed", f"whole/{kills.COPIES}/{steps // 2}"))
    assert left == copied
    ends = set()
    for step in range(1, steps + 1):
        place = tmp_path / "whole" / kills.COPIES / str(step)
        replace_together.finish_replacing(place / "out")
        after = {n: c for n, c in contents(place / "out").items() if not n.startswith(".compgen-")}
        assert after in (old, new), f"step {step} of {steps}, {whole.steps[step - 1]}: {sorted(changed(old, after))}"
        ends.add(after == new)
    assert ends == {True, False}
    shutil.copytree(inputs, place / "in")
    assert kills.run(line, place, kills.Stop()).code == 0
    assert contents(place / "out") == new
    assert [p.name for p in place.iterdir() if p.name not in ("in", "out", "stderr")] == []
