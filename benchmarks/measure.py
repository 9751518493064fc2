"""Medians of processor time, and the machine they were taken on."""

import os
import platform
import statistics
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

ROUNDS = 5


def seconds(work: Callable[[], Any], rounds: int = ROUNDS) -> float:
    """Median processor time of a call, after a warm one [s]."""
    work()
    found = []
    for _ in range(rounds):
        begin = time.process_time()
        work()
        found.append(time.process_time() - begin)
    return statistics.median(found)


def load() -> float:
    """How many cores others use, over the last minute."""
    return os.getloadavg()[0]


def machine() -> list[str]:
    """Facts a reader needs to judge the ratios."""
    import numpy
    import scipy

    model = next(
        (
            line.split(":", 1)[1].strip()
            for line in Path("/proc/cpuinfo").read_text().splitlines()
            if "model name" in line
        ),
        platform.machine(),
    )
    flags = Path("/proc/cpuinfo").read_text()
    vector = next((v for v in ("avx512f", "avx2", "sse2") if v in flags), "none")
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    return [
        f"{model}, {os.cpu_count()} cores, {vector}, {memory:.0f} GB",
        f"Python {platform.python_version()}, casadi {version('casadi')}, numpy {numpy.__version__}, "
        f"scipy {scipy.__version__}",
    ]
