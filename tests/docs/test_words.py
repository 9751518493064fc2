"""How much there is to read: the words of README and docs/, as ``wc -w`` counts them."""

from shipped import ROOT

#: pages that are tables made of the code's own words: a new key, command or finding is no reason to write less
TABLES = {"keys.md", "commands.md", "findings.md"}
AT_MOST = 55_000
PAGES = [ROOT / "README.md", *(page for page in ROOT.glob("docs/**/*.md") if page.name not in TABLES)]


def test_the_pages_are_no_more_than_a_reader_can_take():
    """A page that needs more words takes them from another: what is told twice, history, rows that nothing rests on."""
    words = {page.relative_to(ROOT).as_posix(): len(page.read_text().split()) for page in PAGES}
    longest = sorted(words.items(), key=lambda item: -item[1])[:8]
    assert sum(words.values()) <= AT_MOST, f"{sum(words.values())} words; the longest pages: {longest}"


def test_pages_are_seen():
    assert len(PAGES) > 35
    assert all((ROOT / "docs" / name).is_file() for name in TABLES)
