"""Text and meaning of FANUC programs."""

import re
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from compgen import fanuc as ls
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.rotations import from_wpr, rotation_matrix, to_wpr
from compgen.core.units import DEG, MM
from compgen.fanuc.canonical import reader
from compgen.pipelines.files.program_course import course_of_text
from compgen.program.digits import pose_numbers, printed_poses
from compgen.program.frames import default_frames
from compgen.program.program import Program, program_name
from compgen.program.speeds import parse_speed, speed_text
from compgen.robot.configuration import apply_turns, config_letters, postures_of, turn_digits
from compgen.robot.inverse_kinematics import ALL_POSTURES, Posture

GOLDEN = """/PROG  DEMO
/ATTR
OWNER\t\t= MNEDITOR;
COMMENT\t\t= "compgen 01234567";
PROG_SIZE\t= 0;
CREATE\t\t= DATE 26-01-01  TIME 00:00:00;
MODIFIED\t= DATE 26-01-01  TIME 00:00:00;
FILE_NAME\t= ;
VERSION\t\t= 0;
LINE_COUNT\t= 6;
MEMORY_SIZE\t= 0;
PROTECT\t\t= READ_WRITE;
TCD:  STACK_SIZE\t= 0,
      TASK_PRIORITY\t= 50,
      TIME_SLICE\t= 0,
      BUSY_LAMP_OFF\t= 0,
      ABORT_REQUEST\t= 0,
      PAUSE_REQUEST\t= 0;
DEFAULT_GROUP\t= 1,*,*,*,*;
CONTROL_CODE\t= 00000000 00000000;
/MN
   1:  !one remark ;
   2:  UFRAME_NUM=0 ;
   3:  UTOOL_NUM=1 ;
   4:J P[1] 10% FINE    ;
   5:L P[2] 200mm/sec CNT100    ;
   6:L P[3] 125cm/min FINE    ;
/POS
P[1]{
   GP1:
\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',
\tX =  1350.000  mm,\tY =   -30.000  mm,\tZ =   203.000  mm,
\tW =   180.000 deg,\tP =     0.000 deg,\tR =     0.000 deg
};
P[2]{
   GP1:
\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',
\tX =  1350.123  mm,\tY =     0.000  mm,\tZ =   203.000  mm,
\tW =   180.000 deg,\tP =     0.000 deg,\tR =     0.000 deg
};
P[3]{
   GP1:
\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, -1, 1',
\tX = -1350.000  mm,\tY =     0.001  mm,\tZ =   203.000  mm,
\tW =   180.000 deg,\tP =     0.000 deg,\tR =     0.000 deg
};
/END
""".replace("\n", "\r\n").encode()


def demo():
    return Program(
        name="DEMO",
        comment="compgen 01234567",
        date="26-01-01",
        remarks=("one remark",),
        uframe=0,
        utool=1,
        position=np.array([[1350, -30, 203], [1350.1234, -1e-7, 203], [-1350, 0.0006, 203]]) * MM,
        rotation=np.tile(np.diag([1.0, -1.0, -1.0]), (3, 1, 1)),
        posture=Posture(),
        turns=np.array([[0, 0, 0], [0, 0, 0], [0, -1, 1]]),
        speed=np.array([0.2, 125 * 0.01 / 60]),
        fine=np.array([True, False, True]),
        via=np.zeros(3, dtype=bool),
    )


def test_text_is_the_golden_text():
    assert ls.compose(demo()) == GOLDEN


def test_reading_gives_the_meaning_back():
    back = ls.interpret(GOLDEN)
    assert (back.name, back.comment, back.date, back.remarks, back.uframe, back.utool) == (
        "DEMO", "compgen 01234567", "26-01-01", ("one remark",), 0, 1,
    )  # fmt: skip
    assert_allclose(back.position, demo().position, atol=0.5e-6)
    assert_allclose(back.rotation, demo().rotation, atol=1e-12)
    assert_allclose(back.speed, demo().speed)
    assert back.fine.tolist() == [True, False, True]
    assert back.turns.tolist() == [[0, 0, 0], [0, 0, 0], [0, -1, 1]]
    assert ls.compose(back) == GOLDEN


@pytest.mark.parametrize(("payload", "acc"), [(1, None), (None, 100), (10, 7)])
def test_payload_and_acc_are_written_and_read_back(payload, acc):
    """In columns and in lines, each alone and both."""
    text = ls.compose(replace(demo(), payload=payload, acc=acc))
    statements = re.findall(rb"^ *\d+:(.*?) *;\r$", text, re.MULTILINE)
    assert [s.strip() for s in statements if b"PAYLOAD" in s] == ([b"PAYLOAD[%d]" % payload] if payload else [])
    motions = [s for s in statements if s[:1] in b"JL"]
    assert len(motions) == 3
    for statement, plain in zip(motions, [s for s in re.findall(rb":([JL].*?) *;", GOLDEN)], strict=True):
        assert statement == (plain + b" ACC%d" % acc if acc else plain)
    back = ls.interpret(text)
    assert (back.payload, back.acc) == (payload, acc)
    assert ls.compose(back) == text
    by_lines = ls.interpret(text.replace(b"\r\n", b"\n"))
    assert (by_lines.payload, by_lines.acc) == (payload, acc)
    plain = ls.interpret(GOLDEN)
    assert (plain.payload, plain.acc) == (None, None)


def test_motions_of_several_accs_are_refused():
    text = ls.compose(replace(demo(), acc=50))
    for old, new in (
        (b"FINE ACC50", b"FINE"),
        (b"CNT100 ACC50", b"CNT100 ACC49"),
        (b"L P[3] 125cm/min FINE ACC50", b"L P[3] 125cm/min FINE ACC5"),
    ):
        assert old in text
        with pytest.raises(InputError, match="differ in their ACC"):
            ls.interpret(text.replace(old, new, 1))


@pytest.mark.parametrize("word", [b"CNT50", b"CNT0", b"CNT99", b"cnt75"])
def test_a_slower_corner_is_no_canonical_text_and_keeps_its_words_in_the_course(word, robot):
    """CNT n < 100 waits behind its corner: a record that knows stops and CNT100 alone cannot say so."""
    text = ls.compose(replace(demo(), utool=0)).replace(b"CNT100", word, 1)
    assert word in text
    with pytest.raises(InputError, match="FINE or CNT100"):
        ls.interpret(text)
    kept = course_of_text(text, robot, default_frames()).kept
    assert kept.tolist() == [0, int(word[3:]) / 100, 0]


@settings(max_examples=150, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 40),
    st.sampled_from(ALL_POSTURES),
    st.lists(st.sampled_from(["mm", "cm", "inch"]), min_size=1, max_size=3),
)
def test_write_read_write_is_stable(seed, count, posture, units):
    rng = np.random.default_rng(seed)
    steps = {"mm": 1e-3, "cm": 0.01 / 60, "inch": 0.00254 / 60}
    speed = np.array([rng.integers(1, 2000) * steps[units[i % len(units)]] for i in range(count - 1)])
    program = replace(
        demo(),
        position=rng.uniform(-3, 3, (count, 3)),
        rotation=rotation_matrix(rng.normal(size=(count, 3))),
        posture=posture,
        turns=rng.integers(-2, 3, (count, 3)),
        speed=speed,
        fine=rng.random(count) < 0.5 if count > 1 else np.array([True]),
        via=np.zeros(count, dtype=bool),
    )
    if not program.fine[0]:
        program = replace(program, fine=np.concatenate([[True], program.fine[1:]]))
    text = ls.compose(program)
    back = ls.interpret(text)
    assert ls.compose(back) == text
    assert np.abs(back.position - program.position).max() <= 0.5e-6 + 1e-12
    turn = np.linalg.norm(back.rotation - program.rotation, axis=(1, 2)).max()
    assert turn < 3 * 0.5e-3 * DEG * np.sqrt(2)
    assert np.abs(back.speed / program.speed - 1).max(initial=0) < 0.006
    assert b"-0.000" not in text
    assert max(len(line) for line in text.split(b"\r\n")) < 128


def naive_text(program):
    """The same text, one line after the other."""
    numbers = pose_numbers(program.position, program.rotation).tolist()
    out = [GOLDEN.decode().split("/MN")[0].replace("LINE_COUNT\t= 6", f"LINE_COUNT\t= {3 + len(numbers)}"), "/MN\r\n"]
    out += ["   1:  !one remark ;\r\n   2:  UFRAME_NUM=0 ;\r\n   3:  UTOOL_NUM=1 ;\r\n   4:J P[1] 10% FINE    ;\r\n"]
    for n, (speed, fine) in enumerate(zip(program.speed.tolist(), program.fine[1:].tolist(), strict=False), 2):
        out.append(f"{n + 3:4d}:L P[{n}] {speed_text(speed)} {'FINE' if fine else 'CNT100'}    ;\r\n")
    out.append("/POS\r\n")
    for n, (row, (a, b, c)) in enumerate(zip(numbers, program.turns.tolist(), strict=True), 1):
        x, y, z, w, p, r = (f"{v:9.3f}" for v in row)
        config = f"{config_letters(program.posture)}, {a}, {b}, {c}"
        out.append(
            f"P[{n}]{{\r\n   GP1:\r\n\tUF : 0, UT : 1,\t\tCONFIG : '{config}',"
            f"\r\n\tX = {x}  mm,\tY = {y}  mm,\tZ = {z}  mm,\r\n\tW = {w} deg,\tP = {p} deg,\tR = {r} deg\r\n}};\r\n"
        )
    return ("".join(out) + "/END\r\n").encode()


def many(count, seed):
    rng = np.random.default_rng(seed)
    return replace(
        demo(),
        position=rng.uniform(-3, 9.9, (count, 3)) * 10.0 ** rng.integers(-6, 1, (count, 1)),
        rotation=rotation_matrix(rng.normal(size=(count, 3))),
        turns=rng.integers(-12, 13, (count, 3)),
        speed=rng.choice([0.02, 0.2, 125 * 0.01 / 60, 0.00254], count - 1),
        fine=np.concatenate([[True], rng.random(count - 1) < 0.3]),
        via=np.zeros(count, dtype=bool),
    )


@pytest.mark.parametrize(("count", "seed"), [(2, 0), (9, 1), (10, 2), (1001, 3), (20_000, 4)])
def test_columns_write_what_lines_write(count, seed):
    program = many(count, seed)
    assert ls.compose(program) == naive_text(program)


def test_columns_read_what_lines_read():
    from compgen.fanuc.canonical import reader

    text = ls.compose(many(300, 5))
    quick = reader.read_columns(text)
    assert quick is not None
    slow = ls.interpret(text.replace(b" 200mm/sec", b" 200.mm/sec", 1))  # not as we write it: read line by line
    assert_allclose(quick.position, slow.position, atol=1e-12)
    assert_allclose(quick.rotation, slow.rotation, atol=1e-12)
    for field in ("turns", "speed", "fine"):
        assert np.array_equal(getattr(quick, field), getattr(slow, field)), field


CHARACTERS = b"0123456789 -.+\r\n\t]};:',=/XYZWPRLJFNUDTBCmdeg%\x00\xb2\x85\x0b"


def wounded(text, rng):
    """A text with up to three characters changed, lost, put in, swapped or said twice, mostly behind its head."""
    text = bytearray(text)
    for _ in range(rng.integers(1, 4)):
        low = 0 if rng.random() < 0.2 else text.find(b"/MN") + 1
        a, b = (int(place) for place in rng.integers(low, len(text), 2))
        character = CHARACTERS[rng.integers(len(CHARACTERS))]
        kind = rng.random()
        if kind < 0.6:
            text[a] = character
        elif kind < 0.7:
            del text[a]
        elif kind < 0.8:
            text.insert(a, character)
        elif kind < 0.9:
            text[a], text[b] = text[b], text[a]
        else:
            text[a:a] = text[b : b + 40]
    return bytes(text)


@pytest.mark.parametrize(("count", "decimals"), [(2, 3), (3, 4), (12, 3), (11, 6)])
def test_columns_never_read_what_lines_do_not(count, decimals, monkeypatch):
    """Wounded programs are left to the careful reader, or mean the same to the last bit."""
    from compgen.fanuc.canonical import reader

    rng = np.random.default_rng(count)
    text = ls.compose(replace(many(count, count), decimals=decimals))
    texts = [text, *(wounded(text, rng) for _ in range(1500))]
    quick = [reader.read_columns(t) for t in texts]
    assert quick[0] is not None
    assert 20 < sum(q is not None and t != text for q, t in zip(quick, texts, strict=True)) < 500
    monkeypatch.setattr(reader, "read_columns", lambda data: None)
    for found, data in zip(quick, texts, strict=True):
        if found is not None:
            careful = ls.interpret(data)
            for field in fields(Program):
                a, b = getattr(found, field.name), getattr(careful, field.name)
                same = a.tobytes() == b.tobytes() and a.dtype == b.dtype if isinstance(a, np.ndarray) else a == b
                assert same, (field.name, data)


def test_columns_are_shared_out_with_the_same_meaning():
    from compgen.core import evaluation
    from compgen.fanuc.canonical import reader

    text = ls.compose(many(20_000, 7))
    alone = ls.interpret(text)
    evaluation.configure(None, 3)
    try:
        assert ls.compose(many(20_000, 7)) == text
        shared = reader.read_columns(text)
    finally:
        evaluation.configure(None)
    assert shared is not None
    for name in ("position", "rotation", "turns", "speed", "fine"):
        assert np.array_equal(getattr(alone, name), getattr(shared, name)), name


def test_neighbours_that_share_their_sines_turn_as_each_alone():
    from compgen.program import digits

    t = np.arange(5000)
    rotation = from_wpr(np.pi + 0.003 * np.sin(t / 40), 0.002 * np.cos(t / 40), -0.003 * np.sin(t / 60))
    units = digits.pose_units(np.zeros((5000, 3)), to_wpr(rotation), slice(0, 4000), 3)
    assert 0 < (units[3] < 0).sum() < 4000
    assert np.ptp(np.abs(units[3:]), axis=1).max() < 2000
    numbers = pose_numbers(np.zeros((5000, 3)), rotation)
    turned = printed_poses(Pose(np.zeros((5000, 3)), rotation)).rotation
    assert turned.tobytes() == from_wpr(*(numbers[:, 3:] * DEG).T).tobytes()
    every = np.arange(1, 180_001) / 1000 * DEG
    assert np.array_equal(np.sin(-every), -np.sin(every))
    assert np.array_equal(np.cos(-every), np.cos(every))


def test_numbers_beyond_nine_characters_are_refused():
    for far in (100.0, -10.0):
        with pytest.raises(InputError, match="nine characters"):
            ls.compose(replace(demo(), position=np.full((3, 3), far)))
    ls.compose(replace(demo(), position=np.full((3, 3), 99.999)))
    ls.compose(replace(demo(), position=np.full((3, 3), -9.999)))


def test_a_naive_reader_sees_the_same_numbers():
    """Line by line, no shared code."""
    rng = np.random.default_rng(9)
    program = replace(demo(), position=rng.uniform(-2, 2, (3, 3)), rotation=rotation_matrix(rng.normal(size=(3, 3))))
    numbers: list[list[float]] = []
    current: list[float] = []
    for line in ls.compose(program).decode().split("\r\n"):
        if line.startswith("P["):
            current = []
        for part in line.split(","):
            found = re.match(r"\s*([XYZWPR]) =\s*(-?[0-9.]+)\s+(mm|deg)$", part)
            if found:
                current.append(float(found.group(2)))
        if line == "};":
            numbers.append(current)
    assert_allclose(np.array(numbers), pose_numbers(program.position, program.rotation), atol=1e-12)


@pytest.mark.parametrize(
    ("speed_mm_s", "text"),
    [
        (200, "200mm/sec"), (20, "20mm/sec"), (2.5, "15cm/min"), (0.5, "3cm/min"), (1.27, "3.0inch/min"),
        (133.337, "133mm/sec"), (2000, "2000mm/sec"),
    ],
)  # fmt: skip
def test_speeds_take_the_coarsest_unit_that_says_them(speed_mm_s, text):
    assert speed_text(speed_mm_s * MM) == text


@given(st.floats(0.05e-3, 2.0))
def test_written_speed_is_never_above_the_wanted(speed):
    said = parse_speed(speed_text(speed))
    assert 0.5 * speed <= said <= speed * (1 + 2e-6)
    if speed > 10e-3:
        assert said >= 0.995 * speed


@pytest.mark.parametrize("speed", [1e-6, 5.0])
def test_speeds_no_unit_says_are_refused(speed):
    with pytest.raises(InputError, match="mm/s cannot be written"):
        speed_text(speed)


@pytest.mark.parametrize(
    ("angle", "digit"), [(0, 0), (179, 0), (-179, 0), (180, 1), (539, 1), (540, 2), (-180, -1), (-539, -1), (-540, -2)]
)
def test_turn_digits_follow_the_controllers_rule(robot, angle, digit):
    pendant = np.array([[angle if joint == 6 else 0 for joint in range(1, 7)]]) * DEG
    assert turn_digits(robot, robot.to_theta(pendant)).tolist() == [[0, 0, digit]]


@given(st.lists(st.floats(-700, 700), min_size=3, max_size=3))
def test_turns_are_read_as_they_were_written(robot, angles):
    pendant = np.zeros((1, 6))
    pendant[0, [0, 3, 5]] = np.array(angles) * DEG
    theta = robot.to_theta(pendant)
    lost = theta - 2 * np.pi * np.round(theta / (2 * np.pi))
    assert_allclose(apply_turns(robot, lost, turn_digits(robot, theta)), theta, atol=1e-8)


def test_config_letters_are_wrist_elbow_arm():
    assert config_letters(Posture()) == "N U T"
    assert config_letters(Posture(front=False, up=False, flip=True)) == "F D B"


def test_config_of_the_check_values(robot):
    table = [
        ((10, 20, -15, 30, -60, 45), "N U T", (0, 0, 0)),
        ((10, 20, -15, -150, 60, -135), "F U T", (0, 0, 0)),
        ((10, 20, -15, 210, 60, 225), "F U T", (0, 1, 1)),
        ((-170, -40, 60, -200, 30, 190), "F U B", (0, -1, 1)),
        ((20, -80, -150, 10, 40, 0), "F D B", (0, 0, 0)),
        ((0, 0, 80, 0, -30, 0), "N U T", (0, 0, 0)),
        ((0, 0, 81, 0, -30, 0), "N D T", (0, 0, 0)),
    ]
    theta = robot.to_theta(np.array([row[0] for row in table]) * DEG)
    assert [config_letters(p) for p in postures_of(robot, theta)] == [row[1] for row in table]
    assert [tuple(t) for t in turn_digits(robot, theta).tolist()] == [row[2] for row in table]


def test_w_near_180_reads_as_the_same_rotation():
    tilt = rotation_matrix(np.array([[1e-7, 0, 0], [-1e-7, 0, 0]])) @ np.diag([1.0, -1.0, -1.0])
    numbers = pose_numbers(np.zeros((2, 3)), tilt)
    assert set(np.abs(numbers[:, 3])) == {180.0}
    assert_allclose(from_wpr(*(numbers[:, 3:] * DEG).T), tilt, atol=2e-7)


@pytest.mark.parametrize(
    ("name", "length", "said"),
    [
        ("spiral_1300", 32, "SPIRAL_1300"), ("9lives", 32, "P9LIVES"), ("a-b c.d", 32, "A_B_C_D"),
        ("optic_spiral", 12, "OPTIC_SPIRAL"), ("___", 8, "P"), ("", 8, "P"),
    ],
)  # fmt: skip
def test_names_are_ones_the_controller_takes(name, length, said):
    assert program_name(name, length) == said


@pytest.mark.parametrize(
    ("one", "other", "length", "start"),
    [
        ("größe", "grüße", 32, "GR_"), ("漢", "字", 32, "P_"), ("optic_spiral_1", "optic_spiral_2", 8, "OPTI_"),
        ("line_ä", "line", 32, "LINE_"),
    ],
)  # fmt: skip
def test_names_that_lose_letters_do_not_become_one(one, other, length, start):
    names = [program_name(name, length) for name in (one, other)]
    assert names[0] != names[1]
    assert names[0].startswith(start)
    assert all(re.fullmatch(r"[A-Z][A-Z0-9_]*", name) and len(name) <= length for name in names)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (b"/POS", b"/POZ", "/POS is missing"),
        (b"/END", b"", "/END is missing"),
        (b"L P[2] 200mm/sec", b"C P[2] 200mm/sec", "line 26"),
        (b"L P[2] 200mm/sec CNT100", b"L P[2] 200mm/sec CNT100 INC", "line 26"),
        (b"L P[2] 200mm/sec", b"L P[2] 20..0mm/sec", "line 26"),
        (b"  !one remark ;", b"  CALL OTHER ;", "line 22"),
        (b"X =  1350.123  mm", b"X = ********  mm", "line 35"),
        (b"L P[2]", b"L P[3]", "once each in order"),
        (b"J P[1] 10%", b"L P[1] 10mm/sec", "starts? with one J"),
        (b"'N U T, 0, -1, 1'", b"'F U T, 0, -1, 1'", "differ"),
        (b"P[3]{\r\n   GP1:\r\n\tUF : 0, UT : 1", b"P[3]{\r\n   GP1:\r\n\tUF : 0, UT : 2", "differ"),
    ],
)
def test_other_texts_are_refused_with_their_line(old, new, told):
    assert old in GOLDEN
    with pytest.raises(InputError, match=told) as caught:
        ls.interpret(GOLDEN.replace(old, new))
    assert "\n" not in str(caught.value)


def test_an_overlong_remark_is_refused():
    with pytest.raises(InputError, match="remark"):
        ls.compose(replace(demo(), remarks=("x" * 33,)))


def test_a_position_that_is_no_number_is_refused():
    with pytest.raises(InputError, match="position"):
        ls.compose(replace(demo(), position=np.array([[np.nan, 0, 0]] * 3)))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 30), st.integers(3, 6))
def test_more_decimals_are_written_and_read(seed, count, decimals):
    rng = np.random.default_rng(seed)
    program = replace(
        demo(),
        position=rng.uniform(-3, 3, (count, 3)) * 10.0 ** rng.integers(-6, 1, (count, 1)),
        rotation=rotation_matrix(rng.normal(size=(count, 3))),
        turns=rng.integers(-2, 3, (count, 3)),
        speed=np.full(count - 1, 0.2),
        fine=np.ones(count, dtype=bool),
        via=np.zeros(count, dtype=bool),
        decimals=decimals,
    )
    text = ls.compose(program)
    numbers = pose_numbers(program.position, program.rotation, decimals)
    said = re.findall(rb"[XYZWPR] = (.{%d}) " % (6 + decimals), text)
    assert said == [f"{v:{6 + decimals}.{decimals}f}".encode() for v in numbers.ravel()]
    back = ls.interpret(text)
    assert back.decimals == decimals
    assert np.abs(back.position - program.position).max() <= 0.5e-3 * 10.0**-decimals * 1.0001
    slow = ls.interpret(text.replace(b"J P[1] 10%", b"J P[1] 10.%"))
    assert np.abs(slow.position - back.position).max() < 1e-12
    assert ls.compose(back) == text


@pytest.mark.parametrize("rows", [40 * [b"123456789;"], [*(40 * [b"123456789;"]), *(3 * [b"12;"]), *(40 * [b"1234;"])]])
def test_rows_end_where_each_mark_stands(rows):
    """Guessed ahead from the row before, or looked for: the same ends."""
    ends = np.cumsum([0, *map(len, rows)])
    assert reader.row_ends(b"".join(rows), 0, int(ends[-1]), b";", 1, window=100).tolist() == ends.tolist()
