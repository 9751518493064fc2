"""Median processor time; beside the peers' scripts, which know nothing of compgen."""

import statistics
import time

ROUNDS = 5


def median(work, rounds=ROUNDS):
    """Processor seconds of a call, after a warm one."""
    work()
    found = []
    for _ in range(rounds):
        begin = time.process_time()
        work()
        found.append(time.process_time() - begin)
    return statistics.median(found)
