"""The file that was meant where the one that was named is not there."""

import os
from difflib import get_close_matches
from pathlib import Path

CLOSE = 0.7  # of the letters


def near_file(file: Path, *folders: str) -> str | None:
    """A file of a similar name and the same kind, in the same folder or in others; None where there is none.

    Args:
        file: That is not there; without an ending any file of its name is meant.
        folders: Where its kind is kept, from the current folder.
    """
    stems: dict[str, str] = {}
    for place in dict.fromkeys([file.parent, *map(Path, folders)]):
        try:
            names = sorted(os.listdir(place))
        except (OSError, ValueError):
            continue
        for name in names:
            stem, ending = os.path.splitext(name)
            if ending and file.suffix.lower() in ("", ending.lower()) and (place / name).is_file():
                stems.setdefault(stem.lower(), str(place / name))
    near = get_close_matches(file.stem.lower(), stems, 1, CLOSE)
    if near:
        return stems[near[0]]
    return _other_ending(file)


def _other_ending(file: Path) -> str | None:
    """A file of the same stem with an ending that is spelt nearly so."""
    try:
        names = sorted(name for name in os.listdir(file.parent) if os.path.splitext(name)[0] == file.stem)
    except (OSError, ValueError):
        return None
    near = get_close_matches(file.name, names, 1, CLOSE)
    return str(file.with_name(near[0])) if near else None
