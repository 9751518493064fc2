"""The rest of a job, corrected anew: against jobs that knew from the beginning, and by hand."""

import json
import shutil
from dataclasses import replace
from hashlib import sha256

import naive_files
import naive_heat
import numpy as np
import pytest
import states
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import chi2
from shipped import ROOT, path_file, quiet

from compgen import fanuc as ls
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.units import UM
from compgen.fanuc.paging.join_check import check_manifest
from compgen.job.anchored_start import made_from_robot
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned import generate
from compgen.pipelines.resume.beginning import (
    Begun,
    Logged,
    begin_late,
    begin_with_log,
    begin_with_state,
    known_state,
    read_rises,
)
from compgen.pipelines.resume.pages_anew import prove_pages
from compgen.pipelines.resume.rest import plan_whole
from compgen.pipelines.resume.resume import resume
from compgen.pipelines.resume.written_job import job_of_pages, read_written_job
from compgen.program.pages import CHECKSUM, JoinError, with_checksum
from compgen.robot import inverse_kinematics, joint_path
from compgen.thermal import Duty, state_after
from compgen.thermal.tables.schema import AmbientTable, LogTable
from compgen.verification.deviation import deviation_from_path
from compgen.verification.twin import prepare

SMALL = ("path.stepover_mm=240", "robot.controller.max_positions=200", "process.page_stops=off the part")
IDLE = 'before=[{state="moving", feed_mm_s=200, duration_h=5}, {state="idle", duration_h=%.17g}]'
THIN = "process.thin_um=1"
PLAY = (
    "robot.sources.hysteresis={backlash_mdeg=[0.2, 0.2, 0.2, 0.2, 0.2, 0.2], width_mdeg=[300, 300, 300, 300, 300, 300]}"
)


def write(folder, *overrides, name="optic_raster", small=SMALL):
    """A job in pages in a folder, as ``generate`` leaves it."""
    folder.mkdir(exist_ok=True)
    job = load_job(path_file(name), None, (*small, *overrides))
    _, corrected = generate.generate(job, quiet)
    for file, data in corrected.delivery.files:
        (folder / file).write_bytes(data)
    return folder


def later(folder, page, late, **options):
    """Its pages from one on, written anew for a late start."""
    written = read_written_job(folder)
    whole = plan_whole(job_of_pages(written), quiet)
    return resume(written, whole, page, lambda known: begin_late(known, late), "2026-01-31", quiet, **options)


def put(folder, resumed):
    for file, data in resumed.files.items():
        (folder / file).write_bytes(data)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return write(tmp_path_factory.mktemp("job"))


@pytest.fixture
def copy(made, tmp_path):
    for file in made.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    return tmp_path


def positions(files, name="OPTIC_RASTER_"):
    return [ls.interpret(data) for file, data in sorted(files.items()) if file.startswith(name) and ".LS" in file]


def test_a_late_start_is_what_generate_makes_of_the_same_wait(made, tmp_path):
    """From the first page on: every position, speed and stop of a job whose day has the wait in it."""
    resumed = later(made, 1, 2400.0)
    waited = write(tmp_path / "waited", IDLE % (2400 / 3600))
    twins = zip(positions(resumed.files), positions({f.name: f.read_bytes() for f in waited.iterdir()}), strict=True)
    pages = list(twins)
    assert len(pages) > 3
    for ours, oracle in pages:
        for field in ("position", "rotation", "turns", "speed", "fine"):
            assert_array_equal(getattr(ours, field), getattr(oracle, field), err_msg=field)
    assert resumed.join is None
    assert resumed.replaced == tuple(page.file for page in resumed.written.pages)


@pytest.mark.parametrize("day", [(), ('before=[{state="moving", feed_mm_s=200, duration_h=3}]',)])
def test_the_band_of_a_page_that_nothing_held_up_is_that_of_its_job(tmp_path, day):
    """What the law and the air miss has grown all day: it does not begin with the page."""
    _, corrected = generate.generate(load_job(path_file("optic_raster"), None, (*SMALL, *day)), quiet)
    for file, data in corrected.delivery.files:
        (tmp_path / file).write_bytes(data)
    for page in (2, 6):
        resumed = later(tmp_path, page, 0.0)
        first = resumed.written.pages[page - 1].first
        _, of_job, of_page = np.intersect1d(corrected.band.rows - first, resumed.band.rows, return_indices=True)
        assert len(of_job) > 100
        assert_allclose(resumed.band.radius[of_page], corrected.band.radius[of_job], rtol=0.05)


def test_a_bound_with_a_probability_is_asked_of_the_new_pages(tmp_path):
    """No arm keeps 1 um of a file that knows 36: it was asked of the whole job alone. Draws and band agree."""
    folder = write(tmp_path / "job", "bounds.guaranteed={max_um=1, share=0.8, confidence=0.8}")
    resumed = later(folder, 5, 3600.0)
    assert not resumed.inside
    assert [f.level for f in resumed.findings if f.code == "bounds.guaranteed.max_um"] == ["outside"]
    assert "band.linear" not in {f.code for f in resumed.findings}


def test_the_old_pages_are_flown_through_the_wait(made):
    """What they would have left: the undivided old text on the twin after the same wait."""
    resumed = later(made, 1, 2400.0)
    job = load_job(path_file("optic_raster"), None, SMALL)
    planned, corrected = generate.generate(job, quiet)
    duties = (*job.history.before, Duty("idle", 0.0, 2400.0))
    prepared = prepare(twin_of(job), corrected.program, duties, job.history.air)
    deviation = deviation_from_path(planned.path, prepared.chunks(), prepared.sample_count)
    assert_allclose(resumed.planned.deviation().total(), deviation.total(), atol=1e-11)
    largest = max(page.before.max for page in resumed.pages)
    assert largest == pytest.approx(deviation.on_part["total"].max, abs=1e-11)
    assert largest > 5 * UM > UM > max(page.after.max for page in resumed.pages)


def test_the_rest_of_a_job_is_right_for_the_wait_before_its_page(made):
    """From the third page on, by the model node by node: driven so far, stood so long, driven on."""
    resumed = later(made, 3, 1800.0)
    whole = plan_whole(job_of_pages(resumed.written), quiet)
    law, row = whole.job.heat.law, resumed.written.pages[2].first
    assert law is not None
    rise = state_after(whole.job.heat, whole.job.history.before)
    for goal, dt in zip(
        law.steady_rise("moving", whole.trajectory.driven_speed[:row]), np.diff(whole.time[: row + 1]), strict=True
    ):
        rise = goal + (rise - goal) * np.exp(-dt / law.tau)
    rise = state_after(whole.job.heat, [Duty("idle", 0.0, 1800.0)], rise)
    assert_allclose(resumed.planned.rise[0], rise, atol=1e-9)
    assert_allclose(resumed.begun.state, rise, atol=1e-9)
    left = whole.model.error(ls_joints(resumed), resumed.planned.rise, resumed.planned.path.target)
    assert np.linalg.norm(left[:, :3], axis=1).max() < 1 * UM
    assert resumed.join is not None
    assert not resumed.join.on_the_part


def ls_joints(resumed):
    """Joints of the new text's positions."""
    job, text = resumed.planned.job, resumed.program
    joints, _ = inverse_kinematics.solve_tool(job.robot, Pose(text.position, text.rotation), job.tool.pose, job.posture)
    return joint_path.nearest_turns(joints, resumed.planned.theta)


def test_pages_keep_names_numbers_speeds_and_stops(made):
    resumed = later(made, 3, 1800.0)
    old = {page.file: page.data for page in resumed.written.pages[2:]}
    assert list(resumed.files) == [*old, "OPTIC_RASTER.pages.json"]
    for before, after in zip(positions(old), positions(resumed.files), strict=True):
        assert (before.name, len(before.position), before.comment) == (after.name, len(after.position), after.comment)
        assert (before.uframe, before.utool, before.posture, before.date) == (
            after.uframe, after.utool, after.posture, after.date,
        )  # fmt: skip
        assert_array_equal(before.fine, after.fine)
        assert_allclose(before.speed, after.speed, rtol=6e-3)
        assert 0 < np.abs(before.position - after.position).max() < 50 * UM
        assert len(before.remarks) == len(after.remarks)


def test_the_manifest_says_what_was_replaced_when_and_why(made):
    resumed = later(made, 3, 1800.0, done=1, loaded=2)
    record = json.loads(resumed.files["OPTIC_RASTER.pages.json"])
    old = json.loads((made / "OPTIC_RASTER.pages.json").read_bytes())
    (entry,) = record["resumed"]
    assert (entry["from_page"], entry["date"], entry["done"], entry["loaded"]) == (3, "2026-01-31", 1, 2)
    assert entry["late_s"] == 1800
    for page, line, before in zip(entry["pages"], record["pages"][2:], old["pages"][2:], strict=True):
        data = resumed.files[line["file"]]
        assert page["new_sha256"] == line["sha256"] == sha256(data).hexdigest()
        assert page["old_sha256"] == before["sha256"]
        assert line["start_s"] == pytest.approx(before["start_s"] + 1800, abs=1e-2)
        assert page["before"]["max_um"] > page["after"]["max_um"]
    assert record["pages"][:2] == old["pages"][:2]
    assert record["main"] == old["main"]
    files = {file.name: file.read_bytes() for file in made.iterdir()} | resumed.files
    check_manifest(files["OPTIC_RASTER.pages.json"], files)


def test_waits_add_up_from_one_resume_to_the_next_and_the_same_call_again_changes_nothing(copy):
    put(copy, later(copy, 2, 1200.0))
    written = read_written_job(copy)
    whole = plan_whole(job_of_pages(written), quiet)
    again = later(copy, 2, 1200.0)
    assert again.replaced == ()
    known = known_state(whole, written.resumed, 4, written.pages[3].first)
    row = written.pages[1].first
    law, rise = whole.job.heat.law, np.array(written.resumed[0]["state"])
    assert law is not None
    steady = law.steady_rise("moving", whole.trajectory.driven_speed[row : written.pages[3].first])
    for goal, dt in zip(steady, np.diff(whole.time[row : written.pages[3].first + 1]), strict=True):
        rise = goal + (rise - goal) * np.exp(-dt / law.tau)
    assert_allclose(known.state, rise, atol=1e-9)
    assert known.clock == pytest.approx(whole.job.clock + whole.time[written.pages[3].first] + 1200)
    put(copy, later(copy, 4, 600.0))
    assert later(copy, 4, 600.0).replaced == ()
    assert len(read_written_job(copy).resumed) == 2
    assert later(copy, 3, 60.0).replaced  # pages 3 on are another day's again, and the text reads


@pytest.mark.parametrize(
    "change", [THIN, PLAY, "robot.thermal.model=network", "ambient={kind='ramp', from_degC=20, to_degC=24, over_h=8}"]
)
def test_other_jobs_are_resumed_too(tmp_path, change):
    """Thinned waypoints stay those of the first file; play remembers the page before; any heat and any air."""
    folder = write(tmp_path / "job", change)
    resumed = later(folder, 2, 2400.0)
    assert resumed.inside, resumed.findings
    assert max(page.before.max for page in resumed.pages) > 2 * max(page.after.max for page in resumed.pages)
    never = later(folder, 2, 0.0)
    old = positions({page.file: page.data for page in never.written.pages[1:]})
    for before, after in zip(old, positions(never.files), strict=True):
        assert np.abs(before.position - after.position)[1:].max() < 1.5 * UM  # as written: a digit either way


def test_the_step_at_the_join_is_what_has_drifted(made):
    """By the error model: where the old text holds the tool, and where the new text puts it."""
    resumed = later(made, 3, 7200.0)
    whole, join = plan_whole(job_of_pages(resumed.written), quiet), resumed.join
    row, rise = resumed.written.pages[2].first, resumed.planned.rise[:1]
    job, target = resumed.planned.job, whole.path.target[row : row + 1]
    at = whole.theta[row : row + 1]
    old = ls.interpret(resumed.written.pages[1].data)
    new = ls.interpret(resumed.files[resumed.written.pages[2].file])
    shift = [text.position[k] - target.position[0] for text, k in ((old, -1), (new, 0))]
    error = whole.model.error(at, rise, target)[0, :3]
    assert join.step == pytest.approx(np.linalg.norm(shift[1] - shift[0]), rel=2e-3)
    assert join.demanded == pytest.approx(np.linalg.norm(error + shift[0]), abs=5e-9)
    assert join.beyond == pytest.approx(np.linalg.norm(error + shift[1]), abs=5e-9)
    assert join.beyond < 1 * UM < 5 * UM < join.demanded
    assert join.gap == pytest.approx(np.abs(shift[1] - shift[0]).max(), abs=1e-12)
    assert job.plan.process.thin is None


def test_a_step_on_the_part_is_a_warning_and_one_beyond_what_drifted_is_outside(tmp_path):
    small = ("robot.controller.max_lines=60", "process.page_stops=anywhere")
    folder = write(tmp_path / "job", name="line_x", small=small)
    resumed = later(folder, 2, 7200.0)
    finding = next(f for f in resumed.findings if f.code == "resume.join")
    assert finding.level == "warning"
    assert resumed.inside
    assert resumed.join.on_the_part
    assert resumed.join.step > 10 * UM
    clamped = write(tmp_path / "clamped", "compensation.clamp_mm=0.1", name="line_x", small=small)
    written = read_written_job(clamped)
    whole = plan_whole(job_of_pages(written), quiet)
    hot = whole.job.state() * 2.5

    def begin(known):
        return Begun(cell=known.cell, state=hot, clock=known.clock, why="hot", cause={})

    stuck = resume(written, whole, 2, begin, "2026-01-31", quiet)
    finding = next(f for f in stuck.findings if f.code == "resume.join")
    assert finding.level == "outside"
    assert "beyond what has drifted" in finding.message
    assert not stuck.inside


def test_a_page_that_does_not_go_on_is_refused(made):
    resumed = later(made, 3, 1800.0)
    before = ls.interpret(resumed.written.pages[1].data)
    files = {page.file: resumed.files[page.file] for page in resumed.written.pages[2:]}
    program = replace(resumed.program)
    assert len(prove_pages(before, files, program, resumed.join.gap).position) == len(program.position)
    with pytest.raises(JoinError, match="starts"):
        prove_pages(before, files, program, 0.5 * resumed.join.gap)
    name = next(iter(files))
    own = ls.interpret(files[name])
    moved = replace(own, position=own.position + np.array([1e-6, 0, 0]))
    with pytest.raises(JoinError):
        prove_pages(before, {**files, name: ls.compose(moved)}, program, 1.0)


# An anchored state -----------------------------------------------------------------------------------------------


def by_state(folder, page, file, age=0.0):
    written = read_written_job(folder)
    whole = plan_whole(job_of_pages(written), quiet)
    return resume(written, whole, page, lambda known: begin_with_state(known, file, age), "2026-01-31", quiet)


def moved_state(folder, tmp_path, **changes):
    """A state at page 3 whose base has moved, in a file."""
    whole = plan_whole(job_of_pages(read_written_job(folder)), quiet)
    rise = np.array([9.0, 3.6, 11.0, 2.7, 2.1])
    base = np.array([150e-6, -80e-6, 60e-6, 0, 0, 2e-5])
    return states.written(states.state_of(whole.job, **{"rise": rise, "base": base, **changes}), tmp_path), rise


def test_a_state_brings_its_warmth_and_its_base(copy, tmp_path):
    """The rest of a job that generate makes with that state from the beginning differs by its warmth alone."""
    place = tmp_path / "state"
    place.mkdir()
    file, rise = moved_state(copy, place)
    resumed = by_state(copy, 1, file)
    assert_allclose(resumed.planned.rise[0], rise, atol=1e-9)
    oracle = write(place / "oracle", f"state.file='{file}'")
    for ours, theirs in zip(
        positions(resumed.files), positions({f.name: f.read_bytes() for f in oracle.iterdir()}), strict=True
    ):
        assert_array_equal(ours.position, theirs.position)
        assert_array_equal(ours.rotation, theirs.rotation)
    assert resumed.pages[0].before.max > 150 * UM
    assert resumed.pages[0].after.max < 1.2 * UM


def test_a_base_that_has_moved_stays_moved_for_later_pages(copy, tmp_path):
    place = tmp_path / "state"
    place.mkdir()
    file, _ = moved_state(copy, place)
    put(copy, by_state(copy, 3, file))
    assert by_state(copy, 3, file).replaced == ()
    late = later(copy, 4, 600.0)
    assert late.begun.cell.state.base[0] == pytest.approx(150e-6)
    assert max(page.before.max for page in late.pages) < 10 * UM  # the base is in the pages already
    with pytest.raises(InputError, match="page 3 starts with this state"):
        by_state(copy, 4, file)
    older, _ = moved_state(copy, place, time=100.0)
    with pytest.raises(InputError, match="a later one"):
        by_state(copy, 4, older)


def test_what_a_state_left_open_of_warmth_fades_and_gives_way_to_a_log(copy, tmp_path):
    """Three kelvin of each node, five hours later, fade by their lags; a log since then tells the warmth anew."""
    place = tmp_path / "state"
    place.mkdir()
    open_yet = np.diag([9.0] * 5 + [(20e-6) ** 2] * 3 + [0.0] * 3)
    file, _ = moved_state(copy, place, covariance=open_yet)
    put(copy, by_state(copy, 3, file))
    base = 20e-6 * np.sqrt(chi2.ppf(0.95, 3))  # of a sphere, which the wait and the log leave
    now, later_on = (shares_of(later(copy, 4, late))["anchored state"] for late in (0.0, 5 * 3600.0))
    slowest = np.exp(-5.0 / max(node["tau_h"] for node in naive_heat.NODES.values()))
    assert (
        np.hypot(base, 0.2 * np.sqrt(now**2 - base**2)) < later_on < np.hypot(base, slowest * np.sqrt(now**2 - base**2))
    )
    log = place / "log.csv"
    readings = "".join(f"{t},29,23.6,31,22.7,22.1\n" for t in range(0, 601, 60))
    log.write_text(f"time_s,j2_degC,link1_degC,j3_degC,wrist_degC,face_degC\n{readings}")
    written = read_written_job(copy)
    whole = plan_whole(job_of_pages(written), quiet)
    by_log = resume(written, whole, 4, lambda known: begin_with_log(known, str(log)), "2026-01-31", quiet)
    assert shares_of(by_log)["anchored state"] == pytest.approx(base, rel=1e-3)
    assert shares_of(by_log)["temperature log"] > 10 * UM


def test_a_log_counts_from_what_the_air_of_its_job_counts_from(tmp_path):
    """In a hall at 12 degC the parts counted from 12, as [log] had it, and the air of [ambient] from 20."""
    log, cell = tmp_path / "log.csv", load_job(path_file("line_y")).cell
    rows = [f"{60 * n},12,18,14,20,13.5\n" for n in range(60)]
    log.write_text("time_s,ambient_degC,j2_degC,link1_degC,j3_degC,wrist_degC\n" + "".join(rows))
    table = LogTable(file="log.csv", reference=12.0)
    for zero in (12.0, 20.0):
        logged = Logged(AmbientTable(value_degC=12.0, reference_degC=zero), table)
        if zero == 12.0:
            assert read_rises(cell, logged, str(log)).readings["j3"][-1] == pytest.approx(8.0)
        else:
            with pytest.raises(InputError, match=r"log.csv: its rises count from 12.0 degC, the air from 20; give amb"):
                read_rises(cell, logged, str(log))


def shares_of(resumed):
    return {share.source: share.largest for share in resumed.band.budget}


@pytest.mark.parametrize("verdict", ["anchored", "something moved"])
def test_a_state_that_found_more_than_warmth_is_warned_of(made, tmp_path, verdict):
    file, _ = moved_state(made, tmp_path, verdict=verdict)
    warnings = [f.message for f in by_state(made, 3, file).findings if f.code == "state"]
    assert [("(something moved" in message, "find what moved" in message) for message in warnings] == (
        [(True, True)] if verdict == "something moved" else []
    )


def test_a_state_of_other_values_of_the_robot_file_is_warned_of(made, tmp_path):
    job = job_of_pages(read_written_job(made))
    files = {**made_from_robot(job.cell), "robot_overrides": "0" * 64}
    file, _ = moved_state(made, tmp_path, made_from=files)
    (warning,) = [f for f in by_state(made, 3, file).findings if f.code == "state"]
    assert warning.level == "warning"
    assert "other values of the robot file" in warning.message


def test_a_state_older_than_its_window_is_refused(made, tmp_path):
    file, _ = moved_state(made, tmp_path)
    assert by_state(made, 3, file, 1799.0).inside
    with pytest.raises(InputError, match="window_s"):
        by_state(made, 3, file, 1801.0)


def test_a_state_waits_in_the_air_that_the_path_file_says(tmp_path):
    """As generate does; without a word of it in the file, in the air that the state names."""
    air = "ambient.value_degC=26"
    folder, state = write(tmp_path / "job", air), tmp_path / "state"
    state.mkdir()
    file, _ = moved_state(folder, state, air=0.0)
    waited = load_job(path_file("optic_raster"), None, (*SMALL, air, f"state.file='{file}'", "state.age_min=25"))
    resumed = by_state(folder, 3, file, 1500.0)
    assert_allclose(resumed.planned.rise[0], waited.start_rise(), atol=1e-9)


# Refused ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("page", "options", "word"),
    [
        (0, {}, "pages 1 to"),
        (99, {}, "pages 1 to"),
        (3, {"loaded": 3}, "handed to the controller"),
        (3, {"done": 3}, "have run"),
        (3, {"done": 2, "loaded": 1}, "so it was loaded"),
        (3, {"loaded": -1}, "pages 1 to"),
    ],
)
def test_a_page_that_runs_or_is_not_there_is_refused(made, page, options, word):
    with pytest.raises(InputError, match=word):
        later(made, page, 600.0, **options)


def test_what_has_run_stays_run(copy):
    put(copy, later(copy, 4, 600.0, done=2, loaded=3))
    for page, options, word in ((3, {}, "handed"), (2, {}, "have run"), (4, {"done": 1}, "has run already")):
        with pytest.raises(InputError, match=word):
            later(copy, page, 600.0, **options)


def test_pages_edited_by_hand_are_refused_also_before_the_page(copy):
    file = copy / "OPTIC_RASTER_01.LS"
    file.write_bytes(file.read_bytes().replace(b"CNT100", b"CNT50 ", 1))
    with pytest.raises(InputError, match=r"OPTIC_RASTER_01\.LS: it is not the page"):
        later(copy, 3, 600.0)


@pytest.mark.parametrize(
    ("spoil", "word"),
    [
        (lambda folder: (folder / "OPTIC_RASTER.pages.json").unlink(), "holds no pages"),
        (lambda folder: (folder / "OPTIC_RASTER.pages.json").write_text("[]"), "not a manifest"),
        (lambda folder: (folder / "OPTIC_RASTER_02.LS").unlink(), "cannot be read"),
        (lambda folder: (folder / "OPTIC_RASTER.LS").write_text("mine"), "not the main program"),
        (lambda folder: (folder / "B.pages.json").write_text("{}"), "several jobs"),
        (lambda folder: rewrite(folder, inputs_sha256="0" * 64), "another than what made"),
        (lambda folder: rewrite(folder, schema=99), "schema 99, and this compgen reads 1; generate"),
        (lambda folder: rewrite(folder, planned_sha256="x", job=None), "not a manifest|does not say"),
        (lambda folder: rewrite(folder, job={"path_file": "gone.toml", "robot_file": "x"}), "--path"),
    ],
)
def test_a_job_that_it_did_not_write_is_refused(copy, spoil, word):
    spoil(copy)
    with pytest.raises(InputError, match=word) as refusal:
        later(copy, 3, 600.0)
    assert len(str(refusal.value)) <= 400
    assert "\n" not in str(refusal.value)


def test_a_robot_file_found_by_chance_is_passed_over(made, tmp_path, monkeypatch):
    """Where the command runs lies another project's robot of the same name; the pages' own lies above them."""
    folder = shutil.copytree(made, tmp_path / "own" / "outputs")
    own = (ROOT / "robots" / "m710ic50.toml").read_text()
    for project, text in (("own", own), ("other", own.replace("cte_um_m_K = 11.25", "cte_um_m_K = 11.5", 1))):
        (tmp_path / project / "robots").mkdir(parents=True)
        (tmp_path / project / "robots" / "mine.toml").write_text(text)
    written = read_written_job(folder)
    rewrite(folder, job={**written.record["job"], "robot_file": "robots/mine.toml"})
    monkeypatch.chdir(tmp_path / "other")
    assert job_of_pages(read_written_job(folder)).cell.robot_file == str(tmp_path / "own" / "robots" / "mine.toml")


def edit(folder, value, *keys):
    file = folder / "OPTIC_RASTER.pages.json"
    record = table = json.loads(file.read_bytes())
    for key in keys[:-1]:
        table = table[key]
    table[keys[-1]] = value
    file.write_text(json.dumps(record))


def replaced_once(made, folder):
    """A copy whose manifest says that its pages were replaced from the second on."""
    shutil.copytree(made, folder)
    first = read_written_job(folder).pages[1].first
    rewrite(folder, resumed=[{"from_page": 2, "first_waypoint": first, "clock_s": 1.0, "state": [1.0] * 5}])
    return folder


OTHER_TYPES: tuple[object, ...] = (None, "x", 1.5, True, -1, [], {}, [None], {"a": None}, 10**30, float("nan"))


@pytest.mark.parametrize(
    "keys",
    [
        ("job",), ("job", "path_file"), ("main", "sha256"), ("pages",), ("pages", 0), ("pages", 1, "order"),
        ("pages", 1, "file"), ("pages", 2, "first_position"), ("controller",), ("resumed",), ("resumed", 0),
        ("resumed", 0, "state"), ("resumed", 0, "state_toml"), ("schema",), ("inputs_sha256",), ("record_sha256",),
    ],
    ids=lambda keys: ".".join(map(str, keys)),
)  # fmt: skip
def test_a_manifest_with_a_value_of_another_type_is_refused_in_one_line(made, tmp_path, keys):
    folder = replaced_once(made, tmp_path / "out")
    for value in OTHER_TYPES:
        edited = shutil.copytree(folder, tmp_path / "edited", dirs_exist_ok=True)
        edit(edited, value, *keys)
        with pytest.raises(InputError) as refusal:
            read_written_job(edited)
        message = str(refusal.value).replace(str(edited), "out")
        assert len(message) <= 300
        assert "\n" not in message


def rewrite(folder, **changes):
    file = folder / "OPTIC_RASTER.pages.json"
    record = {**json.loads(file.read_bytes()), **changes}
    file.write_bytes(with_checksum({k: v for k, v in record.items() if v is not None}))


@pytest.fixture(scope="module")
def late(made, tmp_path_factory):
    """A job of which the pages from the third on were written anew."""
    folder = tmp_path_factory.mktemp("late")
    for file in made.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    put(folder, later(folder, 3, 1200.0))
    return folder


EDITS = pytest.mark.parametrize(
    "edit",
    [
        lambda record: record["resumed"][0].update(state=[x + 5 for x in record["resumed"][0]["state"]]),
        lambda record: record["resumed"][0].update(first_waypoint=10),
        lambda record: record["resumed"][0].update(clock_s=record["resumed"][0]["clock_s"] + 3600),
        lambda record: record["pages"][1].update(rise_K={}),
        lambda record: record.pop("resumed"),
        lambda record: record.pop(CHECKSUM),
    ],
)


@EDITS
def test_a_manifest_edited_by_hand_is_refused(late, tmp_path, edit):
    """Its state of the robot was taken for the truth: 5 K more in it were 5 K of heat in all pages, inside."""
    for file in late.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    manifest = tmp_path / "OPTIC_RASTER.pages.json"
    record = json.loads(manifest.read_bytes())
    manifest.write_text(json.dumps(record))  # its layout does not count
    read_written_job(tmp_path)
    edit(record)
    manifest.write_text(json.dumps(record))
    words = r"OPTIC_RASTER\.pages\.json: record_sha256: .* edited since"
    with pytest.raises(InputError, match=words) as refusal:
        read_written_job(tmp_path)
    assert len(str(refusal.value)) <= 300 + len(str(tmp_path))


def test_a_second_reader_finds_the_manifest_whole(made, late):
    for folder in (made, late):
        files = {file.name: file.read_bytes() for file in folder.iterdir()}
        record = naive_files.manifest(files["OPTIC_RASTER.pages.json"], files)
        assert ("resumed" in record) == (folder == late)
