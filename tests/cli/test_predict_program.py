"""``predict --program``: the planned program, called so everywhere, and the prediction is of this very text."""

import json

import pytest
from command_line import refused, run
from shipped import path_file

from compgen.fanuc import interpret
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned import generate
from compgen.verification.deviation import deviation_from_path, statistics
from compgen.verification.twin import prepare

PAGED = ("--set", "robot.controller.max_lines=60", "--set", "process.page_stops=anywhere")


def predict(folder, *arguments, path="line_y"):
    return run("predict", path_file(path), "--program", "-o", folder, *arguments)


@pytest.mark.parametrize(
    ("path", "sets"),
    [("line_y", []), ("circle_1300", []), ("circle_1300", ["process.moves=arcs"]), ("line_y", ["process.thin_um=9"])],
)
def test_the_prediction_is_what_the_twin_does_with_the_text(tmp_path, path, sets):
    done = predict(tmp_path, "--json", *(word for item in sets for word in ("--set", item)), path=path)
    assert done.returncode == 0, done.stderr
    (file,) = tmp_path.glob("*.LS")
    program, job = interpret(file.read_bytes()), load_job(path_file(path), None, sets)
    assert program.via.any() == ("process.moves=arcs" in sets)
    prepared = prepare(twin_of(job), program, job.history.before, job.history.air)
    planned = generate.predict(job, lambda stage, share: None)
    flown = deviation_from_path(planned.path, prepared.chunks(), prepared.sample_count)
    report = json.loads(done.stdout)
    assert report == json.loads((tmp_path / "report.json").read_text())
    for name, sizes in statistics(flown).items():
        assert sizes == pytest.approx(report["before"][name], rel=1e-8, abs=1e-9)  # with a compiler and without
    assert report["before"]["total"]["max_um"] > 80  # nothing of it is corrected


def test_nobody_takes_it_for_a_corrected_one(tmp_path):
    done = predict(tmp_path)
    assert "LINE_Y_PLAN.LS" in done.stdout
    text = (tmp_path / "LINE_Y_PLAN.LS").read_bytes()
    assert text.startswith(b"/PROG  LINE_Y_PLAN\r\n")
    assert b'= "compgen PLANNED";' in text
    assert b"!planned, not corrected ;" in text
    assert b"start within" not in text
    assert json.loads(run("inspect", tmp_path / "LINE_Y_PLAN.LS", "--json").stdout)["mark"] == "none"
    corrected = run("correct", tmp_path / "LINE_Y_PLAN.LS", "-o", tmp_path / "c", "--max-um", "500", "-q")
    assert corrected.returncode == 0, corrected.stderr


def test_the_same_command_without_it_takes_it_away(tmp_path):
    predict(tmp_path, "-q")
    text = (tmp_path / "LINE_Y_PLAN.LS").read_bytes()
    predict(tmp_path, "-q")
    assert (tmp_path / "LINE_Y_PLAN.LS").read_bytes() == text
    assert run("predict", path_file("line_y"), "-q", "-o", tmp_path).returncode == 0
    assert not list(tmp_path.glob("*.LS"))


def test_pages_of_arcs_are_parted_between_them(tmp_path):
    assert predict(tmp_path, "-q", *PAGED, "--set", "process.moves=arcs", path="spiral_1300").returncode == 0
    programs = [interpret(f.read_bytes()) for f in tmp_path.glob("*.LS") if b"P[1]" in f.read_bytes()]
    assert len(programs) > 2
    assert all(program.via.any() and not program.via[[0, -1]].any() for program in programs)


def test_every_page_says_it_and_none_is_resumed(tmp_path):
    assert predict(tmp_path, "-q", *PAGED).returncode == 0
    programs = sorted(tmp_path.glob("*.LS"))
    assert len(programs) > 2
    for program in programs:
        assert program.name.startswith("LINE_Y_PLAN")
        assert b"!planned, not corrected ;" in program.read_bytes()
    manifest = json.loads((tmp_path / "LINE_Y_PLAN.pages.json").read_text())
    assert manifest["planned"] == "not corrected"
    refused(run("resume", tmp_path, "--from-page", "2", "--late", "5min"), 2, "LINE_Y_PLAN.pages.json")
    before = json.loads((tmp_path / "report.json").read_text())["before"]
    assert predict(tmp_path, "-q").returncode == 0
    assert [p.name for p in tmp_path.glob("*.LS")] == ["LINE_Y_PLAN.LS"]
    assert json.loads((tmp_path / "report.json").read_text())["before"] != before  # it stopped for the pages


def test_what_the_controller_cannot_load_is_not_written(tmp_path):
    predict(tmp_path, "-q")
    done = predict(tmp_path, "-q", *PAGED[:2])
    refused(done, 1, "controller.max_lines", "LINE_Y_PLAN.LS not written")
    assert not list(tmp_path.glob("*.LS"))
    assert (tmp_path / "report.json").exists()


def test_what_cannot_be_driven_is_refused(tmp_path):
    refused(predict(tmp_path / "out", "--set", "path.x_mm=2400"), 3, "out of reach")
    assert not (tmp_path / "out").exists()


def test_a_program_of_somebody_else_stays(tmp_path):
    (tmp_path / "LINE_Y_PLAN.LS").write_text("/PROG LINE_Y_PLAN\n")
    refused(predict(tmp_path, "-q"), 2, "LINE_Y_PLAN.LS", "not what cgen predict wrote")
    assert (tmp_path / "LINE_Y_PLAN.LS").read_text() == "/PROG LINE_Y_PLAN\n"


def test_the_date_stands_in_the_header(tmp_path):
    assert predict(tmp_path, "-q", "--date", "2026-11-21").returncode == 0
    assert b"DATE 26-11-21" in (tmp_path / "LINE_Y_PLAN.LS").read_bytes()
