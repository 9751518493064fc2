r"""User frames and tools, which a program only numbers: from a TOML table or from a controller's SYSFRAME.VA.

    [uframe.1]                          [*SYSTEM*]$MNUFRAME  Storage: ...  ARRAY[1,9] OF POSITION
    x_mm = 1200                             [1,1] =
    ...                                       Group: 1   Config: N D B, 0, 0, 0
    r_deg = 0                                 X:  1200.000   Y:     0.000   Z:     0.000
    [utool.1]                                 W:     0.000   P:     0.000   R:     0.000

Frame 0 is World, tool 0 the flange: both are known without a table. An uninitialised entry is not known. A TOML table
also says what extended axes carry (``extended_axes``), and names the file of a frame that a robot has taught:
``[uframe.1] file = "part.toml"``.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from compgen.core.exceptions import InputError
from compgen.core.findings import Finding
from compgen.core.other_units import values_in_other_units
from compgen.core.pose import IDENTITY, POSE_KEYS, Pose
from compgen.core.toml import check, parse_toml, read_toml
from compgen.planning.tables import FrameFile, FrameTable, TaughtTable
from compgen.program.extended_axes import ExtendedAxis, extended_axes
from compgen.program.pose_table import pose_of, pose_values, printed_coordinates, read_controller_table, unnamed

_BYTE_ORDER_MARK = b"\xef\xbb\xbf".decode("latin-1")
_RECORD = re.compile(r"^\[\*SYSTEM\*\]\$MNU(FRAME|TOOL)\b[^\n]*\n((?:(?!\[).*\n?)*)", re.MULTILINE)
_ENTRY = re.compile(r"\[1,\s*([0-9]{1,3})\]\s*=([^\[]*)")


@dataclass(frozen=True, slots=True)
class Frames:
    """What a controller's numbers mean."""

    uframe: dict[int, Pose]
    utool: dict[int, Pose]
    input_findings: tuple[Finding, ...] = ()  # values that look like another unit's
    extended: Mapping[str, ExtendedAxis] = field(default_factory=dict)  # by name, E1 to E3
    taught: Mapping[int, TaughtTable] = field(default_factory=dict)  # how user frames were taught, of those that say so


def default_frames() -> Frames:
    """World and flange."""
    return Frames({0: IDENTITY}, {0: IDENTITY})


def load_frames(path: str) -> Frames:
    """Frames from a TOML table, or from SYSFRAME.VA by its ending.

    Raises:
        InputError: Not readable, an unknown key, a number out of range; names file and key.
    """
    text = read_controller_table(path, "frames", "SYSFRAME.VA")
    base = default_frames()
    loaded = _from_backup(text, path) if path.lower().endswith(".va") else _from_toml(text, path)
    frames = {**base.uframe, **loaded.uframe}, {**base.utool, **loaded.utool}
    return Frames(*frames, loaded.input_findings, loaded.extended, loaded.taught)


def read_frame_file(source: Path) -> FrameTable:
    """The frame of a file of ``cgen teach-frame``.

    Raises:
        InputError: Not such a file; names it and the key.
    """
    frame = check(FrameFile, read_toml(source, "paths", "cgen teach-frame writes one"), str(source)).frame
    if frame.file is not None:
        raise InputError(f"{source}: frame.file: a frame's file names no other; give the numbers")
    return frame


def place_of(frame: FrameTable) -> Pose:
    """Where a frame stands in World."""
    return pose_of([getattr(frame, key) for key in POSE_KEYS])


def _from_toml(text: str, path: str) -> Frames:
    data = parse_toml(text.removeprefix(_BYTE_ORDER_MARK), path)
    for key in data:
        if key not in ("uframe", "utool", "extended"):
            raise InputError(f"{path}: {key:.40}: unknown key; give [uframe.N], [utool.N] and [extended.E1]")
        if not isinstance(data[key], dict):
            raise InputError(f"{path}: {key}: must be a table; give [{key}.{'E1' if key == 'extended' else 'N'}]")
    of_files = {n: t for n, t in data.get("uframe", {}).items() if isinstance(t, dict) and "file" in t}
    files = {n: _frame_of_file(n, table, path) for n, table in of_files.items()}
    numbers = {n: {key: getattr(frame, key) for key in POSE_KEYS} for n, frame in files.items()}
    tables = {**data, "uframe": {**data.get("uframe", {}), **numbers}}
    uframe, utool = (
        {_index(n, kind, path): pose_of(pose_values(t, f"{kind}.{n}", path)) for n, t in tables.get(kind, {}).items()}
        for kind in ("uframe", "utool")
    )
    extended = extended_axes(data.get("extended", {}), path)
    taught = {int(n): frame.taught for n, frame in files.items() if frame.taught is not None}
    return Frames(uframe, utool, values_in_other_units(data, path), extended, taught)


def _frame_of_file(number: str, table: Mapping[str, Any], path: str) -> FrameTable:
    """The frame of the file that a user frame's table names; raises InputError where it is another one."""
    where, source = f"{path}: uframe.{number}", Path(path).parent / str(table["file"])
    doubled = next((key for key in table if key != "file"), None)
    if doubled is not None:
        raise InputError(f"{where}.{doubled:.40}: the frame's file says it; remove it, or file")
    frame = read_frame_file(source)
    if number != str(frame.number or 1):
        raise InputError(f"{where}.file: {source} is of frame {frame.number or 1}; name it there, or teach it anew")
    return frame


def _index(text: str, kind: str, path: str) -> int:
    if not re.fullmatch(r"[1-9][0-9]{0,2}", text):
        zero = "World" if kind == "uframe" else "the flange"
        raise InputError(f"{path}: {kind}.{text}: a frame's number is 1 to 999; 0 is {zero}")
    return int(text)


def _from_backup(text: str, path: str) -> Frames:
    tables: dict[str, dict[int, Pose]] = {"FRAME": {}, "TOOL": {}}
    records = _RECORD.findall(text.replace("\r\n", "\n").replace("\n    [", "\n     ["))
    for kind, body in records:
        for number, entry in _ENTRY.findall(unnamed(body)):
            key = f"$MNU{kind}[1,{number}]"
            values = printed_coordinates(entry, key, path)
            if values is None:
                continue
            if int(number) in tables[kind]:
                raise InputError(f"{path}: {key} is there twice; give one controller's backup")
            tables[kind][int(number)] = pose_of(values)
    if not records:
        raise InputError(f"{path}: no $MNUFRAME or $MNUTOOL in it; give SYSFRAME.VA of a backup")
    return Frames(tables["FRAME"], tables["TOOL"])
