"""Whether orientations that an instrument measured are those of the arm, but for the zeros of its joints.

An arm that was mastered two degrees off turns two degrees otherwise than its file says, and is an arm all the same;
W P R that were given for rotation vectors are no arm's, whatever its zeros.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from compgen.core.arrays import Array, norm
from compgen.core.rotations import rotation_vector
from compgen.core.units import DEG
from compgen.identification.instrument_frames import ROUNDS, InstrumentFrames, initial_frames, kabsch
from compgen.identification.measurements import Measurements
from compgen.identification.model import ArmModel

TURNED = 1 * DEG  # median by which an orientation may be off without a word: of no arm
BETTER = 5.0  # times less that they turn by the right zeros where these are what is wrong
STEPS, SMALL = 3, 1e-4  # of Newton's, and [rad] that a joint is turned by for its slope
FAINT = 1e-3  # share of the steepest slope below which a joint's is none: the frames take it up


def turned_otherwise(model: ArmModel, rows: Measurements, frames: InstrumentFrames | None) -> float:
    """Median angle by which measured orientations turn otherwise than the arm [rad]; 0: little, or its zeros.

    Args:
        model: The arm; its parameters are at zero.
        rows: Measurements.
        frames: Of instruments and reflectors; None: those that fit best.
    """
    if not np.isfinite(rows.rotation).any():
        return 0.0

    def turned(zeros: Array) -> Array:
        position, rotation = model.pose(replace(rows, theta=rows.theta + zeros), np.zeros(len(model.parameters)))
        return _turn_errors(frames or initial_frames(rows, position, rotation), rows, rotation)

    off = float(np.median(norm(turned(np.zeros(6)))))
    if off <= TURNED or float(np.median(norm(turned(_zeros_of(turned))))) * BETTER <= off:
        return 0.0
    return off


def _zeros_of(turned: Callable[[Array], Array]) -> Array:
    """Zeros of the joints (6,) [rad] by which orientations turn least, as ``turned`` has them of any zeros."""
    zeros = np.zeros(6)
    for _ in range(STEPS):
        now = turned(zeros)
        slopes = [(turned(zeros + SMALL * axis) - now).ravel() / SMALL for axis in np.eye(6)]
        zeros = zeros - np.linalg.lstsq(np.column_stack(slopes), now.ravel(), rcond=FAINT)[0]
    return zeros


def _turn_errors(frames: InstrumentFrames, data: Measurements, rotation: Array) -> Array:
    """Rotation vectors by which orientations that an instrument measured turn otherwise than the arm, (N', 3) [rad].

    From what fits them best, F R_n A: places on a line do not tell how the instrument stands about it. F and A, a
    reflector's, are means of each other's rows by turns, from F as the frames have it.
    """
    seen = np.isfinite(data.rotation[:, 0, 0])
    arm, turned, reflector = rotation[data.pose[seen]], data.rotation[seen], data.reflector[seen]
    F, axes = frames.rotation_of(data.instrument[seen]), np.empty_like(turned)
    for _ in range(ROUNDS if len(turned) else 0):
        for r in np.unique(reflector).tolist():
            rows = reflector == r
            axes[rows] = _mean_turn(np.swapaxes(F[rows] @ arm[rows], 1, 2) @ turned[rows])
        F = np.broadcast_to(_mean_turn(turned @ np.swapaxes(arm @ axes, 1, 2)), F.shape)
    return np.asarray(rotation_vector(np.swapaxes(F @ arm @ axes, 1, 2) @ turned))


def _mean_turn(turns: Array) -> Array:
    """The rotation nearest to some, (3, 3)."""
    return kabsch(turns.mean(axis=0).T)
