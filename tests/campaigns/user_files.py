"""Files as users give them, drawn wider than the package's model: what it read of them against a second, naive reader.

    python tests/campaigns/user_files.py --seeds 0:2000

A seed is a file of each kind: STL, URDF, touches with their artefact, poses, distances, a log of a run, a state, a
posterior, poses as an instrument's software exports them. Half of them are changed in one way. Whatever the package
takes, ``naive_files`` has to read to the same numbers; a file that was not changed has to be taken.
"""

import json
import re
import struct
import sys
import tempfile
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2]))

import naive_files as naive
import numpy as np
import seed_journal
from drawn_urdf import drawn_urdf, second_arm
from meshes import grid_mesh
from naive_arm import config, flange, frame, numbers
from shipped import ROOT

from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.error_model.anchored_state import parse_state
from compgen.error_model.posterior import KnownParameter, read_posterior
from compgen.identification.distances import read_distances
from compgen.identification.measured_poses import read_poses
from compgen.identification.touches import read_artefact, read_touches
from compgen.pipelines.files.robot_file import load_robot
from compgen.pipelines.files.robot_from_urdf import robot_from_urdf
from compgen.planning import boundaries, patterns
from compgen.planning.mesh import Mesh, read_stl
from compgen.planning.own_points.pattern_on_mesh import lay
from compgen.robot.kinematics import flange_pose
from compgen.verification.executed.position_log import read_position_log

MM, DEG, UM, MDEG = 1e-3, np.pi / 180, 1e-6, np.pi / 180e3
M710 = load_robot(str(ROOT / "robots" / "m710ic50.toml"))
PENDANT = naive.PENDANT


class WrongError(Exception):
    """The package read something else than the file says."""


def same(ours, its, what, tolerance):
    """Raises WrongError where two readings differ."""
    ours, its = np.asarray(ours, dtype=float), np.asarray(its, dtype=float)
    if ours.shape != its.shape or not np.allclose(ours, its, rtol=0, atol=tolerance, equal_nan=True):
        raise WrongError(f"{what} read otherwise")


# each kind: a drawn file and how it was changed ("" not at all), then its two readings


def stl(rng, folder):
    a, b = rng.uniform(-0.5, 0.5, 2)
    top = grid_mesh(lambda x, y: a * x * x + b * y * y, half=0.1, n=int(rng.integers(9, 14)))
    mm = 1e3 * (np.concatenate([top, top[:, ::-1] - [0, 0, 0.08]]) if rng.random() < 0.5 else top)
    mm = mm.astype(np.float32).astype(float)
    change = str(
        rng.choice(["", "", "", "turned", "mirrored", "quads", "count", "cut", "more", "big", "nan", "inline"])
    )
    if change in ("turned", "mirrored"):
        mm = mm[:, ::-1] if change == "turned" else mm * [-1, 1, 1]
    normals = rng.choice([0.0, 1.0, -1.0]) * np.array([0, 0, 1.0])  # a file's normals may say anything
    is_text = change in ("quads", "inline") or (change in ("", "turned", "mirrored") and rng.random() < 0.5)
    data = _stl_text(mm, normals, change, rng) if is_text else _stl_binary(mm, normals, change, rng)
    if change == "cut":
        data = data[: -int(rng.integers(1, 200))]
    (folder / "part.stl").write_bytes(data)

    def judge():
        corners = read_stl(folder / "part.stl")
        facets = naive.stl(data)
        same(corners / MM, [c for _, c in facets], "corners", 1e-9)
        edge = boundaries.round_part(0.12)
        laid = lay(
            patterns.raster(edge, 0.03, 0.005, smooth=False),
            edge,
            Mesh.of_corners(corners),
            np.zeros(3),
            "part.stl",
            1e-5,
            0.0,
        )
        points = laid.points.position[laid.points.contact] / MM
        for x, y, z in points[rng.choice(len(points), 12)]:
            height, way = naive.stl_top(facets, x, y)
            if np.isfinite(height) and (abs(height - z) > 1e-6 or way < 0):
                raise WrongError(f"the tool is at z {z:.3f}, what is on top at {height:.3f}")

    return change, judge


def _stl_binary(mm, normals, change, rng):
    records = np.zeros(len(mm), np.dtype([("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")]))
    records["n"], records["c"], records["a"] = normals, mm, rng.integers(0, 65536)
    if change == "nan":
        records["c"][3, 1, 2] = rng.choice([np.nan, np.inf])
    count = len(mm) - int(change == "count") * int(rng.integers(1, 9))
    head = (b"solid" if rng.random() < 0.5 else bytes(rng.integers(0, 256, 5, dtype=np.uint8))).ljust(80, b"\0")
    body = records.astype(records.dtype.newbyteorder(">")).tobytes() if change == "big" else records.tobytes()
    return head + struct.pack("<I", count) + body + b"\1" * (60 if change == "more" else 0)


def _stl_text(mm, normals, change, rng):
    end, form = str(rng.choice(["\n", "\r\n"])), str(rng.choice(["%.9g", "%.8e", "%+.9g"]))
    words = ["facet normal", "outer loop", "vertex", "endloop", "endfacet"]
    words = [w.upper() for w in words] if rng.random() < 0.3 else words
    after_loop = " " if change == "inline" else end
    solids = []
    for k, part in enumerate(np.array_split(mm, int(rng.integers(1, 4)))):
        text = f"solid part {k}{end}"
        for facet in part:
            corners = np.vstack([facet, facet[:1]]) if change == "quads" else facet
            text += f"{words[0]} {' '.join(form % v for v in normals)}{end}\t{words[1]}{after_loop}"
            text += "".join(f"  {words[2]}\t{' '.join(form % v for v in corner)}{end}" for corner in corners)
            text += f"{words[3]}{end}{words[4]}{end}"
        solids.append(f"{text}endsolid part {k}{end}")
    return "".join(solids).encode()


#: changes that the package still takes for what they are not
OPEN: tuple[str, ...] = ()
URDF = {
    "a rail": lambda t: t.replace("</robot>", _joint("rail", "prismatic", "w", "base") + "</robot>"),
    "a gripper": lambda t: t.replace("</robot>", _joint("grip", "prismatic", "l6", "finger") + "</robot>"),
    "a camera": lambda t: t.replace("</robot>", _joint("cam", "fixed", "l3", "camera") + "</robot>"),
    "a branch": lambda t: t.replace("</robot>", _joint("rod", "revolute", "l2", "crank") + "</robot>"),
    "a transmission": lambda t: t.replace("</robot>", '<transmission><joint name="joint_1"/></transmission></robot>'),
    "a slide": lambda t: t.replace('name="joint_3" type="revolute"', 'name="joint_3" type="prismatic"'),
    "a mimic joint": lambda t: t.replace('<axis xyz', '<mimic joint="joint_2"/><axis xyz', 3),
    "lower above upper": lambda t: t.replace('lower="-2" upper="2.5"', 'lower="2" upper="-2.5"', 1),
    "degrees": lambda t: t.replace('lower="-2" upper="2.5"', 'lower="-115" upper="143"'),
    "no tool0": lambda t: t.replace('"tool0"', '"tcp"'),
    "two arms": lambda t: t.replace("</robot>", second_arm(t) + "</robot>"),
    "joints from the last": lambda t: "\n".join([t.split("\n")[0], *t.split("\n")[-3:0:-1], "</robot>"]),
}  # fmt: skip
FINE = ("a camera", "a branch", "a transmission", "joints from the last")  # the arm is the same


def _joint(name, kind, parent, child):
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="0 0 0.1" rpy="0 0 0"/><parent link="{parent}"/>'
        f'<child link="{child}"/><limit lower="0" upper="0.1" velocity="1" effort="1"/></joint>'
    )


def urdf(rng, folder):
    text, *_ = drawn_urdf(int(rng.integers(10_000)))
    change = str(rng.choice(list(URDF))) if rng.random() < 0.6 else ""
    text = URDF.get(change, str)(text)
    (folder / "arm.urdf").write_text(text)

    def judge():
        _, written = robot_from_urdf(str(folder / "arm.urdf"), coupled=False)
        way, chain = naive.urdf(text)
        limits = np.array([joint["limits"] for joint in chain])
        if not (limits[:, 0] < limits[:, 1]).all():
            raise WrongError("a range that ends before it begins")
        (folder / "arm.toml").write_text(written)
        robot = load_robot(str(folder / "arm.toml"))
        ends = [robot.to_theta(limits[:, k]) for k in (0, 1)]
        same(np.minimum(*ends), robot.lower, "lower limits", 1e-8)
        same(np.maximum(*ends), robot.upper, "upper limits", 1e-8)
        same(limits[:, 2], robot.speed, "speeds", 1e-8)
        q = rng.uniform(-3, 3, (20, 6))
        ours = flange_pose(robot, robot.to_theta(q))
        its = np.array([naive.urdf_pose(way, row) for row in q])
        off = its[:, :3, 3] - ours.position
        same(off - off[0], 0 * off, "the flange's place", 1e-6)
        turn = np.swapaxes(ours.rotation, 1, 2) @ its[:, :3, :3]
        same(turn - turn[0], 0 * turn, "the flange's turn", 1e-6)

    return "" if change in FINE else change, judge


def touches(rng, folder):
    count, in_world = 6, rng.random() < 0.5
    uframe = np.eye(4) if in_world else frame(*rng.uniform(-300, 300, 3), *rng.uniform(-40, 40, 3))
    probe, ball, sphere = rng.uniform([-60, -60, 80], [60, 60, 250]).tolist(), rng.uniform(1, 10), rng.uniform(10, 40)
    cte, degC = rng.uniform(0.5, 24), rng.uniform(15, 30)
    by_joints, sided = rng.random() < 0.5, rng.random() < 0.6
    text = f'[artefact]\nframe = "{"world" if in_world else "uframe 3"}"\n'
    text += f"cte_um_m_K = {cte!r}\ntemperature_degC = {degC!r}\n"
    text += f"[probe]\nx_mm = {probe[0]!r}\ny_mm = {probe[1]!r}\nz_mm = {probe[2]!r}\ndiameter_mm = {ball!r}\n"
    names = [*(PENDANT if by_joints else [*naive.POSE, "config"]), *(["nx", "ny", "nz", "value_mm"] if sided else [])]
    lines, grown, centres = [",".join(["target", "time_s", *names])], 1 + cte * 1e-6 * (degC - 20), []
    for n in range(count):
        joints = rng.uniform([-60, -20, -40, -60, -110, -100], [60, 40, 10, 60, -60, 100])
        wrist = flange(joints)
        centre = (wrist @ [*probe, 1])[:3]
        centres.append(centre)
        way = rng.normal(size=3)
        way, pushed = way / np.linalg.norm(way), round(rng.uniform(0, 0.4), 4)
        place = centre + way * ((ball + sphere) / 2 - pushed) if sided else centre
        place = (np.linalg.inv(uframe) @ [*place, 1])[:3] / grown
        text += f'[[sphere]]\nname = "s{n}"\ndiameter_mm = {sphere!r}\n'
        text += "".join(f"{axis}_mm = {v!r}\n" for axis, v in zip("xyz", place.tolist(), strict=False))
        told = np.linalg.inv(uframe) @ wrist
        told[:3, 3] = (np.linalg.inv(uframe) @ [*centre, 1])[:3]
        row = (
            [f"{v:.7f}" for v in joints] if by_joints else [*(f"{v:.7f}" for v in numbers(told)), f'"{config(joints)}"']
        )
        lines.append(
            ",".join([f"s{n}", str(60 * n), *row, *((*(f"{v:.9f}" for v in way), f"{pushed}") if sided else ())])
        )
    change = str(rng.choice(["", "", "twice", "another name", *([] if sided else ["empty"])]))
    if change == "twice":
        lines.append(lines[1])
    elif change == "empty":
        lines[2] = lines[2].replace(",60,", ",,")
    elif change == "another name":
        lines[1] = lines[1].replace("s0,", "s9,")
    (folder / "artefact.toml").write_text(text)
    (folder / "touches.csv").write_text("\n".join(lines) + "\n")
    place = {3: Pose(uframe[:3, 3] * MM, uframe[:3, :3])}

    def judge():
        known = read_artefact(str(folder / "artefact.toml"))
        seen = read_touches(str(folder / "touches.csv"), M710, known, place, planes=True)
        word, targets, its_probe = naive.artefact(text)
        rows = naive.table("\n".join(lines))
        same(word == "world", in_world, "the frame", 0)
        same(known.place / MM, [t["place"] for t in targets.values()], "places", 1e-9)
        ours = flange_pose(M710, seen.theta)
        centre = (ours.position + ours.rotation @ known.probe) / MM
        for n, row in enumerate(rows):
            target = list(targets)[seen.target[n]]
            if target != row["target"]:
                raise WrongError("another target")
            told = naive.numbers_of(row, PENDANT if by_joints else naive.POSE)
            its = (flange(told) @ [*probe, 1])[:3] if by_joints else (uframe @ [*told[:3], 1])[:3]
            same(centre[n], its, "the probe's centre", 1e-4)
            same(naive.gap(row, targets[target], its_probe, its, uframe), 0.0, "the surface", 2e-4)
            if sided:
                same(seen.normal[n], naive.numbers_of(row, ["nx", "ny", "nz"]), "the direction", 1e-12)
                same(seen.deflection[n] / MM, float(row["value_mm"] or 0), "the deflection", 1e-12)

    return change, judge


def poses(rng, folder):
    clock = str(rng.choice(["time_s", "order", ""]))
    turned = rng.random() < 0.4
    head = [
        *([clock] if clock else []),
        "target",
        *PENDANT,
        "x_mm",
        "y_mm",
        "z_mm",
        *(["rx_deg", "ry_deg", "rz_deg"] * turned),
    ]
    rows = []
    for n in rng.permutation(9) if clock else range(9):
        joints = rng.uniform([-100, -40, -60, -300, -120, -300], [100, 60, 40, 300, 120, 300])
        for name in ("a", "b"):
            values = [*joints, *rng.uniform(-2e3, 2e3, 3), *(rng.uniform(-170, 170, 3) if turned else ())]
            rows.append([*([f"{n * 20.0}"] if clock else []), name, *(f"{v:.6f}" for v in values)])
    change = str(rng.choice(["", "", "nan", "twice", "short", "decimal comma"]))
    lines = [",".join(row) for row in rows]
    if change == "nan":
        lines[4] = lines[4].replace(rows[4][-1], "nan")
    elif change == "twice":
        lines.append(lines[3])
    elif change == "short":
        lines[5] = lines[5].rpartition(",")[0]
    elif change == "decimal comma":
        lines = [line.replace(".", ",") for line in lines]
    text = "\n".join(["# a remark", ",".join(head), *lines]) + "\n"
    (folder / "poses.csv").write_text(text)

    def judge():
        data = read_poses(str(folder / "poses.csv"), M710, 0)
        rows = naive.table(text)
        pendant = M710.to_pendant(data.theta[data.pose]) / DEG
        same(pendant, [naive.numbers_of(r, PENDANT) for r in rows], "joints", 1e-9)
        same(data.position / MM, [naive.numbers_of(r, ["x_mm", "y_mm", "z_mm"]) for r in rows], "places", 1e-9)
        if [data.reflectors[k] for k in data.reflector] != [r["target"] for r in rows]:
            raise WrongError("targets read otherwise")
        if turned:
            its = [naive.rotation(naive.numbers_of(r, ["rx_deg", "ry_deg", "rz_deg"])) for r in rows]
            same(data.rotation, its, "turns", 1e-9)
        if clock:
            same(data.time[data.pose], [float(r[clock]) for r in rows], "times", 1e-9)

    return change, judge


def distances(rng, folder):
    head = ["time_s", *(f"a_{n}" for n in PENDANT), *(f"b_{n}" for n in PENDANT), "distance_mm"]
    low, high = [-100, -40, -60, -300, -120, -300], [100, 60, 40, 300, 120, 300]
    lines = [
        ",".join(
            f"{v:.6f}" for v in [30.0 * n, *rng.uniform(low, high), *rng.uniform(low, high), rng.uniform(50, 3000)]
        )
        for n in range(12)
    ]
    change = str(rng.choice(["", "", "below zero", "half an end"]))
    if change == "below zero":
        lines[2] = re.sub(r",([^,]*)$", r",-\1", lines[2])
    elif change == "half an end":
        parts = lines[3].split(",")
        lines[3] = ",".join([*parts[:9], "", *parts[10:]])
    text = "\n".join([",".join(head), *lines]) + "\n"
    (folder / "distances.csv").write_text(text)

    def judge():
        data = read_distances(str(folder / "distances.csv"), M710, 0)
        rows = naive.table(text)
        assert data.ends is not None
        for end, pose in (("a_", data.pose), ("b_", data.ends.pose)):
            its = [naive.numbers_of(r, [end + n for n in PENDANT]) for r in rows]
            same(M710.to_pendant(data.theta[pose]) / DEG, its, f"joints of {end}", 1e-9)
        same(data.ends.distance / MM, [float(r["distance_mm"]) for r in rows], "distances", 1e-9)
        if min(float(r["distance_mm"]) for r in rows) <= 0:
            raise WrongError("a distance below zero")

    return change, judge


def log(rng, folder):
    names = [list(naive.POSE), list(PENDANT), [*PENDANT, *naive.POSE]][rng.integers(3)]
    head = ["time_s", *rng.permutation([*names, "speed"])]
    t, rows = rng.uniform(-1e4, 1e4), []
    values = rng.uniform(-100, 100, len(head) - 1)
    for _ in range(40):
        t, values = t + rng.choice([0.008, 0.008, 0.016]), values + rng.normal(size=len(values))
        gap = rng.random() < 0.1
        rows.append(
            [
                f"{t:.4f}",
                *("" if gap and name != "speed" else f"{v:.4f}" for name, v in zip(head[1:], values, strict=False)),
            ]
        )
    change = str(rng.choice(["", "", "half a row", "back", "twice a column"]))
    if change == "half a row":
        k = head.index("x_mm" if "x_mm" in names else "j1_deg")
        rows[7] = [f"{v}" if v else "1.0" for v in rows[7]]
        rows[7][k] = ""
    elif change == "back":
        rows[20][0] = f"{float(rows[20][0]) - 1:.4f}"
    elif change == "twice a column":
        head[1] = head[2]
    text = "\n".join([",".join(head), *(",".join(row) for row in rows)]) + "\n"
    (folder / "log.csv").write_text(text)

    def judge():
        ours = read_position_log(folder / "log.csv")
        names, its = naive.log(text)
        same(list(ours.columns) == names, True, "columns", 0)
        unit = [DEG] * 6 if names == PENDANT else [MM] * 3 + [DEG] * 3
        same(ours.time, [t for t, _ in its], "times", 1e-9)
        same(ours.numbers / unit, [v for _, v in its], "positions", 1e-9)

    return change, judge


def _correlations(rng, count):
    A = rng.normal(size=(count, count + 2))
    C = A @ A.T
    size = np.sqrt(np.diag(C))
    return [[*np.round(row[:i], 7).tolist(), 1] for i, row in enumerate(C / np.outer(size, size))]


def state(rng, folder):
    nodes = list(rng.permutation(["j2", "link1", "j3", "wrist", "face"]))[: rng.integers(1, 6)]
    drifting = list(rng.permutation(["joint_zeros.offset_mdeg[2]", "link_offsets.a_um[3]"]))[: rng.integers(0, 3)]
    change = str(rng.choice(["", "", "a node twice", "a row less", "a sigma below zero", "kelvin"]))
    if change == "a node twice":
        nodes.append(nodes[0])
    K, X = len(nodes), len(nodes) + 6 + len(drifting)
    rise = rng.uniform(-5, 15, K) + 293 * (change == "kelvin")
    sigma = rng.uniform(0.1, 30, X) * np.where(np.arange(X) == X // 2, -1 if change == "a sigma below zero" else 1, 1)
    text = f"correlation = {json.dumps(_correlations(rng, X)[: X - (change == 'a row less')])}\n"
    text += '[state]\nverdict = "anchored"\ntime_s = 1.0\nwindow_s = 2.0\nair_K = 0.5\nheat_model = "nodes"\n'
    text += f"[rise]\nnode = {json.dumps(list(map(str, nodes)))}\nK = {rise.tolist()}\nsigma_K = {sigma[:K].tolist()}\n"
    text += f"[base]\nshift_um = {rng.normal(0, 50, 3).tolist()}\nturn_mdeg = {rng.normal(0, 5, 3).tolist()}\n"
    text += f"sigma_um = {sigma[K : K + 3].tolist()}\nsigma_mdeg = {sigma[K + 3 : K + 6].tolist()}\n"
    for name, s in zip(drifting, sigma[K + 6 :].tolist(), strict=False):
        text += f'[[drifting]]\nparameter = "{name}"\nchange = {rng.normal()!r}\nsigma = {s!r}\n'
    text += f'[made_from]\nrobot_file = "{"0" * 64}"\n'

    def judge():
        ours = parse_state(text.encode(), "state.toml")
        names, values, covariance = naive.state(text)
        if [*ours.nodes, *ours.drifting] != [n for n in names if not n.startswith(("shift", "turn"))]:
            raise WrongError("names read otherwise")
        unit = np.array([1.0] * K + [UM] * 3 + [MDEG] * 3 + [1.0] * len(drifting))
        same(np.concatenate([ours.rise, ours.base, ours.drift]) / unit, values, "values", 1e-9)
        same(ours.covariance / np.outer(unit, unit), covariance, "covariance", 1e-7)

    return change, judge


def posterior(rng, folder):
    count = int(rng.integers(2, 12))
    units = rng.choice([UM, MDEG, 1.0], count)
    known = [KnownParameter("joint_zeros", "offset", (k,), "offset_mdeg", u) for k, u in enumerate(units.tolist())]
    values = [float(f"{v:.9g}") for v in rng.normal(size=count)]
    numbers = {p.name: (p, v * p.unit) for p, v in zip(known, values, strict=False)}
    order = rng.permutation(count)
    rows = [{"name": known[k].name, "value": values[k], "sigma": float(rng.uniform(0, 3))} for k in order]
    lower = _correlations(rng, count)
    change = str(rng.choice(["", "", "another value", "a name twice", "a row less", "a diagonal"]))
    if change == "another value":
        rows[0]["value"] += 1e-3
    elif change == "a name twice":
        rows[1] = dict(rows[0])
    elif change == "a row less":
        lower.pop()
    elif change == "a diagonal":
        lower[1][1] = 0.5
    data = json.dumps({"robot": "x", "parameters": rows, "correlation": lower}).encode()

    def judge():
        ours = read_posterior(data, numbers, "x.posterior.json")
        names, its, covariance = naive.posterior(data)
        if [p.name for p in ours.parameters] != names:
            raise WrongError("names read otherwise")
        unit = np.array([p.unit for p in ours.parameters])
        same(ours.value / unit, its, "values", 1e-8)
        same(ours.covariance / np.outer(unit, unit), covariance, "covariance", 1e-9)

    return change, judge


#: what two sets of places are called, each with the other
SETS = (
    ("Nominal", "Actual"), ("Soll", "Ist"), ("Measured", "Nominal"), ("Sollwerte", "Messwerte"), ("THEO", "MEAS"),
    ("Nominal values", "Measured values"), ("Deviation", "Actual"),
)  # fmt: skip


def exports(rng, folder):
    """Poses as an instrument's software exports them: titles, two header rows, units below, sums behind."""
    comma = bool(rng.random() < 0.5)
    delimiter, encoding = str(rng.choice([";", "\t"])), str(rng.choice(["utf-8", "utf-8-sig", "utf-16", "utf-16-le"]))
    sets = SETS[int(rng.integers(len(SETS)))] if rng.random() < 0.7 else ("",)
    merged, unit_row, end = rng.random() < 0.7, rng.random() < 0.5, str(rng.choice(["\n", "\r\n"]))
    places = [f"{axis}{'' if unit_row else ' [mm]'}" for _ in sets for axis in "XYZ"]
    head = ["Name", *places, *(f"J{n}{'' if unit_row else ' (deg)'}" for n in range(1, 7)), "RMS"]
    joints = rng.uniform([-100, -40, -60, -300, -120, -300], [100, 60, 40, 300, 120, 300], (8, 6))
    values = rng.uniform(-2e3, 2e3, (8, 3 * len(sets)))

    def cells(numbers):
        grouped = [f"{v:,.{digits}f}" for v, digits in zip(numbers, [4] * len(numbers), strict=True)]
        return [cell.translate(str.maketrans(",.", ".,")) if comma else cell for cell in grouped]

    lines = [["Report 5"], ["Operator", "N. N."]][: int(rng.integers(3))]
    if sets != ("",):
        lines.append(["", *(cell for name in sets for cell in [name, *["" if merged else name] * 2]), *[""] * 7])
    lines.append(head)
    if unit_row:
        lines.append(["", *["mm"] * len(places), *["deg"] * 6, ""])
    above = len(lines)
    lines += [[f"r{n % 2}", *cells([*values[n], *joints[n]]), "0"] for n in range(8)]
    sums = [["Mean"], ["Std.Dev."], ["Max"]][: int(rng.integers(4))]
    lines += [[*name, *cells([*values.mean(axis=0), *joints.mean(axis=0)]), "0"] for name in sums]
    which = int(rng.integers(len(sets))) if "Deviation" not in sets else 1
    says = "" if sets == ("",) else ", ".join(f'{axis}_mm = "#{2 + 3 * which + k}"' for k, axis in enumerate("xyz"))
    change = str(rng.choice(["", "", "nobody says which", "a letter"])) if says else str(rng.choice(["", "a letter"]))
    if change == "a letter":
        lines[above + 3][2] += "O"
    data = end.join(delimiter.join(line) for line in lines).encode(encoding)
    (folder / "exports.csv").write_bytes(data)
    if says and change != "nobody says which":
        (folder / "exports.csv.toml").write_text(f"columns = {{ {says} }}\n")

    def judge():
        read = read_poses(str(folder / "exports.csv"), M710, 0)
        if change == "nobody says which":
            raise WrongError("one of two sets taken without a word")
        columns = [*range(1 + 3 * which, 4 + 3 * which), *range(1 + len(places), 7 + len(places))]
        its = np.array(naive.told(data, encoding, delimiter, above, 8, columns, comma))
        same(read.position / MM, its[:, :3], "places", 1e-9)
        same(M710.to_pendant(read.theta[read.pose]) / DEG, its[:, 3:], "joints", 1e-9)

    return change, judge


KINDS = {f.__name__: f for f in (stl, urdf, touches, poses, distances, log, state, posterior, exports)}


def tried(seed: int) -> dict:
    """A row of the journal: what became of a file of each kind."""
    wrong: list[str] = []
    row = {"seed": seed, "wrong": wrong}
    for number, (kind, draw) in enumerate(KINDS.items()):
        with tempfile.TemporaryDirectory() as folder:
            change, judge = draw(np.random.default_rng([seed, number]), Path(folder))
            try:
                judge()
                row[kind] = "same"
            except InputError as refusal:
                row[kind] = "refused"
                if not change:
                    wrong.append(f"{kind}: refused: {refusal}"[:300])
                if "\n" in str(refusal) or len(str(refusal)) > 300 + 2 * len(folder):
                    wrong.append(f"{kind}, {change}: not one line of 300: {refusal}")
            except (WrongError, ValueError, KeyError) as difference:
                row[kind] = "wrong"
                wrong.append(f"{kind}, {change or 'not changed'}: {difference}")
    return row


def is_open(words: str) -> bool:
    """Whether something wrong is known."""
    return any(f", {change}:" in words for change in OPEN)


def table(rows: list[dict]) -> str:
    """Counts of each kind, and whatever is wrong."""
    lines = [f"seeds {seed_journal.ranges_of(row['seed'] for row in rows)}: {len(rows)} files of each kind"]
    for kind in KINDS:
        counts = Counter(row[kind] for row in rows)
        lines.append(f"  {kind}: " + ", ".join(f"{counts[word]} {word}" for word in ("same", "refused", "wrong")))
    return "\n".join([*lines, *(f"  {row['seed']}: {words}" for row in rows for words in row["wrong"])])


def main() -> int:
    """Try the seeds that the journal has not, and print the table of all."""
    given = seed_journal.parser("user_files", __doc__, "0:200").parse_args()
    if not given.table:
        given.journal.keep_trials(given.seeds, given.budget, tried)
    rows = given.journal.rows(given.seeds)
    return seed_journal.conclude(
        "user_files.py", rows, table(rows), lambda row: any(not is_open(words) for words in row["wrong"])
    )


if __name__ == "__main__":
    sys.exit(main())
