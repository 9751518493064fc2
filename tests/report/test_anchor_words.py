"""Evidence of an anchoring in words for an operator: by hand, from the definition of a likelihood ratio."""

import numpy as np
import pytest
from scipy.stats import chi2

from compgen.report.anchor import explains_words, likely_words


@pytest.mark.parametrize(
    ("times", "words"),
    [
        (1.0, "the likeliest"),
        (2.9, "about as likely"),
        (7.4, "7 times less likely"),
        (12.0, "10 times less likely"),
        (640.0, "600 times less likely"),
        (2000.0, "can be left aside"),
        (1e300, "can be left aside"),
    ],
)
def test_a_logarithm_is_said_as_times(times, words):
    assert likely_words(-float(np.log(times))) == words


@pytest.mark.parametrize(("chance", "words"), [(0.5, "yes"), (0.02, "yes"), (0.005, "hardly"), (1e-6, "no")])
def test_touches_are_explained_as_their_scatter_is_likely(chance, words):
    assert explains_words(float(chi2.isf(chance, 18)), 18) == words
