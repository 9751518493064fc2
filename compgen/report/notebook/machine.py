"""The compiler and the threads of a run in a notebook: those that the command line would use."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

import compgen
from compgen.core import evaluation
from compgen.core.codes import Level
from compgen.core.findings import Finding
from compgen.report.notebook.arguments import MAX_WORKERS, whole_number

logger = logging.getLogger("compgen")
logger.addHandler(logging.NullHandler())

LEVELS = {Level.OUTSIDE: logging.WARNING, Level.REFUSED: logging.WARNING, Level.WARNING: logging.WARNING}


@contextmanager
def machine(workers: int | None) -> Iterator[None]:
    """Evaluate as ``cgen generate`` does; when it is left, also by an exception, no thread is at work any more."""
    count = None if workers is None else whole_number(workers, "workers", 1, MAX_WORKERS)
    with evaluation.configured(*compgen.find_machine(count), logger.info):
        yield


@contextmanager
def numpy_alone() -> Iterator[None]:
    """Evaluate as the commands do that compile nothing."""
    with evaluation.configured(None, 1):
        yield


def log_findings(name: str, findings: tuple[Finding, ...]) -> None:
    """Log what a user must know of a result."""
    for finding in findings:
        logger.log(LEVELS.get(finding.level, logging.INFO), "%s: %s: %s", name, finding.code, finding.message)
