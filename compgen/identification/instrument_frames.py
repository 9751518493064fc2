r"""Frames of instruments and artefacts, reflectors, fixed places: unknown, and fitted with the parameters.

    y = F_i (P + R t_r + v) + c_i

for instrument i and reflector r at flange (P, R), moved by v; y is measured, or a fixed place.

A fit begins with those that explain the rows by the nominal arm. Rows whose far end is located in all coordinates (a
touch from one side locates its sphere roughly, along the probing direction) give two linear problems that alternate:
reflectors and places for given frames, frames (Kabsch 1976, by SVD) for given reflectors and places. What distances
alone tell of is found after that: a place c from

    |X_n|^2 - l_n^2 = 2 X_n' c - |c|^2

for a reflector on each node of a coarse grid in the flange, the nearest few of which least squares then improves.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import least_squares

from compgen.core.arrays import Array, BoolArray, IntArray, owns
from compgen.core.units import DEG
from compgen.identification.measurements import NONE, PLACE, Measurements

FAINT = 1e-6  # weight of what keeps a reflector near the flange where poses of one orientation do not tell its place
GUESSED = 0.2  # the same where a file says roughly where it is: to a few times what the nominal arm misses
ROUNDS = 50
START_NOISE = 1e-4  # [m] noise that a fit begins with; nominal arms leave more
TURNED = 10 * DEG  # from where on orientations tell better how an instrument stands, places being off as they are
TILTED = 0.5 * DEG  # rms by which two flanges differ about a second axis, from where on orientations alone tell it
PRIOR = 1e-4  # [m] a place known so well beforehand counts as one row
GRID = np.array([[x, y, z] for x in (0.0, -0.1, 0.1) for y in (0.0, -0.1, 0.1) for z in (0.1, 0.0, 0.2, 0.3)])
IMPROVED = 3  # nodes of the grid that are improved
TOLERANCE = 1e-3  # [m] misfit of a distance beyond which it counts less
EPSILON = np.cross(np.eye(3)[:, None], np.eye(3)[None]).transpose(2, 0, 1)  # (a x b)_i = e_iab a_a b_b


@dataclass(frozen=True, eq=False, slots=True)
@owns(rotation=("V", 3, 3), origin=("V", 3), reflector=("R", 3), place=("S", 3))
class InstrumentFrames:
    """World in each instrument's frame, each reflector in the flange, each fixed place in its frame."""

    rotation: Array  # (V, 3, 3)
    origin: Array  # (V, 3) [m]
    reflector: Array  # (R, 3) [m]
    place: Array = field(default_factory=lambda: np.zeros((0, 3)))  # (S, 3) [m]

    def rotation_of(self, instrument: IntArray) -> Array:
        """F of each row, (N, 3, 3); none for WORLD, which is -1."""
        return np.concatenate([self.rotation, np.eye(3)[None]])[instrument]

    def origin_of(self, instrument: IntArray) -> Array:
        """c of each row, (N, 3) [m]."""
        return np.concatenate([self.origin, np.zeros((1, 3))])[instrument]

    def near_ends(self, data: Measurements, position: Array, rotation: Array) -> Array:
        """Each row's reflector in World, moved by its shift, (N, 3) [m], for the flange at each pose."""
        P, R = position[data.pose], rotation[data.pose]
        reflector = P + np.einsum("nij,nj->ni", R, self.reflector[data.reflector])
        return np.asarray(reflector + data.ends.shift)

    def predict(self, data: Measurements, position: Array, rotation: Array) -> Array:
        """The near end of each row in its instrument's frame, (N, 3) [m]."""
        near = self.near_ends(data, position, rotation)
        F = self.rotation_of(data.instrument)
        return np.asarray(np.einsum("nij,nj->ni", F, near) + self.origin_of(data.instrument))

    def far_ends(self, data: Measurements, position: Array, rotation: Array) -> Array:
        """What each row is compared with, in its instrument's frame, (N, 3) [m]; NaN where not measured."""
        ends, far = data.ends, data.position.copy()
        at_place, at_pose = ends.place != NONE, ends.pose != NONE
        far[at_place] = self.place[ends.place[at_place]]
        P, R = position[ends.pose[at_pose]], rotation[ends.pose[at_pose]]
        far[at_pose] = P + np.einsum("nij,nj->ni", R, self.reflector[ends.reflector[at_pose]])
        return far

    def difference(self, data: Measurements, position: Array, rotation: Array) -> Array:
        """delta, the far end of each row less its near end, (N, 3) [m]; NaN where not measured."""
        return np.asarray(
            self.far_ends(data, position, rotation) - self.predict(data, position, rotation), dtype=np.float64
        )

    def residual(self, data: Measurements, position: Array, rotation: Array) -> Array:
        """What is measured less what is predicted, (N, 3) [m]: coordinates, or a distance in the first; NaN: none."""
        difference = self.difference(data, position, rotation)
        distances = np.isfinite(data.ends.distance)
        misfit = data.ends.distance - np.linalg.norm(difference, axis=1)
        difference[distances] = misfit[distances, None] * np.array([1.0, np.nan, np.nan])
        return difference


def measured_distance(frames: InstrumentFrames, data: Measurements, position: Array, rotation: Array) -> Array:
    """How far each row was measured from what is predicted, along the coordinates that were measured, (N,) [m]."""
    return np.asarray(np.linalg.norm(np.nan_to_num(frames.residual(data, position, rotation)), axis=1))


def kabsch(product: Array) -> Array:
    """The rotation R that makes tr(R M) largest, (3, 3): with M = sum a b^T it brings points a nearest to b."""
    u, _, v = np.linalg.svd(product)
    flip = np.diag([1, 1, np.sign(np.linalg.det(v.T @ u.T))])
    return np.asarray(v.T @ flip @ u.T)


def initial_frames(data: Measurements, position: Array, rotation: Array) -> InstrumentFrames:
    """Frames that fit the nominal arm best; robust against a few outliers."""
    V, R = len(data.instruments), len(data.reflectors)
    frames = InstrumentFrames(
        np.tile(np.eye(3), (V, 1, 1)), np.zeros((V, 3)), np.zeros((R, 3)), np.array(data.fixed.place)
    )
    sided = np.isfinite(data.ends.toward[:, 0])
    located = (data.numbers == 3) | sided
    if located.any():
        frames = _alternating(_as_located(data, sided).subset(located), frames, position, rotation)
    frames = replace(frames, place=np.nan_to_num(frames.place))
    if not located.all():
        frames = _with_distances(data, located, frames, position, rotation)
    return frames


def _as_located(data: Measurements, sided: BoolArray) -> Measurements:
    """Measurements whose distances with a direction are taken for places located along it."""
    ends = data.ends
    along = np.where(sided, ends.distance, 0.0)[:, None] * np.nan_to_num(ends.toward)
    distance = np.where(sided, np.nan, ends.distance)
    return replace(data, ends=replace(ends, shift=ends.shift + along, distance=distance))


def reflector_axes(data: Measurements, frames: InstrumentFrames, rotation: Array) -> Array:
    """Each reflector's own axes in the flange, (R, 3, 3): the mean of what its orientations say; else the flange's."""
    axes = np.tile(np.eye(3), (len(data.reflectors), 1, 1))
    flange = frames.rotation_of(data.instrument) @ rotation[data.pose]
    turns = np.swapaxes(flange, 1, 2) @ data.rotation
    seen = np.isfinite(data.rotation[:, 0, 0])
    for r in np.unique(data.reflector[seen]).tolist():
        axes[r] = kabsch(turns[seen & (data.reflector == r)].mean(axis=0).T)
    return axes


def with_orientations(
    data: Measurements, frames: InstrumentFrames, position: Array, rotation: Array
) -> InstrumentFrames:
    """Frames that orientations hold as well: places on a line do not tell how the instrument stands about it."""
    seen = np.isfinite(data.rotation[:, 0, 0])
    of = [seen & (data.instrument == i) & (not aligned) for i, aligned in enumerate(data.aligned.tolist())]
    if not np.any(of):
        return frames
    distance = measured_distance(frames, data, position, rotation)
    median = max(float(np.median(distance)), START_NOISE)
    near = frames.near_ends(data, position, rotation)
    by_places = {
        i: np.cov(near[data.instrument == i].T, bias=True) / median**2 @ frames.rotation[i].T
        for i, rows in enumerate(of)
        if rows.any()
    }
    alone = [_turned_alike(data.subset(rows), rotation[data.pose[rows]]) for rows in of]
    begin = [known if turn is None else turn for turn, known in zip(alone, frames.rotation, strict=True)]
    frames = replace(frames, rotation=np.array(begin))
    for _ in range(ROUNDS):
        turned = frames.rotation.copy()
        by_turns = rotation[data.pose] @ reflector_axes(data, frames, rotation)[data.reflector]
        by_turns = by_turns @ np.swapaxes(data.rotation, 1, 2) / TURNED**2
        for i, of_places in by_places.items():
            turned[i] = kabsch(of_places + by_turns[of[i]].mean(axis=0))
        frames = replace(frames, rotation=turned)
    placed = data.kind == PLACE
    rows, weight = data.subset(placed), 1 / np.maximum(distance[placed] / (4 * median), 1.0) ** 2
    anew = _fit_reflectors(rows, frames, position[rows.pose], rotation[rows.pose], weight)
    origin, reflector = frames.origin.copy(), frames.reflector.copy()
    of_rows, carried = np.unique(rows.instrument), np.unique(rows.reflector)
    origin[of_rows], reflector[carried] = anew.origin[of_rows], anew.reflector[carried]
    return replace(frames, origin=origin, reflector=reflector)


def _turned_alike(rows: Measurements, rotation: Array) -> Array | None:
    """F of the rows of one instrument by R' = F R A alone, whatever A each reflector has; None: too few are tilted.

    A cancels between two rows n, m of a reflector, R'_n R'_m^T = F R_n R_m^T F^T: F turns the axis of the one into that
    of the other. All pairs together are known from the moments of single rows.
    """
    product, pairs = np.zeros((3, 3)), 0
    for r in np.unique(rows.reflector).tolist():
        of = rows.reflector == r
        moment = np.einsum("nac,ndf->acdf", rotation[of], rows.rotation[of])
        pairs += int(of.sum()) ** 2
        product += np.einsum("iab,jde,acdf,bcef->ij", EPSILON, EPSILON, moment, moment, optimize=True) / 4
    tilted = np.linalg.svd(product, compute_uv=False)[1] > TILTED**2 * pairs
    return kabsch(product) if tilted else None


def _alternating(data: Measurements, frames: InstrumentFrames, position: Array, rotation: Array) -> InstrumentFrames:
    P, rotation_of_row = position[data.pose] + data.ends.shift, rotation[data.pose]
    weight = np.ones(len(P))
    previous = np.inf
    for _ in range(ROUNDS):
        reflector = P + np.einsum("nij,nj->ni", rotation_of_row, frames.reflector[data.reflector])
        frames = _fit_instruments(data, frames, reflector, frames.far_ends(data, position, rotation), weight)
        frames = _fit_reflectors(data, frames, P, rotation_of_row, weight)
        distance = measured_distance(frames, data, position, rotation)
        median = max(float(np.median(distance)), 1e-9)
        weight = 1 / np.maximum(distance / (4 * median), 1.0) ** 2
        if abs(previous - median) <= 0.02 * median:
            break
        previous = median
    return frames


def _fit_instruments(
    data: Measurements, frames: InstrumentFrames, reflector: Array, far: Array, weight: Array
) -> InstrumentFrames:
    """Each instrument's frame, by Kabsch; an aligned one only moves."""
    rotation, origin = frames.rotation.copy(), frames.origin.copy()
    for i, aligned in enumerate(data.aligned.tolist()):
        rows = data.instrument == i
        measured = np.isfinite(far[rows])
        total = np.array([weight[rows][column].sum() or 1.0 for column in measured.T])
        share = weight[rows, None] * measured / total
        place = np.where(measured, far[rows], 0.0)
        centre, measured_centre = (share * reflector[rows]).sum(axis=0), (share * place).sum(axis=0)
        if not aligned:
            rotation[i] = kabsch((share * (reflector[rows] - centre)).T @ (place - measured_centre))
        origin[i] = measured_centre - rotation[i] @ centre
    return replace(frames, rotation=rotation, origin=origin)


def _fit_reflectors(
    data: Measurements, frames: InstrumentFrames, P: Array, rotation: Array, weight: Array
) -> InstrumentFrames:
    """Reflectors, origins and fixed places together, linear for given frame rotations."""
    V, R, S = len(frames.origin), len(frames.reflector), len(frames.place)
    N = len(P)
    F = frames.rotation_of(data.instrument)
    flange = np.einsum("nij,nj->ni", F, P)
    at_place, unit = data.ends.place, np.broadcast_to(np.eye(3), (N, 3, 3))
    parts = (data.reflector, R, F @ rotation), (data.instrument, V, unit), (at_place, S, -unit)
    A = np.concatenate([_columns_of(which, count, matrix) for which, count, matrix in parts], axis=2)
    measured = np.isfinite(data.position) | (at_place != NONE)[:, None]
    root = np.sqrt(weight)[:, None] * measured  # a coordinate that was not measured says nothing
    lhs = (A * root[:, :, None]).reshape(3 * N, -1)
    rhs = ((np.nan_to_num(data.position) - flange) * root).ravel()
    guess = np.full((R, 3), np.nan) if data.guess is None else data.guess
    weight_of_guess = np.where(np.isfinite(guess), GUESSED, FAINT).ravel()
    regularisation = weight_of_guess[:, None] * np.eye(lhs.shape[1])[: 3 * R]
    known, known_place = _known_places(data, lhs.shape[1])
    x = np.linalg.lstsq(
        np.vstack([lhs, regularisation, known]),
        np.concatenate([rhs, weight_of_guess * np.nan_to_num(guess).ravel(), known_place]),
        rcond=None,
    )[0]
    return InstrumentFrames(
        frames.rotation, x[3 * R : 3 * (R + V)].reshape(V, 3), x[: 3 * R].reshape(R, 3), x[3 * (R + V) :].reshape(S, 3)
    )


def _columns_of(which: IntArray, count: int, matrix: Array) -> Array:
    """Matrices of rows, (N, 3, 3), in the columns of the one of K that each row is of, (N, 3, 3 K); -1: of none."""
    is_of = which[:, None] == np.arange(count)
    return np.asarray(np.einsum("nk,nij->nikj", is_of, matrix).reshape(len(which), 3, 3 * count))


def _known_places(data: Measurements, size: int) -> tuple[Array, Array]:
    """Rows that keep fixed places near where they are known to be: (H, size) and (H,)."""
    S = len(data.fixed.names)
    known = np.flatnonzero(np.isfinite(data.fixed.place[:, 0]))
    weight = np.repeat(PRIOR / np.maximum(data.fixed.sigma[known], PRIOR), 3)
    columns = size - 3 * S + (3 * known[:, None] + np.arange(3)).ravel()
    return weight[:, None] * np.eye(size)[columns], weight * data.fixed.place[known].ravel()


def _with_distances(
    data: Measurements, located: BoolArray, frames: InstrumentFrames, position: Array, rotation: Array
) -> InstrumentFrames:
    """Frames with the reflectors and the fixed places that distances alone tell of."""
    rows, elsewhere = data.subset(~located), data.subset(located)
    ends = rows.ends
    reflectors = np.setdiff1d(np.append(rows.reflector, ends.reflector[ends.pose != NONE]), elsewhere.reflector)
    places = np.setdiff1d(ends.place[ends.place != NONE], elsewhere.ends.place)
    if not len(reflectors) + len(places):
        return frames

    def at(x: Array) -> InstrumentFrames:
        reflector, place = frames.reflector.copy(), frames.place.copy()
        reflector[reflectors] = x[: 3 * len(reflectors)].reshape(-1, 3)
        place[places] = x[3 * len(reflectors) :].reshape(-1, 3)
        return replace(frames, reflector=reflector, place=place)

    def misfit(x: Array) -> Array:
        return np.asarray(at(x).residual(rows, position, rotation)[:, 0])

    turns = frames.rotation_of(rows.instrument) @ rotation[rows.pose], rotation[ends.pose]

    def slopes(x: Array) -> Array:
        return _slopes(at(x).difference(rows, position, rotation), rows, *turns, reflectors, places)

    starts = []
    for node in GRID if len(reflectors) else GRID[:1]:
        begin = at(np.concatenate([np.tile(node, len(reflectors)), frames.place[places].ravel()]))
        near = begin.predict(rows, position, rotation)
        centres = [_centre(near[ends.place == s], ends.distance[ends.place == s]) for s in places.tolist()]
        start = np.concatenate([np.tile(node, len(reflectors)), *centres])
        starts.append((float(np.median(np.abs(misfit(start)))), start))
    starts.sort(key=lambda pair: pair[0])
    improved = [
        least_squares(misfit, start, slopes, loss="soft_l1", f_scale=TOLERANCE, x_scale=0.1).x
        for _, start in starts[:IMPROVED]
    ]
    return at(min(improved, key=lambda x: float(np.median(np.abs(misfit(x))))))


def _slopes(
    away: Array, rows: Measurements, near_turns: Array, far_turns: Array, reflectors: IntArray, places: IntArray
) -> Array:
    """Of the misfit l - |delta| for differences (N, 3): by a reflector of the near end, of the far one, by a place."""
    ends = rows.ends
    away = away / np.linalg.norm(away, axis=1)[:, None]
    away[np.isnan(ends.distance)] = [-1.0, 0.0, 0.0]  # a coordinate
    by_near, by_far = (np.einsum("ni,nij->nj", away, turns)[:, None] for turns in (near_turns, far_turns))
    is_near = (rows.reflector[:, None] == reflectors)[:, :, None]
    is_far = ((ends.reflector[:, None] == reflectors) & (ends.pose != NONE)[:, None])[:, :, None]
    is_place = (ends.place[:, None] == places)[:, :, None]
    by_reflector = is_near * by_near - is_far * by_far
    return np.concatenate([by_reflector, is_place * -away[:, None]], axis=1).reshape(len(away), -1)


def _centre(near: Array, distance: Array) -> Array:
    """The place that lies at some distances from others, (3,) [m]."""
    middle = near.mean(axis=0)
    X = near - middle
    lhs = np.column_stack([2 * X, -np.ones(len(X))])
    return np.asarray(middle + np.linalg.lstsq(lhs, (X**2).sum(axis=1) - distance**2, rcond=None)[0][:3])
