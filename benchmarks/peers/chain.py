"""Forward kinematics of rows of d, a, alpha in numpy, for peers that have none of their own and to judge answers."""

from collections.abc import Iterable

import numpy as np


def flange(rows: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """The flange's pose, (4, 4)."""
    T = np.eye(4)
    for (d, a, alpha), q in zip(rows, theta, strict=False):
        c, s, ca, sa = np.cos(q), np.sin(q), np.cos(alpha), np.sin(alpha)
        T = T @ np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])
    return T


def off(rows: np.ndarray, joints: Iterable[np.ndarray], poses: Iterable[np.ndarray]) -> float:
    """How far the worst answer puts the flange from where it shall be [m]."""
    return float(max(np.linalg.norm(flange(rows, q)[:3, 3] - T[:3, 3]) for q, T in zip(joints, poses, strict=False)))
