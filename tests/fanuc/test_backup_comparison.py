"""What a controller gives back against what was written: only print may differ, and each difference is named."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shipped import ROOT

from compgen import fanuc as ls
from compgen.core.rotations import from_wpr
from compgen.core.units import DEG
from compgen.fanuc.backup_comparison import compare_programs, core
from compgen.fanuc.listing.listing import statement_texts
from compgen.program.program import Program
from compgen.program.speeds import writable_speed
from compgen.robot.inverse_kinematics import ALL_POSTURES

SAMPLES = ROOT.parent / "shared" / "fanuc" / "samples"


def written(count=30, seed=3, decimals=3):
    rng = np.random.default_rng(seed)
    return ls.compose(Program(
        name="PLATE", comment="compgen 01234567", date="26-01-01", remarks=("compgen 1.0 arm", "RUN AT 100% OVERRIDE"),
        uframe=2, utool=3, position=rng.uniform(-2, 2, (count, 3)),
        rotation=from_wpr(*(rng.uniform(-179, 179, size=(3, count)) * [[1], [0.4], [1]] * DEG)),
        posture=ALL_POSTURES[seed % 8], turns=rng.integers(-1, 2, size=(count, 3)),
        speed=np.array([writable_speed(v) for v in 10 ** rng.uniform(-3, 0, count - 1)]),
        fine=rng.random(count) < 0.3, decimals=decimals, payload=2, acc=80,
    ))  # fmt: skip


def sizes_and_dates(text):
    """The head as a controller writes it, and six lines that it adds under /APPL."""
    for key, value in (("PROG_SIZE", 4711), ("LINE_COUNT", 99), ("MEMORY_SIZE", 5211), ("VERSION", 3)):
        text = re.sub(rf"({key}\t+= )\d+", rf"\g<1>{value}", text)
    text = re.sub(r"DATE \S+  TIME \S+;", "DATE 26-03-04  TIME 05:06:07;", text).replace(
        "FILE_NAME\t= ;", "FILE_NAME\t= OLD;"
    )
    text = (
        text.replace("READ_WRITE", "READ")
        .replace("1,*,*,*,*;", "1,*,*,*,*,*,*,*;")
        .replace("= MNEDITOR", "= MNEDITOR2")
    )
    return text.replace("/MN\r\n", "/APPL\r\n  ARC Welding Equipment : 1;\r\n/MN\r\n")


def line_numbers(text):
    head, mn, rest = text.partition("/MN")
    return head + mn + re.sub(r"^ *\d+:", "   :", rest, flags=re.MULTILINE)


def blanks(text):
    text = re.sub(r"P\[(\d+)\] ", r"P[\1]   ", text).replace("    ;", " ;").replace("UFRAME_NUM=", "UFRAME_NUM = ")
    return text.replace("CNT100", "CNT 100").replace("CONFIG : '", "CONFIG : ' ").replace("\tX =", "\t X  =")


def names(text):
    text = re.sub(r"PAYLOAD\[(\d+)\]", r"PAYLOAD[\1:SPINDLE [new]]", text)
    text = re.sub(r"^P\[(\d+)\]\{", r'P[\1:"place \1"]{', text, flags=re.MULTILINE)
    return re.sub(r"L P\[(\d+)\]", r"L P[\1:place \1]", text)


def capitals(text):
    return re.sub(r"!.*", lambda m: m[0].upper(), text).replace('"compgen', '"COMPGEN')


def zeros(text):
    return re.sub(r"(?<=[ -])0\.(\d)", r".\1", text).replace("UF : 2", "UF : 02")


def axes(text):
    return re.sub(r"(R =[^\r\n]*deg)\r\n\}", "\\1,\r\n\tE1=     0.000  mm\r\n}", text)


def line_ends(text):
    return text.replace("\r\n", "\n") + "\n\n"


def order_of_positions(text):
    head, pos, rest = text.partition("/POS")
    blocks = re.findall(r"P\[\d.*?\};", rest, re.DOTALL)
    return head + pos + "\n" + "\n".join(reversed(blocks)) + "\n/END\r\n"


def singles(text):
    """Six decimals of the nearest single."""
    return re.sub(r"(= +)(-?\d+\.\d+)(?= +(?:mm|deg))", lambda m: f"{m[1]}{np.float32(m[2]):.6f}", text)


PRINT = [
    sizes_and_dates, line_numbers, blanks, names, capitals, zeros, axes, line_ends, order_of_positions, singles
]  # fmt: skip


def differences(one, other):
    return compare_programs(ls.loads(one), ls.loads(other)).differences


@pytest.mark.parametrize("change", PRINT, ids=lambda change: change.__name__)
def test_what_only_print_changes_is_the_same(change):
    text = written().decode()
    assert change(text) != text
    assert differences(written(), change(text).encode()) == ()


@settings(max_examples=60, deadline=None)
@given(st.permutations(PRINT), st.integers(0, 2**32 - 1), st.sampled_from([3, 6]))
def test_all_of_it_together_is_the_same(changes, seed, decimals):
    original = written(12, seed, decimals)
    text = original.decode()
    for change in changes:
        text = change(text)
    compared = compare_programs(ls.loads(original), ls.loads(text.encode()))
    assert compared.differences == ()
    assert (compared.positions, compared.statements) == (12, 17)


def one_on(match):
    """The digit that follows the last one of a number."""
    return match[1] + str((int(match[2]) + 1) % 10)


ANOTHER_POSITION = """P[31]{\r
   GP1:\r
\tUF : 2, UT : 3,\tCONFIG : 'N U T, 0, 0, 0',\r
\tX = 1.000 mm,\tY = 1.000 mm,\tZ = 1.000 mm,\r
\tW = 1.000 deg,\tP = 1.000 deg,\tR = 1.000 deg\r
};\r
/END"""
SECOND_GROUP = "\r\n   GP2:\r\n\tUF : 0, UT : 0,\r\n\tJ1= 1.000 deg\r\n}"
ONE = {
    "the last digit of X": (r"(P\[7\]\{[^}]*?X = +-?\d+\.\d\d)(\d)", one_on, "P[7]: X"),
    "the last digit of R": (r"(P\[8\]\{[^}]*?R = +-?\d+\.\d\d)(\d)", one_on, "P[8]: R"),
    "a sign": (r"(P\[9\]\{[^}]*?Y = +)(-?)", lambda m: m[1] + ("" if m[2] else "-"), "P[9]: Y"),
    "a turn": (r"(P\[3\]\{[^']*'\w \w \w, )(-?\d)", lambda m: m[1] + str(int(m[2]) + 1), "P[3]: CONFIG"),
    "a posture": (r"(P\[3\]\{[^']*')(\w)", lambda m: m[1] + ("F" if m[2] == "N" else "N"), "P[3]: CONFIG"),
    "a frame": (r"(P\[4\]\{\s+GP1:\s+UF : )2", lambda m: m[1] + "1", "P[4]: UF"),
    "the active frame": (r"(P\[4\]\{\s+GP1:\s+UF : )2", lambda m: m[1] + "F", "P[4]: UF"),
    "a tool": (r"(P\[4\]\{\s+GP1:\s+UF : 2, UT : )3", lambda m: m[1] + "9", "P[4]: UT"),
    "an untaught number": (r"(P\[5\]\{[^}]*?Z = +)-?[\d.]+", lambda m: m[1] + "********", "P[5]: Z"),
    "an axis that stands elsewhere": (
        r"(P\[6\]\{[^}]*deg)\r\n\}", lambda m: m[1] + ",\r\n\tE1=     0.001  mm\r\n}", "P[6]: E1"),
    "a position that is gone": (r"P\[30\]\{.*?\};\r\n", lambda m: "", "P[30]: position: written there"),
    "a position more": (r"/END", lambda m: ANOTHER_POSITION, "P[31]: position: written -"),
    "a second group": (r"(P\[6\]\{[^}]*deg)\r\n\}", lambda m: m[1] + SECOND_GROUP, "P[6] GP2: position"),
    "a speed": (r"(L P\[7\] )(\d)", lambda m: m[1] + str(9 - int(m[2])), "speed"),
    "a termination": (r"(L P\[7\] \S+ )(FINE|CNT100)", lambda m: m[1] + "CNT50", "termination"),
    "a target": (r"L P\[7\]", lambda m: "L P[8]", "target"),
    "a letter": (r"L P\[7\]", lambda m: "J P[7]", "letter"),
    "an option": (r"(L P\[7\][^;]*?)ACC80", lambda m: m[1] + "ACC81", "options"),
    "an option that is gone": (r"(L P\[7\][^;]*?)ACC80", lambda m: m[1], "options"),
    "a statement disabled": (r":L P\[7\]", lambda m: ":  //L P[7]", "statement"),
    "a payload": (r"PAYLOAD\[2\]", lambda m: "PAYLOAD[1]", "statement"),
    "a frame number": (r"UFRAME_NUM=2", lambda m: "UFRAME_NUM=1", "statement"),
    "a remark": (r"!compgen 1\.0", lambda m: "!compgen 1.1", "remark"),
    "a remark that is gone": (r" +1:  !compgen[^\n]*\n", lambda m: "", "statement: written !compgen 1.0 arm, backup -"),
    "a statement more": (r"(\d+:L P\[7\])", lambda m: "11:  OVERRIDE=50% ;\r\n  " + m[1], "backup OVERRIDE=50%"),
    "a name": (r"/PROG  PLATE", lambda m: "/PROG  PLATE_2", "head: name: written PLATE, backup PLATE_2"),
    "a comment": (r"compgen 01234567", lambda m: "compgen 01234568", "head: COMMENT"),
    "motion groups": (r"1,\*,", lambda m: "1,1,", "head: DEFAULT_GROUP"),
}  # fmt: skip


@pytest.mark.parametrize("what", ONE)
def test_one_difference_is_found_and_named(what):
    old, new, words = ONE[what]
    text = written().decode()
    changed, count = re.subn(old, new, text, count=1, flags=re.DOTALL)
    assert count == 1
    assert changed != text
    for dressed in (changed, sizes_and_dates(names(blanks(changed)))):
        differing = differences(written(), dressed.encode())
        assert len(differing) == 1, differing
        assert words in str(differing[0]).replace("  ", " ")


def test_statements_in_another_order_are_not_the_same():
    lines = written().decode().split("\r\n")
    k = next(i for i, line in enumerate(lines) if "L P[9]" in line)
    lines[k], lines[k + 1] = lines[k + 1], lines[k]
    assert differences(written(), "\r\n".join(lines).encode())


def test_a_name_with_zeros_is_another_name():
    """Zeros of numbers say nothing; those of names do."""
    assert core("WAIT   2.00(sec)") == core("WAIT 2(sec)")
    assert core("L P[1] 20.0mm/sec CNT100 TB   .10sec,CALL A") == core("L P[1] 20mm/sec CNT100 TB 0.1sec,CALL A")
    assert core("CALL PAGE_01") != core("CALL PAGE_1")
    assert core("R[5:COUNT]=R[6:a [b]: c]+1") == core("R[5]=R[6]+1") != core("R[5]=R[7]+1")
    assert core("IF (F[10:OFF:PURGE REQUEST]=ON),JMP LBL[99:END]") == core("IF (F[10]=ON),JMP LBL[99]")
    assert core("UFRAME_NUM[GP1]=1") == core("UFRAME_NUM=1") != core("UFRAME_NUM[GP2]=1")
    assert core("MESSAGE[LOAD 2]") != core("MESSAGE[LOAD 3]")
    assert core("//L P[1] 20mm/sec FINE") != core("L P[1] 20mm/sec FINE")


def test_six_decimals_of_a_single_pass_and_a_micrometre_does_not():
    text = written(decimals=6)
    number = re.search(rb"X = +(-?[\d.]+)", text)
    assert number is not None
    value = float(number[1])
    single = np.float32(value)
    for step, same in ((0, True), (1, False), (-1, False)):
        other = float(single) + 4 * step * float(np.spacing(np.abs(single)))
        back = re.sub(rb"(X = +)-?[\d.]+", rb"\g<1>" + f"{other:.6f}".encode(), text, count=1)
        assert (differences(text, back) == ()) is same


def test_fewer_decimals_than_were_written_are_a_difference():
    """1250.452 that comes back as 1250, or as 1250.45, is no number that was written."""
    text = re.sub(rb"(P\[2\]\{[^}]*?X = +)-?[\d.]+", rb"\g<1>1250.452", written())
    for back in (b"1250", b"1250.", b"1250.4", b"1250.45"):
        other = text.replace(b"1250.452", back)
        (found,) = differences(text, other)
        assert str(found) == f"P[2]: X: written 1250.452, backup {back.decode()}"
    assert differences(text, text.replace(b"1250.452", b"1250.452000")) == ()
    one = text.replace(b"1250.452", b"1250")
    assert compare_programs(ls.loads(text), ls.loads(one)).lines(5)[0].endswith(": 1 difference")
    two = re.sub(rb"(P\[3\]\{[^}]*?X = +)-?[\d.]+", rb"\g<1>1.5", one)
    lines = compare_programs(ls.loads(text), ls.loads(two)).lines(1)
    assert lines[0].endswith(": 2 differences")
    assert lines[2] == "  and 1 more (--first N, or --json)"
    fine = written(decimals=6)
    coarse = re.sub(rb"(P\[2\]\{[^}]*?X = +)(-?\d+\.\d{6})", lambda m: m[1] + b"%.3f" % float(m[2]), fine)
    assert [(d.where, d.what) for d in differences(fine, coarse)] == [("P[2]", "X")]


@pytest.mark.parametrize(("unit", "back", "same"), [("mm", "deg", False), ("deg", "mm", False), ("mm", " MM", True)])
def test_another_unit_is_a_difference(unit, back, same):
    text = re.sub(
        rb"(P\[2\]\{[^}]*? deg)\r\n\}", rb"\g<1>,\r\n\tE1=    10.000  " + unit.encode() + rb"\r\n}", written()
    )
    other = text.replace(b"10.000  " + unit.encode(), b"10.000  " + back.encode())
    assert text != other
    found = [str(d) for d in differences(text, other)]
    assert found == ([] if same else [f"P[2]: E1: written 10.000 {unit}, backup 10.000 {back}"])


@pytest.mark.parametrize("print_", ["AVOIDANCE   : TRUE", "AVOIDANCE : TRUE", "avoidance:true"])
@pytest.mark.parametrize("tag", [b"/MN", b"/mn"])
def test_what_a_controller_adds_to_the_path_is_told_and_is_no_difference(print_, tag):
    head = b"/APPL\r\nAUTO_SINGULARITY_HEADER;\r\n  ENABLE_SINGULARITY_" + print_.encode() + b";\r\n"
    text = written().replace(b"/MN\r\n", head + tag + b"\r\n")
    compared = compare_programs(ls.loads(written()), ls.loads(text))
    assert compared.differences == ()
    assert "singularity avoidance" in compared.notes[0]
    same = compare_programs(ls.loads(written()), ls.loads(written()))
    assert "byte for byte" in same.notes[0]


def test_long_programs_that_differ_all_over_are_compared_line_by_line():
    lines = written(5000).decode()
    slower = re.sub(r"(L P\[\d+\] )(\d+)", lambda m: m[1] + str(int(m[2]) + 1), lines)
    differing = differences(written(5000), slower.encode())
    assert len(differing) == 4999
    assert {d.what for d in differing} == {"speed"}


@pytest.mark.skipif(not SAMPLES.exists(), reason="public programs are not here")
def test_real_backups_are_the_same_as_themselves_in_another_print():
    seen = 0
    for path in sorted(SAMPLES.rglob("*")):
        if path.suffix.upper() != ".LS" or not path.is_file():
            continue
        program = ls.loads(path.read_bytes())
        texts = statement_texts(program)
        assert len(texts) == len(program.statements)
        assert not any(text.endswith(";") for text in texts)
        numbered = re.sub(rb"(?m)^ *\d+:", b"   :", program.data)
        for other in (program.data, program.data.replace(b"\n", b"\r\n").replace(b"\r\r", b"\r"), numbered):
            assert compare_programs(program, ls.loads(other)).differences == (), path
        seen += 1
    assert seen > 50


def test_the_step_is_in_the_units_of_the_text():
    compared = compare_programs(ls.loads(written()), ls.loads(written()))
    assert compared.step == pytest.approx(1e-3)
    assert compared.record()["same"]


@pytest.mark.parametrize(("old", "new", "same"), [("180.000", "-180.000", True), ("180.000", "-179.999", False)])
def test_whole_turns_of_an_angle_turn_alike(old, new, same):
    text = re.sub(rb"(P\[2\]\{[^}]*?W = +)-?[\d.]+", lambda m: m[1] + old.encode(), written())
    back = re.sub(rb"(P\[2\]\{[^}]*?W = +)-?[\d.]+", lambda m: m[1] + new.encode(), text)
    assert text != back
    assert [d.what for d in differences(text, back)] == ([] if same else ["W"])


def test_a_number_that_is_missing_is_not_one_that_is_untaught():
    untaught = re.sub(rb"(P\[2\]\{[^}]*?R = +)-?[\d.]+", lambda m: m[1] + b"********", written())
    missing = re.sub(rb"(P\[2\]\{[^}]*?),\tR = +-?[\d.]+ deg", lambda m: m[1], written())
    for pair in ((untaught, missing), (missing, untaught)):
        assert [d.what for d in differences(*pair)] == ["R"]
