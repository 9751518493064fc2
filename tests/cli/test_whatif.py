"""What a study writes, and that no other study takes it away."""

import csv
import io
import json
import re
import sys
from types import SimpleNamespace

import pytest
from command_line import refused, run
from shipped import ROOT

from compgen.cli.output_files.study_files import QUESTIONS
from compgen.pipelines.study import ASKS

GRID = ("--vary", "before.0.duration_h=1,2", "--workers", "1")


def whatif(folder, *arguments):
    """A study without sliders: they are looked at in test_live.py."""
    return run("whatif", ROOT / "paths" / "line_y.toml", "--no-live", *arguments, cwd=folder)


def content(folder):
    return {p.name: p.read_bytes() for p in folder.iterdir()}


def test_the_help_lists_the_questions_that_are_answered():
    assert QUESTIONS == (*ASKS, "passes")


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """A folder in which a study has left its results."""
    folder = tmp_path_factory.mktemp("study")
    assert whatif(folder, *GRID, "-q").returncode == 0
    return folder


def test_inputs_are_what_the_scenarios_share(tmp_path):
    """The file's own values of varied keys stood there, which no scenario had."""
    keys = {"duty": "0.3", "feed": "30,60", "model": "nodes,network", "tool": "{x_mm = 1.0}"}
    varied = [word for key, values in keys.items() for word in ("--vary", f"{key}={values}")]
    done = whatif(tmp_path, *varied, "--workers", "1", "--json")
    assert done.returncode == 0, done.stderr
    inputs = json.loads(done.stdout)["inputs"]
    before, process, thermal = inputs["path"]["before"][0], inputs["path"]["process"], inputs["robot"]["thermal"]
    for table, gone, kept in (
        (before, "duty", "feed_mm_s"),
        (process, "feed_mm_s", "chord_um"),
        (thermal, "model", "cte_um_m_K"),
        (inputs["path"], "tool", "robot"),
    ):
        assert gone not in table
        assert kept in table


def test_another_study_goes_beside(home):
    first = home / "outputs" / "line_y_whatif"
    before = content(first)
    other = whatif(home, "--vary", "before.0.duration_h=3", "--workers", "1")
    assert other.returncode == 0, other.stderr
    assert "line_y_whatif_2" in other.stdout
    asked = whatif(home, "--ask", "contributions")
    assert asked.returncode == 0
    assert "line_y_whatif_3" in asked.stdout
    again = whatif(home, "--vary", "before.0.duration_h=3", "--workers", "1")
    assert "line_y_whatif_2" in again.stdout
    assert content(first) == before
    assert sorted(p.name for p in (home / "outputs").iterdir()) == [
        "line_y_whatif", "line_y_whatif_2", "line_y_whatif_3"
    ]  # fmt: skip


def test_a_chosen_folder_with_another_study_is_refused(home, tmp_path):
    first = home / "outputs" / "line_y_whatif"
    before = content(first)
    for other in (("--vary", "before.0.duration_h=5"), ("--ask", "contributions")):
        refused(whatif(home, *other, "-q", "-o", first), 2, "another study", "-o", "--fresh")
        assert content(first) == before


def test_the_same_study_is_taken_up_again_with_its_answers(home):
    first = home / "outputs" / "line_y_whatif"
    before = content(first)
    assert whatif(home, *GRID, "--ask", "contributions", "-q", "-o", first).returncode == 0
    assert whatif(home, *GRID, "-q", "-o", first).returncode == 0
    after = content(first)
    assert set(after) == {*before, "contributions.csv"}
    assert after["scenarios.jsonl"] == before["scenarios.jsonl"]


def test_fresh_replaces_another_study(tmp_path):
    for grid in (("--vary", "before.0.duration_h=1", "--ask", "contributions"), GRID):
        assert whatif(tmp_path, *grid, "--fresh", "-q", "-o", tmp_path / "o").returncode == 0
    assert set(content(tmp_path / "o")) == {
        "compgen.json",
        "scenarios.jsonl",
        "whatif.csv",
        "whatif.json",
        "whatif.html",
    }
    assert len(json.loads((tmp_path / "o" / "whatif.json").read_text())["scenarios"]) == 2


def test_no_cell_is_a_formula(tmp_path):
    values = """title="=cmd|' /C calc'!A0","plain\""""
    result = whatif(tmp_path, "--vary", values, "--workers", "1", "-q", "-o", tmp_path)
    assert result.returncode == 0, result.stderr
    rows = list(csv.DictReader(io.StringIO((tmp_path / "whatif.csv").read_text())))
    assert [row["title"] for row in rows] == ["'=cmd|' /C calc'!A0", "plain"]


def test_a_cluster_says_what_it_trusts_and_takes_dasks_certificates(tmp_path, monkeypatch):
    assert "pickles" in run("whatif", "--help").stdout
    given = {}

    def connect(address, **how):
        given.update(how)
        raise TypeError("TLS expects a `ssl_context` argument of type ssl.SSLContext")

    dask = SimpleNamespace(Client=connect, Security=lambda: "of Dask's settings", as_completed=iter)
    monkeypatch.setitem(sys.modules, "distributed", dask)
    result = whatif(tmp_path, "--vary", "feed=100,200", "-q", "-o", "o", "--cluster", "tls://127.0.0.1:9")
    refused(result, 2, "certificates", "distributed.comm.tls")
    assert given["security"] == "of Dask's settings"
    assert given["timeout"] == 10  # s
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("values", ["20:200", "20:", "20:200:2.5", "20:200:10:3", "20:200:-1", "1e1:2e2"])
def test_a_range_without_a_count_is_refused_before_anything_is_touched(home, values):
    before = content(home / "outputs" / "line_y_whatif")
    refused(whatif(home, "--vary", f"feed={values}", "-q"), 2, "--vary", values, "FROM:TO:COUNT", "20:200:10")
    assert content(home / "outputs" / "line_y_whatif") == before


def test_a_list_that_names_a_key_twice_is_refused(tmp_path):
    (tmp_path / "l.csv").write_text("feed,process.feed_mm_s\n20,40\n")
    refused(whatif(tmp_path, "--list", "l.csv", "-q"), 2, "l.csv", "process.feed_mm_s stands twice")
    assert [p.name for p in tmp_path.iterdir()] == ["l.csv"]


def test_values_that_look_like_another_unit_are_asked_about(tmp_path):
    done = whatif(tmp_path, "--vary", "cte=11,1.2e-5", "--set", "robot.thermal.cte_um_m_K=1.1e-5", "--workers", "1")
    assert done.returncode == 0, done.stderr
    asked = re.findall(r"thermal.cte_um_m_K = (\S+): did you mean (\d+)\?", done.stdout)
    assert asked == [("1.1e-05", "11"), ("1.2e-05", "12")]


def test_a_stretch_that_the_file_does_not_have_is_refused_before_any_scenario(tmp_path):
    """As warmup_h on a path whose warmth is from a log."""
    rows = "\n".join(f"{60 * k},20,{20 + k / 10}" for k in range(60))
    (tmp_path / "log.csv").write_text(f"time_s,ambient_degC,j2_degC\n{rows}\n")
    text = (ROOT / "paths/line_y.toml").read_text()
    (tmp_path / "p.toml").write_text(re.sub(r"\[\[before\]\][^\[]*", '[log]\nfile = "log.csv"\n\n', text))
    result = run("whatif", "p.toml", "--vary", "warmup_h=0:6:3", "--no-live", "-o", "out", cwd=tmp_path)
    refused(
        result, 2, "--vary warmup_h, before.0.duration_h: p.toml: before.0.state: missing", "no such [[before]] to vary"
    )
    assert "{" not in result.stderr
    assert not (tmp_path / "out").exists()
    (tmp_path / "unbound.toml").write_text(re.sub(r"\[bounds\][^\[]*", "", (ROOT / "paths/line_y.toml").read_text()))
    alone = ("--workers", "1", "--no-live")  # a worker takes longer to start than all of this
    result = run("whatif", "unbound.toml", "--vary", "warmup_h=0:6:3", *alone, "-o", "other", cwd=tmp_path)
    refused(result, 1, "every scenario failed: unbound.toml: bounds: missing")
    both = ("--vary", "before.0.state=idle,off", "--vary", "warmup_h=1", *alone, "-q", "-o", "out")
    assert run("whatif", "p.toml", *both, cwd=tmp_path).returncode == 0
