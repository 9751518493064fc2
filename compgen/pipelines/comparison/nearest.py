"""How far points are from a path that was drawn through others: to its nearest place, wherever that is."""

import numpy as np
from scipy.spatial import cKDTree

from compgen.core.arrays import Array, dot, step_lengths

SPACING = 1e-3  # [m] of the marks by which segments are looked up
MOST_MARKS = 2_000_000
SLACK = 1e-9  # [m] of rounding
BLOCK = 10_000  # points at a time


def distance_to_path(points: Array, path: Array) -> Array:
    """Distances of points (N, 3) to a polyline through others (M, 3) [m], (N,).

    A mark lies on the path, and the nearest place no farther than half the spacing from a mark of its segment: so the
    segments of all marks that are up to half a spacing farther than the nearest mark have it among them.
    """
    if len(path) == 1:
        return np.asarray(np.linalg.norm(points - path[0], axis=1))
    lengths = step_lengths(path)
    spacing = max(SPACING, float(lengths.sum()) / MOST_MARKS)
    parts = np.maximum(1, np.ceil(lengths / spacing)).astype(np.int64)
    segment = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(len(segment)) - np.repeat(np.cumsum(parts) - parts, parts) + 0.5) / parts[segment]
    step = np.diff(path, axis=0)
    tree = cKDTree(path[segment] + share[:, None] * step[segment])
    squared = np.maximum(dot(step, step), np.finfo(float).tiny)
    distance = np.empty(len(points))
    for begin in range(0, len(points), BLOCK):
        block = points[begin : begin + BLOCK]
        reach = tree.query(block)[0] + spacing / 2 + SLACK
        marks = tree.query_ball_point(block, reach)
        counts = np.array([len(near) for near in marks])
        k = segment[np.concatenate(marks).astype(np.int64)]
        point = np.repeat(block, counts, axis=0)
        along = np.clip(dot(point - path[k], step[k]) / squared[k], 0.0, 1.0)
        off = point - (path[k] + along[:, None] * step[k])
        distance[begin : begin + BLOCK] = np.sqrt(np.minimum.reduceat(dot(off, off), np.cumsum(counts) - counts))
    return distance
