"""Every wrong program of other people: refused in one line, or told with its line; and a right one is neither."""

import json

import pytest
from command_line import refused, run

from compgen import fanuc
from compgen.core.exceptions import CompgenError
from compgen.fanuc.analysis import inspection
from compgen.fanuc.listing.templates import FEW_TEXTS
from compgen.pipelines.files.robot_file import load_robot
from compgen.program.frames import default_frames

GOOD = b"""/PROG  GOOD
/ATTR
COMMENT\t\t= "a demo";
DEFAULT_GROUP\t= 1,*,*,*,*;
/MN
   1:J P[1] 10% FINE    ;
   2:L P[2] 100mm/sec CNT50    ;
/POS
P[1]{
   GP1:
\tUF : 0, UT : 0,\t\tCONFIG : 'N U T, 0, 0, 0',
\tX =  1300.000  mm,\tY =     0.000  mm,\tZ =   203.000  mm,
\tW =   180.000 deg,\tP =     0.000 deg,\tR =     0.000 deg
};
P[2]{
   GP1:
\tUF : 0, UT : 0,\t\tCONFIG : 'N U T, 0, 0, 0',
\tX =  1400.000  mm,\tY =     0.000  mm,\tZ =   203.000  mm,
\tW =   180.000 deg,\tP =     0.000 deg,\tR =     0.000 deg
};
/END
"""


def changed(old, new, count=1):
    assert old in GOOD
    return GOOD.replace(old, new, count)


SPANISH = changed(b"COMMENT\t\t=", b"COMENTARIO\t=")
AGAIN = changed(b"};\nP[2]", b"   GP1:\n\tUF : 0, UT : 0,\n\tJ1= 0.000 deg\n};\nP[2]")
HALF_CIRCLE = changed(b"L P[2] 100mm/sec CNT50    ;", b"C P[2]\n   3:J P[1] 10% FINE ;")
SECOND = GOOD.index(b"P[2]{")
#: what is wrong -> text, words of the refusal
REFUSED = {
    "binary TP": (b"\x00\x12TPP\x00\x00" * 40, ("binary", ".LS")),
    "empty": (b"", ("/PROG",)),
    "translated keywords": (SPANISH, ("language",)),
    "cut in a motion": (GOOD[: GOOD.index(b"/POS") - 5], ("line 7", "/END is missing")),
    "cut in a position": (GOOD[: GOOD.index(b"\tW =")], ("line 13", "/END is missing")),
    "no /MN": (changed(b"/MN\n", b""), ("/MN is missing",)),
    "duplicate P": (changed(b"P[2]{", b"P[1]{"), ("line 15", "P[1]", "twice")),
    "duplicate group": (AGAIN, ("line 9", "GP1 twice")),
    "axis twice": (changed(b"\tY =", b"\tX ="), ("line 9", "X twice")),
    "axis that is none": (changed(b"\tR =", b"\tE9="), ("line 9", "E9")),
    "number too long": (changed(b"1300.000", b"1300000000000000.000"), ("line 12", "P[1]: 'X = ")),
    "not a number": (changed(b"1300.000", b"13OO.000"), ("line 12", "P[1]: 'OO.000  mm' is not understood")),
    "position number too large": (changed(b"L P[2]", b"L P[12345678901]"), ("line 7", "999999999")),
    "position number in /POS too large": (changed(b"P[2]{", b"P[12345678901]{"), ("line 15",)),
    "motion without a target": (changed(b"L P[2] 100mm/sec", b"L P[2]&100mm/sec"), ("line 7", "target")),
    "a blank before its number": (changed(b"L P[2] 100mm/sec", b"L P [2] 100mm/sec"), ("line 7", "target")),
    "two statements in a line": (changed(b"FINE    ;\n", b"FINE    ; "), ("line 6", "second statement")),
    "C without an end": (HALF_CIRCLE, ("line 7", "end point")),
}  # fmt: skip
#: what is wrong -> text, line, words of the finding
TOLD = {
    "P used but undefined": (changed(b"L P[2]", b"L P[7]"), 7, ("P[7]", "not defined")),
    "PR target": (changed(b"L P[2]", b"L PR[4:home]"), 7, ("PR[4:home]", "not in the file")),
    "register target": (changed(b"L P[2]", b"L P[R[2]]"), 7, ("P[R[2]]", "not in the file")),
    "mask without a group": (changed(b"= 1,*,*", b"= *,*,*"), 4, ("no motion group",)),
    "empty CONFIG": (GOOD[:SECOND] + GOOD[SECOND:].replace(b"'N U T, 0, 0, 0'", b"''"), 15, ("posture",)),
    "no CONFIG": (GOOD[:SECOND] + GOOD[SECOND:].replace(b"\t\tCONFIG : 'N U T, 0, 0, 0',", b""), 15, ("posture",)),
    "CONFIG of another arm": (changed(b"N U T, 0, 0, 0", b"R, 0, 0, 0"), 9, ("posture",)),
    "CONFIG with absurd turns": (changed(b"N U T, 0, 0, 0", b"N U T, 99999999999999999999, 0, 0"), 9, ("posture",)),
    "CONFIG with two turns": (changed(b"N U T, 0, 0, 0", b"N U T, 0, 0"), 9, ("posture",)),
    "active frame": (changed(b"UF : 0", b"UF : F"), 9, ("active at run time",)),
    "active tool": (changed(b"UT : 0", b"UT : F"), 9, ("active at run time",)),
    "unknown frame": (changed(b"UF : 0", b"UF : 7"), 9, ("uframe 7", "--frames")),
    "unknown tool": (changed(b"UT : 0", b"UT : 3"), 9, ("utool 3", "--frames")),
    "frame number beyond sense": (changed(b"UF : 0", b"UF : 999999999"), 9, ("uframe 999999999",)),
    "out of reach": (changed(b"1400.000", b"2500.000"), 15, ("out of reach", "m710ic50", "mm")),
    "far out of reach": (changed(b"1400.000", b"999999999999.000"), 15, ("out of reach",)),
    "untaught": (changed(b" 1300.000", b"*********"), 9, ("not taught",)),
    "speed from a register without a unit": (changed(b"100mm/sec", b"AR[1]"), 7, ("speed",)),
}  # fmt: skip


def findings(data, few_texts=FEW_TEXTS):
    return inspection.inspect(fanuc.loads(data, few_texts), load_robot("m710ic50"), default_frames())["unsafe"]


def test_the_program_behind_all_these_is_good():
    assert findings(GOOD) == []


@pytest.mark.parametrize("name", REFUSED)
def test_is_refused_in_one_line(name):
    data, words = REFUSED[name]
    with pytest.raises(CompgenError) as caught:
        fanuc.loads(data)
    said = str(caught.value)
    assert said.count("\n") == said.count("\r") == 0
    assert [w for w in words if w not in said] == [], said


@pytest.mark.parametrize("name", TOLD)
def test_is_told_with_its_line(name):
    data, line, words = TOLD[name]
    assert fanuc.dumps(fanuc.loads(data)) == data
    here = [f"{u['text']}: {u['reason']}" for u in findings(data) if u["line"] == line]
    assert any(all(w in said for w in words) for said in here), findings(data)
    json.dumps(findings(data), allow_nan=False)


@pytest.mark.parametrize("name", TOLD)
def test_is_told_alike_when_read_by_columns(name):
    data, _, _ = TOLD[name]
    assert findings(data, 0) == findings(data)


@pytest.mark.parametrize("speed", [b"9" * 400 + b"mm/sec", b"0mm/sec", b"." + b"0" * 400 + b"1sec", b"1e5mm/sec"])
def test_an_absurd_speed_gives_no_absurd_answer(speed):
    data = changed(b"100mm/sec", speed)
    try:
        found = inspection.inspect(fanuc.loads(data), load_robot("m710ic50"), default_frames())
    except CompgenError:
        return
    assert found["duration_s"] is None or 0 <= found["duration_s"] < 1e9
    json.dumps(found, allow_nan=False)


def test_on_the_command_line(tmp_path):
    file = tmp_path / "BAD.LS"
    for name in ("binary TP", "cut in a position", "duplicate P"):
        data, words = REFUSED[name]
        file.write_bytes(data)
        refused(run("inspect", file), 2, "BAD.LS", *words)
    data, line, words = TOLD["out of reach"]
    file.write_bytes(data)
    shown = run("inspect", file, "--robot", "m710ic50")
    assert shown.returncode == 0
    assert f"line {line}: P[2]: it is" in shown.stdout
    assert "out of reach" in shown.stdout
    assert sorted(p.name for p in tmp_path.iterdir()) == ["BAD.LS"]
