"""Offsets as a record: what to type in, and what each leaves."""

from typing import Any

from compgen.core.commands import Command
from compgen.core.pose import POSE_KEYS
from compgen.core.units import MDEG, UM
from compgen.pipelines.planned.offsets import Offset, Offsets


def offsets_record(offsets: Offsets) -> dict[str, Any]:
    """Everything that ``cgen offsets`` says, in plain types."""
    return {
        "command": Command.OFFSETS,
        "name": offsets.name,
        "uframe": offsets.uframe,
        "uframe_is": dict(zip(POSE_KEYS, offsets.frame.tolist(), strict=True)),
        "ways": [_way(way) for way in offsets.ways],
        "findings": [f.record() for f in offsets.findings],
    }


def _way(way: Offset) -> dict[str, Any]:
    left = way.left
    return {
        "kind": way.kind,
        "type_in": None if way.numbers is None else dict(zip(POSE_KEYS, way.numbers.tolist(), strict=True)),
        "leaves": {
            "rms_um": left.rms / UM,
            "p99_um": left.p99 / UM,
            "max_um": left.largest / UM,
            "turn_mdeg": left.turn / MDEG,
        },
    }
