"""Starts that stand for an ensemble: their weighted means are those over all of it, and its corners are flown."""

import numpy as np
import pytest

from compgen.thermal.ensemble import Ensemble, Start, starts_to_fly, weighted_starts

WIDE = Ensemble((100.0, 4000.0), (0.25, 0.5, 1.0), (0, 39))


def mean(ensemble, quantity):
    starts, weights = weighted_starts(ensemble)
    return sum(weight * quantity(start) for start, weight in zip(starts, weights.tolist(), strict=True))


def test_weighted_means_over_delays_are_integrals():
    for ensemble in (WIDE, Ensemble((100.0, 4000.0))):
        assert mean(ensemble, lambda s: 1.0) == pytest.approx(1)
        integral = 1500 * (np.exp(-100 / 1500) - np.exp(-4000 / 1500)) / 3900
        assert mean(ensemble, lambda s: np.exp(-s.delay / 1500)) == pytest.approx(integral, rel=1e-9)
        assert mean(ensemble, lambda s: s.delay**2) == pytest.approx((4000**3 - 100**3) / 3 / 3900)


def test_runs_left_out_count_with_their_neighbours():
    assert mean(WIDE, lambda s: s.run) == pytest.approx(19.5, rel=0.01)
    assert mean(WIDE, lambda s: (s.run - 19.5) ** 2) == pytest.approx(np.var(np.arange(40)), rel=0.05)
    assert mean(WIDE, lambda s: s.override) == pytest.approx(1.75 / 3)


def test_both_ends_of_the_delays_are_foretold_whatever_they_count():
    starts, _ = weighted_starts(WIDE)
    assert {100.0, 4000.0} <= {s.delay for s in starts}
    assert {0, 39} <= {s.run for s in starts}
    assert weighted_starts(Ensemble())[0] == [Start()]


def test_corners_and_middle_are_flown_each_once():
    assert starts_to_fly(Ensemble()) == [Start()]
    assert starts_to_fly(Ensemble((0.0, 60.0))) == [Start(), Start(0, 60.0), Start(0, 30.0)]
    assert starts_to_fly(Ensemble((0.0, 60.0)), Start(0, 60.0), Start(0, 45.0))[3:] == [Start(0, 45.0)]
    assert len(starts_to_fly(WIDE)) == 9
