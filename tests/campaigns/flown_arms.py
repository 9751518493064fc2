"""Programs generated on an identified arm and flown on the true one, cold and after 5 h, in a frame that was taught.

python tests/campaigns/flown_arms.py --seeds 0:20            circle and spiral
python tests/campaigns/flown_arms.py --seeds 0:20 --raster   the raster with them, warm
python tests/campaigns/flown_arms.py --seeds 0:20 --table    only the table of what is in the journal

The files of ``arms.py`` with reversal runs (true widths of 0.2 deg, times or over 1.5; Dahl and play operator in turn);
the part's frame from six spheres around it, six tilts of the probe each, touched by the true arm after 3 h of warming;
paths generated in it with the taught probe as their tool, cold or warm by a log of the day; their text, before and
after the correction, driven by the controller and flown by the true arm with play that begins anywhere, on a base that
is 1.4 mm off World. 8 um of repeatability a coordinate, in touches and in flight; p99 over the part.
"""

import csv
import re
import subprocess
import sys
import tempfile
import tomllib
from functools import lru_cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "campaigns")]

import arms  # noqa: E402
import numpy as np  # noqa: E402
import seed_journal  # noqa: E402
from shipped import path_file, quiet  # noqa: E402
from wider_arm import NODES, WiderArm  # noqa: E402

from compgen.core.dates import DEFAULT_DATE  # noqa: E402
from compgen.core.finding_codes import Code  # noqa: E402
from compgen.core.pose import Pose  # noqa: E402
from compgen.core.rotations import from_wpr, rotation_matrix  # noqa: E402
from compgen.core.units import DEG, MM, UM  # noqa: E402
from compgen.pipelines.files.path_file import load_job  # noqa: E402
from compgen.pipelines.files.robot_file import load_arm  # noqa: E402
from compgen.pipelines.measure.fitted_law import with_law_of  # noqa: E402
from compgen.pipelines.measure.identification_files import MeasurementFiles, identified_robot_text, read_measurements  # noqa: E402
from compgen.pipelines.measure.teach_frame import frame_text, teach_frame  # noqa: E402
from compgen.pipelines.planned.generate import generate  # noqa: E402
from compgen.pipelines.planned.program_text import planned_program  # noqa: E402
from compgen.robot.inverse_kinematics import Posture, solve_tool  # noqa: E402
from compgen.verification.twin import Twin, execute  # noqa: E402

REPEATABILITY = 8e-6  # m, of one coordinate
RUNS = (("circle_1300", False), ("circle_1300", True), ("spiral_1300", False), ("spiral_1300", True))
RASTER = (("raster_1300", True),)
TAUGHT_AT, FLOWN_AT = 3.0, 5.0  # h of warming
ORIENTATIONS = 6  # of the probe at each sphere
PROBE = np.array([12.0, -8.0, 150.0]) * MM
PROBE_ERROR = np.array([0.21, -0.33, 0.12]) * MM
BASE = Pose(np.array([0.9, -0.7, 0.8]) * MM, rotation_matrix(np.array([[2e-4, -3e-4, 5e-4]]))[0])
SPHERES = np.array([[0.6, 0.55, 0.02], [0.6, -0.55, 0.05], [-0.6, 0.5, 0], [-0.6, -0.5, 0.03], [0, 0.65, 0.04],
                    [0, -0.65, 0]])  # fmt: skip


class TrueArm(WiderArm):
    """An arm of the wider family whose play is run through over a width, on a base that is not where World is."""

    def __post_init__(self):
        super().__post_init__()
        rng = np.random.default_rng([self.seed, 21])
        self.width = 0.2 * DEG * np.exp(rng.normal(0, 0.4, 6))
        self.law = ("dahl", "play")[self.seed % 2]

    def sides(self, q, start):
        """How far each joint is through its play at joints driven one after the other, (M, 6) [-1, 1]."""
        u = np.zeros_like(q)
        u[0] = start
        for m, step in enumerate(np.diff(q, axis=0), 1):
            if self.law == "play":
                u[m] = np.clip(u[m - 1] + step / self.width, -1, 1)
            else:
                keep = np.exp(-np.abs(step) / self.width)
                u[m] = keep * u[m - 1] + (1 - keep) * np.sign(step)
        return u

    def tool_pose(self, q, rise, side, tool):
        """Places (M, 3) [m] in World and axes of a point of the flange."""
        T = self.flange(q, rise, side)
        return BASE.act(T[:, :3, 3] + T[:, :3, :3] @ tool), BASE.rotation @ T[:, :3, :3]


def part_place(rng):
    """Where the part stands, known to nobody."""
    angles = (np.array([a * DEG]) for a in rng.uniform(-1, 1, 3) * [1, 1, 4])
    return Pose(np.array([1.25, -0.03, 0.01]) + rng.uniform(-0.03, 0.03, 3), from_wpr(*angles)[0])


@lru_cache(maxsize=1)
def reversal_rows():
    """What plan-poses asks for: pendant angles of the runs of all joints, (M, 6) [rad]."""
    box = "800 -600 -300 1800 600 900"
    prisms = [w for p in arms.PRISM for w in ("--reflector", " ".join(f"{v / MM:.0f}" for v in p))]
    with tempfile.TemporaryDirectory() as folder:
        words = ["plan-poses", "m710ic50", "-n", "30", "--box", box, *prisms, "-o", f"{folder}/plan", "-q"]
        subprocess.run([sys.executable, "-m", "compgen", *words], cwd=ROOT, check=True)
        rows = list(csv.DictReader(Path(folder, "plan", "reversals.csv").read_text().splitlines()))
    return np.array([[float(r[f"j{k}_deg"]) for k in range(1, 7)] for r in rows]) * DEG


def reversals_file(site, folder, rng):
    """The runs of plan-poses, all reflectors at each pose, measured by the tracker that measured the cold poses."""
    pendant = reversal_rows()
    q = site.robot.to_theta(pendant)
    T = site.arm.flange(q, np.zeros((len(q), 5)), site.arm.sides(q, rng.uniform(-1, 1, 6)), rng)
    places = T[:, None, :3, 3] + np.einsum("mij,rj->mri", T[:, :3, :3], arms.PRISM)
    places = places @ site.turn.T + site.origin + rng.normal(0, arms.NOISE, places.shape)
    (folder / "reversals.csv").write_text(arms.pose_csv(pendant, places, 10.0 * np.arange(len(q)) - 8000))
    return str(folder / "reversals.csv")


def log_file(arm, folder, name, hours, rng, off=0.0, worked=6.0):
    """Temperatures of a day until some hours after its start, of which it worked; warm, all sensors are off [K]."""
    minute = np.arange(0, hours * 3600 + 1, 60.0)
    degC = 22 + arm.rises(minute, worked) + rng.normal(0, 0.05, (len(minute), 5))
    degC += off * -np.expm1(-minute / 1800)[:, None]
    rows = ["time_s," + ",".join(f"{n}_degC" for n in NODES)]
    rows += [f"{t:.0f}," + ",".join(f"{v:.3f}" for v in d) for t, d in zip(minute, degC, strict=False)]
    (folder / name).write_text("\n".join(rows) + "\n")
    return str(folder / name)


def touches_file(arm, robot, place, folder, rng, hours=TAUGHT_AT):
    """Joints at which the ball of the true arm, warm for so long, was at the spheres' centres to its repeatability."""
    centre = np.repeat(place.act(SPHERES), ORIENTATIONS, axis=0)
    N = len(centre)
    rotation = np.diag([1.0, -1.0, -1.0]) @ rotation_matrix(rng.uniform(-0.35, 0.35, (N, 3)))
    goal = centre + rng.normal(0, REPEATABILITY, centre.shape)
    q = solve_tool(robot, Pose(centre, rotation), Pose(PROBE, np.eye(3)), Posture())[0]
    clock = TAUGHT_AT * 3600 - 40.0 * np.arange(N)[::-1]
    rise = arm.rises(clock) if hours else np.zeros((N, 5))
    still = np.zeros((N, 6))
    tip = PROBE + PROBE_ERROR
    for _ in range(6):
        at, _ = arm.tool_pose(q, rise, still, tip)
        J = np.stack([(arm.tool_pose(q + 1e-5 * e, rise, still, tip)[0] - at) / 1e-5 for e in np.eye(6)], axis=2)
        q = q + np.einsum("nij,nj->ni", np.linalg.pinv(J), goal - at)
    assert np.abs(goal - arm.tool_pose(q, rise, still, tip)[0]).max() < 1e-7
    rows = ["time_s,target," + ",".join(f"j{k}_deg" for k in range(1, 7))]
    for n, pendant in enumerate(robot.to_pendant(q) / DEG):
        rows.append(f"{clock[n]:.1f},s{n // ORIENTATIONS}," + ",".join(f"{v:.6f}" for v in pendant))
    (folder / "touches.csv").write_text("\n".join(rows) + "\n")
    text = '[artefact]\nframe = "world"\n[probe]\ndiameter_mm = 6\n'
    text += "".join(f"{k} = {v}\n" for k, v in zip(("x_mm", "y_mm", "z_mm"), PROBE / MM, strict=False))
    for k, (x, y, z) in enumerate(SPHERES / MM):
        text += f'[[sphere]]\nname = "s{k}"\ndiameter_mm = 25\nx_mm = {x:g}\ny_mm = {y:g}\nz_mm = {z:g}\n'
    (folder / "artefact.toml").write_text(text)
    return str(folder / "touches.csv"), str(folder / "artefact.toml")


def job_file(name, folder, hot, day="hot"):
    """A shipped path in the part's frame, driven with the probe as it was taught; warm by the log of a day, or cold."""
    text = Path(path_file(name)).read_text()
    text = text.split("[[before]]")[0] + text[text.index("[bounds]") :]
    text = re.sub(r"x_mm = 1350[^\n]*\ny_mm = -30\nz_mm = 203", "x_mm = 0\ny_mm = 0\nz_mm = 0", text)
    tool = tomllib.loads((folder / "frame.toml").read_text())["tool"]
    tool = "[tool]\nnumber = 1\n" + "".join(f"{k} = {tool[k]}\n" for k in ("x_mm", "y_mm", "z_mm"))
    log = f'[log]\nfile = "{day}.csv"\nreference = "start"\n' if hot else ""
    file = folder / f"{name}_{day if hot else 'cold'}.toml"
    file.write_text(text.replace("[process]", f'[frame]\nfile = "frame.toml"\n{tool}{log}[process]'))
    return str(file)


def p99(places, target, repeat):
    """Of the distances, with repeatability."""
    return float(np.quantile(np.linalg.norm(places + repeat - target, axis=1), 0.99) / UM)


def aligned(a, b):
    """Points moved as one to lie nearest to others (Kabsch)."""
    middle, other = a.mean(axis=0), b.mean(axis=0)
    u, _, v = np.linalg.svd((a - middle).T @ (b - other))
    turn = v.T @ np.diag([1, 1, np.linalg.det(v.T @ u.T)]) @ u.T
    return (a - middle) @ turn.T + other


def flown(arm, job, program, path, place, rng, hot):
    """How far the true arm is from the true path, p99 [um]: as found, aligned, and as found without repeatability."""
    controller = Twin(
        robot=job.robot,
        heat=job.heat,
        profiles=job.cell.profiles,
        tool=job.tool.pose,
        faults=None,
        uframe=job.frame.register,
    )
    run = execute(controller, program, ())
    clock = FLOWN_AT * 3600 + run.time
    rise = arm.rises(clock) if hot else np.zeros((len(clock), 5))
    side = arm.sides(run.theta, rng.uniform(-1, 1, 6))
    places, _ = arm.tool_pose(run.theta, rise, side, PROBE + PROBE_ERROR)
    on_part = path.contact[run.segment] & path.contact[run.segment + 1]
    target = place.act(job.frame.place.inverse().act(path.at(run.segment, run.fraction)[0].position))
    places, target = places[on_part], target[on_part]
    repeat = rng.normal(0, REPEATABILITY, places.shape)
    best = aligned(places, target)
    return {"found": p99(places, target, repeat), "aligned": p99(best, target, repeat),
            "quiet": p99(places, target, 0), "quiet_aligned": p99(best, target, 0),
            "rms": float(np.sqrt(((places - target) ** 2).sum(axis=1).mean()) / UM)}  # fmt: skip


def trial(seed, runs=RUNS, folder=None):
    """One arm."""
    if folder is None:
        with tempfile.TemporaryDirectory() as name:
            return trial(seed, runs, Path(name))
    nominal = load_arm(arms.robot_file(folder))
    site = arms.Site(seed, nominal.robot)
    site.arm = arm = TrueArm(seed)
    rng = np.random.default_rng([seed, 31])
    cold, warm, log = arms.campaign_files(site, seed, folder, NODES)
    nominal = with_law_of(nominal, log, "start")
    files = MeasurementFiles(poses=[cold, reversals_file(site, folder, rng)], warm_up=[warm], log=log)
    data, _ = read_measurements(nominal, files, force=False)
    result = arms.identify_arm(nominal, data, True)
    (folder / "mine.toml").write_text(identified_robot_text(nominal, result, [cold, warm, log]))
    own = load_arm(str(folder / "mine.toml"))
    place = part_place(np.random.default_rng([seed, 33]))
    touches, artefact = touches_file(arm, nominal.robot, place, folder, rng)
    log = log_file(arm, folder, "taught.csv", TAUGHT_AT, rng)
    taught = teach_frame(own, touches, artefact, 1, log, "start", {}, nominal=False)
    (folder / "frame.toml").write_text(frame_text(taught))
    log_file(arm, folder, "hot.csv", FLOWN_AT, rng)
    row = {"seed": seed, "refused": result.refused, "law": [arm.law, arm.play_law],
           "frame_um": (taught.fit.sigma[3:6] / UM).round(1).tolist(), "runs": {}, "wrong": []}  # fmt: skip
    for name, hot in runs:
        job = load_job(job_file(name, folder, hot), robot=str(folder / "mine.toml"))
        planned, corrected = generate(job, quiet)
        after = flown(arm, job, corrected.program, planned.path, place, rng, hot)
        plain = planned_program(job, planned.path, planned.theta, planned.trajectory, DEFAULT_DATE)
        after["before"] = flown(arm, job, plain, planned.path, place, rng, hot)["found"]
        limited = [f.message for f in corrected.findings if f.code == Code.COMPENSATION_LIMITED]
        row["runs"][f"{name.split('_')[0]} {'5 h' if hot else 'cold'}"] = after | {"limited": limited}
    return row


def table(rows):
    """What was reached: median and worst of each figure, with the worst seed."""
    lines = [f"{len(rows)} arms, refused {[r['seed'] for r in rows if r['refused']]}"]
    lines += ["| p99 [um]: median, worst (its seed) | before | as found | aligned | as found, repeatability apart | "
              "as found over aligned |", "|---|---|---|---|---|---|"]  # fmt: skip
    for key in rows[0]["runs"] if rows else ():
        of = [r for r in rows if key in r["runs"]]
        columns = [([r["runs"][key][name] for r in of], ".0f") for name in ("before", "found", "aligned", "quiet")]
        columns.append(([r["runs"][key]["found"] / r["runs"][key]["aligned"] for r in of], ".2f"))
        cells = [seed_journal.median_and_worst(values, of, digits) for values, digits in columns]
        lines.append(f"| {key} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main():
    parser = seed_journal.parser("flown_arms", __doc__, "0:20")
    parser.add_argument("--raster", action="store_true", help="the raster with circle and spiral")
    options = parser.parse_args()
    if not options.table:
        runs = RUNS + RASTER if options.raster else RUNS
        for seed in options.journal.left(options.seeds, options.budget):
            folder = options.keep and options.keep / str(seed)
            if folder:
                folder.mkdir(parents=True, exist_ok=True)
            row = trial(seed, runs, folder)
            options.journal.add(row)
            print(seed, {k: {n: round(v) for n, v in run.items() if n != "limited"} for k, run in row["runs"].items()},
                  flush=True)  # fmt: skip
    print(table(options.journal.rows(options.seeds)))


if __name__ == "__main__":
    main()
