"""``--figures``: every figure of a page as a file beside it, with a renderer and without."""

import json
import os
import sys
import types
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from command_line import run
from shipped import path_file

from compgen.cli.app import options_of_commands
from compgen.cli.output_files import figure_files
from compgen.report.figure import figures_of_page

KEYS = {"time", "budget", "space", "band", "heat", "joints"}
IN_SPACE = {"space", "band"}


def predict(folder, *arguments):
    return run("predict", path_file("line_y"), "-o", str(folder), "-q", *arguments)


def figure_names(folder):
    return {path.name for path in folder.iterdir() if "_" in path.name}


@pytest.fixture
def drawing(monkeypatch):
    """A renderer that draws nothing: figure and kind as its bytes."""

    def fake(figures, kind):
        return {key: f"{kind} {key} {figure['layout']['height']}".encode() for key, figure in figures.items()}

    monkeypatch.setattr(figure_files, "render", fake)


@pytest.fixture
def no_renderer(monkeypatch):
    monkeypatch.setitem(sys.modules, "kaleido", None)


@pytest.mark.parametrize("kind", ["svg", "png", "pdf"])
def test_every_figure_is_a_file_beside_the_page(tmp_path, drawing, kind):
    assert predict(tmp_path / "o", "--figures", kind).returncode == 0
    assert figure_names(tmp_path / "o") == {f"report_{key}.{kind}" for key in KEYS}
    assert (tmp_path / "o" / f"report_time.{kind}").read_bytes().startswith(f"{kind} time ".encode())
    for key in IN_SPACE:
        content = (tmp_path / "o" / f"report_{key}.{kind}").read_bytes()
        assert content.startswith(b"<svg" if kind == "svg" else kind.encode())


def test_figures_of_an_earlier_run_are_replaced_and_go(tmp_path, drawing):
    folder = tmp_path / "o"
    predict(folder, "--figures", "svg")
    (folder / "report_mine.svg").write_text("somebody's")
    predict(folder, "--figures", "png")
    assert figure_names(folder) == {f"report_{key}.png" for key in KEYS} | {"report_mine.svg"}
    predict(folder)
    assert figure_names(folder) == {"report_mine.svg"}
    assert b'name="figures"' not in (folder / "report.html").read_bytes()


def test_a_file_of_somebody_else_is_not_replaced(tmp_path, drawing):
    folder = tmp_path / "o"
    predict(folder)
    before = (folder / "report.html").read_bytes()
    (folder / "report_time.svg").write_text("somebody's")
    result = predict(folder, "--figures", "svg", "--set", "process.feed_mm_s=100")
    assert result.returncode == 2
    assert result.stderr.count("\n") == 1
    assert "report_time.svg: it is there, and no page names it" in result.stderr
    assert (folder / "report_time.svg").read_text() == "somebody's"
    assert (folder / "report.html").read_bytes() == before


def test_without_a_renderer_the_rest_is_there_and_one_line_says_so(tmp_path, no_renderer):
    result = predict(tmp_path / "o", "--figures", "svg")
    assert result.returncode == 0
    assert result.stderr == (
        "cgen: warning: --figures svg: 4 of 6 figures not written: kaleido is not installed: "
        "pip install 'compgen[figures]'\n"
    )
    assert figure_names(tmp_path / "o") == {f"report_{key}.svg" for key in IN_SPACE}
    for key in IN_SPACE:
        ElementTree.fromstring((tmp_path / "o" / f"report_{key}.svg").read_text())
    assert {"report.json", "report.html", "waypoints.csv"} <= {p.name for p in (tmp_path / "o").iterdir()}


def test_the_exit_code_stays_what_it_is(tmp_path, no_renderer):
    result = predict(tmp_path / "o", "--figures", "png", "--max-um", "1")
    assert result.returncode == 1
    assert "6 of 6 figures not written" in result.stderr


def test_a_browser_that_fails_is_said(tmp_path, monkeypatch):
    errors = types.SimpleNamespace(
        **{n: type(n, (Exception,), {}) for n in ("BrowserClosedError", "BrowserFailedError", "ChromeNotFoundError")},
        KaleidoError=type("KaleidoError", (Exception,), {}),
    )

    class Broken:
        def __init__(self, **options):
            raise errors.ChromeNotFoundError("a long story\nin lines")

    monkeypatch.setitem(sys.modules, "kaleido", types.SimpleNamespace(Kaleido=Broken, errors=errors))
    monkeypatch.setitem(sys.modules, "kaleido.errors", errors)
    result = predict(tmp_path / "o", "--figures", "png")
    assert result.returncode == 0
    assert "kaleido finds no browser: install Chromium or Chrome" in result.stderr

    def fails(self, **options):
        raise errors.BrowserFailedError("x")

    monkeypatch.setattr(Broken, "__init__", fails)
    assert "the browser failed (BrowserFailedError)" in predict(tmp_path / "o", "--figures", "png").stderr


def test_kaleido_does_not_read_the_arguments_of_a_command_with_a_log(tmp_path, monkeypatch):
    package = tmp_path / "kaleido"
    package.mkdir()
    (package / "__init__.py").write_text(
        "import argparse\nparser = argparse.ArgumentParser()\nfor name in ('human', 'level'):\n"
        "    parser.add_argument(f'--logistro-{name}')\nparser.parse_known_args()\n"
    )
    names = "BrowserFailedError", "BrowserClosedError", "ChromeNotFoundError", "KaleidoError"
    (package / "errors.py").write_text("\n".join(f"class {name}(Exception): pass" for name in names))
    for module in ("kaleido", "kaleido.errors"):
        monkeypatch.setitem(sys.modules, module, None)
        del sys.modules[module]
    monkeypatch.syspath_prepend(tmp_path)
    command = ["cgen", "follow", "outputs/part", "--log", "growing.csv", "--figures", "svg"]
    monkeypatch.setattr(sys, "argv", list(command))
    with pytest.raises(AttributeError, match="Kaleido"):  # it is read, and draws nothing
        figure_files.render({}, "svg")
    assert sys.argv == command


def test_another_kind_of_file_is_refused(tmp_path):
    assert predict(tmp_path / "o", "--figures", "jpg").returncode == 2
    assert not (tmp_path / "o").exists()


def test_a_page_names_only_figures_of_its_own(tmp_path):
    page = tmp_path / "report.html"
    page.write_bytes(b'<meta name="figures" content="report_time.svg ../x_a.svg other.svg report_a.toml report_b.png">')
    assert figure_files.earlier_figures(page) == {"report_time.svg", "report_b.png"}
    assert figure_files.earlier_figures(tmp_path / "none.html") == set()


def test_figures_are_read_back_from_their_page(tmp_path):
    predict(tmp_path / "o")
    figures = figures_of_page((tmp_path / "o" / "report.html").read_bytes())
    assert set(figures) == KEYS
    assert {key for key, figure in figures.items() if "still" in figure} == IN_SPACE
    for figure in figures.values():
        assert figure["layout"]["height"] > 100
        assert figure["alt"].endswith(".")
        assert json.dumps(figure["data"])


def test_what_differs_from_run_to_run_goes():
    one, other = (
        f'<defs id="defs-{u}"><clipPath id="clip{u}xy"/><pattern id="p{u}-legend-{p}"/></defs>'
        f'<g class="trace scatter trace{t}" fill="url(#p{u}-legend-{p})"/>'.encode()
        for u, p, t in (("8d93c2", "abcdef", "123456"), ("559b60", "012345", "fedcba"))
    )
    assert figure_files.without_chance(one, "svg") == figure_files.without_chance(other, "svg") != one
    dated = b"/CreationDate (D:20261122142123+00'00')"
    assert len(figure_files.without_chance(dated, "pdf")) == len(dated)
    assert b"20261122" not in figure_files.without_chance(dated, "pdf")


@pytest.mark.parametrize("kind", ["svg", "png", "pdf"])
def test_a_browser_draws_the_same_bytes_every_time(tmp_path, kind):
    pytest.importorskip("kaleido", reason="kaleido is not installed")
    beginnings = {"svg": b"<svg", "png": b"\x89PNG", "pdf": b"%PDF"}
    for name in ("a", "b"):
        result = predict(tmp_path / name / "o", "--figures", kind)
        if "no browser" in result.stderr:
            pytest.skip("no Chromium or Chrome here")
        assert (result.returncode, result.stderr) == (0, "")
    for key in KEYS:
        one, other = ((tmp_path / name / "o" / f"report_{key}.{kind}").read_bytes() for name in ("a", "b"))
        assert one == other
        assert one.startswith(beginnings[kind])


@pytest.mark.parametrize(
    "command", [name for name, options in options_of_commands().items() if {"--assets", "--figures"} & options]
)
def test_every_command_that_writes_a_page_takes_what_is_for_pages(command):
    assert {"--assets", "--figures", "--date"} <= options_of_commands()[command]


def test_no_browser_is_left_over(tmp_path):
    pytest.importorskip("kaleido", reason="kaleido is not installed")
    if not Path("/proc").is_dir():
        pytest.skip("no /proc to look into")
    predict(tmp_path / "o", "--figures", "svg")
    children = Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children")
    for child in children.read_text().split() if children.exists() else ():
        assert b"chrom" not in Path(f"/proc/{child}/cmdline").read_bytes()
