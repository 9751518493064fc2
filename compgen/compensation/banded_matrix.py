r"""Symmetric matrices on a band of half-width 12: six unknowns a waypoint, coupled up to two waypoints on.

A waypoint's six unknowns are coupled with each other (``block``), its first three with those of its neighbours
(``coupling``), and each with itself up to two waypoints on (``problem``, the same for all six).
"""

import numpy as np

from compgen.core.arrays import Array, BoolArray

HALF_WIDTH = 12


def assemble(smoothness: Array, block: Array, coupling: Array, fixed: BoolArray) -> Array:
    """Upper band of the whole matrix, (13, 6 N); fixed entries stand alone.

    Args:
        smoothness: Banded, (3, N).
        block: Of each waypoint, (N, 6, 6).
        coupling: Of the first three unknowns of neighbours, (N - 1, 3, 3).
        fixed: Entries that stay as they are, (6 N,).
    """
    N = len(block)
    ab = np.zeros((HALF_WIDTH + 1, N, 6))
    for i in range(6):
        for j in range(i, 6):
            ab[HALF_WIDTH - (j - i), :, j] += block[:, i, j]
    for i in range(3):
        for j in range(3):
            ab[HALF_WIDTH - (6 + j - i), 1:, j] += coupling[:, i, j]
    ab[HALF_WIDTH] += smoothness[2][:, None]
    ab[HALF_WIDTH - 6] += smoothness[1][:, None]
    ab[HALF_WIDTH - 12] += smoothness[0][:, None]
    band = ab.reshape(HALF_WIDTH + 1, 6 * N)
    for k in range(1, HALF_WIDTH + 1):
        band[HALF_WIDTH - k, k:][fixed[k:] | fixed[:-k]] = 0.0
        band[HALF_WIDTH - k, :k] = 0.0
    band[HALF_WIDTH, fixed] = 1.0
    return np.asarray(band)


def smoothness_times(smoothness: Array, x: Array) -> Array:
    """The smoothness matrix, banded (3, N), times each component of x, (N, 6)."""
    second, first, diagonal = smoothness
    product: Array = diagonal[:, None] * x
    product[1:] += first[1:, None] * x[:-1]
    product[:-1] += first[1:, None] * x[1:]
    product[2:] += second[2:, None] * x[:-2]
    product[:-2] += second[2:, None] * x[2:]
    return product


def times(matrices: Array, rows: Array) -> Array:
    """Each matrix (N, 6, 6) times its row (N, 6)."""
    return np.asarray(np.einsum("nij,nj->ni", matrices, rows))


def transposed_times(matrices: Array, rows: Array) -> Array:
    """The transpose of each matrix (N, 6, 6) times its row (N, 6)."""
    return np.asarray(np.einsum("nij,ni->nj", matrices, rows))
