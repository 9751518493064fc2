"""Where a study's files go: into its own folder, never over those of another study."""

import os
from itertools import count
from pathlib import Path

from compgen.cli import study_journal
from compgen.cli.publish import check_writable
from compgen.core.exceptions import InputError

QUESTIONS = ("warmup", "validity", "contributions", "steady", "passes")


def own_files() -> set[str]:
    """All files that a study may have."""
    return {study_journal.NAME, "whatif.csv", "whatif.json", "whatif.html", *(f"{q}.csv" for q in QUESTIONS)}


def study_folder(folder: Path, identity: str | None, questions: set[str], is_chosen: bool) -> Path:
    """The folder, or where it holds another study the first one beside it (``_2``, ``_3``) that does not.

    Args:
        folder: Where the files shall go.
        identity: Of the study; None where only questions are asked.
        questions: That are asked.
        is_chosen: Whether the user named the folder, who then looks for the files there and nowhere else.

    Raises:
        InputError: A chosen folder holds another study, or the folder beside cannot be written.
    """
    if _takes(folder, identity, questions):
        return folder
    if is_chosen:
        raise InputError(
            f"output folder {folder}: it holds another study; give another with -o, or --fresh to replace it"
        )
    beside = next(f for n in count(2) if _takes(f := folder.with_name(f"{folder.name}_{n}"), identity, questions))
    check_writable(beside.absolute())
    return beside


def _takes(folder: Path, identity: str | None, questions: set[str]) -> bool:
    """Whether nothing of another study stands in a folder."""
    here = {name for name in own_files() if os.path.lexists(folder / name)}
    if study_journal.NAME in here:
        return study_journal.identity_in(folder) == identity
    return here <= {"whatif.html", *(f"{question}.csv" for question in questions)}
