"""Findings: what a user must know of a result; and the progress of a run."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum

from compgen.core.one_line import one_line

#: Called with the stage that runs and the share of it that is done, 0 to 1.
Progress = Callable[[str, float], None]


class Level(StrEnum):
    """How much a finding weighs."""

    OUTSIDE = "outside"  # a bound is broken: the job fails
    REFUSED = "refused"  # what was identified may not be used
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True, slots=True)
class Finding:
    """Something the user must know."""

    level: Level
    code: str
    message: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "message", one_line(self.message))

    def record(self) -> dict[str, str]:
        """The finding as a report writes it."""
        return {"level": self.level.value, "code": self.code, "message": self.message}


def first_message(level: Level, findings: Iterable[Finding]) -> str:
    """The message of the first finding of a level; empty where there is none."""
    return next((f.message for f in findings if f.level is level), "")
