"""The one bridge from CasADi to numpy: an SX function on many points at once, rows in, rows out.

Where there is a compiler and enough rows, the function runs as C (``codegen``, ``compiler``), several rows in the
lanes of a vector register and shares of the rows on each core (``threads``). Else numpy runs its list of instructions
over blocks of rows (``interpreter``). Either way there is no Python call and no ``DM`` a row, and a row's numbers do
not depend on how many rows or workers there are. What a function becomes, a list of instructions or a loaded library,
belongs to it and ends with it (``lifetime``).
"""

import ctypes
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.evaluation.codegen import c_source, identity
from compgen.core.evaluation.compiler import Compiler, find_compiler, load_function
from compgen.core.evaluation.interpreter import BLOCK, IndexedRows, Rows, instructions_of, run_instructions
from compgen.core.evaluation.lifetime import kept_with
from compgen.core.evaluation.threads import (
    Background,
    done,
    failed,
    map_blocks,
    map_rows,
    parallel_for,
    run_in_background,
    set_workers,
    stop_background,
    worker_count,
)

__all__ = [
    "BLOCK",
    "Background",
    "Compiler",
    "IndexedRows",
    "Rows",
    "configure",
    "configured",
    "done",
    "evaluate",
    "failed",
    "find_compiler",
    "kept_with",
    "map_blocks",
    "map_rows",
    "parallel_for",
    "run_in_background",
    "stop_background",
]

#: below so many rows compiling is not worth the wait; which way a row goes depends on the inputs only
MIN_COMPILED_ROWS = 2048

_compiler: Compiler | None = None
_configuring = threading.RLock()


def _ignore(note: str) -> None:
    """Do nothing with a note."""


_notify: Callable[[str], None] = _ignore


def configure(compiler: Compiler | None, workers: int = 1, notify: Callable[[str], None] = _ignore) -> None:
    """Set what evaluates from here on; called once, by the command line.

    Args:
        compiler: None for numpy.
        workers: Threads that share the rows.
        notify: Called with a note when many rows must do without a compiler.
    """
    global _compiler, _notify
    _compiler, _notify = compiler, notify
    set_workers(workers)


@contextmanager
def configured(compiler: Compiler | None, workers: int, notify: Callable[[str], None] = _ignore) -> Iterator[None]:
    """``configure`` for a while, by one thread at a time; what runs in the background when it is left ends there."""
    with _configuring:
        before = _compiler, worker_count(), _notify
        configure(compiler, workers, notify)
        try:
            yield
        finally:
            stop_background()
            configure(*before)


def evaluate(function: Any, *rows: Rows, exact: bool = False) -> tuple[Array, ...]:
    """A CasADi SX function on many points at once.

    Args:
        function: Each input a column vector (k, 1), each output dense.
        rows: One array per input, (N, k), or the ``IndexedRows`` of a table; a single row (1, k) serves all points.
        exact: The same bits for a row however many there are: numpy always.

    Returns:
        One array per output, (N, entries in column-major order).

    Raises:
        IndexError: An index lies outside its table.
    """
    counts = [len(r) for r in rows]
    N = max(counts) if min(counts) else 0
    outputs = [np.zeros((N, function.numel_out(k))) for k in range(function.n_out())]
    compiled = _compiled(function) if N >= MIN_COMPILED_ROWS and not exact else None
    if compiled is None:
        instructions = instructions_of(function)
        parallel_for(N, lambda start, stop: run_instructions(instructions, rows, outputs, start, stop))
        return tuple(outputs)
    _buffers, pointers = _arguments(rows, outputs)  # a compiled function gets pointers only, into what is kept here
    parallel_for(N, lambda start, stop: compiled(start, stop, *pointers))
    return tuple(outputs)


def _compiled(function: Any) -> Any:
    """The compiled function; None where there is no compiler or it fails."""
    if _compiler is None:
        _notify("no C compiler: numpy evaluates instead, some times slower, the same to nine digits")
        return None
    return _compile(function, _compiler)


@kept_with("function")
def _compile(function: Any, compiler: Compiler) -> Any:
    compiled = load_function(compiler, identity(function), lambda: c_source(instructions_of(function)))
    if compiled is None:
        _notify("the C compiler failed: numpy evaluates instead, some times slower, the same to nine digits")
    return compiled


def _arguments(rows: tuple[Rows, ...], outputs: list[Array]) -> tuple[list[Any], tuple[Any, ...]]:
    """What must stay alive while the compiled function runs, and its arguments, pointers into it."""
    tables, indices, strides = [], [], []
    for r in rows:
        table = _contiguous_rows(r.table if isinstance(r, IndexedRows) else r)
        index = np.ascontiguousarray(r.index, dtype=np.int64) if isinstance(r, IndexedRows) else None
        if index is not None and len(index) and not (0 <= index.min() and index.max() < len(table)):
            raise IndexError("an index lies outside its table")
        tables.append(table)
        indices.append(index)
        strides.append(0 if index is None and len(table) == 1 else table.strides[0] // table.itemsize)
    table_pointers = (ctypes.c_void_p * len(rows))(*(t.ctypes.data for t in tables))
    index_pointers = (ctypes.c_void_p * len(rows))(*(None if i is None else i.ctypes.data for i in indices))
    stride_array = (ctypes.c_longlong * len(rows))(*strides)
    output_pointers = (ctypes.c_void_p * len(outputs))(*(o.ctypes.data for o in outputs))
    return [tables, indices], (table_pointers, index_pointers, stride_array, output_pointers)


def _contiguous_rows(table: Array) -> Array:
    """A table of doubles whose rows may lie apart, but the entries of each side by side; a copy where it must be."""
    is_aligned = table.dtype == np.float64 and table.flags.aligned and table.strides[0] % table.itemsize == 0
    is_contiguous = table.shape[1] == 1 or table.strides[1] == table.itemsize
    return table if is_aligned and is_contiguous else np.ascontiguousarray(table, dtype=np.float64)
