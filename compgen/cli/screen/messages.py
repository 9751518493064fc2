"""What a command says: one-line messages on the error stream, its record on the output."""

import json
import sys
import traceback

from compgen.core import interrupts
from compgen.core.exceptions import CompgenError
from compgen.core.findings import one_line
from compgen.core.json_text import json_text

CRASHED = 70  # exit code of a fault of compgen
_NAME = "cgen: "  # before what stderr says
_printed_notes: set[str] = set()


def print_error(message: str, code: int) -> int:
    """Print why the command failed, in one line; returns the exit code to leave with."""
    sys.stderr.write(f"{one_line(f'{_NAME}{message}')}\n")
    return code


def reason_of(failure: Exception) -> tuple[int, str]:
    """The exit code and the message of what ended a run; of a fault of compgen the trace is printed."""
    if isinstance(failure, CompgenError):
        return failure.exit_code, str(failure)
    if isinstance(failure, MemoryError):
        return 2, "not enough memory; make the path smaller, or raise process.chord_um"
    interrupts.raise_if_interrupted()
    traceback.print_exception(failure, file=sys.stderr)
    return CRASHED, f"a fault of compgen: {type(failure).__name__}: {failure}"


def outcome_words(verdict: str) -> str:
    """What a run that is not inside its bounds ends with, for the error line."""
    return "outside bounds" if verdict == "outside" else verdict


def print_refusal(message: str, code: int) -> int:
    """Print why the command ends without a result, with ``--json`` on the output as well; returns the exit code."""
    if "--json" in sys.argv[1:]:
        sys.stdout.write(
            json.dumps({"error": one_line(f"{_NAME}{message}").removeprefix(_NAME), "exit_code": code}) + "\n"
        )
    return print_error(message, code)


def print_record(record: object) -> None:
    """Print what ``--json`` asks for: a record, or one that is text already."""
    sys.stdout.write((record if isinstance(record, bytes) else json_text(record)).decode())


def print_note_once(note: str) -> None:
    """Print a note, unless it has been printed, ``-q`` asks for errors only, or the run is stopped.

    A compiler that is stopped has not failed.
    """
    if {"-q", "--quiet"} & {*sys.argv[1:]}:
        return
    if note not in _printed_notes and not interrupts.pending_interrupt():
        _printed_notes.add(note)
        sys.stderr.write(f"{one_line(f'cgen: note: {note}')}\n")
