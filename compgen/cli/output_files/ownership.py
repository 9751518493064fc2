"""Whose files are in an output folder: a command replaces what it has written itself, and nothing else.

The folder's marker says it. A folder of a release without a marker, and one in which a run was killed, is known by what
it holds: a record (``report.json``, ``heat.json``) tells which command wrote it and about what, and vouches for the
files beside it; it is written first and removed last. A program tells by its own header, or by the provenance beside
it.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from compgen.cli.output_files.figure_files import earlier_figures
from compgen.cli.output_files.marker import Run, command_in, owners_in
from compgen.cli.output_files.publish import check_writable
from compgen.core.commands import Command, command_of
from compgen.core.exceptions import InputError
from compgen.core.files import MOST_TABLE_BYTES, POSTERIOR, read_regular
from compgen.core.json_text import read_record

REPORT = "report.json"
RESUME_FILES = ("resume.json", "resume.html")


@dataclass(frozen=True, slots=True, kw_only=True)
class Headed:
    """A program that tells by its header whose it is: what only this command writes there; None: nothing does."""

    program: str
    header: str | None = None
    vouches: Sequence[str] = ()  # files that are of the same command


def check_folder(
    folder: Path,
    run: Run,
    *,
    record: str = "",
    others: Sequence[str] = (),
    headed: Sequence[Headed] = (),
    option: str = "-o",
) -> None:
    """Raises InputError where a run would replace a file of another run, or of somebody else.

    Args:
        folder: Where its files go.
        run: The command, and what it is about.
        record: The file that says both; empty where it leaves none.
        others: Files that only the record vouches for.
        headed: Programs.
        option: That names the folder.
    """
    names = (record, *(one.program for one in headed), *others)
    owners = owners_in(folder, names)
    for name in names:
        if not name or not os.path.lexists(folder / name):
            continue
        owner = owners.get(name) or _owner_by_content(folder, run, name, record, headed)
        if owner is None or (run.about and not owner.about):
            raise refusal(folder, f"{name} in it is not what cgen {run.command} wrote; move it away, or", option)
        if not run.takes(owner):
            raise refusal(folder, f"it holds what cgen {owner.command} wrote about {owner.about[:40]};", option)


def check_restored(folder: Path, program: str, planned: bytes) -> None:
    """Raises InputError when a folder has another program of the name that is given back."""
    file = folder / program
    if os.path.lexists(file) and not (file.is_file() and file.read_bytes() == planned):
        raise refusal(folder, f"another {program} is in it; move it away, or")


def check_unfilled(folder: Path, table: str, filled: str) -> None:
    """Raises InputError where a table is there that is not as the folder's marker has it: the shop may have filled it.

    Args:
        folder: Where the table goes.
        table: Its file.
        filled: What it would have then.
    """
    if os.path.lexists(folder / table) and table not in owners_in(folder, [table]):
        raise refusal(folder, f"{table} in it has {filled}; move it away, or")


def check_robot_files(target: Path, command: Command, markers: Mapping[str, str]) -> None:
    """Raises InputError when a robot file, or a report beside it, is there that the command has not written.

    Args:
        target: The robot file.
        command: That writes it.
        markers: Ending of a file's name to what only the command writes into it.
    """
    marked = {target.with_suffix(ending): marker for ending, marker in markers.items()}
    foreign = [file for file, marker in marked.items() if not _contains(file, marker, MOST_TABLE_BYTES)]
    for stem in (target.stem, f"{target.stem}_refused"):
        report, page = target.with_name(f"{stem}.json"), target.with_name(f"{stem}.html")
        foreign += [] if command_in(report) is command else [report, page]
    there = next((file for file in foreign if os.path.lexists(file)), None)
    if there:
        raise InputError(
            f"{there}: it is there and not what cgen {command} wrote; move it away, or give another file with -o"
        )


#: what only its command writes into a robot file, and into the file beside it
IDENTIFIED = {".toml": "\n[identified]", POSTERIOR: '"correlation"'}
IDENTIFIED_MOTION = {".toml": "[motion.identified]"}


def check_own_file(option: str, name: str, marker: str | None, command: str) -> None:
    """Raises InputError when a file cannot be written, or is there and is neither empty nor of the command's kind.

    Args:
        option: That names it.
        name: As typed.
        marker: What the beginning of a file of the command's kind holds; None of its record.
        command: That writes it.
    """
    if not name or "\0" in name or os.path.isdir(name):
        raise InputError(f"{option} {name!r}: not a file's name; give one")
    check_writable(Path(name).absolute().parent)
    is_own = command_in(Path(name)) == command if marker is None else _contains(Path(name), marker)
    if os.path.isfile(name) and Path(name).stat().st_size and not is_own:
        raise InputError(f"{name}: it is there and not what cgen {command} wrote; move it away, or give another file")


def resume_files(folder: Path) -> set[str]:
    """The reports of ``resume`` in a folder and their figures, which go with the pages that they are of."""
    if command_in(folder / RESUME_FILES[0]) is not Command.RESUME:
        return set()
    return {*RESUME_FILES, *earlier_figures(folder / RESUME_FILES[1])}


def _owner_by_content(folder: Path, run: Run, name: str, record: str, headed: Sequence[Headed]) -> Run | None:
    """Whose a file is by what the folder holds; None where nothing tells that a command wrote it."""
    for one in headed:
        if name == one.program or name in one.vouches:
            if one.header is not None and _contains(folder / one.program, one.header):
                return run
            if name == one.program:
                return None
    about = read_record(folder / record) if record else {}
    command, subject = command_of(about), about.get("name")
    is_named = isinstance(subject, str) and subject.isprintable()
    return Run(command, str(subject) if is_named else "") if command else None


def _contains(file: Path, marker: str, first: int = 400) -> bool:
    """Whether a file's first bytes hold what only a command writes."""
    try:
        return marker.encode() in read_regular(file)[:first]
    except OSError:
        return False


def refusal(folder: Path, reason: str, option: str = "-o") -> InputError:
    """That a folder's files are not replaced, and the mend."""
    return InputError(f"output folder {folder}: {reason} give another with {option}")
