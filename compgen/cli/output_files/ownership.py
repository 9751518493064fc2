"""Whose files are in an output folder: a command replaces what it has written itself, and nothing else.

A folder's record (``report.json``, ``heat.json``, ``whatif.json``) tells which command wrote it and about what. It is
written first and removed last, so that a killed run leaves none of the files that it vouches for without it. A program
that has lost its report in such a run tells by its own header or by the provenance beside it.
"""

import json
import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from compgen.cli.output_files.figure_files import earlier_figures
from compgen.cli.output_files.publish import check_writable
from compgen.core.commands import Command, command_of
from compgen.core.exceptions import InputError
from compgen.core.files import MOST_TABLE_BYTES, POSTERIOR, read_regular

REPORT = "report.json"
HEAT = "heat.json"
EXECUTED = "executed.json"
COMPARE = "compare.json"
RESUME_FILES = ("resume.json", "resume.html")
_PROGRAM_LINE = re.compile(rb"^/PROG[ \t]+([A-Za-z0-9_-]+)", re.MULTILINE)


def check_job_folder(folder: Path, command: Command, name: str, program: str) -> None:
    """Raises InputError when a folder has files that ``generate`` or ``predict`` of a path would replace wrongly.

    Args:
        folder: Where results go.
        command: ``generate`` or ``predict``.
        name: The job's.
        program: The file of its program.
    """
    is_own = command is Command.GENERATE and _contains(folder / program, b'= "compgen ')
    _check_report(folder, command, name, () if is_own else (program, "report.html", "waypoints.csv"))
    if not is_own:
        _check_foreign(folder, command, [program])


def check_planned_program(folder: Path, program: str, comment: str) -> None:
    """Raises InputError when the planned program's file is there and is another's.

    Args:
        folder: Where results go.
        program: The file.
        comment: In the header of what ``predict`` writes.
    """
    if not _contains(folder / program, f'= "{comment}"'.encode()):
        _check_foreign(folder, Command.PREDICT, [program])


def check_correction_folder(folder: Path, content: bytes, program: str, provenance: str) -> None:
    """Raises InputError when a folder has files that ``correct`` of a program would replace wrongly.

    Args:
        folder: Where results go.
        content: Of the planned program.
        program: Its file.
        provenance: The file beside a corrected program.
    """
    match = _PROGRAM_LINE.search(content, 0, 4000)
    name = match[1].decode("ascii") if match else Path(program).stem
    _check_report(folder, Command.CORRECT, name, ("report.html", "positions.csv"))
    if not os.path.lexists(folder / provenance):
        _check_foreign(folder, Command.CORRECT, [program])


def check_heat_folder(folder: Path, name: str) -> None:
    """Raises InputError when a folder has files that ``heat`` of a path, ``name`` the job's, would replace wrongly."""
    _check_record(folder, Command.HEAT, name, HEAT, ("heat.csv", "heat.html", "runs.csv"))


def check_compare_folder(folder: Path) -> None:
    """Raises InputError when a folder has files that ``compare`` would replace and has not written."""
    if command_in(folder / COMPARE) is not Command.COMPARE:
        _check_foreign(folder, Command.COMPARE, [COMPARE, "compare.html"])


def check_executed_folder(folder: Path, name: str) -> None:
    """Raises InputError when a folder has files that ``executed`` of a program would replace wrongly."""
    _check_record(folder, Command.EXECUTED, name, EXECUTED, ("executed.html", "executed.csv"))


def check_restored(folder: Path, program: str, planned: bytes) -> None:
    """Raises InputError when a folder has another program of the name that is given back."""
    file = folder / program
    if os.path.lexists(file) and not (file.is_file() and file.read_bytes() == planned):
        raise _refusal(folder, f"another {program} is in it; move it away, or")


def check_pages_folder(folder: Path, files: set[str], own_names: set[str]) -> None:
    """Raises InputError when a folder has files that ``pages`` would replace and has not written."""
    if os.path.lexists(folder / REPORT):
        raise _refusal(folder, f"it holds the {REPORT} of another command;")
    _check_foreign(folder, Command.PAGES, sorted(files - own_names))


def check_planned_poses(folder: Path, program: str, reversals: str) -> None:
    """Raises InputError when poses that are planned anew would replace another robot's, or measurements.

    Args:
        folder: Where results go.
        program: The file that drives to the poses.
        reversals: The file that drives to those of the reversal runs.
    """
    if not _contains(folder / program, b'= "poses to measure"'):
        _check_foreign(folder, Command.PLAN_POSES, [program, "poses.csv", "expected.csv"])
    if not _contains(folder / reversals, b'= "reversal runs"'):
        _check_foreign(folder, Command.PLAN_POSES, [reversals, "reversals.csv"])
    for name in ("poses.csv", "reversals.csv"):
        if not all(row.endswith(b",,,") for row in _rows_in(folder / name)):
            raise _refusal(folder, f"{name} in it has measurements; move it away, or")


def check_planned_touches(folder: Path, program: str, record: str, table: str) -> None:
    """Raises InputError when touches that are planned anew would replace other files, or touches that were made.

    Args:
        folder: Where results go.
        program: The file that touches.
        record: What was planned.
        table: What the shop fills in.
    """
    if command_in(folder / record) is not Command.PLAN_TOUCHES:
        _check_foreign(folder, Command.PLAN_TOUCHES, [program, record, table])
    if not all(row.startswith(b",") for row in _rows_in(folder / table)):
        raise _refusal(folder, f"{table} in it has touches that were made; move it away, or")


def _rows_in(table: Path) -> list[bytes]:
    """The rows of a table below its header; none where it is not there, one that is no row where it cannot be read."""
    try:
        return read_regular(table).splitlines()[1:]
    except FileNotFoundError:
        return []
    except OSError:
        return [b"?"]


def check_identified(target: Path) -> None:
    """Raises InputError when a robot file, or a report beside it, is there that ``identify`` has not written."""
    marked = {target: b"\n[identified]", target.with_suffix(POSTERIOR): b'"correlation"'}
    _check_robot_files(target, Command.IDENTIFY, marked)


def check_identified_motion(target: Path) -> None:
    """Raises InputError when a robot file, or a report beside it, is there that ``identify-motion`` has not written."""
    _check_robot_files(target, Command.IDENTIFY_MOTION, {target: b"[motion.identified]"})


def _check_robot_files(target: Path, command: Command, marked: Mapping[Path, bytes]) -> None:
    """Raises InputError for a file without the marker that its command writes, or a report of another command."""
    foreign = [file for file, marker in marked.items() if not _contains(file, marker, MOST_TABLE_BYTES)]
    for stem in (target.stem, f"{target.stem}_refused"):
        report, page = target.with_name(f"{stem}.json"), target.with_name(f"{stem}.html")
        foreign += [] if command_in(report) is command else [report, page]
    for file in foreign:
        if os.path.lexists(file):
            raise InputError(
                f"{file}: it is there and not what cgen {command} wrote; move it away, or give another file with -o"
            )


def check_file(option: str, name: str) -> None:
    """Raises InputError when a single file, as an option names it, cannot be written; one that is there is replaced."""
    if not name or "\0" in name or os.path.isdir(name):
        raise InputError(f"{option} {name!r}: not a file's name; give one")
    check_writable(Path(name).absolute().parent)


def check_own_file(option: str, name: str, marker: bytes | None, command: str) -> None:
    """Raises InputError when a file cannot be written, or is there and is neither empty nor of the command's kind.

    Args:
        option: That names it.
        name: As typed.
        marker: What the first bytes of a file of the command's kind hold; None of its record.
        command: That writes it.
    """
    check_file(option, name)
    is_own = command_in(Path(name)) == command if marker is None else _contains(Path(name), marker)
    if os.path.isfile(name) and Path(name).stat().st_size and not is_own:
        raise InputError(f"{name}: it is there and not what cgen {command} wrote; move it away, or give another file")


def resume_files(folder: Path) -> set[str]:
    """The reports of ``resume`` in a folder and their figures, which go with the pages that they are of."""
    if command_in(folder / RESUME_FILES[0]) is not Command.RESUME:
        return set()
    return {*RESUME_FILES, *earlier_figures(folder / RESUME_FILES[1])}


def _check_report(folder: Path, command: Command, name: str, others: Iterable[str]) -> None:
    """Raises InputError for the report of another command or job, or for ``others`` that no report vouches for."""
    if not os.path.lexists(folder / REPORT):
        _check_foreign(folder, command, others)
        return
    author = _author(folder / REPORT)
    if author is None:
        _check_foreign(folder, command, [REPORT])
    elif author != (command, name):
        raise _refusal(folder, f"it holds what cgen {author[0]} wrote about {author[1][:40]};")


def _check_record(folder: Path, command: Command, name: str, record_file: str, others: Iterable[str]) -> None:
    """Raises InputError for a record that the command has not written, or about another; or for ``others`` alone."""
    if not os.path.lexists(folder / record_file):
        _check_foreign(folder, command, others)
        return
    record = read_record(folder / record_file)
    if command_of(record) is not command:
        _check_foreign(folder, command, [record_file])
    if record.get("name") != name:
        raise _refusal(folder, f"it holds what cgen {command} wrote about {str(record.get('name'))[:40]!a};")


def _check_foreign(folder: Path, command: Command, names: Iterable[str]) -> None:
    """Raises InputError for the first of some files that is there: nothing says that a command wrote it."""
    foreign = next((name for name in names if os.path.lexists(folder / name)), None)
    if foreign:
        raise _refusal(folder, f"{foreign} in it is not what cgen {command} wrote; move it away, or")


def read_record(file: Path) -> dict[str, Any]:
    """A JSON object; an empty one where the file holds none."""
    try:
        record = json.loads(read_regular(file))
    except (OSError, ValueError, RecursionError):
        return {}
    return record if isinstance(record, dict) else {}


def command_in(file: Path) -> Command | None:
    """The command that left a record; None where the file holds none."""
    return command_of(read_record(file))


def _author(report: Path) -> tuple[str, str] | None:
    """The command that wrote a report, and what about; None where no command did."""
    record = read_record(report)
    name, command = record.get("name"), command_of(record)
    return (command, name) if command and isinstance(name, str) and name.isprintable() else None


def _contains(file: Path, marker: bytes, first: int = 400) -> bool:
    """Whether a file's first bytes hold what only a command writes."""
    try:
        return marker in read_regular(file)[:first]
    except OSError:
        return False


def _refusal(folder: Path, reason: str) -> InputError:
    return InputError(f"output folder {folder}: {reason} give another with -o")
