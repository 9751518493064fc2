"""Work on several threads: ranges of rows, blocks in order, and one task in the background; any number, same results.

A thread of a pool works through its own rows alone: pools do not nest.
"""

import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Generic, TypeVar

import numpy as np

from compgen.core.arrays import Array
from compgen.core.evaluation.interpreter import BLOCK

MAX_ROWS_PER_CALL = 32 * BLOCK  # a run can be interrupted between calls
MIN_BLOCKS_PER_WORKER = 4  # fewer are done before a thread has started
RANGES_PER_WORKER = 4  # no more than the blocks: none is empty
MIN_BACKGROUND_ROWS = 16 * BLOCK

T = TypeVar("T")

_worker_count = 1
_this_thread = threading.local()


def set_workers(count: int) -> None:
    """Set how many threads share work from here on; called once, by the command line."""
    global _worker_count
    _worker_count = max(1, count)


def worker_count() -> int:
    """How many threads share work."""
    return _worker_count


def _available_workers() -> int:
    return 1 if getattr(_this_thread, "in_pool", False) else _worker_count


def _enter_pool() -> None:
    _this_thread.in_pool = True


def _raise_if_cancelled() -> None:
    cancelled = getattr(_this_thread, "cancelled", None)
    if cancelled is not None and cancelled.is_set():
        raise Cancelled


def parallel_for(count: int, body: Callable[[int, int], None]) -> None:
    """Call ``body(start, stop)`` over all rows of a count, in whole blocks, a share of them on each worker."""
    blocks = -(-count // BLOCK)
    workers = min(_available_workers(), max(1, blocks // MIN_BLOCKS_PER_WORKER))
    if workers <= 1:
        for start in range(0, count, MAX_ROWS_PER_CALL):
            _raise_if_cancelled()
            body(start, min(count, start + MAX_ROWS_PER_CALL))
        return
    ranges = RANGES_PER_WORKER * workers
    edges = [BLOCK * (blocks * k // ranges) for k in range(ranges)] + [count]
    with ThreadPoolExecutor(workers, initializer=_enter_pool) as pool:
        list(pool.map(body, edges[:-1], edges[1:]))


def map_blocks(count: int, function: Callable[[int, int], T], rows: int = 2 * BLOCK) -> Iterator[T]:
    """Results of ``function(start, stop)`` over all rows of a count, in order, each worker a block at a time."""
    starts = range(0, count, rows)
    workers = _available_workers()
    if workers == 1 or len(starts) < 2:
        for start in starts:
            _raise_if_cancelled()
            yield function(start, min(count, start + rows))
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


class Background(Generic[T]):
    """A task on a thread of its own, or done already; it pickles as what it returns."""

    def __init__(self) -> None:
        """Nothing runs yet."""
        self._future: Future[T] = Future()
        self._thread: threading.Thread | None = None
        self._cancelled = threading.Event()

    def result(self) -> T:
        """What the task returns, as often as wanted: waits for its end, and raises what it raised."""
        if self._thread is not None:
            self._thread.join()
        return self._future.result()

    def run(self, task: Callable[[], T]) -> None:
        """Run the task on this thread."""
        before = vars(_this_thread).copy()
        _enter_pool()
        _this_thread.cancelled = self._cancelled
        try:
            self._future.set_result(task())
        except (Exception, Cancelled) as exception:  # noqa: BLE001  raised again where the result is asked for
            self.fail(exception)
        finally:
            vars(_this_thread).clear()
            vars(_this_thread).update(before)

    def fail(self, exception: BaseException) -> None:
        """End with an exception."""
        self._future.set_exception(exception)

    def start(self, task: Callable[[], T]) -> None:
        """Run the task on a thread of its own: a daemon, an interrupted command does not wait for it."""
        self._thread = threading.Thread(target=self.run, args=(task,), name="background", daemon=True)
        for thread in [thread for thread in _running if not thread.is_alive()]:
            del _running[thread]
        _running[self._thread] = self._cancelled
        self._thread.start()

    def __reduce__(self) -> tuple[Any, ...]:
        return done, (self.result(),)


class Cancelled(BaseException):
    """Nobody wants the result of a task any more. Not an Exception, which the task may handle."""


_running: dict[threading.Thread, threading.Event] = {}  # those that have ended among them


def done(result: T) -> Background[T]:
    """A task that is over, and what it returned."""
    task: Background[T] = Background()
    task.run(lambda: result)
    return task


def failed(exception: Exception) -> Background[Any]:
    """A task in place of one that nobody asks for; never raised before, its exception keeps no caller's arrays."""
    task: Background[Any] = Background()
    task.fail(exception)
    return task


def run_in_background(task: Callable[[], T], rows: int) -> Background[T]:
    """Start a task of so many rows on a thread of its own; at once and here where it is small or there is one worker.

    Returns:
        Ask it for the result.
    """
    background: Background[T] = Background()
    if _available_workers() == 1 or rows < MIN_BACKGROUND_ROWS:
        background.run(task)
    else:
        background.start(task)
    return background


def stop_background() -> None:
    """End all tasks in the background, at the next block of rows of each, and wait for that."""
    for cancelled in _running.values():
        cancelled.set()
    while _running:
        _running.popitem()[0].join()
