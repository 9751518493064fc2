r"""The vocabulary of /MN: every statement and motion option that compgen knows, named once, and what it means.

A motion is a letter, a target (two for C), a speed, a termination and options; any other statement is taken by its
words. A new word is added here: to ``MOTION_OPTIONS``, to ``UNSAFE_STATEMENTS``, ``DIVERSIONS`` or ``BRACKETS``, or to
``MODAL_STATEMENTS``. What is in none of them is passed through and has no meaning for the correction.
"""

import re
from collections.abc import Collection
from dataclasses import dataclass

from compgen.core.units import INCH, MINUTE, MM

REMARKS = ("!", "//", "--")  # what a remark, a disabled statement and an instruction comment begin with


def _words(pattern: str) -> re.Pattern[str]:
    return re.compile(pattern, re.IGNORECASE)


# ---- Motions, as bytes of a line -------------------------------------------------------------------------------------

#: m/s of one unit of a path speed; seconds of one unit of a time for the whole motion.
RATES = {"mm/sec": MM, "cm/min": 10 * MM / MINUTE, "inch/min": INCH / MINUTE}
TIMES = {"sec": 1.0, "msec": 1e-3}
PERCENT, TURN_RATE = "%", "deg/sec"  # of joint speed; of the tool's orientation
_NUMBER = rb"(?:\d++\.?\d*+|\.\d++)"
_UNIT = rb"(?:%|mm/sec|cm/min|inch/min|deg/sec|msec|sec)"
_SPEED_WORD = rb"WELD_SPEED|max_speed"

LINE_NUMBER = re.compile(rb"[ \t]*+(\d*+)[ \t]*+:")
MOTION = re.compile(rb"[ \t]*+(//)?+[ \t]*+([JLCAS])[ \t]++(?=PR?\[)", re.IGNORECASE)
#: P[...] or PR[...]; a name may hold brackets, so it ends where a speed, another target or the line's end follows.
TARGET = re.compile(
    rb"[ \t]*(PR?)\[([^\r\n]*?)\](?=[ \t]+(?:"
    + _NUMBER
    + rb"[ \t]*"
    + _UNIT
    + rb"|A?R\[|"
    + _SPEED_WORD
    + rb"|PR?\[)|[ \t]*$)",
    re.IGNORECASE,
)
SPEED = re.compile(
    rb"[ \t]*(?:(" + _NUMBER + rb"|A?R\[[^\r\n]*?\])[ \t]*(" + _UNIT + rb")|(" + _SPEED_WORD + rb"))", re.IGNORECASE
)
SPEED_NUMBER = re.compile(_NUMBER)
TERMINATION = re.compile(rb"[ \t]*(FINE|CNT[ \t]*(?:\d+|R\[[^\r\n]*?\])|C[RD][ \t]*\d+)", re.IGNORECASE)
#: n and the name of P[n:name], inside the brackets.
NUMBER_AND_NAME = re.compile(rb"\s*(\d+)\s*(?::(.*))?$", re.DOTALL)

CONSTANT_SPEED = re.compile(r"(\d*\.?\d+)\s*(\S+)$")  # number and unit; not a register or a word
SPEED_OF_WHOLE_MOTION = _words(r"(?<![/a-z])m?sec$|deg/sec$")  # a part of the motion would need another number
SPEED_NEEDS_LENGTH = _words(r"(?<!/)sec$|WELD_SPEED$")  # a motion of no length cannot be told it
ARC_LETTERS = ("A", "S")  # a curve through several motions


# ---- Options of motions ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class MotionOption:
    """A word behind a motion's termination."""

    word: str  # a pattern, in capitals
    unsafe: str = ""  # why a motion with it cannot be corrected off-line
    modifies_target: bool = False  # the motion ends elsewhere than at its position

    @property
    def pattern(self) -> str:
        """Where the word stands among options, whatever its case."""
        return rf"(?<![A-Z_]){self.word}\b"


MOTION_OPTIONS = (
    MotionOption("INC", "INC moves relative to where it starts: a shift of both ends is wrong", modifies_target=True),
    MotionOption(
        "TOOL_OFFSET", "Tool_Offset is added at run time: the nominal place is not where it works", modifies_target=True
    ),
    MotionOption(
        "OFFSET", "Offset is added at run time: the nominal place is not where it works", modifies_target=True
    ),
    MotionOption(
        "VOFFSET", "VOFFSET is added at run time: the nominal place is not where it works", modifies_target=True
    ),
    MotionOption("RTCP", "RTCP: the frame is moved by another group", modifies_target=True),
    MotionOption("COORD", "COORD: the frame is moved by another group", modifies_target=True),
    MotionOption("SKIP", "Skip may end the motion anywhere", modifies_target=True),
    MotionOption("SKIPJUMP", modifies_target=True),
    MotionOption("WEAVE", "weaving changes the executed path"),
    MotionOption("TRACK", "tracking changes the executed path"),
    MotionOption(r"ACC\d*"),
    MotionOption("WJNT"),
    MotionOption("PTH"),
    MotionOption("TA"),
    MotionOption("TB"),
    MotionOption("DB"),
)
_UNSAFE_OPTIONS = [(_words(option.pattern), option.unsafe) for option in MOTION_OPTIONS if option.unsafe]
#: An option after which the robot is elsewhere than at the motion's position.
TARGET_MODIFIER = _words("|".join(option.pattern for option in MOTION_OPTIONS if option.modifies_target))

# Parts of options that some readers need.
ACCELERATION = _words(r"ACC\s*(?:\d+|R\[[^\]]*\])")
TIMED_BEFORE_END = _words(r"\b(?:DB\s*(\d*\.?\d+)\s*mm|T[AB]\s*(\d*\.?\d+)\s*sec)")  # mm, or seconds, before (after) it
TIME_AFTER_STOP = _words(r"(?<![A-Z_])TA\s+[\d.]")  # its logic runs after the stop
POINT_LOGIC = _words(r"P-SPS")  # a listing of its own follows, up to a rule of dashes
POINT_LOGIC_END = re.compile(rb"(?:\A|(?<=[\r\n]))[ \t]*-{3,}[ \t]*(?=[\r\n]|\Z)")


def unsafe_options(options: str) -> list[str]:
    """Why a motion with these options cannot be corrected off-line; empty when it can."""
    return [reason for pattern, reason in _UNSAFE_OPTIONS if pattern.search(options)] if options else []


# ---- Positions and registers in any statement ------------------------------------------------------------------------

POSITION = _words(r"(?<![A-Za-z_$])P\[\s*(\d*)")  # n of P[n]; empty for one that is found at run time
INDIRECT_POSITION = _words(r"(?<![A-Za-z])P\[\s*R\[[^\]]*\]\s*\](\s*=)?")  # P[R[n]], and whether it is written
POSITION_WRITTEN = re.compile(r"(?<![A-Z])P\[\s*(?:\d+[^\]]*|R\[[^\]]*\]\s*)\]\s*=")
POSITION_BEFORE_EQUALS = _words(r"(?<![A-Za-z_$])P\[\s*(\d*)[^\]]*\][^=<>]*=")  # written, a component of it too
FRAME_WRITTEN = re.compile(r"\bU(FRAME|TOOL)\s*\[((?:[^\[\]]|\[[^\]]*\])*)\]\s*=")  # kind and number
REGISTER = _words(r"(?<![A-Z_$])(P?R)\[\s*(\d*)")
REGISTER_WRITTEN = _words(r"(?<![A-Z_$])(P?R)\[\s*(\d*)[^=<>]*=")
LOCAL_REGISTER = _words(r"(?<![A-Z_])(AR|LR)\[")  # known to one program only


# ---- Order -----------------------------------------------------------------------------------------------------------

#: A statement that may change the order in which others are run.
FLOW = _words(r"(?:IF|JMP|FOR|ENDFOR|SELECT|CALL|RUN|LBL|WHEN|ELSE|ENDIF|SKIP CONDITION|MONITOR)\b")
LABEL = _words(r"(?<![A-Za-z_])LBL\[\s*(\d*)")  # said or jumped to; empty for one that is found at run time
CALL = _words(r"(?:^|[\s,])(?:CALL|RUN)\s+([A-Z_][^\s(;]*)")  # the program's name
CALL_ALONE = _words(r"^CALL\s+([^\s(;]+)$")
MESSAGE_OR_PAUSE = _words(r"^(?:MESSAGE\[[^\]]*\]|PAUSE)$")
END = _words(r"(?:^|,)\s*END\s*$")
WAIT = _words(r"WAIT\s+(\d*\.?\d+)\s*\(?\s*sec\s*\)?")  # seconds
JUMP = _words(r"^JMP\b")
LABEL_ALONE = _words(r"^LBL\[\s*(\d*)")
ABORT = _words(r"^(?:END|ABORT)\s*$")
IF_THEN = _words(r"^IF\b.*\bTHEN\s*$")
ELSE_ALONE = _words(r"^ELSE\s*$")
ENDIF = _words(r"^ENDIF\b")
FOR = _words(r"^FOR\b")
ENDFOR = _words(r"^ENDFOR\b")
CONSTANT_FOR = _words(r"^FOR\b.*=\s*\(?(-?\d+)\)?\s*\b(TO|DOWNTO)\s+\(?(-?\d+)\)?\s*$")  # first, way, last
_CONDITIONAL = _words(r"^(?:IF\b|SELECT\b|=|ELSE\s*,|WHEN\b)")  # what is done stands after the last comma
_INSIDE = re.compile(r"\[[^\[\]]*\]|\([^()]*\)")  # brackets and what they hold
_DEEPEST = 8  # brackets in brackets; a statement with more is not understood
_ASSIGNMENT = _words(r"^[A-Z_$][\w$.]*\s*=")
#: Statements that never move the arm. Whatever else is said may be a macro, which a listing gives by its name alone.
_STILL = _words(
    r"^(?:LBL|JMP|END|ABORT|ELSE|ENDIF|FOR|ENDFOR|WAIT|TIMER|OVERRIDE|MESSAGE|UALM|PAUSE|PAYLOAD|(?:UN)?LOCK\s+PREG|"
    r"(?:SKIP|OFFSET|TOOL_OFFSET|VOFFSET)\s+CONDITION|COL\s+(?:DETECT|GUARD\s+ADJUST)|STICK\s+DETECT|VISION|"
    r"(?:Arc|Weld|Search)\s+(?:Start|End)|Weave|Track|Touch\s+Offset|LINE_?TRACK|STOP_?TRACKING)\b"
)


def may_move_arm(text: str, motionless: Collection[str] = ()) -> bool:
    """Whether a statement that is no motion may leave the arm elsewhere.

    Args:
        text: The statement.
        motionless: Programs, in capitals, of which it is known that they do not move the arm.
    """
    if any(name.upper() not in motionless for name in CALL.findall(text)):
        return True
    for _ in range(_DEEPEST):
        text = _INSIDE.sub("", text)
    if _CONDITIONAL.match(text):
        if IF_THEN.match(text):
            return False
        text = text.rpartition(",")[2].strip()
    return not (_STILL.match(text) or _ASSIGNMENT.match(text) or CALL.search(text))


@dataclass(frozen=True, slots=True)
class Bracket:
    """What begins a part of a program, and what ends it."""

    opens: re.Pattern[str]
    closes: re.Pattern[str]
    reason: str = ""  # why motions in it cannot be corrected


def _bracket(opens: str, closes: str, reason: str = "") -> Bracket:
    return Bracket(_words(opens), _words(closes), reason)


_START = r"(?:^|(?<![A-Za-z_]))"  # a word's begin: the start of a statement, or inside the options of a motion
#: Statements that belong together: a program is not parted into pages between them.
BRACKETS = (
    _bracket(r"^IF\b.*\bTHEN\s*$", r"^ENDIF\b"),
    _bracket(r"^FOR\b", r"^ENDFOR\b"),
    _bracket(r"^LOCK\s+PREG\b", r"^UNLOCK\s+PREG\b"),
    _bracket(_START + r"(?:Arc|Weld)\s+Start\b", _START + r"(?:Arc|Weld)\s+End\b"),
    _bracket(_START + r"Weave\s+(?!End\b)", _START + r"Weave\s+End\b"),
    _bracket(_START + r"Track\s+(?!End\b)", _START + r"Track\s+End\b"),
    _bracket(_START + r"Touch\s+Offset\s+(?!End\b)", _START + r"Touch\s+Offset\s+End\b"),
    _bracket(_START + r"Search\s+Start\b", _START + r"Search\s+End\b"),
    _bracket(r"^LINE_?TRACK\b", r"^STOP_?TRACKING\b"),
    _bracket(r"^MONITOR\s+(?!END\b)", r"^MONITOR\s+END\b"),
)
#: Between these the executed path is not the programmed one.
DIVERSIONS = (
    _bracket(r"\bWeave\s+(?!End)\w+", r"\bWeave\s+End\b", "between weaving statements"),
    _bracket(
        r"\bLINE_TRACK\b|\bLINE\[[^\]]*\]\s*ON\b",
        r"\bSTOP_TRACKING\b|\bLINE\[[^\]]*\]\s*OFF\b",
        "while line tracking",
    ),
    _bracket(r"\bTrack\s+(?:TAST|AVC|MPS)", r"\bTrack\s+End\b", "while seam tracking"),
    _bracket(r"\bTouch\s+Offset\s+(?!End)\w+", r"\bTouch\s+Offset\s+End\b", "shifted by a touch offset"),
    _bracket(r"\bSearch\s+Start\b", r"\bSearch\s+End\b", "inside a search"),
)


# ---- Statements that make a correction unsafe ------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class UnsafeStatement:
    """A statement that is no motion, or a line of the head, and why it casts doubt on a correction."""

    pattern: re.Pattern[str]
    reason: str


UNSAFE_STATEMENTS = tuple(
    UnsafeStatement(re.compile(pattern), reason)
    for pattern, reason in (
        (r"\bOFFSET CONDITION\b", "OFFSET CONDITION adds an offset at run time to what follows"),
        (r"\bTOOL_OFFSET CONDITION\b", "TOOL_OFFSET CONDITION adds an offset at run time to what follows"),
        (r"\bLINE_TRACK\b|\bSTOP_TRACKING\b", "line tracking changes the executed path"),
        (r"\bWeave\b", "weaving changes the executed path"),
        (r"\bTouch Offset\b|\bSearch Start\b|\bTrack\s+(?:TAST|AVC|MPS)", "sensing changes the executed path"),
        (POSITION_WRITTEN.pattern, "a position is written at run time, not the file's"),
    )
)
_FRAME_REASON = {
    "FRAME": "UFRAME[] is written: the frame is not the one of the table",
    "TOOL": "UTOOL[] is written: the tool is not the one of the table",
}
#: Text of /APPL
UNSAFE_HEADERS = {
    "ENABLE_SINGULARITY_AVOIDANCE   : TRUE": "singularity avoidance may change the executed path",
    "LINE_TRACK_SCHEDULE": "line tracking changes the executed path",
}


def unsafe_words(text: str) -> list[str]:
    """Why a statement that is no motion makes a correction unsafe; empty when it does not."""
    reasons = [statement.reason for statement in UNSAFE_STATEMENTS if statement.pattern.search(text)]
    return reasons + [_FRAME_REASON[kind] for kind in dict.fromkeys(m[1] for m in FRAME_WRITTEN.finditer(text))]


# ---- Modal state -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ModalStatement:
    """A setting that later motions obey."""

    name: str
    pattern: re.Pattern[str]
    ends_with_program: bool = True  # otherwise it stays with the controller
    evaluated_live: bool = False  # while the robot moves, not when it is said


MODAL_STATEMENTS = (
    ModalStatement("UFRAME_NUM", _words(r"UFRAME_NUM\s*(?:\[[^\]]*\])?\s*="), ends_with_program=False),
    ModalStatement("UTOOL_NUM", _words(r"UTOOL_NUM\s*(?:\[[^\]]*\])?\s*="), ends_with_program=False),
    ModalStatement("PAYLOAD", _words(r"PAYLOAD\s*\["), ends_with_program=False),
    ModalStatement("TOOL_OFFSET CONDITION", _words(r"TOOL_OFFSET\s+CONDITION\b")),
    ModalStatement("OFFSET CONDITION", _words(r"(?<![A-Z_])OFFSET\s+CONDITION\b")),
    ModalStatement("VOFFSET CONDITION", _words(r"VOFFSET\s+CONDITION\b")),
    ModalStatement("SKIP CONDITION", _words(r"SKIP\s+CONDITION\b"), evaluated_live=True),
    ModalStatement("COL DETECT", _words(r"COL\s+DETECT\b")),
    ModalStatement("COL GUARD ADJUST", _words(r"COL\s+GUARD\s+ADJUST\b")),
    ModalStatement("JOINT_MAX_SPEED", _words(r"JOINT_MAX_SPEED\s*(?:\[[^\]]*\])?\s*=")),
    ModalStatement("LINEAR_MAX_SPEED", _words(r"LINEAR_MAX_SPEED\s*=")),
)
FRAME_NUMBER = _words(r"^(UFRAME_NUM|UTOOL_NUM)\s*=\s*(.*?)\s*$")  # which, and its value
ASSIGNED_NUMBER = re.compile(r"=\s*(\d+)\s*$")
