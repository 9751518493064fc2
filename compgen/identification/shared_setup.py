r"""Files measured from one setup: instruments whose fitted frames agree are one.

Two setups of an instrument are metres apart, or aligned with each other to some hundredths of a millimetre. Where the
frames of two files, fitted apart, agree within what both are known to,

    (x_i - x_j)' (C_ii + C_jj - C_ij - C_ji)^-1 (x_i - x_j) <= chi2(6),     x = (turn, origin)

and by less than NEAR, they are taken for one. What warmth does to the base is then seen against the cold poses."""

from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from compgen.core.arrays import Array
from compgen.core.codes import Code, Level
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
    K = int(fitted.active.sum())
    names, findings = list(data.instruments), list[Finding]()
    for i in range(1, len(names)):
        for j in range(i):
            if data.aligned[i] or data.aligned[j] or names[j] != data.instruments[j]:
                continue
            difference = _difference(fitted, i, j)
            if not np.abs(difference).max() <= NEAR:
                continue
            rows_i, rows_j = (slice(K + 6 * k, K + 6 * k + 6) for k in (i, j))
            C = fitted.posterior.covariance
            cross = C[rows_i, rows_j]
            distance = difference @ np.linalg.solve(C[rows_i, rows_i] + C[rows_j, rows_j] - cross - cross.T, difference)
            if distance <= chi2.isf(CHANCE, 6):
                names[i] = names[j]
                message = (
                    f"{data.instruments[j]} and {data.instruments[i]}: their frames agree to "
                    f"{np.linalg.norm(difference[3:]) / UM:.0f} um: taken as measured from one setup"
                )
                findings.append(Finding(Level.NOTE, Code.SETUP, message))
                break
    if not findings:
        return data, findings
    return with_one_frame_a_name(replace(data, instruments=tuple(names))), findings


def as_one_setup(data: Measurements, fitted: Fit) -> Measurements:
    """Measurements in which all instruments that stood within CLOSE are one, whatever their frames say of warmth."""
    names = list(data.instruments)
    for i in range(1, len(names)):
        for j in range(i):
            own_frames = not (data.aligned[i] or data.aligned[j])
            if own_frames and names[j] == data.instruments[j] and np.abs(_difference(fitted, i, j)).max() <= CLOSE:
                names[i] = names[j]
                break
    return with_one_frame_a_name(replace(data, instruments=tuple(names)))


def _difference(fitted: Fit, i: int, j: int) -> Array:
    """Turn [rad] and shift [m] of one frame against another, (6,), in the axes of the instruments."""
    rotation, origin = fitted.frames.rotation, fitted.frames.origin
    return np.concatenate([rotation_vector((rotation[i] @ rotation[j].T)[None])[0], origin[i] - origin[j]])
