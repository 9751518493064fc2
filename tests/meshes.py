"""Triangle meshes of surfaces, and their files."""

import struct

import numpy as np


def grid_mesh(height, half=0.1, n=41):
    """The corners of a mesh of height(x, y) over a square."""
    g = np.linspace(-half, half, n)
    x, y = np.meshgrid(g, g)
    p = np.stack([x, y, height(x, y)], axis=-1)
    a, b, c, d = p[:-1, :-1], p[:-1, 1:], p[1:, 1:], p[1:, :-1]
    corners = np.concatenate([np.stack([a, b, c], axis=2).reshape(-1, 3, 3), np.stack([a, c, d], 2).reshape(-1, 3, 3)])
    return corners.astype(np.float32).astype(float)


def binary(corners):
    records = np.zeros(len(corners), np.dtype([("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")]))
    records["c"] = corners * 1e3
    return b"a part".ljust(80) + struct.pack("<I", len(corners)) + records.tobytes()
