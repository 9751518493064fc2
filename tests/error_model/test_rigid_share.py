"""What touches and a path share, by motions typed here and by numpy's least squares."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.error_model.rigid_share import design_of, rigid_share

SHIFT, TURN, PROBE = np.array([30e-6, -20e-6, 50e-6]), np.array([4e-5, -7e-5, 9e-5]), np.array([1e-5, -3e-5, 6e-5])
ATOL_M = 1e-12


@pytest.fixture
def cell():
    """Touches around a part, tilted, and places on it: places and rotations of the flange."""
    rng = np.random.default_rng(5)

    def flange(count, tilt):
        w = rng.uniform(-tilt, tilt, (count, 2))
        x, y = w.T
        none, one = np.zeros(count), np.ones(count)
        about_x = np.array([[one, none, none], [none, np.cos(x), -np.sin(x)], [none, np.sin(x), np.cos(x)]])
        about_y = np.array([[np.cos(y), none, np.sin(y)], [none, one, none], [-np.sin(y), none, np.cos(y)]])
        return np.einsum("ijn,jkn->nik", about_x, about_y) @ np.diag([1.0, -1.0, -1.0])

    place = np.array([1.3, 0.0, 0.2]) + rng.uniform(-0.6, 0.6, (18, 3)) * [1, 1, 0.1]
    path = np.array([1.3, 0.0, 0.2]) + rng.uniform(-0.6, 0.6, (7, 3))
    return place, flange(18, 0.35), path, flange(7, 0.1)


def carried(place, about, rotation, probe):
    """Where a rigid motion of the part, and a probe that is longer, move each place, by cross products."""
    return SHIFT + np.cross(TURN, place - about) - np.einsum("nij,j->ni", rotation, probe)


def test_a_motion_of_frame_and_probe_is_taken_up_whole(cell):
    place, rotation, path, path_rotation = cell
    share = rigid_share(place, rotation)
    motion = share.motion(carried(place, place.mean(axis=0), rotation, PROBE)[:, :, None])
    assert_allclose(motion[:, 0], np.concatenate([SHIFT, TURN, PROBE]), atol=ATOL_M)
    on_path = carried(path, place.mean(axis=0), path_rotation, PROBE)[:, :, None]
    assert_allclose(on_path - design_of(path - share.middle, path_rotation) @ motion, 0, atol=ATOL_M)
    # with another tool what the probe took up is no error of the path
    of_frame = carried(path, place.mean(axis=0), path_rotation, 0 * PROBE)[:, :, None]
    assert_allclose(share.left(of_frame, motion, path), 0, atol=ATOL_M)


def test_what_is_no_motion_is_fitted_by_least_squares(cell):
    """From one side some touches tell one coordinate, and each has a sigma of its own: numpy says the same."""
    place, rotation, _, _ = cell
    rng = np.random.default_rng(6)
    column, along = rng.normal(size=(18, 3, 2)), rng.normal(size=(18, 3))
    along /= np.linalg.norm(along, axis=1)[:, None]
    along[:8] = np.nan
    sigma = rng.uniform(5e-6, 20e-6, 18)
    rows, values = [], []
    for n in range(18):
        lever = place[n] - place.mean(axis=0)
        D = np.column_stack([np.eye(3), np.array([np.cross(e, lever) for e in np.eye(3)]).T, -rotation[n]])
        for e in np.eye(3) if n < 8 else along[n : n + 1]:
            rows.append(e @ D / sigma[n])
            values.append(e @ column[n] / sigma[n])
    held = np.hstack([np.zeros((3, 6)), np.eye(3) / 5e-4])  # the probe is known to half a millimetre
    by_hand = np.linalg.lstsq(np.vstack([rows, held]), np.vstack([values, np.zeros((3, 2))]), rcond=None)[0]
    share = rigid_share(place, rotation, along, sigma, probe_sigma=5e-4)
    assert_allclose(share.motion(column), by_hand, rtol=1e-6, atol=1e-9)
    alone = rigid_share(place)
    left = alone.left(column, alone.motion(column), place)
    assert np.linalg.norm(left) < np.linalg.norm(column)
    assert_allclose(left.sum(axis=0), 0, atol=1e-9)  # no force and no moment is left
    arm = place - place.mean(axis=0)
    assert_allclose([np.cross(arm, left[:, :, q]).sum(axis=0) for q in range(2)], 0, atol=1e-9)
