r"""Kinds of constraints g(x) <= 0 on a band's unknowns x (N, 6), with their derivatives about a point.

    Box       lower <= f(x_n) <= upper            f linear about where it was last taken
    Rows      g_n + A_n (x_n - x0_n) <= 0         so many linear ones of a waypoint's own unknowns
    Balls     (|p|^2 - r^2) / 2r <= 0             p the first three of a waypoint's unknowns, and the last three
    Changes   (|p_n+1 - p_n|^2 - r^2) / 2r <= 0   p the first three

Each gives A = g', taken about x, three ways: A dx, A' y, and what it adds to the matrix, A' R A + sum lam g''.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from compgen.compensation.banded_matrix import times, transposed_times
from compgen.core.arrays import Array, BoolArray, IntArray, dot


class Derivative(Protocol):
    """A constraint's derivative about a point."""

    def times(self, dx: Array) -> Array:
        """A dx."""

    def add_transposed(self, y: Array, gradient: Array) -> None:
        """Adds A' y to a gradient (N, 6)."""

    def add_hessian(self, ratio: Array, lam: Array, block: Array, coupling: Array) -> None:
        """Adds A' ratio A + sum lam g'' to a matrix's blocks (N, 6, 6) and its coupling (N - 1, 3, 3)."""


class Constraint(Protocol):
    """One kind of constraint on all waypoints."""

    @property
    def included(self) -> BoolArray:
        """Which of them there are, in the shape of its values."""

    def value(self, x: Array) -> Array:
        """G at a point."""

    def about(self, x: Array) -> Derivative:
        """Its derivative about a point."""


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Box:
    """What depends on a waypoint's own unknowns stays between a lower and an upper bound, (2, N, 6)."""

    included: BoolArray  # (2, N, 6) upper, lower
    rows: IntArray  # (J,) waypoints of which any is
    x: Array  # (N, 6) where f was taken
    f: Array  # (N, 6)
    jacobian: Array  # (N, 6, 6)
    lower: Array  # (6,)
    upper: Array  # (6,)

    def value(self, x: Array) -> Array:
        """G at a point."""
        f = self.f + times(self.jacobian, x - self.x)
        return np.stack([f - self.upper, self.lower - f])

    def about(self, x: Array) -> Derivative:
        """The same everywhere."""
        return _BoxDerivative(self.rows, self.jacobian[self.rows])


@dataclass(frozen=True, eq=False, slots=True)
class _BoxDerivative:
    rows: IntArray
    jacobian: Array  # (J, 6, 6)

    def times(self, dx: Array) -> Array:
        df = np.zeros_like(dx)
        df[self.rows] = times(self.jacobian, dx[self.rows])
        return np.stack([df, -df])

    def add_transposed(self, y: Array, gradient: Array) -> None:
        gradient[self.rows] += transposed_times(self.jacobian, (y[0] - y[1])[self.rows])

    def add_hessian(self, ratio: Array, lam: Array, block: Array, coupling: Array) -> None:
        A = self.jacobian
        block[self.rows] += np.matmul(np.swapaxes(A, 1, 2), ratio.sum(axis=0)[self.rows, :, None] * A)


@dataclass(frozen=True, eq=False, slots=True)
class Rows:
    """Linear constraints on a waypoint's own unknowns, E of them at each, (N, E)."""

    included: BoolArray  # (N, E)
    x: Array  # (N, 6) where they were taken
    g: Array  # (N, E) there
    jacobian: Array  # (N, E, 6)

    def value(self, x: Array) -> Array:
        """G at a point."""
        return self.g + times(self.jacobian, x - self.x)

    def about(self, x: Array) -> Derivative:
        """The same everywhere."""
        return _RowsDerivative(self.jacobian)


@dataclass(frozen=True, eq=False, slots=True)
class _RowsDerivative:
    jacobian: Array  # (N, E, 6)

    def times(self, dx: Array) -> Array:
        return times(self.jacobian, dx)

    def add_transposed(self, y: Array, gradient: Array) -> None:
        gradient += transposed_times(self.jacobian, y)

    def add_hessian(self, ratio: Array, lam: Array, block: Array, coupling: Array) -> None:
        A = self.jacobian
        block += np.matmul(np.swapaxes(A, 1, 2), ratio[:, :, None] * A)


@dataclass(frozen=True, eq=False, slots=True)
class Balls:
    """The first and the last three of a waypoint's unknowns lie in balls, (N, 2)."""

    included: BoolArray  # (N, 2)
    radius: Array  # (2,)

    def value(self, x: Array) -> Array:
        """G at a point."""
        p, w = x[:, :3], x[:, 3:]
        return np.asarray((np.column_stack([dot(p, p), dot(w, w)]) - self.radius**2) / (2 * self.radius))

    def about(self, x: Array) -> Derivative:
        """Its derivative about a point."""
        return _BallsDerivative(x[:, :3] / self.radius[0], x[:, 3:] / self.radius[1], self.radius)


@dataclass(frozen=True, eq=False, slots=True)
class _BallsDerivative:
    first: Array  # (N, 3)
    last: Array  # (N, 3)
    radius: Array

    def times(self, dx: Array) -> Array:
        return np.column_stack([dot(self.first, dx[:, :3]), dot(self.last, dx[:, 3:])])

    def add_transposed(self, y: Array, gradient: Array) -> None:
        gradient[:, :3] += y[:, :1] * self.first
        gradient[:, 3:] += y[:, 1:] * self.last

    def add_hessian(self, ratio: Array, lam: Array, block: Array, coupling: Array) -> None:
        block[:, :3, :3] += _ball_hessian(ratio[:, 0], self.first, lam[:, 0] / self.radius[0])
        block[:, 3:, 3:] += _ball_hessian(ratio[:, 1], self.last, lam[:, 1] / self.radius[1])


@dataclass(frozen=True, eq=False, slots=True)
class Changes:
    """The first three unknowns differ from those of the waypoint before by no more than a radius, (N - 1,)."""

    included: BoolArray  # (N - 1,)
    radius: Array  # (N - 1,)

    def value(self, x: Array) -> Array:
        """G at a point."""
        d = np.diff(x[:, :3], axis=0)
        return np.asarray((dot(d, d) - self.radius**2) / (2 * self.radius))

    def about(self, x: Array) -> Derivative:
        """Its derivative about a point."""
        return _ChangesDerivative(np.diff(x[:, :3], axis=0) / self.radius[:, None], self.radius)


@dataclass(frozen=True, eq=False, slots=True)
class _ChangesDerivative:
    gradient: Array  # (N - 1, 3)
    radius: Array

    def times(self, dx: Array) -> Array:
        return dot(self.gradient, np.diff(dx[:, :3], axis=0))

    def add_transposed(self, y: Array, gradient: Array) -> None:
        gradient[1:, :3] += y[:, None] * self.gradient
        gradient[:-1, :3] -= y[:, None] * self.gradient

    def add_hessian(self, ratio: Array, lam: Array, block: Array, coupling: Array) -> None:
        hessian = _ball_hessian(ratio, self.gradient, lam / self.radius)
        block[:-1, :3, :3] += hessian
        block[1:, :3, :3] += hessian
        coupling -= hessian


def _ball_hessian(along: Array, rows: Array, isotropic: Array) -> Array:
    """Along (N,) times a row (N, 3) with itself, and isotropic (N,) times the identity."""
    return np.asarray((along[:, None] * rows)[:, :, None] * rows[:, None, :] + isotropic[:, None, None] * np.eye(3))
