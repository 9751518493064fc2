r"""The one offset for a whole program that leaves least, as an operator can type it: digits and all.

With p the programmed positions of the TCP in the program's user frame, e = actual - target and w, the error of the
orientation as a rotation vector, both in that frame's axes, and weights g (lengths on the part), the three kinds are

    position register   X Y Z are added to X Y Z of each position:        e' = e + d
                        W P R as well, to W P R of each position:         w' = w + M(P, R) (dW, dP, dR)
    user frame          UF becomes another frame V:                       e' = e + (UF^-1 V) p - p

and sum g |e'|^2 (for W P R sum g |w'|^2) is least. An angle's last digit moves a point 1 m away by 17 um: angles are
rounded first, to those neighbours that leave least, and X Y Z are fitted to them.
"""

from itertools import product

import numpy as np

from compgen.core.arrays import Array
from compgen.core.pose import Pose
from compgen.core.rotations import from_wpr, rotation_matrix, to_wpr
from compgen.core.units import DEG, MM

DIGITS = 3  # decimals of mm and deg on the pendant
SAME = 1e-9  # of a sum of squares: digits that leave so little less are not turned for it


def register_shift(error: Array, weight: Array) -> Array:
    """X Y Z of the best position register [mm], (3,).

    Args:
        error: e (M, 3) [m].
        weight: g (M,).
    """
    return np.asarray(np.round(-np.average(error, axis=0, weights=weight) / MM, DIGITS) + 0.0)


def register_turn(turn: Array, rotation: Array, weight: Array) -> Array:
    """W P R of the best position register [deg], (3,).

    Args:
        turn: Errors of the orientation as rotation vectors in the frame's axes, (M, 3) [rad].
        rotation: Programmed, in the frame, (M, 3, 3).
        weight: g (M,).
    """
    _, P, R = to_wpr(rotation)
    M = wpr_rates(P, R)
    normal = np.einsum("m,mki,mkj->ij", weight, M, M)
    angles = np.linalg.lstsq(normal, -np.einsum("m,mki,mk->i", weight, M, turn), rcond=1e-9)[0]
    return np.asarray(np.round(angles / DEG, DIGITS) + 0.0)


def wpr_rates(P: Array, R: Array) -> Array:
    """Rotation vector in the frame's axes for each radian of W, P and R, (M, 3, 3), from R = Rz(R) Ry(P) Rx(W)."""
    zero, one = np.zeros_like(P), np.ones_like(P)
    by_w = np.stack([np.cos(R) * np.cos(P), np.sin(R) * np.cos(P), -np.sin(P)], axis=1)
    by_p = np.stack([-np.sin(R), np.cos(R), zero], axis=1)
    return np.stack([by_w, by_p, np.stack([zero, zero, one], axis=1)], axis=2)


def best_frame(frame: Pose, position: Array, error: Array, weight: Array) -> Array:
    """X Y Z [mm] and W P R [deg] of the user frame V that leaves least, (6,).

    Args:
        frame: UF in World.
        position: p (M, 3) [m] in the frame.
        error: e (M, 3) [m] in the frame's axes.
        weight: g (M,).
    """
    wanted = frame.act(position - error)  # where V shall have p
    share = weight / weight.sum()
    center, goal = share @ position, share @ wanted
    H = np.einsum("m,mi,mj->ij", share, position - center, wanted - goal)
    rotation = _nearest_rotation(H, frame.rotation)
    angles = np.round(np.concatenate(to_wpr(rotation[None])) / DEG, DIGITS)
    best, least = np.zeros(6), np.inf
    for step in sorted(product((-1, 0, 1), repeat=3), key=np.count_nonzero):
        wpr = np.round(angles + np.array(step) / 10**DIGITS, DIGITS)
        V = from_wpr(*(wpr * DEG)[:, None])[0]
        xyz = np.round((goal - V @ center) / MM, DIGITS)
        left = share @ ((position @ V.T + xyz * MM - wanted) ** 2).sum(axis=1)
        if left < least * (1 - SAME):
            best, least = np.concatenate([xyz, wpr]), left
    return best + 0.0


def _nearest_rotation(H: Array, start: Array) -> Array:
    r"""The rotation that turns positions onto what is wanted: Gauss-Newton from the frame's own, of least turn.

    Points on one line leave the turn about it open; then it stays as it is.
    """
    rotation = start
    for _ in range(5):
        S = rotation @ H  # sum g (V p)(wanted)^T
        normal = np.trace(S) * np.eye(3) - (S + S.T) / 2
        torque = np.array([S[1, 2] - S[2, 1], S[2, 0] - S[0, 2], S[0, 1] - S[1, 0]])
        rotation = rotation_matrix(np.linalg.lstsq(normal, torque, rcond=1e-9)[0]) @ rotation
    return np.asarray(rotation)
