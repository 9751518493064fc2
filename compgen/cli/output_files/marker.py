"""The marker of an output folder: which command wrote which of its files, about what, in which version.

``compgen.json`` has a run for each command, and job or program, that wrote into the folder, with the hash of each of
its files. It is written after all of them and goes before any of them; a file whose hash is another is somebody's.
"""

import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from compgen.core.commands import Command, command_of
from compgen.core.exceptions import InputError
from compgen.core.files import read_regular
from compgen.core.json_text import json_text, read_record
from compgen.core.version import __version__

NAME = "compgen.json"


@dataclass(frozen=True, slots=True)
class Run:
    """What wrote files: a command, and the job or program that they are about; empty where that does not matter."""

    command: str
    about: str = ""

    def takes(self, owner: "Run") -> bool:
        """Whether files of ``owner`` may be replaced by this run's."""
        return owner.command == self.command and self.about in ("", owner.about)


def owners_in(folder: Path, names: Collection[str]) -> dict[str, Run]:
    """Whose some files of a folder are: those that its marker names and that are what was written."""
    return {
        name: Run(run["command"], run["about"])
        for run in runs_in(folder)
        for name, digest in run["files"].items()
        if name in names and hash_of(folder / name) == digest
    }


def marker_text(folder: Path, run: Run, hashes: Mapping[str, str], gone: Collection[str]) -> bytes:
    """The marker of a folder after a run.

    Args:
        folder: Where the files go; the runs that its marker has keep the files that this one leaves them.
        run: That writes.
        hashes: Of its files, by name.
        gone: Files that are replaced or removed.
    """
    files, runs = dict(hashes), []
    for earlier in runs_in(folder):
        stay = {name for name in earlier["files"] if name not in gone and (folder / name).exists()}
        left = {name: earlier["files"][name] for name in sorted(stay)}
        if (earlier["command"], earlier["about"]) == (run.command, run.about):
            files |= left
        elif left:
            runs.append({**earlier, "files": left})
    own = {"command": run.command, "about": run.about, "version": __version__, "files": dict(sorted(files.items()))}
    runs = sorted([*runs, own], key=lambda each: (each["command"], each["about"]))
    return json_text({"schema": 1, "runs": runs})


def command_in(file: Path) -> Command | None:
    """The command that left a record; None where the file holds none."""
    return command_of(read_record(file))


def runs_in(folder: Path) -> list[dict[str, Any]]:
    """The runs that a folder's marker has; none where it has no marker.

    Raises:
        InputError: A file of the marker's name is there that is none.
    """
    if not os.path.lexists(folder / NAME):
        return []
    runs = read_record(folder / NAME).get("runs")
    if not isinstance(runs, list) or not all(map(_is_run, runs)):
        raise InputError(
            f"output folder {folder}: {NAME} in it is not what cgen wrote; move it away, or give another with -o"
        )
    return runs


def _is_run(run: Any) -> bool:
    if not isinstance(run, dict) or not isinstance(run.get("files"), dict):
        return False
    words = [run.get("command"), run.get("about"), *run["files"].values()]
    return all(isinstance(word, str) for word in words)


def hash_of(file: Path) -> str | None:
    """Of what a file holds; None where it cannot be read."""
    try:
        return sha256(read_regular(file)).hexdigest()
    except (OSError, ValueError):
        return None
