"""Wherever a residual is read stands what the files leave open, and what they do not know."""

import csv
import io
import json
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from shipped import ROOT, path_file, quiet

import compgen
from compgen.cli.screen.ci_reports import JudgedPath, junit_xml
from compgen.core.exceptions import InputError
from compgen.core.units import UM
from compgen.error_model.unmeasured import NOT_KNOWN, Unknown
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.planned import generate
from compgen.pipelines.uncertainty.band_columns import assumed_findings
from compgen.report.band_page import band_facts, band_rows, budget_figure
from compgen.report.band_words import (
    band_record,
    before_and_after,
    gain_words,
    headline,
    known_words,
    not_known_words,
    times_words,
    unknown_words,
)
from compgen.report.job_page import job_reports
from compgen.report.job_summary import job_summary
from compgen.report.study_tables import band_caveat
from compgen.verification.band import Band, BudgetShare

BAND = Band(
    rows=np.array([0, 1]),
    moment=np.ones((2, 6)) * UM**2,
    radius=np.ones(2) * UM,
    largest=41.3 * UM,
    p99=40 * UM,
    budget=(BudgetShare("cte", 20.4 * UM, 15 * UM), BudgetShare("temperature law", 13.1 * UM, 9 * UM)),
)
UNKNOWN = (
    Unknown("play", (55 * UM, 175 * UM), "a study", ("lost motion",)),
    Unknown("the controller's motion", None, ""),
)


@pytest.fixture(scope="module")
def run():
    return generate.generate(load_job(path_file("line_y")), quiet)


def summary_of(record, after=2.06, **more):
    """What the sentences read of a report."""
    sides = {"before": {"total": {"max_um": 107.1}}, "after": {"total": {"max_um": after}}}
    return {
        **sides,
        "ratio": 107.1 / after,
        "band": record,
        "findings": [],
        "thermal": {"start_window_s": 1068.9},
        **more,
    }


def test_the_sentences_say_what_is_left_what_is_not_sure_and_what_nobody_measured():
    assert headline(summary_of(band_record(BAND, UNKNOWN))).splitlines() == [
        "Largest error 107.1 um before. After: 2.1 um left by calculation. Uncertainty of the robot data: 41 um "
        "(95 %), from cte 20, temperature law 13. Not measured on your robot: play (55 to 175 um); without a figure: "
        "the controller's motion.",
        "Measure next, to make these 41 um smaller: one hot length: -19 um (then, with your own values, cgen generate "
        "PATH --set "
        "robot.thermal.cte_um_m_K=12 --set 'robot.thermal.uncertainty.cte_um_m_K=[11.5,12.5]' --set "
        "'robot.thermal.uncertainty.growth_percent.d4=[-9,9]'); a temperature log of the day: -6.5 um (then, with your "
        "own values, cgen generate PATH --set log.file=log.csv); "
        "all of these leave 0.0 um of the band; larger than the band, so first: play",
    ]
    assert gain_words(summary_of(band_record(BAND, UNKNOWN))) == (
        " 52 times smaller. Start within 17 minutes of the planned time."
    )


def test_a_screen_names_the_largest_and_counts_the_rest():
    sizes = {"a": 9.0, "b": 700.0, "c": 30.0, "d": 55.0, "e": 2.5}
    rows = [Unknown(name, (0.0, size * UM), "") for name, size in sizes.items()]
    words = not_known_words(band_record(BAND, [*rows, *UNKNOWN[1:]]), verbose=False)
    assert (
        "robot: b (0 to 700 um), d (0 to 55 um), c (0 to 30 um), 2 more of up to 9.0 um, 1 without a figure: " in words
    )
    assert words.splitlines()[1].startswith(
        "Measure next: first what is larger than these 41 um. Then, to make them smaller: one hot length: -19 um (then"
    )
    assert "log.file" not in words
    few = not_known_words(band_record(BAND, UNKNOWN), verbose=False)
    assert "Not measured on your robot: play (55 to 175 um); without a figure: the controller's motion.\n" in few


def test_what_nothing_was_corrected_for_says_what_the_robot_file_needs_and_no_gain():
    nothing = {"level": "outside", "code": "correction.none", "message": "the robot file is empty; give numbers"}
    cold = summary_of(band_record(BAND, UNKNOWN), after=107.1, findings=[nothing])
    assert before_and_after(cold) == "Nothing was corrected: the robot file is empty; give numbers."
    assert gain_words(cold) == ""


def test_no_start_is_promised_where_nothing_is_known_of_warmth():
    cold = summary_of(band_record(BAND, [Unknown("warmth", None, "")]))
    assert gain_words(cold) == " 52 times smaller."


@pytest.mark.parametrize(
    ("ratio", "words"),
    [(1.0, "No smaller"), (1.06, "1.1 times smaller"), (9.949, "9.9 times smaller"), (51.7, "52 times smaller")],
)
def test_a_small_gain_is_not_rounded_to_none_or_twice_itself(ratio, words):
    assert times_words(ratio) == words


def test_where_the_part_stands_is_said_apart():
    rest = replace(BAND, largest=12.4 * UM, budget=(BudgetShare("lost motion", 12.4 * UM, 3 * UM),))
    record = band_record(replace(BAND, parted=(38 * UM, rest)), ())
    assert [step["what"] for step in record["next"]] == ["the part's frame, taught", "reversals of each joint"]
    assert (record["part_stands_um"], record["when_taught_um"]) == (38, 12.4)
    assert known_words(record) == (
        "41 um (95 %), from cte 20, temperature law 13; 38 um where the part stands, 12 um when its frame is taught"
    )
    rows = [row for row in band_rows(record) if "of it" in row[0]]
    assert [row[1] for row in rows] == ["38", "12"]


def test_a_bars_words_are_short_enough_for_its_figure():
    """``expected 1032, up to 1630`` was cut at the edge; the bar is between the two."""
    seen = Unknown("the controller's motion", (1032 * UM, 1630 * UM), "a maker", (), 1032 * UM)
    drawn = budget_figure(band_record(BAND, [seen]))
    assert drawn["data"][1]["text"] == ["1032 to 1630"]
    assert "expected 1032, up to 1630" in drawn["alt"]


def test_what_is_expected_stands_before_its_range_with_whose_word_it_is():
    seen = Unknown("the controller's motion", (154 * UM, 237 * UM), "a maker", (), 194 * UM)
    assert unknown_words(band_record(BAND, [seen])) == (
        "the controller's motion (expected 194, 154 to 237 um, from a maker)"
    )
    least = replace(seen, expected=154 * UM)
    assert unknown_words(band_record(BAND, [least])) == (
        "the controller's motion (expected 154, up to 237 um, from a maker)"
    )
    most = replace(seen, expected=237 * UM)
    assert "(expected 237, from 154 um, " in unknown_words(band_record(BAND, [most]))
    none = replace(seen, size=(0.0, 0.04 * UM), expected=0.01 * UM)
    assert unknown_words(band_record(BAND, [none])) == "the controller's motion (below 0.1 um, from a maker)"


def test_without_any_uncertainty_the_sentence_says_that_there_is_no_band():
    none = replace(BAND, largest=0.0, budget=())
    assert not_known_words(band_record(none, UNKNOWN[:1])) == (
        "Uncertainty of the robot data: not stated (the robot file gives no number a sigma). Not measured "
        "on your robot: play (55 to 175 um)."
    )
    ((_, words),) = band_facts(band_record(none, ()))
    assert words == "not stated (the robot file gives no number a sigma)"


def test_a_study_without_any_uncertainty_says_that_there_is_no_band():
    assert band_caveat([{"band_um": 0.0}]).startswith("uncertainty of the robot data: not stated (the robot file")
    assert band_caveat([{"band_um": 0.0}, {"band_um": 40.0}]).startswith(
        "uncertainty of the robot data: 0.0 to 40 um (95 %)"
    )


def test_small_sources_are_not_listed():
    many = replace(BAND, budget=(*BAND.budget, BudgetShare("feed", 0.1 * UM, 0.1 * UM)))
    assert known_words(band_record(many, ())) == "41 um (95 %), mostly cte 20, temperature law 13"


def test_the_record_is_what_is_documented(run):
    record = job_summary(*run)["band"]
    assert list(record) == [
        "p95_um",
        "share",
        "confidence",
        "draws",
        "seed",
        "budget_um",
        "budget_rms_um",
        "unknown",
        "next",
    ]
    sizes = list(record["budget_um"].values())
    assert sizes == sorted(sizes, reverse=True)
    assert max(sizes) < record["p95_um"] < sum(sizes)
    assert record["unknown"][0] == {
        "what": "cold geometry", "size_um": [300, 746], "expected_um": None,
        "from": "the study, lines 1127 and 1470: largest errors of its cold arm along X and Y",
    }  # fmt: skip


def test_page_screen_and_junit_say_it(run):
    summary = job_summary(*run)
    page = job_reports(*run)["report.html"]
    assert isinstance(page, bytes)
    assert "<dt>not measured on this robot</dt><dd>cold geometry (300 to 746 &micro;m)" in page.decode()
    assert "um left by calculation. Uncertainty of the robot data: " in headline(summary)
    suite = ElementTree.fromstring(junit_xml([JudgedPath("line_y.toml", 0, 1.0, summary)]))
    properties = {p.attrib["name"]: p.attrib["value"] for p in suite.iter("property")}
    assert float(properties["band.p95_um"]) == pytest.approx(summary["band"]["p95_um"], rel=1e-5)
    assert "repeatability (25 to 100 um)" in properties["band.not_known"]
    assert suite.findtext("system-out") == headline(summary)


def test_the_table_has_the_half_widths_of_both_frames(run):
    planned, corrected = run
    lines = job_reports(planned, corrected)["waypoints.csv"]
    assert not isinstance(lines, bytes)
    rows = list(csv.DictReader(io.StringIO(b"".join(lines).decode())))
    names = [f"band_{axis}_um" for axis in ("x", "y", "z", "feed", "cross", "normal")]
    table = np.array([[float(row[name]) for name in names] for row in rows])
    assert np.allclose(table, corrected.band.half_widths(planned.path) / UM, atol=0.0051)
    assert np.allclose(np.linalg.norm(table[:, :3], axis=1), np.linalg.norm(table[:, 3:], axis=1), atol=0.02)


def test_a_prediction_and_a_correction_of_a_program_carry_it_too(run, tmp_path):
    prediction = compgen.predict(compgen.load_job(path_file("line_y")))
    assert prediction.report["band"]["p95_um"] > 1
    program = tmp_path / "LINE_Y.LS"
    program.write_bytes(run[1].text)
    corrected = compgen.correct(program, robot="m710ic50", before="moving 200mm/s 6h", again=True, max_um=500)
    record = corrected.report["band"]
    assert record["p95_um"] == pytest.approx(prediction.report["band"]["p95_um"], rel=0.03)
    rows = list(csv.DictReader(io.StringIO(corrected.files()["positions.csv"].decode())))
    assert float(rows[5]["band_um"]) > 1
    assert "not known" in corrected.files()["report.html"].decode()
    json.dumps(corrected.report, allow_nan=False)


def test_a_file_that_says_nothing_gets_assumptions_and_a_finding(tmp_path):
    text = (ROOT / "robots" / "m710ic50.toml").read_text()
    begin, end = text.index("[thermal.uncertainty]"), text.index("# Second thermal model")
    silent = tmp_path / "silent.toml"
    silent.write_text(text[:begin] + text[end : text.index("\n[[unknown]]")])
    cell = load_cell(str(silent))
    (finding,) = assumed_findings(cell)
    assert "0.15" in finding.message or "15 % of missing physics" in finding.message
    assert cell.unknown == NOT_KNOWN
    assert not [*assumed_findings(load_cell("m710ic50"))]


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("thermal.uncertainty.cte_um_m_K=[15, 10]", "cte_um_m_K: [15.0, 10.0] must rise"),
        ("thermal.uncertainty.growth_percent.a3=[0, 1]", "growth_percent.a3: no profile"),
        ("thermal.uncertainty.growth_percent.d4=[5, 1]", "growth_percent.d4: [5.0, 1.0] must rise"),
        ("thermal.uncertainty.law_K=-1", "thermal.uncertainty.law_K"),
        ("thermal.uncertainty.law_k=1", "did you mean 'law_K'?"),
        ("unknown.0.size_um=[9, 3]", "unknown.0.size_um: [9.0, 3.0] must rise"),
    ],
)
def test_what_a_file_cannot_mean_is_refused_in_one_line(override, words):
    with pytest.raises(InputError) as refusal:
        load_cell("m710ic50", [override])
    message = str(refusal.value)
    assert words in message
    assert "\n" not in message
    assert len(message) <= 300
