"""From the tables of air and log in a path file to rises."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from compgen.core.exceptions import InputError
from compgen.core.units import HOUR, MINUTE
from compgen.thermal import Ambient, still_air
from compgen.thermal.log_doubt import refuse_doubtful
from compgen.thermal.log_fit import TemperatureLog
from compgen.thermal.model import ArmHeat
from compgen.thermal.tables import schema as sh
from compgen.thermal.temperature_log import check_sensors, read_temperature_log
from compgen.thermal.uncertainty import ThermalUncertainty


def ambient_of(table: sh.AmbientTable, where: str) -> Ambient:
    """The air over time, from the first [[before]] on.

    Raises:
        InputError: Keys that miss or do not belong to its kind, or a bad CSV file.
    """
    needs = {
        "constant": (),
        "ramp": ("from_degC", "to_degC", "over_h"),
        "wave": ("amplitude_K",),
        "csv": ("file",),
    }
    may = {"constant": ("value_degC",), "ramp": (), "wave": ("value_degC", "period_h", "peak_h"), "csv": ()}
    kind, zero = table.kind, table.reference_degC
    for key in needs[kind]:
        if getattr(table, key) is None:
            raise InputError(f"{where}: ambient.{key}: missing; kind = '{kind}' needs it")
    for key in ("value_degC", "from_degC", "to_degC", "over_h", "amplitude_K", "period_h", "peak_h", "file"):
        if getattr(table, key) is not None and key not in needs[kind] + may[kind]:
            raise InputError(f"{where}: ambient.{key}: kind = '{kind}' has none; remove it or change ambient.kind")
    level = (table.value_degC if table.value_degC is not None else zero) - zero
    if kind == "ramp":
        ends = np.array([table.from_degC, table.to_degC], dtype=float) - zero
        return Ambient(np.array([0.0, (table.over_h or 0.0) * HOUR]), ends)
    if kind == "wave":
        peak = (table.peak_h if table.peak_h is not None else 15.0) - table.clock_h
        return Ambient(
            np.zeros(1), np.array([level]), table.amplitude_K or 0.0, (table.period_h or 24.0) * HOUR, peak * HOUR
        )
    if kind == "csv":
        source = Path(where).parent / str(table.file)
        log = read_temperature_log(source, (), {}, air=True)
        if log.ambient is None:
            raise InputError(f"{source}: it has no column ambient_degC; add it")
        return Ambient(log.time, log.ambient - zero)
    return Ambient(np.zeros(1), np.array([level])) if level else still_air()


def log_of(
    table: sh.LogTable,
    heat: ArmHeat,
    warmth: ThermalUncertainty,
    sensors: Mapping[str, str],
    zero: float,
    where: str,
) -> TemperatureLog:
    """A thermocouple log as rises.

    Args:
        table: Its file, beside the path file, and what its rises count from.
        heat: The model, with the names of its rises.
        warmth: How well it is known.
        sensors: part_<n> to the name of a rise.
        zero: Reference temperature [degC] unless the table says otherwise.
        where: The path file.

    Raises:
        InputError: A bad file, an unknown sensor, readings that no robot has or that the rest contradicts.
    """
    log = read_temperature_log(Path(where).parent / table.file, heat.names, sensors)
    check_sensors(log, [f"{name}_degC" for name in (*sensors, *heat.names)])
    refuse_doubtful(log, heat, warmth, zero)
    return log.rises(zero if table.reference is None else table.reference, table.window_min * MINUTE)
