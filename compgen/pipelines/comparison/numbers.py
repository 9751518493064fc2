"""The numbers of a report that a comparison looks at, by kind, under the keys that the report has them by.

The error of an output along its path, its stations, its runs: what a figure shows of two.

Reports hold all digits of a double. Sums in another order, another machine, another version of a library move the
last of them, which is nothing that anybody changed: two numbers are the same that differ by less than the last digit
that a table shows.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import floor, log10
from typing import Any

import numpy as np

from compgen.core.arrays import Array, lengths_along
from compgen.core.commands import Command
from compgen.core.csv_table import CsvTable
from compgen.core.findings import one_line
from compgen.core.units import MM, UM
from compgen.pipelines.comparison.outputs import Output, naming_damage, number

RISES = "rise_K."  # what the keys of rises begin with
#: by what a key ends with, the last digit that is shown: 0.01 um, mdeg, s or K, and 0.01 % of a share
SHOWN = {"_um": 0.01, "_mdeg": 0.01, "_s": 0.01, "at_feed": 1e-4}
DIGITS = 6  # that are shown of every other number that is no count
Values = dict[str, Any]
_WHOLE = ("after.total.max_um", "before.total.max_um")
_ON_PART = ("on_part.after.total.max_um", "on_part.before.total.max_um")
#: where the error stands that is left, by kind: on the part; after correction, before where nothing is corrected
_FINAL = {
    Command.WHATIF: ("largest.after_on_part_max_um", "largest.before_on_part_max_um"),
    Command.CORRECT: _WHOLE,
    Command.HEAT: ("runs.residual_max_um",),
}
TABLES = {
    Command.GENERATE: "waypoints.csv",
    Command.PREDICT: "waypoints.csv",
    Command.CORRECT: "positions.csv",
    Command.HEAT: "runs.csv",
    Command.WHATIF: "whatif.csv",
}


@dataclass(frozen=True, slots=True)
class ReportNumbers:
    """The numbers of a report."""

    error: Values  # its sizes, the verdict and the band
    time: Values  # duration and the share at feed
    program: Values  # what is loaded, or how many scenarios and runs there are


def tolerance_of(key: str, a: float, b: float) -> float:
    """What the values of a key may differ by, in its own unit; counts are exact."""
    if isinstance(a, int) and isinstance(b, int):
        return 0.0
    if key.startswith(RISES):
        return 0.01
    shown = next((limit for ending, limit in SHOWN.items() if key.endswith(ending)), None)
    if shown is not None:
        return shown
    return 10.0 ** (floor(log10(max(abs(a), abs(b)))) + 1 - DIGITS)


def report_numbers(output: Output) -> ReportNumbers:
    """The numbers of an output."""
    with naming_damage(output):
        return _BY_KIND[output.kind](output.record)


def final_error(output: Output) -> float | None:
    """The largest error that is left [um]: what ``--max-um`` judges; None where nothing was computed.

    Of a study the worst scenario's, of a day what one corrected file leaves in its worst run.
    """
    errors = report_numbers(output).error
    with naming_damage(output):
        keys = _FINAL.get(output.kind, (*_ON_PART, *_WHOLE))
        return next((number(errors[key]) for key in keys if errors.get(key) is not None), None)


def findings_of(output: Output) -> list[tuple[str, str, str]]:
    """Level, code and message of each finding."""
    with naming_damage(output):
        return [
            (one_line(str(f["level"])), one_line(str(f["code"])), one_line(str(f["message"])))
            for f in output.record.get("findings", [])
        ]


def _of_job(record: Mapping[str, Any]) -> ReportNumbers:
    error: Values = {"verdict": record["verdict"]}
    nothing = {"before": None, "after": None}  # of a report from before it had these
    for prefix, sides in (("on_part.", record.get("on_part", nothing)), ("", record)):
        for side in ("before", "after"):
            if sides[side] is not None:
                error |= {f"{prefix}{key}": value for key, value in _sizes(side, "total", "um", sides[side]).items()}
    timing = {f"timing.{key}": number(record["timing"][key]) for key in ("duration_s", "at_feed")}
    window = {"thermal.start_window_s": record["thermal"].get("start_window_s")} if record["after"] else {}
    program = {f"path.{key}": record["path"][key] for key in ("waypoints", "length_m")}
    if (written := record.get("program")) is not None:
        program |= {f"program.{key}": written[key] for key in ("positions", "arcs", "bytes")}
        program["program.pages"] = len(written["pages"])
    return ReportNumbers(error | {"band.p95_um": _half_width(record["band"])}, timing | window, program)


def _of_correction(record: Mapping[str, Any]) -> ReportNumbers:
    error: Values = {"verdict": record["verdict"]}
    for side in ("before", "after"):
        for kind, unit in (("total", "um"), ("turn", "mdeg")):
            if kind in record[side]:
                error |= _sizes(side, kind, unit, record[side])
    program = {f"positions.{key}": record["positions"][key] for key in ("corrected", "new", "unchanged")}
    band = {"band.p95_um": _half_width(record["band"])}
    return ReportNumbers(error | band, {"duration_s": number(record["duration_s"])}, program)


def _of_study(record: Mapping[str, Any]) -> ReportNumbers:
    rows = record["scenarios"]
    done = [row for row in rows if row["state"] == "done"]
    error = _extremes(done, ("before_on_part_max_um", "after_on_part_max_um", "band_um"))
    inside = [row["inside"] for row in done if "inside" in row]
    error |= {"outside": inside.count(False)} if inside else {}
    asked = record["answers"][1 if record["keys"] else 0 : -1]  # behind the scenarios', before what none says
    error |= {f"answer.{n}": one_line(str(answer)) for n, answer in enumerate(asked)}
    return ReportNumbers(
        error, _extremes(done, ("duration_s",)), {"scenarios": len(rows), "failed": len(rows) - len(done)}
    )


def _of_day(record: Mapping[str, Any]) -> ReportNumbers:
    error: Values = {f"runs.{key}": number(record["runs"][key]) for key in ("error_max_um", "residual_max_um")}
    error |= {f"band.{name}.p95_um": _half_width(band) for name, band in record["band"].items()}
    for when in ("start", "end"):
        error |= {f"rise_K.{when}.{node}": number(rise) for node, rise in record["rise_K"][when].items()}
    time = {key: number(record[key]) for key in ("start_s", "duration_s")}
    return ReportNumbers(error, time, {"runs.count": record["runs"]["count"]})


def _sizes(side: str, kind: str, unit: str, extents: Mapping[str, Any]) -> Values:
    """Sizes of the error of one side."""
    names = [f"{name}_{unit}" for name in ("max", "p99", "rms")]
    return {f"{side}.{kind}.{name}": number(extents[kind][name]) for name in names}


def _half_width(band: Mapping[str, Any] | None) -> float | None:
    """Of a band [um]; None where none is known."""
    return None if band is None or band["p95_um"] is None else number(band["p95_um"])


def _extremes(rows: list[Mapping[str, Any]], columns: tuple[str, ...]) -> Values:
    """The least and the largest of each column that any row has."""
    extremes: Values = {}
    for column in columns:
        values = [number(row[column]) for row in rows if column in row]
        if values:
            extremes |= {f"least.{column}": min(values), f"largest.{column}": max(values)}
    return extremes


_BY_KIND: Mapping[str, Callable[[Mapping[str, Any]], ReportNumbers]] = {
    Command.GENERATE: _of_job,
    Command.PREDICT: _of_job,
    Command.CORRECT: _of_correction,
    Command.WHATIF: _of_study,
    Command.HEAT: _of_day,
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
        length = lengths_along(_columns(table, "{}_mm") * MM)
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
