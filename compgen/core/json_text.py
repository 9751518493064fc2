"""JSON as a command writes it, and as it reads it back: keys once, numbers finite; whatever else is damage."""

import json
from collections import Counter
from math import isfinite
from pathlib import Path
from typing import Any

from compgen.core.files import read_regular

MOST_DIGITS = 18  # of a count; beyond it no report has one


def json_text(record: object) -> bytes:
    """A record in plain types as indented JSON, the same bytes for the same record; raises ValueError for NaN."""
    return (json.dumps(record, indent=2, allow_nan=False) + "\n").encode()


def read_json(content: bytes) -> Any:
    """The value that a report's bytes spell, in UTF-8, 16 or 32.

    Raises:
        ValueError: It is not JSON, names a key twice, or has a number that is none or beyond all reports.
    """
    try:
        return json.loads(
            content, parse_constant=_no_number, parse_float=_finite, parse_int=_count, object_pairs_hook=_table
        )
    except json.JSONDecodeError as failure:
        raise ValueError(f"it is not JSON at line {failure.lineno}, column {failure.colno}") from None
    except (UnicodeDecodeError, RecursionError):
        raise ValueError("it is not JSON") from None


def read_record(file: Path) -> dict[str, Any]:
    """A JSON object; an empty one where the file holds none."""
    try:
        record = json.loads(read_regular(file))
    except (OSError, ValueError, RecursionError):
        return {}
    return record if isinstance(record, dict) else {}


def _table(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        twice, _ = Counter(key for key, _ in pairs).most_common(1)[0]
        raise ValueError(f"key {twice[:40]!r} is in it twice")
    return table


def _finite(digits: str) -> float:
    value = float(digits)
    return value if isfinite(value) and abs(value) < 10.0**MOST_DIGITS else _no_number(digits)


def _count(digits: str) -> int:
    return int(digits) if len(digits) <= MOST_DIGITS else int(_no_number(digits))


def _no_number(digits: str) -> float:
    raise ValueError(f"{digits[:12]} is no number of a report")
