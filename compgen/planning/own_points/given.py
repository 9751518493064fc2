"""Points that a user gives for a path: where the tool goes, how it stands, how fast, and what happens there."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, own, row_norms
from compgen.core.exceptions import InputError
from compgen.core.units import DEG, MM, UM

SAME = 1 * UM  # points nearer than this are one
UNUSUAL = 20.0  # times the usual step, from where a long one is a slip
SMALL = 5 * MM  # a whole path below this was written in metres
MAX_TILT = 150 * DEG  # of the tool from upright: at 180 deg its tilt has no one axis


@dataclass(frozen=True, eq=False, slots=True)
class GivenPoints:
    """M points of a path in the frame of the part, in the order they are driven."""

    source: str  # the file, for messages
    line: IntArray  # (M,) of the file
    position: Array  # (M, 3) [m]
    normal: Array | None  # (M, 3) unit, out of the surface; the tool's z axis points against it
    rotation: Array | None  # (M, 3, 3) of the tool; None with ``normal``, or where the surface says it
    feed: Array  # (M,) [m/s] on the way to each point; NaN where the file does not say
    contact: BoolArray  # (M,) on the way to each point the tool may touch the part
    stop: BoolArray  # (M,) the robot stops there

    def __post_init__(self) -> None:
        own(self, line=("M",), position=("M", 3), feed=("M",), contact=("M",), stop=("M",))

    def where(self, row: int) -> str:
        """File and line of a point, for messages."""
        return f"{self.source}: line {self.line[row]}"


def check_points(points: GivenPoints, jump: float) -> None:
    """Refuse what no path can be laid through.

    Args:
        points: The points.
        jump: Length from which a step on the part that is also many times the usual one is a slip [m].

    Raises:
        InputError: Fewer than two points, two that are one, a path as small as metres taken for millimetres, or a step
            far beyond the others.
    """
    position = points.position
    if len(position) < 2:
        raise InputError(f"{points.source}: {len(position)} points are no path; give two at least")
    size = float(np.linalg.norm(np.ptp(position, axis=0)))
    if size < SMALL and len(position) >= 10:
        raise InputError(
            f"{points.source}: the whole path is {size / MM:.3g} mm long and wide; if it is in metres, give millimetres"
        )
    step = row_norms(np.diff(position, axis=0))
    near = np.flatnonzero(step < SAME)
    if len(near):
        row = int(near[0]) + 1
        before = points.line[row - 1]
        raise InputError(f"{points.where(row)}: the same place as line {before}; leave one of the two out")
    usual = float(np.median(step))
    far = np.flatnonzero((step > jump) & (step > UNUSUAL * usual) & points.contact[1:] & points.contact[:-1])
    if len(far):
        row = int(far[0]) + 1
        raise InputError(
            f"{points.where(row)}: {step[row - 1] / MM:.1f} mm from the point before, where steps are {usual / MM:.3g} "
            "mm; mend it, say contact = 0 off the part, or raise path.jump_mm"
        )
