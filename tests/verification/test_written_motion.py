"""Times, feeds and joint use of a report are those of the text that was written."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import EXACT, path_file, quiet

from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned.generate import generate
from compgen.report import job_summary, waypoints_blocks
from compgen.verification.twin import prepare
from compgen.verification.written_motion import read_motion


@pytest.fixture(scope="module")
def raster():
    job = load_job(path_file("raster_1300"), None, ["path.stepover_mm=150", "path.diameter_mm=900"])
    return job, *generate(job, quiet)


def lengths(program):
    return np.linalg.norm(np.diff(program.position, axis=0), axis=1)


def test_the_reports_duration_is_the_texts(raster):
    _, planned, corrected = raster
    timing, program = job_summary(planned, corrected)["timing"], corrected.program
    cruise = float((lengths(program) / program.speed).sum())
    assert cruise < timing["duration_s"] < cruise + 0.5 * program.fine.sum()  # s: half of two ramps at each stop
    assert timing["duration_s"] == corrected.deviation.time[-1]
    assert timing["planned_s"] == corrected.trajectory.time[-1]
    rows = list(csv.DictReader(io.StringIO(b"".join(waypoints_blocks(planned, corrected)).decode())))
    assert_allclose([float(r["time_s"]) for r in rows], corrected.deviation.time[corrected.samples], atol=1e-6)


def test_plan_and_text_a_hundredth_apart_is_a_finding():
    _, corrected = generate(load_job(path_file("line_x")), quiet)
    assert abs(corrected.written.time[-1] / corrected.trajectory.time[-1] - 1) > 0.01
    message = next(f.message for f in corrected.findings if f.code == "timing.clock")
    assert f"the written program takes {corrected.written.time[-1]:.2f} s" in message


def test_a_step_of_the_written_speed_is_asked_of_the_joints():
    job = load_job(path_file("line_y"), None, [EXACT])
    _, corrected = generate(job, quiet)
    gaps = lengths(corrected.program)
    middle = len(gaps) // 2
    speed = np.array(corrected.program.speed)
    speed[middle:-4] *= 208 / 393
    smooth, stepped = (
        read_motion(
            prepare(twin_of(job), replace(corrected.program, speed=v), job.history.before, job.history.air),
            gaps,
            job.feed,
        )
        for v in (corrected.program.speed, speed)
    )
    theta, t = corrected.execution().theta[corrected.samples], gaps / speed
    qd = np.diff(theta, axis=0) / t[:, None]
    qdd = (qd[middle] - qd[middle - 1]) / ((t[middle] + t[middle - 1]) / 2)
    assert stepped.hardest == middle + 1
    assert_allclose(stepped.use[1].max(), (np.abs(qdd) / job.robot.acceleration).max(), rtol=1e-9)
    assert stepped.use[1].max() > 2 * smooth.use[1].max()


def test_what_is_written_below_feed_and_the_ramps_are_not_at_feed(raster):
    _, planned, corrected = raster
    gaps, fast = lengths(corrected.program), corrected.program.speed >= planned.feed * (1 - 1e-9)
    assert 0.3 < job_summary(planned, corrected)["timing"]["at_feed"] < gaps[fast].sum() / gaps.sum()
