"""Streams whose reader may leave, as ``head`` does: what follows is dropped, and the command ends as it would have."""

import io
import os
import sys
from contextlib import suppress
from typing import Any


def let_readers_leave() -> None:
    """Replace the output and the error stream, where they are files of this process."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # closed by whoever started the command
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115  until the process ends
        elif isinstance(stream, io.TextIOWrapper):
            setattr(sys, name, _text_stream(stream))


def reader_has_left() -> bool:
    """Whether nobody reads the output any more."""
    raw = getattr(getattr(sys.stdout, "buffer", None), "raw", None)
    return isinstance(raw, _PatientFile) and raw.is_left


class _PatientFile(io.RawIOBase):
    """A file that takes everything, also when its other end is closed."""

    def __init__(self, handle: int) -> None:
        """Of an open file's number."""
        self._handle = handle
        self.is_left = False

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        return self._handle

    def isatty(self) -> bool:
        return os.isatty(self._handle)

    def write(self, content: Any) -> int:
        with suppress(BrokenPipeError):
            if not self.is_left:
                return os.write(self._handle, content)
        self.is_left = True
        return len(content)


def _text_stream(stream: io.TextIOWrapper) -> io.TextIOWrapper:
    """The same stream, patient; characters that its encoding has not are written as escapes."""
    with suppress(OSError):
        stream.flush()
    file = io.BufferedWriter(_PatientFile(stream.fileno()))
    at_once = stream.line_buffering or stream.write_through
    return io.TextIOWrapper(file, encoding=stream.encoding, errors="backslashreplace", line_buffering=at_once)
