r"""Files measured from one setup: instruments whose fitted frames agree are one.

Two setups of an instrument are metres apart, or aligned with each other to some hundredths of a millimetre. Where the
frames of two files, fitted apart, agree within what both are known to,

    (x_i - x_j)' (C_ii + C_jj - C_ij - C_ji)^-1 (x_i - x_j) <= chi2(6),     x = (turn, origin)

and by less than NEAR, they are taken for one. What warmth does to the base is then seen against the cold poses."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.special import chdtri

from compgen.core.arrays import Array
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.rotations import rotation_vector
from compgen.core.units import UM
from compgen.identification.fit import Fit
from compgen.identification.measurements import Measurements, with_one_frame_a_name

CHANCE = 1e-3  # that frames of one setup are taken for two
CLOSE = 1e-3  # [m], [rad]: nobody sets an instrument up so nearly in the same place again without aligning it
NEAR = 0.15e-3  # [m], [rad]: frames further apart are of two setups, however little is known of them


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
