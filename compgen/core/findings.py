"""Findings: what a user must know of a result."""

from collections.abc import Iterable
from dataclasses import dataclass

from compgen.core.codes import Code, Level
from compgen.core.message_text import one_line


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


def first_message(level: Level, findings: Iterable[Finding]) -> str:
    """The message of the first finding of a level; empty where there is none."""
    return next((f.message for f in findings if f.level is level), "")
