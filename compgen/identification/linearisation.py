r"""All rows at a point: their residuals, their Jacobian against all unknowns, and which columns are whose.

    delta = y - F (P + R t + v) - c,     d delta = -A dx
    z = delta,                           dz = -A dx                    a row of coordinates
    z = l - |delta|,                     dz = (delta / |delta|)' A dx   a row of one distance

    x = (u, for each instrument w and c, for each reflector t, for each fixed place y)

with u the parameters in units of their priors, w a small turn of the instrument's frame, c its origin, t the reflector
in the flange. The far end y is measured, or a fixed place, or another reflector P' + R' t'. Orientations give rows of
their own, in the reflector's axes; so does what is known of fixed places beforehand, in units of its sigma.

The linear problem of a fit at a point: the equations of all its rows or of some, and what other scales make of it.

What cross-validation, forecasts, the choice of thermal terms and other readings of a log ask is asked here, without
linearising again: parameters are small, and the arm is linear in them.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.rotations import cross_matrix, rotation_vector
from compgen.identification.evidence import (
    ROUNDS,
    FitPrior,
    NormalEquations,
    Posterior,
    Scales,
    normal_equations,
    pose_equations,
    posterior,
)
from compgen.identification.instrument_frames import InstrumentFrames
from compgen.identification.measurements import KNOWN, NONE, ORIENTATION, PLACE, Measurements
from compgen.identification.model import ArmModel

SHORTEST = 1e-9  # [m] a distance that has no direction
ALIGNED = 1e-3  # rad: how well the frame of an axis test is aligned with World
FRAME_PRECISION = 100.0  # [1/m2], [1/rad2] of steps of the frames, 0.1 m and 0.1 rad: it damps, and does not bias


@dataclass(frozen=True, slots=True)
class FitUnknowns:
    """x = (parameters, for each instrument its turn and its origin, reflectors, fixed places, the reflectors' axes)."""

    parameters: int  # K'
    instruments: int
    reflectors: int
    places: int
    oriented: bool  # whether orientations were measured

    @property
    def size(self) -> int:
        """How many there are, D."""
        triples = self.reflectors + self.places + (self.reflectors if self.oriented else 0)
        return self.parameters + 6 * self.instruments + 3 * triples

    def frame(self, i: int) -> slice:
        """Turn and origin of an instrument's frame."""
        return slice(self.parameters + 6 * i, self.parameters + 6 * i + 6)

    def reflector(self, r: int) -> slice:
        """A reflector in the flange."""
        begin = self.parameters + 6 * self.instruments + 3 * r
        return slice(begin, begin + 3)

    def place(self, s: int) -> slice:
        """A fixed place in its frame; they stand behind the reflectors."""
        return self.reflector(self.reflectors + s)

    def turn(self, r: int) -> slice:
        """The axes of a reflector; they stand behind the places."""
        return self.place(self.places + r)


def fit_unknowns(data: Measurements, active: BoolArray) -> FitUnknowns:
    """The unknowns of a fit of the active parameters, (K,), to some measurements."""
    oriented = bool(np.isfinite(data.rotation[:, 0, 0]).any())
    return FitUnknowns(int(active.sum()), len(data.instruments), len(data.reflectors), len(data.fixed.names), oriented)


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Linearisation:
    """All rows at a point: residuals, and their Jacobian against (u, frames)."""

    z: Array  # (N, 3) [m] residuals of coordinates, or of a distance in the first
    A: Array  # (N, 3, D)
    turn: Array  # (N', 3) [rad] orientation residuals
    B: Array  # (N', 3, D)
    oriented: IntArray  # (N',) which rows have an orientation
    known: Array  # (H,) what was known beforehand of fixed places and half-widths, less what they are, over its sigma
    C: Array  # (H, D)


def linearise(
    model: ArmModel,
    data: Measurements,
    active: BoolArray,
    p: Array,
    frames: InstrumentFrames,
    reflector_rotation: Array,
) -> Linearisation:
    """Residuals and Jacobian of all rows; parameters in units of their priors."""
    P, R, dP, dR = model.derivatives(active, data, p)
    scale = model.prior[active]
    dP, dR = dP * scale, dR * scale
    unknowns = fit_unknowns(data, active)
    arm = _Arm(unknowns, R, dP, dR, frames)
    oriented = np.flatnonzero(np.isfinite(data.rotation[:, 0, 0]))
    F = frames.rotation_of(data.instrument)
    A = np.zeros((len(data.pose), 3, unknowns.size))
    arm.carry(A, data.pose, data.reflector, F)
    rotated = np.einsum("nij,nj->ni", F, frames.near_ends(data, P, R))
    for i in range(len(data.instruments)):
        rows = data.instrument == i
        turn = unknowns.frame(i).start
        A[rows, :, turn : turn + 3] = cross_matrix(-rotated[rows])
        A[rows, :, turn + 3 : turn + 6] = np.eye(3)
    delta = frames.far_ends(data, P, R) - rotated - frames.origin_of(data.instrument)
    z, A = _with_far_ends(data, arm, delta, A)
    measured = np.isfinite(z)  # coordinates that were not carry no weight
    z, A = np.where(measured, z, 0.0), A * measured[:, :, None]
    turns, B = _linearise_orientations(data, unknowns, R, dR, frames, reflector_rotation, oriented)
    known, of_places = data.fixed.prior_rows(frames.place)
    C = np.zeros((len(known), unknowns.size))
    C[:, unknowns.place(0).start : unknowns.place(unknowns.places).start] = of_places
    known, C = _with_half_widths(model, data, active, p, known, C)
    return Linearisation(z=z, A=A, turn=turns, B=B, oriented=oriented, known=known, C=C)


def _with_half_widths(
    model: ArmModel, data: Measurements, active: BoolArray, p: Array, known: Array, C: Array
) -> tuple[Array, Array]:
    """What was known beforehand (H,), its slopes (H, D), with what runs say of half-widths: (b_run - b) / sigma."""
    measured = np.full((6, 2), np.nan) if data.half_width is None else data.half_width
    for column, k in enumerate(np.flatnonzero(active).tolist()):
        t = model.parameters[k]
        if t.field == "backlash" and np.isfinite(measured[t.index[0], 0]):
            half, sigma = measured[t.index[0]]
            known = np.append(known, (half - p[k]) / sigma)
            C = np.vstack([C, model.prior[k] / sigma * (np.arange(C.shape[1]) == column)])
    return known, C


@dataclass(frozen=True, eq=False, slots=True)
class _Arm:
    """The flange at each pose, and its derivatives by the parameters."""

    unknowns: FitUnknowns
    rotation: Array  # (M, 3, 3)
    dP: Array  # (M, 3, K)
    dR: Array  # (M, 3, 3, K)
    frames: InstrumentFrames

    def carry(self, A: Array, pose: IntArray, reflector: IntArray, F: Array) -> None:
        """Put F d(P + R t) / dx of reflectors (n,) at poses (n,) into rows (n, 3, D)."""
        K = self.unknowns.parameters
        for r in np.unique(reflector).tolist():
            rows = np.flatnonzero(reflector == r)
            at = pose[rows]
            derivative = self.dP[at] + np.einsum("nijk,j->nik", self.dR[at], self.frames.reflector[r])
            A[rows, :, :K] = F[rows] @ derivative
            A[rows, :, self.unknowns.reflector(r)] = F[rows] @ self.rotation[at]


def _with_far_ends(data: Measurements, arm: _Arm, delta: Array, A: Array) -> tuple[Array, Array]:
    """z and A of all rows: far ends that are no measured places, and distances."""
    ends = data.ends
    other = np.flatnonzero(ends.pose != NONE)
    far = np.zeros((len(other), 3, A.shape[2]))
    arm.carry(far, ends.pose[other], ends.reflector[other], np.tile(np.eye(3), (len(other), 1, 1)))
    A[other] -= far
    for s in np.unique(ends.place[ends.place != NONE]).tolist():
        A[ends.place == s, :, arm.unknowns.place(s)] -= np.eye(3)
    rows = np.flatnonzero(np.isfinite(ends.distance))
    length = np.linalg.norm(delta[rows], axis=1)
    toward = delta[rows] / np.maximum(length, SHORTEST)[:, None]
    along = -np.einsum("ni,nid->nd", toward, A[rows])
    A[rows] = 0.0
    A[rows, 0] = along
    delta[rows] = np.column_stack([ends.distance[rows] - length, np.zeros((len(rows), 2))])
    return delta, A


def _linearise_orientations(
    data: Measurements,
    unknowns: FitUnknowns,
    R: Array,
    dR: Array,
    frames: InstrumentFrames,
    reflector_rotation: Array,
    oriented: IntArray,
) -> tuple[Array, Array]:
    """Residuals and Jacobian of the orientations, in the reflector's own axes."""
    B = np.zeros((len(oriented), 3, unknowns.size))
    pose, inst, refl = data.pose[oriented], data.instrument[oriented], data.reflector[oriented]
    S = R[pose] @ reflector_rotation[refl]
    predicted = frames.rotation[inst] @ S
    spin = np.einsum("nijk,nlj->nilk", dR[pose], R[pose])  # dR R'
    w = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)  # (N', 3, K)
    B[:, :, : unknowns.parameters] = np.swapaxes(S, 1, 2) @ w
    for n in range(len(oriented)):
        turn = unknowns.frame(int(inst[n])).start
        B[n, :, turn : turn + 3] = predicted[n].T
        B[n, :, unknowns.turn(int(refl[n]))] = np.eye(3)
    return rotation_vector(np.swapaxes(predicted, 1, 2) @ data.rotation[oriented]), B


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class LinearProblem:
    """Rows at a point, how much each counts, and what is known of the unknowns before them."""

    data: Measurements
    linear: Linearisation
    weight: Array  # (N,)
    x: Array  # (D,) unknowns at the point: parameters over their priors, no step of the frames
    prior: FitPrior
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
        sigma, share = self.data.sigma, self.weight * self.data.sigma**2
        keep = np.ones(len(self.weight), dtype=bool) if rows is None else rows
        equations = []
        for k in np.unique(self.data.kind).tolist():
            of_kind = keep & (self.data.kind == k)
            A = linear.A[of_kind].reshape(-1, D)
            right = linear.z[of_kind].ravel() + A @ self.x
            measured = A.any(axis=1)  # a coordinate that was not measured is no row
            of_rows, of_sigma = (np.repeat(each[of_kind], 3)[measured] for each in (share, sigma))
            equation = normal_equations(A[measured], right[measured], of_rows, of_sigma, k)
            if rho and k == PLACE:
                pose, weight = self.data.pose[of_kind], self.weight[of_kind]
                equation = equation.without(pose_equations(linear.A[of_kind], right.reshape(-1, 3), weight, pose, rho))
            equations.append(equation)
        if len(linear.oriented):
            oriented = keep[linear.oriented]
            B, t = linear.B[oriented].reshape(-1, D), linear.turn[oriented].ravel()
            of_rows, of_sigma = (np.repeat(each[linear.oriented[oriented]], 3) for each in (share, sigma))
            equations.append(normal_equations(B, t + B @ self.x, of_rows, of_sigma, ORIENTATION))
        if len(linear.known):
            C = linear.C if with_known else linear.C[:0]
            right = linear.known[: len(C)] + C @ self.x
            one = np.ones(len(C))
            equations.append(replace(normal_equations(C, right, one, one, KNOWN), rows=0.0))
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


def prior_at(model: ArmModel, data: Measurements, active: BoolArray, frames: InstrumentFrames, size: int) -> FitPrior:
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
    return FitPrior(model.groups()[1][active], precision, mean, model.ceiling)


def unknowns_at(model: ArmModel, active: BoolArray, p: Array, size: int) -> Array:
    """The unknowns at parameters (K,) [SI]: these over their priors, and no step of the frames, (D,)."""
    u = (p / model.prior)[active] if len(p) else p
    return np.concatenate([u, np.zeros(size - len(u))])
