"""Arms measured at the poses and runs of plan-poses, identified, taught, and flown on the true arm.

python tests/campaigns/planned_arms.py --seeds 0:20                 circle and spiral, cold
python tests/campaigns/planned_arms.py --seeds 0:20 --without-runs  without the reversal runs
python tests/campaigns/planned_arms.py --seeds 0:20 --table         only the table of what is in the journal

The arms of ``wider_arm.py`` with half the waviness and play of either sign that is run through linearly, over a width
of each joint's own, 4 to 150 mdeg and no less than it loses, as no joint turns back while its motor goes on. 60 poses x
3 reflectors and the runs, as the command chooses them; 8 um of repeatability, 6 um of the instrument, 1 % wild, no log;
masses declared to 10 %. The part's frame from touched spheres. Errors as found in that frame, by the text as written,
without repeatability: what the robot file leaves.
"""

import csv
import subprocess
import sys
import tempfile
from functools import lru_cache
from pathlib import Path

import flown_arms
import numpy as np
import seed_journal
from arms import LOADS, ROOT, Site, identify_arm, pose_csv, wild
from flown_arms import TrueArm
from shipped import quiet
from wider_arm import ARCSEC, MDEG

from compgen.core.finding_codes import Code
from compgen.core.units import DEG, MM, UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.robot_file import load_arm
from compgen.pipelines.measure.identification_files import (
    MeasurementFiles,
    arm_to_identify,
    identified_robot_text,
    read_measurements,
)
from compgen.pipelines.measure.teach_frame import frame_text, teach_frame
from compgen.pipelines.planned.generate import generate

REPEATABILITY, INSTRUMENT = 8e-6, 6e-6  # m, of one coordinate
BOX = "800 -700 -100 1900 700 1000"
PRISM = np.array([[100, 0, 50], [-60, -90, 50], [-50, 90, 120]]) * MM
RUNS = (("circle_1300", False), ("spiral_1300", False))


class PlannedArm(TrueArm):
    """An arm of the wider family with play of either sign that is run through linearly."""

    def __post_init__(self):
        super().__post_init__()
        rng = np.random.default_rng([self.seed, 41])
        self.law, self.play_law = "play", "one size"
        self.play = rng.choice([-1, 1]) * np.abs(rng.normal(0, [12, 8, 8, 30, 20, 15])) * ARCSEC
        self.width = np.maximum(np.exp(rng.normal(np.log(25), 0.9, 6)).clip(4, 150) * MDEG, self.play)
        size, order, phase = self.ripples_of_space
        self.ripples_of_space = size / 2, order, phase


@lru_cache(maxsize=1)
def planned():
    """Pendant angles that plan-poses asks for, (M, 6) [rad]: of the poses and of the runs."""
    prisms = [w for p in PRISM for w in ("--reflector", " ".join(f"{v / MM:.0f}" for v in p))]
    with tempfile.TemporaryDirectory() as folder:
        words = ["plan-poses", "m710ic50", "-n", "60", "--box", BOX, *prisms, "-o", f"{folder}/plan", "-q"]
        subprocess.run([sys.executable, "-m", "compgen", *words], cwd=ROOT, check=True)
        return tuple(_asked(Path(folder, "plan", name)) for name in ("poses.csv", "reversals.csv"))


def _asked(file):
    """Joints (M, 6) [rad] and reflectors (N,) of each row's pose (N,)."""
    rows = list(csv.DictReader(file.read_text().splitlines()))
    order = np.array([int(r["order"]) for r in rows])
    first = [int(np.flatnonzero(order == m)[0]) for m in range(order[-1] + 1)]
    q = np.array([[float(r[f"j{k}_deg"]) for k in range(1, 7)] for r in rows]) * DEG
    return q[first], order, np.array([int(r["target"][1:]) - 1 for r in rows])


def measured(site, asked, name, folder, rng):
    """A file of some poses, driven in their order from anywhere."""
    pendant, order, target = asked
    q = site.robot.to_theta(pendant)
    T = site.arm.flange(q, np.zeros((len(q), 5)), site.arm.sides(q, rng.uniform(-1, 1, 6)))
    places = T[:, None, :3, 3] + np.einsum("mij,rj->mri", T[:, :3, :3], PRISM)
    places = (places + rng.normal(0, REPEATABILITY, (len(q), 1, 3))) @ site.turn.T + site.origin
    places = wild(places + rng.normal(0, INSTRUMENT, places.shape), rng)
    rows = pose_csv(pendant, places, np.arange(len(q))).replace("time_s", "order").splitlines()
    kept = {(m, r) for m, r in zip(order.tolist(), target.tolist(), strict=True)}
    kept_rows = [rows[1 + 3 * m + r] for m, r in sorted(kept)]
    file = folder / name
    file.write_text("\n".join([rows[0], *(_whole(row) for row in kept_rows)]) + "\n")
    return str(file)


def _whole(row):
    order, rest = row.split(",", 1)
    return f"{float(order):.0f},{rest}"


def trial(seed, runs=True, loads=True, paths=RUNS, folder=None):
    """One arm."""
    if folder is None:
        with tempfile.TemporaryDirectory() as name:
            return trial(seed, runs, loads, paths, Path(name))
    nominal_file = folder / "m710ic50.toml"
    nominal_file.write_text((ROOT / "robots" / "m710ic50.toml").read_text() + LOADS * loads)
    nominal = arm_to_identify(str(nominal_file))
    site = Site(seed, nominal.robot)
    site.arm = arm = PlannedArm(seed)
    rng = np.random.default_rng([seed, 43])
    names = [measured(site, asked, f"{n}.csv", folder, rng) for n, asked in zip("pr", planned(), strict=True)]
    data, _ = read_measurements(nominal, MeasurementFiles(poses=names if runs else names[:1]), force=False)
    result = identify_arm(nominal, data, False)
    (folder / "mine.toml").write_text(identified_robot_text(nominal, result, names))
    own = load_arm(str(folder / "mine.toml"))
    place = flown_arms.part_place(np.random.default_rng([seed, 33]))
    touches, artefact = flown_arms.touches_file(arm, nominal.robot, place, folder, rng, hours=0.0)
    (folder / "frame.toml").write_text(
        frame_text(teach_frame(own, touches, artefact, 1, None, "start", {}, nominal=False))
    )
    row = {"seed": seed, "refused": [f.message for f in result.findings if f.level.name == "REFUSED"],
           "noise_um": result.selected.fit.noise / UM, "model": result.selected.candidate.name,
           "set_aside": int(result.selected.fit.outlier.sum()), "rows": len(data.pose),
           "held_out_um": result.selected.cross_validation.robust_mean / UM, "runs": {}, "wrong": []}  # fmt: skip
    for name, _ in paths:
        job = load_job(flown_arms.job_file(name, folder, False), robot=str(folder / "mine.toml"))
        plan, corrected = generate(job, quiet)
        after = flown_arms.flown(arm, job, corrected.program, plan.path, place, rng, False)
        limited = sum(f.code == Code.COMPENSATION_LIMITED for f in corrected.findings)
        row["runs"][name.split("_")[0]] = {k: round(v, 1) for k, v in after.items()} | {"limited": limited}
    return row


def table(rows):
    """What was reached: median and worst of each figure, with the worst seed."""
    refused = [r["seed"] for r in rows if r["refused"]]
    lines = [f"{len(rows)} arms, refused {refused}"]
    lines += ["| [um]: median, worst (its seed) | p99 as found | rms as found | p99 aligned |", "|---|---|---|---|"]
    for key in rows[0]["runs"] if rows else ():
        columns = ([r["runs"][key][name] for r in rows] for name in ("quiet", "rms", "quiet_aligned"))
        cells = [seed_journal.median_and_worst(values, rows) for values in columns]
        lines.append(f"| {key} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main():
    parser = seed_journal.parser("planned_arms", __doc__, "0:20")
    parser.add_argument("--without-runs", action="store_true")
    parser.add_argument("--no-loads", action="store_true", help="with no masses in the robot file: sag is not fitted")
    parser.add_argument("--path", default="", help="one of the paths only")
    options = parser.parse_args()
    paths = [p for p in RUNS if options.path in p[0]]
    if not options.table:
        for seed in options.journal.left(options.seeds, options.budget):
            folder = options.keep and options.keep / str(seed)
            if folder:
                folder.mkdir(parents=True, exist_ok=True)
            row = trial(seed, not options.without_runs, not options.no_loads, paths, folder)
            options.journal.add(row)
            print(row, flush=True)
    print(table(options.journal.rows(options.seeds)))


if __name__ == "__main__":
    main()
