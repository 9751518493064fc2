"""What a program is: its motions, frames and positions, how long it runs, how near it comes to limits, what is unsafe.

Motions are taken as listed: jumps, calls and loops are not followed. Lengths and times need both ends in the file and
their frames known.
"""

import re
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from compgen.arrays import Array
from compgen.dialects.fanuc_ls.frames import Frames
from compgen.dialects.fanuc_ls.listing import LsProgram
from compgen.dialects.fanuc_ls.places import AXES
from compgen.dialects.fanuc_ls.program import apply_turns
from compgen.dialects.fanuc_ls.safety import unsafe_statements
from compgen.ik import Posture, solve
from compgen.robot import Robot
from compgen.rotations import from_wpr
from compgen.units import DEG, INCH, MINUTE, MM

_RATES = {"mm/sec": MM, "cm/min": 10 * MM / MINUTE, "inch/min": INCH / MINUTE}
_TIMES = {"sec": 1.0, "msec": 1e-3}
_CONFIG = re.compile(r"\s*([NF])\s*([UD])\s*([TB])\s*(?:,\s*(-?\d+)\s*,\s*(-?\d+)\s*,\s*(-?\d+))?\s*$")


@dataclass(frozen=True, eq=False, slots=True)
class Places:
    """GP1 of each position of a program, where it can be told."""

    number: tuple[int, ...]
    position: Array  # (G, 3) [m] TCP in World, NaN when not known
    theta: Array  # (G, 6) [rad] on the robot, NaN when not known
    margin: Array  # (G,) [m] inside reach, NaN when not asked


def inspect(program: LsProgram, robot: Robot, frames: Frames) -> dict[str, Any]:
    """Everything ``compgen inspect`` says, in plain types.

    Args:
        program: Any program.
        robot: For limits and singularities.
        frames: What UFRAME and UTOOL numbers mean.
    """
    m, p = program.motions, program.positions
    active = ~m.disabled
    uses = Counter(int(n) for i in np.flatnonzero(active) for n in m.position[i] if n >= 0)
    defined = p.number.tolist()
    places = _places(program, robot, frames)
    length, duration, untimed = _travel(program, places)
    first = p.group <= 1
    pairs = Counter(zip(p.uframe[first].tolist(), p.utool[first].tolist()))
    joint_form = (p.span[first][:, AXES.index("J1"), 1] > 0) if first.any() else np.zeros(0, dtype=bool)
    return {
        "name": program.name,
        "subtype": program.subtype,
        "comment": dict(program.attributes).get("COMMENT", "").strip('"'),
        "robot": robot.name,
        "bytes": len(program.data),
        "motions": dict(Counter(letter for letter, on in zip(m.letter, active) if on)),
        "disabled_motions": int((~active).sum()),
        "frames": [{"uframe": uf, "utool": ut, "positions": n} for (uf, ut), n in sorted(pairs.items())],
        "positions": {
            "defined": len(set(defined)),
            "used": len(set(defined) & set(uses)),
            "unused": sorted(set(defined) - set(uses)),
            "shared": sorted(n for n, count in uses.items() if count > 1),
            "undefined": sorted(set(uses) - set(defined)),
            "joint_form": int(joint_form.sum()),
        },
        "path_length_mm": length / MM,
        "duration_s": duration,
        "motions_without_time": untimed,
        "postures": dict(Counter(_letters(c) for c, g in zip(p.config, p.group) if g <= 1 and c is not None)),
        "limits": _limits(places, robot),
        "out_of_reach": [n for n, margin in zip(places.number, places.margin) if margin < 0],
        "unsafe": [{"line": u.line, "text": u.text, "reason": u.reason} for u in unsafe_statements(program)],
    }


def _letters(config: str) -> str:
    found = _CONFIG.match(config)
    return " ".join(found.groups()[:3]) if found else config


def _places(program: LsProgram, robot: Robot, frames: Frames) -> Places:
    p = program.positions
    rows = np.flatnonzero(p.group <= 1)
    count = len(rows)
    position, theta, margin = np.full((count, 3), np.nan), np.full((count, 6), np.nan), np.full(count, np.nan)
    value = p.value[rows]
    joints = value[:, 6:12] * DEG
    by_joint = np.isfinite(joints).all(axis=1)
    theta[by_joint] = robot.to_theta(joints[by_joint])
    known = np.array(
        [u in frames.uframe and t in frames.utool for u, t in zip(p.uframe[rows].tolist(), p.utool[rows].tolist())],
        dtype=bool,
    )
    cartesian = np.flatnonzero(np.isfinite(value[:, :6]).all(axis=1) & known)
    if len(cartesian):
        base = [frames.uframe[int(u)] for u in p.uframe[rows[cartesian]]]
        tool = [frames.utool[int(t)] for t in p.utool[rows[cartesian]]]
        base_p, base_R = np.array([b[0] for b in base]), np.array([b[1] for b in base])
        tool_p, tool_R = np.array([t[0] for t in tool]), np.array([t[1] for t in tool])
        position[cartesian] = base_p + np.einsum("nij,nj->ni", base_R, value[cartesian, :3] * MM)
        turned = base_R @ from_wpr(*(value[cartesian, 3:6] * DEG).T)
        flange = turned @ np.swapaxes(tool_R, 1, 2)
        reach = position[cartesian] - np.einsum("nij,nj->ni", flange, tool_p)
        configs = [_CONFIG.match(p.config[i] or "") for i in rows[cartesian]]
        for letters in {c.groups()[:3] for c in configs if c}:
            some = np.array([c is not None and c.groups()[:3] == letters for c in configs])
            posture = Posture(letters[2] == "T", letters[1] == "U", letters[0] == "F")
            solved, inside = solve(robot, reach[some], flange[some], posture)
            turns = np.array(
                [[int(t or 0) for t in c.groups()[3:]] for c in configs if c and c.groups()[:3] == letters]
            )
            theta[cartesian[some]] = np.where(inside[:, None] >= 0, apply_turns(robot, solved, turns), np.nan)
            margin[cartesian[some]] = inside
    return Places(tuple(int(n) for n in p.number[rows]), position, theta, margin)


def _travel(program: LsProgram, places: Places) -> tuple[float, float, int]:
    """Length of linear and circular motions [m], their time at programmed speeds [s], and motions without a time."""
    where = {n: places.position[i] for i, n in enumerate(places.number)}
    m = program.motions
    length = duration = 0.0
    untimed = 0
    here: Array | None = None
    for i in np.flatnonzero(~m.disabled).tolist():
        stations = [where.get(int(n)) for n in m.position[i]]
        goal = stations[-1] if stations else None
        if goal is not None and np.isnan(goal).any():
            goal = None
        step = None
        if here is not None and goal is not None:
            via = stations[0] if m.letter[i] == "C" and len(stations) == 2 else None
            step = float(np.linalg.norm(goal - here)) if via is None else _arc(here, via, goal)
        number, unit = _speed(m.speed[i])
        if number is not None and unit in _TIMES:
            duration += number * _TIMES[unit]
        elif m.letter[i] != "J" and step is not None and number and unit in _RATES:
            duration += step / (number * _RATES[unit])
        else:
            untimed += 1
        if m.letter[i] != "J" and step is not None:
            length += step
        here = goal
    return length, duration, untimed


def _speed(text: str) -> tuple[float | None, str]:
    found = re.match(r"(\d*\.?\d+)\s*(\S+)$", text)
    return (float(found.group(1)), found.group(2).lower()) if found else (None, "")


def _arc(a: Array, b: Array, c: Array) -> float:
    """Length of the circle arc from a through b to c; the straight way when they are in line."""
    u, v = b - a, c - a
    normal = np.cross(u, v)
    size = float(normal @ normal)
    if size < 1e-18:
        return float(np.linalg.norm(u) + np.linalg.norm(c - b))
    centre = a + (float(v @ v) * np.cross(normal, u) + float(u @ u) * np.cross(v, normal)) / (2 * size)
    start, end = a - centre, c - centre
    radius = float(np.linalg.norm(start))
    angle = float(np.arctan2(normal @ np.cross(start, end) / np.sqrt(size), start @ end)) % (2 * np.pi)
    return radius * angle


def _limits(places: Places, robot: Robot) -> dict[str, Any]:
    """Closest distance of each joint to its limits, and to the singularities, with the position."""
    known = np.isfinite(places.theta).all(axis=1)
    if not known.any():
        return {}
    theta, names = places.theta[known], np.array(places.number)[known]
    room = np.minimum(theta - robot.lower, robot.upper - theta) / DEG
    closest = room.argmin(axis=0)
    wrist = np.abs(theta[:, 4] - robot.pendant_zero[4]) / DEG
    found: dict[str, Any] = {
        name: {"room_deg": float(room[i, j]), "position": int(names[i])}
        for j, (name, i) in enumerate(zip(robot.joint_names, closest.tolist()))
    }
    found["wrist_singularity"] = {"room_deg": float(wrist.min()), "position": int(names[wrist.argmin()])}
    margin = places.margin[known]
    if np.isfinite(margin).any():
        i = int(np.nanargmin(margin))
        found["reach"] = {"room_mm": float(margin[i] / MM), "position": int(names[i])}
    return found
