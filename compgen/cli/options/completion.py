"""Values that a shell completes: path files, programs, folders of pages, robots by name, keys.

A function gets what is typed of the word at work and returns words, some with what they mean. Where it returns none the
shell falls back to its files. Nothing slow is loaded.
"""

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from compgen.core.finding_codes import Code

SHIPPED = Path(__file__).parents[2]  # the package
DEEPEST = 4  # levels of tables


def complete_paths(incomplete: str) -> list[str]:
    """Path files here, in ``paths`` and in the folder that is typed."""
    return _files(incomplete, ".toml", "", "paths")


def complete_programs(incomplete: str) -> list[str]:
    """Programs here, in the folder that is typed and in those of ``outputs``."""
    return _files(incomplete, ".ls", "", *(f"outputs/{name}" for name in _names("outputs")))


def complete_jobs(incomplete: str) -> list[str]:
    """Path files and programs."""
    return [*complete_paths(incomplete), *complete_programs(incomplete)]


def complete_page_folders(incomplete: str) -> list[str]:
    """Folders of ``outputs`` that hold pages."""
    folders = (f"outputs/{name}" for name in _names("outputs"))
    return [folder for folder in folders if folder.startswith(incomplete) and _names(folder, ".pages.json")]


def complete_robots(incomplete: str) -> list[str]:
    """Robots by name, of ``robots`` here or as shipped, and robot files in the folder that is typed."""
    named = {name.removesuffix(".toml") for folder in ("robots", _data("robots")) for name in _names(folder, ".toml")}
    files = _files(incomplete, ".toml", "") if os.sep in incomplete or incomplete.endswith(".toml") else []
    return [*sorted(name for name in named if name.startswith(incomplete)), *files]


def complete_keys(incomplete: str) -> list[tuple[str, str]]:
    """Keys of path files and, behind ``robot.``, of robot files, each with its meaning."""
    keys = [*_keys(_schema("path"), "", 0), *_keys(_schema("robot"), "robot.", 0)]
    return [(f"{key}=", meaning) for key, meaning in dict(reversed(keys)).items() if key.startswith(incomplete)]


def complete_codes(incomplete: str) -> list[tuple[str, str]]:
    """Codes of findings, each with what it means."""
    return [(code.value, code.meaning) for code in Code if code.startswith(incomplete)]


def one_of(*words: str) -> Callable[[str], list[str]]:
    """What completes an option that has so many values."""

    def complete(incomplete: str) -> list[str]:
        return [word for word in words if word.startswith(incomplete)]

    return complete


def _files(incomplete: str, suffix: str, *folders: str) -> list[str]:
    """Files of a kind that begin as typed, in some folders and in the one that is typed."""
    typed = incomplete[: incomplete.rfind("/") + 1]
    places = dict.fromkeys([*folders, typed.rstrip("/")]) if not os.path.isabs(incomplete) else [typed]
    files = [os.path.join(place, name) for place in places for name in _names(place or ".", suffix)]
    return [file for file in files if file.startswith(incomplete)]


def _names(folder: str, suffix: str = "") -> list[str]:
    """What is in a folder, if it is one."""
    try:
        return sorted(name for name in os.listdir(folder) if name.lower().endswith(suffix) and name[0] != ".")
    except OSError:
        return []


def doc_place(name: str) -> str:
    """Where a page of docs/ lies here: in the checkout, or as it came with the package."""
    return os.path.join(_data("docs"), f"{name}.md")


def _data(kind: str) -> str:
    inside = SHIPPED / "data" / kind
    return str(inside if inside.is_dir() else SHIPPED.parent / kind)


def _schema(kind: str) -> dict[str, Any]:
    """The JSON Schema that is shipped; empty where it is not."""
    try:
        return dict(json.loads(Path(_data(f"{kind}s"), f"{kind}.schema.json").read_text()))
    except (OSError, ValueError):
        return {}


def _keys(schema: dict[str, Any], before: str, level: int, part: Any = None) -> Iterator[tuple[str, str]]:
    """Keys of a table in a schema, as ``--set`` takes them, with the first sentence of what they mean."""
    part = schema if part is None else part
    for key, entry in part.get("properties", {}).items():
        tables = [table for table in _tables(schema, entry) if level < DEEPEST]
        inner = f"{before}{key}.0." if entry.get("type") == "array" else f"{before}{key}."
        if not tables:
            yield f"{before}{key}", str(entry.get("description", "")).partition(". ")[0]
        for table in tables:
            yield from _keys(schema, inner, level + 1, table)


def _tables(schema: dict[str, Any], entry: dict[str, Any]) -> list[dict[str, Any]]:
    """The tables that a key may hold."""
    kinds = [entry, entry.get("items", {}), *(k for way in ("oneOf", "anyOf", "allOf") for k in entry.get(way, []))]
    kinds += [inner for way in ("oneOf", "anyOf") for inner in entry.get("items", {}).get(way, [])]
    return [schema.get("$defs", {}).get(kind["$ref"].rpartition("/")[2], {}) for kind in kinds if "$ref" in kind]
