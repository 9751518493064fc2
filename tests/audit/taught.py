r"""What a taught frame has taken up of what an arm errs by.

Touches found the part where the arm believed it to be. An effect that moves the tool by c_r at touch r moves the part
by d and w about the touches' middle m, and the probe that was fitted along by t in the flange, so that

    e_r . (c_r - d - w x (p_r - m) + R_r t) / sigma_r    over all touches, and t / 0.5 mm,    are least in squares.

On the path what is left of c is c - d - w x (p - m) + R t, with t only where the tool is that probe. The touches' own
noise leaves the frame as open as the same least squares make of it.
"""

import numpy as np
from naive_errors import MDEG

from audit.arm import Spots
from audit.study import NODES

SAME_TOOL_MM, PROBE_MM = 0.01, 0.5  # one probe and one tool; how far off a probe may be before it is fitted
FIELD_MM = 500.0  # over which what no number explains turns
SCALE = 1e-3  # of turns against millimetres, in the least squares


class Untaught:
    """A frame that took up nothing, and is as well known as it says, about the middle of the part."""

    spots, is_tool = None, False  # touches, and whether the tool is the probe of them

    def __init__(self, table, middle):
        """Of the table ``frame.taught``, or of none."""
        self._sigma = np.concatenate([table.get("sigma_um", [0.0] * 3), table.get("sigma_mdeg", [0.0] * 3)])
        self._middle = middle

    def left(self, _spots, path, _touches):
        """All of it."""
        return path

    def field(self, place, _flange):
        """Share of a smooth field's variance that is left, (N,)."""
        return np.ones(len(place))

    def frame(self, place, _flange):
        """What is open of the frame at places (N, 3) [mm], columns (N, 3, 6) [mm]."""
        unit = self._sigma * np.array([1e-3] * 3 + [MDEG] * 3)
        return design(place - self._middle, None)[:, :, :6] * unit


class Taught:
    """A frame that this arm taught through its own model, T touches."""

    def __init__(self, table, arm, tool):
        """Of the table ``frame.taught``; ``tool`` is that of the path."""
        touches, T = table["touches"], len(table["touches"])
        probe = np.array(table["probe_mm"]), np.eye(3)
        self.is_tool = bool(np.abs(tool[0] - probe[0]).max() < SAME_TOOL_MM)
        rise = np.array([table.get("rise_K", {}).get(n, 0.0) for n in NODES])
        self.spots = Spots(
            arm,
            np.radians([t["joints_deg"] for t in touches]),
            np.array([t.get("direction", [0.0] * 6) for t in touches]),
            np.tile(rise, (T, 1)),
            probe,
        )
        place, rotation = self.spots.pose()
        self._middle = place.mean(axis=0)
        rows, along, of, sigma = list[np.ndarray](), list[np.ndarray](), list[int](), list[float]()
        full = design(place - self._middle, rotation)
        for k, touch in enumerate(touches):
            for e in [np.array(touch["probing"])] if "probing" in touch else np.eye(3):
                rows.append(e @ full[k] / (touch["noise_um"] / 1e3))
                along.append(e)
                of.append(k)
                sigma.append(touch["noise_um"] / 1e3)
        self._along, self._of, self._sigma, self._place = map(np.array, (along, of, sigma, place))
        unit = np.array([1.0] * 3 + [SCALE] * 3 + [1.0] * 3)
        held = np.hstack([np.zeros((3, 6)), np.eye(3) / PROBE_MM])
        solved = np.linalg.pinv(np.vstack([rows, held]) * unit)
        self._gain = unit[:, None] * solved[:, : len(rows)] / self._sigma

    def left(self, spots, path, touches):
        """Of effects on a path (N, 3, Q) that are (T, 3, Q) at the touches, (N, 3, Q)."""
        place, flange = spots.pose()[0], spots.flange()[1]
        taken = self._gain @ np.einsum("ri,riq->rq", self._along, touches[self._of])
        return path - design(place - self._middle, flange if self.is_tool else None) @ taken

    def field(self, place, flange):
        """Share of a smooth field's variance that is left, a coordinate's mean, (N,)."""
        H = design(place - self._middle, flange if self.is_tool else None) @ self._gain
        touched = self._place[self._of]
        among = (self._along @ self._along.T) * _alike(touched, touched)
        shared = np.einsum("nir,ri,nr->n", H, self._along, _alike(place, touched))
        return 1 + (np.einsum("nir,rs,nis->n", H, among, H) - 2 * shared) / 3

    def frame(self, place, flange):
        """What is open of the frame at places (N, 3) [mm], columns (N, 3, R) [mm]."""
        return design(place - self._middle, flange if self.is_tool else None) @ (self._gain * self._sigma)


def of_frame(table, arm, tool, hashed, middle):
    """What a frame's table ``taught`` makes of the arm's errors; ``hashed`` is the robot file's sha256."""
    own = table.get("through") == "model" and bool(table.get("touches"))
    own = own and table.get("robot_file", "").endswith(hashed[:16])
    return Taught(table, arm, tool) if own else Untaught(table, middle)


def design(lever, rotation):
    """What a shift, a turn and a longer probe take off an error, (N, 3, 9), at levers (N, 3) [mm] from the middle."""
    out = np.zeros((len(lever), 3, 9))
    out[:, :, :3] = np.eye(3)
    for k, axis in enumerate(np.eye(3)):
        out[:, :, 3 + k] = np.cross(axis, lever)
    if rotation is not None:
        out[:, :, 6:] = -rotation
    return out


def _alike(one, other):
    """How alike a smooth field is at places (N, 3) and (R, 3) [mm], (N, R)."""
    square = ((one[:, None] - other[None]) ** 2).sum(axis=2)
    return np.exp(-square / (2 * FIELD_MM**2))
