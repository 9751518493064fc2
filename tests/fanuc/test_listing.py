"""Any .LS file in, the same bytes out, and every number where a second reader sees it too."""

import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

import fuzz_listing
import numpy as np
import pytest
from agreement import assert_readers_agree, moves_of
from hypothesis import given, settings
from printed import programs

from compgen.core.exceptions import InputError
from compgen.fanuc.listing.lines import line_end
from compgen.fanuc.listing.listing import dumps, edited, loads
from compgen.fanuc.listing.position_parser import AXES, NO_NUMBER

TESTS = Path(__file__).resolve().parents[1]
SAMPLES = TESTS.parents[1] / "shared" / "fanuc" / "samples"
REAL = sorted(p for p in SAMPLES.rglob("*") if p.is_file() and p.suffix.lower() == ".ls")
GOLDEN = sorted((TESTS / "golden").glob("*.LS"))
FUZZ_INPUTS = 2_000
LONG = 20_000  # bytes of one line, far above any real one


def golden(name):
    return loads((TESTS / "golden" / f"{name}.LS").read_bytes())


def program(mn=b"", pos=b"", head=b"/PROG  T\n/ATTR\n"):
    return head + b"/MN\n" + mn + b"/POS\n" + pos + b"/END\n"


def point(n=b"1", x=b"1.000", config=b"N U T, 0, 0, 0"):
    return b"P[%s]{\n   GP1:\n\tUF : 0, UT : 1,\t\tCONFIG : '%s',\n\tX = %s  mm\n};\n" % (n, config, x)


def row(read, number, group=1):
    """Place of one group of one position in the table."""
    (found,) = np.flatnonzero((read.positions.number == number) & (read.positions.group == group))
    return int(found)


def axes(read, number, group=1):
    """The numbers that are there, by axis."""
    values = read.positions.value[row(read, number, group)]
    return {axis: value for axis, value in zip(AXES, values, strict=True) if not np.isnan(value)}


# Real programs ---------------------------------------------------------------------------------------------------


@pytest.mark.skipif(not REAL, reason="no programs of other people here")
def test_there_are_88_real_programs():
    assert len(REAL) == 88


@pytest.mark.parametrize("path", REAL, ids=lambda p: p.name)
def test_real_program_is_kept_and_read_as_a_second_reader_does(path):
    assert_readers_agree(path.read_bytes())


@pytest.mark.skipif(not REAL, reason="no programs of other people here")
def test_real_programs_hold_enough_to_check():
    read = [loads(p.read_bytes()) for p in REAL]
    assert sum(len(r.motions.letter) for r in read) > 1000
    assert sum(len(r.positions.number) for r in read) > 1000


# Golden programs -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", GOLDEN, ids=lambda p: p.name)
def test_golden_program_is_kept_and_read_as_a_second_reader_does(path):
    assert_readers_agree(path.read_bytes())


def test_golden_line_ends_are_still_what_they_were_made_for():
    ends = {p.stem: p.read_bytes() for p in GOLDEN}
    assert b"\r\n" in ends["CTRL"]
    assert b"\n" not in ends["LONECR"]
    assert b"\r" not in ends["TRAPS"]
    left = ends["MIXED"].replace(b"\r\n", b"")
    assert b"\r\n" in ends["MIXED"]
    assert b"\n" in left
    assert b"\r" in left


def test_header_fields_names_and_subtype():
    read = golden("CTRL")
    assert (read.name, read.subtype) == ("CTRL", "Macro")
    fields = dict(read.attributes)
    assert fields["COMMENT"] == '"größe µm"'
    assert fields["DEFAULT_GROUP"] == "1,1,*,*,*"
    assert fields["LINE_COUNT"] == "77"
    assert (golden("NOPOS").name, golden("NOPOS").attributes) == ("NOPOS", ())


def test_names_hold_colons_brackets_quotes_and_latin_1():
    read = golden("CTRL")
    targets = ['P[1:"home"]', "P[2:grün: links]", "P[4]", "P[7:a]b]", "P[9]"]
    assert [t for (t,) in read.motions.target] == targets
    assert [list(p) for p in read.motions.position] == [[1], [2], [4], [7], [9]]
    names = dict(zip(read.positions.number.tolist(), read.positions.name, strict=True))
    assert names == {1: "home", 2: "grün: links", 4: "", 7: "a]b", 9: "", 12: ""}


def test_second_group_and_extra_axis_in_mm():
    read = golden("CTRL")
    assert axes(read, 2)["E1"] == 123.456
    assert axes(read, 2, group=2) == {"J1": 45.5, "J2": -90.0}
    assert axes(read, 7, group=2) == {"J1": 0.5}
    assert axes(read, 7)["X"] == -1474.831
    i = row(read, 2, group=2)
    assert (read.positions.uframe[i], read.positions.utool[i], read.positions.config[i]) == (2, 3, None)


def test_joint_form_under_a_linear_move():
    read = golden("MOVES")
    assert read.motions.letter[5] == "L"
    assert read.motions.position[5] == (1,)
    assert axes(read, 1) == {f"J{i}": float(i) for i in range(1, 7)}


def test_frames_differ_between_positions_and_gaps_and_unused_positions_stay():
    p = golden("CTRL").positions
    assert sorted(set(p.number.tolist())) == [1, 2, 4, 7, 9, 12]
    pairs = {n: (u, t) for n, g, u, t in zip(p.number, p.group, p.uframe, p.utool, strict=True) if g == 1}
    assert pairs == {1: (0, 1), 2: (0, 1), 4: (3, 2), 7: (0, 1), 9: (9, 10), 12: (9, 10)}
    assert 12 not in np.concatenate(golden("CTRL").motions.position)


def test_numbers_in_every_print():
    read = golden("NUMBERS")
    assert axes(read, 1) == {"X": 0.044, "Y": -0.242, "Z": 0.0, "W": 0.0, "P": 0.0, "R": 0.0}
    assert axes(read, 2) == {"X": 181.350006, "Y": -7.5, "Z": 12.25, "W": 0.0, "P": -90.0, "R": 3.0}
    assert axes(read, 3) == {}
    assert axes(read, 4) == {"X": 1.0, "Y": 2.0, "Z": 3.0, "W": 4.0, "P": 5.0, "R": 6.0}
    assert axes(read, 5) == {"J1": -180.0, "J3": 0.001, "J4": 0.0}
    assert axes(read, 6)["E3"] == -9.0
    assert axes(read, 2049)["X"] == 123456.789
    i = row(read, 1)
    z = AXES.index("Z")
    assert read.text(read.positions.span[i, z]) == "-.000"
    assert np.signbit(read.positions.value[i, z])


def test_active_frames_and_odd_configs():
    read = golden("NUMBERS")
    p = read.positions
    assert p.config == ("N   U   T, 0,0,0", "", "N U T, 0, 0, 0", "R, 0, 0, 0", None, "F, , 0, 0", "N U T, 0, 0, 0")
    assert (p.uframe[1], p.utool[1]) == (NO_NUMBER, NO_NUMBER)
    assert p.name == ("", "", "", "", "", "it's \"5\" o'clock", "last")


def test_a_name_may_end_with_a_quote():
    assert loads(program(pos=point(b'1:"in "quotes""'))).positions.name == ('in "quotes"',)


def test_only_true_moves_are_moves():
    read = golden("TRAPS")
    speeds = ["11", "12", "13", "14", "15", "16", "17", "18", "19", "21%", *(str(s) for s in range(22, 26))]
    got = [s.lower().removesuffix("mm/sec") for s in read.motions.speed]
    assert got == [*speeds, "26", "27", "28"]
    disabled = [s for s, off in zip(got, read.motions.disabled, strict=True) if off]
    assert disabled == ["12", "18"]


def test_wrapped_remark_is_no_move():
    read = golden("TRAPS")
    assert read.remarks[0] == "the arm goes to a place and then"
    assert not set(read.motions.line) & {5, 7, 11}  # the wrapped lines of TRAPS.LS


def test_circle_stands_on_one_line_or_two():
    read = golden("TRAPS")
    circles = [(t, s) for letter, t, s, _ in moves_of(read) if letter == "C"]
    assert circles == [
        (("P[1]", "P[2]"), "16mm/sec"),
        (("P[1]", "P[2]"), "17mm/sec"),
        (("P[1]", "P[3]"), "18mm/sec"),
    ]
    assert [list(p) for letter, p in zip(read.motions.letter, read.motions.position, strict=True) if letter == "C"] == [
        [1, 2],
        [1, 2],
        [1, 3],
    ]


def test_a_circle_without_its_semicolon_is_not_lost():
    for text in (b"   1:C P[1] P[1] 5mm/sec FINE\n", b"   1:C P[1]\n", b"   1:C P[1]\n    :  P[1] 5mm/sec FINE\n"):
        try:
            read = loads(program(text + b"   2:L P[1] 6mm/sec FINE ;\n", point()))
        except InputError:
            continue  # refusing is right too
        assert read.motions.letter == ("C", "L")


def test_a_move_whose_target_cannot_be_read_is_refused():
    with pytest.raises(InputError, match="line 4"):
        loads(program(b"   1:L P[1]&7mm/sec FINE ;\n", point()))


def test_a_position_without_content_is_not_lost():
    try:
        read = loads(program(b"", b"P[1]{\n};\n"))
    except InputError:
        return  # refusing is right too
    assert read.positions.number.tolist() == [1]


def test_numbers_restart_in_point_logic_and_pass_9999():
    read = golden("TRAPS")
    lines = dict(zip(read.motions.speed, read.motions.line.tolist(), strict=True))
    text = read.data.decode("latin-1").split("\n")
    for speed, line in lines.items():
        if speed not in ("16mm/sec", "18mm/sec"):  # their speed stands on the line below
            assert speed in text[line - 1]
    assert "TB    .10sec,P-SPS" in read.motions.options
    assert "TA    .25sec,P-SPS" in read.motions.options


def test_options_on_a_continuation_line_belong_to_the_move():
    read = golden("TRAPS")
    assert read.motions.speed[-1] == "28mm/sec"
    assert read.motions.options[-1].replace(":", " ").split() == ["Offset,PR[4]", "INC"]
    assert "INC" in read.text(read.motions.span[-1])


@pytest.mark.parametrize("after", [b"", b".", b"\r\n \t\r\n", b"\r\n\x1a"])
def test_blanks_after_the_end_are_kept(after):
    read = loads(WHOLE.rstrip() + after)
    assert dumps(read).endswith(b"/END" + after)
    assert set(read.positions.number.tolist()) == {1}


def test_every_speed_unit_and_every_target():
    read = golden("MOVES")
    m = read.motions
    assert len(m.letter) == 30
    assert {s.lstrip("0123456789.") for s in m.speed if s[:1] in ".0123456789"} == {
        "%", "sec", "msec", "mm/sec", "cm/min", "inch/min", "deg/sec",
    }  # fmt: skip
    assert [s for s in m.speed if s[:1] not in ".0123456789"] == [
        "R[5]%", "R[12:a]b 5%]mm/sec", "R[R[4]]cm/min", "AR[2]mm/sec", "WELD_SPEED", "max_speed",
    ]  # fmt: skip
    elsewhere = [t[0] for t, p in zip(m.target, m.position, strict=True) if p[0] == NO_NUMBER]
    assert elsewhere == ["P[R[3:which]]", "PR[62:JPOS[]]", "PR[GP1:5]", "PR[R[9]]", "PR[7:next :5]"]
    assert m.letter[22:27] == ("A", "A", "A", "S", "S")
    assert Counter(m.termination)["FINE"] == 15
    assert {"CNT0", "CNT1", "CNT99", "CNT R[8:blend]", "CNT R[1]", "CR20", "CD5"} < set(m.termination)


def test_options_are_kept_in_order():
    options = golden("MOVES").motions.options
    assert options[15] == "COORD PTH"
    assert options[21] == "Tool_Offset,PR[8:x] ACC50"
    assert options[27] == "Skip,LBL[2],PR[1:q]=LPOS"
    assert options[28] == "TB    .10sec,CALL OPEN"
    assert options[29] == "ACC R[4] INC Wjnt EV50%"


def test_a_program_may_have_no_positions():
    for name in ("EMPTY", "NOPOS"):
        read = golden(name)
        assert len(read.positions.number) == len(read.motions.letter) == 0
        assert read.positions.value.shape == (0, len(AXES))
        assert read.statements.tolist() == [4 if name == "EMPTY" else 5]


def test_lines_are_counted_alike_with_every_line_end():
    mixed = golden("MIXED")
    text = (TESTS / "golden" / "MIXED.LS").read_bytes()
    lines = text.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
    assert [lines[i - 1].split(b"P[")[0].strip() for i in mixed.motions.line] == [b"1:J", b"3:C"]
    assert [lines[i - 1] for i in mixed.positions.line] == [b"P[1]{", b"P[2]{"]


@pytest.mark.parametrize(
    ("data", "end"),
    [(b"a\r\nb\n", b"\r\n"), (b"a\nb\r\n", b"\n"), (b"a\rb\r", b"\r"), (b"a\n\r\n", b"\n"), (b"a", b"\r\n")],
)
def test_added_lines_end_as_the_files_first(data, end):
    assert line_end(data) == end


def test_lone_carriage_returns_end_lines():
    read, mixed = golden("LONECR"), golden("MIXED")
    assert moves_of(read) == moves_of(mixed)
    assert read.attributes == mixed.attributes
    assert read.motions.line.tolist() == mixed.motions.line.tolist()
    np.testing.assert_array_equal(read.positions.value, mixed.positions.value)


def test_tags_and_keywords_in_any_case():
    data = program(b"   1:L P[1] 5mm/sec FINE ;\n", point())
    read = loads(data.lower())
    assert moves_of(read) == [("L", ("P[1]",), "5mm/sec", "fine")]
    assert axes(read, 1) == {"X": 1.0}


def test_a_remark_in_another_language_is_only_a_remark():
    read = loads(program(b"   1:  !KOMMENTAR: 5 ZEILEN ;\n   2:L P[1] 5mm/sec FINE ;\n", point()))
    assert len(read.motions.letter) == 1


def test_a_name_may_hold_a_bracket_and_a_number():
    read = loads(program(b"   1:L P[1:a] 5b] 5mm/sec FINE ;\n", point(b"1")))
    assert moves_of(read) == [("L", ("P[1:a] 5b]",), "5mm/sec", "FINE")]


def test_a_second_group_that_says_the_same_may_have_a_linear_axis():
    pose = b"P[1]{\n   GP1:\n\tUF:1, UT:0,\t\nJ1=0deg\n   GP2:\n\tUF:1, UT:0,\t\nJ1=0mm\n};\n"
    assert_readers_agree(program(b"   1:J P[1] 5% FINE ;\n", pose))


# Programs nobody wrote -----------------------------------------------------------------------------------------------


@settings(max_examples=500, deadline=None, derandomize=True, database=None)
@given(programs())
def test_programs_nobody_wrote_are_read_as_a_second_reader_does(data):
    assert_readers_agree(data)


# Edits -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", GOLDEN, ids=lambda p: p.name)
def test_an_edit_changes_its_bytes_and_nothing_else(path):
    read = loads(path.read_bytes())
    p = read.positions
    places: dict[tuple[int, int], bytes] = {}
    for i, j in zip(*np.nonzero(p.span[:, :, 1]), strict=True):
        begin, end = p.span[i, j].tolist()
        places[begin, end] = b"-%d.25" % (len(places) + 1)
    for i, speed in enumerate(read.motions.speed):
        if speed.endswith("mm/sec"):
            places[tuple(read.motions.speed_span[i].tolist())] = b"77mm/sec"
    new = edited(read, places)
    expected, at = b"", 0
    for (start, end), text in sorted(places.items()):
        expected += read.data[at:start] + text
        at = end
    assert dumps(new) == expected + read.data[at:]
    assert new.motions.target == read.motions.target
    written = p.span[:, :, 1] > 0
    np.testing.assert_array_equal(np.isnan(new.positions.value), ~written)
    np.testing.assert_array_equal(new.positions.value[written], -np.arange(1, written.sum() + 1) - 0.25)
    assert new.positions.config == p.config


def test_no_edit_gives_the_same_bytes():
    read = golden("CTRL")
    assert dumps(edited(read, {})) == read.data


def test_a_config_is_edited_in_place():
    read = golden("CTRL")
    place = tuple(read.positions.config_span[row(read, 4)].tolist())
    new = edited(read, {place: b"F U T, 1, 0, 0"})
    assert new.positions.config[row(new, 4)] == "F U T, 1, 0, 0"
    assert dumps(new) == read.data.replace(b"F U B, 0, -1, 1", b"F U T, 1, 0, 0")


@pytest.mark.parametrize("places", [[(100, 110), (105, 120)], [(120, 110)]], ids=["overlap", "backwards"])
def test_edits_that_overlap_or_run_backwards_are_refused(places):
    read = golden("CTRL")
    with pytest.raises(InputError):
        edited(read, {place: b"xx" for place in places})


def test_an_edit_that_breaks_a_position_is_refused():
    read = golden("CTRL")
    place = tuple(read.positions.span[row(read, 4), 0].tolist())
    with pytest.raises(InputError, match=r"P\[4\]"):
        edited(read, {place: b"here"})


# Refusals --------------------------------------------------------------------------------------------------------

WHOLE = program(b"   1:L P[1] 5mm/sec FINE ;\n", point())
FRENCH = b'/PROG  T\r\n/ATTR\r\nPROPRIETAIRE = MNEDITOR;\r\nCOMMENTAIRE = "x";\r\n/MN\r\n/POS\r\n/END\r\n'
BROKEN = {
    "binary": (b"\x00\x12TPP\x00\x00" * 40, "binary"),
    "empty": (b"", "/PROG"),
    "blank": (b" \r\n\r\n", "/PROG"),
    "not a program": (b"ERRALL.LS   robot 1\n 1 SRVO-001\n", "line 1"),
    "translated": (FRENCH, "language"),
    "cut before /END": (WHOLE[: WHOLE.index(b"/END")], "/END"),
    "cut in a position": (WHOLE[: WHOLE.index(b"X =") + 4], "line 9: /END"),
    "cut before /POS": (WHOLE[: WHOLE.index(b"/POS")], "/END"),
    "cut in the header": (WHOLE[:12], "/MN"),
    "garbage in a number": (WHOLE.replace(b"1.000", b"1.0x0"), "line 9"),
    "garbage in a position": (WHOLE.replace(b"\tX", b"???\tX"), "line 9"),
    "garbage between positions": (WHOLE.replace(b"};\n", b"};\nhello\n"), "line 11"),
    "two points": (WHOLE.replace(b"1.000", b"1.00.0"), "line 9"),
    "exponent": (WHOLE.replace(b"1.000", b"1e3"), "line 9"),
    "unknown unit": (WHOLE.replace(b"  mm", b"  inch"), "line 9"),
    "unknown axis": (WHOLE.replace(b"X =", b"E9 ="), "E9"),
    "length in degrees": (WHOLE.replace(b"  mm", b"  deg"), "line 9: P[1]: X is in deg; give it in mm"),
    "angle in mm": (WHOLE.replace(b"\n};", b",\n\tW = 180.000 mm\n};"), "line 10: P[1]: W is in mm; give it in deg"),
    "joint in mm": (WHOLE.replace(b"X =", b"J3 ="), "line 9: P[1]: J3 is in mm; give it in deg"),
    "remote angle in mm": (WHOLE.replace(b"\n};", b",\n\tRP = 1.000 MM\n};"), "line 10: P[1]: P is in mm"),
    "text behind the end": (WHOLE + b"\nP[4]{ a note, not a position\n", "line 13: text stands behind /END"),
    "text on the line of the end": (WHOLE.rstrip() + b" of it\n", "line 11: text stands behind /END"),
    "position not closed": (WHOLE.replace(b"};", b""), "line 11"),
    "position number of 20 digits": (WHOLE.replace(b"P[1]{", b"P[" + b"9" * 20 + b"]{"), "line 6"),
    "position number of 5000 digits": (WHOLE.replace(b"P[1]{", b"P[" + b"9" * 5000 + b"]{"), "line 6"),
    "group of 20 digits": (WHOLE.replace(b"GP1", b"GP" + b"9" * 20), "line"),
    "frame of 20 digits": (WHOLE.replace(b"UF : 0", b"UF : " + b"9" * 20), "line"),
    "target of 20 digits": (WHOLE.replace(b"L P[1]", b"L P[" + b"9" * 20 + b"]"), "line 4"),
    "axis twice": (WHOLE.replace(b"\n};", b",\n\tX = 2.000  mm\n};"), "P[1]"),
    "group twice": (WHOLE.replace(b"\n};", b"\n   GP1:\n\tY = 2.000  mm\n};"), "P[1]"),
    "position twice": (WHOLE.replace(b"/END", point() + b"/END"), "P[1]"),
    "number beyond floats": (WHOLE.replace(b"1.000", b"9" * 400), "line 9"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_no_program_is_refused_in_one_line(name):
    data, says = BROKEN[name]
    with pytest.raises(InputError) as refused:
        loads(data)
    assert says in str(refused.value)
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 200


def test_the_whole_program_behind_the_refusals_is_good():
    assert axes(loads(WHOLE), 1) == {"X": 1.0}


# Cost ------------------------------------------------------------------------------------------------------------


LONG_LINES = {
    "blanks after a target": program(b"   1:L P[1]" + b" " * LONG + b"x ;\n"),
    "digits of a speed": program(b"   1:L P[1] " + b"1" * (LONG // 2) + b" ;\n"),
    "brackets of a name": program(b"   1:L P[1:" + b"]" * LONG + b" ;\n"),
    "blanks before an instruction": program(b"   1:" + b" " * LONG + b"x ;\n"),
    "blanks in a header field": program(head=b"/PROG  T\n/ATTR\nA = x" + b" " * LONG + b"y;;\n"),
    "commas in a position": program(pos=b"P[1]{\nX = 1.0 mm" + b"," * LONG + b"?};\n"),
}


@pytest.mark.parametrize("name", LONG_LINES)
def test_a_long_line_costs_no_more_than_its_length(name):
    start = time.process_time()
    with suppress(InputError):
        loads(LONG_LINES[name])
    assert time.process_time() - start < fuzz_listing.LONGEST_S


def test_damaged_programs_are_taken_whole_or_refused():
    counts: Counter[str] = Counter()
    assert [what for what, _ in fuzz_listing.faults(FUZZ_INPUTS, 1, counts, fuzz_listing.golden_programs())] == []
    assert min(counts["accepted"], counts["refused"]) > FUZZ_INPUTS // 10


@pytest.mark.parametrize(
    "statement",
    [
        b"   1:L P[1] 100mm/sec FINE\n" + b"    :  ACC50\n" * 30_000,
        b"   1:L P[1] 100mm/sec FINE " + b"[" * 200_000 + b" ;\n",
        b"   1:  " + b"[" * 200_000 + b" ;\n",
        b"   1:  !" + b"x" * 200_000 + b"\n" * 20,
    ],
    ids=["continued", "motion", "other", "remark"],
)
def test_a_statement_that_no_controller_prints_is_refused(statement):
    """Each further line of one was searched again with all that stood before it: ten megabytes took minutes."""
    with pytest.raises(InputError, match="program: line 3: a statement of more than 65536 characters"):
        loads(b"/PROG  T\n/MN\n" + statement + b"    :  ;\n/POS\n/END\n")


def test_a_tag_that_is_repeated_is_the_first():
    program = loads(b"/PROG  T\n/MN\n" + b"/MN\n" * 1000 + b"   1:  !here ;\n/POS\n/END\n")
    assert program.remarks == ("here",)
