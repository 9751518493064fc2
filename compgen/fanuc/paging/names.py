"""Names of pages: the program's name and a number, unique within the length that the controller takes."""

from collections.abc import Collection

from compgen.core.exceptions import InputError


def page_names(name: str, count: int, length: int, taken: Collection[str] = ()) -> tuple[str, ...]:
    """NAME_01, NAME_02, ...: as much of the name as keeps them apart from each other and from all taken ones.

    Args:
        name: The program's.
        count: Number of pages.
        length: Characters of a name that the controller takes.
        taken: Names of other programs, in any case.

    Raises:
        InputError: No name is left.
    """
    digits = max(2, len(str(count)))
    used = {n.upper() for n in taken} | {name.upper(), name[:length].upper()}
    for keep in range(min(len(name), length - digits - 1), 0, -1):
        stem = name[:keep].rstrip("_") or name[:keep]
        names = tuple(f"{stem}_{n:0{digits}d}" for n in range(1, count + 1))
        if not used & {n.upper() for n in names}:
            return names
    raise InputError(f"program {name}: {count} pages get no name of their own within {length} characters; rename it")
