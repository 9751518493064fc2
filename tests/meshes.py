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


def strip_mesh(x, z, half=0.1):
    """The corners of a mesh of one profile, two facets from end to end a strip, as CAD exports it."""
    p = np.stack([np.column_stack([x, np.full(len(x), y), z]) for y in (-half, half)])
    a, b, c, d = p[0, :-1], p[0, 1:], p[1, 1:], p[1, :-1]
    corners = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return corners.astype(np.float32).astype(float)


def rounded_plate(half=0.06, radius=0.005, strips=8):
    """Of a plate whose edges in x are rounded until they are upright."""
    turn = np.linspace(0, np.pi / 2, strips + 1)
    x, z = half - radius + radius * np.sin(turn), radius * (np.cos(turn) - 1)
    return strip_mesh(np.concatenate([-x[::-1], x]), np.concatenate([z[::-1], z]))


def binary(corners):
    records = np.zeros(len(corners), np.dtype([("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")]))
    records["c"] = corners * 1e3
    return b"a part".ljust(80) + struct.pack("<I", len(corners)) + records.tobytes()
