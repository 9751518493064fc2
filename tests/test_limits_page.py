"""The figures of docs/limits.md are those of the pages that it leads to."""

import re
import tomllib
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
BLOCK = re.compile(r"^(?:- |\| )(?:.+(?:\n  .+)*)", re.MULTILINE)
FIGURE = re.compile(r"(?<![\w.#])-?(\d[\d,]*(?:\.\d+)?(?:e-\d+)?)(?= (?:um|K|%|h|mm|deg|MB|GB|m)\b| %| times| poses)")
LINK = re.compile(r"\]\(([^)#\s]+)")
WORDS = DOCS.joinpath("limits.md").read_text()
BLOCKS = BLOCK.findall(WORDS)


def figures(block):
    return {match.replace(",", "") for match in FIGURE.findall(block.replace("\n", " "))}


@pytest.mark.parametrize("block", [block for block in BLOCKS if figures(block) and LINK.search(block)])
def test_a_figure_stands_on_a_page_that_its_line_leads_to(block):
    pages = " ".join((DOCS / link).read_text() for link in LINK.findall(block)).replace(",", "")
    numbers = set(re.findall(r"\d+(?:\.\d+)?(?:e-\d+)?", pages))
    assert figures(block) <= numbers


def test_no_figure_stands_without_a_page():
    assert not [block for block in BLOCKS if figures(block) and not LINK.search(block) and "2.4 um" not in block]
    assert len([block for block in BLOCKS if figures(block)]) > 25


def test_the_box_is_that_of_the_robot_file():
    box = tomllib.loads((DOCS.parent / "robots" / "m710ic50.toml").read_text())["thermal"]["box"]
    low, high = box["feed_mm_s"]
    assert f"feeds of {low} to {high} mm/s, {box['hours']} h, rises of {box['rise_K']} K" in WORDS
