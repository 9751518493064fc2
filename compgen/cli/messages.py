"""One-line messages on the error stream."""

import sys

from compgen.core import interrupts
from compgen.core.one_line import one_line

_printed_notes: set[str] = set()


def print_error(message: str, code: int) -> int:
    """Print why the command failed, in one line; returns the exit code to leave with."""
    sys.stderr.write(f"{one_line(f'cgen: {message}')}\n")
    return code


def print_note_once(note: str) -> None:
    """Print a note, unless it has been printed or the run is stopped: a compiler that is stopped has not failed."""
    if note not in _printed_notes and not interrupts.pending_interrupt():
        _printed_notes.add(note)
        sys.stderr.write(f"{one_line(f'cgen: note: {note}')}\n")
