"""The options of a motion that cgen knows, word by word, and what they mean for a correction; no other word is safe.

FPLIN (faceplate linear), ORNT_BASE (a frame of World, UF or leader, and an axis) and TA_REF (torch angle) mean what
public parsers of the language call them; SPOT's schedules of distances are described by a maker of welding tables.
"""

import re
from dataclasses import dataclass
from enum import Enum

from compgen.fanuc.vocabulary import any_case


class OnInsertion(Enum):
    """What becomes of an option where points are put into the line of its motion."""

    LEAVE = "no points are put into the line"
    CARRY = "each new point carries it"
    KEEP = "it stays with the end of the line"


@dataclass(frozen=True, slots=True)
class MotionOption:
    """A word behind a motion's termination."""

    word: str  # a pattern, in capitals
    unsafe: str = ""  # why a motion with it cannot be corrected off-line
    modifies_target: bool = False  # the motion ends elsewhere than at its position
    arguments: str = ""  # a pattern of what may follow the word; [] stands for brackets with anything inside
    on_insertion: OnInsertion = OnInsertion.LEAVE


_NUMBER_OR_REGISTER = r"\s*(?:-?[\d.]+|A?R[])"
_OFFSET_REGISTER = r"\s*,\s*[PV]?R[]"
_AFTER_SKIP = r"\s*,\s*LBL[](?:\s*,\s*PR[]\s*=\s*[LJ]POS)?"
_LOGIC = (  # beside a motion: a call, point logic, or an output, perhaps as a pulse of some seconds
    rf"{_NUMBER_OR_REGISTER}\s*(?:sec|mm)?(?:\s*,\s*(?:CALL\s+[^\s,(]+(?:\s*\([^()]*\))?|P-SPS"
    rf"|[A-Z]+[]\s*=\s*(?:\([^()]*\)|[^\s,]+)(?:\s*,{_NUMBER_OR_REGISTER}\s*sec)?))?"
)
_SCHEDULE = r"\s*[]"

MOTION_OPTIONS = (
    MotionOption("INC", "INC moves relative to where it starts: a shift of both ends is wrong", modifies_target=True),
    MotionOption(
        "INCREMENTAL",
        "Incremental moves relative to where it starts: a shift of both ends is wrong",
        modifies_target=True,
    ),
    MotionOption(
        "TOOL_OFFSET",
        "Tool_Offset is added at run time: the nominal place is not where it works",
        modifies_target=True,
        arguments=_OFFSET_REGISTER,
    ),
    MotionOption(
        "OFFSET",
        "Offset is added at run time: the nominal place is not where it works",
        modifies_target=True,
        arguments=_OFFSET_REGISTER,
    ),
    MotionOption(
        "VOFFSET",
        "VOFFSET is added at run time: the nominal place is not where it works",
        modifies_target=True,
        arguments=_OFFSET_REGISTER,
    ),
    MotionOption("RTCP", "RTCP: the frame is moved by another group", modifies_target=True),
    MotionOption("COORD", "COORD: the frame is moved by another group", modifies_target=True, arguments=_SCHEDULE),
    MotionOption("SKIP", "Skip may end the motion anywhere", modifies_target=True, arguments=_AFTER_SKIP),
    MotionOption("SKIPJUMP", "SkipJump may end the motion anywhere", modifies_target=True, arguments=_AFTER_SKIP),
    MotionOption("SEARCH", "a search ends where it touches", modifies_target=True, arguments=_SCHEDULE),
    MotionOption(
        "SPOT",
        "SPOT: a servo gun closes, and the robot moves with it, at the distances of its schedules",
        modifies_target=True,
        arguments=_SCHEDULE,
    ),
    MotionOption(
        "FPLIN", "FPLIN leads the faceplate along the straight line: the tool's path is not known", modifies_target=True
    ),
    MotionOption(
        "ORNT_BASE",
        "ORNT_BASE leads the orientation by a frame's axis: how the tool turns on the way is not known",
        modifies_target=True,
        arguments=r"(?:\s*(?:UF|LDR|WF)?\s*[])?",
    ),
    MotionOption(
        "TA_REF",
        "TA_REF leads the torch's angle by a reference that is not known",
        modifies_target=True,
        arguments=r"(?:\s*-?[\d.]+\s*(?:mm|deg)?|\s*[])?",
    ),
    MotionOption("CTV", "CTV: the last axis goes on turning", arguments=_NUMBER_OR_REGISTER),
    MotionOption("WEAVE", "weaving changes the executed path", arguments=r"\s+\w+(?:\s*[])?"),
    MotionOption("TRACK", "tracking changes the executed path", arguments=r"\s+\w+(?:\s*[])?"),
    MotionOption("ACC", arguments=_NUMBER_OR_REGISTER, on_insertion=OnInsertion.CARRY),
    MotionOption("PSPD", arguments=_NUMBER_OR_REGISTER, on_insertion=OnInsertion.CARRY),
    MotionOption("PTH", on_insertion=OnInsertion.CARRY),
    MotionOption("WJNT"),
    MotionOption("MROT"),
    MotionOption("BREAK"),
    MotionOption("AP_LD", arguments=_NUMBER_OR_REGISTER),
    MotionOption("RT_LD", arguments=_NUMBER_OR_REGISTER),
    MotionOption("EV", arguments=_NUMBER_OR_REGISTER + r"\s*%"),
    MotionOption("IND.EV", arguments=_NUMBER_OR_REGISTER + r"\s*%"),
    MotionOption("TA", arguments=_LOGIC, on_insertion=OnInsertion.KEEP),
    MotionOption("TB", arguments=_LOGIC, on_insertion=OnInsertion.KEEP),
    MotionOption("DB", arguments=_LOGIC, on_insertion=OnInsertion.KEEP),
    MotionOption("ARC START", arguments=_SCHEDULE, on_insertion=OnInsertion.KEEP),
    MotionOption("ARC END", arguments=_SCHEDULE, on_insertion=OnInsertion.KEEP),
    MotionOption("WELD START", arguments=_SCHEDULE, on_insertion=OnInsertion.KEEP),
    MotionOption("WELD END", arguments=_SCHEDULE, on_insertion=OnInsertion.KEEP),
)
OFFSETS = ("OFFSET", "TOOL_OFFSET")  # a position register's value is added
_BLANK = "\0"  # what stands in brackets, where only the brackets matter
#: An option with its arguments, a termination that stands behind it, or a word that is none of them.
_OPTION_OR_WORD = any_case(
    r"(?:"
    + "|".join(
        f"(?P<option{i}>{option.word}(?:{option.arguments})?)".replace("[]", rf"\[{_BLANK}*\]")
        for i, option in enumerate(MOTION_OPTIONS)
    )
    + r"|FINE|CNT\s*\d*|C[RD]\s*\d+)(?=[\s,]|$)|(?P<unknown>[^\s,]+)"
)
STEPS = ("INC", "INCREMENTAL")  # a position's numbers are a step from where the robot stands, no place
_LONGEST_QUOTE = 40  # characters of unknown words in a message

# Parts of options that some readers need.
TIMED_BEFORE_END = any_case(
    r"\b(?:DB\s*(\d*\.?\d+)\s*mm|T[AB]\s*(\d*\.?\d+)\s*sec)"
)  # mm, or seconds, before (after) it
TIME_AFTER_STOP = any_case(r"(?<![A-Z_])TA\s+[\d.]")  # its logic runs after the stop
ACC_OR_NOTHING = any_case(r"\s*(?:ACC\s*(\d+)\s*)?")  # nothing else is asked of the motion
POINT_LOGIC = any_case(r"P-SPS")  # a listing of its own follows, up to a rule of dashes
POINT_LOGIC_END = re.compile(rb"(?:\A|(?<=[\r\n]))[ \t]*-{3,}[ \t]*(?=[\r\n]|\Z)")


def unsafe_options(options: str) -> list[str]:
    """Why a motion with these options cannot be corrected off-line; empty when it can.

    A word that is not known here may move the target or the path.
    """
    if not options:
        return []
    parts = _split_options(options)
    known = {option for option, _ in parts}
    reasons = [option.unsafe for option in MOTION_OPTIONS if option.unsafe and option in known]
    if unknown := " ".join(dict.fromkeys(text for option, text in parts if option is None)):
        reasons.append(f"'{unknown[:_LONGEST_QUOTE]}' is not known to cgen: it may move the target or the path")
    return reasons


def ends_elsewhere(options: str) -> bool:
    """Whether after a motion with these options the robot may be elsewhere than at the motion's position."""
    return any(option is None or option.modifies_target for option, _ in _split_options(options))


def is_step(options: str) -> bool:
    """Whether a motion with these options takes its position's numbers for a step from where the robot stands."""
    return any(option is not None and option.word in STEPS for option, _ in _split_options(options))


def without_offsets(options: str) -> str:
    """Options without Offset and Tool_Offset: what is left where the places that they lead to are known."""
    return " ".join(text for option, text in _split_options(options) if option is None or option.word not in OFFSETS)


def offsets_of(options: str) -> list[tuple[str, str]]:
    """The offsets among options: which, and its text with the register, in the order they stand."""
    return [(option.word, text) for option, text in _split_options(options) if option and option.word in OFFSETS]


def options_on_parts(options: str) -> str | None:
    """The options that points put into a motion's line carry; None where no points may be put there."""
    parts = _split_options(options)
    if any(option is None or option.on_insertion is OnInsertion.LEAVE for option, _ in parts):
        return None
    return " ".join(text for option, text in parts if option and option.on_insertion is OnInsertion.CARRY)


def _split_options(options: str) -> list[tuple[MotionOption | None, str]]:
    """Options with their texts; None for a word that is not known."""
    parts: list[tuple[MotionOption | None, str]] = []
    for match in _OPTION_OR_WORD.finditer(_blank_brackets(options)):
        text = options[slice(*match.span())]
        if match.lastgroup == "unknown":
            parts.append((None, text))
        elif match.lastgroup:
            parts.append((MOTION_OPTIONS[int(match.lastgroup.removeprefix("option"))], text))
    return parts


def _blank_brackets(text: str) -> str:
    """The text with what stands in brackets blanked out, character by character."""
    depth, characters = 0, []
    for character in text:
        depth -= character == "]" and depth > 0
        characters.append(_BLANK if depth else character)
        depth += character == "["
    return "".join(characters)
