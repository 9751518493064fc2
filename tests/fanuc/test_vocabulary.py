"""The vocabulary of statements: what each word means for a correction, and where it is not that word."""

import pytest

from compgen.fanuc.vocabulary import (
    CALL,
    MODAL_STATEMENTS,
    MOTION_OPTIONS,
    POSITION,
    RATES,
    SPEED,
    SPEED_NEEDS_LENGTH,
    SPEED_OF_WHOLE_MOTION,
    TARGET_MODIFIER,
    TIMES,
    unsafe_options,
    unsafe_words,
)

BY_WORD = {option.word: option for option in MOTION_OPTIONS}


@pytest.mark.parametrize("option", MOTION_OPTIONS, ids=lambda option: option.word)
@pytest.mark.parametrize("form", ["{}", "ACC50 {},PR[1]", "{} CNT100", "Break,{}"])
def test_an_option_is_known_wherever_it_stands_in_any_case(option, form):
    word = option.word.removesuffix(r"\d*")
    for text in (form.format(word), form.format(word.lower())):
        assert unsafe_options(text) == [option.unsafe] * bool(option.unsafe)
        assert bool(TARGET_MODIFIER.search(text)) is option.modifies_target


@pytest.mark.parametrize("text", ["", "ACC100", "Wjnt PTH", "TB 0.10sec,CALL INCREASE", "SKIPPED", "MY_OFFSET,PR[1]"])
def test_other_words_are_not_that_option(text):
    assert not unsafe_options(text)
    assert not TARGET_MODIFIER.search(text)


def test_options_are_named_once():
    assert len(BY_WORD) == len(MOTION_OPTIONS)
    assert len({s.name for s in MODAL_STATEMENTS}) == len(MODAL_STATEMENTS)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("OFFSET CONDITION PR[1]", "OFFSET CONDITION adds"),
        ("TOOL_OFFSET CONDITION PR[1]", "TOOL_OFFSET CONDITION adds"),
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
    assert SPEED.match(f" 12.5{unit} FINE".encode())[2].decode() == unit


def test_times_belong_to_the_whole_motion_and_rates_do_not():
    assert all(SPEED_OF_WHOLE_MOTION.search(f"2{unit}") and SPEED_NEEDS_LENGTH.search(f"2{unit}") for unit in TIMES)
    assert not any(SPEED_OF_WHOLE_MOTION.search(f"2{unit}") or SPEED_NEEDS_LENGTH.search(f"2{unit}") for unit in RATES)
    assert SPEED_NEEDS_LENGTH.search("WELD_SPEED")
    assert not SPEED_NEEDS_LENGTH.search("45deg/sec")


def test_positions_and_calls_are_found_in_any_statement():
    assert POSITION.findall("IF P[3:here]<>P[R[2]] AND PR[4]=$P[5]") == ["3", ""]
    assert CALL.findall("IF R[1]=1,CALL GRIP(1)") == ["GRIP"]
    assert CALL.findall("R[7:last run]=1") == []
