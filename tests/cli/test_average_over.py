"""One file for many starts, as a user asks for it."""

import json

from command_line import refused, run
from ls_text import at, program

STARTS = "compensation.average_over={delay_s=[0, 1200], override_percent=[50, 100]}"
HOME = (10.0, 20.0, -15.0, 30.0, -60.0, 45.0)
ROOMY = ("--set", "bounds.max_um=3")
PROGRAM = program(["L P[1] 400mm/sec FINE"], [at(1, HOME)])


def test_generate_shows_each_flown_start_and_writes_the_interval(tmp_path):
    result = run("generate", "paths/line_y.toml", "-o", tmp_path / "out", "--verbose", "--set", STARTS, *ROOMY)
    assert result.returncode == 0, result.stderr
    for words in ("one file for many starts", "mean of the rises", "run 1, 1200 s late, 50 %", "made anew"):
        assert words in result.stdout
    assert "rise [K] mean over the starts" in result.stdout
    assert b"start within 1200 s of that" in (tmp_path / "out" / "LINE_Y.LS").read_bytes()
    record = json.loads((tmp_path / "out" / "report.json").read_text())["average_over"]
    assert len(record["flown"]) >= 5


def test_check_is_outside_where_one_flown_start_is(tmp_path):
    inside = run("check", "paths/line_y.toml", "--set", STARTS, "--json", *ROOMY)
    assert inside.returncode == 0
    largest = json.loads(inside.stdout)["average_over"]["max_um"]
    assert json.loads(inside.stdout)["average_over"]["at_mean"]["max_um"] < largest - 0.2
    broken = run("check", "paths/line_y.toml", "--set", STARTS, "--set", f"bounds.max_um={largest - 0.1}", "--quiet")
    refused(broken, 1, "outside bounds", f"{largest:.3f} um after correction")


def test_what_is_no_interval_ends_with_2_and_one_line():
    for table, words in (
        ("{delay_s=[1200, 0]}", "must rise"),
        ("{runs=[1, 40]}", "there is no run 40"),
        ("{delay_s=[0, 1e7]}", "57600"),
    ):
        refused(run("generate", "paths/line_y.toml", "--set", f"compensation.average_over={table}"), 2, words)


def test_correct_takes_starts_as_an_option(tmp_path):
    (tmp_path / "T.LS").write_bytes(PROGRAM)
    options = ("T.LS", "--robot", "m710ic50", "--before", "moving 200mm/s 6h", "--max-um", "50")
    result = run("correct", *options, "--average-over", "delay_s=[0, 7200]", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "one file for starts 0 to 7200 s late" in " ".join(result.stdout.split())
    report = json.loads((tmp_path / "outputs" / "T" / "report.json").read_text())
    assert report["average_over"]["delay_s"] == [0, 7200]
    for words, why in (("delay_s=[9, 1]", "must rise"), ("runs=[1, 2]", "no [[cycle]]"), ("soon", "not understood")):
        refused(run("correct", *options, "--average-over", words, cwd=tmp_path), 2, "--average-over", why)


def test_of_a_program_in_which_nothing_is_corrected_nothing_is_said_over_starts(tmp_path):
    """*At most 0.00 um over the starts* was said of it, and stood in its report."""
    (tmp_path / "T.LS").write_bytes(program(["L P[1] 400mm/sec FINE Offset,PR[1]"], [at(1, HOME)]))
    options = ("T.LS", "--robot", "m710ic50", "--before", "moving 200mm/s 6h", "--max-um", "50", "--force", "--verbose")
    result = run("correct", *options, "--average-over", "delay_s=[0, 7200]", cwd=tmp_path)
    refused(result, 1, "nothing corrected")
    assert "one file for" not in " ".join(result.stdout.split())
    assert "average_over" not in json.loads((tmp_path / "outputs" / "T" / "report.json").read_text())


def test_correct_takes_bounds_with_a_probability_as_an_option(tmp_path):
    (tmp_path / "T.LS").write_bytes(PROGRAM)
    options = ("T.LS", "--robot", "m710ic50", "--before", "moving 200mm/s 6h", "--guaranteed")
    kept = run("correct", *options, "max_um=900, share=0.8, confidence=0.8", cwd=tmp_path)
    assert kept.returncode == 0, kept.stderr
    assert "guaranteed: 80 % of arms and days stay within max_um" in " ".join(kept.stdout.split())
    first = (tmp_path / "outputs" / "T" / "report.json").read_bytes()
    assert run("correct", *options, "max_um=900, share=0.8, confidence=0.8", cwd=tmp_path).returncode == 0
    assert (tmp_path / "outputs" / "T" / "report.json").read_bytes() == first
    broken = run("correct", *options, "max_um=0.5, share=0.8, confidence=0.8", cwd=tmp_path)
    refused(broken, 1, "80 % of arms and days", "bounds.guaranteed.max_um = 0.5", "T.LS not written")
    refused(run("correct", *options, "max_um=60, draws=9", cwd=tmp_path), 2, "--guaranteed.draws: 9", "needs 59")
