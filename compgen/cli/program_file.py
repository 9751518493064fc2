"""How a command takes a program that exists, and the frames that its positions are told in."""

from collections.abc import Iterator
from contextlib import contextmanager

from compgen.core.exceptions import InputError
from compgen.core.files import read_regular
from compgen.fanuc.frames import Frames, default_frames, load_frames


def read_program(program: str) -> bytes:
    """A program file's bytes."""
    try:
        return read_regular(program)
    except (OSError, ValueError) as failure:
        reason = getattr(failure, "strerror", None) or str(failure)
        raise InputError(f"{program}: cannot be read: {reason}; give a program listing (.LS)") from None


@contextmanager
def naming_program(program: str) -> Iterator[None]:
    """Put the file's name before what is wrong in it."""
    try:
        yield
    except InputError as failure:
        raise InputError(f"{program}: {failure}") from failure


def read_frames(path: str | None) -> Frames:
    """What UF and UT numbers mean."""
    return load_frames(path) if path is not None else default_frames()
