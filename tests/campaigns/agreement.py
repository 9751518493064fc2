"""What two ways of reading a program must agree on."""

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import naive_ls
import numpy as np

from compgen.fanuc.listing.listing import LsProgram, dumps, loads
from compgen.fanuc.listing.position_parser import AXES, NO_NUMBER
from compgen.fanuc.listing.templates import FEW_TEXTS


def moves_of(read):
    m = read.motions
    return list(zip(m.letter, m.target, m.speed, m.termination, strict=False))


def assert_readers_agree(data, few_texts=FEW_TEXTS):
    read = loads(data, few_texts)
    points, moves = naive_ls.read(data)
    assert dumps(read) == data
    assert moves_of(read) == [(m.letter, m.targets, m.speed, m.termination) for m in moves]
    assert read.motions.disabled.tolist() == [m.disabled for m in moves]
    for i, speed in enumerate(read.motions.speed):
        assert read.text(read.motions.speed_span[i]) == speed
    p = read.positions
    assert sorted(zip(p.number, p.group, strict=False)) == sorted(
        (n, g) for n, here in points.items() for g in here.groups
    )
    for i, (number, group) in enumerate(zip(p.number, p.group, strict=False)):
        here = points[number].groups[group]
        assert p.name[i] == points[number].name
        assert (p.uframe[i], p.utool[i]) == tuple(NO_NUMBER if f is None else f for f in (here.uf, here.ut))
        assert p.config[i] == here.config
        assert bool(p.remote[i]) == here.remote
        assert here.config is None or read.text(p.config_span[i]) == here.config
        written = {axis for axis, (start, end) in zip(AXES, p.span[i], strict=False) if end > start}
        assert written == set(here.axes)
        for axis, value, span in zip(AXES, p.value[i], p.span[i], strict=False):
            if here.axes.get(axis) is None:
                assert np.isnan(value)
                assert set(read.text(span)) <= {"*"}
            else:
                assert value == here.axes[axis] == float(read.text(span))
        block = read.text(p.block[i])
        assert block.upper().startswith("P[")
        assert block.rstrip(" \t;").endswith("}")
    return read


def differences(one, other):
    """Names of what two readings of the same bytes do not share, to the last bit."""
    found = [
        name for name in ("name", "subtype", "attributes", "remarks") if getattr(one, name) != getattr(other, name)
    ]
    tables: list[tuple[str, Any, Any, Sequence[str]]] = [("", one, other, ("statements", "place"))]
    for name in ("motions", "positions"):
        table = getattr(one, name)
        tables.append((f"{name}.", table, getattr(other, name), [f.name for f in fields(table)]))
    for table, here, there, columns in tables:
        for column in columns:
            a, b = getattr(here, column), getattr(there, column)
            if isinstance(a, np.ndarray):
                same = a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
            else:
                same = a == b
            if not same:
                found.append(f"{table}{column}")
    return found


def contradiction(data: bytes, read: LsProgram) -> str | None:
    """What the second reader reads otherwise in a damaged program; None when it refuses the program.

    A motion that has lost its speed is compared by its letter: where such a line's target ends nobody can say. A
    termination that is cut by a line's end may be read as none: then its pieces are unknown words.
    """
    try:
        points, moves = naive_ls.read(data)
    except (ValueError, IndexError):
        return None
    if len(moves) != len(read.motions.letter):
        return f"{len(read.motions.letter)} motions, and {len(moves)} by the second reader"
    for first, move, disabled in zip(moves_of(read), moves, read.motions.disabled.tolist(), strict=False):
        second = (move.letter, move.targets, move.speed, move.termination if first[3] else "")
        if first[0] != second[0] or disabled != move.disabled or (first[2] and move.speed and first != second):
            return f"a motion is {first}, and {second} by the second reader"
    p = read.positions
    if sorted(zip(p.number, p.group, strict=False)) != sorted(
        (n, g) for n, here in points.items() for g in here.groups
    ):
        return "other positions by the second reader"
    for i, (number, group) in enumerate(zip(p.number, p.group, strict=False)):
        here = points[number].groups[group]
        frames = tuple(NO_NUMBER if f is None else f for f in (here.uf, here.ut))
        if (p.name[i], p.config[i], (p.uframe[i], p.utool[i])) != (points[number].name, here.config, frames):
            return "another name, CONFIG or frame by the second reader"
        if bool(p.remote[i]) != here.remote:
            return "remote TCP by one reader only"
        values = {axis: here.axes.get(axis) for axis in AXES}
        if any(
            not (np.isnan(v) if values[a] is None else v == values[a]) for a, v in zip(AXES, p.value[i], strict=False)
        ):
            return "another number by the second reader"
    return ""
