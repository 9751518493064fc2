"""Programs that another one calls, looked for in its folder."""

from collections.abc import Callable
from pathlib import Path

LARGEST = 10_000_000  # bytes


def programs_beside(path: Path) -> Callable[[str], bytes | None]:
    """The listing of a program by its name, whatever its case, in the folder of a program file; None when not there."""
    files: dict[str, list[Path]] = {}
    try:
        for file in sorted(path.resolve().parent.iterdir()):
            if file.suffix.upper() == ".LS" and file.is_file() and file.stat().st_size <= LARGEST:
                files.setdefault(file.stem.upper(), []).append(file)
    except OSError:
        files = {}

    def find(name: str) -> bytes | None:
        candidates = files.get(name.upper(), [])
        if len(candidates) != 1:
            return None
        try:
            return candidates[0].read_bytes()
        except OSError:
            return None

    return find
