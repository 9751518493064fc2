"""What a written program makes of a user's lines and arcs: a reader and an arm that share nothing with the package."""

import json
from dataclasses import dataclass

import jobs
import naive_cam
import naive_ls
import numpy as np
from naive_arm import dh_angles, frame, frame_of, joints_by_config
from naive_heat import THERMAL, rises_along
from naive_way import cut, from_pieces, worst_in_order
from shipped import ROOT

SCHEMA = json.loads((ROOT / "paths" / "path.schema.json").read_text())["$defs"]
CHORD_UM = 1.5  # process.chord_um when the path file says none
ROUNDING_UM = 0.9  # of 0.001 mm and 0.001 deg in the program
APART_UM = 0.3  # judge and report: they sample different moments
RAPID_UM = 1000.0  # a rapid may leave its line by so much, but not downward
BULGE_UM = (
    SCHEMA["PointsTable"]["properties"].get("bulge_um", {}).get("default", 50.0)
)  # a curve through points, beyond what their own curvature explains
CORNER_DEG = 25.0  # path.corner_deg: what turns more is a corner, not a curve
TILT_MDEG = 20.0  # the tool's axis at a place: path.tolerance_mdeg, rounding, and the judge's interpolation
FASTER = 1.01
SPEED_STEP = 25.4 / 600  # mm/s: 0.1 inch/min, the finest step of a speed that a program can say
TABLES = {"gcode": "GcodeTable", "apt": "AptTable", "points": "PointsTable"}


# What the user asked for -----------------------------------------------------------------------------------------


@dataclass
class Wanted:
    """The user's way in short straight pieces, each with the distance [mm] that a place may have from it."""

    start: np.ndarray  # (M, 3) [mm]
    end: np.ndarray  # (M, 3) [mm]
    may: np.ndarray  # (M,) [mm]
    floor: np.ndarray  # (M,) [mm]: no place of a rapid is lower
    feed: np.ndarray  # (M,) [mm/s]
    line: np.ndarray  # (M,) of the user's file; 0: the approach or the retract
    corner: np.ndarray  # (K, 3) [mm]
    near: np.ndarray  # (K,) [mm]: how near each corner is passed
    normal: np.ndarray | None  # (K, 3): the tool's axis there


def allowance_mm(keys: dict, left_um: float) -> float:
    """How far [mm] the tool may be from a line or an arc."""
    default = SCHEMA[TABLES[keys["path"]["pattern"]]]["properties"]["tolerance_um"]["default"]
    own = keys["path"].get("tolerance_um", default)
    return (own + keys["process"].get("chord_um", CHORD_UM) + ROUNDING_UM + left_um + APART_UM) / 1000


def wanted(read: naive_cam.Reading, keys: dict, left_um: float) -> Wanted:
    """The way of a file, with an approach and a retract along the tool's axis."""
    may, lift, feed = allowance_mm(keys, left_um), keys["process"]["lift_mm"], keys["process"]["feed_mm_s"]
    through = keys["path"].get("through", "tolerance")
    curve = read.points and through != "lines"
    first, last = read.moves[0], read.moves[-1]
    up = [lift * v for v in read.normal or (0, 0, 1)], [lift * v for v in last.normal or (0, 0, 1)]
    before = naive_cam.Line(tuple(np.add(first.start, up[0])), first.start, rapid=True)
    behind = naive_cam.Line(last.end, tuple(np.add(last.end, up[1])), rapid=True)
    places = np.array([first.start, *(m.end for m in read.moves)])
    bulge = [0.0, *explained_mm(places), 0.0] if curve else [0.0] * (len(read.moves) + 2)
    starts, ends, rows = [], [], []
    for move, out in zip([before, *read.moves, behind], bulge, strict=False):
        way = cut(move)
        lowest = min(move.start[2], move.end[2]) - may
        unsure = move.unsure if isinstance(move, naive_cam.Arc) else 0.0
        row = [may + unsure + out, -np.inf, feed if move.feed is None else move.feed, move.line]
        if move.rapid and not curve:
            row[:2] = RAPID_UM / 1000, lowest
        starts += list(way[:-1])
        ends += list(way[1:])
        rows += [row] * (len(way) - 1)
    table = np.array(rows)
    loose = [
        a.rapid and b.rapid and not curve for a, b in zip([before, *read.moves], [*read.moves, behind], strict=False)
    ]
    near = np.where(loose, RAPID_UM / 1000, may)
    normals = [read.normal, *(m.normal for m in read.moves)]
    normal = None if None in normals else np.array(normals)
    may_be, floor, feeds, line = table.T
    return Wanted(np.array(starts), np.array(ends), may_be, floor, feeds, line, places, near, normal)


def explained_mm(place: np.ndarray) -> np.ndarray:
    """How far (N - 1,) [mm] a curve through places may leave the lines between them: the key, and the places' own
    curvature. A span L between two circles of curvature k is L² k / 8 high; half as much again is allowed."""
    step = np.diff(place, axis=0)
    length = np.maximum(np.linalg.norm(step, axis=1), 1e-9)
    unit = step / length[:, None]
    turn = np.arccos(np.clip((unit[:-1] * unit[1:]).sum(axis=1), -1, 1))
    curvature = np.where(turn < np.radians(CORNER_DEG), 2 * turn / (length[:-1] + length[1:]), 0.0)
    most = np.maximum(np.append(0.0, curvature), np.append(curvature, 0.0))
    return BULGE_UM / 1000 + 1.5 * length**2 * most / 8


# What was written ------------------------------------------------------------------------------------------------


@dataclass
class Flown:
    """A program as the warm arm drives it, in the axes of the user's file."""

    pose: np.ndarray  # (M, 4, 4) [mm] at each written place and between
    motion: np.ndarray  # (M - 1,) which motion each stretch is of
    speed: np.ndarray  # (K,) [mm/s] of the motions


def flown(texts: list[bytes], keys: dict) -> Flown:
    """Drive the text: lines and circular motions in the user frame, the joints by CONFIG, the arm as it has warmed."""
    base, tool = (frame_of(keys.get(name, {})) for name in ("frame", "tool"))
    pose, motion, config, speed = list[np.ndarray](), list[int](), list[str | None](), list[float]()
    for text in texts:
        positions, moves = naive_ls.read(text)
        for move in moves:
            groups = [positions[int(t[2:-1].split(":")[0])].groups[1] for t in move.targets]
            targets = [frame(*(g.axes[k] for k in "XYZWPR")) for g in groups]
            again = (
                move.letter == "J" and pose and np.allclose(pose[-1], targets[0], atol=1e-9)
            )  # the next page's start
            if move.disabled or move.letter not in "JLC" or (move.letter == "J") != (not pose or again):
                raise ValueError(f"a motion that the judge does not know: {move}")
            way = [targets[0]] if not pose or again else between(pose[-1], targets)
            pose += way
            motion += [len(speed)] * len(way)
            config += [groups[-1].config] * len(way)
            speed.append(naive_ls.mm_s(move.speed) if move.letter != "J" else 1.0)
    told = np.array(pose)
    joints = joints_by_config(base @ told @ np.linalg.inv(tool), config)
    joints = np.unwrap(joints, axis=0)  # turn digits are those of positions; between them no joint turns far
    theta = dh_angles(joints)
    length = np.linalg.norm(np.diff(told[:, :3, 3], axis=0), axis=1)
    feeds = np.array(speed)[motion[1:]]
    before = [(s["state"], s.get("feed_mm_s", 0.0), s["duration_h"]) for s in keys.get("before", [])]
    rise = rises_along(before, length / feeds, feeds)
    real = jobs.tool_poses(theta, rise, THERMAL["cte_um_m_K"], {}, tool)
    part = np.linalg.inv(base) @ real
    part[:, :3, 3] -= [keys["path"].get(k, 0.0) for k in ("x_mm", "y_mm", "z_mm")]
    return Flown(part, np.array(motion[1:]), np.array(speed))


def between(start: np.ndarray, targets: list[np.ndarray]) -> list[np.ndarray]:
    """The places of a line (half way and its end) or of a circular motion (through one place to another)."""
    shares = [0.5, 1.0] if len(targets) == 1 else np.linspace(0, 1, 17)[1:]
    turned = [targets[-1][:3, :3] * s + start[:3, :3] * (1 - s) for s in shares]
    out = []
    for share, turn in zip(shares, turned, strict=False):
        u, _, v = np.linalg.svd(turn)
        here = np.eye(4)
        here[:3, :3] = u @ v
        a, b, c = start[:3, 3], targets[0][:3, 3], targets[-1][:3, 3]
        here[:3, 3] = a + share * (b - a) if len(targets) == 1 else on_circle(a, b, c, share)
        out.append(here)
    return out


def on_circle(a: np.ndarray, b: np.ndarray, c: np.ndarray, share: float) -> np.ndarray:
    """A place on the arc from a through b to c."""
    first, second = b - a, c - a
    axis = np.cross(first, second)
    square = axis @ axis
    centre = a + np.cross(axis, first) * (second @ second) / (2 * square)
    centre = centre + np.cross(second, axis) * (first @ first) / (2 * square)
    axis = axis / np.sqrt(square)
    out, end = a - centre, c - centre
    turn = np.arctan2(np.cross(out, end) @ axis, out @ end) % (2 * np.pi)
    return centre + np.cos(share * turn) * out + np.sin(share * turn) * np.cross(axis, out)


# Distances -------------------------------------------------------------------------------------------------------


def contradiction(want: Wanted, drive: Flown) -> tuple[float, str]:
    """The largest share of what may be, and what is wrong; no words when nothing is."""
    place = drive.pose[:, :3, 3]

    def off(distance: np.ndarray, n: int) -> np.ndarray:
        below = np.where(np.isfinite(want.floor), want.floor - place[n, 2], -1.0)
        return np.where(below > 0, np.maximum(2.0, distance / want.may), distance / want.may)

    largest, n = worst_in_order(place, want.start, want.end, off)
    if largest > 1:
        return largest, f"the tool leaves the lines{off_by(largest, place[n], want.start, want.end)}"
    missed, n = worst_in_order(want.corner, place[:-1], place[1:], lambda distance, k: distance / want.near[k])
    if missed > 1:
        return missed, f"a place is not passed{off_by(missed, want.corner[n], place[:-1], place[1:])}"
    tilted = tilt_mdeg(want, drive)
    if tilted > TILT_MDEG:
        return tilted / TILT_MDEG, f"the tool stands otherwise: {tilted:.0f} mdeg"
    return max(largest, missed), too_fast(want, drive)


def off_by(share: float, place: np.ndarray, start: np.ndarray, end: np.ndarray) -> str:
    """Words: where, how far from the nearest piece of all, and the share in order."""
    way = end - start
    nearest = from_pieces(place, start, way, np.maximum((way**2).sum(axis=1), 1e-18)).min()
    at = ", ".join(f"{v:.3f}" for v in place)
    return f": {1000 * nearest:.1f} um from the nearest at ({at}), in order {share:.2f} times what may be"


def tilt_mdeg(want: Wanted, drive: Flown) -> float:
    """Largest angle [mdeg] between the tool and the user's axis where the tool passes his places."""
    if want.normal is None:
        return 0.0
    place, axis, largest = drive.pose[:, :3, 3], -drive.pose[:, :3, 2], 0.0
    way = np.diff(place, axis=0)
    square = np.maximum((way**2).sum(axis=1), 1e-18)
    for corner, normal, near in zip(want.corner, want.normal, want.near, strict=False):
        passed = from_pieces(corner, place[:-1], way, square) <= near
        share = np.clip(((corner - place[:-1]) * way).sum(axis=1) / square, 0, 1)[passed, None]
        here = axis[:-1][passed] * (1 - share) + axis[1:][passed] * share
        apart = np.linalg.norm(np.cross(here, normal / np.linalg.norm(normal)), axis=1)
        largest = max(largest, float(np.where((here * normal).sum(axis=1) > 0, apart, 1.0).min(initial=1.0)))
    return 1000 * np.degrees(largest)


def too_fast(want: Wanted, drive: Flown) -> str:
    """Words, when a motion is faster than the feed of every piece of the user's way that it lies on."""
    place = drive.pose[:, :3, 3]
    half = 0.5 * (place[1:] + place[:-1])
    way = want.end - want.start
    square = np.maximum((way**2).sum(axis=1), 1e-18)
    for p, motion in zip(half, drive.motion, strict=False):
        apart = from_pieces(p, want.start, way, square)
        here = apart <= np.maximum(2 * want.may, apart.min())
        if drive.speed[motion] > FASTER * want.feed[here].max(initial=0.0) + SPEED_STEP:
            return f"faster than the feed: {drive.speed[motion]:g} mm/s at {np.round(p, 3).tolist()}"
    return ""
