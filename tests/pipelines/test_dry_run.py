"""``--lift-all``: the real program's motion above the part, under another name, never to be taken for the real one."""

import json
from dataclasses import replace

import numpy as np
import pytest
from command_line import refused, run
from numpy.testing import assert_allclose
from shipped import ROOT, path_file, quiet
from toolpaths import laid

from compgen.core.exceptions import InputError
from compgen.core.units import MM, UM
from compgen.fanuc import compose, interpret
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.pipelines.planned.dry_run import dry_run_findings, lifted
from compgen.pipelines.planned.program_text import planned_program, program_name_of
from compgen.verification.twin import execute

HEIGHT = 15 * MM


@pytest.fixture(scope="module", params=[(), ("path.x_mm=0", "path.y_mm=0", "path.z_mm=0")], ids=["World", "frame"])
def both(request, tmp_path_factory):
    """The real program and the lifted one, in World and in a leaning frame."""
    source = path_file("line_y")
    if request.param:
        folder = tmp_path_factory.mktemp("p")
        text = (ROOT / "paths" / "line_y.toml").read_text().replace("#:schema ./path.schema.json\n", "")
        frame = "[frame]\nnumber = 3\nx_mm = 1300\ny_mm = -100\nz_mm = 200\nw_deg = 3\np_deg = -4\nr_deg = 20\n"
        (folder / "line_y.toml").write_text(f"{text}\n{frame}")
        source = str(folder / "line_y.toml")
    job = load_job(source, None, request.param)
    return [generate.generate(j, quiet) for j in (job, lifted(job, HEIGHT))]


def test_it_is_the_real_program_higher_in_its_own_frame(both):
    (real, _), (dry, proven) = both
    texts = [interpret(compose(planned_program(p.job, p.path, p.theta, p.trajectory))) for p, _ in both]
    assert texts[0].uframe == texts[1].uframe
    assert_allclose(texts[1].position - texts[0].position, np.tile([0, 0, HEIGHT], (len(real.theta), 1)), atol=2 * UM)
    assert_allclose(texts[1].rotation, texts[0].rotation, atol=2e-5)
    assert np.array_equal(texts[0].fine, texts[1].fine)
    assert_allclose(real.path.arc, dry.path.arc, rtol=1e-9)
    assert proven.inside


def test_speeds_are_those_of_the_real_one_and_its_bounds_are_judged_up_there(both):
    (_, real), (dry, proven) = both
    assert_allclose(proven.program.speed, real.program.speed, rtol=5e-3)
    execution = proven.execution()
    fraction = execution.fraction[:, None]
    ends = dry.path.target.position[execution.segment], dry.path.target.position[execution.segment + 1]
    target = ends[0] + fraction * (ends[1] - ends[0])
    worst = np.linalg.norm(execution.actual.position - target, axis=1).max()
    assert worst < 2 * UM
    down = execute(proven.twin, real.program, dry.job.history.before)
    assert np.linalg.norm(down.actual.position[0] - execution.actual.position[0]) == pytest.approx(HEIGHT, abs=5 * UM)


def test_nobody_takes_it_for_the_real_one(both):
    (real_plan, real), (dry_plan, dry) = both
    assert (real.program.name, dry.program.name) == ("LINE_Y", "LINE_Y_DRY")
    assert dry.program.comment == "compgen DRY RUN"
    assert "DRY RUN +15 MM" in dry.program.remarks
    assert not any("OVERRIDE" in remark for remark in dry.program.remarks)
    higher = lifted(real_plan.job, 2 * HEIGHT)
    assert len({j.inputs_hash for j in (dry_plan.job, real_plan.job, higher)}) == 3
    warning = next(f for f in dry.findings if f.code == "program.dry_run")
    assert warning.level == "warning"
    assert "at least 15.0 mm clear" in warning.message
    assert not [f for f in real.findings if f.code == "program.dry_run"]


def test_the_command_writes_it_beside_the_real_one(tmp_path):
    made = [
        run("generate", path_file("line_y"), "-q", "-o", tmp_path / name, *extra)
        for name, extra in (("real", ()), ("dry", ("--lift-all", "15")))
    ]
    assert [m.returncode for m in made] == [0, 0], made
    report = json.loads((tmp_path / "dry" / "report.json").read_text())
    assert report["name"] == "line_y_dry"
    assert report["title"].startswith("DRY RUN +15 MM: ")
    written = tmp_path / "dry" / "LINE_Y_DRY.LS"
    refused(run("check-backup", tmp_path / "real" / "LINE_Y.LS", written), 1, "differs", "LINE_Y_DRY")
    refused(run("correct", written, "--robot", "m710ic50", "-o", tmp_path / "c"), 2, "mark")
    again = run("generate", path_file("line_y"), "-q", "-o", tmp_path / "real", "--lift-all", "15")
    refused(again, 2, "line_y")  # the folder of the real one is not overwritten
    assert run("generate", path_file("line_y"), "-q", "-o", tmp_path / "dry", "--lift-all", "15").returncode == 0


def test_its_default_folder_is_its_own(tmp_path):
    done = run("generate", path_file("line_y"), "--lift-all", "5", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "outputs" / "line_y_dry" / "LINE_Y_DRY.LS").exists()


def test_pages_of_it_are_named_and_marked_too(tmp_path):
    few = ["--set", "robot.controller.max_lines=60", "--set", "process.page_stops=anywhere"]
    run("generate", path_file("line_y"), "-q", "-o", tmp_path / "out", "--lift-all", "15", "--force", *few)
    programs = sorted((tmp_path / "out").glob("*.LS"))
    assert len(programs) > 2
    for program in programs:
        assert program.name.startswith("LINE_Y_DRY")
        assert b"!DRY RUN +15 MM ;" in program.read_bytes()


def test_a_name_as_long_as_the_controller_takes_still_says_it():
    job = load_job(path_file("line_y"), None, ["robot.controller.name_length=8"])
    long = replace(job, name="spiral_of_the_large_mirror")
    names = [program_name_of(j) for j in (long, lifted(long, HEIGHT))]
    assert all(len(name) <= 8 for name in names)
    assert names[1].endswith("_DRY")


@pytest.mark.parametrize("value", ["0", "-5", "nan", "inf", "1001"])
def test_a_height_that_is_none_is_refused(value):
    refused(run("generate", path_file("line_y"), "--lift-all", value), 2, "--lift-all", "mm")


def test_out_of_reach_is_refused_with_the_lift(tmp_path):
    done = run("generate", path_file("circle_1300"), "--lift-all", "50", "-o", tmp_path / "out", "-q")
    refused(done, 3, "waypoint 1 ", "out of reach", "lifted by 50 mm (--lift-all)")
    assert not (tmp_path / "out").exists()


def test_a_tool_that_leans_from_the_lift_is_refused():
    """A steep bowl: its edge would be cleared by less than half of the lift."""
    path = [
        "path.diameter_mm=400",
        "surface={kind='conic', radius_of_curvature_m=0.22, conic_constant=0, off_axis_m=0}",
    ]
    job = load_job(path_file("circle_1300"), None, [*path, "path.x_mm=1250", "path.y_mm=0", "tool.number=1"])
    plan, process = job.plan.path, job.plan.process
    bowl = laid(
        plan.pattern, plan.surface, plan.boundary, spin=0.0, chord=process.chord, lift=0.0, spacing=process.spacing
    )
    leaning = r"--lift-all 15: at waypoint \d+ the tool leans \d+ deg .* would clear the part by [0-7]\.\d mm"
    with pytest.raises(InputError, match=leaning):
        list(dry_run_findings(lifted(job, HEIGHT), bowl))
