"""The fit against independent answers: finite differences, scipy's least squares, made-up robots."""

import time
from dataclasses import replace

import numpy as np
import pytest
from campaign import robot_file
from numpy.testing import assert_allclose
from scipy.optimize import least_squares
from synthetic import NOISE, axis_lines, made_up, measured, random_theta, warming, with_outliers

from compgen.core.rotations import rotation_matrix
from compgen.identification.cross_validation import cross_validate
from compgen.identification.evidence import FitPrior, Scales, normal_equations, posterior
from compgen.identification.fit import fit
from compgen.identification.identify import identify
from compgen.identification.instrument_frames import InstrumentFrames
from compgen.identification.linearisation import linearise
from compgen.identification.measurements import concatenate
from compgen.identification.model import build_model
from compgen.identification.parameters import symbolic_sources
from compgen.identification.thermal_terms import Information

SOURCES = ("link_offsets", "joint_zeros", "gear_harmonics", "joint_coupling")
FREE = 60  # parameters of them


def quiet(stage, share):
    """Says nothing."""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return robot_file(tmp_path_factory.mktemp("robot"))


@pytest.fixture(scope="module")
def truth(file):
    return made_up(file, 3)


@pytest.fixture(scope="module")
def small(truth):
    rng = np.random.default_rng(8)
    return measured(truth, random_theta(truth.arm.robot, rng, 25), rng)


def test_slopes_are_difference_quotients(truth, small):
    """Of every parameter, every frame and every reflector."""
    model, data = truth.model, small
    active = np.array([t.source != "joint_ripple" for t in model.parameters])
    rng = np.random.default_rng(2)
    p = rng.normal(0, 1, len(active)) * model.prior * active
    turn = np.tile(np.eye(3), (3, 1, 1))
    linear = linearise(model, data, active, p, truth.frames, turn)
    K, step = int(active.sum()), 1e-3
    for k in range(K):
        column = np.flatnonzero(active)[k]
        z = []
        for sign in (1, -1):
            moved = p.copy()
            moved[column] += sign * step * model.prior[column]
            z.append(data.position - truth.frames.predict(data, *model.pose(data, moved)))
        assert_allclose(
            linear.A[:, :, k], -(z[0] - z[1]) / (2 * step), atol=2e-8, err_msg=model.parameters[column].name
        )
    for k in range(6 + 9):
        z = []
        for sign in (1, -1):
            d = np.zeros(15)
            d[k] = sign * 1e-6
            frames = InstrumentFrames(
                rotation_matrix(d[None, :3]) @ truth.frames.rotation, truth.frames.origin + d[3:6],
                truth.frames.reflector + d[6:].reshape(3, 3),
            )  # fmt: skip
            z.append(data.position - frames.predict(data, *model.pose(data, p)))
        assert_allclose(linear.A[:, :, K + k], -(z[0] - z[1]) / 2e-6, atol=1e-8)


def test_orientation_rows_have_the_right_slope(truth, small):
    model = truth.model
    active = np.array([t.source in ("joint_zeros", "link_offsets") for t in model.parameters])
    zero = np.zeros(len(active))
    _, R = model.pose(small, zero)
    measured_rotation = truth.frames.rotation[0] @ R[small.pose]
    data = replace(small, rotation=measured_rotation @ rotation_matrix(np.full((len(measured_rotation), 3), 1e-4)))
    turn = np.tile(np.eye(3), (3, 1, 1))
    linear = linearise(model, data, active, zero, truth.frames, turn)
    assert_allclose(linear.turn, 1e-4, rtol=1e-6)
    k = next(i for i, j in enumerate(np.flatnonzero(active)) if model.parameters[j].source == "joint_zeros")
    column, step = np.flatnonzero(active)[k], 1e-2
    moved = zero.copy()
    moved[column] = step * model.prior[column]
    after = linearise(model, data, active, moved, truth.frames, turn)
    assert_allclose(
        linear.B[:, :, k], -(after.turn - linear.turn) / step, atol=1e-7
    )  # turns of 1e-4 rad add as vectors
    assert np.abs(linear.B[:, :, k]).max() > 1e-4
    K, instruments = int(active.sum()), len(data.instruments)
    for r in range(3):  # each reflector's own axes turn its own rows alone
        tilt = np.array([2e-5, -1e-5, 3e-5])
        turned = turn.copy()
        turned[r] = turn[r] @ rotation_matrix(tilt[None])[0]
        after = linearise(model, data, active, zero, truth.frames, turned)
        columns = linear.B[:, :, K + 6 * instruments + 3 * 3 :][:, :, 3 * r : 3 * r + 3]
        assert_allclose(columns @ tilt, -(after.turn - linear.turn), atol=1e-8)
        assert (data.reflector == r).any()


def test_measured_orientations_are_fitted_with_each_reflectors_own_axes(truth, small):
    axes = rotation_matrix(np.random.default_rng(9).normal(size=(3, 3)))
    _, R = truth.model.pose(small, truth.p)
    rotation = truth.frames.rotation[small.instrument] @ R[small.pose] @ axes[small.reflector]
    active = np.array([t.source in ("joint_zeros", "link_offsets") for t in truth.model.parameters])
    with_axes = fit(truth.model, replace(small, rotation=rotation), active)
    turn = np.swapaxes(axes, 1, 2) @ with_axes.reflector_rotation
    assert np.abs(turn - np.eye(3)).max() < 2e-3  # what the other sources turn
    without = fit(truth.model, small, active)
    assert_allclose(without.reflector_rotation, np.tile(np.eye(3), (3, 1, 1)))
    zeros = [k for k in np.flatnonzero(active) if truth.model.parameters[k].source == "joint_zeros"]
    assert (with_axes.sigma[zeros] < without.sigma[zeros]).all()  # orientations tell of the joints


def of_two_sources(truth, poses, times=1.0):
    """Measured on an arm whose zeros and lengths alone are off, so many times as much, and which these are."""
    rng = np.random.default_rng(12)
    active = np.array([t.source in ("joint_zeros", "link_offsets") for t in truth.model.parameters])
    only = replace(truth, p=np.where(active, times * truth.p, 0.0))
    return measured(only, random_theta(truth.arm.robot, rng, poses), rng), active, rng


@pytest.mark.parametrize("robust", [False, True])
def test_a_fit_that_begins_where_one_ended_stays_there(truth, robust):
    data, active, _ = of_two_sources(truth, 25, times=5.0)
    ended = fit(truth.model, data, active, robust=robust)
    again = fit(truth.model, data, active, robust=robust, start=ended)
    assert (np.abs(again.p - ended.p) <= 1e-4 * ended.sigma).all()


def test_rows_that_say_they_are_twice_as_bad_are_rows_of_twice_the_noise(truth):
    data, active, _ = of_two_sources(truth, 25)
    worse = replace(data, sigma=np.full(len(data.pose), 2.0))
    ours, theirs = (
        fit(truth.model, rows, active, learn=False, noise=noise) for rows, noise in ((worse, NOISE), (data, 2 * NOISE))
    )
    assert_allclose(ours.p, theirs.p, rtol=1e-6, atol=1e-12)
    assert_allclose(ours.sigma, theirs.sigma, rtol=1e-6)


def test_three_wild_rows_in_ten_neither_hide_nor_bend_the_fit(truth):
    data, active, rng = of_two_sources(truth, 60)
    spoiled, outlier = with_outliers(data, rng, share=0.3)
    fitted = fit(truth.model, spoiled, active)
    assert np.array_equal(fitted.outlier, outlier)
    assert_allclose(fitted.noise, NOISE, rtol=0.1)


@pytest.mark.parametrize("sigma", [(1, 1), (0.3, 1.7)], ids=["alike", "10 and 60 um"])
def test_the_noise_is_that_of_a_row_whatever_sigmas_the_rows_have(truth, sigma):
    """A row of a third of the sigma is one row, not nine: the noise was told as half of it, and right rows set aside.

    The noise that is drawn is the answer.
    """
    data, active, rng = of_two_sources(truth, 60)
    own = rng.choice(np.array(sigma, dtype=float), len(data.pose))
    exact = replace(truth, p=np.where(active, truth.p, 0.0)).noiseless(data)
    position = exact + rng.normal(0, NOISE, exact.shape) * own[:, None]
    fitted = fit(truth.model, replace(data, position=position, sigma=own), active)
    assert fitted.outlier.sum() <= 1
    assert_allclose(fitted.noise, NOISE, rtol=0.1)


def test_the_linear_problem_meets_the_closed_form():
    rng = np.random.default_rng(0)
    A, z = rng.normal(size=(40, 6)), rng.normal(size=40)
    lam, s2 = np.array([0.5, 2.0]), 0.3
    group = np.array([0, 0, 1, 1])
    solution = posterior(
        [normal_equations(A, z, *np.ones((2, 40)))],
        FitPrior(group, np.array([1e-3, 1e-3]), np.zeros(2), np.full(2, 1e6)),
        Scales(lam, np.array([s2, s2])), learn_groups=False, learn_noise=False,
    )  # fmt: skip
    D = np.diag([*(1 / lam[group]), 1e-3, 1e-3])
    by_hand = np.linalg.inv(A.T @ A / s2 + D)
    assert_allclose(solution.covariance, by_hand, rtol=1e-10)
    assert_allclose(solution.x, by_hand @ A.T @ z / s2, rtol=1e-10)
    whole = s2 * np.eye(40) + A @ np.linalg.inv(D) @ A.T  # the evidence is a Gaussian of the rows
    direct = -0.5 * (z @ np.linalg.solve(whole, z) + np.linalg.slogdet(2 * np.pi * whole)[1])
    assert_allclose(solution.log_evidence, direct, rtol=1e-9)


def test_unknowns_held_at_zero_leave_what_the_rows_say_without_their_columns():
    rng = np.random.default_rng(2)
    A, z, k, rest = rng.normal(size=(40, 8)), rng.normal(size=40), np.array([1, 3, 4]), np.array([0, 2, 5, 6, 7])
    group, lam = np.array([0, 1, 0, 1, 1, 0]), np.array([0.5, 2.0])

    def solved(columns):
        prior = FitPrior(group[columns[:-2]], np.array([1e-3, 1e-2]), np.array([0.1, -0.2]), np.full(2, 1e6))
        rows, scales = normal_equations(A[:, columns], z, *np.ones((2, 40))), Scales(lam, np.array([0.3]))
        return posterior([rows], prior, scales, learn_groups=False, learn_noise=False)

    whole, direct = solved(np.arange(8)), solved(rest)
    known = Information(whole.x, whole.covariance)
    without = known.without(k)
    assert_allclose(without.x[rest], direct.x, rtol=1e-10)
    assert_allclose(without.C[np.ix_(rest, rest)], direct.covariance, rtol=1e-9, atol=1e-14)
    assert_allclose([without.x[k], np.diag(without.C)[k]], 0.0, atol=1e-15)
    assert_allclose(known.loss(k, lam[1]), whole.log_evidence - direct.log_evidence, rtol=1e-9)


def test_a_group_that_does_nothing_shrinks_and_one_that_works_does_not():
    rng = np.random.default_rng(1)
    A = rng.normal(size=(300, 20))
    z = A[:, :10] @ rng.normal(0, 3, 10) + rng.normal(0, 0.1, 300)
    solution = posterior(
        [normal_equations(A, z, *np.ones((2, 300)))],
        FitPrior(np.repeat([0, 1], 10), np.zeros(0), np.zeros(0), np.full(2, 1e6)),
        Scales(np.ones(2), np.array([1.0, 1.0])),
    )  # fmt: skip
    assert solution.scales.group[0] > 3
    assert solution.scales.group[1] < 0.1
    assert_allclose(np.sqrt(solution.scales.noise[0]), 0.1, rtol=0.15)


def sixty(truth, poses):
    rng = np.random.default_rng(4)
    active = np.array([t.source in SOURCES for t in truth.model.parameters])
    active[np.flatnonzero(active)[FREE:]] = False
    only = replace(truth, p=np.where(active, truth.p, 0.0))
    return measured(only, random_theta(truth.arm.robot, rng, poses), rng), active


def by_scipy(model, data, active, start):
    """The same objective and residual function with a numerical Jacobian; also how long it took."""
    scale = model.prior[active]

    def residual(x):
        p = np.zeros(len(active))
        p[active] = x[:FREE] * scale
        step = x[FREE:]
        frames = InstrumentFrames(rotation_matrix(step[None, :3]) @ start.rotation, start.origin + step[3:6],
                        start.reflector + step[6:].reshape(3, 3))  # fmt: skip
        z = data.position - frames.predict(data, *model.pose(data, p))
        return np.concatenate([z.ravel() / NOISE, x[:FREE]])

    start_time = time.process_time()
    solution = least_squares(residual, np.zeros(FREE + 15), x_scale="jac", xtol=1e-10, ftol=1e-10, gtol=1e-10)
    return solution, time.process_time() - start_time


def test_the_optimum_is_that_of_least_squares_and_comes_much_sooner(truth):
    parts = [
        p
        for p in symbolic_sources(truth.arm.robot, truth.arm.known, np.ones(6, bool), warm=False)
        if p.original.NAME in SOURCES
    ]
    model = build_model(truth.arm.robot, parts, len(truth.arm.nodes))
    plain = replace(truth, model=model, p=np.random.default_rng(6).normal(0, model.prior))
    data, active = sixty(plain, 1000)
    fit(model, data.subset(data.pose < 50), active, learn=False, robust=False, noise=NOISE)  # warm caches
    seconds = np.inf
    for _ in range(10):  # the least of them: a busy machine costs a short run more than a long one
        start_time = time.process_time()
        fitted = fit(model, data, active, learn=False, robust=False, noise=NOISE)
        seconds = min(seconds, time.process_time() - start_time)
    start = fit(model, data, np.zeros(len(active), bool), robust=False).frames
    reference, reference_seconds = by_scipy(model, data, active, start)
    p = fitted.p[active] / model.prior[active]
    spread = fitted.sigma[active] / model.prior[active]
    assert (np.abs(p - reference.x[:FREE]) < 0.05 * spread).all()  # what a numerical Jacobian leaves
    cost = (fitted.residual**2).sum() / NOISE**2 + (p**2).sum()
    assert cost <= 2 * reference.cost * (1 + 1e-9)
    assert reference_seconds / seconds > 20, (reference_seconds, seconds)


def test_outliers_are_identified(truth):
    rng = np.random.default_rng(12)
    data, outlier = with_outliers(measured(truth, random_theta(truth.arm.robot, rng, 60), rng), rng, share=0.03)
    active = np.array(
        [t.source != "joint_ripple" and not t.source.startswith("thermal") for t in truth.model.parameters]
    )
    fitted = fit(truth.model, data, active)
    assert np.array_equal(fitted.outlier, outlier)
    assert_allclose(fitted.noise, NOISE, rtol=0.25)


def test_held_out_error_is_what_leaving_out_and_fitting_again_gives(truth, small):
    """The linear folds against a real fit without the rows."""
    active = np.array([t.source in ("joint_zeros", "link_offsets") for t in truth.model.parameters])
    fitted = fit(truth.model, small, active, robust=False)
    folds = cross_validate(truth.model, small, fitted)
    held_out = folds.block % 10 == 3
    refitted = fit(truth.model, small.subset(~held_out), active, robust=False)
    frames = refitted.frames
    held_out_rows = small.subset(held_out)
    predicted = frames.predict(held_out_rows, *truth.model.pose(held_out_rows, refitted.p))
    direct = np.linalg.norm(held_out_rows.position - predicted, axis=1)
    assert_allclose(folds.distance[held_out], direct, rtol=0.1, atol=10e-6)
    assert folds.mean > np.linalg.norm(fitted.residual, axis=1).mean()


@pytest.fixture(scope="module")
def cold_and_warm(truth):
    rng = np.random.default_rng(21)
    cold, outlier = with_outliers(measured(truth, random_theta(truth.arm.robot, rng, 60), rng), rng)
    warm, _ = warming(truth, rng)
    data = concatenate([cold, replace(warm, instruments=cold.instruments), axis_lines(truth, rng)])
    same = np.where(data.instrument <= 1, 0, data.instrument - 1)
    return replace(
        data, instrument=same, instruments=data.instruments[1:], aligned=np.array(data.aligned)[1:]
    ), outlier  # fmt: skip


def test_a_made_up_robot_is_identified(truth, cold_and_warm):
    data, outlier = cold_and_warm
    identification = identify(truth.arm.robot, truth.arm.known, data, len(truth.arm.nodes), quiet, temperatures=True)
    assert not identification.refused
    best = identification.selected.fit
    assert np.array_equal(best.outlier[: len(outlier)], outlier)
    rng = np.random.default_rng(5)
    theta = random_theta(truth.arm.robot, rng, 200)
    for sense in (1.0, -1.0):
        fresh = measured(truth, theta, rng, noise=0.0, direction=np.full_like(theta, sense))
        frames = InstrumentFrames(best.frames.rotation[:1], best.frames.origin[:1], best.frames.reflector[:3])
        error = frames.predict(fresh, *identification.model.pose(fresh, best.p)) - fresh.position
        assert np.sqrt((error**2).mean()) < 0.83 * NOISE  # with the noise of new measurements: 1.3 times
    inside = [
        abs(best.p[k] - v) <= 1.96 * best.sigma[k]
        for k, v in enumerate(truth.p)
        if identification.model.parameters[k].source != "joint_ripple" and best.active[k]
    ]
    assert len(inside) > 80
    assert np.mean(inside) > 0.85


def test_coordinates_that_were_not_measured_carry_no_weight(truth):
    """Lines with the deviation along them only: all that a laser interferometer gives."""
    rng = np.random.default_rng(61)
    lines = axis_lines(truth, rng)
    along = np.arange(3) == lines.instrument[:, None]
    single = replace(lines, position=np.where(along, lines.position, np.nan))
    poses = measured(truth, random_theta(truth.arm.robot, rng, 25), rng)
    active = np.array([t.source in SOURCES for t in truth.model.parameters])
    fitted = fit(truth.model, concatenate([poses, single]), active)
    assert np.isfinite(fitted.p).all()
    assert (fitted.residual[len(poses.pose) :][~along] == 0).all()
    measured_rows = int(np.isfinite(concatenate([poses, single]).position[~fitted.outlier]).sum())
    freedom = measured_rows - fitted.gamma.sum() - 6 - 9 - 9 - 3  # frame, reflectors, zeros and tilts, tool
    rms = np.sqrt((fitted.residual[~fitted.outlier] ** 2).sum() / freedom)
    assert_allclose(fitted.noise, rms, rtol=0.05)
    identified = identify(
        truth.arm.robot,
        truth.arm.known,
        concatenate([poses, single]),
        len(truth.arm.nodes),
        quiet,
        temperatures=False,
    )
    assert np.isfinite(identified.selected.fit.p).all()


def test_few_poses_shrink_rather_than_blow_up(truth):
    rng = np.random.default_rng(31)
    data = measured(truth, random_theta(truth.arm.robot, rng, 7), rng, reflectors=1)
    identification = identify(truth.arm.robot, truth.arm.known, data, len(truth.arm.nodes), quiet, temperatures=True)
    best = identification.selected.fit
    assert (np.abs(best.p) < 6 * truth.model.prior[: len(best.p)].max()).all()
    assert np.isfinite(best.sigma).all()
    assert best.gamma.sum() < 3 * 7


def test_an_arm_without_errors_is_refused(truth):
    perfect = replace(truth, p=0 * truth.p)
    rng = np.random.default_rng(41)
    data = measured(perfect, random_theta(truth.arm.robot, rng, 30), rng)
    identification = identify(truth.arm.robot, truth.arm.known, data, len(truth.arm.nodes), quiet, temperatures=True)
    assert identification.refused
    assert any("beats the nominal" in f.message and "measure" in f.message for f in identification.findings)
