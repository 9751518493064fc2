r"""Rotation vectors and matrices, row by row.

A rotation vector w turns by \|w\| about w/\|w\|:  R = I + a [w] + b [w]^2 with a = sin|w|/|w|, b = (1 - cos|w|)/|w|^2.
"""

from collections.abc import Sequence
from functools import lru_cache
from math import factorial
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array
from compgen.core.evaluation import BLOCK, evaluate, parallel_for


def cross_matrix(w: Array) -> Array:
    """[w] with [w] v = w x v, (..., 3) to (..., 3, 3)."""
    matrix = np.zeros((*w.shape[:-1], 3, 3))
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -w[..., 2], w[..., 1], -w[..., 0]
    return np.asarray(matrix - np.swapaxes(matrix, -1, -2))


def rotation_matrix(w: Array) -> Array:
    """Rotation matrices of rotation vectors [rad], (..., 3) to (..., 3, 3)."""
    angle = np.linalg.norm(w, axis=-1)[..., None, None]
    a = np.sinc(angle / np.pi)
    b = np.sinc(angle / (2 * np.pi)) ** 2 / 2
    m = cross_matrix(w)
    return np.asarray(np.eye(3) + a * m + b * (m @ m))


def rotation_vector(rotation: Array) -> Array:
    r"""Rotation vectors [rad] of rotation matrices, (..., 3, 3) to (..., 3); angles up to pi.

    By the unit quaternion q = (w, v): 4 q_k q is column k of the symmetric matrix below for every k, and the column of
    the largest \|q_k\| is free of cancellation. Then the vector is 2 atan2(|v|, w) v / |v|.
    """
    r = rotation
    trace = np.trace(r, axis1=-2, axis2=-1)
    squares = np.stack([trace, r[..., 0, 0], r[..., 1, 1], r[..., 2, 2]], axis=-1)
    k = np.argmax(squares, axis=-1)[..., None]
    axial = [r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]]
    off_diagonal = {(i, j): r[..., i, j] + r[..., j, i] for i, j in ((0, 1), (0, 2), (1, 2))}
    diagonal = [1 + 2 * r[..., i, i] - trace for i in range(3)]
    columns = [
        [1 + trace, *axial],
        [axial[0], diagonal[0], off_diagonal[0, 1], off_diagonal[0, 2]],
        [axial[1], off_diagonal[0, 1], diagonal[1], off_diagonal[1, 2]],
        [axial[2], off_diagonal[0, 2], off_diagonal[1, 2], diagonal[2]],
    ]
    q = np.choose(k, [np.stack(column, axis=-1) for column in columns])
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    w, v = q[..., :1], q[..., 1:]
    v = np.where(w < 0, -v, v)
    sine = np.linalg.norm(v, axis=-1, keepdims=True)
    small = sine < 1e-12
    scale = np.where(small, 2.0, 2 * np.arctan2(sine, np.abs(w)) / np.where(small, 1.0, sine))
    return np.asarray(scale * v)


def interpolate_rotation(start: Array, end: Array, fraction: Array) -> Array:
    """Rotations at a fraction (M,) of the shortest turn from start to end, (M, 3, 3)."""
    return np.asarray(start @ rotation_matrix(fraction[..., None] * relative_rotation(start, end)))


def relative_rotation(start: Array, end: Array) -> Array:
    """Rotation vectors of the shortest turns from start to end (M, 3, 3), in the axes of start, (M, 3) [rad]."""
    vector, cosine = evaluate(_build_relative_rotation(), start.reshape(-1, 9), end.reshape(-1, 9))
    far = np.flatnonzero(cosine[:, 0] < 0)  # beyond a quarter turn the other way is the exact one
    vector[far] = rotation_vector(np.swapaxes(start[far], -1, -2) @ end[far])
    return vector


@lru_cache(maxsize=1)
def _build_relative_rotation() -> Any:
    """(start, end; 9 each, row by row) -> rotation vector (3), cosine of its angle."""
    start, end = ca.SX.sym("start", 9), ca.SX.sym("end", 9)
    turn = ca.reshape(start, 3, 3) @ ca.reshape(end, 3, 3).T
    return ca.Function("relative_rotation", [start, end], [rotation_vector_expr(turn), (ca.trace(turn) - 1) / 2])


def from_wpr(w: Array, p: Array, r: Array) -> Array:
    """R = Rz(r) Ry(p) Rx(w), FANUC's fixed X-Y-Z angles [rad], (N,) each to (N, 3, 3)."""
    angles = [np.ascontiguousarray(np.ravel(a)) for a in (w, p, r)]
    rotation = np.empty((*np.shape(w), 3, 3))
    rows = rotation.reshape(-1, 9)

    def fill(start: int, stop: int) -> None:
        for begin in range(start, stop, BLOCK):
            block = slice(begin, min(begin + BLOCK, stop))
            with np.errstate(invalid="ignore"):  # NaN and infinity give NaN
                pairs = [(np.cos(a[block]), np.sin(a[block])) for a in angles]
            fill_rotation_matrices(pairs, rows[block])

    parallel_for(len(rows), fill)
    return rotation


def fill_rotation_matrices(pairs: Sequence[tuple[Array, Array]], rows: Array) -> None:
    """Write the rotations of W, P, R, given as cosine and sine (N,) of each angle, into rows (N, 9).

    Always by numpy: one text means one pose, in a file of any length.
    """
    (cw, sw), (cp, sp), (cr, sr) = pairs
    tilt, swing = cr * sp, sr * sp
    entries = rows.T
    np.multiply(cr, cp, out=entries[0])
    np.subtract(tilt * sw, sr * cw, out=entries[1])
    np.add(tilt * cw, sr * sw, out=entries[2])
    np.multiply(sr, cp, out=entries[3])
    np.add(swing * sw, cr * cw, out=entries[4])
    np.subtract(swing * cw, cr * sw, out=entries[5])
    np.negative(sp, out=entries[6])
    np.multiply(cp, sw, out=entries[7])
    np.multiply(cp, cw, out=entries[8])


def to_wpr(rotation: Array) -> tuple[Array, Array, Array]:
    r"""W, P, R [rad] of rotation matrices, (..., 3, 3) to (...) each.

    At \|P\| = 90 deg, where only W -/+ R is fixed, R = 0.
    """
    angles = evaluate(_build_to_wpr(), np.reshape(rotation, (-1, 9)))[0]
    w, p, r = (angles[:, k].reshape(rotation.shape[:-2]) for k in range(3))
    return w, p, r


@lru_cache(maxsize=1)
def _build_to_wpr() -> Any:
    """Rotation (9, row by row) -> W, P, R (3)."""
    rows = ca.SX.sym("r", 9)
    cosine = ca.sqrt(rows[0] ** 2 + rows[3] ** 2)
    is_singular = cosine < 1e-9
    w = ca.if_else(is_singular, ca.atan2(-rows[5], rows[4]), ca.atan2(rows[7], rows[8]))
    wpr = ca.vertcat(w, ca.atan2(-rows[6], cosine), ca.if_else(is_singular, 0.0, ca.atan2(rows[3], rows[0])))
    return ca.Function("to_wpr", [rows], [wpr])


def rotation_matrix_expr(w: Any) -> Any:
    """Rotation matrix (3, 3) of a rotation vector (3, 1); by Taylor's series, exact to rounding up to 1 rad."""
    x = ca.dot(w, w)
    a = b = ca.SX(0)
    for k in range(8, -1, -1):  # sin(t) / t and (1 - cos(t)) / t^2
        a, b = 1 / factorial(2 * k + 1) - x * a, 1 / factorial(2 * k + 2) - x * b
    m = ca.skew(w)
    return ca.SX.eye(3) + a * m + b * (m @ m)


def rotation_vector_expr(rotation: Any) -> Any:
    """Rotation vector (3, 1) of a rotation matrix (3, 3) by less than half a turn."""
    axial = (
        ca.vertcat(rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1])
        / 2
    )
    s2 = ca.dot(axial, axial)
    small = s2 < 1e-6
    sine = ca.sqrt(ca.if_else(small, 1.0, s2))
    angle = ca.atan2(sine, (ca.trace(rotation) - 1) / 2)
    return axial * ca.if_else(small, 1 + s2 * (1 / 6 + s2 * (3 / 40 + s2 * 15 / 336)), angle / sine)
