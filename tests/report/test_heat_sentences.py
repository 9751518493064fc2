"""What is said of a day."""

import json

import numpy as np
import pytest
from shipped import path_file, quiet

from compgen.core.finding_codes import Code
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.pipelines.study import timeline
from compgen.report.heat_page import heat_csv, heat_html, heat_json, heat_sentences, runs_csv


@pytest.mark.parametrize(
    ("before", "worst", "said"),
    [("before.0.duration_h=6", 1, "first run, which errs most"), ("before=[]", 3, "um in run 3, which errs most")],
)
def test_the_run_that_errs_most_is_named_once(before, worst, said):
    """``that is the first run, 44 um in run 1, which errs most`` was said."""
    job = load_job(path_file("line_x"), None, (before, 'cycle=[{state="moving", repeat=3, dwell_s=1800}]'))
    day = timeline(job)
    assert int(np.argmax(day.error)) + 1 == worst
    (sentence,) = (s for s in heat_sentences(job, day) if "errs most" in s)
    assert said in sentence
    assert (f"µm in run {worst}<" in heat_html(job, day).decode()) == (worst > 1)


def test_runs_of_a_long_day_begin_one_after_another():
    """Six digits of 1,440,007 s are ten seconds: four runs began at once."""
    job = load_job(path_file("line_x"), None, ("before.0.duration_h=400", 'cycle=[{state="moving", repeat=9}]'))
    day = timeline(job)
    for table, times in ((runs_csv(job, day), day.run), (heat_csv(job, day), day.time)):
        head, *rows = (line.split(",") for line in table.decode().splitlines())
        column = next(n for n, name in enumerate(head) if name.endswith("_s"))
        assert [float(row[column]) for row in rows] == pytest.approx(times.tolist(), abs=5.1e-4)


BEYOND = (
    'before=[{state="moving", repeat=7, dwell_s=33, feed_mm_s=200}, {state="moving", feed_mm_s=450, duration_h=6}]',
    'cycle=[{state="moving", repeat=2}, {state="moving", program="line_y", feed_mm_s=300, duration_h=1}]',
)
AT_450 = "before.1 feed 450 mm/s lies outside 20 to 200 mm/s, where the thermal parameters were measured"
AT_300 = "cycle.1 feed 300 mm/s lies outside 20 to 200 mm/s, where the thermal parameters were measured"


def in_box(findings):
    return [finding.message for finding in findings if finding.code == Code.THERMAL_BOX]


def test_a_day_says_where_it_leaves_what_was_measured():
    """By the steps as the file has them, its hours and its highest rise; nothing was said."""
    job = load_job(path_file("line_x"), None, BEYOND)
    day = timeline(job)
    *feeds, hours, rise = in_box(day.findings)
    assert feeds == [AT_450, AT_300]
    assert hours == "7.02 h of motion by the day's end exceed the 6.5 h the thermal parameters were measured over"
    assert rise == f"a rise of {day.rise.max():.1f} K is above the 14 K measured"
    assert day.rise.max() > 18
    messages = [f["message"] for f in json.loads(heat_json(job, day))["findings"] if f["code"] == "thermal.box"]
    assert messages == in_box(day.findings)
    assert AT_450 in heat_html(job, day).decode()


def test_a_day_inside_of_what_was_measured_says_nothing():
    assert in_box(timeline(load_job(path_file("line_x"), None, ("before.0.duration_h=3",))).findings) == []


def test_a_step_is_named_as_its_file_has_it():
    """*before.14* was said, and *before.1* of a cycle that [start] goes through."""
    planned = generate.predict(load_job(path_file("line_x"), None, BEYOND), quiet)
    assert in_box(planned.findings)[0] == AT_450
    later = (
        "before=[]",
        'cycle=[{state="moving", program="line_y", feed_mm_s=300, duration_h=1}, {state="moving", repeat=2}]',
        "start.run=2",
    )
    planned = generate.predict(load_job(path_file("line_x"), None, later), quiet)
    assert in_box(planned.findings) == [AT_300.replace("cycle.1", "cycle.0")]
