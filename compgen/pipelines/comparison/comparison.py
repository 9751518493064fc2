"""Two outputs of one kind, side by side: what changed in what went in, and in what came out."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.commands import Command
from compgen.core.exceptions import InputError
from compgen.core.findings import beyond_text
from compgen.core.toml import dotted_keys
from compgen.core.units import UM
from compgen.pipelines.comparison import numbers
from compgen.pipelines.comparison.numbers import SHOWN, ErrorAlong, error_along, tolerance_of
from compgen.pipelines.comparison.outputs import Output, naming_damage, number, read_output
from compgen.pipelines.comparison.positions import Movement, movement
from compgen.pipelines.comparison.texts import first_page_anew
from compgen.verification.verdict import Verdict

ERROR = SHOWN["_um"] * UM  # [m]
_COLUMN = {"before": "before_on_part_max_um", "after": "after_on_part_max_um"}  # of a scenario
FindingText = tuple[str, str, str]  # of a finding: level, code, message


@dataclass(frozen=True, slots=True)
class Pair:
    """A value of both; None where one has none."""

    key: str
    a: Any
    b: Any

    @property
    def change(self) -> int | float | None:
        """b - a of two numbers."""
        both = (self.a, self.b)
        if not all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in both):
            return None
        difference: int | float = self.b - self.a
        return difference

    @property
    def is_same(self) -> bool:
        """Whether they are equal, or two numbers that differ by less than what a table of them shows."""
        difference = self.change
        if self.a == self.b or difference is None:
            return bool(self.a == self.b)
        return abs(difference) < tolerance_of(self.key, self.a, self.b)


@dataclass(frozen=True, slots=True)
class ChangedFindings:
    """Findings that one output has alone: level, code, message; those of B that A has with other numbers in them."""

    gone: tuple[FindingText, ...]
    new: tuple[FindingText, ...]
    changed: tuple[FindingText, ...]


@dataclass(frozen=True, eq=False, slots=True)
class MatchedScenarios:
    """Scenarios that both studies have, and how their largest errors changed."""

    both: int  # with the same values, done in both
    only_a: int
    only_b: int
    changes: Mapping[str, Array]  # side to b - a [m], of scenarios that have it in both
    worst: Mapping[str, Mapping[str, Any]]  # side to the values of the scenario that changed most

    @property
    def is_equal(self) -> bool:
        """Whether both studies have the same scenarios with the same errors."""
        return not (
            self.only_a or self.only_b or any(np.any(np.abs(change) >= ERROR) for change in self.changes.values())
        )


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Comparison:
    """What differs between outputs A and B."""

    a: Output
    b: Output
    notes: tuple[str, ...]  # what makes the two less alike than they look
    inputs: tuple[Pair, ...] | None  # that differ; None where a report has none, from before they were in it
    error: tuple[Pair, ...]
    time: tuple[Pair, ...]
    program: tuple[Pair, ...]
    movement: Movement | str  # of the commanded positions, or why it is not known
    findings: ChangedFindings
    scenarios: MatchedScenarios | None  # of two studies
    courses: tuple[ErrorAlong | None, ErrorAlong | None]  # the errors over the path

    @property
    def kind(self) -> Command:
        """The command that wrote both."""
        return self.a.kind

    @property
    def is_equal(self) -> bool:
        """Whether inputs, numbers, positions and findings are the same, as far as all of them are known."""
        pairs = (*self.error, *self.time, *self.program)
        moved = isinstance(self.movement, Movement) and not self.movement.is_same
        other_findings = self.findings.gone or self.findings.new or self.findings.changed
        differs = any(not pair.is_same for pair in pairs) or moved or other_findings or self.inputs != ()
        return not (differs or (self.scenarios is not None and not self.scenarios.is_equal))

    @property
    def final_error(self) -> float | None:
        """The largest error that B leaves [um]."""
        return numbers.final_error(self.b)

    def broken_bound(self, max_um: float) -> str | None:
        """Why B is not within a largest error [um]; None where it is. What was not corrected never is."""
        verdict = next((pair.b for pair in self.error if pair.key == "verdict"), None)
        if self.final_error is None:
            return "no error of B is known"
        if verdict in (Verdict.NOT_CORRECTED, Verdict.NOT_LOADABLE):
            return f"B is {verdict}"
        if failed := next((pair.b for pair in self.program if pair.key == "failed"), 0):
            return f"of B {'1 scenario' if failed == 1 else f'{failed} scenarios'} failed"
        if self.final_error <= max_um:
            return None
        return f"B is {beyond_text(self.final_error, max_um)} um off, --max-um {max_um:g}"


def compare(first: str, second: str) -> Comparison:
    """Compare two outputs.

    Args:
        first: Folder of an output, or its JSON report: A.
        second: The other: B.

    Raises:
        InputError: One is none, damaged, edited since, of another kind or schema; or both are one.
    """
    a, b = read_output(first), read_output(second)
    if a.file.resolve() == b.file.resolve():
        raise InputError(f"{first} and {second}: both are {a.file}; give two outputs")
    if a.kind != b.kind:
        raise InputError(f"{first} is of cgen {a.kind}, {second} of cgen {b.kind}: not of one kind; give two of one")
    inputs, of_a, of_b = _changed_inputs(a, b), numbers.report_numbers(a), numbers.report_numbers(b)
    return Comparison(
        a=a,
        b=b,
        notes=tuple(_notes(a, b, inputs)),
        inputs=inputs,
        error=_pairs(of_a.error, of_b.error),
        time=_pairs(of_a.time, of_b.time),
        program=_pairs(of_a.program, of_b.program),
        movement=movement(a, b),
        findings=_changed_findings(numbers.findings_of(a), numbers.findings_of(b)),
        scenarios=match_scenarios(a, b) if a.kind == Command.WHATIF else None,
        courses=(error_along(a), error_along(b)),
    )


def _pairs(a: Mapping[str, Any], b: Mapping[str, Any]) -> tuple[Pair, ...]:
    return tuple(Pair(key, a.get(key), b.get(key)) for key in dict.fromkeys([*a, *b]))


def _changed_findings(a: list[FindingText], b: list[FindingText]) -> ChangedFindings:
    only_a, only_b = Counter(a) - Counter(b), Counter(b) - Counter(a)
    kinds = [{finding[:2] for finding in only} for only in (only_a, only_b)]
    return ChangedFindings(
        gone=tuple(finding for finding in only_a.elements() if finding[:2] not in kinds[1]),
        new=tuple(finding for finding in only_b.elements() if finding[:2] not in kinds[0]),
        changed=tuple(finding for finding in only_b.elements() if finding[:2] in kinds[0]),
    )


def match_scenarios(a: Output, b: Output) -> MatchedScenarios:
    """The scenarios of two studies by the values of all keys that either varied."""
    tables = []
    for output in (a, b):
        with naming_damage(output):
            keys = [str(key) for key in output.record["keys"]]
            rows = [row for row in output.record["scenarios"] if row["state"] == "done"]
            tables.append({tuple(sorted((key, _value(row[key])) for key in keys)): row for row in rows})
    same = [values for values in tables[0] if values in tables[1]]
    changes, worst = {}, {}
    for side, column in _COLUMN.items():
        with naming_damage(b):
            pairs = [(values, tables[0][values], tables[1][values]) for values in same]
            rows = [
                (v, (number(y[column]) - number(x[column])) * UM) for v, x, y in pairs if column in x and column in y
            ]
        if rows:
            changes[side] = np.array([change for _, change in rows])
            worst[side] = dict(rows[int(np.abs(changes[side]).argmax())][0])
    return MatchedScenarios(len(same), len(tables[0]) - len(same), len(tables[1]) - len(same), changes, worst)


def _value(cell: Any) -> str:
    """A varied value in one spelling: 20 of a list is 20.0 of a range."""
    try:
        return f"{float(cell):.12g}"
    except (ValueError, TypeError):
        return str(cell)


def _changed_inputs(a: Output, b: Output) -> tuple[Pair, ...] | None:
    """Keys with other values; None where a report has no inputs."""
    flat = []
    for output in (a, b):
        with naming_damage(output):
            inputs = output.record.get("inputs")
            if not inputs:
                return None
            keys = {**inputs.get("path", {}), **{k: v for k, v in inputs.items() if k not in ("path", "robot")}}
            named = dotted_keys(keys) | dotted_keys({"robot": inputs["robot"]})  # as --set takes them
            flat.append({key: value for key, value in named.items() if value not in (None, [])})
    return tuple(pair for pair in _pairs(*flat) if pair.a != pair.b)


def _notes(a: Output, b: Output, inputs: tuple[Pair, ...] | None) -> Iterator[str]:
    if a.version != b.version:
        yield f"A is of compgen {a.version}, B of {b.version}: numbers may differ for that alone"
    if a.subject != b.subject:
        yield f"A is of {a.subject}, B of {b.subject}"
    for output in (a, b):
        if (page := first_page_anew(output)) is not None:
            yield (
                f"{output.name}: pages from {page} on were written anew since its report: positions are theirs, errors "
                "and times those of before; resume.json has what they leave"
            )
    if inputs is None:
        older = a if not a.record.get("inputs") else b
        yield f"{older.name}: its report has no inputs, so that what changed in them is not known; run it anew"
