"""What a fit leaves beside its parameters' covariance, and how well it foretells: drawn, and found again."""

from dataclasses import replace

import numpy as np
import pytest
from campaign import robot_file
from synthetic import made_up, measured, random_theta, warming

from compgen.core.finding_codes import Level
from compgen.core.units import UM
from compgen.identification.fit import fit
from compgen.identification.fit_limits import (
    assess_fit_limits,
    fit_limits_record,
    forecast_blocks,
    forecast_findings,
    mean_if_not_negative,
    with_uncertain_scales,
)
from compgen.identification.measurements import concatenate
from compgen.identification.model import active_in_groups

SOURCES = ("link_offsets", "joint_zeros", "thermal_growth", "thermal_bend")


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """A made-up arm that errs by zeros, lengths and warmth alone, and which of its parameters are free."""
    truth = made_up(robot_file(tmp_path_factory.mktemp("limits")), 4)
    free = np.array([t.source in SOURCES for t in truth.model.parameters])
    names, _ = truth.model.groups()
    groups = [name for name in names if name.split(".")[0] in SOURCES]
    return replace(truth, p=np.where(free, truth.p, 0.0)), active_in_groups(truth.model, groups)


def limits_of(truth, active, data, temperatures=True):
    return assess_fit_limits(truth.model, data, fit(truth.model, data, active), temperatures=temperatures)


def shaken(data, sigma, rng):
    """Measurements of an arm that stands elsewhere at each pose."""
    return replace(data, position=data.position + rng.normal(0, sigma, (len(data.theta), 3))[data.pose])


def warm_campaign(truth, seed, poses=60):
    rng = np.random.default_rng(seed)
    cold = measured(truth, random_theta(truth.arm.robot, rng, poses), rng, time=np.arange(poses) - 1e4)
    return concatenate([cold, warming(truth, rng, count=60)[0]])


@pytest.mark.parametrize("sigma", [8, 20])
def test_what_the_rows_of_a_pose_share_is_fit_noise(arm, sigma):
    truth, active = arm
    rng = np.random.default_rng(sigma)
    data = measured(truth, random_theta(truth.arm.robot, rng, 120), rng)
    limits = limits_of(truth, active, shaken(data, sigma * UM, rng))
    assert limits.noise / UM == pytest.approx(sigma, abs=0.15 * sigma + 1)
    assert limits.repeatability is None
    assert limits.missing is None


def test_a_fit_that_shows_no_noise_of_poses_is_not_free_of_it(arm):
    truth, active = arm
    rng = np.random.default_rng(8)
    limits = limits_of(truth, active, measured(truth, random_theta(truth.arm.robot, rng, 120), rng))
    assert 0.5 < limits.noise / UM < 7


def test_poses_driven_to_again_tell_repeatability_from_fit_noise(arm):
    truth, active = arm
    rng = np.random.default_rng(9)
    poses = random_theta(truth.arm.robot, rng, 60)
    misfit = rng.normal(0, 12 * UM, (60, 3))
    data = measured(truth, np.repeat(poses, 3, axis=0), rng, direction=np.zeros((180, 6)))
    data = replace(data, position=data.position + np.repeat(misfit, 3, axis=0)[data.pose])
    limits = limits_of(truth, active, shaken(data, 18 * UM, rng))
    assert limits.repeatability / UM == pytest.approx(18, abs=3)
    assert limits.noise / UM == pytest.approx(12, abs=4)


def test_an_arm_that_only_its_visits_shake_is_not_free_of_fit_noise(arm):
    """Given that it is not below nothing its mean is above it, also where repeats leave less than nothing."""
    truth, active = arm
    for seed in range(4):
        rng = np.random.default_rng(30 + seed)
        poses = np.repeat(random_theta(truth.arm.robot, rng, 40), 3, axis=0)
        data = measured(truth, poses, rng, direction=np.zeros((120, 6)))
        limits = limits_of(truth, active, shaken(data, 18 * UM, rng))
        assert 0.5 < limits.noise / UM < 9, seed
        assert limits.repeatability / UM == pytest.approx(18, abs=3)


def test_a_model_of_the_arm_foretells_later_blocks_as_well_as_it_says(arm):
    scales = []
    for seed in range(3):
        limits = limits_of(arm[0], arm[1], warm_campaign(arm[0], seed))
        assert limits.blocks == 12
        assert 0.002 < limits.missing < 0.05  # what these poses cannot tell from nothing
        assert forecast_findings(limits, warm=True) == []
        scales.append(limits.scale)
    assert min(scales) >= 1
    assert max(scales) < 1.35


def test_an_instrument_that_drifts_is_refused_with_the_reason(arm):
    data = warm_campaign(arm[0], 1)
    drift = np.linspace(0, 1, len(data.theta)) ** 2 * 1.5e-3
    moved = replace(data, position=data.position + (drift[:, None] * [0.6, -0.5, 0.6])[data.pose])
    limits = limits_of(arm[0], arm[1], moved)
    (finding,) = forecast_findings(limits, warm=True)
    assert limits.scale > 3
    assert finding.level is Level.REFUSED
    assert forecast_findings(limits, warm=False)[0].level is Level.WARNING
    assert "did instrument, reflector or base move" in finding.message


def test_warmth_that_no_term_explains_is_thermal_physics_missing(arm):
    """The arm grows with the square of its warmth, which no source does."""
    truth, active = arm
    data = warm_campaign(truth, 2)
    bent = replace(data, rise=data.rise * (1 + data.rise / 6))
    more = truth.noiseless(bent) - truth.noiseless(data)
    limits = limits_of(truth, active, replace(data, position=data.position + more))
    assert 0.07 < limits.missing < 0.5
    assert limits_of(truth, active, data, temperatures=False).missing is None


def test_what_is_missing_is_found_in_the_mean_of_arms_that_miss_little(arm):
    """3 % of what warmth does, in a direction of each pose's own: less than most single arms can tell."""
    truth, active = arm
    squares, share = [], 0.03
    for seed in range(8):
        data, rng = warm_campaign(truth, 30 + seed), np.random.default_rng(seed)
        cold = replace(data, rise=0 * data.rise, lag=0 * data.lag, warm=0 * data.warm)
        warmth = np.linalg.norm(truth.noiseless(data) - truth.noiseless(cold), axis=1)
        away = rng.normal(0, share, (len(data.theta), 3))[data.pose] * warmth[:, None]
        squares.append(limits_of(truth, active, replace(data, position=data.position + away)).missing ** 2)
    assert 0.8 * share < np.sqrt(np.mean(squares)) < 1.5 * share


@pytest.mark.parametrize(("value", "sigma"), [(-3.0, 1.0), (0.0, 2.0), (0.7, 0.5), (40.0, 0.1)])
def test_a_variance_is_the_mean_of_what_is_not_below_zero(value, sigma):
    """By summing the normal density over its upper side."""
    x = np.linspace(0.0, max(value, 0.0) + 12 * sigma, 400_001)
    density = np.exp(-0.5 * ((x - value) / sigma) ** 2)
    assert mean_if_not_negative(value, sigma) == pytest.approx((x * density).sum() / density.sum(), rel=1e-4)


def test_few_poses_are_said(arm):
    truth, active = arm
    rng = np.random.default_rng(3)
    limits = limits_of(truth, active, measured(truth, random_theta(truth.arm.robot, rng, 20), rng))
    (finding,) = forecast_findings(limits, warm=False)
    assert limits.blocks == 4
    assert finding.level is Level.NOTE
    assert "4 blocks" in finding.message
    assert "36 poses" in finding.message
    assert fit_limits_record(limits)["forecast_blocks"] == 4
    assert "repeatability_um" not in fit_limits_record(limits)


def test_blocks_are_of_poses_in_the_order_of_time(arm):
    data = warm_campaign(arm[0], 1)
    backwards = replace(data, time=-data.time)
    block, count = forecast_blocks(data)
    assert count == 12
    assert (block[:40] == -1).all()
    assert (np.diff(block) >= 0).all()
    assert (np.diff(forecast_blocks(backwards)[0]) <= 0).all()


def test_a_scale_known_from_few_numbers_widens_what_it_alone_holds(arm):
    truth, active = arm
    data = warm_campaign(truth, 1)
    fitted = fit(truth.model, data, active)
    wider = with_uncertain_scales(truth.model, data, fitted)
    ratio = wider.sigma / fitted.sigma
    share_of_data = fitted.gamma[active]
    assert (ratio[~active] == 1).all()
    assert ratio[active].min() >= 1 - 1e-9
    assert ratio[active].max() <= np.sqrt(2) + 1e-9
    assert np.median(ratio[active][share_of_data > 0.99]) < 1.01
    assert ratio[active][share_of_data < 0.5].max() > 1.1
    assert (wider.p == fitted.p).all()
    thermal = active & truth.model.thermal
    assert (wider.sigma[thermal] <= truth.model.prior[thermal] * (1 + 1e-9)).all()  # their ceiling is the prior


def test_what_scales_widen_is_by_as_many_numbers_as_tell_them(arm):
    """Normal equations with numpy alone: lambda n / (n - 2), twice at most, n = 0.3 and what the data tells of a group.

    Doubled where n is two or less; never above the group's ceiling.
    """
    truth, active = arm
    rng = np.random.default_rng(5)
    data = measured(truth, random_theta(truth.arm.robot, rng, 12), rng, reflectors=1)
    fitted = fit(truth.model, data, active)
    wider = with_uncertain_scales(truth.model, data, fitted)

    names, group = truth.model.groups()
    known, learnt = np.zeros(len(names)), fitted.posterior.scales.group
    np.add.at(known, group[active], fitted.gamma[active])
    n = 0.3 + known
    factor = np.array([v / (v - 2) if v > 4 else 2.0 for v in n])
    assert (n < 2).any()
    assert ((n > 2) & (n < 4)).any()
    assert (n > 4).any()
    scales = np.minimum(learnt * factor, np.maximum(truth.model.ceiling, learnt))
    assert (scales < learnt * factor).any()

    K, kept = int(active.sum()), ~fitted.outlier
    A = fitted.linear.A[kept].reshape(3 * kept.sum(), -1) / np.sqrt(fitted.posterior.scales.noise[0])
    prior = np.full(A.shape[1], 100.0)  # of frames and reflectors
    prior[:K] = 1 / scales[group[active]]
    spread = np.sqrt(np.diag(np.linalg.inv(A.T @ A + np.diag(prior))))[:K]
    assert wider.sigma[active] == pytest.approx(spread * truth.model.prior[active], rel=1e-6)
    assert wider.gamma[active] == pytest.approx(1 - spread**2 / scales[group[active]], abs=1e-6)
    assert (wider.sigma[~active] == truth.model.prior[~active]).all()


def test_an_arm_of_which_nothing_is_free_has_no_scales_to_widen(arm):
    truth, active = arm
    rng = np.random.default_rng(5)
    data = measured(truth, random_theta(truth.arm.robot, rng, 12), rng, reflectors=1)
    fitted = fit(truth.model, data, np.zeros_like(active))
    assert with_uncertain_scales(truth.model, data, fitted) is fitted
