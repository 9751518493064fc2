"""What a job says of the controller's motion: unknown, known, and commanded against."""

import json
from dataclasses import replace

import pytest
from shipped import path_file, quiet

from compgen.core.finding_codes import Level
from compgen.job.bounds import Bounds
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.robot_file import load_cell, load_robot
from compgen.pipelines.findings.motion_findings import WHAT, motion_of_a_listing
from compgen.pipelines.planned import generate
from compgen.pipelines.study import timeline
from compgen.report.band_words import headline
from compgen.report.heat_page import heat_json, heat_sentences
from compgen.report.job_summary import job_summary
from compgen.robot.motion import ANY_ARM, ControllerMotion

MEANS = "robot.motion.moving_average_ms=[200, 100]"
IDENTIFIED = 'robot.motion.identified={robot="m710ic50", verdict="accepted", runs_began="both"}'


OF_ITS_CLASS = "the maker's motion code for this class of arm"
DIGITS_UM = 4  # what positions of three digits add to a pull


def pull_um(*windows):
    """v^2 sigma^2 / (2 R) on the study's circle, 200 mm/s and 650 mm, with moving means of some windows [ms]."""
    return 0.2**2 * sum((w / 1000) ** 2 for w in windows) / 12 / (2 * 0.65) * 1e6


def run(*overrides, name="circle_1300"):
    planned, corrected = generate.generate(load_job(path_file(name), None, overrides), quiet)
    finding = next(f for f in corrected.findings if f.code.startswith("motion."))
    return job_summary(planned, corrected), corrected, finding


def row(summary):
    return [u for u in summary["band"]["unknown"] if u["what"] == WHAT]


def test_unknown_motion_has_its_size_on_this_path_and_changes_no_verdict():
    summary, corrected, finding = run()
    assert (finding.code, finding.level) == ("motion.unknown", Level.WARNING)
    assert corrected.inside
    assert not summary["motion"]["known"]
    motion = summary["motion"]
    assert motion["off_path_um"] == pytest.approx(pull_um(176, 168), abs=DIGITS_UM)
    assert motion["lowest_um"] == pytest.approx(pull_um(176, 168), abs=DIGITS_UM)
    assert motion["highest_um"] == pytest.approx(pull_um(256, 168), abs=DIGITS_UM)
    assert row(summary)[0]["size_um"] == pytest.approx([motion["lowest_um"], motion["highest_um"]], rel=1e-5)
    assert row(summary)[0]["expected_um"] == pytest.approx(motion["off_path_um"], rel=1e-5)
    assert motion["lowest_um"] == motion["off_path_um"]  # and is not said twice
    expected, highest = (f"{motion[key]:.0f}" for key in ("off_path_um", "highest_um"))
    assert f"lead the tool off this path by {expected} um (up to {highest}), " in finding.message
    assert f"by {OF_ITS_CLASS}" in finding.message
    assert "..." not in finding.message  # nothing of it is cut away
    assert f"{WHAT} (expected {expected}, up to {highest} um, from {OF_ITS_CLASS})" in headline(summary)


def test_a_robot_whose_file_says_nothing_is_expected_to_move_as_any_arm():
    (finding,) = motion_of_a_listing(replace(load_robot("m710ic50"), expected_motion=ANY_ARM), None, Bounds())
    message = finding.message
    expected, lowest, highest = (f"{pull_um(window, window):.0f}" for window in (200, 104, 320))
    assert f"by an expected {expected} um ({lowest} to {highest}), by logs and motion code of other arms" in message


def test_arcs_are_looked_at_as_they_are_driven():
    """The plan's lines round a small circle are shorter than a period, so that they run at 61 of 100 mm/s: not arcs."""
    small = ("path.diameter_mm=40", "process.feed_mm_s=100", 'process.moves="arcs"')
    summary, _, _ = run(*small)
    motion = summary["motion"]
    pull = pull_um(176, 168) * (0.1 / 0.2) ** 2 * 0.65 / 0.02
    assert motion["off_path_um"] == pytest.approx(pull, rel=0.05)
    assert row(summary)[0]["expected_um"] == pytest.approx(motion["off_path_um"], rel=1e-5)


def test_straight_sweeps_have_nothing_to_fear():
    summary, _, finding = run(name="line_y")
    assert finding.level is Level.NOTE
    assert summary["motion"]["off_path_um"] < 1.0  # the digits, which smoothing averages


def test_known_motion_is_part_of_the_errors_and_nothing_is_commanded():
    summary, corrected, finding = run(MEANS, IDENTIFIED)
    assert finding.code == "motion.known"
    assert "motion.enabled is false" in finding.message
    assert summary["on_part"]["after"]["total"]["max_um"] == pytest.approx(129, abs=2)
    assert not row(summary)
    assert corrected.program.name == "CIRCLE_1300"


def test_typed_numbers_are_flown_and_stay_unknown():
    summary, _, finding = run(MEANS)
    assert "not from a log" in finding.message
    assert "..." not in finding.message  # nothing of it is cut away
    assert row(summary)


def test_a_program_made_against_the_motion_says_for_which_override():
    summary, corrected, finding = run(MEANS, IDENTIFIED, "robot.motion.enabled=true")
    assert finding.code == "motion.predistorted"
    assert "100 % override" in finding.message
    assert "75 % are wrong at 50 %" in finding.message
    assert summary["motion"]["predistorted"]
    assert corrected.program.name == "CIRCLE_1300_V100"
    assert "pre-distorted for 100% override" in corrected.program.remarks


def began(how, verdict="accepted"):
    runs = "" if how is None else f', runs_began="{how}"'
    return f'robot.motion.identified={{robot="m710ic50", verdict="{verdict}"{runs}}}'


@pytest.mark.parametrize(("how", "moves", "commanded", "words"), [
    ("short", "lines", True, ""), ("both", "lines", True, ""), ("both", "arcs", True, ""),
    ("short", "arcs", True, ""),  # as planned they begin long, as commanded short
    ("long", "lines", False, "its runs begin with a short line, and no logged one did: log the program of cgen plan-"),
    (None, "lines", False, "no runs_began in [motion.identified]: run cgen identify-motion again, best on cgen plan-"),
])  # fmt: skip
def test_runs_that_begin_as_no_logged_one_did_are_not_commanded_and_stay_unknown(how, moves, commanded, words):
    """Lines of the circle last 16 ms each, means 300."""
    sets = [MEANS, began(how), "robot.motion.enabled=true", f'process.moves="{moves}"']
    summary, corrected, finding = run(*sets)
    assert corrected.program.name == ("CIRCLE_1300_V100" if commanded else "CIRCLE_1300")
    assert ("pre-distorted for 100% override" in corrected.program.remarks) is commanded
    assert summary["motion"]["predistorted"] is commanded
    assert finding.code == ("motion.predistorted" if commanded else "motion.runs")
    assert finding.level is Level.WARNING
    assert bool(row(summary)) is not commanded
    assert words in finding.message
    assert " ... " not in finding.message
    left = corrected.deviation.on_part["total"].max * 1e6
    foretold = (120, 100) if how == "long" else (200, 100)  # by the class a run after a long line has 80 ms more
    assert left < 13 if commanded else left == pytest.approx(pull_um(*foretold), abs=DIGITS_UM)
    predicted = job_summary(generate.predict(load_job(path_file("circle_1300"), None, sets), quiet), None)
    assert predicted["motion"]["predistorted"] is commanded


def test_a_motion_that_is_not_enabled_says_too_that_runs_begin_otherwise():
    summary, _, finding = run(MEANS, began("long"))
    assert finding.code == "motion.runs"
    origin = row(summary)[0]["from"]
    assert "means of 120 and 100 ms, by [motion] and how [expected_motion]'s differ of runs that begin other" in origin
    assert "as [motion] has it of runs that begin otherwise" in row(run(MEANS, began(None))[0])[0]["from"]


def test_straight_sweeps_begin_long_and_are_no_reason_to_command_nothing():
    """No run of lines alone has a bend."""
    assert not load_cell_covers("short", [5.0])
    summary, *_ = run(MEANS, began("short"), "robot.motion.enabled=true", name="line_y")
    assert summary["motion"]["predistorted"]


def load_cell_covers(how, first):
    motion = load_cell("m710ic50", [o.removeprefix("robot.") for o in (MEANS, began(how))]).robot.motion
    assert motion is not None
    return motion.covers(first)


@pytest.mark.parametrize(("how", "covered"), [
    ("short", [True, True, False, False]), ("long", [False, False, True, True]),
    ("both", [True] * 4), (None, [False] * 4),
])  # fmt: skip
def test_a_first_line_is_long_from_the_sum_of_the_means_on(how, covered):
    assert [load_cell_covers(how, [time]) for time in (0.008, 0.292, 0.3, 2.0)] == covered
    assert load_cell_covers(how, [0.1, 0.4]) is (how == "both")
    assert load_cell_covers(how, [])


def test_a_program_that_exists_is_told_that_its_motion_is_not_looked_at():
    robot = load_robot("m710ic50")
    assert motion_of_a_listing(robot, None, Bounds())[0].code == "motion.unknown"
    known = replace(robot, motion=ControllerMotion(space="joint", moving_averages=(0.2, 0.1)))
    assert "200 and 100 ms" in motion_of_a_listing(known, None, Bounds())[0].message


@pytest.mark.parametrize("name", ["line_x", "circle_1300"])
def test_one_path_has_one_size_of_it_whichever_command_says_it(name):
    job = load_job(path_file(name))
    predicted = job_summary(generate.predict(job, quiet), None)
    generated = job_summary(*generate.generate(job, quiet))
    assert row(predicted) == row(generated) != []
    assert predicted["motion"] == generated["motion"]
    told = [
        [f["message"] for f in summary["findings"] if f["code"] == "motion.unknown"]
        for summary in (predicted, generated)
    ]
    assert told[0] == told[1] != []


@pytest.mark.parametrize("said", ["process.moves=arcs", "process.thin_um=8"])
def test_a_prediction_is_of_the_arcs_that_a_program_has_not_of_lines_through_each_waypoint(said):
    """These take 25.0 s for 21.5 of the study's circle, and are led 111 um off for 240."""
    job = load_job(path_file("circle_1300"), None, [said])
    predicted, generated = job_summary(generate.predict(job, quiet), None), job_summary(*generate.generate(job, quiet))
    for keys in (("motion", "off_path_um"), ("motion", "highest_um"), ("path", "waypoints"), ("timing", "duration_s")):
        of_both = [summary[keys[0]][keys[1]] for summary in (predicted, generated)]
        assert of_both[0] == pytest.approx(of_both[1], rel=0.005), keys
    assert generated["before"] == predicted["before"]


def test_where_no_text_is_flown_it_is_said_not_to_be_looked_at():
    job = load_job(path_file("circle_1300"))
    day = timeline(job)
    for band in json.loads(heat_json(job, day))["band"].values():
        assert row({"band": band}) == [
            {"what": WHAT, "size_um": None, "expected_um": None, "from": "not looked at here"}
        ]
    assert f"{WHAT} (not looked at here)" in " ".join(heat_sentences(job, day))
