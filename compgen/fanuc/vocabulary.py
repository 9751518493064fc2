r"""The vocabulary of /MN: every statement that compgen knows, named once, and what it means.

A motion is a letter, a target (two for C), a speed, a termination and options (``motion_options``); any other statement
is taken by its words. A new word is added here: to ``UNSAFE_STATEMENTS``, ``DIVERSIONS``, ``BRACKETS`` or
``MODAL_STATEMENTS``. What is in none of them is passed through and has no meaning for the correction.
"""

import re
from collections.abc import Collection
from dataclasses import dataclass

from compgen.core.units import INCH, MINUTE, MM, MS

REMARKS = ("!", "//", "--")  # what a remark, a disabled statement and an instruction comment begin with
_WORDS = re.compile(r"(\[[\d,\s]*\d\s*):(?:[^\[\]]++|\[[^\[\]]*+\])*+\]|(\bMESSAGE\[).*\]", re.IGNORECASE)


def any_case(pattern: str) -> re.Pattern[str]:
    """A pattern of words in capitals or not, as programs have them."""
    return re.compile(pattern, re.IGNORECASE)


def without_words(text: str) -> str:
    """A statement without its names, R[5:name] as R[5], and without its message: what stands there says nothing."""
    return _WORDS.sub(r"\1\2]", text)


# ---- Other languages -------------------------------------------------------------------------------------------------

#: Words that a controller set to German prints, and the English ones, of public backups that hold the same programs in
#: both. What has no meaning here (A[], E[], AN, AUS, FB-PSPS) is passed through; Offset, CNT, ACC, UF, PR[] are the
#: same, and sec is sek. FEIN, DANN, HALT and ZEIT NACH stand in none of these programs: they are formed as others are.
GERMAN = {
    "KONFIG": "CONFIG",
    "DEFAULT_GRUP": "DEFAULT_GROUP",
    "BENUTZER_NUM": "UFRAME_NUM",
    "WKZ_NUM": "UTOOL_NUM",
    "TRAGLST": "PAYLOAD",
    "IRQ BEDINGUNG": "SKIP CONDITION",
    "BEDINGUNG": "CONDITION",
    "FREIG. PREG": "UNLOCK PREG",
    "AUFRUF": "CALL",
    "SPRUNG": "JMP",
    "LABEL": "LBL",
    "WENN": "IF",
    "DANN": "THEN",
    "SONST": "ELSE",
    "IST": "SELECT",
    "WARTE": "WAIT",
    "ENDE": "END",
    "HALT": "PAUSE",
    "MELDUNG": "MESSAGE",
    "BALM": "UALM",
    "ZEIT VOR": "TB",
    "ZEIT NACH": "TA",
    "WEG VOR": "DB",
    "Interrupt": "Skip",
    "FEIN": "FINE",
    "Makro": "Macro",
}
#: Words that a bracket follows; frames as their numbers are called.
GERMAN_REGISTERS = {"i": "R", "gE": "GI", "gA": "GO", "BENUTZER": "UFRAME", "WKZ": "UTOOL"}
#: Keys of a German head that are read.
GERMAN_HEAD = {"KOMMENTAR": "COMMENT", "ERSTELL": "CREATE", "ZEILEN": "LINE_COUNT"}


# ---- Motions, as bytes of a line -------------------------------------------------------------------------------------

#: m/s of one unit of a path speed; seconds of one unit of a time for the whole motion.
RATES = {"mm/sec": MM, "cm/min": 10 * MM / MINUTE, "inch/min": INCH / MINUTE}
TIMES = {"sec": 1.0, "msec": MS}
PERCENT, TURN_RATE = "%", "deg/sec"  # of joint speed; of the tool's orientation
_NUMBER = rb"(?:\d++\.?\d*+|\.\d++)"
_UNIT = rb"(?:%|mm/sec|cm/min|inch/min|deg/sec|msec|sec)"
_SPEED_WORD = rb"WELD_SPEED|max_speed"

LINE_NUMBER = re.compile(rb"[ \t]*+(\d*+)[ \t]*+:")
CONTINUATION = re.compile(rb"(?:\r\n|\r|\n)[ \t]*:([^\r\n]*)")  # a line without a number goes on with a statement
_TARGET = rb"PR?|PAL_\d{1,9}"  # P[n], PR[n], and a place that palletizing computes
MOTION = re.compile(rb"[ \t]*+(//)?+[ \t]*+([JLCAS])[ \t]++(?=(?:" + _TARGET + rb")[ \t]*\[)", re.IGNORECASE)
#: Options that may stand between the via point of a C and its end point.
_VIA_OPTION = rb"(?:TOOL_OFFSET|V?OFFSET|ACC|INC|RTCP|COORD|WJNT|PTH)\b|ACC[ \t]*\d"
#: P[...], PR[...] or PAL_n[...]; a name may hold brackets, so it ends where a speed, another target, an option of a via
#: point or the line's end follows.
TARGET = re.compile(
    rb"[ \t]*("
    + _TARGET
    + rb")\[([^\r\n]*?)\](?=[ \t]+(?:"
    + _NUMBER
    + rb"[ \t]*"
    + _UNIT
    + rb"|A?R\[|"
    + _SPEED_WORD
    + rb"|"
    + _VIA_OPTION
    + rb"|(?:"
    + _TARGET
    + rb")\[)|[ \t]*$)",
    re.IGNORECASE,
)
#: The options of a via point, up to the end point or the line's end.
VIA_OPTIONS = re.compile(rb"[ \t]+((?:" + _VIA_OPTION + rb")[^\r\n]*?)(?=[ \t]+P\[|[ \t]*$)", re.IGNORECASE)
SPEED = re.compile(
    rb"[ \t]*(?:(" + _NUMBER + rb"|A?R\[[^\r\n]*?\])[ \t]*(" + _UNIT + rb")|(" + _SPEED_WORD + rb"))", re.IGNORECASE
)
SPEED_NUMBER = re.compile(_NUMBER)
TERMINATION = re.compile(rb"[ \t]*(FINE|CNT[ \t]*(?:\d+|R\[[^\r\n]*?\])|C[RD][ \t]*\d+)", re.IGNORECASE)
#: n and the name of P[n:name], inside the brackets.
NUMBER_AND_NAME = re.compile(rb"\s*(\d+)\s*(?::(.*))?$", re.DOTALL)

CONSTANT_SPEED = re.compile(r"(\d*\.?\d+)\s*(\S+)$")  # number and unit; not a register or a word
SPEED_OF_WHOLE_MOTION = any_case(r"(?<![/a-z])m?sec$|deg/sec$")  # a part of the motion would need another number
SPEED_NEEDS_LENGTH = any_case(r"(?<!/)sec$|WELD_SPEED$")  # a motion of no length cannot be told it
ARC_LETTERS = ("A", "S")  # a curve through several motions


# ---- Positions and registers in any statement ------------------------------------------------------------------------

POSITION = any_case(r"(?<![A-Za-z_$])P\[\s*(\d*)")  # n of P[n]; empty for one that is found at run time
INDIRECT_POSITION = any_case(r"(?<![A-Za-z])P\[\s*R\[[^\]]*\]\s*\](\s*=)?")  # P[R[n]], and whether it is written
POSITION_WRITTEN = re.compile(r"(?<![A-Z])P\[\s*(?:\d+[^\]]*|R\[[^\]]*\]\s*)\]\s*=")
POSITION_BEFORE_EQUALS = any_case(r"(?<![A-Za-z_$])P\[\s*(\d*)[^\]]*\][^=<>\s]*\s*=")  # written, a component of it too
#: Kind, and number: n of UFRAME[n]; of the system variable $MNUFRAME[group,n] too, or a component of it.
FRAME_WRITTEN = any_case(r"(?:\bU|\$MNU)(FRAME|TOOL)\s*\[\s*(?:\d+\s*,)?((?:[^\[\]]|\[[^\]]*\])*)\](?:\.\$?\w+)*\s*=")
REGISTER = any_case(r"(?<![A-Z_$])(P?R)\[\s*(\d*)")
REGISTER_WRITTEN = any_case(r"(?<![A-Z_$])(P?R)\[\s*(\d*)(?=[^\]]*\][^=<>\s]*\s*=)")  # or compared
POSITION_REGISTER = any_case(r"(?<![A-Z_$])PR\[\s*(\d*)")  # n of PR[n]; empty for one that is found at run time
POSITION_REGISTER_SET = any_case(r"(?<![A-Z_$])PR\[[^\]=]*\]\s*=")
NUMBER_REGISTER_SET = any_case(r"(?<![A-Z])R\[[^\]]*\]\s*=")
REGISTER_INDEX = re.compile(r"\s*(\d{1,4})\s*(?::.*)?", re.DOTALL)  # n and its name, inside the brackets
#: What may write a register, a frame or the offset of later motions.
MAY_SET = any_case(r"(?:PR|(?<![A-Z])R|UFRAME|UTOOL)\[.*=|\$MNU|CONDITION\b|\b(?:Search|Touch|VISION)\b|P-SPS")
SEARCH = any_case(r"\bSearch\b")
PALLETIZING = any_case(r"^PALLETIZING-")  # its begin or its end
LOCAL_REGISTER = any_case(r"(?<![A-Z_])(AR|LR)\[")  # known to one program only


# ---- Order -----------------------------------------------------------------------------------------------------------

#: A statement that may change the order in which others are run.
FLOW = any_case(r"(?:IF|JMP|FOR|ENDFOR|SELECT|CALL|RUN|LBL|WHEN|ELSE|ENDIF|SKIP CONDITION|MONITOR)\b")
LABEL = any_case(r"(?<![A-Za-z_])LBL\[\s*(\d*)")  # said or jumped to; empty for one that is found at run time
CALL = any_case(r"(?:^|[\s,])(?:CALL|RUN)\s+(?![^\[]*\])([A-Z_][^\s(;]*)")  # the program's name; not in brackets
CALL_ALWAYS = any_case(r"^CALL\s+([A-Z_][^\s(;]*)")  # no condition before it
CALL_ALONE = any_case(r"^CALL\s+([^\s(;]+)$")
MESSAGE_OR_PAUSE = any_case(r"^(?:MESSAGE\[[^\]]*\]|PAUSE)$")
END = any_case(r"(?:^|,)\s*END\s*$")
WAIT = any_case(r"WAIT\s+(\d*\.?\d+)\s*\(?\s*sec\s*\)?")  # seconds
#: What lasts, or makes the robot slower, as run time or an operator decides; WAIT with its seconds is another matter.
UNTIMED_WAIT = any_case(r"^(?:WAIT|PAUSE)\b(?!\s+\.?\d)")
UNTIMED = any_case(rf"{UNTIMED_WAIT.pattern}|^(?:OVERRIDE\s*=(?!\s*100\s*%)|(?:LINEAR|JOINT)_MAX_SPEED\b)")
JUMP = any_case(r"^JMP\b")
LABEL_ALONE = any_case(r"^LBL\[\s*(\d*)")
ABORT = any_case(r"^(?:END|ABORT)\s*$")
IF_THEN = any_case(r"^IF\b.*\bTHEN\s*(?:;|$)")
ELSE_ALONE = any_case(r"^ELSE\s*$")
ENDIF = any_case(r"^ENDIF\b")
FOR = any_case(r"^FOR\b")
ENDFOR = any_case(r"^ENDFOR\b")
CONSTANT_FOR = any_case(r"^FOR\b.*=\s*\(?(-?\d+)\)?\s*\b(TO|DOWNTO)\s+\(?(-?\d+)\)?\s*$")  # first, way, last
_CONDITIONAL = any_case(r"^(?:IF\b|SELECT\b|=|ELSE\s*,|WHEN\b)")  # what is done stands after the last comma
_INSIDE = re.compile(r"\[[^\[\]]*\]|\([^()]*\)")  # brackets and what they hold
_DEEPEST = 8  # brackets in brackets; a statement with more is not understood
_ASSIGNMENT = any_case(r"^[A-Z_$][\w$.]*\s*=")
_ASSIGNED = any_case(r"^([A-Z_][\w$.]*)\s*(?:\[[^=<>]*\][\w$.]*)?\s*=")
#: What a statement may set: registers, signals (A and E are German ones), frames, clocks and speeds.
_SETTABLE = any_case(
    r"(?:PR|SR|AR|R|P|PL|F|M|A|E|[DRGASUW]O|[DRGAUW]I|TIMER|RSR|U(?:FRAME|TOOL)(?:_NUM)?|OVERRIDE|(?:JOINT|LINEAR)_MAX_SPEED)"
    r"(?:\..*)?"
)
_PULSE = any_case(r"=\s*PULSE\s*,.*$")  # of an output, for some seconds
#: Statements that move the arm, or let it be moved, and write no register.
MOVERS = any_case(r"^(?:SOFTFLOAT|FORCE\s+CTRL|PALLETIZING)\b")
#: Statements that never move the arm. Whatever else is said may be a macro, which a listing gives by its name alone.
_STILL = any_case(
    r"^(?:LBL|JMP|END|ABORT|ELSE|ENDIF|FOR|ENDFOR|WAIT|TIMER|OVERRIDE|MESSAGE|UALM|PAUSE|PAYLOAD|(?:UN)?LOCK\s+PREG|"
    r"(?:SKIP|OFFSET|TOOL_OFFSET|VOFFSET)\s+CONDITION|COL\s+(?:DETECT|GUARD\s+ADJUST)|STICK\s+DETECT|VISION|"
    r"(?:Arc|Weld|Search)\s+(?:Start|End)|Weave|Track|Touch\s+Offset|LINE_?TRACK|STOP_?TRACKING)\b"
)


_CLEARANCE = any_case(r"^FB-PSPS\b")  # of a German plant: TC_ONLINE, a condition under which the robot goes on


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
        text = _PULSE.sub("=ON", text).rpartition(",")[2].strip()
    return not (_STILL.match(text) or _ASSIGNMENT.match(text) or CALL.search(text))


def is_unknown(text: str) -> bool:
    """Whether a statement in English words is none that is known: a macro, or what was left in another language."""
    assigned = _ASSIGNED.match(conditional_action(text) or text)
    if assigned is not None and not _SETTABLE.fullmatch(assigned[1]):
        return True
    return may_move_arm(text) and not (CALL.search(text) or _CLEARANCE.match(text))


#: What writes position registers, user frames or tools, or runs what may.
_WRITES = any_case(
    r"(?<![A-Z_$])(?:PR|UFRAME|UTOOL)\s*\[[^=<>]*=|\$MNU|\bSearch\s+(?:Start|End)\b|P-SPS|\bMONITOR\b|\bRUN\b|^\s*\$"
)


def may_write_registers(text: str, settled: Collection[str] = (), *, options: bool = False) -> bool:
    """Whether a statement may write a position register, a user frame or a tool.

    Args:
        text: The statement, or the options of a motion.
        settled: Programs, in capitals, of which it is known that they do not.
        options: The text is that of options.
    """
    names = [name.upper() for name in CALL.findall(text)]
    if any(name not in settled for name in names) or _WRITES.search(without_words(text)):
        return True
    return not (options or names or MOVERS.match(text)) and may_move_arm(text)


def conditional_action(text: str) -> str | None:
    """What a statement does on a condition: IF ...,PR[1]=PR[2]; None for one that does what it says."""
    if not _CONDITIONAL.match(text):
        return None
    depth, at = 0, len(text)
    for i, character in enumerate(text):
        depth += (character in "[(") - (character in "])")
        if character == "," and depth == 0:
            at = i + 1
    return text[at:].strip()


@dataclass(frozen=True, slots=True)
class Bracket:
    """What begins a part of a program, and what ends it."""

    opens: re.Pattern[str]
    closes: re.Pattern[str]
    reason: str = ""  # why motions in it cannot be corrected


def _bracket(opens: str, closes: str, reason: str = "") -> Bracket:
    return Bracket(any_case(opens), any_case(closes), reason)


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
    _bracket(r"\bTrack\s+DPM", r"\bTrack\s+End\b", "while its path is modified at run time (DPM)"),
    _bracket(r"^SOFTFLOAT\s*\[", r"^SOFTFLOAT\s+END\b", "while soft float lets the arm give way"),
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
        (r"\bLINE_TRACK\b|\bSTOP_TRACKING\b", "line tracking changes the executed path"),
        (r"\bWeave\b", "weaving changes the executed path"),
        (r"\bTouch Offset\b|\bSearch Start\b|\bTrack\s+(?:TAST|AVC|MPS)", "sensing changes the executed path"),
        (r"(?i)\bTrack\s+DPM", "DPM modifies the path at run time"),
        (r"(?i)^SOFTFLOAT\s*\[", "soft float lets the arm give way"),
        (r"(?i)^FORCE\s+CTRL\b", "force control moves the robot until it feels its force"),
        (POSITION_WRITTEN.pattern, "a position is written at run time, not the file's"),
    )
)
_FRAME_REASON = {
    "UFRAME": "UFRAME[] is written: the frame is not the one of the table",
    "UTOOL": "UTOOL[] is written: the tool is not the one of the table",
}


@dataclass(frozen=True, slots=True)
class OffsetCondition:
    """A statement that gives the offset of later motions that have an option, and no register of their own."""

    pattern: re.Pattern[str]
    option: re.Pattern[str]  # where it stands without a register
    reason: str


OFFSET_CONDITIONS = tuple(
    OffsetCondition(
        any_case(rf"(?<![A-Z_]){option}\s+CONDITION\b"),
        any_case(rf"(?<![A-Z_]){option}(?![A-Z_]|\s*,)"),
        f"{option} CONDITION adds an offset at run time to motions with {word}",
    )
    for option, word in (("OFFSET", "Offset"), ("TOOL_OFFSET", "Tool_Offset"), ("VOFFSET", "VOFFSET"))
)
CONDITION_OF_OFFSET = any_case(r"^(OFFSET|TOOL_OFFSET)\s+CONDITION\b(\s+PR(?=\[))?")  # of which, and from a register
BESIDE = any_case(r"^(?:.*,)?\s*(?:RUN\s|MONITOR\b)")  # another program runs at the same time
FRAME_BEGINS = re.compile(rb"(?:FRAME|TOOL)[ \t]*\[", re.IGNORECASE)  # looked for before any statement is read
#: Text of /APPL, in any print of blanks and letters.
UNSAFE_HEADERS = (
    UnsafeStatement(
        any_case(r"\bENABLE_SINGULARITY_AVOIDANCE\s*:\s*TRUE\b"), "singularity avoidance may change the executed path"
    ),
    UnsafeStatement(any_case(r"\bLINE_TRACK_SCHEDULE"), "line tracking changes the executed path"),
)


def written_frames(text: str) -> list[tuple[str, int | None]]:
    """UFRAME or UTOOL, and the number, that a statement writes; None for a number that is found at run time."""
    indices = [(f"U{match[1].upper()}", match[2].partition(":")[0].strip()) for match in FRAME_WRITTEN.finditer(text)]
    return [(kind, int(index) if index.isdigit() else None) for kind, index in indices]


def unsafe_words(text: str, *, frames: bool = True) -> list[str]:
    """Why a statement that is no motion makes a correction unsafe; empty when it does not.

    Args:
        text: The statement.
        frames: A frame or tool that it writes is one of them.
    """
    reasons = [statement.reason for statement in UNSAFE_STATEMENTS if statement.pattern.search(text)]
    if not frames:
        return reasons
    return reasons + [_FRAME_REASON[kind] for kind in dict.fromkeys(kind for kind, _ in written_frames(text))]


# ---- Modal state -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ModalStatement:
    """A setting that later motions obey."""

    name: str
    pattern: re.Pattern[str]
    ends_with_program: bool = True  # otherwise it stays with the controller
    evaluated_live: bool = False  # while the robot moves, not when it is said


MODAL_STATEMENTS = (
    ModalStatement("UFRAME_NUM", any_case(r"UFRAME_NUM\s*(?:\[[^\]]*\])?\s*="), ends_with_program=False),
    ModalStatement("UTOOL_NUM", any_case(r"UTOOL_NUM\s*(?:\[[^\]]*\])?\s*="), ends_with_program=False),
    ModalStatement("PAYLOAD", any_case(r"PAYLOAD\s*\["), ends_with_program=False),
    ModalStatement("TOOL_OFFSET CONDITION", any_case(r"TOOL_OFFSET\s+CONDITION\b")),
    ModalStatement("OFFSET CONDITION", any_case(r"(?<![A-Z_])OFFSET\s+CONDITION\b")),
    ModalStatement("VOFFSET CONDITION", any_case(r"VOFFSET\s+CONDITION\b")),
    ModalStatement("SKIP CONDITION", any_case(r"SKIP\s+CONDITION\b"), evaluated_live=True),
    ModalStatement("COL DETECT", any_case(r"COL\s+DETECT\b")),
    ModalStatement("COL GUARD ADJUST", any_case(r"COL\s+GUARD\s+ADJUST\b")),
    ModalStatement("JOINT_MAX_SPEED", any_case(r"JOINT_MAX_SPEED\s*(?:\[[^\]]*\])?\s*=")),
    ModalStatement("LINEAR_MAX_SPEED", any_case(r"LINEAR_MAX_SPEED\s*=")),
)
FRAME_NUMBER = any_case(r"^(UFRAME_NUM|UTOOL_NUM)(?:\[(?:GP)?1\])?\s*=\s*(.*?)\s*$")  # which, and its value
#: The same written, whatever else the statement has.
FRAME_MENTIONED = any_case(r"(?:\b(?:UFRAME_NUM|UTOOL_NUM)\b|\$MNU(?:FRAME|TOOL)NUM\b).*=")
PAYLOAD_ALONE = any_case(r"^PAYLOAD\s*\[\s*(\d+)\s*\]$")  # its schedule
ASSIGNED_NUMBER = re.compile(r"=\s*(\d+)\s*$")
