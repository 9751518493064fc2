"""What ``inspect`` says of a program, and the frames it needs."""

import json
import re
from dataclasses import replace
from pathlib import Path

import ls_text
import numpy as np
import pytest
from command_line import refused, run
from corrected import MANY
from numpy.testing import assert_allclose
from shipped import ROOT

from compgen import fanuc
from compgen.cli.commands.inspect import program_lines
from compgen.core.exceptions import InputError
from compgen.core.units import DEG
from compgen.fanuc.analysis import inspection
from compgen.fanuc.analysis.correctable import read_scope
from compgen.fanuc.analysis.poses import program_poses
from compgen.fanuc.analysis.program_context import ProgramContext
from compgen.fanuc.analysis.traversal import read_traversal
from compgen.fanuc.analysis.unsafe_statements import unsafe_statements
from compgen.fanuc.listing.listing import edited, other_statements
from compgen.pipelines.files.robot_file import load_robot
from compgen.program.frames import default_frames, load_frames

SAMPLES = ROOT.parent / "shared" / "fanuc" / "samples"

HEAD = """/PROG  DEMO
/ATTR
COMMENT\t\t= "a demo";
DEFAULT_GROUP\t= 1,*,*,*,*;
/MN
"""
PLACE = """P[{n}]{{
   GP1:
\tUF : {uf}, UT : {ut},\t\tCONFIG : '{config}',
\tX = {x:9.3f}  mm,\tY = {y:9.3f}  mm,\tZ =   203.000  mm,
\tW =   180.000 deg,\tP =     0.000 deg,\tR =     0.000 deg
}};
"""


def program(moves, *places):
    lines = "".join(f"{i:4d}:{m}\n" for i, m in enumerate(moves, 1))
    body = ""
    for n, place in enumerate(places, 1):
        full = {"n": n, "uf": 0, "ut": 0, "config": "N U T, 0, 0, 0", "x": 1300.0, "y": 0.0, **place}
        body += PLACE.format(**full)
    return fanuc.loads(f"{HEAD}{lines}/POS\n{body}/END\n".encode())


def inspected(moves, *places):
    return inspection.inspect(program(moves, *places), load_robot("m710ic50"), default_frames())


def test_lengths_and_times_of_a_small_program():
    found = inspected(
        ["J P[1] 10% FINE    ;", "L P[2] 100mm/sec CNT50    ;", "L P[3] 60cm/min FINE    ;", "  WAIT   1.00(sec) ;",
         "//L P[1] 5mm/sec FINE    ;"],
        {}, {"x": 1400.0}, {"x": 1400.0, "y": 20.0}, {"y": 30.0},
    )  # fmt: skip
    assert found["motions"] == {"J": 1, "L": 2}
    assert found["disabled_motions"] == 1
    assert found["path_length_mm"] == pytest.approx(120)
    assert found["duration_s"] == pytest.approx(1.0 + 2.0)
    assert found["positions"]["unused"] == [4]
    assert found["postures"] == {"N U T": 4}
    assert found["limits"]["J1"]["room_deg"] == pytest.approx(180 - np.degrees(np.arctan2(30, 1300)), abs=1e-6)
    assert found["limits"]["J1"]["position"] == 4
    wrist = np.hypot(1400, 20) - 150, 203 + 175  # of P[3], from the axis of joint 2, the tool pointing down
    assert found["limits"]["reach"]["room_mm"] == pytest.approx(870 + np.hypot(1016, 170) - np.hypot(*wrist), abs=1e-3)
    assert found["limits"]["reach"]["position"] == 3
    assert found["unsafe"] == []


@pytest.mark.parametrize(
    ("moves", "length", "duration", "words"),
    [
        ([], 0.0, 0.0, "path: no line and no arc"),
        (["J P[1] 10% FINE    ;"], 0.0, None, "path: no line and no arc"),
        (["L P[1] 100mm/sec FINE    ;"], None, None, "path: its length is not known: of no line or arc are both ends"),
        (["L P[1] 2.0sec FINE    ;"], None, 2.0, "path: its length is not known: of no line or arc are both ends"),
        (["J P[1] 10% FINE    ;", "L P[2] R[1]mm/sec FINE    ;"], 20.0, None, "path 20.0 mm, its time is not known"),
        (["J P[1] 10% FINE    ;", "L P[2] 10mm/sec FINE    ;"], 20.0, 2.0, "path 20.0 mm, 2.0 s at programmed speeds"),
    ],
)
def test_lengths_and_times_that_nobody_knows_are_no_numbers(moves, length, duration, words):
    """0.0 was the record's word for them; and of joint motions alone the screen sent the reader to nothing below."""
    report = inspected(moves, {}, {"y": 20.0})
    assert (report["path_length_mm"], report["duration_s"]) == (pytest.approx(length), pytest.approx(duration))
    assert any(line.startswith(f"{words}; motions without") for line in program_lines(report))


def test_a_circle_motion_is_as_long_as_its_arc():
    found = inspected(
        ["J P[1] 10% FINE    ;", "C P[2]    \n    :  P[3] 100mm/sec FINE    ;"],
        {"x": 1300.0, "y": 100.0}, {"x": 1400.0, "y": 0.0}, {"x": 1300.0, "y": -100.0},
    )  # fmt: skip
    assert found["path_length_mm"] == pytest.approx(100 * np.pi)


def test_a_shared_and_an_undefined_position_are_named():
    found = inspected(["J P[1] 10% FINE    ;", "L P[1] 5mm/sec FINE    ;", "L P[7] 5mm/sec FINE    ;"], {})
    assert found["positions"]["shared"] == [1]
    assert found["positions"]["undefined"] == [7]
    assert [(u["line"], u["reason"]) for u in found["unsafe"]] == [(8, "P[7] is used but not defined")]


@pytest.mark.parametrize(
    ("move", "word"),
    [
        ("L PR[4:home] 5mm/sec FINE    ;", "PR[4:home]: its value is not in the file"),
        ("L P[R[2]] 5mm/sec FINE    ;", "P[R[2]]: its value is not in the file"),
        ("L P[1] 5mm/sec FINE INC    ;", "INC"),
        ("L P[1] 5mm/sec FINE Offset,PR[3]    ;", "Offset is added"),
        ("L P[1] 5mm/sec FINE Tool_Offset,PR[3]    ;", "Tool_Offset is added"),
        ("L P[1] 5mm/sec FINE COORD PTH    ;", "COORD"),
        ("L P[1] 5mm/sec FINE Skip,LBL[3]    ;", "Skip"),
        ("  UFRAME[1]=PR[3] ;", "UFRAME[] is written"),
        ("  P[1]=PR[3] ;", "a position is written"),
    ],
)
def test_unsafe_statements_are_told_with_their_line(move, word):
    found = unsafe_statements(program(["J P[1] 10% FINE    ;", move], {}))
    assert [(u.line, word in u.reason) for u in found] == [(7, True)], found


@pytest.mark.parametrize(
    "move",
    ["L P[1] 5mm/sec CNT100 ACC50 PTH    ;", "  !UFRAME[1]=PR[3] ;", "  PR[1]=P[1] ;", "//L PR[4] 5mm/sec FINE    ;",
     "L P[1:INC Offset] 5mm/sec FINE    ;", "  UFRAME_NUM=1 ;", "  OFFSET CONDITION PR[3] ;"],
)  # fmt: skip
def test_safe_statements_are_not_told(move):
    assert unsafe_statements(program(["J P[1] 10% FINE    ;", move], {})) == ()


@pytest.mark.parametrize("option", ["Offset", "Tool_Offset", "VOFFSET"])
def test_a_condition_is_told_where_its_option_stands_without_a_register(option):
    condition = f"  {option.upper()} CONDITION PR[3] ;"
    for move, told in ((f"L P[1] 5mm/sec FINE {option}", True), (f"L P[1] 5mm/sec FINE {option},PR[1]", False),
                       ("L P[1] 5mm/sec FINE", False), (f"//L P[1] 5mm/sec FINE {option}", False)):  # fmt: skip
        findings = unsafe_statements(program(["J P[1] 10% FINE    ;", condition, f"{move} ;"], {}))
        assert [u.text for u in findings if u.line == 7] == ([condition.strip(" ;")] if told else [])


def test_places_that_palletizing_computes_are_motions():
    moves = [
        "J P[1] 10% FINE    ;",
        "  PALLETIZING-B_1 ;",
        "J PAL_1[A_1] 70% CNT50    ;",
        "L PAL_1[BTM] 5mm/sec FINE ;",
    ]
    assert inspected(moves, {})["motions"] == {"J": 2, "L": 1}
    reasons = [u.reason for u in unsafe_statements(program(moves, {}))]
    assert reasons == ["PAL_1[A_1]: its value is not in the file", "PAL_1[BTM]: its value is not in the file"]


@pytest.mark.parametrize("via", ["P[2] ACC50", "P[2] Tool_Offset,PR[4:a name]", "P[2] Offset", "P[2:via] Wjnt"])
@pytest.mark.parametrize("wrap", ["    \n    :  ", " "])
def test_options_of_a_via_point_belong_to_the_circle_motion(via, wrap):
    moves = ["J P[1] 10% FINE    ;", f"C {via}{wrap}P[3] 100mm/sec FINE ACC20    ;"]
    places: tuple[dict[str, float], ...] = {}, {"x": 1400.0, "y": 100.0}, {"x": 1500.0}
    read = program(moves, *places)
    assert read.motions.position[1] == (2, 3)
    assert read.motions.options[1] == f"{via.split(' ', 1)[1]} ACC20"
    assert inspected(moves, *places)["path_length_mm"] == pytest.approx(100 * np.pi)
    assert bool(unsafe_statements(read)) is ("Offset" in via)


WRAPPED = [
    "C P[2]@P[3]@100mm/sec FINE ACC20",
    "C P[2]@P[3] 100mm/sec@FINE ACC20",
    "C P[2]@P[3]@100mm/sec@FINE@ACC20",
    "C P[2]@@P[3] 100mm/sec FINE ACC20",
    "C P[2] P[3]@100mm/sec@FINE ACC20",
    "L P[2]@100mm/sec@FINE@ACC20",
    "L P[2] 100mm/sec@FINE ACC20",
]


@pytest.mark.parametrize("text", WRAPPED)
@pytest.mark.parametrize("via", ["", " ACC50"])
def test_a_motion_wrapped_over_several_lines_is_read_as_one(text, via):
    whole = text.replace("P[2]", f"P[2]{via}") if text.startswith("C") else text
    places: tuple[dict[str, float], ...] = {}, {"x": 1400.0, "y": 100.0}, {"x": 1500.0}
    plain, read = (
        program(["J P[1] 10% FINE    ;", f"{whole.replace('@', wrap)}    ;"], *places)
        for wrap in (" ", "    \n    :  ")
    )
    for column in ("position", "speed", "termination", "letter"):
        assert getattr(read.motions, column) == getattr(plain.motions, column)
    assert read.motions.termination[1] == "FINE"
    assert read.motions.options[1] == f"{via if text.startswith('C') else ''} ACC20".strip()
    assert not unsafe_statements(read)


def test_untaught_open_and_empty_positions_are_told():
    text = program(["J P[1] 10% FINE    ;"], {}, {"config": ""}, {"uf": "F", "ut": "F"}).data
    text = text.replace(b"X =  1300.000", b"X = ********", 1)
    reasons = [u.reason for u in unsafe_statements(fanuc.loads(text))]
    assert any("not taught" in r for r in reasons)
    assert any("does not name a posture" in r for r in reasons)
    assert any("active at run time" in r for r in reasons)


@pytest.mark.parametrize(
    ("header", "said"),
    [("AVOIDANCE   : TRUE", True), ("AVOIDANCE : TRUE", True), ("avoidance:true", True), ("AVOIDANCE : FALSE", False)],
)
@pytest.mark.parametrize("tag", [b"/MN", b"/mn"])
def test_singularity_avoidance_in_the_head_is_told_in_any_print(header, said, tag):
    data = program(["J P[1] 10% FINE    ;"], {}).data
    data = data.replace(b"/MN", b"/APPL\n  ENABLE_SINGULARITY_" + header.encode() + b";\n" + tag)
    found = [u for u in unsafe_statements(fanuc.loads(data)) if "singularity avoidance" in u.reason]
    assert [u.line for u in found] == ([6] if said else [])


def test_a_mask_without_a_group_is_told():
    text = program(["J P[1] 10% FINE    ;"], {}).data.replace(b"= 1,*,*", b"= *,*,*")
    assert [u.reason for u in unsafe_statements(fanuc.loads(text))] == ["no motion group"]


def test_frames_of_a_table_move_positions_into_world(tmp_path):
    (tmp_path / "f.toml").write_text(
        "[uframe.2]\nx_mm=1000\ny_mm=0\nz_mm=0\nw_deg=0\np_deg=0\nr_deg=90\n"
        "[utool.3]\nx_mm=0\ny_mm=0\nz_mm=150\nw_deg=0\np_deg=0\nr_deg=0\n"
    )
    frames = load_frames(str(tmp_path / "f.toml"))
    robot = load_robot("m710ic50")
    places = program_poses(program(["J P[1] 10% FINE    ;"], {"uf": 2, "ut": 3, "x": 50.0, "y": -300.0}), robot, frames)
    assert_allclose(places.tcp.position[0], [1.3, 0.05, 0.203], atol=1e-12)
    from compgen.robot.kinematics import flange_pose

    assert_allclose(flange_pose(robot, places.theta).act(np.array([0, 0, 0.15]))[0], [1.3, 0.05, 0.203], atol=1e-9)


def test_joint_form_positions_are_taken_as_they_are():
    text = program(["J P[1] 10% FINE    ;"], {}).data.decode()
    start = text.index("\tX =")
    end = text.index("\n};")
    joints = ",".join(f"\n\tJ{i}= {v:9.3f} deg" for i, v in enumerate((10, 20, -15, 30, -60, 45), 1))
    listing = fanuc.loads((text[:start] + joints + text[end:]).encode())
    robot = load_robot("m710ic50")
    places = program_poses(listing, robot, default_frames())
    assert_allclose(robot.to_pendant(places.theta)[0] / DEG, [10, 20, -15, 30, -60, 45], atol=1e-12)


BACKUP = """[*SYSTEM*]$MNUFRAME  Storage: SHADOW  Access: RW  : ARRAY[1,9] OF POSITION
    [1,1] =
  Group: 1   Config: N D B, 0, 0, 0
  X:  1200.000   Y:   -30.000   Z:      .500
  W:     0.000   P:     0.000   R:    90.000
    [1,2] = 'part' Uninitialized
[*SYSTEM*]$MNUFRAMENUM  Storage: SHADOW  Access: RW  : ARRAY[1] OF BYTE
    [1] = 1
[*SYSTEM*]$MNUTOOL  Storage: SHADOW  Access: RW  : ARRAY[1,10] OF POSITION
    [1,3] =  'spindle' Group: 1   Config: N D B, 0, 0, 0
  X:     0.000   Y:     0.000   Z:   250.000
  W:     0.000   P:    90.000   R:     0.000
"""


@pytest.mark.parametrize("ends", ["\n", "\r\n"])
def test_frames_of_a_controllers_backup(tmp_path, ends):
    (tmp_path / "SYSFRAME.VA").write_bytes(BACKUP.replace("\n", ends).encode())
    frames = load_frames(str(tmp_path / "SYSFRAME.VA"))
    assert set(frames.uframe) == {0, 1}
    assert set(frames.utool) == {0, 3}
    assert_allclose(frames.uframe[1].position, [1.2, -0.03, 0.0005])
    assert_allclose(frames.uframe[1].rotation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    assert_allclose(frames.utool[3].rotation @ [0, 0, 1], [1, 0, 0], atol=1e-15)


def test_names_of_a_backup_may_say_anything(tmp_path):
    text = BACKUP.replace("'spindle'", "'X: 7.000 [1,4] = Y:'").replace("[1,1] =", "[1,1] = 'P[2] W: 90.000'")
    (tmp_path / "SYSFRAME.VA").write_text(text)
    frames = load_frames(str(tmp_path / "SYSFRAME.VA"))
    assert (set(frames.uframe), set(frames.utool)) == ({0, 1}, {0, 3})
    assert_allclose(frames.utool[3].position, [0, 0, 0.25])
    assert_allclose(frames.uframe[1].position, [1.2, -0.03, 0.0005])


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ("1200.000", "1.200E+03", "$MNUFRAME[1,1]: 'X: 1.200E+03 Y: -30.000"),
        ("1200.000", "1,200.000", "is not X Y Z W P R as a controller prints them"),
        ("1200.000", "1200,000", "is not X Y Z W P R"),
        ("1200.000", "********", "is not X Y Z W P R"),
        ("1200.000", "1200000.000", "beyond 100000"),
        ("  Z:   250.000", "", "$MNUTOOL[1,3]"),
        ("90.000   R:     0.000\n", "90.000   R:     0.0", "$MNUTOOL[1,3]"),  # cut off in a number
        ("90.000   R:     0.000\n", "90.000   R:     0", "$MNUTOOL[1,3]"),
        ("[1,2] = 'part' Uninitialized", "[1,1] =\n  X: 0.000 Y: 0.000 Z: 0.000 W: 0.000 P: 0.000 R: 0.000", "twice"),
    ],
)
def test_a_backup_whose_numbers_are_not_a_controllers_is_refused(old, new, word, tmp_path):
    assert old in BACKUP
    (tmp_path / "SYSFRAME.VA").write_text(BACKUP.replace(old, new))
    with pytest.raises(InputError) as caught:
        load_frames(str(tmp_path / "SYSFRAME.VA"))
    assert word in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "SYSFRAME.VA"))


@pytest.mark.parametrize(
    ("text", "word"),
    [("[uframe.0]\n", "uframe.0"), ("[uframe.1]\nx_mm=1\n", "z_mm, w_deg, p_deg, r_deg: missing; add y_mm = 0, "),
     ("[frame.1]\n", "frame: unknown key"),
     ("[utool.1]\nx=1\n", "utool.1.x: unknown key"), ("[utool.1]\nx_mm='a'\n", "utool.1.x_mm"), ("x", "not TOML")],
)  # fmt: skip
def test_wrong_frames_tables_are_refused(tmp_path, text, word):
    (tmp_path / "f.toml").write_text(text)
    with pytest.raises(InputError, match=r"f\.toml") as caught:
        load_frames(str(tmp_path / "f.toml"))
    assert word in str(caught.value)


def test_inspect_on_the_command_line(tmp_path):
    demo = tmp_path / "DEMO.LS"
    demo.write_bytes(program(["J P[1] 10% FINE    ;", "L PR[2] 5mm/sec FINE    ;"], {}, {"x": 2500.0}).data)
    shown = run("inspect", demo)
    assert shown.returncode == 0
    assert "line 7" in shown.stdout
    data = json.loads(run("inspect", demo, "--json", "--robot", "m710ic50").stdout)
    assert data["out_of_reach"] == [2]
    assert data["unsafe"][0]["line"] == 7
    assert data["robot"] == "m710ic50"
    (tmp_path / "x.LS").write_bytes(b"\0\1\2")
    refused(run("inspect", tmp_path / "x.LS"), 2, "x.LS", "binary")
    refused(run("inspect", tmp_path / "none.LS"), 2, "none.LS", "cannot be read")


def test_without_a_robot_inspect_says_nothing_of_an_arm_and_the_rest_as_with_one(tmp_path):
    demo = tmp_path / "DEMO.LS"
    moves = ["J P[1] 10% FINE    ;", "L P[2] 5mm/sec FINE INC    ;"]
    demo.write_bytes(program(moves, {"x": 1500.0}, {"x": 2500.0}, {"x": 2500.0}).data)
    without = json.loads(run("inspect", demo, "--json").stdout)
    arm = json.loads(run("inspect", demo, "--json", "--robot", "m710ic50").stdout)
    assert (without["robot"], without["limits"], without["out_of_reach"]) == (None, {}, [])
    assert arm["out_of_reach"] == [3]  # P[2] is a step from where the robot stands, no place
    assert [u for u in arm["unsafe"] if "out of reach" not in u["reason"]] == without["unsafe"]
    for key in ("motions", "positions", "frames", "postures", "path_length_mm", "duration_s", "mark"):
        assert without[key] == arm[key]
    assert "names no robot" in run("inspect", demo).stdout
    demo.write_bytes(demo.read_bytes().replace(b"/MN\n", b"/MN\n   9:  !for M-710iC/50 ;\n"))
    assert json.loads(run("inspect", demo, "--json").stdout)["robot"] == "m710ic50"


@pytest.mark.parametrize(
    ("remark", "named"),
    [
        ("LR Mate 200iD", ["lrmate200id"]), ("LR Mate 200iD/7L", ["lrmate200id7l"]), ("M-20iA/10L", ["m20ia10l"]),
        ("lr mate 200iD 7L", ["lrmate200id7l"]), ("LR Mate 200iD/4S", []), ("LR Mate 200iD 4S", []),
        ("M-710iC/50H", []), ("M-710iC/50 2nd cell", ["m710ic50"]), ("XM-710iC/50", []),
        ("M-20iA and M-20iA/10L", ["m20ia", "m20ia10l"]),
        ("M-20iA/M-10iA", ["m10ia", "m20ia"]), ("M-10iA/M-20iA", ["m10ia", "m20ia"]),
        ("M-20iA/R-30iB", ["m20ia"]), ("LR Mate 200iD/R-30iB Mate", ["lrmate200id"]),
        ("R-2000iC/165F/R-30iB", ["r2000ic165f"]), ("R-2000iC/165F/2", ["r2000ic165f"]),
        ("R-2000iC/165F 20L", ["r2000ic165f"]), ("M-10iA/R1", ["m10ia"]), ("M-10iA/CELL4", ["m10ia"]),
        *((f"M-20iA {more}", ["m20ia"]) for more in ("2ND STATION", "1ST OP", "20KG", "3MM TOOL", "24V", "3D VISION")),
        ("LR Mate 200iD 10MM", ["lrmate200id"]), ("M-20iA - 2 PARTS", ["m20ia"]), ("M-710iC/50 HOME", ["m710ic50"]),
        ("LRMate200iD_4S", []), ("LR Mate 200iD / 4S", []), ("LR Mate 200iD 4SH", []),
        ("M-710iC/50 H", []), ("M-20iA_10L", ["m20ia10l"]), ("M-20iA  10L", ["m20ia10l"]), ("M-20iA/35M", []),
        ("M-20iA/35", []), ("M-20iA/L", []), ("M-710iC/50 M-20iA", ["m20ia", "m710ic50"]),
        ("M-710iC/50 / M 20iA", ["m20ia", "m710ic50"]), ("LR Mate 200iD 4S 2 parts", []),
    ],
)  # fmt: skip
def test_a_model_is_named_by_its_whole_name(remark, named):
    text = program([f"  !{remark} ;", "J P[1] 10% FINE    ;"], {})
    robots = ["lrmate200id", "lrmate200id7l", "m10ia", "m20ia", "m20ia10l", "m710ic50", "r2000ic165f"]
    assert inspection.robots_named(text, robots) == named


@pytest.mark.parametrize(
    ("robot", "remark", "others"),
    [
        ("m20ia", "M-20iA 2ND STATION", []), ("m20ia10l", "M-20iA 2ND STATION", []), ("m20ia", "M-20iA/R-30iB", []),
        ("m710ic50", "M-20iA 20KG", ["M20IA"]), ("m20ia", "M-20iA/M-10iA", ["M10IA"]),
        ("m710ic50", "M-710iC/50 H", ["M710IC50H"]), ("lrmate200id", "LR Mate 200iD / 4S", ["LRMATE200ID4S"]),
        ("m20ia", "M-20iA/35M", ["M20IA35M"]), ("r2000ic165f", "R-2000iC/210WE", ["R2000IC210WE"]),
    ],
)  # fmt: skip
def test_a_remark_names_other_models_and_no_station_or_unit(robot, remark, others):
    text = program([f"  !{remark} ;", "J P[1] 10% FINE    ;"], {})
    assert inspection.other_models(text, replace(load_robot("m710ic50"), name=robot)) == others


def test_every_sample_is_inspected():
    if not SAMPLES.is_dir():
        pytest.skip("the sample programs are not here")
    robot, frames = load_robot("m710ic50"), default_frames()
    files = [p for p in SAMPLES.rglob("*") if p.is_file() and p.suffix.lower() == ".ls"]
    assert len(files) == 88
    for file in files:
        found = inspection.inspect(fanuc.loads(Path(file).read_bytes()), robot, frames)
        json.dumps(found, allow_nan=False)
        assert found["positions"]["undefined"] == [], file
        json.dumps(inspection.inspect(fanuc.loads(Path(file).read_bytes()), None, frames), allow_nan=False)


REMOTE = ["J P[1] 10% FINE    ;", "L P[2] 100mm/sec FINE    ;", "L P[3] 100mm/sec FINE RTCP    ;"]


def with_remote(axes="XYZWPR"):
    """P[3] as the place of a part in the frame of a tool that stands still."""
    head, third = program(REMOTE, {}, {"x": 1400.0}, {"ut": 4}).data.split(b"P[3]{")
    for axis in axes:
        third = third.replace(f"\t{axis} =".encode(), f"\tR{axis} =".encode())
    return head + b"P[3]{" + third


@pytest.mark.parametrize("axes", ["XYZWPR", "X", "R"])
def test_positions_of_a_remote_tool_are_read_and_held(axes):
    read = fanuc.loads(with_remote(axes))
    assert fanuc.dumps(read) == with_remote(axes)
    assert read.positions.remote.tolist() == [False, False, True]
    assert not np.isfinite(program_poses(read, load_robot("m710ic50"), default_frames()).theta[2]).any()
    unsafe = inspection.inspect(read, load_robot("m710ic50"), default_frames())["unsafe"]
    assert [(u["text"][:4], u["reason"][:10]) for u in unsafe if "P[3]{" not in u["text"]][-1] == ("P[3]", "remote TCP")
    assert not any("utool 4" in u["reason"] for u in unsafe)


def test_many_positions_of_a_remote_tool_are_read_as_one_is():
    place = with_remote().split(b"P[3]{")[1].split(b"/END")[0]
    count = 1500
    text = with_remote().replace(b"/END", b"".join(b"P[%d]{" % n + place for n in range(4, count)) + b"/END")
    assert fanuc.loads(text).positions.remote.tolist() == [False] * 2 + [True] * (count - 3)


def test_positions_that_statements_read_are_used():
    found = inspected(["J P[1] 10% FINE    ;", "  PR[1:a]=PR[2:b]+\n    :  P[2] ;", "  PR[3]=P[3:x] ;"], {}, {}, {}, {})
    assert found["positions"]["used"] == 3
    assert found["positions"]["unused"] == [4]


@pytest.mark.parametrize(
    ("moves", "places", "text", "reason"),
    [
        (["L P[2] 5mm/sec FINE ;", "  PR[1]=P[2] ;"], [{"x": 1400.0}], "PR[1]=P[2]", "it uses a position as a value"),
        (["  Independent GP ;", "  GP1 JP P[2] 5% FINE ;"], [{}], "GP1 JP P[2] 5% FINE", "no statement that is known"),
        (["  Weave Sine[1] ;", "L P[2] 5mm/sec FINE ;"], [{}], "L P[2] 5mm/sec FINE", "it runs between weaving"),
        (["L P[2] 5mm/sec FINE ;"], [{"x": 9000.0}], "P[2]", "out of reach of"),
        (["L P[2] 5mm/sec FINE ;"], [{"config": "F U T, 0, 0, 0"}], "P[2]", "J4 stands at 180 or -180 deg, CONFIG's 0"),
    ],
)
def test_what_correct_would_hold_is_listed_with_its_reason(moves, places, text, reason):
    unsafe = inspected(["J P[1] 10% FINE    ;", *moves], {}, *places)["unsafe"]
    assert any(u["text"] == text and reason in u["reason"] for u in unsafe), unsafe


@pytest.mark.parametrize(("form", "told"), [("{:.3f}", 20), ("{:.6f}", 0)])
def test_a_joint_is_said_to_stand_at_180_deg_where_the_digits_of_its_position_leave_the_side_open(form, told):
    """Half a thousandth of a degree from it, three decimals lay J4 to either side; of most nothing was said."""
    rng = np.random.default_rng(4)
    low, high = (-90, 0, -40, -179.9995, 25, -150), (90, 30, 10, -179.9995, 90, 150)
    points = [ls_text.at(n, rng.uniform(low, high), form=form) for n in range(1, 21)]
    text = ls_text.program([f"J P[{n}] 10% FINE" for n in range(1, 21)], points)
    unsafe = inspection.inspect(fanuc.loads(text), load_robot("m710ic50"), default_frames())["unsafe"]
    assert sum("J4 stands at 180 or -180 deg" in u["reason"] for u in unsafe) == told
    sides = {u["reason"].split("; ")[1].split(" ")[0] for u in unsafe if "J4 stands" in u["reason"]}
    assert sides == ({"180", "-180"} if told else set())  # the one that is corrected; 180 was said of all


def test_only_the_wrist_turns_steeply_where_j5_is_small():
    """J1 at 179.95 deg is 1 mm beside the half turn: its side was not told, as if J5 near zero turned it."""
    for joints, is_named in (((179.95, 10, -20, 30, 0.5, 20), False), ((10, 10, -20, 179.95, 0.5, 20), True)):
        text = ls_text.program(["J P[1] 10% FINE"], [ls_text.at(1, joints)])
        unsafe = inspection.inspect(fanuc.loads(text), load_robot("m710ic50"), default_frames())["unsafe"]
        assert any("at 180 or -180 deg" in u["reason"] for u in unsafe) == is_named


def test_a_number_without_decimals_leaves_out_zeros():
    """A W of 180 deg where others have three decimals was known to a degree, and J4 at 179.6 deg said to be at 180."""
    point = ls_text.at(1, (10, 10, -20, 179.6, 60, 20))
    text = ls_text.program(["J P[1] 10% FINE"], [re.sub(r"(W = -?\d+)\.\d+", r"\1", point)])
    assert "J4 " not in str(inspection.inspect(fanuc.loads(text), load_robot("m710ic50"), default_frames())["unsafe"])


@pytest.mark.parametrize("config", ["F U T, 0, 1, 1", "F U T, 0, -1, -1", "N U T, 0, 0, 0"])
def test_a_turn_that_config_tells_casts_no_doubt(config):
    assert inspected(["J P[1] 10% FINE    ;"], {"config": config})["unsafe"] == []


def test_an_unknown_frame_is_told_once_and_not_as_a_missing_number():
    unsafe = inspected(["J P[1] 10% FINE    ;", "L P[2] 5mm/sec FINE ;"], {"uf": 3}, {"uf": 3})["unsafe"]
    assert [u["reason"] for u in unsafe] == ["uframe 3 is not known: give [uframe.3] in a table with --frames"]


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda data: b"\xef\xbb\xbf" + data, "line 1: a byte order mark"),
        (lambda data: data.decode().encode("utf-16"), "line 1: it is UTF-16"),
        (lambda data: data.decode().encode("utf-16-be").join([b"\xfe\xff", b""]), "line 1: it is UTF-16"),
        (lambda data: data + data, "line 1[0-9]: a second program begins after /END"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_as_it_is(spoil, words):
    with pytest.raises(InputError, match=words):
        fanuc.loads(spoil(program(["J P[1] 10% FINE    ;"], {}).data))


def unlisted(data, robot=None, frames=None):
    """Lines of motions that are held, of which neither the line nor its position is listed."""
    read, arm = fanuc.loads(data), robot or load_robot("m710ic50")
    poses = ProgramContext(frames or MANY).poses(read, arm)
    drive = read_traversal(read, poses, arm)
    scope = read_scope(read, poses, drive, arm)
    listed = {u.line for u in scope.unsafe}
    return [
        int(read.motions.line[drive.motion[s]])
        for s in np.flatnonzero(~scope.free)
        if int(read.motions.line[drive.motion[s]]) not in listed
        and (drive.pose[s] < 0 or int(poses.line[drive.pose[s]]) not in listed)
    ]


@pytest.mark.parametrize(
    "statements",
    [["PR[1]=P[2]"], ["P[2]=PR[1]"], ["UFRAME[0]=PR[1]"], ["UTOOL[R[1]]=PR[1]"], ["Weave Sine[1]"], ["PR[1]=P[R[1]]"],
     ["L P[2] 5mm/sec FINE FPLIN"], ["L P[2] 5mm/sec FINE SPOT[SD=8,P=1,S=1,ED=5]"], ["SOFTFLOAT[1]"]],
)  # fmt: skip
def test_every_line_that_is_held_is_listed(statements):
    moves = ["J P[1] 10% FINE    ;", *(f"{s} ;" for s in statements), "L P[2] 5mm/sec FINE    ;"]
    read = program(moves, {}, {"x": 1400.0})
    assert unlisted(read.data) == []
    assert inspected(moves, {}, {"x": 1400.0})["unsafe"]


def test_every_line_that_is_held_is_listed_in_real_programs():
    if not SAMPLES.is_dir():
        pytest.skip("the sample programs are not here")
    for file in [p for p in SAMPLES.parent.rglob("*") if p.is_file() and p.suffix.lower() == ".ls"]:
        assert unlisted(file.read_bytes()) == [], file


def test_a_position_of_another_group_alone_is_listed():
    read = program(["J P[1] 10% FINE    ;", "J P[2] 10% FINE    ;"], {}, {})
    head, second = read.data.split(b"P[2]{")
    data = head + b"P[2]{" + second.replace(b"GP1", b"GP2")
    unsafe = inspection.inspect(fanuc.loads(data), load_robot("m710ic50"), default_frames())["unsafe"]
    assert [u["reason"] for u in unsafe] == ["its position has no numbers of group 1"]


def test_what_would_steer_a_terminal_stands_as_escapes_and_is_no_name():
    evil = b"\x1b[31m\x07\x9b"
    listed = b"/PROG A\n/MN\n   1:L P[1] 100mm/sec FINE " + evil + b" ;\n/POS\n/END\n"
    unsafe = unsafe_statements(fanuc.loads(listed))
    assert any("\\x1b[31m\\x07\\x9b" in row.text for row in unsafe)
    assert all(row.text.isprintable() and row.reason.isprintable() for row in unsafe)
    for name in (b"A\x1b[31mB", b"../A", b"A\x07"):
        with pytest.raises(InputError, match=r"line 1: its name .* is none"):
            fanuc.loads(listed.replace(b"PROG A", b"PROG " + name))


@pytest.mark.parametrize("code", ["utf-8", "latin-1"])
def test_letters_of_a_comment_are_shown_by_the_code_it_is_written_in(code):
    moves = ["WAIT DI[1:Kühlung à Åre]=ON    ;", "L PR[2:Größe] 5mm/sec FINE    ;", "L P[1] 5mm/sec FINE ;"]
    source = program(moves, {}).data.decode().replace("a demo", "Prüfung µm").encode(code)
    read = fanuc.loads(source)
    record = inspection.inspect(read, load_robot("m710ic50"), default_frames())
    assert record["comment"] == "Prüfung µm"
    shown = {row["text"]: row["reason"] for row in record["unsafe"]}
    assert [text.rstrip("; ") for _, text in other_statements(read)] == ["WAIT DI[1:Kühlung à Åre]=ON"]
    assert shown["L PR[2:Größe] 5mm/sec FINE"].startswith("PR[2:Größe]: ")
    assert fanuc.dumps(read) == source
    at = read.data.index(b"1300.000")
    assert edited(read, {(at, at + 8): b"1300.001"}).source == source.replace(b"1300.000", b"1300.001")
