"""Files that are read whole, regular ones of a size that a reader can hold; and the one that was meant."""

import os
import stat
from difflib import get_close_matches
from errno import EFBIG, EINVAL, EISDIR
from hashlib import sha256
from pathlib import Path

from compgen.core.exceptions import InputError
from compgen.core.units import MB

MOST_BYTES = 2_000_000_000
PROVENANCE = ".compgen.json"  # behind a program's name: what it was corrected from, beside a corrected program
POSTERIOR = ".posterior.json"  # behind a robot file's name: how well its parameters are known together, beside it
PROJECT = "cgen.toml"  # a project's file, with the defaults of its path files
MOST_TABLE_BYTES = 16_000_000  # of a TOML file or another that people write by hand
_CLOSE = 0.7  # of the letters of a name


def file_hash(source: str | Path) -> str:
    """The sha256 of a file's bytes, in hexadecimal digits; raises as ``read_regular``."""
    return sha256(read_regular(source)).hexdigest()


def read_regular(source: str | Path, most: int = MOST_BYTES) -> bytes:
    """A file's bytes; a pipe or a device, which may never end, is not waited for.

    Args:
        source: Its name.
        most: Bytes that its kind can have.

    Raises:
        OSError: Not there, not readable, no regular file, or larger; ``strerror`` says which.
        ValueError: No file has such a name.
    """
    descriptor = os.open(source, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0))
    try:
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(EISDIR, "it is a folder", str(source))
        if not stat.S_ISREG(mode):
            raise OSError(EINVAL, "it is a pipe or a device", str(source))
        with open(descriptor, "rb", closefd=False) as file:
            content: bytes | None = file.read(most + 1)
    finally:
        os.close(descriptor)
    if content is None:  # a file of the system's own, which would be waited for
        raise OSError(EINVAL, "it is a pipe or a device", str(source))
    if len(content) > most:
        raise OSError(EFBIG, f"it is larger than {most / MB:g} MB", str(source))
    return content


def read_named(source: str | Path, mend: str, most: int = MOST_BYTES) -> bytes:
    """A file's bytes as ``read_regular`` has them, of a file that a user named.

    Args:
        source: Its name.
        mend: What to do where it cannot be read, for the message.
        most: Bytes that its kind can have.

    Raises:
        InputError: It cannot be read.
    """
    try:
        return read_regular(source, most)
    except OSError as failure:
        raise InputError(f"{source}: cannot be read: {failure.strerror}; {mend}") from None
    except ValueError:
        raise InputError(f"{str(source)!r}: cannot be read: no file has such a name; {mend}") from None


def near_file(file: Path, *folders: str) -> str | None:
    """The file that was meant where one is not there: of a similar name and the same kind, in its folder or others.

    None where there is none.

    Args:
        file: That is not there; without an ending any file of its name is meant.
        folders: Where its kind is kept, from the current folder.
    """
    stems: dict[str, str] = {}
    for place in dict.fromkeys([file.parent, *map(Path, folders)]):
        for name in _names_in(place):
            stem, ending = os.path.splitext(name)
            if ending and file.suffix.lower() in ("", ending.lower()) and (place / name).is_file():
                stems.setdefault(stem.lower(), str(place / name))
    near = get_close_matches(file.stem.lower(), stems, 1, _CLOSE)
    if near:
        return stems[near[0]]
    return _other_ending(file)


def _other_ending(file: Path) -> str | None:
    """A file of the same stem with an ending that is spelt nearly so."""
    names = [name for name in _names_in(file.parent) if os.path.splitext(name)[0] == file.stem]
    near = get_close_matches(file.name, names, 1, _CLOSE)
    return str(file.with_name(near[0])) if near else None


def _names_in(folder: Path) -> list[str]:
    """The names in a folder; none where it is not there or cannot be read."""
    try:
        return sorted(os.listdir(folder))
    except (OSError, ValueError):
        return []
