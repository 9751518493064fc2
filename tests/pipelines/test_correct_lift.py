"""Programs that exist: the override in a remark where lines may be added, and the dry run of ``--lift-all``."""

import json
import re
from functools import partial

import naive_ls
import numpy as np
import pytest
from command_line import refused, run
from corrected import HOME, corrected, missed_um
from ls_text import at, cartesian, joint_form, program

from compgen.core.exceptions import InputError
from compgen.fanuc import loads
from compgen.fanuc.analysis.called_programs import UNKNOWN_PROGRAMS
from compgen.fanuc.editing.dry_run_lift import lifted_program
from compgen.pipelines.files.robot_file import load_cell
from compgen.program.pose_table import pose_of

TURNS = ([0, 0, 0, 0, 0, 0], [3, -2, 1, 0, 2, 0], [5, -3, 2, 1, 3, 1], [-4, 2, 3, 0, 1, 2])
STEP = [np.array(HOME) + np.array(turn) for turn in TURNS]
MOVES = ["J P[1] 10% FINE", "L P[2] 100mm/sec CNT100", "L P[3] 100mm/sec CNT100", "L P[4] 100mm/sec FINE"]
CORRECT = ("--robot", "m710ic50", "--before", "moving 200mm/s 6h", "--max-um", "500")


def part(moves=MOVES, **how):
    return program(list(moves), [at(n, q) for n, q in enumerate(STEP, 1)], name="PART", **how)


@pytest.fixture(scope="module")
def cell():
    return load_cell("m710ic50")


@pytest.mark.parametrize(
    ("options", "remarks"),
    [
        ({}, ()),
        ({"insert": 0.05e-6}, ("RUN AT 100% OVERRIDE",)),
        ({"remark": True}, ("compgen 0.1.0 corrected",)),
        ({"insert": 0.05e-6, "remark": True}, ("RUN AT 100% OVERRIDE",)),  # now the digits have places for the mark
    ],
)
def test_the_override_is_said_where_lines_may_be_added(cell, options, remarks):
    result = corrected(part(), cell, **options)
    written_remarks = loads(result.text).remarks
    assert sorted(re.sub(r"compgen \S+", "compgen 0.1.0", r) for r in written_remarks) == sorted(remarks)
    assert (result.added > 0) is ("insert" in options)
    if not options:
        assert result.text.count(b"\n") == part().count(b"\n")


@pytest.mark.parametrize("word", ["!OVERRIDE AT 30%", "OVERRIDE=50%", "OVERRIDE=R[6:SPEED]"])
def test_a_program_that_says_an_override_keeps_its_own(cell, word):
    result = corrected(part([word, *MOVES]), cell, remark=True, insert=0.05e-6)
    assert not [r for r in loads(result.text).remarks if r.startswith("RUN AT")]
    assert word.encode() in result.text


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "PART.LS").write_bytes(part())
    return tmp_path


def lift(folder, *more, height="50"):
    return run("correct", folder / "PART.LS", "-o", folder / "out", *CORRECT, "-q", "--lift-all", height, *more)


def test_every_position_is_lifted_and_corrected_up_there(folder):
    assert lift(folder).returncode == 0
    text = (folder / "out" / "PART_DRY.LS").read_bytes()
    program_read = loads(text)
    assert (program_read.name, program_read.remarks) == ("PART_DRY", ("DRY RUN +50 MM",))
    before, after = naive_ls.read(part())[0], naive_ls.read(text)[0]
    planned = part()
    for n in range(1, 5):
        z = np.array([positions[n].groups[1].axes["Z"] for positions in (before, after)], float)
        assert z[1] - z[0] == pytest.approx(50, abs=0.5)  # a correction is less than half a millimetre
        planned = re.sub(
            rb"(P\[%d\]\{[^}]*?Z = )(-?[\d.]+)" % n, lambda m: m[1] + b"%.3f" % (float(m[2]) + 50), planned, count=1
        )
    for n in range(1, 5):  # the second reader and arm: it is right 50 mm above the planned place
        assert missed_um(planned, text, n, STEP[n - 1]) < 1.0
    report = json.loads((folder / "out" / "report.json").read_text())
    assert [f["level"] for f in report["findings"] if f["code"] == "program.dry_run"] == ["warning"]
    speeds = re.findall(rb"P\[\d\] (\S+ \S+)", text)
    assert speeds == re.findall(rb"P\[\d\] (\S+ \S+)", part())


def test_a_program_with_branches_and_loops_is_lifted(cell):
    branches = [*MOVES[:2], "IF (R[1]=1) THEN", MOVES[2], "ELSE", "FOR R[2]=1 TO 3", MOVES[3], "ENDFOR", "ENDIF"]
    assert loads(corrected(part(branches), cell, raised=0.05).text).name == "PART_DRY"


def test_it_may_be_written_again_and_never_over_the_real_one(folder):
    assert lift(folder).returncode == 0
    assert lift(folder, height="20").returncode == 0
    assert b"DRY RUN +20 MM" in (folder / "out" / "PART_DRY.LS").read_bytes()
    done = run("correct", folder / "PART.LS", "-o", folder / "out", *CORRECT, "-q")
    refused(done, 2, "PART_DRY", "-o")
    refused(run("check-backup", folder / "PART.LS", folder / "out" / "PART_DRY.LS"), 1, "PART_DRY")
    refused(run("correct", folder / "out" / "PART_DRY.LS", "-o", folder / "o2", *CORRECT), 2, "twice")


def test_a_corrected_program_is_not_lifted(folder):
    many = program(
        [f"J P[{n}] 10% FINE" for n in range(1, 9)],
        [at(n, np.array(HOME) + n * np.array([2, 1, -1, 0, 1, 0])) for n in range(1, 9)],
        name="PART",
    )
    (folder / "PART.LS").write_bytes(many)
    assert run("correct", folder / "PART.LS", "-o", folder / "real", *CORRECT, "-q").returncode == 0
    alone = folder / "alone"
    alone.mkdir()
    (alone / "PART.LS").write_bytes((folder / "real" / "PART.LS").read_bytes())
    refused(lift(alone), 2, "mark", "twice")
    assert not (alone / "out").exists()


@pytest.mark.parametrize(
    ("moves", "points", "words"),
    [
        (["CALL OTHER", *MOVES], None, ("line 4", "'CALL OTHER", "may move the arm")),
        ([*MOVES, "J PR[1] 10% FINE"], None, ("PR[1]", "goes where the file does not say")),
        ([*MOVES[:3], "L P[4] 100mm/sec FINE INC"], None, ("INC", "goes where")),
        ([*MOVES[:3], "L P[4] 100mm/sec FINE Offset,PR[2]"], None, ("Offset", "goes where")),
        (MOVES, joint_form(4, STEP[3]), ("P[4] is in joint form", "Cartesian")),
        (MOVES, at(4, STEP[3], numbered=(1, 0)), ("several user frames (0, 1)",)),
    ],
)
def test_what_would_not_go_along_is_refused_by_line(folder, moves, points, words):
    texts = [at(n, q) for n, q in enumerate(STEP, 1)]
    if points is not None:
        texts[3] = points
    (folder / "PART.LS").write_bytes(program(list(moves), texts, name="PART"))
    frames = folder / "frames.toml"
    zeros = "".join(f"{k} = 0\n" for k in ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg"))
    frames.write_text(f"[uframe.1]\n{zeros}")
    refused(lift(folder, "--frames", frames), 2, "--lift-all", *words)
    assert not (folder / "out").exists()


def test_statements_that_move_nothing_go_along(folder):
    (folder / "PART.LS").write_bytes(part(["DO[1]=ON", "WAIT .50(sec)", *MOVES, "R[1]=R[1]+1"]))
    assert lift(folder).returncode == 0


def test_disabled_motions_and_unused_positions_stay_as_they_are(folder):
    texts = [at(n, q) for n, q in enumerate(STEP, 1)] + [joint_form(9, STEP[0])]
    (folder / "PART.LS").write_bytes(program([*MOVES, "//J P[9] 10% FINE"], texts, name="PART"))
    assert lift(folder).returncode == 0
    assert texts[-1].replace("\n", "").encode() in (folder / "out" / "PART_DRY.LS").read_bytes().replace(b"\n", b"")


@pytest.mark.parametrize("height", ["0", "-1", "nan", "5000"])
def test_a_height_that_is_none_is_refused(folder, height):
    refused(lift(folder, height=height), 2, "--lift-all", "mm")


#: the frame's turn about x, the tool's in it, a statement before -> whether the lift leads from the part
LIFTS = [
    (0, 180, "", True),
    (0, 90, "", True),  # a gripper across the flange, lifted up
    (0, 0, "", False),  # from below against a part: up is into it
    (180, 0, "", False),  # z of the frame points down
    (90, 180, "", True),  # on a wall: sideways, back along the tool
    (90, 90, "", False),  # sideways, the tool down
    (0, 90, "UFRAME[1]=PR[2]", False),  # nothing says where up is
]


@pytest.mark.parametrize(("frame_w", "tool_w", "statement", "leads_away"), LIFTS)
def test_a_lift_leads_away_from_the_part_or_is_refused(frame_w, tool_w, statement, leads_away):
    """Of a frame whose z points down a dry run went into the part, and was inside its bounds."""
    points = [cartesian(n, (100.0 * n, 0, 0, tool_w, 0, 0), uf=1) for n in (1, 2)]
    data = program([*filter(None, [statement]), "L P[1] 100mm/sec FINE", "L P[2] 100mm/sec FINE"], points)
    frames = {1: pose_of((1200.0, 0.0, 0.0, frame_w, 0.0, 0.0))}
    lift = partial(lifted_program, loads(data), 50.0, 8, UNKNOWN_PROGRAMS, frames)
    if leads_away:
        assert [g.groups[1].axes["Z"] for g in naive_ls.read(lift().source)[0].values()] == [50.0, 50.0]
    else:
        with pytest.raises(InputError, match=r"line \d+: z of its user frame leads P\[1\] neither up nor back"):
            lift()


@pytest.mark.parametrize("moves", [[], ["WAIT 1.00(sec)"]])
def test_a_program_without_a_motion_is_not_lifted(moves):
    with pytest.raises(InputError, match="PART: --lift-all: it has no motion"):
        lifted_program(loads(part(moves)), 20.0, 8, UNKNOWN_PROGRAMS, {})
