"""The one bridge from CasADi to numpy: an SX function on many points at once, rows in, rows out.

Where there is a compiler and enough rows, the function runs as C, several rows in the lanes of a vector register and
shares of the rows on each core. Else numpy runs its list of instructions over blocks of rows. Either way there is no
Python call and no ``DM`` a row, and a row's numbers do not depend on how many rows or workers there are.
"""

import ctypes
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.evaluation.codegen import c_source, identity
from compgen.core.evaluation.compiler import Compiler, find_compiler, load
from compgen.core.evaluation.interpreter import BLOCK, Picked, Rows, instructions_of, run
from compgen.core.evaluation.threads import beside, blocks_of, by_rows, share_out, use_workers

__all__ = [
    "BLOCK",
    "Compiler",
    "Picked",
    "Rows",
    "beside",
    "blocks_of",
    "by_rows",
    "evaluate",
    "find_compiler",
    "share_out",
    "use",
]

FEW = 2048  # rows below which compiling is not worth the wait; which way a row goes depends on the inputs only

_compiler: Compiler | None = None
_compiled: dict[int, Any] = {}


def _silent(note: str) -> None:
    """Says nothing."""


_tell: Callable[[str], None] = _silent


def use(compiler: Compiler | None, workers: int = 1, tell: Callable[[str], None] = _silent) -> None:
    """What evaluates from here on: a compiler or numpy, and how many threads. Set once, by the command line.

    Args:
        compiler: None for numpy.
        workers: Threads that share the rows.
        tell: Called with a note when many rows must do without a compiler.
    """
    global _compiler, _tell
    _compiler, _tell = compiler, tell
    use_workers(workers)
    _compiled.clear()


def evaluate(function: Any, *rows: Rows, exact: bool = False) -> tuple[Array, ...]:
    """A CasADi SX function on many points at once.

    Args:
        function: Each input a column vector (k, 1), each output dense.
        rows: One array per input, (N, k), or the ``Picked`` rows of a table; a single row (1, k) serves all points.
        exact: The same bits for a row however many there are: numpy always.

    Returns:
        One array per output, (N, entries in column-major order).
    """
    sizes = [len(r) for r in rows]
    N = max(sizes) if min(sizes) else 0
    outs = [np.zeros((N, function.numel_out(k))) for k in range(function.n_out())]
    compiled = _compile(function) if N >= FEW and not exact else None
    if compiled is None:
        program = instructions_of(function)
        share_out(N, lambda start, stop: run(program, rows, outs, start, stop))
        return tuple(outs)
    kept, arguments = _arguments(rows, outs)
    share_out(N, partial(_called, compiled, arguments, (kept, outs)))
    return tuple(outs)


def _called(compiled: Any, arguments: tuple[Any, ...], alive: Any, start: int, stop: int) -> None:
    """Pointers are all that C gets: who calls it holds what they lead to, also when the run is stopped meanwhile."""
    compiled(start, stop, *arguments)


def _compile(function: Any) -> Any:
    if _compiler is None:
        _tell("no C compiler: numpy evaluates instead, with the same numbers and some times slower")
        return None
    key = function.__hash__()
    if key not in _compiled:
        found = load(_compiler, identity(function), lambda: c_source(instructions_of(function)))
        _compiled[key] = function, found  # the function is kept, so that its identity stays its own
        if found is None:
            _tell("the C compiler failed: numpy evaluates instead, with the same numbers and some times slower")
    return _compiled[key][1]


def _arguments(rows: tuple[Rows, ...], outs: list[Array]) -> tuple[list[Any], tuple[Any, ...]]:
    """Pointers for the compiled function, and what must stay alive while they are used."""
    tables, indices, strides = [], [], []
    for r in rows:
        table = _side_by_side(r.table if isinstance(r, Picked) else r)
        index = np.ascontiguousarray(r.index, dtype=np.int64) if isinstance(r, Picked) else None
        if index is not None and len(index) and not (0 <= index.min() and index.max() < len(table)):
            raise IndexError("a picked row lies outside its table")
        tables.append(table)
        indices.append(index)
        strides.append(0 if index is None and len(table) == 1 else table.strides[0] // table.itemsize)
    ins = (ctypes.c_void_p * len(rows))(*(t.ctypes.data for t in tables))
    picks = (ctypes.c_void_p * len(rows))(*(None if i is None else i.ctypes.data for i in indices))
    steps = (ctypes.c_longlong * len(rows))(*strides)
    targets = (ctypes.c_void_p * len(outs))(*(o.ctypes.data for o in outs))
    return [tables, indices], (ins, picks, steps, targets)


def _side_by_side(table: Array) -> Array:
    """The same rows, however far apart, with the entries of each side by side."""
    there = table.dtype == np.float64 and table.flags.aligned and table.strides[0] % table.itemsize == 0
    together = table.shape[1] == 1 or table.strides[1] == table.itemsize
    return table if there and together else np.ascontiguousarray(table, dtype=np.float64)
