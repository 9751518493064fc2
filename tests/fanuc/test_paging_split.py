"""Long programs in pages: what they drive, where they are cut, what each holds."""

import re

import naive_ls
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from long_program import move, text
from shipped import ROOT

from compgen import fanuc as ls
from compgen.core.exceptions import CompgenError, ImpossibleError, InputError
from compgen.fanuc.analysis.control_flow import read_flow
from compgen.fanuc.analysis.modal_state import read_modal_state
from compgen.fanuc.paging.capacity import program_size
from compgen.fanuc.paging.join_check import called_pages, check_join, motion_sequence
from compgen.fanuc.paging.plan import page_names
from compgen.fanuc.paging.split import line_count, split_program
from compgen.program.pages import JoinError
from compgen.robot.robot import Capacity


def controller(lines=12, positions=50, memory=1e6, name=12):
    return Capacity(lines, positions, memory, name)


def split_text(body, lines=12, **more):
    keys = ("positions", "memory", "name")
    limits = controller(lines, **{k: more.pop(k) for k in keys if k in more})
    data = text(body, **{k: more.pop(k) for k in ("places", "frame", "numbered") if k in more})
    program = ls.loads(data)
    return program, split_program(program, limits, **more)


def bodies(page):
    """Statements of a page, numbers left out."""
    mn = naive_ls.sections(naive_ls.lines_of(page.data.decode("latin-1")))["MN"]
    return [s.strip() for s in naive_ls.statements(mn)]


def pages_of(paged):
    return {p.name: p.data for p in paged.pages}


def assert_same_motions(data, paged):
    """The naive reader drives pages and program alike, starts left out."""
    files = pages_of(paged)
    for content in files.values():
        numbers = [int(n) for n in re.findall(rb"(?m)^\s*P\[(\d+)[^\r\n]*\{", content)]
        assert numbers == sorted(set(numbers))
    whole = naive_ls.driven(data)
    motions: list[tuple] = []
    for k, name in enumerate(naive_ls.calls(paged.main)):
        rows = naive_ls.driven(files[name])
        if k and rows and motions and rows[0][1] == motions[-1][1][-1:] and paged.pages[k].motions[0] == len(motions):
            own = paged.pages[k].motions[1] - paged.pages[k].motions[0]
            if len(rows) == own + 1:
                assert rows[0][3].upper() == "FINE"
                rows = rows[1:]
        motions += rows
    assert motions == whole


# What a page is --------------------------------------------------------------------------------------------------


def test_pages_of_a_small_program_in_full():
    body = ["  UFRAME_NUM=1 ", "  UTOOL_NUM=1 ", "  PAYLOAD[2] ", move(1, letter="J", speed="10%"), move(2, False)]
    body += [move(3), "  DO[1]=ON ", move(4, False), move(2, False), move(5)]
    program, paged = split_text(body, lines=10)
    assert [p.name for p in paged.pages] == ["LONG_01", "LONG_02"]
    one, two = paged.pages
    assert bodies(one) == ["!page 1 of 2", *[s.strip() for s in body[:6]]]
    assert bodies(two) == [
        "!page 2 of 2", "UFRAME_NUM=1", "UTOOL_NUM=1", "PAYLOAD[2]", "L P[3] 100mm/sec FINE",
        *[s.strip() for s in body[6:]],
    ]  # fmt: skip
    assert sorted(naive_ls.read(two.data)[0]) == [2, 3, 4, 5]
    assert b"/PROG  LONG_02\r\n" in two.data
    assert b"LINE_COUNT\t= 9;" in two.data
    assert b"CORNER_SPEED_HEADER" in two.data
    assert b'COMMENT\t\t= "a long one"' in two.data
    assert [line.split(b":")[0] for line in two.data.split(b"/MN\r\n")[1].split(b"\r\n")[:3]] == [
        b"   1",
        b"   2",
        b"   3",
    ]
    main = paged.main.decode()
    assert main.startswith("/PROG  LONG\r\n")
    assert "DEFAULT_GROUP\t= *,*,*,*,*;" in main
    assert "CORNER_SPEED_HEADER" not in main
    assert main.endswith("/MN\r\n   1:  CALL LONG_01 ;\r\n   2:  CALL LONG_02 ;\r\n/POS\r\n/END\r\n")
    assert check_join(program, paged.main, pages_of(paged)) == 6
    assert one.motions == (0, 3)
    assert two.motions == (3, 6)


def test_a_program_that_fits_is_one_page_with_its_own_bytes():
    body = [move(1), move(2, False), move(3)]
    program, paged = split_text(body, lines=50, places=3, head_lines=0, heading=lambda *page: ())
    assert len(paged.pages) == 1
    assert paged.pages[0].data == program.data.replace(b"LONG", b"LONG_01").replace(b"= 99", b"= 3")


def test_positions_are_numbered_anew_on_demand_and_beyond_what_the_controller_has():
    body = [move(7), move(5, False), move(6), move(9), move(7), move(8)]
    for more in ({"renumber": True}, {"positions": 4}):
        program, paged = split_text(body, lines=6, **more)
        for page in paged.pages:
            places, moves = naive_ls.read(page.data)
            assert sorted(places) == list(range(1, len(places) + 1))
            assert {int(t[2:-1]) for m in moves for t in m.targets} == set(places)
        assert check_join(program, paged.main, pages_of(paged)) == 6
        assert_same_motions(program.data, paged)


@pytest.mark.parametrize("named", [move(8), "  PR[1]=P[8] "])
def test_a_position_that_is_not_there_gets_no_other_ones_number(named):
    body = [move(1), move(2), named, move(3), move(4), move(5), move(6)]
    with pytest.raises(ImpossibleError, match=r"P\[8\] is not in /POS, and positions beyond P\[4\] need new numbers"):
        split_text(body, positions=4, lines=4, places=6)
    assert split_text(body, lines=4, places=6)[1].pages


def test_a_zero_byte_in_a_statement_is_a_byte_like_any_other():
    for mark in ("x", "\0"):
        body = [move(7), move(5, False), f"  CALL A('{mark}',P[5]) ", move(6), move(9), move(7)]
        program, paged = split_text(body, lines=6, renumber=True)
        made = [paged.main, *pages_of(paged).values()]
        assert check_join(program, paged.main, pages_of(paged)) == 5
        if mark == "x":
            wanted = made
    assert b"\0" in b"".join(made)
    assert [page.replace(b"\0", b"x") for page in made] == wanted


def test_new_numbers_stand_where_a_position_is_named_and_nowhere_else():
    body = [
        move(7),
        "  !L P[7] as before ",
        "  //" + move(8),
        "  SKIP[9]=AMP[9] ",
        "l p[ 9 ] 5mm/sec fine ",
        move(6, False),
        move(9),
    ]
    data = text(body).replace(b"   1:", b"1:")
    paged = split_program(ls.loads(data), controller(7), renumber=True)
    assert [bodies(p) for p in paged.pages] == [
        [
            "!page 1 of 2",
            "L P[1] 100mm/sec FINE",
            "!L P[7] as before",
            "//L P[8] 100mm/sec FINE",
            "SKIP[9]=AMP[9]",
            "l p[ 2 ] 5mm/sec fine",
        ],
        ["!page 2 of 2", "L P[ 1 ] 5mm/sec FINE", "L P[2] 100mm/sec CNT100", "L P[1] 100mm/sec FINE"],
    ]
    assert [sorted(naive_ls.read(p.data)[0]) for p in paged.pages] == [[1, 2], [1, 2]]
    assert [line[:5] for line in paged.pages[0].data.split(b"/MN\r\n")[1].split(b"\r\n")[:3]] == [
        b"   1:",
        b"2:L P",
        b"   3:",
    ]


def test_what_differs_is_named_with_both_motions():
    """In a program with a motion that is off, a wrapped one and one to a register."""
    body = [move(1), "  //" + move(2), "C P[3]    \n  P[4] 16mm/sec FINE ", "L PR[3] 10mm/sec FINE ", move(5), move(6)]
    program, paged = split_text(body, lines=6)
    files = pages_of(paged)
    assert read_flow(program).mention.tolist() == [1, 3, 4, 5, 6]
    name = next(p.name for p in paged.pages if b"PR[3]" in p.data)
    assert check_join(program, paged.main, files) == 5
    files[name] = files[name].replace(b"PR[3]", b"PR[4]")
    with pytest.raises(
        JoinError, match=r"motion \d: ExecutedMotion\(letter='L', targets=\('PR\[4\]',\).* instead of .*'PR\[3\]'"
    ):
        check_join(program, paged.main, files)


def test_pages_start_by_a_joint_motion_on_demand():
    _, paged = split_text([move(n) for n in (1, 2, 3, 4, 5)], lines=4, joint_entry=10)
    assert [bodies(p)[1] for p in paged.pages[1:]] == ["J P[3] 10% FINE", "J P[5] 10% FINE"][: len(paged.pages) - 1]


@pytest.mark.parametrize(
    ("last", "start"),
    [
        ("J P[2] 30% FINE ACC50 ", "J P[2] 30% FINE"),
        ("L P[2:there] 2.5sec FINE ", "L P[2:there] 100mm/sec FINE"),
        ("J P[2] 500msec FINE ", "J P[2] 10% FINE"),
        ("L P[2] WELD_SPEED FINE ", "L P[2] 100mm/sec FINE"),
        ("L P[2] 30cm/min FINE TB    .10sec,CALL OPEN ", "L P[2] 30cm/min FINE"),
        ("C P[1]    \n  P[2] 16mm/sec FINE ", "L P[2] 16mm/sec FINE"),
        ("L PR[3] 10mm/sec FINE ", None),
        ("L P[R[3]] 10mm/sec FINE ", None),
        ("L P[2] 10mm/sec FINE INC ", None),
        ("L P[2] 10mm/sec FINE Offset,PR[1] ", None),
        ("L P[2] 10mm/sec FINE Tool_Offset,PR[1] ", None),
        ("L P[2] 10mm/sec FINE Skip,LBL[9] ", None),
    ],
)
def test_a_page_goes_to_where_the_one_before_stopped(last, start):
    body = ["  LBL[9] ", *["  R[1]=1 "] * 3, last, *[move(n, n == 6) for n in (3, 4, 5, 6)]]
    program, paged = split_text(body, lines=7)
    assert len(paged.pages) > 1
    page = next(p for p in paged.pages if p.motions[0] == 1)
    assert bodies(page)[1] == (start or "L P[3] 100mm/sec CNT100")
    assert bool(page.notes) == (start is None)
    assert check_join(program, paged.main, pages_of(paged)) == len(program.motions.line)


# Where it may be cut ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "inside",
    [
        ["  IF R[1]=1 THEN ", move(2), "  ELSE ", move(3), "  ENDIF "],
        ["  FOR R[1]=1 TO 3 ", move(2), move(3), "  ENDFOR "],
        ["  LBL[1:again] ", move(2), "  R[1]=R[1]+1 ", move(3), "  IF R[1]<5,JMP LBL[1] "],
        ["  JMP LBL[4] ", move(2), move(3), "  LBL[4] ", "  R[1]=1 "],
        ["  JMP LBL[R[1]] ", move(2), move(3), "  LBL[5] ", "  R[1]=1 "],
        ["  LOCK PREG ", move(2), move(3), "  UNLOCK PREG ", "  R[1]=1 "],
        [move(1, rest=" Arc Start[1] "), move(2), move(3, rest=" Arc End[1]"), "  R[1]=1 ", "  R[1]=1 "],
        ["  Weave Sine[1] ", move(2), move(3), "  Weave End ", "  R[1]=1 "],
        ["  P[8]=LPOS ", move(2), move(3), move(8, False), "  R[1]=1 "],
        ["  WAIT DI[1]=ON TIMEOUT,\n LBL[7] ", move(2), move(3), "  LBL[7] ", "  R[1]=2 "],
    ],
)
def test_what_belongs_together_stays_on_one_page(inside):
    body = [move(1), move(4), move(5), *inside, move(6), move(7), move(9)]
    program, paged = split_text(body, lines=10)
    assert len(paged.pages) > 1
    flat = [" ".join(s.split()) for s in inside]
    holders = [p for p in paged.pages if flat[0] in [" ".join(s.split()) for s in bodies(p)]]
    assert len(holders) == 1
    texts = [" ".join(s.split()) for s in bodies(holders[0])]
    start = texts.index(flat[0])
    assert texts[start : start + len(flat)] == flat
    assert check_join(program, paged.main, pages_of(paged)) == len(program.motions.line)


@pytest.mark.parametrize("written", ["P[8]=LPOS", "P[8,3]=R[2]", "IF DI[1],P[8:a b] =LPOS"])
def test_no_page_starts_at_a_position_that_is_written_at_run_time(written):
    body = [move(1), f"  {written} ", move(2), move(8), move(3), move(4, False)]
    may = read_flow(ls.loads(text(body))).may_split_after
    assert may.tolist() == [True, False, False, False, True, False]


def test_an_arc_of_a_motions_is_not_cut():
    body = [move(1), move(2, letter="A"), move(3, letter="A"), move(4, letter="A"), move(5), move(6)]
    may = read_flow(ls.loads(text(body))).may_split_after
    assert may.tolist() == [False, False, False, True, True, False]


def test_after_an_end_there_is_no_other_page():
    body = [move(1), move(2), "  IF DI[1],JMP LBL[1] ", move(3), "  END ", "  LBL[1] ", move(4), move(5), move(6)]
    may = read_flow(ls.loads(text(body))).may_split_after
    assert may.tolist() == [True, True, False, False, False, False, False, False, False]


def test_only_stops_are_cut():
    body = [
        move(1, False), move(2, rest=" TA    .20sec,DO[1]=ON "), "  //" + move(3), "  !L P[1] 5mm/sec FINE ",
        "L P[4] 5mm/sec CNT R[1] ", move(5), "  DO[1]=ON ", move(6), "  CALL DONE ",
    ]  # fmt: skip
    may = read_flow(ls.loads(text(body))).may_split_after
    assert [i for i, ok in enumerate(may) if ok] == [5]


def test_each_motion_has_the_frames_that_were_set_last():
    body = [
        move(1),
        "  UFRAME_NUM=2 ",
        move(2),
        move(3),
        "  UTOOL_NUM=3 ",
        "  UFRAME_NUM=4 ",
        move(4),
        "  UTOOL_NUM=5 ",
    ]
    sequence = motion_sequence(ls.loads(text(body)), {"UTOOL_NUM": "1"})
    frames = [dict(sequence.motion(i).frames) for i in range(4)]
    both = [("1", None), ("1", "2"), ("1", "2"), ("3", "4")]
    assert [(f.get("UTOOL_NUM"), f.get("UFRAME_NUM")) for f in frames] == both
    assert sequence.frames == {"UTOOL_NUM": "5", "UFRAME_NUM": "4"}


def test_point_logic_goes_with_its_motion():
    data = text([move(1), move(2, rest=" TB    .10sec,P-SPS "), move(3), move(4)])
    listing = b"   1:  DO[8]=ON ;\r\n   2:L P[9] 14mm/sec FINE    ;\r\n     ------\r\n   3:L P[3]"
    data = data.replace(b"   3:L P[3]", listing)
    program = ls.loads(data)
    flow = read_flow(program)
    assert flow.may_split_after.tolist() == [True, True, True, False]
    assert len(flow.line) == 4
    paged = split_program(program, controller(6))
    assert any(b"   1:  DO[8]=ON ;\r\n   2:L P[9] 14mm/sec FINE    ;\r\n     ------\r\n" in p.data for p in paged.pages)
    holder = next(p for p in paged.pages if b"P-SPS" in p.data)
    assert 9 in naive_ls.read(holder.data)[0]


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ([move(1), *[move(2, False)] * 9], r"line 10 to line 14 .*no motion between them stops"),
        (["  FOR R[1]=1 TO 2 ", *[move(2)] * 9, "  ENDFOR "], r"inside IF, FOR"),
        ([move(1), "  R[2]=AR[1] ", *[move(2)] * 9], r"line 10: AR\[\] is known to this program only"),
        ([move(1), "L P[2] AR[1]mm/sec FINE ", *[move(2)] * 9], r"line 10: AR\[\]"),
        (["  IF DI[1],OFFSET CONDITION PR[1] ", *[move(2)] * 9], "a condition in force"),
        (["  OFFSET CONDITION PR[1] ", "  PR[1]=LPOS ", *[move(2)] * 9], "a condition in force"),
        (["  OFFSET CONDITION PR[1] ", "  CALL OTHER ", *[move(2)] * 9], "a condition in force"),
        (["  OFFSET CONDITION PR[1] ", "  IF (R[1]=3),PR[1]=PR[4] ", *[move(2)] * 9], "a condition in force"),
        (
            ["  OFFSET CONDITION PR[1] ", move(1, rest=" Skip,LBL[1],PR[1]=LPOS"), "  LBL[1] ", *[move(2)] * 8],
            "in force",
        ),
    ],
)
def test_what_cannot_be_split_is_refused_with_its_line(body, message):
    with pytest.raises(ImpossibleError, match=message) as caught:
        split_text(body, lines=6)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("limit", "line", "holds"),
    [
        ({"lines": 2}, 10, "2 lines, 50 positions"),
        ({"positions": 1}, 10, "12 lines, 1 positions"),
        ({"memory": 600}, 9, ""),
    ],
)
def test_a_line_that_is_more_than_a_page_holds_is_named_with_what_a_page_holds(limit, line, holds):
    with pytest.raises(ImpossibleError, match=rf"line {line} alone is more than a page holds \({holds}"):
        split_text([move(1), move(2)] * 9, **limit)


# What is in force ------------------------------------------------------------------------------------------------


def test_what_is_in_force_is_repeated_and_only_that():
    body = ["  UFRAME_NUM=2 ", "  UFRAME_NUM=1 ", "  PAYLOAD[1] ", "  SKIP CONDITION DI[1]=ON ", move(1), move(2)]
    body += ["  PAYLOAD[3] ", move(3), move(4), move(5)]
    _, paged = split_text(body, lines=8)
    assert bodies(paged.pages[1])[1:5] == [
        "UFRAME_NUM=1",
        "PAYLOAD[1]",
        "SKIP CONDITION DI[1]=ON",
        "L P[2] 100mm/sec FINE",
    ]
    assert [s for s in bodies(paged.pages[2]) if "PAYLOAD" in s] == ["PAYLOAD[3]"]


@pytest.mark.parametrize(
    ("body", "why"),
    [
        (["  UFRAME_NUM=1 ", "  CALL OTHER ", move(1), move(2), move(3)], "line 10 calls a program"),
        (["  IF DI[1],UFRAME_NUM=1 ", move(1), move(2), move(3)], "line 9 sets it on a condition"),
        (["  IF DI[1] THEN ", "  UFRAME_NUM=1 ", "  ENDIF ", move(1), move(2)], "line 10 sets it on a condition"),
        (["  UFRAME_NUM=R[1] ", "  R[1]=5 ", move(1), move(2), move(3)], "line 10 may change the register"),
        (["  UFRAME_NUM=2 ", move(1), move(2), move(3)], "line 10 goes to a position in another frame"),
        (["  UFRAME_NUM=1 ", move(1, rest=" TB .10sec,CALL GRIP"), move(2), move(3)], "UM: line 10 calls a program"),
        (["  UFRAME_NUM=1 ", "  GRIP_OPEN ", move(1), move(2), move(3)], "line 10 calls a program"),
        (["  UFRAME_NUM=1 ", "  PAYLOAD[2] ", "  Hand 1 Close ", move(1), move(2)], "PAYLOAD: line 11 calls a program"),
        (["  UFRAME_NUM=R[5] ", "  IF (R[1]=3),R[5]=(2) ", move(1), move(2)], "line 10 may change the register"),
        (["  UFRAME_NUM=R[5] ", "  IF R[1]=R[2],R[5]=2 ", move(1), move(2)], "line 10 may change the register"),
        (["  UFRAME_NUM=1 ", "  UFRAME_NUM[GP1]=R[2] ", "  R[2]=5 ", move(1)], "line 11 may change the register"),
    ],
)
def test_a_frame_that_is_not_sure_is_left_to_the_page_before(body, why):
    _, paged = split_text([*body, move(4), move(5)], lines=5)
    later = [p for p in paged.pages if p.motions[0] > 0]
    assert later
    for page in later:
        assert not any("UFRAME_NUM" in s for s in bodies(page))
        assert any(why in note for note in page.notes)


def test_a_frame_from_a_register_nobody_changes_is_repeated():
    body = ["  UFRAME_NUM=R[1] ", "  R[2]=5 ", "  SOFTFLOAT[1] ", move(1, rest=" ACC R[1] TB .10sec,DO[1]=ON")]
    _, paged = split_text([*body, move(2), move(3), move(4)], lines=7)
    assert bodies(paged.pages[1])[1] == "UFRAME_NUM=R[1]"


def test_a_condition_that_is_looked_at_all_the_time_is_repeated():
    _, paged = split_text(["  SKIP CONDITION R[1]=1 ", "  R[1]=5 ", *[move(n) for n in (1, 2, 3, 4)]], lines=6)
    assert bodies(paged.pages[1])[1] == "SKIP CONDITION R[1]=1"


def test_frames_of_two_groups_are_two_settings():
    program = ls.loads(text(["  UFRAME_NUM[GP1]=1 ", "  UFRAME_NUM[GP2]=4 ", move(1), move(2)]))
    flow = read_flow(program)
    again, unsure = read_modal_state(program, flow).at(2)
    assert again == [0, 1]
    assert unsure == []


def test_a_frame_holds_up_to_the_call_that_may_change_it():
    program = ls.loads(text(["  UFRAME_NUM=1 ", move(1), move(2), "  CALL OTHER ", move(3)]))
    state = read_modal_state(program, read_flow(program))
    assert [state.at(unit)[0] for unit in range(5)] == [[0], [0], [0], [], []]


# Sizes, names, loads ---------------------------------------------------------------------------------------------


def test_a_last_line_without_an_end_is_a_line():
    assert line_count([]) == 0
    assert line_count([b"   1:  ;\n    :  ;\n", b"   2:  ;\n"]) == 3
    assert line_count([b"   1:  ;\r\n", b"   2:  ;"]) == 2


def naive_size(data):
    """Lines of /MN, positions, and bytes by the documented rule for programs of usual motions and remarks."""
    parts = naive_ls.sections(naive_ls.lines_of(data.decode("latin-1")))
    lines = [line for line in parts["MN"] if line.strip()]
    moves = [line for line in lines if re.match(r"\s*\d*:[JLCA] P\[", line)]
    other = [line for line in lines if line not in moves]
    places = naive_ls.read(data)[0]
    return len(lines), len(places), 400 + 35 * len(places) + 28 * len(moves) + sum(len(o) + 2 for o in other)


@settings(max_examples=150, deadline=None)
@given(
    st.lists(st.tuples(st.integers(1, 9), st.booleans()), min_size=1, max_size=60),
    st.integers(4, 20),
    st.integers(2, 9),
)
def test_sizes_are_what_was_written_and_pages_are_as_few_as_can_be(rows, lines, positions):
    body = [move(n, stop) for n, stop in rows]
    program = ls.loads(text(body))
    capacity = controller(lines, positions)
    whole = program_size(program)
    assert (whole.lines, whole.memory) == (naive_size(program.data)[0], naive_size(program.data)[2])
    least = fewest([stop for _, stop in rows], [n for n, _ in rows], lines, positions)
    if least is None:
        with pytest.raises(ImpossibleError):
            split_program(program, capacity)
        return
    paged = split_program(program, capacity)
    assert len(paged.pages) == least
    for page in paged.pages:
        assert (page.size.lines, page.size.positions, page.size.memory) == naive_size(page.data)
        assert page.size.within(capacity)
    assert_same_motions(program.data, paged)
    assert check_join(program, paged.main, pages_of(paged)) == len(rows)


def fewest(stops, places, lines, positions):
    """By trying every way to cut, the fewest pages."""
    N = len(stops)
    best: list[int | None] = [0] + [None] * N
    for end in range(1, N + 1):
        for start in range(end):
            entry = [places[start - 1]] if start else []
            used = {*entry, *places[start:end]}
            fits = 1 + len(entry) + end - start <= lines and len(used) <= positions
            cut = start == 0 or stops[start - 1]
            before, least = best[start], best[end]
            if fits and cut and before is not None and (least is None or before + 1 < least):
                best[end] = before + 1
    return best[N]


@pytest.mark.parametrize(
    ("name", "count", "length", "taken", "names"),
    [
        ("LONG", 2, 12, (), ("LONG_01", "LONG_02")),
        ("OPTIC_SPIRAL", 2, 8, (), ("OPTIC_01", "OPTIC_02")),
        ("OPTIC_01", 2, 8, (), ("OPTI_01", "OPTI_02")),
        ("LONG", 2, 12, ("long_02",), ("LON_01", "LON_02")),
        ("A", 120, 8, (), None),
        ("-X", 1, 8, (), ("-X_01",)),
    ],
)
def test_names_differ_after_trimming(name, count, length, taken, names):
    unique_names = page_names(name, count, length, taken)
    assert names is None or unique_names == names
    assert len({n.upper() for n in (*unique_names, *taken, name[:length])}) == count + len(taken) + 1
    assert max(map(len, unique_names)) <= length


def test_no_name_left_is_refused():
    with pytest.raises(InputError, match="no name of their own"):
        page_names("A", 2, 8, ("A_01",))


def test_names_of_called_programs_are_taken():
    body = [move(1), "  CALL LONG_01 ", move(2), move(3), move(4, rest=" TB .10sec,CALL LON_01")]
    _, paged = split_text(body, lines=4)
    assert not {"LONG_01", "LON_01", "LONG"} & {p.name for p in paged.pages}


def test_no_load_is_a_byte_beyond_the_memory_and_none_begins_early():
    """Around where the memory holds two pages: one is loaded apart only where both would leave less than 40 bytes."""
    body, counts = ["  UFRAME_NUM=1 ", "  PAYLOAD[1] ", *(move(n % 9 + 1) for n in range(60))], set()
    for memory in range(2800, 3200, 10):
        _, paged = split_text(body, lines=14, memory=float(memory))
        main = 400 + sum(len(p.name) + 50 for p in paged.pages)
        loads = [0.0] * (paged.load_count + 1)
        for page in paged.pages:
            if not loads[page.load]:
                assert page.load == 1 or loads[page.load - 1] + page.size.memory + main > memory - 40
            loads[page.load] += page.size.memory
        assert max(loads) + main <= memory
        counts.add(paged.load_count)
    assert counts == {3, 5, 6}


def test_beyond_the_memory_pages_come_in_loads():
    program, paged = split_text([move(n % 9 + 1) for n in range(60)], lines=12, memory=2600.0)
    assert paged.load_count > 2
    main = 400 + sum(len(p.name) + 50 for p in paged.pages)
    for load in range(1, paged.load_count + 1):
        assert sum(p.size.memory for p in paged.pages if p.load == load) + main <= 2600
    assert [p.load for p in paged.pages] == sorted(p.load for p in paged.pages)
    texts = [s for s in bodies(type("Main", (), {"data": paged.main})) if not s.startswith("CALL")]
    waits = [[f"MESSAGE[LOAD {n} OF {paged.load_count}]", "PAUSE"] for n in range(2, paged.load_count + 1)]
    assert texts == [s for pair in waits for s in pair]
    assert called_pages(paged.main) == tuple(p.name for p in paged.pages)
    assert check_join(program, paged.main, pages_of(paged)) == 60


# Any program -----------------------------------------------------------------------------------------------------

OPTIONS = st.sampled_from(["", " ACC50 ", " INC ", " Offset,PR[2] ", " PTH "])
OTHERS = [
    *("  UFRAME_NUM=1 ", "  UTOOL_NUM=1 ", "  UFRAME_NUM=R[3] ", "  PAYLOAD[2] ", "  SKIP CONDITION DI[1]=ON "),
    *(
        "  DO[1]=ON ",
        "  CALL SUB(1) ",
        "  R[3]=P[4] ",
        "  PR[1]=LPOS ",
        "A P[3] 5mm/sec FINE ",
        "L PR[2] 50mm/sec FINE ",
    ),
    *("  !L P[1] 5mm/sec FINE ", "  //L P[2] 5mm/sec FINE ", "  !wrapped and\n  L P[3] 5mm/sec FINE "),
]
NUMBERS = st.integers(1, 9)
LEAVES = st.one_of(
    st.builds(move, NUMBERS, st.booleans(), OPTIONS),
    st.builds(lambda n: move(n, letter="J", speed="20%"), NUMBERS),
    st.builds("C P[{}]    \n  P[{}] 16mm/sec {} ".format, NUMBERS, NUMBERS, st.sampled_from(["FINE", "CNT5"])),
    st.sampled_from(OTHERS),
)


def nested(children):
    many = st.lists(children, max_size=4).map(lambda parts: [s for part in parts for s in part])
    return st.one_of(
        many,
        many.map(lambda inner: ["  IF R[1]=1 THEN ", *inner, "  ENDIF "]),
        many.map(lambda inner: ["  FOR R[2]=1 TO 3 ", *inner, "  ENDFOR "]),
        st.tuples(st.integers(1, 4), many).map(lambda t: [f"  LBL[{t[0]}] ", *t[1], f"  JMP LBL[{t[0]}] "]),
    )


PROGRAMS = st.lists(st.recursive(LEAVES.map(lambda s: [s]), nested, max_leaves=12), min_size=1, max_size=25).map(
    lambda parts: [s for part in parts for s in part]
)


@settings(max_examples=400, deadline=None)
@given(PROGRAMS, st.integers(5, 25), st.booleans(), st.booleans(), st.sampled_from(["\r\n", "\n"]))
def test_pages_of_any_program_drive_what_it_drives(body, lines, renumber, numbered, end):
    data = text(body, numbered=numbered, end=end)
    program = ls.loads(data)
    try:
        paged = split_program(program, controller(lines), renumber=renumber)
    except ImpossibleError as refused:
        assert re.search(r"line \d+", str(refused))  # noqa: PT017
        return
    assert_same_motions(data, paged)
    assert check_join(program, paged.main, pages_of(paged)) == len(naive_ls.driven(data))
    if renumber:
        return
    whole = [plain(s) for s in statements(data)]
    at = 0
    for k, page in enumerate(paged.pages):
        texts = [plain(s) for s in statements(page.data)]
        own = next(n for n in range(len(texts), -1, -1) if texts[len(texts) - n :] == whole[at : at + n])
        at += own
        assert page.size.lines <= lines
        if k + 1 < len(paged.pages):
            assert_split_well(whole[:at], whole[at:])
    assert at == len(whole)


def statements(data):
    return naive_ls.statements(naive_ls.sections(naive_ls.lines_of(data.decode("latin-1")))["MN"])


def plain(statement):
    return " ".join(statement.split())


def assert_split_well(before, after):
    """The rules again, naively."""
    real = [s for s in before if not s.startswith(("!", "//"))]
    assert sum(s.startswith("IF ") for s in real) == sum(s == "ENDIF" for s in real)
    assert sum(s.startswith("FOR ") for s in real) == sum(s == "ENDFOR" for s in real)
    labels = [set(re.findall(r"LBL\[(\d+)", " ".join(part))) for part in (before, after)]
    assert not labels[0] & labels[1]
    assert " FINE" in before[-1]
    moves = [s for s in after if re.match(r"[JLCA] P", s)]
    assert moves
    assert moves[0][0] != "A"


# The proof can fail ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"X =   103.000", b"X =   103.001"),
        (b"L P[4] 100mm/sec CNT100", b"L P[4] 101mm/sec CNT100"),
        (b"L P[4] 100mm/sec CNT100", b"L P[4] 100mm/sec FINE"),
        (b"L P[4] 100mm/sec CNT100", b"L P[3] 100mm/sec CNT100"),
        (b"L P[4] 100mm/sec CNT100    ;", b"//L P[4] 100mm/sec CNT100    ;"),
        (b"UFRAME_NUM=1", b"UFRAME_NUM=2"),
        (b"CONFIG : 'N U T, 0, 0, 0'", b"CONFIG : 'N U T, 0, 0, 1'"),
    ],
)
def test_a_changed_page_is_found(old, new):
    body = ["  UFRAME_NUM=1 ", move(1), move(2), move(3), move(4, False), move(5)]
    program, paged = split_text(body, lines=6)
    files = pages_of(paged)
    last = paged.pages[-1].name
    assert old in files[last]
    files[last] = files[last].replace(old, new)
    with pytest.raises(CompgenError):
        check_join(program, paged.main, files)


def test_pages_in_another_order_or_missing_are_found():
    program, paged = split_text([move(n) for n in (1, 2, 3, 4, 5, 6)], lines=4)
    files = pages_of(paged)
    a, b = (p.name.encode() for p in paged.pages[:2])
    swapped = (
        paged.main.replace(b"CALL " + a, b"CALL X").replace(b"CALL " + b, b"CALL " + a).replace(b"CALL X", b"CALL " + b)
    )
    with pytest.raises(JoinError):
        check_join(program, swapped, files)
    with pytest.raises(JoinError, match="not there"):
        check_join(program, paged.main, {})
    with pytest.raises(JoinError, match="of 6 are driven"):
        check_join(program, paged.main.replace(b"CALL " + paged.pages[-1].name.encode(), b"PAUSE"), files)
    with pytest.raises(JoinError, match="not a call"):
        called_pages(paged.main.replace(b"CALL " + a, b"JMP LBL[1]"))
    with pytest.raises(JoinError, match="twice"):
        called_pages(paged.main.replace(b"CALL " + a, b"CALL " + b))


# Programs of other people ----------------------------------------------------------------------------------------

SAMPLES = ROOT.parent / "shared" / "fanuc" / "samples"
FOUND = [
    *sorted((ROOT / "tests" / "golden").glob("*.LS")),
    *sorted(p for p in SAMPLES.rglob("*.[lL][sS]") if p.is_file() and b"/PROG" in p.read_bytes()[:20]),
]


@pytest.mark.parametrize("path", FOUND, ids=lambda p: p.name)
def test_a_program_of_others_is_split_rightly_or_refused_with_its_line(path):
    program = ls.loads(path.read_bytes())
    whole = program_size(program)
    for share in (0.2, 0.5, 0.9, 2.0):
        capacity = Capacity(max(6, int(whole.lines * share)), max(2, int(whole.positions * share)), 1e6, 16)
        try:
            paged = split_program(program, capacity)
        except ImpossibleError as refused:
            assert re.search(r"line \d+", str(refused))  # noqa: PT017
            continue
        assert check_join(program, paged.main, pages_of(paged)) == len(naive_ls.driven(program.data))
        assert_same_motions(program.data, paged)
        assert all(p.size.within(capacity) for p in paged.pages)
        assert len(paged.pages) == 1 or share < 1
