"""Where a study's files go: into its own folder, never over those of another study."""

import os
from itertools import count
from pathlib import Path

from compgen.cli.output_files import study_journal
from compgen.cli.output_files.ownership import command_in, read_record
from compgen.cli.output_files.publish import check_writable
from compgen.core.commands import Command
from compgen.core.exceptions import InputError

RECORD = "whatif.json"
QUESTIONS = ("warmup", "validity", "contributions", "steady", "passes")


def own_files() -> set[str]:
    """All files that a study may have."""
    return {study_journal.NAME, RECORD, "whatif.csv", "whatif.html", *(f"{q}.csv" for q in QUESTIONS)}


def study_folder(
    folder: Path, path: str, identity: str | None, questions: set[str], is_chosen: bool, fresh: bool
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
    if study_journal.NAME in files:
        return study_journal.identity_in(folder) == identity
    record = read_record(folder / RECORD)
    is_own = record.get("study_sha256", "") is None and Path(str(record.get("path"))).stem == Path(path).stem
    return is_own and files <= {RECORD, "whatif.html", *(f"{question}.csv" for question in questions)}


def _check_replaceable(folder: Path) -> None:
    """Raises InputError where a file would be replaced that no study has left."""
    files = _files_in(folder)
    if files and not (study_journal.identity_in(folder) or command_in(folder / RECORD) is Command.WHATIF):
        raise InputError(
            f"output folder {folder}: {min(files)} in it is not what cgen whatif wrote; move it away, or give another "
            "with -o"
        )


def _files_in(folder: Path) -> set[str]:
    return {name for name in own_files() if os.path.lexists(folder / name)}
