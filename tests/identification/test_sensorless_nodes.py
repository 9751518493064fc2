"""A node without a sensor: a factor and a lag of what the others' heat says, fitted along and written."""

import tomllib
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from campaign import SOURCES
from flawed import flawed_file
from numpy.testing import assert_allclose
from shipped import ROOT
from synthetic import made_up, warming

from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Level
from compgen.error_model.posterior import known_numbers
from compgen.error_model.sources.joint_zeros import JointZeros
from compgen.error_model.uncertain_sources import UncertainSource
from compgen.identification.fit import fit
from compgen.identification.identified_robot_file import (
    posterior_of,
    sensorless_findings,
    sensorless_nodes,
    with_sensorless_nodes,
)
from compgen.identification.model import build_model, fixed_source
from compgen.identification.parameters import symbolic_sources
from compgen.pipelines.files.robot_file import arm_of
from compgen.pipelines.measure.identification_files import identified_robot_text
from compgen.thermal.filled_rises import fill_rises
from compgen.thermal.state_from_log import TemperatureLog

HIGH = 1.4  # times what the file's proportions say
NODE = 2  # the middle joint


@pytest.fixture(scope="module")
def truth(tmp_path_factory):
    return made_up(flawed_file(tmp_path_factory.mktemp("arm"), "nominal", SOURCES), 5)


@pytest.fixture(scope="module")
def warm(truth):
    """A warm-up with sensors on all nodes but one, which warms more than its share."""
    rng = np.random.default_rng(4)
    heat = truth.arm.heat
    proportions = heat.reference_rise * np.where(np.arange(5) == NODE, HIGH, 1.0)
    data, _ = warming(truth, rng, count=60, tau=(2.0,) * 5, final=tuple(proportions))
    names = [n for k, n in enumerate(heat.names) if k != NODE]
    log = TemperatureLog(data.time, np.zeros(len(data.time)), {n: data.rise[:, heat.names.index(n)] for n in names})
    logged = fill_rises(log, heat, data.time, cold=True)
    return replace(data, rise=logged.rise, lag=logged.lag, modelled=(NODE,)), data.rise


def test_the_course_without_a_sensor_is_the_others_in_the_files_proportions(warm):
    data, true_rise = warm
    others = [k for k in range(5) if k != NODE]
    assert_allclose(data.rise[:, others], true_rise[:, others], atol=1e-9)
    assert_allclose(data.rise[-1, NODE], true_rise[-1, NODE] / HIGH, rtol=0.15)


def test_without_temperatures_a_node_warms_to_a_share_of_8_k_with_a_time_constant_about_2_h(truth):
    """8 K (1 + y) (1 - exp(-t / (2 h e^x))): the arm stands where it does at that rise."""
    arm = truth.arm
    sources = [fixed_source(known.source) for known in arm.known]
    hours, x, y = np.array([0.0, 1.0, 5.0, 40.0]), 0.3, -0.25
    M = len(hours)
    data: Any = SimpleNamespace(
        theta=np.tile(arm.robot.pendant_zero, (M, 1)) + 0.2,
        rise=np.zeros((M, 5)),
        lag=np.zeros((M, 5)),
        direction=np.zeros((M, 6)),
        warm=3600 * hours,
    )
    model = build_model(arm.robot, sources, 5, (NODE,))
    assert [t.field for t in model.parameters] == ["log_tau", "rise"]
    position, _ = model.pose(data, np.array([x, y]))
    data.rise[:, NODE] = 8 * (1 + y) * (1 - np.exp(-hours / (2 * np.exp(x))))
    expected, _ = build_model(arm.robot, sources, 5).pose(data, np.zeros(0))
    assert_allclose(position, expected, atol=1e-12)
    assert np.linalg.norm(position[-1] - position[0]) > 20e-6


def test_its_height_is_fitted_along_and_written(truth, warm):
    data, true_rise = warm
    arm = truth.arm
    rng = np.random.default_rng(5)
    sources = symbolic_sources(arm.robot, arm.known, np.ones(6, bool), warm=True)
    model = build_model(arm.robot, sources, 5, (), data.modelled)
    assert sum(t.source == "warm_up" for t in model.parameters) == 2
    # the arm's own values are known here, but for the node's: what is left is its height
    value = {t.name: v for t, v in zip(truth.model.parameters, truth.p, strict=True)}
    p = np.array([value.get(t.name, 0.0) for t in model.parameters])
    known = replace(
        data, position=truth.noiseless(replace(data, rise=true_rise)) + rng.normal(0, 2e-6, data.position.shape)
    )
    active = np.array([t.source == "warm_up" for t in model.parameters])
    position, _ = model.pose(known, p)
    shifted = model.pose(replace(known), np.where(active, 0.3, p))
    assert np.abs(shifted[0] - position).max() > 5e-6  # the set-up bites
    only = fixed_at(model, p, active)
    fitted = fit(only, known, np.ones(2, bool), robust=False, learn=False, noise=2e-6)
    node = sensorless_nodes(only, fitted, arm.nodes)[0]
    assert node.name == "j3"
    assert node.is_known
    modelled = known.rise[-1, NODE] + np.log(node.lag) * known.lag[-1, NODE]
    assert node.height * modelled == pytest.approx(true_rise[-1, NODE], rel=0.1)
    text = with_sensorless_nodes(arm.text, [node])
    before, after = (tomllib.loads(t)["thermal"]["node"] for t in (arm.text, text))
    assert after[NODE]["rise_K"] == pytest.approx(before[NODE]["rise_K"] * node.height, rel=1e-3)
    assert [n for k, n in enumerate(after) if k != NODE] == [n for k, n in enumerate(before) if k != NODE]
    assert "j3 has no sensor" in next(sensorless_findings([node], is_written=True)).message


@pytest.mark.parametrize(("height", "lag"), [(0.0, 10.0), (30.0, 0.0)])
def test_what_no_node_can_be_is_not_written(truth, warm, height, lag):
    arm, (data, _) = truth.arm, warm
    model = build_model(
        arm.robot, symbolic_sources(arm.robot, arm.known, np.ones(6, bool), warm=True), 5, (), data.modelled
    )
    values = {"height": height, "lag": lag}
    p = np.array([values.get(t.field, 0.0) if t.source == "warm_up" else 0.0 for t in model.parameters])
    everything = np.ones(len(p), dtype=bool)
    fitted: Any = SimpleNamespace(p=p, active=everything, sigma=model.prior, gamma=np.ones(len(p)))
    nodes = sensorless_nodes(model, fitted, arm.nodes)
    assert not nodes[0].is_known
    (finding,) = sensorless_findings(nodes, is_written=True)
    assert finding.level is Level.WARNING
    assert "j3 has no sensor" in finding.message
    assert "the log does not show it" in finding.message
    assert with_sensorless_nodes(arm.text, nodes) == arm.text


def test_what_is_known_of_a_nodes_numbers_is_how_they_move_with_what_was_fitted(truth, warm):
    """By finite differences of the written numbers."""
    arm, (data, _) = truth.arm, warm
    model = build_model(
        arm.robot, symbolic_sources(arm.robot, arm.known, np.ones(6, bool), warm=True), 5, (), data.modelled
    )
    of_node = {t.field: k for k, t in enumerate(model.parameters) if t.source == "warm_up"}
    everything = np.ones(len(model.parameters), bool)

    def numbers(**fitted_values):
        p = np.zeros(len(model.parameters))
        p[[of_node[field] for field in fitted_values]] = list(fitted_values.values())
        fitted: Any = SimpleNamespace(p=p, active=everything, sigma=model.prior, gamma=np.ones(len(p)))
        text = with_sensorless_nodes(arm.text, sensorless_nodes(model, fitted, arm.nodes))
        node = tomllib.loads(text)["thermal"]["node"][NODE]
        return p, np.array([node["rise_K"], node["tau_h"] * 3600.0])

    p, (rise, tau) = numbers(height=0.3, lag=-0.2)
    per_height = (numbers(height=0.4, lag=-0.2)[1] - numbers(height=0.2, lag=-0.2)[1])[0] / 0.2
    per_lag = (numbers(height=0.3, lag=-0.1)[1] - numbers(height=0.3, lag=-0.3)[1])[1] / 0.2
    law = [np.where(np.arange(5) == NODE, value, 1.0) for value in (rise, tau)]
    fit_: Any = SimpleNamespace(p=p, active=everything, posterior=SimpleNamespace(covariance=np.eye(len(p))))
    identified: Any = SimpleNamespace(
        selected=SimpleNamespace(fit=fit_), model=model, known=(), robot=arm.robot, lost_motion=None
    )
    posterior = posterior_of(identified, known_numbers((), *law), frozenset({NODE}))
    assert [known.name for known in posterior.parameters] == ["thermal.node.rise_K[3]", "thermal.node.tau_h[3]"]
    sigma = np.sqrt(np.diag(posterior.covariance))
    expected = model.prior[[of_node["height"], of_node["lag"]]] * [per_height, per_lag]
    assert_allclose(sigma, expected, rtol=0.01)


def test_whatever_is_fitted_of_a_node_its_file_can_be_read_again(truth, warm):
    """Heights and time constants far beyond their priors, to either side: what is written is what a node can be."""
    arm, (data, _) = truth.arm, warm
    model = build_model(
        arm.robot, symbolic_sources(arm.robot, arm.known, np.ones(6, bool), warm=True), 5, (), data.modelled
    )
    scale = np.array([model.prior[k] if t.source == "warm_up" else 0.0 for k, t in enumerate(model.parameters)])
    rng, written = np.random.default_rng(11), 0
    for spread in (0.3, 1.0, 3.0, 10.0) * 10:
        p = scale * rng.normal(0, spread, len(scale))
        fitted: Any = SimpleNamespace(p=p, active=np.ones(len(p), bool), sigma=model.prior, gamma=np.ones(len(p)))
        text = with_sensorless_nodes(arm.text, sensorless_nodes(model, fitted, arm.nodes))
        again = arm_of(tomllib.loads(text), text, "written")
        assert again.law is not None
        assert (again.law.reference_rise > 0).all()
        written += text != arm.text
    assert 10 < written < 40


def test_a_value_that_no_file_may_have_is_said_of_the_measurements(truth):
    """A zero of 20 deg: the robot file was right."""
    arm = truth.arm
    wild = UncertainSource(JointZeros(np.full(6, 0.35)), {}, {"offset": np.full(6, 1e-5)}, "")
    identified: Any = SimpleNamespace(
        data=SimpleNamespace(theta=np.zeros((3, 6))), selected=SimpleNamespace(candidate=SimpleNamespace(name="zeros")),
        known=[wild], box=np.zeros((6, 2)), record=lambda: {"reflector_mm": {}},
    )  # fmt: skip
    measured = ROOT / "robots" / "m710ic50_temperatures.csv"  # any file
    with pytest.raises(InputError, match=r"^what was fitted to m710ic50_temperatures\.csv: .*offset_mdeg") as refusal:
        identified_robot_text(replace(arm, heat=None), identified, [str(measured)])
    assert arm.source not in str(refusal.value)


def fixed_at(model, p, active):
    """The model with all parameters but some held at values."""
    import casadi as ca

    inputs, position, rotation, jacobian = model.expressions
    rows = np.flatnonzero(active).tolist()
    free = ca.SX.sym("free", len(rows))
    whole = ca.SX(ca.DM(p))
    for n, k in enumerate(rows):
        whole[k] = free[n]
    outputs = ca.substitute([position, rotation, jacobian[:, rows]], [inputs[-1]], [whole])
    arguments = [*inputs[:-1], free]
    return replace(
        model,
        parameters=tuple(t for t, flag in zip(model.parameters, active, strict=True) if flag),
        flange=ca.Function("flange", arguments, outputs[:2]),
        expressions=(arguments, *outputs),
    )
