"""Whether orientations that an instrument measured are the arm's, once its zeros, lengths and frames are known.

An arm that was mastered two degrees off turns two degrees otherwise than its file says, and is an arm all the same;
W P R that were given for rotation vectors are no arm's. Places tell the two apart: zeros that orientations ask for move
them as well, and columns in another order turn as from where the instrument does not stand.
"""

from collections.abc import Iterator

import numpy as np
from scipy.special import chdtri

from compgen.core.arrays import Array, IntArray, norm
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.rotations import rotation_vector
from compgen.core.units import DEG
from compgen.identification.fit import Fit
from compgen.identification.instrument_frames import InstrumentFrames, reflector_axes
from compgen.identification.measurements import Measurements
from compgen.identification.model import ArmModel
from compgen.identification.outliers import outlier_threshold

LEFT = 1 * DEG  # median by which an orientation may be off without a word: of no arm
MASTERED = 5 * DEG  # the same where no zeros are fitted: mastering by eye is off by a degree or two a joint


def check_fitted_turns(data: Measurements, fitted: Fit) -> None:
    """Raises InputError where a fit, which places hold, leaves measured orientations turned otherwise than the arm."""
    refuse_turned(data, fitted.linear.oriented, fitted.linear.turn)


def check_known_turns(model: ArmModel, data: Measurements, frames: InstrumentFrames) -> None:
    """Raises InputError where measured orientations turn otherwise than any mastering; a reflector's axes may be any.

    Args:
        model: The arm; its parameters are at zero.
        data: Measurements.
        frames: Of instruments.
    """
    refuse_turned(data, *_known_turns(model, data, frames), MASTERED)


def turned_findings(model: ArmModel, data: Measurements, frames: InstrumentFrames) -> list[Finding]:
    """A warning where orientations turn otherwise by what mastering may explain; raises InputError beyond."""
    rows, turn = _known_turns(model, data, frames)
    refuse_turned(data, rows, turn, MASTERED)
    row, off = _most_turned(data, rows, turn)
    if off <= LEFT:
        return []
    message = (
        f"{data.file(row)}: orientations turn by {off / DEG:.1f} deg (median) otherwise than the arm: a joint was "
        "mastered anew, or rx_deg, ry_deg, rz_deg are in another convention"
    )
    return [Finding.of(Code.TURNED, message)]


def _known_turns(model: ArmModel, data: Measurements, frames: InstrumentFrames) -> tuple[IntArray, Array]:
    """Rows with an orientation, and by how much each turns otherwise than the arm, (n,) and (n, 3) [rad]."""
    rotation = model.pose(data, np.zeros(len(model.parameters)))[1]
    seen = np.flatnonzero(np.isfinite(data.rotation[:, 0, 0]))
    axes = reflector_axes(data, frames, rotation)[data.reflector]
    turned = frames.rotation_of(data.instrument) @ rotation[data.pose] @ axes
    return seen, rotation_vector(np.swapaxes(turned[seen], 1, 2) @ data.rotation[seen])


def refuse_turned(data: Measurements, rows: IntArray, turn: Array, most: float = LEFT) -> None:
    """Raises InputError where the rows of an instrument turn otherwise, (n, 3) [rad]; names the one that does most."""
    row, off = _most_turned(data, rows, turn)
    if off > most:
        raise InputError(
            f"{data.file(row)}: columns rx_deg, ry_deg, rz_deg: they turn by {off / DEG:.1f} deg "
            "(median) otherwise than the arm: are they W P R, other Euler angles, in another order, or radians? give "
            "rotation vectors in deg, or leave them out"
        )


def wild_turns(data: Measurements, fitted: Fit) -> Iterator[Finding]:
    """Orientations of rows that count, too far from the arm's to be noise of their instrument: none is set aside."""
    rows, off = fitted.linear.oriented, norm(fitted.linear.turn)
    of = data.instrument[rows]
    for i in np.unique(of).tolist():
        usual = float(np.median(off[of == i]))
        far = (of == i) & ~fitted.outlier[rows] & (off**2 * chdtri(3, 0.5) > usual**2 * outlier_threshold(len(rows)))
        lines = [f"{data.label[rows[n]].rsplit(': ', 1)[1]}: {off[n] / DEG:.2g} deg" for n in np.flatnonzero(far)]
        if lines:
            more = f" and {len(lines) - 5} more" if len(lines) > 5 else ""
            yield Finding.of(
                Code.OUTLIER,
                f"{data.file(int(rows[of == i][0]))}: orientations far from the arm's: {', '.join(lines[:5])}{more}, "
                f"where {usual / DEG:.1g} deg is usual: all orientations count less by them; mend or empty rx_deg, "
                "ry_deg, rz_deg there",
            )


def _most_turned(data: Measurements, rows: IntArray, turn: Array) -> tuple[int, float]:
    """The first row of the instrument whose rows turn most, and their median [rad]; none: (0, 0)."""
    of = data.instrument[rows]
    off = {int(rows[of == i][0]): float(np.median(norm(turn[of == i]))) for i in np.unique(of).tolist()}
    return max(off.items(), key=lambda item: item[1], default=(0, 0.0))
