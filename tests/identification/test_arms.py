"""An arm of a wider family than the model: identified from cold and warm measurements, judged on poses never seen."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from arms import Site, campaign_files, flown, identify_arm, judged_parameters, robot_file
from shipped import ROOT, quiet
from synthetic import PRISM
from wider_arm import NODES

from compgen.core.finding_codes import Level
from compgen.identification.fit import fit
from compgen.identification.identify import identify
from compgen.identification.log_readings import GAIN, exchanged_sensors, log_evidence, log_findings, moved_clocks
from compgen.identification.measurements import Measurements, plain_ends
from compgen.identification.model import active_in_groups
from compgen.identification.warm_up import CLOCK_SHIFTS
from compgen.pipelines.files.robot_file import arm_of, load_arm
from compgen.pipelines.measure.fitted_law import with_law_of
from compgen.pipelines.measure.identification_files import MeasurementFiles, identified_robot_text, read_measurements
from compgen.robot.kinematics import flange_pose

SEED = 0  # its column bends with one node, its links with another and with a difference


@pytest.fixture(scope="module")
def identified(tmp_path_factory):
    """The true arm, what was found, and the robot file that says it."""
    folder = tmp_path_factory.mktemp("arms")
    nominal = load_arm(robot_file(folder))
    site = Site(SEED, nominal.robot)
    cold, warm, log = campaign_files(site, SEED, folder, NODES)
    nominal = with_law_of(nominal, log, "start")
    data, _ = read_measurements(nominal, MeasurementFiles(poses=[cold], warm_up=[warm], log=log), force=False)
    result = identify_arm(nominal, data, True)
    text = identified_robot_text(nominal, result, [cold, warm, log])
    return site, result, arm_of(tomllib.loads(text), text, "identified.toml")


def test_cold_and_hot_poses_never_seen_are_predicted(identified):
    site, result, arm = identified
    assert not result.refused
    reached = flown(site, SEED, arm, result)
    assert reached["cold"] < 1.3
    assert reached["hot"] < 1.6
    for name in ("drift_2h", "drift_6h", "drift_cooled"):
        rms, p99, before = reached[name]
        assert rms < 12
        assert p99 < 20
        assert before > 40


def test_thermal_values_lie_within_three_of_their_sigmas_and_of_their_priors(identified):
    site, result, arm = identified
    judged = judged_parameters(site.arm, arm, result)
    assert len(judged["thermal"]) >= 5
    assert np.mean(np.abs(list(judged["thermal"].values())) <= 3) >= 0.95
    assert judged["prior"] <= 3
    assert judged["inside"] >= 0.85 * judged["counted"]


def test_a_bend_that_no_table_names_is_found_and_written(identified):
    site, _, arm = identified
    assert "[sources.thermal_bend]" in arm.text
    bend = next(k.source for k in arm.known if k.source.NAME == "thermal_bend")
    rise = site.arm.rises(np.array([6 * 3600.0]))[0]
    true = sum(rate * rise @ state for link, plane, rate, state in site.arm.bends if (link, plane) == ("column", "x"))
    terms = [k for k, term in enumerate(zip(bend.link, bend.plane, strict=True)) if term == ("column", "x")]
    assert abs(true) > 50e-6  # rad
    assert bend.rate[terms] @ rise[bend.node[terms]] == pytest.approx(true, rel=0.4)


def test_loads_alone_let_compliance_be_found(identified):
    _, _, arm = identified
    assert any(k.source.NAME == "compliance" and k.sigma for k in arm.known)


def test_files_of_one_setup_have_one_frame(identified):
    _, result, _ = identified
    assert len(result.data.instruments) == 1
    assert any(f.code == "setup" and "one setup" in f.message for f in result.findings)


def misread_log(result, shift):
    """The measurements as they would be with the log's clock that much ahead of theirs [s], and all terms fitted."""
    wrong = result.data.shifted[CLOCK_SHIFTS.tolist().index(shift)]
    others = np.repeat(wrong[None], len(CLOCK_SHIFTS), axis=0)
    others[CLOCK_SHIFTS.tolist().index(-shift)] = result.data.rise
    data = replace(result.data, rise=wrong, shifted=others)
    active = active_in_groups(result.model, result.selected.candidate.groups)
    return data, fit(result.model, data, active)


def test_a_log_on_the_poses_clock_is_not_suspected(identified):
    _, result, _ = identified
    assert not {"log.clock", "log.swapped"} & {f.code for f in result.findings}
    active = active_in_groups(result.model, result.selected.candidate.groups)
    fitted = fit(result.model, result.data, active)
    as_it_stands = log_evidence(result.model, result.data, fitted)
    for rise, words in (*moved_clocks(result.data), *exchanged_sensors(result.data, NODES)):
        assert log_evidence(result.model, replace(result.data, rise=rise), fitted) - as_it_stands < GAIN / 3, words


@pytest.mark.parametrize(("shift", "side"), [(3600.0, "behind"), (-3600.0, "ahead of")])
def test_a_log_on_a_clock_an_hour_off_is_refused(identified, shift, side):
    """Within the poses' times, so that nothing but the poses can tell."""
    _, result, _ = identified
    data, fitted = misread_log(result, shift)
    (finding,) = log_findings(result.model, data, fitted, NODES)
    assert finding.level is Level.REFUSED
    assert finding.code == "log.clock"
    assert f"60 min {side} theirs" in finding.message
    assert "3600 s" in finding.message


def test_an_arm_without_a_heat_model_gets_a_plain_warmth(tmp_path):
    """A forearm that grows by 60 um in a warm-up of an arm that has no [thermal]: the cold parameters stay clean."""
    arm = load_arm(str(ROOT / "robots" / "irb120.toml"))
    rng = np.random.default_rng(3)
    theta = arm.robot.to_theta(rng.uniform(-0.8, 0.8, (90, 6)) + 0.9 * (np.arange(6) == 4))
    warm = np.where(np.arange(90) < 40, 0.0, (np.arange(90) - 39) * 400.0)
    grown = 60e-6 * (1 - np.exp(-warm / 7000))
    flange = flange_pose(arm.robot, theta)
    longer = flange_pose(replace(arm.robot, d=arm.robot.d + 1e-3 * (np.arange(6) == 3)), theta)
    place = flange.position + (longer.position - flange.position) * grown[:, None] / 1e-3
    pose = np.repeat(np.arange(90), 3)
    position = place[pose] + np.einsum("nij,nj->ni", flange.rotation[pose], np.tile(PRISM, (90, 1)))
    data = Measurements(
        theta=theta,
        rise=np.zeros((90, 0)),
        lag=np.zeros((90, 0)),
        direction=np.zeros((90, 6)),
        time=np.arange(90.0),
        warm=warm,
        pose=pose,
        instrument=np.zeros(270, int),
        reflector=np.tile(np.arange(3), 90),
        ends=plain_ends(270),
        position=position + rng.normal(0, 10e-6, position.shape),
        rotation=np.full((270, 3, 3), np.nan),
        sigma=np.ones(270),
        label=tuple(f"warm.csv: line {i}" for i in range(270)),
        reflectors=("a", "b", "c"),
        instruments=("warm.csv",),
        aligned=np.array([False]),
    )
    result = identify(arm.robot, arm.known, data, 0, quiet, temperatures=False, facts=arm.facts)
    assert result.selected.fit.noise < 12e-6  # without the growth 17 um
    notes = [f for f in result.findings if f.code == "warm_up"]
    assert len(notes) == 1
    assert notes[0].level is Level.NOTE
    assert "[thermal]" in notes[0].message
    assert not any(k.source.NAME.startswith("thermal") and k.sigma for k in result.known)
