"""The scenarios of a study as a grid: the values of each key in their order, and which of them a figure holds."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from compgen.pipelines.study import Row
from compgen.report.key_words import unit_of, words_of

Value = float | str


@dataclass(frozen=True, slots=True)
class Grid:
    """Rows of a study, and the values of what was varied."""

    keys: tuple[str, ...]
    rows: tuple[Row, ...]
    numeric: frozenset[str]  # keys whose values are all numbers

    @property
    def done(self) -> list[Row]:
        """Scenarios with an error."""
        return [row for row in self.rows if row["state"] == "done"]

    @property
    def failed(self) -> list[Row]:
        """Scenarios without one."""
        return [row for row in self.rows if row["state"] != "done"]

    @property
    def sides(self) -> tuple[str, ...]:
        """Sides of the error that any scenario has: before, and after where they were corrected."""
        return tuple(side for side in ("before", "after") if any(f"{side}_on_part_max_um" in row for row in self.done))

    @property
    def varied(self) -> tuple[str, ...]:
        """Keys with more than one value."""
        return tuple(key for key in self.keys if len(self.values(key)) > 1)

    def values(self, key: str) -> list[Value]:
        """The values of a key, numbers from the least, words as they come."""
        values = dict.fromkeys(self.value(row, key) for row in self.rows)
        return sorted(values, key=_order) if key in self.numeric else list(values)

    def value(self, row: Row, key: str) -> Value:
        """A key's value in a scenario: a number where all of its values are."""
        return float(row[key]) if key in self.numeric else str(row[key])

    def worst(self) -> Row:
        """The scenario with the largest error that is left: after correction where they were corrected."""
        return max(self.done, key=lambda row: (row.get(f"{self.sides[-1]}_on_part_max_um", -1.0), -row["index"]))

    def held_at_worst(self, drawn: Sequence[str]) -> "tuple[Grid, str]":
        """The rows in which all keys but those drawn are as in the worst scenario, and those keys in words."""
        others = [key for key in self.varied if key not in drawn]
        if not others:
            return self, ""
        worst = self.worst()
        rows = tuple(row for row in self.rows if all(row[key] == worst[key] for key in others))
        held = ", ".join(f"{words_of(key)} {in_words(key, self.value(worst, key))}" for key in others)
        return Grid(self.keys, rows, self.numeric), f"Held as in the scenario that errs most: {held}."


def grid_of(keys: Sequence[str], rows: Sequence[Row]) -> Grid:
    """The grid of a study's rows."""
    numeric = frozenset(key for key in keys if all(_number(row[key]) is not None for row in rows))
    return Grid(tuple(keys), tuple(rows), numeric)


def in_words(key: str, value: Value) -> str:
    """A value with the unit of its key."""
    return f"{plain(value)} {unit_of(key)}".strip()


def plain(value: Value) -> str:
    """A value as a label."""
    return f"{value:.6g}" if isinstance(value, float) else value


def _order(value: Any) -> float:
    return float(value)


def _number(value: Any) -> float | None:
    try:
        return float(value)
    except (TypeError, ValueError):
        return None
