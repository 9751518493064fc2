"""STL files, binary and ASCII: triangles in millimetres."""

from pathlib import Path

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.core.files import read_regular
from compgen.core.units import MM

MOST_BYTES = 1_500_000_000
HEADER, COUNT = 80, 84  # bytes before the number of triangles, and before the first
LARGEST = 1e5  # mm of a coordinate
RECORD = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("attribute", "<u2")])
VERTEX = b"vertex"


def read_stl(source: str | Path) -> Array:
    """The corners of T triangles, (T, 3, 3) [m], in the file's order and axes; its normals are not looked at.

    Raises:
        InputError: Not readable, cut off, longer than its count says, a facet that is no triangle, a coordinate that is
            no number or beyond 100 m, or no triangle.
    """
    name = str(source)
    try:
        content = read_regular(source, MOST_BYTES)
    except OSError as exception:
        raise InputError(f"{name}: cannot be read: {exception.strerror}; give an STL file") from None
    except ValueError:
        raise InputError(f"{name!r}: cannot be read: no file has such a name; give an STL file") from None
    corners = _ascii(name, content) if _is_ascii(content) else _binary(name, content)
    bad = np.flatnonzero(~(np.abs(corners).max(axis=(1, 2), initial=0.0) <= LARGEST))
    if len(bad):
        raise InputError(
            f"{name}: facet {int(bad[0]) + 1}: a coordinate is not a number, or beyond {LARGEST:g} mm; export it again"
        )
    return corners * MM


def _is_ascii(content: bytes) -> bool:
    """Whether it is text: binary files may begin with "solid" as well, but hold as many bytes as their count says."""
    if not content[:HEADER].lstrip().lower().startswith(b"solid"):
        return False
    count = int.from_bytes(content[HEADER:COUNT], "little")
    return len(content) != COUNT + count * RECORD.itemsize


def _binary(name: str, content: bytes) -> Array:
    if len(content) < COUNT:
        raise InputError(f"{name}: {len(content)} bytes are no STL file; export it again")
    count = int.from_bytes(content[HEADER:COUNT], "little")
    needed = COUNT + count * RECORD.itemsize
    if len(content) < needed:
        raise InputError(
            f"{name}: cut off: {count} facets need {needed} bytes, and it has {len(content)}; export it again"
        )
    if not count:
        raise InputError(f"{name}: no facets; export the surface of the part")
    more = (len(content) - needed) // RECORD.itemsize
    if more:  # a count that is too small leaves a hole where the rest of the part is
        raise InputError(f"{name}: its count says {count} facets, and it has room for {more} more; export it again")
    return np.frombuffer(content, RECORD, count, COUNT)["corner"].astype(float)


def _ascii(name: str, content: bytes) -> Array:
    lines = content.splitlines()
    vertices = [line for line in (row.strip() for row in lines) if line.lower().startswith(VERTEX)]
    if not vertices:
        raise InputError(f"{name}: no facets; export the surface of the part")
    try:
        numbers = np.array(b" ".join(line[len(VERTEX) :] for line in vertices).split(), dtype=float)
    except ValueError:
        numbers = np.zeros(0)
    if len(numbers) != 3 * len(vertices):
        raise InputError(f"{name}: line {_first_bad(lines)}: a vertex has three numbers; export it again")
    _check_triangles(name, lines)
    if len(vertices) % 3 or not any(row.strip().lower().startswith(b"endsolid") for row in lines[-3:]):
        raise InputError(f"{name}: cut off after line {len(lines)}: no endsolid; export it again")
    return numbers.reshape(-1, 3, 3)


def _check_triangles(name: str, lines: list[bytes]) -> None:
    """Raises InputError where a loop has other than three lines with a vertex."""
    count = 0
    for n, row in enumerate(lines, 1):
        word = row.lstrip()[:7].lower()
        if word[:6] == VERTEX:
            count += 1
        elif word == b"endloop":
            if count != 3:
                raise InputError(
                    f"{name}: line {n}: a facet with {count} vertices on lines of their own; export triangles, each "
                    "vertex on its line"
                )
            count = 0


def _first_bad(lines: list[bytes]) -> int:
    """The first line, from 1, with a vertex that is not three numbers."""
    for n, row in enumerate(lines, 1):
        words = row.split()
        if words and words[0].lower() == VERTEX:
            try:
                if len([float(word) for word in words[1:]]) != 3:
                    return n
            except ValueError:
                return n
    return len(lines)
