"""The date on a page, and one script for many pages: whole, shared by runs at one moment, never over another file."""

import re
from concurrent.futures import ThreadPoolExecutor

import pytest
from command_line import refused, run
from shipped import path_file

from compgen.cli.options import page_options as options
from compgen.cli.options.page_options import Assets, PageChoice, page_date, share_script
from compgen.core.files import read_regular
from compgen.report.figure import library, library_name

LINE = path_file("line_y")
FOREIGN = b"// not plotly"


def predict(folder, name, *more):
    return run("predict", LINE, "-q", "-o", f"outputs/{name}", *more, cwd=folder)


def sources(page):
    """Where a page looks for its scripts."""
    return re.findall(rb'<script src="([^"]+)"', page.read_bytes())


def test_many_pages_share_one_script_that_lies_above_their_folders(tmp_path):
    for name in ("a", "b"):
        assert predict(tmp_path, name, "--assets", "shared").returncode == 0
    pages = [tmp_path / "outputs" / name / "report.html" for name in ("a", "b")]
    for page in pages:
        (source,) = sources(page)
        script = page.parent / source.decode()
        assert script.resolve() == (tmp_path / "outputs" / library_name()).resolve()
        assert script.read_bytes() == library()
        assert page.stat().st_size < 2_000_000 < script.stat().st_size
    assert pages[0].read_bytes() == pages[1].read_bytes()
    assert {file.name for file in (tmp_path / "outputs").iterdir()} == {"a", "b", library_name()}


def test_a_page_holds_its_script_unless_it_shall_be_shared(tmp_path):
    assert predict(tmp_path, "a").returncode == 0
    page = tmp_path / "outputs" / "a" / "report.html"
    assert not sources(page)
    assert library() in page.read_bytes()
    assert [file.name for file in (tmp_path / "outputs").iterdir()] == ["a"]


def test_a_file_of_others_is_not_replaced_and_nothing_is_written(tmp_path):
    foreign = tmp_path / "outputs" / library_name()
    foreign.parent.mkdir()
    foreign.write_bytes(FOREIGN)
    refused(predict(tmp_path, "a", "--assets", "shared"), 2, library_name(), "--assets inline")
    assert foreign.read_bytes() == FOREIGN
    assert [file.name for file in foreign.parent.iterdir()] == [library_name()]


def test_a_folder_in_the_script_s_place_is_refused(tmp_path):
    (tmp_path / "outputs" / library_name()).mkdir(parents=True)
    refused(predict(tmp_path, "a", "--assets", "shared"), 2, library_name(), "--assets inline")


def test_runs_at_the_same_moment_leave_one_whole_script(tmp_path):
    of_page = options.page_place(tmp_path / "a", PageChoice(assets=Assets.SHARED)).options
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda n: share_script(tmp_path / f"run{n}", of_page), range(8)))
    assert [file.name for file in tmp_path.iterdir()] == [library_name()]
    assert (tmp_path / library_name()).read_bytes() == library()


def test_a_script_that_comes_while_it_is_looked_for_is_the_script(tmp_path, monkeypatch):
    """Another run's script appears after this one has tried to read it and before it looks whether it is there."""
    of_page = options.page_place(tmp_path / "a", PageChoice(assets=Assets.SHARED)).options
    script = tmp_path / library_name()

    def late(path):
        try:
            return read_regular(path)
        finally:
            script.write_bytes(library())

    monkeypatch.setattr(options, "read_regular", late)
    share_script(tmp_path / "a", of_page)
    assert [file.name for file in tmp_path.iterdir()] == [library_name()]


def test_a_date_stands_on_the_page_and_in_the_header(tmp_path):
    result = run("generate", LINE, "-q", "--date", "26-11-22", "-o", "a", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert b"<dt>date</dt><dd>2026-11-22</dd>" in (tmp_path / "a" / "report.html").read_bytes()
    assert b"DATE 26-11-22" in (tmp_path / "a" / "LINE_Y.LS").read_bytes()


def test_without_a_date_the_header_has_its_own_and_the_page_none(tmp_path):
    assert run("generate", LINE, "-q", "-o", "a", cwd=tmp_path).returncode == 0
    assert b"<dt>date</dt>" not in (tmp_path / "a" / "report.html").read_bytes()
    assert b"DATE 26-01-01" in (tmp_path / "a" / "LINE_Y.LS").read_bytes()


@pytest.mark.parametrize("date", ["2026-11-22", "26-11-22", "2026-11-22T14:05", "20261122"])
def test_a_date_reads_the_same_however_it_is_written(date):
    assert page_date(date) == "2026-11-22"


@pytest.mark.parametrize("date", ["", "today", "2026-02-30", "26-13-01", "22.11.2026", "2026"])
def test_what_is_no_date_is_refused_before_any_work(tmp_path, date):
    refused(predict(tmp_path, "a", "--date", date), 2, "--date", "2026-01-31")
    assert not (tmp_path / "outputs").exists()


def test_another_word_for_assets_is_refused(tmp_path):
    result = predict(tmp_path, "a", "--assets", "cdn")
    assert result.returncode == 2
    assert "inline" in result.stderr
    assert "shared" in result.stderr
