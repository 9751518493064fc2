r"""The one second arm: the study's, in numpy alone, with constants typed from the sources; nothing of the package.

    T = prod_i rz(theta_i) tx(a_i) tz(d_i) rx(alpha_i) ry(beta_i),    R(W, P, R) = rz(R) ry(P) rx(W)

theta2 = J2 - 90 deg, theta3 = J2 + J3. Lengths are mm. Two inverses: a closed form by the letters and turn digits of
CONFIG, and Newton's method, with z_i the axis of theta_i through o_i and the Jacobian's columns z_i x (p - o_i) over
z_i. Newton's is for the posture N U T: from a pose in its middle it is led to a few positions in steps no longer than
``STRIDE``, and from these to all between.
"""

import math

import numpy as np
from audit import study

A, D, ALPHA = np.array(study.A_MM), np.array(study.D_MM), np.array(study.ALPHA)
A1, A2, A3, D4, D6 = A[0], A[1], A[2], -D[3], -D[5]
OFFSET = np.array([0, study.THETA2_AT_ZERO, 0, 0, 0, 0])  # theta where all pendant angles are zero
NOMINAL = {"a2": A2, "d4": D4, "d6": D6}  # lengths that grow [mm]

MIDDLE = np.radians([0.0, 0.0, 0.0, 0.0, -90.0, 0.0])  # pendant, N U T, tool down
STRIDE_MM, STRIDE = 100.0, 0.3  # at most, of a step to the first positions
STRIDES, ROUNDS = 80, 20
CLOSED_MM, CLOSED = 1e-6, 1e-9  # how near the inverse must come, and in an entry of the rotation
LED = 200  # positions that are led to from the middle


class UnreachableError(Exception):
    """Newton's method does not arrive."""


# Matrices --------------------------------------------------------------------------------------------------------


def turned(axis, angle):
    """Rotations (N, 4, 4) about x, y or z by angles (N,) or one [rad]."""
    angle, k = np.atleast_1d(angle), "xyz".index(axis)
    i, j = (k + 1) % 3, (k + 2) % 3
    out = np.zeros((len(angle), 4, 4))
    out[:, k, k] = out[:, 3, 3] = 1.0
    out[:, i, i] = out[:, j, j] = np.cos(angle)
    out[:, j, i] = np.sin(angle)
    out[:, i, j] = -out[:, j, i]
    return out


def shifted(x=0.0, y=0.0, z=0.0):
    """Translations (N, 4, 4)."""
    out = np.tile(np.eye(4), (np.broadcast(x, y, z).size, 1, 1))
    for k, place in enumerate((x, y, z)):
        out[:, k, 3] = place
    return out


def by_vector(vector):
    """Rotation of a vector (3,) [rad], Rodrigues, as 4 x 4."""
    angle = float(np.linalg.norm(vector))
    out = np.eye(4)
    if angle:
        x, y, z = np.asarray(vector) / angle
        K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        out[:3, :3] += math.sin(angle) * K + (1 - math.cos(angle)) * K @ K
    return out


def rotation(w, p, r):
    """Of W, P, R (N,) each [rad], (N, 3, 3)."""
    return (turned("z", r) @ turned("y", p) @ turned("x", w))[:, :3, :3]


def frame(x, y, z, w, p, r):
    """X Y Z [mm] W P R [deg] as a matrix (4, 4)."""
    out = shifted(x, y, z)[0]
    out[:3, :3] = rotation(*np.radians([[w], [p], [r]]))[0]
    return out


def frame_of(table):
    """A frame or tool of a path file's table as a matrix (4, 4)."""
    return frame(*(table.get(k, 0.0) for k in ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg")))


def numbers(matrix):
    """X Y Z W P R of a matrix."""
    r = matrix[:3, :3]
    p = math.degrees(math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0])))
    w, z = math.degrees(math.atan2(r[2, 1], r[2, 2])), math.degrees(math.atan2(r[1, 0], r[0, 0]))
    return (*matrix[:3, 3], w, p, z)


# Forwards --------------------------------------------------------------------------------------------------------


def chain(theta, a=A, d=D, alpha=ALPHA, beta=(0.0,) * 6, behind=None):
    """Frames (N, 4, 4) before each joint, and the flange, at DH angles (N, 6) [rad].

    Lengths are (6,) or (N, 6). What stands ``behind`` a frame, matrices by its number, is put there.
    """
    a, d = (np.broadcast_to(rows, theta.shape) for rows in (a, d))
    poses = [np.tile(np.eye(4), (len(theta), 1, 1))]
    for i in range(6):
        for displacement in (behind or {}).get(i, []):
            poses[-1] = poses[-1] @ displacement
        link = turned("z", theta[:, i]) @ shifted(a[:, i], 0, d[:, i]) @ turned("x", alpha[i])
        poses.append(poses[-1] @ (link @ turned("y", beta[i]) if beta[i] else link))
    return poses


def poses_of_rows(robot, theta):
    """Flange poses of a robot with other DH rows at theta (N, 6) [rad]: (N, 3) in its lengths' unit, and (N, 3, 3)."""
    end = chain(theta, robot.a, robot.d, robot.alpha)[-1]
    return end[:, :3, 3], end[:, :3, :3]


def dh_angles(pendant):
    """theta of pendant angles, (N, 6) [rad]."""
    theta = pendant + OFFSET
    theta[:, 2] += pendant[:, 1]
    return theta


def growth_of_rises(rise, reference=None):
    """How much longer a2, d4 and d6 are at rises (..., K) [K], (..., 3) [mm]: millimetre by millimetre along each.

    The shape along a link is that of the reference state, the study's or rises (K,) [K].
    """
    known = study.REFERENCE_RISE_K if reference is None else dict(zip(study.NODES, reference, strict=True))
    per_kelvin = np.zeros((len(study.NODES), 3))
    for k, (_, sections) in enumerate(study.LINKS):
        begin = 0
        for end, one, other, shape in sections:
            u = (np.arange(end - begin) + 0.5) / (end - begin)
            ra, rb = known[one], known[other]
            # the shape of the reference state, in shares of its two ends
            share = 1 - u if shape == "linear" else (ra * (rb / ra) ** u - rb) / (ra - rb)
            per_kelvin[study.NODES.index(one), k] += study.CTE_1_K * share.sum()
            per_kelvin[study.NODES.index(other), k] += study.CTE_1_K * (1 - share).sum()
            begin = end
    return rise @ per_kelvin


def frames_at(pendant, growth=None):
    """The chain at pendant angles (N, 6) [rad] and growths of a2, d4 and d6, (N, 3) [mm]."""
    a, d = np.tile(A, (len(pendant), 1)), np.tile(D, (len(pendant), 1))
    if growth is not None:  # a link that is negative in the table gets more negative (errata)
        a[:, 1] += growth[:, 0]
        d[:, [3, 5]] -= growth[:, 1:]
    return chain(dh_angles(pendant), a, d)


def flange(joints, lengths=NOMINAL):
    """Where the flange is at pendant angles (6,) [deg], (4, 4)."""
    growth = [[lengths[name] - NOMINAL[name] for name in NOMINAL]]
    return frames_at(np.radians([joints]), np.array(growth))[-1][0]


# Backwards by Newton's method ------------------------------------------------------------------------------------


def _newton_step(pendant, position, rotation, limited):
    """One step of pendant angles towards flange poses, and how far these were [mm] and in rotation."""
    *frames, end = frames_at(pendant)
    p, R = end[:, :3, 3], end[:, :3, :3]
    origins, axes = (np.array([f[:, :3, k] for f in frames]) for k in (3, 2))
    dp, relative = position - p, rotation @ np.swapaxes(R, 1, 2)
    sine = np.column_stack(
        [relative[:, (k + 2) % 3, (k + 1) % 3] - relative[:, (k + 1) % 3, (k + 2) % 3] for k in range(3)]
    )
    dr = sine / 2
    far = np.abs(dp).max(axis=1), np.abs(relative - np.eye(3)).max(axis=(1, 2))
    if limited:
        excess = np.maximum(np.linalg.norm(dp, axis=1) / STRIDE_MM, np.linalg.norm(dr, axis=1) / STRIDE)
        dp, dr = (x / np.maximum(1.0, excess)[:, None] for x in (dp, dr))
    columns = np.concatenate([np.cross(axes, p - origins), axes], axis=2)  # (6, N, 6)
    columns[1] += columns[2]
    return np.linalg.solve(np.moveaxis(columns, 0, 2), np.concatenate([dp, dr], axis=1)[:, :, None])[:, :, 0], far


def pendant_angles(position, rotation, start=None):
    """Pendant angles of flange poses one after the other along a path, (N, 6) [rad].

    Args:
        position: (N, 3) [mm].
        rotation: (N, 3, 3).
        start: Angles near them, (N, 6); None: they are led to from the middle of the posture.

    Raises:
        UnreachableError: Newton does not come to a pose.
    """
    if start is None:
        rows = np.unique(np.linspace(0, len(position) - 1, LED).astype(int))
        led = np.tile(MIDDLE, (len(rows), 1))
        for _ in range(STRIDES):
            step, (away, turned_by) = _newton_step(led, position[rows], rotation[rows], True)
            led = led + step
            if away.max() <= CLOSED_MM and turned_by.max() <= CLOSED:
                break
        start = np.column_stack([np.interp(np.arange(len(position)), rows, column) for column in led.T])
    pendant = start
    for _ in range(ROUNDS):
        step, (away, turned_by) = _newton_step(pendant, position, rotation, False)
        if away.max() <= CLOSED_MM and turned_by.max() <= CLOSED:
            return pendant
        pendant = pendant + step
    n = int(np.argmax(away))
    raise UnreachableError(f"the inverse stays {away[n]:.3g} mm from P[{n + 1}] in the posture N U T")


def joints_at(wanted, guess):
    """Pendant angles (6,) [deg] that bring the nominal flange to a matrix, by Newton's method from a guess."""
    return np.degrees(pendant_angles(wanted[None, :3, 3], wanted[None, :3, :3], np.radians([guess]))[0])


# CONFIG ----------------------------------------------------------------------------------------------------------


def posture(pendant):
    """CONFIG of pendant angles (N, 6) [rad]: three letters, and the turns of J1, J4 and J6, (N, 3) each.

    U where cos(J2 + J3 + atan2(a3, |d4|)) > 0, T where the wrist is before axis 1, a turn for each 360 deg beyond 180
    (the format's description, section 7).
    """
    j2, j3 = pendant[:, 1], pendant[:, 2]
    up = np.cos(j2 + j3 + np.arctan2(A3, D4)) > 0
    before = A1 + A2 * np.sin(j2) + D4 * np.cos(j3) - A3 * np.sin(j3) > 0
    letters = np.column_stack(
        [np.where(pendant[:, 4] > 0, "F", "N"), np.where(up, "U", "D"), np.where(before, "T", "B")]
    )
    angles = np.degrees(pendant[:, [0, 3, 5]])
    return letters, (np.sign(angles) * ((np.abs(angles) + 180) // 360)).astype(int)


def config(joints):
    """CONFIG's text of pendant angles (6,) [deg]."""
    letters, turns = posture(np.radians([joints]))
    return f"{' '.join(letters[0])}, {', '.join(map(str, turns[0]))}"


def joints_by_config(flange, config):
    """Pendant angles (N, 6) [rad] of flange poses (N, 4, 4), in closed form by the texts of CONFIG."""
    letters = np.array([c.split(",")[0].split() for c in config])
    digits = np.array([[int(d) for d in c.split(",")[1:]] for c in config])
    back = frame(0, 0, 0, 180, 0, 0).T @ frame(0, 0, 0, 0, 90, 0)
    wrist_axes = flange[:, :3, :3] @ back[:3, :3]
    wrist = flange[:, :3, 3] - D6 * wrist_axes[:, :, 0]
    front = np.where(letters[:, 2] == "T", 1, -1)
    j1 = np.arctan2(front * wrist[:, 1], front * wrist[:, 0])
    out, up = np.cos(j1) * wrist[:, 0] + np.sin(j1) * wrist[:, 1] - A1, wrist[:, 2]
    far, forearm, bend = np.hypot(out, up), math.hypot(D4, A3), math.atan2(A3, D4)
    inner = np.arccos((A2**2 + far**2 - forearm**2) / (2 * A2 * far))
    upper = np.arctan2(up, out) + np.where(letters[:, 1] == "U", 1, -1) * inner
    fore = np.arctan2(up - A2 * np.sin(upper), out - A2 * np.cos(upper))
    lower, highest = np.radians(study.LOWER_DEG) - OFFSET, np.radians(study.UPPER_DEG) - OFFSET
    j2 = within(np.pi / 2 - upper, lower[1], highest[1])
    elbow = (j2 + fore + np.pi / 2) % (2 * np.pi) - np.pi / 2 - bend  # from fold to fold, through the stretch
    j3 = np.where(elbow > highest[2] + 1e-9, elbow - 2 * np.pi, elbow) - j2
    arm = turned("z", j1) @ turned("y", -j3)
    w = np.swapaxes(arm[:, :3, :3], 1, 2) @ wrist_axes
    side = np.where(letters[:, 0] == "F", 1, -1)
    j5 = side * np.arccos(np.clip(w[:, 0, 0], -1, 1))
    j4 = np.arctan2(side * w[:, 1, 0], side * w[:, 2, 0])
    j6 = np.arctan2(side * w[:, 0, 1], -side * w[:, 0, 2])
    q = np.column_stack([j1, j2, j3, j4, j5, j6])
    for column, digit in zip((0, 3, 5), digits.T, strict=False):
        begins = (q[:, column] * digit > 0) & (np.abs(q[:, column]) > np.pi - 1e-6)  # a turn begins at 180 deg
        q[:, column] += 2 * np.pi * (digit - begins * np.sign(digit))
        over = np.sign(q[:, column]) * ((np.abs(q[:, column]) + np.pi) // (2 * np.pi)) != digit
        near = np.abs(np.abs(q[:, column]) % (2 * np.pi) - np.pi) < 1e-6
        assert not (over & ~near).any(), "a turn digit that no angle has"
    return q


def within(angle, low, high):
    """The same angle, a turn on where that is inside the limits."""
    angle = (angle + np.pi) % (2 * np.pi) - np.pi
    return np.where(angle > high + 1e-9, angle - 2 * np.pi, np.where(angle < low - 1e-9, angle + 2 * np.pi, angle))
