"""Every page with its figures in a real browser: on a phone, in the dark, on paper, without its script."""

import itertools
import re

import pytest
from browser import BEYOND, CUT
from every_page import COMMANDS
from markupsafe import Markup

from compgen.report.inputs import Inputs
from compgen.report.page import PageOptions, page

#: tables that are wider than their box, and of those whose rows are blocks each cell with the heading that it shows
SCROLLING = """
return [...document.querySelectorAll(".scroll")].filter(box => box.scrollWidth > box.clientWidth + 1)
  .map(box => box.textContent.slice(0, 60))
"""
STACKED = """
return [...document.querySelectorAll(".stacks tbody td:not(:empty)")].map(cell => [
  cell.textContent, getComputedStyle(cell, "::before").content,
  cell.closest("table").querySelectorAll("thead th")[[...cell.parentElement.children].indexOf(cell)].textContent,
])
"""
WIDTHS = (1400, 800, 400)
NAME = "plotly-1.0.0-abc.min.js"
FIGURE = Markup(
    '<figure><div id="key" class="plotly-graph-div"></div></figure><script>cgenFigures.draw("key",[],{})</script>'
)


@pytest.fixture(scope="module", params=itertools.product(COMMANDS, WIDTHS), ids=lambda of: f"{of[0]}-{of[1]}")
def screen(browser, every_page, request):
    """A page with its figures on a light screen, and how wide that is [px]; opened once for all that is asked of it."""
    command, width = request.param
    browser.show(every_page[command], width=width)
    return browser, width


@pytest.fixture(scope="module", params=COMMANDS)
def dark_screen(browser, every_page, request):
    """A page with its figures on a dark screen, opened once for all that is asked of it."""
    browser.show(every_page[request.param], width=1400, dark=True)
    return browser


def test_nothing_is_wider_than_its_screen(screen):
    browser, width = screen
    assert browser.run("return innerWidth") == width
    assert browser.run(BEYOND) == []
    assert browser.run("return document.documentElement.scrollWidth") <= width


def test_no_word_of_a_figure_is_cut(screen):
    browser, _ = screen
    assert browser.run(CUT) == []


def test_figures_fit_paper_whole_and_go_back(dark_screen):
    widths = "return [...document.querySelectorAll('.chart .main-svg')].map(svg => svg.getBoundingClientRect().width)"
    before = dark_screen.run(widths)
    dark_screen.run("dispatchEvent(new Event('beforeprint'))")
    assert all(width <= 680 for width in dark_screen.run(widths))
    assert dark_screen.run(CUT) == []
    ink = "return [...document.querySelectorAll('.chart [class*=tick] text')].map(text => getComputedStyle(text).fill)"
    assert set(dark_screen.run(ink)) <= {"rgb(30, 41, 59)"}
    dark_screen.run("dispatchEvent(new Event('afterprint'))")
    assert dark_screen.run(widths) == before
    assert "rgb(30, 41, 59)" not in dark_screen.run(ink)


def test_a_page_prints_white_in_the_dark(dark_screen):
    ground = "return getComputedStyle(document.body).backgroundColor"
    assert dark_screen.run(ground) == "rgb(15, 23, 42)"
    pdf = dark_screen.printed()
    assert pdf.startswith(b"%PDF-")
    assert len(re.findall(rb"/Type\s*/Page\b", pdf)) >= 1
    with dark_screen.print_media():
        assert dark_screen.run(ground) == "rgb(255, 255, 255)"


def test_a_page_that_does_not_find_its_script_says_so_in_place_of_each_figure(browser, tmp_path):
    (tmp_path / "page.html").write_bytes(
        page("page.html", "t", inputs=Inputs(), body=FIGURE, options=PageOptions(script=f"../{NAME}"))
    )
    browser.open(tmp_path / "page.html")
    words = browser.run("return document.getElementById('key').innerText")
    assert NAME in words
    assert "not found" in words
    assert "--assets inline" in words


def test_a_browser_that_runs_no_scripts_gets_the_words(browser, every_page):
    browser.open(every_page["generate"], scripts=False)
    assert "this browser runs none" in browser.text("noscript p, noscript")
