r"""Rotation vectors and matrices, row by row.

A rotation vector w turns by \|w\| about w/\|w\|:  R = I + a [w] + b [w]^2 with a = sin|w|/|w|, b = (1 - cos|w|)/|w|^2.
"""

import numpy as np

from compgen.arrays import Array


def cross_matrix(w: Array) -> Array:
    """[w] with [w] v = w x v, (..., 3) to (..., 3, 3)."""
    matrix = np.zeros((*w.shape[:-1], 3, 3))
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -w[..., 2], w[..., 1], -w[..., 0]
    return np.asarray(matrix - np.swapaxes(matrix, -1, -2))


def matrix_of(w: Array) -> Array:
    """Rotation matrices of rotation vectors [rad], (..., 3) to (..., 3, 3)."""
    angle = np.linalg.norm(w, axis=-1)[..., None, None]
    a = np.sinc(angle / np.pi)
    b = np.sinc(angle / (2 * np.pi)) ** 2 / 2
    m = cross_matrix(w)
    return np.asarray(np.eye(3) + a * m + b * (m @ m))


def vector_of(rotation: Array) -> Array:
    r"""Rotation vectors [rad] of rotation matrices, (..., 3, 3) to (..., 3); angles up to pi.

    By the unit quaternion q = (w, v): 4 q_k q is column k of the symmetric matrix below for every k, and the column of
    the largest \|q_k\| is free of cancellation. Then the vector is 2 atan2(|v|, w) v / |v|.
    """
    r = rotation
    trace = np.trace(r, axis1=-2, axis2=-1)
    squares = np.stack([trace, r[..., 0, 0], r[..., 1, 1], r[..., 2, 2]], axis=-1)
    k = np.argmax(squares, axis=-1)[..., None]
    axial = [r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]]
    pair = {(i, j): r[..., i, j] + r[..., j, i] for i, j in ((0, 1), (0, 2), (1, 2))}
    own = [1 + 2 * r[..., i, i] - trace for i in range(3)]
    columns = [
        [1 + trace, *axial],
        [axial[0], own[0], pair[0, 1], pair[0, 2]],
        [axial[1], pair[0, 1], own[1], pair[1, 2]],
        [axial[2], pair[0, 2], pair[1, 2], own[2]],
    ]
    q = np.choose(k, [np.stack(column, axis=-1) for column in columns])
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    w, v = q[..., :1], q[..., 1:]
    v = np.where(w < 0, -v, v)
    sine = np.linalg.norm(v, axis=-1, keepdims=True)
    small = sine < 1e-12
    scale = np.where(small, 2.0, 2 * np.arctan2(sine, np.abs(w)) / np.where(small, 1.0, sine))
    return np.asarray(scale * v)


def between(start: Array, end: Array, fraction: Array) -> Array:
    """Rotation at a fraction of the shortest turn from start to end, (M, 3, 3)."""
    turn = vector_of(np.swapaxes(start, -1, -2) @ end)
    return np.asarray(start @ matrix_of(fraction[..., None] * turn))


def from_wpr(w: Array, p: Array, r: Array) -> Array:
    """R = Rz(r) Ry(p) Rx(w), FANUC's fixed X-Y-Z angles [rad], (N,) each to (N, 3, 3)."""
    cw, sw, cp, sp, cr, sr = np.cos(w), np.sin(w), np.cos(p), np.sin(p), np.cos(r), np.sin(r)
    rows = [
        [cr * cp, cr * sp * sw - sr * cw, cr * sp * cw + sr * sw],
        [sr * cp, sr * sp * sw + cr * cw, sr * sp * cw - cr * sw],
        [-sp, cp * sw, cp * cw],
    ]
    return np.moveaxis(np.asarray(rows), (0, 1), (-2, -1))


def to_wpr(rotation: Array) -> tuple[Array, Array, Array]:
    """W, P, R [rad] of rotation matrices; at \\|P\\| = 90 deg, where only W -/+ R is fixed, R = 0."""
    r11, r21, r31 = rotation[..., 0, 0], rotation[..., 1, 0], rotation[..., 2, 0]
    cos_p = np.hypot(r11, r21)
    p = np.arctan2(-r31, cos_p)
    lost = cos_p < 1e-9
    w = np.where(
        lost,
        np.arctan2(-rotation[..., 1, 2], rotation[..., 1, 1]),
        np.arctan2(rotation[..., 2, 1], rotation[..., 2, 2]),
    )
    r = np.where(lost, 0.0, np.arctan2(r21, r11))
    return w, p, r
