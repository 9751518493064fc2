"""What the frames can do is taken from the parameters, and what they can do only in rounding is not."""

from types import SimpleNamespace
from typing import cast

import numpy as np
from numpy.testing import assert_allclose

from compgen.identification.fit import Fit
from compgen.identification.identifiability import assess_identifiability
from compgen.identification.measurements import Measurements
from compgen.identification.model import ArmModel


def stand_in(columns, parameter):
    """A fit of one parameter with frames that move the rows along some columns."""
    rows = len(parameter) // 3
    A = np.column_stack([parameter, columns]).reshape(rows, 3, -1)
    posterior = SimpleNamespace(covariance=np.eye(A.shape[2]), scales=SimpleNamespace(group=np.ones(1)))
    fitted = SimpleNamespace(
        active=np.array([True]), outlier=np.zeros(rows, dtype=bool), noise=1.0, posterior=posterior,
        noise_of_row=np.ones(rows), linear=SimpleNamespace(A=A, C=np.zeros((0, A.shape[2]))),
    )  # fmt: skip
    data = SimpleNamespace(sigma=np.ones(rows), aligned=np.array([False]), instrument=np.zeros(rows, dtype=int))
    model = SimpleNamespace(groups=lambda: ((), np.zeros(1, dtype=int)))
    # what stands in for them has what is asked of them
    return assess_identifiability(cast(ArmModel, model), cast(Measurements, data), cast(Fit, fitted))


def test_columns_that_differ_by_rounding_are_one_direction():
    """Eigenvalues of the frames below 1e-10 of the largest, 4 here, are nothing that a frame can do.

    Four unit columns a, a, a, a + d b have the eigenvalue 3/4 d^2 along b.
    """
    a, b = np.eye(6)[0], np.eye(6)[1]
    for eigenvalue, left in ((1e-10, 5.0), (1.6e-9, 0.0)):  # 4e-10 is between
        columns = np.column_stack([a, a, a, a + np.sqrt(4 / 3 * eigenvalue) * b])
        fit_of_b = stand_in(columns, 5 * b)
        assert_allclose(fit_of_b.singular_values, [left], atol=1e-3)


def test_a_parameter_that_does_what_a_frame_does_is_not_seen():
    a, b, c = np.eye(6)[:3]
    assert_allclose(stand_in(np.column_stack([a, b]), 3 * a + 4 * c).singular_values, [4.0], atol=1e-12)
