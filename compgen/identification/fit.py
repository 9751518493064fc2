r"""The fit: Gauss-Newton steps on the most probable parameters, scales by maximum evidence, outliers set aside.

    minimise  sum_n w_n |z_n(p, frames)|^2 / s^2  +  sum_k (p_k / sigma_k)^2 / lambda_g(k)

with the residuals z of places, touches and distances (``linearisation``); each kind has a noise s of its own.

Each step linearises all rows at once (``ArmModel.derivatives``), solves the linear problem with its scales
(``evidence``) and is shortened while it makes the sum worse. First with weights of Student's t, so that outliers do not
bend the answer; then without those rows whose deviation, allowing for how strongly each row draws the fit to itself,
has a chance below 1 % of happening even once in all rows of Gaussian noise."""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.rotations import rotation_matrix
from compgen.identification.evidence import Posterior, Scales, pose_equations
from compgen.identification.instrument_frames import (
    START_NOISE,
    InstrumentFrames,
    initial_frames,
    measured_distance,
    reflector_axes,
    with_orientations,
)
from compgen.identification.linearisation import (
    FRAME_PRECISION,
    FitUnknowns,
    Linearisation,
    LinearProblem,
    fit_unknowns,
    linearise,
    prior_at,
    unknowns_at,
)
from compgen.identification.measurements import KINDS, KNOWN, ORIENTATION, PLACE, Measurements
from compgen.identification.model import ArmModel
from compgen.identification.outliers import leave_one_out_distance, outlier_threshold, student_weights

STEPS = 10
SHARES = (1, 1 / 4, 1 / 16, 1 / 64, 1 / 256, 1 / 1024)  # of a step: the first that makes the sum no worse is taken
ROUNDS = 5  # of setting outliers aside
SETTLED = 0.1  # change of the poses' share of the noise, over the whole, that needs no further round
CONVERGED = 1e-10  # m: a step that moves no row further ends the fit
NEGLIGIBLE = 1e-3  # share of the noise: so does one that moves no row further than this, when scales are learnt
SEEN_TWICE = 30.0  # degrees of freedom within and between poses that tell their noises apart
LARGEST = 25.0  # of rho


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Fit:
    """The fitted parameters and frames, how well they are known, and the residuals."""

    p: Array  # (K,) [SI]
    frames: InstrumentFrames
    reflector_rotation: Array  # (R, 3, 3) of each reflector's own axes
    posterior: Posterior
    active: BoolArray  # (K,) parameters that were free
    sigma: Array  # (K,) [SI] standard deviation, the prior's where nothing was free
    gamma: Array  # (K,) share of each that the data determines
    outlier: BoolArray  # (N,) rows set aside
    residual: Array  # (N, 3) [m] measured less predicted: coordinates, or a distance in the first
    kind: IntArray  # (N,) of each row
    linear: Linearisation

    def problem(self, model: ArmModel, data: Measurements, linear: Linearisation | None = None) -> LinearProblem:
        """The linear problem at the fit, without the rows set aside; ``linear``: of other data at the same point."""
        linear = self.linear if linear is None else linear
        size = linear.A.shape[2]
        return LinearProblem(
            data=data,
            linear=linear,
            weight=(~self.outlier) / data.sigma**2,
            x=unknowns_at(model, self.active, self.p, size),
            prior=prior_at(model, data, self.active, self.frames, size),
            scales=self.posterior.scales,
        )

    @property
    def noise(self) -> float:
        """Standard deviation of one number of one row [m]: of a place where an instrument measured any."""
        return float(np.sqrt(row_variance(self.posterior.scales, int(self.kind.min(initial=len(KINDS))))))

    @property
    def noise_of_row(self) -> Array:
        """Standard deviation of one number of each row, (N,) [m], beside what the row says of itself."""
        variance = np.array([row_variance(self.posterior.scales, kind) for kind in range(len(KINDS))])
        return np.asarray(np.sqrt(variance)[self.kind])


def fit(
    model: ArmModel,
    data: Measurements,
    active: BoolArray,
    *,
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
        robust: Set outliers aside.
        start: Where to begin.
        noise: Known standard deviation [m], when it shall not be learnt.
    """
    solver = _Solver(
        model=model,
        data=data,
        active=active,
        learn=learn,
        noise=noise,
    )
    point = solver.initial(start)
    weight = np.ones(len(data.pose))
    outlier = np.zeros(len(weight), dtype=bool)
    if robust:
        point, solution = solver.minimise(point, weight, student=True)
        outlier = solver.find_outliers(point, solution, outlier)
    for _ in range(ROUNDS):
        point, solution = solver.minimise(point, (~outlier).astype(float))
        if not robust:
            break
        rho = solver.common_noise(point, solution, outlier)
        updated = solver.find_outliers(point, solution, outlier)
        if np.array_equal(updated, outlier) and abs(rho - point.scales.rho) <= SETTLED * (1 + rho):
            break
        outlier, point = updated, replace(point, scales=replace(point.scales, rho=rho))
    return solver.finish(point, solution, outlier)


@dataclass(frozen=True, slots=True)
class PoseNoise:
    """What the rows of a pose share, by how their residuals agree."""

    rho: float  # of its variance over s^2; below nothing where they agree less than by chance
    spread: float  # standard deviation of rho
    variance: float  # s^2 [m^2] of one coordinate of a row


def pose_noise(data: Measurements, z: Array, rows: BoolArray, known: float) -> PoseNoise | None:
    """The noise that rows of one pose share, from residuals (N, 3) of some rows; None where they do not tell.

    Within poses s^2 (n - 1) is left a coordinate, between them s^2 (1 + rho (sum 1/sigma)^2 / n), less what the
    parameters take up: of alike rows, s^2 (1 + n rho).

    Args:
        data: Whose rows they are.
        z: Residuals [m].
        rows: Those that count, places by an instrument, (N,).
        known: How many parameters the rows have told.
    """
    pose, scaled = data.pose[rows], z[rows] / data.sigma[rows, None]
    count = np.bincount(pose, minlength=len(data.theta)).astype(float)
    used = count > 0
    sums = np.stack([np.bincount(pose, column, len(count)) for column in scaled.T], axis=1)[used]
    between = float((sums**2 / count[used, None]).sum())
    within = float((scaled**2).sum()) - between
    free_within = 3.0 * float((count[used] - 1).sum()) - 3 * (len(data.reflectors) - 1)
    free_between = 3.0 * float(used.sum()) - known - 6 * len(data.instruments) - 3
    if free_within < SEEN_TWICE or free_between < SEEN_TWICE:
        return None
    lever = np.bincount(pose, 1 / data.sigma[rows], len(count))[used] ** 2 / count[used]
    ratio, of_pose = between / free_between / (within / free_within), float(lever.mean())
    spread = ratio * np.sqrt(2 / free_between + 2 / free_within) / of_pose
    return PoseNoise((ratio - 1) / of_pose, float(spread), within / free_within)


def row_variance(scales: Scales, kind: int) -> float:
    """Variance of one number of one row of a kind: its own noise, and that of its pose [m^2]."""
    return float(scales.noise[kind]) * (1 + (scales.rho if kind == PLACE else 0.0))


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class _Iterate:
    p: Array
    frames: InstrumentFrames
    reflector_rotation: Array
    scales: Scales
    linear: Linearisation


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class _Solver:
    """What does not change during one fit, and the steps of the fit."""

    model: ArmModel
    data: Measurements
    active: BoolArray
    learn: bool
    noise: float | None

    def initial(self, start: Fit | None) -> _Iterate:
        if start is not None:
            p, scales = np.where(self.active, start.p, 0.0), start.posterior.scales
            return self._at(p, start.frames, start.reflector_rotation, scales)
        p = np.zeros(len(self.model.parameters))
        position, rotation = self.model.pose(self.data, p)
        frames = initial_frames(self.data, position, rotation)
        frames = with_orientations(self.data, frames, position, rotation)
        distance = measured_distance(frames, self.data, position, rotation)
        s2 = self.noise**2 if self.noise else max(START_NOISE, 0.2 * float(np.median(distance))) ** 2
        names, _ = self.model.groups()
        scales = Scales(np.ones(len(names)), np.where(np.arange(len(KINDS)) == KNOWN, 1.0, s2))
        axes = reflector_axes(self.data, frames, rotation)
        return self._at(p, frames, axes, scales)

    def _at(self, p: Array, frames: InstrumentFrames, axes: Array, scales: Scales) -> _Iterate:
        linear = linearise(self.model, self.data, self.active, p, frames, axes)
        return _Iterate(p=p, frames=frames, reflector_rotation=axes, scales=scales, linear=linear)

    def minimise(self, point: _Iterate, weight: Array, *, student: bool = False) -> tuple[_Iterate, Posterior]:
        """Gauss-Newton steps until no row moves, and the solution that the last of them led to."""
        data = self.data
        learning = self.learn or self.noise is None
        kinds = np.unique(data.kind)
        for _ in range(STEPS):
            w = weight / data.sigma**2
            if student:
                w = w * student_weights(
                    point.linear.z / data.sigma[:, None], point.scales.noise[data.kind], data.numbers
                )
            problem = self._problem(point, w)
            solution = problem.solve(learn_groups=self.learn, learn_noise=self.noise is None)
            cost = self._cost(point, w, solution.scales)
            for share in SHARES:
                candidate = self._stepped(point, solution, problem.x, share)
                if self._cost(candidate, w, solution.scales) <= cost * (1 + 1e-9):
                    break
            largest_shift = float(np.abs(candidate.linear.z - point.linear.z).max())
            scales_moved = float(np.abs(np.log(solution.scales.noise / point.scales.noise)[kinds]).max())
            point = candidate
            faint = NEGLIGIBLE * float(np.sqrt(point.scales.noise[kinds].min()))
            if largest_shift < CONVERGED or (learning and largest_shift < faint and scales_moved < 0.01):
                break
        return point, solution

    def _problem(self, point: _Iterate, weight: Array) -> LinearProblem:
        size = self.unknowns.size
        return LinearProblem(
            data=self.data,
            linear=point.linear,
            weight=weight,
            x=unknowns_at(self.model, self.active, point.p, size),
            prior=prior_at(self.model, self.data, self.active, point.frames, size),
            scales=point.scales,
        )

    @property
    def unknowns(self) -> FitUnknowns:
        """Which columns are whose."""
        return fit_unknowns(self.data, self.active)

    def _stepped(self, point: _Iterate, solution: Posterior, x0: Array, share: float) -> _Iterate:
        unknowns = self.unknowns
        K = unknowns.parameters
        step = share * (solution.x - x0)
        p = point.p.copy()
        p[self.active] += step[:K] * self.model.prior[self.active]
        V, Q, S = unknowns.instruments, unknowns.reflectors, unknowns.places
        frame_step = step[K : unknowns.frame(V).start].reshape(V, 6)
        frames = InstrumentFrames(
            rotation_matrix(frame_step[:, :3]) @ point.frames.rotation,
            point.frames.origin + frame_step[:, 3:],
            point.frames.reflector + step[unknowns.reflector(0).start : unknowns.reflector(Q).start].reshape(Q, 3),
            point.frames.place + step[unknowns.place(0).start : unknowns.place(S).start].reshape(S, 3),
        )
        rotation = point.reflector_rotation
        if unknowns.oriented:
            rotation = rotation @ rotation_matrix(step[unknowns.turn(0).start :].reshape(Q, 3))
        return self._at(p, frames, rotation, solution.scales)

    def _cost(self, point: _Iterate, w: Array, scales: Scales) -> float:
        problem, linear, kind = self._problem(point, w), point.linear, self.data.kind
        cost = float((w * (linear.z**2).sum(axis=1) / scales.noise[kind]).sum())
        if scales.rho:
            places, A = kind == PLACE, linear.A[:, :, :0]
            shared = pose_equations(A[places], linear.z[places], w[places], self.data.pose[places], scales.rho)
            cost -= shared.sum_of_squares / float(scales.noise[PLACE])
        cost += float((w[linear.oriented, None] * linear.turn**2).sum() / scales.noise[ORIENTATION])
        cost += float((linear.known**2).sum())
        u, prior = problem.x, problem.prior
        K = len(prior.group)
        cost += float((u[:K] ** 2 / scales.group[prior.group]).sum())
        held = prior.precision > FRAME_PRECISION
        cost += float((prior.precision * prior.mean**2)[held].sum())
        return cost

    def common_noise(self, point: _Iterate, solution: Posterior, outlier: BoolArray) -> float:
        """rho, from how the residuals of a pose agree; 0 where poses have one row each."""
        if self.noise is not None:
            return 0.0
        places = ~outlier & (self.data.kind == PLACE)
        noise = pose_noise(self.data, point.linear.z, places, float(solution.gamma.sum()))
        return 0.0 if noise is None else float(np.clip(noise.rho, 0.0, LARGEST))

    def find_outliers(self, point: _Iterate, solution: Posterior, outlier: BoolArray) -> BoolArray:
        """Rows too far off to be noise, (N,)."""
        distance = leave_one_out_distance(point.linear, solution, self.data, outlier)
        return np.asarray(distance > outlier_threshold(len(distance), self.data.numbers))

    def finish(self, point: _Iterate, solution: Posterior, outlier: BoolArray) -> Fit:
        sigma, gamma = self.model.prior.copy(), np.zeros(len(point.p))
        K = int(self.active.sum())
        if K:
            sigma[self.active] *= np.sqrt(np.diag(solution.covariance)[:K])
            gamma[self.active] = solution.gamma
        return Fit(
            p=point.p,
            frames=point.frames,
            reflector_rotation=point.reflector_rotation,
            posterior=solution,
            active=self.active,
            sigma=sigma,
            gamma=gamma,
            outlier=outlier,
            residual=point.linear.z,
            kind=self.data.kind,
            linear=point.linear,
        )
