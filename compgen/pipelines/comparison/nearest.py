"""How far points are from a path that was drawn through others: to its nearest place, wherever that is."""

import numpy as np
from scipy.spatial import cKDTree

from compgen.core.arrays import Array, dot, step_lengths

SPACING = 1e-3  # [m] of the marks by which segments are looked up
MOST_MARKS = 2_000_000
CANDIDATES = 8  # marks near a point whose segments are measured
BLOCK = 100_000  # points at a time


def distance_to_path(points: Array, path: Array) -> Array:
    """Distances of points (N, 3) to a polyline through others (M, 3) [m], (N,).

    Exact on the segments about the nearest marks; another that is nearer by less than ``SPACING`` squared over eight
    times the distance may be missed.
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
    count = min(CANDIDATES, len(segment))
    for begin in range(0, len(points), BLOCK):
        block = points[begin : begin + BLOCK, None]
        _, marks = tree.query(block[:, 0], k=np.arange(1, count + 1))
        k = segment[marks]
        along = np.clip(dot(block - path[k], step[k]) / squared[k], 0.0, 1.0)
        off = block - (path[k] + along[..., None] * step[k])
        distance[begin : begin + BLOCK] = np.sqrt(dot(off, off).min(axis=1))
    return distance
