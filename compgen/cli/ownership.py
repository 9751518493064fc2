"""Whose files are in an output folder: a command replaces what it has written itself, and nothing else.

A folder's ``report.json`` tells which command wrote it and about what. A program that has lost its report, in a run
that was killed, tells by its own header or by the provenance beside it.
"""

import json
import os
import re
from pathlib import Path
from typing import Any

from compgen.core.exceptions import InputError
from compgen.core.files import read_regular

REPORT = "report.json"
_PROGRAM_LINE = re.compile(rb"^/PROG[ \t]+([A-Za-z0-9_-]+)", re.MULTILINE)


def check_job_folder(folder: Path, command: str, name: str, program: str) -> None:
    """Raises InputError when a folder has files that ``generate`` or ``predict`` of a path would replace wrongly.

    Args:
        folder: Where results go.
        command: ``generate`` or ``predict``.
        name: The job's.
        program: The file of its program.
    """
    _check_report(folder, command, name)
    if os.path.lexists(folder / program) and not (command == "generate" and _is_generated(folder / program)):
        raise _refusal(folder, f"{program} in it is not what cgen {command} wrote; move it away, or")


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
    _check_report(folder, "correct", name)
    if os.path.lexists(folder / program) and not os.path.lexists(folder / provenance):
        raise _refusal(folder, f"{program} in it is not what cgen correct wrote; move it away, or")


def check_restored(folder: Path, program: str, planned: bytes) -> None:
    """Raises InputError when a folder has another program of the name that is given back."""
    file = folder / program
    if os.path.lexists(file) and not (file.is_file() and file.read_bytes() == planned):
        raise _refusal(folder, f"another {program} is in it; move it away, or")


def check_pages_folder(folder: Path, files: set[str], own_names: set[str]) -> None:
    """Raises InputError when a folder has files that ``pages`` would replace and has not written."""
    if os.path.lexists(folder / REPORT):
        raise _refusal(folder, f"it holds the {REPORT} of another command;")
    foreign = next((name for name in sorted(files - own_names) if os.path.lexists(folder / name)), None)
    if foreign:
        raise _refusal(folder, f"{foreign} in it is not what cgen pages wrote; move it away, or")


def check_planned_poses(folder: Path, name: str) -> None:
    """Raises InputError when somebody has filled measurements into the poses that would be planned anew."""
    try:
        lines = read_regular(folder / name).splitlines()[1:]
    except FileNotFoundError:
        return
    except OSError:
        lines = [b"?"]
    if not all(line.endswith(b",,,") for line in lines):
        raise _refusal(folder, f"{name} in it has measurements; move it away, or")


def check_identified(target: Path) -> None:
    """Raises InputError when a robot file, or the report beside it, is there that ``identify`` has not written."""
    mend = "move it away, or give another file with -o"
    try:
        if os.path.lexists(target) and b"\n[identified]" not in read_regular(target):
            raise InputError(f"{target}: it is there and not what cgen identify wrote; {mend}")
        report = target.with_suffix(".json")
        if os.path.lexists(report) and "held_out_um" not in json.loads(read_regular(report)):
            raise InputError(f"{report}: it is there and not what cgen identify wrote; {mend}")
    except (OSError, ValueError, TypeError, RecursionError):
        raise InputError(f"{target}: it or its .json is there and cannot be read; {mend}") from None


def _check_report(folder: Path, command: str, name: str) -> None:
    if not os.path.lexists(folder / REPORT):
        return
    author = _author(folder / REPORT)
    if author is None:
        raise _refusal(folder, f"{REPORT} in it is not what cgen {command} wrote; move it away, or")
    if author != (command, name):
        raise _refusal(folder, f"it holds what cgen {author[0]} wrote about {author[1][:40]};")


def _author(report: Path) -> tuple[str, str] | None:
    """The command that wrote a report, and what about; None where no command of these did."""
    try:
        record: Any = json.loads(read_regular(report))
        name = record["name"]
        keys = set(record)
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    if not isinstance(name, str) or not name.isprintable():
        return None
    if {"unsafe", "positions"} <= keys:
        return "correct", name
    if {"path", "timing"} <= keys:
        return "predict" if record.get("after") is None else "generate", name
    return None


def _is_generated(program: Path) -> bool:
    """Whether a program's header says that ``generate`` made it."""
    try:
        return b'= "compgen ' in read_regular(program)[:400]
    except OSError:
        return False


def _refusal(folder: Path, reason: str) -> InputError:
    return InputError(f"output folder {folder}: {reason} give another with -o")
