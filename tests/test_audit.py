"""The audit in ``tests/audit`` agrees with every shipped path, and sees errors that planner and twin share."""

import ast
import re
import shutil
import sys

import naive_arm as arm
import numpy as np
import pytest
from audit import heat, poses, study
from audit.__main__ import main
from audit.curves import OffCurveError
from audit.judge import audit
from audit.listing import UnreadableError
from audit_mutants import ASKED, CHANGES, Copy, rows_outside
from command_line import run
from shipped import ROOT

PATHS = sorted(p.stem for p in (ROOT / "paths").glob("*.toml"))
SHARED = ("naive_arm", "naive_cam", "naive_errors", "naive_ls", "naive_way")  # with other judges
FILES = [*sorted((ROOT / "tests" / "audit").glob("*.py")), *(ROOT / "tests" / f"{name}.py" for name in SHARED)]
NOT_LISTED = "not known: rows that are missing or another size"
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
        if isinstance(node, ast.ImportFrom):
            assert node.module
            names.append(node.module)
        for name in names:
            own = name.split(".")[0] in ("audit", *SHARED)
            assert own or name == "numpy" or name.split(".")[0] in sys.stdlib_module_names
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


def test_every_planting_finds_its_place():
    """A text that has moved on would end the campaign."""
    edits = [(c.what, name, old) for c in (*ASKED, *CHANGES) for name, old, _ in c.edits]
    assert [what for what, name, old in edits if (ROOT / name).read_text().count(old) != 1] == []


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
    ("report.json", r'("p95_um": )[0-9.]+', r"\g<1>9.3", "band, 95 %, um"),
    ("report.json", r'("air": )[0-9.]+', r"\g<1>1.1", "budget, um"),
    ("report.json", r'("budget_um": \{\s*)"[a-z ]+": [0-9.]+,', r"\1", "budget, um"),
    ("report.json", r'("what": )"tool length"', r'\1"tool"', NOT_LISTED),
    ("report.json", r'("what": "play",\s*"size_um": \[\s*)55.0', r"\g<1>5.0", NOT_LISTED),
    ("waypoints.csv", r"(\n60,.*,)([0-9.]+)(,[0-9.]+,[0-9.]+,[0-9.]+,[0-9.]+\n)", r"\g<1>99.00\3", "band y, um"),
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
    assert "all 30 checks agree" in capsys.readouterr().out
    assert main([str(altered("report.json", r'("duration_s": )[0-9.]+', r"\g<1>7.3"))]) == 1
    output = capsys.readouterr().out
    assert "1 of 30 checks outside" in output
    assert re.search(r"^duration, s .* OUTSIDE$", output, re.M)


@pytest.mark.parametrize(("old", "new", "words"), [
    (r'("robot": )"m710ic50"', r'\1"m710ic50_identified"', "m710ic50_identified with thermal_growth: not judged"),
    (r'"sources": \[\s*"thermal_growth"', r'"sources": ["thermal_growth", "joint_zeros"', "robot file as third"),
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
    path.write_text((ROOT / "paths" / "line_y.toml").read_text().replace('pattern = "line"', 'pattern = "rose"'))
    assert main([str(output), str(path)]) == 2
    assert "path.pattern = rose: not judged" in capsys.readouterr().err


OWN_PATH = """title = "{title}"
robot = "m710ic50"
path = {{ {path} }}
frame = {{ number = 1, x_mm = 1200, y_mm = -200, z_mm = 150, w_deg = 2, r_deg = 8 }}
tool = {{ z_mm = 100, spin_deg = 12 }}
process = {{ feed_mm_s = 50 }}
before = [{{ state = "moving", feed_mm_s = 100, duration_h = 2 }}]
bounds = {{ max_um = 5 }}
"""
TRIANGLE = "G90 G21\nG0 X0 Y0 Z0\nG1 X100\nG1 X0 Y60.745\nG1 Y0.745\nM30\n"  # 100, 117 and 60 mm
ARCS = """G90 G21 G17
G0 X0 Y0 Z5
G1 Z0 F1200
G1 X60 F2000
G2 X60 Y60 I0 J30
G3 X30 Y30 Z-3 I0 J-30
G1 Y-40
G1 X31 Y-80
G0 Z5
M30
"""
BESIDE = (
    "x_mm,y_mm,z_mm,feed_mm_s,contact\n0,0,10,,0\n0,0,0,20,0\n80,0,0,50,1\n120,15,0,35,1\n120,80,-5,,1\n120,80,9,,0\n"
)
CURVE = "x_mm,y_mm,z_mm\n" + "".join(
    f"{r * np.cos(a):.3f},{r * np.sin(a):.3f},{5e-4 * r * r:.3f}\n"
    for r, a in zip(np.linspace(20, 60, 200), np.linspace(0, 9, 200), strict=True)
)
APT = (
    "UNITS/MM\nFROM/300,0,90\nRAPID\nGOTO/0,0,9\nFEDRAT/1800\nGOTO/0,0,0\nGOTO/90,0,0\nGOTO/0,9,0\nGOTO/90,0,0\nFINI\n"
)
OWN_FILES = {
    "triangle.nc": ('pattern = "gcode"', TRIANGLE),
    "arcs.nc": ('pattern = "gcode", z_mm = 7', ARCS),
    "there_and_back.apt": ('pattern = "apt", tolerance_um = 10', APT),
    "beside.csv": ('pattern = "points", through = "lines"', BESIDE),
    "curve.csv": ('pattern = "points"', CURVE),
}


def own_path(folder, file):
    """The path file of one of ``OWN_FILES``, which stands beside it."""
    keys, text = OWN_FILES[file]
    (folder / file).write_text(text)
    path = (folder / file).with_suffix(".toml")
    path.write_text(OWN_PATH.format(title=file, path=f'{keys}, file = "{file}"'))
    return path


@pytest.mark.parametrize("file", OWN_FILES)
def test_it_agrees_with_a_file_of_the_users_own(file, tmp_path):
    path = own_path(tmp_path, file)
    code, folder = generated(path, tmp_path / "out")
    assert code == 0
    checks = audit(folder, path)[1]
    assert not outside(checks)
    about_file = {c.what for c in checks if "the file's" in c.what}
    assert about_file >= {"waypoints beside the file's places, um", "tool beside the file's places, um"}
    assert len(about_file) == (2 if file == "curve.csv" else 4)
    assert next(c for c in checks if c.what == "rms after, um").apart < 0.02  # um, though half of it may be unsure


def test_config_says_which_turn_of_the_wrist_is_meant(tmp_path):
    path = own_path(tmp_path, "triangle.nc")
    path.write_text(path.read_text().replace("r_deg = 8", "r_deg = 177").replace("spin_deg = 12", "spin_deg = 0"))
    code, folder = generated(path, tmp_path / "out")
    assert code == 0
    assert not outside(audit(folder, path)[1])


@pytest.fixture(scope="module")
def own_outputs(tmp_path_factory):
    """A folder with the triangle and the arcs, their path files and outputs."""
    folder = tmp_path_factory.mktemp("own")
    for file in ("triangle.nc", "arcs.nc"):
        assert generated(own_path(folder, file), folder / f"{file}.out")[0] == 0
    return folder


@pytest.mark.parametrize(("file", "name", "old", "new", "what"), [
    ("triangle.nc", "triangle.nc.out/TRIANGLE.LS", r"(P\[12\]\{[^}]*Y =\s+-?[0-9]+\.[0-9])\d", r"\g<1>{digit}",
     {"errors after, um", "tool off the file's lines, um"}),
    ("triangle.nc", "triangle.nc.out/waypoints.csv", r"(\n12,[^,]+,[^,]+,-?[0-9]+\.[0-9])\d", r"\g<1>{digit}",
     {"waypoints off the file's lines, um"}),
    ("triangle.nc", "triangle.nc", "G1 X100", "G1 X100.1",
     {"waypoints beside the file's places, um", "tool beside the file's places, um"}),
    ("triangle.nc", "triangle.nc", "M30", "G1 X1\nM30", {"tool beside the file's places, um"}),
    ("arcs.nc", "arcs.nc", "G2 X60", "G3 X60", {"waypoints off the file's lines, um"}),
    ("arcs.nc", "arcs.nc", "Z-3", "Z-2.96", {"waypoints off the file's lines, um"}),
    ("arcs.nc", "arcs.nc", "G2 X60 Y60 I0 J30", "G1 X60 Y60", {"tool off the file's lines, um"}),
    ("arcs.nc", "arcs.nc", "F2000", "F1900", {"fastest on the part over the feed"}),
    ("arcs.nc", "arcs.nc", "G1 Z0", "G0 Z0", {"waypoints wrongly on or off the part"}),
    ("arcs.nc", "arcs.toml", "z_mm = 7", "z_mm = 7.03", {"waypoints off the file's lines, um"}),
    ("arcs.nc", "arcs.toml", "spin_deg = 12", "spin_deg = 12.1", {"tool turned about its axis, mdeg"}),
])  # fmt: skip
def test_what_is_apart_from_the_users_file_is_seen(own_outputs, tmp_path, file, name, old, new, what):
    shutil.copytree(own_outputs, tmp_path, dirs_exist_ok=True)
    text = (tmp_path / name).read_bytes().decode("latin-1")
    match = re.search(old, text)
    assert match
    if "{digit}" in new:  # 30 um
        new = new.format(digit=(int(match[0][-1]) + 3) % 10)
    (tmp_path / name).write_bytes(re.sub(old, new, text, count=1).encode("latin-1"))
    assert what <= {c.what for c in outside(audit(tmp_path / f"{file}.out", (tmp_path / file).with_suffix(".toml"))[1])}


def test_a_corner_that_is_cut_is_seen(tmp_path):
    path = own_path(tmp_path, "triangle.nc")
    wanted = path.read_text()
    path.write_text(wanted.replace('"gcode"', '"gcode", tolerance_um = 30'))
    assert generated(path, tmp_path / "out")[0] == 0
    assert not outside(audit(tmp_path / "out", path)[1])
    path.write_text(wanted)
    seen = {c.what for c in outside(audit(tmp_path / "out", path)[1])}
    assert seen >= {"waypoints off the file's lines, um", "waypoints beside the file's places, um"}


@pytest.mark.parametrize(("name", "old", "new", "words"), [
    ("triangle.nc", "G1 X100", "G1 X100 B3", "the audit's reader does not read it: line 3"),
    ("triangle.nc", "G90", "M30", "it has no line on the part"),
    ("triangle.toml", "triangle.nc\" }", "nowhere.nc\" }", "No such file"),
    ("triangle.toml", "bounds", "boundary = { shape = \"circle\" }\nbounds", "boundary: not judged"),
    ("triangle.toml", "bounds", "surface = { kind = \"conic\" }\nbounds", "surface.kind = conic: not judged"),
    ("triangle.toml", "feed_mm_s = 50", "feed_mm_s = 50, moves = \"arcs\"", "process.moves: not judged"),
])  # fmt: skip
def test_what_it_cannot_judge_of_own_files_is_told_in_a_sentence(own_outputs, tmp_path, capsys, name, old, new, words):
    shutil.copytree(own_outputs, tmp_path, dirs_exist_ok=True)
    text = (tmp_path / name).read_text()
    assert old in text
    (tmp_path / name).write_text(text.replace(old, new, 1))
    assert main([str(tmp_path / "triangle.nc.out"), str(tmp_path / "triangle.toml")]) == 2
    output = capsys.readouterr()
    assert words in output.err
    assert output.err.count("\n") == 1


def test_a_file_that_says_how_the_tool_stands_is_not_judged(tmp_path, capsys):
    path = own_path(tmp_path, "curve.csv")
    text = CURVE.replace("\n", ",0,0,1\n").replace("z_mm,0,0,1", "z_mm,i,j,k")
    (tmp_path / "curve.csv").write_text(text)
    assert generated(path, tmp_path / "out")[0] == 0
    assert main([str(tmp_path / "out"), str(path)]) == 2
    assert "it says how the tool stands" in capsys.readouterr().err


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
    position, rotation = poses.of_matrices(arm.frames_at(pendant)[-1])
    np.testing.assert_allclose(position[0], pose[:3], atol=6e-4)  # mm
    wanted = arm.rotation(*np.radians(pose[3:])[:, None])
    np.testing.assert_allclose(rotation, wanted, atol=2e-6)
    letters, turns = arm.posture(pendant)
    assert f"{' '.join(letters[0])}, {', '.join(map(str, turns[0]))}" == config


def test_its_hot_arm_gives_the_figures_of_the_study():
    """Lines 1654 and 1627: on the circle X is 45 to 122 um, on the Y axis Y ends at 38 um."""
    angle = np.linspace(0, 2 * np.pi, 361)
    circle = np.column_stack([1350 + 650 * np.cos(angle), -30 + 650 * np.sin(angle), 203 + 0 * angle])
    down = np.tile(np.diag([1.0, -1.0, -1.0]), (len(angle), 1, 1))
    rise = np.array([[study.REFERENCE_RISE_K[n] for n in study.NODES]])
    pendant = arm.pendant_angles(circle, down)
    hot = arm.frames_at(pendant, np.repeat(arm.growth_of_rises(rise), len(angle), axis=0))[-1]
    grown = hot[:, :3, 3] - circle
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
    for seconds, v in zip(np.diff(time), speed, strict=True):
        fine.append(rise)
        for _ in range(400):
            rise = rise + seconds / 400 * (law.steady("moving", [v])[0] - rise) / law.tau
    np.testing.assert_allclose(law.along(np.full(5, 2.0), time, speed), [*fine, rise], atol=1e-4)  # K
