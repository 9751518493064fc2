"""A figure in words: numbers of three figures, and the way in which a curve goes."""

import numpy as np
import pytest

from compgen.report.curves import course, rounded_number, sentence

HOURS = np.linspace(0, 1, 20)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (100 * HOURS, "error between 0.00 and 100 µm, rising"),
        (100 - 100 * HOURS, "error between 0.00 and 100 µm, falling"),
        (100 + 5 * HOURS, "error between 100 and 105 µm, level"),
        (100 * np.sin(7 * HOURS), "error between -99.7 and 99.5 µm"),
        (np.array([np.nan, 2.0]), "error 2.00 µm"),
        (np.array([np.nan]), "error unknown"),
    ],
)
def test_a_curve_says_its_range_and_its_way(values, words):
    assert course("error", values, "µm") == words


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (0.0, "0.00"),
        (-0.001, "0.00"),
        (0.123, "0.12"),
        (1.234, "1.23"),
        (9.996, "10.0"),
        (99.96, "100"),
        (123.4, "123"),
        (12345.6, "12,346"),
    ],
)
def test_a_number_has_three_figures(value, words):
    assert rounded_number(value) == words


def test_a_figure_of_nothing_says_so():
    assert sentence("Errors", ["", ""]) == "Errors: nothing."
