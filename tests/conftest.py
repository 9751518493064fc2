import gc
import itertools
import os
import signal
import sys
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import pytest
from browser import chromium
from hypothesis import settings
from shipped import load_everything, path_file

import compgen.cli.blas_threads  # noqa: F401  one thread a matrix product, as under the command; before numpy
from compgen.job.job import Job
from compgen.pipelines.files.path_file import load_job

settings.register_profile("same every time", derandomize=True, deadline=None)  # a busy machine is no fault
settings.load_profile("same every time")

os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # each process that tests start would compile compgen anew
sys.dont_write_bytecode = False  # and each worker would compile all tests anew

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as a shell's background hands on, and tests send it
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_configure(config):
    """Load all in a worker: property tests draw from what is loaded, and which worker runs what is chance."""
    if hasattr(config, "workerinput"):
        load_everything()


def pytest_collection_finish():
    """Tests and libraries stay to the end: the garbage collector need not look through them."""
    gc.collect()
    gc.freeze()


def pytest_terminal_summary(terminalreporter):
    """Seconds of each room's tests, of all processes; nothing where only one room was asked."""
    seconds: dict[str, float] = defaultdict(float)
    for report in itertools.chain(*terminalreporter.stats.values()):
        if isinstance(report, pytest.TestReport):
            rooms = Path(report.nodeid.split("::")[0]).parts[1:-1]
            seconds[rooms[0] if rooms else "the whole"] += report.duration
    if len(seconds) > 1:
        terminalreporter.section("seconds by room")
        for room, spent in sorted(seconds.items(), key=lambda item: -item[1]):
            terminalreporter.line(f"{spent:8.1f} {room}")


@pytest.fixture(scope="session")
def job() -> Job:
    """The study's circle on the study's robot."""
    return load_job(path_file("circle_1300"))


@pytest.fixture(scope="session")
def robot(job):
    """The study's robot with lines that last as long as they are: hand formulas have no periods."""
    return replace(job.robot, controller=replace(job.robot.controller, rounds_up_to_period=False))


@pytest.fixture(scope="session")
def one_browser():
    """A browser that starts when the first test looks at a page, and serves all."""
    with chromium() as opened:
        yield opened


@pytest.fixture(scope="module")
def browser(one_browser):
    """The browser; a page with figures in space would go on drawing behind the tests that follow."""
    yield one_browser
    one_browser.driver.get("about:blank")
