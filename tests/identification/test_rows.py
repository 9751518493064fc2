"""Rows of distances and touches: their slopes, and the fit against least squares on a numpy arm of its own."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import least_squares
from synthetic import random_theta

from compgen.core.pose import Pose
from compgen.core.rotations import rotation_matrix
from compgen.core.units import MM, UM
from compgen.identification.cross_validation import FOLDS, blocks_of_poses, cross_validate, held_out_rows
from compgen.identification.fit import fit
from compgen.identification.instrument_frames import InstrumentFrames
from compgen.identification.linearisation import linearise
from compgen.identification.measurements import (
    DISTANCE,
    NONE,
    PLACE,
    TOUCH,
    WORLD,
    FarEnds,
    FixedPlaces,
    Measurements,
    concatenate,
    with_one_frame_a_name,
)
from compgen.identification.model import build_model
from compgen.identification.parameters import symbolic_sources
from compgen.pipelines.files.robot_file import load_arm
from compgen.robot.inverse_kinematics import Posture, solve_tool

NOISE = 20 * UM
PRISM = np.array([[60, 10, 120], [-50, 40, 150]]) * 1e-3
PROBE = np.array([10, -20, 180]) * 1e-3
SOCKET = np.array([1.2, 0.3, -0.4])
ANYWHERE = np.array([[1.3, -0.2, 0.1], [0.9, 0.5, 0.4]])  # two spheres in World
PART = np.array([[0.0, 0.0, 0.0], [0.4, 0.0, 0.05], [0.0, 0.5, 0.0], [0.3, 0.4, 0.2]])  # in the artefact's frame
LENGTH_SIGMA, PLACE_SIGMA = 3 * UM, 15 * UM
GEOMETRY = ("link_offsets", "joint_zeros")


# an arm in numpy alone: T = prod_i Rz(q_i + zero_i) Tz(d_i) Tx(a_i) Rx(alpha_i) Ry(beta_i)


def about(axis, angle):
    i, j = ((1, 2), (2, 0), (0, 1))[axis]
    T = np.tile(np.eye(4), (len(angle), 1, 1))
    T[:, i, i] = T[:, j, j] = np.cos(angle)
    T[:, j, i], T[:, i, j] = np.sin(angle), -np.sin(angle)
    return T


def along(d, a, count):
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, 0, 3], T[:, 2, 3] = a, d
    return T


def numpy_flange(robot, parameters, p, theta):
    """Positions and rotations of the flange with parameters of lengths and zeros."""
    rows = {"d": robot.d.copy(), "a": robot.a.copy(), "alpha": robot.alpha.copy(), "beta": np.zeros(6)}
    rows["offset"] = np.zeros(6)
    for parameter, value in zip(parameters, p, strict=True):
        rows[parameter.field][parameter.index] += value
    T, one = np.tile(np.eye(4), (len(theta), 1, 1)), np.ones(len(theta))
    for i in range(6):
        T = T @ about(2, theta[:, i] + rows["offset"][i]) @ along(rows["d"][i], rows["a"][i], len(theta))
        T = T @ about(0, rows["alpha"][i] * one) @ about(1, rows["beta"][i] * one)
    return T[:, :3, 3], T[:, :3, :3]


@pytest.fixture(scope="module")
def arm():
    return load_arm("m710ic50")


@pytest.fixture(scope="module")
def model(arm):
    parts = symbolic_sources(arm.robot, arm.known, np.ones(6, dtype=bool), warm=False, facts=arm.facts)
    return build_model(arm.robot, [s for s in parts if s.original.NAME in GEOMETRY], 0)


def blank(theta, kind, rows, reflectors, **values):
    """Rows of one kind, one a pose unless it is said otherwise."""
    ends = FarEnds(
        kind=np.full(rows, kind),
        shift=values.pop("shift", np.zeros((rows, 3))),
        place=values.pop("place", np.full(rows, NONE)),
        pose=values.pop("far_pose", np.full(rows, NONE)),
        reflector=values.pop("far_reflector", np.zeros(rows, dtype=int)),
        distance=values.pop("distance", np.full(rows, np.nan)),
        toward=values.pop("toward", np.full((rows, 3), np.nan)),
    )
    fixed, instruments = values.pop("fixed", FixedPlaces()), values.pop("instruments", ())
    M = len(theta)
    data = Measurements(
        theta=theta,
        rise=np.zeros((M, 0)),
        lag=np.zeros((M, 0)),
        direction=np.zeros((M, 6)),
        time=np.arange(M, dtype=float),
        warm=np.zeros(M),
        pose=values.pop("pose", np.arange(rows)),
        instrument=np.full(rows, 0 if instruments else WORLD),
        reflector=values.pop("reflector", np.zeros(rows, dtype=int)),
        position=values.pop("position", np.full((rows, 3), np.nan)),
        rotation=np.full((rows, 3, 3), np.nan),
        sigma=np.ones(rows),
        label=tuple(f"{kind}.csv: line {n + 2}" for n in range(rows)),
        reflectors=reflectors,
        instruments=instruments,
        aligned=np.zeros(len(instruments), dtype=bool),
        ends=ends,
        fixed=fixed,
    )
    assert not values
    return data


@pytest.fixture(scope="module")
def truth(arm, model):
    rng = np.random.default_rng(3)
    p = rng.normal(0, 0.5, len(model.parameters)) * model.prior
    turn = rotation_matrix(rng.normal(size=(2, 3)))
    frames = InstrumentFrames(turn, rng.uniform(-2, 2, (2, 3)), np.vstack([PRISM, PROBE]), np.zeros((0, 3)))
    return p, frames


@pytest.fixture(scope="module")
def everything(arm, model, truth):
    """Places, distances between reflectors and to a socket, touches of spheres anywhere and on a part, by numpy."""
    p, frames = truth
    robot = arm.robot
    rng = np.random.default_rng(7)

    def flange(theta):
        return numpy_flange(robot, model.parameters, p, theta)

    def carried(theta, point):
        P, R = flange(theta)
        return P + np.einsum("nij,nj->ni", R, np.broadcast_to(point, P.shape))

    theta = random_theta(robot, rng, 20)
    places = carried(theta, PRISM[0]) @ frames.rotation[0].T + frames.origin[0]
    parts = [
        blank(theta, PLACE, 20, ("r1",), position=places + rng.normal(0, NOISE, (20, 3)), instruments=("tracker",))
    ]
    theta = random_theta(robot, rng, 120)
    near, far = rng.integers(0, 2, (2, 60))
    apart = np.linalg.norm(carried(theta[:60], PRISM[near]) - carried(theta[60:], PRISM[far]), axis=1)
    parts.append(
        blank(
            theta,
            DISTANCE,
            60,
            ("r1", "r2"),
            reflector=near,
            far_pose=np.arange(60, 120),
            far_reflector=far,
            distance=apart + rng.normal(0, NOISE, 60),
        )
    )
    theta = random_theta(robot, rng, 40)
    apart = np.linalg.norm(carried(theta, PRISM[1]) - SOCKET, axis=1)
    unknown = FixedPlaces(names=("socket",), frame=np.array([WORLD]), place=np.full((1, 3), np.nan), sigma=np.zeros(1))
    parts.append(
        blank(
            theta,
            DISTANCE,
            40,
            ("r2",),
            distance=apart + rng.normal(0, NOISE, 40),
            place=np.zeros(40, int),
            fixed=unknown,
        )
    )
    # located centres of spheres anywhere: what the probe was off is its shift
    theta = random_theta(robot, rng, 60)
    place = np.arange(60) % 2
    shift = ANYWHERE[place] - carried(theta, PROBE) + rng.normal(0, NOISE, (60, 3))
    length = FixedPlaces(
        names=("box: a", "box: b"),
        frame=np.full(2, WORLD),
        place=np.full((2, 3), np.nan),
        sigma=np.zeros(2),
        between=np.array([[0, 1]]),
        length=np.array([np.linalg.norm(ANYWHERE[0] - ANYWHERE[1])]),
        length_sigma=np.array([LENGTH_SIGMA]),
        certified=True,
    )
    parts.append(blank(theta, TOUCH, 60, ("probe",), shift=shift, place=place, fixed=length))
    # sides of spheres whose places in the part's frame are known to a sigma
    theta = random_theta(robot, rng, 80)
    place = np.arange(80) % 4
    spheres = (PART + rng.normal(0, PLACE_SIGMA, PART.shape) - frames.origin[1]) @ frames.rotation[1]
    radius = 15 * MM
    normal = rng.normal(size=(80, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    shift = spheres[place] - normal * (radius + rng.normal(0, NOISE, (80, 1))) - carried(theta, PROBE)
    known = FixedPlaces(
        names=tuple(f"part: {k}" for k in "abcd"),
        frame=np.zeros(4, int),
        place=PART,
        sigma=np.full(4, PLACE_SIGMA),
        certified=True,
    )
    parts.append(
        blank(
            theta,
            TOUCH,
            80,
            ("probe",),
            shift=shift,
            place=place,
            distance=np.full(80, radius),
            fixed=known,
            instruments=("part",),
            toward=normal,
        )
    )
    return with_one_frame_a_name(concatenate(parts))


def start_of(everything, truth):
    """Frames and places near the true ones."""
    _, frames = truth
    place = np.vstack([SOCKET, ANYWHERE, PART])
    assert everything.fixed.names[0] == "socket"
    return InstrumentFrames(frames.rotation, frames.origin, frames.reflector, place)


def moved_frames(frames, d, V):
    """Frames moved by their part of the unknowns."""
    Q, S = len(frames.reflector), len(frames.place)
    turn = d[: 6 * V].reshape(V, 6)
    reflector, place = d[6 * V : 6 * V + 3 * Q], d[6 * V + 3 * Q : 6 * V + 3 * (Q + S)]
    return InstrumentFrames(
        rotation_matrix(turn[:, :3]) @ frames.rotation, frames.origin + turn[:, 3:],
        frames.reflector + reflector.reshape(Q, 3), frames.place + place.reshape(S, 3),
    )  # fmt: skip


def test_slopes_of_all_rows_are_difference_quotients(model, truth, everything):
    p, frames = truth[0], start_of(everything, truth)
    active = np.ones(len(p), dtype=bool)
    axes = np.tile(np.eye(3), (3, 1, 1))
    linear = linearise(model, everything, active, p, frames, axes)
    K, D = len(p), linear.A.shape[2]
    assert D == K + 12 + 9 + 21
    assert {PLACE, TOUCH, DISTANCE} == set(everything.kind.tolist())
    for k in range(D):
        z, known = [], []
        for sign in (1, -1):
            d = np.zeros(D)
            d[k] = sign * (1e-3 if k < K else 1e-6)
            at = moved_frames(frames, d[K:], 2)
            moved = p + d[:K] * model.prior
            z.append(np.nan_to_num(at.residual(everything, *model.pose(everything, moved))))
            known.append(everything.fixed.prior_rows(at.place)[0])
        step = 2e-3 if k < K else 2e-6
        assert_allclose(linear.A[:, :, k], -(z[0] - z[1]) / step, atol=3e-8 if k < K else 1e-7)
        assert_allclose(linear.C[:, k], -(known[0] - known[1]) / step, atol=2e-3, rtol=1e-6)
    assert (np.abs(linear.A).max(axis=(0, 1)) > 0).all()  # each unknown moves something
    assert len(linear.C) == 3 * 4 + 1


def numpy_residuals(arm, model, data, x, frames, active):
    """What least squares shall make small: rows over their noise, parameters and places over their priors."""
    K = int(active.sum())
    p = np.zeros(len(active))
    p[active] = x[:K] * model.prior[active]
    at = moved_frames(frames, x[K:], 2)
    P, R = numpy_flange(arm.robot, model.parameters, p, data.theta)

    def carried(pose, reflector):
        return P[pose] + np.einsum("nij,nj->ni", R[pose], at.reflector[reflector])

    ends, out = data.ends, [x[:K]]
    near = carried(data.pose, data.reflector) + ends.shift
    for n in range(len(data.pose)):
        i = data.instrument[n]
        y = near[n] if i == WORLD else at.rotation[i] @ near[n] + at.origin[i]
        if ends.pose[n] != NONE:
            far = carried(ends.pose[n : n + 1], ends.reflector[n : n + 1])[0]
        else:
            far = at.place[ends.place[n]] if ends.place[n] != NONE else data.position[n]
        gap = far - y
        of_row = gap if np.isnan(ends.distance[n]) else np.array([ends.distance[n] - np.linalg.norm(gap)])
        out.append(of_row / NOISE)
    fixed = data.fixed
    given = np.isfinite(fixed.place[:, 0])
    out.append(((fixed.place - at.place)[given] / fixed.sigma[given, None]).ravel())
    for (a, b), length, sigma in zip(fixed.between, fixed.length, fixed.length_sigma, strict=True):
        out.append(np.array([(length - np.linalg.norm(at.place[a] - at.place[b])) / sigma]))
    return np.concatenate(out)


def test_the_fit_is_where_least_squares_on_a_numpy_arm_ends(arm, model, truth, everything):
    active = np.ones(len(model.parameters), dtype=bool)
    fitted = fit(model, everything, active, learn=False, robust=False, noise=NOISE)
    K, start = len(active), start_of(everything, truth)

    def residuals(x):
        return numpy_residuals(arm, model, everything, x, start, active)

    best = least_squares(residuals, np.zeros(K + 12 + 9 + 21), x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-12)
    frames = moved_frames(start, best.x[K:], 2)
    assert_allclose(fitted.p / model.prior, best.x[:K], atol=2e-5)
    assert_allclose(fitted.frames.reflector, frames.reflector, atol=1e-9)
    assert_allclose(fitted.frames.place, frames.place, atol=1e-8)
    assert_allclose(fitted.frames.origin, frames.origin, atol=1e-8)
    p, _ = truth
    off = np.abs(fitted.p - p) / fitted.sigma
    assert off.max() < 4.5  # and it is near the truth, by what it says itself
    assert 0.6 < np.sqrt((off**2).mean()) < 1.4
    assert np.median(fitted.gamma) > 0.9  # which the rows tell, and not the prior


def test_scales_and_noises_are_learnt_by_kind(model, everything):
    active = np.ones(len(model.parameters), dtype=bool)
    rng = np.random.default_rng(11)
    rows = everything.kind == DISTANCE
    ends = replace(everything.ends, distance=everything.ends.distance + rng.normal(0, 150 * UM, len(rows)) * rows)
    fitted = fit(model, replace(everything, ends=ends), active)
    noise = {kind: fitted.noise_of_row[everything.kind == kind][0] for kind in (PLACE, TOUCH, DISTANCE)}
    assert noise[DISTANCE] == pytest.approx(150 * UM, rel=0.25)
    assert noise[TOUCH] == pytest.approx(NOISE, rel=0.25)
    assert noise[PLACE] < 35 * UM


def test_a_wild_distance_and_a_wild_touch_are_set_aside(model, everything):
    active = np.ones(len(model.parameters), dtype=bool)
    rng = np.random.default_rng(12)
    wrong = np.array([int(rng.choice(np.flatnonzero(everything.kind == kind))) for kind in (DISTANCE, TOUCH)])
    ends = everything.ends
    distance, shift = ends.distance.copy(), ends.shift.copy()
    distance[wrong[0]] += 1 * MM
    shift[wrong[1]] += np.array([0, 0.7, 0.7]) * MM
    fitted = fit(model, replace(everything, ends=replace(ends, distance=distance, shift=shift)), active)
    assert set(wrong.tolist()) <= set(np.flatnonzero(fitted.outlier).tolist())
    assert fitted.outlier.sum() <= 4


@pytest.mark.parametrize("kind", [DISTANCE, TOUCH])
def test_each_kind_alone_finds_its_own_start_and_the_arm(model, truth, everything, kind):
    """Nothing is told of reflectors, sockets and spheres: from the flange outwards."""
    p, frames = truth
    data = everything.subset(everything.kind == kind)
    fitted = fit(model, data, np.ones(len(p), dtype=bool), noise=NOISE)
    assert np.sqrt((fitted.residual**2).sum(axis=1).mean()) < 3 * NOISE
    used = np.unique(data.reflector)
    assert_allclose(fitted.frames.reflector[used], frames.reflector[used], atol=2 * MM)
    off = np.abs(fitted.p - p) / fitted.sigma
    assert np.sqrt((off**2).mean()) < 1.6


def touching(robot, rng, centres, count):
    """Poses of the nominal arm with its probe in the middle of spheres, tilted, and the spheres' numbers."""
    place = np.arange(count) % len(centres)
    down = np.diag([1.0, -1.0, -1.0]) @ rotation_matrix(rng.uniform(-0.6, 0.6, (count, 3)))
    return solve_tool(robot, Pose(centres[place], down), Pose(PROBE, np.eye(3)), Posture())[0], place


def test_an_arm_that_grows_by_a_factor_touches_spheres_anywhere_alike(arm, model):
    """Without a certified length no row moves: it is why scale is refused then; with one, a row of it does."""
    theta, place = touching(arm.robot, np.random.default_rng(4), ANYWHERE, 60)
    length = FixedPlaces(
        names=("a", "b"),
        frame=np.full(2, WORLD),
        place=np.full((2, 3), np.nan),
        sigma=np.zeros(2),
        between=np.array([[0, 1]]),
        length=np.array([np.linalg.norm(ANYWHERE[0] - ANYWHERE[1])]),
        length_sigma=np.array([LENGTH_SIGMA]),
        certified=True,
    )
    touches = blank(theta, TOUCH, 60, ("probe",), place=place, fixed=length)
    factor = 1e-4
    grown = np.zeros(len(model.parameters))
    for k, parameter in enumerate(model.parameters):
        if parameter.field in ("a", "d"):
            grown[k] = factor * getattr(arm.robot, parameter.field)[parameter.index]
    active = np.ones(len(grown), dtype=bool)
    frames = InstrumentFrames(np.zeros((0, 3, 3)), np.zeros((0, 3)), PROBE[None], ANYWHERE)
    linear = linearise(model, touches, active, 0 * grown, frames, np.tile(np.eye(3), (1, 1, 1)))
    assert np.abs(linear.z).max() < 1 * UM  # the poses do touch
    K = len(grown)

    def left(A):
        column, others = A[:, :K] @ (grown / model.prior), A[:, K:]
        assert np.abs(column).max() > 20 * UM
        return np.abs(column - others @ np.linalg.lstsq(others, column, rcond=None)[0]).max()

    A = linear.A.reshape(-1, linear.A.shape[2])
    assert left(A) < 0.01 * UM
    assert left(np.vstack([A, linear.C * NOISE])) > 5 * UM


def test_a_distance_is_left_out_with_either_of_its_poses(everything):
    """Else its other end would be predicted from what was measured there."""
    for fold in range(FOLDS):
        out = held_out_rows(everything, fold)
        poses = np.flatnonzero(blocks_of_poses(everything) % FOLDS == fold)
        for ends in (everything.pose, everything.ends.pose):
            assert not np.isin(ends[~out], poses).any()
        assert np.isin(everything.pose[out], poses).any()


def test_a_row_of_one_number_counts_as_a_coordinate_of_a_place(model, everything):
    active = np.zeros(len(model.parameters), dtype=bool)
    fitted = fit(model, everything, active, robust=False)
    one = everything.numbers == 1
    left = np.linalg.norm(fitted.residual, axis=1)
    ratio = cross_validate(model, everything, fitted).distance / left
    assert np.median(ratio[one]) == pytest.approx(np.sqrt(3), rel=0.15)
    assert np.median(ratio[~one]) == pytest.approx(1, rel=0.15)
