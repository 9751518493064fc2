"""The notebooks, run from top to bottom in an empty folder: what their cells print is what they show."""

import sys

import pytest
from shipped import ROOT

sys.path.insert(0, str(ROOT / "docs"))
nbformat = pytest.importorskip("nbformat", reason="notebooks are run with the extra 'docs': nbclient and ipykernel")
pytest.importorskip("nbclient", reason="notebooks are run with the extra 'docs': nbclient and ipykernel")
pytest.importorskip("ipykernel", reason="notebooks are run with the extra 'docs': nbclient and ipykernel")
import notebooks  # noqa: E402
import tutorials  # noqa: E402

PAGES = notebooks.pages()
ANEW = "lay it anew: PYTHONPATH=. python docs/notebooks.py"


@pytest.mark.filterwarnings("default")  # of the libraries that run notebooks
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_notebook_shows_what_its_cells_print(page, tmp_path):
    shown = nbformat.read(page, as_version=4)
    now = notebooks.executed(page, tmp_path)
    assert [cell.source for cell in shown.cells] == [cell.source for cell in now.cells]
    for words, came in zip(notebooks.words_of(shown), notebooks.words_of(now), strict=True):
        assert not tutorials.differences(words, came), f"{page.name}: {ANEW}\n{came}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_notebook_holds_words_alone_and_its_page_is_made_from_it(page):
    shown = nbformat.read(page, as_version=4)
    assert page.stat().st_size < 20_000
    assert all(output.output_type == "stream" for cell in shown.cells for output in cell.get("outputs", []))
    assert sum(notebooks.NO_FIGURE in words for words in notebooks.words_of(shown)) >= 2
    assert page.with_suffix(".md").read_text() == notebooks.site_page(shown, page.stem)
