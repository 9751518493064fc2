r"""A constant offset between a log and a course: of a user frame, or of a tool.

A nearest point shows of an offset d only what is square to the path, off = (I - t t^T) d, or (I - t t^T) R d
where it is constant in the tool's axes R. Over rows with several directions of travel least squares give all of d.
"""

from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, IntArray, rms
from compgen.core.pose import Pose
from compgen.core.rotations import rotation_vector
from compgen.core.units import DEG, MM
from compgen.verification.executed.course import Course
from compgen.verification.executed.projection import project
from compgen.verification.executed.tracking import Track, fits, follow

SEVERAL = 2000  # rows or marks that shapes are compared at
WIDE = 20e-3  # [m] off the course, while a shape is brought to it
SHAPE = 2e-3  # [m] rms at which another place is the same shape
TURNED = 0.02 * DEG  # of a shape that is more than moved
STRAIGHT = 1e-6  # of a shape's length: what is thinner is a straight line
SHOWN_DIGITS = 6  # of an offset [m]: the micrometre
SHOWN = 1e-3  # of the rows: an offset of which the path shows less is not known


class Offset(NamedTuple):
    """An offset that is the same in all rows."""

    vector: Array  # (3,) [m]
    explained: float  # share of the squares of all deviation
    in_tool: bool  # constant in the tool's axes, else in World


def constant_offset(course: Course, way: IntArray, off: Array) -> Offset | None:
    """The constant vector that explains most of rows' deviations (m, 3) [m] on ways (m,); None where none is known."""
    t = course.tangents()[way]
    square = np.eye(3) - t[:, :, None] * t[:, None, :]
    total, best = float((off**2).sum()), None
    for in_tool, matrix in ((False, square), (True, square @ course.rotation[way])):
        normal = np.einsum("mij,mik->jk", matrix, matrix)
        if np.linalg.eigvalsh(normal)[0] < SHOWN * len(way):
            continue
        vector = np.linalg.solve(normal, np.einsum("mij,mi->j", matrix, off))
        left = float(((off - np.einsum("mij,j->mi", matrix, vector)) ** 2).sum())
        explained = 1 - left / max(total, 1e-30)
        if best is None or explained > best.explained + 1e-6:
            best = Offset(vector, explained, in_tool)
    return best


def shape_elsewhere(course: Course, position: Array, travelled: Array) -> Pose | None:
    """The motion that brings a log of the whole course from where it is to where it belongs, or None.

    Rows and places of the course at the same share of the way are brought together, then places at the same marks,
    then, where nothing is turned, nearest points.
    """
    goal = np.linspace(0.0, 1.0, SEVERAL)
    share = (travelled - travelled[0]) / max(float(travelled[-1] - travelled[0]), 1e-9)
    rows = np.minimum(np.searchsorted(share, goal), len(position) - 1)
    moved = best_motion(position[rows], course.place(goal * course.length))
    for _ in range(4):
        track = follow(course, moved.act(position), travelled, gate=WIDE)
        if not track.on.any():
            return None
        moved = best_motion(position[track.row[track.on]], course.place(track.arc[track.on]))
    if turn_of(moved) < 10 * TURNED:
        moved = _moved_only(course, position, travelled, moved)
    track = follow(course, moved.act(position), travelled)
    off = _rms(track)
    return moved if fits(course, track) and track.share > 0.9 and off < SHAPE else None


def _moved_only(course: Course, position: Array, travelled: Array, moved: Pose) -> Pose:
    """A motion without a turn, brought to the nearest points; the one given where that is worse."""
    centre = position.mean(axis=0)
    shift = moved.act(centre) - centre
    for _ in range(4):
        track = follow(course, position + shift, travelled, gate=WIDE)
        if not track.on.any():
            return moved
        rows = track.row[track.on]
        rows = rows[:: max(1, len(rows) // SEVERAL)]
        beside = project(course, position[rows] + shift, travelled[rows], track)
        offset = constant_offset(course, beside.way, beside.off)
        if offset is None or offset.in_tool:
            break
        shift = shift - offset.vector
    return Pose(shift, np.eye(3)) if _rms(track) <= 2 * _rms(follow(course, moved.act(position), travelled)) else moved


def _rms(track: Track) -> float:
    return rms(track.distance[track.on]) if track.on.any() else np.inf


def best_motion(start: Array, end: Array) -> Pose:
    """The rigid motion that brings points (m, 3) nearest to others, by least squares."""
    a, b = start.mean(axis=0), end.mean(axis=0)
    spread = (start - a).T @ (end - b)
    u, sizes, v = np.linalg.svd(spread)
    sign = np.sign(np.linalg.det(u @ v))
    rotation = (v.T * [1, 1, sign]) @ u.T
    if sizes[1] < STRAIGHT * sizes[0]:
        rotation = np.eye(3)  # a straight line does not tell a turn about itself
    return Pose(b - rotation @ a, rotation)


def turn_of(moved: Pose) -> float:
    """How far a motion turns [rad]."""
    return float(np.linalg.norm(rotation_vector(moved.rotation)))


def motion_words(moved: Pose, course: Course) -> str:
    """Where a log is against its course, and what that may come from; ``moved`` brings it there."""
    frame, tool = course.numbers
    away = moved.inverse()
    x, y, z = (v / MM + 0.0 for v in np.round(away.position, SHOWN_DIGITS).tolist())
    if turn_of(moved) > TURNED:
        return (
            f"it has this program's shape, moved by X {x:.3f} Y {y:.3f} Z {z:.3f} mm and turned by "
            f"{turn_of(moved) / DEG:.3f} deg in World: another user frame than UFRAME {frame}; log in the program's "
            "frame, or give --frames"
        )
    return (
        f"it has this program's shape at a constant offset of X {x:.3f} Y {y:.3f} Z {z:.3f} mm in World: another user "
        f"frame than UFRAME {frame}, or another tool than UTOOL {tool}; log with the program's own, or give --frames"
    )


def offset_words(offset: Offset, course: Course) -> str:
    """An offset, and what it may come from."""
    x, y, z = (v / MM + 0.0 for v in np.round(offset.vector, SHOWN_DIGITS).tolist())
    frame, tool = course.numbers
    origin = f"in the tool's axes: another tool than UTOOL {tool}" if offset.in_tool else (
        f"in World: another user frame than UFRAME {frame}, or another tool than UTOOL {tool}"
    )  # fmt: skip
    return f"a constant offset of X {x:.3f} Y {y:.3f} Z {z:.3f} mm {origin}"
