"""Work on several threads: ranges of rows, blocks in order, and one task in the background; any number, same results.

A thread of a pool works through its own rows alone: pools do not nest.
"""

import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

import numpy as np

from compgen.core.arrays import Array
from compgen.core.evaluation.interpreter import BLOCK

MAX_ROWS_PER_CALL = 32 * BLOCK  # a run can be interrupted between calls
MIN_BLOCKS_PER_WORKER = 4  # fewer are done before a thread has started
RANGES_PER_WORKER = 4
MIN_BACKGROUND_ROWS = 16 * BLOCK

T = TypeVar("T")

_worker_count = 1
_this_thread = threading.local()


def set_workers(count: int) -> None:
    """Set how many threads share work from here on; called once, by the command line."""
    global _worker_count
    _worker_count = max(1, count)


def _available_workers() -> int:
    return 1 if getattr(_this_thread, "in_pool", False) else _worker_count


def _enter_pool() -> None:
    _this_thread.in_pool = True


def parallel_for(count: int, body: Callable[[int, int], None]) -> None:
    """Call ``body(start, stop)`` over all rows of a count, in whole blocks, a share of them on each worker."""
    blocks = -(-count // BLOCK)
    workers = min(_available_workers(), max(1, blocks // MIN_BLOCKS_PER_WORKER))
    if workers <= 1:
        for start in range(0, count, MAX_ROWS_PER_CALL):
            body(start, min(count, start + MAX_ROWS_PER_CALL))
        return
    ranges = RANGES_PER_WORKER * workers
    edges = [min(count, BLOCK * (blocks * k // ranges)) for k in range(ranges)] + [count]
    with ThreadPoolExecutor(workers, initializer=_enter_pool) as pool:
        list(pool.map(lambda pair: body(*pair) if pair[0] < pair[1] else None, zip(edges, edges[1:])))


def map_blocks(count: int, function: Callable[[int, int], T], rows: int = 2 * BLOCK) -> Iterator[T]:
    """Results of ``function(start, stop)`` over all rows of a count, in order, each worker a block at a time."""
    starts = range(0, count, rows)
    workers = _available_workers()
    if workers == 1 or len(starts) < 2:
        yield from (function(start, min(count, start + rows)) for start in starts)
        return
    with ThreadPoolExecutor(workers, initializer=_enter_pool) as pool:
        pending: deque[Future[T]] = deque()
        for start in starts:  # a few blocks ahead, so that they do not pile up
            pending.append(pool.submit(function, start, min(count, start + rows)))
            if len(pending) > 2 * workers:
                yield pending.popleft().result()
        while pending:
            yield pending.popleft().result()


def map_rows(function: Callable[..., Array], *rows: Array) -> Array:
    """A numpy function of arrays that works row by row, over blocks that stay in cache, a share on each worker.

    Args:
        function: Takes M rows of each array and returns M rows.
        rows: (N, ...) each.

    Returns:
        What the function returns for all rows, (N, ...).
    """
    N = len(rows[0])
    if N <= 2 * BLOCK:
        return function(*rows)
    first = function(*(r[:1] for r in rows))
    out = np.empty((N, *first.shape[1:]), dtype=first.dtype)

    def fill(start: int, stop: int) -> None:
        for begin in range(start, stop, BLOCK):
            end = min(stop, begin + BLOCK)
            out[begin:end] = function(*(r[begin:end] for r in rows))

    parallel_for(N, fill)
    return out


def run_in_background(task: Callable[[], T], rows: int) -> Callable[[], T]:
    """Start a task of so many rows on a thread of its own; at once and here where it is small or there is one worker.

    Returns:
        Call it for the result, as often as wanted: it waits, and raises what the task raised.
    """
    future: Future[T] = Future()

    def run() -> None:
        _enter_pool()
        try:
            future.set_result(task())
        except Exception as exception:  # raised again where the result is asked for
            future.set_exception(exception)

    if _available_workers() == 1 or rows < MIN_BACKGROUND_ROWS:
        in_pool = getattr(_this_thread, "in_pool", False)
        try:
            run()
        finally:
            _this_thread.in_pool = in_pool
    else:  # a daemon: an interrupted command does not wait for it
        threading.Thread(target=run, name="background", daemon=True).start()
    return future.result
