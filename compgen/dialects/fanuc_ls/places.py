"""Positions of a program, as places in its bytes; names may hold ``:`` and ``]``."""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from compgen.arrays import Array, IntArray
from compgen.dialects.fanuc_ls.lines import line_ends, line_of
from compgen.dialects.fanuc_ls.moves import NO_NUMBER
from compgen.exceptions import InputError

#: Columns of ``Positions.value``.
AXES = ("X", "Y", "Z", "W", "P", "R", "J1", "J2", "J3", "J4", "J5", "J6", "J7", "J8", "J9", "E1", "E2", "E3")
_COLUMN = {axis: i for i, axis in enumerate(AXES)}
_BETWEEN = b" \t\r\n\f\v,;"  # may stand between two fields of a position
_BLOCK = re.compile(rb"\s*P\[[ \t]*(\d{1,9})[ \t]*(?::([^\r\n]*?))?\][ \t]*\{", re.IGNORECASE)
_INSIDE = re.compile(
    rb"[\s,;]*(?:(?P<group>GP(\d{1,9})[ \t]*:)"
    rb"|(?P<frame>UF[ \t]*:[ \t]*(\d{1,9}|F)[ \t]*,[ \t]*UT[ \t]*:[ \t]*(\d{1,9}|F))"
    rb"|CONFIG[ \t]*:[ \t]*'(?P<config>[^'\r\n]*)'"
    rb"|(?P<axis>[XYZWPR]|[JE]\d)[ \t]*=[ \t]*"
    rb"(?P<number>[-+]?(?:\d{1,15}(?!\d)(?:\.\d*)?|\.\d+)|\*+)[ \t]*(?P<unit>mm|deg)?"
    rb"|(?P<end>\}[ \t]*;?))",
    re.IGNORECASE,
)


_NUMBER = rb"[ \t]*([-+]?(?:\d{1,15}\.\d*|\.\d+))[ \t]*"
#: What nearly all positions of a long program look like; the careful way below reads them the same.
_USUAL = re.compile(
    rb"\s*P\[(\d{1,9})\]\{\s*GP1:\s*UF : (\d{1,9}), UT : (\d{1,9}),\s*CONFIG : '([^'\r\n]*)',\s*"
    + rb",\s*".join(rb"%c =" % axis + _NUMBER + unit for axis, unit in zip(b"XYZWPR", [b"mm"] * 3 + [b"deg"] * 3))
    + rb"\s*\}[ \t]*;?"
)


@dataclass(frozen=True, eq=False, slots=True)
class Positions:
    """G rows, one for each motion group of each position."""

    number: IntArray  # (G,) n of P[n]
    group: IntArray  # (G,)
    line: IntArray  # (G,) physical line of P[n], from 1
    name: tuple[str, ...]
    uframe: IntArray  # (G,) NO_NUMBER for F or none
    utool: IntArray  # (G,)
    config: tuple[str | None, ...]
    config_span: IntArray  # (G, 2)
    value: Array  # (G, 18) mm or deg, NaN where there is none or ****
    span: IntArray  # (G, 18, 2) of each number, zero where there is none
    block: IntArray  # (G, 2) of the whole P[n]{...};


def read_positions(data: bytes, start: int, end: int) -> Positions:
    """The positions in /POS.

    Raises:
        InputError: Something that is no position, or is given twice; names the line.
    """
    rows: list[tuple[int, int, int, str, int, int, str | None, tuple[int, int], tuple[int, int]]] = []
    values: list[tuple[int, int, float, int, int]] = []
    at, number, counted = start, line_of(data, start), start
    taught: set[int] = set()
    usual_rows: list[int] = []
    usual_texts: list[tuple[bytes, ...]] = []
    usual_spans: list[tuple[tuple[int, int], ...]] = []
    while True:
        if (usual := _USUAL.match(data, at, end)) and int(usual[1]) not in taught:
            spans = usual.regs
            number += line_ends(data, counted, spans[1][0])
            counted, at = spans[1][0], usual.end()
            taught.add(int(usual[1]))
            usual_rows.append(len(rows))
            usual_texts.append(usual.groups()[4:])
            usual_spans.append(spans[5:])
            config = usual[4].decode("latin-1")
            rows.append(
                (int(usual[1]), 1, number, "", int(usual[2]), int(usual[3]), config, spans[4], (counted - 2, at))
            )
            continue
        block = _BLOCK.match(data, at, end)
        if block is None:
            break
        opened = block.start(1)
        number += line_ends(data, counted, opened)
        counted = opened
        name = (block.group(2) or b"").decode("latin-1").strip()
        if len(name) > 1 and name[0] == name[-1] == '"':
            name = name[1:-1]
        if int(block.group(1)) in taught:
            raise InputError(f"program: line {number}: P[{block.group(1).decode()}] is defined twice; remove one")
        taught.add(int(block.group(1)))
        groups: set[int] = set()
        axes: set[str] = set()
        group, frame, config, config_place = 0, (NO_NUMBER, NO_NUMBER), None, (0, 0)
        first = len(rows)
        begun = False
        at = block.end()
        while True:
            token = _INSIDE.match(data, at, end)
            if token is None:
                raise InputError(
                    f"program: line {number + line_ends(data, counted, _skip(data, at, end, _BETWEEN))}: "
                    f"not understood in P[{block.group(1).decode()}]; mend the position"
                )
            at = token.end()
            if token["group"] is not None or token["end"] is not None:
                if begun:
                    rows.append((int(block.group(1)), group, number, name, *frame, config, config_place, (0, 0)))
                if token["end"] is not None:
                    break
                if int(token[2]) in groups:
                    raise InputError(
                        f"program: line {number}: P[{block.group(1).decode()}] has GP{int(token[2])} twice"
                    )
                groups.add(int(token[2]))
                axes = set()
                group, frame, config, config_place, begun = int(token[2]), (NO_NUMBER, NO_NUMBER), None, (0, 0), True
            elif token["frame"] is not None:
                frame, begun = (_frame(token[4]), _frame(token[5])), True
            elif token["config"] is not None:
                config, config_place, begun = token["config"].decode("latin-1"), token.span("config"), True
            else:
                axis = token["axis"].decode().upper()
                if axis in axes:
                    raise InputError(f"program: line {number}: P[{block.group(1).decode()}] has {axis} twice")
                axes.add(axis)
                if axis not in _COLUMN:
                    raise InputError(f"program: line {number}: P[{block.group(1).decode()}] has an axis {axis}")
                text = token["number"]
                value = np.nan if text[:1] == b"*" else float(text)
                values.append((len(rows), _COLUMN[axis], value, *token.span("number")))
                begun = True
        if len(rows) == first:
            raise InputError(f"program: line {number}: P[{block.group(1).decode()}] is empty; teach or remove it")
        whole = (block.start(1) - 2, at)
        for i in range(first, len(rows)):
            rows[i] = (*rows[i][:-1], whole)
    rest = _skip(data, at, end)
    if rest < end:
        raise InputError(f"program: line {number + line_ends(data, counted, rest)}: not a position; mend it")
    table = np.full((len(rows), len(AXES)), np.nan)
    spans_of = np.zeros((len(rows), len(AXES), 2), dtype=np.int64)
    if values:
        r, c, v, s, e = (np.array(column) for column in zip(*values))
        table[r, c] = v
        spans_of[r, c, 0], spans_of[r, c, 1] = s, e
    if usual_rows:
        table[usual_rows, :6] = np.array(usual_texts).astype(float)
        spans_of[usual_rows, :6] = np.array(usual_spans)
    columns: list[Any] = list(zip(*rows)) if rows else [()] * 9
    n, g, line, names, uf, ut, config_text, config_span, blocks = columns
    return Positions(
        number=np.array(n, dtype=np.int64),
        group=np.array(g, dtype=np.int64),
        line=np.array(line, dtype=np.int64),
        name=tuple(names),
        uframe=np.array(uf, dtype=np.int64),
        utool=np.array(ut, dtype=np.int64),
        config=tuple(config_text),
        config_span=np.array(config_span, dtype=np.int64).reshape(-1, 2),
        value=table,
        span=spans_of,
        block=np.array(blocks, dtype=np.int64).reshape(-1, 2),
    )


def _frame(text: bytes) -> int:
    return int(text) if text.isdigit() else NO_NUMBER


def _skip(data: bytes, at: int, end: int, over: bytes | None = None) -> int:
    """First byte from a place on that is not blank."""
    rest = data[at:end]
    return end - len(rest.lstrip(over))
