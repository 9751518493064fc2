"""Cross flight: what one heat model corrected, driven on the other."""

from dataclasses import astuple
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from shipped import ROOT

from compgen.core.findings import Finding
from compgen.core.units import UM
from compgen.job import day_before
from compgen.job.job import Cell, Job, ProgramPlan
from compgen.job.motion_plan import MotionPlan, plan_motion_for_heat, plan_written_motion
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned import generate
from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.pipelines.uncertainty.model_form import fly_across
from compgen.thermal import JointMotion
from compgen.verification.deviation import deviation_from_path
from compgen.verification.twin import prepare

LINE = str(ROOT / "paths" / "line_x.toml")


def corrected(*overrides: str, robot: str | None = None, path: str = LINE) -> tuple[Planned, Corrected]:
    return generate.generate(load_job(path, robot, overrides), lambda stage, share: None)


def told(result: Corrected) -> list[Finding]:
    return [f for f in result.findings if f.code == "thermal.model_form"]


def on_other_model(planned: Planned) -> Job:
    """The job on the robot file's other model, its day planned anew."""
    assert planned.job.on_other_heat_model is not None
    return planned.job.on_other_heat_model(None)


@pytest.mark.parametrize(("own", "other"), [("nodes", "network"), ("network", "nodes")])
def test_a_correction_is_off_on_the_other_model_by_what_the_whole_flight_says(own: str, other: str) -> None:
    planned, result = corrected(f'robot.thermal.model="{own}"')
    form = result.model_form
    assert form is not None
    assert (form.corrected, form.driven) == (own, other)
    job = load_job(LINE, None, [f'robot.thermal.model="{other}"'])
    prepared = prepare(twin_of(job), result.program, job.history.before, job.history.air)
    flown = deviation_from_path(planned.path, prepared.chunks(), prepared.sample_count).extents["total"]
    np.testing.assert_allclose([form.largest, form.rms], [flown.max, flown.rms], rtol=0, atol=0.02 * UM)
    assert 12 * UM < form.largest < 22 * UM  # the study's arm: some 18
    assert 0.1 < form.share < 0.5
    (finding,) = told(result)
    assert f"up to {form.largest / UM:.1f} um off" in finding.message


def test_in_moving_air_both_models_feel_the_same_air() -> None:
    air = ("ambient.kind=wave", "ambient.amplitude_K=3", "ambient.peak_h=6")
    planned, result = corrected(*air)
    job = load_job(LINE, None, [*air, 'robot.thermal.model="network"'])
    prepared = prepare(twin_of(job), result.program, job.history.before, job.history.air)
    flown = deviation_from_path(planned.path, prepared.chunks(), prepared.sample_count).extents["total"]
    still = corrected()[1].model_form
    assert result.model_form is not None
    assert still is not None
    assert abs(result.model_form.largest - flown.max) < 0.02 * UM
    assert abs(flown.max - still.largest) > 0.5 * UM  # the air matters


def test_a_long_program_is_heated_stretch_by_stretch() -> None:
    planned, result = corrected("robot.thermal.model=network")
    prepared = prepare(result.twin, result.program, result.before, result.air)
    other = on_other_model(planned)
    whole, parted = (fly_across(planned.job, other, prepared, result.deviation, stretch) for stretch in (10**6, 40))
    assert len(prepared.timing.time) > 80
    assert abs(whole.largest - parted.largest) < 0.01 * UM


@pytest.mark.parametrize(("late", "cooler"), [
    ("start.delay_min=10", 0.05 * UM), ("compensation.average_over.delay_s=[300,900]", 0.0)
])  # fmt: skip
def test_a_robot_that_stands_before_the_start_does_so_on_both_models(late: str, cooler: float) -> None:
    waited, prompt = corrected(late)[1].model_form, corrected()[1].model_form
    assert waited is not None
    assert prompt is not None
    assert cooler < abs(waited.thermal - prompt.thermal) < 5 * UM


@pytest.mark.parametrize(("served", "start"), [
    ("runs=[40,40]", "start.run=40"), ("delay_s=[9000,9000]", "start.delay_min=150")
])  # fmt: skip
def test_a_file_for_a_later_start_is_judged_at_it_on_both_models(served: str, start: str) -> None:
    """By the twin's whole flights at that start, warm by either model and cold."""
    day = ('cycle=[{state="moving", repeat=40, dwell_s=60}]', "before.0.duration_h=2")
    planned, result = corrected(*day, f"compensation.average_over.{served}")
    flown = []
    for changes in ((start,), (start, 'robot.thermal.model="network"'), ("before=[]", "cycle=[]")):
        job = load_job(LINE, None, [*day, *changes])
        prepared = prepare(twin_of(job), result.program, job.history.before, job.history.air)
        flown.append(deviation_from_path(planned.path, prepared.chunks(), prepared.sample_count))
    own, other, cold = (deviation.error for deviation in flown)
    form = result.model_form
    assert form is not None
    assert abs(form.largest - flown[1].extents["total"].max) < 0.05 * UM
    share = np.sqrt(((other - own) ** 2).sum() / ((own - cold) ** 2).sum())
    assert abs(form.share - share) < 0.02


def test_the_other_model_plans_the_day_and_not_the_program_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    feeds = []

    def planned(program: ProgramPlan, cell: Cell, feed: float) -> JointMotion:
        feeds.append(feed)
        return plan_motion_for_heat(program, cell, feed)

    monkeypatch.setattr(day_before, "plan_motion_for_heat", planned)
    job = load_job(LINE, None, ["process.feed_mm_s=100", "before.0.feed_mm_s=150"])
    assert job.on_other_heat_model is not None
    assert job.on_other_heat_model(None).heat.names != job.heat.names
    assert feeds == [0.15]


@pytest.mark.parametrize(("change", "planned_anew"), [("process.feed_mm_s=200", 1), ("process.thin_um=5", 2)])
def test_a_program_that_ran_before_is_planned_once_for_both_models(
    change: str, planned_anew: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three runs before: how long each takes is the program's, which drops waypoints where it is thinned."""
    feeds = []

    def counted(program: ProgramPlan, cell: Cell, feed: float) -> MotionPlan:
        feeds.append(feed)
        return plan_written_motion(program, cell, feed)

    monkeypatch.setattr(day_before, "plan_written_motion", counted)
    runs = 'before=[{state="moving", feed_mm_s=200, repeat=3}]'
    planned, result = corrected(change, runs, path=str(ROOT / "paths" / "circle_1300.toml"))
    assert feeds == planned_anew * [0.2]
    prepared = prepare(result.twin, result.program, result.before, result.air)
    anew = fly_across(planned.job, on_other_model(planned), prepared, result.deviation)
    assert result.model_form is not None
    assert astuple(result.model_form) == astuple(anew)


@pytest.mark.parametrize("name", ["circle_1300", "spiral_1300", "optic_raster", "optic_spiral"])
@pytest.mark.parametrize("feed", [0.02, 0.2])
def test_few_waypoints_show_what_the_drives_lose(name: str, feed: float) -> None:
    job = load_job(str(ROOT / "paths" / f"{name}.toml"), None, ["robot.thermal.model=network", "before=[]"])
    motions = [
        plan_motion_for_heat(job.plan, job.cell, feed),
        plan_written_motion(job.plan, job.cell, feed).joint_motion,
    ]
    few, every = (job.heat.mean_losses(partial(lambda motion: motion, motion)) for motion in motions)
    for one, other in zip(few, every, strict=True):
        assert np.abs(np.subtract(one, other)).sum() < 0.005 * np.sum(other)


def test_a_robot_with_one_model_has_no_model_form(tmp_path: Path) -> None:
    text = (ROOT / "robots" / "m710ic50.toml").read_text()
    robot = tmp_path / "one.toml"
    robot.write_text(text[: text.index("# Second thermal model")])
    _, result = corrected(robot=str(robot))
    assert result.model_form is None
    assert told(result) == []


def test_the_note_says_how_far_off_the_program_would_be_by_the_other_model() -> None:
    _, result = corrected()
    form = result.model_form
    assert form is not None
    words = f"'{form.driven}', is the true one, this program is up to {form.largest * 1e6:.1f} um off"
    assert words in told(result)[0].message


def test_another_model_that_cannot_be_driven_is_said(tmp_path: Path) -> None:
    text = (ROOT / "robots" / "m710ic50.toml").read_text()
    robot = tmp_path / "broken.toml"
    robot.write_text(text.replace('material = "steel", length_mm = 175,', 'material = "steel", length_mm = 180,'))
    _, result = corrected(robot=str(robot))
    assert result.model_form is None
    assert "model form is not known" in told(result)[0].message
    assert "'d6' is 180 mm" in told(result)[0].message
