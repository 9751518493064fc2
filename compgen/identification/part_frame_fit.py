r"""Where a part stands: its frame from spheres touched by an arm whose errors are known.

The touches are rows of a fit (``fit``) in which the arm's parameters are known and the part's frame (o, Q), the probe
t in the flange and the spheres whose places are not certain are free, by their priors N(t_0, PROBE^2) and
N(s_0, sigma^2). The noise is the touches' own, or what the residuals say where that is more. What warmth leaves open of
it is added where a frame is taught (``pipelines/measure/teach_frame``).
"""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, exchanged, owns, rms
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.rotations import cross_matrix
from compgen.core.units import DEG, MM, UM
from compgen.identification.fit import Fit, fit
from compgen.identification.instrument_frames import initial_frames, measured_distance
from compgen.identification.measurements import EXACT, NONE, FixedPlaces, Measurements
from compgen.identification.model import ArmModel
from compgen.identification.touch_rows import sigma_of, touched_poses
from compgen.identification.touches import Artefact, Touches, check_directions

PROBE = 0.5e-3  # [m] how far the probe may be from where the file has it
FLOOR = 3 * UM  # of the noise that residuals say
FAR = 4.5  # standard deviations beyond which a touch is set aside
FAR_OF_OTHERS = 2 * FAR  # the same of the noise that the others have: one in few hides in its own
ENOUGH = 18  # numbers of the others that tell their noise, beside frame and probe
MOST = 0.1  # share of touches that may be, or one
MISFIT = 2e-3  # [m] rms beyond which it is no noise
VAGUE = 5e-3  # [rad] of the frame's turn: the spheres lie on a line


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(probe=(3,), covariance=(9, 9), middle=(3,), flange=(3, 3), residual=("N",), outlier=("N",))
class FrameFit:
    """The part's frame and the probe, and how well they are known."""

    frame: Pose
    probe: Array  # (3,) [m] in the flange
    covariance: Array  # (9, 9) of (turn of the frame in World, its place as the probe finds it, probe) [rad], [m]
    middle: Array  # (3,) [m] of what was touched, in World
    flange: Array  # (3, 3) mean rotation of the flange at the touches
    noise: float  # [m] of one coordinate
    shared: float  # factor of its variance, for what touches of one sphere share
    residual: Array  # (N,) [m] distance, or along the probing direction
    outlier: BoolArray  # (N,) touches set aside

    @property
    def sigma(self) -> Array:
        """Standard deviations of turn [rad], place at the middle [m] and probe [m], (9,)."""
        return np.sqrt(np.diag(self.covariance))


def touches_of_part(artefact: Artefact, touches: Touches, direction: Array, nodes: int) -> Measurements:
    """Touches as rows of a fit, of a cold arm: one instrument, the part, and one reflector, the probe.

    Args:
        artefact: What was touched.
        touches: N of them.
        direction: That each joint came with, (N, 6) [-1, 1].
        nodes: Of the heat model.
    """
    fitted = np.flatnonzero(np.isnan(artefact.place[:, 0]) | (artefact.sigma > 0))  # the others are known exactly
    is_fitted = np.isin(touches.target, fitted)
    place = np.where(is_fitted, np.searchsorted(fitted, touches.target), NONE)
    return replace(
        touched_poses(artefact, touches, direction, sigma_of(touches), place, nodes),
        position=np.where(is_fitted[:, None], np.nan, artefact.place[touches.target]),
        reflectors=("probe",),
        instruments=(touches.file,),
        aligned=np.array([False]),
        fixed=FixedPlaces(
            names=tuple(artefact.names[s] for s in fitted.tolist()),
            frame=np.zeros(len(fitted), dtype=int),
            place=artefact.place[fitted],
            sigma=artefact.sigma[fitted],
        ),
        guess_sigma=np.array([PROBE]),
    )


def fit_frame(artefact: Artefact, touches: Touches, model: ArmModel, data: Measurements) -> FrameFit:
    """The frame that explains the touches.

    Args:
        artefact: What was touched.
        touches: N of them.
        model: The arm as it is known, nothing in it free.
        data: The touches as rows (``touches_of_part``), with the rises of their moments.

    Raises:
        InputError: Too few touches, spheres on a line, or touches that are not of this artefact.
    """
    count = len({int(s) for s in touches.target if np.isfinite(artefact.place[s, 0])})
    if count < 3:
        raise InputError(
            f"{touches.file}: {count} spheres of known places are touched, and a frame needs three that do not lie on "
            "a line; touch more"
        )
    outlier: BoolArray = np.zeros(len(touches.target), dtype=np.bool_)
    frame = _fit(touches, model, data, outlier)
    for _ in range(max(1, int(MOST * len(outlier)))):
        distance = frame.residual / (frame.noise * data.sigma)
        worst = int(np.argmax(np.where(outlier, 0.0, distance)))
        without = outlier | (np.arange(len(outlier)) == worst)
        if data.numbers[~without].sum() < ENOUGH:
            break
        others = _fit(touches, model, data, without)
        by_others = others.residual[worst] / (others.noise * data.sigma[worst])
        if distance[worst] <= FAR and by_others <= FAR_OF_OTHERS:
            break
        outlier, frame = without, others
    left = rms(frame.residual[~frame.outlier])
    if left > MISFIT:
        raise InputError(_misfit(artefact, touches, model, data, left))
    turn, worse = frame.sigma[:3].max(), frame.noise / float(np.median(sigma_of(touches)))
    if turn > VAGUE:
        if worse > 1 and turn / (worse * np.sqrt(frame.shared)) <= VAGUE:  # at the usual noise the spheres tell it
            raise InputError(_misfit(artefact, touches, model, data, left))
        raise InputError(
            f"{artefact.source}: the spheres touched lie on a line or near each other: the frame's turn is known to "
            f"{turn / DEG:.2f} deg only; touch spheres apart"
        )
    return frame


def _fit(touches: Touches, model: ArmModel, data: Measurements, outlier: BoolArray) -> FrameFit:
    """The frame by all touches but those set aside; the others are measured against it."""
    unit = float(np.median(sigma_of(touches)))
    kept = data.subset(~outlier)
    fitted = fit(model, kept, np.zeros(0, dtype=bool), learn=False, robust=False, noise=unit)
    F, position, rotation = fitted.frames.rotation[0], *model.pose(data, fitted.p)
    frame = Pose(-F.T @ fitted.frames.origin[0], F.T)
    residual = measured_distance(fitted.frames, data, position, rotation)
    if rms(residual[~outlier]) <= MISFIT:  # else something else is wrong
        inwards = fitted.frames.difference(data, position, rotation) @ F
        check_directions(touches, np.where(outlier[:, None], 0.0, inwards))
    measured = int(kept.numbers.sum())
    if measured < 7:
        raise InputError(f"{touches.label[0]}: {measured} measured numbers are too few for a frame; touch more")
    middle = frame.act(fitted.frames.far_ends(kept, position, rotation).mean(axis=0))
    # of (turn w and origin c of World in the part's frame) to turn and place at the middle: -Q w, m x Q w - Q c
    to_part, flange = np.eye(9), rotation[~outlier].mean(axis=0)
    to_part[:6, :6] = np.block([[-F.T, np.zeros((3, 3))], [cross_matrix(middle) @ F.T, -F.T]])
    to_part[3:6, 6:] = -flange  # a probe that is too long has the part as much nearer, and meets it
    scale = _variance_over(touches, kept, fitted, unit, measured)
    shared = _shared_by_sphere(touches.target[~outlier], touches.normal[~outlier], fitted.residual)
    return FrameFit(
        frame=frame,
        probe=fitted.frames.reflector[0],
        covariance=scale * shared * (to_part @ fitted.posterior.covariance[:9, :9] @ to_part.T),
        middle=middle,
        flange=flange,
        noise=unit * np.sqrt(scale),
        shared=shared,
        residual=residual,
        outlier=outlier,
    )


def _variance_over(touches: Touches, kept: Measurements, fitted: Fit, unit: float, measured: int) -> float:
    """The noise's variance over what the touches say, by what the fit leaves of each number that it does not take up.

    Touches that say their noise are believed, unless more is left.
    """
    sigma = unit * kept.sigma
    A = (fitted.linear.A / sigma[:, None, None]).reshape(-1, fitted.linear.A.shape[2])
    taken = float(np.einsum("ij,nj,ni->", fitted.posterior.covariance, A, A))
    chi2 = float(((fitted.residual / sigma[:, None]) ** 2).sum())
    scale = chi2 / (measured - taken) if measured - taken >= 1 else 1.0
    return max(scale, 1.0 if np.isfinite(touches.sigma).any() else (FLOOR / unit) ** 2)


def _shared_by_sphere(target: IntArray, normal: Array, residual: Array) -> float:
    """How much more the touches of a sphere err alike than each by itself, as a factor of the variance, 1 or more.

    Sums of residuals over S spheres, of which the frame has taken up six numbers, against those of independent ones;
    learnt from n = 3 S - 6 numbers it counts as Student's t does, n / (n - 2), at most twice.
    """
    away = np.where(np.isfinite(normal), residual[:, :1] * np.nan_to_num(normal), residual)
    sums = np.eye(int(target.max()) + 1)[:, target] @ away
    share, learnt = float((sums**2).sum()) / max(float((away**2).sum()), EXACT**2), 3 * len(np.unique(target)) - 6
    return max(share * (learnt + 6) / learnt, 1.0) * (learnt / (learnt - 2) if learnt > 4 else 2.0)


def measured_lengths(artefact: Artefact, touches: Touches, fitted: FrameFit, flange: Pose) -> list[tuple[int, float]]:
    """How much longer the arm has each certified length than its certificate, where that is more than noise.

    A touch from one side locates its sphere along the line to where the fitted frame has it.

    Returns:
        Number of the length, and the difference [m].
    """
    if artefact.certified is False:
        return []
    tip = flange.position - touches.deflection[:, None] * np.nan_to_num(touches.normal)
    tip = tip + flange.rotation @ fitted.probe
    radius = np.where(
        np.isfinite(touches.normal[:, 0]), (artefact.diameter[touches.target] + artefact.probe_diameter) / 2, 0.0
    )
    centres = {}
    for s in np.unique(touches.target[~fitted.outlier]).tolist():
        rows = (touches.target == s) & ~fitted.outlier
        middle = fitted.frame.act(artefact.place[s][None]) if np.isfinite(artefact.place[s, 0]) else tip[rows].mean(0)
        gap = middle - tip[rows]
        toward = gap / np.maximum(np.linalg.norm(gap, axis=1), 1e-12)[:, None]
        centres[s] = ((tip[rows] + radius[rows, None] * toward).mean(axis=0), int(rows.sum()))
    differences = []
    for n, (a, b) in enumerate(artefact.between.tolist()):
        if a in centres and b in centres:
            (at, of_a), (bt, of_b) = centres[a], centres[b]
            longer = float(np.linalg.norm(at - bt) - artefact.length[n])
            sigma = np.hypot(fitted.noise * np.sqrt(1 / of_a + 1 / of_b), artefact.length_sigma[n])
            if abs(longer) > FAR * sigma:
                differences.append((n, longer))
    return differences


def _misfit(artefact: Artefact, touches: Touches, model: ArmModel, data: Measurements, left: float) -> str:
    """Why touches do not fit: two names that are swapped, or something that is not said here."""
    missed = f"{touches.file}: the touches miss the spheres by {left / MM:.1f} mm (rms)"
    position, rotation = model.pose(data, np.zeros(0))
    for i, j in combinations(range(len(artefact.names)), 2):
        renamed = replace(touches, target=exchanged(len(artefact.names), i, j)[touches.target])
        rows = touches_of_part(artefact, renamed, data.direction, data.rise.shape[1])
        distance = measured_distance(initial_frames(rows, position, rotation), rows, position, rotation)
        if rms(distance) <= min(MISFIT, left / 2):
            return f"{missed}: are '{artefact.names[i]}' and '{artefact.names[j]}' swapped?"
    return (
        f"{missed}: check the spheres' places (mm) and names, the probe in the flange, the sign of value_mm, and the "
        "pendant's convention of the joints"
    )
