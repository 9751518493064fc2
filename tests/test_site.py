"""The documentation as a site: built without a warning, and it asks nothing of another host. Wants ``.[docs]``."""

import os
import re
import subprocess
import sys

import pytest
from browser import chromium
from shipped import ROOT

pytest.importorskip("mkdocs", reason="the site wants: pip install -e '.[docs]'")
pytest.importorskip("material", reason="the site wants: pip install -e '.[docs]'")
pytest.importorskip("mkdocstrings", reason="the site wants: pip install -e '.[docs]'")

#: what a browser fetches by itself; links that a reader follows are no requests
FETCHED = re.compile(r"<(?:script|img|iframe|source|link)\b[^>]*\b(?:src|href)=[\"']?((?:https?:)?//[^\"'\s>]+)")
FETCHED_BY_STYLE = re.compile(r"(?:url\(|@import )[\"']?((?:https?:)?//[^\"')]+)")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    place = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(place)],
        cwd=ROOT, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return place


def test_no_page_fetches_anything_from_another_host(site):
    pages = {file: file.read_text() for file in site.rglob("*.html")}
    styles = {file: file.read_text() for file in site.rglob("*.css")}
    assert len(pages) > 30
    assert styles
    assert not {(file.name, url) for file, text in pages.items() for url in FETCHED.findall(text)}
    assert not {(file.name, url) for file, text in styles.items() for url in FETCHED_BY_STYLE.findall(text)}
    assert FETCHED.findall('<script defer src="https://unpkg.com/x">')


def test_every_page_of_docs_is_in_the_site(site):
    for page in ROOT.glob("docs/*.md"):
        assert (site / page.relative_to(ROOT / "docs").with_suffix(".html")).is_file()


def test_the_search_answers_from_a_file_and_pages_fit_a_phone_without_asking_any_host(site):
    with chromium(logs_requests=True) as browser:
        from selenium.webdriver.support.expected_conditions import element_to_be_clickable
        from selenium.webdriver.support.ui import WebDriverWait

        for page in ("overview.html", "keys.html", "api.html", "commands.html", "gallery.html", "index.html"):
            browser.open(site / page, width=400, dark=True)
            assert browser.run("return document.documentElement.scrollWidth") <= 400
        browser.open(site / "tutorials" / "my_raster.html", width=400)
        wraps = "return [...document.querySelectorAll('.language-sh code')].every(c => c.scrollWidth <= c.clientWidth)"
        assert browser.run(wraps)  # commands are whole
        assert browser.run("return document.querySelector('article p > img').clientWidth") >= 600  # words are read
        assert browser.run("return document.documentElement.scrollWidth") <= 400
        browser.run("document.querySelector('#__search').click()")
        waiting = WebDriverWait(browser.driver, 300)
        waiting.until(element_to_be_clickable(("css selector", ".md-search__input"))).send_keys("ballbar")
        results = "return document.querySelector('.md-search-result__list').textContent"
        waiting.until(lambda _: "Identifying a robot" in browser.run(results))
        urls = browser.requested()
    assert any("search_index" in url for url in urls)
    assert not [url for url in urls if url.startswith(("http:", "https:"))]
