"""Rows of a study as they come, on disk: what a killed study has finished is found again.

One JSON object a line; the first line names the study. A line counts when it is whole. Lines are appended and forced to
the disk one batch at a time, so that a kill loses at most the batch at work.
"""

import json
import os
from contextlib import suppress
from math import isfinite
from pathlib import Path
from typing import Any

from compgen.cli.output_files.publish import write_file
from compgen.core.exceptions import InputError
from compgen.core.files import read_regular

NAME = "scenarios.jsonl"


def header(identity: str) -> dict[str, Any]:
    """The first line, which names the study."""
    return {"compgen study": identity}


def content(identity: str, rows: list[dict[str, Any]]) -> bytes:
    """The whole journal, rows in the order of the study."""
    lines = [header(identity), *sorted(rows, key=lambda r: r["index"])]
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
        return read_regular(folder / NAME).split(b"\n")
    except FileNotFoundError:
        return None
    except OSError as failure:
        raise InputError(f"{folder / NAME}: cannot be read: {failure.strerror}; remove it") from None


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
            raise InputError(f"{folder / NAME}: line {n}: not a row of this study; remove the line, or say --fresh")
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
        self._is_new = not rows and not (folder / NAME).exists()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._path = folder / NAME
            write_file(self._path, content(identity, rows))
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
