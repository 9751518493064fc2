"""JSON Schema (draft 2020-12) of path and robot files, for editors and for the tables of keys in docs/."""

from typing import Any

from compgen.core.toml import Table
from compgen.pipelines.files.schema import PathFile, RobotFile

#: where a shipped file's first line, ``#:schema ./path.schema.json``, finds its schema
SCHEMA_FILES = {"path": "paths/path.schema.json", "robot": "robots/robot.schema.json"}

UNITS = {
    "um": "um", "mm": "mm", "m": "m", "mm_s": "mm/s", "m_s2": "m/s^2", "um_mm": "um/mm", "um_K": "um/K",
    "um_m_K": "um/(m K)", "deg": "deg", "mdeg": "mdeg", "deg_s": "deg/s", "deg_s2": "deg/s^2", "deg_s3": "deg/s^3",
    "arcsec_K": "arcsec/K", "urad_Nm": "urad/(N m)", "ms": "ms", "s": "s", "min": "min", "h": "h", "degC": "degC",
    "K": "K", "W": "W", "W_K": "W/K", "W_mm_K": "W mm/K", "J_kgK": "J/(kg K)", "kg": "kg", "N": "N", "kB": "kB",
    "ppm": "ppm", "percent": "%",
}  # fmt: skip


def path_schema() -> dict[str, Any]:
    """JSON Schema of a path file."""
    return _document(PathFile, "path")


def robot_schema() -> dict[str, Any]:
    """JSON Schema of a robot file."""
    return _document(RobotFile, "robot")


def unit_of(key: str) -> str:
    """The unit that a key carries at the end of its name; empty without one."""
    words = key.split("_")
    endings = ("_".join(words[i:]) for i in range(1, len(words)))
    return next((UNITS[e] for e in endings if e in UNITS), "")


def _document(model: type[Table], name: str) -> dict[str, Any]:
    head = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:compgen:{name}-file",
        "title": f"compgen {name} file",
    }
    return {**head, **_plain(model.model_json_schema())}


def _plain(schema: dict[str, Any], key: str = "") -> dict[str, Any]:
    """A schema as TOML needs it: no null, no titles made of names, defaults at the keys alone, units in the text."""
    plain = {k: v for k, v in schema.items() if k not in ("title", "discriminator")}
    choices = [c for c in plain.pop("anyOf", []) if c != {"type": "null"}]
    if len(choices) == 1:
        plain |= choices[0]
    elif choices:
        plain["anyOf"] = [_plain(c) for c in choices]
    if plain.get("default") is None or "$ref" in plain:
        plain.pop("default", None)
    if "description" in plain and (unit := unit_of(key)):
        first, *rest = plain["description"].rstrip(".").split(";", 1)
        plain["description"] = ";".join([f"{first} [{unit}]", *rest]) + "."
    for word in ("properties", "$defs"):
        if word in plain:
            plain[word] = {name: _plain(inner, name) for name, inner in plain[word].items()}
    for word in ("items", "additionalProperties"):
        if isinstance(plain.get(word), dict):
            plain[word] = _plain(plain[word])
    return plain
