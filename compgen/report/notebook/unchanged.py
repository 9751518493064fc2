"""Whether a job is what its files and overrides say: a program names their hash as what it is made from."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from weakref import WeakSet

import numpy as np

from compgen.core.exceptions import CompgenError, InputError
from compgen.job.job import Job
from compgen.pipelines.files.path_file import load_job

_as_read: WeakSet[Job] = WeakSet()  # jobs that are known to be what was read


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
