"""Two outputs side by side: what changed is shown, nothing else is, and what cannot be compared is refused."""

import json
import re
import shutil

import numpy as np
import pytest
from command_line import refused, run
from corrected import HOME
from ls_text import at, joint_form, program
from shipped import ROOT

LINE = str(ROOT / "paths" / "line_y.toml")
ZEROS = ("--set", "robot.sources.joint_zeros.offset_mdeg=[0,30,-20,0,15,0]")
RUNS = {
    "six": ("generate", LINE),
    "two": ("generate", LINE, "--set", "before.0.duration_h=2"),
    "dense": ("generate", LINE, "--set", "process.spacing_mm=5"),
    "moved": ("generate", LINE, "--set", "path.z_mm=190"),
    "zeros": ("generate", LINE, *ZEROS),
    "zeros_dense": ("generate", LINE, *ZEROS, "--set", "process.spacing_mm=5"),
    "warm": ("generate", LINE, "--set", "robot.thermal.cte_um_m_K=12"),
    "cold": ("predict", LINE, "--set", "before.0.duration_h=1"),
    "hot": ("predict", LINE),
    "grid": ("whatif", LINE, "--vary", "before.0.duration_h=1,2", "--workers", "1", "--no-live"),
    "more": (
        "whatif",
        LINE,
        "--vary",
        "before.0.duration_h=1:3:3",
        "--set",
        "process.feed_mm_s=100",
        "--workers",
        "1",
        "--no-live",
    ),
    "asked": ("whatif", LINE, "--ask", "contributions", "--no-live"),
    "asked_at_2": ("whatif", LINE, "--ask", "contributions", "--no-live", "--set", "before.0.duration_h=2"),
    "soon": ("whatif", LINE, "--ask", "warmup", "--within-um", "5", "--no-live"),
    "late": ("whatif", LINE, "--ask", "warmup", "--within-um", "0.01", "--no-live"),
    "day": ("heat", LINE),
    "duty": ("heat", LINE, "--set", "before.0.duty=0.5"),
}


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """A folder with outputs of all kinds."""
    folder = tmp_path_factory.mktemp("outputs")
    for name, (command, *arguments) in RUNS.items():
        done = run(command, *arguments, "-o", folder / name, "-q")
        assert done.returncode == 0, done.stderr
    return folder


def compared(home, a, b, *options):
    done = run("compare", a, b, "--json", *options, cwd=home)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_other_answers_are_no_equal_studies(home):
    comparison = compared(home, "soon", "late")
    (answer,) = comparison["error"]
    assert (comparison["equal"], answer["key"], answer["same"]) == (False, "answer.0", False)
    for side, folder in (("a", "soon"), ("b", "late")):
        assert answer[side] == json.loads((home / folder / "whatif.json").read_text())["answers"][0]
    assert answer["a"] != answer["b"]


def printed_positions(text):
    """X Y Z W P R of each P[n] of a program, by regular expressions alone, (N, 6) [mm] and [deg]."""
    number = r"=\s*(-?[\d.]+)\s*(?:mm|deg)"
    row = re.compile(r"P\[(\d+)\].*?" + ".*?".join(axis + r"\s*" + number for axis in "XYZWPR"), re.DOTALL)
    rows = {int(m[1]): [float(v) for v in m.groups()[1:]] for m in row.finditer(text[text.index("/POS") :])}
    return np.array([rows[n] for n in sorted(rows)])


def test_one_key_changed_shows_that_key_alone(home):
    for other, key, a, b in (
        ("two", "before.0.duration_h", 6.0, 2.0),
        ("dense", "process.spacing_mm", None, 5.0),
        ("moved", "path.z_mm", None, 190.0),
        ("warm", "robot.thermal.cte_um_m_K", None, 12.0),
    ):
        record = compared(home, "six", other)
        assert [pair["key"] for pair in record["inputs"]] == [key]
        assert record["inputs"][0]["b"] == b
        assert a in (None, record["inputs"][0]["a"])
        assert not record["equal"]


def test_moved_positions_are_those_of_the_two_texts(home):
    """An oracle that shares no code: regular expressions and numpy on the programs."""
    a, b = (printed_positions((home / name / "LINE_Y.LS").read_text()) for name in ("six", "two"))
    distance = 1e3 * np.sqrt(((b - a)[:, :3] ** 2).sum(axis=1))
    positions = compared(home, "six", "two")["positions"]
    assert positions["matched"] == "number"
    assert positions["count"] == len(a)
    assert positions["moved"] == np.count_nonzero(np.any(a != b, axis=1)) > 100
    assert positions["largest_um"] == pytest.approx(distance.max(), abs=1e-6)
    assert positions["rms_um"] == pytest.approx(np.sqrt(np.mean(distance**2)), abs=1e-6)
    turned = np.abs((b - a)[:, 3:] + 180) % 360 - 180
    assert positions["largest_mdeg"] <= 1e3 * np.abs(turned).sum(axis=1).max() + 1e-6


def test_another_spacing_is_matched_by_length(home):
    """The correction is smooth: between other points on one line it is the same to the last digit that is printed."""
    positions = compared(home, "six", "dense")["positions"]
    assert positions["matched"] == "length"
    assert positions["count"] == len((home / "six" / "waypoints.csv").read_text().splitlines()) - 1
    assert 0 < positions["largest_um"] < 3
    both = compared(home, "two", "dense")["positions"]["largest_um"]
    assert both == pytest.approx(compared(home, "two", "six")["positions"]["largest_um"], abs=3)


def test_another_spacing_has_the_angles_of_the_same_one(home):
    """By number and by length: what the digits of the texts leave open is between them."""
    alike, other = (compared(home, "six", name)["positions"] for name in ("zeros", "zeros_dense"))
    assert (alike["matched"], other["matched"]) == ("number", "length")
    assert alike["largest_mdeg"] > 20
    assert other["largest_mdeg"] == pytest.approx(alike["largest_mdeg"], abs=2)
    assert other["rms_mdeg"] == pytest.approx(alike["rms_mdeg"], abs=1)


def test_what_the_digits_leave_open_is_no_movement(home):
    """The same correction at other points of the path."""
    record = compared(home, "zeros", "zeros_dense")["positions"]
    assert record["moved"] == 0
    assert 0 < record["largest_um"] <= record["same_within_um"] == 2
    done = run("compare", "zeros", "zeros_dense", cwd=home)
    words = "commanded positions are the same within the last digit of the texts, 2 um, matched by the length along"
    assert words in done.stdout


def test_another_path_is_measured_to_its_nearest_place(home):
    """An oracle that shares no code: every position against every segment of the other text."""
    texts = [printed_positions((home / name / "LINE_Y.LS").read_text())[:, :3] for name in ("six", "moved")]
    positions = compared(home, "six", "moved")["positions"]
    assert positions["matched"] == "nearest"
    for (points, path), largest, rms in zip(
        (texts, texts[::-1]), ("largest_um", "largest_of_b_um"), ("rms_um", "rms_of_b_um"), strict=True
    ):
        start, step = path[:-1], np.diff(path, axis=0)
        share = ((points[:, None] - start) * step).sum(axis=2) / np.maximum((step**2).sum(axis=1), 1e-12)
        off = points[:, None] - start - np.clip(share, 0, 1)[..., None] * step
        distance = 1e3 * np.linalg.norm(off, axis=2).min(axis=1)
        assert positions[largest] == pytest.approx(distance.max(), abs=0.01)
        assert positions[rms] == pytest.approx(np.sqrt(np.mean(distance**2)), abs=0.01)
    assert 12_000 < positions["largest_um"] < 14_000
    done = run("compare", "six", "moved", cwd=home)
    assert "at the nearest places A's positions are up to 13 mm" in done.stdout


def test_errors_and_times_are_those_of_the_reports(home):
    record = compared(home, "six", "two")
    reports = [json.loads((home / name / "report.json").read_text()) for name in ("six", "two")]
    error = {pair["key"]: pair for pair in record["error"]}
    for side, report in zip("ab", reports, strict=True):
        assert error["on_part.after.total.max_um"][side] == report["on_part"]["after"]["total"]["max_um"]
        assert error["before.total.rms_um"][side] == report["before"]["total"]["rms_um"]
        assert error["verdict"][side] == report["verdict"]
        assert error["band.p95_um"][side] == report["band"]["p95_um"]
    pair = next(pair for pair in record["time"] if pair["key"] == "timing.duration_s")
    assert pair["change"] == pair["b"] - pair["a"]
    assert record["final_error_um"] == reports[1]["on_part"]["after"]["total"]["max_um"]


def test_findings_that_came_went_or_changed(home, tmp_path):
    for name in ("a", "b"):
        shutil.copytree(home / "six", tmp_path / name)
    report = tmp_path / "b" / "report.json"
    data = json.loads(report.read_text())
    gone = data["findings"].pop(0)
    data["findings"].append({"level": "note", "code": "made.up", "message": "new"})
    data["findings"][0]["message"] = "other numbers"
    report.write_text(json.dumps(data))
    findings = compared(tmp_path, "a", "b")["findings"]
    assert findings["gone"] == [gone]
    assert [f["code"] for f in findings["new"]] == ["made.up"]
    assert [f["message"] for f in findings["changed"]] == ["other numbers"]


def test_equal_outputs_are_equal(home, tmp_path):
    shutil.copytree(home / "six", tmp_path / "six")
    record = compared(home, "six", tmp_path / "six")
    assert record["equal"]
    assert record["inputs"] == []
    assert record["positions"]["moved"] == 0
    done = run("compare", "six", tmp_path / "six", cwd=home)
    assert done.stdout.endswith("the two are equal: inputs, errors, times, positions and findings\n")
    (tmp_path / "six" / "LINE_Y.LS").unlink()
    done = run("compare", "six", tmp_path / "six", cwd=home)
    assert "the two are equal: inputs, errors, times and findings; positions are not compared: " in done.stdout


def test_max_um_is_the_largest_error_that_b_may_leave(home):
    final = compared(home, "six", "two")["final_error_um"]
    assert run("compare", "six", "two", "-q", "--max-um", f"{final + 0.01}", cwd=home).returncode == 0
    over = run("compare", "six", "two", "-q", "--max-um", f"{final - 0.01}", cwd=home)
    refused(over, 1, "--max-um")
    assert over.stdout == ""
    refused(run("compare", "six", "two", "--max-um", "0", cwd=home), 2, "--max-um 0")


def test_what_was_not_corrected_is_never_within(home, tmp_path):
    shutil.copytree(home / "two", tmp_path / "b")
    report = tmp_path / "b" / "report.json"
    for verdict in ("nothing corrected", "not loadable"):
        report.write_text(json.dumps({**json.loads(report.read_text()), "verdict": verdict}))
        done = run("compare", "six", tmp_path / "b", "-q", "--max-um", "1000", "-o", tmp_path / "page", cwd=home)
        refused(done, 1, f"outside bounds: B is {verdict}")
        page = (tmp_path / "page" / "compare.html").read_text()
        assert f"B is {verdict}." in page
        assert 'class="big outside"' in page


def test_what_changed_stands_first_and_the_largest_change_above(home):
    lines = run("compare", "six", "two", cwd=home).stdout.splitlines()
    table = lines[lines.index("error") : lines.index("time and size")]
    changes = [float(c) for c in re.findall(r"│\s*([+-][\d.]+) │", "\n".join(table))]
    assert len(changes) > 6
    assert np.all(np.diff(np.abs(changes)) <= 0)
    rows = [line for line in table if line.startswith("│")]
    assert [bool(re.search(r"[+-][\d.]+ │", row)) for row in rows] == sorted(
        (bool(re.search(r"[+-][\d.]+ │", row)) for row in rows), reverse=True
    )


def test_one_sentence_says_what_changed(home):
    record = compared(home, "six", "two")
    pair = next(pair for pair in record["error"] if pair["key"] == "on_part.after.total.max_um")
    last = run("compare", "six", "two", cwd=home).stdout.splitlines()[-1]
    assert last.startswith("first warm-up went from 6 to 2 h; the largest error left on the part ")
    moved = record["positions"]
    assert f"{pair['b']:.2f} um" in last
    assert (
        f"{moved['moved']} of {moved['count']} commanded positions moved, by up to {moved['largest_um']:.3g} um" in last
    )
    assert f"at P[{moved['largest_at']}]" in last


def test_another_robot_is_many_keys_and_all_are_on_the_page(home, tmp_path):
    assert run("predict", LINE, "--robot", "m710ic45m", "-o", tmp_path / "b", "-q").returncode == 0
    keys = [pair["key"] for pair in compared(home, "hot", tmp_path / "b")["inputs"]]
    assert len(keys) > 40
    done = run("compare", "hot", tmp_path / "b", "-o", tmp_path / "page", cwd=home)
    assert f"and {len(keys) - 30} more: --json has all" in done.stdout
    page = (tmp_path / "page" / "compare.html").read_text()
    assert all(f"<code>{key}</code> of the robot file" in page for key in keys if key != "robot")
    assert "<code>robot</code> of the path file" in page
    assert f"<summary>{len(keys) - 30} more</summary>" in page


def test_predictions_studies_and_days_are_compared_with_their_like(home):
    record = compared(home, "cold", "hot")
    assert record["positions"] == {"matched": None, "reason": "cgen predict corrects no program"}
    study = compared(home, "grid", "more")
    assert study["scenarios"]["both"] == 2
    assert (study["scenarios"]["only_a"], study["scenarios"]["only_b"]) == (0, 1)
    assert [pair["key"] for pair in study["inputs"]] == ["process.feed_mm_s"]
    questions = compared(home, "asked", "asked_at_2")
    assert [pair["key"] for pair in questions["inputs"]] == ["before.0.duration_h"]
    assert questions["final_error_um"] is None
    refused(run("compare", "asked", "asked_at_2", "-q", "--max-um", "5", cwd=home), 1, "no error of B is known")
    day = compared(home, "day", "duty")
    assert [(pair["key"], pair["b"]) for pair in day["inputs"]] == [("before.0.duty", 0.5)]
    assert day["final_error_um"] is not None


def test_a_study_with_a_failed_scenario_is_within_no_bound(home, tmp_path):
    grid = ("--vary", "path.x_mm=1350,9000", "--workers", "1", "--no-live")
    assert run("whatif", LINE, *grid, "-q", "-o", tmp_path / "far").returncode == 0
    assert run("compare", tmp_path / "far", "grid", "-q", "--max-um", "500", cwd=home).returncode == 0
    refused(run("compare", "grid", tmp_path / "far", "-q", "--max-um", "500", cwd=home), 1, "of B 1 scenario failed")


def test_corrections_are_compared_position_by_position(home, tmp_path):
    planned = tmp_path / "PLAIN.LS"
    lines = (home / "six" / "LINE_Y.LS").read_text().splitlines(keepends=True)
    planned.write_text("".join(line for line in lines if "compgen" not in line and "!" not in line))
    for name, hours in (("a", "5h"), ("b", "2h")):
        given = ("--robot", "m710ic50", "--before", f"moving 200mm/s {hours}", "--again", "--force")
        done = run("correct", planned, *given, "-o", tmp_path / name, "-q")
        assert (tmp_path / name / "PLAIN.LS").is_file(), done.stderr
    record = compared(tmp_path, "a", "b")
    a, b = (printed_positions((tmp_path / name / "PLAIN.LS").read_text()) for name in ("a", "b"))
    distance = 1e3 * np.sqrt(((b - a)[:, :3] ** 2).sum(axis=1))
    assert record["positions"]["largest_um"] == pytest.approx(distance.max(), abs=1e-6)
    assert [pair["key"] for pair in record["inputs"]] == ["before.0.duration_h"]
    assert [record[side]["inputs_sha256"] for side in "ab"] == [None, None]  # the robot's stood there, the same of both
    (tmp_path / "b" / "PLAIN.LS").write_text((tmp_path / "b" / "PLAIN.LS").read_text().replace("CNT100", "CNT90", 1))
    refused(run("compare", "a", "b", cwd=tmp_path), 2, "PLAIN.LS", "edited")


def test_positions_in_joint_form_are_counted_beside_those_whose_distance_is_told(tmp_path):
    """*5 of 5 commanded positions moved* was said of seven."""
    turned = [np.array(HOME) + 2.0 * n for n in range(8)]
    points = [at(n, turned[n]) for n in range(1, 6)] + [joint_form(n, turned[n]) for n in (6, 7)]
    (tmp_path / "PART.LS").write_bytes(program([f"J P[{n}] 20% FINE" for n in range(1, 8)], points))
    for name, hours, most in (("a", "5h", "20"), ("b", "2h", "20"), ("wider", "5h", "30")):
        given = ("--robot", "m710ic50", "--before", f"moving 200mm/s {hours}", "--max-um", most)
        assert run("correct", tmp_path / "PART.LS", *given, "-o", tmp_path / name, "-q").returncode == 0
    done = run("compare", "a", "b", cwd=tmp_path)
    assert "5 of 5 commanded positions moved" in done.stdout
    assert "; 2 of 2 in joint angles read otherwise" in done.stdout
    positions = compared(tmp_path, "a", "b")["positions"]
    assert (positions["count"], positions["in_joints"], positions["in_joints_moved"]) == (5, 2, 2)
    assert "all 7 commanded positions are the same" in run("compare", "a", "wider", cwd=tmp_path).stdout


def test_reports_alone_are_compared_without_what_lies_beside_them(home, tmp_path):
    for name in ("six", "two"):
        shutil.copy(home / name / "report.json", tmp_path / f"{name}.json")
    record = compared(tmp_path, "six.json", "two.json")
    assert record["positions"]["matched"] is None
    assert [pair["key"] for pair in record["inputs"]] == ["before.0.duration_h"]


def test_another_version_is_compared_with_a_warning(home, tmp_path):
    shutil.copytree(home / "six", tmp_path / "six")
    report = tmp_path / "six" / "report.json"
    data = json.loads(report.read_text())
    data["provenance"]["compgen"] = "0.0.9"
    report.write_text(json.dumps(data))
    done = run("compare", tmp_path / "six", "six", cwd=home)
    assert done.returncode == 0
    assert "warning: A is of compgen 0.0.9" in done.stdout


def test_what_cannot_be_compared_is_refused_in_one_line(home, tmp_path):
    refused(run("compare", "six", "hot", cwd=home), 2, "generate", "predict")
    refused(run("compare", "six", "six/report.json", cwd=home), 2, "both are")
    refused(run("compare", "six", "nowhere", cwd=home), 2, "nowhere")
    (tmp_path / "empty").mkdir()
    refused(run("compare", home / "six", "empty", cwd=tmp_path), 2, "not an output")
    shutil.copytree(home / "six", tmp_path / "six")
    report, text = tmp_path / "six" / "report.json", (home / "six" / "report.json").read_text()
    for damaged, words in (
        (text[:-200], "not JSON"),
        ("[]", "not a report"),
        (text.replace('"ratio": ', '"ratio": NaN, "other": ', 1), "NaN is no number"),
        (text.replace('"schema": 1', '"schema": 2', 1), "schema 2"),
        (text.replace('"max_um"', '"largest"'), "damaged"),
        (text.replace('"timing"', '"clock"'), "no key 'timing'"),
        (text.replace('"timing"', '"clock"').replace('"command": "generate",', ""), "not a report"),
        (text.replace('"command": "generate"', '"command": "made"'), "not a report"),
        (json.dumps({**json.loads(text), "inputs": {"path": 3}}), "damaged"),
        (json.dumps({**json.loads(text), "findings": 3}), "damaged"),
    ):
        report.write_text(damaged)
        refused(run("compare", home / "six", "six", cwd=tmp_path), 2, "report.json", words)
    report.write_text(text)
    program = tmp_path / "six" / "LINE_Y.LS"
    program.write_bytes(program.read_bytes().replace(b"CNT100", b"CNT90", 1))
    refused(run("compare", home / "six", "six", cwd=tmp_path), 2, "LINE_Y.LS", "edited")
    program.unlink()
    assert "has no program" in compared(tmp_path, home / "six", "six")["positions"]["reason"]
    (tmp_path / "six" / "waypoints.csv").unlink()
    refused(run("compare", home / "six", "six", cwd=tmp_path), 2, "waypoints.csv", "not there")


def test_a_page_and_a_record_go_into_a_folder_and_replace_nothing_else(home, tmp_path):
    done = run("compare", "six", "two", "-o", tmp_path / "page", "--max-um", "3", cwd=home)
    assert done.returncode == 0, done.stderr
    assert {file.name for file in (tmp_path / "page").iterdir()} == {"compgen.json", "compare.html", "compare.json"}
    assert json.loads((tmp_path / "page" / "compare.json").read_text()) == compared(home, "six", "two")
    page = (tmp_path / "page" / "compare.html").read_text()
    body = page[page.index("<main>") : page.index("</main>")]
    assert "First warm-up [h]" in body
    assert "before.0.duration_h" in body
    assert "--max-um 3" in body
    first = (tmp_path / "page" / "compare.html").read_bytes()
    assert run("compare", "six", "two", "-o", tmp_path / "page", "--max-um", "3", "-q", cwd=home).returncode == 0
    assert (tmp_path / "page" / "compare.html").read_bytes() == first
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "compare.json").write_text("{}")
    refused(run("compare", "six", "two", "-o", tmp_path / "mine", cwd=home), 2, "compare.json")


def test_pages_of_a_long_program_are_one_program(tmp_path):
    short = ("--set", "robot.controller.max_positions=60", "--set", "process.page_stops=anywhere")
    for name, more in (("whole", ()), ("paged", short)):
        assert run("generate", LINE, *more, "-o", tmp_path / name, "-q").returncode == 0
    assert len(list((tmp_path / "paged").glob("*.LS"))) > 2
    record = compared(tmp_path, "whole", "paged")
    assert record["positions"]["matched"] == "number"
    assert record["positions"]["moved"] == 0
    assert record["positions"]["count"] == len((tmp_path / "whole" / "waypoints.csv").read_text().splitlines()) - 1


def perturbed(value, rng, size):
    """Every float of a record moved by a share of itself."""
    if isinstance(value, dict):
        return {key: inner if key == "inputs" else perturbed(inner, rng, size) for key, inner in value.items()}
    if isinstance(value, list):
        return [perturbed(inner, rng, size) for inner in value]
    return value * (1 + size * rng.uniform(-1, 1)) if isinstance(value, float) else value


def test_last_digits_of_a_double_are_no_change(home, tmp_path):
    """What another machine or another order of sums moves, no table shows."""
    for name, report in (
        ("six", "report.json"),
        ("cold", "report.json"),
        ("grid", "whatif.json"),
        ("day", "heat.json"),
    ):
        shutil.copytree(home / name, tmp_path / name)
        data = json.loads((home / name / report).read_text())
        (tmp_path / name / report).write_text(json.dumps(perturbed(data, np.random.default_rng(3), 1e-12)))
        record = compared(home, name, tmp_path / name)
        assert record["equal"]
        pairs = [pair for group in ("error", "time", "program") for pair in record[group]]
        assert all(pair["same"] for pair in pairs)
        assert any(pair["change"] for pair in pairs), "the set-up must bite"
    done = run("compare", "six", tmp_path / "six", cwd=home)
    assert "e-" not in done.stdout


def test_a_change_of_the_last_shown_digit_is_one(home, tmp_path):
    shutil.copytree(home / "six", tmp_path / "six")
    report = tmp_path / "six" / "report.json"
    for change, same in ((0.009, True), (0.011, False)):
        data = json.loads((home / "six" / "report.json").read_text())
        data["after"]["total"]["rms_um"] += change
        report.write_text(json.dumps(data))
        record = compared(home, "six", tmp_path / "six")
        assert record["equal"] is same
        pair = next(pair for pair in record["error"] if pair["key"] == "after.total.rms_um")
        assert pair["same"] is same


def test_inputs_are_shown_to_the_last_digit(home, tmp_path):
    """A key that changed never reads alike on both sides."""
    options = ("--set", "before.0.duration_h=2.0000001", "--set", "bounds.max_um=50.0004")
    assert run("predict", LINE, *options, "-o", tmp_path / "a", "-q").returncode == 0
    options = ("--set", "before.0.duration_h=2", "--set", "bounds.max_um=50.0001")
    assert run("predict", LINE, *options, "-o", tmp_path / "b", "-q").returncode == 0
    done = run("compare", "a", "b", "-o", "page", cwd=tmp_path)
    page = (tmp_path / "page" / "compare.html").read_text()
    for shown in ("2.0000001", "50.0004", "50.0001"):
        assert shown in done.stdout
        assert shown in page


def test_an_empty_list_is_no_key_that_changed(home, tmp_path):
    assert (
        run("predict", LINE, "--set", 'cycle=[{state="idle", duration_h=1}]', "-o", tmp_path / "b", "-q").returncode
        == 0
    )
    keys = [pair["key"] for pair in compared(home, "hot", tmp_path / "b")["inputs"]]
    assert keys == ["cycle.0.state", "cycle.0.duration_h", "cycle.0.shifts"]


def test_a_report_of_windows_is_read(home, tmp_path):
    """What a shell there makes of --json and a file: UTF-16."""
    text = (home / "cold" / "report.json").read_text()
    (tmp_path / "r.json").write_bytes(text.encode("utf-16"))
    record = compared(home, "cold/report.json", tmp_path / "r.json")
    assert record["error"]
    assert all(pair["same"] for pair in record["error"])


def test_json_that_no_command_writes_is_damage(home, tmp_path):
    text = (home / "six" / "report.json").read_text()
    shutil.copytree(home / "six", tmp_path / "six")
    for damaged, words in (
        (text.replace('"name"', '"schema": 1, "name"', 1), "'schema' is in it twice"),
        (text.replace('"max_um": ', '"max_um": 1e999, "other": ', 1), "1e999 is no number"),
        (text.replace('"max_um": ', '"max_um": -Infinity, "other": ', 1), "-Infinity is no number"),
        (text.replace('"schema": 1', f'"schema": 1{"0" * 500}', 1), "is no number"),
        (text.replace('"schema": 1', '"schema": true', 1), "not a report"),
        (text[:500], "line"),
        (text.encode("utf-8")[:50].decode() + "\ufffd", "line"),
        ("", "line 1, column 1"),
        ("[" * 100_000, "not JSON"),
    ):
        (tmp_path / "six" / "report.json").write_text(damaged)
        refused(run("compare", home / "six", "six", cwd=tmp_path), 2, "report.json", words)
    (tmp_path / "six" / "report.json").write_bytes(b"\xff\xfe\x00\xd8" + text.encode()[:99])
    refused(run("compare", home / "six", "six", cwd=tmp_path), 2, "report.json", "not JSON")


def test_reports_of_other_commands_are_refused_by_their_name(home, tmp_path):
    for kind, record in (
        ("identify", {"compgen": "0.1.0", "ladder": [], "coverage": {}}),
        ("executed", {"schema": 1, "covered": {}, "override": [], "log": {}}),
        ("anchor", {"schema": 1, "anchored_state": True}),
        ("resume", {"schema": 1, "from_page": 2, "replaced": []}),
        ("offsets", {"command": "offsets", "name": "line_y", "ways": []}),
    ):
        (tmp_path / "r.json").write_text(json.dumps(record))
        refused(run("compare", "six", tmp_path / "r.json", cwd=home), 2, "r.json", f"cgen {kind}", "not compared")
    assert run("compare", "six", "two", "-o", tmp_path / "c", "-q", cwd=home).returncode == 0
    refused(run("compare", "six", tmp_path / "c" / "compare.json", cwd=home), 2, "cgen compare", "not compared")


def test_what_is_no_output_is_refused_in_one_line(home, tmp_path):
    (tmp_path / "loop").symlink_to(tmp_path / "pool")
    (tmp_path / "pool").symlink_to(tmp_path / "loop")
    (tmp_path / "folder" / "report.json").mkdir(parents=True)
    (tmp_path / "r.json").mkdir()
    for name, words in (
        ("loop", "cannot be read"),
        ("folder", "not an output"),
        ("r.json", "not an output"),
        ("/dev/null", "a pipe or a device"),
        ("x" * 300, "cgen generate"),
        ("", "empty name"),
        (str(home / "six" / "LINE_Y.LS"), "not JSON at line 1"),
    ):
        refused(run("compare", home / "six", name, cwd=tmp_path), 2, words)


def test_names_with_spaces_and_letters_of_all_kinds(home, tmp_path):
    other = tmp_path / "nach dem Öl wechsel µ"
    shutil.copytree(home / "two", other)
    assert compared(home, "six", other)["b"]["output"] == str(other)
    assert run("compare", "six", other, "-o", tmp_path / "s ü", "-q", cwd=home).returncode == 0
    assert "nach dem Öl wechsel" in (tmp_path / "s ü" / "compare.html").read_text()


def test_rises_of_a_day_have_their_unit(home):
    record = compared(home, "day", "duty")
    rises = [pair for pair in record["error"] if pair["key"].startswith("rise_K.")]
    assert rises
    assert {pair["unit"] for pair in rises} == {"K"}
    last = run("compare", "day", "duty", cwd=home).stdout.splitlines()[-1]
    assert "the most that one corrected file leaves in a run" in last
    assert "positions" not in last


def test_a_value_of_another_type_is_damage(home, tmp_path):
    for name, report, changes in (
        ("day", "heat.json", {"provenance": 3, "runs": {"error_max_um": 1.0, "residual_max_um": [], "count": 1}}),
        ("grid", "whatif.json", {"scenarios": [{"state": "done", "duration_s": "NaN"}]}),
        ("six", "report.json", {"timing": {"at_feed": {}, "duration_s": 1.0}, "provenance": "x"}),
    ):
        shutil.copytree(home / name, tmp_path / name)
        data = json.loads((home / name / report).read_text())
        for key, value in changes.items():
            (tmp_path / name / report).write_text(json.dumps({**data, key: value}))
            refused(run("compare", home / name, name, cwd=tmp_path), 2, report, "damaged")


def test_inputs_that_are_not_known_are_not_called_the_same(home, tmp_path):
    """Of a report from before they were in it."""
    shutil.copytree(home / "six", tmp_path / "old")
    report = tmp_path / "old" / "report.json"
    data = json.loads(report.read_text())
    del data["inputs"], data["on_part"], data["program"]["sha256"]
    report.write_text(json.dumps(data))
    record = compared(home, "six", tmp_path / "old")
    assert record["inputs"] is None
    assert record["equal"] is False
    assert record["positions"]["moved"] == 0
    done = run("compare", "six", tmp_path / "old", "-o", tmp_path / "page", cwd=home)
    assert "warning" in done.stdout
    assert "what changed in the inputs is not known" in done.stdout
    page = (tmp_path / "page" / "compare.html").read_text()
    assert "What changed in the inputs is not known." in page
    for words in ("no key changed", "no input changed", "every key of the files", "are equal"):
        assert words not in done.stdout + page
