"""Limits in figures: dashed lines with the words of what they are."""

from dataclasses import dataclass
from typing import Any

from compgen.report.figure import HALO

LIMIT = "#b91c1c"


@dataclass(frozen=True, slots=True)
class Limit:
    """A size that an error is judged by."""

    label: str  # what says so, with the size and its unit
    um: float
    is_asked: bool = False  # on the command line, for whatever is computed; else a bound of what is corrected


def limit_label(text: str, y: float, axis_number: str = "") -> dict[str, Any]:
    """The words of a limit, at the right end of its line; ``axis_number`` is the number of the plot's axes, from 2."""
    place = {"xref": f"x{axis_number} domain", "x": 1, "yref": f"y{axis_number}", "y": y}
    font = {"color": LIMIT, "size": 11, "shadow": HALO}
    return {"text": text, **place, "showarrow": False, "xanchor": "right", "yanchor": "bottom", "font": font}
