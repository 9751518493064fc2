"""Files that say no sigma, side by side: each weighs by its own noise, and a file that fits nothing else is named."""

import re
from dataclasses import replace

import numpy as np
import pytest
from campaign import aligned_error, robot_file
from shipped import quiet
from synthetic import made_up, measured, random_theta

from compgen.core.units import DEG, UM
from compgen.identification.identify import identify, identify_by_files
from compgen.identification.measured_poses import motion_directions
from compgen.identification.measurements import concatenate


@pytest.fixture(scope="module")
def truth(tmp_path_factory):
    return made_up(robot_file(tmp_path_factory.mktemp("noise")), 5)


def file(truth, rng, name, noise, poses=40, zeros=0.0):
    """A file of poses by an instrument of its own; ``zeros``: of an arm whose joints are mastered otherwise [rad]."""
    theta = random_theta(truth.arm.robot, rng, poses)
    data = measured(truth, theta + zeros, rng, noise=noise, name=name)
    return replace(data, theta=theta)


def identified(truth, files):
    """By files, and how often that took an identification."""
    runs = list[int]()

    def rows(data):
        runs.append(1)
        return identify(truth.arm.robot, truth.arm.known, data, len(truth.arm.nodes), quiet, temperatures=False)

    return identify_by_files(rows, concatenate(files)), len(runs)


def left(truth, identification):
    """How far the identified arm is off at poses not seen, by the true one, rms of a coordinate [um]."""
    theta, fitted = random_theta(truth.arm.robot, np.random.default_rng(99), 100), identification.selected.fit
    off = aligned_error(truth, identification.model, fitted.p, fitted.frames, theta, motion_directions(theta))
    return float(np.sqrt((off**2).mean())) / UM


def test_a_bad_instrument_beside_a_good_one_weighs_by_its_own_noise(truth):
    """A tracker of 5 um and a scanner of 100 um, drawn: as far off at poses not seen as where both are said.

    They counted alike, without a finding.
    """
    rng = np.random.default_rng(3)
    files = [file(truth, rng, "tracker", 5 * UM), file(truth, rng, "scanner", 100 * UM)]
    identification, runs = identified(truth, files)
    assert 1 < runs <= 4
    (finding,) = [f for f in identification.findings if f.code == "noises"]
    assert not identification.refused
    assert len(finding.message) <= 300
    noises = re.fullmatch(
        r"scanner.csv is (\S+) um off .*, tracker.csv (\S+): each is weighed by that; .*", finding.message
    )
    assert noises is not None
    scanner, tracker = map(float, noises.groups())
    assert scanner == pytest.approx(100, rel=0.15)
    assert tracker == pytest.approx(5, rel=0.4)  # what the model does not tell of the arm is in it
    with_sigma = [replace(f, stated_sigma=np.full(len(f.pose), s * UM)) for f, s in zip(files, (5, 100), strict=True)]
    known, once = identified(truth, with_sigma)
    assert once == 1
    assert not [f for f in known.findings if f.code == "noises"]
    assert left(truth, identification) < 1.3 * left(truth, known) < 12


def test_alike_instruments_count_alike_as_before(truth):
    rng = np.random.default_rng(4)
    files = [file(truth, rng, "a", 20 * UM, 20), file(truth, rng, "b", 30 * UM, 20), file(truth, rng, "c", 90 * UM, 3)]
    identification, runs = identified(truth, files)  # nine rows tell no noise
    assert runs == 1
    assert not [f for f in identification.findings if f.code == "noises"]
    assert (identification.data.sigma == 1).all()


def test_a_file_of_an_arm_mastered_anew_gets_no_noise_of_its_own(truth):
    """By itself it fits as well as the others: it is no bad instrument's. It is refused as before, and named."""
    rng = np.random.default_rng(5)
    wrong = file(truth, rng, "wrong", 15 * UM, 25, zeros=np.array([0, 0.02, 0.03, 0.03, 0, 0]) * DEG)
    identification, runs = identified(truth, [file(truth, rng, "right", 15 * UM, 80), wrong])
    assert runs > 1
    (finding,) = [f for f in identification.findings if f.code == "noises"]
    assert identification.refused
    assert len(finding.message) <= 300
    assert finding.message.startswith("wrong.csv is ")
    assert "both weigh alike" in finding.message
    by_itself = re.search(r"and (\d+) by itself", finding.message)
    assert by_itself is not None
    assert float(by_itself[1]) < 35
    assert (identification.data.sigma == 1).all()
