"""What is said of a day."""

import numpy as np
import pytest
from shipped import path_file

from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.study import timeline
from compgen.report.heat_page import heat_csv, heat_html, heat_sentences, runs_csv


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
