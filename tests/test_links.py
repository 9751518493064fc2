"""Links of README, docs/ and the other pages lead somewhere: to files and to headings that are there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = sorted(
    page.relative_to(ROOT).as_posix()
    for pages in ("*.md", "docs/**/*.md", "benchmarks/*.md", "outputs/README.md")
    for page in ROOT.glob(pages)
)
LINK = re.compile(r"!?\[(?:[^\[\]]|\[[^\]]*\])*\]\(<?([^)\s>]+)>?\)")
HEADING = re.compile(r"^#{1,6} +(.+?)(?: +#+)?$", re.MULTILINE)
FENCE = re.compile(r"^( *)(```+|~~~+).*?^\1\2", re.MULTILINE | re.DOTALL)


def text_of(page):
    return FENCE.sub("", (ROOT / page).read_text())


def anchors(page):
    """The anchors of a page's headings, as git hosts and the site make them, but of those that stand twice."""
    names = []
    for heading in HEADING.findall(text_of(page)):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        names.append(re.sub(r"[^\w\- ]", "", words.lower()).strip().replace(" ", "-"))
    return {name for name in names if names.count(name) == 1}


def links(page):
    return LINK.findall(re.sub(r"`[^`\n]*`", "", text_of(page)))


@pytest.mark.parametrize("page", PAGES)
def test_every_link_leads_to_a_file_and_a_heading_that_are_there(page):
    broken = []
    for link in links(page):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = ((ROOT / page).parent / path).resolve() if path else ROOT / page
        inside = target.is_relative_to(ROOT) and target.exists()
        if not inside or (anchor and anchor not in anchors(target.relative_to(ROOT))):
            broken.append(link)
    assert not broken


def test_links_are_seen():
    seen = {link for page in PAGES for link in links(page)}
    assert len(seen) > 100
    assert any("#" in link for link in seen)
