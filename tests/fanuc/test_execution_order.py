"""From where the robot surely comes: never wrong, and known where a reader of the listing would know it."""

import itertools

import numpy as np
import pytest
from ls_text import joint_form, program

from compgen.fanuc import loads
from compgen.fanuc.analysis.called_programs import called_programs
from compgen.fanuc.analysis.flow_graph import NO_ORIGIN, station_origins
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.vocabulary import may_move_arm


def origins(*statements, motionless=()):
    """The P number from which the robot comes to each motion, in the order listed; None where it is not sure."""
    return origins_in(program(statements, [joint_form(n, [n, 0, 0, 0, -60, 0]) for n in range(1, 10)]), motionless)


def origins_in(text, motionless=()):
    loaded = loads(text)
    m = loaded.motions
    motion = np.flatnonzero(~m.disabled)
    motion = np.repeat(motion, [len(m.position[i]) for i in motion])
    numbers = [n for i in np.flatnonzero(~m.disabled) for n in m.position[i]]
    return [None if o == NO_ORIGIN else numbers[o] for o in station_origins(loaded, motion, motionless).tolist()]


def go(n, options=""):
    return f"L P[{n}] 50mm/sec FINE {options}".strip()


def test_straight_code_is_driven_as_it_is_listed():
    assert origins(go(1), "R[1]=R[1]+1", go(2), "WAIT   1.00(sec)", "C P[3] P[4] 50mm/sec FINE") == [None, 1, 2, 3]


def test_a_jump_that_always_happens_is_followed_and_what_it_skips_joins_nothing():
    listing = (go(1), "JMP LBL[9]", "LBL[1]", go(2), go(3), "LBL[9]", go(4))
    assert origins(*listing) == [None, None, 2, 1]


@pytest.mark.parametrize(
    ("statements", "known"),
    [
        ((go(1), "IF R[1]=1,JMP LBL[1]", go(2), "LBL[1]", go(3)), [None, 1, None]),
        ((go(1), "IF R[1]=1,JMP LBL[1]", "LBL[1]", go(2)), [None, 1]),
        (("LBL[1:again]", go(1), go(2), "JMP LBL[1]"), [None, 1]),
        ((go(9), "LBL[1]", go(1), go(2), "IF DI[1]=ON,JMP LBL[1]", go(3)), [None, None, 1, 2]),
        ((go(1), "FOR R[1]=1 TO 3", go(2), go(3), "ENDFOR", go(4)), [None, None, 2, 3]),
        ((go(1), "FOR R[1]=3 DOWNTO 1", go(2), "ENDFOR", go(4)), [None, None, 2]),
        ((go(1), "FOR R[1]=3 TO 1", go(2), "ENDFOR", go(4)), [None, None, None]),
        ((go(1), "FOR R[1]=2 TO 2", go(2), "ENDFOR", go(4)), [None, None, 2]),
        ((go(1), "FOR R[1]=2 DOWNTO 2", go(2), "ENDFOR", go(4)), [None, None, 2]),
        ((go(1), "FOR R[1]=1 TO R[2]", go(2), "ENDFOR", go(4)), [None, None, None]),
        ((go(1), "IF (DI[1]=ON) THEN", go(2), "ELSE", go(3), "ENDIF", go(4)), [None, 1, 1, None]),
        ((go(1), "IF (DI[1]=ON) THEN", "R[1]=2", "ENDIF", go(4)), [None, 1]),
        ((go(1), "IF (DI[1]=ON) THEN", go(2), "ENDIF", go(4)), [None, 1, None]),
        ((go(1), "IF (DI[1]=ON) THEN", go(2), "JMP LBL[1]", "ENDIF", go(4), "LBL[1]"), [None, 1, 1]),
        ((go(1), "SELECT R[1]=1,JMP LBL[1]", "  =2,JMP LBL[2]", "ELSE,JMP LBL[1]", "LBL[1]", go(2), "LBL[2]", go(3)),
         [None, 1, None]),
        ((go(1), "JMP LBL[R[1]]", "LBL[1]", go(2), "LBL[2]", go(3)), [None, 1, None]),
        ((go(1), "IF R[1]=1,JMP LBL[R[2]]", go(2), "JMP LBL[R[2]]", go(3)), [None, 1, None]),  # no label to jump to
        ((go(1), "WAIT DI[1]=ON TIMEOUT,LBL[1]", go(2), "LBL[1]", go(3)), [None, 1, None]),
        ((go(1), go(2, "Skip,LBL[1]"), go(3), "LBL[1]", go(4)), [None, None, None, None]),
        ((go(1), go(2, "Offset,PR[1]"), go(3), go(4)), [None, None, None, 3]),
        ((go(1), go(2, "FPLIN"), go(3), go(4)), [None, None, None, 3]),
        ((go(1), "L PAL_1[A_1] 50mm/sec FINE", go(3), go(4)), [None, 1, NO_NUMBER, 3]),
        ((go(1), "END", go(2)), [None, None]),
        ((go(1), "IF (DI[1]=ON) THEN", go(2)), [None, None]),
        ((go(1), "ENDFOR", go(2)), [None, None]),
        ((go(1), "ELSE", go(2), go(3)), [None, None, 2]),
    ],
)  # fmt: skip
def test_where_ways_differ_the_origin_is_not_known(statements, known):
    assert origins(*statements) == known


@pytest.mark.parametrize(("inside", "known"), [("DO[8]=ON", [None, 1, 2, 3]), (go(9), [None, 1, None, None, 3])])
def test_only_a_motion_in_a_motions_point_logic_leaves_the_place_unknown(inside, known):
    points = [joint_form(n, [n, 0, 0, 0, -60, 0]) for n in range(1, 10)]
    text = program([go(1), go(2, "TB    .10sec,P-SPS"), go(3), go(4)], points)
    before, third, behind = text.partition(b"   3:L")
    assert third
    logic = f"   1:{inside} ;\n     ------\n".encode()
    assert origins_in(before + logic + third + behind) == known


@pytest.mark.parametrize(
    "statement",
    [
        "CALL GRIP", "RUN OTHER", "CALL GRIP(1,2)", "IF DI[1]=ON,CALL GRIP", "CALL R[1]", "CALL SR[1]", "OPEN_HAND",
        "Follow Up", "IF (DI[1]=ON),OPEN_HAND", "FORCE CTRL[1]", "SOFTFLOAT[1]",
        "MONITOR SEES_IT", "=3,CALL GRIP", "ELSE,CALL GRIP", "HOME(1)", "CALL",
    ],
)  # fmt: skip
def test_what_may_move_the_arm_leaves_its_place_unknown(statement):
    assert may_move_arm(statement)
    assert origins(go(1), statement, go(2)) == [None, None]


@pytest.mark.parametrize(
    "statement",
    [
        "DO[1:a, b]=PULSE,0.5sec", "PR[3,3:WELD (X)]=(R[35]-2)", "$MCR_GRP[1].$PRGOVERRIDE=50", "UFRAME_NUM=1",
        "PAYLOAD[3]", "TIMER[7]=START", "OVERRIDE=R[2]", "MESSAGE[a,b]", "UALM[1]", "PAUSE", "COL DETECT ON",
        "Arc Start[1]", "IF (DI[1]=ON),DO[2]=(OFF)", "IF R[1]=1,END", "WAIT DI[1]=ON", "LOCK PREG", "UNLOCK PREG",
        "SKIP CONDITION DI[1]=ON", "CALL QUIET", "IF R[1]=1,CALL QUIET(1,'a')", "RUN QUIET", "!HOME",
        "//CALL GRIP", "TIMER[1]=RESET", "IF (F[1:a, b]=ON),DO[2]=PULSE,0.5sec", "IF DI[1]=ON,DO[2]=PULSE, 1.0 sec",
    ],
)  # fmt: skip
def test_what_never_moves_it_leaves_the_order_as_it_is(statement):
    assert origins(go(1), statement, go(2), motionless={"QUIET"}) == [None, 1]


def test_a_called_program_is_followed_as_far_as_to_know_that_it_stands_still():
    texts = {
        "QUIET": program(["DO[1]=ON", "CALL DEEPER", "WAIT   .50(sec)"], [], name="QUIET"),
        "DEEPER": program(["R[1]=R[1]+1"], [], name="DEEPER"),
        "GOES": program([go(1)], [joint_form(1, [0, 0, 0, 0, -60, 0])], name="GOES"),
        "FAR": program(["CALL GOES"], [], name="FAR"),
        "LOOP": program(["CALL LOOP"], [], name="LOOP"),
        "HAND": program(["OPEN_HAND"], [], name="HAND"),
        "ALIAS": program(["R[1]=1"], [], name="OTHER"),
        "BROKEN": b"no program",
    }
    caller = loads(program([f"CALL {name}" for name in [*sorted(texts), "ABSENT"]], []))
    assert called_programs(caller, texts.get).motionless == {"QUIET", "DEEPER"}


def test_many_jumps_to_many_labels_take_no_square_of_time():
    listing = [*(f"LBL[{n}]" for n in range(1, 5001)), *["IF R[1]=1,JMP LBL[R[2]]"] * 5000, go(1), go(2)]
    assert origins(*listing) == [None, 1]
    assert may_move_arm("IF " + "[" * 100_000 + "]" * 100_000)


def run(statements, choose, limit=60):
    """Drive a listing as a controller would, run time decided by ``choose``; pairs of P numbers driven in a row."""
    pc = 0
    at: int | str | None = None
    pairs: set[tuple[int | str | None, int]] = set()
    labels = {s: i for i, s in enumerate(statements) if s.startswith("LBL")}

    def closing(start, opens, closes):
        depth = 0
        for i in range(start + 1, len(statements)):
            word = statements[i]
            if depth == 0 and word.startswith(closes):
                return i
            depth += word.startswith(opens) - word.startswith(closes[-1])
        raise AssertionError("not closed")

    for _ in range(limit):
        if pc >= len(statements):
            break
        s = statements[pc]
        pc += 1
        if s.startswith("L P["):
            n = int(s[4])
            pairs.add((at, n))
            at = n
        elif s.startswith("JMP"):
            pc = labels[s[4:]]
        elif s.startswith("IF R"):
            pc = labels[s.split("JMP ")[1]] if choose() else pc
        elif s.startswith("IF ("):
            pc = pc if choose() else closing(pc - 1, "IF (", ("ELSE", "ENDIF")) + 1
        elif s == "ELSE":
            pc = closing(pc - 1, "IF (", ("ENDIF",))
        elif s.startswith("FOR"):
            first, last = int(s.split("=")[1][0]), s[-1]
            if not (choose() if last == "]" else first <= int(last)):
                pc = closing(pc - 1, "FOR", ("ENDFOR",)) + 1
        elif s == "ENDFOR":
            begin = max(
                b for b in range(pc) if statements[b].startswith("FOR") and closing(b, "FOR", ("ENDFOR",)) == pc - 1
            )
            if choose():
                pc = begin + 1
        elif s == "CALL MOVES":
            at = "elsewhere"
    return pairs


def draw(rng, depth=0):
    """A random listing of motions, jumps, branches and loops; every label exists."""
    statements = []
    for _ in range(rng.integers(2, 6)):
        kind = rng.integers(0, 9 if depth < 3 else 6)
        if kind < 3:
            statements.append("L P[?] 50mm/sec FINE")
        elif kind == 3:
            statements.append(str(rng.choice(["JMP LBL[1]", "JMP LBL[2]", "JMP LBL[3]"])))
        elif kind == 4:
            statements.append(f"IF R[1]=1,JMP LBL[{rng.integers(1, 4)}]")
        elif kind == 5:
            statements.append(str(rng.choice(["R[1]=2", "CALL MOVES", "DO[1]=ON"])))
        elif kind == 6:
            statements += ["IF (DI[1]=ON) THEN", *draw(rng, depth + 1), "ENDIF"]
        elif kind == 7:
            statements += ["IF (DI[1]=ON) THEN", *draw(rng, depth + 1), "ELSE", *draw(rng, depth + 1), "ENDIF"]
        else:
            statements += [f"FOR R[1]=1 TO {rng.choice(['3', '0', 'R[2]'])}", *draw(rng, depth + 1), "ENDFOR"]
    return statements


def test_no_way_through_random_programs_contradicts_an_origin():
    rng = np.random.default_rng(7)
    known = driven = 0
    for _ in range(250):
        listing = draw(rng)
        for label in (1, 2, 3):
            listing.insert(int(rng.integers(0, len(listing) + 1)), f"LBL[{label}]")
        names = itertools.count(1)
        listing = [s.replace("?", str(next(names))) if "?" in s else s for s in listing]
        if sum("L P" in s for s in listing) > 9:
            continue
        told = dict(zip((int(s[4]) for s in listing if s.startswith("L P")), origins(*listing), strict=True))
        for _ in range(40):
            for before, n in run(listing, lambda: rng.random() < 0.5):
                assert told[n] in (None, before), (listing, before, n)
                driven += 1
                known += told[n] is not None
    assert known > 0.2 * driven > 200
