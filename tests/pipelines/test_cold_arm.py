"""An arm whose warmth nobody has measured: corrected for what is known of it, taken as cold, and said so."""

import json
import tomllib

import tomlkit
from command_line import refused, run
from shipped import ROOT, path_file, quiet
from typer.testing import CliRunner

from compgen.cli.app import app
from compgen.cli.commands import correct
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned.generate import generate
from compgen.verification.verdict import Verdict

assert correct


def cold_robot(folder, sources=None):
    data = tomllib.loads((ROOT / "robots" / "m710ic50.toml").read_text())
    for key in ("thermal", "unknown"):
        data.pop(key, None)
    data["sources"] = sources or {}
    file = folder / "cold.toml"
    file.write_text(tomlkit.dumps(data))
    return str(file)


def corrected_circle(folder, sources=None):
    return generate(load_job(path_file("circle_1300"), cold_robot(folder, sources)), quiet)


def test_a_cold_arm_is_corrected_for_its_geometry(tmp_path):
    planned, corrected = corrected_circle(tmp_path, {"joint_zeros": {"offset_mdeg": [0, 5, -3, 0, 2, 0]}})
    assert corrected.inside
    assert planned.deviation().on_part["total"].max > 150e-6
    assert corrected.deviation.on_part["total"].max < 2.5e-6
    assert not planned.rise.any()
    assert "thermal.none" in {f.code for f in corrected.findings}


def test_its_warmth_is_among_what_is_not_known(tmp_path):
    job = load_job(path_file("circle_1300"), cold_robot(tmp_path))
    assert "warmth" in {unknown.what for unknown in job.cell.unknown}
    assert "warmth" not in {unknown.what for unknown in load_job(path_file("circle_1300")).cell.unknown}


def test_an_arm_that_errs_nowhere_is_not_called_corrected(tmp_path):
    _, corrected = corrected_circle(tmp_path)
    assert corrected.verdict is Verdict.NOT_CORRECTED
    assert not corrected.inside


def test_a_program_that_exists_is_not_called_corrected_either(tmp_path):
    robot = cold_robot(tmp_path)
    _, corrected = generate(load_job(path_file("circle_1300")), quiet)
    (tmp_path / "PLAN.LS").write_bytes(corrected.text)
    command = [
        "correct",
        str(tmp_path / "PLAN.LS"),
        "--robot",
        robot,
        "-o",
        str(tmp_path / "out"),
        "--again",
        "--json",
        "--max-um",
        "5",
    ]
    run = CliRunner().invoke(app, command)
    assert run.exit_code == 1, run.output
    assert json.loads(run.stdout)["verdict"] == "nothing corrected"


def test_a_planned_program_that_is_not_written_says_what_keeps_it_back(tmp_path):
    (tmp_path / "own.csv").write_text("x_mm,y_mm,z_mm\n1300,0,200\n1310,4,200\n1320,0,200\n1330,-4,200\n")
    (tmp_path / "own.toml").write_text(
        '[path]\npattern = "points"\nfile = "own.csv"\ncorner_deg = 90\n'
        "[process]\nfeed_mm_s = 50\n[bounds]\nmax_um = 50\n"
    )
    robot, out = cold_robot(tmp_path), tmp_path / "out"
    result = run("generate", tmp_path / "own.toml", "--robot", robot, "-o", out, "-q")
    refused(result, 1, "nothing corrected", "behind it the curve leaves", "OWN.LS not written")
    assert "makes this arm err" not in result.stderr


def test_its_planned_program_is_written_and_not_called_corrected(tmp_path):
    robot, out = cold_robot(tmp_path), tmp_path / "out"
    result = run("generate", path_file("line_x"), "--robot", robot, "-o", out, "-q")
    refused(result, 1, "nothing corrected", "LINE_X.LS is written as planned")
    assert (out / "LINE_X.LS").read_bytes().startswith(b"/PROG  LINE_X")
    assert json.loads((out / "report.json").read_text())["verdict"] == "nothing corrected"
    broken = run("generate", path_file("line_x"), "--robot", robot, "-o", out, "-q", "--set", "bounds.max_um=0.01")
    assert broken.returncode == 1
    assert "not written" in broken.stderr
    assert not (out / "LINE_X.LS").exists()
