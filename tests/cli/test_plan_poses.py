"""``cgen plan-poses`` as a user meets it."""

import csv
import os
from pathlib import Path

import pytest
from command_line import refused, run
from shipped import ROOT


def test_poses_with_measurements_in_them_are_not_planned_anew(tmp_path):
    plan = ("plan-poses", "m710ic50", "-n", "12", "-q", "-o", tmp_path / "o")
    for _ in range(2):  # the second time over its own, not filled in
        result = run(*plan)
        assert result.returncode == 0, result.stderr
    poses = tmp_path / "o" / "poses.csv"
    first, *rows = poses.read_text().splitlines()
    filled = "\n".join([first, rows[0].removesuffix(",,,") + ",1,2,3", *rows[1:]]) + "\n"
    poses.write_text(filled)
    refused(run(*plan), 2, "poses.csv", "measurements", "-o")
    assert poses.read_text() == filled


@pytest.mark.parametrize(
    "option", [("--instrument", "1e308 0 0"), ("--reflector", "nan 0 0"), ("--box", "0 0 0 1 1 1e6"), ("--box", "1 2")]
)
def test_lengths_that_no_cell_has_are_refused(option, tmp_path):
    refused(run("plan-poses", "m710ic50", "-n", "12", *option, "-q", "-o", tmp_path / "o"), 2, *option, "numbers in mm")
    assert not (tmp_path / "o").exists()


def test_a_box_in_metres_is_asked_about_where_no_pose_is_in_it(tmp_path):
    plan = run("plan-poses", "m20ia", "-n", "12", "--box", "0.8 -0.6 -0.3 1.5 0.6 0.9", "-q", "-o", tmp_path / "o")
    refused(plan, 3, "are in the box", "did you mean '800 -600 -300 1500 600 900'? it looks like metres, it is in mm")


def test_all_that_looks_like_metres_is_asked_about(tmp_path):
    values = ("--box", "0.8 -0.6 -0.3 1.5 0.6 0.9", "--reflector", "0.02 0 0.03")
    plan = run("plan-poses", "m20ia", "-n", "12", *values, "-q", "-o", tmp_path / "o")
    refused(plan, 3, "are in the box", "did you mean '20 0 30'?", "did you mean '800 -600 -300 1500 600 900'?")
    assert not (tmp_path / "o").exists()


def test_the_measuring_program_is_there_at_every_moment_and_never_beside_the_poses_of_another(tmp_path, monkeypatch):
    """Also in a folder with files of others, where each file is put in its place."""
    (tmp_path / "mine.txt").write_text("mine")
    plan = ("plan-poses", "m710ic50", "-q", "-o", tmp_path, "-n")
    assert run(*plan, "12").returncode == 0
    older = (tmp_path / "poses.csv").read_bytes()
    moments = []

    def replace(self, to):
        moments.append({p.name: p.read_bytes() for p in tmp_path.iterdir() if p.is_file()})
        os.rename(self, to)

    monkeypatch.setattr(Path, "replace", replace)
    assert run(*plan, "13").returncode == 0
    assert len(moments) == 6
    assert all({"M710IC50_POSES.LS", "M710IC50_REVERSALS.LS"} <= set(files) for files in moments)
    assert not any(files.get("poses.csv") == older for files in moments)


def test_no_pose_stands_where_the_arm_hits_itself(tmp_path):
    """J2 and J3 of all poses and reversal runs lie in the robot file's polygon; without it some would not."""
    text = (ROOT / "robots" / "m710ic50.toml").read_text()
    assert "j2_j3_deg = []" in text
    for name, corners, allowed in (
        ("free", "[]", False),
        ("held", "[[-30, -60], [60, -60], [60, 10], [-30, 10]]", True),
    ):
        robot = tmp_path / f"{name}.toml"
        robot.write_text(text.replace("j2_j3_deg = []", f"j2_j3_deg = {corners}"))
        assert run("plan-poses", robot, "-n", "12", "-q", "-o", tmp_path / name).returncode == 0
        files = [(tmp_path / name / file).read_text() for file in ("poses.csv", "reversals.csv")]
        rows = [row for content in files for row in csv.DictReader(content.splitlines())]
        joints = [(float(row["j2_deg"]), float(row["j3_deg"])) for row in rows]
        assert len(joints) > 12
        assert all(-30 <= j2 <= 60 and -60 <= j3 <= 10 for j2, j3 in joints) is allowed
