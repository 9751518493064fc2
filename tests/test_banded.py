"""LAPACK without its package: scipy's own numbers."""

import numpy as np
import pytest
import scipy.linalg
from numpy.linalg import LinAlgError

from compgen.banded import cho_solve_banded, cholesky_banded, lapack


def system(n=50):
    """A definite matrix by its upper bands, and right-hand sides."""
    rng = np.random.default_rng(5)
    bands = rng.normal(size=(3, n))
    bands[2] = 10 + rng.random(n)
    return bands, rng.normal(size=(n, 6))


@pytest.mark.parametrize("columns", [np.s_[:], np.s_[:, 0]], ids=["many", "one"])
def test_the_numbers_are_scipys_to_the_last_bit(columns):
    bands, right = system()
    mine, theirs = cholesky_banded(bands), scipy.linalg.cholesky_banded(bands)
    assert np.array_equal(mine, theirs)
    b = right[columns]
    assert np.array_equal(cho_solve_banded((mine, False), b), scipy.linalg.cho_solve_banded((theirs, False), b))


def test_the_extension_is_found_by_itself():
    assert lapack().__name__ == "_flapack"


def test_what_is_not_definite_or_no_number_is_refused_as_by_scipy():
    bands, right = system()
    bands[2, 7] = -1.0
    with pytest.raises(LinAlgError, match="8-th leading minor"):
        cholesky_banded(bands)
    bands[2, 7] = np.nan
    with pytest.raises(ValueError, match="infs or NaNs"):
        cholesky_banded(bands)
    right[3, 3] = np.inf
    with pytest.raises(ValueError, match="infs or NaNs"):
        cho_solve_banded((cholesky_banded(system()[0]), False), right)
