r"""Files beside each other: which were measured from one setup, and how well each is known.

Instruments whose fitted frames agree are one.

Two setups of an instrument are metres apart, or aligned with each other to some hundredths of a millimetre. Where the
frames of two files, fitted apart, agree within what both are known to,

    (x_i - x_j)' (C_ii + C_jj - C_ij - C_ji)^-1 (x_i - x_j) <= chi2(6),     x = (turn, origin)

and by less than NEAR, they are taken for one. What warmth does to the base is then seen against the cold poses.

A file's noise is told by its rows, each by how far the others leave it off: half of Gaussian rows of k numbers are
within the median of chi2(k), and up to half may be wild."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np
from scipy.special import chdtri

from compgen.core.arrays import Array, BoolArray
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.rotations import rotation_vector
from compgen.core.units import UM
from compgen.identification.fit import Fit
from compgen.identification.measurements import PLACE, Measurements, with_one_frame_a_name
from compgen.identification.outliers import leave_one_out_distance

CHANCE = 1e-3  # that frames of one setup are taken for two
CLOSE = 1e-3  # [m], [rad]: nobody sets an instrument up so nearly in the same place again without aligning it
NEAR = 0.15e-3  # [m], [rad]: frames further apart are of two setups, however little is known of them
LEAST_ROWS = 12  # of a file, that tell its noise


def with_shared_setups(data: Measurements, fitted: Fit) -> tuple[Measurements, list[Finding]]:
    """Measurements in which instruments of one setup are one, and a note of each."""
    K, C = int(fitted.active.sum()), fitted.posterior.covariance

    def is_one(i: int, j: int, difference: Array) -> bool:
        a, b = (slice(K + 6 * k, K + 6 * k + 6) for k in (i, j))
        spread = C[a, a] + C[b, b] - C[a, b] - C[a, b].T
        near = bool(np.abs(difference).max() <= NEAR)
        return near and bool(difference @ np.linalg.solve(spread, difference) <= chdtri(6, CHANCE))

    merged, pairs = _merged(data, fitted, is_one)
    messages = [
        f"{data.instruments[j]} and {data.instruments[i]}: their frames agree to "
        f"{np.linalg.norm(_difference(fitted, i, j)[3:]) / UM:.0f} um: taken as measured from one setup"
        for i, j in pairs
    ]
    return merged, [Finding.of(Code.SETUP, message) for message in messages]


def as_one_setup(data: Measurements, fitted: Fit) -> Measurements:
    """Measurements in which all instruments that stood within CLOSE are one, whatever their frames say of warmth."""
    return _merged(data, fitted, lambda i, j, difference: bool(np.abs(difference).max() <= CLOSE))[0]


def _merged(
    data: Measurements, fitted: Fit, is_one: Callable[[int, int, Array], bool]
) -> tuple[Measurements, list[tuple[int, int]]]:
    """Measurements in which each instrument is the first that it is one with, and these pairs; axis tests stay."""
    names, pairs = list(data.instruments), list[tuple[int, int]]()
    for i in np.flatnonzero(~data.aligned).tolist():
        earlier = [j for j in np.flatnonzero(~data.aligned[:i]).tolist() if names[j] == data.instruments[j]]
        j = next((j for j in earlier if is_one(i, j, _difference(fitted, i, j))), None)
        if j is not None:
            names[i] = names[j]
            pairs.append((i, j))
    return (with_one_frame_a_name(replace(data, instruments=tuple(names))) if pairs else data), pairs


def _difference(fitted: Fit, i: int, j: int) -> Array:
    """Turn [rad] and shift [m] of one frame against another, (6,), in the axes of the instruments."""
    rotation, origin = fitted.frames.rotation, fitted.frames.origin
    return np.concatenate([rotation_vector((rotation[i] @ rotation[j].T)[None])[0], origin[i] - origin[j]])


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class FileNoise:
    """How well a file is known that stands beside others of its kind."""

    name: str  # of the file, or of the instrument of several
    files: list[str]
    kind: int
    rows: BoolArray  # (N,) that are its own
    factor: float  # by which its rows scatter more than they are weighed for
    noise: float  # [m] of a coordinate, or a distance, of a usual row


def noises_of_files(data: Measurements, fitted: Fit) -> list[FileNoise]:
    """The noise of each file, of those kinds of rows of which several tell theirs and not all say it.

    Files of one instrument have one, also a warm-up and the cold poses of its setup.
    """
    distance = leave_one_out_distance(fitted.linear, fitted.posterior, data, fitted.outlier)
    ratio = distance / chdtri(np.maximum(fitted.linear.A.any(axis=2).sum(axis=1), 1), 0.5)
    file, noises = _files(data), list[FileNoise]()
    owner = _owners(data, file)
    for kind in np.unique(data.kind).tolist():
        of_kind = data.kind == kind
        if data.stated_sigma is not None and np.isfinite(data.stated_sigma[of_kind]).all():
            continue
        of_owners = [(name, of_kind & (owner == name)) for name in dict.fromkeys(owner[of_kind].tolist())]
        several = [(name, rows) for name, rows in of_owners if rows.sum() >= LEAST_ROWS]
        for name, rows in several if len(several) > 1 else ():
            factor = float(np.sqrt(np.median(ratio[rows])))
            noise = factor * float(np.median(fitted.noise_of_row[rows] * data.sigma[rows]))
            files = sorted(set(file[rows].tolist()))
            noises.append(FileNoise(name=name, files=files, kind=kind, rows=rows, factor=factor, noise=noise))
    return noises


def _files(data: Measurements) -> Array:
    """The file of each row, (N,)."""
    return np.array([data.file(n) for n in range(len(data.pose))], dtype=object)


def _owners(data: Measurements, file: Array) -> Array:
    """The instrument that measured each place, by its name, else the file of each row, (N,)."""
    owner = file.copy()
    for i, name in enumerate(data.instruments):
        rows = (data.instrument == i) & (data.kind == PLACE)
        if not data.aligned[i] and rows.any():
            owner[rows if data.named_instrument(i) else rows & (data.warm[data.pose] > 0)] = name
    return owner


def weighed_by_noise(data: Measurements, noises: Sequence[FileNoise]) -> Measurements:
    """Measurements whose files weigh by their own noise."""
    sigma, file = data.sigma.copy(), _files(data)
    for noise in noises:
        sigma[np.isin(file, noise.files) & (data.kind == noise.kind)] *= noise.factor
    for rows in (data.kind == kind for kind in {noise.kind for noise in noises}):
        sigma[rows] /= np.median(sigma[rows])
    return replace(data, sigma=sigma)


def differ(noises: Sequence[FileNoise], times: float) -> list[tuple[FileNoise, FileNoise]]:
    """The best and the worst file of each kind whose noises are so many times apart."""
    of_kinds = [[noise for noise in noises if noise.kind == kind] for kind in {noise.kind for noise in noises}]
    pairs = [(min(of, key=attrgetter("noise")), max(of, key=attrgetter("noise"))) for of in of_kinds]
    return [(best, worst) for best, worst in pairs if worst.noise > times * best.noise]
