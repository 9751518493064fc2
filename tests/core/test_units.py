"""Conversion factors by hand."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core import units


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (1450 * units.MM, 1.45),  # m
        (122 * units.UM, 122e-6),  # m
        (180 * units.DEG, np.pi),  # rad
        (2000 * units.MDEG, 2 * np.pi / 180),  # rad
        (6.5 * units.HOUR, 23400),  # s
        (2 * units.MINUTE, 120),  # s
        (8 * units.MS, 0.008),  # s
        (20 * units.INCH, 0.508),  # m
        (1000 * units.KB, 1e6),  # bytes
    ],
)
def test_units_by_hand(value, expected):
    assert_allclose(value, expected, rtol=1e-15)


def test_a_limit_in_words_is_never_longer_than_it_is_and_at_most_a_tenth_shorter():
    seconds = {"hour": 3600, "minute": 60, "second": 1}
    drawn = np.random.default_rng(29).uniform(0, 1, 400)
    limits = [*(10 ** (5 * drawn)).tolist(), 1068.999, 59.999, 3599.999, 35999.999]
    for limit in limits:
        words = units.limit_words(limit).split()
        parts = [(int(n), unit.removesuffix("s")) for n, unit in zip(words[::2], words[1::2], strict=True)]
        seconds_in_words = sum(n * seconds[unit] for n, unit in parts)
        assert 0.9 * limit - 1 < seconds_in_words <= limit, (limit, words)
    assert units.limit_words(1068.9) == "17 minutes"
    assert units.limit_words(57600) == "16 hours"
    assert units.limit_words(7500) == "2 hours 5 minutes"
    assert units.limit_words(0.9) == "0 seconds"
