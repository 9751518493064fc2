"""Arguments of the public functions, checked where they come in: what is wrong raises an InputError that names it.

Whether a job is what its files and overrides say: a program names their hash as what it is made from.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar
from weakref import WeakSet

import numpy as np

from compgen.core.exceptions import CompgenError, InputError
from compgen.core.stages import Progress
from compgen.core.toml import brief_value, toml_value
from compgen.job.job import Job
from compgen.pipelines.files.path_file import load_job

MAX_WORKERS = 64
STATE = "a state that cgen anchor wrote, as 'state.toml'"
EXAMPLE = "{'process.feed_mm_s': 100}"  # of overrides
T = TypeVar("T")

#: The name of a file, as text or as a path.
File = str | os.PathLike[str]
#: Keys of a path or robot file and their values, or ``key=value`` as the command line takes them.
Overrides = Mapping[str, Any] | Sequence[str]
_as_read: WeakSet[Job] = WeakSet()  # jobs that are known to be what was read


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
    listed = files if isinstance(files, list | tuple) else [files]
    return [file_name(file, argument, what) for file in listed]


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
    if not isinstance(values, list | tuple | np.ndarray) or getattr(values, "ndim", 1) != 1:
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


def remember(job: Job) -> Job:
    """A job that has just been read."""
    _as_read.add(job)
    return job


def require_unchanged(job: Job) -> None:
    """Raises InputError for a job with other contents than the inputs that it names; those are read again if need be.

    A job whose files are gone, or have changed since it was read, is taken as it is.
    """
    if job in _as_read:
        return
    try:
        read = load_job(job.source, job.cell.robot_file, job.overrides)
    except CompgenError:
        return
    if read.inputs_hash == job.inputs_hash:
        place = first_difference(job, read)
        if place is not None:
            raise InputError(
                f"job {job.name}: {place or 'it'} was changed since it was read from {job.source}; give what shall be "
                "different to compgen.load_job as overrides"
            )
    remember(job)


def first_difference(one: object, other: object, place: str = "") -> str | None:
    """Where two trees of frozen data differ first, dotted; None where they are the same."""
    if one is other:
        return None
    if type(one) is not type(other):
        return place
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        same = one.shape == other.shape and bool(((one == other) | ((one != one) & (other != other))).all())
        return None if same else place
    if is_dataclass(one):
        names = [field.name for field in fields(one)]
        pairs = [(name, getattr(one, name), getattr(other, name)) for name in names]
    elif isinstance(one, tuple | list) and isinstance(other, tuple | list):
        pairs = [(str(k), *pair) for k, pair in enumerate(zip(one, other, strict=False))]
        if len(one) != len(other):
            return place
    elif isinstance(one, Mapping) and isinstance(other, Mapping):
        if list(one) != list(other):
            return place
        pairs = [(str(key), one[key], other[key]) for key in one]
    else:
        return None if one == other or (one != one and other != other) else place
    inner = (first_difference(a, b, f"{place}.{name}" if place else name) for name, a, b in pairs)
    return next((difference for difference in inner if difference is not None), None)
