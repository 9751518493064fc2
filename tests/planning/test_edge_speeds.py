"""Jerk-limited changes of speed by hand, and how fast a block may be left."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.planning.retiming.blocks import Blocks, Partition, change_duration, reachable_speed, stop_ramps


@pytest.mark.parametrize(("dv", "expected"), [(0.08, 0.4), (0.02, 0.2), (0.32, 1.0)])
def test_duration_of_a_change_of_speed_by_hand(dv, expected):
    """a = 0.4 m/s2 and j = 2 m/s3: full acceleration is reached from 0.08 m/s on."""
    assert_allclose(change_duration(np.array([dv]), np.array([0.4]), np.array([2.0])), expected, rtol=1e-14)


def test_reachable_speed_takes_the_whole_length():
    rng = np.random.default_rng(9)
    v0, length = rng.uniform(0, 0.1, 300), rng.uniform(0.1, 1, 300)
    a, j = rng.uniform(0.1, 5, 300), rng.uniform(1, 50, 300)
    v1 = reachable_speed(v0, length, a, j)
    assert_allclose((v0 + v1) / 2 * change_duration(v1 - v0, a, j), length, rtol=1e-6)


@pytest.mark.parametrize(
    ("speeds", "ramps"),
    [
        ([0, 4, 4, 4, 0], [True, False, False, True]),
        ([0, 2, 4, 4, 3, 0], [True, True, False, True, True]),
        ([0, 4, 3, 4, 0], [True, False, False, True]),  # slower in the middle is no ramp of a stop
        ([0, 3, 0], [True, True]),
        ([0, 0], [True]),
    ],
)
def test_ramps_of_stops_are_those_up_to_the_full_speed_and_from_it(speeds, ramps):
    """On two ways alike, one behind the other: mm/s at the edges of their blocks, of at most 4 mm/s each."""
    B, ones = len(ramps), np.ones(2 * len(ramps))
    v0, v1 = np.tile(speeds[:-1], 2) * 1e-3, np.tile(speeds[1:], 2) * 1e-3
    blocks = Blocks(start=np.arange(2.0 * B), length=ones, v0=v0, v1=v1, v=4e-3 * ones, a=ones, j=ones)
    run = np.repeat([0, 1], B)
    partition = Partition(blocks.start, blocks.start + 1, run, np.array([0, B]))
    assert stop_ramps(blocks, partition).tolist() == 2 * ramps
