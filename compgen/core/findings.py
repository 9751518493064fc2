"""Findings: what a user must know of a result; and what a message of one line may be at most."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import inf
from typing import Self

from compgen.core.finding_codes import Code, Level

MOST_CHARACTERS = 300
MOST_DECIMALS = 12
_FAILING = (Level.OUTSIDE, Level.REFUSED)
_MICROMETRES = re.compile(r"(\d+(?:\.\d+)?) um(?![\w/])")
_ENDING = 100  # characters kept of the end, where the mend stands
_LAST_WORD, _FIRST_WORD = re.compile(r" \S{0,20}$"), re.compile(r"^\S{0,20} ")  # which a cut may go through

# what findings are to their reader; the rest says how much something is worth, and is read by its micrometres
# fmt: off
#: metal may go elsewhere, or the program is not the one that was meant
OF_SAFETY = frozenset({
    Code.UNITS_UNLIKELY, Code.PATH_BULGE, Code.PATH_BELOW, Code.PATH_END, Code.PATH_STEPOVER, Code.EXECUTED_OTHER,
    Code.EXECUTED_ANOTHER, Code.EXECUTED_OFFSET, Code.EXECUTED_OLDER, Code.LENGTHS, Code.TIMING_LIMIT,
    Code.MOTION_PREDISTORTED, Code.PATH_FILE, Code.PATH_ARCS_ORIENTATION, Code.FRAME_HOT, Code.FRAME_MODEL, Code.STATE,
    Code.ANCHOR_MOVED, Code.TOUCHES_REACH, Code.TOUCHES_WAY, Code.RESUME_JOIN, Code.WRITTEN_ROBOT_FILE,
    Code.CONTROLLER_SIGNATURE, Code.CONTROLLER_SIZE, Code.PROGRAM_DRY_RUN, Code.PROGRAM_CONTRADICTION,
    Code.ROBOT_UNATTAINABLE, Code.ROBOT_NAMED, Code.CORRECTION_WORSE, Code.CORRECTION_TURN, Code.CORRECTION_REACH,
    Code.CORRECTION_ARC, Code.CORRECTION_FLAT_ARC, Code.OFFSETS_DOUBLED, Code.EXECUTED_RECORD,
    Code.PROGRAM_CALLED,
})
#: something is left as it was, or was not looked at
NOT_DONE = frozenset({
    Code.SURFACE_MESH, Code.SOURCES_START, Code.BOUNDS_NONE, Code.EXECUTED_UNSURE, Code.EXECUTED_PART,
    Code.EXECUTED_NO_CLOCK, Code.EXECUTED_NOTHING, Code.EXECUTED_GAPS, Code.EXECUTED_AWAY, Code.EXECUTED_UNJUDGED,
    Code.UNOBSERVABLE, Code.SET_ASIDE, Code.STILL, Code.NARROW, Code.OUTLIER, Code.OUTLIERS, Code.HELD, Code.WARM_UP,
    Code.THERMAL_NONE, Code.THERMAL_COLD, Code.SOURCES_LOADS, Code.POSTERIOR_MISSING, Code.POSTERIOR_OVERRIDDEN,
    Code.COMPENSATION_LIMITED, Code.MOTION_KNOWN, Code.MOTION_RUNS, Code.MOTION_UNKNOWN, Code.ANCHOR_TOUCH,
    Code.ANCHOR_LEFT_OUT, Code.ANCHOR_COLD, Code.TOUCHES_UNKNOWN_PLACE, Code.TOUCHES_TOO_FEW, Code.ROBOT_GROUPS,
    Code.CORRECTION_NONE, Code.CORRECTION_ORDER, Code.CORRECTION_UNSAFE, Code.CORRECTION_HELD, Code.CORRECTION_LIMITED,
    Code.CORRECTION_SHARED, Code.CORRECTION_MIXED, Code.CORRECTION_STRAIGHT, Code.CORRECTION_MARK,
    Code.OFFSETS_JOINT_FORM, Code.OFFSETS_WORLD,
})
#: whose notes say of every job the same: a screen counts them; what is not known is none of these
OF_EVERY_JOB = frozenset({
    Code.MOTION_SLOWED, Code.MOTION_LAG, Code.TIMING_BELOW_FEED, Code.TIMING_FEED_ERROR, Code.TIMING_WHOLE_PERIODS,
    Code.COMPENSATION_SOLVER, Code.PATH_LEAD_IN, Code.PATH_THINNED, Code.PATH_ARCS,
})
# fmt: on


def printable(text: str) -> str:
    """A text whose characters that control a terminal or a page, or are no letters, stand as escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def one_line(message: str) -> str:
    """A message in one line of printable characters, at most ``MOST_CHARACTERS``; a longer one loses its middle."""
    line = printable(" ".join(message.split()))
    if len(line) <= MOST_CHARACTERS:
        return line
    mark = " ... "
    head, ending = line[: MOST_CHARACTERS - _ENDING - len(mark)], line[-_ENDING:]
    return f"{_LAST_WORD.sub('', head)}{mark}{_FIRST_WORD.sub('', ending)}"


def beyond_text(value: float, limit: float, decimals: int = 2) -> str:
    """A value with as many decimals as show on which side of a limit it is: 2.5004, not 2.50, beyond 2.5.

    Args:
        value: In the unit of the message.
        limit: In the same.
        decimals: As many at least.
    """
    for places in range(decimals, MOST_DECIMALS):
        text = f"{value:.{places}f}"
        if (float(text) > limit) == (value > limit) and (float(text) < limit) == (value < limit):
            return text
    return f"{value!r}"


@dataclass(frozen=True, slots=True)
class Finding:
    """Something the user must know."""

    level: Level
    code: Code
    message: str

    def __post_init__(self) -> None:
        if self.level not in self.code.levels:
            raise ValueError(f"a finding {self.code} is no {self.level}: {', '.join(self.code.levels)}")
        object.__setattr__(self, "message", one_line(self.message))

    @classmethod
    def of(cls, code: Code, message: str) -> Self:
        """A finding of a code that has one level."""
        (level,) = code.levels
        return cls(level, code, message)

    def record(self) -> dict[str, str]:
        """The finding as a report writes it."""
        return {"level": self.level.value, "code": self.code.value, "message": self.message}


def in_reading_order(findings: Iterable[Finding | Mapping[str, str]]) -> list[Finding]:
    """Findings, or their records, as they are read: of safety, of what was not done, then the rest by micrometres."""
    each = (
        f if isinstance(f, Finding) else Finding(Level(f["level"]), Code(f["code"]), f["message"]) for f in findings
    )
    return sorted(each, key=_reading_rank)


def _reading_rank(finding: Finding) -> tuple[int, bool, float]:
    """The kind; what fails a run before the rest; the most micrometres that are said, a warning without any first."""
    sizes = [float(number) for number in _MICROMETRES.findall(finding.message)]
    unsized = inf if finding.level is Level.WARNING else 0.0
    rank = 0 if finding.code in OF_SAFETY else 1 if finding.code in NOT_DONE else 2
    return rank, finding.level not in _FAILING, -max(sizes, default=unsized)


def is_for_every_job(finding: Finding) -> bool:
    """Whether it is a note that says the same of every job; no warning is."""
    return finding.level is Level.NOTE and finding.code in OF_EVERY_JOB


def first_message(level: Level, findings: Iterable[Finding]) -> str:
    """The message of the first finding of a level; empty where there is none."""
    return next((f.message for f in findings if f.level is level), "")
