"""Rows of a study as they come, on disk: what a killed study has finished is found again.

One JSON object a line; the first line names the study. A line counts when it is whole. Lines are appended and forced to
the disk one batch at a time, so that a kill loses at most the batch at work.
"""

import json
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

from compgen.core.exceptions import InputError

NAME = "scenarios.jsonl"


def header(identity: str) -> dict[str, Any]:
    """The first line, which names the study."""
    return {"compgen study": identity}


def content(identity: str, rows: list[dict[str, Any]]) -> bytes:
    """The whole journal, rows in the order of the study."""
    lines = [header(identity), *sorted(rows, key=lambda r: r["index"])]
    return "".join(json.dumps(line) + "\n" for line in lines).encode()


def read_finished(folder: Path, identity: str) -> list[dict[str, Any]]:
    """Rows of an earlier run of the same study; none when it was another."""
    try:
        lines = (folder / NAME).read_bytes().split(b"\n")
    except OSError:
        return []
    rows: dict[int, dict[str, Any]] = {}
    for n, line in enumerate(lines[:-1]):  # what follows the last newline was cut off
        try:
            entry = json.loads(line)
        except ValueError:
            continue
        if n == 0 and entry != header(identity):
            return []
        if isinstance(entry, dict) and isinstance(entry.get("index"), int):
            rows[entry["index"]] = entry
    return list(rows.values())


class Journal:
    """The open file, to which finished rows are appended."""

    def __init__(self, folder: Path, identity: str, rows: list[dict[str, Any]]) -> None:
        """Begin with the rows that are finished already; the old file is replaced in one step."""
        part = folder / f".{NAME}.part"
        missing = [p for p in (folder, *folder.parents) if not p.exists()]
        try:
            folder.mkdir(parents=True, exist_ok=True)
            part.write_bytes(content(identity, rows))
            part.replace(folder / NAME)
            self._path = folder / NAME
            self._file = os.open(folder / NAME, os.O_WRONLY | os.O_APPEND)
        except OSError as failure:
            with suppress(OSError):
                part.unlink(missing_ok=True)
                for parent in missing:
                    parent.rmdir()
            raise InputError(f"output folder {folder}: cannot be written: {failure.strerror}; give another") from None

    def add(self, rows: list[dict[str, Any]]) -> None:
        """Append finished rows."""
        try:
            os.write(self._file, "".join(json.dumps(row) + "\n" for row in rows).encode())
            os.fsync(self._file)
        except OSError as failure:
            raise InputError(
                f"{self._path}: cannot be written: {failure.strerror}; finished scenarios are kept"
            ) from None

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)
