r"""All rows at a point: their residuals, their Jacobian against parameters and frames, and the equations they give.

    z = y - F (P + R t) - c,     dz = -A dx,     x = (u, for each instrument w and c, for each reflector t)

with u the parameters in units of their priors, w a small turn of the instrument's frame, c its origin, t the reflector
in the flange. Orientations give rows of their own, in the reflector's axes."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.rotations import rotation_vector
from compgen.identification.evidence import NormalEquations, normal_equations, pose_equations
from compgen.identification.frames import InstrumentFrames
from compgen.identification.measurements import Measurements
from compgen.identification.model import ArmModel


@dataclass(frozen=True, eq=False, slots=True)
class Linearisation:
    """All rows at a point: residuals, and their Jacobian against (u, frames)."""

    z: Array  # (N, 3) [m] position residuals
    A: Array  # (N, 3, D)
    turn: Array  # (N', 3) [rad] orientation residuals
    B: Array  # (N', 3, D)
    oriented: IntArray  # (N',) which rows have an orientation


def channel_equations(
    linear: Linearisation, weight: Array, x0: Array, pose: IntArray, rho: float, rows: BoolArray | None = None
) -> list[NormalEquations]:
    """Normal equations of the position and the orientation rows, for x itself rather than a step from ``x0``.

    Args:
        linear: All rows.
        weight: Of each, (N,).
        x0: Where they were linearised, (D,).
        pose: Of each row, (N,).
        rho: Noise that the rows of a pose share.
        rows: Some of them; those of a pose stay together.
    """
    keep = np.ones(len(weight), dtype=bool) if rows is None else rows
    D = linear.A.shape[2]
    A, z = linear.A[keep].reshape(-1, D), linear.z[keep].ravel()
    measured = A.any(axis=1)  # a coordinate that was not measured is no row
    equations = [normal_equations(A, z + A @ x0, np.repeat(weight[keep], 3) * measured)]
    if rho:
        right = (z + A @ x0).reshape(-1, 3)
        equations[0] = equations[0].without(pose_equations(linear.A[keep], right, weight[keep], pose[keep], rho))
    if len(linear.oriented):
        oriented = keep[linear.oriented]
        B, t = linear.B[oriented].reshape(-1, D), linear.turn[oriented].ravel()
        equations.append(normal_equations(B, t + B @ x0, np.repeat(weight[linear.oriented[oriented]], 3)))
    return equations


def linearise(
    model: ArmModel,
    jacobian_function: Any,
    data: Measurements,
    active: BoolArray,
    p: Array,
    frames: InstrumentFrames,
    reflector_rotation: Array,
) -> Linearisation:
    """Residuals and Jacobian of all rows; parameters in units of their priors."""
    if jacobian_function is not None:
        P, R, dP, dR = model.derivatives(jacobian_function, data, p)
        scale = model.prior[active]
        dP, dR = dP * scale, dR * scale
    else:
        P, R = model.pose(data, p)
        dP, dR = np.zeros((len(P), 3, 0)), np.zeros((len(P), 3, 3, 0))
    N, K = len(data.pose), int(active.sum())
    V, Q = len(data.instruments), len(data.reflectors)
    oriented = np.flatnonzero(np.isfinite(data.rotation[:, 0, 0]))
    D = K + 6 * V + (6 if len(oriented) else 3) * Q
    A = np.zeros((N, 3, D))
    F = frames.rotation[data.instrument]
    offset = frames.reflector[data.reflector]
    Rn = R[data.pose]
    reflector = P[data.pose] + np.einsum("nij,nj->ni", Rn, offset)
    rotated = np.einsum("nij,nj->ni", F, reflector)
    for i in range(V):
        rows = data.instrument == i
        jacobian = np.zeros((int(rows.sum()), 3, D))
        for r in range(Q):
            rows_of_reflector = data.reflector[rows] == r
            pose = data.pose[rows][rows_of_reflector]
            derivative = dP[pose] + np.einsum("nijk,j->nik", dR[pose], frames.reflector[r])
            jacobian[rows_of_reflector, :, :K] = frames.rotation[i] @ derivative
            jacobian[rows_of_reflector, :, K + 6 * V + 3 * r : K + 6 * V + 3 * r + 3] = (
                frames.rotation[i] @ Rn[rows][rows_of_reflector]
            )
        s = rotated[rows]
        zero = np.zeros(len(s))
        cross = [[zero, s[:, 2], -s[:, 1]], [-s[:, 2], zero, s[:, 0]], [s[:, 1], -s[:, 0], zero]]
        jacobian[:, :, K + 6 * i : K + 6 * i + 3] = np.moveaxis(np.array(cross), 2, 0)
        jacobian[:, :, K + 6 * i + 3 : K + 6 * i + 6] = np.eye(3)
        A[rows] = jacobian
    z = data.position - rotated - frames.origin[data.instrument]
    measured = np.isfinite(z)
    if not measured.all():  # coordinates that were not measured carry no weight
        z, A = np.where(measured, z, 0.0), A * measured[:, :, None]
    turn, B = _linearise_orientations(data, active, R, dR, frames, reflector_rotation, oriented, D)
    return Linearisation(z, A, turn, B, oriented)


def _linearise_orientations(
    data: Measurements,
    active: BoolArray,
    R: Array,
    dR: Array,
    frames: InstrumentFrames,
    reflector_rotation: Array,
    oriented: IntArray,
    D: int,
) -> tuple[Array, Array]:
    """Residuals and Jacobian of the orientations, in the reflector's own axes."""
    B = np.zeros((len(oriented), 3, D))
    if not len(oriented):
        return np.zeros((0, 3)), B
    K, V, Q = int(active.sum()), len(data.instruments), len(data.reflectors)
    pose, inst, refl = data.pose[oriented], data.instrument[oriented], data.reflector[oriented]
    S = R[pose] @ reflector_rotation[refl]
    predicted = frames.rotation[inst] @ S
    spin = np.einsum("nijk,nlj->nilk", dR[pose], R[pose])  # dR R'
    w = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)  # (N', 3, K)
    B[:, :, :K] = np.swapaxes(S, 1, 2) @ w
    for n in range(len(oriented)):
        B[n, :, K + 6 * inst[n] : K + 6 * inst[n] + 3] = predicted[n].T
        begin_ = K + 6 * V + 3 * Q + 3 * refl[n]
        B[n, :, begin_ : begin_ + 3] = np.eye(3)
    return rotation_vector(np.swapaxes(predicted, 1, 2) @ data.rotation[oriented]), B
