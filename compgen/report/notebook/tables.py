"""Columns as a pandas DataFrame, and figures as plotly's."""

from collections.abc import Mapping
from typing import Any

import plotly

from compgen.core.exceptions import InputError
from compgen.core.toml import brief_value
from compgen.report.figure import Figure


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
