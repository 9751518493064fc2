"""The pages of a corrected program, corrected anew for a late start: against a program whose day had the wait in it."""

import json
import shutil

import naive_arm as arm
import naive_heat
import numpy as np
import pytest
from command_line import refused, run
from corrected import HOME, POLISHED, polishing
from corrected_pages import PAGES, pages_of
from ls_text import program
from numpy.testing import assert_allclose
from states import state_of, written

from compgen import fanuc as ls
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.resume.corrected_job import read_corrected
from compgen.pipelines.resume.corrected_run import corrected_run
from compgen.pipelines.resume.written_job import read_written_job
from compgen.program.pages import with_checksum

RESUME = ("--late", "35min", "--max-um", "5", "--date", "2026-01-31")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return pages_of(tmp_path_factory.mktemp("made"), "pages")


@pytest.fixture
def job(made, tmp_path):
    return shutil.copytree(made, tmp_path / "out")


def contents(folder):
    return {p.name: p.read_bytes() for p in folder.iterdir()}


def test_a_late_start_is_what_correct_makes_of_the_same_wait(job, tmp_path):
    waited = pages_of(tmp_path / "waited", "pages", "--before", "idle 35min")
    result = run("resume", job, "--from-page", "1", *RESUME)
    assert result.returncode == 0, result.stderr
    for number in (1, 2, 3):
        ours, oracle = (ls.loads((folder / f"LONG_0{number}.LS").read_bytes()) for folder in (job, waited))
        assert np.array_equal(ours.positions.value, oracle.positions.value, equal_nan=True)
    assert "Uncertainty of the robot data" in result.stdout
    assert "error, um" in result.stdout  # the program does not say where the part is
    assert run("resume", job, "--from-page", "1", *RESUME).stdout.count("nothing to do") == 1


def test_pages_are_not_judged_as_one_file_that_the_controller_could_not_hold(tmp_path):
    """They were parted because it cannot; *not loadable* was said of each call, and *cgen pages parts it*."""
    pages = pages_of(tmp_path, "pages", "--set", "controller.max_lines=40", ends_with=1)
    assert json.loads((tmp_path / "pages_made" / "report.json").read_bytes())["verdict"] == "not loadable"
    result = run("resume", pages, "--from-page", "2", *RESUME, "--json")
    assert (result.returncode, result.stderr) == (0, "")
    record = json.loads(result.stdout)
    assert record["verdict"] == "inside"
    assert "controller.size" not in [finding["code"] for finding in record["findings"]]


def log_at_27_degC(folder):
    log = folder / "now.csv"
    rows = [f"{t},27,33,29,35,28" for t in range(0, 7200, 60)]
    log.write_text("\n".join(["time_s,ambient_degC,part_3_degC,part_4_degC,part_6_degC,part_11_degC", *rows, ""]))
    return log


def test_air_that_was_found_changes_nothing_of_the_warmth_that_was_found(job, tmp_path):
    """Behind 3.5 h of work the day so far is another in other air; a log says how warm the arm is, all the same."""
    (tmp_path / "made").mkdir()
    (tmp_path / "made" / "GRIP.LS").write_bytes(polishing("GRIP"))
    behind_work, log = pages_of(tmp_path / "made", "pages", between=("CALL GRIP",)), log_at_27_degC(tmp_path)
    for folder in (job, behind_work):
        assert run("resume", folder, "--from-page", "3", "--log", log, *RESUME[2:]).returncode == 0
    (worked,), (plain,) = (numbers_of(folder, (3,)) for folder in (behind_work, job))
    assert_allclose(worked[-len(plain) :], plain, rtol=0, atol=1.1e-3)


def test_pages_are_written_anew_for_the_air_that_was_found(job, tmp_path):
    """A room of 27 degC: two hours later the arm is nearer to 27 than to 20, by the nodes' law."""
    log = log_at_27_degC(tmp_path)
    assert run("resume", job, "--from-page", "2", "--log", log, *RESUME[2:]).returncode == 0
    resumed = json.loads((job / "LONG.pages.json").read_bytes())["resumed"][0]
    assert resumed["air_K"] == pytest.approx(7.0)
    result = run("resume", job, "--from-page", "3", "--late", "0s", *RESUME[2:], "--json")
    assert json.loads(result.stdout)["pages"][0]["before"]["max_um"] < 1
    result = run("resume", job, "--from-page", "3", "--late", "2h", *RESUME[2:], "--json")
    (page,) = json.loads(result.stdout)["pages"]
    heat, later = load_cell("m710ic50").heat, {}
    now = dict(zip(heat.names, heat.outputs @ resumed["start_state"], strict=True))  # some seconds before
    for name, node in naive_heat.NODES.items():
        steady = naive_heat.steady_rise(node, "idle", 0.0) + 7.0
        later[name] = steady + (now[name] - steady) * np.exp(-2.0 / node["tau_h"])
    there = arm.joints_at(arm.frame(1390, 20, 200, 180, 0, 0), HOME)
    at = [arm.flange(there, naive_heat.warm_lengths(rise))[:3, 3] for rise in (now, later)]
    assert page["before"]["max_um"] == pytest.approx(np.linalg.norm(at[1] - at[0]) * 1e3, abs=2.0)
    assert page["after"]["max_um"] < 1


def test_the_band_of_pages_in_time_is_that_of_the_program(made, job):
    """The program takes two minutes after five hours: what the law missed in them is not forgotten."""
    of_program = json.loads((made.parent / "pages_made" / "report.json").read_bytes())["band"]
    of_pages = json.loads(run("resume", job, "--from-page", "2", "--late", "0s", *RESUME[2:], "--json").stdout)["band"]
    assert of_pages["p95_um"] == pytest.approx(of_program["p95_um"], rel=0.01)


def test_the_rest_is_written_and_what_was_before_stays(job):
    before = contents(job)
    result = run("resume", job, "--from-page", "2", *RESUME, "--json")
    assert result.returncode == 0, result.stderr
    report, after = json.loads(result.stdout), contents(job)
    changed = {name for name in after if before.get(name) != after[name]}
    assert changed == {"compgen.json", "LONG_02.LS", "LONG_03.LS", "LONG.pages.json", "resume.json", "resume.html"}
    assert [page["page"] for page in report["pages"]] == [2, 3]
    assert report["band"]["p95_um"] > 5
    assert "not measured on this robot" in after["resume.html"].decode()
    for page in report["pages"]:
        assert page["before"]["max_um"] > 5 > 1 > page["after"]["max_um"]
    join = report["join"]
    assert join["beyond_um"] < 1 < join["demanded_um"]
    entry = json.loads(after["LONG.pages.json"])["resumed"][0]
    assert (entry["from_page"], entry["late_s"], entry["date"]) == (2, 2100, "2026-01-31")
    for page in ("LONG_02.LS", "LONG_03.LS"):
        old, new = (ls.loads(files[page]) for files in (before, after))
        assert (old.positions.number == new.positions.number).all()
        assert len(old.data) == len(new.data)
    # a second wait counts from the first
    again = json.loads(run("resume", job, "--from-page", "3", *RESUME, "--json").stdout)
    assert again["pages"][0]["before"]["max_um"] > 3 > again["pages"][0]["after"]["max_um"]


def test_pages_that_were_written_anew_already_are_what_the_job_would_have_gone_on_with(job):
    """Written for 35 min, they are 11 um off after 2 h, and 0 when asked again; 18 were said, of what they replaced."""
    before = []
    for late in ("35min", "2h", "2h"):
        result = run("resume", job, "--from-page", "2", "--late", late, *RESUME[2:], "--json")
        before.append(json.loads(result.stdout)["pages"][0]["before"]["max_um"])
    there = arm.joints_at(arm.frame(1360, 20, 200, 180, 0, 0), HOME)
    warm = [naive_heat.rises((("moving", 200, 5), ("idle", 0, hours))) for hours in (0, 35 / 60, 2)]
    planned, first, second = (arm.flange(there, naive_heat.warm_lengths(rise))[:3, 3] for rise in warm)
    off = [np.linalg.norm(now - then) * 1e3 for now, then in ((first, planned), (second, first), (second, second))]
    assert_allclose(before, off, rtol=0, atol=1.0)


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("--from-page", "4"), 2, ("pages 1 to 3",)),
        (("--from-page", "2", "--loaded", "2"), 2, ("handed",)),
        (("--from-page", "2", "--robot", "irb120"), 2, ("irb120",)),
    ],
)
def test_what_cannot_be_is_refused_and_changes_nothing(job, arguments, code, words):
    before = contents(job)
    refused(run("resume", job, *arguments, *RESUME), code, *words)
    assert contents(job) == before


def test_a_page_edited_by_hand_and_a_record_that_is_none_are_refused(job):
    page = (job / "LONG_01.LS").read_bytes()
    (job / "LONG_01.LS").write_bytes(page.replace(b"100mm/sec", b"101mm/sec", 1))
    refused(run("resume", job, "--from-page", "2", *RESUME), 2, "edited by hand")
    (job / "LONG_01.LS").write_bytes(page)
    record = json.loads((job / "LONG.pages.json").read_bytes())
    record["corrected_from"]["planned_zlib_b85"] = "x"
    (job / "LONG.pages.json").write_bytes(with_checksum(record))
    refused(run("resume", job, "--from-page", "2", *RESUME), 2, "cgen correct")


def numbers_of(folder, pages):
    return [ls.loads((folder / f"LONG_0{n}.LS").read_bytes()).positions.value for n in pages]


def state_file(folder, **changes):
    """A state of the shipped robot after other hours than the pages were made for, its base moved."""
    job = load_job("paths/spiral_1300.toml")
    base = np.array([4e-5, -2e-5, 1e-5, 0, 0, 0])
    return written(state_of(job, rise=job.start_rise() * 0.6, base=base, **changes), folder)


def test_a_page_that_has_run_is_not_judged(tmp_path):
    """To be as warm as the state says, in such air, the arm would have cooled by some 6 K in a pause on page 2."""
    job = pages_of(tmp_path, "pages", history=(), between=("WAIT 7200.00(sec)",))
    state = ("--state", state_file(tmp_path, air=-14.0, verdict="something moved"))
    result = run("resume", job, "--from-page", "3", *state, *RESUME[2:], "--json")
    assert result.returncode == 0, result.stderr
    record = json.loads(result.stdout)
    assert sum("find what moved before they run" in f["message"] for f in record["findings"]) == 1
    (page,) = record["pages"]
    assert page["before"]["max_um"] > 50 > 5 > page["after"]["max_um"]


@pytest.mark.parametrize(("age", "air"), [((), 0.0), (("--state-age", "20min"), 6.0)])
def test_a_state_is_what_correct_makes_of_it(job, tmp_path, age, air):
    state = ("--state", state_file(tmp_path, air=air), *age)
    anchored = pages_of(tmp_path / "anchored", "pages", *state, history=())
    result = run("resume", job, "--from-page", "1", *state, *RESUME[2:], "--json")
    assert result.returncode == 0, result.stderr
    for ours, oracle in zip(numbers_of(job, (1, 2, 3)), numbers_of(anchored, (1, 2, 3)), strict=True):
        assert np.array_equal(ours, oracle, equal_nan=True)
    entry = json.loads((job / "LONG.pages.json").read_bytes())["resumed"][0]
    assert entry["state_verdict"] == "anchored"
    assert json.loads(result.stdout)["verdict"] == "inside"
    # pages after it go on from the state, not from the robot file
    late = json.loads(run("resume", job, "--from-page", "3", *RESUME, "--json").stdout)
    assert late["pages"][0]["before"]["max_um"] < 10
    refused(run("resume", job, "--from-page", "3", "--state", state_file(tmp_path, time=10.0)), 2, "a later one")


def test_pages_of_a_program_that_began_with_a_state_are_resumed_from_it(tmp_path):
    state = ("--state", state_file(tmp_path))
    made = pages_of(tmp_path / "made", "pages", *state, history=())
    result = run("resume", made, "--from-page", "1", *RESUME)
    assert result.returncode == 0, result.stderr
    waited = pages_of(tmp_path / "waited", "pages", *state, "--state-age", "29min", history=())
    after = run("resume", made, "--from-page", "1", "--late", "29min", *RESUME[2:])
    assert after.returncode == 0, after.stderr
    for ours, oracle in zip(numbers_of(made, (1, 2, 3)), numbers_of(waited, (1, 2, 3)), strict=True):
        assert np.array_equal(ours, oracle, equal_nan=True)


def test_a_bound_with_a_probability_is_asked_of_the_new_pages_too(tmp_path):
    given = ("--state", state_file(tmp_path), "--guaranteed", "max_um=900, share=0.8, confidence=0.8")
    made = pages_of(tmp_path / "made", "pages", *given, history=())
    result = run("resume", made, "--from-page", "2", *RESUME)
    assert result.returncode == 0, result.stderr
    record = json.loads((made / "LONG.pages.json").read_bytes())
    promise = record["corrected_from"]["options"]["guaranteed"]
    assert promise == {"max_um": 900, "share": 0.8, "confidence": 0.8, "draws": 8, "seed": 0}
    promise["max_um"] = 0.5
    (made / "LONG.pages.json").write_bytes(with_checksum(record))
    refused(run("resume", made, "--from-page", "3", *RESUME), 1, "80 % of arms and days")


def test_draws_of_the_rest_go_through_the_same_day_as_its_band(tmp_path):
    """Five hours before the program, and a wait within: flown from the morning on, the draws are what the band says."""
    made = pages_of(tmp_path, "pages", "--guaranteed", "max_um=900, share=0.8, confidence=0.8, draws=20")
    result = run("resume", made, "--from-page", "2", *RESUME, "--json")
    assert "band.linear" not in {finding["code"] for finding in json.loads(result.stdout)["findings"]}


def test_registers_frames_and_many_starts_are_taken_from_what_made_the_pages(tmp_path):
    table = tmp_path / "registers.toml"
    table.write_text("[pr.5]\nx_mm = 10\ny_mm = 0\nz_mm = 20\nw_deg = 0\np_deg = 0\nr_deg = 0\n")
    given = ("--registers", table, "--average-over", "delay_s = [0, 1200], override_percent = [50, 100]")
    made = pages_of(tmp_path / "made", "pages", *given, motion=" Offset,PR[5]")
    result = run("resume", made, "--from-page", "1", *RESUME)
    assert result.returncode == 0, result.stderr
    waited = pages_of(tmp_path / "w", "pages", *given[:2], "--before", "idle 35min", motion=" Offset,PR[5]")
    for ours, oracle in zip(numbers_of(made, (1, 2, 3)), numbers_of(waited, (1, 2, 3)), strict=True):
        assert np.array_equal(ours, oracle, equal_nan=True)


def test_pages_of_a_program_touched_up_since_say_that_they_cannot_be_written_anew(tmp_path):
    pages_of(tmp_path, "pages")
    corrected, out = tmp_path / "pages_made" / "LONG.LS", tmp_path / "out"
    corrected.write_bytes(corrected.read_bytes().replace(b"100mm/sec", b"101mm/sec", 1))
    result = run("pages", corrected, *PAGES[:-1], "-o", out)
    assert result.returncode == 0
    assert "cgen resume cannot write these pages anew: LONG.LS is not what LONG.compgen.json" in result.stdout
    refused(run("resume", out, "--from-page", "2", *RESUME), 2, "cannot be written anew", "touched up since")
    corrected.with_name("LONG.compgen.json").unlink()
    assert "no LONG.compgen.json beside LONG.LS says" in run("pages", corrected, *PAGES[:-1], "-o", out).stdout
    assert "anew" not in run("pages", tmp_path / "LONG.LS", *PAGES[:-1], "-o", tmp_path / "planned").stdout


def test_called_programs_and_a_history_with_rests_are_taken_from_what_made_the_pages(tmp_path):
    (tmp_path / "made").mkdir()
    (tmp_path / "made" / "GRIP.LS").write_bytes(program(["DO[1]=ON"], [], name="GRIP"))
    table, day = tmp_path / "registers.toml", tmp_path / "day.toml"
    table.write_text("[pr.5]\nx_mm = 10\ny_mm = 0\nz_mm = 20\nw_deg = 0\np_deg = 0\nr_deg = 0\n")
    day.write_text('[[before]]\nstate = "moving"\nfeed_mm_s = 200\nduration_h = 5\nduty = 0.5\n')
    given = {"history": ("--before", day), "motion": " Offset,PR[5]", "between": ("CALL GRIP",)}
    made = pages_of(tmp_path / "made", "pages", "--registers", table, **given)
    (tmp_path / "made" / "GRIP.LS").unlink()  # the folder of the pages is all that is needed
    result = run("resume", made, "--from-page", "1", "--late", "0s", *RESUME[2:], "--json")
    assert result.returncode == 0, result.stderr
    assert "program.called" not in {finding["code"] for finding in json.loads(result.stdout)["findings"]}
    assert json.loads((made / "LONG.pages.json").read_bytes())["corrected_from"]["before"][0]["duty"] == 0.5


def test_pages_behind_a_called_program_that_warms_the_arm_start_in_its_warmth(tmp_path):
    """3.5 h at 20 mm/s: without a delay what is there stays right; behind one the arm has cooled from that warmth."""
    (tmp_path / "made").mkdir()
    (tmp_path / "made" / "GRIP.LS").write_bytes(polishing("GRIP"))
    made = pages_of(tmp_path / "made", "pages", between=("CALL GRIP",))
    day = [("moving", 200.0, 5.0), POLISHED]
    warm, cooled = (naive_heat.warm_lengths(naive_heat.rises(d)) for d in (day, [*day, ("idle", 0.0, 35 / 60)]))
    there = arm.joints_at(arm.frame(1390, 20, 200, 180, 0, 0), HOME)
    shrunk = np.linalg.norm((arm.flange(there, warm) - arm.flange(there, cooled))[:3, 3]) * 1e3
    for page, late, missed in (("1", "0s", 0.0), ("2", "0s", 0.0), ("3", "0s", 0.0), ("3", "35min", shrunk)):
        result = run("resume", made, "--from-page", page, "--late", late, *RESUME[2:], "--json", "--force")
        assert result.returncode == 0, result.stderr
        for sizes in json.loads(result.stdout)["pages"]:
            assert sizes["before"]["max_um"] == pytest.approx(missed, abs=1.5)
    run_of_pages = corrected_run(read_corrected(read_written_job(made)), lambda stage, share: None)
    first, second, third = run_of_pages.spans
    assert (first, third) == pytest.approx((10, 10), abs=20)
    assert second == pytest.approx(499 * 25, rel=0.03)
    drive, places = run_of_pages.first.plan.drive, run_of_pages.places
    assert_allclose(run_of_pages.motion.theta[places], drive.at.theta[drive.pose], atol=1e-12)


def test_without_a_bound_it_is_written_and_said(job):
    result = run("resume", job, "--from-page", "2", "--late", "35min", "-q")
    assert result.returncode == 1
    assert "no bounds" in result.stderr
    assert "written all the same" in result.stderr


@pytest.mark.parametrize(
    ("keys", "value", "words"),
    [
        (("pages", 2, "motions", 1), 10**8, "its pages have 100000000 motions, the corrected program 99"),
        (("resumed",), [{"from_page": 1, "start_state": [1.0]}], "start_state is of another thermal model"),
    ],
)
def test_a_manifest_of_other_pages_or_another_heat_model_is_refused(job, keys, value, words):
    record = table = json.loads((job / "LONG.pages.json").read_bytes())
    for key in keys[:-1]:
        table = table[key]
    table[keys[-1]] = value
    (job / "LONG.pages.json").write_bytes(with_checksum(record))
    before = contents(job)
    refused(run("resume", job, "--from-page", "2", *RESUME), 2, words)
    assert contents(job) == before
