"""The study's arm a second time, with nothing shared: 4 x 4 matrices, Newton's method, the heat law by hand.

mm and deg as on the pendant. The arm link by link as published,

    rz(J1) tx150 ry(J2) tz870 ry(-(J2+J3)) tz170 rx(-J4) tx1016 ry(-J5) tx175 rx(-J6) ry(-90) rx(180)

and its lengths longer by what the rises of the nodes make of them.
"""

import math
import tomllib
from pathlib import Path

import numpy as np

ROBOT = tomllib.loads((Path(__file__).resolve().parents[1] / "robots" / "m710ic50.toml").read_text())
THERMAL = ROBOT["thermal"]
NODES = {n["name"]: n for n in THERMAL["node"]}
NOMINAL = {"a2": 870.0, "d4": 1016.0, "d6": 175.0}
#: rises after 6 h at 200 mm/s, by definition of the model
WARM = {name: node["rise_K"] for name, node in NODES.items()}


def turn(axis, angle):
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    matrix = np.eye(4)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def shift(x=0.0, y=0.0, z=0.0):
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def frame(x, y, z, w, p, r):
    """X Y Z W P R as a matrix: R = Rz(R) Ry(P) Rx(W)."""
    return shift(x, y, z) @ turn("z", r) @ turn("y", p) @ turn("x", w)


def numbers(matrix):
    """X Y Z W P R of a matrix."""
    r = matrix[:3, :3]
    p = math.degrees(math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0])))
    w, z = math.degrees(math.atan2(r[2, 1], r[2, 2])), math.degrees(math.atan2(r[1, 0], r[0, 0]))
    return (*matrix[:3, 3], w, p, z)


def flange(joints, lengths=NOMINAL):
    """Where the flange is at pendant angles."""
    j1, j2, j3, j4, j5, j6 = joints
    arm = turn("z", j1) @ shift(150) @ turn("y", j2) @ shift(z=lengths["a2"]) @ turn("y", -(j2 + j3)) @ shift(z=170)
    arm = arm @ turn("x", -j4) @ shift(lengths["d4"]) @ turn("y", -j5) @ shift(lengths["d6"]) @ turn("x", -j6)
    return arm @ turn("y", -90) @ turn("x", 180)


def joints_at(wanted, guess):
    """Pendant angles that bring the nominal flange to a matrix, by Newton's method from a guess."""
    q = np.array(guess, dtype=float)
    for _ in range(20):
        pose = flange(q)
        columns = [difference(pose, flange(q + step)) / 1e-4 for step in np.eye(6) * 1e-4]
        q = q + np.linalg.solve(np.array(columns).T, difference(pose, wanted))
    assert np.abs(difference(flange(q), wanted)).max() < 1e-6
    return q


def difference(a, b):
    """Way from a to b [mm] and small turn [mm at 1 m]."""
    r = a[:3, :3].T @ b[:3, :3]
    return np.concatenate(
        [b[:3, 3] - a[:3, 3], 500 * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])]
    )


def between_means(a, b):
    """Mean of the curve that falls by a constant ratio from a to b, at the reference."""
    return (a - b) / math.log(a / b)


def warm_lengths(rise=WARM, cte=THERMAL["cte_um_m_K"]):
    """Lengths [mm] at rises of the nodes; shapes are fixed at the reference, so sections are linear in the rises."""

    def mean(a, b, shape):
        ra, rb = WARM[a], WARM[b]
        if a == b:
            return rise[a]
        share = 0.5 if shape == "linear" else (between_means(ra, rb) - rb) / (ra - rb)
        return share * rise[a] + (1 - share) * rise[b]

    lengths = dict(NOMINAL)
    for profile in THERMAL["profile"]:
        start, grown = 0.0, 0.0
        for s in profile["sections"]:
            grown += cte * 1e-6 * (s["to_mm"] - start) * mean(s["from"], s["to"], s["shape"])
            start = s["to_mm"]
        lengths[profile["length"]] += grown
    return lengths


def rises(duties):
    """Rises after (state, feed [mm/s], hours) in turn."""
    rise_of = {}
    for name, node in NODES.items():
        full = node["rise_K"] / (1 - math.exp(-THERMAL["reference_h"] / node["tau_h"]))
        rise = 0.0
        for state, feed, hours in duties:
            idle = THERMAL["idle_fraction"]
            moving = (feed / THERMAL["reference_feed_mm_s"]) ** node["exponent"] if state == "moving" else 0.0
            steady = 0.0 if state == "off" else full * (idle + (1 - idle) * moving)
            rise = steady + (rise - steady) * math.exp(-hours / node["tau_h"])
        rise_of[name] = rise
    return rise_of


def config(joints):
    """CONFIG's text of pendant angles."""
    j1, j2, j3, j4, j5, j6 = joints
    letters = "F" if j5 > 0 else "N"
    elbow = "U" if math.cos(math.radians(j2 + j3) + math.atan2(170, 1016)) > 0 else "D"
    s, c = math.sin, math.cos
    a, b = math.radians(j2), math.radians(j3)
    side = "T" if 150 + 870 * s(a) + 1016 * c(b) - 170 * s(b) > 0 else "B"
    digits = [int(math.copysign(1, a)) * int((abs(a) + 180) // 360) for a in (j1, j4, j6)]
    return f"{letters} {elbow} {side}, {digits[0]}, {digits[1]}, {digits[2]}"
