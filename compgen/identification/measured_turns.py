"""Whether orientations that an instrument measured are the arm's, once its zeros, lengths and frames are known.

An arm that was mastered two degrees off turns two degrees otherwise than its file says, and is an arm all the same;
W P R that were given for rotation vectors are no arm's. Places tell the two apart: zeros that orientations ask for move
them as well, and columns in another order turn as from where the instrument does not stand.
"""

import numpy as np

from compgen.core.arrays import Array, IntArray, norm
from compgen.core.exceptions import InputError
from compgen.core.rotations import rotation_vector
from compgen.core.units import DEG
from compgen.identification.fit import Fit
from compgen.identification.instrument_frames import InstrumentFrames, reflector_axes
from compgen.identification.measurements import Measurements
from compgen.identification.model import ArmModel

LEFT = 1 * DEG  # median by which an orientation may be off without a word: of no arm


def check_fitted_turns(data: Measurements, fitted: Fit) -> None:
    """Raises InputError where a fit, which places hold, leaves measured orientations turned otherwise than the arm."""
    refuse_turned(data, fitted.linear.oriented, fitted.linear.turn)


def check_known_turns(model: ArmModel, data: Measurements, frames: InstrumentFrames) -> None:
    """Raises InputError where measured orientations turn otherwise than the arm; a reflector's axes may be any.

    Args:
        model: The arm; its parameters are at zero.
        data: Measurements.
        frames: Of instruments.
    """
    rotation = model.pose(data, np.zeros(len(model.parameters)))[1]
    seen = np.flatnonzero(np.isfinite(data.rotation[:, 0, 0]))
    axes = reflector_axes(data, frames, rotation)[data.reflector]
    turned = frames.rotation_of(data.instrument) @ rotation[data.pose] @ axes
    refuse_turned(data, seen, rotation_vector(np.swapaxes(turned[seen], 1, 2) @ data.rotation[seen]))


def refuse_turned(data: Measurements, rows: IntArray, turn: Array) -> None:
    """Raises InputError where the rows of an instrument turn otherwise, (n, 3) [rad]; names the one that does most."""
    of = data.instrument[rows]
    off = {int(np.flatnonzero(of == i)[0]): float(np.median(norm(turn[of == i]))) for i in np.unique(of).tolist()}
    first = max(off, key=lambda n: off[n], default=0)
    if off and off[first] > LEFT:
        raise InputError(
            f"{data.file(int(rows[first]))}: columns rx_deg, ry_deg, rz_deg: they turn by {off[first] / DEG:.1f} deg "
            "(median) otherwise than the arm: are they W P R, other Euler angles, in another order, or radians? give "
            "rotation vectors in deg, or leave them out"
        )
