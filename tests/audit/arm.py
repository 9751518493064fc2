r"""The arm: a DH chain whose lengths may have grown, and Newton's method as its inverse.

    T = prod_i rz(theta_i) tz(d_i) tx(a_i) rx(alpha_i),    R(W, P, R) = rz(R) ry(P) rx(W)

and for Newton, with z_i the axis of theta_i through o_i, the Jacobian's columns z_i x (p - o_i) over z_i; pendant J2
turns theta_2 and theta_3. The inverse is for the posture N U T: from a pose in its middle Newton is led to a few
positions in steps no longer than ``STRIDE``, and from these to all between.
"""

import numpy as np

from tests.audit import study

MIDDLE = np.radians([0.0, 0.0, 0.0, 0.0, -90.0, 0.0])  # pendant, N U T, tool down
STRIDE_MM, STRIDE = 100.0, 0.3  # at most, of a step to the first positions
STRIDES, ROUNDS = 80, 12
CLOSED_MM, CLOSED = 1e-6, 1e-9  # how near the inverse must come, and in an entry of the rotation
LED = 200  # positions that are led to from the middle


class UnreachableError(Exception):
    """Newton's method does not arrive."""


def rotation(w, p, r):
    """Of W, P, R (M,) each [rad], (M, 3, 3)."""
    return turn(2, r) @ turn(1, p) @ turn(0, w)


def turn(axis, angle):
    """About x, y or z by angles (M,), (M, 3, 3)."""
    c, s, j, k = np.cos(angle), np.sin(angle), (axis + 1) % 3, (axis + 2) % 3
    out = np.zeros((len(c), 3, 3))
    out[:, axis, axis], out[:, j, j], out[:, k, k], out[:, j, k], out[:, k, j] = 1, c, c, -s, s
    return out


def growth_of_rises(rise):
    """How much longer a2, d4 and d6 are at rises (M, K) [K], (M, 3) [mm]: millimetre by millimetre along each link."""
    per_kelvin = np.zeros((len(study.NODES), 3))
    for k, (_, sections) in enumerate(study.LINKS):
        begin = 0
        for end, a, b, shape in sections:
            ra, rb, u = (
                study.REFERENCE_RISE_K[a],
                study.REFERENCE_RISE_K[b],
                (np.arange(end - begin) + 0.5) / (end - begin),
            )
            # the shape of the reference state, in shares of its two ends
            share = 1 - u if shape == "linear" else (ra * (rb / ra) ** u - rb) / (ra - rb)
            per_kelvin[study.NODES.index(a), k] += study.CTE_1_K * share.sum()
            per_kelvin[study.NODES.index(b), k] += study.CTE_1_K * (1 - share).sum()
            begin = end
    return rise @ per_kelvin


def dh_angles(pendant):
    """theta of pendant angles, (M, 6) [rad]."""
    theta = pendant.copy()
    theta[:, 1] += study.THETA2_AT_ZERO
    theta[:, 2] += pendant[:, 1]
    return theta


def flange(pendant, growth=None):
    """Position (M, 3) [mm] and rotation (M, 3, 3) at pendant angles (M, 6) and growths (M, 3) [mm]."""
    return _chain(pendant, growth)[:2]


def _chain(pendant, growth=None):
    """Position and rotation of the flange, and origin and axis of each theta before it turns, (6, M, 3) each."""
    theta, M = dh_angles(pendant), len(pendant)
    longer = np.zeros((M, 3)) if growth is None else growth
    # a link that is negative in the table gets more negative (errata)
    a = [study.A_MM[i] + (longer[:, 0] if i == 1 else 0.0) for i in range(6)]
    d = [study.D_MM[i] - (longer[:, 1] if i == 3 else longer[:, 2] if i == 5 else 0.0) for i in range(6)]
    p, R = np.zeros((M, 3)), np.tile(np.eye(3), (M, 1, 1))
    origins, axes = [], []
    for i in range(6):
        origins.append(p)
        axes.append(R[:, :, 2])
        R = R @ turn(2, theta[:, i])
        p = p + R[:, :, 0] * np.broadcast_to(a[i], M)[:, None] + R[:, :, 2] * np.broadcast_to(d[i], M)[:, None]
        R = R @ turn(0, np.array([study.ALPHA[i]]))
    return p, R, np.array(origins), np.array(axes)


def _newton_step(pendant, position, rotation, limited):
    """One step of pendant angles towards flange poses, and how far these were [mm] and in rotation."""
    p, R, origins, axes = _chain(pendant)
    dp, relative = position - p, rotation @ np.swapaxes(R, 1, 2)
    sine = np.column_stack(
        [relative[:, (k + 2) % 3, (k + 1) % 3] - relative[:, (k + 1) % 3, (k + 2) % 3] for k in range(3)]
    )
    dr = sine / 2
    far = np.abs(dp).max(axis=1), np.abs(relative - np.eye(3)).max(axis=(1, 2))
    if limited:
        excess = np.maximum(np.linalg.norm(dp, axis=1) / STRIDE_MM, np.linalg.norm(dr, axis=1) / STRIDE)
        dp, dr = (x / np.maximum(1.0, excess)[:, None] for x in (dp, dr))
    columns = np.concatenate([np.cross(axes, p - origins), axes], axis=2)  # (6, M, 6)
    columns[1] += columns[2]
    return np.linalg.solve(np.moveaxis(columns, 0, 2), np.concatenate([dp, dr], axis=1)[:, :, None])[:, :, 0], far


def pendant_angles(position, rotation, start=None):
    """Pendant angles of flange poses one after the other along a path, (M, 6) [rad].

    Args:
        position: (M, 3) [mm].
        rotation: (M, 3, 3).
        start: Angles near them, (M, 6); None: they are led to from the middle of the posture.

    Raises:
        UnreachableError: Newton does not come to a pose.
    """
    if start is None:
        rows = np.unique(np.linspace(0, len(position) - 1, LED).astype(int))
        led = np.tile(MIDDLE, (len(rows), 1))
        for _ in range(STRIDES):
            led = led + _newton_step(led, position[rows], rotation[rows], True)[0]
        start = np.column_stack([np.interp(np.arange(len(position)), rows, column) for column in led.T])
    pendant = start
    for _ in range(ROUNDS):
        step, (away, turned) = _newton_step(pendant, position, rotation, False)
        if away.max() <= CLOSED_MM and turned.max() <= CLOSED:
            return pendant
        pendant = pendant + step
    n = int(np.argmax(away))
    raise UnreachableError(f"the inverse stays {away[n]:.3g} mm from P[{n + 1}] in the posture N U T")


def config(pendant):
    """CONFIG of pendant angles (M, 6): three letters, and the turns of J1, J4 and J6, (M, 3).

    U where cos(J2 + J3 + atan2(a3, |d4|)) > 0, T where the wrist is before axis 1, a turn for each 360 deg beyond 180
    (the format's description, section 7).
    """
    a1, a2, a3, d4 = study.A_MM[0], study.A_MM[1], study.A_MM[2], -study.D_MM[3]
    j2, j3 = pendant[:, 1], pendant[:, 2]
    up = np.cos(j2 + j3 + np.arctan2(a3, d4)) > 0
    before = a1 + a2 * np.sin(j2) + d4 * np.cos(j3) - a3 * np.sin(j3) > 0
    letters = np.column_stack(
        [np.where(pendant[:, 4] > 0, "F", "N"), np.where(up, "U", "D"), np.where(before, "T", "B")]
    )
    angles = np.degrees(pendant[:, [0, 3, 5]])
    return letters, (np.sign(angles) * ((np.abs(angles) + 180) // 360)).astype(int)
