"""What results in a notebook are made with and given as: compiler, threads and log; DataFrames and plotly figures."""

import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import plotly

import compgen
from compgen.core import evaluation
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Level
from compgen.core.toml import brief_value
from compgen.report.figure import Figure
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


def log_result(name: str, result: Any) -> None:
    """Log a result in a line, and the findings that it has."""
    logger.info("%r", result)
    for finding in result.findings:
        logger.log(LEVELS.get(finding.level, logging.INFO), "%s: %s: %s", name, finding.code, finding.message)


def data_frame(columns: Mapping[str, Any]) -> Any:
    """A pandas DataFrame of columns of equal length.

    Raises:
        InputError: pandas is not installed.
    """
    try:
        import pandas
    except ImportError:
        raise InputError("to_dataframe: pandas is not installed; pip install 'compgen[pandas]'") from None
    return pandas.DataFrame(dict(columns))


def plotly_figure(figures: Mapping[str, Figure], titles: Mapping[str, str], which: object) -> Any:
    """One of several figures by its key, as a ``plotly.graph_objects.Figure``.

    Raises:
        InputError: There is no such figure.
    """
    if not isinstance(which, str) or which not in figures:
        raise InputError(f"plot: {brief_value(which)}: unknown; known: {', '.join(figures) or 'none'}")
    content = figures[which]
    shown = plotly.graph_objects.Figure(data=content["data"], layout=content["layout"])
    return shown.update_layout(title={"text": titles[which]}, margin={"t": 80})
