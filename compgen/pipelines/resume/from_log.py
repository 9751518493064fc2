"""The robot as a thermocouple log leaves it: the state that explains the readings, and the air."""

from dataclasses import replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

from compgen.core.files import read_regular
from compgen.core.toml import check, override, read_toml
from compgen.core.units import MINUTE
from compgen.job.job import Job
from compgen.pipelines.files.schema import PathFile
from compgen.pipelines.planned.job_results import Planned
from compgen.pipelines.resume.beginning import Beginning, Known, begin_at
from compgen.thermal import tables
from compgen.thermal.log_doubt import refuse_doubtful
from compgen.thermal.log_end import LogEnd, end_of
from compgen.thermal.log_fit import TemperatureLog
from compgen.thermal.tables.schema import LogTable
from compgen.thermal.temperature_log import read_growing_log


def read_log(job: Job, file: str) -> tuple[TemperatureLog, bool]:
    """A log as rises of a job's nodes, and whether its last air is the air from now on.

    What rises count from is what the path file says in [log] and [ambient].

    Raises:
        InputError: A bad file, an unknown sensor, readings that no robot has.
    """
    path = path_tables(job)
    table = LogTable(file=file) if path.log is None else path.log.model_copy(update={"file": file})
    zero = path.ambient.reference_degC
    cell = job.cell
    log = _whole_rows(job, table, zero) or tables.log_of(table, cell.heat, cell.warmth, cell.sensors, zero, "log")
    return log, not path.ambient.model_fields_set - {"reference_degC", "clock_h"}


def _whole_rows(job: Job, table: LogTable, zero: float) -> TemperatureLog | None:
    """A log that somebody is still writing, without a last line that has no end; None for one with anything wrong."""
    log = read_growing_log(table.file, job.cell.heat.names, job.cell.sensors, table)
    if log.readings is None or log.left_out or log.gaps or log.set_back or len(log.readings.time) < 2:
        return None
    refuse_doubtful(log.readings, job.cell.heat, job.cell.warmth, zero)
    rises = log.readings.rises(zero if table.reference is None else table.reference, table.window_min * MINUTE)
    return replace(rises, notes=log.readings.notes)


def path_tables(job: Job) -> PathFile:
    """The tables of a job's path file, overrides put in."""
    data = read_toml(Path(job.source), "paths")
    for item in job.overrides:
        if not item.startswith("robot."):
            override(data, item, item)
    return check(PathFile, data, job.source)


def state_at_end(whole: Planned, log: TemperatureLog) -> LogEnd:
    """The robot when a log ends."""
    return end_of(log, whole.job.cell.heat, whole.job.cell.warmth, partial(whole.motion_from, 0))


def begin_with_log(whole: Planned, known: Known, file: str) -> Beginning:
    """The page starts when a log ends.

    Args:
        whole: The plan of the job.
        known: The robot by the plan.
        file: The log so far.

    Raises:
        InputError: A bad file, or too few readings.
    """
    log, keeps_air = read_log(whole.job, file)
    end = float(log.time[-1])
    cause: dict[str, Any] = {
        "log": Path(file).name,
        "log_sha256": sha256(read_regular(file)).hexdigest(),
        "log_end_s": end,
    }
    air = float(log.air[-1]) if keeps_air else None
    end_of_log = state_at_end(whole, log)
    known = replace(known, cell=replace(known.cell, warmth=end_of_log.warmth))
    why = "; ".join([f"thermocouple log {cause['log']} until {end:.0f} s", *log.notes])
    return begin_at(whole, known, end_of_log.state, air, why, cause)
