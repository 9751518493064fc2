"""A study's page in a real browser: legends and maps that a phone can show, headings that paper keeps."""

import pytest
from browser import BEYOND, chromium

from compgen.pipelines.study import Scenario, Study
from compgen.report.study_page import study_html
from compgen.report.study_tables import StudyOutcome

FEED, WARMUP = "process.feed_mm_s", "before.0.duration_h"
LEGEND = """
const whole = document.getElementById("vary0").getBoundingClientRect();
return [...document.querySelectorAll("#vary0 .legend text")].map(text => {
  const box = text.getBoundingClientRect();
  return [text.textContent, box.left >= whole.left && box.right <= whole.right];
})
"""
CELLS = "return [...document.querySelectorAll('#map_before .heatmap-label')].map(text => text.textContent).join('')"


@pytest.fixture(scope="module")
def browser():
    with chromium() as opened:
        yield opened


@pytest.fixture(scope="module")
def write(tmp_path_factory):
    """A page over the values of two keys."""

    def file_of(key, values, other, others):
        points = [((key, value), (other, one)) for value in values for one in others]
        rows = [
            {"index": n, **dict(point), "state": "done", "before_on_part_max_um": 10.0 * n + 1}
            for n, point in enumerate(points)
        ]
        scenarios = tuple(Scenario(n, point) for n, point in enumerate(points))
        study = Study(
            path="paths/line_y.toml",
            robot=None,
            base=(),
            keys=(key, other),
            scenarios=scenarios,
            correct=False,
            identity="0",
        )
        file = tmp_path_factory.mktemp("study") / "whatif.html"
        file.write_bytes(study_html("What if", StudyOutcome(study=study, rows=rows, answers=[])))
        return file

    return file_of


@pytest.fixture(scope="module")
def page(write):
    """Six feeds and nine warm-ups."""
    return write(WARMUP, [str(hours) for hours in range(9)], FEED, [str(feed) for feed in range(100, 700, 100)])


def test_a_legend_is_whole_on_a_phone(browser, write):
    browser.open(write("robot.thermal.model", ["nodes", "network"], WARMUP, list("01234")), width=400)
    assert browser.run(LEGEND) == [["first warm-up [h]", True], *([hours, True] for hours in "01234")]
    assert browser.run(BEYOND) == []


def test_a_map_of_many_columns_has_numbers_where_they_can_be_read(browser, page):
    browser.open(page, width=400)
    assert browser.run(CELLS) == ""
    assert browser.run("return document.documentElement.scrollHeight") < 6000  # scenarios stay rows
    browser.open(page, width=1400)
    assert "531" in browser.run(CELLS)


def test_paper_keeps_words_with_their_table_and_leaves_out_what_is_folded(browser, page):
    browser.open(page)
    with browser.print_media():
        lead = "return getComputedStyle(document.querySelector('.lead:has(+.scroll)')).breakAfter"
        assert browser.run(lead) == "avoid"
        assert browser.run("return getComputedStyle(document.querySelector('footer')).breakBefore") == "avoid"
        assert browser.run("return getComputedStyle(document.querySelector('details')).display") == "none"
