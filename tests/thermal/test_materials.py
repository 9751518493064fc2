"""Bodies of the network are made of something: what no metal can store or conduct is refused."""

import re

import pytest
from shipped import ROOT, path_file

from compgen.core.exceptions import InputError
from compgen.core.toml import read_toml
from compgen.pipelines.files.path_file import load_job
from compgen.thermal.tables.materials import MATERIALS

NETWORK = read_toml(ROOT / "robots" / "m710ic50.toml", "robots")["thermal"]["network"]
BODIES = {body["name"]: (i, body) for i, body in enumerate(NETWORK["body"])}


def refused(*changes):
    with pytest.raises(InputError) as refusal:
        load_job(path_file("line_y"), overrides=[f"robot.thermal.network.{change}" for change in changes])
    message = str(refusal.value)
    assert len(message) <= 300
    assert "\n" not in message
    return message


def test_the_limit_is_conductivity_over_density_and_heat_capacity():
    """A solid bar of pure aluminium, 1 m x 0.01 m2: k A = 2.37 W m/K, 27.02 kg, 903 J/kgK (Incropera, table A.1)."""
    assert MATERIALS["aluminium"].diffusivity == pytest.approx(2.37 * 1.0 / (27.02 * 903), rel=2e-3)
    assert MATERIALS["steel"].diffusivity == pytest.approx(80.2 / (7870 * 447), rel=0.02)  # pure iron


@pytest.mark.parametrize("name", list(BODIES))
def test_shipped_bodies_are_within_their_material(name):
    _, body = BODIES[name]
    material = MATERIALS[body["material"]]
    low, high = material.heat_capacity
    assert low <= body["heat_capacity_J_kgK"] <= high
    stored = body["mass_kg"] * body["heat_capacity_J_kgK"]
    diffusivity = body["conductance_W_mm_K"] * 1e-3 * body["length_mm"] * 1e-3 / stored
    assert 0.05 * material.diffusivity < diffusivity <= material.diffusivity


def test_the_links_are_no_better_than_an_alloy():
    for name in ("a2", "d4"):
        _, body = BODIES[name]
        stored = body["mass_kg"] * body["heat_capacity_J_kgK"]
        assert body["conductance_W_mm_K"] * body["length_mm"] * 1e-6 / stored <= 73.1e-6  # m2/s, 2024-T6


@pytest.mark.parametrize("name", list(BODIES))
def test_a_body_just_below_its_limit_is_taken_and_just_above_refused(name):
    i, body = BODIES[name]
    stored, length = body["mass_kg"] * body["heat_capacity_J_kgK"], body["length_mm"] * 1e-3
    most = MATERIALS[body["material"]].diffusivity * stored / length * 1e3  # W mm/K
    key = f"body.{i}.conductance_W_mm_K"
    load_job(path_file("line_y"), overrides=[f"robot.thermal.network.{key}={most * 0.9999}"])
    message = refused(f"{key}={most * 1.0001}")
    assert f"thermal.network.{key}" in message
    assert body["material"] in message
    given = float(message.split("give ")[1].split(" or less")[0])
    load_job(path_file("line_y"), overrides=[f"robot.thermal.network.{key}={given}"])  # the mend mends


def test_the_forearm_that_was_shipped_once_is_refused():
    """2340 W mm/K over 1016 mm and 13.64 kg: twice the diffusivity of aluminium."""
    message = refused("body.3.conductance_W_mm_K=2340", "body.3.mass_kg=13.64")
    assert "193.7 mm2/s" in message
    assert "97.1" in message


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (("body.3.material=copper",), ("body.3.material", "aluminium")),
        (("body.3.heat_capacity_J_kgK=460",), ("body.3.heat_capacity_J_kgK", "460", "aluminium 850 to 970")),
        (("body.2.heat_capacity_J_kgK=9000",), ("body.2.heat_capacity_J_kgK", "9000")),
        (("body.3.mass_kg=1",), ("body.3.conductance_W_mm_K", "mass_kg")),
        (("body.0.material=steel", "body.0.length_mm=5650"), ("body.0.conductance_W_mm_K", "steel")),
        (("housing.1.heat_capacity_J_kgK=4200",), ("housing.1.heat_capacity_J_kgK", "4200", "1000")),
        (("housing.1.heat_capacity_J_kgK=46",), ("housing.1.heat_capacity_J_kgK", "380")),
    ],
)
def test_what_no_material_could_be_is_said(changes, words):
    message = refused(*changes)
    assert all(word in message for word in words), message


def test_a_body_that_names_no_material_must_be_one_of_them(tmp_path):
    text = (ROOT / "robots" / "m710ic50.toml").read_text()
    plain = text.replace('material = "aluminium", ', "").replace('material = "cast iron", ', "")
    assert plain != text
    robot = tmp_path / "m710ic50.toml"
    robot.write_text(plain)
    load_job(path_file("line_y"), str(robot))
    robot.write_text(re.sub(r'(name = "d4".*conductance_W_mm_K = )\d+', r"\g<1>1600", plain))
    with pytest.raises(InputError, match=r"body\.3\.conductance_W_mm_K.*aluminium has at most 97\.1"):
        load_job(path_file("line_y"), str(robot))
    robot.write_text(plain.replace("heat_capacity_J_kgK = 900", "heat_capacity_J_kgK = 700", 1))
    with pytest.raises(InputError, match=r"body\.2\.heat_capacity_J_kgK: 700.*steel.*cast iron.*aluminium"):
        load_job(path_file("line_y"), str(robot))


def test_it_is_refused_also_where_the_nodes_are_used():
    assert "thermal.network.body.3" in refused("body.3.conductance_W_mm_K=5000")
    assert load_job(path_file("line_y")).heat.__class__.__name__ == "NodeModel"
