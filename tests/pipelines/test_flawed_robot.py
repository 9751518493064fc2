"""A robot with every error source: planned, corrected, written, and proven on a twin that has them by its own code."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from changed import changed
from flawed import SOURCES, flawed_file
from numpy.testing import assert_allclose
from problems import problem_of
from shipped import path_file, quiet
from toolpaths import laid

from compgen import fanuc
from compgen.compensation import nonlinear_program, optimise, refinement
from compgen.compensation.optimise import Status
from compgen.core.dates import DEFAULT_DATE
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Level
from compgen.core.units import DEG, MDEG, MM, UM
from compgen.error_model import beyond_measured
from compgen.error_model.direction_memory import NO_DIRECTION
from compgen.error_model.model import build_error_model
from compgen.error_model.sources.hysteresis import Hysteresis
from compgen.error_model.sources.link_offsets import LinkOffsets
from compgen.error_model.sources.measured_map import AxisMap
from compgen.error_model.sources.thermal_growth import ThermalGrowth
from compgen.error_model.uncertain_sources import source_table
from compgen.job.motion_plan import plan_motion
from compgen.pipelines import correct
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.planned import generate
from compgen.pipelines.planned.program_text import compose_program
from compgen.planning import toolpath
from compgen.program.frames import default_frames
from compgen.report import job_summary
from compgen.robot.joint_path import nearest_turns

# by a robot whose hysteresis is of the study's size
RASTER = (
    "path.diameter_mm=400",
    "path.stepover_mm=80",
    "robot.sources.hysteresis.backlash_mdeg=[2, 1.6, 2, 4, 4, 4]",
)


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    return flawed_file(tmp_path_factory.mktemp("robot"))


@pytest.fixture(scope="module")
def raster(robot):
    job = load_job(path_file("raster_1300"), robot, RASTER)
    return job, *generate.generate(job, quiet)


def codes(findings):
    return {f.code for f in findings}


def test_a_millimetre_of_error_goes_down_to_rounding_and_chord(raster):
    job, planned, corrected = raster
    assert planned.deviation().total().max() > 900 * UM
    assert corrected.inside
    assert corrected.solution.status is Status.CONVERGED
    assert corrected.deviation.total().max() < 1.5 * UM  # straight sweeps in both directions
    assert corrected.deviation.extents["axis_angle"].max < 3 * MDEG
    assert job.bounds.max < 3 * UM


def test_both_directions_of_sweeps_are_cancelled_by_knowing_them(raster):
    """The same job planned without a direction keeps what hysteresis does, on the same twin."""
    job, planned, corrected = raster
    blind = optimise.optimise(replace(problem_of(planned), direction_state=NO_DIRECTION), job.settings)
    seeing = problem_of(planned)
    left = np.linalg.norm(seeing.residual(blind.correction)[planned.path.contact, :3], axis=1)
    assert left.max() > 50 * UM
    assert np.linalg.norm(corrected.solution.residual[planned.path.contact, :3], axis=1).max() < 1 * UM


def test_the_report_names_the_sources(raster):
    _, planned, corrected = raster
    named = job_summary(planned, corrected)["provenance"]["sources"]
    assert named[:2] == ["thermal_growth", "link_offsets"]
    assert len(named) == 15


def test_the_correction_stays_within_its_rate_through_reversals(raster):
    job, planned, corrected = raster
    step = np.linalg.norm(np.diff(corrected.solution.correction[:, :3], axis=0), axis=1)
    assert (step <= job.settings.rate * np.diff(planned.path.arc) * (1 + 1e-6)).all()
    assert np.abs(np.diff(np.sign(planned.motion.direction), axis=0)).max() == 2  # there are reversals


def test_a_reversal_too_sharp_for_the_rate_is_told_and_lags_at_the_stops(robot):
    """A tenth of a degree of blend asks for 60 um/mm: the best legal correction lags there and catches up."""
    width = "robot.sources.hysteresis.width_mdeg=[100, 100, 100, 100, 100, 100]"
    job = load_job(path_file("raster_1300"), robot, [*RASTER, width, "compensation.rate_um_mm=10"])
    planned, corrected = generate.generate(job, quiet)
    assert corrected.solution.status is Status.LIMITED
    (told,) = [f for f in corrected.findings if f.code == "compensation.limited"]
    assert "rate limit at waypoints" in told.message
    contact, segment = planned.path.contact, corrected.execution().segment
    on = contact[segment] & contact[segment + 1]
    total = corrected.deviation.total()
    assert np.percentile(total[on], 99) < 2 * UM
    assert 10 * UM < total.max() < 30 * UM


def test_the_general_program_agrees_with_every_source_on(raster):
    job, planned, _ = raster
    whole = problem_of(planned)
    n = int(np.argmax(planned.path.contact)) + 40
    part = whole.window(slice(n, n + 40))
    fast = optimise.optimise(part, job.settings).correction
    slow = nonlinear_program.solve(part, job.settings, np.zeros_like(fast), np.ones(40, dtype=bool))
    assert slow.converged
    assert np.abs(fast - slow.correction).max() < 2e-9  # m, rad
    assert np.abs(fast[:, :3]).max() > 100 * UM


def test_waypoints_come_closer_where_the_error_bends(raster):
    job = changed(raster[0], "plan.process.lead_in", False)
    planned = plan_motion(job.plan, job.cell, job.feed, quiet)
    plan, process = job.plan.path, job.plan.process
    plain = laid(plan.pattern, plan.surface, plan.boundary, spin=job.tool.spin, chord=process.chord, lift=process.lift)
    assert len(planned.path.arc) > len(plain.arc) + 20
    middle, length = (planned.path.arc[1:] + planned.path.arc[:-1]) / 2, np.diff(planned.path.arc)
    near = np.abs(middle[:, None] - planned.path.arc[planned.path.stop]).min(axis=1) < 20 * MM  # where joints reverse
    assert np.median(length[near]) < 0.6 * np.median(length[~near])
    growth = [s for s in job.sources if isinstance(s, ThermalGrowth)]
    arm = refinement.ErringArm(
        robot=job.robot, posture=job.posture, tool=job.tool.pose, sources=job.sources, model=planned.model
    )
    layout = toolpath.LayoutSettings(process.chord)
    assert refinement.refine(replace(arm, sources=growth), plain, job.feed, layout)[0] is plain
    room = np.diff(planned.path.arc) / (job.feed * job.robot.controller.period)
    assert room.min() >= 0.9  # never below what the controller can follow
    bend, _ = refinement.error_shape(arm, planned.path, planned.theta)
    assert ((bend <= refinement.CHORD_SHARE * process.chord) | (room < 2)).all()  # no segment is left that could be cut


def test_the_shape_of_the_error_is_that_of_places_between_the_ends(raster, monkeypatch):
    """Against places taken one by one; and the same however many segments are looked at together."""
    job, planned, _ = raster
    path, theta = planned.path, planned.theta
    sources = [s for s in job.sources if not isinstance(s, Hysteresis | AxisMap)]  # of one pass or the other alike
    cold = np.zeros((1, planned.model.actual.size1_in(1)))
    model = build_error_model(job.robot, sources, cold.shape[1], job.tool.pose)
    arm = refinement.ErringArm(robot=job.robot, posture=job.posture, tool=job.tool.pose, sources=sources, model=model)
    bend, stretch = refinement.error_shape(arm, path, theta)
    for k in (0, 17, len(bend) // 2, len(bend) - 1):
        at = [path.at(np.array([k]), np.array([share])).pose for share in np.linspace(0, 1, refinement.SAMPLES + 1)]
        joints = [nearest_turns(arm.solve(pose), theta[k : k + 1]) for pose in at]
        off = [model.actual_pose(q, cold).position[0] - p.position[0] for p, q in zip(at, joints, strict=True)]
        line = np.linspace(off[0], off[-1], len(off))
        assert_allclose(bend[k], np.linalg.norm(off - line, axis=1).max(), atol=1e-12)
        way = at[-1].position[0] - at[0].position[0]
        assert_allclose(stretch[k], max(0.0, -(off[-1] - off[0]) @ way / (way @ way)), atol=1e-12)
    monkeypatch.setattr(refinement, "CHUNK", 7)
    assert_allclose(refinement.error_shape(arm, path, theta), [bend, stretch], atol=1e-13)


def test_a_path_cut_finer_is_the_same_path(job):
    plan, process = job.plan.path, job.plan.process
    path = laid(plan.pattern, plan.surface, plan.boundary, spin=job.tool.spin, chord=process.chord, lift=process.lift)
    length = np.diff(path.arc)
    finest = np.where(np.arange(len(length)) % 300 < 40, length / 3, np.inf)
    limits = toolpath.SegmentLimits(path.arc, finest, np.zeros(len(length)))
    finer = toolpath.relaid(path, [limits], toolpath.LayoutSettings(process.chord, process.spacing))
    assert_allclose(finer.arc[finer.stop], path.arc[path.stop], atol=1e-9)
    assert len(finer.arc) > len(path.arc) + 60
    owner = np.clip(np.searchsorted(path.arc, (finer.arc[1:] + finer.arc[:-1]) / 2) - 1, 0, len(length) - 1)
    assert np.all(np.diff(finer.arc) <= finest[owner] * 1.001)
    at = np.clip(np.searchsorted(path.arc, finer.arc, side="right") - 1, 0, len(length) - 1)
    share = np.clip((finer.arc - path.arc[at]) / length[at], 0, 1)
    assert_allclose(path.at(at, share).pose.position, finer.target.position, atol=1e-7)


def test_leaving_the_map_or_the_joints_is_told(robot):
    job = load_job(path_file("line_z"), robot)
    planned = generate.predict(job, quiet)
    (told,) = [f for f in planned.findings if f.code == "sources.map"]
    assert told.level is Level.WARNING
    assert "z by up to 100.0 mm (203 to 1003 measured)" in told.message
    assert "sources.box" not in codes(planned.findings)
    narrow = replace(job.cell, joint_box=np.array([[-90, 90], [-60, 15], *4 * [[-200, 200]]]) * DEG)
    (box,) = beyond_measured.joint_box_findings(narrow.robot, narrow.joint_box, planned.theta)
    assert "J2 by up to" in box.message
    assert "(-60 to 15)" in box.message


def test_an_unknown_start_is_told_until_it_has_faded(robot):
    job = load_job(path_file("line_y"), robot, ("process.lead_in=false",))
    planned = generate.predict(job, quiet)
    (told,) = [f for f in planned.findings if f.code == "sources.start"]
    # nothing but the approach is driven before: most of J1's 0.5 mdeg and windup, 1.5 m away
    n = int(np.argmax(planned.path.contact))
    (lash,) = [s for s in job.sources if isinstance(s, Hysteresis)]
    first = float(told.message.split("J1 ")[1].split(" um")[0]) * UM
    assert first > lash.backlash[0] * np.linalg.norm(planned.path.target.position[n, :2])
    swing = np.array([0, 0.2, 0.0])[:, None] * np.ones(6) + planned.theta[n]
    far = np.array([0, 0.5, 0.0])[:, None] * np.ones(3)
    for contact, faded in (([False, False, True], True), ([True, True, True], False)):
        start = beyond_measured.DrivenPoses(
            theta=swing,
            position=far,
            rise=planned.rise[:3],
            directions=planned.motion.at(slice(3)),
            contact=np.array(contact),
        )
        findings = [*beyond_measured.unknown_start_findings(job.robot, job.sources, planned.model, start)]
        assert (not findings) is faded


def test_the_shipped_robot_has_growth_and_nothing_to_tell(job):
    assert [type(s) for s in job.sources] == [ThermalGrowth]
    planned = generate.predict(job, quiet)
    assert not [f for f in planned.findings if f.code.startswith("sources.")]


@pytest.mark.parametrize("split", [False, True])
def test_an_existing_program_is_corrected_with_the_direction_it_comes_from(raster, robot, split):
    """The planned, uncorrected text as somebody's program."""
    _, planned, corrected = raster
    job, path = planned.job, planned.path
    program, _ = compose_program(job, path.target, planned.theta, planned.trajectory, path, DEFAULT_DATE, None)
    text = fanuc.compose(program)
    cell = load_cell(robot)
    result = correct.correct(
        text, cell, default_frames(), planned.job.history.before, correct.Options(split=split), quiet
    )
    assert result.error[0][result.judged].max() > 900 * UM
    assert result.residual[0][result.judged].max() < 3 * UM
    assert {"sources.start"} <= codes(result.findings)
    assert corrected.inside


def test_sigma_prior_and_provenance_are_read_and_written(robot):
    cell = load_cell(robot)
    known = next(k for k in cell.known if isinstance(k.source, LinkOffsets))
    assert known.provenance == "made up"
    assert_allclose(known.sigma["d"], 20 * UM)
    assert_allclose(known.sigma["a"], np.array([10, 10, 12, 15, 15, 20]) * UM)
    assert_allclose(known.prior["d"], np.array([400, 0, 400, 400, 400, 400]) * UM)
    assert_allclose(known.prior["alpha"], 50 * MDEG)
    table = tomllib.loads(SOURCES.read_text())["sources"]["link_offsets"]
    written = source_table(known)
    assert written["d_um"] == table["d_um"]
    assert written["beta_mdeg"] == table["beta_mdeg"]
    assert written["sigma"]["a_um"] == table["sigma"]["a_um"]
    assert written["prior"] == table["prior"]
    assert json.dumps(written)


def test_the_file_says_the_map_in_metres(robot):
    line = next(s for s in load_cell(robot).sources if isinstance(s, AxisMap))
    assert line.axis == 0
    assert_allclose(line.station[[0, -1]], [0.7, 2.0])
    assert_allclose(line.forward[1], np.array([-12, 20, 12]) * UM)
    assert_allclose(line.place, np.array([0, -30, 203]) * MM)


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("sources.link_ofsets.d_um=1", "sources.link_ofsets: unknown key; did you mean 'link_offsets'?"),
        ("sources.link_offsets.d_mm=[1,1,1,1,1,1]", "d_mm: unknown key; did you mean 'd_um'?"),
        ("sources.link_offsets.d_um=[1,1]", "sources.link_offsets.d_um: [1, 1]"),
        ("sources.link_offsets.a_um=[0,1e6,0,0,0,0]", "a_um.1: 1000000.0: must be less than or equal to 50000"),
        ("sources.joint_zeros.offset_mdeg=[1,1,1,1,1,nan]", "is not a number"),
        ("sources.joint_zeros.sigma.offset_mdge=1", "sigma.offset_mdge: unknown key; did you mean 'offset_mdeg'?"),
        ("sources.joint_zeros.sigma.offset_mdeg=[1,2]", "must be one number, or 6 as the values are"),
        ("sources.joint_zeros.prior.offset_mdeg=-1", "a standard deviation is a number from 0 up"),
        ("sources.joint_zeros.prior.offset_mdeg=\"1\"", "a standard deviation is a number from 0 up"),
        ("sources.hysteresis.width_mdeg=[0,1,1,1,1,1]", "sources.hysteresis.width_mdeg.0: 0"),
        ("sources.gear_harmonics.cycles=[1,1,1,1,1,0]", "sources.gear_harmonics.cycles.5: 0"),
        ("sources.thermal_bend.node.0=\"j9\"", "sources.thermal_bend.node.0: 'j9' is unknown; did you mean 'j"),
        ("sources.thermal_bend.plane.0=\"arm\"", "'arm' does not fit the link 'column'; say 'x' or 'y'"),
        ("sources.thermal_bend.rate_arcsec_K=[1]", "1 entries for 7 links; give one each"),
        ("sources.map.0.station_mm.1=600", "sources.map.0.station_mm: stations must rise"),
        ("sources.map.2.station_mm=[1,2,3]", "sources.map.2.forward_um: 2 rows for 3 stations; give one each"),
        ("sources.map.1.axis=\"x\"", "sources.map: two lines along x"),
        ("sources.map.0.axis=\"w\"", "sources.map.0.axis: 'w'"),
        ("sources.loads.payload_kg=-1", "sources.loads.payload_kg: -1"),
        ("sources.loads.payload_kg=3400", "payload_kg: 3400, and the robot carries payload_kg = 50; give the tool's"),
        ("sources.loads.gravity_m_s2=[0,0,-9810]", "-9810.0]: more than 20 m/s^2"),
        ("sources.box.low_deg.2=100", "sources.box.high_deg.2: 90 must be above low_deg"),
    ],
)  # fmt: skip
def test_bad_tables_are_refused_in_one_line(robot, setting, told):
    with pytest.raises(InputError) as refusal:
        load_cell(robot, [setting])
    assert told in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert Path(robot).name in str(refusal.value)


def test_tables_left_out_are_sources_left_out(tmp_path):
    drop = ("hysteresis", "map", "thermal_bend", "compliance")
    cell = load_cell(flawed_file(tmp_path, "less", drop))
    assert not {s.NAME for s in cell.sources} & set(drop)
    assert len(cell.sources) == 9
