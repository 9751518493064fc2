"""Poses at which joints came from nobody knows where: play there is no fault of the arm, and what is more is."""

from dataclasses import replace

import numpy as np
import pytest
from shipped import quiet
from synthetic import random_theta

from compgen.core.finding_codes import Code, Level
from compgen.core.units import DEG, MDEG, MM, UM
from compgen.identification.identify import identify
from compgen.identification.measured_poses import read_poses
from compgen.identification.measurements import blank_rows
from compgen.identification.validation import reach_of_few, validate
from compgen.pipelines.files.robot_file import load_arm
from compgen.robot.kinematics import flange_pose

BACKLASH = np.array([10, 8, 7, 10, 10, 10]) * MDEG
REFLECTORS = np.array([[0.06, 0, 0.12], [-0.04, 0.05, 0.09], [0.01, -0.07, 0.11]])
NAMES = ("j1_deg", "j2_deg", "j3_deg", "j4_deg", "j5_deg", "j6_deg", "x_mm", "y_mm", "z_mm")


@pytest.fixture(scope="module")
def arm():
    return load_arm("m710ic50")


def measured(folder, arm, keep, push=0.0, backlash=BACKLASH):
    """Poses driven by an arm with play, of which some were measured: its side at the first is anyone's guess."""
    rng = np.random.default_rng(4)
    theta = random_theta(arm.robot, rng, 60)
    sides = np.vstack([np.sign(rng.normal(size=6)), np.sign(np.diff(theta, axis=0))])
    flange = flange_pose(arm.robot, theta - sides * backlash)
    places = flange.position[:, None] + np.einsum("nij,rj->nri", flange.rotation, REFLECTORS)
    places += rng.normal(0, 20 * UM, places.shape)
    lines = [",".join(("order", "target", *NAMES))]
    for n in keep:
        for r, place in enumerate(places[n] + push):
            numbers = (*arm.robot.to_pendant(theta[n]) / DEG, *place / MM)
            lines.append(",".join((str(n), f"r{r}", *(f"{v:.6f}" for v in numbers))))
    file = folder / "poses.csv"
    file.write_text("\n".join(lines) + "\n")
    return read_poses(str(file), arm.robot, len(arm.nodes), force=True, frames_known=True)


@pytest.fixture(scope="module")
def identification(arm, tmp_path_factory):
    keep = np.setdiff1d(np.arange(60), [5, 12, 20, 33, 41, 52])
    data = measured(tmp_path_factory.mktemp("gaps"), arm, keep)
    return identify(arm.robot, arm.known, data, len(arm.nodes), quiet, temperatures=False)


def test_gaps_in_the_order_of_an_arm_with_play_are_no_ground_to_refuse(identification):
    assert not [f.message for f in identification.findings if f.level is Level.REFUSED]
    (finding,) = [f for f in identification.findings if f.code is Code.UNKNOWN_SIDES]
    assert len(finding.message) <= 300
    rows = 3 * 54 - len(identification.data.pose)
    assert finding.message.startswith(f"{rows} rows do not count")
    assert 15 <= rows <= 21  # the first pose and six gaps
    model, fitted = identification.model, identification.selected.fit
    backlash = [p for t, p in zip(model.parameters, fitted.p, strict=True) if t.field == "backlash"]
    assert np.abs(np.array(backlash) - BACKLASH).max() < 1.5 * MDEG


def test_without_play_every_row_counts(arm, tmp_path):
    data = measured(tmp_path, arm, np.setdiff1d(np.arange(60), [5, 12, 20]), backlash=np.zeros(6))
    identified = identify(arm.robot, arm.known, data, len(arm.nodes), quiet, temperatures=False)
    assert len(identified.data.pose) == len(data.pose)
    assert not [f for f in identified.findings if f.code is Code.UNKNOWN_SIDES]


def test_a_single_pose_of_the_true_arm_is_inside_and_another_is_not(identification, arm, tmp_path):
    frames = identification.selected.fit.frames
    frames = replace(frames, origin=frames.origin[:1], rotation=frames.rotation[:1])

    def check(push):
        one = measured(tmp_path, arm, [30], push)
        return validate(arm.robot, identification.known, one, len(arm.nodes), frames, bound=60 * UM)

    right, wrong = check(0.0), check(1 * MM)
    assert right.identified.max() > 60 * UM
    assert {f.code for f in right.findings} & {Code.BOUNDS_MAX_UM, Code.UNKNOWN_SIDES} == {Code.UNKNOWN_SIDES}
    assert Code.BOUNDS_MAX_UM in {f.code for f in wrong.findings}


def test_play_excuses_the_rows_of_one_pose_and_no_file_in_which_most_sides_are_unknown():
    data = blank_rows(np.zeros((40, 6)), np.repeat(np.arange(40), 3), 120 * [""], 0)
    of_first, of_all = np.where(np.arange(120) < 3, 1e-4, 0.0), np.full(120, 1e-4)
    assert (reach_of_few(data, of_first) == of_first).all()
    assert not reach_of_few(data, of_all).any()
    one_pose = blank_rows(np.zeros((1, 6)), np.zeros(3, dtype=int), 3 * [""], 0)
    assert reach_of_few(one_pose, of_all[:3]).all()
