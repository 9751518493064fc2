"""Logs of more rows than positions: a logger that asks more often than the controller answers."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.verification.executed.position_log import read_position_log


def read(folder, time, x):
    rows = [f"{t:.4f},{v:.3f},0,100,180,0,0" for t, v in zip(time, x, strict=True)]
    (folder / "log.csv").write_text("\n".join(["time_s,x_mm,y_mm,z_mm,w_deg,p_deg,r_deg", *rows, ""]))
    log = read_position_log(folder / "log.csv")
    return log.time, log.place[:, 0] * 1e3, log.row


@pytest.mark.parametrize("times", [2, 3])
def test_positions_that_are_repeated_count_once_and_in_their_middle_but_where_the_robot_stands(tmp_path, times):
    place = np.concatenate([np.zeros(50), 0.8 * np.arange(1, 101), np.full(50, 80.0)])
    x = np.repeat(place, times)
    time = 5.0 + 0.004 * np.arange(len(x))
    seen, at, row = read(tmp_path, time, x)
    moving = (at > 0) & (at < 80)
    assert moving.sum() == 99
    assert_allclose(np.diff(seen[moving]), 0.004 * times, atol=1e-9)
    middle = np.array([time[np.isclose(x, v)].mean() for v in at[moving]])
    assert_allclose(seen[moving], middle, atol=1e-9)
    standing = row[~moving]
    assert len(standing) == (2 * 50 + 1) * times
    assert (np.diff(seen) > 0).all()


def test_a_few_positions_that_are_repeated_stay(tmp_path):
    x = np.repeat(0.8 * np.arange(100), [2 if k % 7 == 0 else 1 for k in range(100)])
    time = 0.008 * np.arange(len(x))
    seen, at, _ = read(tmp_path, time, x)
    assert_allclose(seen, time)
    assert_allclose(at, x, atol=1e-9)
