"""The documentation as a site: built without a warning, and it asks nothing of another host. Wants ``.[docs]``."""

import json
import os
import re
import shutil
import subprocess
import sys
import time

import pytest
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
        if page.name != "validation_text.md":
            assert (site / page.relative_to(ROOT / "docs").with_suffix(".html")).is_file()


def test_the_search_answers_from_a_file_and_the_browser_asks_no_host(site):
    webdriver = pytest.importorskip("selenium.webdriver", reason="a page in a browser wants selenium")
    if not (shutil.which("chromium") and shutil.which("chromedriver")):
        pytest.skip("no chromium and chromedriver here")
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-background-networking"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"performance": "ALL"})
    browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
    try:
        browser.get(f"file://{site}/index.html")
        browser.execute_script("document.querySelector('#__search').click()")
        browser.find_element("css selector", ".md-search__input").send_keys("ballbar")
        results, until = [], time.monotonic() + 60
        while not results and time.monotonic() < until:
            results = browser.find_elements("css selector", ".md-search-result__item")
        assert any("Identifying a robot" in result.text for result in results)
        log = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    finally:
        browser.quit()
    asked = [entry["params"]["request"]["url"] for entry in log if entry["method"] == "Network.requestWillBeSent"]
    assert asked
    assert not [url for url in asked if url.startswith(("http:", "https:"))]
