"""Changes of override among windows of rates, and what is none."""

import numpy as np
import pytest

from compgen.verification.executed.clock_rates import Windows, stretches_of, window_rates


def windows(*levels, noise=1e-3, seed=0):
    """Windows of half a second, (count, rate) after (count, rate)."""
    rate = np.concatenate([np.full(n, r) for n, r in levels])
    rate = rate + noise * np.random.default_rng(seed).normal(size=len(rate))
    begin = 0.5 * np.arange(len(rate), dtype=np.float64)
    return Windows(rate, begin, begin + 0.5)


@pytest.mark.parametrize("seed", range(5))
def test_levels_are_found_with_their_edges(seed):
    stretches, _ = stretches_of(windows((40, 1.0), (30, 0.5), (50, 0.98), noise=2e-3, seed=seed))
    assert [s.override for s in stretches] == [1.0, 0.5, 0.98]
    assert [s.begin for s in stretches] == [0.0, 20.0, 35.0]


def test_a_short_slight_dip_is_the_controller_s_own_and_a_long_one_is_not():
    assert len(stretches_of(windows((40, 1.0), (4, 0.95), (40, 1.0)))[0]) == 1
    assert len(stretches_of(windows((40, 1.0), (20, 0.95), (40, 1.0)))[0]) == 3


def test_noise_alone_is_one_level():
    for seed in range(20):
        (stretch,), spread = stretches_of(windows((200, 0.73), noise=0.01, seed=seed))
        assert stretch.rate == pytest.approx(0.73, abs=5 * stretch.sigma + 1e-4)
        assert spread == pytest.approx(0.01, rel=0.3)


def test_rates_are_slopes_run_by_run():
    time = np.arange(0, 20, 0.008)
    run = 1 + (time > 10)
    clock = np.where(run == 1, 0.6 * time, 0.6 * time + 5.0)  # a stop between
    windows = window_rates(time, clock, run, np.ones(len(time), dtype=bool))
    np.testing.assert_allclose(windows.rate, 0.6, atol=1e-9)
    assert not ((windows.begin < 10) & (windows.end > 10.01)).any()
