"""What the cell did before, in words or in a file of its own: for a program that exists already."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from compgen.core.exceptions import InputError
from compgen.core.toml import check, read_toml
from compgen.core.units import HOUR, MINUTE
from compgen.pipelines.files.schema import BeforeFile
from compgen.thermal import Duty, tables


def load_before(items: Sequence[str]) -> tuple[Duty, ...]:
    """What the cell did before, from the command line.

    Args:
        items: In order; each a TOML file with [[before]] tables, or a stretch in words: state, feed and duration, as in
            ``moving 200mm/s 5h``, ``idle 30min``, ``off 16h``, or as a table has it, ``feed_mm_s=200 duration_h=5``.

    Raises:
        InputError: Not understood; says which and how it is written.
    """
    duties: list[Duty] = []
    for item in items:
        if item.endswith(".toml"):
            data = read_toml(Path(item), "paths", "give a file with [[before]], or words: 'moving 200mm/s 5h'")
            duties += _plain_duties({"before": data.get("before", [])}, item)
        else:
            duties += _plain_duties({"before": [stretch(item)]}, f"--before '{item}'")
    return tuple(duties)


def _plain_duties(data: dict[str, Any], where: str) -> list[Duty]:
    """Stretches of a duration each, as a program that exists already needs them."""
    rows = check(BeforeFile, data, where).before
    steps = tables.steps_of(rows, "before", where, 0.0)
    for step in steps:
        if step.repeat is not None or step.program or step.shifts:
            raise InputError(f"{step.key}: here only state, feed, duration and duty count; remove the rest")
    return [Duty(s.state, s.feed, s.duration or 0.0, s.share) for s in steps]


def stretch(item: str) -> dict[str, str | float]:
    """A stretch in words as a table."""
    table: dict[str, str | float] = {}
    for word in re.split(r"[\s,;:@]+", item.strip()):
        if word in ("moving", "idle", "off"):
            table["state"] = word
        elif feed := re.fullmatch(r"(?:feed_mm_s=)?(\d*\.?\d+)(?:mm/s(?:ec)?)?", word):
            if not (word.startswith("feed") or word.endswith(("s", "c"))):
                raise InputError(f"--before '{item}': {word} has no unit; write it as in 'moving 200mm/s 5h'")
            table["feed_mm_s"] = float(feed[1])
        elif time := re.fullmatch(r"(\d*\.?\d+)(h|min|s)", word):
            table["duration_h"] = float(time[1]) * {"h": HOUR, "min": MINUTE, "s": 1.0}[time[2]] / HOUR
        elif pair := re.fullmatch(r"(state|duration_h)=(\S+)", word):
            table[pair[1]] = pair[2] if pair[1] == "state" else _plain(pair[2], item)
        else:
            raise InputError(f"--before '{item}': {word!r} is not understood; write it as in 'moving 200mm/s 5h'")
    return {"state": "moving" if "feed_mm_s" in table else "idle", **table}


def _plain(text: str, item: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"--before '{item}': {text!r} is not a number") from None
