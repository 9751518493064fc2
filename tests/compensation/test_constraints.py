"""Each kind of constraint on a band's unknowns, its value against a formula of its own, its derivatives against it."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.compensation.constraints import Balls, Box, Changes, Rows

N, STEP = 5, 1e-6
RNG = np.random.default_rng(3)
X = RNG.normal(size=(N, 6))
SQUARE, SIX, LOW, HIGH = RNG.normal(size=(N, 6, 6)), RNG.normal(size=(N, 6)), -np.ones(6), 2 * np.ones(6)
ROWS = RNG.normal(size=(N, 4, 6))
RADII, APART = np.array([0.7, 1.9]), RNG.uniform(0.5, 2, N - 1)
EVERY = np.ones((2, N, 6), dtype=bool)
#: each kind, and one value of it by hand: its place, and a formula of x
KINDS: dict[str, tuple[Any, Any]] = {
    "box": (
        Box(included=EVERY, rows=np.arange(N), x=0 * X, f=SIX, jacobian=SQUARE, lower=LOW, upper=HIGH),
        ((1, 3, 2), lambda x: -1 - SIX[3, 2] - sum(SQUARE[3, 2, i] * x[3, i] for i in range(6))),
    ),
    "rows": (
        Rows(np.ones((N, 4), dtype=bool), 0 * X, SIX[:, :4], ROWS),
        ((2, 3), lambda x: SIX[2, 3] + sum(ROWS[2, 3, i] * x[2, i] for i in range(6))),
    ),
    "balls": (
        Balls(np.ones((N, 2), dtype=bool), RADII),
        ((4, 1), lambda x: (x[4, 3] ** 2 + x[4, 4] ** 2 + x[4, 5] ** 2 - 1.9**2) / 3.8),
    ),
    "changes": (
        Changes(np.ones(N - 1, dtype=bool), APART),
        ((1,), lambda x: (sum((x[2, i] - x[1, i]) ** 2 for i in range(3)) - APART[1] ** 2) / (2 * APART[1])),
    ),
}


def matrix(derivative, ratio, lam):
    """A' ratio A + sum lam g'' of all unknowns, (6 N, 6 N)."""
    block, coupling = np.zeros((N, 6, 6)), np.zeros((N - 1, 3, 3))
    derivative.add_hessian(ratio, lam, block, coupling)
    whole = np.zeros((N, 6, N, 6))
    for n in range(N):
        whole[n, :, n] = block[n]
    for n in range(N - 1):
        whole[n + 1, :3, n, :3], whole[n, :3, n + 1, :3] = coupling[n], coupling[n].T
    return whole.reshape(6 * N, 6 * N)


def pulled(constraint, x, y):
    gradient = np.zeros((N, 6))
    constraint.about(x).add_transposed(y, gradient)
    return gradient.ravel()


def slope(function, x):
    """Central differences by each unknown, (values, 6 N)."""
    steps = STEP * np.eye(6 * N).reshape(-1, N, 6)
    return np.stack([(function(x + s) - function(x - s)).ravel() / (2 * STEP) for s in steps], axis=1)


@pytest.mark.parametrize("kind", KINDS)
def test_a_value_is_that_of_its_formula(kind):
    constraint, (place, formula) = KINDS[kind]
    value = constraint.value(X)
    assert value.shape == constraint.included.shape
    assert_allclose(value[place], formula(X), rtol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_are_those_of_the_value(kind):
    constraint, _ = KINDS[kind]
    A, shape = slope(constraint.value, X), constraint.included.shape
    y, ratio = RNG.normal(size=shape), RNG.uniform(size=shape)
    dx = RNG.normal(size=(N, 6))
    assert_allclose(constraint.about(X).times(dx).ravel(), A @ dx.ravel(), atol=1e-8)
    assert_allclose(pulled(constraint, X, y), A.T @ y.ravel(), atol=1e-8)
    bent = slope(lambda x: pulled(constraint, x, y), X)  # sum y g''
    assert_allclose(matrix(constraint.about(X), ratio, y), A.T @ (ratio.ravel()[:, None] * A) + bent, atol=1e-7)
