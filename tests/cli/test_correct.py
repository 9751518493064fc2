"""``cgen correct`` as a user meets it: files, exit codes, one-line refusals, the folder untouched on error."""

import json
import shutil
import signal
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import refused, run
from corrected import HOME, ROUNDED_UM, missed_um
from ls_text import at, cartesian, joint_form, program
from shipped import ROOT
from stopped import run_stopped

ROBOT = ROOT / "robots" / "m710ic50.toml"
BEFORE = ("--before", "moving 200mm/s 6h")
ROBOT_OPTION = ("--robot", "m710ic50")
BOUND = ("--max-um", "500")


@pytest.fixture
def folder(tmp_path):
    """A folder with a program in it, and one with an earlier result."""
    (tmp_path / "PART.LS").write_bytes(part())
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "notes.txt").write_text("mine")
    return tmp_path


def part(count=8, **how):
    rng = np.random.default_rng(2)
    q = np.array(HOME) + rng.uniform(-15, 15, (count, 6))
    return program(
        [f"J P[{n}] 10% FINE" for n in range(1, count + 1)],
        [at(n, row) for n, row in enumerate(q, 1)],
        name="PART",
        **how,
    )


def correct(folder, *more, name="PART.LS"):
    robot, bound = () if "--robot" in more else ROBOT_OPTION, () if "--max-um" in more else BOUND
    return run("correct", folder / name, "-o", folder / "out", *robot, *bound, *more)


def untouched(folder):
    return [p.name for p in (folder / "out").iterdir()] == ["notes.txt"]


def content(folder):
    return {p.name: p.read_bytes() for p in folder.iterdir() if p.is_file()}


def test_another_programs_correction_is_not_replaced(folder):
    assert correct(folder, "-q").returncode == 0
    before = content(folder / "out")
    (folder / "OTHER.LS").write_bytes(part().replace(b"PART", b"OTHER"))
    refused(correct(folder, "-q", name="OTHER.LS"), 2, "correct wrote about PART", "-o")
    few = ("--robot", "m710ic50", "--set", "controller.max_lines=6")
    refused(run("pages", folder / "PART.LS", "-q", "-o", folder / "out", *few), 2, "-o")
    assert content(folder / "out") == before
    assert correct(folder, "-q", "--before", "moving 200mm/s 1h").returncode == 0  # its own
    assert set(content(folder / "out")) == set(before)
    assert content(folder / "out")["PART.LS"] != before["PART.LS"]


def test_a_program_of_the_same_name_that_is_not_its_own_stays(folder):
    (folder / "out" / "PART.LS").write_text("of another robot")
    refused(correct(folder, "-q"), 2, "PART.LS", "not what cgen correct wrote", "-o")
    refused(correct(folder, "-q", "--max-um", "0.1"), 2, "PART.LS", "not what cgen correct wrote", "-o")
    assert set(content(folder / "out")) == {"PART.LS", "notes.txt"}


def test_restoring_replaces_no_other_program(folder):
    assert correct(folder, "-q").returncode == 0
    (folder / "back").mkdir()
    (folder / "back" / "PART.LS").write_text("another")
    back = ("correct", folder / "out" / "PART.LS", "--restore", "-q", "-o", folder / "back")
    refused(run(*back), 2, "another PART.LS", "-o")
    (folder / "back" / "PART.LS").write_bytes(part())
    assert run(*back).returncode == 0


def robot_file(folder, *changes):
    text = ROBOT.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "arm.toml").write_text(text)
    return folder / "arm.toml"


def test_the_whole_set_is_written_and_the_program_keeps_its_name(folder):
    result = correct(folder, *BEFORE)
    assert result.returncode == 0, result.stderr
    assert {p.name for p in (folder / "out").iterdir()} == {
        "compgen.json",
        "PART.LS", "PART.compgen.json", "report.json", "report.html", "positions.csv", "notes.txt"
    }  # fmt: skip
    assert (folder / "PART.LS").read_bytes() == part()
    text = (folder / "out" / "PART.LS").read_bytes()
    assert missed_um(part(), text, 1, HOME) < ROUNDED_UM
    data = json.loads((folder / "out" / "report.json").read_text())
    assert data["positions"] == {"corrected": 8, "new": 0, "unchanged": 0}
    assert data["verdict"] == "inside"
    assert data["after"]["total"]["max_um"] < 1.1 < 30 < data["before"]["total"]["max_um"]
    rows = (folder / "out" / "positions.csv").read_text().splitlines()
    assert len(rows) == 9
    assert all(row.count(",") == rows[0].count(",") for row in rows)
    page = (folder / "out" / "report.html").read_text()
    assert "8 positions corrected" in page
    assert ">nan" not in page
    assert "8 positions corrected" in result.stdout


def test_json_is_the_report_and_quiet_is_quiet(folder):
    result = correct(folder, "--json")
    assert json.loads(result.stdout) == json.loads((folder / "out" / "report.json").read_text())
    result = correct(folder, "-q")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")


def test_two_runs_give_the_same_bytes(folder):
    def files():
        assert correct(folder, *BEFORE, "--split", "--insert", "5").returncode == 0
        return {p.name: p.read_bytes() for p in (folder / "out").iterdir()}

    assert files() == files()


def test_no_error_no_change(folder):
    assert correct(folder, "--set", "thermal.cte_um_m_K=0", "-q").returncode == 0
    assert (folder / "out" / "PART.LS").read_bytes() == part()


def test_restore_gives_the_planned_program_back(folder):
    assert correct(folder, *BEFORE, "-q").returncode == 0
    result = run("correct", folder / "out" / "PART.LS", "--restore", "-o", folder / "back")
    assert result.returncode == 0, result.stderr
    assert (folder / "back" / "PART.LS").read_bytes() == part()


def test_restore_refuses_what_does_not_belong_together(folder):
    alone = run("correct", folder / "PART.LS", "--restore", "-o", folder / "out")
    refused(alone, 2, "PART.compgen.json is not beside it")
    assert untouched(folder)
    assert correct(folder, *BEFORE, "-q").returncode == 0
    provenance = folder / "out" / "PART.compgen.json"
    shutil.copy(provenance, folder)
    refused(run("correct", folder / "PART.LS", "--restore", "-o", folder / "b"), 2, "another program")
    provenance.write_bytes(provenance.read_bytes()[:-200])
    refused(run("correct", folder / "out" / "PART.LS", "--restore", "-o", folder / "b"), 2, "PART.compgen.json")
    assert not (folder / "b").exists()


def test_a_corrected_program_is_refused_in_its_place_and_elsewhere(folder):
    assert correct(folder, *BEFORE, "-q").returncode == 0
    shutil.copy(folder / "out" / "PART.LS", folder / "COPY.LS")
    for program_file in (folder / "out" / "PART.LS", folder / "COPY.LS"):
        result = run("correct", program_file, "--robot", "m710ic50", "-o", folder / "second")
        refused(result, 2, program_file.name, "mark", "--restore", "--again")
        assert not (folder / "second").exists()
    again = ("--again", "-q", "--robot", "m710ic50", *BOUND, "-o", folder / "second")
    assert run("correct", folder / "COPY.LS", *again).returncode == 0


def test_a_program_too_small_for_the_mark_is_known_by_its_provenance(folder):
    (folder / "ONE.LS").write_bytes(program(["J P[1] 10% FINE"], [at(1, HOME)]))
    assert correct(folder, *BEFORE, "-q", name="ONE.LS").returncode == 0
    refused(run("correct", folder / "out" / "ONE.LS", "-o", folder / "second"), 2, "mark", "ONE.compgen.json")
    (folder / "out" / "ONE.LS").rename(folder / "out" / "TWO.LS")
    refused(run("correct", folder / "out" / "TWO.LS", "-o", folder / "second"), 2, "mark", "ONE.compgen.json")


def test_a_remark_marks_what_is_too_small_also_without_its_provenance(folder):
    (folder / "ONE.LS").write_bytes(program(["J P[1] 10% FINE"], [at(1, HOME)]))
    result = correct(folder, *BEFORE, name="ONE.LS")
    assert "--mark remark" in " ".join(result.stdout.split())
    assert json.loads((folder / "out" / "report.json").read_text())["mark"] == "none"
    assert correct(folder, *BEFORE, "-q", "--mark", "remark", name="ONE.LS").returncode == 0
    assert json.loads((folder / "out" / "report.json").read_text())["mark"] == "remark"
    shutil.copy(folder / "out" / "ONE.LS", folder / "COPY.LS")
    refused(correct(folder, name="COPY.LS"), 2, "mark", "its remark says")


def test_inspect_says_that_a_program_is_marked_and_what_says_so(folder):
    def mark(path):
        return json.loads(run("inspect", path, "--json").stdout)["mark"]

    (folder / "ONE.LS").write_bytes(program(["J P[1] 10% FINE"], [at(1, HOME)]))
    for name, more, here, elsewhere in (
        ("PART.LS", (), "digits", "digits"),
        ("ONE.LS", (), "record", "none"),
        ("ONE.LS", ("--mark", "remark"), "remark", "remark"),
    ):
        assert mark(folder / name) == "none"
        assert "corrected by compgen" not in run("inspect", folder / name).stdout
        out = folder / Path(name).stem
        assert run("correct", folder / name, *ROBOT_OPTION, *BEFORE, *BOUND, "-q", *more, "-o", out).returncode == 0
        assert mark(out / name) == here
        assert "corrected by compgen" in run("inspect", out / name).stdout
        shutil.copy(out / name, folder / "COPY.LS")
        assert mark(folder / "COPY.LS") == elsewhere


CONTROLLERS = [
    ([('compensation = "none"', 'compensation = "unknown"')], ("controller.compensation", "'none' or 'signature'")),
    ([('compensation = "none"', 'compensation = "signature"')], ("controller.signature", "missing")),
    (
        [('compensation = "none"', 'compensation = "signature"\nsignature = "S-2"\nidentified_with = "S-1"')],
        ("controller.identified_with", "S-1", "S-2", "identify again"),
    ),
    ([('compensation = "none"', 'compensation = "signature"\nsignature = "S-2"')], ("identified_with", "S-2")),
    ([('compensation = "none"', 'compensation = "none"\nsignature = "S-1"')], ("controller.signature", "'S-1'")),
    ([('compensation = "none"', 'compensation = "none"\nidentified_with = "S-1"')], ("identified_with", "S-1")),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "words"), CONTROLLERS, ids=lambda v: v[0] if isinstance(v, tuple) else None)
def test_a_controller_that_corrects_itself_otherwise_is_refused(changes, words, folder):
    result = correct(folder, "--robot", robot_file(folder, *changes))
    refused(result, 2, "arm.toml", *words)
    assert untouched(folder)


def test_a_matching_signature_is_taken_and_said(folder):
    arm = robot_file(
        folder, ('compensation = "none"', 'compensation = "signature"\nsignature = "S-1"\nidentified_with = "S-1"')
    )
    result = correct(folder, "--robot", arm, *BEFORE)
    assert result.returncode == 0, result.stderr
    assert "S-1" in result.stdout


GOOD = part().decode()
BAD_PROGRAMS = {
    "binary": (b"\x00\x01TP\x00\x00" * 50, ("binary", ".TP")),
    "not a program": (b"hello\n", ("/PROG",)),
    "empty": (b"", ("/PROG",)),
    "translated": (GOOD.replace("/ATTR\n", "/ATTR\nCOMENTARIO = \"x\";\n").encode(), ("language", "English")),
    "cut off": (GOOD[: GOOD.index("/END") - 90].encode(), ("/END", "cut off")),
    "used but undefined": (GOOD.replace("J P[3] ", "J P[33] ").encode(), ("P[33]", "not defined", "line ")),
    "defined twice": (GOOD.replace("P[3]{", "P[2]{").encode(), ("P[2]", "twice", "line ")),
    "no motion group": (GOOD.replace("/MN", "DEFAULT_GROUP = *,*,*;\n/MN").encode(), ("DEFAULT_GROUP", "group")),
    "no such frame": (GOOD.replace("UF : 0", "UF : 31", 1).encode(), ("uframe 31", "line ", "--frames")),
    "huge position number": (GOOD.replace("P[3]{", "P[" + "9" * 30 + "]{").encode(), ("line ",)),
    "huge frame number": (GOOD.replace("UF : 0", "UF : " + "9" * 30, 1).encode(), ("line ",)),
    "number of 400 digits": (GOOD.replace("X = ", "X = " + "9" * 400, 1).encode(), ("line ",)),
}  # fmt: skip


@pytest.mark.parametrize("kind", BAD_PROGRAMS)
def test_a_bad_program_is_refused_in_one_line_and_nothing_is_written(kind, folder):
    data, words = BAD_PROGRAMS[kind]
    (folder / "BAD.LS").write_bytes(data)
    refused(correct(folder, name="BAD.LS"), 2, "BAD.LS", *words)
    assert untouched(folder)


LISTED = {
    "CONFIG empty": (GOOD.replace("N U T, 0, 0, 0", "", 1), "CONFIG"),
    "UF : F": (GOOD.replace("UF : 0", "UF : F", 1), "UF : F"),
    "untaught": (program(["J P[1] 10% FINE"], [cartesian(1, ("********",) * 6)]).decode(), "****"),
    "PR target": (GOOD.replace("J P[3]", "J PR[3]"), "PR[3]"),
    "out of reach": (program(["J P[1] 10% FINE"], [cartesian(1, (9000, 0, 0, 0, 0, 0))]).decode(), "out of reach"),
    "beyond a limit": (program(["J P[1] 9% FINE"], [joint_form(1, (0, 0, 0, 0, 126, 0))]).decode(), "beyond its limit"),
    "number overflow": (GOOD.replace("W = ", "W = 99999999999", 1), "more digits"),
}  # fmt: skip


@pytest.mark.parametrize("kind", LISTED)
def test_what_cannot_be_corrected_is_listed_and_strict_refuses_it(kind, folder):
    text, words = LISTED[kind]
    (folder / "ODD.LS").write_text(text)
    result = correct(folder, "--strict", name="ODD.LS")
    refused(result, 2, "ODD.LS", "line ", words, "--strict")
    assert untouched(folder)
    result = correct(folder, name="ODD.LS")
    assert result.returncode == (0 if text.count("P[8]") else 1), result.stderr
    assert any(
        words in u["text"] + u["reason"] for u in json.loads((folder / "out" / "report.json").read_text())["unsafe"]
    )
    assert words in " ".join(result.stdout.split())


ARGUMENTS = [
    (("--frames", "no.toml"), ("no.toml", "cannot be read")),
    (("--frames", "README.md"), ("README.md", "not TOML")),
    (("--frames", "pyproject.toml"), ("pyproject.toml", "unknown key")),
    (("--robot", "kuka"), ("kuka",)),
    (("--robot", ""), ("--robot",)),
    (("--before", "moving 200 5h"), ("--before", "unit")),
    (("--before", "moving 200mm/s"), ("--before",)),
    (("--before", "moving -200mm/s 5h"), ("--before",)),
    (("--before", "flying 1h"), ("--before",)),
    (("--before", "moving nanmm/s 5h"), ("--before",)),
    (("--insert", "0"), ("--insert", "0.1")),
    (("--insert", "nan"), ("--insert",)),
    (("--max-um", "-3"), ("--max-um",)),
    (("--mark", "ink"), ("--mark", "digits or remark")),
    (("--set", "thermal.cte=3"), ("thermal.cte",)),
    (("--set", "thermal.cte_um_m_K"), ("--set",)),
    (("-o", ""), ("-o",)),
    (("-o", "README.md"), ("README.md",)),
]


@pytest.mark.parametrize(("arguments", "words"), ARGUMENTS, ids=lambda v: " ".join(v))
def test_a_bad_argument_is_refused_in_one_line(arguments, words, folder):
    refused(correct(folder, *arguments), 2, *words)
    assert untouched(folder)


def test_a_program_that_is_not_there_is_refused(folder):
    refused(correct(folder, name="NONE.LS"), 2, "NONE.LS", "cannot be read")
    refused(correct(folder, name="."), 2, "cannot be read")
    assert untouched(folder)


def test_outside_its_bound_the_report_is_written_and_the_program_only_by_force(folder):
    (folder / "COARSE.LS").write_bytes(program(["J P[1] 10% FINE"], [at(1, HOME, form="{:.1f}")]))
    result = correct(folder, *BEFORE, "--max-um", "5", name="COARSE.LS")
    refused(result, 1, "COARSE.LS not written", "--force", "line 4")
    assert {"report.json", "report.html"} < {p.name for p in (folder / "out").iterdir()}
    assert not (folder / "out" / "COARSE.LS").exists()
    assert "<dd>not written</dd>" in (folder / "out" / "report.html").read_text()
    assert correct(folder, *BEFORE, "--max-um", "5", "--force", name="COARSE.LS").returncode == 1
    assert (folder / "out" / "COARSE.LS").exists()
    assert "<dt>corrected program sha256</dt>" in (folder / "out" / "report.html").read_text()
    assert correct(folder, *BEFORE, "--max-um", "200", name="COARSE.LS").returncode == 0


@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
@pytest.mark.parametrize(
    "moment",
    [("import", "casadi", 1), ("os.mkdir", "compgen-", 1), ("open", "positions.csv", 1)]
    + [("os.rename", "compgen-", n) for n in (1, 2, 3, 4, 5)],
    ids=lambda m: f"{m[0]}-{m[2]}",
)
def test_killed_at_any_moment_nothing_is_half_written(moment, folder):
    """The program is there at any moment, and no report beside it that is not its own."""
    assert correct(folder, "-q", *BEFORE).returncode == 0
    new = content(folder / "out")
    assert correct(folder, "-q").returncode == 0
    old = content(folder / "out")
    command = ["correct", folder / "PART.LS", *ROBOT_OPTION, *BEFORE, *BOUND, "-q", "-o", folder / "out"]
    assert run_stopped(command, moment, signal.SIGKILL).returncode == -signal.SIGKILL
    files = content(folder / "out")
    run_of_program = old if files["PART.LS"] == old["PART.LS"] else new  # the program is there, old or new
    assert old["PART.LS"] != new["PART.LS"]
    reports = {name: text for name, text in files.items() if name != "PART.compgen.json"}
    assert reports.items() <= run_of_program.items()  # and what is beside it belongs to it
    assert files["PART.compgen.json"] in (old["PART.compgen.json"], new["PART.compgen.json"])
    assert correct(folder, "-q", *BEFORE).returncode == 0
    assert content(folder / "out") == new


def test_a_result_never_replaces_the_program_it_was_made_from(folder):
    for more in ((), ("--force",), ("--restore",)):
        refused(run("correct", folder / "PART.LS", "-o", folder, "-q", *more), 2, "PART.LS", "would replace it", "-o")
    assert (folder / "PART.LS").read_bytes() == part()
    assert not (folder / "PART.compgen.json").exists()


# The verdict -------------------------------------------------------------------------------------------------------


def report(folder):
    return json.loads((folder / "out" / "report.json").read_text())


def test_nothing_corrected_is_not_inside(folder):
    (folder / "ODD.LS").write_bytes(program(["J PR[1] 10% FINE", "J P[1] 10% FINE Offset,PR[2]"], [at(1, HOME)]))
    result = correct(folder, name="ODD.LS")
    refused(result, 1, "cgen: nothing corrected: ", "ODD.LS not written", "cgen inspect")
    assert "verdict: nothing corrected" in result.stdout
    assert "outside: " not in result.stdout
    assert report(folder)["verdict"] == "nothing corrected"
    page = (folder / "out" / "report.html").read_text()
    assert "Nothing corrected" in page
    assert "inside" not in page.split("</style>")[1].split("<body>")[1]
    assert not (folder / "out" / "ODD.LS").exists()
    assert correct(folder, "-q", "--force", name="ODD.LS").returncode == 1
    assert (folder / "out" / "ODD.LS").read_bytes() == (folder / "ODD.LS").read_bytes()
    (folder / "NONE.LS").write_bytes(program(["CALL OTHER"], []))
    refused(correct(folder, "-q", name="NONE.LS"), 1, "nothing corrected")


def test_a_program_the_controller_cannot_load_is_not_inside(folder):
    result = correct(folder, "--max-um", "5", "--set", "controller.max_lines=5")
    refused(result, 1, "cgen: not loadable: ", "8 lines", "cgen pages parts it at FINE", "written all the same")
    assert "verdict: not loadable" in result.stdout
    assert report(folder)["verdict"] == "not loadable"
    assert "<b>More than the controller can load.</b>" in (folder / "out" / "report.html").read_text()
    assert (folder / "out" / "PART.LS").exists()  # for cgen pages
    refused(
        correct(folder, *BEFORE, "-q", "--max-um", "0.1", "--set", "controller.max_lines=5"),
        1,
        "cgen: outside bounds: ",
    )
    assert report(folder)["verdict"] == "outside"


def test_without_a_bound_nothing_is_inside_it(folder):
    result = run("correct", folder / "PART.LS", "-o", folder / "out", *ROBOT_OPTION, *BEFORE)
    refused(result, 1, "cgen: no bounds: ", " um after correction", "give --max-um", "written all the same")
    assert "verdict: no bounds" in result.stdout
    assert report(folder)["verdict"] == "no bounds"
    assert (folder / "out" / "PART.LS").read_bytes() != part()  # nowhere worse: there to be looked at
    quiet = run("correct", folder / "PART.LS", "-o", folder / "out", *ROBOT_OPTION, *BEFORE, "-q", "--json")
    assert (quiet.returncode, json.loads(quiet.stdout)["findings"][-1]["code"]) == (1, "bounds.none")
    refused(run("correct", folder / "PART.LS", "-o", folder / "out", *ROBOT_OPTION, "-q", "--force"), 1, "no bounds")
    assert "nside its bound" not in (folder / "out" / "report.html").read_text()
    assert "--max-um" in (folder / "out" / "report.html").read_text()
    assert correct(folder, "-q", "--max-um", "5").returncode == 0
    assert report(folder)["verdict"] == "inside"
    assert "<b>Inside its bound.</b>" in (folder / "out" / "report.html").read_text()


# Which robot -------------------------------------------------------------------------------------------------------


def test_a_program_that_names_no_robot_needs_one(folder):
    refused(run("correct", folder / "PART.LS", "-o", folder / "out"), 2, "PART.LS", "--robot NAME", "m710ic50")
    assert untouched(folder)


@pytest.mark.parametrize("text", ["m710ic50", "FANUC M-710iC/50 cell 3", "for the M 710 IC 50"])
def test_a_program_that_names_its_robot_needs_no_option(text, folder):
    named = part().replace(b"   1:J", f"   1:  !{text} ;\n   2:J".encode())
    commented = part(head=f'COMMENT = "{text[:16]}";\n')
    (folder / "REMARK.LS").write_bytes(named)
    (folder / "COMMENT.LS").write_bytes(commented if "50" in text[:16] else named)
    for name in ("REMARK.LS", "COMMENT.LS"):
        assert run("correct", folder / name, *BOUND, "-q", "-o", folder / "out").returncode == 0
        assert report(folder)["provenance"]["robot"] == "m710ic50"


def test_a_program_that_names_two_robots_needs_the_option(folder):
    (folder / "TWO.LS").write_bytes(part().replace(b"   1:J", b"   1:  !m710ic50 or ur5 ;\n   2:J"))
    refused(run("correct", folder / "TWO.LS", "-o", folder / "out"), 2, "m710ic50 and ur5", "--robot")


def codes(folder):
    return {f["code"]: f for f in report(folder)["findings"]}


@pytest.mark.parametrize(
    ("remark", "named"),
    [
        ("LR Mate 200iD", "LRMATE200ID"), ("R-2000iC/165F", "R2000IC165F"), ("ARC MATE 120iC", "ARCMATE120IC"),
        ("M-710iC/50H", "M710IC50H"),  # of five axes
    ],
)  # fmt: skip
def test_a_remark_that_names_another_robot_is_a_warning(remark, named, folder):
    (folder / "OTHER.LS").write_bytes(part().replace(b"   1:J", f"   1:  !{remark} ;\n   2:J".encode()))
    assert correct(folder, "-q", name="OTHER.LS").returncode == 0
    finding = codes(folder)["robot.named"]
    assert finding["level"] == "warning"
    assert named in finding["message"]


@pytest.mark.parametrize(
    "remark", ["M-710iC", "R-30iB Plus", "p1 in place", "M-710iC/50", "M-710iC/50 2nd cell", "move mate 200"]
)
def test_a_remark_that_names_this_robot_or_none_is_no_warning(remark, folder):
    (folder / "OTHER.LS").write_bytes(part().replace(b"   1:J", f"   1:  !{remark} ;\n   2:J".encode()))
    assert correct(folder, "-q", name="OTHER.LS").returncode == 0
    assert "robot.named" not in codes(folder)


def test_positions_that_the_robot_cannot_take_speak_against_it(folder):
    """A small arm's program: its joints turn farther, its places lie too near. Half of them are enough to stop."""
    reached = [at(n, np.array(HOME) + n) for n in (1, 2, 3)]
    near, far = cartesian(4, (100, 0, 0, 180, 0, 0)), joint_form(4, (0, 0, 0, 0, 126, 0))
    for other in (near, far):
        moves = [f"J P[{n}] 10% FINE" for n in (1, 2, 3, 4)]
        (folder / "FEW.LS").write_bytes(program(moves, [*reached, other]))
        assert correct(folder, "-q", name="FEW.LS").returncode == 0
        finding = codes(folder)["robot.unattainable"]
        assert finding["level"] == "warning"
        assert "1 of 4" in finding["message"]
        assert "P[4]" in finding["message"]
        (folder / "HALF.LS").write_bytes(program(moves[2:], [reached[2], other]))
        refused(correct(folder, "-q", name="HALF.LS"), 1, "1 of 2", "--robot", "--frames", "not written")
        assert report(folder)["verdict"] == "outside"
        assert correct(folder, "-q", "--force", name="HALF.LS").returncode == 1
        moves[3] += " Offset,PR[1]"  # where it drives is not known
        (folder / "OFFSET.LS").write_bytes(program(moves, [*reached, other]))
        assert correct(folder, "-q", name="OFFSET.LS").returncode == 0
        assert "robot.unattainable" not in codes(folder)


def test_a_second_group_is_named(folder):
    second = at(1, HOME).replace("\n};", "\n   GP2:\n\tUF : 0, UT : 0,\n\tJ1 = 1.000 deg\n};")
    (folder / "TWO.LS").write_bytes(program(["J P[1] 10% FINE"], [second]))
    assert correct(folder, "-q", name="TWO.LS").returncode == 0
    assert "group 2" in codes(folder)["robot.groups"]["message"]
