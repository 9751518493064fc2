"""What is said of a day."""

import numpy as np
import pytest
from shipped import path_file

from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.study import timeline
from compgen.report.heat_page import heat_html, heat_sentences


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
