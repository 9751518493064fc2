"""The page of a study: words for keys, limits, maps over two keys, legends that can be read, failures that are seen."""

import re

import numpy as np
import pytest
from shipped import path_file

from compgen.core.units import UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.study import Answer, Scenario, Study
from compgen.report.answer_figures import answer_figure, passes_rows
from compgen.report.figure import Limit, unpacked
from compgen.report.study_figures import MANY_COLOURS, curves, error_map
from compgen.report.study_page import study_html
from compgen.report.study_tables import StudyOutcome, grid_of

FEED, WARMUP, MODEL = "process.feed_mm_s", "before.0.duration_h", "robot.thermal.model"
FEEDS, HOURS = ("20", "100", "50"), ("0.0", "1.0", "6.0")


def row(index, values, error, after=None, inside=True):
    done = {
        "index": index,
        **values,
        "state": "done",
        "before_max_um": 1.1 * error,  # of the whole program
        "before_on_part_max_um": error,
        "waypoints": 10,
        "band_um": 5.0,
    }
    return done if after is None else {**done, "after_max_um": after, "after_on_part_max_um": after, "inside": inside}


def made_grid(axes, error, after=None):
    """A full grid of scenarios; an error of None is a scenario that failed."""
    points: list[dict[str, str]] = [{}]
    for key, values in axes.items():
        points = [{**point, key: value} for point in points for value in values]
    rows = []
    for n, point in enumerate(points):
        size = error(point)
        failed = {"index": n, **point, "state": "failed", "reason": "out of reach"}
        rows.append(failed if size is None else row(n, point, size, after(point) if after else None))
    return grid_of(tuple(axes), rows)


def study_of(grid):
    scenarios = tuple(Scenario(r["index"], tuple((k, str(r[k])) for k in grid.keys)) for r in grid.rows)
    return Study(
        path="paths/line_y.toml", robot=None, base=(), keys=grid.keys, scenarios=scenarios, correct=False, identity="0"
    )


def outcome(grid, **more):
    return StudyOutcome(study=study_of(grid), rows=list(grid.rows), answers=[], **more)


def by_feed_and_hours(point):
    return 10 * float(point[WARMUP]) + float(point[FEED]) / 10


def texts(page):
    return re.sub(r"<script>.*?</script>", "", page, flags=re.S)


@pytest.fixture
def plane():
    return made_grid({WARMUP: HOURS, FEED: FEEDS}, by_feed_and_hours)


def test_titles_and_axes_are_words_with_units(plane):
    page = texts(study_html("t", outcome(plane)).decode())
    for words in ("Largest error against first warm-up", "Largest error against feed", "before max, on the part [µm]"):
        assert words in page.split("<details>")[0]
    assert "duration_h" not in page.split("<details>")[0]
    figure, _ = curves(plane, FEED)
    assert figure["layout"]["xaxis"]["title"]["text"] == "feed [mm/s]"
    assert figure["layout"]["legend"]["title"]["text"] == "first warm-up [h]"
    assert [t["name"] for t in figure["data"]] == ["0", "1", "6"]


def test_the_table_leaves_out_what_says_nothing_and_begins_with_what_was_varied(plane):
    page = texts(study_html("t", outcome(plane)).decode()).split("<details>")[0]
    heads = re.findall(r'<th scope="col"[^>]*>([^<]*)</th>', page)
    assert heads == ["first warm-up [h]", "feed [mm/s]", "before max, on the part [µm]", "scenario"]
    assert "The same in all: may be off beside that (95 %) 5.0 µm." in page


def test_lines_of_a_second_key_are_told_without_colours(plane):
    figure, _ = curves(plane, FEED)
    assert len({t["marker"]["symbol"] for t in figure["data"]}) == len(HOURS)
    greys = [
        sum(w * int(c[i : i + 2], 16) for w, i in zip((0.3, 0.59, 0.11), (1, 3, 5), strict=True)) for c in MANY_COLOURS
    ]
    assert all(b - a > 15 for a, b in zip(greys, greys[1:], strict=False))


def test_lines_run_along_the_axis_whatever_the_order_of_the_values(plane):
    figure, _ = curves(plane, FEED)
    assert all(list(t["x"]) == [20.0, 50.0, 100.0] for t in figure["data"])


def test_a_map_has_a_cell_for_each_pair_in_the_order_of_the_values(plane):
    for x, y, cells in ((WARMUP, FEED, lambda c, r: 10 * c + r / 10), (FEED, WARMUP, lambda c, r: 10 * r + c / 10)):
        figure, held = error_map(plane, x, y, "before", Limit("--max-um 30 µm", 30.0, True))
        (heat,) = figure["data"]
        expected = [[cells(float(c), float(r)) for c in heat["x"]] for r in heat["y"]]
        assert heat["z"] == expected
        assert [float(v) for v in heat["x"]] == sorted(float(v) for v in heat["x"])
        assert held == "▲ over --max-um 30 µm."
        assert [["▲" in text for text in line] for line in heat["text"]] == [
            [z > 30 for z in line] for line in expected
        ]
        assert figure["layout"]["xaxis"]["type"] == "category"
    assert "65.0 µm" not in figure["alt"]
    assert "70.0 µm at feed 100 mm/s and first warm-up 6 h" in figure["alt"]


def test_words_are_categories_in_their_order():
    grid = made_grid({MODEL: ("nodes", "network"), FEED: FEEDS}, lambda p: len(p[MODEL]) + float(p[FEED]))
    figure, _ = curves(grid, MODEL)
    assert figure["layout"]["xaxis"]["categoryarray"] == ["nodes", "network"]
    heat = error_map(grid, FEED, MODEL, "before")[0]["data"][0]
    assert heat["y"] == ["nodes", "network"]


def test_many_values_of_a_second_key_have_a_colour_bar_and_no_names():
    hours = [str(float(h)) for h in range(9)]
    figure, _ = curves(made_grid({WARMUP: hours, FEED: FEEDS}, by_feed_and_hours), FEED)
    lines = [t for t in figure["data"] if t["mode"] != "markers"]
    assert len(lines) == 9
    assert not any(t["showlegend"] for t in lines)
    assert lines[0]["line"]["color"] == MANY_COLOURS[0]
    assert lines[-1]["line"]["color"] == MANY_COLOURS[-1]
    (bar,) = (t["marker"]["colorbar"] for t in figure["data"] if "colorbar" in t.get("marker", {}))
    assert bar["title"]["text"] == "first warm-up [h]"
    assert bar["ticktext"] == ["0", "4", "8"]


def test_a_third_key_is_held_as_in_the_worst_scenario_and_said():
    axes = {WARMUP: HOURS, FEED: FEEDS, "process.chord_um": ("1", "2")}
    grid = made_grid(axes, lambda p: by_feed_and_hours(p) - float(p["process.chord_um"]))
    figure, held = curves(grid, WARMUP)
    assert held == "Held as in the scenario that errs most: chord 1 µm."
    assert len(figure["data"]) == len(FEEDS)
    assert error_map(grid, WARMUP, FEED, "before")[1] == held


def test_before_and_after_differ_by_dash_and_marker_and_have_scales_of_their_own():
    grid = made_grid({FEED: FEEDS}, lambda p: float(p[FEED]), lambda p: 1.0)
    figure, _ = curves(grid, FEED, Limit("bound 2.5 µm", 2.5))
    before, after = figure["data"]
    assert (before["name"], after["name"]) == ("before", "after")
    assert before["line"]["dash"] != after["line"]["dash"]
    assert before["marker"]["symbol"] != after["marker"]["symbol"]
    assert before["yaxis"] != after["yaxis"]
    (line,), (label,) = figure["layout"]["shapes"], figure["layout"]["annotations"]
    assert (line["yref"], line["y0"], line["line"]["dash"]) == ("y2", 2.5, "dash")
    assert (label["yref"], label["text"]) == ("y2", "bound 2.5 µm")


def test_scenarios_that_failed_or_are_outside_are_marked():
    grid = made_grid({WARMUP: HOURS, FEED: FEEDS}, lambda p: None if p[FEED] == "50" else by_feed_and_hours(p))
    figure, _ = curves(grid, FEED)
    (failed,) = (t for t in figure["data"] if t["name"] == "failed")
    assert failed["marker"]["symbol"] == "x"
    assert failed["x"] == [50.0] * 3
    cells = error_map(grid, FEED, WARMUP, "before")[0]["data"]
    assert cells[0]["z"][0][1] is None
    assert list(cells[1]["x"]) == ["50"] * 3
    page = texts(study_html("t", outcome(grid)).decode())
    assert "failed: scenarios 2, 5, 8: out of reach" in page
    corrected = grid_of((FEED,), [row(0, {FEED: "20"}, 9.0, 1.0), row(1, {FEED: "50"}, 9.0, 4.0, inside=False)])
    (ring,) = (t for t in curves(corrected, FEED)[0]["data"] if t["name"] == "outside bounds")
    assert (ring["x"], ring["y"]) == ([50.0], [4.0])


def test_a_study_that_failed_as_a_whole_has_a_page(plane):
    grid = made_grid({FEED: FEEDS}, lambda p: None)
    page = texts(study_html("t", outcome(grid)).decode())
    assert "failed: scenarios 0, 1, 2: out of reach" in page


def test_the_worst_scenario_is_first_and_bold_and_the_csv_is_linked(plane):
    page = texts(study_html("t", outcome(plane)).decode())
    first = page[page.index("<tbody>") :].split("</tr>")[0]
    assert "<strong>70.00</strong>" in first
    assert page.count("<strong>70.00</strong>") == 1
    assert '<a href="whatif.csv">' in page
    assert "<dt><code>before_max_um</code></dt><dd>before max [µm]</dd>" in page


def test_the_page_says_what_it_was_made_from_and_what_was_varied(plane):
    job = load_job(path_file("line_y"))
    page = texts(study_html("t", outcome(plane, base=job)).decode())
    assert job.cell.robot_file_hash in page
    assert "first warm-up [h]: 0, 1, 6; feed [mm/s]: 20, 50, 100" in page


def test_the_bound_is_the_command_lines_or_the_files_unless_it_is_varied(plane):
    job = load_job(path_file("line_y"))
    assert job.bounds.max is not None

    def labels(grid, **more):
        page = study_html("t", outcome(grid, base=job, **more)).decode().replace("\\u00b5", "µ")
        return re.findall(r"(?:bound|--max-um) [\d.]+ µ", page)

    assert set(labels(plane)) == {f"bound {job.bounds.max / UM:g} µ"}
    assert set(labels(plane, max_um=7.0)) == {"--max-um 7 µ"}
    assert not labels(made_grid({"bounds.max_um": ("2", "3"), FEED: FEEDS}, lambda p: float(p[FEED])))


def test_answers_show_the_limit_that_they_are_about():
    table = np.array([[0.0, 8.0], [1.0, 4.0], [2.0, 2.0]])
    figure = answer_figure(
        Answer(key="warmup", sentence="s", columns=("warmup_h", "drift_um"), table=table, limit=5 * UM)
    )
    assert [shape["y0"] for shape in figure["layout"]["shapes"]] == [pytest.approx(5)]
    assert figure["layout"]["xaxis"]["title"]["text"] == "warm-up [h]"
    passes = Answer(
        key="passes",
        sentence="s",
        columns=("feed_mm_s", "minutes", "error_um"),
        table=np.array([[20, 9, 3], [50, 4, 7.0]]),
        labels=("a", "b"),
        limit=5 * UM,
    )
    within, beyond = answer_figure(passes)["data"]
    assert unpacked(within["y"]).tolist() == [3.0]
    assert unpacked(beyond["y"]).tolist() == [7.0]
    assert within["marker"]["symbol"] != beyond["marker"]["symbol"]


def test_curves_are_shown_where_they_cross_the_limit():
    late = np.linspace(0, 960, 97)
    table = np.column_stack([late, late / 5, np.linspace(-5, 5, 97), np.abs(np.linspace(-50, 50, 97))])
    columns = ("delay_min", "late_um", "ambient_K", "ambient_um")
    layout = answer_figure(Answer(key="validity", sentence="s", columns=columns, table=table, limit=2 * UM))["layout"]
    assert layout["yaxis"]["range"] == layout["yaxis2"]["range"] == [0, pytest.approx(12)]
    assert layout["xaxis"]["range"] == [0, 70]
    assert layout["xaxis2"]["range"] == [pytest.approx(-1.25), pytest.approx(1.25)]
    assert (
        "range"
        not in answer_figure(Answer(key="validity", sentence="s", columns=columns, table=table, limit=50 * UM))[
            "layout"
        ]["yaxis"]
    )


def test_passes_are_listed_with_those_within_the_limit_first():
    table = np.array([[20, 9, 3], [50, 4, 7.0], [40, 5, 2.0]])
    rows, more = passes_rows(
        Answer(
            key="passes",
            sentence="s",
            columns=("feed_mm_s", "minutes", "error_um"),
            table=table,
            labels=("a > b", "c", "d"),
            limit=5 * UM,
        )
    )
    assert [row[0] for row in rows] == ["d", "a, b", "c"]
    assert more <= 0


def test_a_sentence_that_begins_with_the_name_of_a_file_keeps_it():
    answer = Answer(
        key="passes",
        sentence="raster_2 then a: 3 um",
        columns=("feed_mm_s", "minutes", "error_um"),
        table=np.ones((1, 3)),
        labels=("a",),
    )
    assert (
        "</span> raster_2 then a: 3 µm</p>"
        in study_html("t", StudyOutcome(study=None, rows=[], answers=[answer])).decode()
    )


def test_a_large_study_is_drawn_at_once_with_some_of_its_lines():
    hours = [str(h / 100) for h in range(300)]
    grid = made_grid({WARMUP: hours, FEED: [str(f) for f in range(20, 220)]}, by_feed_and_hours)
    figure, held = curves(grid, FEED)
    assert len([t for t in figure["data"] if t["mode"] != "markers"]) == 30
    assert held == "Lines for 30 of 300 values of first warm-up."


def test_only_the_map_that_the_bound_is_for_marks_what_is_over_it():
    grid = made_grid({WARMUP: HOURS, FEED: FEEDS}, by_feed_and_hours, lambda p: float(p[FEED]) / 20)
    page = texts(study_html("t", outcome(grid, max_um=2.0)).decode())
    before, after = page.split("Largest error before, over")[1].split("Largest error after, over")
    assert "▲" not in before
    assert "▲ over --max-um 2 µm." in after
