"""TOML files to checked tables: defaults, overrides, and one line for whatever is wrong."""

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from compgen.core.exceptions import InputError


class Table(BaseModel):
    """A TOML table: unknown keys are refused, numbers are numbers, and it stays as it was read."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


Model = TypeVar("Model", bound=Table)


def shipped() -> Path:
    """The folder with the robots and paths that come with compgen."""
    package = Path(__file__).parents[1]
    inside = package / "data"
    return inside if inside.is_dir() else package.parent


def read_toml(source: Path, folder: str) -> dict[str, Any]:
    """A file's tables; ``folder`` names where its kind is shipped.

    Raises:
        InputError: It is not there, not readable or not TOML.
    """
    try:
        text = source.read_bytes().decode("utf-8")
        return tomllib.loads(text)
    except FileNotFoundError:
        known = sorted(p.stem for p in (shipped() / folder).glob("*.toml"))
        raise InputError(f"{source}: no such file; 'cgen init' lays down {', '.join(known)}") from None
    except UnicodeDecodeError:
        raise InputError(f"{source}: cannot be read: it is not UTF-8 text; give a TOML file") from None
    except OSError as failure:
        raise InputError(f"{source}: cannot be read: {failure.strerror}; give a TOML file") from None
    except (ValueError, RecursionError) as failure:
        raise InputError(f"{source}: not TOML: {failure}; see paths/ for examples") from None


def override(data: dict[str, Any], item: str, said: str) -> None:
    """Put one ``key=value`` into a tree of tables."""
    key, equals, text = item.partition("=")
    if not equals or not key.strip():
        raise InputError(f"--set {said}: expected key=value, as in --set process.feed_mm_s=100")
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        value = text.strip()
    *parents, last = key.strip().split(".")
    place: Any = data
    try:
        for step in parents:
            place = _item(place, step) if isinstance(place, list) else place.setdefault(step, {})
        if isinstance(place, list):
            _item(place, last)
            place[int(last)] = value
        else:
            place[last] = value
    except (IndexError, ValueError, TypeError, AttributeError):
        raise InputError(f"--set {said}: there is no '{key}' in the file to set") from None


def _item(rows: list[Any], step: str) -> Any:
    """An entry of a list of tables; the one after the last is a new one."""
    if not step.isdigit():
        raise IndexError(step)
    if int(step) == len(rows):
        rows.append({})
    return rows[int(step)]


def check(model: type[Model], data: Mapping[str, Any], where: str, prefix: str = "") -> Model:
    """Validate, and say the first thing that is wrong in one line."""
    try:
        return model.model_validate(data)
    except ValidationError as failure:
        errors = failure.errors()
        # an unknown key is the cause of a missing one more often than the other way round
        error = next((e for e in errors if e["type"] == "extra_forbidden"), errors[0])
    steps = [str(s) for s in error["loc"] if not str(s).startswith(("float", "dict["))]
    key = ".".join([*([prefix] if prefix else []), *steps])
    value = error.get("input")
    match error["type"]:
        case "extra_forbidden":
            raise InputError(f"{where}: {key}: unknown key{suggest(steps[-1], _keys(model, error['loc'][:-1]))}")
        case "missing":
            raise InputError(f"{where}: {key}: missing; add it")
        case "finite_number":
            raise InputError(f"{where}: {key}: {value} is not a number; give a finite one")
        case "model_type" | "dict_type":
            raise InputError(f"{where}: {key}: {value!r} must be a table")
        case _:
            told = str(error["msg"]).replace("Input should be", "must be")
            raise InputError(f"{where}: {key}: {value!r}: {told[0].lower()}{told[1:]}")


def keys_of(model: type[Table]) -> list[str]:
    """The keys that a table may have, as a file spells them."""
    return [field.alias or name for name, field in model.model_fields.items()]


def _keys(model: type[Table], steps: Sequence[int | str]) -> list[str]:
    """Keys that the table at a place may have."""
    for step in steps:
        fields = {field.alias or name: field for name, field in model.model_fields.items()}
        annotation = fields[str(step)].annotation if str(step) in fields else None
        tables = [t for t in _types(annotation) if isinstance(t, type) and issubclass(t, Table)]
        if tables:
            model = tables[0]
    return keys_of(model)


def _types(annotation: Any) -> list[Any]:
    return [annotation, *(t for a in get_args(annotation) for t in _types(a))]


def suggest(word: str, known: Sequence[str], listed: bool = False) -> str:
    """The end of a message: the word that was probably meant, or all there are."""
    close = difflib.get_close_matches(word, known, n=1, cutoff=0.5)
    if close:
        return f"; did you mean '{close[0]}'?"
    return "" if listed or len(known) > 12 else f"; known: {', '.join(known)}"
