"""The numbers of a report that a comparison looks at, by kind, under the keys that the report has them by."""

from collections.abc import Callable, Mapping
from typing import Any

from compgen.core.commands import Command
from compgen.core.message_text import one_line
from compgen.pipelines.comparison.outputs import Output, naming_damage, number

Numbers = dict[str, Any]
_WHOLE = ("after.total.max_um", "before.total.max_um")
_SIZES = ("max_um", "p99_um", "rms_um")


def error_of(output: Output) -> Numbers:
    """Sizes of the error, the verdict and the band."""
    with naming_damage(output):
        return _ERRORS[output.kind](output.record)


def time_of(output: Output) -> Numbers:
    """Duration and the share at feed."""
    record = output.record
    with naming_damage(output):
        if output.kind == Command.CORRECT:
            return {"duration_s": number(record["duration_s"])}
        if output.kind == Command.WHATIF:
            return _extremes(_done(record), ("duration_s",))
        if output.kind == Command.HEAT:
            return {key: number(record[key]) for key in ("start_s", "duration_s")}
        window = {"thermal.start_window_s": record["thermal"].get("start_window_s")} if record["after"] else {}
        return {f"timing.{key}": number(record["timing"][key]) for key in ("duration_s", "at_feed")} | window


def program_of(output: Output) -> Numbers:
    """What is loaded, or how many scenarios and runs there are."""
    record = output.record
    with naming_damage(output):
        if output.kind == Command.CORRECT:
            return {f"positions.{key}": record["positions"][key] for key in ("corrected", "new", "unchanged")}
        if output.kind == Command.WHATIF:
            return {"scenarios": len(record["scenarios"]), "failed": len(record["scenarios"]) - len(_done(record))}
        if output.kind == Command.HEAT:
            return {"runs.count": record["runs"]["count"]}
        path = {f"path.{key}": record["path"][key] for key in ("waypoints", "length_m")}
        program = record.get("program")
        if program is None:
            return path
        sizes = {f"program.{key}": program[key] for key in ("positions", "arcs", "bytes")}
        return path | sizes | {"program.pages": len(program["pages"])}


def findings_of(output: Output) -> list[tuple[str, str, str]]:
    """Level, code and message of each finding."""
    with naming_damage(output):
        return [
            (one_line(str(f["level"])), one_line(str(f["code"])), one_line(str(f["message"])))
            for f in output.record.get("findings", [])
        ]


def final_error(output: Output) -> float | None:
    """The largest error that is left [um]: what ``--max-um`` judges; None where nothing was computed.

    On the part: after correction, before where nothing is corrected. Of a study the worst scenario's, of a day what one
    corrected file leaves in its worst run.
    """
    errors = error_of(output)
    if output.kind == Command.HEAT:
        with naming_damage(output):
            return number(errors["runs.residual_max_um"])
    keys = {
        Command.WHATIF: ("largest.after_on_part_max_um", "largest.before_on_part_max_um"),
        Command.CORRECT: _WHOLE,
    }.get(output.kind, ("on_part.after.total.max_um", "on_part.before.total.max_um", *_WHOLE))
    with naming_damage(output):
        return next((number(errors[key]) for key in keys if errors.get(key) is not None), None)


def _of_job(record: Mapping[str, Any]) -> Numbers:
    numbers: Numbers = {"verdict": record["verdict"]}
    nothing = {"before": None, "after": None}  # of a report from before it had these
    for prefix, sides in (("on_part.", record.get("on_part", nothing)), ("", record)):
        for side in ("before", "after"):
            if sides[side] is not None:
                numbers |= {f"{prefix}{side}.total.{size}": number(sides[side]["total"][size]) for size in _SIZES}
    return numbers | {"band.p95_um": _half_width(record["band"])}


def _of_correction(record: Mapping[str, Any]) -> Numbers:
    numbers: Numbers = {"verdict": record["verdict"]}
    for side in ("before", "after"):
        for kind, unit in (("total", "um"), ("turn", "mdeg")):
            if kind in record[side]:
                sizes = record[side][kind]
                numbers |= {
                    f"{side}.{kind}.{name}_{unit}": number(sizes[f"{name}_{unit}"]) for name in ("max", "p99", "rms")
                }
    return numbers | {"band.p95_um": _half_width(record["band"])}


def _of_study(record: Mapping[str, Any]) -> Numbers:
    done = _done(record)
    numbers = _extremes(done, ("before_on_part_max_um", "after_on_part_max_um", "band_um"))
    inside = [row["inside"] for row in done if "inside" in row]
    return numbers | ({"outside": inside.count(False)} if inside else {})


def _of_day(record: Mapping[str, Any]) -> Numbers:
    runs = {f"runs.{key}": number(record["runs"][key]) for key in ("error_max_um", "residual_max_um")}
    bands = {f"band.{name}.p95_um": _half_width(band) for name, band in record["band"].items()}
    warmth = {
        f"rise_K.{when}.{node}": number(rise)
        for when in ("start", "end")
        for node, rise in record["rise_K"][when].items()
    }
    return runs | bands | warmth


def _half_width(band: Mapping[str, Any] | None) -> float | None:
    """Of a band [um]; None where none is known."""
    return None if band is None or band["p95_um"] is None else number(band["p95_um"])


def _done(record: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    return [row for row in record["scenarios"] if row["state"] == "done"]


def _extremes(rows: list[Mapping[str, Any]], columns: tuple[str, ...]) -> Numbers:
    """The least and the largest of each column that any row has."""
    numbers: Numbers = {}
    for column in columns:
        values = [number(row[column]) for row in rows if column in row]
        if values:
            numbers |= {f"least.{column}": min(values), f"largest.{column}": max(values)}
    return numbers


_ERRORS: Mapping[str, Callable[[Mapping[str, Any]], Numbers]] = {
    Command.GENERATE: _of_job,
    Command.PREDICT: _of_job,
    Command.CORRECT: _of_correction,
    Command.WHATIF: _of_study,
    Command.HEAT: _of_day,
}
