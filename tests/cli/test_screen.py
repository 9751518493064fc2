"""What a run says on the screen, on its page and in its program, read as an operator reads it."""

import json
import re

import pytest
from command_line import refused, run
from shipped import ROOT

COLD = ("m900ib700", "m20ia")  # robot files without [thermal]


def sentences(text):
    """What stands below the table."""
    return [line for line in text.splitlines() if line and line[0] not in "┏┃┡│└"]


@pytest.fixture(scope="module")
def generated(tmp_path_factory):
    """A run with labels, its screen, and the folder."""
    out = tmp_path_factory.mktemp("screen") / "out"
    labels = ("--part", "Plate <7> & Co", "--order", " A-4711/2 ", "--operator", "J. Wéber")
    done = run("generate", "paths/spiral_1300.toml", "-o", out, *labels)
    assert done.returncode == 0, done.stderr
    return done.stdout, out


def test_a_run_says_before_and_after_what_is_not_known_what_to_read_and_what_was_written(generated):
    screen, out = generated
    report = json.loads((out / "report.json").read_text())
    before, after = (report[side]["total"]["max_um"] for side in ("before", "after"))
    lines = sentences(screen)
    sentence = next(line for line in lines if line.startswith("Largest error"))
    assert f"Largest error {before:.1f} um before. After: {after:.1f} um left by calculation. " in sentence
    minutes = int(report["thermal"]["start_window_s"] // 60)
    assert sentence.endswith(f" times smaller. Start within {minutes} minutes of the planned time.")
    place = {word: n for word in ("Largest error", "Uncertainty", "warning:", "note", "wrote") for n, line in
             enumerate(lines) if line.startswith(word)}  # fmt: skip
    assert list(place) == sorted(place, key=place.__getitem__)
    unknown = [row["what"] for row in report["band"]["unknown"]]
    named = [what for what in unknown if what in lines[place["Uncertainty"]]]
    assert len(named) == 3
    assert f"{len(unknown) - 3 - sum(r['size_um'] is None for r in report['band']['unknown'])} more of up to" in screen
    assert max(map(len, lines)) < 450
    whole = run("generate", "paths/spiral_1300.toml", "-o", out.with_name("whole"), "--verbose").stdout
    assert all(what in whole for what in unknown)
    for finding in report["findings"]:
        assert f"{finding['level']} [{finding['code']}]: {finding['message']}" in whole
        assert finding["level"] == "note" or finding["message"] in screen
    folded = sum(f["message"] not in screen for f in report["findings"])
    assert folded
    assert f"{folded} note{'s' * (folded > 1)} that every job has: --verbose shows" in screen


def test_labels_stand_on_the_page_and_in_the_record_and_change_no_byte_of_the_program(generated, tmp_path):
    _, out = generated
    page, report = (out / "report.html").read_text(), json.loads((out / "report.json").read_text())
    assert report["labels"] == {"part": "Plate <7> & Co", "order": "A-4711/2", "operator": "J. Wéber"}
    head = page[page.index("<h1>") : page.index('class="big')]
    assert "part <b>Plate &lt;7&gt; &amp; Co</b> · order <b>A-4711/2</b> · operator <b>J. Wéber</b>" in head
    assert run("generate", "paths/spiral_1300.toml", "-o", tmp_path / "out", "-q").returncode == 0
    assert (tmp_path / "out/SPIRAL_1300.LS").read_bytes() == (out / "SPIRAL_1300.LS").read_bytes()
    assert "labels" not in json.loads((tmp_path / "out/report.json").read_text())


@pytest.mark.parametrize("option", ["--part", "--order", "--operator"])
@pytest.mark.parametrize("text", ["", "  ", "a\tb", "a\nb", "x" * 81, "a\u202eb", "\x1b[31m"])
def test_a_label_that_is_no_line_is_refused_before_any_work(tmp_path, option, text):
    done = run("generate", "paths/circle_1300.toml", "-o", tmp_path / "out", option, text)
    refused(done, 2, option, "1 to 80 printable letters")
    assert not (tmp_path / "out").exists()


def test_the_headline_has_the_band_in_the_letters_of_the_error_that_is_left(generated):
    _, out = generated
    page, report = (out / "report.html").read_text(), json.loads((out / "report.json").read_text())
    (big,) = re.findall(r'<div class="big inside"><p>(.*?)</p>', page, re.DOTALL)
    assert f"<b>{report['on_part']['after']['total']['max_um']:.2f} &micro;m</b> left by calculation" in big
    assert f"<b>{report['band']['p95_um']:.0f} &micro;m</b> (95 %) uncertainty of the robot data" in big
    worst = max((row for row in report["band"]["unknown"] if row["size_um"]), key=lambda row: row["size_um"][1])
    assert f"on top: {worst['what'].replace(chr(39), '&#39;')} (up to {worst['size_um'][1]:.0f} &micro;m)" in big


def test_findings_on_the_page_are_in_the_order_of_the_screen(generated):
    screen, out = generated
    listed = re.findall(r'<li class="(?:warning|note)">.*?</span>(.*?)</li>', (out / "report.html").read_text())
    first = next(line for line in sentences(screen) if line.startswith(("warning:", "note:")))
    assert listed[0].replace(" &micro;m", " um").replace("&#39;", "'") == first


@pytest.mark.parametrize("robot", COLD)
def test_a_cold_arm_is_promised_nothing_and_told_what_it_needs(tmp_path, robot):
    assert "[thermal]" not in (ROOT / f"robots/{robot}.toml").read_text()
    done = run("generate", "paths/line_y.toml", "--robot", robot, "-o", tmp_path)
    assert done.returncode == 1
    program, page = (tmp_path / "LINE_Y.LS").read_text(), (tmp_path / "report.html").read_text()
    for text in (done.stdout, program, page[: page.index("<h2>Inputs")]):
        assert "times smaller" not in text
        assert "start within" not in text.lower()
    assert "!planned, not corrected" in program
    assert done.stdout.count("Nothing was corrected: ") == 1
    assert "Nothing was corrected: " in page
    assert "it needs [thermal] with temperatures" in done.stdout
    assert "cgen identify" in done.stdout
