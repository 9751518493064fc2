"""Median processor time; beside the peers' scripts, which know nothing of compgen."""

import statistics
import time
from collections.abc import Callable

ROUNDS = 5


def median(work: Callable[[], object], rounds: int = ROUNDS) -> float:
    """Processor seconds of a call, after a warm one."""
    work()
    found = []
    for _ in range(rounds):
        begin = time.process_time()
        work()
        found.append(time.process_time() - begin)
    return statistics.median(found)
