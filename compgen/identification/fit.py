r"""The fit: Gauss-Newton steps on the most probable parameters, their scales from the evidence, wild rows set aside.

    minimise  sum_n w_n |y_n - f_n(p, frames)|^2 / s^2  +  sum_k (p_k / sigma_k)^2 / lambda_g(k)

Each step linearises all rows at once (``Model.derivatives``), solves the linear problem with its scales (``linear``)
and is shortened while it makes the sum worse. First with weights of Student's t, so that wild rows do not bend the
answer; then without those rows whose deviation, allowing for how strongly each row draws the fit to itself, has a
chance below 1 % of happening even once in all rows of Gaussian noise."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import chi2

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.rotations import rotation_matrix, rotation_vector
from compgen.identification.evidence import Normal, Posterior, Scales, normal_of, posterior
from compgen.identification.frames import InstrumentFrames, begin
from compgen.identification.measurements import Measurements
from compgen.identification.model import Model

STEPS = 10
ROUNDS = 3  # of setting wild rows aside
FREEDOM = 4.0  # of Student's t
SETTLED = 1e-10  # m: a step that moves no row further ends the fit
FAINT = 1e-3  # share of the noise: so does one that moves no row further than this, when scales are learnt
CHANCE = 0.01  # that Gaussian noise alone sets a row aside, somewhere in the data
ALIGNED = 1e-3  # rad: how well the frame of an axis test is aligned with World
WIDE = 100.0  # prior precision of steps of the frames [1/m2], [1/rad2]: 0.1 m, 0.1 rad; it damps and does not bias
START_NOISE = 1e-4  # m


@dataclass(frozen=True, eq=False, slots=True)
class Linear:
    """All rows at a point: residual z, slope A against (u, frames)."""

    z: Array  # (N, 3) [m]
    A: Array  # (N, 3, D)
    turn: Array  # (N', 3) [rad] orientation rows
    B: Array  # (N', 3, D)
    turned: IntArray  # (N',) which rows have an orientation


@dataclass(frozen=True, eq=False, slots=True)
class Fit:
    """What the data says."""

    p: Array  # (K,) [SI]
    frames: InstrumentFrames
    tool_turn: Array  # (R, 3, 3) of each reflector's own axes
    posterior: Posterior
    active: BoolArray  # (K,) parameters that were free
    sigma: Array  # (K,) [SI] standard deviation, the prior's where nothing was free
    gamma: Array  # (K,) how much the data says of each
    wild: BoolArray  # (N,) rows set aside
    residual: Array  # (N, 3) [m] measured less predicted
    distance: Array  # (N,) deviation squared over its variance, left-out
    linear: Linear
    steps: int

    @property
    def noise(self) -> float:
        """Standard deviation of one coordinate [m]."""
        return float(np.sqrt(self.posterior.scales.noise[0]))


def fit(
    model: Model,
    data: Measurements,
    active: BoolArray,
    learn: bool = True,
    robust: bool = True,
    start: Fit | None = None,
    noise: float | None = None,
) -> Fit:
    """The most probable parameters, with everything that is needed to judge them.

    Args:
        model: The arm with symbols.
        data: What was measured.
        active: Which parameters are free, (K,); the others stay at zero.
        learn: Learn the scales of groups and noise from the data; else the priors hold as they are.
        robust: Set wild rows aside.
        start: Where to begin.
        noise: Known standard deviation [m], when it shall not be learnt.
    """
    search = _Search(model, data, active, learn, noise, model.slopes(active) if active.any() else None)
    point = search.begin(start)
    weight = np.ones(len(data.pose))
    wild = np.zeros(len(weight), dtype=bool)
    if robust:
        point = search.descend(point, weight, student=True)
        wild = search.wild(point, wild)
    for _ in range(ROUNDS):
        point = search.descend(point, (~wild).astype(float))
        if not robust:
            break
        again = search.wild(point, wild)
        if np.array_equal(again, wild):
            break
        wild = again
    return search.finish(point, wild)


@dataclass(frozen=True, eq=False, slots=True)
class _Point:
    p: Array
    frames: InstrumentFrames
    tool_turn: Array
    scales: Scales
    posterior: Posterior | None
    linear: Linear | None
    steps: int


@dataclass(frozen=True, eq=False, slots=True)
class _Search:
    """What stays the same during one fit."""

    model: Model
    data: Measurements
    active: BoolArray
    learn: bool
    noise: float | None
    slopes: Any  # None where nothing is free

    def begin(self, start: Fit | None) -> _Point:
        if start is not None:
            p = np.where(self.active, start.p, 0.0)
            return _Point(p, start.frames, start.tool_turn, start.posterior.scales, None, None, 0)
        p = np.zeros(len(self.model.terms))
        position, rotation = self.model.pose(self.data, p)
        frames = begin(self.data, position, rotation)
        miss = np.linalg.norm(frames.seen(self.data, position, rotation) - self.data.position, axis=1)
        s2 = self.noise**2 if self.noise else max(START_NOISE, 0.2 * float(np.median(miss))) ** 2
        names, _ = self.model.groups()
        scales = Scales(np.ones(len(names)), np.array([s2, s2]))
        return _Point(p, frames, _tool_turns(self.data, frames, rotation), scales, None, None, 0)

    def descend(self, point: _Point, weight: Array, student: bool = False) -> _Point:
        """Steps until no row moves."""
        linear = point.linear or linearise(
            self.model, self.slopes, self.data, self.active, point.p, point.frames, point.tool_turn
        )
        data = self.data
        taken = 0
        learning = self.learn or self.noise is None
        for _ in range(STEPS):
            taken += 1
            w = weight / data.sigma**2
            if student:
                w = w * _student(linear.z / data.sigma[:, None], float(point.scales.noise[0]))
            at, target = self._prior(point)
            fixed = frame_prior(data, point.frames, len(target))[0]
            channels = normals(linear, w, at)
            _, group = self.model.groups()
            found = posterior(channels, group[self.active], fixed, target, point.scales, self.learn, self.noise is None)
            share = 1.0
            before = self._cost(point, linear, w, found.scales)
            while True:
                moved = self._moved(point, found, at, share)
                fresh = linearise(self.model, self.slopes, data, self.active, moved.p, moved.frames, moved.tool_turn)
                if share < 1e-3 or self._cost(moved, fresh, w, found.scales) <= before * (1 + 1e-9):
                    break
                share /= 4
            shift = float(np.abs(fresh.z - linear.z).max())
            scales_moved = float(np.abs(np.log(found.scales.noise[0] / point.scales.noise[0])))
            point, linear = moved, fresh
            faint = FAINT * float(np.sqrt(point.scales.noise[0]))
            if shift < SETTLED or (learning and shift < faint and scales_moved < 0.01):
                break
        return _Point(
            point.p, point.frames, point.tool_turn, point.scales, point.posterior, linear, point.steps + taken
        )

    def _prior(self, point: _Point) -> tuple[Array, Array]:
        """The unknowns at a point, (D,), and the prior means of the frames as seen from there, (D - K,)."""
        u = (point.p / self.model.prior)[self.active] if len(point.p) else point.p
        free = self._frame_unknowns()
        return np.concatenate([u, np.zeros(free)]), frame_prior(self.data, point.frames, free)[1]

    def _frame_unknowns(self) -> int:
        turned = np.isfinite(self.data.rotation[:, 0, 0]).any()
        return 6 * len(self.data.instruments) + (6 if turned else 3) * len(self.data.reflectors)

    def _moved(self, point: _Point, found: Posterior, at: Array, share: float) -> _Point:
        K = int(self.active.sum())
        step = share * (found.x - at)
        p = point.p.copy()
        p[self.active] += step[:K] * self.model.prior[self.active]
        V, R = len(self.data.instruments), len(self.data.reflectors)
        frame = step[K : K + 6 * V].reshape(V, 6)
        sat = step[K + 6 * V : K + 6 * V + 3 * R].reshape(R, 3)
        turn = step[K + 6 * V + 3 * R :].reshape(-1, 3)
        frames = InstrumentFrames(
            rotation_matrix(frame[:, :3]) @ point.frames.rotation,
            point.frames.origin + frame[:, 3:],
            point.frames.reflector + sat,
        )
        tool_turn = point.tool_turn @ rotation_matrix(turn) if len(turn) else point.tool_turn
        return _Point(p, frames, tool_turn, found.scales, found, None, point.steps)

    def _cost(self, point: _Point, linear: Linear, w: Array, scales: Scales) -> float:
        _, group = self.model.groups()
        value = float((w[:, None] * linear.z**2).sum() / scales.noise[0])
        value += float((w[linear.turned, None] * linear.turn**2).sum() / scales.noise[1])
        u = (point.p / self.model.prior)[self.active] if len(point.p) else point.p
        value += float((u**2 / scales.group[group[self.active]]).sum()) if len(u) else 0.0
        for i, aligned in enumerate(self.data.aligned.tolist()):
            if aligned:
                value += float((rotation_vector(point.frames.rotation[i]) ** 2).sum()) / ALIGNED**2
        return value

    def wild(self, point: _Point, now: BoolArray) -> BoolArray:
        """Rows too far off to be noise."""
        if point.posterior is None or point.linear is None:
            return now
        distance = left_out(point.linear, point.posterior, self.data, now)
        return np.asarray(distance > threshold(len(distance)))

    def finish(self, point: _Point, wild: BoolArray) -> Fit:
        found, linear = point.posterior, point.linear
        assert found is not None
        assert linear is not None
        sigma, gamma = self.model.prior.copy(), np.zeros(len(point.p))
        K = int(self.active.sum())
        if K:
            sigma[self.active] *= np.sqrt(np.diag(found.covariance)[:K])
            gamma[self.active] = found.gamma
        return Fit(
            point.p, point.frames, point.tool_turn, found, self.active, sigma, gamma, wild, linear.z,
            left_out(linear, found, self.data, wild), linear, point.steps,
        )  # fmt: skip


def frame_prior(data: Measurements, frames: InstrumentFrames, free: int) -> tuple[Array, Array]:
    """Prior precision and mean of the frames' unknowns, (D - K,): steps from where the frames are now."""
    fixed, target = np.full(free, WIDE), np.zeros(free)
    for i, aligned in enumerate(data.aligned.tolist()):
        if aligned:
            fixed[6 * i : 6 * i + 3] = ALIGNED**-2
            target[6 * i : 6 * i + 3] = -rotation_vector(frames.rotation[i])
    return fixed, target


def threshold(rows: int) -> float:
    """Squared deviation over variance beyond which a row is wild."""
    return float(chi2.isf(CHANCE / max(rows, 1), 3))


def left_out(linear: Linear, found: Posterior, data: Measurements, wild: BoolArray) -> Array:
    """Squared deviation of each row from what the others say of it, over its variance, (N,).

    For a row inside the fit e' (s^2 V - A C A')^-1 e, for one that was set aside e' (s^2 V + A C A')^-1 e.
    """
    s2 = found.scales.noise[0] * data.sigma**2
    drawn = linear.A @ found.covariance @ np.swapaxes(linear.A, 1, 2)
    sign = np.where(wild, 1.0, -1.0)[:, None, None]
    S = s2[:, None, None] * np.eye(3) + sign * drawn
    values, vectors = np.linalg.eigh(S)
    values = np.maximum(values, 0.1 * s2[:, None])  # a row that the fit follows wherever it goes tells nothing
    along = np.einsum("nji,nj->ni", vectors, linear.z)
    return np.asarray((along**2 / values).sum(axis=1))


def normals(linear: Linear, weight: Array, at: Array, rows: BoolArray | None = None) -> list[Normal]:
    """Sums of the position and the orientation rows, for x itself rather than a step from ``at``."""
    keep = np.ones(len(weight), dtype=bool) if rows is None else rows
    D = linear.A.shape[2]
    A, z = linear.A[keep].reshape(-1, D), linear.z[keep].ravel()
    own = [normal_of(A, z + A @ at, np.repeat(weight[keep], 3))]
    if len(linear.turned):
        there = keep[linear.turned]
        B, t = linear.B[there].reshape(-1, D), linear.turn[there].ravel()
        own.append(normal_of(B, t + B @ at, np.repeat(weight[linear.turned[there]], 3)))
    return own


def linearise(
    model: Model,
    slopes: Any,
    data: Measurements,
    active: BoolArray,
    p: Array,
    frames: InstrumentFrames,
    tool_turn: Array,
) -> Linear:
    """Residual and slope of all rows; parameters in units of their priors."""
    if slopes is not None:
        P, R, dP, dR = model.derivatives(slopes, data, p)
        scale = model.prior[active]
        dP, dR = dP * scale, dR * scale
    else:
        P, R = model.pose(data, p)
        dP, dR = np.zeros((len(P), 3, 0)), np.zeros((len(P), 3, 3, 0))
    N, K = len(data.pose), int(active.sum())
    V, Q = len(data.instruments), len(data.reflectors)
    turned = np.flatnonzero(np.isfinite(data.rotation[:, 0, 0]))
    D = K + 6 * V + (6 if len(turned) else 3) * Q
    A = np.zeros((N, 3, D))
    F = frames.rotation[data.instrument]
    t = frames.reflector[data.reflector]
    Rn = R[data.pose]
    place = P[data.pose] + np.einsum("nij,nj->ni", Rn, t)
    seen = np.einsum("nij,nj->ni", F, place)
    for i in range(V):
        rows = data.instrument == i
        here = np.zeros((int(rows.sum()), 3, D))
        for r in range(Q):
            there = data.reflector[rows] == r
            pose = data.pose[rows][there]
            slope = dP[pose] + np.einsum("nijk,j->nik", dR[pose], frames.reflector[r])
            here[there, :, :K] = frames.rotation[i] @ slope
            here[there, :, K + 6 * V + 3 * r : K + 6 * V + 3 * r + 3] = frames.rotation[i] @ Rn[rows][there]
        s = seen[rows]
        zero = np.zeros(len(s))
        cross = [[zero, s[:, 2], -s[:, 1]], [-s[:, 2], zero, s[:, 0]], [s[:, 1], -s[:, 0], zero]]
        here[:, :, K + 6 * i : K + 6 * i + 3] = np.moveaxis(np.array(cross), 2, 0)
        here[:, :, K + 6 * i + 3 : K + 6 * i + 6] = np.eye(3)
        A[rows] = here
    z = data.position - seen - frames.origin[data.instrument]
    measured = np.isfinite(z)
    if not measured.all():  # coordinates that were not measured say nothing
        z, A = np.where(measured, z, 0.0), A * measured[:, :, None]
    turn, B = _turns(data, active, R, dR, frames, tool_turn, turned, D)
    return Linear(z, A, turn, B, turned)


def _turns(
    data: Measurements,
    active: BoolArray,
    R: Array,
    dR: Array,
    frames: InstrumentFrames,
    tool_turn: Array,
    turned: IntArray,
    D: int,
) -> tuple[Array, Array]:
    """Residual and slope of the orientations, in the reflector's own axes."""
    B = np.zeros((len(turned), 3, D))
    if not len(turned):
        return np.zeros((0, 3)), B
    K, V, Q = int(active.sum()), len(data.instruments), len(data.reflectors)
    pose, inst, refl = data.pose[turned], data.instrument[turned], data.reflector[turned]
    S = R[pose] @ tool_turn[refl]
    predicted = frames.rotation[inst] @ S
    spin = np.einsum("nijk,nlj->nilk", dR[pose], R[pose])  # dR R'
    w = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)  # (N', 3, K)
    B[:, :, :K] = np.swapaxes(S, 1, 2) @ w
    for n in range(len(turned)):
        B[n, :, K + 6 * inst[n] : K + 6 * inst[n] + 3] = predicted[n].T
        begin_ = K + 6 * V + 3 * Q + 3 * refl[n]
        B[n, :, begin_ : begin_ + 3] = np.eye(3)
    return rotation_vector(np.swapaxes(predicted, 1, 2) @ data.rotation[turned]), B


def _tool_turns(data: Measurements, frames: InstrumentFrames, rotation: Array) -> Array:
    """Each reflector's own axes in the flange, from its first measured orientation."""
    found = np.tile(np.eye(3), (len(data.reflectors), 1, 1))
    for r in range(len(found)):
        rows = np.flatnonzero((data.reflector == r) & np.isfinite(data.rotation[:, 0, 0]))
        if len(rows):
            n = int(rows[0])
            found[r] = rotation[data.pose[n]].T @ frames.rotation[data.instrument[n]].T @ data.rotation[n]
    return found


def _student(z: Array, s2: float) -> Array:
    """Weights of Student's t for rows of three, (N,)."""
    return np.asarray((FREEDOM + 3) / (FREEDOM + (z**2).sum(axis=1) / s2))
