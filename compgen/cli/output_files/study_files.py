"""Where a study's files go: into its own folder, never over those of another; its rows are there as they come.

What a killed study has finished is found again: its journal has one JSON object a line; the first line names the study.
A line counts when it is whole. Lines are appended and forced to the disk one batch at a time, so that a kill loses at
most the batch at work.
"""

import json
import os
from contextlib import suppress
from itertools import count
from math import isfinite
from pathlib import Path
from typing import Any

from compgen.cli.output_files.marker import command_in
from compgen.cli.output_files.publish import check_writable, write_file
from compgen.core.commands import Command
from compgen.core.exceptions import InputError
from compgen.core.files import read_regular
from compgen.core.json_text import read_record

JOURNAL = "scenarios.jsonl"
RECORD = "whatif.json"
QUESTIONS = ("warmup", "validity", "contributions", "steady", "passes")


def own_files() -> set[str]:
    """All files that a study may have."""
    return {JOURNAL, RECORD, "whatif.csv", "whatif.html", *(f"{q}.csv" for q in QUESTIONS)}


def study_folder(
    folder: Path, path: str, identity: str | None, questions: set[str], *, is_chosen: bool, fresh: bool
) -> Path:
    """The folder, or where it holds another study the first one beside it (``_2``, ``_3``) that does not.

    Args:
        folder: Where the files shall go.
        path: The path file.
        identity: Of the study; None where only questions are asked.
        questions: That are asked.
        is_chosen: Whether the user named the folder, who then looks for the files there and nowhere else.
        fresh: Whether another study in the folder may be replaced.

    Raises:
        InputError: A chosen folder holds another study, or the folder beside cannot be written; or a study shall be
            replaced and there is none, but a file of its name that is somebody else's.
    """
    if fresh:
        _check_replaceable(folder)
        return folder
    if _takes(folder, path, identity, questions):
        return folder
    if is_chosen:
        raise InputError(
            f"output folder {folder}: it holds another study; give another with -o, or --fresh to replace it"
        )
    others = (folder.with_name(f"{folder.name}_{n}") for n in count(2))
    beside = next(other for other in others if _takes(other, path, identity, questions))
    check_writable(beside.absolute())
    return beside


def _takes(folder: Path, path: str, identity: str | None, questions: set[str]) -> bool:
    """Whether nothing of another study, of another path or of somebody else stands in a folder."""
    files = _files_in(folder)
    if not files:
        return True
    if JOURNAL in files:
        return identity_in(folder) == identity
    record = read_record(folder / RECORD)
    is_own = record.get("study_sha256", "") is None and Path(str(record.get("path"))).stem == Path(path).stem
    return is_own and files <= {RECORD, "whatif.html", *(f"{question}.csv" for question in questions)}


def _check_replaceable(folder: Path) -> None:
    """Raises InputError where a file would be replaced that no study has left."""
    files = _files_in(folder)
    if files and not (identity_in(folder) or command_in(folder / RECORD) is Command.WHATIF):
        raise InputError(
            f"output folder {folder}: {min(files)} in it is not what cgen whatif wrote; move it away, or give another "
            "with -o"
        )


def _files_in(folder: Path) -> set[str]:
    return {name for name in own_files() if os.path.lexists(folder / name)}


def journal_text(identity: str, rows: list[dict[str, Any]]) -> bytes:
    """The whole journal, rows in the order of the study."""
    lines = [{"compgen study": identity}, *sorted(rows, key=lambda r: r["index"])]
    return "".join(json.dumps(line) + "\n" for line in lines).encode()


def identity_in(folder: Path) -> str | None:
    """The study whose scenarios a folder holds; empty where that cannot be told, None where there are none."""
    lines = _lines(folder)
    if lines is None:
        return None
    try:
        return str(json.loads(lines[0])["compgen study"])
    except (ValueError, KeyError, TypeError, RecursionError):
        return ""


def _lines(folder: Path) -> list[bytes] | None:
    """The journal's lines, and what follows the last of them; None where there is no journal."""
    try:
        return read_regular(folder / JOURNAL).split(b"\n")
    except FileNotFoundError:
        return None
    except OSError as failure:
        raise InputError(f"{folder / JOURNAL}: cannot be read: {failure.strerror}; remove it") from None


def read_finished(folder: Path, identity: str) -> list[dict[str, Any]]:
    """Rows of an earlier run of the same study; none when it was another.

    Raises:
        InputError: A whole line is not a row that a study writes, or the file is not a regular one.
    """
    lines = _lines(folder) if identity_in(folder) == identity else None
    rows: dict[int, dict[str, Any]] = {}
    for n, line in enumerate((lines or [])[1:-1], 2):  # what follows the last newline was cut off
        try:
            entry = json.loads(line)
        except (ValueError, RecursionError):
            continue
        if not _is_row(entry):
            raise InputError(f"{folder / JOURNAL}: line {n}: not a row of this study; remove the line, or say --fresh")
        rows[entry["index"]] = entry
    return list(rows.values())


def _is_row(entry: Any) -> bool:
    """Whether a line is what ``add`` writes: an index, a state, and the numbers or the reason that go with it."""
    if not isinstance(entry, dict) or type(entry.get("index")) is not int or entry["index"] < 0:
        return False
    plain = all(isinstance(v, str | bool) or (isinstance(v, int | float) and isfinite(v)) for v in entry.values())
    if entry.get("state") == "failed":
        return plain and isinstance(entry.get("reason"), str)
    numbers = ("before_on_part_max_um", "before_rms_um", "duration_s", "waypoints")
    return plain and entry.get("state") == "done" and all(isinstance(entry.get(n), int | float) for n in numbers)


class Journal:
    """The open file, to which finished rows are appended."""

    def __init__(self, folder: Path, identity: str, rows: list[dict[str, Any]]) -> None:
        """Begin with the rows that are finished already; the old file is replaced in one step."""
        self._missing = [p for p in (folder, *folder.parents) if not p.exists()]
        self._is_new = not rows and not (folder / JOURNAL).exists()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._path = folder / JOURNAL
            write_file(self._path, journal_text(identity, rows))
            self._file = os.open(self._path, os.O_WRONLY | os.O_APPEND | os.O_NOFOLLOW)
        except (OSError, InputError) as failure:
            self._remove_folders()
            if isinstance(failure, InputError):
                raise
            raise InputError(f"output folder {folder}: cannot be written: {failure.strerror}; give another") from None

    def add(self, rows: list[dict[str, Any]]) -> None:
        """Append finished rows."""
        try:
            os.write(self._file, "".join(json.dumps(row) + "\n" for row in rows).encode())
            os.fsync(self._file)
            self._is_new = False
        except OSError as failure:
            raise InputError(
                f"{self._path}: cannot be written: {failure.strerror}; finished scenarios are kept"
            ) from None

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)

    def discard_empty(self) -> None:
        """Remove a new file to which nothing was added, with the folders made for it."""
        if self._is_new:
            with suppress(OSError):
                self._path.unlink()
            self._remove_folders()

    def _remove_folders(self) -> None:
        with suppress(OSError):  # the first with something in it stays
            for folder in self._missing:
                folder.rmdir()
