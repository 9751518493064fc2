"""Every page in a real browser: on a phone, in the dark, on paper, without its script."""

import re

import pytest
from browser import BEYOND, chromium
from every_page import COMMANDS

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
NAME = "plotly-1.0.0-abc.min.js"
FIGURE = '<figure><div id="key" class="plotly-graph-div"></div></figure><script>cgenFigures.draw("key",[],{})</script>'


@pytest.fixture(scope="module")
def browser():
    with chromium() as opened:
        yield opened


@pytest.mark.parametrize("command", COMMANDS)
def test_nothing_is_wider_than_a_phone(browser, every_page, command):
    browser.open(every_page[command], width=400)
    assert browser.run("return innerWidth") == 400
    assert browser.run(BEYOND) == []
    assert browser.run("return document.documentElement.scrollWidth") <= 400


@pytest.mark.parametrize("command", [c for c in COMMANDS if c != "whatif"])  # its rows have many columns: they scroll
def test_no_table_is_wider_than_a_phone_and_every_number_keeps_its_heading(browser, every_page, command):
    browser.open(every_page[command], width=400)
    assert browser.run(SCROLLING) == []
    for cell, heading, shown in browser.run(STACKED):
        assert heading == f'"{shown}"', cell


@pytest.mark.parametrize("command", COMMANDS)
def test_a_page_prints_white_in_the_dark(browser, every_page, command):
    browser.open(every_page[command], dark=True)
    ground = "return getComputedStyle(document.body).backgroundColor"
    assert browser.run(ground) == "rgb(15, 23, 42)"
    pdf = browser.printed()
    assert pdf.startswith(b"%PDF-")
    assert len(re.findall(rb"/Type\s*/Page\b", pdf)) >= 1
    browser.print_media()
    assert browser.run(ground) == "rgb(255, 255, 255)"


def test_a_page_that_does_not_find_its_script_says_so_in_place_of_each_figure(browser, tmp_path):
    (tmp_path / "page.html").write_bytes(page("t", FIGURE, options=PageOptions(script=f"../{NAME}")))
    browser.open(tmp_path / "page.html")
    words = browser.run("return document.getElementById('key').innerText")
    assert NAME in words
    assert "not found" in words
    assert "--assets inline" in words


def test_a_browser_that_runs_no_scripts_gets_the_words(browser, every_page):
    browser.open(every_page["generate"], scripts=False)
    assert "this browser runs none" in browser.text("noscript p, noscript")
