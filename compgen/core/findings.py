"""Findings: what a user must know of a result; and what a message of one line may be at most."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import inf

from compgen.core.codes import Code, Level
from compgen.core.kinds import NOT_DONE, OF_EVERY_JOB, OF_SAFETY

MOST_CHARACTERS = 300
MOST_DECIMALS = 12
_FAILING = (Level.OUTSIDE, Level.REFUSED)
_MICROMETRES = re.compile(r"(\d+(?:\.\d+)?) um(?![\w/])")
_ENDING = 100  # characters kept of the end, where the mend stands


def printable(text: str) -> str:
    """A text whose characters that control a terminal or a page, or are no letters, stand as escapes."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def one_line(message: str) -> str:
    """A message in one line of printable characters, at most ``MOST_CHARACTERS``; a longer one loses its middle."""
    line = printable(" ".join(message.split()))
    if len(line) <= MOST_CHARACTERS:
        return line
    mark = " ... "
    return f"{line[: MOST_CHARACTERS - _ENDING - len(mark)]}{mark}{line[-_ENDING:]}"


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
