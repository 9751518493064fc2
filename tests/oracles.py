"""Second ways to numbers of the package, written out plainly and sharing nothing with it."""

import numpy as np


def forward_kinematics(robot, theta):
    """Nominal flange poses of DH joint angles (N, 6) [rad], row by row in numpy: (N, 3) [m] and (N, 3, 3)."""
    position, rotation = np.zeros((len(theta), 3)), np.tile(np.eye(3), (len(theta), 1, 1))
    for angle, d, a, alpha in zip(theta.T, robot.d, robot.a, robot.alpha, strict=True):
        c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
        zero = np.zeros_like(c)
        link = np.array([[c, -s * ca, s * sa], [s, c * ca, -c * sa], [zero, zero + sa, zero + ca]])
        position = position + np.einsum("nij,nj->ni", rotation, np.column_stack([a * c, a * s, zero + d]))
        rotation = rotation @ np.moveaxis(link, -1, 0)
    return position, rotation
