r"""What makes the second arm differ, in numpy alone, from the tables of a robot file as docs/sources.md words them.

The chain is ``naive_arm``'s, lengths are mm. What depends on the pose depends on the commanded joints and the nominal
arm: joints are turned first (``turned_joints``), then the chain is grown, bent and moved (``flange_poses``).
"""

import math

import naive_arm
import numpy as np
from naive_arm import ALPHA, A, D, chain, shifted, turned

MDEG, ARCSEC = math.radians(1e-3), math.radians(1 / 3600)
SIX = [0.0] * 6
GROWN = {"a2": ("excess_a", 1, 1), "d4": ("excess_d", 3, -1), "d6": ("excess_d", 5, -1)}  # key, row, sign of the length

Behind = dict[int, list[np.ndarray]]


# Joints ----------------------------------------------------------------------------------------------------------


def torques(theta: np.ndarray, loads: dict, tool: np.ndarray) -> np.ndarray:
    """Of gravity and process force on each joint, (N, 6) [N m], at the nominal arm."""
    N = len(theta)
    here, mastered = chain(theta), chain(naive_arm.OFFSET[None])
    masses, centres = [], []
    for i, (mass, centre) in enumerate(
        zip(loads.get("link_kg", SIX), loads.get("link_centre_mm", 6 * [[0, 0, 0]]), strict=False)
    ):
        at_zero = mastered[i] @ turned("z", naive_arm.OFFSET[i])
        world = np.append(at_zero[0, :3, 3] + centre, 1.0)
        masses.append(mass)
        centres.append((here[i] @ turned("z", theta[:, i]) @ np.linalg.inv(at_zero[0]) @ world)[:, :3])
    masses.append(loads.get("payload_kg", 0))
    centres.append((here[6] @ np.append(loads.get("payload_centre_mm", [0, 0, 0]), 1.0))[:, :3])
    tip = here[6] @ tool
    force = tip[:, :3, :3] @ np.array(loads.get("force_N", [0, 0, 0]), dtype=float)
    out = np.zeros((N, 6))
    for i in range(6):
        o, z = here[i][:, :3, 3], here[i][:, :3, 2]
        moment = np.cross(tip[:, :3, 3] - o, force)
        for k in range(i, 7):
            moment = moment + np.cross(centres[k] - o, masses[k] * np.array([0, 0, -9.80665]))
        out[:, i] = (z * moment).sum(axis=1) / 1000
    return out


def sides(theta: np.ndarray, width: np.ndarray, law: str = "dahl") -> np.ndarray:
    """Which side each joint has come from, (N, 6), nothing at the beginning."""
    u = np.zeros_like(theta)
    for n, turn in enumerate(np.diff(theta, axis=0)):
        if law == "play":
            u[n + 1] = np.clip(u[n] + turn / width, -1, 1)
        else:
            u[n + 1] = np.sign(turn) + (u[n] - np.sign(turn)) * np.exp(-np.abs(turn) / width)
    return u


def turned_joints(theta: np.ndarray, load: np.ndarray, side: np.ndarray, sources: dict) -> np.ndarray:
    """By how much joints are off (N, 6) [rad], at loads [N m] and sides that they come from, (N, 6) each."""
    zeros, coupling = sources.get("joint_zeros", {}), sources.get("joint_coupling", {})
    give, lash = sources.get("compliance", {}), sources.get("hysteresis", {})
    off = np.tile(MDEG * np.array(zeros.get("offset_mdeg", SIX)), (len(theta), 1))
    off += 1e-6 * (theta - naive_arm.OFFSET) @ np.array(coupling.get("ratio_ppm", 6 * [SIX])).T
    softer = 1e-9 * np.array(give.get("hardening_nrad_Nm2", SIX)) * np.hypot(load, 1)
    off += (1e-6 * np.array(give.get("compliance_urad_Nm", SIX)) + softer) * load
    half = 1e-6 * np.array(lash.get("windup_urad_Nm", SIX)) * np.hypot(load, 1)
    off -= side * (MDEG * np.array(lash.get("backlash_mdeg", SIX)) + half)
    for name in ("gear_harmonics", "joint_ripple"):
        table = sources.get(name, {})
        for i in range(6 if table else 0):
            orders = table["order"] if name == "joint_ripple" else [n * table.get("cycles", 6 * [1])[i] for n in (1, 2)]
            angle = np.outer(theta[:, i], orders)
            off[:, i] += MDEG * (np.sin(angle) @ table["sine_mdeg"][i] + np.cos(angle) @ table["cosine_mdeg"][i])
    return off


# Chain -----------------------------------------------------------------------------------------------------------


def bends(table: dict, rise: dict) -> Behind:
    """Displacements of a bend behind the frames where its link ends, in their axes; a forearm's where it begins."""
    out: Behind = {}
    for link, plane, node, rate in zip(*(table[k] for k in ("link", "plane", "node", "rate_arcsec_K")), strict=False):
        phi = rate * ARCSEC * np.atleast_1d(rise[node])
        row = {"column": 0, "a1": 1, "a2": 2, "a3": 3, "d4": 3}[link]
        along = {"column": (0, 0, table.get("column_mm", 0)), "d4": (0, 0, D[3])}.get(link, (A[max(row, 1) - 1], 0, 0))
        vector = np.array(along, dtype=float)
        if plane in ("x", "y"):
            axis = np.eye(3)["xy".index(plane)]
        elif plane == "twist":
            axis = np.array([0, 0, 1.0]) if link == "column" else vector / np.linalg.norm(vector)
        else:  # joint 2 turns as J2 does; joint 3 lies along it, either way round
            axis = np.array([0, 0, 1.0]) if link == "a1" else turned("x", -ALPHA[row - 1])[0, :3, 2]
            if row == 3:
                axis = axis * np.sign(math.cos(ALPHA[1]))
            axis = np.cross(vector / np.linalg.norm(vector), axis) if plane == "side" else axis
        aside = np.zeros(3) if plane == "twist" else np.cross(axis, vector) / 2 * (-1 if link == "d4" else 1)
        out.setdefault(row, []).append(shifted(*np.outer(aside, phi)) @ about(axis, phi))
    return out


def about(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rotations (M, 4, 4) about a unit axis by angles (M,) [rad], Rodrigues."""
    x, y, z = axis
    K, out = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), np.tile(np.eye(4), (len(angle), 1, 1))
    out[:, :3, :3] += np.sin(angle)[:, None, None] * K + (1 - np.cos(angle))[:, None, None] * (K @ K)
    return out


def shifts(table: dict, rise: dict) -> Behind:
    """Of base, links along themselves away from zero, tool along the flange's axis; of a part, the other way."""
    out: Behind = {}
    for of, node, rate in zip(*(table[k] for k in ("of", "node", "rate_um_K")), strict=False):
        way = rate * np.atleast_1d(rise[node]) / 1000
        if of == "tool":
            row, axis = 6, "z"
        elif of.startswith(("base", "fixture")):
            row, axis, way = 0, of[-1], -way if of.startswith("fixture") else way
        elif of == "d1":
            row, axis = 0, "z"
        else:
            number = int(of[1])
            row, axis = (number, "x") if of[0] == "a" else (number - 1, "z")
            way = way * np.sign(A[number - 1] if of[0] == "a" else D[number - 1])
        out.setdefault(row, []).append(shifted(**{axis: way}))
    return out


def displaced(table: dict) -> np.ndarray:
    """A displacement of a frame as a matrix."""
    position = np.array(table.get("position_um", [0, 0, 0])) / 1000
    return shifted(*position)[0] @ naive_arm.by_vector(MDEG * np.array(table.get("rotation_mdeg", [0, 0, 0])))


def flange_poses(real: np.ndarray, rise: dict, growth: np.ndarray, sources: dict) -> np.ndarray:
    """Where the real flange is, (N, 4, 4) [mm].

    Args:
        real: Joints as they are turned, (N, 6) [rad].
        rise: Of each node, (N,) or one [K].
        growth: Of a2, d4 and d6 at the file's coefficient, (N, 3) [mm].
        sources: The robot file's tables.
    """
    offsets, own = sources.get("link_offsets", {}), sources.get("thermal_growth", {})
    d, a = (np.tile(x + np.array(offsets.get(k, SIX)) / 1000, (len(real), 1)) for x, k in ((D, "d_um"), (A, "a_um")))
    for (key, row, sign), grown in zip(GROWN.values(), growth.T, strict=True):
        (a if key == "excess_a" else d)[:, row] += sign * (1 + own.get(key, SIX)[row]) * grown
    alpha, beta = (MDEG * np.array(offsets.get(key, SIX)) for key in ("alpha_mdeg", "beta_mdeg"))
    behind: Behind = {0: [displaced(sources.get("base_frame", {}))[None]]}
    for name, of in (("thermal_bend", bends), ("thermal_shift", shifts)):
        for row, matrices in (of(sources[name], rise) if name in sources else {}).items():
            behind.setdefault(row, []).extend(matrices)
    end = chain(real, a, d, ALPHA + alpha, beta, behind)[-1]
    for displacement in behind.get(6, []):
        end = end @ displacement
    return end @ displaced(sources.get("tool_frame", {}))
