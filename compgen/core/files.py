"""Files that are read whole: regular ones, of a size that a reader can hold."""

import os
import stat
from errno import EFBIG, EINVAL, EISDIR
from hashlib import sha256
from pathlib import Path

from compgen.core.units import MB

MOST_BYTES = 2_000_000_000
PROVENANCE = ".compgen.json"  # behind a program's name: what it was corrected from, beside a corrected program
POSTERIOR = ".posterior.json"  # behind a robot file's name: how well its parameters are known together, beside it
MOST_TABLE_BYTES = 16_000_000  # of a TOML file or another that people write by hand


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
