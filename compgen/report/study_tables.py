"""A study as data: its scenarios as a grid, CSV tables, JSON, and a headline in one sentence."""

import csv
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compgen.core.commands import Command
from compgen.core.csv_table import text_cell
from compgen.core.units import counted
from compgen.core.version import __version__
from compgen.job.job import Job
from compgen.pipelines.study import Answer, Study, StudyRow
from compgen.report.band_words import NO_BAND, rounded
from compgen.report.inputs import made_from
from compgen.report.key_words import ascii_units, unit_of, words_of

Value = float | str


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class StudyOutcome:
    """What a study of a path file came to, and the answers to its questions."""

    study: Study | None  # None where only questions were asked
    rows: list[StudyRow]
    answers: list[Answer]
    base: Job | None = None  # that all scenarios share; None where none can be read without their values
    max_um: float | None = None  # the largest error allowed, where the command line says one


@dataclass(frozen=True, slots=True)
class Grid:
    """Rows of a study, and the values of what was varied."""

    keys: tuple[str, ...]
    rows: tuple[StudyRow, ...]
    numeric: frozenset[str]  # keys whose values are all numbers

    @property
    def done(self) -> list[StudyRow]:
        """Scenarios with an error."""
        return [row for row in self.rows if row["state"] == "done"]

    @property
    def failed(self) -> list[StudyRow]:
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
        return sorted(values, key=float) if key in self.numeric else list(values)

    def value(self, row: StudyRow, key: str) -> Value:
        """A key's value in a scenario: a number where all of its values are."""
        return float(row[key]) if key in self.numeric else str(row[key])

    def worst(self) -> StudyRow:
        """The scenario with the largest error that is left: after correction where they were corrected."""
        return max(self.done, key=lambda row: (row.get(f"{self.sides[-1]}_on_part_max_um", -1.0), -row["index"]))

    def held_at_worst(self, drawn: Sequence[str]) -> "tuple[Grid, str]":
        """The rows in which all keys but those drawn are as in the worst scenario, and those keys in words."""
        others = [key for key in self.varied if key not in drawn]
        if not others:
            return self, ""
        worst = self.worst()
        rows = tuple(row for row in self.rows if all(row[key] == worst[key] for key in others))
        held = ", ".join(f"{words_of(key)} {value_words(key, self.value(worst, key))}" for key in others)
        return Grid(self.keys, rows, self.numeric), f"Held as in the scenario that errs most: {held}."


def grid_of(keys: Sequence[str], rows: Sequence[StudyRow]) -> Grid:
    """The grid of a study's rows."""
    numeric = frozenset(key for key in keys if all(_number(row[key]) is not None for row in rows))
    return Grid(tuple(keys), tuple(rows), numeric)


def value_words(key: str, value: Value) -> str:
    """A value with the unit of its key."""
    return f"{plain(value)} {unit_of(key)}".strip()


def plain(value: Value) -> str:
    """A value as a label."""
    return f"{value:.6g}" if isinstance(value, float) else value


def _number(value: Any) -> float | None:
    try:
        return float(value)
    except (TypeError, ValueError):
        return None


def study_csv(study: Study, rows: list[StudyRow]) -> bytes:
    """A row for each scenario, in the order of the study."""
    return _csv(study_columns(study, rows), rows)


def answer_csv(answer: Answer) -> bytes:
    """The numbers behind an answer."""
    names = [*answer.columns, *(["what"] if answer.labels else [])]
    rows = [
        {
            **{n: "" if np.isnan(v) else float(f"{v:.6g}") for n, v in zip(answer.columns, line, strict=True)},
            **({"what": answer.labels[i]} if answer.labels else {}),
        }
        for i, line in enumerate(answer.table)
    ]
    return _csv(names, rows)


def _csv(names: list[str], rows: list[StudyRow]) -> bytes:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    for cells in (names, *([row.get(name, "") for name in names] for row in rows)):
        writer.writerow([text_cell(cell) if isinstance(cell, str) else cell for cell in cells])
    return out.getvalue().encode()


def study_columns(study: Study, rows: list[StudyRow]) -> list[str]:
    """Columns of a study's table: index, what was varied, state, every result, reason."""
    results = dict.fromkeys(name for row in rows for name in row)
    first = ["index", *study.keys, "state"]
    return [*first, *(name for name in results if name not in (*first, "reason")), "reason"]


def study_json(
    path: str,
    overrides: Sequence[str],
    study: Study | None,
    rows: list[StudyRow],
    sentences: list[str],
    base: Job | None,
    live: dict[str, Any] | None,
) -> bytes:
    """Study, answers and scenarios as JSON; without a study, where only questions are asked, no scenarios."""
    data = {
        "schema": 1,
        "command": Command.WHATIF,
        "path": path,
        "study_sha256": study.identity if study else None,
        "keys": list(study.keys) if study else [],
        "overrides": list(overrides),
        "answers": sentences,
        **({} if live is None else {"live": live}),
        "scenarios": rows,
        "provenance": {"compgen": __version__, **({} if base is None else made_from(base))},
        "inputs": None if base is None else shared_inputs(base.inputs, study.keys if study else ()),
    }
    return (json.dumps(data, indent=1, allow_nan=False) + "\n").encode()


def shared_inputs(inputs: Mapping[str, Any], varied: Sequence[str]) -> dict[str, Any]:
    """A job's inputs without the keys that are varied, and without what lies in tables that are; null in a list."""

    def is_shared(key: str) -> bool:
        return not any(f"{key}.".startswith(f"{name}.") for name in varied)

    def shared(value: Any, key: str) -> Any:
        if isinstance(value, Mapping):
            return {name: shared(v, f"{key}{name}.") for name, v in value.items() if is_shared(f"{key}{name}")}
        if isinstance(value, list):
            return [shared(v, f"{key}{n}.") if is_shared(f"{key}{n}") else None for n, v in enumerate(value)]
        return value

    return {name: shared(table, "robot." if name == "robot" else "") for name, table in inputs.items()}


def band_caveat(rows: list[StudyRow]) -> str:
    """How far the part may be off beyond a study's numbers, or who says so."""
    bands = [row["band_um"] for row in rows if "band_um" in row]
    beyond = "what is not measured comes on top: cgen predict names it"
    if not bands:
        return "these sizes are the model's; cgen predict says how well they are known"
    if not max(bands):
        return f"uncertainty of the robot data: {NO_BAND}; {beyond}"
    low, high = rounded(min(bands)), rounded(max(bands))
    amount = low if low == high else f"{low} to {high}"
    sensors = [row["sensor_um"] for row in rows if "sensor_um" in row]
    unseen = f", unless a temperature sensor is off unseen (0 to {rounded(max(sensors))} um)" if sensors else ""
    return f"uncertainty of the robot data: {amount} um (95 %){unseen}; {beyond}"


def of_beyond_measured(rows: list[StudyRow]) -> Iterator[str]:
    """That scenarios leave what the heat model was measured over, by the first of them."""
    beyond = [row for row in rows if "beyond_measured" in row]
    if beyond:
        count = f"{len(beyond)} of {counted(len(rows), 'scenario', 'scenarios')}"
        yield f"{count} beyond what was measured: scenario {beyond[0]['index']}: {beyond[0]['beyond_measured']}"


def largest_and_least(study: Study, rows: list[StudyRow]) -> str:
    """The largest and least error of a grid, in one sentence."""
    done = [r for r in rows if r["state"] == "done"]
    failed = len(rows) - len(done)
    text = counted(len(rows), "scenario", "scenarios") + (f", {failed} failed" if failed else "")
    if not done:
        return text
    grid = grid_of(study.keys, rows)
    low, high = (f(done, key=lambda r: (r["before_on_part_max_um"], r["index"])) for f in (min, max))

    def at(row: StudyRow) -> str:
        return ascii_units(", ".join(f"{words_of(k)} {value_words(k, grid.value(row, k))}" for k in study.keys))

    sizes = [f"{row['before_on_part_max_um']:.1f} um ({at(row)})" for row in (low, high)]
    text += f": error {sizes[0]} to {sizes[1]}"
    if any("after_on_part_max_um" in r for r in done):
        worst = max((r for r in done if "after_on_part_max_um" in r), key=lambda r: r["after_on_part_max_um"])
        outside = sum(not r.get("inside", True) for r in done)
        text += f"; corrected at most {worst['after_on_part_max_um']:.2f} um, {outside} outside bounds"
    return text
