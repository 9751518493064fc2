"""Parallel sweeps along x, there and back, clipped to the part; they turn outside it."""

from itertools import pairwise
from math import ceil

from compgen import pieces
from compgen.boundaries import Boundary
from compgen.exceptions import InputError
from compgen.pieces import Pieces

#: Initial speed of a smooth turn over its stepover: a turn about half as deep as it is wide.
TURN_REACH = 1.6


def raster(boundary: Boundary, stepover: float, lead: float, smooth: bool) -> Pieces:
    """Sweeps from -y to +y, each longer than the part by ``lead`` at both ends [m].

    Where the part widens or narrows, both sweeps of a turn run past all of the part that lies between them, so the
    step lies outside the edge. Square turns stop at both corners; smooth ones do not.

    Raises:
        InputError: No sweep meets the part.
    """
    half = boundary.half_height()
    count = max(1, ceil(2 * half / stepover - 1e-9))
    levels = [stepover * (i - (count - 1) / 2) for i in range(count)]
    spans = [(y, *span) for y in levels if (span := boundary.clip(y)) is not None]
    if not spans:
        raise InputError("path.stepover_mm: no sweep meets the part; make it smaller")
    signs = [1 if i % 2 == 0 else -1 for i in range(len(spans))]
    # sweep i runs from begin[i] to finish[i]; a turn's two ends share an x outside all of the part between them
    ends = [(low - lead, high + lead)[::s] for (_, low, high), s in zip(spans, signs)]
    begin, finish = [e[0] for e in ends], [e[1] for e in ends]
    for i, s in enumerate(signs[:-1]):
        low, high = boundary.widest(spans[i][0], spans[i + 1][0])
        finish[i] = begin[i + 1] = high + lead if s > 0 else low - lead

    parts: list[Pieces] = []
    for i, ((y, low, high), s) in enumerate(zip(spans, signs)):
        if i and smooth:
            parts.append(pieces.turn((begin[i], spans[i - 1][0]), (begin[i], y), (-s, 0.0), TURN_REACH * stepover))
        elif i:
            parts.append(pieces.line((begin[i], spans[i - 1][0]), (begin[i], y), stop=True))
        stations = [begin[i], *((low, high) if s > 0 else (high, low)), finish[i]]
        cuts = [(a, b) for a, b in pairwise(stations) if a != b]
        last = i == len(spans) - 1
        for a, b in cuts:
            parts.append(pieces.line((a, y), (b, y), stop=b == finish[i] and (last or not smooth)))
    return pieces.join(*parts)
