"""The IRB 120 is shipped with what its joints carry: its sag is fitted unasked; arms without masses are told."""

import tomllib
from dataclasses import dataclass, field
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import quiet

from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.error_model.loads import torque_expr
from compgen.error_model.sources.compliance import JointCompliance
from compgen.error_model.uncertain_sources import UncertainSource
from compgen.identification.parameters import symbolic_sources
from compgen.pipelines.files.robot_file import load_arm, load_cell
from compgen.pipelines.measure import identification_files
from compgen.pipelines.measure.identification_files import arm_to_identify
from compgen.robot.kinematics import nominal_chain
from compgen.thermal.drive_losses import joint_torques
from compgen.thermal.network import NetworkModel

#: kg, and mm in front of the axes of J2 and of J3 with the forearm forward: its drawing, 302 and 72 mm to J5 and flange
MASS = {"upper arm": 3.909, "forearm": 2.944, "link 4": 1.328, "link 5": 0.546, "flange": 0.137}
AHEAD = {"upper arm": 0.8, "forearm": 22.8, "link 4": 224.7, "link 5": 302 - 1.1, "flange": 302 + 72 - 7.1}


def test_its_joints_carry_what_a_hand_sums():
    arm = load_arm("irb120")
    moment = {name: 9.80665 * MASS[name] * AHEAD[name] / 1e3 for name in MASS}  # N m
    chain = nominal_chain(arm.robot, ca.DM(arm.robot.to_theta(np.zeros(6))))
    torque = np.array([float(t) for t in torque_expr(arm.facts.loads, chain)])
    shoulder, elbow = sum(moment.values()), sum(moment.values()) - moment["upper arm"]
    assert_allclose(np.abs(torque[:3]), [0, shoulder, elbow], atol=0.02)
    assert shoulder == pytest.approx(5.72, abs=0.01)


def test_masses_of_the_thermal_network_load_the_joints_as_they_load_its_drives():
    arm, heat = arm_to_identify("m710ic50"), load_cell("m710ic50", ["thermal.model='network'"]).heat
    assert arm.network_masses
    assert isinstance(heat, NetworkModel)
    theta = np.random.default_rng(0).uniform(arm.robot.lower, arm.robot.upper, (50, 6))
    holding = joint_torques(arm.robot, heat.drives, theta, np.zeros((50, 6)), np.zeros((50, 6)))  # by pinocchio
    load = [[float(t) for t in torque_expr(arm.facts.loads, nominal_chain(arm.robot, ca.DM(q)))] for q in theta]
    assert_allclose(-np.array(load) / 9.80665, holding / 9.81, atol=1e-9)


def test_masses_of_its_own_come_before_those_of_the_thermal_network(tmp_path):
    robot = tmp_path / "own.toml"
    robot.write_text(load_arm("m710ic50").text + "\n[sources.loads]\npayload_kg = 7\n")
    arm = arm_to_identify(str(robot))
    assert not arm.network_masses
    assert arm.text == robot.read_text()
    assert arm.facts.loads.payload == 7
    assert not arm.facts.loads.mass.any()


def test_gravity_and_force_of_the_file_stay_beside_the_masses_of_the_network(tmp_path):
    """On a ceiling the warning said to give gravity, and the file that did was fitted as one on the floor again."""
    robot = tmp_path / "ceiling.toml"
    own = {"gravity_m_s2": [0, 0, 9.80665], "force_N": [0, 0, -20]}
    robot.write_text(
        load_arm("m710ic50").text + "\n[sources.loads]\n" + "".join(f"{key} = {value}\n" for key, value in own.items())
    )
    arm, floor = arm_to_identify(str(robot)), arm_to_identify("m710ic50")
    assert arm.network_masses
    table = tomllib.loads(arm.text)
    masses = {key: table["thermal"]["network"][key] for key in identification_files.MASSES}
    assert table["sources"]["loads"] == own | masses
    q = ca.DM(arm.robot.to_theta(np.radians([20, 30, -10, 40, 50, 60])))
    hanging, standing = (
        [float(t) for t in torque_expr(of.facts.loads.without_force(), nominal_chain(of.robot, q))]
        for of in (arm, floor)
    )
    assert_allclose(hanging, -np.array(standing), rtol=1e-12)


def test_a_file_that_was_not_identified_sags_by_its_own_masses_alone(tmp_path):
    robot = tmp_path / "own.toml"
    robot.write_text(load_arm("m710ic50").text + "\n[sources.compliance]\ncompliance_urad_Nm = [0, 1, 0, 0, 0, 0]\n")
    assert not load_arm(str(robot)).facts.loads.have_weight
    arm = arm_to_identify(str(robot))
    table, network = tomllib.loads(arm.text)["sources"], tomllib.loads(arm.text)["thermal"]["network"]
    assert table["compliance"] == {"compliance_urad_Nm": [0, 1, 0, 0, 0, 0]}
    assert table["loads"] == {key: network[key] for key in table["loads"]}
    assert set(table["loads"]) == {"link_kg", "link_centre_mm", "payload_kg", "payload_centre_mm"}


@pytest.mark.parametrize(("name", "fitted"), [("irb120", True), ("ur5", False), ("m710ic50", True)])
def test_sag_is_fitted_where_the_masses_are_known(name, fitted):
    arm = arm_to_identify(name)
    sources = symbolic_sources(arm.robot, arm.known, np.ones(6, bool), warm=False, facts=arm.facts)
    tables = {p.source for source in sources for p in source.parameters}
    assert ("compliance" in tables) == fitted


@dataclass(frozen=True)
class Fitted:
    """What the fit found, which does not matter here."""

    findings: tuple[Finding, ...] = ()
    known: tuple[UncertainSource, ...] = ()
    model: None = None
    selected: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(fit=None))


@pytest.mark.parametrize(
    ("name", "codes"), [("irb120", []), ("ur5", [Code.SOURCES_LOADS]), ("m710ic50", [Code.SOURCES_LOADS])]
)
def test_an_arm_without_masses_is_told_of_its_sag(name, codes, monkeypatch):
    monkeypatch.setattr(identification_files, "read_measurements", lambda *_, **__: (None, []))
    monkeypatch.setattr(identification_files, "identify_by_files", lambda *_, **__: Fitted())
    monkeypatch.setattr(identification_files, "sensorless_nodes", lambda *_: [])
    files = identification_files.MeasurementFiles(poses=["poses.csv"])
    identified = identification_files.identify_files(arm_to_identify(name), files, "start", quiet, force=False)
    assert [finding.code for finding in identified.findings] == codes


@pytest.mark.parametrize(("value", "said"), [(-0.26, "J2, J3 would give against the load"), (-0.15, ""), (0.26, "")])
def test_joints_that_give_against_their_load_are_warned_of(value, said, monkeypatch):
    """An arm on a ceiling whose file said nothing of it was accepted with springs that push, without a word."""
    given = 1e-6 * np.array([0, value, value, -0.35, 0, 0])
    sag = JointCompliance(given, np.zeros(6), arm_to_identify("irb120").facts.loads)
    sigma = {"compliance": 1e-6 * np.array([0, 0.08, 0.08, 0.2, 0.1, 0.5])}
    known = (UncertainSource(sag, {}, sigma, ""),)
    monkeypatch.setattr(identification_files, "read_measurements", lambda *_, **__: (None, []))
    monkeypatch.setattr(identification_files, "identify_by_files", lambda *_, **__: Fitted(known=known))
    monkeypatch.setattr(identification_files, "sensorless_nodes", lambda *_: [])
    files = identification_files.MeasurementFiles(poses=["poses.csv"])
    identified = identification_files.identify_files(arm_to_identify("irb120"), files, "start", quiet, force=False)
    assert " ".join(f.message for f in identified.findings).startswith(said)
    assert [f.level for f in identified.findings] == [Level.WARNING] * bool(said)


@pytest.mark.parametrize(
    ("gravity", "first"), [("0, 0, -9.80665", False), ("0, 0, 9.80665", False), ("9.8, 0, 0", True)]
)
def test_the_first_joint_of_an_arm_on_a_wall_gives_too(gravity, first, tmp_path):
    """Its axis lies level and carries the whole arm, and its compliance was held at zero."""
    loads = "\n[sources.loads]\npayload_kg = 30\nlink_kg = [0, 50, 40, 20, 10, 5]\n"
    (tmp_path / "wall.toml").write_text(load_arm("m710ic50").text + loads + f"gravity_m_s2 = [{gravity}]\n")
    arm = arm_to_identify(str(tmp_path / "wall.toml"))
    sources = symbolic_sources(arm.robot, arm.known, np.ones(6, bool), warm=False, facts=arm.facts)
    fitted = {p.name for source in sources for p in source.parameters}
    assert ("compliance.compliance_urad_Nm[1]" in fitted) == first
    assert "compliance.compliance_urad_Nm[2]" in fitted
