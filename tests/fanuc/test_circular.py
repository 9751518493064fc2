"""Circular motions in text: written, read back by two readers, and refused where no controller could drive them."""

import re
from dataclasses import replace

import naive_ls
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from compgen import fanuc as ls
from compgen.core.arcs import arcs_through, segment_lengths
from compgen.core.exceptions import InputError
from compgen.core.rotations import from_wpr
from compgen.core.units import DEG, MM
from compgen.fanuc.analysis.traversal import arc_lengths
from compgen.program.digits import as_written
from compgen.program.program import Program
from compgen.program.speeds import writable_speed
from compgen.robot.inverse_kinematics import Posture


def drawn(seed, arcs=6):
    """Lines and arcs in turn at random, on random circles."""
    rng = np.random.default_rng(seed)
    places, via, fine = [np.array([1.2, 0.1, 0.2])], [False], [True]
    speed: list[float] = []
    for _ in range(arcs):
        v, stop = writable_speed(10 ** rng.uniform(-2, 0)), bool(rng.random() < 0.3)
        if rng.random() < 0.5:
            x, y = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
            radius, end = 10 ** rng.uniform(-2, 0), np.pi * rng.uniform(0.05, 0.98)
            middle = end * rng.uniform(0.3, 0.7)
            for angle in (middle, end):
                places.append(places[0] + radius * (x * np.sin(angle) + y * (1 - np.cos(angle))))
            places[-2:] = [p + places[-3] - places[0] for p in places[-2:]]
            via, speed, fine = [*via, True, False], [*speed, v, v], [*fine, False, stop]
        else:
            places.append(places[-1] + rng.normal(size=3) * 0.05)
            via, speed, fine = [*via, False], [*speed, v], [*fine, stop]
    N = len(places)
    fine[-1] = True
    return Program(
        name="ARCS", comment="drawn", date="26-01-01", remarks=("arcs",), uframe=0, utool=1,
        position=np.array(places) / 2, rotation=from_wpr(*(rng.uniform(-80, 80, size=(3, N)) * DEG)),
        posture=Posture(), turns=np.zeros((N, 3), dtype=np.int64), speed=np.array(speed), fine=np.array(fine),
        via=np.array(via),
    )  # fmt: skip


GOLDEN = """   1:  !arcs ;
   2:  UFRAME_NUM=0 ;
   3:  UTOOL_NUM=1 ;
   4:J P[1] 10% FINE    ;
   5:L P[2] 200mm/sec CNT100    ;
   6:C P[3]    
    :  P[4] 100mm/sec CNT100    ;
   7:C P[5]    
    :  P[6] 100mm/sec FINE    ;
/POS
""".replace("\n", "\r\n").encode()


def quarters():
    """A line and two quarters of a circle of 50 mm."""
    angle = np.arange(5) * 45 * DEG
    circle = np.column_stack([np.sin(angle), 1 - np.cos(angle), 0 * angle]) * 0.05
    position = np.array([1.2, 0.0, 0.2]) + np.vstack([[[-0.1, 0, 0]], circle])
    return Program(
        name="ARCS", comment="drawn", date="26-01-01", remarks=("arcs",), uframe=0, utool=1, position=position,
        rotation=np.tile(np.diag([1.0, -1.0, -1.0]), (6, 1, 1)), posture=Posture(),
        turns=np.zeros((6, 3), dtype=np.int64), speed=np.array([0.2, 0.1, 0.1, 0.1, 0.1]),
        fine=np.array([True, False, False, False, False, True]), via=np.array([False, False, True, False, True, False]),
    )  # fmt: skip


def test_an_arc_is_one_statement_on_two_lines():
    text = ls.compose(quarters())
    assert GOLDEN in text
    assert b"LINE_COUNT\t= 7;" in text


def test_a_program_of_arcs_is_read_as_it_was_written():
    program = quarters()
    back = ls.interpret(ls.compose(program))
    assert back.via.tolist() == program.via.tolist()
    assert back.fine.tolist() == program.fine.tolist()
    assert_allclose(back.speed, program.speed)
    assert_allclose(back.lengths(), [0.1, *[0.05 * np.pi / 4] * 4], atol=2e-6)
    assert ls.compose(back) == ls.compose(program)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_text_and_meaning_of_drawn_arcs_agree_with_another_reader(seed):
    program = drawn(seed)
    text = ls.compose(program)
    back = ls.interpret(text)
    assert ls.compose(back) == text
    meant = as_written(program)
    for name in ("position", "rotation", "turns", "speed", "fine", "via"):
        assert np.array_equal(getattr(back, name), getattr(meant, name)), name
    positions, moves = naive_ls.read(text)
    via, number = [], 1
    for move in moves:
        assert move.targets == tuple(f"P[{number + k}]" for k in range(len(move.targets)))
        assert (move.letter == "C") == (len(move.targets) == 2)
        via += [*([True] if move.letter == "C" else []), False]
        number += len(move.targets)
    assert via == back.via.tolist()
    for n, place in enumerate(back.position, 1):
        assert_allclose(np.array([positions[n].groups[1].axes[a] for a in "XYZ"], dtype=float), place / MM, atol=1e-9)


def bent(**changes):
    return replace(quarters(), **changes)


def moved(n, place):
    position = quarters().position.copy()
    position[n] = place
    return bent(position=position)


P = quarters().position
TURNED = np.zeros((6, 3), dtype=np.int64)
TURNED[3:, 2] = 1


@pytest.mark.parametrize(
    ("program", "words"),
    [
        (moved(2, (P[1] + P[3]) / 2), r"P\[3\] is the via of an arc, 0\.0000 mm beside .* no circle; use L"),
        (moved(2, P[1]), r"P\[3\] is the via of an arc and its start or end as well"),
        (moved(3, P[2]), r"P\[3\] is the via of an arc and its start or end as well"),
        (moved(3, P[1]), r"ends where it began"),
        (moved(3, P[1] + [-0.005, 0.001, 0]), r"of an arc of 3\d\d\.\d deg, more than 180; part it"),
        (bent(turns=TURNED), r"P\[3\] .* differ in CONFIG's turns"),
        (bent(via=np.array([False, True, True, False, False, False])), r"P\[2\] is a via, and so is the next"),
        (bent(via=np.array([False, False, False, False, False, True])), r"P\[6\] .* without start or end"),
        (bent(via=np.array([True, False, False, False, False, False])), r"P\[1\] .* without start or end"),
        (bent(fine=np.array([True, False, True, False, False, True])), r"P\[3\] .* cannot stop there"),
        (bent(speed=np.array([0.2, 0.1, 0.2, 0.1, 0.1])), r"P\[3\] .* two speeds"),
    ],
)
def test_an_arc_that_no_controller_drives_is_not_written(program, words):
    with pytest.raises(InputError, match=words) as refusal:
        ls.compose(program)
    assert len(str(refusal.value)) <= 300


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (b"\r\n    :  P[4] 100mm/sec CNT100    ;", b"", r"line 27: this C has no end point"),
        (b"   6:C P[3]    \r\n    :  P[4]", b"   6:C P[4]", r"line 27: .* C has a via and an end"),
        (b"\r\n    :  P[4] 100mm/sec CNT100    ;", b" 100mm/sec CNT100    ;", r"line 27: this C has no end point"),
        (b"\r\n    :  P[4] 100mm/sec CNT100    ;", b" ;", r"line 27: this C has no end point"),
        (b"   5:L P[2]", b"   5:L P[2] P[3]", r"line 26: .* C has a via and an end"),
        (b"   6:C P[3]    \r\n    :  P[4]", b"   6:C P[4]    \r\n    :  P[3]", r"not driven once each in order"),
        (b"P[4] 100mm/sec", b"P[4] 10%", r"line 27: "),
        (b"0, 0, 0',\r\n\tX =  1250", b"0, 0, 1',\r\n\tX =  1250", r"line 27: P\[3\] .* CONFIG's turns"),
        (
            b"X =  1235.355  mm,\tY =    14.645",
            b"X =  1225.000  mm,\tY =    25.000",
            r"line 27: P\[3\] .* no circle; use L",
        ),
    ],
)
def test_a_bad_circular_motion_is_refused_with_its_line(old, new, words):
    text = ls.compose(quarters())
    assert old in text
    with pytest.raises(InputError, match=words) as refusal:
        ls.interpret(text.replace(old, new, 1))
    assert len(str(refusal.value)) <= 300
    assert "\n" not in str(refusal.value)


def test_a_circular_motion_on_one_line_means_the_same():
    text = ls.compose(quarters())
    one_line = re.sub(rb"    \r\n    :  ", b" ", text)
    assert one_line != text
    assert ls.compose(ls.interpret(one_line)) == text


def test_lengths_are_those_of_the_circle_to_the_last_digits():
    """Against angles at a known centre, from a quarter of a circle to one that bulges by a micrometre."""
    rng = np.random.default_rng(7)
    for _ in range(200):
        x, y = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
        radius, end = 10 ** rng.uniform(-2, 3), 10 ** rng.uniform(-4, 0)
        middle = end * rng.uniform(0.3, 0.7)
        at = np.array([0.0, middle, end])[:, None]
        p = radius * (x * np.sin(at) + y * 2 * np.sin(at / 2) ** 2)
        lengths = segment_lengths(p, np.array([False, True, False]))
        assert_allclose(lengths, [radius * middle, radius * (end - middle)], rtol=1e-9)
        arc = arcs_through(*(q[None] for q in p))
        assert_allclose(arc.at(arc.angle)[0], p[1:], atol=1e-13)
        assert_allclose(arc.sagitta, 2 * radius * np.sin(end / 4) ** 2, rtol=1e-6)


def test_an_arc_is_as_long_as_its_circle_and_as_its_two_lines_where_the_three_places_are_in_line():
    turn = np.radians([[0, 20, 180], [0, 200, 270]])
    circle = np.stack([3 * np.cos(turn), 3 * np.sin(turn), 0 * turn], axis=2)
    line = np.array([[[0, 0, 0], [1, 2, 2], [4, 8, 8]], [[0, 0, 0], [3, 0, 0], [1, 0, 0]]], dtype=float)
    lengths = arc_lengths(*np.concatenate([circle, line]).swapaxes(0, 1))
    assert_allclose(lengths, [3 * np.pi, 4.5 * np.pi, 12, 5])
