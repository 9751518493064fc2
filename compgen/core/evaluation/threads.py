"""Work shared out over threads: rows, blocks in order, and one thing beside another; the same results for any number.

A thread that works for others does its own shares alone: no threads of threads.
"""

import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

import numpy as np

from compgen.core.arrays import Array
from compgen.core.evaluation.interpreter import BLOCK

LONGEST = 32 * BLOCK  # rows at a time: between them a run can be stopped

T = TypeVar("T")
SHARE = 4  # blocks of rows that a thread at least does: less is done before it has started
MANY = 16 * BLOCK  # rows from which on something goes on beside something else

_count = 1
_here = threading.local()


def use_workers(count: int) -> None:
    """How many threads share work from here on; set once, by the command line."""
    global _count
    _count = max(1, count)


def _workers() -> int:
    return 1 if getattr(_here, "busy", False) else _count


def _busy() -> None:
    _here.busy = True


def share_out(count: int, work: Callable[[int, int], None]) -> None:
    """Call work(start, stop) over all of a count, in whole blocks, on each worker a part."""
    blocks = -(-count // BLOCK)
    hands = min(_workers(), max(1, blocks // SHARE))
    if hands <= 1:
        for at in range(0, count, LONGEST):
            work(at, min(count, at + LONGEST))
        return
    edges = [min(count, BLOCK * (blocks * k // (4 * hands))) for k in range(4 * hands)] + [count]
    with ThreadPoolExecutor(hands, initializer=_busy) as pool:
        list(pool.map(lambda pair: work(*pair) if pair[0] < pair[1] else None, zip(edges, edges[1:])))


def blocks_of(count: int, work: Callable[[int, int], T], rows: int = 2 * BLOCK) -> Iterator[T]:
    """The results of work(start, stop) over all of a count, in order, each worker a block at a time."""
    starts = range(0, count, rows)
    hands = _workers()
    if hands == 1 or len(starts) < 2:
        yield from (work(at, min(count, at + rows)) for at in starts)
        return
    with ThreadPoolExecutor(hands, initializer=_busy) as pool:
        ahead: deque[Future[T]] = deque()
        for at in starts:  # a few blocks ahead, so that they do not pile up
            ahead.append(pool.submit(work, at, min(count, at + rows)))
            if len(ahead) > 2 * hands:
                yield ahead.popleft().result()
        while ahead:
            yield ahead.popleft().result()


def by_rows(work: Callable[..., Array], *rows: Array) -> Array:
    """A numpy function of arrays row by row, over blocks that stay in cache, each worker a part of them."""
    N = len(rows[0])
    if N <= 2 * BLOCK:
        return work(*rows)
    first = work(*(r[:1] for r in rows))
    out = np.empty((N, *first.shape[1:]), dtype=first.dtype)

    def part(start: int, stop: int) -> None:
        for at in range(start, stop, BLOCK):
            end = min(stop, at + BLOCK)
            out[at:end] = work(*(r[at:end] for r in rows))

    share_out(N, part)
    return out


def beside(work: Callable[[], T], rows: int) -> Callable[[], T]:
    """Start work on so many rows beside what follows, on a thread of its own where there are two or more.

    Returns:
        Call it for the result, as often as wanted: it waits, and raises what the work raised.
    """
    done: Future[T] = Future()

    def run() -> None:
        _busy()
        try:
            done.set_result(work())
        except Exception as failure:  # raised again where the result is asked for
            done.set_exception(failure)

    if _workers() == 1 or rows < MANY:
        busy = getattr(_here, "busy", False)
        try:
            run()
        finally:
            _here.busy = busy
    else:  # a daemon: an interrupted command does not wait for it
        threading.Thread(target=run, daemon=True).start()
    return done.result
