"""The judge's own reader of CAM files: what each word means, by hand, and what it does not know."""

import math

import cam_draws
import naive_cam
import pytest
from naive_cam import Arc, Line, Unreadable, apt, gcode, points
from numpy.testing import assert_allclose

TOLD_MM = 2e-3  # drawn places stand in the file with three digits, centres with four


def ends(read):
    return [read.moves[0].start, *(m.end for m in read.moves)]


def test_straight_lines_are_straight_lines():
    read = gcode("G21 G90 G17\nG0 X0 Y0 Z10\nG1 Z0 F3000\nG1 X100 Y0\nX0 Y60\nG0 Z10\nM30\n")
    assert ends(read) == [(0, 0, 10), (0, 0, 0), (100, 0, 0), (0, 60, 0), (0, 60, 10)]
    assert [m.rapid for m in read.moves] == [False, False, False, True]
    assert [m.feed for m in read.moves] == [50, 50, 50, None]
    assert [m.line for m in read.moves] == [3, 4, 5, 6]
    assert read.ended == 7


def test_the_manner_of_writing_means_nothing():
    plain = gcode("G1 X0 Y0 Z0 F600\nG1 X1.5 Y-0.5 Z0\nG1 X1.5 Y2 Z0\nM2")
    other = gcode("g01x+.0y0.z00f600(G1 X9)\r\nN5 x 1 . 5 y -.5;G1 X9\r\n\r\nN7 G 91 Y+2.5 (M30)\r\nm02\r\nX99")
    assert ends(plain) == ends(other)
    assert [m.feed for m in plain.moves] == [m.feed for m in other.moves] == [10, 10]


@pytest.mark.parametrize(
    ("block", "turn", "middle"),
    [
        ("G2 X10 Y10 I10 J0", -math.pi / 2, (10 - 10 * math.sqrt(0.5), 10 * math.sqrt(0.5), 0)),
        ("G3 X10 Y10 I10 J0", 3 * math.pi / 2, (10 + 10 * math.sqrt(0.5), -10 * math.sqrt(0.5), 0)),
        ("G2 X10 Y10 R10", -math.pi / 2, (10 - 10 * math.sqrt(0.5), 10 * math.sqrt(0.5), 0)),
        ("G3 X10 Y10 R10", math.pi / 2, (10 * math.sqrt(0.5), 10 - 10 * math.sqrt(0.5), 0)),
        ("G2 X10 Y10 R-10", -3 * math.pi / 2, (-10 * math.sqrt(0.5), 10 + 10 * math.sqrt(0.5), 0)),
        ("G2 I10", -2 * math.pi, (20, 0, 0)),
        ("G3 Z4 I10", 2 * math.pi, (20, 0, 2)),
        ("G90.1 G2 X10 Y10 I10 J0", -math.pi / 2, (10 - 10 * math.sqrt(0.5), 10 * math.sqrt(0.5), 0)),
        ("G18 G2 X10 Z10 I10", -3 * math.pi / 2, (10 + 10 * math.sqrt(0.5), 0, -10 * math.sqrt(0.5))),
        ("G18 G3 X20 I10 K0", math.pi, (10, 0, 10)),
    ],
)
def test_arcs_turn_as_their_word_says(block, turn, middle):
    """Seen from +z, and G18 from +y: from z to x is against the clock."""
    (move,) = gcode(f"G1 X0 Y0 Z0\n{block}\nM2").moves
    assert isinstance(move, Arc)
    assert move.turn == pytest.approx(turn)
    assert_allclose(move.at(0.5), middle, atol=1e-12)
    assert_allclose(move.at(1.0), move.end, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("G1 X0 Y0 Z0\nX1\nM30\nX9", 3),
        ("G1 X0 Y0 Z0\nM30 X1\nX9", 2),
        ("%\nG1 X0 Y0 Z0\nX1\n%\nX9", 4),
        ("G1 X0 Y0 Z0\nX1\n%\n\n", 3),
        ("%\nG1 X0 Y0 Z0\nX1\nM2\nwhat\n%", 4),
    ],
)
def test_what_stands_behind_the_end_is_not_read(text, line):
    read = gcode(text)
    assert ends(read) == [(0, 0, 0), (1, 0, 0)]
    assert read.ended == line


def test_a_dwell_is_no_motion():
    assert ends(gcode("G1 X0 Y0 Z0\nG4 X5\nX1\nN9 G04 P0.5\nX2\nM2")) == [(0, 0, 0), (1, 0, 0), (2, 0, 0)]


def test_inches_are_obeyed():
    assert ends(gcode("G20 G1 X0 Y0 Z0 F60\nX1\nM2")) == [(0, 0, 0), (25.4, 0, 0)]
    assert gcode("G20 G1 X0 Y0 Z0 F60\nX1\nM2").moves[0].feed == pytest.approx(25.4 / 60 * 60)
    assert ends(apt("UNITS/INCHES\nGOTO/0,0,0\nGOTO/1,0,0")) == [(0, 0, 0), (25.4, 0, 0)]


def test_words_that_say_nothing_of_the_way_are_passed():
    assert ends(gcode("G54\nG1 X0 Y0 Z0\nG43 H1 Z5\nM30")) == [(0, 0, 0), (0, 0, 5)]
    assert ends(apt("GOTO/0,0,0\nCLEARP/XYPLAN,30\nGOTO/2,0,0\nFINI")) == [(0, 0, 0), (2, 0, 0)]


@pytest.mark.parametrize(
    "block",
    [
        *cam_draws.ARC_TRAPS,
        *(t for t in cam_draws.G_TRAPS if t not in ("G20", "G18", "G19", "G91.1\nG90.1", "G4 X0.5", "G43 H1")),
        "G1 X1 R3", "G2 X1 Y1", "G2 X1 Y1 I1 R2", "G2 X1 Y1 I5 J0", "G3 R5", "G2 X20 R5", "F0", "F-3", "M40", "G91 G90",
        "X", "?", "(a (b))", "X1 ; \n %\n G1 X4", "E3",
    ],
)  # fmt: skip
def test_what_it_does_not_know_it_refuses(block):
    with pytest.raises(Unreadable):
        gcode(f"G54\nG1 X0 Y0 Z0\nX3 Y0\n{'G2 X0 Y0 I-1.5 ' if block in cam_draws.ARC_TRAPS else ''}{block}\nM30")


def test_a_work_offset_is_fine_until_it_changes():
    assert len(gcode("G55\nG1 X0 Y0 Z0\nG55\nX1\nM2").moves) == 1
    for text in ("G1 X0 Y0 Z0\nG55\nX1", "G54 G55 X0", "G54\nG1 X0 Y0 Z0\nX1 G56"):
        with pytest.raises(Unreadable):
            gcode(text)


def test_a_place_is_not_known_before_all_its_axes_are():
    assert ends(gcode("G0 Z10\nG0 X0 Y0\nG1 Z0\nM2")) == [(0, 0, 10), (0, 0, 0)]
    for text in ("G1 X0 Y0", "G91 G0 X0 Y0 Z0", "G1 X0 Y0 Z0\nX1\nG0 X2 Y"):
        with pytest.raises(Unreadable):
            gcode(text)


def test_apt_goes_in_straight_lines_and_rapid_is_for_one():
    read = apt(
        "PARTNO X GOTO/9,9,9\nUNITS/MM\nMULTAX\nFEDRAT/3000\nGOTO/0,0,0,0,0,1\nRAPID\n"
        "goto / 100, $\n 0,0,0,0,1 $$ GOTO/5,5\nGODLTA/0,5,0\nPPRINT GOTO/1,1,1\nFEDRAT/60,MMPM\n"
        "GOTO/1.E1,-.5,0,0,0,1\nFINI\nGOTO/400,300,0,0,0,1"
    )  # fmt: skip
    assert ends(read) == [(0, 0, 0), (100, 0, 0), (100, 5, 0), (10, -0.5, 0)]
    assert [m.rapid for m in read.moves] == [True, False, False]
    assert [m.feed for m in read.moves] == [None, 50, 1]
    assert [m.normal for m in read.moves] == [(0, 0, 1)] * 3
    assert read.ended == 13


def test_a_circle_turns_right_handed_about_its_axis():
    (left,) = apt("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,0").moves
    (right,) = apt("GOTO/10,0,0\nCIRCLE/0,0,5,0,0,-1,10\nGOTO/0,10,2").moves
    assert isinstance(left, Arc)
    assert isinstance(right, Arc)
    assert_allclose(left.at(0.5), [10 * math.sqrt(0.5), 10 * math.sqrt(0.5), 0], atol=1e-12)
    assert_allclose(right.at(0.5), [-10 * math.sqrt(0.5), -10 * math.sqrt(0.5), 1], atol=1e-12)
    for text in (
        "CIRCLE/0,0,0,0,0,1,9\nGOTO/0,10,0",
        "CIRCLE/0,0,0,0,0,1,10",
        "CIRCLE/0,0,0,0,0,1,10\nRAPID\nGOTO/0,10,0",
    ):
        with pytest.raises(Unreadable):
            apt("GOTO/10,0,0\n" + text)


@pytest.mark.parametrize(
    "word", [t for t in cam_draws.APT_TRAPS if t not in ("UNITS/INCHES", "CYCLE/OFF", "CLEARP/XYPLAN,30")]
)
def test_apt_words_that_it_does_not_know_are_refused(word):
    with pytest.raises(Unreadable):
        apt(f"GOTO/0,0,0\nGOTO/1,0,0\n{word}\nGOTO/2,0,0\nFINI")


def test_points_are_read_by_the_names_of_their_columns():
    read = points("y_mm, x_mm,z_mm,contact,feed_mm_s\n1,2,3,1,\n\n4,5,6,0,20\n")
    assert read.moves == [Line((2, 1, 3), (5, 4, 6), 20.0, True, None, 4)]
    for text in ("x_mm,y_mm\n1,2", "x_mm,y_mm,z_mm\n1,2", "x_mm,y_mm,z_mm,a\n1,2,3,4", "x_mm,y_mm,z_mm\n1,2,nan"):
        with pytest.raises(Unreadable):
            points(text)


@pytest.mark.parametrize("pattern", ["gcode", "apt", "points"])
def test_what_was_drawn_is_what_is_read(pattern, monkeypatch):
    """The way that a file was written from, in whatever manner, is the way that is read from it."""
    ways = []
    writers = {"gcode": "gcode_text", "apt": "apt_text", "points": "csv_text"}
    write = getattr(cam_draws, writers[pattern])

    def watched(rng, steps, *rest):
        ways.append(steps)
        return write(rng, steps, *rest)

    monkeypatch.setattr(cam_draws, writers[pattern], watched)
    read = 0
    for seed in range(250):
        ways.clear()
        case = cam_draws.drawn(seed)
        if case.pattern != pattern or case.trap not in ("", "CIRCLE"):
            continue
        moves = naive_cam.READERS[pattern](case.text).moves
        steps = ways[0][1:]
        assert_allclose([m.end for m in moves[: len(steps)]], [s.end for s in steps], atol=TOLD_MM)
        assert len(moves) - len(steps) in (0, 1)  # one may stand in the block of M30
        for move, step in zip(moves, steps, strict=False):
            assert isinstance(move, Arc) == (step.centre is not None)
            assert move.rapid == (step.kind == "rapid") or pattern != "gcode"
            if step.centre is not None:
                assert isinstance(move, Arc)
                assert math.dist(move.centre[:2], step.centre) < 0.1  # by R near half a turn the digits decide
                assert (move.turn * move.axis[2] > 0) == (step.kind == "ccw")
        read += 1
    assert read > 30
