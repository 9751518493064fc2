"""Twist of links, growth of tool and spindle, drift of the fixture: hand formulas, and the twin's own arm."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.units import UM
from compgen.error_model.loads import loads_of
from compgen.error_model.model import build_error_model
from compgen.error_model.schema import LoadsTable
from compgen.error_model.source import ArmFacts
from compgen.error_model.sources.thermal_bend import ThermalBend
from compgen.error_model.sources.thermal_growth import ThermalGrowth
from compgen.error_model.sources.thermal_shift import ThermalShift
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.files.twin_of_job import faults_of
from compgen.verification.twin import Twin

SHIFT = 'sources.thermal_shift={of=["tool", "fixture x"], node=["face", "wrist"], rate_um_K=[2, -1.5]}'
TWIST = (
    'sources.thermal_bend={link=["a2", "d4", "column"], plane=["twist", "twist", "twist"], '
    'node=["link1", "j3", "j2"], rate_arcsec_K=[1.5, -0.7, 0.4]}'
)
DIFFERENCE = (
    'sources.thermal_bend={link=["a2", "a2", "column", "column"], plane=["arm", "arm", "x", "x"], '
    'node=["j2", "j3", "j2", "link1"], rate_arcsec_K=[2, -2, 0.4, 0.3], column_mm=565}'
)
BASE = 'sources.thermal_shift={of=["d1", "base x", "base y"], node=["j2", "link1", "j3"], rate_um_K=[6.4, -0.5, 2]}'
LENGTHS = (
    'sources.thermal_shift={of=["a1", "a3", "d4", "d6"], node=["j2", "j3", "wrist", "face"], '
    "rate_um_K=[1.7, 1.9, 3, 2]}"
)
RISE = np.array([[10.0, 4.0, 12.0, 3.0, 2.0]])
TOOL = Pose(np.array([0.02, -0.01, 0.15]), np.eye(3))
ARCSEC = np.pi / 180 / 3600


def poses(*overrides, kind):
    cell = load_cell("m710ic50", overrides)
    sources = tuple(s for s in cell.sources if isinstance(s, kind))
    assert len(sources) == 1
    model = build_error_model(cell.robot, sources, 5, TOOL)
    theta = np.random.default_rng(2).uniform(-1.2, 1.2, (40, 6)) + cell.robot.pendant_zero
    twin = Twin(robot=cell.robot, heat=cell.heat, profiles=(), tool=TOOL, faults=faults_of(sources))
    rise = np.repeat(RISE, 40, axis=0)
    return model.nominal_pose(theta), model.actual_pose(theta, rise), twin.actual_pose(theta, rise, lambda share: None)


@pytest.mark.parametrize(
    ("override", "kind"),
    [
        (SHIFT, ThermalShift),
        (BASE, ThermalShift),
        (LENGTHS, ThermalShift),
        (TWIST, ThermalBend),
        (DIFFERENCE, ThermalBend),
    ],
)
def test_the_twins_own_arm_agrees(override, kind):
    nominal, actual, twin = poses(override, kind=kind)
    assert_allclose(actual.position, twin.position, atol=1e-10)  # m
    assert_allclose(actual.rotation, twin.rotation, atol=1e-10)
    assert np.linalg.norm(actual.position - nominal.position, axis=1).min() > 1 * UM


def test_a_tool_grows_along_its_axis_and_a_fixture_drifts_away_from_it():
    nominal, actual, _ = poses(SHIFT, kind=ThermalShift)
    expected = 2 * UM * 2.0 * nominal.rotation[:, :, 2] + np.array([1.5 * UM * 3.0, 0, 0])
    assert_allclose(actual.position - nominal.position, expected, atol=1e-12)
    assert_allclose(actual.rotation, nominal.rotation, atol=1e-14)


def test_a_column_lifts_the_arm_and_a_base_moves_it():
    nominal, actual, _ = poses(BASE, kind=ThermalShift)
    assert_allclose(
        actual.position - nominal.position, np.tile([-0.5 * UM * 4, 2 * UM * 12, 6.4 * UM * 10], (40, 1)), atol=1e-12
    )


def test_links_without_a_profile_grow_along_themselves_away_from_zero():
    """At the pendant's zero: the shoulder lies ahead, the elbow's offset upwards, the forearm and the flange ahead."""
    cell = load_cell("m710ic50", [LENGTHS])
    (source,) = (s for s in cell.sources if isinstance(s, ThermalShift))
    model = build_error_model(cell.robot, [source], 5, Pose(np.zeros(3), np.eye(3)))
    zero = cell.robot.pendant_zero[None]
    moved = model.actual_pose(zero, RISE).position - model.nominal_pose(zero).position
    assert_allclose(moved, [[(1.7 * 10 + 3 * 3 + 2 * 2) * UM, 0, 1.9 * 12 * UM]], atol=1e-12)


def test_what_identification_offers_is_what_the_file_has_and_every_other_term_once():
    cell = load_cell("m710ic50", [LENGTHS, TWIST])
    growth = cell.sources[0]
    assert isinstance(growth, ThermalGrowth)
    arm = ArmFacts(cell.robot, cell.heat.names, (growth.a, growth.d), loads_of(LoadsTable(), cell.robot))
    shift = next(s for s in cell.sources if isinstance(s, ThermalShift))
    bend = next(s for s in cell.sources if isinstance(s, ThermalBend))
    more, prior = shift.extended(arm, ("j2", "wrist"))
    pairs = [*zip(more.of, more.node_name, strict=True)]
    assert pairs[:4] == [*zip(shift.of, shift.node_name, strict=True)]
    assert len(pairs) == len(set(pairs)) == 4 + len(prior["rate"])
    assert {("d1", "wrist"), ("base x", "j2"), ("a3", "j2")} < set(pairs)
    assert ("a2", "j2") not in pairs  # a profile heats it
    assert_allclose(prior["rate"][pairs.index(("a3", "j2")) - 4], 11.5e-6 * 0.17)
    bent, prior = bend.extended(arm, ("j2",))
    triples = [*zip(bent.link, bent.plane, bent.node_name, strict=True)]
    assert {("a3", "side", "j2"), ("column", "twist", "j2"), ("d4", "arm", "j2"), ("a2", "twist", "link1")} < set(
        triples
    )
    assert len(triples) == len(set(triples)) == 3 + 14
    assert_allclose(bent.rate, [*bend.rate, *14 * [0]])
    kept = bent.only(np.arange(17) % 2 == 0)
    assert kept.link == bent.link[::2]
    assert_allclose(kept.axis, bent.axis[::2])


def test_a_twisted_column_turns_the_arm_about_the_vertical():
    alone = 'sources.thermal_bend={link=["column"], plane=["twist"], node=["j2"], rate_arcsec_K=[0.4]}'
    nominal, actual, _ = poses(alone, kind=ThermalBend)
    turn = np.cross([0, 0, 10 * 0.4 * ARCSEC], nominal.position)
    assert_allclose(actual.position - nominal.position, turn, atol=1e-9)
    assert_allclose((actual.position - nominal.position)[:, 2], 0, atol=1e-12)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ('sources.thermal_shift={of=["tool"], node=["nose"], rate_um_K=[2]}', ("node.0", "nose")),
        ('sources.thermal_shift={of=["tool"], node=["face"], rate_um_K=[2, 3]}', ("rate_um_K", "2 entries for 1")),
        ('sources.thermal_shift={of=["d5"], node=["face"], rate_um_K=[2]}', ("of.0", "d4")),
        ('sources.thermal_shift={of=["table"], node=["face"], rate_um_K=[2]}', ("of.0", "fixture x")),
    ],
)
def test_what_is_wrong_is_said(override, words):
    with pytest.raises(InputError) as refusal:
        load_cell("m710ic50", [override])
    assert all(w in str(refusal.value) for w in words), refusal.value
