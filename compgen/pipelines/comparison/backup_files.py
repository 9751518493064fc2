"""Which files of a backup are the programs that were written: one program, or pages with their main program."""

import json
from pathlib import Path

from compgen.core.exceptions import InputError
from compgen.core.files import read_regular
from compgen.fanuc.backup_comparison import ComparedProgram, compare_programs, not_there
from compgen.pipelines.correct.program_file import read_program
from compgen.pipelines.files.program_course import listing_of
from compgen.program.pages import MANIFEST_SUFFIX

BINARY = "is a binary .TP; save it as ASCII: SELECT or FILE > SAVE AS .LS, FILE > BACKUP > ASCII Programs, or PrintTP"


def verify_backup(written: str, backup: str) -> list[ComparedProgram]:
    """What a controller gives back, against what was written.

    Args:
        written: A program, with its pages where a manifest beside it names them, or a folder of programs.
        backup: The same from the controller: a file for one program, or a folder, in which others may lie too.

    Returns:
        A comparison for each program that was written.

    Raises:
        InputError: Nothing to compare, a binary program, a file that is no complete program; names it.
    """
    programs, other = _written_files(written), Path(backup)
    if _is_binary(other):
        raise InputError(f"{backup}: {BINARY}")
    if not other.is_dir():
        if len(programs) > 1:
            raise InputError(
                f"{backup}: {len(programs)} programs were written, and this is one file; give the folder of the backup"
            )
        return [_compare(programs[0], other)]
    files = sorted(other.iterdir())
    there = {path.name.upper(): path for path in files}
    backups = [there.get(f"{path.stem.upper()}.LS") for path in programs]
    for path in files:
        twin = there[path.name.upper()]
        if twin in backups and twin != path:
            raise InputError(f"{path}: {twin.name} is in it, too; leave the one that the controller saved last")
    for path, listing in zip(programs, backups, strict=False):
        if listing is None and (binary := there.get(f"{path.stem.upper()}.TP")) is not None:
            raise InputError(f"{binary}: {BINARY}")
    if not any(backups):
        raise InputError(f"{backup}: {programs[0].name} is not in it; give the folder with the .LS files of the backup")
    return [
        not_there(p.stem) if listing is None else _compare(p, listing)
        for p, listing in zip(programs, backups, strict=False)
    ]


def _compare(written: Path, backup: Path) -> ComparedProgram:
    if backup.exists() and written.samefile(backup):
        raise InputError(f"{backup}: it is the file that was written; give what the controller saved")
    return compare_programs(*(listing_of(read_program(str(path)), str(path)) for path in (written, backup)))


def _written_files(written: str) -> list[Path]:
    """The programs that a file or a folder stands for, the main program last."""
    path = Path(written)
    if _is_binary(path):
        raise InputError(f"{written}: {BINARY}")
    if not path.is_dir():
        return [*_pages(path), path]
    listings = [p for p in sorted(path.iterdir()) if p.suffix.upper() == ".LS" and p.is_file()]
    if not listings:
        raise InputError(f"{written}: there is no .LS in it; give the folder or the program that cgen wrote")
    return listings


def _pages(main: Path) -> list[Path]:
    """The pages that the manifest beside a main program names; none without one."""
    manifest = main.with_name(f"{main.stem}{MANIFEST_SUFFIX}")
    if not manifest.exists():
        return []
    try:
        names = [str(page["file"]) for page in json.loads(read_regular(manifest))["pages"]]
        return [main.with_name(Path(name).name) for name in names]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        raise InputError(f"{manifest}: it is no manifest of pages; give the folder that cgen wrote") from None


def _is_binary(path: Path) -> bool:
    return path.suffix.upper() == ".TP" and not path.is_dir()
