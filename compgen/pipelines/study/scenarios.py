"""Scenarios: the grid or list of keys that a study varies, checked before any of them runs."""

import itertools
import json
import math
import re
import tomllib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from compgen.core.csv_table import read_csv
from compgen.core.exceptions import CompgenError, InputError, TableError
from compgen.core.files import read_regular
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.toml import suggest, toml_value
from compgen.core.version import __version__
from compgen.pipelines.files.path_file import load_job

MOST = 100_000
_NUMBERS_WITH_COLONS = re.compile(r"[\s\d.+\-eE]+(:[\s\d.+\-eE]*)+")
_RANGE = re.compile(r"[^:]+:[^:]+:\s*\+?\d+\s*")
_GAP, _QUOTED = re.compile(r"^\s*,|,\s*,"), re.compile(r"[\"'\[{]")
_ROW = re.compile(r"(\w+)\.\d+\.")  # of a key, the table of a list that it is in
#: what refusals of keys say that no file has
UNKNOWN = ("unknown key", "there is no", "no such file", "nested more than", "must be a table")
#: short names of keys that studies vary most
SHORT = {
    "feed": "process.feed_mm_s",
    "duty": "before.0.duty",
    "warmup_h": "before.0.duration_h",
    "warmup_feed": "before.0.feed_mm_s",
    "ambient": "ambient.value_degC",
    "stepover": "path.stepover_mm",
    "chord": "process.chord_um",
    "cte": "robot.thermal.cte_um_m_K",
    "payload": "robot.thermal.network.payload_kg",
    "model": "robot.thermal.model",
}


#: why the files refuse some values, by key; None where they take them
Refused = Callable[[Iterable[tuple[str, str]]], CompgenError | None]


@dataclass(frozen=True, slots=True)
class Scenario:
    """One combination of values."""

    index: int  # from 0, in the order of the grid
    values: tuple[tuple[str, str], ...]  # full key and value as TOML

    def overrides(self) -> list[str]:
        """As ``--set`` takes them."""
        return [f"{key}={value}" for key, value in self.values]


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """All scenarios of a path."""

    path: str
    robot: str | None
    base: tuple[str, ...]  # overrides that all share
    keys: tuple[str, ...]
    scenarios: tuple[Scenario, ...]
    correct: bool
    identity: str  # hash of everything that the results depend on
    questions: tuple[Finding, ...] = ()  # on values that look like another unit's


def build(
    path: str, robot: str | None, base: Sequence[str], vary: Sequence[str], listed: str | None, *, correct: bool
) -> Study:
    """Read what shall vary.

    Args:
        path: A path file.
        robot: Name or file; default what the path file says.
        base: Overrides that hold for all.
        vary: ``KEY=V1,V2`` or ``KEY=FROM:TO:COUNT``, multiplied with each other.
        listed: A CSV file with keys as header and a scenario in each row, multiplied with the grid.
        correct: Whether each scenario is corrected and proven as well.

    Raises:
        InputError: Nothing to vary, an unknown key, no values or one that the key never takes, too many scenarios.
    """
    scenarios = _scenarios(vary, listed)
    questions: dict[str, Finding] = {}
    hashes: set[str] = set()

    def refused(values: Iterable[tuple[str, str]]) -> CompgenError | None:
        try:
            job = load_job(path, robot, [*base, *(f"{key}={value}" for key, value in values)])
        except CompgenError as failure:
            return failure
        hashes.add(job.inputs_hash)
        questions.update({f.message: f for f in job.input_findings if f.code == Code.UNITS_UNLIKELY})
        return None

    base_inputs = _inputs(path, robot, base, str(refused(scenarios[0].values)))
    _check_keys(refused, scenarios[0])
    _check_values(refused, scenarios)
    inputs = [__version__, base_inputs, [s.values for s in scenarios], correct, sorted(hashes)]
    return Study(
        path=path,
        robot=robot,
        base=tuple(base),
        keys=tuple(key for key, _ in scenarios[0].values),
        scenarios=scenarios,
        correct=correct,
        identity=sha256(json.dumps(inputs).encode()).hexdigest(),
        questions=tuple(questions.values()),
    )


def _scenarios(vary: Sequence[str], listed: str | None) -> tuple[Scenario, ...]:
    """The rows of a list, each with every combination of what is varied; one that says nothing where none is listed."""
    axes = [_axis(item) for item in vary]
    rows = [dict(zip(keys, row, strict=True)) for keys, table in [_listed(listed)] for row in table] if listed else [{}]
    if not axes and not listed:
        raise InputError("--vary: nothing to vary; give KEY=V1,V2 as in --vary process.feed_mm_s=20,100,200, or --list")
    count = len(rows) * math.prod(len(values) for _, values in axes)
    if count > MOST:
        raise InputError(f"--vary: {count} scenarios are over {MOST}; give fewer values")
    keys = [*rows[0], *(key for key, _ in axes)]
    if twice := next((k for k in keys if keys.count(k) > 1), None):
        raise InputError(f"--vary {twice}: it is varied twice; give its values together")
    combinations = itertools.product(rows, itertools.product(*(values for _, values in axes)))
    return tuple(
        Scenario(n, tuple(zip(keys, (*row.values(), *point), strict=True)))
        for n, (row, point) in enumerate(combinations)
    )


def _inputs(path: str, robot: str | None, base: Sequence[str], refusal: str) -> str:
    """Hash of what all scenarios share; ``refusal``: of the first of them."""
    try:
        return load_job(path, robot, base).inputs_hash
    except CompgenError as failure:  # the base need not run: its scenarios may
        if ("unknown key" in str(failure) and str(failure) == refusal) or not Path(path).is_file():
            raise
        return sha256(read_regular(path) + str(failure).encode() + str(robot).encode()).hexdigest()


def _axis(item: str) -> tuple[str, list[str]]:
    key, equals, text = item.partition("=")
    key = SHORT.get(key.strip(), key.strip())
    if _NUMBERS_WITH_COLONS.fullmatch(text) and not _RANGE.fullmatch(text):
        raise InputError(f"--vary {item[:80]}: not FROM:TO:COUNT; say how many values, as in {key[:60]}=20:200:10")
    if not equals or not key or not item.isprintable():
        raise InputError(f"--vary {item}: expected KEY=V1,V2 as in --vary process.feed_mm_s=20,100,200")
    if _GAP.search(text) and not _QUOTED.search(text):
        raise InputError(f"--vary {item[:80]}: a value is missing between its commas; take a comma away")
    if _RANGE.fullmatch(text) and float(text.rpartition(":")[2]) > MOST:
        raise InputError(f"--vary {item[:80]}: more than {MOST} values; give fewer")
    values = _values(text.strip())
    if not values and _RANGE.fullmatch(text) and float(text.rpartition(":")[2]) == 1:
        raise InputError(
            f"--vary {item[:80]}: one value is no range; give {key[:60]}={text.split(':')[0]}, or more values"
        )
    if not values:
        raise InputError(f"--vary {item}: no values: the grid is empty; give {key}=V1,V2")
    return key, values


def _values(text: str) -> list[str]:
    try:
        first, last, count = (kind(part) for kind, part in zip((float, float, int), text.split(":"), strict=True))
    except ValueError:
        return _typed_values(text)
    if not 1 <= count <= MOST or (count == 1 and first != last):
        return []
    step = (last - first) / max(count - 1, 1)
    return [repr(round(first + n * step, 12)) for n in range(int(count))]


def _typed_values(text: str) -> list[str]:
    """Values between commas as TOML has them, else as words."""
    try:
        table: list[Any] = tomllib.loads(f"x = [{text}]")["x"]
    except (ValueError, RecursionError):
        return [toml_value(word.strip()) for word in text.split(",") if word.strip()]
    return [toml_value(value) for value in table]


def _listed(file: str) -> tuple[list[str], list[list[str]]]:
    """Keys and rows of a CSV file that lists scenarios, values as TOML."""
    table = read_csv(file)
    columns = []
    for name in table.header:
        cells = [_values(cell) for cell in table.words(name)]
        for row, values in enumerate(cells):
            if len(values) != 1:
                raise InputError(
                    f"{table.location(row, name)}: {len(values)} values; give one, and each scenario a row of its own"
                )
        columns.append([values[0] for values in cells])
    keys = [SHORT.get(name, name) for name in table.header]
    if twice := next((key for key in keys if keys.count(key) > 1), None):
        raise InputError(f"{file}: {twice} stands twice in the header, once by its short name; keep one")
    return keys, [list(row) for row in zip(*columns, strict=True)]


def _check_keys(refused: Refused, first: Scenario) -> None:
    """Raises InputError for a key that no file knows."""
    for key, value in first.values:
        message = str(refused([(key, value)]) or "")
        if any(words in message for words in UNKNOWN):
            if message.endswith("must be a table"):
                message += "; vary a key of it"
            elif "." not in key:  # the nearer of what the file and what the short names offer
                message, _, near = message.partition("; did you mean")
                message += suggest(key, [*SHORT, *near.split("'")[1:2]])
            raise InputError(f"--vary {key}: {message}") from None
        row = _ROW.match(key)
        absent = row and ": missing" in message.partition(f": {row[0]}")[2]
        if row and absent and ": missing" in str(refused(first.values) or ""):
            short = next((f"{name}, " for name, long in SHORT.items() if long == key), "")
            raise InputError(
                f"--vary {short}{key}: {message.removesuffix('; add it')}: the file has no such [[{row[1]}]] "
                "to vary; write it there, or give what is missing with --set"
            ) from None


def _check_values(refused: Refused, scenarios: Sequence[Scenario]) -> None:
    """Raises InputError for a value that its key never takes; one that only the arm cannot follow is a failed scenario.

    A value is looked at in the first and in the last scenario that has it: another varied key may change what a key
    takes. Limits are ranges, so of many numbers the least and the largest tell.
    """
    for key in dict(scenarios[0].values):
        last = {dict(scenario.values)[key]: scenario for scenario in scenarios}
        first = {dict(scenario.values)[key]: scenario for scenario in reversed(scenarios)}
        for value in _telling(list(last)):
            failures = [refused(scenario.values) for scenario in (first[value], last[value])]
            where = f": {key.removeprefix('robot.')}: "
            if all(isinstance(failure, TableError) and where in str(failure) for failure in failures):
                raise InputError(f"--vary {key}: {failures[0]}; change this value or leave it out")


def _telling(values: Sequence[str]) -> list[str]:
    """Of numbers the least and the largest, and everything that is no number, each once."""
    numbers: dict[float, str] = {}
    words: dict[str, None] = {}
    for value in values:
        try:
            numbers.setdefault(float(value), value)
        except ValueError:
            words[value] = None
    ends = [numbers[end] for end in dict.fromkeys((min(numbers), max(numbers)))] if numbers else []
    return [*ends, *words]
