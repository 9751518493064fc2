"""Figures as plain data: plotly's own classes must take every one of them as it is."""

import base64
import json
import re

import numpy as np
import plotly.graph_objects as go
import pytest
from plotly.colors import get_colorscale
from shipped import path_file, quiet

from compgen.pipelines import generate
from compgen.pipelines.path_file import load_job
from compgen.pipelines.study import timeline
from compgen.report.figure import RED_TO_BLUE, TURBO, axis, div, figure, packed_array, spans, trace
from compgen.report.heat_page import heat_html
from compgen.report.job_page import job_html


def figures(page):
    """Data and layout of each figure of a page, by its key."""
    page_figures, decoder = {}, json.JSONDecoder()
    text = page.decode()
    for start in re.finditer(r'cgenFigures\.draw\("(\w+)",', text):
        data, at = decoder.raw_decode(text, start.end())
        layout, _ = decoder.raw_decode(text, at + 1)
        page_figures[start[1]] = (data, layout)
    return page_figures


def unpacked(packed):
    return np.frombuffer(base64.b64decode(packed["bdata"]), packed["dtype"])


@pytest.fixture(scope="module")
def pages():
    job = load_job(path_file("line_y"))
    planned, corrected = generate.generate(job, quiet)
    day = timeline(load_job(path_file("line_y"), overrides=['cycle=[{state="moving",repeat=3}]']))
    return planned, [
        (job_html(planned, corrected), {"time", "budget", "space", "band", "heat", "joints"}),
        (job_html(planned, None), {"time", "budget", "space", "band", "heat", "joints"}),
        (heat_html(job, day), {"rises", "runs"}),
    ]


def test_plotly_takes_every_figure_as_it_is(pages):
    for page, keys in pages[1]:
        page_figures = figures(page)
        assert set(page_figures) == keys
        for data, layout in page_figures.values():
            accepted = go.Figure(data, layout).to_plotly_json()  # raises for what plotly does not know
            assert json.loads(json.dumps(accepted["layout"])) == layout
            assert [t["type"] for t in accepted["data"]] == [t["type"] for t in data]


def test_a_curve_shows_the_numbers(pages):
    planned, ((page, _), *_) = pages
    curve = figures(page)["heat"][0][0]
    assert np.array_equal(unpacked(curve["x"]), np.round(planned.trajectory.time, 3))
    assert np.array_equal(unpacked(curve["y"]), np.round(planned.rise[:, 0], 4))


def test_no_text_ends_the_script():
    page = div(figure([trace("scatter", [1], [2], name="</script><b>")], 100, "a <i>", xaxis=axis("a/b<c>")), "key")
    assert page.count("</script>") == 1
    assert "<b>" not in page
    assert "<i>" not in page
    assert 'role="img" aria-label="a &lt;i&gt;"' in page


def test_arrays_keep_shape_and_numbers():
    table = np.array([[1.5, np.nan], [-2.0, 1e300]])
    packed = packed_array(table)
    assert packed["shape"] == "2, 2"
    assert unpacked(packed).tobytes() == table.tobytes()
    assert packed_array(np.arange(3))["dtype"] == "f8"
    assert packed_array(np.zeros(0)) == []


def test_scales_are_plotlys():
    for scale, name in ((TURBO, "Turbo"), (RED_TO_BLUE, "RdBu")):
        reference = get_colorscale(name)
        assert np.allclose([place for place, _ in scale], [place for place, _ in reference], rtol=0, atol=1e-15)
        shown = [tuple(int(c[i : i + 2], 16) for i in (1, 3, 5)) for _, c in scale]
        accepted = [
            tuple(map(int, re.findall(r"\d+", c))) if c.startswith("rgb") else tuple(bytes.fromhex(c[1:]))
            for _, c in reference
        ]
        assert shown == accepted


def test_shares_of_a_page_leave_gaps():
    assert spans(1, 0.2) == [[0.0, 1.0]]
    assert np.allclose(spans(2, 0.1), [[0, 0.45], [0.55, 1]])
