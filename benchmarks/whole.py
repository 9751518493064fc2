"""Whole runs in processes of their own: from TOML to written, and a short job from the shell."""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.cases import PATH, overrides_of
from benchmarks.measure import ROUNDS

SCRIPT = """
import resource, sys, time
from pathlib import Path
from compgen.core import evaluation
from compgen.core.json_text import json_text
from compgen.pipelines.planned.generate import generate
from compgen.pipelines.files.path_file import load_job
from compgen.report import job_html, job_summary, waypoints_blocks
evaluation.configure(evaluation.find_compiler(Path(sys.argv[1])), int(sys.argv[2]))
folder, path, rounds = Path(sys.argv[3]), sys.argv[4], int(sys.argv[5])
def run(*overrides):
    begin, spent = time.perf_counter(), time.process_time()
    job = load_job(path, None, list(overrides))
    planned, done = generate(job, lambda stage, share: None)
    reports = {"json": json_text(job_summary(planned, done)), "html": job_html(planned, done)}
    files = {**reports, **dict(done.delivery.files)}
    for name, content in files.items():
        (folder / name).write_bytes(content)
    with (folder / "csv").open("wb") as table:
        table.writelines(waypoints_blocks(planned, done))
    return len(planned.path.arc), time.perf_counter() - begin, time.process_time() - spent
size = sys.argv[6].split(",")
run(*size)
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3  # of one run, as a user has it
for _ in range(rounds):
    print(*run(*size), peak, flush=True)
"""


def runs(cache: Path, workers: int, points: int) -> tuple[float, ...]:
    """Waypoints, elapsed and processor seconds, peak MB of a whole run with about so many waypoints: medians, warm."""
    with tempfile.TemporaryDirectory() as folder:
        call = [sys.executable, "-c", SCRIPT, str(cache), str(workers), folder, PATH, str(ROUNDS)]
        done = subprocess.run([*call, ",".join(overrides_of(points))], stdout=subprocess.PIPE, text=True, check=True)
    rows = [[float(v) for v in line.split()] for line in done.stdout.splitlines()]
    return tuple(statistics.median(column) for column in zip(*rows, strict=False))


def spent(cache: Path, *call: str, answers: tuple[int, ...] = (0,)) -> tuple[float, float]:
    """Processor and elapsed seconds of a process of Python, as a user starts it.

    Without this process's word on threads, and with modules kept compiled.

    Raises:
        RuntimeError: It ends with another code than the answers.
    """
    own = ("_NUM_THREADS", "PYTHONDONTWRITEBYTECODE")
    environment = {name: value for name, value in os.environ.items() if not name.endswith(own)}
    environment["XDG_CACHE_HOME"] = str(cache)
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run([sys.executable, *call], capture_output=True, text=True, env=environment, check=False)
    after, end = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    if done.returncode not in answers:
        raise RuntimeError(done.stderr)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, end - begin


def cold_start(cache: Path, starts: int) -> tuple[float, float]:
    """A short job from the shell with a warm cache over importing what it stands on: processor time, elapsed time.

    Both as a user starts them (``spent``).
    """
    jobs, bases = [], []
    for n in range(starts + 1):  # in turn, so that both see the same machine; the first warms
        with tempfile.TemporaryDirectory() as folder:
            job = spent(cache, "-m", "compgen", "generate", "paths/spiral_1300.toml", "-q", "-o", f"{folder}/o")
        base = spent(cache, "-c", "import casadi, pinocchio, scipy")
        if n:
            jobs.append(job)
            bases.append(base)
    processor, elapsed = (
        statistics.median(a) / statistics.median(b)
        for a, b in zip(zip(*jobs, strict=False), zip(*bases, strict=False), strict=True)
    )
    return processor, elapsed
