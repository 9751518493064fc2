"""Files that appear together or not at all, also when the process is killed half way.

A run's files are written into a hidden folder first. When the target is new, or holds only an earlier run's files,
the hidden folder takes its place in one step of the file system. A target that holds anything else is never moved: the
earlier reports go, the program takes the place of its predecessor in one step, and the new reports follow, so that a
program is never lost and never stands beside a report that does not prove it; the folder's marker goes first and comes
last. Runs on the same folder put their files there one after the other: the operating system holds the lock, and a
process that is killed gives it free. What is not ours is never copied, moved or deleted. Used by the command line only.
"""

import ctypes
import errno
import json
import os
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path

from compgen.cli.output_files import marker
from compgen.cli.output_files.figure_files import Content, earlier_figures
from compgen.core import interrupts
from compgen.core.exceptions import InputError
from compgen.core.files import read_regular

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

_AT_FDCWD, _EXCHANGE = -100, 2
MARK = ".compgen-"


def check_writable(folder: Path) -> None:
    """Raises InputError when a folder cannot take files, before any work is done."""
    nearest = folder
    try:
        while not _exists(nearest):
            nearest = nearest.parent
        if not nearest.exists():
            raise folder_refusal(folder, f"{nearest} is a broken link")
        if not nearest.is_dir():
            raise folder_refusal(folder, f"{nearest} is a file")
        if not os.access(nearest, os.W_OK | os.X_OK):
            raise folder_refusal(folder, f"no permission to write in {nearest}")
    except (OSError, ValueError) as failure:
        raise folder_refusal(folder, getattr(failure, "strerror", None) or str(failure)) from failure


def _exists(path: Path) -> bool:
    """Whether a name exists, links not followed; a name that cannot exist raises OSError or ValueError."""
    try:
        os.lstat(path)
    except (FileNotFoundError, NotADirectoryError):
        return False
    return True


def publish(
    folder: Path,
    programs: Mapping[str, Content],
    reports: Mapping[str, Content],
    own_names: Iterable[str] = (),
    manifest: str = "",
    run: marker.Run | None = None,
) -> None:
    """Put files into a folder, while no other run puts files there.

    Args:
        folder: Made when absent.
        programs: Name to content, whole or in parts, of what the run is for: programs, a robot file. The last of
            several is the one that needs the others.
        reports: Name to content of what describes them, first the record that tells whose files these are: it is
            written before the others and removed after them.
        own_names: Names that belong to this run beside these, and beside the figures that an earlier page of its name
            names: they vanish, everything else in the folder stays.
        manifest: Name of the manifest of an earlier run's pages: what it names belongs to this run too.
        run: Named in the folder's marker; None where the user named a file, and not a folder.

    Raises:
        InputError: The folder cannot be written; nothing has changed.
    """
    interrupts.raise_on_signal()
    missing: list[Path] = []
    try:
        target = folder.resolve()
        if not target.exists():
            missing = [p for p in target.parents if not p.exists()]
            target.parent.mkdir(parents=True, exist_ok=True)
        with alone_in(folder):
            pages = [target / name for name in reports if name.endswith(".html")]
            own = {*programs, *reports}.union(own_names, *map(earlier_figures, pages))
            if manifest:
                own |= files_of_earlier_run(target / manifest)
            own |= {marker.NAME} if run else set()
            check_names(folder, own)
            _put(target, programs, reports, own, run=run, paged=bool(manifest))
    except OSError as failure:
        raise folder_refusal(folder, failure.strerror or str(failure)) from failure
    finally:
        with suppress(OSError):  # folders made for nothing; the first with something in it stays
            for parent in missing:
                parent.rmdir()


def _put(
    target: Path,
    programs: Mapping[str, Content],
    reports: Mapping[str, Content],
    own_names: set[str],
    *,
    run: marker.Run | None,
    paged: bool,
) -> None:
    """Write files into a hidden folder, and put them in their places."""
    stage: Path | None = None
    new = not target.exists()
    try:
        remove_leftovers(target.parent, f".{target.name}{MARK}")
        remove_leftovers(target, MARK)
        beside = new or (can_move(target) and all(entry.name in own_names for entry in target.iterdir()))
        parent, prefix = (target.parent, f".{target.name}{MARK}") if beside else (target, MARK)
        stage = parent / interrupts.temporary_name(prefix)  # named before it is made: always removed
        stage.mkdir(0o700)
        write_files(stage, {**reports, **programs}, target, run, own_names)
        interrupts.block_interrupts()
        if new:
            stage.chmod(0o777 & ~_umask())
            _rename_to_new(stage, target)
            return
        if beside:
            stage.chmod(target.stat().st_mode & 0o7777)
        if not (beside and exchange(stage, target)):
            last = [marker.NAME] if run else []
            replace_files(stage, target, list(programs), [*reports, *last], own_names, paged=paged)
    finally:
        if stage is not None:
            remove_stage(stage)


def write_files(
    stage: Path, files: Mapping[str, Content], target: Path, run: marker.Run | None, gone: Collection[str]
) -> None:
    """Write files into a folder, down to the disk, and after them the marker that the target shall have.

    Args:
        stage: The folder.
        files: Name to content.
        target: Where they go from there.
        run: That writes them; None: the target gets no marker.
        gone: Files of the target that are replaced or removed.
    """
    hashes = {name: _write(stage / name, content) for name, content in files.items()}
    if run is not None:
        _write(stage / marker.NAME, marker.marker_text(target, run, hashes, {*gone, *files}))


def _write(path: Path, content: Content) -> str:
    """Write a file down to the disk; returns the hash of what it holds."""
    digest = sha256()
    with path.open("wb") as file:
        for block in [content] if isinstance(content, bytes) else content:
            digest.update(block)
            file.write(block)
        file.flush()
        os.fsync(file.fileno())
    return digest.hexdigest()


def check_names(folder: Path, names: Iterable[str]) -> None:
    """Raises InputError when a folder stands where a file shall be written."""
    blocked = next((name for name in sorted(names) if (folder / name).is_dir()), None)
    if blocked:
        raise folder_refusal(folder, f"{folder / blocked} is a folder")


def write_file(path: Path, content: bytes) -> None:
    """One file, whole or not at all; a link of that name is replaced, and what it leads to stays."""
    interrupts.raise_on_signal()
    prefix = f".{path.name}{MARK}"
    part = path.with_name(interrupts.temporary_name(prefix))
    if os.path.exists(path) and not os.path.isfile(path):  # a device would become a file
        raise InputError(f"{path}: cannot be written: it is no regular file; give another file")
    try:
        remove_leftovers(path.parent, prefix)
        with part.open("xb") as file:  # a new file: no link is followed
            file.write(content)
        part.replace(path)
    except OSError as failure:
        raise InputError(f"{path}: cannot be written: {failure.strerror}; give another file") from failure
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def files_of_earlier_run(manifest: Path) -> set[str]:
    """Files that the manifest of an earlier run's pages names and that are still what it wrote; it is one of them."""
    try:
        record = json.loads(read_regular(manifest))
        checksums = {str(e["file"]): str(e["sha256"]) for e in [record["main"], *record["pages"]]}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return set()
    names = {manifest.name}
    for name, checksum in checksums.items():
        file = manifest.with_name(Path(name).name)
        if not file.is_symlink() and marker.hash_of(file) == checksum:
            names.add(file.name)
    return names


def _rename_to_new(stage: Path, target: Path) -> None:
    """Rename a folder to a name that is free."""
    try:
        stage.rename(target)
    except OSError as failure:
        if failure.errno in (errno.ENOTEMPTY, errno.EEXIST):
            raise OSError(failure.errno, "another run has written there meanwhile") from failure
        raise


def replace_files(
    stage: Path, target: Path, programs: list[str], reports: list[str], own_names: set[str], *, paged: bool
) -> None:
    """Rename the files in: old reports go, programs take the place of the old ones, new reports follow.

    What tells the next run whose the others are (the first report, a manifest, a program) goes after them. Of pages
    the main program goes first and comes last.
    """
    others = sorted(own_names - {*programs, *reports}, key=lambda name: (name.endswith(".LS"), name))
    gone = [*others, *reversed(reports)]
    pages = [name for name in [*programs[:-1], *gone] if name.endswith(".LS")] if paged and programs else []
    for name in [*programs[-1:], *pages] if pages else []:
        (target / name).unlink(missing_ok=True)
    for name in gone:
        (target / name).unlink(missing_ok=True)
    for name in [*programs, *reports]:
        (stage / name).replace(target / name)


def can_move(target: Path) -> bool:
    """Whether a folder holds plain files alone, and nobody stands in it or mounts on it."""
    current = Path.cwd()
    plain = all(entry.is_file() and not entry.is_symlink() for entry in target.iterdir())
    occupied = target == current or target in current.parents
    return plain and not occupied and not target.is_mount() and os.access(target.parent, os.W_OK | os.X_OK)


def remove_leftovers(parent: Path, prefix: str) -> None:
    """Remove hidden files and folders of runs on this machine that were killed."""
    if not parent.is_dir():
        return
    for stage in parent.iterdir():
        if interrupts.is_abandoned(stage.name, prefix):
            remove_stage(stage)


def remove_stage(stage: Path) -> None:
    """Delete a hidden file, or folder with the files in it; a folder inside is not ours and keeps it."""
    try:
        if stage.is_symlink() or not stage.is_dir():
            stage.unlink(missing_ok=True)
            return
        for entry in stage.iterdir():
            if entry.is_symlink() or not entry.is_dir():
                entry.unlink()
        stage.rmdir()
    except OSError:
        pass


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def exchange(a: Path, b: Path) -> bool:
    """Swap two folders in one step of the file system, where the system can."""
    if not sys.platform.startswith("linux"):
        return False
    renameat2 = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    return renameat2 is not None and renameat2(_AT_FDCWD, os.fsencode(a), _AT_FDCWD, os.fsencode(b), _EXCHANGE) == 0


def folder_refusal(folder: Path, reason: str) -> InputError:
    """That a folder cannot take files, and the mend."""
    return InputError(f"output folder {folder}: cannot be written: {reason}; give another folder")


@contextmanager
def alone_in(folder: Path) -> Iterator[Path]:
    """Wait until no other run is in this context with the same folder; it is given with links followed.

    Nothing is waited for where the folder does not exist, or where the system or its file system has no locks.

    Raises:
        InputError: The system refuses what is done there.
    """
    handle = None
    try:
        target = folder.resolve()
        handle = _locked(target)
        yield target
    except OSError as failure:
        raise folder_refusal(folder, failure.strerror or str(failure)) from failure
    finally:
        if handle is not None:
            os.close(handle)


def _locked(folder: Path) -> int | None:
    """The folder, open and locked; None where it does not exist or cannot be opened."""
    while True:
        try:
            handle = os.open(folder, os.O_RDONLY)
        except OSError:
            return None
        try:
            if fcntl is not None:
                with suppress(OSError):
                    fcntl.flock(handle, fcntl.LOCK_EX)
            if _has_name(handle, folder):
                return handle
        except BaseException:  # a signal, while it waits
            os.close(handle)
            raise
        os.close(handle)


def _has_name(handle: int, folder: Path) -> bool:
    """Whether an open folder still has its name: another run may have put its own in its place."""
    try:
        return os.path.samestat(os.fstat(handle), folder.stat())
    except FileNotFoundError:
        return False
