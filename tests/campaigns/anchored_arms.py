"""Arms that a shop identified and then anchors by touches: what is left on the path, and whether that was promised.

python tests/campaigns/anchored_arms.py --arms 0:10 --keep FOLDER            a row for each day, then the table
python tests/campaigns/anchored_arms.py --arms 0:10 --keep FOLDER --table    only the table of what is in the journal

Hidden arms of ``flown_arms`` (play run through over a width of its own at each joint, bends, column, own growths, in
numpy), identified from the poses of ``plan-poses`` (FOLDER/plan, made once) and a warm-up by ``cgen identify``. A day:
2 to 6 h of motion, told right or 2 to 4 h off or as a cold arm (or a cold arm told warm), or told right but for a
break after it (0.5 to 2.5 h of standing, then up to 1 h of motion); eight centres (``--touches``) of four
spheres located with 12 um, in one orientation, each joint with the play that the way there left; places by an
instrument (``certified``) or those that the robot commanded on them cold (``taught``). The truth is the hidden arm on
the shipped spiral, play apart.

What is left is judged by what the state says: with the covariance S of the path's places that the state gives, the
rms left holds where it is below the 95th percentile of the rms of N(0, S).
"""

import argparse
import csv
import json
import subprocess
import sys
import tempfile
from dataclasses import replace
from functools import lru_cache
from itertools import product
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "campaigns")]

import compgen.cli.blas_threads  # noqa: E402, F401, I001

import arms  # noqa: E402
import numpy as np  # noqa: E402
from flown_arms import TrueArm  # noqa: E402
from scipy.stats import chi2  # noqa: E402
from shipped import path_file  # noqa: E402
from wider_arm import NODES  # noqa: E402

from compgen.core.exceptions import CompgenError  # noqa: E402
from compgen.core.pose import IDENTITY, Pose  # noqa: E402
from compgen.core.units import DEG, HOUR, MM, UM  # noqa: E402
from compgen.error_model.model import build_error_model  # noqa: E402
from compgen.identification.touches import read_artefact, read_touches  # noqa: E402
from compgen.job.anchored_start import cell_with_state  # noqa: E402
from compgen.pipelines.anchor import anchor  # noqa: E402
from compgen.pipelines.anchor.estimate import compare, estimate, path_places  # noqa: E402
from compgen.pipelines.anchor.hypotheses import AS_FORECAST  # noqa: E402
from compgen.verification.band import field_correlation  # noqa: E402
from compgen.pipelines.files.path_file import load_job  # noqa: E402
from compgen.pipelines.files.robot_file import load_arm  # noqa: E402
from compgen.robot.inverse_kinematics import Posture, solve_tool  # noqa: E402
from compgen.robot.kinematics import flange_pose  # noqa: E402
from compgen.thermal import rise_history  # noqa: E402

BOX = "800 -600 -300 1800 600 900"
SPHERES = np.array([[800, -700, 250], [800, 640, 250], [1700, -600, 250], [1700, 540, 250]]) * MM
PLACE, REPEAT, NOISE = 5 * UM, 8 * UM, 12 * UM  # of an instrument, of the arm, of a touch
PROBE = Pose(np.array([0, 0, 0.15]), np.eye(3))
DOWN = np.diag([1.0, -1.0, -1.0])
LIFT = 0.15  # m above a sphere, where the arm turns
TURNED = 2 * DEG  # by which each joint is turned before the first touch
KINDS = ("taught right", "taught wrong", "taught cold", "certified right", "certified wrong", "certified cold",
         "certified break")  # fmt: skip


def planned_poses(keep):
    """Pendant angles that plan-poses asks for, without its reversal runs, (60, 6) [rad]."""
    if not (keep / "plan" / "poses.csv").exists():
        prisms = [w for p in arms.PRISM for w in ("--reflector", " ".join(f"{v / MM:.0f}" for v in p))]
        words = ["plan-poses", "m710ic50", "-n", "60", "--box", BOX, *prisms, "-o", str(keep / "plan"), "-q"]
        subprocess.run([sys.executable, "-m", "compgen", *words], cwd=ROOT, check=True)
    rows = csv.DictReader((keep / "plan" / "poses.csv").read_text().splitlines())
    return np.array([[float(r[f"j{k}_deg"]) for k in range(1, 7)] for r in rows if r["target"] == "r1"]) * DEG


def identified(seed, keep):
    """The robot file that ``cgen identify`` wrote of an arm, made once."""
    folder = keep / str(seed)
    own_robot = folder / "mine.toml"
    if own_robot.exists():
        return own_robot
    folder.mkdir(parents=True, exist_ok=True)
    nominal = arms.robot_file(folder)
    site = arms.Site(seed, load_arm(nominal).robot)
    site.arm = TrueArm(seed)
    rng = np.random.default_rng([seed, 41])
    cold, warm, clock = planned_poses(keep), arms.drawn_poses(site.robot, rng, 120), np.linspace(0, 6 * HOUR, 120)
    for name, pendant, time, since in (
        ("cold", cold, np.zeros(60), np.arange(60) * 30 - 4000), ("warm", warm, clock, clock)
    ):  # fmt: skip
        rise = site.arm.rises(time) if name == "warm" else np.zeros((60, 5))
        places = arms.wild(measured(site, pendant, rise, rng), rng)
        (folder / f"{name}.csv").write_text(arms.pose_csv(pendant, places, since))
    minute = np.arange(0, 6 * HOUR + 61, 60.0)
    degC = 22 + site.arm.rises(minute) + rng.normal(0, 0.05, (len(minute), 5))
    rows = ["time_s," + ",".join(f"{n}_degC" for n in NODES)]
    rows += [f"{t:.0f}," + ",".join(f"{v:.3f}" for v in d) for t, d in zip(minute, degC, strict=True)]
    (folder / "log.csv").write_text("\n".join(rows) + "\n")
    words = ["identify", nominal, "--poses", folder / "cold.csv", "--warm-up", folder / "warm.csv", "--temperatures",
             folder / "log.csv", "-o", own_robot, "-q"]  # fmt: skip
    subprocess.run([sys.executable, "-m", "compgen", *map(str, words)], cwd=ROOT, check=False)
    return own_robot


def measured(site, pendant, rise, rng):
    """Places of the prisms by the instrument, each joint through its play as far as the poses before let it."""
    q = site.robot.to_theta(pendant)
    T = site.arm.flange(q, rise, site.arm.sides(q, rng.uniform(-1, 1, 6)), rng)
    places = T[:, None, :3, 3] + np.einsum("mij,rj->mri", T[:, :3, :3], arms.PRISM)
    places = places @ site.turn.T + site.origin
    return places + rng.normal(0, arms.NOISE, places.shape)


def at(arm, q, rise, side=None, tool=PROBE):
    """Of a tool's centre on the hidden arm, World (M, 3) [m]."""
    T = arm.flange(q, np.broadcast_to(rise, (len(q), 5)), np.zeros_like(q) if side is None else side)
    return T[:, :3, 3] + T[:, :3, :3] @ tool.position


def joints(robot, places):
    """That the controller takes for places of the probe, pointing down, (M, 6) [rad]."""
    theta, margin = solve_tool(robot, Pose(places, np.broadcast_to(DOWN, (len(places), 3, 3))), PROBE, Posture())
    assert margin.min() > 0
    return theta


def touched(arm, robot, places, rise, start, rng, approach):
    """Commanded joints at which the probe's centre met places one after the other, from above, with noise.

    Args:
        approach: Whether the program begins above the last place, each joint that this does not turn turned by 2 deg
            first, so that play at the first touch comes from there.
    """
    wanted = places + rng.normal(0, NOISE, places.shape)
    commanded = wanted.copy()
    above = joints(robot, places + np.array([0, 0, LIFT]))
    begin = np.where(np.abs(above[-1] - above[0]) < TURNED, above[0] - TURNED, above[-1])
    for _ in range(5):
        q = joints(robot, commanded)
        way, of_touch = ([begin] if approach else []), []
        for n in range(len(q)):
            way += [above[n]] if not way else list(np.linspace(way[-1], above[n], 40)[1:])
            way += list(joints(robot, commanded[n] + np.linspace(LIFT, 0, 60)[:, None] * [0, 0, 1])[1:])
            of_touch.append(len(way) - 1)
            way += [above[n]]
        side = arm.sides(np.array(way), start)[of_touch]
        commanded = commanded + wanted - at(arm, q, rise, side)
    return q


def hours_of(kind, rng):
    """Told, and true."""
    declared = rng.uniform(2, 6)
    if kind.endswith(("right", "break")):
        return declared, declared
    if kind.endswith("cold"):
        return 0.0, 0.0
    if rng.random() < 0.25:
        return declared, 0.0
    return declared, max(declared + rng.choice([-1, 1]) * rng.uniform(2, 4), 0.5)


def true_rise(job, hours, rng, after=()):
    """As the shop's law has it after hours of the circle and of what came after, but for its errors, (5,) [K].

    Args:
        after: Hours that the robot then stood, and then moved again; of a break that nobody told of.
    """
    heat, K = job.cell.heat, 5
    real = replace(heat, reference_rise=heat.reference_rise * (1 + 0.06 * rng.standard_normal(K)),
                   tau=heat.tau * np.exp(0.1 * rng.standard_normal(K)))  # fmt: skip
    law = job.cell.warmth.law * rng.standard_normal(K) * -np.expm1(-hours / 2)
    moving = job.history.before[0] if job.history.before else None
    if moving is None or hours == 0:
        return np.zeros(K) + 0.1 * rng.standard_normal(K)
    drawn = zip((moving, job.history.standing, moving), (hours, *after), strict=False)
    duties = [replace(duty, duration=h * HOUR) for duty, h in drawn]
    return rise_history(real, duties, np.array([sum(d.duration for d in duties)]))[0] + law


@lru_cache(maxsize=1)
def shop_job(own_robot):
    """The shipped spiral by an identified robot, after some hours of the circle."""
    return load_job(path_file("spiral_1300"), robot=str(own_robot))


def job_of(own_robot, declared):
    """The same after hours that the shop is told."""
    job = shop_job(own_robot)
    before = (replace(job.history.before[0], duration=declared * HOUR),) if declared else ()
    return replace(job, history=replace(job.history, before=before))


def day(seed, kind, draw, own_robot, folder, approach=True, count=8, wrong_touch=False):
    """One day's job, touches and truth."""
    rng = np.random.default_rng([seed, draw, KINDS.index(kind), 43])
    declared, hours = hours_of(kind, rng)
    after = (rng.uniform(0.5, 2.5), rng.uniform(0, 1)) if kind.endswith("break") else ()
    arm, job = TrueArm(seed), job_of(own_robot, declared)
    warm_job = job if declared else job_of(own_robot, 3.0)
    rise = true_rise(warm_job, hours, rng, after)
    robot, taught = job.robot, kind.startswith("taught")
    stand = SPHERES + PLACE * rng.standard_normal(SPHERES.shape)
    which = np.arange(count) % 4
    say = SPHERES
    if taught:
        first = touched(arm, robot, stand[which], np.zeros(5), rng.uniform(-1, 1, 6), rng, approach)
        flange = (flange_pose(robot, first) @ PROBE).position
        say = np.array([flange[which == k].mean(axis=0) for k in range(4)])
    theta = touched(arm, robot, stand[which], rise, rng.uniform(-1, 1, 6), rng, approach)
    if wrong_touch:
        theta[3, 0] += 3e-4
    head = "taught = {}\n" if taught else "certified = true\n"
    text = f"[artefact]\n{head}" + "".join(
        f'[[sphere]]\nname = "{n}"\nx_mm = {x:.4f}\ny_mm = {y:.4f}\nz_mm = {z:.4f}\ndiameter_mm = 30\n'
        + ("" if taught else "sigma_um = 5\n")
        for n, (x, y, z) in zip("abcd", say / MM, strict=True)
    )
    (folder / "artefact.toml").write_text(text + "[probe]\nz_mm = 150\ndiameter_mm = 6\n")
    rows = ["target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,sigma_um"]
    for k, q in zip(which, robot.to_pendant(theta) / DEG, strict=True):
        rows.append(f"{'abcd'[k]}," + ",".join(f"{v:.6f}" for v in q) + f",{NOISE / UM:g}")
    (folder / "touches.csv").write_text("\n".join(rows) + "\n")
    return job, arm, rise, declared, hours


def run(seed, kind, draw, own_robot, folder, **changes):
    """One row."""
    job, arm, rise, declared, hours = day(seed, kind, draw, own_robot, folder, **changes)
    artefact = read_artefact(str(folder / "artefact.toml"))
    touches = read_touches(str(folder / "touches.csv"), job.robot, artefact, {}, planes=True)
    row = {"seed": seed, "kind": kind, "draw": draw, "declared": round(declared, 2), "true": round(hours, 2)}
    try:
        result = anchor(job, artefact, touches, IDENTITY)
    except CompgenError as failure:
        return {**row, "verdict": "refused", "reason": str(failure).replace(str(folder), "")}
    beside = compare(job, artefact, touches, IDENTITY, path_places(job, 60))
    limit = limit_of(beside, result) / UM
    return row | judged(job, arm, rise, result) | {"limit": round(limit, 1)}


def limit_of(beside, result):
    """What 95 % of the rms left on the path stay below, by the state that is written [m].

    The path's error is G (x - s) + N q + f, s the state's numbers, with x, q, f and the touches' noise as compgen has
    them; the rms of such an error is that of a chi^2 of nu numbers (Satterthwaite 1946).
    """
    h = AS_FORECAST if result.verdict == "leave it" else result.judged[0].hypothesis
    judged = next(j for j in result.judged if j.hypothesis == h)
    innovation, columns = beside.innovation, beside.columns
    keep = innovation.used(h)
    part, M = innovation.rows(keep), len(columns.G)
    G, N = columns.G.reshape(3 * M, -1), columns.N.reshape(3 * M, -1)
    P, V = beside.prior.of(h), part.covariance(beside.prior, h)
    L = G @ estimate(beside, h).gain
    rest = N @ part.N.T + (columns.field[:, keep][:, None, :] * part.along.T[None]).reshape(3 * M, -1)
    with_y = G @ P @ part.H.T + rest
    alike = np.kron(field_correlation(beside.path.position, beside.path.position), np.eye(3))
    S = G @ P @ G.T + N @ N.T + alike * np.outer(*[np.repeat(columns.missed, 3)] * 2)
    if result.verdict != "leave it":
        S = S - with_y @ L.T - L @ with_y.T + L @ V @ L.T
    values = np.clip(np.linalg.eigvalsh(S), 0, None) * max(judged.chi2 / len(innovation.y), 1.0)
    nu = values.sum() ** 2 / (values**2).sum()
    return float(np.sqrt(values.sum() / M * chi2.ppf(0.95, nu) / nu))


def judged(job, arm, rise, result):
    """What a state leaves: of the drift since the arm was cold, in all, and in a frame taught on the spheres cold.

    ``cold`` is what identification left of the cold arm in that frame: no state takes it away.
    """
    path = path_places(job)
    true = [at(arm, path.theta, r, tool=job.tool.pose) for r in (rise, 0 * rise)]
    file = believed(job, job.cell, path.theta, np.zeros(5))
    cells = {"before": result.forecast.cell, "after": cell_with_state(job.cell, result.state, "state")}
    row = {"verdict": result.verdict, "reason": result.reason, "chi2": round(result.judged[0].chi2, 1),
           "chi2_forecast": round(result.as_forecast.chi2, 1), "hypothesis": str(result.judged[0].hypothesis),
           "promised": [round(v / UM, 1) for v in result.rms]}  # fmt: skip
    rigid = framed(arm, job)
    for name, cell in cells.items():
        own = believed(job, cell, path.theta, np.asarray(cell.heat.outputs @ cell.heat.start))
        errors = {"drift": (true[0] - true[1]) - (own - file), "total": true[0] - own}
        errors["framed"] = errors["total"] - rigid(path.position)
        for what, error in errors.items():
            row[f"{what} {name}"] = rms_um(error)
    return row | {"cold": rms_um(true[1] - file - rigid(path.position))}


def rms_um(error):
    return round(float(np.sqrt((error**2).sum(axis=1).mean())) / UM, 1)


def framed(arm, job):
    """The rigid motion by which the part's frame, taught on the spheres cold, is off."""
    q = joints(job.robot, SPHERES)
    error = at(arm, q, np.zeros(5)) - believed(job, job.cell, q, np.zeros(5), PROBE)
    middle = SPHERES.mean(axis=0)
    rows = [np.hstack([np.eye(3), -cross(p - middle)]) for p in SPHERES]
    x = np.linalg.lstsq(np.vstack(rows), error.ravel(), rcond=None)[0]
    return lambda p: x[:3] + np.cross(x[3:], p - middle)


def cross(v):
    x, y, z = v
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def believed(job, cell, theta, rise, tool=None):
    """Where a cell says the tool is, (M, 3) [m]."""
    model = build_error_model(job.robot, cell.sources, 5, job.tool.pose if tool is None else tool)
    return model.actual_pose(theta, np.broadcast_to(rise, (len(theta), 5))).position


def table(rows):
    """A line for each kind: verdicts, what is left in the frame where the robot taught, else in all [um]."""
    print("kind             days anchored leave tell moved refused | left before: median, worst | after | said | holds")
    for kind in KINDS:
        of_kind = [r for r in rows if r["kind"] == kind]
        counts = [sum(r["verdict"] == v for r in of_kind) for v in
                  ("anchored", "leave it", "cannot tell", "something moved", "refused")]  # fmt: skip
        used = [r for r in of_kind if r["verdict"] in ("anchored", "leave it", "something moved")]
        if not used:
            continue
        what = "framed" if kind.startswith("taught") else "total"
        before, after, drift, cold = (
            np.array([r[k] for r in used]) for k in (f"{what} before", f"{what} after", "drift after", "cold")
        )
        promised, limit = (np.array(v) for v in ([r["promised"][1] for r in used], [r["limit"] for r in used]))
        print(f"{kind:16} {len(of_kind):4} {counts[0]:8} {counts[1]:5} {counts[2]:4} {counts[3]:5} {counts[4]:7} | "
              f"{np.median(before):.0f}, {before.max():.0f} | {np.median(after):.0f}, {after.max():.0f} | "
              f"{np.median(promised):.0f} | {np.mean(after <= limit):.2f} of {len(used)} | drift alone "
              f"{np.median(drift):.0f}, {drift.max():.0f}, cold {np.median(cold):.0f}, {cold.max():.0f}")  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arms", default="0:10")
    parser.add_argument("--draws", default="0:1")
    parser.add_argument("--keep", required=True, type=lambda text: Path(text).resolve())
    parser.add_argument("--touches", default=8, type=int)
    parser.add_argument("--table", action="store_true")
    asked = parser.parse_args()
    asked.keep.mkdir(parents=True, exist_ok=True)
    journal, rows = asked.keep / f"days_{asked.touches}.jsonl", []
    if journal.exists():
        rows = [json.loads(line) for line in journal.read_text().splitlines()]
    seen = {(r["seed"], r["kind"], r["draw"]) for r in rows}
    for seed in () if asked.table else range(*map(int, asked.arms.split(":"))):
        for draw, kind in product(range(*map(int, asked.draws.split(":"))), KINDS):
            if (seed, kind, draw) not in seen:
                with tempfile.TemporaryDirectory() as folder:
                    own_robot = identified(seed, asked.keep)
                    rows.append(run(seed, kind, draw, own_robot, Path(folder), count=asked.touches))
                with journal.open("a") as file:
                    file.write(json.dumps(rows[-1]) + "\n")
                print(rows[-1], flush=True)
    table(rows)


if __name__ == "__main__":
    main()
