"""What a verdict rests on: how much may be set aside, and when weak frames are no ground to refuse."""

from dataclasses import replace

import numpy as np
import pytest
from campaign import robot_file
from shipped import quiet
from synthetic import axis_lines, made_up, measured, random_theta

from compgen.core.finding_codes import Level
from compgen.core.units import DEG, MM
from compgen.error_model.sources.compliance import JointCompliance
from compgen.identification.cross_validation import CrossValidation, improvement_interval
from compgen.identification.fit import fit
from compgen.identification.identify import identify
from compgen.identification.measurements import DISTANCE, TOUCH, concatenate
from compgen.identification.verdict import (
    left_findings,
    poses_to_add,
    refuse_foreign_lengths,
    refuse_set_aside,
    turned_back,
)
from compgen.report.identification import identification_summary, limits_sentence


@pytest.fixture(scope="module")
def truth(tmp_path_factory):
    return made_up(robot_file(tmp_path_factory.mktemp("verdict")), 5)


def series(robot):
    """Each joint alone from one pose, 18 poses a joint."""
    base = np.array([0, 10, -15, 30, -60, 20]) * DEG
    steps = np.linspace(-25, 25, 18) * DEG
    alone = [base + step * (np.arange(6) == k) for k in range(6) for step in steps]
    return robot.to_theta(np.array([base, *alone]))


def test_a_fit_that_leaves_out_a_whole_series_is_refused(truth):
    """J2's series is off by some centimetres: a sixth of the rows, which robust weights would set aside."""
    rng = np.random.default_rng(6)
    data = measured(truth, series(truth.arm.robot), rng, reflectors=2)
    pose = np.arange(len(data.theta))
    pushed = ((pose > 18) & (pose <= 36))[data.pose]
    data = replace(data, position=data.position + pushed[:, None] * rng.normal(0, 30 * MM, data.position.shape))
    fitted = fit(truth.model, data, np.array([t.source == "joint_zeros" for t in truth.model.parameters]))
    assert fitted.outlier[pushed].mean() > 0.5
    (finding,) = refuse_set_aside(data, fitted)
    assert "5 % may be wild" in finding.message
    assert len(finding.message) <= 300
    of_series = replace(fitted, outlier=pushed & (np.cumsum(pushed) <= 9))  # 4 % of all rows
    (finding,) = refuse_set_aside(data, of_series)
    assert "J2" in finding.message


def test_stations_behind_the_turn_of_a_line_are_told_apart_from_what_moved(truth):
    """Play of 100 um that is not run through at the first station of each way: *did a reflector move* was said."""
    rng = np.random.default_rng(7)
    lines = axis_lines(truth, rng, 5e-6)  # 13 stations a way
    assert np.flatnonzero(turned_back(lines)).tolist() == [n for n in range(234) if n % 13 < 3]
    poses = measured(truth, random_theta(truth.arm.robot, rng, 30), rng, noise=5e-6)
    lines = replace(lines, position=lines.position + 1e-4 * (np.arange(234) % 13 == 0)[:, None])
    data = concatenate([poses, lines])
    assert not turned_back(data)[:90].any()
    fitted = fit(truth.model, data, np.ones(len(truth.model.parameters), dtype=bool))
    first = np.append(np.zeros(90, dtype=bool), np.arange(234) % 13 == 0)
    (finding,) = refuse_set_aside(data, replace(fitted, outlier=first))
    assert "18 are stations of a line just behind where it turned back" in finding.message
    assert "drive some mm beyond each end" in finding.message
    assert len(finding.message) <= 300
    (finding,) = refuse_set_aside(data, replace(fitted, outlier=np.arange(324) < 18))
    assert "did a reflector or the instrument move" in finding.message


def test_a_few_wild_rows_are_no_ground_to_refuse(truth):
    rng = np.random.default_rng(8)
    data = measured(truth, random_theta(truth.arm.robot, rng, 40), rng)
    position = data.position.copy()
    position[[3, 50]] += 2 * MM
    fitted = fit(truth.model, replace(data, position=position), np.ones(len(truth.model.parameters), dtype=bool))
    assert fitted.outlier.sum() >= 2
    assert refuse_set_aside(data, fitted) == []


def test_a_length_of_another_robot_is_named_and_refused(truth):
    """The file's a1 and a3 are exchanged, 20 mm apart: a fit explains it all, and no arm is so far off its figures."""
    rng = np.random.default_rng(9)
    data = measured(truth, random_theta(truth.arm.robot, rng, 40), rng)
    fitted = fit(truth.model, data, np.array([t.source == "link_offsets" for t in truth.model.parameters]))
    assert not [*refuse_foreign_lengths(truth.arm.robot, truth.model, fitted)]
    name = [(t.source, t.field, t.index) for t in truth.model.parameters]
    p = fitted.p.copy()
    p[name.index(("link_offsets", "a", (0,)))], p[name.index(("link_offsets", "a", (2,)))] = 20 * MM, -20 * MM
    (finding,) = refuse_foreign_lengths(truth.arm.robot, truth.model, replace(fitted, p=p))
    assert finding.level is Level.REFUSED
    assert "a1 fits 170.0 mm, where the robot file has 150.0" in finding.message
    assert "a3 fits 150.0 mm" in finding.message


def test_the_held_out_error_counts_in_rows_set_aside_and_comparisons_limit_each():
    block = np.repeat(np.arange(50), 2)
    distance = np.full(100, 50e-6)
    distance[7] = 5e-3
    validation = CrossValidation(distance, block)
    assert validation.mean == pytest.approx(99.5e-6)
    assert validation.robust_mean == pytest.approx((99 * 50e-6 + 250e-6) / 100)
    worse = CrossValidation(2 * distance, block)
    low, high = improvement_interval(validation, worse)
    assert 40e-6 < low < high < 60e-6


def test_a_coupling_that_the_arm_has_not_is_refused_however_much_it_gains(truth):
    """A robot file whose joint 6 turns with joint 5: centimetres wrong, yet better than the nominal arm."""
    rng = np.random.default_rng(9)
    data = measured(truth, random_theta(truth.arm.robot, rng, 40), rng, reflectors=2)
    theta = data.theta.copy()
    theta[:, 5] += data.theta[:, 4]
    wrong = identify(
        truth.arm.robot,
        truth.arm.known,
        replace(data, theta=theta),
        len(truth.arm.nodes),
        quiet,
        temperatures=False,
    )
    (finding,) = [f for f in wrong.findings if f.code == "unexplained"]
    assert wrong.refused
    assert "coupled joints" in finding.message
    right = identify(truth.arm.robot, truth.arm.known, data, len(truth.arm.nodes), quiet, temperatures=False)
    assert not right.refused
    assert "the flange is known to +- " in limits_sentence(identification_summary(right))
    plain = identification_summary(replace(right, best=0))  # where nothing of the arm is fitted, nothing is known of it
    assert plain["known_um"] is None
    assert "known to" not in limits_sentence(plain)


def test_an_instrument_that_is_said_to_be_as_bad_explains_what_is_left(truth):
    """Of a scanner of 100 um, and of one beside a tracker of 10 um: *the arm does what the model has not* was said."""
    rng = np.random.default_rng(9)
    data = measured(truth, random_theta(truth.arm.robot, rng, 40), rng)
    N, none = len(data.pose), np.zeros(len(data.pose), dtype=bool)
    stated = np.full(N, 1e-4)
    distance = 1e-4 * np.sqrt(3) * np.ones(N)
    assert [*left_findings(data, distance, none, None, [])]
    assert not [*left_findings(replace(data, stated_sigma=stated), distance, none, None, [])]
    stated[::2] = 1e-5
    both = replace(data, stated_sigma=stated, sigma=stated / np.median(stated))
    assert not [*left_findings(both, np.sqrt(3) * stated, none, None, [])]
    unstated = replace(both, stated_sigma=None)  # by their own rows: 14 um where the better file counts
    assert not [*left_findings(unstated, np.sqrt(3) * stated, none, None, [])]
    (finding,) = left_findings(unstated, 4 * np.sqrt(3) * stated, none, None, [])
    assert f"are {4 * np.sqrt(2 / (1e10 + 1e8)) * 1e6:.0f} um off" in finding.message


def test_of_touches_the_artefact_may_be_the_cause_of_what_is_left(truth):
    """A sphere knocked by 0.3 mm, or a ball 0.5 mm thinner than said: *the arm does what the model has not* alone."""
    data = measured(truth, random_theta(truth.arm.robot, np.random.default_rng(9), 40), np.random.default_rng(9))
    N = len(data.pose)
    touches = replace(data, ends=replace(data.ends, kind=np.full(N, TOUCH)))
    (finding,) = left_findings(touches, np.full(N, 2e-4), np.zeros(N, dtype=bool), None, [])
    assert "explain 30: the artefact or its probe is not as its file says, or the arm does" in finding.message
    assert len(finding.message) <= 300


def test_what_instrument_and_repeatability_do_not_explain_is_said(truth):
    """45 um of a coordinate are 1.5 times what is usual; wild rows and those that nothing predicts do not count."""
    rng = np.random.default_rng(9)
    data = measured(truth, random_theta(truth.arm.robot, rng, 40), rng)
    wild = np.arange(len(data.pose)) < 3
    place = rng.normal(0, 1, (len(data.pose), 3))
    place /= np.sqrt((place[4:] ** 2).mean())
    distance = np.linalg.norm(place, axis=1)
    distance[wild], distance[3] = 500.0, np.nan
    sag = "sag was not fitted: masses are missing"
    assert not [*left_findings(data, 44e-6 * distance, wild, None, [])]
    (finding,) = left_findings(data, 46e-6 * distance, wild, None, [])
    assert finding.level is Level.WARNING
    assert "46 um off" in finding.message
    assert "explain 30" in finding.message
    assert sag in finding.message
    assert len(finding.message) <= 300
    (finding,) = left_findings(
        data,
        46e-6 * distance,
        wild,
        None,
        [JointCompliance(np.zeros(6), np.zeros(6), replace(truth.arm.facts.loads, payload=10.0))],
    )
    assert sag not in finding.message
    assert not [*left_findings(data, 70e-6 * distance, wild, 40e-6, [])]  # 1.5 x hypot(30, 40) um
    assert len([*left_findings(data, 76e-6 * distance, wild, 40e-6, [])]) == 1
    of_distances = replace(data, ends=replace(data.ends, kind=np.full(len(data.pose), DISTANCE)))
    (finding,) = left_findings(of_distances, 46e-6 * distance, wild, None, [])
    assert finding.message.startswith("unseen distances are 46 um off")


def test_no_joint_is_sent_further_that_turns_far_already(truth):
    rng = np.random.default_rng(7)
    data = measured(truth, random_theta(truth.arm.robot, rng, 40), rng)
    robot = truth.arm.robot
    narrow = replace(data, theta=np.where(np.arange(6) == 3, data.theta / 20, data.theta))
    assert "move J4 further than" in poses_to_add(robot, narrow, np.ones(6, bool))
    far = np.linspace(robot.lower, robot.upper, 40)
    far[:, 3] *= 0.3 * np.pi / np.abs(far[:, 3]).max() * 2  # 216 deg of 720: least of its range, and far
    words = poses_to_add(robot, replace(data, theta=far), np.ones(6, bool))
    assert words == "40 poses move every joint far: measure more of them, as 'cgen plan-poses' says"
