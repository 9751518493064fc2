r"""Where a part stands: its frame from spheres touched by an arm whose errors are known.

The model says where the probe's ball really was at touch n: c_n = P_n + R_n (t + e) - v_n n_n, with the flange (P, R)
at the joints and the rises of that moment, the probe t in the flange and its unknown error e, and the ball pushed back
by v along the probing direction n. In the part's frame (o, Q) with its spheres at s,

    o + Q s - c_n = 0                    where the touch located the sphere's centre
    |o + Q s - c_n| = (D + d) / 2        where it came from one side (diameters D of the sphere, d of the ball)

Gauss-Newton on (turn of Q, o, e, the spheres that are not certain), with N(0, PROBE^2) for e and N(0, sigma^2) for a
sphere's place. The noise is the touches' own, or what the residuals say where that is more. What the model of the
temperatures leaves unknown is added: the frame is fitted again with each modelled node's rise moved by its sigma.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, own, rms
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.rotations import cross_matrix, rotation_matrix
from compgen.core.units import DEG, MM, UM
from compgen.identification.touches import Artefact, Touches, check_directions

PROBE = 0.5e-3  # [m] how far the probe may be from where the file has it
FREE = 1.0  # [rad], [m] of one step of the frame: it damps, and does not bias
UNKNOWN = 1.0  # [m] prior of a sphere whose place is not known
NOISE = 20 * UM  # of a touch that does not say its own
FLOOR = 3 * UM  # of the noise that residuals say
STEPS = 20
CONVERGED = 1e-10  # [m]
FAR = 4.5  # standard deviations beyond which a touch is set aside
MOST = 0.1  # share of touches that may be
MISFIT = 2e-3  # [m] rms beyond which it is no noise
VAGUE = 5e-3  # [rad] of the frame's turn: the spheres lie on a line


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class FrameFit:
    """The part's frame and the probe, and how well they are known."""

    frame: Pose
    probe: Array  # (3,) [m] in the flange
    covariance: Array  # (9, 9) of (turn of the frame in World, its place at ``middle``, probe) [rad], [m]
    middle: Array  # (3,) [m] of what was touched, in World
    noise: float  # [m] of one coordinate
    residual: Array  # (N,) [m] distance, or along the probing direction
    outlier: BoolArray  # (N,) touches set aside

    def __post_init__(self) -> None:
        own(self, probe=(3,), covariance=(9, 9), middle=(3,), residual=("N",), outlier=("N",))

    @property
    def sigma(self) -> Array:
        """Standard deviations of turn [rad], place at the middle [m] and probe [m], (9,)."""
        return np.sqrt(np.diag(self.covariance))


def fit_frame(
    artefact: Artefact, touches: Touches, position: Array, rotation: Array, variants: list[Array]
) -> FrameFit:
    """The frame that explains the touches.

    Args:
        artefact: What was touched.
        touches: N of them.
        position: Flange at each by the model, (N, 3) [m] World.
        rotation: (N, 3, 3).
        variants: Flange positions with one unknown of the temperatures moved by its sigma each, (N, 3) [m].

    Raises:
        InputError: Too few touches, spheres on a line, or touches that are not of this artefact.
    """
    certain = np.asarray(np.isfinite(artefact.place).all(axis=1))
    count = len({int(s) for s in touches.target if certain[s]})
    if count < 3:
        raise InputError(
            f"{touches.file}: {count} spheres of known places are touched, and a frame needs three that do not lie on "
            "a line; touch more"
        )
    outlier: BoolArray = np.zeros(len(touches.target), dtype=np.bool_)
    for _ in range(1 + int(MOST * len(outlier))):
        fitted = _fit(artefact, touches, position, rotation, outlier)
        distance = np.abs(fitted.residual) / (fitted.noise * _relative(touches))
        worst = int(np.argmax(np.where(outlier, 0.0, distance)))
        if distance[worst] <= FAR or (outlier.sum() + 1) > MOST * len(outlier):
            break
        outlier = outlier.copy()
        outlier[worst] = True
    left = rms(fitted.residual[~fitted.outlier])
    if left > MISFIT:
        raise InputError(_misfit(artefact, touches, position, rotation, left))
    if fitted.sigma[:3].max() > VAGUE:
        raise InputError(
            f"{artefact.source}: the spheres touched lie on a line or near each other: the frame's turn is known to "
            f"{fitted.sigma[:3].max() / DEG:.2f} deg only; touch spheres apart"
        )
    covariance = np.array(fitted.covariance)
    for variant in variants:
        moved = _fit(artefact, touches, variant, rotation, outlier)
        turn = moved.frame.rotation @ fitted.frame.rotation.T
        axial = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
        change = np.concatenate([axial, moved.middle - fitted.middle, moved.probe - fitted.probe])
        covariance += np.outer(change, change)
    return FrameFit(
        frame=fitted.frame,
        probe=fitted.probe,
        covariance=covariance,
        middle=fitted.middle,
        noise=fitted.noise,
        residual=fitted.residual,
        outlier=fitted.outlier,
    )


def _relative(touches: Touches) -> Array:
    """Standard deviation of each touch beside the noise, (N,)."""
    own_sigma = np.where(np.isfinite(touches.sigma), touches.sigma, NOISE)
    return np.asarray(own_sigma / np.median(own_sigma))


def _fit(artefact: Artefact, touches: Touches, position: Array, rotation: Array, outlier: BoolArray) -> FrameFit:
    """Gauss-Newton from the frame that fits the spheres' rough centres."""
    N = len(touches.target)
    sides: BoolArray = np.isfinite(touches.normal[:, 0])
    radius = np.where(sides, (artefact.diameter[touches.target] + artefact.probe_diameter) / 2, 0.0)
    normal = np.nan_to_num(touches.normal)
    base = position - touches.deflection[:, None] * normal
    sphere = np.where(np.isfinite(artefact.place), artefact.place, 0.0)
    certain = np.asarray(np.isfinite(artefact.place).all(axis=1))
    tip = base + rotation @ artefact.probe
    known = certain[touches.target] & ~outlier
    frame = _kabsch(sphere[touches.target][known], (tip + radius[:, None] * normal)[known])
    probe_error = np.zeros(3)
    for s in np.flatnonzero(~certain).tolist():
        rows = touches.target == s
        if rows.any():
            sphere[s] = (((tip + radius[:, None] * normal)[rows].mean(axis=0)) - frame.position) @ frame.rotation
    prior_place, S = sphere.copy(), len(sphere)
    prior = np.concatenate(
        [np.full(6, FREE), np.full(3, PROBE), np.repeat(np.where(certain, artefact.sigma, UNKNOWN), 3)]
    )
    free = np.concatenate([np.ones(9, dtype=bool), prior[9:] > 0])
    sigma = np.median(np.where(np.isfinite(touches.sigma), touches.sigma, NOISE)) * _relative(touches)
    for _ in range(STEPS):
        tip = base + rotation @ (artefact.probe + probe_error)
        at = sphere[touches.target] @ frame.rotation.T
        gap = frame.position + at - tip
        J = np.zeros((N, 3, 9 + 3 * S))
        J[:, :, :3] = -cross_matrix(at)
        J[:, :, 3:6] = np.eye(3)
        J[:, :, 6:9] = -rotation
        for n in range(N):
            s = 9 + 3 * touches.target[n]
            J[n, :, s : s + 3] = frame.rotation
        length = np.linalg.norm(gap, axis=1)
        toward = np.where(sides[:, None], gap / np.maximum(length, 1e-12)[:, None], 0.0)
        along = np.einsum("ni,nij->nj", toward, J)
        kept = ~outlier
        rows_c, rows_s = kept & ~sides, kept & sides
        A = np.vstack([
            (J[rows_c] / sigma[rows_c, None, None]).reshape(-1, J.shape[2]), along[rows_s] / sigma[rows_s, None]
        ])  # fmt: skip
        r = np.concatenate([
            (gap[rows_c] / sigma[rows_c, None]).ravel(), (length - radius)[rows_s] / sigma[rows_s]
        ])  # fmt: skip
        offset = np.concatenate([np.zeros(6), probe_error, (sphere - prior_place).ravel()])
        weight = np.where(prior > 0, 1 / np.maximum(prior, 1e-12), 0.0)
        A = np.vstack([A, np.diag(weight)])[:, free]
        r = np.concatenate([r, weight * offset])
        step = np.zeros(len(free))
        step[free] = -np.linalg.lstsq(A, r, rcond=None)[0]
        frame = Pose(frame.position + step[3:6], rotation_matrix(step[None, :3])[0] @ frame.rotation)
        probe_error = probe_error + step[6:9]
        sphere = sphere + step[9:].reshape(S, 3)
        if np.abs(step[3:]).max() < CONVERGED:
            break
    check_directions(touches, np.where(kept[:, None], toward, 0.0))
    measured = int(3 * rows_c.sum() + rows_s.sum())
    if measured < 7:
        raise InputError(f"{touches.label[0]}: {measured} measured numbers are too few for a frame; touch more")
    normal_matrix = A.T @ A
    covariance = np.linalg.pinv(normal_matrix)
    # what the data's share of the normal equations determines
    effective = float(np.trace(covariance @ (A[:measured].T @ A[:measured])))
    spare = measured - effective
    chi2 = float((r[:measured] ** 2).sum())
    has_sigma = bool(np.isfinite(touches.sigma).any())
    scale = chi2 / spare if spare >= 1 else 1.0
    unit = float(np.median(sigma))
    scale = max(scale, 1.0) if has_sigma else max(scale, (FLOOR / unit) ** 2)
    residual = np.where(sides, length - radius, length)
    middle_local = sphere[touches.target[kept]].mean(axis=0)
    middle = frame.position + frame.rotation @ middle_local
    # the origin's place, moved to the middle of what was touched
    lever = np.eye(9)
    lever[3:6, :3] = -cross_matrix(frame.rotation @ middle_local)
    compact = np.zeros((9, 9))
    first = np.flatnonzero(free)[:9]
    compact[:, :] = covariance[: len(first), : len(first)]
    return FrameFit(
        frame=frame,
        probe=artefact.probe + probe_error,
        covariance=scale * (lever @ compact @ lever.T),
        middle=middle,
        noise=unit * np.sqrt(scale),
        residual=residual,
        outlier=outlier,
    )


def measured_lengths(artefact: Artefact, touches: Touches, fitted: FrameFit, flange: Pose) -> list[tuple[int, float]]:
    """How much longer the arm has each certified length than its certificate, where that is more than noise.

    A touch from one side locates its sphere along the line to where the fitted frame has it.

    Returns:
        Number of the length, and the difference [m].
    """
    tip = flange.position - touches.deflection[:, None] * np.nan_to_num(touches.normal)
    tip = tip + flange.rotation @ fitted.probe
    radius = np.where(
        np.isfinite(touches.normal[:, 0]), (artefact.diameter[touches.target] + artefact.probe_diameter) / 2, 0.0
    )
    centres = {}
    for s in np.unique(touches.target).tolist():
        rows = (touches.target == s) & ~fitted.outlier
        if not rows.any():
            continue
        middle = fitted.frame.act(artefact.place[s][None]) if np.isfinite(artefact.place[s, 0]) else tip[rows].mean(0)
        gap = middle - tip[rows]
        toward = gap / np.maximum(np.linalg.norm(gap, axis=1), 1e-12)[:, None]
        centres[s] = ((tip[rows] + radius[rows, None] * toward).mean(axis=0), int(rows.sum()))
    differences = []
    for n, (a, b) in enumerate(artefact.between.tolist()):
        if artefact.certified is False or a not in centres or b not in centres:
            continue
        (at, of_a), (bt, of_b) = centres[a], centres[b]
        longer = float(np.linalg.norm(at - bt) - artefact.length[n])
        sigma = np.hypot(fitted.noise * np.sqrt(1 / of_a + 1 / of_b), artefact.length_sigma[n])
        if abs(longer) > FAR * sigma:
            differences.append((n, longer))
    return differences


def _kabsch(sphere: Array, tip: Array) -> Pose:
    """The frame that puts spheres (M, 3) nearest to where they were touched (M, 3)."""
    middle, centre = sphere.mean(axis=0), tip.mean(axis=0)
    u, _, v = np.linalg.svd((sphere - middle).T @ (tip - centre))
    turn = v.T @ np.diag([1.0, 1.0, np.sign(np.linalg.det(v.T @ u.T))]) @ u.T
    return Pose(centre - turn @ middle, turn)


def _misfit(artefact: Artefact, touches: Touches, position: Array, rotation: Array, rms: float) -> str:
    """Why touches do not fit: two names that are swapped, or something that is not said here."""
    tip = position + rotation @ artefact.probe
    names = artefact.names
    missed = f"{touches.file}: the touches miss the spheres by {rms / MM:.1f} mm (rms)"
    for i in range(len(names)):
        for j in range(i):
            swapped = touches.target.copy()
            swapped[touches.target == i], swapped[touches.target == j] = j, i
            known = np.isfinite(artefact.place[swapped]).all(axis=1)
            frame = _kabsch(artefact.place[swapped][known], tip[known])
            gap = frame.position + artefact.place[swapped][known] @ frame.rotation.T - tip[known]
            radius = np.nan_to_num(artefact.diameter[swapped][known] + artefact.probe_diameter).max(initial=0.0) / 2
            if np.sqrt((gap**2).sum(axis=1).mean()) < max(0.3 * rms, 1.5 * radius * np.isfinite(touches.normal).any()):
                return f"{missed}: are '{names[j]}' and '{names[i]}' swapped?"
    return (
        f"{missed}: check the spheres' places (mm) and names, the probe in the flange, and the pendant's convention of "
        "the joints"
    )
