"""What a command says: one-line messages on the error stream; on the output its record, or tables and sentences.

Of what is seen a command says lines and tables, which are printed here alone: as wide as the terminal; into a pipe or a
file nothing is wrapped.
"""

import json
import sys
import traceback
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from compgen.core import interrupts
from compgen.core.exceptions import CompgenError
from compgen.core.exit_codes import ExitCode
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding, first_message, in_reading_order, is_for_every_job, one_line
from compgen.core.json_text import json_text

if TYPE_CHECKING:
    from rich.table import Table
    from rich.text import Text

UNWRAPPED = 100_000  # columns
MOST_UNSAFE = 40  # statements that are printed; a long program may have thousands
_NAME = "cgen: "  # before what stderr says
_printed_notes: set[str] = set()


def print_error(message: str, code: int) -> int:
    """Print why the command failed, in one line; returns the exit code to leave with."""
    sys.stderr.write(f"{one_line(f'{_NAME}{message}')}\n")
    return code


def reason_of(failure: Exception) -> tuple[ExitCode, str]:
    """The exit code and the message of what ended a run; of a fault of compgen the trace is printed."""
    if isinstance(failure, CompgenError):
        return failure.exit_code, str(failure)
    if isinstance(failure, MemoryError):
        return ExitCode.BAD_INPUT, "not enough memory; make the path smaller, or raise process.chord_um"
    interrupts.raise_if_interrupted()
    traceback.print_exception(failure, file=sys.stderr)
    return ExitCode.CRASHED, f"a fault of compgen: {type(failure).__name__}: {failure}"


def outside_words(findings: Sequence[Finding]) -> str:
    """What a run that is not inside its bounds ends with, and the first reason, for the error line; empty of others."""
    from compgen.verification.verdict import Verdict, verdict_of

    verdict = verdict_of(findings)
    others = (f for f in findings if f.code != Code.CORRECTION_NONE)  # that alone keeps no planned program back
    broken = first_message(Level.OUTSIDE, others) or first_message(Level.OUTSIDE, findings)
    return f"{'outside bounds' if verdict is Verdict.OUTSIDE else verdict}: {broken}" if broken else ""


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
    if note not in _printed_notes and print_note(note):
        _printed_notes.add(note)


def print_note(note: str) -> bool:
    """``print_note_once`` as often as it is called; returns whether it was printed."""
    if {"-q", "--quiet"} & {*sys.argv[1:]} or interrupts.pending_interrupt():
        return False
    sys.stderr.write(f"{one_line(f'cgen: note: {note}')}\n")
    return True


def print_shown(shown: Iterable[object]) -> None:
    """Print sentences and tables, as wide as the terminal; without markup or colours of their own in texts."""
    if not shown:
        return
    from rich.console import Console

    terminal = sys.stdout.isatty()
    console = Console(  # whatever FORCE_COLOR says
        width=None if terminal else UNWRAPPED, highlight=False, markup=False, force_terminal=terminal
    )
    for item in shown:
        console.print(item)


def finding_lines(findings: Iterable[Finding | Mapping[str, str]], *, verbose: bool) -> list[str]:
    """Findings, or their records, in the order of reading: how much each weighs, and what it says.

    Notes that every job has are counted in the last line; ``verbose`` lists them, and names each code for
    ``cgen explain``.
    """
    shown = in_reading_order(findings)
    folded = [] if verbose else [finding for finding in shown if is_for_every_job(finding)]
    lines = [f"{f.level}{f' [{f.code}]' if verbose else ''}: {f.message}" for f in shown if f not in folded]
    if folded:
        several = len(folded) > 1
        lines.append(
            f"{len(folded)} note{'s' * several} that every job has: --verbose shows {'them' if several else 'it'}"
        )
    return lines


def print_lines(lines: Iterable[str]) -> None:
    """Print sentences, a line each, as long as they are."""
    sys.stdout.write("".join(f"{line}\n" for line in lines))


def finding_rows(records: Iterable[Mapping[str, str]], *, verbose: bool) -> list[str]:
    """Findings, a line each, but for the one that stands above them in words: that nothing was corrected."""
    return finding_lines((r for r in records if r["code"] != Code.CORRECTION_NONE), verbose=verbose)


def unsafe_lines(statements: Sequence[Mapping[str, object]], most: int, where: str) -> list[str]:
    """The first statements that make a correction unsafe, and where all are named, as "in report.json"."""
    lines = [f"  line {s['line']}: {s['text']}: {s['reason']}" for s in statements[:most]]
    return [*lines, *([f"  and {len(statements) - most} more, all {where}"] if len(statements) > most else [])]


def titled(title: str, table: "Table") -> "tuple[Text, Table]":
    """A table under its title, which may be wider: rich would wrap a title of the table's own, and fill it up."""
    from rich.text import Text

    return Text(" ".join(title.split()), style="bold"), table


def table_of(
    head: Iterable[str], rows: Iterable[Iterable["str | Text"]], numbers: slice = slice(0), *, names: bool = False
) -> "Table":
    """A table, some of its columns numbers, at the right; the first one may be names, which are not wrapped."""
    from rich.table import Table

    table = Table(*head)
    for column in table.columns[numbers]:
        column.justify = "right"
    table.columns[0].no_wrap = names
    for row in rows:
        table.add_row(*row)
    return table


def sizes_table(first: str, sides: Iterable[str], rows: Iterable[Iterable[str]], *more: str) -> "Table":
    """A table whose columns are largest, 99th percentile and rms of each side of an error, and more to their right."""
    from compgen.report.page import statistics_head

    return table_of([first, *statistics_head(sides), *more], rows, slice(1, None), names=True)
