"""A robot file with what was identified in it: the tables that changed, everything else as it stands."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.units import DEG
from compgen.error_model.sources.thermal_bend import ThermalBend
from compgen.error_model.uncertainty import Known, table_of
from compgen.robot.robot import Robot

_HEADER = re.compile(r"^\s*\[+\s*([A-Za-z0-9_.]+)\s*\]+", re.MULTILINE)


def robot_text(
    text: str, robot: Robot, known: Sequence[Known], box: Array, told: str, record: Mapping[str, Any]
) -> str:
    """The robot file's text with new sources.

    Args:
        text: The file that was identified.
        robot: Its nominal facts.
        known: Sources; those with a sigma were identified and replace the file's tables of their names.
        box: Range of theta that the poses cover, (6, 2) [rad].
        told: Where the values are from.
        record: The table ``identified``.
    """
    fresh = [k for k in known if k.sigma and not isinstance(k.source, ThermalBend)]
    names = {f"sources.{k.source.NAME}" for k in fresh} | {"sources.box", "identified"}
    kept = _without(text, names).rstrip()
    tables = [_table("identified", record), _box(robot, box)]
    tables += [_table(f"sources.{k.source.NAME}", {**table_of(k), "provenance": told}) for k in fresh]
    return kept + "\n\n" + "\n\n".join(tables) + "\n"


def _box(robot: Robot, box: Array) -> str:
    corners = np.array([robot.to_pendant(box[:, 0]), robot.to_pendant(box[:, 1])]) / DEG
    low, high = corners.min(axis=0), corners.max(axis=0)
    return _table("sources.box", {"low_deg": np.floor(low * 1000) / 1000, "high_deg": np.ceil(high * 1000) / 1000})


def _without(text: str, names: set[str]) -> str:
    """The text less some tables and the tables below them."""
    cuts = list(_HEADER.finditer(text))
    kept = [text[: cuts[0].start()] if cuts else text]
    for here, after in zip(cuts, [*cuts[1:], None]):
        name = here.group(1)
        if not any(name == n or name.startswith(f"{n}.") for n in names):
            kept.append(text[here.start() : after.start() if after else len(text)])
    return "".join(kept)


def _table(name: str, rows: Mapping[str, Any]) -> str:
    lines = [f"[{name}]"]
    for key, value in rows.items():
        if not isinstance(value, Mapping):
            lines.append(f"{key} = {_value(value)}")
    for key, value in rows.items():
        if isinstance(value, Mapping):
            lines.append(f"[{name}.{key}]")
            lines += [f"{_key(k)} = {_value(v)}" for k, v in value.items()]
    return "\n".join(lines)


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _value(key)


def _value(value: Any) -> str:
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return f'"{escaped}"'
    if isinstance(value, (list, tuple, np.ndarray)):
        inner = [_value(v) for v in value]
        line = "[" + ", ".join(inner) + "]"
        nested = len(value) and isinstance(value[0], (list, tuple, np.ndarray))
        return "[\n" + "".join(f"    {row},\n" for row in inner) + "]" if nested else line
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    return f"{float(value):.9g}"
