"""The error of an output along its path, its stations, its runs: what a figure shows of two."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, step_lengths
from compgen.core.commands import Command
from compgen.core.csv_table import CsvTable
from compgen.core.units import MM, UM
from compgen.pipelines.comparison.outputs import Output, naming_damage

TABLES = {
    Command.GENERATE: "waypoints.csv",
    Command.PREDICT: "waypoints.csv",
    Command.CORRECT: "positions.csv",
    Command.HEAT: "runs.csv",
    Command.WHATIF: "whatif.csv",
}


@dataclass(frozen=True, eq=False, slots=True)
class ErrorAlong:
    """Errors at N places, NaN where there is none."""

    title: str  # of the abscissa, with its unit
    at: Array  # (N,)
    before: Array  # (N,) [m]
    after: Array | None  # (N,) [m]; None where nothing was corrected


def error_along(output: Output) -> ErrorAlong | None:
    """An output's errors over its way; None where its report was given alone.

    Raises:
        InputError: The table is missing or damaged.
    """
    if output.kind == Command.WHATIF and not output.record["scenarios"]:
        return None  # questions alone
    table = output.table(TABLES[output.kind])
    if table is None:
        return None
    with naming_damage(output):
        return _of_table(output.kind, table)


def _of_table(kind: Command, table: CsvTable) -> ErrorAlong:
    if kind in (Command.GENERATE, Command.PREDICT):
        length = np.concatenate([[0.0], np.cumsum(step_lengths(_columns(table, "{}_mm") * MM))])
        after = None if kind == Command.PREDICT else np.linalg.norm(_columns(table, "after_d{}_um") * UM, axis=1)
        return ErrorAlong(
            "length along the path [m]", length, np.linalg.norm(_columns(table, "before_d{}_um") * UM, axis=1), after
        )
    if kind == Command.CORRECT:
        before, after = (table.numbers(f"{side}_um", gaps=True) * UM for side in ("before", "after"))
        return ErrorAlong("station", table.numbers("station"), before, after)
    if kind == Command.HEAT:
        error, residual = (table.numbers(f"{name}_um", gaps=True) * UM for name in ("error", "residual"))
        return ErrorAlong("run", np.arange(1.0, len(error) + 1), error, residual)
    before = table.numbers("before_max_um", gaps=True) * UM
    corrected = table.numbers("after_max_um", gaps=True) * UM if table.has("after_max_um") else None
    return ErrorAlong("scenario", table.numbers("index"), before, corrected)


def _columns(table: CsvTable, name: str) -> Array:
    """Three columns along x, y, z."""
    return np.column_stack([table.numbers(name.format(axis), gaps=True) for axis in "xyz"])
