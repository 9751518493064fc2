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
