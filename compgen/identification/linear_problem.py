"""The linear problem of a fit at a point: the equations of all its rows or of some, and what other scales make of it.

What cross-validation, forecasts, the choice of thermal terms and other readings of a log ask is asked here, without
linearising again: parameters are small, and the arm is linear in them.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray
from compgen.core.rotations import rotation_vector
from compgen.identification.evidence import (
    ROUNDS,
    NormalEquations,
    Posterior,
    Prior,
    Scales,
    normal_equations,
    pose_equations,
    posterior,
)
from compgen.identification.frames import InstrumentFrames
from compgen.identification.linearisation import Linearisation
from compgen.identification.measurements import KNOWN, ORIENTATION, PLACE, Measurements
from compgen.identification.model import ArmModel

ALIGNED = 1e-3  # rad: how well the frame of an axis test is aligned with World
FRAME_PRECISION = 100.0  # [1/m2], [1/rad2] of steps of the frames, 0.1 m and 0.1 rad: it damps, and does not bias


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class LinearProblem:
    """Rows at a point, how much each counts, and what is known of the unknowns before them."""

    data: Measurements
    linear: Linearisation
    weight: Array  # (N,)
    x: Array  # (D,) unknowns at the point: parameters over their priors, no step of the frames
    prior: Prior
    scales: Scales

    def equations(
        self, rows: BoolArray | None = None, rho: float | None = None, *, with_known: bool = True
    ) -> list[NormalEquations]:
        """Normal equations of the rows of each kind, for x itself rather than a step from the point.

        Args:
            rows: Some of them, (N,); those of a pose stay together.
            rho: Noise that the rows of a pose share, where an instrument measured them; None: as the scales have it.
            with_known: Whether what was known beforehand counts.
        """
        linear, D = self.linear, len(self.x)
        rho = self.scales.rho if rho is None else rho
        keep = np.ones(len(self.weight), dtype=bool) if rows is None else rows
        equations = []
        for k in np.unique(self.data.kind).tolist():
            of_kind = keep & (self.data.kind == k)
            A = linear.A[of_kind].reshape(-1, D)
            right = linear.z[of_kind].ravel() + A @ self.x
            measured = A.any(axis=1)  # a coordinate that was not measured is no row
            equation = normal_equations(A[measured], right[measured], np.repeat(self.weight[of_kind], 3)[measured], k)
            if rho and k == PLACE:
                pose, weight = self.data.pose[of_kind], self.weight[of_kind]
                equation = equation.without(pose_equations(linear.A[of_kind], right.reshape(-1, 3), weight, pose, rho))
            equations.append(equation)
        if len(linear.oriented):
            oriented = keep[linear.oriented]
            B, t = linear.B[oriented].reshape(-1, D), linear.turn[oriented].ravel()
            w = np.repeat(self.weight[linear.oriented[oriented]], 3)
            equations.append(normal_equations(B, t + B @ self.x, w, ORIENTATION))
        if len(linear.known):
            C = linear.C if with_known else linear.C[:0]
            right = linear.known[: len(C)] + C @ self.x
            equations.append(replace(normal_equations(C, right, np.ones(len(C)), KNOWN), rows=0.0))
        return equations

    def solve(
        self,
        equations: list[NormalEquations] | None = None,
        *,
        learn_groups: bool = False,
        learn_noise: bool = False,
        rounds: int = ROUNDS,
    ) -> Posterior:
        """The posterior by some equations, or by those of all rows."""
        equations = self.equations() if equations is None else equations
        return posterior(
            equations, self.prior, self.scales, learn_groups=learn_groups, learn_noise=learn_noise, rounds=rounds
        )

    def left(self, x: Array, rows: BoolArray | slice = slice(None)) -> Array:
        """What unknowns (D,) leave of some rows, (n, 3) [m]."""
        return np.asarray(self.linear.z[rows] - self.linear.A[rows] @ (x - self.x))


def prior_at(model: ArmModel, data: Measurements, active: BoolArray, frames: InstrumentFrames, size: int) -> Prior:
    """What is known of the unknowns, (D,) of which are ``size``: those of the frames are steps from the ones given."""
    free = size - int(active.sum())
    precision, mean = np.full(free, FRAME_PRECISION), np.zeros(free)
    for i in np.flatnonzero(data.aligned).tolist():
        precision[6 * i : 6 * i + 3] = ALIGNED**-2
        mean[6 * i : 6 * i + 3] = -rotation_vector(frames.rotation[i])
    if data.guess is not None and data.guess_sigma is not None:
        begin = 6 * len(data.instruments)
        precision[begin : begin + data.guess.size] = np.repeat(data.guess_sigma**-2, 3)
        mean[begin : begin + data.guess.size] = (data.guess - frames.reflector).ravel()
    return Prior(model.groups()[1][active], precision, mean, model.ceiling)


def unknowns_at(model: ArmModel, active: BoolArray, p: Array, size: int) -> Array:
    """The unknowns at parameters (K,) [SI]: these over their priors, and no step of the frames, (D,)."""
    u = (p / model.prior)[active] if len(p) else p
    return np.concatenate([u, np.zeros(size - len(u))])
