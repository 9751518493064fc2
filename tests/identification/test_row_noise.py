"""What noise is said to be by the rows of a fit: shared by poses or not, and how far off a row of it may be."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.stats import chi2

from compgen.identification.evidence import Posterior, Scales
from compgen.identification.fit import pose_noise
from compgen.identification.linearisation import Linearisation
from compgen.identification.measurements import DISTANCE, PLACE, blank_rows
from compgen.identification.outliers import leave_one_out_distance, outlier_threshold


@pytest.mark.parametrize(("rows", "numbers"), [(1, 3), (50, 1), (2000, 3)])
def test_noise_sets_a_row_of_all_aside_once_in_a_hundred_campaigns(rows, numbers):
    assert chi2.sf(outlier_threshold(rows, numbers), numbers) * rows == pytest.approx(0.01)


def test_how_far_a_row_is_from_what_the_others_say_is_found_by_leaving_it_out():
    """Places and distances of a linear arm, of their own sigmas; one row was set aside before.

    With its shared noise a row of a pose is as uncertain as sqrt(1 + rho), and what is left out says nothing.
    """
    rng = np.random.default_rng(4)
    N, D, rho, noise = 12, 5, 0.6, np.array([2.0, 0.5, 3.0, 1.0, 1.0])
    data = blank_rows(np.zeros((N, 6)), np.arange(N), ("",) * N, 0)
    far = np.arange(N) >= 8
    ends = replace(data.ends, distance=np.where(far, 0.1, np.nan), kind=np.where(far, DISTANCE, PLACE))
    data = replace(data, sigma=rng.uniform(0.5, 2, N), ends=ends)
    variance = noise[data.kind] * (data.sigma**2 + rho * (data.kind == PLACE))
    A, y = rng.normal(size=(N, 3, D)), rng.normal(size=(N, 3))
    A[far, 1:], y[far, 1:] = 0.0, 0.0
    outlier = np.arange(N) == 3

    def solved(rows):
        root = np.sqrt(variance[rows])[:, None]
        B = (A[rows] / root[:, :, None]).reshape(-1, D)
        C = np.linalg.inv(B.T @ B + np.eye(D))
        return C @ B.T @ (y[rows] / root).ravel(), C

    x, C = solved(np.flatnonzero(~outlier))
    linear = SimpleNamespace(A=A, z=y - A @ x)
    solution = SimpleNamespace(covariance=C, scales=Scales(np.ones(1), noise, rho))
    found = leave_one_out_distance(cast(Linearisation, linear), cast(Posterior, solution), data, outlier)
    for n in range(N):
        others, C_others = solved(np.flatnonzero(~outlier & (np.arange(N) != n)))
        k = 1 if far[n] else 3
        off, slope = (y[n] - A[n] @ others)[:k], A[n, :k]
        assert found[n] == pytest.approx(
            off @ np.linalg.solve(slope @ C_others @ slope.T + variance[n] * np.eye(k), off)
        )


def test_a_row_that_the_fit_follows_wherever_it_goes_is_taken_to_have_a_tenth_of_its_noise():
    data = blank_rows(np.zeros((1, 6)), np.zeros(1, dtype=int), ("",), 0)
    linear = SimpleNamespace(A=np.eye(3)[None], z=np.array([[0.3, 0.0, 0.4]]))
    solution = SimpleNamespace(covariance=7.0 * np.eye(3), scales=Scales(np.ones(1), np.full(5, 7.0)))
    rows = cast(Linearisation, linear), cast(Posterior, solution), data
    assert leave_one_out_distance(*rows, np.array([False])) == pytest.approx([0.25 / 0.7])
    assert leave_one_out_distance(*rows, np.array([True])) == pytest.approx([0.25 / 14])


def shared(rng, poses, rows, rho, sigma, reflectors=3):
    """Measurements at poses of so many rows each, and residuals of which the rows of a pose share a part."""
    pose = np.repeat(np.arange(poses), rows)
    data = replace(
        blank_rows(np.zeros((poses, 6)), pose, ("",) * len(pose), 0),
        reflectors=("a", "b", "c")[:reflectors], instruments=("t",), aligned=np.array([False]),
    )  # fmt: skip
    data = replace(data, sigma=np.where(np.arange(len(pose)) % 2, 1.0, 1.5))
    own = rng.normal(0, sigma, (len(pose), 3)) * data.sigma[:, None]
    return data, own + rng.normal(0, np.sqrt(rho) * sigma, (poses, 3))[pose]


def test_what_rows_of_a_pose_share_is_counted_pose_by_pose():
    data, z = shared(np.random.default_rng(1), 60, 3, 1.5, 2e-5)
    data = replace(data, instruments=("t", "u"), aligned=np.zeros(2, dtype=bool))
    used = (np.arange(180) % 7 > 0) & (data.pose > 0)  # of the first pose nothing
    found = pose_noise(data, z, used, 12.5)
    assert found is not None
    within, between, own = 0.0, 0.0, 0
    for m in range(1, 60):
        rows = (z / data.sigma[:, None])[used & (data.pose == m)]
        within += ((rows - rows.mean(axis=0)) ** 2).sum()
        between += len(rows) * (rows.mean(axis=0) ** 2).sum()
        own += len(rows) - 1
    within /= 3 * own - 3 * 2  # three reflectors, told but for their common shift
    between /= 3 * 59 - 12.5 - 2 * 6 - 3  # the parameters, two frames, that shift
    weights = [(1 / data.sigma)[used & (data.pose == m)] for m in range(1, 60)]
    count = np.mean([w.sum() ** 2 / len(w) for w in weights])  # what a common shift adds to the squares of a mean
    assert found.variance == pytest.approx(within)
    assert found.rho == pytest.approx((between / within - 1) / count)
    freedoms = 2 / (3 * 59 - 27.5) + 2 / (3 * own - 6)
    assert found.spread == pytest.approx(between / within * np.sqrt(freedoms) / count)


def test_what_poses_share_is_as_much_at_rows_of_another_sigma():
    """Half of the poses by an instrument of a tenth of the noise: what the arm does at a pose is the same at both.

    It was told as a share of each row's own sigma: five times too much of it.
    """
    rng, found, pose = np.random.default_rng(3), [], np.repeat(np.arange(60), 3)
    data, _ = shared(rng, 60, 3, 0.0, 1.0)
    data = replace(data, sigma=np.where(pose % 2, 1.0, 0.1))
    for _ in range(200):
        z = rng.normal(size=(180, 3)) * data.sigma[:, None] + rng.normal(0, np.sqrt(0.04), (60, 3))[pose]
        noise = pose_noise(data, z, np.ones(180, dtype=bool), 0.0)
        assert noise is not None
        found.append(noise.rho)
    assert np.mean(found) == pytest.approx(0.04 * 177 / 168, rel=0.1)  # of 171 numbers between poses none is taken up


def test_the_noise_of_poses_is_found_as_well_as_it_says():
    rng, found = np.random.default_rng(2), []
    for _ in range(200):
        data, z = shared(rng, 60, 3, 1.5, 2e-5)
        z /= data.sigma[:, None]  # of rows of one sigma
        noise = pose_noise(replace(data, sigma=np.ones(180)), z, np.ones(180, dtype=bool), 0.0)
        assert noise is not None
        found.append(noise)
    assert np.std([f.rho for f in found]) == pytest.approx(np.mean([f.spread for f in found]), rel=0.2)


@pytest.mark.parametrize(
    ("poses", "twice", "known", "told"),
    [(13, 13, 0, True), (13, 13, 1, False), (20, 11, 0, True), (20, 10, 0, False), (60, 0, 0, False)],
)
def test_few_rows_do_not_tell_what_poses_share(poses, twice, known, told):
    """Thirty numbers between poses, less nine of a frame and a shift, and thirty within, less three of a reflector."""
    data, z = shared(np.random.default_rng(1), poses, 2, 0.5, 1.0, 2)
    rows = (np.arange(2 * poses) % 2 == 0) | (data.pose < twice)
    assert (pose_noise(data, z, rows, known) is not None) == told
