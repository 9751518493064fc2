"""The law that a warm-up's log shows stands in the robot file with how well it is known, and the file can be read."""

import tomllib

import numpy as np
import pytest
from shipped import ROOT
from wider_arm import NODES, WiderArm

from compgen.core.finding_codes import Code, Level
from compgen.core.units import HOUR
from compgen.job.uncertainty import quantities_of_cell
from compgen.pipelines.files.robot_file import load_arm, load_cell
from compgen.pipelines.measure.fitted_law import with_law_of
from compgen.pipelines.measure.identification_files import arm_to_identify


def log_of(folder, degC, names=NODES, step=60.0):
    rows = ["time_s," + ",".join(f"{n}_degC" for n in names)]
    rows += [f"{step * n:g}," + ",".join(f"{v:.3f}" for v in row) for n, row in enumerate(degC)]
    (folder / "log.csv").write_text("\n".join(rows) + "\n")
    return str(folder / "log.csv")


@pytest.fixture(scope="module")
def warming():
    time = np.arange(0.0, 6 * HOUR + 1, 60.0)
    return 22 + WiderArm(0).rises(time) + np.random.default_rng(3).normal(0, 0.05, (len(time), 5))


@pytest.fixture(scope="module")
def shipped():
    return load_arm("m710ic50")


def nodes_of(text):
    return {t["name"]: t for t in tomllib.loads(text)["thermal"]["node"]}


def test_the_file_has_the_law_and_how_well_it_is_known(shipped, warming, tmp_path):
    arm = with_law_of(shipped, log_of(tmp_path, warming), "start")
    before, after = nodes_of(shipped.text), nodes_of(arm.text)
    for name in NODES:
        assert before[name].keys() | {"law_K"} == after[name].keys()
        assert 0.49 <= after[name]["law_K"] < 1
        assert after[name]["tau_h"] < before[name]["tau_h"]
        assert after[name]["exponent"] == before[name]["exponent"]
    rest = [{k: v for k, v in tomllib.loads(t).items() if k != "thermal"} for t in (shipped.text, arm.text)]
    assert rest[0] == rest[1]
    assert arm.law is not None
    assert arm.warmth.own is not None
    assert arm.law.tau.tolist() == pytest.approx([HOUR * after[n]["tau_h"] for n in NODES])
    assert arm.warmth.own.tolist() == [after[n]["law_K"] for n in NODES]
    finding = arm.input_findings[-1]
    assert (finding.level, finding.code) == (Level.NOTE, Code.LOG_FITTED)
    assert f"j2 {after['j2']['rise_K']:.1f} +- {after['j2']['law_K']:.1f} K" in finding.message
    assert len(finding.message) < 300 + len(str(tmp_path))


def test_the_band_of_the_temperature_law_is_each_nodes_own(shipped, warming, tmp_path):
    arm = with_law_of(shipped, log_of(tmp_path, warming), "start")
    (tmp_path / "mine.toml").write_text(arm.text)
    quantities = quantities_of_cell(load_cell(str(tmp_path / "mine.toml"))).quantities
    sizes = np.diag([q.cause.heat.rise for q in quantities if q.source == "temperature law"])
    assert sizes.tolist() == [nodes_of(arm.text)[n]["law_K"] for n in NODES]


def test_a_node_without_a_sensor_is_named_and_stays(shipped, warming, tmp_path):
    arm = with_law_of(shipped, log_of(tmp_path, warming[:, :3], NODES[:3]), "start")
    before, after = nodes_of(shipped.text), nodes_of(arm.text)
    for name in NODES[3:]:
        assert after[name]["rise_K"] == before[name]["rise_K"]
        assert "law_K" not in after[name]
    assert "the log does not show wrist, face: rise_K and law_K stay" in arm.input_findings[-1].message
    only = with_law_of(shipped, log_of(tmp_path, warming[:, 2:3], NODES[2:3]), "start")
    assert only.text == shipped.text


def test_sensors_on_other_parts_leave_the_law(shipped, warming, tmp_path):
    exchanged = with_law_of(shipped, log_of(tmp_path, warming[:, [0, 1, 3, 2, 4]]), "start")
    assert exchanged is shipped  # said with the measurements, by the file's own proportions
    steep = 22 + (warming - 22) * [1, 3, 1, 1, 1]
    odd = with_law_of(shipped, log_of(tmp_path, steep), "start")
    assert odd.text == shipped.text
    finding = odd.input_findings[-1]
    assert (finding.level, finding.code) == (Level.WARNING, Code.HELD)
    assert "link1 warms otherwise than any arm" in finding.message


def test_an_arm_that_cools_leaves_the_law(shipped, tmp_path):
    time = np.arange(6 * HOUR, 12 * HOUR + 1, 60.0)
    cooled = with_law_of(shipped, log_of(tmp_path, 22 + WiderArm(1).rises(time)), "22")
    assert cooled.text == shipped.text
    finding = cooled.input_findings[-1]
    assert (finding.level, finding.code) == (Level.WARNING, Code.HELD)
    assert "j2 falls by 12.5 K" in finding.message


def test_a_network_and_an_arm_without_nodes_are_left(warming, tmp_path):
    log = log_of(tmp_path, warming)
    assert with_law_of(load_arm("ur5"), log, "start").text == load_arm("ur5").text
    network = tmp_path / "network.toml"
    network.write_text(
        (ROOT / "robots" / "m710ic50.toml").read_text().replace("[thermal]", '[thermal]\nmodel = "network"')
    )
    assert with_law_of(load_arm(str(network)), log, "start").text == network.read_text()
    own = [arm_to_identify("m710ic50", *given).warmth.of_nodes(-1.0) for given in ((log,), ())]
    assert (own[0] > 0).all()
    assert (own[1] == -1).all()


def test_whatever_a_log_shows_the_file_can_be_read_and_no_value_leaves_its_prior(shipped, tmp_path):
    """Logs that no arm has: a fitted value stays within three of its prior's sigmas, or the file as it was."""
    rng, written = np.random.default_rng(2), 0
    for _ in range(40):
        rows, spread = int(rng.integers(2, 200)), rng.choice([0.2, 1.0])
        size = shipped.law.reference_rise * np.exp(rng.normal(0, spread, 5))
        course = np.linspace(0, 1, rows)[:, None] ** np.exp(rng.normal(0, 2 * spread, 5))
        degC = np.clip(22 + size * course + rng.normal(0, rng.choice([0.01, 3.0]), (rows, 5)), -15, 110)
        log = log_of(tmp_path, degC, step=float(np.exp(rng.uniform(-3, 8))))
        arm = with_law_of(shipped, log, "start")
        assert arm.law is not None
        gain = np.abs(np.log(arm.law.reference_rise / shipped.law.reference_rise))
        lag = np.abs(np.log(arm.law.tau / shipped.law.tau))
        assert (gain <= 3 * 0.25 + 1e-3).all()
        assert (lag <= 3 * np.hypot(0.7, 0.3) + 1e-3).all()
        written += arm.text != shipped.text
    assert 5 < written < 35
