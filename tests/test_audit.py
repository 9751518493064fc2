"""The audit in ``tests/audit`` agrees with every shipped path, and sees errors that planner and twin share."""

import ast
import re
import shutil
import sys

import numpy as np
import pytest
from audit_mutants import ASKED, Copy, rows_outside
from command_line import run
from shipped import ROOT

from tests.audit import arm, heat, study
from tests.audit.__main__ import main
from tests.audit.curves import OffCurveError
from tests.audit.judge import audit
from tests.audit.listing import UnreadableError

PATHS = sorted(p.stem for p in (ROOT / "paths").glob("*.toml"))
FILES = sorted((ROOT / "tests" / "audit").glob("*.py"))
EVERYTHING = ROOT / "tests" / "audit" / "everything.toml"


def generated(file, folder, *options):
    """The output folder of a path file, and the exit code."""
    result = run("generate", file, "-o", folder, "--robot", ROOT / "robots" / "m710ic50.toml", *options)
    assert (folder / "report.json").is_file(), result.stderr
    return result.returncode, folder


def outside(checks):
    return [c for c in checks if not c.kept]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_it_imports_numpy_and_nothing_of_the_package(path):
    for node in ast.walk(ast.parse(path.read_text())):
        names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
        names += [node.module] if isinstance(node, ast.ImportFrom) else []
        for name in names:
            assert name == "numpy" or name.startswith("tests.audit") or name.split(".")[0] in sys.stdlib_module_names
    assert "importlib" not in path.read_text()
    assert "robots/" not in path.read_text()  # nor what the package takes its constants from


@pytest.mark.parametrize("name", PATHS)
def test_it_agrees_with_every_shipped_path(name, tmp_path):
    code, folder = generated(ROOT / "paths" / f"{name}.toml", tmp_path / "out")
    assert code == 0
    title, checks = audit(folder)
    assert title == name
    assert not outside(checks)


def test_it_agrees_with_a_path_that_has_something_of_everything(tmp_path):
    code, folder = generated(EVERYTHING, tmp_path / "out")
    assert code == 0
    assert not outside(audit(folder, EVERYTHING)[1])


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    return Copy(tmp_path_factory.mktemp("copy"))


@pytest.mark.parametrize("change", ASKED, ids=lambda change: change.what)
def test_what_planner_and_twin_believe_together_is_seen(change, copy):
    made, judged, words = copy.run(change)
    assert made == 0, "the package notices nothing"
    assert judged == 1, words
    assert rows_outside(words)


@pytest.fixture(scope="module")
def output(tmp_path_factory):
    """An output that is right, in three lines of path."""
    folder = tmp_path_factory.mktemp("right")
    assert generated(ROOT / "paths" / "line_y.toml", folder / "out")[0] == 0
    return folder / "out"


@pytest.fixture
def altered(output, tmp_path):
    """A function that makes a copy of that output, with a text replaced in one of its files."""

    def alter(name, old, new):
        folder = tmp_path / "out"
        shutil.copytree(output, folder)
        text = (folder / name).read_bytes().decode("latin-1")
        assert re.search(old, text), old
        (folder / name).write_bytes(re.sub(old, new, text, count=1).encode("latin-1"))
        return folder

    return alter


@pytest.mark.parametrize(("name", "old", "new", "what"), [
    ("LINE_Y.LS", r"(P\[60\]\{[^}]*Z =\s+203\.00)\d", r"\g<1>9", "errors after, um"),
    ("LINE_Y.LS", r"(L P\[60\]) 200mm/sec", r"\1 190mm/sec", "times of waypoints, s"),
    ("LINE_Y.LS", r"(L P\[60\] 200mm/sec) CNT100", r"\1 FINE", "duration, s"),
    ("LINE_Y.LS", r"(P\[60\]\{[^}]*CONFIG : 'N U T), 0", r"\1, 1", "positions with another CONFIG"),
    ("LINE_Y.LS", r"(P\[60\]\{[^}]*R = +)0\.000", r"\g<1>0.100", "tool turned about its axis, mdeg"),
    ("waypoints.csv", r"(\n60,[0-9.]+,)1350\.000000", r"\g<1>1350.000010", "waypoints off the closed form, um"),
    ("waypoints.csv", r"(\n60,([^,]+,){10})([0-9.]+)", r"\g<1>11.10000", "rises along the path, K"),
    ("waypoints.csv", r"(\n60,([^,]+,){15})1", r"\g<1>0", "waypoints wrongly on or off the part"),
    ("report.json", r'("after": \{\s*"total": \{\s*"max_um": )[0-9.]+', r"\g<1>0.31", "largest total after, um"),
    ("report.json", r'("after": \{\s*"total": \{[^}]*"rms_um": )[0-9.]+', r"\g<1>0.2", "rms after, um"),
    ("report.json", r'("after": \{\s*"total": \{[^}]*"p99_um": )[0-9.]+', r"\g<1>0.2", "99 % of the length after, um"),
    ("report.json", r'("before": \{\s*"total": \{\s*"max_um": )[0-9.]+', r"\g<1>8.8", "largest before, um"),
    ("report.json", r'("duration_s": )[0-9.]+', r"\g<1>7.3", "duration, s"),
])  # fmt: skip
def test_what_was_altered_afterwards_is_seen(altered, name, old, new, what):
    assert what in [c.what for c in outside(audit(altered(name, old, new))[1])]


@pytest.mark.parametrize(("old", "new"), [
    (r"(L P\[60\] 200mm/sec CNT100) ", r"\1 ACC50"),
    (r"  9:  UFRAME_NUM=0 ;", r"  9:  OVERRIDE=50% ;"),
    (r"(P\[60\]\{\s*GP1:\s*UF : )0", r"\g<1>1"),
    (r"L P\[60\]", r"L P[61]"),
    (r"P\[60\]\{", r"P[59]{"),
    (r"(P\[60\]\{[^}]*)mm,", r"\g<1>deg,"),
])  # fmt: skip
def test_nothing_in_a_program_goes_unread(altered, old, new):
    with pytest.raises(UnreadableError):
        audit(altered("LINE_Y.LS", old, new))


def test_a_waypoint_that_goes_back_is_no_walk_along_the_path(altered):
    with pytest.raises(OffCurveError, match="do not go along piece 2"):
        audit(altered("waypoints.csv", r"(\n60,[^,]+,1350\.000000,)-?[0-9.]+", r"\g<1>600.000000"))


def test_the_command_prints_a_table_and_exits_by_what_it_finds(output, altered, capsys):
    assert main([str(output)]) == 0
    assert "all 24 checks agree" in capsys.readouterr().out
    assert main([str(altered("report.json", r'("duration_s": )[0-9.]+', r"\g<1>7.3"))]) == 1
    output = capsys.readouterr().out
    assert "1 of 24 checks outside" in output
    assert re.search(r"^duration, s .* OUTSIDE$", output, re.M)


@pytest.mark.parametrize(("old", "new", "words"), [
    (r'("robot": )"m710ic50"', r'\1"m710ic50_identified"', "not identified arms"),
    (r'"sources": \[\s*"thermal_growth"', r'"sources": ["thermal_growth", "joint_zeros"', "joint_zeros: not judged"),
    (r'"overrides": \[', r'"overrides": ["process.feed_mm_s=100"', "process.feed_mm_s=100: not judged"),
    (r'"file": "LINE_Y.LS"', r'"file": "LINE_Z.LS"', "LINE_Z.LS was not written"),
    (r'"program"', r'"programme"', "not for predict, correct or others"),
    (r'"wrist": ', r'"base": 1.0, "wrist": ', "another heat model"),
    (r'"title": "', r'"title": "Not ', "not the path file of 'Not The study"),
])  # fmt: skip
def test_what_it_has_no_oracle_for_is_told_in_a_sentence(altered, capsys, old, new, words):
    assert main([str(altered("report.json", old, new))]) == 2
    output = capsys.readouterr()
    assert words in output.err
    assert output.err.count("\n") == 1
    assert not output.out


@pytest.mark.parametrize(("lines", "words"), [
    ('[ambient]\nkind = "constant"\nvalue_degC = 25', "ambient: not judged"),
    ('[[cycle]]\nstate = "moving"', "cycle: not judged"),
    ('[posture]\nwrist = "flip"', "posture: not judged"),
    ('[[before]]\nstate = "moving"\nrepeat = 3', "repeat: not judged"),
    ('[boundary]\nshape = "polygon"', "boundary.shape = polygon: not judged"),
    ("[process.x]", "process.x: not judged"),
    ("[compensation.average_over]", "compensation.average_over: not judged"),
])  # fmt: skip
def test_a_path_file_that_says_more_is_not_judged(output, tmp_path, capsys, lines, words):
    path = tmp_path / "path.toml"
    path.write_text((ROOT / "paths" / "line_y.toml").read_text() + "\n" + lines + "\n")
    assert main([str(output), str(path)]) == 2
    assert words in capsys.readouterr().err


def test_a_pattern_without_a_closed_form_is_not_judged(output, tmp_path, capsys):
    path = tmp_path / "path.toml"
    path.write_text((ROOT / "paths" / "line_y.toml").read_text().replace('pattern = "line"', 'pattern = "points"'))
    assert main([str(output), str(path)]) == 2
    assert "path.pattern = points: not judged" in capsys.readouterr().err


def test_the_command_says_what_it_wants(capsys, tmp_path):
    for arguments in ([], ["--help"], ["a", "b", "c"], [str(tmp_path)], [str(tmp_path / "nowhere")]):
        assert main(arguments) == 2
    assert "give an output folder" in capsys.readouterr().err


#: pendant angles, X Y Z and W P R of the flange, CONFIG: from two independent forms of the arm
POSES = (
    ((10, 20, -15, 30, -60, 45), (1513.4993, 189.9246, 569.3554, 150.7201, 11.7854, 63.7208), "N U T, 0, 0, 0"),
    ((10, 20, -15, 210, 60, 225), (1513.4993, 189.9246, 569.3554, 150.7201, 11.7854, 63.7208), "F U T, 0, 1, 1"),
    ((-170, -40, 60, -200, 30, 190), (-91.841, -46.583, 1721.479, -2.5082, -58.9644, 24.4350), "F U B, 0, -1, 1"),
    ((20, -80, -150, 10, 40, 0), (-1474.831, -516.008, -667.117, -170.8266, 19.3867, 28.1068), "F D B, 0, 0, 0"),
)


@pytest.mark.parametrize(("joints", "pose", "config"), POSES)
def test_its_arm_is_at_published_poses(joints, pose, config):
    pendant = np.radians([joints])
    position, rotation = arm.flange(pendant)
    np.testing.assert_allclose(position[0], pose[:3], atol=6e-4)  # mm
    wanted = arm.rotation(*np.radians(pose[3:])[:, None])
    np.testing.assert_allclose(rotation, wanted, atol=2e-6)
    letters, turns = arm.config(pendant)
    assert f"{' '.join(letters[0])}, {', '.join(map(str, turns[0]))}" == config


def test_its_hot_arm_gives_the_figures_of_the_study():
    """Lines 1654 and 1627: on the circle X is 45 to 122 um, on the Y axis Y ends at 38 um."""
    angle = np.linspace(0, 2 * np.pi, 361)
    circle = np.column_stack([1350 + 650 * np.cos(angle), -30 + 650 * np.sin(angle), 203 + 0 * angle])
    down = np.tile(np.diag([1.0, -1.0, -1.0]), (len(angle), 1, 1))
    rise = np.array([[study.REFERENCE_RISE_K[n] for n in study.NODES]])
    pendant = arm.pendant_angles(circle, down)
    grown = arm.flange(pendant, np.repeat(arm.growth_of_rises(rise), len(angle), axis=0))[0] - circle
    assert 1e3 * grown[:, 0].max() == pytest.approx(122, abs=1)
    assert 1e3 * grown[:, 0].min() == pytest.approx(45, abs=1)
    assert 1e3 * np.abs(grown[:, 1]).max() == pytest.approx(39, abs=1)


def test_its_heat_ends_the_reference_at_the_studys_rises():
    reference = heat.fitted().after([("moving", 200.0, 1.0, 6 * 3600.0)])
    np.testing.assert_allclose(reference, [11, 3.9, 13, 3, 2.3], rtol=1e-12)


def test_its_heat_along_a_program_is_the_equation_integrated():
    law, rng = heat.fitted(), np.random.default_rng(3)
    time, speed = np.concatenate([[0.0], np.cumsum(rng.uniform(1, 200, 60))]), rng.uniform(20, 200, 60)
    rise, fine = np.full(5, 2.0), []
    for seconds, v in zip(np.diff(time), speed):
        fine.append(rise)
        for _ in range(400):
            rise = rise + seconds / 400 * (law.steady("moving", [v])[0] - rise) / law.tau
    np.testing.assert_allclose(law.along(np.full(5, 2.0), time, speed), [*fine, rise], atol=1e-4)  # K
