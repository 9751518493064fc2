"""The JSON Schema of path and robot files says what the reader takes, and is what lies beside the shipped files."""

import copy
import json
import tomllib
from pathlib import Path

import jsonschema
import pytest
from forked import code_of, run_forked

from compgen.core.exceptions import InputError
from compgen.core.json_text import json_text
from compgen.core.toml import Table, check
from compgen.core.units import parted
from compgen.pipelines.files.schema import SCHEMA_FILES, PathFile, RobotFile, path_schema, robot_schema

ROOT = Path(__file__).parents[2]
SHAPES = ("line", "circle", "spiral", "raster", "iso9283")
SCHEMAS = {"path": path_schema(), "robot": robot_schema()}
MODELS: dict[str, type[Table]] = {"path": PathFile, "robot": RobotFile}
SHIPPED = [
    pytest.param(kind, file, id=file.stem) for kind in SCHEMAS for file in sorted((ROOT / f"{kind}s").glob("*.toml"))
]
EXAMPLES = {
    "path": ROOT / "paths" / "optic_raster.toml",
    "robot": ROOT / "robots" / "m710ic50.toml",
    "sources": ROOT / "tests" / "flawed_sources.toml",
}
#: keys of numbers that have no unit
PLAIN_NUMBERS = {
    "confidence", "conic_constant", "coulomb", "cycles", "decimals", "draws", "drives", "drifting", "duty", "excess_a",
    "excess_d", "exponent", "forecast_blocks", "forecast_scale", "holding", "idle_fraction", "margin_sigma", "matrix",
    "max_lines", "max_positions", "name_length", "number", "order", "payload", "repeat", "run", "runs", "seed", "share",
    "direction", "probing", "turn_joints", "turns", "viscous", "volumes",
}  # fmt: skip


def example(kind):
    data = tomllib.loads(EXAMPLES[kind].read_text())
    if kind == "robot":
        data["sources"] = tomllib.loads(EXAMPLES["sources"].read_text())["sources"]
    return data


def changed(data, key, value):
    """The data with one key set, or removed where the value is None."""
    data = copy.deepcopy(data)
    *parents, last = [int(step) if step.isdigit() else step for step in key.split(".")]
    table = data
    for step in parents:
        table = table[step] if isinstance(table, list) else table.setdefault(step, {})
    if value is None:
        del table[last]
    else:
        table[last] = value
    return data


def keys(schema):
    """Every table of a schema with each of its keys."""
    for name, table in [("file", schema), *schema["$defs"].items()]:
        for key, value in table["properties"].items():
            yield name, key, value


@pytest.mark.parametrize("kind", SCHEMAS)
def test_a_schema_is_one_of_draft_2020_12(kind):
    schema = SCHEMAS[kind]
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert (schema["$id"], schema["title"]) == (f"urn:compgen:{kind}-file", f"compgen {kind} file")
    jsonschema.Draft202012Validator.check_schema(schema)
    assert all(table["additionalProperties"] is False for table in [schema, *schema["$defs"].values()])
    assert '"null"' not in json.dumps(schema)


def test_the_pattern_decides_which_keys_a_path_has():
    schema = SCHEMAS["path"]
    choices = [schema["$defs"][choice["$ref"].split("/")[-1]] for choice in schema["properties"]["path"]["oneOf"]]
    patterns = [c["properties"]["pattern"]["const"] for c in choices]
    assert set(patterns) >= {"line", "circle", "spiral", "raster", "iso9283", "points", "apt", "gcode"}
    assert len(set(patterns)) == len(patterns)
    assert all("pattern" in c["required"] for c in choices)


@pytest.mark.parametrize("kind", SCHEMAS)
def test_every_key_is_described_in_one_line(kind):
    for table, key, value in keys(SCHEMAS[kind]):
        target = SCHEMAS[kind]["$defs"].get(value.get("$ref", "").split("/")[-1], {})
        text = value.get("description") or target.get("description", "")
        assert text, f"{table}.{key} has no text"
        fits = text.isascii() and text.isprintable() and text.endswith(".") and len(text) <= 120
        assert fits, f"{table}.{key}: {text}"


@pytest.mark.parametrize("kind", SCHEMAS)
def test_every_number_has_its_unit_in_its_name_and_in_its_text(kind):
    for table, key, value in keys(SCHEMAS[kind]):
        text = json.dumps(value)
        if unit := parted(key)[1]:
            assert f"[{unit}]" in value["description"], f"{table}.{key}"
        elif '"number"' in text or '"integer"' in text:
            assert key in PLAIN_NUMBERS or "[h]" in text or "degC" in text, f"{table}.{key} has no unit"


@pytest.mark.parametrize("kind", SCHEMAS)
def test_every_number_has_a_range(kind):
    def ranged(value):
        if value.get("type") in ("number", "integer"):
            assert {"minimum", "exclusiveMinimum"} & set(value), value
            assert {"maximum", "exclusiveMaximum"} & set(value) or value["type"] == "integer", value
        for inner in [value.get("items"), value.get("additionalProperties"), *value.get("anyOf", [])]:
            if isinstance(inner, dict):
                ranged(inner)

    for _, _, value in keys(SCHEMAS[kind]):
        ranged(value)


@pytest.mark.parametrize(("kind", "file"), SHIPPED)
def test_every_shipped_file_is_valid_and_names_its_schema(kind, file):
    text = file.read_text()
    directive, schema = text.splitlines()[0].split()
    assert directive == "#:schema"
    assert (file.parent / schema).samefile(ROOT / SCHEMA_FILES[kind])
    jsonschema.Draft202012Validator(json.loads((file.parent / schema).read_text())).validate(tomllib.loads(text))


@pytest.mark.parametrize("kind", SCHEMAS)
def test_the_shipped_schema_is_the_one_of_the_code(kind):
    """To renew it: cgen schema path -o paths/path.schema.json, cgen schema robot -o robots/robot.schema.json."""
    assert (ROOT / SCHEMA_FILES[kind]).read_bytes() == json_text(SCHEMAS[kind])


@pytest.mark.parametrize("kind", SCHEMAS)
def test_the_example_is_right_for_both(kind):
    check(MODELS[kind], example(kind), "file")
    jsonschema.Draft202012Validator(SCHEMAS[kind]).validate(example(kind))


WRONG: dict[str, list[tuple[str, object]]] = {
    "path": [
        ("titel", "x"), ("title", 3), ("path", None), ("path", 3), ("path.pattern", "spirale"),
        ("path.pattern", None), ("path.x_mm", None), ("path.x_mm", 20_000), ("path.x_mm", "1200"), ("path.size_mm", 5),
        ("path.stepover_mm", 0), ("path.stepover_mm", None), ("path.lead_mm", 51), ("path.turn", "round"),
        ("path.lead_um", 5), ("surface.kind", "sphere"), ("surface.radius_of_curvature_m", 0),
        ("surface.radius_of_curvature_mm", 84_000), ("boundary.shape", None), ("boundary", []), ("tool.number", 1.5),
        ("tool.number", 11), ("tool.axisymmetric", 1), ("process", None), ("process.feed_mm_s", None),
        ("process.feed_mm_s", True), ("process.feed_mm_s", 0), ("process.feed", 20), ("process.page_stops", "here"),
        ("posture.arm", "left"), ("compensation.clamp_mm", 101), ("before", {"state": "idle"}),
        ("before.0.state", None), ("before.0.state", "running"), ("before.0.repeat", 2.5), ("before.0.duty", 1.1),
        ("before.0.shifts", "yes"), ("shift", [{"from_h": 24, "to_h": 30}]), ("shift", [{"from_h": 6}]),
        ("shift", [{"from_h": 6, "to_h": 14, "breaks_h": [[9]]}]), ("ambient.value_degC", 61), ("ambient.kind", "sine"),
        ("log", {}), ("log", {"file": "a.csv", "reference": "cold"}), ("log", {"file": "a.csv", "reference": 61}),
        ("bounds", None), ("bounds.max_um", 0), ("bounds.max_mm", 1),
    ],
    "robot": [
        ("name", None), ("name", "a b"), ("name", 25 * "x"), ("nam", "x"), ("payload_kg", 0), ("dh", None),
        ("dh.d_mm", [0, 0, 0, 0, 0]), ("dh.d_mm.3", "x"), ("dh.d_mm.3", 20_000), ("dh.theta_deg", 6 * [0]),
        ("pendant.matrix", 6 * [[1, 0, 0]]), ("limits.j1_deg", [-180]), ("limits.j1_rad", [-3, 3]),
        ("limits.speed_deg_s.0", 0), ("controller.compensation", "yes"), ("controller.max_lines", 99.5),
        ("controller.name_length", 40), ("controller.turn_joints", [1, 4, 7]), ("thermal.model", "fem"),
        ("thermal.cte_um_m_K", "steel"), ("thermal.cte_um_m_K", {"a2": "steel"}), ("thermal.cte_um_m_K", 2000),
        ("thermal.node", []), ("thermal.node.0.tau_h", 0), ("thermal.node.0.tau_s", 60), ("thermal.node.0.name", "2"),
        ("thermal.profile.0.sections.0.from", None), ("thermal.profile.0.sections.0.from", 3),
        ("thermal.profile.0.sections.0.from_", "j2"), ("thermal.profile.0.length", "d5"),
        ("thermal.sensors.part_3", 3), ("thermal.network.body.0.volumes", 0), ("thermal.network.housing.0.drives", [0]),
        ("thermal.network.loss.viscous", None), ("sources.joint_zero", {}), ("sources.joint_zeros.offset_mdeg", [0.0]),
        ("sources.joint_zeros.offset_deg", 6 * [0.0]), ("sources.joint_zeros.sigma", 3), ("sources.hysteresis", {}),
        ("sources.map.0.axis", "w"), ("sources.map.0.at_mm", [0, 0]), ("sources.map", {}),
        ("sources.loads.payload_kg", -1), ("sources.thermal_bend.plane", ["up"]), ("sources.box.low_deg", None),
        ("identified", {}),
    ],
}  # fmt: skip


@pytest.mark.parametrize(("kind", "key", "value"), [(kind, *case) for kind in WRONG for case in WRONG[kind]])
def test_what_the_reader_refuses_the_schema_refuses_too(kind, key, value):
    data = changed(example(kind), key, value)
    with pytest.raises(InputError, match=r"^file: ") as caught:
        check(MODELS[kind], data, "file")
    assert len(str(caught.value)) <= 300
    assert not jsonschema.Draft202012Validator(SCHEMAS[kind]).is_valid(data)


def test_the_command_prints_and_writes_what_is_shipped(tmp_path):
    def run(*words):
        return run_forked(code_of(["schema", *words]))

    for kind, file in SCHEMA_FILES.items():
        assert run(kind).stdout == (ROOT / file).read_text()
    assert run("path", "-o", str(tmp_path / "p.json")).stdout == ""
    assert (tmp_path / "p.json").read_text() == (ROOT / SCHEMA_FILES["path"]).read_text()
    refused = run("tool")
    assert refused.returncode == 2
    assert "'path', 'robot'" in refused.stderr


def test_the_page_of_keys_is_made_from_the_schema(monkeypatch):
    """To renew it: python docs/key_tables.py."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    import key_tables

    assert (ROOT / "docs" / "keys.md").read_text() == key_tables.page()
