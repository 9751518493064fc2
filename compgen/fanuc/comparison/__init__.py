"""A program as it was written and as a controller gives it back, and one thing in which they differ."""

from dataclasses import dataclass

NOTHING = "-"  # where the other one has something


@dataclass(frozen=True, slots=True)
class Difference:
    """What was written and what came back, as texts."""

    where: str  # "P[17]", "line 24", "head"
    what: str  # "X", "speed", "statement", ...
    written: str
    backup: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what}: written {self.written}, backup {self.backup}"

    def record(self) -> dict[str, str]:
        """The difference as a report writes it."""
        return {"where": self.where, "what": self.what, "written": self.written, "backup": self.backup}
