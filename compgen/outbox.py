"""Files that appear together or not at all, also when the process is killed half way.

A run's files are written into a hidden folder beside the target, which then takes the target's place in one step of
the file system. What else the target held is carried over first. Used by the command line only.
"""

import ctypes
import os
import shutil
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from compgen.exceptions import InputError

_AT_FDCWD, _EXCHANGE = -100, 2


def check_writable(folder: Path) -> None:
    """Raises InputError when a folder cannot take files, before any work is done."""
    place = folder
    while not place.exists():
        if place.is_symlink():
            raise _refusal(folder, f"{place} is a broken link")
        place = place.parent
    if not place.is_dir():
        raise _refusal(folder, f"{place} is a file")
    if not os.access(place, os.W_OK | os.X_OK):
        raise _refusal(folder, f"no permission to write in {place}")


def publish(folder: Path, files: Mapping[str, bytes], ours: set[str]) -> None:
    """Put files into a folder in one step.

    Args:
        folder: Made when absent.
        files: Name to content.
        ours: Names that belong to this run; those not in ``files`` vanish, everything else in the folder stays.

    Raises:
        InputError: The folder cannot be written; nothing has changed.
    """
    target = folder.resolve()
    stage: Path | None = None
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        _tidy(target, ours)
        stage = Path(tempfile.mkdtemp(prefix=f".{target.name}.compgen-{os.getpid()}-", dir=target.parent))
        for name, content in files.items():
            with (stage / name).open("wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
        if target.exists():
            stage.chmod(target.stat().st_mode & 0o7777)
            _swap(stage, target, ours)
        else:
            mask = os.umask(0)
            os.umask(mask)
            stage.chmod(0o777 & ~mask)
            stage.rename(target)
    except OSError as failure:
        if stage is not None:
            shutil.rmtree(stage, ignore_errors=True)
        raise _refusal(folder, failure.strerror or str(failure)) from failure


def _swap(stage: Path, target: Path, ours: set[str]) -> None:
    """Exchange the two folders; foreign files are linked over before, foreign folders moved after."""
    for entry in target.iterdir():
        if entry.name not in ours and not entry.is_dir():
            try:
                os.link(entry, stage / entry.name, follow_symlinks=False)
            except OSError:
                shutil.copy2(entry, stage / entry.name, follow_symlinks=False)
    if not _exchange(stage, target):
        old = stage.with_name(stage.name + "-old")
        target.rename(old)
        stage.rename(target)
        old.rename(stage)
    _rescue(stage, target, ours)


def _rescue(left: Path, target: Path, ours: set[str]) -> None:
    """Move what is not ours out of a left-over folder, then remove it."""
    for entry in left.iterdir():
        if entry.name not in ours and not (target / entry.name).exists():
            entry.rename(target / entry.name)
    shutil.rmtree(left, ignore_errors=True)


def _tidy(target: Path, ours: set[str]) -> None:
    """Clean up after runs that were killed: their hidden folders name a process that is gone."""
    for left in target.parent.glob(f".{target.name}.compgen-*"):
        process = left.name.rsplit("compgen-", 1)[1].split("-")[0]
        if process.isdigit() and int(process) != os.getpid() and not _alive(int(process)):
            if target.is_dir():
                _rescue(left, target, ours)
            elif not any(e.name not in ours for e in left.iterdir()):
                shutil.rmtree(left, ignore_errors=True)


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _exchange(a: Path, b: Path) -> bool:
    """Swap two folders in one step of the file system, where the system can."""
    if not sys.platform.startswith("linux"):
        return False
    renameat2 = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    return renameat2 is not None and renameat2(_AT_FDCWD, os.fsencode(a), _AT_FDCWD, os.fsencode(b), _EXCHANGE) == 0


def _refusal(folder: Path, reason: str) -> InputError:
    return InputError(f"output folder {folder}: cannot be written: {reason}; give another with -o")
