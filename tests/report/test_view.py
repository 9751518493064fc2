"""Which box of space a path is shown in and from where, and the picture that needs no script."""

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from compgen.report.figure import LIGHT_TO_DARK
from compgen.report.figure_in_space import Coloured, figure_in_space
from compgen.report.still_picture import side_by_side
from compgen.report.view import close_together, ticks, view_of

T = np.linspace(0, 1, 400)


def raster(u, v):
    """Sweeps over the unit square, spanned by two directions."""
    sweep = np.concatenate([T if n % 2 == 0 else 1 - T for n in range(9)]) - 0.5
    step = np.repeat(np.linspace(-0.5, 0.5, 9), len(T))
    return np.outer(sweep, u) + np.outer(step, v)


PLANES = {
    "flat spiral": np.column_stack([1350 + 600 * T * np.cos(50 * T), 600 * T * np.sin(50 * T), 0 * T + 200]),
    "raster upright in XZ": np.add(raster([800, 0, 0], [0, 0, 800]), [1200, 100, 900]),
    "raster upright in YZ": np.add(raster([0, 800, 0], [0, 0, 800]), [1200, 100, 900]),
    "raster upright at 45 degrees": np.add(raster([560, 560, 0], [0, 0, 800]), [1200, 100, 900]),
    "raster upright at -45 degrees": np.add(raster([560, -560, 0], [0, 0, 800]), [1200, 100, 900]),
    "raster tilted": np.add(raster([800, 0, 0], [0, 560, 560]), [1200, 0, 400]),
    "small program far out": np.add(raster([100, 0, 0], [0, 100, 0]), [1200, 0, 50]),
}
LINES = {
    "line along X": np.add(np.outer(T, [1000, 0, 0]), [800, 0, 200]),
    "line along Y": np.add(np.outer(T, [0, 1360, 0]), [1350, -680, 203]),
    "line along Z": np.add(np.outer(T, [0, 0, 1000]), [1200, 0, 0]),
    "line across": np.add(np.outer(T, [500, 500, 500]), [800, 0, 200]),
    "stations on a line": np.add(np.outer(np.arange(9), [50, 0, 0]), [1000.0, 0, 300]),
}


def filled(view, places):
    """Shares of the picture's width and height that places fill."""
    return np.ptp(view.project(places), axis=0) / (2 * np.array(view.extent))


@pytest.mark.parametrize("name", PLANES)
def test_a_plane_fills_most_of_its_picture_and_is_not_seen_from_its_edge(name):
    places = PLANES[name]
    view = view_of(places, np.ones(len(places), dtype=bool))
    assert (filled(view, places) > 0.6).all()
    small, large = np.linalg.svd(view.project(places - places.mean(axis=0)) - view.project(np.zeros((1, 3))))[1][::-1]
    assert small > 0.35 * large


@pytest.mark.parametrize("name", LINES)
def test_a_line_fills_most_of_its_picture_along_it(name):
    places = LINES[name]
    view = view_of(places, np.ones(len(places), dtype=bool))
    assert filled(view, places).max() > 0.7
    drawn = np.linalg.norm(view.project(places[-1:]) - view.project(places[:1]))
    assert drawn > 0.6, "no line is looked at along itself"


def test_one_point_is_in_the_middle_of_a_small_box():
    view = view_of(np.array([[1200.0, 30, 400]]), np.ones(1, dtype=bool))
    assert np.allclose(view.project(np.array([[1200.0, 30, 400]])), 0)
    assert view.size.max() == 20


def test_every_axis_has_room_for_its_numbers():
    for places in [*PLANES.values(), *LINES.values()]:
        view = view_of(places, np.ones(len(places), dtype=bool))
        assert view.size.min() >= 0.2 * view.size.max()
        for low, high, size in zip(view.low, view.high, view.size, strict=True):
            count = len(ticks(low, high, max(2, round(5 * size / view.size.max()))))
            assert 1 <= count <= 5


def test_right_up_and_eye_stand_square_on_each_other():
    view = view_of(PLANES["raster tilted"], np.ones(len(PLANES["raster tilted"]), dtype=bool))
    axes = np.array([view.right, view.up, view.eye])
    assert np.allclose(axes @ axes.T, np.eye(3))
    assert np.allclose(np.cross(view.right, view.up), view.eye)
    assert view.up[2] > 0


def test_the_part_decides_the_box_and_what_is_left_out_is_said():
    small = PLANES["small program far out"]
    places = np.vstack([small, [[900, -800, 900], [1500, 900, 1000.0]]])
    part = np.arange(len(places)) < len(small)
    view = view_of(places, part)
    assert (filled(view, small) > 0.6).all()
    drawn = figure_in_space("x", [Coloured("before", places, np.ones(len(places)))], places, part)
    note = f"Not shown: 2 of {len(places)} places, up to 1,"
    assert note in drawn["alt"]
    assert drawn["layout"]["annotations"][0]["text"].startswith(note)


def test_a_lift_near_the_part_is_shown():
    small = PLANES["small program far out"]
    places = np.vstack([np.add(small[:1], [0, 0, 30]), small])
    view = view_of(places, np.arange(len(places)) > 0)
    assert view.shows(places).all()


def test_positions_far_from_most_are_no_part():
    places = np.vstack([PLANES["small program far out"][::40], np.full((9, 3), 900.0)])
    assert close_together(places).tolist() == [True] * (len(places) - 9) + [False] * 9
    for places in (*PLANES.values(), *LINES.values()):
        assert close_together(places).all()


def test_numbers_on_an_axis_are_round():
    assert ticks(0, 123.6, 5).tolist() == [0, 50, 100]
    assert ticks(-684, 584, 5).tolist() == [-500, 0, 500]
    assert ticks(0.0, 0.0, 5).tolist() == [0.0]


def still(places, values):
    return figure_in_space("x", [Coloured("a <b> & c", places, values)], places, np.ones(len(places), dtype=bool))[
        "still"
    ]


@pytest.mark.parametrize("name", [*PLANES, *LINES])
def test_a_still_picture_is_well_formed_small_and_the_same_every_time(name):
    places = {**PLANES, **LINES}[name]
    values = np.abs(np.sin(np.arange(len(places)) / 7))
    (picture,) = still(places, values)
    assert still(places, values) == [picture]
    assert len(picture) < 60_000
    root = ElementTree.fromstring(picture)
    width, height = (float(root.attrib[k]) for k in ("width", "height"))
    words = ["".join(t.itertext()) for t in root.iter("{http://www.w3.org/2000/svg}text")]
    assert {"a <b> & c [µm]", f"\u25c7 largest {values.max():.2f}"} <= set(words)
    for axis in "XYZ":
        assert any(re.fullmatch(rf"{axis} (\[mm\]|-?[\d.]+ mm)", word) for word in words), axis
    for text in root.iter("{http://www.w3.org/2000/svg}text"):
        x, length = float(text.attrib["x"]), 7 * len("".join(text.itertext()))
        left = x - {"start": 0, "middle": length / 2, "end": length}[text.attrib.get("text-anchor", "start")]
        assert left > -2, "a word is cut"
        assert left + length < width + 2, "a word is cut"
    for x, y in re.findall(r"[ML](-?[\d.]+) (-?[\d.]+)", picture):
        assert 0 <= float(x) <= width
        assert 0 <= float(y) <= height
    assert "nan" not in picture
    ElementTree.fromstring(side_by_side([picture, picture], "2 < 3"))


@pytest.mark.parametrize("name", [*PLANES, *LINES])
def test_a_still_picture_is_as_large_as_its_words_allow(name):
    places = {**PLANES, **LINES}[name]
    (picture,) = still(places, np.ones(len(places)))
    xy = [(float(x), float(y)) for x, y in re.findall(r"[ML](-?[\d.]+) (-?[\d.]+)", picture)]
    words = re.findall(r'<text x="([-\d.]+)" y="([-\d.]+)" text-anchor="(\w+)"[^>]*>([^<]*)', picture)
    for x, y, anchor, text in words[2:]:
        shift = {"start": 0, "middle": 0.5, "end": 1}[anchor] * 7 * len(text)
        xy += [(float(x) - shift, float(y)), (float(x) - shift + 7 * len(text), float(y))]
    below = np.array([point for point in xy if point[1] > 70])
    assert (np.ptp(below, axis=0) / [340, 340 - 70]).max() > 0.9


def test_a_still_picture_is_interrupted_where_the_path_is():
    places = np.vstack([LINES["line along X"], np.full((1, 3), np.nan), LINES["line along X"] + [0, 200, 0]])
    (picture,) = still(np.where(np.isnan(places), 0, places), np.ones(len(places)))
    whole = picture.count("stroke-linecap")
    drawn = figure_in_space(
        "x", [Coloured("a", places, np.ones(len(places)))], LINES["line along X"], np.ones(400, bool)
    )
    assert (whole, drawn["still"][0].count("stroke-linecap")) == (1, 1)
    both = figure_in_space(
        "x", [Coloured("a", places, np.ones(len(places)))], places[~np.isnan(places[:, 0])], np.ones(800, bool)
    )
    assert both["still"][0].count("stroke-linecap") == 2


def test_a_still_picture_has_the_colour_of_the_error_at_each_place():
    places = LINES["line along X"]
    (picture,) = still(places, np.linspace(0, 1, len(places)))
    drawn = re.findall(r'stroke="(#\w+)" stroke-width', picture)
    assert (drawn[0], drawn[-1]) == (LIGHT_TO_DARK[0], LIGHT_TO_DARK[-1])
    assert drawn == re.findall(r'fill="(#\w+)"', picture)  # the scale above


def test_a_still_picture_of_a_circle_is_round():
    angle = np.linspace(0, 2 * np.pi, 400)
    (picture,) = still(np.column_stack([200 * np.cos(angle), 200 * np.sin(angle), 0 * angle]), np.ones(400))
    (drawn,) = re.findall(r'<path d="([^"]*)" stroke="#\w+" stroke-width', picture)
    assert drawn.count("L") > 20


def test_nothing_to_colour_is_a_picture_all_the_same():
    places = LINES["line along X"]
    drawn = figure_in_space("x", [Coloured("a", places, np.full(len(places), np.nan))], places, np.zeros(400, bool))
    ElementTree.fromstring(drawn["still"][0])
    assert "nan" not in drawn["alt"].lower()


def test_a_place_that_has_a_name_says_it_once():
    places, values = PLANES["flat spiral"][::80], np.arange(5.0)
    drawn = figure_in_space("x", [Coloured("a", places, values, [f"P[{k}]" for k in range(5)])], places, values >= 0)
    hover = drawn["data"][0]["hovertemplate"]
    assert hover.count("%{text}") == 1
    assert drawn["data"][0]["text"][3] == "P[3]"
