"""A pose as a table of a TOML file: x_mm, y_mm, z_mm, w_deg, p_deg, r_deg."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from compgen.core.exceptions import InputError
from compgen.core.files import MOST_TABLE_BYTES, read_named
from compgen.core.pose import POSE_KEYS, Pose
from compgen.core.rotations import from_wpr
from compgen.core.toml import brief_value
from compgen.core.units import DEG, MM

LARGEST = 1e5  # [mm] or [deg]
_NAME = re.compile(r"'[^'\n]*'")  # it may say anything
_GROUP = re.compile(r"\bGroup:")
_COORDINATE = re.compile(r"\b([XYZWPR]):[ \t]*(\S*)")
_PRINTED = re.compile(r"[-+]?(?:\d+|\d*\.(\d+))")


def read_controller_table(path: str, kind: str, backup: str) -> str:
    """The text of a table that says what a controller holds, or of the controller's own backup of it.

    Raises:
        InputError: Not readable; names the file and the two kinds that are.
    """
    return read_named(path, f"give a {kind} table (.toml or {backup})", MOST_TABLE_BYTES).decode("latin-1")


def unnamed(text: str) -> str:
    """A controller's own backup without the names that were given to its entries."""
    return _NAME.sub("", text)


def printed_coordinates(entry: str, key: str, path: str) -> tuple[float, ...] | None:
    """X Y Z [mm], W P R [deg] of an entry of a controller's own backup, of its first group; None where it has none.

    Raises:
        InputError: They are not six numbers with a point and as many decimals each; names file and entry.
    """
    printed = _COORDINATE.findall(_GROUP.split(entry, maxsplit=2)[1] if _GROUP.search(entry) else entry)
    if not printed:
        return None
    numbers = [_PRINTED.fullmatch(text) for _, text in printed]
    if any(number and not abs(float(number[0])) < LARGEST for number in numbers):
        raise InputError(f"{path}: {key}: a coordinate is beyond 100000; export the backup anew")
    decimals = {len(number[1] or "") for number in numbers if number}
    if [axis for axis, _ in printed] != list("XYZWPR") or not all(numbers) or len(decimals) != 1 or 0 in decimals:
        numbers_shown = " ".join(f"{axis}: {text}" for axis, text in printed)
        raise InputError(
            f"{path}: {key}: '{numbers_shown:.80}' is not X Y Z W P R as a controller prints them; export it anew"
        )
    return tuple(float(text) for _, text in printed)


def pose_values(table: Any, key: str, path: str, also: Sequence[str] = ()) -> list[float]:
    """The six numbers of a table [mm] and [deg]; ``also`` are keys that it may have beside them.

    Raises:
        InputError: It is no table, a key is not known or missing, or a number is out of range; names file and key.
    """
    if not isinstance(table, dict):
        raise InputError(f"{path}: {key}: must be a table with {', '.join(POSE_KEYS)}")
    if unknown := sorted(set(table) - {*POSE_KEYS, *also}):
        raise InputError(f"{path}: {key}.{unknown[0]:.40}: unknown key; known: {', '.join((*also, *POSE_KEYS))}")
    values = [length_or_angle(table, name, key, path) for name in POSE_KEYS if name in table]
    if missing := [name for name in POSE_KEYS if name not in table]:
        added = ", ".join(f"{name} = 0" for name in missing)
        raise InputError(f"{path}: {key}: {', '.join(missing)}: missing; add {added}, or what the controller shows")
    return values


def length_or_angle(table: Mapping[str, Any], name: str, key: str, path: str) -> float:
    """A number of a table, below ``LARGEST``.

    Raises:
        InputError: It is not such a number; names file and key.
    """
    value = table[name]
    if not isinstance(value, (int, float)) or isinstance(value, bool) or not abs(value) < LARGEST:
        raise InputError(f"{path}: {key}.{name}: {brief_value(value)} is not a length or angle")
    return float(value)


def pose_of(values: Sequence[float]) -> Pose:
    """The pose with coordinates X Y Z [mm] and angles W P R [deg]."""
    w, p, r = (np.array([v * DEG]) for v in values[3:])
    return Pose(np.array(values[:3]) * MM, from_wpr(w, p, r)[0])
