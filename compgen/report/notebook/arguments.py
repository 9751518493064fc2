"""Arguments of the public functions, checked where they come in: what is wrong raises an InputError that names it."""

import os
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from compgen.core.exceptions import InputError
from compgen.core.stages import Progress
from compgen.core.toml import brief_value, toml_value

MAX_WORKERS = 64
STATE = "a state that cgen anchor wrote, as 'state.toml'"
EXAMPLE = "{'process.feed_mm_s': 100}"  # of overrides
T = TypeVar("T")

#: The name of a file, as text or as a path.
File = str | os.PathLike[str]
#: Keys of a path or robot file and their values, or ``key=value`` as the command line takes them.
Overrides = Mapping[str, Any] | Sequence[str]


def file_name(file: object, argument: str, what: str) -> str:
    """A file's name as text; ``what`` says which kind of file is wanted."""
    if isinstance(file, str | os.PathLike):
        name = os.fspath(file)
        if isinstance(name, str):
            return name
    raise InputError(f"{argument}: {brief_value(file)} is no file's name; give {what}")


def optional_name(file: object, argument: str, what: str) -> str | None:
    """A file's name as text, or None."""
    return None if file is None else file_name(file, argument, what)


def file_names(files: object, argument: str, what: str) -> list[str]:
    """Names of one file or of several; none of None."""
    if files is None:
        return []
    if isinstance(files, list | tuple):
        return [file_name(file, argument, what) for file in files]
    return [file_name(files, argument, what)]


def instance(value: object, kind: type[T], argument: str, mend: str) -> T:
    """A value of a class."""
    if not isinstance(value, kind):
        raise InputError(f"{argument}: {brief_value(value)} is no {kind.__name__}; {mend}")
    return value


def progress_of(progress: Progress | None) -> Progress:
    """A callback; one that says nothing of None."""
    if progress is None:
        return lambda stage, share: None
    if not callable(progress):
        raise InputError(f"progress: {brief_value(progress)} cannot be called; give a function of stage and share")
    return progress


def whole_number(value: object, argument: str, least: int, most: int) -> int:
    """A whole number within limits."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not least <= value <= most:
        raise InputError(f"{argument}: {brief_value(value)}: must be a whole number from {least} to {most}")
    return int(value)


def number(value: object, argument: str) -> float:
    """A number."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise InputError(f"{argument}: {brief_value(value)} is not a number; give one")
    return float(value)


def numbers(values: object, argument: str) -> list[float]:
    """Some numbers."""
    if not isinstance(values, list | tuple | np.ndarray) or np.ndim(values) != 1:
        raise InputError(f"{argument}: {brief_value(values)}: give a list of numbers")
    return [number(value, argument) for value in values]


def text_of(value: object, argument: str, mend: str) -> str:
    """A text."""
    if not isinstance(value, str):
        raise InputError(f"{argument}: {brief_value(value)} is no text; {mend}")
    return value


def assignments(overrides: object, argument: str = "overrides", example: str = EXAMPLE) -> list[str]:
    """Overrides as the command line takes them, ``key=value``."""
    if overrides is None:
        return []
    if isinstance(overrides, Mapping):
        return [f"{key_of(key, argument)}={value_of(value, f'{argument}: {key}')}" for key, value in overrides.items()]
    if isinstance(overrides, list | tuple) and all(isinstance(item, str) for item in overrides):
        return list(overrides)
    raise InputError(f"{argument}: {brief_value(overrides)}: give a dict, as in {example}")


def key_of(key: object, argument: str) -> str:
    """A dotted key."""
    if not isinstance(key, str) or not key.strip() or "=" in key:
        raise InputError(f"{argument}: {brief_value(key)} is no key; give dotted keys, as in 'process.feed_mm_s'")
    return key


def value_of(value: object, key: str) -> str:
    """A value as TOML in one line."""
    return toml_value(_plain(value, key))


def _plain(value: object, key: str) -> Any:
    """A value of Python's own types that TOML has."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, os.PathLike):
        return file_name(value, key, "a file's name")
    if isinstance(value, list | tuple):
        return [_plain(entry, key) for entry in value]
    if isinstance(value, Mapping):
        return {key_of(name, key): _plain(entry, key) for name, entry in value.items()}
    raise InputError(f"{key}: {brief_value(value)} cannot stand in a file; give a number, a text, a list or a dict")
