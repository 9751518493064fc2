"""Lines of a program file: CR LF, LF and CR each end one."""

import re

_END = re.compile(rb"\r\n|\n|\r")


def line_of(data: bytes, place: int) -> int:
    """Physical line of a byte, from 1."""
    return 1 + line_ends(data, 0, place)


def line_ends(data: bytes, start: int, stop: int) -> int:
    """Line ends between two places."""
    part = data[start:stop]
    return part.count(b"\n") + part.count(b"\r") - part.count(b"\r\n")


def end_of_line(data: bytes, place: int) -> int:
    """Where the line that holds a byte ends."""
    match = _END.search(data, place)
    return match.start() if match else len(data)


def letters(text: str) -> str:
    """Text that was read a character a byte, in the letters of UTF-8 where its bytes are that."""
    try:
        return text.encode("latin-1").decode()
    except UnicodeError:
        return text


def line_end(data: bytes) -> bytes:
    """The line end that a file begins with; CR LF where it has none."""
    match = _END.search(data)
    return match.group() if match else b"\r\n"
