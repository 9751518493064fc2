"""TOML files to checked tables: defaults, overrides, and one line for whatever is wrong."""

import difflib
import json
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from reprlib import Repr
from typing import Annotated, Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError
from pydantic_core import ErrorDetails

from compgen.core.exceptions import InputError, TableError
from compgen.core.files import MOST_TABLE_BYTES, near_file, read_regular

DEEPEST = 20  # levels of tables and lists in each other; a thousand of them would exceed Python's own limit
MOST_MISSING = 8  # keys that one message names

_REPR = Repr()  # of values in messages
_REPR.maxlevel, _REPR.maxstring = 2, 60
#: C0 and C1 but for tab and line feed, line and paragraph separators, marks that turn the direction of writing
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufeff]")
_MANY_DIGITS = "a number of thousands of digits"
_LONG_INTEGER = re.compile(r"<int instance with roughly \d+ digits [^>]*>")  # since Python 3.14, with its address
# Bounded values that several tables hold; their ends are far beyond any cell: no slip of the keyboard overflows.
Number = Annotated[FiniteFloat, Field(ge=-1e6, le=1e6)]
Positive = Annotated[FiniteFloat, Field(gt=0, le=1e6)]
NotNegative = Annotated[FiniteFloat, Field(ge=0, le=1e6)]
Length = Annotated[FiniteFloat, Field(gt=0, le=1e4)]  # mm
Coordinate = Annotated[FiniteFloat, Field(ge=-1e4, le=1e4)]  # mm
Angle = Annotated[FiniteFloat, Field(ge=-3600, le=3600)]  # deg
NAME = r"^[A-Za-z0-9][A-Za-z0-9_.+-]*$"
Identifier = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=16)]
Point = Annotated[list[Coordinate], Field(min_length=3, max_length=3)]
Range = Annotated[list[Number], Field(min_length=2, max_length=2)]
AngleRange = Annotated[list[Angle], Field(min_length=2, max_length=2)]
SixCoordinates = Annotated[list[Coordinate], Field(min_length=6, max_length=6)]
SixAngles = Annotated[list[Angle], Field(min_length=6, max_length=6)]
SixFactors = Annotated[list[Annotated[FiniteFloat, Field(ge=-10, le=10)]], Field(min_length=6, max_length=6)]
SixRates = Annotated[list[Annotated[FiniteFloat, Field(ge=1e-3, le=1e6)]], Field(min_length=6, max_length=6)]
MOST_VALUES = 200  # of a list: one with more is named by how many they are and their hash


class Table(BaseModel):
    """A TOML table: unknown keys are refused, numbers are numbers, and it stays as it was read.

    The text below a field describes its key: the JSON Schema and the tables of keys in docs/ are made from it, read
    from the source by who makes them (``use_attribute_docstrings`` reads it at every start).
    """

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True)


Model = TypeVar("Model", bound=Table)


def shipped() -> Path:
    """The folder with the robots and paths that come with compgen."""
    package = Path(__file__).parents[1]
    inside = package / "data"
    return inside if inside.is_dir() else package.parent


@dataclass(frozen=True, slots=True)
class TomlText:
    """A file as it was read, once: its tables and the bytes that say them."""

    tables: dict[str, Any]
    content: bytes


def read_toml(source: Path, folder: str, mend: str = "") -> dict[str, Any]:
    """A file's tables; ``folder`` names where its kind is shipped, ``mend`` what helps where none is.

    Raises:
        InputError: It is not there, not readable or not TOML.
    """
    return read_toml_text(source, folder, mend).tables


def read_toml_text(source: Path, folder: str, mend: str = "") -> TomlText:
    """A file's tables, and the bytes that they are from.

    Raises:
        InputError: It is not there, not readable or not TOML.
    """
    if source.suffix.lower() == ".ls" and source.is_file():
        raise InputError(f"{source}: a FANUC program, and a TOML file is wanted; cgen correct and cgen inspect take it")
    try:
        content = read_regular(source, MOST_TABLE_BYTES)
        text = content.decode("utf-8-sig")
    except FileNotFoundError:
        known = sorted(p.stem for p in (shipped() / folder).glob("*.toml"))
        near = near_file(source, folder)
        mend = f"did you mean {near}?" if near else mend or f"'cgen init' lays down {', '.join(known)}"
        raise InputError(f"{source}: no such file; {mend}") from None
    except UnicodeDecodeError:
        raise InputError(f"{source}: cannot be read: it is not UTF-8 text; give a TOML file") from None
    except (OSError, ValueError) as failure:
        reason = getattr(failure, "strerror", None) or failure
        raise InputError(f"{source}: cannot be read: {reason}; give a TOML file") from None
    other = "give a TOML file; one of a path names points, APT or G-code by [path] pattern and file"
    mend = "see paths/ for examples" if source.suffix.lower() == ".toml" else other
    return TomlText(parse_toml(text, str(source), mend), content)


def parse_toml(text: str, source: str, mend: str = "") -> dict[str, Any]:
    """The tables of a text; ``mend`` is what the refusal says at its end.

    Raises:
        InputError: It is not TOML.
    """
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as failure:
        reason = str(failure).partition("; use sys.")[0]  # a number of thousands of digits
        raise InputError(f"{source}: not TOML: {reason}{mend and f'; {mend}'}") from None


def override(data: dict[str, Any], assignment: str, option: str) -> None:
    """Put one ``key=value`` into a tree of tables; ``option`` is how the user wrote it."""
    key, equals, text = assignment.partition("=")
    if not equals or not all(step.strip() for step in key.split(".")):
        raise InputError(f"--set {_short(option)}: expected key=value, as in --set process.feed_mm_s=100")
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        value = text.strip()
    *parents, last = key.strip().split(".")
    table: Any = data
    try:
        for step, following in zip(parents, [*parents[1:], last], strict=False):
            rows: Any = [] if following.isdigit() else {}
            table = _entry(table, step) if isinstance(table, list) else table.setdefault(step, rows)
        if isinstance(table, list):
            _entry(table, last)
            table[int(last)] = value
        else:
            table[last] = value
    except (IndexError, ValueError, TypeError, AttributeError):
        raise InputError(f"--set {_short(option)}: there is no '{_short(key.strip())}' in the file to set") from None


def toml_value(value: Any) -> str:
    """A value as TOML in one line: booleans, numbers, text, lists and tables of them."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_quoted(k)} = {toml_value(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(toml_value(v) for v in value) + "]"
    return _quoted(value) if isinstance(value, str) else repr(value)


def _quoted(text: str) -> str:
    """A text in quotes: JSON's escapes are TOML's, but for one character that TOML wants escaped as well."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _entry(rows: list[Any], step: str) -> Any:
    """An entry of a list of tables; the one after the last is a new one."""
    if not step.isdigit():
        raise IndexError(step)
    if int(step) == len(rows):
        rows.append({})
    return rows[int(step)]


def table_of_words(words: str, where: str, example: str) -> dict[str, Any]:
    """The keys of a table as they are typed, as in ``delay_s=[0, 1200]``.

    Raises:
        InputError: Not understood; says by an example how it is written.
    """
    inner = words.strip().removeprefix("{").removesuffix("}")
    try:
        data = tomllib.loads(f"x = {{{inner}}}")
    except (ValueError, RecursionError):
        data = {}
    if set(data) != {"x"}:
        raise InputError(f"{where}: {brief_value(words)} is not understood; write it as in '{example}'")
    return dict(data["x"])


def check(model: type[Model], data: Mapping[str, Any], where: str) -> Model:
    """The table that the data describe.

    Raises:
        TableError: The first thing that is wrong, in one line: file, key, value, limit.
    """
    deep = next((key for key, value in data.items() if _is_deeper(value, DEEPEST)), None)
    if deep is not None:
        raise InputError(f"{where}: {_short(deep)}: nested more than {DEEPEST} deep; remove it, no key here needs that")
    control = _control_character(data)
    if control is not None:
        raise TableError(f"{where}: {control}: it holds a control character or a mark of direction; remove it")
    try:
        return model.model_validate(data)
    except ValidationError as failure:
        errors = failure.errors(include_url=False)
    raise TableError(f"{where}: {_message(model, data, errors)}")


def _control_character(value: Any, key: str = "") -> str | None:
    """Key and text of the first that would steer a terminal or a page that shows it; None where there is none."""
    if isinstance(value, str):
        return f"{key}: {_short(value)}" if _CONTROL.search(value) else None
    if isinstance(value, dict):
        named = next((name for name in value if _CONTROL.search(name)), None)
        if named is not None:
            return f"{key}{'.' if key else ''}{_short(named)}"
        entries: Any = value.items()
    else:
        entries = enumerate(value) if isinstance(value, list) else ()
    refusals = (_control_character(entry, f"{key}.{_short(str(k))}" if key else _short(str(k))) for k, entry in entries)
    return next((text for text in refusals if text is not None), None)


def _message(model: type[Table], data: Mapping[str, Any], errors: Sequence[ErrorDetails]) -> str:
    """The first error with its key, value and limit."""
    # an unknown key is the cause of a missing one more often than the other way round
    first = next((e for e in errors if e["type"] == "extra_forbidden"), errors[0])
    place = _steps(data, first)
    # each choice of a union has an error of its own: those that went deepest took the value for what it is
    below = [(steps, e) for e in errors if (steps := _steps(data, e))[: len(place)] == place]
    steps, error = max(below, key=lambda pair: len(pair[0]))
    key, value = ".".join(map(_short, steps)), error["input"]
    match error["type"]:
        case "extra_forbidden":
            fields = [item for table in _tables(model, error["loc"][:-1]) for item in table.model_fields.items()]
            known = [field.alias or name for name, field in fields]  # as a file spells them
            return f"{key}: unknown key{suggest(steps[-1], known)}"
        case "missing":
            missing = [".".join(map(_short, _steps(data, e))) for e in errors if e["type"] == "missing"]
            more = f" and {len(missing) - MOST_MISSING} more" if len(missing) > MOST_MISSING else ""
            named = ", ".join(missing[:MOST_MISSING])
            shown = "; ".join(text for e in errors if e["type"] == "missing" for text in _examples(model, e["loc"]))
            as_in = f": {shown}" if shown else ""
            return f"{named}{more}: missing; add {'it' if len(missing) == 1 else 'them'}{as_in}"
        case "union_tag_not_found" | "union_tag_invalid":
            name = error["ctx"]["discriminator"].strip("'")
            tags = [get_args(table.model_fields[name].annotation)[0] for table in _tables(model, error["loc"])]
            if name not in value:
                return f"{key}.{name}: missing; known: {', '.join(tags)}"
            close = suggest(value[name], tags, listed=True) if isinstance(value[name], str) else ""
            return f"{key}.{name}: {brief_value(value[name])} is unknown; known: {', '.join(tags)}{close}"
        case "finite_number":
            return f"{key}: {value} is not a number; give a finite one"
        case "model_type" | "model_attributes_type" | "dict_type":
            return f"{key}: {_told(value)} must be a table"
        case "list_type" if isinstance(value, dict) and _tables(model, steps) != _tables(model, steps[:-1]):
            return f"{key}: one table, and a list is wanted; say [[{'.'.join(s for s in steps if not s.isdigit())}]]"
    return f"{key}: {_told(value)}: {', or '.join(dict.fromkeys(_reason(e) for s, e in below if s == steps))}"


def _is_deeper(value: Any, levels: int) -> bool:
    """Whether tables and lists are nested deeper than some levels."""
    level = [value]
    for _ in range(levels + 1):
        level = [v for x in level if isinstance(x, dict | list) for v in (x.values() if isinstance(x, dict) else x)]
    return bool(level)


def _steps(data: Any, error: ErrorDetails) -> list[str]:
    """The keys that lead to an error, as the file has them: without the names of a union's choices."""
    steps = []
    for step in error["loc"]:
        if (isinstance(data, dict) and step in data) or (isinstance(data, list) and isinstance(step, int)):
            data = data[step]  # type: ignore[index]
            steps.append(str(step))
    return [*steps, str(error["loc"][-1])] if error["type"] == "missing" else steps


def _reason(error: ErrorDetails) -> str:
    """What a value must be, in the words of pydantic."""
    if error.get("ctx", {}).get("pattern") == NAME:
        return "must be of letters, digits, _ . + and -, without a blank"
    text = re.sub(r"^(?:Input|List|String) should ", "must ", error["msg"])
    return text.replace(" after validation", "").replace("a valid dictionary", "a table")


def _told(value: object) -> str:
    """A value of a file for a message: only JSON has nothing as a value."""
    return "null" if value is None else brief_value(value)


def brief_value(value: object) -> str:
    """A value for a message, whatever it holds and however deep."""
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list) and any(isinstance(entry, dict) for entry in value):
        return "a list of tables"
    try:
        text = _REPR.repr(value)
    except ValueError:  # more digits than Python writes, before 3.14
        return _MANY_DIGITS
    return _short(_LONG_INTEGER.sub(_MANY_DIGITS, text))


def _short(text: str) -> str:
    plain = text if text.isprintable() else repr(text)
    return plain if len(plain) <= 80 else f"{plain[:77]}..."


def _tables(model: type[Table], steps: Sequence[int | str]) -> list[type[Table]]:
    """The tables that may stand at a place; several where the value of a key tells which."""
    tables = [model]
    for step in steps:
        annotations = [
            field.annotation for t in tables for name, field in t.model_fields.items() if step in (name, field.alias)
        ]
        inner = [t for a in annotations for t in _types(a) if isinstance(t, type) and issubclass(t, Table)]
        named = [t for t in tables if any(get_args(f.annotation) == (step,) for f in t.model_fields.values())]
        tables = inner or named or tables
    return tables


def _examples(model: type[Table], steps: Sequence[int | str]) -> list[str]:
    """How a missing key may look, where its table says so."""
    fields = [f for t in _tables(model, steps[:-1]) for n, f in t.model_fields.items() if steps[-1] in (n, f.alias)]
    return [example for field in fields for example in field.examples or ()]


def _types(annotation: Any) -> list[Any]:
    return [annotation, *(t for a in get_args(annotation) for t in _types(a))]


def suggest(word: str, known: Sequence[str], *, listed: bool = False) -> str:
    """The end of a message: the word that was probably meant, or all there are."""
    close = [key for key in known if key.startswith(f"{word}_")]  # its unit is missing
    close = close or difflib.get_close_matches(word, known, n=1, cutoff=0.5)
    if close:
        return f"; did you mean '{close[0]}'?"
    return "" if listed or len(known) > 12 else f"; known: {', '.join(known)}"


def line_of_key(text: str, key: str) -> int:
    """The line, from 1, where a file's text has a key or, where it has not, the first of its tables; 1 without either.

    Args:
        text: Of a TOML file, well formed or not.
        key: Dotted; rows of a list of tables are not told apart.
    """
    wanted, table, line_of = re.sub(r"\.\d+(?=\.|$)", "", key), "", dict[str, int]()
    for number, line in enumerate(text.splitlines(), 1):
        head, entry = re.match(r"\s*\[+\s*([\w.-]+)", line), re.match(r"\s*([\w.-]+)\s*=", line)
        if head:
            table = f"{head[1]}."
        if head or entry:
            line_of.setdefault(head[1] if head else f"{table}{entry[1] if entry else ''}", number)
    places = ["", *wanted.split(".")]
    return next((line_of[k] for n in range(len(places), 1, -1) if (k := ".".join(places[1:n])) in line_of), 1)


def input_keys(table: Table) -> dict[str, Any]:
    """Every key of a checked table with its value, as a file would spell both; None where it was left open.

    A list of more than ``MOST_VALUES`` values is ``{"values": how many, "sha256": of their JSON}``.
    """
    return {key: _brief(value) for key, value in table.model_dump(mode="json", by_alias=True).items()}


def dotted_keys(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Tables in each other as dotted keys, as ``--set`` takes them; a list of plain values is one value."""
    return dict(_flat(tables, ""))


def _flat(value: Any, key: str) -> Iterator[tuple[str, Any]]:
    step = f"{key}." if key else ""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _flat(inner, f"{step}{name}")
    elif isinstance(value, list) and any(isinstance(row, Mapping) for row in value):
        for n, row in enumerate(value):
            yield from _flat(row, f"{step}{n}")
    else:
        yield key, value


def _brief(value: Any) -> Any:
    """A value of JSON with its long lists named by their hashes."""
    if isinstance(value, dict):
        return {key: _brief(inner) for key, inner in value.items()}
    if not isinstance(value, list):
        return value
    count = _count(value)
    if count > MOST_VALUES:
        return {"values": count, "sha256": sha256(json.dumps(value).encode()).hexdigest()}
    return [_brief(inner) for inner in value]


def _count(value: Any) -> int:
    """Values in lists and tables in each other."""
    if isinstance(value, dict):
        return sum(map(_count, value.values()))
    return sum(map(_count, value)) if isinstance(value, list) else 1
