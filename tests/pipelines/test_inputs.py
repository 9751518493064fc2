"""What a run was made from, in its report: every key of both files, and the files that they name."""

import json
import tomllib
from hashlib import sha256
from math import cos, sin

import pytest
from shipped import ROOT, path_file, quiet

from compgen.core.toml import MOST_VALUES, check, dotted_keys, read_toml, read_toml_text
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.robot_file import cell_of, load_cell
from compgen.pipelines.files.schema import PathFile
from compgen.pipelines.planned import generate
from compgen.pipelines.planned.dry_run import lifted
from compgen.report import job_summary

LINE = path_file("line_y")


def test_a_report_has_every_value_of_both_files_and_every_default():
    inputs = job_summary(generate.predict(load_job(LINE), quiet), None)["inputs"]
    for kind, file in (("path", LINE), ("robot", ROOT / "robots" / "m710ic50.toml")):
        written = dotted_keys(tomllib.loads(ROOT.joinpath(file).read_text()))
        used = dotted_keys(inputs[kind])
        assert {key: used[key] for key in written} == written
    assert inputs["path"]["process"].keys() >= {"feed_mm_s", "chord_um", "lift_mm", "acc_percent"}
    assert inputs["path"]["process"]["acc_percent"] is None  # left open: the robot file decides
    assert set(inputs["path"]) == set(PathFile.model_fields)


def test_inputs_read_again_are_the_same_job():
    """Nothing is lost or changed: the keys of a report are themselves a path file."""
    job = load_job(LINE, overrides=["process.feed_mm_s=73", "before.0.duration_h=2.25"])
    again = check(PathFile, dict(job.inputs["path"]), "again")
    assert again.model_dump(mode="json", by_alias=True) == job.inputs["path"]
    assert json.loads(json.dumps(job.inputs)) == job.inputs


def test_overrides_and_a_chosen_robot_are_in_the_inputs(tmp_path):
    other = tmp_path / "other.toml"
    other.write_bytes((ROOT / "robots" / "m710ic50.toml").read_bytes())
    plain = dotted_keys(load_job(LINE).inputs)
    changed = dotted_keys(load_job(LINE, str(other), ["process.feed_mm_s=73", "robot.thermal.cte_um_m_K=12.5"]).inputs)
    differ = {key: (plain.get(key), value) for key, value in changed.items() if plain.get(key) != value}
    assert {key: new for key, (_, new) in differ.items()} == {
        "path.process.feed_mm_s": 73.0,
        "path.robot": "other",
        "robot.thermal.cte_um_m_K": 12.5,
    }


def test_files_that_a_path_file_names_are_there_by_name_and_hash(tmp_path):
    rows = "x_mm,y_mm,z_mm\n" + "".join(f"{1250 + 2 * i},{0.02 * i * i},-150\n" for i in range(40))
    (tmp_path / "points.csv").write_text(rows)
    (tmp_path / "air.csv").write_text("time_s,ambient_degC\n0,20\n36000,22\n")
    bound = tomllib.loads((ROOT / "paths" / "line_y.toml").read_text())["bounds"]["max_um"]
    file = tmp_path / "own.toml"
    file.write_text(
        'robot = "m710ic50"\n[path]\npattern = "points"\nfile = "points.csv"\n'
        f'[process]\nfeed_mm_s = 50.0\n[ambient]\nkind = "csv"\nfile = "air.csv"\n[bounds]\nmax_um = {bound}\n'
    )
    files = load_job(str(file)).inputs["files"]
    assert files == {
        key: {"file": name, "sha256": sha256((tmp_path / name).read_bytes()).hexdigest()}
        for key, name in (("ambient.file", "air.csv"), ("path.file", "points.csv"))
    }


def test_a_long_list_is_named_by_its_hash():
    source = ROOT / "robots" / "m710ic50.toml"
    order = list(range(1, 61))
    ripple = {"order": order, "cosine_mdeg": 6 * [60 * [0.0]]}
    half = 6 * [60 * [0.5]]

    def inputs_with(sine):
        text = read_toml_text(source, "robots")
        text.tables.setdefault("sources", {})["joint_ripple"] = {**ripple, "sine_mdeg": sine}
        return cell_of(text, source, ()).inputs["sources"]["joint_ripple"]

    used = inputs_with(half)
    assert used["order"] == order
    assert len(order) < MOST_VALUES < 360
    assert used["sine_mdeg"]["values"] == 360
    other = [row[:] for row in half]
    other[5][59] = 0.25
    assert inputs_with(other)["sine_mdeg"]["sha256"] != used["sine_mdeg"]["sha256"]


def test_a_dry_run_says_its_lift():
    job = lifted(load_job(LINE), 0.05)
    assert job.inputs["options"] == {"lift_all_mm": pytest.approx(50)}


def test_a_cell_of_an_existing_program_has_its_robot_file():
    cell = load_cell("m710ic50", ["thermal.cte_um_m_K=12.5"])
    written = dotted_keys(read_toml(ROOT / "robots" / "m710ic50.toml", "robots"))
    used = dotted_keys(cell.inputs)
    assert {key for key in written if used[key] != written[key]} == {"thermal.cte_um_m_K"}


def test_a_point_that_a_program_of_the_day_before_passes_is_an_input(tmp_path):
    def points(radius):
        turns = [k / 40 * 6.2832 for k in range(41)]
        rows = "".join(f"{1400 + radius * cos(t):.3f},{radius * sin(t):.3f},-150\n" for t in turns)
        (tmp_path / "points.csv").write_text(f"x_mm,y_mm,z_mm\n{rows}")

    own = '[path]\npattern = "points"\nfile = "points.csv"\n[process]\nfeed_mm_s = 200\n'
    (tmp_path / "warm.toml").write_text(f'robot = "m710ic50"\n{own}[bounds]\n')
    day = '[[before]]\nstate = "moving"\nprogram = "warm"\nrepeat = 200\ndwell_s = 5\n'
    (tmp_path / "job.toml").write_text((ROOT / LINE).read_text().split("[[before]]")[0] + day + "[bounds]\n")
    jobs = []
    for radius in (300, 40):
        points(radius)
        jobs.append(load_job(str(tmp_path / "job.toml")))
    warm, less = jobs
    assert warm.history != less.history
    assert warm.inputs_hash != less.inputs_hash
    before, after = (job.inputs["files"]["before.0.program.path.file"] for job in jobs)
    assert before["file"] == after["file"] == "points.csv"
    assert before["sha256"] != after["sha256"] == sha256((tmp_path / "points.csv").read_bytes()).hexdigest()
