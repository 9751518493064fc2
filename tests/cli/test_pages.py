"""Long programs at the command line: whole sets of files, and nothing that is not ours touched."""

import json
from hashlib import sha256

import pytest
from command_line import refused, run
from long_program import move, text
from ls_text import at, program

BASE = {"compgen.json", "report.json", "report.html", "waypoints.csv", "LINE_Y.LS"}
PAGES = {"LINE_Y.pages.json", "LINE_Y_01.LS", "LINE_Y_02.LS", "LINE_Y_03.LS"}
ARM = ("--robot", "m710ic50")
SMALL = ("--set", "robot.controller.max_lines=60", "--set", "process.page_stops=anywhere")


def names(folder):
    return {p.name for p in folder.iterdir()}


def test_generate_writes_pages_and_the_next_run_takes_them_away(tmp_path):
    out = tmp_path / "out"
    result = run("generate", "paths/line_y.toml", *SMALL, "-o", out)
    assert result.returncode == 0, result.stderr
    assert names(out) == BASE | PAGES
    manifest = json.loads((out / "LINE_Y.pages.json").read_bytes())
    for entry in [manifest["main"], *manifest["pages"]]:
        assert sha256((out / entry["file"]).read_bytes()).hexdigest() == entry["sha256"]
    report = json.loads((out / "report.json").read_text())["program"]
    assert report["file"] == "LINE_Y.LS"
    assert [p["file"] for p in report["pages"]] == [p["file"] for p in manifest["pages"]]
    assert report["bytes"] == sum((out / e["file"]).stat().st_size for e in [manifest["main"], *manifest["pages"]])
    assert "written as 3 pages" in " ".join(result.stdout.split())
    # what a user changed or put there is not ours any more
    (out / "LINE_Y_02.LS").write_text("mine")
    (out / "LINE_Y_04.LS").write_text("mine as well")
    assert run("generate", "paths/line_y.toml", "-q", "-o", out).returncode == 0
    assert names(out) == BASE | {"LINE_Y_02.LS", "LINE_Y_04.LS"}
    assert (out / "LINE_Y_04.LS").read_text() == "mine as well"


def test_the_same_inputs_give_the_same_pages(tmp_path):
    for name in "ab":
        assert run("generate", "paths/line_y.toml", *SMALL, "-q", "-o", tmp_path / name).returncode == 0
    for file in sorted(names(tmp_path / "a") - {"report.html"}):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes(), file


def test_outside_its_bounds_no_page_is_written(tmp_path):
    result = run("generate", "paths/line_y.toml", *SMALL, "--set", "bounds.max_um=0.01", "-q", "-o", tmp_path)
    assert result.returncode == 1
    assert names(tmp_path) == BASE - {"LINE_Y.LS"}


def test_without_pages_it_is_one_file_that_cannot_be_loaded(tmp_path):
    result = run("generate", "paths/line_y.toml", *SMALL, "--no-pages", "-o", tmp_path)
    assert result.returncode == 1
    assert result.stderr.startswith("cgen: not loadable: ")
    assert names(tmp_path) == BASE - {"LINE_Y.LS"}
    assert "--no-pages" in result.stdout
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["verdict"] == "not loadable"
    assert "cannot be loaded" in next(f["message"] for f in report["findings"] if f["code"] == "controller.size")
    assert run("generate", "paths/line_y.toml", *SMALL, "--no-pages", "--force", "-o", tmp_path).returncode == 1
    assert names(tmp_path) == BASE


def test_without_bounds_nothing_is_inside_them(tmp_path):
    result = run("check", "paths/line_y.toml", "--json", "--set", "bounds={}")
    assert result.returncode == 1
    assert json.loads(result.stdout)["verdict"] == "no bounds"
    result = run("generate", "paths/line_y.toml", "-q", "--set", "bounds={}", "-o", tmp_path)
    assert (result.returncode, result.stderr.count("\n")) == (1, 1)
    assert "no bounds" in result.stderr
    assert "bounds.max_um" in result.stderr
    assert "inside its bounds" not in (tmp_path / "report.html").read_text()


def test_pages_of_a_program_that_exists(tmp_path):
    body = ["  UFRAME_NUM=1 ", *[move(n % 9 + 1) for n in range(60)]]
    (tmp_path / "LONG.LS").write_bytes(text(body))
    few = ("--set", "controller.max_lines=20")
    result = run("pages", tmp_path / "LONG.LS", *ARM, *few, "-o", tmp_path / "out")
    assert result.returncode == 0, result.stderr
    manifest = json.loads((tmp_path / "out" / "LONG.pages.json").read_bytes())
    assert names(tmp_path / "out") == {
        "compgen.json",
        "LONG.pages.json",
        "LONG.LS",
        *(p["file"] for p in manifest["pages"]),
    }
    assert manifest["planned_sha256"] == sha256((tmp_path / "LONG.LS").read_bytes()).hexdigest()
    assert "61 lines, 9 positions" in result.stdout
    # fewer pages the next time: the old ones go
    assert (
        run("pages", tmp_path / "LONG.LS", *ARM, "--set", "controller.max_lines=40", "-o", tmp_path / "out").returncode
        == 0
    )
    again = json.loads((tmp_path / "out" / "LONG.pages.json").read_bytes())
    assert len(again["pages"]) < len(manifest["pages"])
    assert names(tmp_path / "out") == {
        "compgen.json",
        "LONG.pages.json",
        "LONG.LS",
        *(p["file"] for p in again["pages"]),
    }
    refused(run("pages", tmp_path / "LONG.LS", *ARM, *few, "-o", tmp_path), 2, "would replace it", "-o")
    fits = run("pages", tmp_path / "LONG.LS", *ARM, "-o", tmp_path / "none")
    assert fits.returncode == 0
    assert "one file" in fits.stdout
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize(
    ("content", "code", "words"),
    [
        (text([move(n % 9 + 1, False) for n in range(60)]), 3, ("line 9 to line 28", "FINE")),
        (text(["  R[1]=AR[1] ", *[move(n % 9 + 1) for n in range(60)]]), 3, ("line 9", "AR[]")),
        (text([move(1)] * 60)[:-40], 2, ("cut off",)),
        (b"\x00\x01", 2, ("LONG.LS", "binary")),
        (text(["  PALLETIZING-B_1 ", *[move(n % 9 + 1) for n in range(60)]]), 3, ("line 9", "palletizing", "pattern")),
        (text(["J PAL_1[BTM] 30% FINE ", *[move(n % 9 + 1) for n in range(60)]]), 3, ("line 9", "palletizing")),
    ],
)
def test_what_cannot_be_split_is_one_line(tmp_path, content, code, words):
    (tmp_path / "LONG.LS").write_bytes(content)
    few = ("--set", "controller.max_lines=20")
    refused(run("pages", tmp_path / "LONG.LS", *ARM, *few, "-o", tmp_path / "out"), code, *words)
    assert not (tmp_path / "out").exists()


def test_limits_no_page_can_keep_are_refused(tmp_path):
    (tmp_path / "LONG.LS").write_bytes(text([move(n % 9 + 1) for n in range(60)]))
    for few in ("max_lines=1", "max_positions=1", "memory_kB=0.1"):
        result = run("pages", tmp_path / "LONG.LS", *ARM, "--set", f"controller.{few}", "-o", tmp_path / "out")
        refused(result, 3, "alone is more than a page holds", "controller.max_lines")
    small = run(
        "generate", "paths/line_y.toml", *SMALL, "--set", "robot.controller.memory_kB=0.1", "-o", tmp_path / "o"
    )
    assert small.returncode == 1
    assert small.stderr.startswith("cgen: not loadable: ")
    assert "no room for a page" in " ".join(small.stdout.split())
    refused(run("pages", tmp_path / "NONE.LS"), 2, "cannot be read")
    refused(run("generate", "paths/line_y.toml", "--set", "process.page_stops=never"), 2, "page_stops")


def test_pages_wants_a_robot_unless_the_program_names_one(tmp_path):
    body = [move(n % 9 + 1) for n in range(60)]
    few = ("--set", "controller.max_lines=20")
    (tmp_path / "LONG.LS").write_bytes(text(body))
    refused(run("pages", tmp_path / "LONG.LS", *few, "-o", tmp_path / "out"), 2, "which robot", "--robot")
    assert not (tmp_path / "out").exists()
    (tmp_path / "LONG.LS").write_bytes(text(["  !for M-710iC/50 ", *body]))
    assert run("pages", tmp_path / "LONG.LS", *few, "-o", tmp_path / "out").returncode == 0


def test_every_page_of_a_marked_program_is_marked(tmp_path):
    """A page may be corrected again as little as the whole: its first places are not those that carry the mark."""
    moves = ["J P[1] 20% FINE", *(f"L P[{n}] 100mm/sec FINE" for n in range(2, 61))]
    points = [at(n, (n / 2, 20 + n / 10, -15, 30, -60, 45)) for n in range(1, 61)]
    (tmp_path / "LONG.LS").write_bytes(program(moves, points, name="LONG"))
    warm = ("--before", "moving 200mm/s 6h", "--max-um", "5")
    corrected = run("correct", tmp_path / "LONG.LS", *ARM, *warm, "-o", tmp_path / "c")
    assert corrected.returncode == 0, corrected.stderr
    few = ("--set", "controller.max_lines=25")
    whole = tmp_path / "w" / "LONG.LS"
    whole.parent.mkdir()
    whole.write_bytes((tmp_path / "c" / "LONG.LS").read_bytes())  # without its provenance file
    assert run("pages", whole, *ARM, *few, "-o", tmp_path / "pages").returncode == 0
    pages = sorted((tmp_path / "pages").glob("LONG_*.LS"))
    assert len(pages) >= 3
    for page in pages:
        assert json.loads(run("inspect", page, *ARM, "--json").stdout)["mark"] != "none"
        refused(run("correct", page, *ARM, "-o", tmp_path / "again"), 2, "carries compgen's mark")
    assert run("pages", tmp_path / "LONG.LS", *ARM, *few, "-o", tmp_path / "plain").returncode == 0
    for page in (tmp_path / "plain").glob("LONG_*.LS"):
        assert json.loads(run("inspect", page, *ARM, "--json").stdout)["mark"] == "none"
