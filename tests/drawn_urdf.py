"""URDF texts of drawn arms of the class, with any zero, any signs and link frames turned anyhow."""

import re

import numpy as np

from compgen.core.rotations import rotation_matrix, to_wpr

LINKS = ["base", *(f"l{i}" for i in range(1, 7))]


def numbers(values):
    return " ".join(f"{v:.16g}" for v in values)


def class_lines(sizes, theta):
    """Points and directions of the six axes of the class at angles theta, and the tip: by hand, in World."""
    a1, a2, a3, d4, d6 = sizes

    def turned(points, lines, about, through, angle):
        R = rotation_matrix(angle * about)
        return [through + R @ (p - through) for p in points], [R @ w for w in lines]

    z, y, x = np.eye(3)[2], np.eye(3)[1], np.eye(3)[0]
    # with theta = (0, -90, 0, 0, 0, 0) the upper arm stands up, the forearm points forward
    points = [np.zeros(3), a1 * x, a1 * x + a2 * z]
    wrist = points[2] + a3 * z + d4 * x
    points += [wrist, wrist, wrist, wrist + d6 * x]
    lines = [z, y, -y, -x, -y, -x]
    for i, angle in reversed(list(enumerate(theta - np.deg2rad([0, -90, 0, 0, 0, 0])))):
        behind, lines_behind = turned(points[i + 1 :], lines[i + 1 :], lines[i], points[i], angle)
        points[i + 1 :], lines[i + 1 :] = behind, lines_behind
    return points, lines


def drawn_urdf(seed, sizes=None, zero=None, sign=None, tip=None, beside=0.0, wrist=0.0):
    """A URDF whose link frames are turned anyhow, and what it was made of."""
    rng = np.random.default_rng(seed)
    sizes = rng.uniform([0.05, 0.3, 0.02, 0.3, 0.05], [0.4, 1.2, 0.3, 1.5, 0.3]) if sizes is None else sizes
    zero = rng.uniform([-1, -2, -1, -2, 0.3, -2], [1, -1, 1, 2, 1.5, 2]) if zero is None else zero
    sign = rng.choice([-1.0, 1.0], 6) if sign is None else sign
    points, lines = class_lines(sizes, zero)
    points[1:] = [p + beside * lines[1] for p in points[1:]]
    points[5] = points[5] + wrist * np.cross(lines[5], lines[4])
    base = np.array([*rng.uniform(-0.5, 0.5, 2), rng.uniform(0.2, 0.9)])
    before, place, rows = np.eye(3), -base, [f'<link name="{name}"/>' for name in [*LINKS, "tool0"]]
    for i in range(6):
        frame = rotation_matrix(rng.uniform(-2, 2, 3))
        point = points[i] + rng.uniform(-0.2, 0.2) * lines[i]
        rpy = [v[0] for v in to_wpr((before.T @ frame)[None])]
        rows.append(
            f'<joint name="joint_{i + 1}" type="revolute"><origin xyz="{numbers(before.T @ (point - place))}" '
            f'rpy="{numbers(rpy)}"/><parent link="{LINKS[i]}"/><child link="{LINKS[i + 1]}"/>'
            f'<axis xyz="{numbers(2 * sign[i] * frame.T @ lines[i])}"/>'
            f'<limit lower="-2" upper="2.5" effort="0" velocity="{3 + i}"/></joint>'
        )
        before, place = frame, point
    tip = points[6] if tip is None else tip
    rows.append(
        f'<joint name="end" type="fixed"><origin xyz="{numbers(before.T @ (tip - place))}" rpy="1 2 3"/>'
        '<parent link="l6"/><child link="tool0"/></joint>'
    )
    return "<robot name='drawn'>\n" + "\n".join(rows) + "\n</robot>\n", base, sizes, sign


def second_arm(text):
    """The joints and links of an arm, under other names."""
    inner = text.partition("\n")[2].replace("</robot>", "")
    return re.sub(r'(name|link)="', r'\1="left_', inner)
