"""What a statement makes of registers, beside sums by hand and Python's own arithmetic."""

import random
from dataclasses import replace

import numpy as np
import pytest
from ls_text import cartesian, joint_form, program

from compgen.core.pose import Pose
from compgen.core.rotations import from_wpr
from compgen.fanuc import loads
from compgen.fanuc.analysis.called_programs import UNKNOWN_PROGRAMS
from compgen.fanuc.analysis.flow_graph import Node
from compgen.fanuc.analysis.placements import read_placements
from compgen.fanuc.analysis.register_arithmetic import (
    UNKNOWN,
    Key,
    KnownValues,
    element,
    evaluate_number,
    evaluate_register,
)
from compgen.fanuc.analysis.register_flow import RegisterFlow
from compgen.program.frames import default_frames
from compgen.program.registers import CARTESIAN, JOINT, Register

ONE, TWO = (1.0, 2.0, 3.0, 10.0, 20.0, 30.0), (100.0, 0.0, -7.0, 0.5, 0.0, -1.0)
HALF = Register(CARTESIAN, (1.0, None, 3.0, None, 5.0, None))  # three of its numbers are known
KNOWN: dict[Key, Register | float | None] = {
    ("PR", 1): Register(CARTESIAN, ONE),
    ("PR", 2): Register(CARTESIAN, TWO),
    ("PR", 3): HALF,
    ("PR", 4): Register(JOINT, ONE),
    ("R", 1): 4.0,
    ("R", 2): 0.0,
    ("R", 3): None,
}
VALUES = KnownValues(KNOWN, lambda number: Register(CARTESIAN, TWO), lambda kind, number: Register(CARTESIAN, ONE))
SUM, LESS = np.add(ONE, TWO).tolist(), np.subtract(ONE, TWO).tolist()


@pytest.mark.parametrize(
    ("text", "form", "numbers"),
    [
        ("PR[1]", CARTESIAN, ONE),
        ("PR[1:above]+PR[2]", CARTESIAN, SUM),
        (" PR[ 1 ] - P[9] ;", CARTESIAN, LESS),
        ("UFRAME[3]+PR[2]-PR[1]", CARTESIAN, TWO),
        ("PR[1]+PR[2]-PR[1]", CARTESIAN, TWO),  # the second is taken off what both make
        ("PR[1]+PR[1]", CARTESIAN, np.add(ONE, ONE)),
        ("PR[1]-PR[1]", CARTESIAN, np.zeros(6)),
        ("PR[3]-PR[3]+PR[2]", CARTESIAN, TWO),  # zero, whatever it holds
        ("PR[2]+PR[3]-PR[3]", CARTESIAN, [100.0, None, -7.0, None, 0.0, None]),
        ("PR[3]+PR[1]", CARTESIAN, [2.0, None, 6.0, None, 25.0, None]),
        ("PR[4]-PR[4]", JOINT, np.zeros(6)),
        ("JPOS-JPOS", JOINT, [None] * 6),
        ("LPOS", CARTESIAN, [None] * 6),
    ],
)
def test_registers_are_added_number_by_number(text, form, numbers):
    assert evaluate_register(text, VALUES) == Register(form, tuple(n if n is None else float(n) for n in numbers))


@pytest.mark.parametrize("text", ["PR[4]+PR[1]", "PR[1]-PR[4]", "PR[8]", "PR[R[1]]", "PR[1,2]", "PR[1]*PR[2]", "R[1]"])
def test_what_is_not_understood_is_unknown(text):
    assert evaluate_register(text, VALUES) == UNKNOWN


def test_numbers_are_those_of_python():
    words = {"R[1]": "4.0", "PR[2,1]": "100.0", "PR[1,6]": "30.0", "2.5": "2.5", "7": "7"}
    rng, followed = random.Random(3), 0
    for _ in range(300):
        terms, signs = rng.choices(list(words), k=5), rng.choices("+-*/", k=4)
        left, right = rng.choice([0, 1, 2]), rng.choice([3, 4])  # a bracket
        text = plain = rng.choice(["", "-"])
        for k, (term, sign) in enumerate(zip(terms, [*signs, ""], strict=True)):
            opens, closes = "(" * (k == left), ")" * (k == right)
            text, plain = text + opens + term + closes + sign, plain + opens + words[term] + closes + sign
        try:
            expected = eval(plain)
        except ZeroDivisionError:
            expected = None
        followed += expected is not None
        assert evaluate_number(text, VALUES) == (
            expected if expected is None else pytest.approx(expected, rel=1e-12)
        ), text
    assert followed > 250


@pytest.mark.parametrize(
    "text", ["R[1]/R[2]", "R[3]+1", "R[8]", "PR[3,2]", "PR[1]", "1+", "R[1] MOD 2", "R[R[1]]", "(1"]
)
def test_a_number_that_nobody_knows_is_none(text):
    assert evaluate_number(text, VALUES) is None


def test_an_element_is_its_kind_number_component_and_end():
    assert element("PR[5,3:up]=1") == ("PR", 5, 2, 10)
    assert element("..UTOOL[2]=PR[1]", 2) == ("UTOOL", 2, None, 10)
    assert element("PR[R[7]]=1") == ("PR", None, None, 8)
    assert element("PR[5") is None
    assert element("DO[5]") is None


def test_positions_frames_and_tools_are_their_numbers_in_mm_and_degrees():
    place, ridden = cartesian(1, ONE), cartesian(4, ONE, more=",\n\tE1= 10.000 mm")
    points = [place, cartesian(2, ["********", *ONE[1:]]), joint_form(3, ONE), ridden]
    frame = Pose(np.array([0.1, -0.2, 0.3]), from_wpr(np.zeros(()), np.zeros(()), np.array(np.pi / 6)))
    frames = replace(default_frames(), uframe={3: frame})
    flow = RegisterFlow(program=loads(program([], points)), frames=frames, called=UNKNOWN_PROGRAMS)
    assert flow.position(1) == Register(CARTESIAN, ONE)
    assert flow.position(2) == Register(CARTESIAN, (None, *ONE[1:]))
    assert flow.position(3) == Register(JOINT)
    assert flow.position(4) == flow.position(5) == flow.frame("UTOOL", 3) == UNKNOWN
    assert flow.frame("UFRAME", 3).form == CARTESIAN
    assert flow.frame("UFRAME", 3).values == pytest.approx((100.0, -200.0, 300.0, 0.0, 0.0, 30.0), abs=1e-9)
    known = flow.leave(Node(text="PR[5]=P[1]"), {})
    known = flow.leave(Node(text="PR[5,3]=PR[5,2]*(-2)"), known)
    assert known["PR", 5] == Register(CARTESIAN, (1.0, 2.0, -4.0, 10.0, 20.0, 30.0))


@pytest.mark.parametrize("text", ["UFRAME[R[1]]=PR[5]", "UFRAME[3,2]=R[4]"])
def test_a_frame_that_run_time_writes_makes_all_of_its_kind_unknown(text):
    flow = RegisterFlow(
        program=loads(program([], [cartesian(1, ONE)])), frames=default_frames(), called=UNKNOWN_PROGRAMS
    )
    before = flow.leave(Node(text="UTOOL[3]=P[1]"), flow.leave(Node(text="UFRAME[3]=P[1]"), {}))
    values = flow.values(before)
    assert [values.frame_value(kind, 3).values for kind in ("UFRAME", "UTOOL")] == [ONE, ONE]
    assert values.frame_value("UFRAME", 0).form == CARTESIAN  # of the table
    after = flow.values(flow.leave(Node(text=text), before))
    assert after.frame_value("UFRAME", 3) == after.frame_value("UFRAME", 0) == UNKNOWN
    assert after.frame_value("UTOOL", 3).values == ONE


def test_a_program_whose_motions_are_all_offset_is_shifted():
    """By the register that it starts with; a motion without an offset beside them is not."""
    points, offset = [cartesian(1, ONE), cartesian(2, TWO)], "100mm/sec FINE Offset,PR[7]"
    moves, start = [f"L P[1] {offset}", f"L P[2] {offset}"], {7: Register(CARTESIAN, TWO)}
    for more, shifted in (([], [0, 1]), (["L P[1] 100mm/sec FINE"], [0, 1])):
        placed = read_placements(loads(program([*moves, *more], points)), default_frames(), start)
        assert sorted(placed.of_motion) == shifted
        assert not placed.unknown
