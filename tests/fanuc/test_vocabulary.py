"""The vocabulary of statements: what each word means for a correction, and where it is not that word."""

import time

import pytest

from compgen.fanuc.motion_options import (
    MOTION_OPTIONS,
    ends_elsewhere,
    is_step,
    options_on_parts,
    unsafe_options,
)
from compgen.fanuc.vocabulary import (
    CALL,
    MODAL_STATEMENTS,
    POSITION,
    RATES,
    SPEED,
    SPEED_NEEDS_LENGTH,
    SPEED_OF_WHOLE_MOTION,
    TIMES,
    unsafe_words,
)

BY_WORD = {option.word: option for option in MOTION_OPTIONS}


@pytest.mark.parametrize("option", MOTION_OPTIONS, ids=lambda option: option.word)
@pytest.mark.parametrize("form", ["{}", "ACC50 {} PTH", "{} CNT100", "Break,{}"])
def test_an_option_is_known_wherever_it_stands_in_any_case(option, form):
    word = option.word.removesuffix(r"\d*")
    for text in (form.format(word), form.format(word.lower())):
        assert unsafe_options(text) == [option.unsafe] * bool(option.unsafe)
        assert ends_elsewhere(text) is option.modifies_target
        assert is_step(text) is option.word.startswith("INC")


@pytest.mark.parametrize(
    "text",
    ["", "ACC100", "Wjnt PTH", "TB 0.10sec,CALL INCREASE", "TB .50sec,CALL INC", "TA .00sec,DO[1:INC FEED]=ON",
     "DB 5.0mm,DO[1:INC]=ON", "ACC R[4:skip]", "TA .10sec,CALL OFFSET(1)"],
)  # fmt: skip
def test_other_words_are_not_that_option(text):
    """Nor is a comment in brackets, nor the name of a program that is called."""
    assert not unsafe_options(text)
    assert not ends_elsewhere(text)
    assert not is_step(text)


def test_an_offset_by_a_register_of_that_name_is_no_step():
    (reason,) = unsafe_options("Offset,PR[3:INC]")
    assert "Offset is added" in reason
    assert not is_step("Offset,PR[3:INC]")
    assert is_step("Offset,PR[3:INC] INC")


@pytest.mark.parametrize(
    "text", ["SKIPPED", "MY_OFFSET,PR[1]", "ACC50 FPLIN", "TA_REF 5mm", "ORNT_BASE UF[1,X]", "PR[", "TB .1sec,FOO"]
)
def test_a_word_that_is_not_known_makes_its_motion_unsafe(text):
    assert ends_elsewhere(text)
    (reason,) = unsafe_options(text)
    assert "not known" in reason
    assert options_on_parts(text) is None


@pytest.mark.parametrize(
    "text",
    ["TA  1.0sec,CALL GRIP(1,R[2:a b])", "TB   0.0sec,DO[0:blow 0]=PULSE,0.0sec", "DB 10.0mm,RO[1]=ON",
     "TB .10sec,P-SPS", "TA R[3]sec,DO[1]=(R[1]>3)", "Arc Start[1,2]", "Weld End[1]", "Ind.EV50%", "EV R[1]%",
     "AP_LD50 RT_LD R[2:x]", "MROT"],
)  # fmt: skip
def test_options_are_known_with_their_arguments(text):
    assert unsafe_options(text) == []


@pytest.mark.parametrize(
    ("options", "carried"),
    [
        ("", ""), ("ACC50", "ACC50"), ("ACC R[1:a b] PTH", "ACC R[1:a b] PTH"), ("TA 0.5sec,DO[1]=ON PSPD50", "PSPD50"),
        ("Wjnt", None), ("AP_LD5", None), ("RT_LD5 ACC50", None), ("CTV50", None), ("Offset", None),
    ],
)  # fmt: skip
def test_inserted_points_carry_what_they_can_or_the_line_is_left(options, carried):
    assert options_on_parts(options) == carried


def test_a_search_through_options_takes_time_in_proportion():
    start = time.process_time()
    assert unsafe_options("[" * 200_000)
    assert unsafe_options("A[" * 200_000)
    assert time.process_time() - start < 5


def test_options_are_named_once():
    assert len(BY_WORD) == len(MOTION_OPTIONS)
    assert len({s.name for s in MODAL_STATEMENTS}) == len(MODAL_STATEMENTS)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("$MNUTOOL[1,3]=PR[2]", "UTOOL[] is written"),
        ("$MNUFRAME[1,R[2]].$Z = 5", "UFRAME[] is written"),
        ("TRACK DPM[1]", "DPM"),
        ("SOFTFLOAT[1]", "soft float"),
        ("FORCE CTRL[2:JIG]", "force control"),
        ("UFRAME[R[1]]=PR[2]", "UFRAME[] is written"),
        ("UTOOL[3:probe] = PR[2]", "UTOOL[] is written"),
        ("P[R[4]]=LPOS", "a position is written"),
        ("Weave Sine[1]", "weaving"),
        ("Track TAST[1]", "sensing"),
    ],
)
def test_a_statement_says_why_it_is_unsafe(text, reason):
    (why,) = unsafe_words(text)
    assert why.startswith(reason)


@pytest.mark.parametrize("text", ["UFRAME_NUM=1", "PR[1]=P[3]", "R[2]=5", "CALL WEAVE_ON", "IF P[1]<>P[2],JMP LBL[1]"])
def test_reading_a_frame_or_a_position_is_not_writing_it(text):
    assert unsafe_words(text) == []


@pytest.mark.parametrize("statement", MODAL_STATEMENTS, ids=lambda statement: statement.name)
def test_a_setting_is_known_by_its_statement_and_by_no_other(statement):
    for text in (f"{statement.name}=1", f"{statement.name}[1]", f"{statement.name} R[1]=1"):
        hits = [other.name for other in MODAL_STATEMENTS if other.pattern.match(text)]
        assert set(hits) <= {statement.name}
        if hits:
            return
    pytest.fail(f"{statement.name} is not known")


@pytest.mark.parametrize("unit", [*RATES, *TIMES, "%", "deg/sec"])
def test_every_unit_of_speed_is_read(unit):
    speed = SPEED.match(f" 12.5{unit} FINE".encode())
    assert speed is not None
    assert speed[2].decode() == unit


def test_times_belong_to_the_whole_motion_and_rates_do_not():
    assert all(SPEED_OF_WHOLE_MOTION.search(f"2{unit}") and SPEED_NEEDS_LENGTH.search(f"2{unit}") for unit in TIMES)
    assert not any(SPEED_OF_WHOLE_MOTION.search(f"2{unit}") or SPEED_NEEDS_LENGTH.search(f"2{unit}") for unit in RATES)
    assert SPEED_NEEDS_LENGTH.search("WELD_SPEED")
    assert not SPEED_NEEDS_LENGTH.search("45deg/sec")


def test_positions_and_calls_are_found_in_any_statement():
    assert POSITION.findall("IF P[3:here]<>P[R[2]] AND PR[4]=$P[5]") == ["3", ""]
    assert CALL.findall("IF R[1]=1,CALL GRIP(1)") == ["GRIP"]
    assert CALL.findall("R[7:last run]=1") == []
