"""Figures in a real browser: named, drawn or still, dark, on a phone."""

import re

import pytest
from every_page import COMMANDS

SHOWN = "getComputedStyle(document.querySelector('{}')).display != 'none'"
NO_WEBGL = """
const context = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function(kind, ...more) {
  return kind.startsWith("webgl") ? null : context.call(this, kind, ...more);
};
"""


@pytest.mark.parametrize("command", COMMANDS)
def test_every_figure_of_every_page_is_named_by_its_numbers(every_page, command):
    page = every_page[command].read_text()
    named = re.findall(r'<figure class="chart" role="img" aria-label="([^"]*)"><div id="[^"]+"', page)
    assert len(named) == len(re.findall(r"cgenFigures\.draw\(\"", page))
    for words in named:
        assert re.search(r"\d", words), words
        assert not re.search(r"\bnan\b|\binf\b|: nothing", words), words


@pytest.mark.parametrize("command", ["generate", "whatif"])
def test_no_button_of_a_figure_sends_its_numbers_to_another_host(browser, every_page, command):
    browser.show(every_page[command])
    buttons = "return [...document.querySelectorAll('.modebar-btn')].map(button => button.dataset.title)"
    titles = set(browser.run(buttons))
    assert "download plot as a png" in {title.lower() for title in titles}
    assert not [title for title in titles if re.search("[Ss]hare|[Cc]loud|[Ee]dit", title)]


@pytest.mark.parametrize("width", [400, 1400])
def test_the_number_of_a_bar_stands_upright_beside_it(browser, every_page, width):
    browser.show(every_page["generate"], width=width)
    texts = "return [...document.querySelectorAll('#budget .bartext')].map(text => text.getAttribute('transform'))"
    turns = browser.run(texts)
    assert len(turns) > 5
    assert not [turn for turn in turns if "rotate" in turn]


def test_a_figure_in_space_is_drawn_once_it_is_near_the_screen_and_still_on_paper(browser, every_page):
    browser.open(every_page["generate"])
    settle(browser)
    live, still = SHOWN.format("#space"), SHOWN.format(".chart:has(#space) .still")
    assert browser.run(f"return [{live}, {still}]") == [False, True]
    assert browser.run("return document.querySelectorAll('canvas').length") == 0
    browser.run("document.querySelector('.chart:has(#space)').scrollIntoView()")
    browser.wait_for(lambda: browser.run("return document.querySelector('.chart:has(#space)').matches('.drawn')"))
    assert browser.run("return document.querySelectorAll('#space canvas').length") >= 1
    assert browser.run(f"return [{live}, {still}]") == [True, False]
    with browser.print_media():
        assert browser.run(f"return [{live}, {still}]") == [False, True]


def test_without_webgl_the_still_picture_stands_in_place(browser, every_page):
    script = browser.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": NO_WEBGL})
    try:
        browser.open(every_page["generate"])
        shown = browser.run("return document.querySelector('.chart:has(#space) .still').getBoundingClientRect().height")
        assert shown > 100
        assert browser.run("return document.querySelectorAll('#space canvas').length") == 0
        assert browser.run("return document.querySelectorAll('#time .main-svg').length") > 0, "others are drawn"
    finally:
        browser.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", script)


def test_without_a_script_the_still_picture_stands_in_place(browser, every_page):
    browser.open(every_page["generate"], scripts=False)
    stills = browser.driver.find_elements("css selector", ".still svg")
    assert len(stills) == 3
    assert all(svg.is_displayed() for svg in stills)


def settle(browser):
    """Wait until the page has drawn what an event asks for."""
    frames = "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done)))"
    browser.driver.execute_async_script(frames)


def test_the_words_of_a_figure_change_with_the_page_to_dark_and_back(browser, every_page):
    fill = "return getComputedStyle(document.querySelector('#time [class*=tick] text')).fill"
    line = "return getComputedStyle(document.querySelector('#time .scatterlayer .js-line')).stroke"
    seen = []
    browser.show(every_page["generate"])
    for scheme in ("light", "dark", "light"):
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
        settle(browser)
        seen.append((browser.run(fill), browser.run(line)))
    assert seen[0] == seen[2] == ("rgb(30, 41, 59)", "rgb(194, 65, 12)")
    assert seen[1] == ("rgb(226, 232, 240)", "rgb(251, 146, 60)")


def test_scenes_stand_beside_each_other_on_a_screen_and_below_each_other_on_a_phone(browser, every_page):
    tops = "return [...document.querySelectorAll('#space [id^=scene]')].map(e => e.getBoundingClientRect().top)"
    browser.show(every_page["generate"])
    one, other = browser.run(tops)
    assert one == other
    browser.show(every_page["generate"], width=400)
    one, other = browser.run(tops)
    assert abs(one - other) > 300
