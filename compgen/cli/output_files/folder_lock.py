"""One run at a time in a folder, held by the operating system: a process that ends or is killed gives it free."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Wait until no other run is in this context with the same folder.

    Nothing is waited for where the folder does not exist, or where the system or its file system has no locks.
    """
    handle = _locked(folder)
    try:
        yield
    finally:
        if handle is not None:
            os.close(handle)


def _locked(folder: Path) -> int | None:
    """The folder, open and locked; None where it does not exist or cannot be opened."""
    while True:
        try:
            handle = os.open(folder, os.O_RDONLY)
        except OSError:
            return None
        try:
            if fcntl is not None:
                with suppress(OSError):
                    fcntl.flock(handle, fcntl.LOCK_EX)
            if _has_name(handle, folder):
                return handle
        except BaseException:  # a signal, while it waits
            os.close(handle)
            raise
        os.close(handle)


def _has_name(handle: int, folder: Path) -> bool:
    """Whether an open folder still has its name: another run may have put its own in its place."""
    try:
        return os.path.samestat(os.fstat(handle), folder.stat())
    except FileNotFoundError:
        return False
