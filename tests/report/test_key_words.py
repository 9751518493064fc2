"""Keys in words: whatever the key, its unit is the one that its name carries."""

import json

import pytest
from shipped import ROOT

from compgen.core.units import UNIT_AT_END
from compgen.pipelines.comparison.comparison import Pair
from compgen.pipelines.study.scenarios import SHORT
from compgen.report.compare_words import input_cells
from compgen.report.key_words import title_of, unit_of, words_of


@pytest.mark.parametrize(
    ("key", "title"),
    [
        ("process.feed_mm_s", "feed [mm/s]"),
        ("before.0.duration_h", "first warm-up [h]"),
        ("before.1.duty", "duty of the second warm-up"),
        ("robot.thermal.cte_um_m_K", "coefficient of expansion [µm/(m K)]"),
        ("robot.thermal.model", "heat model"),
        ("ambient.value_degC", "air temperature [°C]"),
        ("robot.sources.link_offsets.a_um.2", "link offsets, a 3 [µm]"),
        ("tool.x_mm", "tool, x [mm]"),
        ("before_max_um", "before max [µm]"),
    ],
)
def test_a_key_is_words_with_its_unit(key, title):
    assert title_of(key) == title


def schema_keys(node, names):
    if isinstance(node, dict):
        names |= set(node.get("properties", {}))
        for value in node.values():
            schema_keys(value, names)
    elif isinstance(node, list):
        for value in node:
            schema_keys(value, names)
    return names


def test_no_key_of_either_file_keeps_its_unit_in_its_words():
    """What looks like a unit at a name's end is in the table of units."""
    names: set[str] = set()
    for file in ("paths/path.schema.json", "robots/robot.schema.json"):
        schema_keys(json.loads((ROOT / file).read_text()), names)
    endings = {ending for ending in UNIT_AT_END if len(ending) > 1}
    for name in names:
        assert not any(words_of(name).endswith(f" {ending.replace('_', ' ')}") for ending in endings), name
        if name.endswith(("_mm", "_um", "_mm_s", "_h", "_deg", "_mdeg", "_K", "_degC", "_percent")):
            assert unit_of(name), name
    for key in SHORT.values():
        assert "_" not in words_of(key)


def test_a_hash_in_a_table_is_short():
    pair = Pair("files.before.0.program.sha256", "d80c142991e9" + 52 * "0", None)
    assert input_cells(pair) == ("d80c142991e9", "–")
