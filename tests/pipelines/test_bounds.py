"""Every shipped path keeps the promise in its file, read from the text that was written."""

import json
from pathlib import Path

import numpy as np
import pytest
from shipped import ROOT, path_file, quiet

from compgen.core.json_text import json_text
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned import generate
from compgen.report import job_html, job_summary, waypoints_blocks
from compgen.verification.deviation import deviation_from_path, statistics
from compgen.verification.twin import execute
from compgen.verification.verdict import judge

PATHS = sorted(p.stem for p in (ROOT / "paths").glob("*.toml"))


def test_ten_paths_are_shipped_at_least():
    assert set(PATHS) >= {
        "line_x",
        "line_y",
        "line_z",
        "circle_1300",
        "spiral_1300",
        "spiral_spindle",
        "raster_1300",
        "iso9283",
        "optic_spiral",
        "optic_raster",
    }


def test_the_spindles_flange_is_where_the_bare_flange_was():
    """Same joints: the part stands lower by the tool's length, and UTOOL 1 is written."""
    same = ["process.feed_mm_s=200", "process.chord_um=1.5"]
    bare, tooled = (generate.predict(load_job(path_file(n), None, same), quiet)
                    for n in ("spiral_1300", "spiral_spindle"))  # fmt: skip
    np.testing.assert_allclose(tooled.theta, bare.theta, atol=1e-9)
    assert tooled.job.tool.number == 1


@pytest.mark.parametrize("name", PATHS)
def test_bounds_are_kept(name):
    job = load_job(path_file(name))
    planned, corrected = generate.generate(job, quiet)
    after, before = statistics(corrected.deviation), statistics(planned.deviation())
    assert corrected.inside, [f.message for f in corrected.findings]
    assert after["total"]["max_um"] <= 2.5
    assert after["normal"]["max_um"] <= 1.5
    assert before["total"]["max_um"] > 50
    if name == "spiral_1300":
        assert before["total"]["max_um"] / after["total"]["max_um"] >= 40
    assert corrected.trajectory.utilisation.max() <= 1
    assert np.all(np.diff(corrected.trajectory.time) > 0)


@pytest.mark.parametrize("overrides", [
    ("path.turn=smooth",),
    ("tool.z_mm=50", "tool.y_mm=40", "tool.w_deg=5", "tool.spin_deg=15"),
    ("path.stepover_mm=60", "tool.axisymmetric=true"),
    ("before.0.state=idle",),
])  # fmt: skip
def test_variants_of_the_optic_keep_its_bounds(overrides):
    job = load_job(path_file("optic_raster"), None, ["path.stepover_mm=40", *overrides])
    _, corrected = generate.generate(job, quiet)
    assert corrected.inside, [f.message for f in corrected.findings]


def test_two_runs_give_identical_bytes():
    runs = []
    for _ in range(2):
        planned, corrected = generate.generate(load_job(path_file("line_y")), quiet)
        runs.append(
            (
                corrected.text,
                json_text(job_summary(planned, corrected)),
                b"".join(waypoints_blocks(planned, corrected)),
                job_html(planned, corrected),
            )
        )
    assert runs[0] == runs[1]


def test_before_is_the_twin_on_the_uncorrected_text():
    """The proof's 'before' (pinocchio, from text) is the prediction (CasADi), to rounding and chord."""
    planned = generate.predict(load_job(path_file("line_x")), quiet)
    model = np.linalg.norm(planned.error()[:, :3], axis=1).max()
    twin = planned.deviation().total().max()
    assert abs(model - twin) < 1e-6


def deviation_of(planned, program, before):
    execution = execute(twin_of(planned.job), program, before)
    return deviation_from_path(planned.path, [execution], len(execution.time))


def test_a_wrong_correction_is_found_outside():
    """The verdict bites: the same text, executed cold, is a hundred micrometres off."""
    from dataclasses import replace

    job = load_job(path_file("line_x"))
    planned, corrected = generate.generate(job, quiet)

    cold = deviation_of(planned, corrected.program, ())
    assert cold.total().max() > 100e-6
    found = judge(cold, job.bounds)
    assert {f.code for f in found} == {"bounds.max_um", "bounds.normal_um"}
    shifted = replace(corrected.program, position=corrected.program.position + np.array([0, 0, 3e-6]))
    raised = deviation_of(planned, shifted, job.history.before)
    assert raised.normal.mean() == pytest.approx(3e-6, abs=0.1e-6)


def test_start_window_is_when_drift_reaches_the_setting():
    from dataclasses import replace

    from compgen.thermal import Duty

    job = load_job(path_file("line_x"))
    planned, corrected = generate.generate(job, quiet)
    late = (*job.history.before, Duty("idle", 0.0, corrected.start_window))
    drift = deviation_of(planned, corrected.program, late)
    exact = deviation_of(planned, corrected.program, job.history.before)
    moved = np.linalg.norm(drift.error - exact.error, axis=1).max()
    assert moved == pytest.approx(job.start_drift, rel=0.02)
    assert replace(job, start_drift=1e-6).start_drift < job.start_drift


def test_waypoint_rows_are_the_programs_positions():
    planned, corrected = generate.generate(load_job(path_file("line_x")), quiet)
    lines = b"".join(waypoints_blocks(planned, corrected)).decode().splitlines()
    head = lines[0].split(",")
    expected = (
        "n,time_s,x_mm,y_mm,z_mm,before_dx_um,before_dy_um,before_dz_um,after_dx_um,after_dy_um,after_dz_um,"
        "rise_j2_K,rise_link1_K,rise_j3_K,rise_wrist_K,rise_face_K,contact,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,"
        "band_x_um,band_y_um,band_z_um,band_feed_um,band_cross_um,band_normal_um"
    )
    assert lines[0] == expected
    rows = np.array([[float(v) for v in line.split(",")] for line in lines[1:]])
    assert rows.shape == (len(corrected.program.position), len(head))
    assert rows[0, 1] == 0
    assert np.all(np.diff(rows[:, 1]) > 0)
    commanded = corrected.program.position * 1e3
    assert np.abs(commanded + rows[:, 5:8] * 1e-3 - rows[:, 2:5]).max() < 1.2e-3  # mm: correction is minus the error
    assert rows[:, 16].min() == 0
    assert rows[1:-1, 16].mean() > 0.9
    from compgen.core.evaluation import evaluate
    from compgen.core.units import DEG

    theta = planned.job.robot.to_theta(rows[:, 17:23] * DEG)
    assert np.abs(evaluate(planned.model.nominal, theta)[0] * 1e3 - commanded).max() < 2e-3


def test_report_is_documented():
    planned, corrected = generate.generate(load_job(path_file("line_x")), quiet)
    page = (Path(ROOT) / "docs" / "report.md").read_text()
    data = json.loads(json_text(job_summary(planned, corrected)))

    def keys(tree):
        for key, value in tree.items():
            yield key
            if isinstance(value, dict) and key not in {
                "start_K",
                "end_K",
                "speed",
                "acceleration",
                "jerk",
                "joint_range_deg",
                "budget_um",
                "budget_rms_um",
                "inputs",  # keys of path and robot files: docs/keys.md
                "sha256",  # of programs by their names
            }:
                yield from keys(value)

    missing = [k for k in keys(data) if f"`{k}" not in page and f".{k}" not in page]
    assert not missing
