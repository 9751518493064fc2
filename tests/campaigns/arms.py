"""Arms that nobody tuned to: drawn from a wider family than the model, measured cold and warm, identified, flown.

python tests/campaigns/arms.py --seeds 0:20                 a row for each arm, then the table; again goes on
python tests/campaigns/arms.py --seeds 0:20 --log none      without temperatures; ``j2,link1,j3`` for some sensors only
python tests/campaigns/arms.py --seeds 0:20 --table         only the table of what is in arms.jsonl

60 cold poses x 3 reflectors, a warm-up of 6 h with 120 poses x 3, a log of five nodes, 25 um of noise a coordinate, 1 %
wild; no file names its instrument. What the robot file predicts is judged on poses never seen: cold, after 2 h and 6 h
of another program, which heats each node by 15 % more or less, and 2 h of cooling after it.
"""

import argparse
import json
import sys
import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "campaigns")]

import casadi as ca  # noqa: E402
import numpy as np  # noqa: E402
from shipped import quiet  # noqa: E402
from wider_arm import BENDS, CENTRE, MASS, NODES, PAYLOAD, PAYLOAD_CENTRE, WiderArm  # noqa: E402

import compgen.cli.blas_threads  # noqa: E402, F401
from compgen.core.evaluation import evaluate  # noqa: E402
from compgen.core.pose import Pose  # noqa: E402
from compgen.identification.identify import identify  # noqa: E402
from compgen.identification.model import SymbolicSource, build_model  # noqa: E402
from compgen.pipelines.files.robot_file import arm_of, load_arm  # noqa: E402
from compgen.pipelines.measure.fitted_law import with_law_of  # noqa: E402
from compgen.pipelines.measure.identification_files import MeasurementFiles, identified_robot_text, read_measurements  # noqa: E402
from compgen.robot.inverse_kinematics import Posture  # noqa: E402
from compgen.robot.joint_path import follow_branch  # noqa: E402

JOURNAL = ROOT / "tests" / "campaigns" / "arms.jsonl"
NOISE = 25e-6
PRISM = np.array([[60, 10, 120], [-50, 40, 150], [5, -60, 180]]) * 1e-3
LOW, HIGH = np.radians([-60, -30, -60, -120, -110, -150]), np.radians([60, 60, 30, 120, 110, 150])
HEAD = "time_s,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm"
LOADS = f"""
[sources.loads]
link_kg = {MASS.tolist()}
link_centre_mm = {(CENTRE * 1e3).tolist()}
payload_kg = {PAYLOAD}
payload_centre_mm = {(PAYLOAD_CENTRE * 1e3).tolist()}
"""


def robot_file(folder, drop=""):
    """The shipped arm with what it carries, and no table of any error."""
    file = Path(folder) / "nominal.toml"
    text = (ROOT / "robots" / "m710ic50.toml").read_text()
    assert drop in text
    file.write_text(text.replace(drop, "") + LOADS)
    return str(file)


def drawn_poses(robot, rng, count):
    """Pendant angles in front of the arm, J5 away from zero, inside the limits."""
    poses = list[np.ndarray]()
    while len(poses) < count:
        pendant = rng.uniform(LOW, HIGH)
        theta = robot.to_theta(pendant[None])[0]
        if (theta > robot.lower).all() and (theta < robot.upper).all() and abs(pendant[4]) > np.radians(10):
            poses.append(pendant)
    return np.array(poses)


class Site:
    """An arm, the instrument beside it, and the prisms on its flange."""

    def __init__(self, seed, robot):
        self.arm, self.robot = WiderArm(seed), robot
        rng = np.random.default_rng([seed, 3])
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        self.turn, self.origin = turn * np.sign(np.linalg.det(turn)), rng.uniform(-3, 3, 3)

    def places(self, pendant, rise, rng, points=PRISM):
        """Of the prisms in World, (M, R, 3) [m]; each joint comes from the pose before."""
        q = self.robot.to_theta(pendant)
        side = np.sign(np.vstack([q[0] * 0, np.diff(q, axis=0)]))
        T = self.arm.flange(q, rise, side, rng)
        return T[:, None, :3, 3] + np.einsum("mij,rj->mri", T[:, :3, :3], points)

    def measured(self, pendant, rise, rng):
        """By the instrument, with noise, (M, R, 3) [m]."""
        places = self.places(pendant, rise, rng) @ self.turn.T + self.origin
        return places + rng.normal(0, NOISE, places.shape)


def pose_csv(pendant, places, clock):
    """A pose file."""
    rows = [HEAD]
    for q, triple, t in zip(np.degrees(pendant), places * 1e3, clock, strict=False):
        for name, p in zip(("r1", "r2", "r3"), triple, strict=False):
            rows.append(",".join([f"{t:.1f}", name, *(f"{v:.6f}" for v in q), *(f"{v:.4f}" for v in p)]))
    return "\n".join(rows) + "\n"


def wild(places, rng):
    """Some readings pushed away."""
    rows = rng.choice(
        places.shape[0] * places.shape[1], max(1, places.shape[0] * places.shape[1] // 100), replace=False
    )
    push = rng.normal(size=(len(rows), 3))
    places.reshape(-1, 3)[rows] += (
        push / np.linalg.norm(push, axis=1)[:, None] * rng.uniform(5e-4, 5e-3, (len(rows), 1))
    )
    return places


def campaign_files(site, seed, folder, sensors):
    """What somebody measured: cold poses, the warm-up, the log."""
    rng = np.random.default_rng([seed, 7])
    cold = drawn_poses(site.robot, rng, 60)
    warm = drawn_poses(site.robot, rng, 120)
    clock = np.linspace(0, 6 * 3600, 120)
    files = {
        "cold.csv": pose_csv(cold, wild(site.measured(cold, np.zeros((60, 5)), rng), rng), np.arange(60.0) * 30 - 4000),
        "warm.csv": pose_csv(warm, wild(site.measured(warm, site.arm.rises(clock), rng), rng), clock),
    }
    minute = np.arange(0, 6 * 3600 + 61, 60.0)
    degC = 22 + site.arm.rises(minute) + rng.normal(0, 0.05, (len(minute), 5))
    kept = [i for i, name in enumerate(NODES) if name in sensors]
    rows = ["time_s," + ",".join(f"{NODES[i]}_degC" for i in kept)]
    rows += [f"{t:.0f}," + ",".join(f"{degC[n, i]:.3f}" for i in kept) for n, t in enumerate(minute)]
    files["log.csv"] = "\n".join(rows) + "\n"
    for name, text in files.items():
        (Path(folder) / name).write_text(text)
    return [str(Path(folder) / name) for name in files]


def predicted(arm, q, side, rise, points):
    """What a robot file says of points on the flange, (M, R, 3) [m] in World."""
    sources = [
        SymbolicSource(
            source=k.source, original=k.source, symbols=ca.SX.zeros(0, 1), parameters=(), values={}, prior={}
        )
        for k in arm.known
    ]
    model = build_model(arm.robot, sources, len(arm.nodes))
    P, columns = evaluate(model.flange, q, rise, 0 * rise, side, np.zeros((len(q), 1)), np.zeros((1, 0)))
    R = np.swapaxes(columns.reshape(-1, 3, 3), 1, 2)
    return P[:, None] + np.einsum("mij,rj->mri", R, points)


def spiral(robot):
    """Joints along the spiral of 1.3 m, tool pointing down."""
    turn = np.linspace(0, 16 * np.pi, 400)
    r = 0.65 * turn / turn[-1]
    place = np.column_stack([1.35 + r * np.cos(turn), -0.03 + r * np.sin(turn), np.full(400, 0.203)])
    return follow_branch(robot, Pose(place, np.tile(np.diag([1.0, -1, -1]), (400, 1, 1))), Posture())


def run(seed, sensors=NODES, robot=None):
    """One arm: identified from its files, and the written robot file judged on what it has not seen."""
    with tempfile.TemporaryDirectory() as folder:
        nominal = load_arm(robot or robot_file(folder))
        site = Site(seed, nominal.robot)
        cold, warm, log = campaign_files(site, seed, folder, sensors)
        nominal = with_law_of(nominal, log, "start") if sensors else nominal
        files = MeasurementFiles(poses=[cold], warm_up=[warm], log=log if sensors else None)
        data, _ = read_measurements(nominal, files, force=False)
        start = time.perf_counter()
        result = identify_arm(nominal, data, bool(sensors))
        seconds = time.perf_counter() - start
        text = identified_robot_text(nominal, result, [cold, warm, log])
    arm = arm_of(tomllib.loads(text), text, "identified.toml")
    row = {"seed": seed, "setups": len(result.selected.fit.frames.origin),
           "sensors": list(sensors), "seconds": round(seconds, 1), "refused": result.refused,
           "model": result.selected.candidate.name, "noise_um": result.selected.fit.noise * 1e6,
           "held_out_um": result.selected.cross_validation.mean * 1e6}  # fmt: skip
    return row | flown(site, seed, arm, result) | judged_parameters(site.arm, arm, result)


def identify_arm(arm, data, logged):
    return identify(arm.robot, arm.known, data, len(arm.nodes), quiet, temperatures=logged, facts=arm.facts)


def flown(site, seed, arm, result):
    """Residuals over the noise, cold and hot, and the drift that is left on the spiral [um]."""
    rng = np.random.default_rng([seed, 11])
    frames = result.selected.fit.frames
    row: dict[str, Any] = {}  # figures, and triples of figures
    level = rng.uniform(0.85, 1.15, 5)
    for name, hours, t in (("cold", 0, 0), ("2h", 6, 2), ("6h", 6, 6), ("cooled", 6, 8)):
        pendant = drawn_poses(site.robot, rng, 120)
        rise = site.arm.rises(np.full(120, t * 3600.0), hours, level) if hours else np.zeros((120, 5))
        places = site.measured(pendant, rise, rng)
        q = site.robot.to_theta(pendant)
        side = np.sign(np.vstack([q[0] * 0, np.diff(q, axis=0)]))
        i = min(1 if hours else 0, len(frames.origin) - 1)
        p = predicted(arm, q, side, rise, frames.reflector[:3]) @ frames.rotation[i].T + frames.origin[i]
        row[name] = float(np.sqrt(((places - p)[1:] ** 2).mean()) / NOISE)
    row["hot"] = float(np.sqrt(np.mean([row[k] ** 2 for k in ("2h", "6h", "cooled")])))
    q = spiral(site.robot)
    tool, still, none = np.array([[0, 0, 0.15]]), np.zeros_like(q), np.zeros((len(q), 5))
    for name, t in (("2h", 2), ("6h", 6), ("cooled", 8)):
        rise = np.repeat(site.arm.rises(np.array([t * 3600.0]), 6, level), len(q), axis=0)
        true = [(lambda T: T[:, :3, 3] + T[:, :3, :3] @ tool[0])(site.arm.flange(q, r, still)) for r in (rise, none)]
        own = [predicted(arm, q, still, r, tool)[:, 0] for r in (rise, none)]
        distance = np.linalg.norm((own[0] - own[1]) - (true[0] - true[1]), axis=1) * 1e6
        row[f"drift_{name}"] = [float(np.sqrt((distance**2).mean())), float(np.quantile(distance, 0.99)),
                                float(np.linalg.norm(true[0] - true[1], axis=1).max() * 1e6)]  # fmt: skip
    return row


def judged_parameters(truth, arm, result):
    """How many true values lie inside their intervals; how thermal ones lie; largest against its prior."""
    values = truth.true_values()
    inside, thermal, beyond = [], {}, {}
    for known in arm.known:
        for p in known.source.PARAMETERS:
            if p.field not in known.sigma:
                continue
            value, sigma, prior = getattr(known.source, p.field), known.sigma[p.field], known.prior[p.field]
            for index in np.ndindex(value.shape):
                if sigma[index] == 0:
                    continue
                label = f"{known.source.NAME}.{p.field}{list(index)}"
                true = values.get((known.source.NAME, p.field, index))
                if known.source.NAME == "thermal_bend":
                    true = true_rate(truth, arm, known.source, index[0])
                if known.source.NAME.startswith("thermal"):
                    beyond[label] = float(value[index] / prior[index])
                    if true is not None:
                        thermal[label] = float((value[index] - true) / sigma[index])
                elif true is not None:
                    inside.append(abs(value[index] - true) <= 1.96 * sigma[index])
    inside += [abs(z) <= 1.96 for z in thermal.values()]
    return {"inside": int(np.sum(inside)), "counted": len(inside), "thermal": thermal,
            "prior": max(map(abs, beyond.values()), default=0.0)}  # fmt: skip


def true_rate(truth, arm, source, b):
    """Of a bend in the file: what the true arm has of it at that node."""
    table = tomllib.loads(arm.text)["sources"]["thermal_bend"]
    kind, node = (table["link"][b], table["plane"][b]), NODES.index(table["node"][b])
    assert kind in BENDS or kind[0] in ("a3", "a1")
    return sum(rate * state[node] for link, plane, rate, state in truth.bends if (link, plane) == kind)


def worst(rows, name, values):
    """Median and worst of some numbers, and whose the worst is."""
    k = int(np.argmax(values))
    return f"{name}: median {np.median(values):.2f}, worst {values[k]:.2f} (seed {rows[k]['seed']})"


def table(rows):
    """What was reached, over all arms."""

    def column(name):
        return np.array([r[name] for r in rows])

    z = np.array([v for r in rows for v in r["thermal"].values()])
    cover = column("inside") / np.maximum(column("counted"), 1)
    lines = [f"{len(rows)} arms, accepted {int((~column('refused')).sum())}"]
    lines += [worst(rows, name, column(name)) for name in ("cold", "2h", "6h", "cooled", "hot")]
    for name in ("drift_2h", "drift_6h", "drift_cooled"):
        for k, part in enumerate(("rms um", "p99 um", "before um")):
            lines.append(worst(rows, f"{name} {part}", column(name)[:, k]))
    lines.append(f"95 % intervals: pooled {column('inside').sum() / column('counted').sum():.3f}")
    lines.append(worst(rows, "outside their interval", 1 - cover))
    if len(z):
        lines.append(f"thermal parameters within 3 sigma: {np.mean(np.abs(z) <= 3):.3f} of {len(z)}")
    lines.append(worst(rows, "largest thermal parameter over its prior", column("prior")))
    lines.append(worst(rows, "seconds", column("seconds")))
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", default="0:20")
    parser.add_argument("--log", default="all")
    parser.add_argument("--journal", default=str(JOURNAL))
    parser.add_argument("--table", action="store_true")
    options = parser.parse_args()
    first, last = map(int, options.seeds.split(":"))
    sensors = {"all": NODES, "none": ()}.get(options.log, tuple(options.log.split(",")))
    journal = Path(options.journal)
    rows = [json.loads(line) for line in journal.read_text().splitlines()] if journal.exists() else []
    rows = [r for r in rows if first <= r["seed"] < last and r["sensors"] == list(sensors)]
    for seed in range(first, last) if not options.table else ():
        if seed not in {r["seed"] for r in rows}:
            rows.append(run(seed, sensors))
            with journal.open("a") as file:
                file.write(json.dumps(rows[-1]) + "\n")
            short = {k: round(v, 2) if isinstance(v, float) else v for k, v in rows[-1].items() if k != "thermal"}
            print(short, flush=True)
    print(table(rows))


if __name__ == "__main__":
    main()
