"""Writes docs/keys.md: every key of a path file and of a robot file, from their JSON Schema.

python docs/key_tables.py
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from compgen.pipelines.files.schema import path_schema, robot_schema

Schema = dict[str, Any]

PAGE = Path(__file__).parent / "keys.md"
INTRODUCTION = """\
# Keys of path and robot files

Made by `python docs/key_tables.py` from the schemas that `cgen schema path` and `cgen schema robot` print. Each key
carries its unit in its name; a wrong unit is an unknown key. `*` marks what must be given, `n` any count. Frames and
angles are in [conventions](conventions.md), heat in [heat](heat.md), error sources in [error sources](sources.md).

An editor with TOML support (Even Better TOML, taplo) completes and checks these keys in a file whose first line is
`#:schema ./path.schema.json` or `#:schema ./robot.schema.json`; `cgen init` lays the schemas down beside the files.
"""
#: keys that every error source has
OF_EVERY_SOURCE = ("provenance", "sigma", "prior")


def page() -> str:
    """The text of docs/keys.md."""
    files = [("Path file", path_schema()), ("Robot file", robot_schema())]
    return "\n".join([INTRODUCTION, *(line for title, schema in files for line in _file(title, schema))])


def _file(title: str, schema: Schema) -> Iterator[str]:
    yield from (f"## {title}", "", schema["description"], "")
    yield from _tables(schema, schema, ())


def _tables(schema: Schema, table: Schema, path: tuple[str, ...]) -> Iterator[str]:
    """The rows of a table's own keys, then each of the tables below it; keys of the same table stand together."""
    yield from _rows(table)
    below: dict[str, list[tuple[str, Schema]]] = {}
    for key, value in table["properties"].items():
        if "oneOf" in value:
            below[key] = [(key, value)]
        elif reference := _reference(value):
            below.setdefault(reference, []).append((key, value))
    for reference, uses in below.items():
        if "oneOf" in uses[0][1]:
            yield from _patterns(schema, *uses[0])
            continue
        names = [".".join((*path, key)) for key, _ in uses]
        headings = [
            f"`[[{n}]]`" if "items" in value else f"`[{n}]`" for n, (_, value) in zip(names, uses, strict=False)
        ]
        inner = schema["$defs"][reference]
        yield from (f"### {', '.join(headings)}", "", inner["description"], "")
        if len(uses) > 1:
            yield from (
                f"- {heading}: {value['description']}" for heading, (_, value) in zip(headings, uses, strict=False)
            )
            yield ""
        if names == ["sources"]:
            source = schema["$defs"]["JointZerosTable"]["properties"]
            common = {key: source[key] for key in OF_EVERY_SOURCE}
            yield from ("Every source may have:", "", *_rows({"properties": common}))
        elif path == ("sources",):
            inner = {**inner, "properties": {k: v for k, v in inner["properties"].items() if k not in OF_EVERY_SOURCE}}
        yield from _tables(schema, inner, (*path, uses[0][0]))


def _patterns(schema: Schema, key: str, value: Schema) -> Iterator[str]:
    """A table whose pattern decides its keys: what all patterns have, then each pattern's own keys."""
    choices = [schema["$defs"][choice["$ref"].split("/")[-1]] for choice in value["oneOf"]]
    names = [choice["properties"]["pattern"]["const"] for choice in choices]
    common = {k: v for k, v in choices[0]["properties"].items() if all(c["properties"].get(k) == v for c in choices)}
    pattern = {"enum": names, "description": "Shape of the path."}
    shared = {"properties": {"pattern": pattern, **common}, "required": ["pattern", *common]}
    yield from (f"### `[{key}]`", "", value["description"], "", *_rows(shared))
    for name, choice in zip(names, choices, strict=False):
        own = {k: v for k, v in choice["properties"].items() if k not in (*common, "pattern")}
        yield from (f'### `[{key}]` with `pattern = "{name}"`', "", choice["description"], "")
        yield from _rows({**choice, "properties": own})


def _reference(value: Schema) -> str:
    """The name of the table, or of the tables of a list, that a key holds; empty for a plain value."""
    return str({**value, **value.get("items", {})}.get("$ref", "")).split("/")[-1]


def _rows(table: Schema) -> list[str]:
    """A table of the keys that hold plain values, with an empty line behind it."""
    rows = [
        f"| `{key}`{'*' if key in table.get('required', ()) else ''} | {_values(value)} | {_default(value)} "
        f"| {value['description'].replace('<', '&lt;')} |"
        for key, value in table["properties"].items()
        if not _reference(value) and "oneOf" not in value
    ]
    return ["| key | values | default | meaning |", "|---|---|---|---|", *rows, ""] if rows else []


def _values(value: Schema) -> str:
    """What a key may hold."""
    if "anyOf" in value:
        return ", or ".join(_values(choice) for choice in value["anyOf"])
    if value.get("type") == "array":
        return _list(value)
    if value.get("type") == "object":
        inner = value["additionalProperties"]
        return f"by name: {_values(inner)}" if isinstance(inner, dict) else "by key"
    return _plain(value)


def _list(value: Schema) -> str:
    """What a list may hold, with its counts: 6 x 2 numbers, 0 to 1."""
    counts = []
    while value.get("type") == "array":
        least, most = value.get("minItems", 0), value.get("maxItems")
        counts.append(str(least) if least == most else f"{least} to {most}" if least and most else "n")
        value = value["items"]
    noun = {"number": "numbers, ", "integer": "integers, "}.get(value["type"], "")
    return f"{' x '.join(counts)} {'of ' * (not noun)}{noun}{_plain(value).removeprefix('integer ')}"


def _plain(value: Schema) -> str:
    """What a key without a list may hold."""
    if "const" in value:
        return f"`{value['const']}`"
    if "enum" in value:
        return ", ".join(f"`{word}`" for word in value["enum"])
    if value["type"] == "boolean":
        return "`true`, `false`"
    if value["type"] == "string":
        return f"text, at most {value['maxLength']} characters" if "maxLength" in value else "text"
    low = f"{value['minimum']:.10g}" if "minimum" in value else f"above {value['exclusiveMinimum']:.10g}"
    high = f" to {value['maximum']:.10g}" if "maximum" in value else ""
    high = f" to below {value['exclusiveMaximum']:.10g}" if "exclusiveMaximum" in value else high
    high = f", up{high}" if high and low.startswith("above") else high
    return f"{'integer ' * (value['type'] == 'integer')}{low}{high}"


def _default(value: Schema) -> str:
    """A key's default as a TOML file would have it; a list of equal numbers is "all 0"."""
    default = value.get("default")
    if default in (None, "", [], {}):
        return ""
    if isinstance(default, list):
        numbers = [f"{x:g}" for x in _flat(default)]
        return f"all {numbers[0]}" if len(set(numbers)) == 1 else f"[{', '.join(numbers)}]"
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    return f"`{default}`" if isinstance(default, str) else f"{default:g}"


def _flat(value: Any) -> list[float]:
    return [x for inner in value for x in _flat(inner)] if isinstance(value, list) else [value]


if __name__ == "__main__":
    PAGE.write_text(page())
