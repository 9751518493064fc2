"""Figures as plain data: plotly's own classes must take every one of them as it is."""

import base64
import html
import json
import re

import numpy as np
import plotly.graph_objects as go
import pytest
from plotly.colors import get_colorscale
from shipped import path_file, quiet

from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.pipelines.study import timeline
from compgen.report.figure import LIGHT_TO_DARK, RED_TO_BLUE, axis, div, figure, library, packed_array, spans, trace
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


def test_every_figure_of_the_pages_says_its_numbers(pages):
    for page, keys in pages[1]:
        words = [
            html.unescape(w)
            for w in re.findall(r'<figure class="chart" role="img" aria-label="([^"]*)"', page.decode())
        ]
        assert len(words) == len(keys)
        for sentence in words:
            assert re.search(r"\d", sentence), sentence
            assert sentence.endswith(".")
            assert "nan" not in sentence.lower()
        assert len(set(words)) == len(words)


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


def rgb(colour):
    values = re.findall(r"\d+", colour) if colour.startswith("rgb") else bytes.fromhex(colour[1:])
    return tuple(map(int, values))


def test_two_sided_scale_is_plotlys():
    reference = get_colorscale("RdBu")
    assert np.allclose([p for p, _ in RED_TO_BLUE], [p for p, _ in reference], rtol=0, atol=1e-15)
    assert [rgb(c) for _, c in RED_TO_BLUE] == [rgb(c) for _, c in reference]


def lightness(colour, seen=None):
    """CIE L* of a colour, as it is or as one without red or green cones sees it (Vienot, Brettel, Mollon 1999)."""
    share = np.array(rgb(colour)) / 255
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    linear = linear if seen is None else np.array(seen) @ linear
    y = linear @ [0.2126, 0.7152, 0.0722]
    return 116 * np.cbrt(y) - 16


PROTANOPE = [[0.11238, 0.88762, 0], [0.11238, 0.88762, 0], [0.00401, -0.00401, 1]]
DEUTERANOPE = [[0.29275, 0.70725, 0], [0.29275, 0.70725, 0], [-0.02234, 0.02234, 1]]


@pytest.mark.parametrize("seen", [None, PROTANOPE, DEUTERANOPE])
def test_scale_of_a_path_darkens_evenly_in_grey_and_for_the_colour_blind(seen):
    steps = np.diff([lightness(colour, seen) for colour in LIGHT_TO_DARK])
    assert (steps < -3).all()
    assert lightness(LIGHT_TO_DARK[0]) < 85, "seen on white"
    assert lightness(LIGHT_TO_DARK[-1]) > 30, "seen on a dark page"


def test_shares_of_a_page_leave_gaps():
    assert spans(1, 0.2) == [[0.0, 1.0]]
    assert np.allclose(spans(2, 0.1), [[0, 0.45], [0.55, 1]])


def test_the_library_that_pages_carry_keeps_the_notice_of_its_licence():
    head = library()[:400].decode()
    assert "Copyright" in head
    assert "Plotly" in head
    assert "Licensed under the MIT license" in head
