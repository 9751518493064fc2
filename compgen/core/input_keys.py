"""What a run was made from, key by key: the tables of a file as they were read, overrides and defaults in them."""

import json
from collections.abc import Iterator, Mapping
from hashlib import sha256
from typing import Any

from compgen.core.toml import Table

MOST_VALUES = 200  # of a list: one with more is named by how many they are and their hash


def input_keys(table: Table) -> dict[str, Any]:
    """Every key of a checked table with its value, as a file would spell both; None where it was left open.

    A list of more than ``MOST_VALUES`` values is ``{"values": how many, "sha256": of their JSON}``.
    """
    return {key: _brief(value) for key, value in table.model_dump(mode="json", by_alias=True).items()}


def dotted_keys(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Tables in each other as dotted keys, as ``--set`` takes them; a list of plain values is one value."""
    return dict(_flat(tables, ""))


def _flat(value: Any, key: str) -> Iterator[tuple[str, Any]]:
    step = f"{key}." if key else ""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _flat(inner, f"{step}{name}")
    elif isinstance(value, list) and any(isinstance(row, Mapping) for row in value):
        for n, row in enumerate(value):
            yield from _flat(row, f"{step}{n}")
    else:
        yield key, value


def _brief(value: Any) -> Any:
    """A value of JSON with its long lists named by their hashes."""
    if isinstance(value, dict):
        return {key: _brief(inner) for key, inner in value.items()}
    if not isinstance(value, list):
        return value
    count = _count(value)
    if count > MOST_VALUES:
        return {"values": count, "sha256": sha256(json.dumps(value).encode()).hexdigest()}
    return [_brief(inner) for inner in value]


def _count(value: Any) -> int:
    """Values in lists and tables in each other."""
    if isinstance(value, dict):
        return sum(map(_count, value.values()))
    return sum(map(_count, value)) if isinstance(value, list) else 1
