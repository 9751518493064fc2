"""Random jobs through ``generate``, each judged from the text it wrote by an arm that shares nothing with the package.

python tests/campaigns/jobs.py --seeds 0:200            draws, judges and adds to jobs.jsonl; again goes on
python tests/campaigns/jobs.py --seeds 0:200 --table    only the table of what is in jobs.jsonl

A seed draws a pattern, its place, surface, edge, tool, posture, history and error sources of the M-710iC/50; four in
ten stand at an edge: a stretched arm, a joint's limit, a stretched wrist, an elbow that is down. The judge reads the
text with the second reader, finds the joints by CONFIG in closed form, warms and distorts its own DH chain as
docs/sources.md says, and compares the tool with the planned path: at every position and half way to the next. One job
in twenty goes through the command line in a process as well and must give the same bytes.
"""

import math
import random
import subprocess
import sys
import tempfile
import tomllib
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

import naive_arm  # noqa: E402
import naive_ls  # noqa: E402
import numpy as np  # noqa: E402
import seed_journal  # noqa: E402
from naive_arm import NOMINAL, chain  # noqa: E402
from naive_errors import MDEG, flange_poses, sides, torques, turned_joints  # noqa: E402
from naive_heat import ROBOT, rises_along, warm_lengths  # noqa: E402
from shipped import path_file, quiet  # noqa: E402
from shrinking import shrunk  # noqa: E402

import compgen.cli.blas_threads  # noqa: E402, F401  before numpy
from compgen.core.exceptions import CompgenError  # noqa: E402
from compgen.pipelines.files.path_file import load_job  # noqa: E402
from compgen.pipelines.planned import generate  # noqa: E402
from compgen.verification.deviation import statistics  # noqa: E402

APART_UM = 0.3  # judge and report, at their largest deviation: they sample different moments
APART = 0.02  # share of it
IN_A_PROCESS = 20  # every so many seeds
LIMITS = ("j1_deg", "j2_deg", "j2_plus_j3_deg", "j4_deg", "j5_deg", "j6_deg")
EDGES = ("reach", "limit", "wrist", "elbow")


# A job -----------------------------------------------------------------------------------------------------------


def drawn(seed: int) -> list[str]:
    """Overrides of the shipped circle."""
    rng = random.Random(seed)
    edge = edge_of(seed)
    number = rng.uniform
    size = math.exp(number(math.log(5), math.log(150))) if edge else number(60, 500)
    keys: dict[str, Any] = {  # numbers, words and tables of TOML
        "path.x_mm": round(number(700, 1700), 3),
        "path.y_mm": round(number(-700, 700), 3),
        "path.z_mm": round(number(-400, 800), 3),
        "process.feed_mm_s": round(math.exp(number(math.log(15), math.log(200))), 2),
        "process.chord_um": round(number(0.5, 10), 2),
        "process.lift_mm": rng.choice([0, 10, 20]),
    }
    pattern = rng.choice(["circle", "line", "spiral", "raster", "iso9283"])
    shape = {
        "circle": f'pattern="circle", diameter_mm={size}',
        "line": f'pattern="line", axis="{rng.choice("xyz")}", length_mm={size}',
        "spiral": f'pattern="spiral", diameter_mm={size}, turns={number(2, 6)}',
        "raster": f'pattern="raster", diameter_mm={size}, stepover_mm={size / number(3, 8)}, '
        f'turn="{rng.choice(["square", "smooth"])}"',
        "iso9283": f'pattern="iso9283", size_mm={size}',
    }[pattern]
    standing = at_edge(rng, edge) if edge else {}
    keys |= {k: standing.pop(k) for k in list(standing) if k in keys}
    where = ", ".join(f"{k.split('.')[1]}={keys.pop(k)}" for k in ("path.x_mm", "path.y_mm", "path.z_mm"))
    out = [f"path={{{shape}, {where}}}", *(f"{k}={v}" for k, v in keys.items())]
    if pattern in ("spiral", "raster") and rng.random() < 0.4:
        numbers = (
            f"radius_of_curvature_m={number(2, 40)}, conic_constant={number(-1.5, 0.5)}, off_axis_m={number(0, 1)}"
        )
        out.append(f'surface={{kind="conic", {numbers}}}')
    out += [f"{k}={v}" for k, v in standing.items()]
    if not edge and rng.random() < 0.7:
        tool = [number(-60, 60), number(-60, 60), number(20, 300)]
        tool += [number(-20, 20), number(-20, 20), number(-180, 180)] if rng.random() < 0.5 else [0, 0, 0]
        out += [
            f"tool.{k}={v:.3f}" for k, v in zip(("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg"), tool, strict=False)
        ]
    if not edge and rng.random() < 0.4:
        out.append(f"tool.spin_deg={number(-180, 180):.2f}")
    if not edge and rng.random() < 0.3:
        out.append(f'posture.wrist="{rng.choice(["flip", "no flip"])}"')
    if not edge and rng.random() < 0.1:
        out.append('posture.elbow="down"')
    if not edge and rng.random() < 0.05:
        out.append('posture.arm="back"')
    steps = [
        {"state": rng.choice(["moving", "idle", "off"]), "duration_h": round(number(0.1, 6), 2)}
        for _ in range(rng.randint(0, 3))
    ]
    words = [
        f'{{state="{s["state"]}", duration_h={s["duration_h"]}'
        + (f", feed_mm_s={number(20, 200):.1f}}}" if s["state"] == "moving" else "}")
        for s in steps
    ]
    out.append(f"before=[{', '.join(words)}]")
    out.append(f"robot.thermal.cte_um_m_K={number(9, 13):.3f}")
    return out + [f"robot.sources.{name}={text}" for name, text in drawn_sources(rng).items() if rng.random() < 0.4]


def edge_of(seed: int) -> str:
    """Which edge a seed's job stands at, or none."""
    rng = random.Random(f"edge {seed}")
    return rng.choice(EDGES) if rng.random() < 0.4 else ""


def at_edge(rng: random.Random, edge: str) -> dict[str, object]:
    """Place, tool and posture with which a vertical tool brings the arm near an edge, at drawn pendant angles [deg]."""
    number = rng.uniform
    q = [number(-150, 150), number(-40, 80), number(-50, 50), number(-150, 150), number(15, 100), number(-150, 150)]
    q[4] *= rng.choice((-1, 1))
    stretched = 90 - math.degrees(math.atan2(170, 1016))  # J2 + J3 of a straight arm
    match edge:
        case "reach":
            q[2] = stretched - q[1] - rng.choice((-1, 1)) * number(1, 20)
        case "elbow":
            q[1] = number(-60, 60)
            q[2] = number(stretched, 275) - q[1]
        case "wrist":
            q[4] = rng.choice((-1, 1)) * number(0.8, 5)
        case "limit":
            k = rng.randrange(6)
            low, high = ROBOT["limits"][LIMITS[k]]
            value = rng.choice((low + number(-0.2, 4), high - number(-0.2, 4)))
            q[k] = value - q[1] if k == 2 else value
    _, j2, j3, _, j5, _ = (math.radians(v) for v in q)
    pose = naive_arm.flange(q)
    tip = naive_arm.frame(number(-60, 60), number(-60, 60), number(20, 300), 0, 0, 0)
    place = (pose @ tip)[:3, 3]
    tip[:3, :3] = pose[:3, :3].T @ naive_arm.frame(0, 0, 0, 180, 0, 0)[:3, :3]
    keys: dict[str, object] = dict(
        zip(("path.x_mm", "path.y_mm", "path.z_mm"), np.round(place, 3).tolist(), strict=False)
    )
    names = ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg")
    keys |= {f"tool.{k}": v for k, v in zip(names, np.round(naive_arm.numbers(tip), 3).tolist(), strict=False)}
    out = 150 + 870 * math.sin(j2) + 1016 * math.cos(j3) - 170 * math.sin(j3)
    keys["posture.arm"] = '"front"' if out > 0 else '"back"'
    keys["posture.elbow"] = '"up"' if math.degrees(j2 + j3) < stretched else '"down"'
    keys["posture.wrist"] = '"flip"' if j5 > 0 else '"no flip"'
    return keys


def drawn_sources(rng: random.Random) -> dict[str, str]:
    def vector(size: float, count: int = 6) -> str:
        return f"[{', '.join(f'{rng.gauss(0, size):.4f}' for _ in range(count))}]"

    def matrix(size: float, count: int) -> str:
        return f"[{', '.join(vector(size, count) for _ in range(6))}]"

    stiffness = [abs(rng.gauss(0, s)) for s in (0.4, 0.4, 0.5, 2, 2, 4)]
    waves = rng.randint(1, 3)
    return {
        "thermal_growth": f"{{excess_a={vector(0.1)}, excess_d={vector(0.1)}}}",
        "link_offsets": f"{{d_um={vector(100)}, a_um={vector(100)}, alpha_mdeg={vector(10)}, beta_mdeg={vector(5)}}}",
        "joint_zeros": f"{{offset_mdeg={vector(15)}}}",
        "joint_coupling": f"{{ratio_ppm={matrix(40, 6)}}}",
        "compliance": f"{{compliance_urad_Nm={stiffness}}}",
        "gear_harmonics": f"{{sine_mdeg={matrix(1.5, 2)}, cosine_mdeg={matrix(1, 2)}, cycles=[1, 1, 1, 2, 1, 1]}}",
        "joint_ripple": f"{{order={rng.sample(range(3, 20), waves)}, sine_mdeg={matrix(1, waves)}, "
        f"cosine_mdeg={matrix(1, waves)}}}",
        "hysteresis": f"{{backlash_mdeg=[0.5, 0.4, 0.5, 1, 1, 1], windup_urad_Nm={[s / 400 for s in stiffness]}, "
        "width_mdeg=[600, 600, 600, 600, 600, 600]}",
        "base_frame": f"{{position_um={vector(200, 3)}, rotation_mdeg={vector(10, 3)}}}",
        "tool_frame": f"{{position_um={vector(100, 3)}, rotation_mdeg={vector(20, 3)}}}",
        "thermal_shift": '{of=["tool", "fixture x", "fixture z"], node=["face", "j2", "wrist"], '
        f"rate_um_K={vector(2, 3)}}}",
        "thermal_bend": '{link=["column", "a1", "a2", "d4", "a3"], '
        f'plane=["{rng.choice("xy")}", "side", "arm", "{rng.choice(["arm", "side"])}", "twist"], '
        'node=["face", "j2", "j3", "wrist", "j2"], '
        f"rate_arcsec_K={vector(1, 5)}, column_mm={rng.choice([0, 565])}}}",
        "map": f"[{', '.join(drawn_map(rng, axis) for axis in rng.sample('xyz', rng.randint(1, 3)))}]",
        "loads": "{link_kg=[120, 70, 80, 25, 15, 5], link_centre_mm=[[75, 0, -150], [20, 10, 400], [100, 0, 120], "
        "[300, 0, 0], [60, 0, 0], [20, 0, 0]], payload_kg=34, payload_centre_mm=[10, 0, 150], "
        f"force_N={vector(50, 3)}}}",
    }


def drawn_map(rng: random.Random, axis: str) -> str:
    """A line of stations that holds most of what the pattern reaches, with smooth errors."""
    count = rng.randint(2, 9)
    station = np.linspace(-900, 900, count) + (900 if axis == "x" else 0)
    waves = [[rng.gauss(0, 80), rng.uniform(0, 4), rng.gauss(0, 25)] for _ in range(3)]
    forward = [[round(a * math.sin(s / 900 + p), 3) for a, p, _ in waves] for s in station]
    reverse = [[round(v + h, 3) for v, (_, _, h) in zip(row, waves, strict=False)] for row in forward]
    return (
        f'{{axis="{axis}", at_mm=[900, 0, 0], station_mm={station.round(3).tolist()}, forward_um={forward}, '
        f"reverse_um={reverse}, width_mm={rng.uniform(5, 40):.2f}}}"
    )


# The judge -------------------------------------------------------------------------------------------------------


def off_by_maps(tables: list[dict], nominal: np.ndarray) -> np.ndarray:
    """What measured lines add (N, 3) [mm] where the controller believes the tool to be (N, 3) [mm]."""
    step = np.diff(nominal, axis=0)
    length = np.linalg.norm(step, axis=1)
    off = np.zeros_like(nominal)
    for table in tables:
        k = "xyz".index(table["axis"])
        travel = [0.0]
        for way, whole in zip(step[:, k], length, strict=False):
            keep = math.exp(-whole / table.get("width_mm", 10.0))
            travel.append(keep * travel[-1] + ((1 - keep) * way / whole if whole else 0))
        station = np.array(table["station_mm"])
        at = np.clip(nominal[:, k], station[0], station[-1])
        for axis in range(3):
            f, r = (natural_spline(station, np.array(table[key])[:, axis], at) for key in ("forward_um", "reverse_um"))
            off[:, axis] += ((f + r) / 2 + np.array(travel) * (f - r) / 2) / 1000
    return off


def natural_spline(x: np.ndarray, y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """A cubic spline without curvature at its ends, by its second derivatives m at the stations."""
    h, n = np.diff(x), len(x)
    K, b = np.eye(n), np.zeros(n)
    for i in range(1, n - 1):
        K[i, i - 1 : i + 2] = h[i - 1] / 6, (h[i - 1] + h[i]) / 3, h[i] / 6
        b[i] = (y[i + 1] - y[i]) / h[i] - (y[i] - y[i - 1]) / h[i - 1]
    m = np.linalg.solve(K, b)
    k = np.clip(np.searchsorted(x, at) - 1, 0, n - 2)
    right, left = at - x[k], x[k + 1] - at
    cubic = (m[k] * left**3 + m[k + 1] * right**3) / (6 * h[k])
    return cubic + (y[k] / h[k] - m[k] * h[k] / 6) * left + (y[k + 1] / h[k] - m[k + 1] * h[k] / 6) * right


def tool_poses(theta: np.ndarray, rise: dict, cte: float, sources: dict, tool: np.ndarray) -> np.ndarray:
    """Where the real tool is, (N, 4, 4) [mm]: docs/sources.md."""
    lengths = warm_lengths(rise, cte)
    growth = np.column_stack([np.broadcast_to(lengths[k] - NOMINAL[k], len(theta)) for k in NOMINAL])
    lash = sources.get("hysteresis")
    side = sides(theta, MDEG * np.array(lash["width_mdeg"])) if lash else np.zeros_like(theta)
    real = theta + turned_joints(theta, torques(theta, sources.get("loads", {}), tool), side, sources)
    poses = flange_poses(real, rise, growth, sources) @ tool
    if "map" in sources:
        poses[:, :3, 3] += off_by_maps(sources["map"], (chain(theta)[-1] @ tool)[:, :3, 3])
    return poses


@dataclass
class Driven:
    """A text as the judge drives it."""

    pose: np.ndarray  # (M, 4, 4) [mm] of the real tool, at each position and half way to the next
    joints: np.ndarray  # (M, 6) [rad] pendant
    speed: np.ndarray  # (N - 1,) [mm/s]


def drive(text: bytes, tables: dict) -> Driven:
    """What the real arm makes of a program."""
    positions, moves = naive_ls.read(text)
    groups = [positions[int(m.targets[0][2:-1].split(":")[0])].groups[1] for m in moves]
    wanted = np.array([naive_arm.frame(*(g.axes[k] for k in "XYZWPR")) for g in groups])
    tool = naive_arm.frame(
        *(tables.get("tool", {}).get(k, 0.0) for k in ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg"))
    )
    speed = np.array([naive_ls.mm_s(m.speed) for m in moves[1:]])
    assert moves[0].letter == "J"
    assert all(m.letter == "L" for m in moves[1:])
    half = 0.5 * (wanted[1:] + wanted[:-1])
    u, _, v = np.linalg.svd(half[:, :3, :3])
    half[:, :3, :3] = u @ v
    every = np.empty((2 * len(wanted) - 1, 4, 4))
    every[::2], every[1::2] = wanted, half
    config = [groups[n // 2].config for n in range(len(every))]
    joints = naive_arm.joints_by_config(every @ np.linalg.inv(tool), config)
    step = joints[1::2] - joints[:-1:2]  # turn digits are those of positions; half way on no joint has turned far
    joints[1::2] = joints[:-1:2] + (step + np.pi) % (2 * np.pi) - np.pi
    theta = naive_arm.dh_angles(joints)
    length = np.linalg.norm(np.diff(wanted[:, :3, 3], axis=0), axis=1)
    before = [(s["state"], s.get("feed_mm_s", 0.0), s["duration_h"]) for s in tables.get("before", [])]
    rise = rises_along(before, np.repeat(0.5 * length / speed, 2), np.repeat(speed, 2))
    robot = tables["robot"]
    pose = tool_poses(theta, rise, robot["thermal"]["cte_um_m_K"], robot.get("sources", {}), tool)
    return Driven(pose, joints, speed)


def from_polyline(point: np.ndarray, path: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Distance (M,) of points from a polyline, on the segments about their rows."""
    best = np.full(len(point), np.inf)
    for step in (-1, 0, 1):
        n = np.clip(rows + step, 0, len(path) - 2)
        a, way = path[n], path[n + 1] - path[n]
        share = ((point - a) * way).sum(axis=1) / np.maximum((way**2).sum(axis=1), 1e-18)
        best = np.minimum(best, np.linalg.norm(a + np.clip(share, 0, 1)[:, None] * way - point, axis=1))
    return best


# Judging ---------------------------------------------------------------------------------------------------------


def tables_of(overrides: list[str]) -> dict:
    """What a job's overrides say, as nested tables."""
    return tomllib.loads("\n".join(overrides))


def judged(overrides: list[str], written: Callable[[bytes], None] = lambda text: None) -> tuple[str, str]:
    """``inside``, ``outside``, ``refused`` or ``wrong``, and why; what was written is handed on."""
    try:
        job = load_job(path_file("circle_1300"), overrides=overrides)
        planned, corrected = generate.generate(job, quiet)
    except CompgenError as exception:
        kind = "wrong" if exception.exit_code == 2 else "refused"  # whatever is drawn is well said
        return kind, f"{type(exception).__name__}: {exception}"
    except Exception:
        return "wrong", traceback.format_exc()
    written(corrected.text)
    path = planned.path
    tables = tables_of(overrides)
    driven = drive(corrected.text, tables)
    target = 1000 * np.asarray(path.target.position)
    if len(driven.pose) != 2 * len(target) - 1:
        return "wrong", f"{len(target)} waypoints, {len(driven.pose)} samples in the text"
    largest = largest_um(driven, tables, target, path.contact)
    reported = statistics(corrected.deviation)["total"]["max_um"]
    uncorrected = statistics(planned.deviation())["total"]["max_um"]
    numbers = f"judge {largest:.3f} um, report {reported:.3f} um, before {uncorrected:.0f} um"
    if largest > reported * (1 + APART) + APART_UM:
        return "wrong", f"worse than told: {numbers}"
    assert job.bounds.max is not None  # the shipped circle has one
    if corrected.inside and largest > 1e6 * job.bounds.max + APART_UM:
        return "wrong", f"inside and yet beyond its bounds: {numbers}"
    limits = ROBOT["limits"]
    angle = np.degrees(driven.joints)
    angle[:, 2] += angle[:, 1]
    for k, name in enumerate(LIMITS):
        if angle[:, k].min() < limits[name][0] - 1e-3 or angle[:, k].max() > limits[name][1] + 1e-3:
            return "wrong", f"{name} beyond its limits: {angle[:, k].min():.3f} to {angle[:, k].max():.3f}"
    if driven.speed.max() > 1000 * planned.feed * 1.01:
        return "wrong", f"faster than the feed: {driven.speed.max():g} mm/s"
    planned_off = from_pattern(tables["path"], target[path.contact])
    if planned_off is not None and planned_off.max() > 1e-6:
        return "wrong", f"the path is off its pattern: {planned_off.max():g} mm"
    return ("inside" if corrected.inside else "outside"), numbers


def largest_um(driven: Driven, tables: dict, target: np.ndarray, contact: np.ndarray) -> float:
    """Largest distance [um] on the part: from its own target at positions, from the path half way between them."""
    rows = np.arange(len(driven.pose)) // 2
    at_position = np.arange(len(rows)) % 2 == 0
    tool = driven.pose[:, :3, 3]
    exact = from_pattern(tables["path"], tool)
    off = from_polyline(tool, target, rows) if exact is None else exact
    off = np.where(at_position, np.linalg.norm(tool - target[rows], axis=1), off)
    part = contact[rows] & contact[np.minimum(rows + ~at_position, len(target) - 1)]
    return 1000 * float(off[part].max())


def from_pattern(table: dict, point: np.ndarray) -> np.ndarray | None:
    """Distance (M,) [mm] of points from a circle or a line; None for the other patterns."""
    x, y, z = point.T - np.array([[table["x_mm"]], [table["y_mm"]], [table["z_mm"]]])
    match table["pattern"]:
        case "circle":
            return np.hypot(np.hypot(x, y) - table["diameter_mm"] / 2, z)
        case "line":
            a, b = (way for axis, way in (("x", x), ("y", y), ("z", z)) if axis != table["axis"])
            return np.hypot(a, b)
    return None


def smallest(overrides: list[str], reason: str) -> list[str]:
    """Fewest of the overrides that are wrong for a reason that begins alike."""
    kept = [o for o in overrides if o.startswith(("path=", "before=", "robot.thermal"))]

    def fails(others: list[str]) -> bool:
        result, why = judged(kept + others)
        return result == "wrong" and why.split(":")[0] == reason.split(":")[0]

    return kept + shrunk([o for o in overrides if o not in kept], fails)


def in_a_process(overrides: list[str]) -> tuple[int, str, bytes | None]:
    """Exit code, the error stream and the program of the same job through the command line."""
    with tempfile.TemporaryDirectory() as folder:
        settings = [word for o in overrides for word in ("--set", o)]
        command = [
            sys.executable,
            "-m",
            "compgen",
            "generate",
            str(path_file("circle_1300")),
            "-q",
            "--force",
            *settings,
        ]
        run = subprocess.run([*command, "-o", f"{folder}/out"], cwd=ROOT, capture_output=True, text=True, check=False)
        programs = sorted(Path(folder).glob("out/*.LS"))
        return run.returncode, run.stderr, programs[0].read_bytes() if programs else None


# Telling ---------------------------------------------------------------------------------------------------------


def tried(seed: int) -> dict:
    """A row of the journal."""
    overrides = drawn(seed)
    text: list[bytes] = []
    result, reason = judged(overrides, text.append)
    row = {"seed": seed, "edge": edge_of(seed), "result": result, "reason": reason, "process": seed % IN_A_PROCESS == 0}
    if result == "wrong":
        return row | {"overrides": smallest(overrides, reason)}
    if row["process"]:
        code, said, program = in_a_process(overrides)
        if code not in {"inside": (0,), "outside": (1,), "refused": (2, 3)}[result] or program != (
            text[0] if text else None
        ):
            same = "same" if [program] == text else "other"
            return row | {"result": "wrong", "reason": f"in a process: exit {code}, {same} bytes: {said[:300]}"}
    return row


def table(rows: list[dict]) -> str:
    """Counts by edge, and whatever is wrong."""
    kinds = ("inside", "outside", "refused", "wrong")
    lines = [f"seeds {seed_journal.ranges_of(row['seed'] for row in rows)}, "
             f"{sum(row['process'] for row in rows)} of them in a process too"]  # fmt: skip
    for edge in ("", *EDGES, None):
        counts = Counter(row["result"] for row in rows if edge is None or row["edge"] == edge)
        name = {"": "no edge", None: "all"}.get(edge, edge)
        lines.append(f"{name:<8} tried {counts.total():5}, " + ", ".join(f"{k} {counts[k]}" for k in kinds))
    return "\n".join([*lines, *(f"  {r['seed']}: {r['reason']}" for r in rows if r["result"] == "wrong")])


def main() -> int:
    """Try the seeds that the journal has not, and print the table of all."""
    given = seed_journal.parser("jobs", __doc__, "0:10").parse_args()
    for seed in () if given.table else given.journal.left(given.seeds, given.budget):
        row = tried(seed)
        given.journal.add(row)
        print(seed, row["edge"], row["result"], row["reason"], *row.get("overrides", []), flush=True)
    rows = given.journal.rows(given.seeds)
    return seed_journal.conclude("jobs.py", rows, table(rows), lambda row: row["result"] == "wrong")


if __name__ == "__main__":
    sys.exit(main())
