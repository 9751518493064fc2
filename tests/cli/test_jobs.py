"""Commands on a path file, as a user meets them: exit codes, one-line messages, whole outputs."""

import json
import re
import shutil
import signal
import subprocess
import sys
from xml.etree import ElementTree

import pytest
from command_line import ENVIRONMENT, refused, run
from shipped import ROOT
from stopped import run_stopped

OURS = {"compgen.json", "LINE_Y.LS", "report.json", "report.html", "waypoints.csv"}


def test_generate_writes_the_whole_set(tmp_path):
    result = run("generate", "paths/line_y.toml", "-o", tmp_path / "out")
    assert result.returncode == 0, result.stderr
    assert {p.name for p in (tmp_path / "out").iterdir()} == OURS
    data = json.loads((tmp_path / "out" / "report.json").read_text())
    assert data["verdict"] == "inside"
    assert data["after"]["total"]["max_um"] <= 2.5
    text = (tmp_path / "out" / "LINE_Y.LS").read_bytes()
    assert f"inputs {data['provenance']['inputs_sha256'][:24]}".encode() in text
    assert b"start within" in text
    assert "times smaller" in result.stdout
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_quiet_says_nothing(tmp_path):
    result = run("generate", "paths/line_y.toml", "-q", "-o", tmp_path / "out")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")


def test_predict_writes_no_program_and_has_a_folder_of_its_own(tmp_path):
    for _ in range(2):  # the second time over its own files
        assert run("predict", ROOT / "paths/line_y.toml", "-q", cwd=tmp_path).returncode == 0
    out = tmp_path / "outputs" / "line_y_predict"
    assert {p.name for p in out.iterdir()} == OURS - {"LINE_Y.LS"}
    assert json.loads((out / "report.json").read_text())["verdict"] == "predicted"


@pytest.fixture(scope="module")
def generated(tmp_path_factory):
    """The folder that ``generate`` of line_y wrote."""
    folder = tmp_path_factory.mktemp("generated") / "out"
    assert run("generate", "paths/line_y.toml", "-q", "-o", folder).returncode == 0
    return folder


def content(folder):
    return {p.name: p.read_bytes() for p in folder.iterdir()}


def test_no_command_removes_what_another_wrote(tmp_path, generated):
    out = tmp_path / "out"
    shutil.copytree(generated, out)
    before = content(out)
    words = ("generate wrote about line_y", "-o")
    refused(run("predict", "paths/line_y.toml", "-q", "-o", out), 2, *words)
    refused(run("generate", "paths/line_x.toml", "-q", "-o", out), 2, *words)
    refused(run("correct", out / "LINE_Y.LS", "--again", "-q", "-o", out), 2, "would replace it")
    (tmp_path / "LINE_Y.LS").write_bytes(before["LINE_Y.LS"])
    refused(run("correct", tmp_path / "LINE_Y.LS", "--again", "-q", "-o", out), 2, *words)
    assert content(out) == before
    (out / "report.json").unlink()
    refused(run("predict", "paths/line_y.toml", "-q", "-o", out), 2, *words)  # by the marker
    (out / "compgen.json").unlink()  # as an older release left it
    refused(run("predict", "paths/line_y.toml", "-q", "-o", out), 2, "LINE_Y.LS", "not what cgen predict wrote")
    assert run("generate", "paths/line_y.toml", "-q", "-o", out).returncode == 0  # its own, of a run that was killed
    assert content(out) == before


def test_without_a_compiler_only_the_last_digits_of_the_report_differ(tmp_path, monkeypatch):
    """As docs/how_it_works.md says: sines and cosines of the C library and of numpy differ in their last bit."""
    for name, compiler in (("c", "cc"), ("numpy", "no-such-compiler")):
        monkeypatch.setenv("CC", compiler)
        assert run("generate", "paths/circle_1300.toml", "-q", "-o", tmp_path / name).returncode == 0
    with_c, without = content(tmp_path / "c"), content(tmp_path / "numpy")
    reports = [json.loads(files.pop("report.json")) for files in (with_c, without)]
    hashes = [json.loads(files.pop("compgen.json"))["runs"][0]["files"].items() for files in (with_c, without)]
    assert {name for name, _ in hashes[0] ^ hashes[1]} == {"report.json"}
    assert with_c == without
    numbers = [list(plain_numbers(report)) for report in reports]
    assert len(numbers[0]) > 60
    assert numbers[0] == pytest.approx(numbers[1], rel=1e-8, abs=1e-9)


def plain_numbers(value):
    """All numbers in plain data, in its order."""
    if isinstance(value, dict | list):
        for inner in value.values() if isinstance(value, dict) else value:
            yield from plain_numbers(inner)
    elif isinstance(value, int | float):
        yield value


def test_a_relative_cache_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", "cache")
    result = run("generate", ROOT / "paths/line_y.toml", "-q", "-o", "out", cwd=tmp_path)
    refused(result, 2, "XDG_CACHE_HOME", "'cache'", "absolute")
    assert not list(tmp_path.iterdir())


def test_files_of_somebody_else_are_not_replaced(tmp_path):
    (tmp_path / "LINE_Y.LS").write_text("/PROG LINE_Y\n")
    refused(run("generate", "paths/line_y.toml", "-q", "-o", tmp_path), 2, "LINE_Y.LS", "not what cgen generate wrote")
    (tmp_path / "LINE_Y.LS").unlink()
    (tmp_path / "report.json").write_text('{"errors": 3}')
    refused(run("generate", "paths/line_y.toml", "-q", "-o", tmp_path), 2, "report.json", "not what cgen generate")
    assert content(tmp_path) == {"report.json": b'{"errors": 3}'}


def test_outside_bounds_writes_the_report_but_no_program(tmp_path):
    result = run("generate", "paths/line_y.toml", "-q", "-o", tmp_path / "out", "--set", "bounds.max_um=0.2")
    refused(result, 1, "bounds.max_um = 0.2", "--force")
    assert {p.name for p in (tmp_path / "out").iterdir()} == OURS - {"LINE_Y.LS"}
    assert json.loads((tmp_path / "out" / "report.json").read_text())["verdict"] == "outside"
    of_it = "program LINE_Y.LS sha256"  # the page does not name a file that is not there
    page = (tmp_path / "out" / "report.html").read_text()
    assert "<dd>not written: outside its bounds</dd>" in page
    assert of_it not in page
    forced = run("generate", "paths/line_y.toml", "-q", "-o", tmp_path / "out", "--set", "bounds.max_um=0.2", "--force")
    assert forced.returncode == 1
    assert {p.name for p in (tmp_path / "out").iterdir()} == OURS
    assert of_it in (tmp_path / "out" / "report.html").read_text()


def test_check_speaks_json_and_junit(tmp_path):
    good = run("check", "paths/line_y.toml", "--json", "--junit", tmp_path / "j.xml")
    assert good.returncode == 0
    assert json.loads(good.stdout)["verdict"] == "inside"
    suite = ElementTree.parse(tmp_path / "j.xml").getroot()
    assert (suite.get("tests"), suite.get("failures")) == ("2", "0")
    bad = run("check", "paths/line_y.toml", "--json", "--junit", tmp_path / "j.xml", "--set", "bounds.max_um=0.2")
    assert bad.returncode == 1
    assert json.loads(bad.stdout)["verdict"] == "outside"
    suite = ElementTree.parse(tmp_path / "j.xml").getroot()
    assert suite.get("failures") == "1"
    assert suite.find("testcase/failure") is not None
    assert not (ROOT / "LINE_Y.LS").exists()


def test_check_judges_both_kinds_of_bound(tmp_path):
    promise = ("--set", "bounds.guaranteed={max_um=200, normal_um=100, seed=3}")
    kept = run("check", "paths/line_y.toml", "--json", "--junit", tmp_path / "j.xml", *promise)
    assert kept.returncode == 0, kept.stderr
    cases = [case.get("name") for case in ElementTree.parse(tmp_path / "j.xml").getroot().iter("testcase")]
    assert cases[-2:] == ["bounds.guaranteed.max_um", "bounds.guaranteed.normal_um"]
    report = json.loads(kept.stdout)
    assert [report["band"][key] for key in ("share", "confidence", "draws", "seed")] == [0.95, 0.95, 59, 3]
    assert report["guaranteed"]["bounds"]["max_um"]["bound"] == 200
    assert run("check", "paths/line_y.toml", "--json", *promise).stdout == kept.stdout
    broken = run("check", "paths/line_y.toml", "--junit", tmp_path / "j.xml", "--set", "bounds.guaranteed.max_um=5")
    refused(broken, 1, "95 % of arms and days", "bounds.guaranteed.max_um = 5", "can be kept")
    assert "guaranteed: 95 % of arms and days stay within max_um" in broken.stdout
    suite = ElementTree.parse(tmp_path / "j.xml").getroot()
    failed = [case.get("name") for case in suite.iter("testcase") if case.find("failure") is not None]
    assert failed == ["bounds.guaranteed.max_um"]


@pytest.mark.parametrize(
    ("promise", "words"),
    [
        ("{max_um=60, draws=0}", "bounds.guaranteed.draws: 0: .* needs 59 to 10000"),
        ("{max_um=60, draws=1000000000}", "bounds.guaranteed.draws: 1000000000: .* needs 59 to 10000"),
        ("{max_um=60, draws=58}", "bounds.guaranteed.draws: 58: .* needs 59"),
        ("{max_um=60, share=1}", "bounds.guaranteed.share: 1: must be less than 1"),
        ("{max_um=60, share=0}", "bounds.guaranteed.share: 0: must be greater than 0"),
        ("{max_um=60, confidence=1.2}", "bounds.guaranteed.confidence: 1.2: must be less than 1"),
        ("{share=0.9}", "bounds.guaranteed: it gives no bound; add max_um"),
        ("{max_um=60, shares=0.9}", "bounds.guaranteed.shares: unknown key; did you mean 'share'"),
    ],
)
def test_a_promise_that_cannot_be_verified_is_refused(promise, words):
    result = run("check", "paths/line_y.toml", "-q", "--set", f"bounds.guaranteed={promise}")
    assert re.search(words, result.stderr), result.stderr
    assert (result.returncode, result.stdout) == (2, "")
    assert len(result.stderr.splitlines()) == 1
    assert len(result.stderr) <= 300


def test_set_reaches_path_and_robot():
    base = json.loads(run("check", "paths/line_y.toml", "--json").stdout)
    twice = json.loads(run("check", "paths/line_y.toml", "--json", "--set", "robot.thermal.cte_um_m_K=22.5").stdout)
    assert twice["before"]["total"]["max_um"] == pytest.approx(2 * base["before"]["total"]["max_um"], rel=0.01)
    short = json.loads(run("check", "paths/line_y.toml", "--json", "--set", "before.0.duration_h=3").stdout)
    assert short["thermal"]["start_K"]["j3"] == pytest.approx(
        13 * (1 - 2.718281828 ** (-3 / 6.48)) / (1 - 2.718281828 ** (-6 / 6.48)), abs=1e-3
    )
    assert short["provenance"]["overrides"] == ["before.0.duration_h=3"]


def test_a_cold_robot_has_nothing_to_correct():
    data = json.loads(run("check", "paths/line_y.toml", "--json", "--set", "robot.thermal.cte_um_m_K=0").stdout)
    assert data["before"]["total"]["max_um"] < 2.5
    assert data["compensation"]["largest_um"] < 1e-6


PATH_ERRORS = [
    ("process.feed_mm_s=-1", ("process.feed_mm_s", "greater than or equal to 0.05")),
    ("process.feed_m_s=1", ("process.feed_m_s", "unknown key", "did you mean 'feed_mm_s'")),
    ("path.diameter_mm=1300", ("path.diameter_mm", "unknown key")),
    ("path.length_mm=0", ("path.length_mm", "greater than 0")),
    ("path.length_mm=-5", ("path.length_mm", "greater than 0")),
    ("path.length_mm=nan", ("path.length_mm", "finite")),
    ("path.x_mm=inf", ("path.x_mm", "finite")),
    ("path.x_mm='a'", ("path.x_mm", "number")),
    ("path.pattern=zigzag", ("path.pattern", "zigzag", "spiral")),
    ("path.axis=q", ("path.axis", "'x', 'y' or 'z'")),
    ("robot=kuka", ("robot 'kuka' is unknown", "m710ic50")),
    ("bounds.max_um=-2", ("bounds.max_um", "greater than 0")),
    ("tool.z=100", ("tool.z", "unknown key", "z_mm")),
    ("before.0.state=dancing", ("before.0.state", "'moving', 'idle' or 'off'")),
    ("before.0.duration_h=-1", ("before.0.duration_h", "greater than or equal to 0")),
    ("before.3.duration_h=1", ("before.3.duration_h", "no")),
    ('before=[{state="moving", duration_h=1}]', ("before.0.feed_mm_s", "missing")),
    ("surface.conic_constant=-1", ("surface.conic_constant", "plane")),
    ("surface.kind=conic", ("surface.radius_of_curvature_m", "missing")),
    ("boundary={shape='circle', corner_to_corner_mm=3}", ("boundary.corner_to_corner_mm", "conflicts")),
    ("boundary={shape='hexagon'}", ("boundary.corner_to_corner_mm", "missing")),
    ("robot.controller.compensation=unknown", ("controller.compensation", "'none'")),
    ("robot.thermal.nodes=1", ("thermal.nodes", "unknown key", "node")),
    ("robot.limits.j1_deg=[10,-10]", ("limits.j1_deg", "rise")),
    ("robot.dh.a_mm=[150,900,170,0,0,0]", ("thermal.profile.0", "900")),
    ("robot.dh.d_mm=[0,10,0,-1016,0,-175]", ("closed-form",)),
    ("novalue", ("key=value",)),
]


@pytest.mark.parametrize(("override", "words"), PATH_ERRORS, ids=[o for o, _ in PATH_ERRORS])
def test_bad_input_is_one_line_and_exit_2(tmp_path, override, words):
    result = run("generate", "paths/line_y.toml", "-q", "-o", tmp_path / "out", "--set", override)
    refused(result, 2, *words)
    assert not (tmp_path / "out").exists()


IMPOSSIBLE = [
    ("circle_1300", ["path.diameter_mm=2400"], ("waypoint", "out of reach", "joint 3", "mm")),
    ("line_x", ["path.x_mm=0", "path.y_mm=0", "path.z_mm=1000"], ("waypoint", "shoulder singularity", "J1", "mm")),
    ("line_y", ["robot.limits.j1_deg=[-20, 20]"], ("waypoint", "J1", "limits -20.000 deg to 20.000 deg")),
    ("line_z", ["robot.limits.j2_plus_j3_deg=[-160, 10]"], ("waypoint", "J2+J3", "beyond")),
    ("line_x", ["path.length_mm=1323", "process.lift_mm=0"], ("waypoint", "elbow singularity", "J3")),
]


@pytest.mark.parametrize(("name", "overrides", "words"), IMPOSSIBLE, ids=[i[0] + i[1][0] for i in IMPOSSIBLE])
def test_what_the_robot_cannot_do_is_exit_3(tmp_path, name, overrides, words):
    sets = [a for o in overrides for a in ("--set", o)]
    result = run("generate", f"paths/{name}.toml", "-q", "-o", tmp_path / "out", *sets)
    refused(result, 3, *words)
    assert not (tmp_path / "out").exists()


def test_files_that_are_no_path_are_refused(tmp_path):
    (tmp_path / "a.toml").write_text("[path\n")
    (tmp_path / "b.toml").write_bytes(b"\xff\xfe\x00")
    (tmp_path / "c.toml").write_text("")
    for name, words in (("a", "not TOML"), ("b", "text"), ("c", "path"), ("d", "no such file")):
        refused(run("generate", tmp_path / f"{name}.toml", "-q", "-o", tmp_path / "out"), 2, f"{name}.toml", words)
    refused(run("generate", tmp_path, "-q", "-o", tmp_path / "out"), 2, "cannot be read")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("key", ["process", "bounds", "path"])
def test_missing_tables_are_named(tmp_path, key):
    text = (ROOT / "paths" / "line_y.toml").read_text()
    (tmp_path / "p.toml").write_text(re.sub(rf"^\[{key}\]\n(?:(?!\[).*\n)*", "", text, flags=re.MULTILINE))
    refused(run("generate", tmp_path / "p.toml", "-q", "-o", tmp_path / "out"), 2, "p.toml", key, "missing")


def test_an_output_folder_that_cannot_be_written_is_refused(tmp_path):
    (tmp_path / "file").write_text("in the way")
    for place in (tmp_path / "file", tmp_path / "file" / "deeper", "/proc/nowhere/out"):
        refused(run("generate", "paths/line_y.toml", "-q", "-o", place), 2, "output folder", "give another folder")
    assert (tmp_path / "file").read_text() == "in the way"


def test_two_runs_write_identical_bytes(tmp_path):
    for name, seed in (("a", "1"), ("b", "77")):
        environment = {**ENVIRONMENT, "PYTHONHASHSEED": seed, "TZ": "Asia/Tokyo" if seed == "1" else "UTC"}
        command = [sys.executable, "-m", "compgen", "generate", "paths/line_y.toml", "-q", "-o", str(tmp_path / name)]
        subprocess.run(command, cwd=ROOT, env=environment, check=True)
    for file in OURS:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes(), file


def test_date_is_an_argument(tmp_path):
    assert run("generate", "paths/line_y.toml", "-q", "-o", tmp_path, "--date", "26-11-21").returncode == 0
    assert b"DATE 26-11-21" in (tmp_path / "LINE_Y.LS").read_bytes()
    refused(run("generate", "paths/line_y.toml", "-q", "-o", tmp_path, "--date", "2026-13-21"), 2, "not a date")


MOMENTS = [
    ("import", "casadi", 1),
    ("open", "m710ic50.toml", 1),
    ("os.mkdir", "compgen-", 1),
    ("open", "waypoints.csv", 1),
    *(("os.rename", "compgen-", n) for n in (1, 2, 3, 4)),
]


@pytest.fixture(scope="module")
def slower(tmp_path_factory):
    """Files of an earlier run."""
    folder = tmp_path_factory.mktemp("slower")
    feed = ("--set", "process.feed_mm_s=100")
    assert run("generate", "paths/line_y.toml", "-q", "-o", folder, *feed).returncode == 0
    return folder


@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
@pytest.mark.parametrize("earlier", [False, True])
@pytest.mark.parametrize("moment", MOMENTS, ids=lambda m: f"{m[0]}-{m[2]}")
def test_a_killed_run_leaves_old_files_or_new_ones(tmp_path, moment, earlier, generated, slower):
    """Beside other files, which are never moved: the program is whole, and what is there with it is of its own run."""
    target = tmp_path / "out"
    (target / "folder").mkdir(parents=True)
    others = {target / "mine.txt": "mine", target / "folder" / "deep.txt": "deep"}
    for file, text in others.items():
        file.write_text(text)
    old = {}
    if earlier:
        shutil.copytree(slower, target, dirs_exist_ok=True)
        old = {name: (target / name).read_bytes() for name in OURS}
    killed = run_stopped(["generate", "paths/line_y.toml", "-q", "-o", target], moment, signal.SIGKILL)
    assert killed.returncode == -signal.SIGKILL
    new, files = content(generated), {name: (target / name).read_bytes() for name in OURS if (target / name).exists()}
    assert files.items() <= old.items() or files.items() <= new.items()
    assert ("LINE_Y.LS" in files) or not earlier
    assert "report.json" in files or not {"report.html", "waypoints.csv"} & set(files)
    assert run("generate", "paths/line_y.toml", "-q", "-o", target).returncode == 0
    assert {name: (target / name).read_bytes() for name in OURS} == new
    assert {p.name for p in target.iterdir()} == OURS | {"mine.txt", "folder"}
    assert [p.name for p in tmp_path.iterdir()] == ["out"]
    assert all(file.read_text() == text for file, text in others.items())


def test_a_limit_that_binds_only_the_correction_is_a_finding(tmp_path):
    """The plan is legal, the full correction is not: the best legal one is written about, and named."""
    plan = json.loads(run("check", "paths/line_x.toml", "--json").stdout)["provenance"]["joint_range_deg"]
    planned = run("predict", "paths/line_x.toml", "-q", "-o", tmp_path / "p")
    assert planned.returncode == 0
    nominal = json.loads((tmp_path / "p" / "report.json").read_text())["provenance"]["joint_range_deg"]["J2+J3"]
    low = (2 * nominal[0] + plan["J2+J3"][0]) / 3
    assert plan["J2+J3"][0] < low < nominal[0]
    result = run("check", "paths/line_x.toml", "--json", "--set", f"robot.limits.j2_plus_j3_deg=[{low}, 280]")
    data = json.loads(result.stdout)
    assert result.returncode == 1
    assert data["compensation"]["status"] == "limited"
    message = next(f["message"] for f in data["findings"] if f["code"] == "compensation.limited")
    assert "joint J2+J3 limit at waypoints" in message
    assert "waypoint" in message
    assert data["after"]["total"]["max_um"] < data["before"]["total"]["max_um"]


MORE_ERRORS = [
    ("line_x", ["path.length_mm=1e-6"], 2, ("line_x.toml", "zero length")),
    ("line_x", ["path.length_mm=1e9"], 2, ("path.length_mm", "less than or equal")),
    ("line_x", ["bounds=3"], 2, ("bounds", "must be a table")),
    ("line_x", ["before.-1.duration_h=2"], 2, ("before.-1",)),
    (
        "line_x",
        ["robot.thermal.node.4.name=wrist", "robot.thermal.profile.2.sections.0.to=wrist"],
        2,
        ("'wrist'", "twice"),
    ),
    ("line_x", ["robot.controller.turn_joints=[1,1,6]"], 2, ("turn_joints", "twice")),
    ("line_x", ["robot.thermal.box.feed_mm_s=[200,20]"], 2, ("box.feed_mm_s", "rise")),
    ("line_x", ["robot.name=ROBOT ü"], 2, ("m710ic50.toml", "name")),
    ("line_x", ["process.feed_mm_s=0.01"], 2, ("process.feed_mm_s",)),
    ("circle_1300", ["path.diameter_mm=1300", "boundary={shape='circle'}"], 2, ("boundary.diameter_mm", "missing")),
    ("spiral_1300", ["path.stepover_mm=20"], 2, ("path.turns", "one of them")),
    ("spiral_1300", ["boundary={shape='hexagon', corner_to_corner_mm=1450}"], 2, ("path.diameter_mm", "conflicts")),
    ("raster_1300", ["boundary={shape='circle', diameter_mm=900}"], 2, ("path.diameter_mm", "conflicts")),
    ("raster_1300", ["path.stepover_mm=1e-4"], 2, ("path.stepover_mm", "sweeps")),
    ("spiral_1300", ["path.turns=9999", "process.chord_um=0.01"], 2, ("spiral_1300.toml", "waypoints", "chord_um")),
    ("optic_raster", ["surface.radius_of_curvature_m=0.5"], 2, ("optic_raster.toml", "surface.off_axis_m")),
    (
        "optic_spiral",
        ["surface.radius_of_curvature_m=1", "surface.off_axis_m=0", "surface.conic_constant=5"],
        2,
        ("optic_spiral", "surface"),
    ),
    (
        "line_x",
        ["robot.limits.speed_deg_s=[0.001,0.001,0.001,0.001,0.001,0.001]"],
        3,
        ("waypoint", "joint", "cannot follow"),
    ),
]


@pytest.mark.parametrize(("name", "overrides", "code", "words"), MORE_ERRORS, ids=[m[1][0] for m in MORE_ERRORS])
def test_more_that_is_refused(tmp_path, name, overrides, code, words):
    sets = [a for o in overrides for a in ("--set", o)]
    refused(run("generate", f"paths/{name}.toml", "-q", "-o", tmp_path / "out", *sets), code, *words)
    assert not (tmp_path / "out").exists()


def test_a_title_is_text_and_not_markup(tmp_path):
    result = run("generate", "paths/line_y.toml", "-o", tmp_path, "--set", 'title="[/bold] x"')
    assert result.returncode == 0, result.stderr
    assert "[/bold] x" in result.stdout


def test_limits_that_bind_are_named():
    for override, word in (
        ("compensation.clamp_mm=0.1", "position clamp"),
        ("compensation.rate_um_mm=0.05", "rate limit"),
    ):
        data = json.loads(run("check", "paths/line_x.toml", "--json", "--set", override).stdout)
        message = next(f["message"] for f in data["findings"] if f["code"] == "compensation.limited")
        assert message.startswith(word), message
        assert data["compensation"]["active_limits"] > 10


def test_a_feed_that_cannot_be_written_is_taken_as_it_is_said():
    data = json.loads(run("check", "paths/line_y.toml", "--json", "--set", "process.feed_mm_s=0.1").stdout)
    assert data["verdict"] == "inside"
    assert any(f["code"] == "timing.feed" and "0.08467" in f["message"] for f in data["findings"])


@pytest.mark.parametrize("name", ["___", "- -"])
def test_a_path_file_whose_name_leaves_none_to_the_program_is_refused(tmp_path, name):
    file = tmp_path / f"{name}.toml"
    file.write_bytes((ROOT / "paths/line_y.toml").read_bytes())
    refused(run("check", file), 2, "its name gives the program's", "rename the file")
