"""Some files of a folder replaced in one step, so that whoever reads them has all of the old ones or all of the new.

The new files and hard links to all others are laid into a hidden folder, which then changes places with the old one in
one step of the file system. Files of others keep their data and stay what they are. Where a folder cannot be exchanged
(a folder is in it, somebody stands in it, the system cannot), the new files are first made complete in a hidden folder
inside it; a run that is killed while they take their places is brought to its end by the next one. The figures of a
page that is replaced go with it.
"""

import os
from collections.abc import Collection, Mapping
from contextlib import suppress
from pathlib import Path

from compgen.cli.output_files import marker
from compgen.cli.output_files.figure_files import Content, earlier_figures
from compgen.cli.output_files.publish import (
    MARK,
    alone_in,
    can_move,
    exchange,
    remove_leftovers,
    remove_stage,
    write_files,
)
from compgen.core import interrupts

COMPLETE = f"{MARK}resumed"  # holds files that are complete, and shall take their places


def replace_together(folder: Path, files: Mapping[str, Content], run: marker.Run) -> None:
    """Put a run's files into a folder that exists, in place of those of their names, and say so in its marker.

    Raises:
        InputError: The folder cannot be written; nothing has changed.
    """
    interrupts.raise_on_signal()
    with alone_in(folder) as target:
        _clear_up(target)
        beside = target.parent / interrupts.temporary_name(f".{target.name}{MARK}")
        with interrupts.raise_later():
            if not (can_move(target) and _exchanged(target, beside, files, run)):
                _one_by_one(target, files, run)


def finish_replacing(folder: Path) -> None:
    """Bring to its end what a killed run began: files that are complete take their places, what is left goes.

    Raises:
        InputError: The folder cannot be written.
    """
    if not folder.is_dir():  # none, or a link that leads round in a circle
        return
    with alone_in(folder) as target:
        _clear_up(target)


def _exchanged(target: Path, stage: Path, files: Mapping[str, Content], run: marker.Run) -> bool:
    """Whether a folder with the new files has taken the place of the old one."""
    linked: dict[str, tuple[int, int]] = {}
    replaced = {*files, marker.NAME} | _old_figures(target, files)
    done = False
    try:
        stage.mkdir(0o700)
        for entry in list(target.iterdir()):
            if entry.name not in replaced:
                os.link(entry, stage / entry.name)
                linked[entry.name] = _inode(entry)
        write_files(stage, files, target, run, replaced)
        stage.chmod(target.stat().st_mode & 0o7777)
        done = exchange(stage, target)
    except OSError:  # no hard links here, no permission beside the folder
        done = False
    finally:
        if done:
            _put_back(stage, target, replaced, linked)
        remove_stage(stage)
    return done


def _put_back(stage: Path, target: Path, replaced: set[str], linked: Mapping[str, tuple[int, int]]) -> None:
    """What somebody wrote into the old folder while it was exchanged goes to the new one."""
    for entry in list(stage.iterdir()):
        if entry.name not in replaced and linked.get(entry.name) != _inode(entry):
            with suppress(OSError):
                entry.replace(target / entry.name)


def _inode(file: Path) -> tuple[int, int]:
    facts = os.lstat(file)
    return facts.st_dev, facts.st_ino


def _one_by_one(target: Path, files: Mapping[str, Content], run: marker.Run) -> None:
    stage = target / interrupts.temporary_name(MARK)
    try:
        stage.mkdir(0o700)
        write_files(stage, files, target, run, _old_figures(target, files))
        stage.rename(target / COMPLETE)  # from here on the new files stand, whoever puts them into their places
    finally:
        remove_stage(stage)
    _finish(target)


def _clear_up(target: Path) -> None:
    remove_leftovers(target.parent, f".{target.name}{MARK}")
    remove_leftovers(target, MARK)
    _finish(target)


def _finish(target: Path) -> None:
    complete = target / COMPLETE
    if not complete.is_dir():
        return
    entries = sorted(complete.iterdir(), key=lambda entry: (entry.name == marker.NAME, entry.name))
    for name in _old_figures(target, {entry.name for entry in entries}):
        (target / name).unlink(missing_ok=True)
    for entry in entries:
        entry.replace(target / entry.name)
    complete.rmdir()


def _old_figures(target: Path, names: Collection[str]) -> set[str]:
    """Figures of pages that are replaced, which no new figure replaces."""
    return {figure for name in names if name.endswith(".html") for figure in earlier_figures(target / name)} - {*names}
