"""Places that a program writes at run time, and that its text or a table tells: offsets, frames, extended axes.

Each is judged by the second reader and the second arm: what the written numbers mean with the same offset, frame or
base must be reached by the warm arm.
"""

import naive_arm as arm
import naive_heat
import naive_ls
import numpy as np
import pytest
from corrected import HOME, MANY, ROUNDED_UM, WARM, corrected
from ls_text import at, joint_form, program
from shipped import ROOT, quiet

from compgen.core.exceptions import InputError
from compgen.fanuc import loads
from compgen.fanuc.analysis.inspection import inspect
from compgen.pipelines.correct import Options, correct
from compgen.pipelines.correct.program_file import load_before
from compgen.pipelines.files.robot_file import load_cell
from compgen.program.frames import default_frames, load_frames
from compgen.program.registers import load_registers
from compgen.report.provenance import inputs_record

THERE = (15.0, 25.0, -20.0, 25.0, -55.0, 40.0)
AWAY = (-30.0, 35.0, 5.0, 40.0, -75.0, -20.0)
SHIFT = (30.0, -20.0, 50.0, 0.0, 0.0, 0.0)
TURNED = (10.0, 0.0, -30.0, 2.0, 0.0, 5.0)
FRAME = (200.0, -100.0, 50.0, 3.0, -4.0, 20.0)
GO = "J P[3] 10% FINE"
XYZWPR = "XYZWPR"


@pytest.fixture(scope="module")
def hot():
    return load_cell(str(ROOT / "robots" / "m710ic50.toml"))


def assign(n, values):
    """Statements that write the six numbers of PR[n]."""
    return [f"PR[{n},{i}:x]={v:g}" if v >= 0 else f"PR[{n},{i}:x]=({v:g})" for i, v in enumerate(values, 1)]


def table(tmp_path, text, name="t.toml"):
    path = tmp_path / name
    path.write_text(text)
    return str(path)


def registers(tmp_path, **values):
    text = ""
    for name, numbers in values.items():
        keys = ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg")
        text += f"[pr.{name[2:]}]\n" + "".join(f"{k} = {v}\n" for k, v in zip(keys, numbers, strict=True))
    return load_registers(table(tmp_path, text))


def run(data, cell, frames=None, table_of=None, programs=None, **options):
    find = (programs or {}).get
    return correct(data, cell, frames or MANY, load_before((WARM,)).duties, Options(**options), quiet, find, table_of)


def numbers(data, n):
    axes = naive_ls.read(data)[0][n].groups[1].axes
    return np.array([axes[k] for k in XYZWPR])


def changed(data, result):
    before, after = naive_ls.read(data)[0], naive_ls.read(result.text)[0]
    return {n for n in after if n not in before or before[n].groups[1].axes != after[n].groups[1].axes}


def missed_um(data, text, n, guess, offset=None, tool_offset=None, uf=None, ut=None):
    """um by which the warm arm misses what P[n] means with an offset, a frame and a tool."""
    offset = np.zeros(6) if offset is None else np.array(offset)
    after = np.eye(4) if tool_offset is None else arm.frame(*tool_offset)
    uf, ut = (np.eye(4) if m is None else m for m in (uf, ut))
    meant, written = (uf @ arm.frame(*(numbers(d, n) + offset)) @ after for d in (data, text))
    q = arm.joints_at(written @ np.linalg.inv(ut), guess)
    real = arm.flange(q, naive_heat.warm_lengths()) @ ut
    return 1e3 * float(np.linalg.norm(real[:3, 3] - meant[:3, 3]))


def shifted(moves, *head, points=None, **how):
    """P[1] is driven to with what is tested, between plain motions to P[3]."""
    return program([*head, GO, *moves, GO], [*(points or [at(1, HOME), at(2, THERE)]), at(3, AWAY)], **how)


WAYS = [
    ("Offset,PR[5:up]", {"offset": SHIFT}),
    ("Offset,PR[5:up]", {"offset": TURNED}),
    ("Tool_Offset,PR[5]", {"tool_offset": SHIFT}),
    ("Tool_Offset,PR[5]", {"tool_offset": TURNED}),
]


@pytest.mark.parametrize(("option", "how"), WAYS, ids=[f"{o} {next(iter(h.values()))}" for o, h in WAYS])
@pytest.mark.parametrize("source", ["registers", "program"])
def test_an_offset_that_is_told_is_corrected_where_it_leads(option, how, source, hot, tmp_path):
    (values,) = how.values()
    head = assign(5, values) if source == "program" else []
    data = shifted([f"L P[1] 50mm/sec FINE {option}"], *head)
    result = run(data, hot, table_of=registers(tmp_path, pr5=values) if source == "registers" else None)
    assert changed(data, result) == {1, 3}
    assert not result.plan.scope.unsafe
    assert missed_um(data, result.text, 1, HOME, **how) < ROUNDED_UM
    assert missed_um(data, data, 1, HOME, **how) > 50


def test_a_place_with_and_without_its_offset_stays_where_its_correction_turns_a_joint_past_180(hot):
    """Its one CONFIG cannot say it for both; a place of one motion, or one that does not turn past it, is corrected."""
    stays = set()
    for more in (-0.002, 0.0004, 0.002):
        q = (*HOME[:5], 180.0 + more)
        point, motion = [at(1, q, form="{:.6f}")], "L P[1] 50mm/sec FINE"
        alone = shifted([motion], points=point)
        of_one = run(alone, hot)
        config, corrected_config = (naive_ls.read(d)[0][1].groups[1].config for d in (alone, of_one.text))
        both = shifted([f"{motion} Offset,PR[5]", motion], *assign(5, SHIFT), points=point)
        result = run(both, hot)
        reasons = [reason for _, reason in result.plan.stations.held]
        assert [reason.startswith("its correction would pass +-180 deg") for reason in reasons] == (
            [True] if config != corrected_config else []
        )
        assert changed(alone, of_one) == {1, 3}
        assert changed(both, result) == ({3} if reasons else {1, 3})
        stays.add(bool(reasons))
    assert stays == {True, False}


def test_a_condition_gives_the_offset_of_motions_without_a_register(hot):
    moves = ["OFFSET CONDITION PR[5]", "L P[1] 50mm/sec FINE Offset", "L P[2] 50mm/sec FINE"]
    data = shifted(moves, *assign(5, SHIFT))
    result = run(data, hot)
    assert changed(data, result) == {1, 2, 3}
    assert not result.plan.scope.unsafe
    assert missed_um(data, result.text, 1, HOME, offset=SHIFT) < ROUNDED_UM
    assert missed_um(data, result.text, 2, THERE) < ROUNDED_UM


def test_a_position_driven_to_with_and_without_its_offset_takes_the_mean(hot):
    """An approach over a place and the place itself: both come nearer, and --split serves each exactly."""
    moves = ["L P[1] 50mm/sec FINE Offset,PR[5]", "L P[1] 50mm/sec FINE", "L P[1] 50mm/sec FINE Tool_Offset,PR[5]"]
    data = shifted(moves, *assign(5, (0.0, 0.0, -60.0, 0.0, 0.0, 0.0)))
    result = run(data, hot)
    up = {"offset": (0, 0, -60, 0, 0, 0)}
    along = {"tool_offset": (0, 0, -60, 0, 0, 0)}
    assert changed(data, result) == {1, 3}
    for way in (up, {}, along):
        assert missed_um(data, result.text, 1, HOME, **way) < 0.2 * missed_um(data, data, 1, HOME, **way)
    parted = run(data, hot, split=True)
    new = sorted(set(naive_ls.read(parted.text)[0]) - {1, 2, 3})
    assert len(new) == 2
    targets = [m.targets[0] for m in naive_ls.read(parted.text)[1][1:4]]
    for target, way in zip(targets, (up, {}, along), strict=True):
        n = int(target[2:-1])
        wanted = numbers(data, 1)
        assert np.abs(numbers(parted.text, n) - wanted).max() < 1.0
        meant = arm.frame(*(wanted + np.array(way.get("offset", np.zeros(6)))))
        meant = meant @ arm.frame(*way.get("tool_offset", (0,) * 6))
        written = arm.frame(*(numbers(parted.text, n) + np.array(way.get("offset", np.zeros(6)))))
        written = written @ arm.frame(*way.get("tool_offset", (0,) * 6))
        real = arm.flange(arm.joints_at(written, HOME), naive_heat.warm_lengths())
        assert 1e3 * np.linalg.norm(real[:3, 3] - meant[:3, 3]) < ROUNDED_UM


@pytest.mark.parametrize("kind", ["UFRAME", "UTOOL"])
def test_a_frame_written_from_a_known_register_is_a_known_frame(kind, hot):
    matrix = arm.frame(*FRAME) if kind == "UFRAME" else arm.frame(10, 5, 150, 0, 5, 0)
    values = FRAME if kind == "UFRAME" else (10.0, 5.0, 150.0, 0.0, 5.0, 0.0)
    where = {"uf": matrix} if kind == "UFRAME" else {"ut": matrix}
    numbered = (4, 0) if kind == "UFRAME" else (0, 4)
    points = [at(1, HOME, numbered=numbered, **where), at(2, THERE, numbered=numbered, **where)]
    moves = [*assign(9, values), f"{kind}[4]=PR[9:frame]", "L P[1] 50mm/sec FINE", "L P[2] 50mm/sec FINE"]
    data = shifted(moves, points=points)
    result = run(data, hot, frames=default_frames())  # the table need not tell it
    assert changed(data, result) == {1, 2, 3}
    assert not result.plan.scope.unsafe
    for n, guess in ((1, HOME), (2, THERE)):
        assert missed_um(data, result.text, n, guess, **where) < ROUNDED_UM


def test_a_frame_is_the_tables_before_it_is_written_and_the_programs_behind(hot, tmp_path):
    first, second = arm.frame(*FRAME), arm.frame(100, 50, -20, 0, 0, 10)
    points = [at(1, HOME, uf=first, numbered=(4, 0)), at(2, THERE, uf=second, numbered=(4, 0))]
    moves = ["L P[1] 50mm/sec FINE", "UFRAME[4]=PR[9]", "L P[2] 50mm/sec FINE"]
    data = shifted(moves, points=points)
    keys = zip(("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg"), FRAME, strict=True)
    frames = load_frames(table(tmp_path, "[uframe.4]\n" + "".join(f"{k}={v}\n" for k, v in keys), "f.toml"))
    result = run(data, hot, frames, registers(tmp_path, pr9=(100.0, 50.0, -20.0, 0.0, 0.0, 10.0)))
    assert changed(data, result) == {1, 2, 3}
    assert missed_um(data, result.text, 1, HOME, uf=first) < ROUNDED_UM
    assert missed_um(data, result.text, 2, THERE, uf=second) < ROUNDED_UM


FOLLOWED = [
    (["PR[5]=LPOS", "PR[5]=PR[5]-PR[5]", "PR[5,1]=30", "PR[5,2]=(-20)", "PR[5,3]=50"], True),
    ([*assign(6, SHIFT), "PR[5]=PR[6:other]"], True),
    ([*assign(6, (10, 0, 20, 0, 0, 0)), *assign(7, (20, -20, 30, 0, 0, 0)), "PR[5]=PR[6]+PR[7]"], True),
    (["R[1]=25", "PR[5]=LPOS", "PR[5]=PR[5]-PR[5]", "PR[5,1]=R[1]+5", "PR[5,2]=(-R[1]+5)", "PR[5,3]=2*R[1]"], True),
    (["LBL[1]", *assign(5, SHIFT), "IF DI[1]=ON,JMP LBL[1]"], True),
    ([*assign(5, SHIFT), "FOR R[1]=1 TO 3", "DO[1]=ON", "ENDFOR"], True),
    ([*assign(5, SHIFT), "IF (DI[1]) THEN", "PR[5,3]=50", "ENDIF"], True),
    ([*assign(5, SHIFT), "CALL QUIET"], True),
    ([*assign(5, SHIFT), "IF (F[1:x]=ON),DO[2:y]=PULSE,0.5sec"], True),
    ([*assign(5, SHIFT), "SOFTFLOAT[1]", "SOFTFLOAT END"], True),
    # from here on run time decides
    (["PR[5]=LPOS"], False),
    (["PR[5]=JPOS", "PR[5]=PR[5]-PR[5]", *assign(5, SHIFT)], False),
    (["PR[5,3]=50"], False),
    (["PR[5]=PR[5]-PR[5]", "PR[5,3]=GI[1]"], False),
    ([*assign(5, SHIFT), "CALL OTHER"], False),
    ([*assign(5, SHIFT), "CALL WRITES"], False),
    ([*assign(5, SHIFT), "RUN OTHER"], False),
    ([*assign(5, SHIFT), "SOME MACRO"], False),
    ([*assign(5, SHIFT), "PR[R[1]]=LPOS"], False),
    ([*assign(5, SHIFT), "PR[5,R[1]]=3"], False),
    ([*assign(5, SHIFT), "IF DI[1]=ON,PR[5,3]=51"], False),
    ([*assign(5, SHIFT), "IF (DI[1]) THEN", "PR[5,3]=51", "ENDIF"], False),
    ([*assign(5, SHIFT), "FOR R[1]=1 TO 3", "PR[5,3]=PR[5,3]+10", "ENDFOR"], False),
    ([*assign(5, SHIFT), "LBL[1]", "PR[5,3]=PR[5,3]+10", "IF DI[1]=ON,JMP LBL[1]"], False),
    ([*assign(5, SHIFT), "L P[2] 50mm/sec FINE Skip,LBL[1],PR[5]=LPOS", "LBL[1]"], False),
    ([*assign(5, SHIFT), "L P[2] 50mm/sec FINE TB .10sec,CALL OTHER"], False),
    ([*assign(5, SHIFT), "Search Start[1] PR[5]", "Search End"], False),
    ([*assign(6, SHIFT), "PR[5]=PR[6]*2"], False),
    ([*assign(6, SHIFT), "PR[5]=PR[6]+VR[1]"], False),
    (["JMP LBL[1]", *assign(5, SHIFT), "LBL[1]"], False),
    (["SELECT R[1]=1,PR[5]=PR[6]", *assign(6, SHIFT)], False),
]  # fmt: skip


@pytest.mark.parametrize(("statements", "known"), FOLLOWED, ids=[" ".join(s)[-60:] for s, _ in FOLLOWED])
def test_registers_are_followed_as_far_as_constants_tell(statements, known, hot):
    programs = {
        "QUIET": program(["R[1]=5", "DO[1]=ON"], [], name="QUIET"),
        "WRITES": program(["PR[5]=LPOS"], [], name="WRITES"),
    }
    data = shifted([*statements, "L P[1] 50mm/sec FINE Offset,PR[5]"])
    result = run(data, hot, programs=programs)
    assert (1 in changed(data, result)) == known
    line = next(i for i, text in enumerate(data.decode().split("\n"), 1) if "Offset,PR[5]" in text)
    listed = [u for u in result.plan.scope.unsafe if u.line == line]
    assert bool(listed) != known
    assert all("Offset is added at run time" in u.reason and len(u.reason) < 200 for u in listed)
    if known:
        assert missed_um(data, result.text, 1, HOME, offset=SHIFT) < ROUNDED_UM
    said = inspect(loads(data), hot.robot, MANY, None, programs.get)["unsafe"]
    assert [(u["line"], u["reason"]) for u in said] == [(u.line, u.reason) for u in result.plan.scope.unsafe]


@pytest.mark.parametrize(
    ("moves", "reason"),
    [
        (["L P[1] 50mm/sec FINE Offset,PR[R[1]]"], "which register"),
        (["L P[1] 50mm/sec FINE Offset,PR[5] Tool_Offset,PR[5]"], "how they add up"),
        (["C P[1] P[2] 50mm/sec FINE Offset,PR[5]"], "arc"),
        (["L P[4] 50mm/sec FINE Offset,PR[5]"], "joint form"),
        (["OFFSET CONDITION PR[5],UFRAME[1]", "L P[1] 50mm/sec FINE Offset"], "CONDITION"),
        (["OFFSET CONDITION PR[5]", "PR[5,1]=7", "L P[1] 50mm/sec FINE Offset"], "behind its OFFSET CONDITION"),
        (["IF DI[1]=ON,JMP LBL[1]", "OFFSET CONDITION PR[5]", "LBL[1]", "L P[1] 50mm/sec FINE Offset"], "CONDITION"),
        (["L P[1] 50mm/sec FINE Offset,PR[6]"], "PR[6] is not known: give it with --registers"),
        (["PR[6]=PR[7]", "L P[1] 50mm/sec FINE Offset,PR[6]"], "give it, or what it is written from, with --reg"),
        (["PR[6,1]=R[9]", "L P[1] 50mm/sec FINE Offset,PR[6]"], "PR[6] may have been written before it"),
        (["L P[1] 50mm/sec FINE Offset,PR[5] INC"], "INC moves relative"),
        (["L P[1] 50mm/sec FINE VOFFSET,VR[1]"], "VOFFSET is added"),
        (["UFRAME[4]=PR[6]", "L P[5] 50mm/sec FINE"], "UFRAME[] is written"),
        (["UFRAME[4]=PR[5]", "CALL OTHER", "L P[5] 50mm/sec FINE"], "UFRAME[4] is written before it"),
        (["UFRAME[R[1]]=PR[5]", "L P[5] 50mm/sec FINE"], "UFRAME[] is written"),
        (["$MNUFRAME[1,4].$X=5", "L P[5] 50mm/sec FINE"], "UFRAME[] is written"),
    ],
)  # fmt: skip
def test_what_is_not_followed_stays_held_with_its_reason(moves, reason, hot):
    points = [at(1, HOME), at(2, THERE), joint_form(4, HOME), at(5, HOME, numbered=(4, 0))]
    data = program([*assign(5, SHIFT), GO, *moves, GO], [*points[:2], at(3, AWAY), *points[2:]])
    result = run(data, hot)
    assert changed(data, result) == ({3} if "UFRAME[R" not in moves[0] else set())  # any frame may be the one
    assert any(reason in u.reason for u in result.plan.scope.unsafe), result.plan.scope.unsafe
    with pytest.raises(InputError, match="--strict"):
        run(data, hot, strict=True)


@pytest.mark.parametrize(
    ("statements", "given"),
    [
        ([], {6}), (["PR[6,1]=7"], {6}), (["PR[6,1]=PR[6,1]+7"], {6}), (["PR[6]=PR[7]"], {7}),
        (["PR[6]=PR[6]+PR[7]"], {6, 7}), (["PR[6,2]=PR[7,1]"], {6, 7}), (["IF DI[1]=ON,JMP LBL[1]", "LBL[1]"], {6}),
        (["CALL OTHER"], None), (["PR[6,1]=R[9]"], None), (["IF DI[1]=ON,PR[6,1]=7"], None),
        (["PR[6]=PR[7]-P[9]"], None), (["LBL[1]", "PR[6,1]=PR[6,1]+7", "IF DI[1]=ON,JMP LBL[1]"], None),
        (["PR[R[1]]=PR[7]"], None),
    ],
)  # fmt: skip
def test_registers_are_asked_for_where_giving_them_frees_the_motion(statements, given, hot, tmp_path):
    data = shifted([*statements, "L P[1] 50mm/sec FINE Offset,PR[6]"])

    def reasons(*numbers):
        table_of = registers(tmp_path, **{f"pr{n}": SHIFT for n in numbers})
        unsafe = run(data, hot, table_of=table_of).plan.scope.unsafe
        return [u.reason for u in unsafe if "Offset is added at run time" in u.reason]

    (reason,) = reasons()
    assert ("with --registers" in reason) == (given is not None), reason
    assert ("give it, or" in reason) == (given is not None and bool(statements) and "PR" in statements[0])
    assert bool(reasons(6, 7)) == (given is None)
    assert given is None or not reasons(*given)


@pytest.mark.parametrize("write", ["UFRAME[4]=PR[5]", "utool[2]=pr[5]", "IF DI[1]=ON,UFRAME[R[1]]=PR[5]"])
@pytest.mark.parametrize("call", ["CALL INNER", "CALL OUTER", "L P[2] 50mm/sec FINE TB .10sec,CALL OUTER"])
def test_a_frame_that_a_called_program_writes_is_not_the_tables_behind_the_call(call, write, hot):
    """It was: the program was corrected for the table's frame, proven for it, and inside its bounds."""
    points = [at(n, HOME, numbered=(4, 2)) for n in (1, 3)]
    go = "L P[2] 50mm/sec FINE"
    data = program([go, "L P[1] 50mm/sec FINE", call, "L P[3] 50mm/sec FINE"], [*points, at(2, THERE, numbered=(0, 0))])
    programs = {"OUTER": program(["CALL INNER"], [], name="OUTER"), "INNER": program([write], [], name="INNER")}
    assert changed(data, run(data, hot)) == {1, 2, 3}
    result = run(data, hot, programs=programs)
    assert changed(data, result) == {1, 2}
    (reason,) = {u.reason for u in result.plan.scope.unsafe}
    assert "is written before it, here or in a program that it calls" in reason
    frame = {"UFRAME[4]=PR[5]": "UFRAME[4]", "utool[2]=pr[5]": "UTOOL[2]"}.get(write, "UFRAME[R]")
    called = inputs_record(result)["called"]  # another program beside is another input
    assert called == {"motionless": ["OUTER" if "OUTER" in call else "INNER"], "settled": [], "writes": [frame]}


OTHER_NAME = program([], [], name="OTHER")


@pytest.mark.parametrize(
    ("beside", "missing"),
    [
        ({}, "DEEP, OUTER"),
        ({"OUTER": program(["CALL INNER"], [], name="OUTER"), "DEEP": b"\xd0\xcf"}, "DEEP, INNER"),
        ({"OUTER": OTHER_NAME, "DEEP": program([], [], name="DEEP")}, "OUTER"),
        ({"OUTER": program(["CALL OUTER"], [], name="OUTER"), "DEEP": program([], [], name="DEEP")}, ""),
    ],
)
def test_a_called_program_that_is_not_there_to_read_is_named(beside, missing, hot):
    """It was taken to write no frame, and nothing said so."""
    moves = ["L P[2] 50mm/sec FINE", "CALL OUTER", "L P[1] 50mm/sec FINE TB .10sec,CALL DEEP"]
    data = program(moves, [at(1, HOME, numbered=(4, 2)), at(2, THERE, numbered=(0, 0))])
    messages = [f.message for f in run(data, hot, programs=beside).findings if f.code == "program.called"]
    assert [message.split(": ")[1].split(";")[0] for message in messages] == [missing] * bool(missing)


def test_a_frame_is_not_known_where_two_ways_meet_that_wrote_it_differently(hot):
    moves = ["UFRAME[4]=PR[5]", "IF DI[1]=ON,UFRAME[4]=PR[6]", "L P[1] 50mm/sec FINE"]
    data = shifted(moves, *assign(5, SHIFT), *assign(6, TURNED), points=[at(1, HOME, numbered=(4, 0)), at(2, THERE)])
    assert changed(data, run(data, hot)) == {3}


def test_a_register_of_six_written_numbers_is_taken_for_cartesian_and_said(hot):
    data = shifted(["L P[1] 50mm/sec FINE Offset,PR[5]"], *assign(5, SHIFT))
    (note,) = [f for f in run(data, hot).findings if f.code == "registers.form"]
    assert "PR[5]" in note.message


def test_points_go_into_ways_between_shifted_places(hot):
    """The straight way from an offset place to a plain one is cut along where the tool really goes."""
    start = end = (60.0, -10.0, -50.0, 20.0, -40.0, 10.0)
    for y in np.linspace(0, -1200, 20):
        end = arm.joints_at(arm.frame(0, y, 0, 0, 0, 0) @ arm.flange(start), end)
    back = arm.frame(*(-v for v in SHIFT))
    moves = [*assign(5, SHIFT), "L P[1] 100mm/sec FINE Offset,PR[5]", "L P[2] 100mm/sec FINE"]
    data = program(moves, [at(1, start, uf=np.linalg.inv(back)), at(2, end)])
    result = run(data, hot, insert=2e-6)
    new = sorted(set(naive_ls.read(result.text)[0]) - {1, 2})
    assert new
    a, b = (numbers(data, 1) + np.array(SHIFT))[:3], numbers(data, 2)[:3]
    along = (b - a) / np.linalg.norm(b - a)
    for n in new:
        place = numbers(result.text, n)[:3]
        assert np.linalg.norm((place - a) - along * ((place - a) @ along)) < 1.0


# Extended axes ---------------------------------------------------------------------------------------------------

RAIL = "[extended.E1]\nkind = 'rail'\n"
BASE = (1500.0, 200.0, -300.0, 0.0, 0.0, 90.0)


def rail(*bases):
    keys = ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg")
    text = RAIL
    for value, pose in bases:
        text += f"[[extended.E1.base]]\nat_mm = {value}\n" + "".join(
            f"{k} = {v}\n" for k, v in zip(keys, pose, strict=True)
        )
    return text


def on_rail(n, joints, value, base, unit="mm"):
    """A position of an arm whose base stands elsewhere, told in the cell's World."""
    return at(n, joints, uf=np.linalg.inv(arm.frame(*base)), more=f",\n\tE1=  {value:.3f}  {unit}")


def test_an_arm_on_a_rail_that_stands_still_is_corrected_where_it_stands(hot, tmp_path):
    frames = load_frames(table(tmp_path, rail((1500, BASE), (0, (0,) * 6))))
    points = [on_rail(n, j, 1500.0, BASE) for n, j in ((1, HOME), (2, THERE), (3, AWAY))]
    data = program([GO, "L P[1] 50mm/sec FINE", "L P[2] 50mm/sec FINE", GO], points)
    result = correct(data, hot, frames, load_before((WARM,)).duties, Options(), quiet)
    assert changed(data, result) == {1, 2, 3}
    assert not result.plan.scope.unsafe
    for n, guess in ((1, HOME), (2, THERE), (3, AWAY)):
        back = np.linalg.inv(arm.frame(*BASE))
        assert missed_um(data, result.text, n, guess, uf=back) < ROUNDED_UM  # in the arm's own World
    assert (result.execution.fraction < 1).any()  # ways are ridden
    assert any(f.code == "robot.carried" for f in result.findings)
    plain = program([GO, "L P[1] 50mm/sec FINE", "L P[2] 50mm/sec FINE", GO], [at(1, HOME), at(2, THERE), at(3, AWAY)])
    there = corrected(plain, hot)
    assert np.allclose(
        result.error.distance, there.error.distance, atol=2e-8
    )  # the same arm, the same error, elsewhere
    assert not result.text.replace(b"1500.000", b"").count(b"E1=  1")


def test_positions_are_told_in_the_cells_world_in_the_report(hot, tmp_path):
    from compgen.report.correction import correction_csv

    frames = load_frames(table(tmp_path, rail((1500, BASE))))
    data = program([GO, "L P[1] 50mm/sec FINE"], [on_rail(1, HOME, 1500.0, BASE), on_rail(3, AWAY, 1500.0, BASE)])
    result = correct(data, hot, frames, load_before((WARM,)).duties, Options(), quiet)
    rows = correction_csv(result).decode().split("\n")
    head, last = rows[0].split(","), rows[2].split(",")
    told = [float(last[head.index(k)]) for k in ("x_mm", "y_mm", "z_mm")]
    assert told == pytest.approx(numbers(data, 1)[:3], abs=2e-3)


HELD = [
    (rail((1500, BASE)), 1000.0, "mm", "at 1000 mm, where its base is not told"),
    (rail((1500, BASE)), 1500.0, "deg", "at 1500 deg, where its base is not told"),
    ("[extended.E2]\nkind = 'positioner'\n", 1500.0, "mm", "extended axis E1 moves the base or the part"),
    ("", 1500.0, "mm", "extended axis E1 moves the base or the part"),
]


@pytest.mark.parametrize(("text", "value", "unit", "reason"), HELD)
def test_an_axis_whose_kind_or_base_is_not_told_holds_its_positions(text, value, unit, reason, hot, tmp_path):
    frames = load_frames(table(tmp_path, text))
    points = [on_rail(n, j, value, (0,) * 6, unit) for n, j in ((1, HOME), (3, AWAY))]
    data = program([GO, "L P[1] 50mm/sec FINE"], points)
    result = correct(data, hot, frames, load_before((WARM,)).duties, Options(), quiet)
    assert result.text == data
    assert all(reason in u.reason for u in result.plan.scope.unsafe)
    assert {u.text for u in result.plan.scope.unsafe} == {"P[1]", "P[3]"}


def test_a_position_that_does_not_say_where_the_arm_stands_is_held(hot, tmp_path):
    frames = load_frames(table(tmp_path, rail((0, (0,) * 6))))
    data = program([GO, "L P[1] 50mm/sec FINE"], [at(1, HOME), on_rail(3, AWAY, 0.0, (0,) * 6)])
    result = correct(data, hot, frames, load_before((WARM,)).duties, Options(), quiet)
    assert changed(data, result) <= {3}
    assert any("does not say where" in u.reason and u.text == "P[1]" for u in result.plan.scope.unsafe)


def test_where_the_axis_moves_the_station_is_held_and_the_others_are_not(hot, tmp_path):
    other = (2500.0, 200.0, -300.0, 0.0, 0.0, 90.0)
    frames = load_frames(table(tmp_path, rail((1500, BASE), (2500, other))))
    points = [on_rail(1, HOME, 1500.0, BASE), on_rail(2, THERE, 1500.0, BASE)]
    points += [on_rail(4, THERE, 2500.0, other), on_rail(5, HOME, 2500.0, other)]
    moves = ["J P[1] 10% FINE", "L P[2] 50mm/sec FINE", "J P[4] 10% FINE", "L P[5] 50mm/sec FINE"]
    data = program(moves, points)
    result = correct(data, hot, frames, load_before((WARM,)).duties, Options(), quiet)
    assert changed(data, result) == {2, 5}  # to P[4] it moves, to P[1] it may
    carried = [u for u in result.plan.scope.unsafe if "moves on the way there" in u.reason]
    assert [u.text.split("]")[0] for u in carried] == ["J P[1", "J P[4"]
    (timed,) = [f for f in result.findings if f.code == "timing.assumed"]
    assert timed.message.startswith("line 6: ")  # to P[4], as if the arm alone moved
    assert "a moving extended axis" in timed.message


def test_a_positioner_that_stands_still_leaves_the_arm_where_it_is(hot, tmp_path):
    frames = load_frames(table(tmp_path, "[extended.E1]\nkind = 'positioner'\n"))
    points = [at(n, j, more=",\n\tE1=  30.000 deg") for n, j in ((1, HOME), (3, AWAY))]
    data = program([GO, "L P[1] 50mm/sec FINE", GO], points)
    result = correct(data, hot, frames, load_before((WARM,)).duties, Options(), quiet)
    assert changed(data, result) == {1, 3}
    assert missed_um(data, result.text, 1, HOME) < ROUNDED_UM
    turning = data.replace(b"E1=  30.000", b"E1=  40.000", 1)
    assert correct(turning, hot, frames, load_before((WARM,)).duties, Options(), quiet).text == turning


BAD_TABLES = [
    ("[extended.E4]\nkind='rail'\n", "E4"), ("[extended.E1]\n", "kind: missing"),
    ("[extended.E1]\nkind='slide'\n", "slide"), ("[extended.E1]\nkind='rail'\n", "base: missing"),
    ("[extended.E1]\nkind='rail'\nbase=3\n", "base"), ("[extended]\nE1=3\n", "must be a table"),
    ("extended=3\n", "must be a table"), ("[extended.E1]\nkind='positioner'\n[[extended.E1.base]]\n", "positioner"),
    (rail((1500, BASE)).replace("at_mm", "at_deg") + rail((0, BASE))[len(RAIL):], "one unit"),
    (rail((1500, BASE)).replace("at_mm = 1500\n", ""), "at_mm or at_deg"),
    (rail((1500, BASE), (1500.002, BASE)), "told twice"),
    (rail((1500, BASE)).replace("w_deg = 0.0", "w_deg = 1"), "w_deg"),
    (rail((1500, BASE)) + rail((0, BASE)).replace("E1", "E2"), "second rail"),
    (rail((1500, BASE)).replace("x_mm = 1500.0\n", ""), "x_mm: missing"),
    (rail((1500, BASE)).replace("1500\n", "nan\n"), "at_mm"), (rail((1500, BASE)).replace("kind", "sort"), "sort"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "words"), BAD_TABLES)
def test_a_wrong_table_of_extended_axes_is_refused_in_one_line(text, words, tmp_path):
    with pytest.raises(InputError) as refused:
        load_frames(table(tmp_path, text))
    message = str(refused.value)
    assert words in message
    assert "t.toml" in message
    assert "\n" not in message
    assert len(message) <= 300 + len(str(tmp_path))


POSREG = """[*POSREG*]$POSREG  Storage: CMOS  Access: RW  : ARRAY[2,8] OF Position Reg
    [1,1] =   'Home1'   Group: 1
  J1 =     0.000 deg   J2 =   -60.000 deg   J3 =     0.000 deg
  J4 =     0.000 deg   J5 =    90.000 deg   J6 =      .000 deg

    [1,2] =   'X: 1 Y: 2' Uninitialized
    [1,5] =   'shift'
  Group: 1   Config: N U T, 0, 0, 0
  X:    30.000   Y:   -20.000   Z:    50.000
  W:     0.000   P:      .000   R:     0.000
    [2,5] =   'other group' Group: 2
  J1 =     0.000 deg
"""


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_registers_of_a_controllers_backup(end, tmp_path):
    path = tmp_path / "posreg.va"
    path.write_bytes(POSREG.replace("\n", end).encode())
    read = load_registers(str(path))
    assert set(read) == {1, 5}
    assert (read[5].form, read[5].values, read[1].form) == ("cartesian", SHIFT, "joint")


BAD_REGISTERS = [
    ("[pr.0]\nx_mm=0\n", "pr.0"), ("[pr.5]\nx_mm=0\n", "add y_mm = 0"), ("[p.5]\n", "unknown key"), ("pr=3", "pr"),
    ("[pr.5]\nx=0\n", "pr.5.x"), ("[pr.5\n", "not TOML"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "words"), BAD_REGISTERS)
def test_a_wrong_table_of_registers_is_refused_in_one_line(text, words, tmp_path):
    with pytest.raises(InputError, match=r"t\.toml") as refused:
        load_registers(table(tmp_path, text))
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)
