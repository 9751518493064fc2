"""``--strict``: assumed accelerations are refused where ramps decide whether bounds are kept, and told where not."""

import json
from dataclasses import replace

import numpy as np
import pytest
from command_line import refused, run
from shipped import path_file, quiet

from compgen.core.units import UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned import generate
from compgen.pipelines.planned.assumed_ramps import SHARES, judge_ramps
from compgen.verification.deviation import deviation_from_path
from compgen.verification.twin import execute

#: Many stops of a tool that goes fast: a cold arm warms while it waits in ramps.
PATH = ["path.stepover_mm=20", "before=[]", "process.feed_mm_s=500", "robot.thermal.box.feed_mm_s=[20, 500]"]


@pytest.fixture(scope="module")
def made():
    return generate.generate(load_job(path_file("raster_1300"), None, PATH), quiet)


def flown(made, share):
    """Error of the written text on an arm whose accelerations and jerks are a share of the file's, (M, 3)."""
    planned, corrected = made
    job = planned.job
    arm = replace(job.robot, acceleration=share * job.robot.acceleration, jerk=share * job.robot.jerk)
    execution = execute(replace(twin_of(job), robot=arm), corrected.program, job.history.before, air=job.history.air)
    usual = execute(twin_of(job), corrected.program, job.history.before, air=job.history.air)
    return execution.actual.position - usual.actual.position


def test_the_note_says_how_far_other_ramps_move_the_tool(made):
    planned, corrected = made
    finding = judge_ramps(planned, corrected).findings[-1]
    assert (finding.level, finding.code) == ("note", "timing.ramps")
    moved = max(np.linalg.norm(flown(made, share), axis=1).max() for share in SHARES)
    assert moved > 1e-9
    assert f"move the tool by {max(moved / UM, 0.01):.2f} um at most" in finding.message
    assert np.log(SHARES) == pytest.approx([-0.4, 0.4])


def test_ramps_matter_at_the_starts_that_a_file_serves():
    """As the same start says it that is planned alone: its arm is warm, and moves by more."""
    day = (*PATH, 'cycle=[{state="moving", repeat=12, dwell_s=60}]')
    served, alone, first = (
        judge_ramps(*generate.generate(load_job(path_file("raster_1300"), None, [*day, start]), quiet)).findings[-1]
        for start in ("compensation.average_over.runs=[12, 12]", "start.run=12", "start.run=1")
    )
    assert served == alone != first


def test_what_ramps_hardly_move_is_said_as_a_number_that_one_reads():
    """Of a line it was '6.4e-05 um at most'."""
    assert "move the tool by 0.01 um at most" in run("check", path_file("line_y"), "--strict").stdout


def test_nothing_is_asked_of_accelerations_that_are_known(made):
    planned, corrected = made
    known = replace(
        planned.job, cell=replace(planned.job.cell, robot=replace(planned.job.robot, acceleration_known=True))
    )
    assert judge_ramps(replace(planned, job=known), corrected) is corrected


def test_a_bound_that_only_the_assumed_ramps_keep_is_refused(made):
    """The bound lies between what the assumed ramps leave and what others do."""
    planned, corrected = made
    job = planned.job
    usual = corrected.deviation.on_part["total"].max
    worst = usual
    for share in SHARES:
        arm = replace(job.robot, acceleration=share * job.robot.acceleration, jerk=share * job.robot.jerk)
        execution = replace(corrected, twin=replace(corrected.twin, robot=arm)).execution()
        deviation = deviation_from_path(planned.path, [execution], len(execution.time))
        worst = max(worst, deviation.on_part["total"].max)
    assert worst > usual * (1 + 1e-6)
    bound = [f"bounds={{max_um = {(usual + worst) / 2 / UM!r}}}"]
    arguments = ["check", path_file("raster_1300"), *(word for o in PATH + bound for word in ("--set", o))]
    assert run(*arguments, "-q").returncode == 0
    words = ("outside bounds", "accelerations are assumed", "with ramps at", "bounds.max_um", "acceleration_deg_s2")
    refused(run(*arguments, "-q", "--strict"), 1, *words)
    known = run(*arguments, "--strict", "--set", "robot.limits.acceleration_known=true", "--json")
    assert known.returncode == 0
    assert not [f for f in json.loads(known.stdout)["findings"] if f["code"] == "timing.ramps"]


def test_generate_takes_strict_too_and_its_report_says_what_it_found(tmp_path):
    arguments = ("generate", path_file("line_y"), "-o", tmp_path / "out", "-q", "--set", "bounds={max_um = 0.9}")
    done = run(*arguments, "--strict")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "LINE_Y.LS").exists()
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert [f["level"] for f in report["findings"] if f["code"] == "timing.ramps"] == ["note"]
