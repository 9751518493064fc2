"""Files of ours that a page names are there: a reader who looks for one that was renamed finds nothing."""

import re

import pytest
from shipped import ROOT

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *ROOT.glob("docs/**/*.md")]
NAMED = re.compile(r"`([\w/]+\.py)`")
FILES = {
    path.relative_to(ROOT).as_posix()
    for room in ("compgen", "tests", "benchmarks", "docs", "robots", "paths")
    for path in (ROOT / room).rglob("*.py")
}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_files_that_a_page_names_are_there(page):
    named = set(NAMED.findall(page.read_text()))
    assert {name for name in named if not any(f"/{file}".endswith(f"/{name}") for file in FILES)} == set()


def test_names_are_seen():
    assert sum(len(NAMED.findall(page.read_text())) for page in PAGES) > 100
