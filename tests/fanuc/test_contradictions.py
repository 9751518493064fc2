"""What a program says that cannot be: another frame than is set, a label twice, a jump to none."""

import pytest
from corrected import MANY, corrected
from ls_text import at, joint_form, program
from naive_arm import config
from shipped import ROOT

from compgen import fanuc
from compgen.fanuc.analysis import inspection
from compgen.fanuc.analysis.called_programs import called_programs
from compgen.fanuc.analysis.contradictions import contradictions
from compgen.fanuc.analysis.program_context import ProgramContext
from compgen.fanuc.analysis.traversal import read_traversal
from compgen.pipelines.files.robot_file import load_cell, load_robot

HOME, THERE = (10.0, 20.0, -15.0, 30.0, -60.0, 45.0), (15.0, 25.0, -20.0, 25.0, -55.0, 40.0)
GO = "J P[1] 10% FINE"
SETS = ["UFRAME_NUM=1", "UTOOL_NUM=2"]


def text(*moves, numbered=(1, 2)):
    return program(list(moves), [at(1, HOME, numbered=numbered), at(2, THERE, numbered=(1, 2))])


def found(data, beside=None):
    read = fanuc.loads(data)
    poses = ProgramContext(MANY).poses(read, None)
    called = called_programs(read, (beside or {}).get)
    drive = read_traversal(read, poses, None, called.motionless)
    return [(u.line - 3, u.reason) for u in contradictions(read, drive, called)]


@pytest.mark.parametrize(
    ("moves", "line", "reason"),
    [
        (
            ["UFRAME_NUM=3", "UTOOL_NUM=2", GO],
            3,
            "P[1] is told in uframe 1, and UFRAME_NUM=3 is set: a controller stops",
        ),
        (["UTOOL_NUM=1", GO], 2, "P[1] is told in utool 2, and UTOOL_NUM=1 is set: a controller stops there"),
        ([*SETS, GO, "UFRAME_NUM = 2", "L P[2] 5mm/sec FINE"], 5, "P[2] is told in uframe 1, and UFRAME_NUM=2 is set"),
        (["UFRAME_NUM[GP1]=3", GO], 2, "P[1] is told in uframe 1, and UFRAME_NUM=3 is set"),
        (["UFRAME_NUM=3", "IF R[1]=1,JMP LBL[1]", "R[1]=2", "LBL[1]", GO], 5, "UFRAME_NUM=3 is set"),
        (["UFRAME_NUM=3", "C P[1]\n    :  P[2] 5mm/sec FINE"], 2, "P[2] is told in uframe 1"),
        ([GO, "LBL[1]", GO, "LBL[1:again]", "JMP LBL[1]"], 4, "LBL[1] stands twice, on line 5 too"),
        ([GO, "JMP LBL[2]", "LBL[1]"], 2, "LBL[2] stands nowhere: a jump to it stops; add the label"),
        ([GO, "IF R[1]=1,JMP LBL[20]", "LBL[2]"], 2, "LBL[20] stands nowhere"),
        (["L P[1] 5mm/sec FINE Skip,LBL[9]"], 1, "LBL[9] stands nowhere"),
    ],
)
def test_what_contradicts_itself_is_said_with_its_line(moves, line, reason):
    said = found(text(*moves))
    assert any(at_line == line and reason in words for at_line, words in said), said


@pytest.mark.parametrize(
    "moves",
    [
        [*SETS, GO],
        [GO],
        ["UFRAME_NUM=R[1]", GO],
        ["UFRAME_NUM=3", "CALL SETUP", GO],
        ["UFRAME_NUM=3", "GO HOME", GO],
        ["UFRAME_NUM=3", "IF R[1]=1,UFRAME_NUM=1", GO],
        ["UFRAME_NUM=3", "IF R[1]=1,JMP LBL[1]", "UFRAME_NUM=1", "LBL[1]", GO],
        ["UFRAME_NUM=3", "UFRAME_NUM[GP1]=1", GO],
        ["UFRAME_NUM=3", "$MNUFRAMENUM[1]=1", GO],
        ["JMP LBL[1]", "UFRAME_NUM=3", "LBL[1]", GO],
        ["UFRAME_NUM=3", f"//{GO}", "!JMP LBL[4]", "L PR[1] 5mm/sec FINE"],
        [GO, "LBL[1:a]", "JMP LBL[1]", "LBL[2]", "JMP LBL[R[1]]"],
    ],
)
def test_what_may_be_right_is_not_said(moves):
    assert found(text(*moves)) == []


@pytest.mark.parametrize(
    ("called", "contradicts"),
    [
        (["DO[1]=ON"], True),
        (["UFRAME_NUM=1"], False),
        (["CALL DEEPER"], False),
        (["IF DI[1]=ON,UFRAME_NUM=1"], False),
    ],
)
def test_a_called_program_may_set_the_frame_of_what_follows(called, contradicts):
    beside = {"SETUP": program(called, [], name="SETUP"), "DEEPER": program(["UFRAME_NUM=1"], [], name="DEEPER")}
    reasons = found(text("UFRAME_NUM=3", "CALL SETUP", GO), beside)
    assert bool(reasons) == contradicts, reasons


FLIPPED = (15.0, 25.0, -20.0, 25.0, 55.0, 40.0)  # F, where THERE is N
NEARLY_STRAIGHT = (15.0, 25.0, -20.0, 25.0, 0.5, 40.0)


@pytest.mark.parametrize("form", [at, joint_form])
@pytest.mark.parametrize("home", [HOME, (-10.0, 20.0, 15.0, 0.0, -90.0, 0.0)])
@pytest.mark.parametrize(
    ("end", "move", "line"),
    [
        (FLIPPED, "L P[2] 5mm/sec FINE", 2),
        (FLIPPED, "C P[3]\n    :  P[2] 5mm/sec CNT100", 2),
        (THERE, "L P[2] 5mm/sec FINE", None),
        (NEARLY_STRAIGHT, "L P[2] 5mm/sec FINE", None),
        (FLIPPED, "L P[2] 5mm/sec FINE Wjnt", None),
        (FLIPPED, "L P[2] 5mm/sec FINE INC", None),
        (FLIPPED, "J P[2] 5% FINE", None),
        (FLIPPED, "L PR[2] 5mm/sec FINE", None),
    ],
)
def test_a_way_between_two_configurations_is_said(form, home, end, move, line):
    data = program([GO, move], [at(1, home), form(2, end), at(3, home)])
    read = fanuc.loads(data)
    poses = ProgramContext(MANY).poses(read, load_robot("m710ic50"))
    arriving = [
        (u.line - 3, u.reason)
        for u in contradictions(read, read_traversal(read, poses, None))
        if "the arm comes as" in u.reason
    ]
    assert [n for n, _ in arriving] == ([] if line is None else [line]), arriving
    assert all(
        reason.startswith(f"P[2] is {config(end)[:5]}, and the arm comes as {config(home)[:5]}: ")
        for _, reason in arriving
    )


def test_both_commands_say_it_and_correct_what_they_did():
    """A position is right in its own frame; that the controller stops before it is for a person to mend."""
    data = text("UFRAME_NUM=3", "UTOOL_NUM=2", GO, "L P[2] 5mm/sec FINE", "JMP LBL[7]")
    listed = inspection.inspect(fanuc.loads(data), load_robot("m710ic50"), MANY)["unsafe"]
    assert [u["line"] for u in listed] == [6, 7, 8]
    result = corrected(data, load_cell(str(ROOT / "robots" / "m710ic50.toml")), MANY, bound=1e-3)
    (finding,) = [f for f in result.findings if f.code == "program.contradiction"]
    assert finding.message.startswith(
        "the program contradicts itself at lines 6, 7, 8; first: J P[1] 10% FINE: P[1] is"
    )
    assert result.inside
    assert result.changed == 2
