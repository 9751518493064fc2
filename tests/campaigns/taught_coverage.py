"""Does the band of a taught arm hold? Arms that nobody tuned to: identified, spheres touched, the frame taught, driven.

python tests/campaigns/taught_coverage.py --seeds 0:60             a row for each arm, then the table; again goes on
python tests/campaigns/taught_coverage.py --seeds 0:60 --table     only the table of what is in the journal
python tests/campaigns/taught_coverage.py --keep FOLDER            identified robots stay there, and are used again

The arms are those of ``flown_arms.py`` without reversal runs: play that is run through over a width that nobody
measured (linearly on two arms of three), bends, a column, growths of their own. Each is touched warm, after 3 h, in one
of three ways: six spheres on the edge three times, four twice, nine within the part four times. Along the shipped
circle and spiral, cold, after 5 h, and 1.5 h after 3 h of work, both by a log, the joints that correct the path are
driven: the true place of the tool on the true part is compared with the predicted one on the taught part. The band is
the one of these joints, without the start window. What the robot file says of its sensors and of the air is drawn: all
warm sensors of an arm are off by one amount, on the day it teaches and on the day it works, and a cold arm is as warm
as its air.

Ratio: half width of the band (k = 2) over that of the errors (95 % quantile of |error|), a coordinate, rms over jobs.
"""

import sys
import tempfile
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[2]), str(Path(__file__).resolve().parent)]

import arms  # noqa: E402
import flown_arms  # noqa: E402
import numpy as np  # noqa: E402
import seed_journal  # noqa: E402
from flown_arms import FLOWN_AT, PROBE, PROBE_ERROR, REPEATABILITY, TAUGHT_AT, TrueArm, job_file, log_file, part_place  # noqa: E402
from shipped import quiet  # noqa: E402
from wider_arm import NODES  # noqa: E402

from compgen.core.exceptions import InputError  # noqa: E402
from compgen.core.files import POSTERIOR  # noqa: E402
from compgen.core.units import UM  # noqa: E402
from compgen.job.motion_plan import plan_motion  # noqa: E402
from compgen.pipelines.files.path_file import load_job  # noqa: E402
from compgen.pipelines.files.robot_file import load_arm  # noqa: E402
from compgen.pipelines.measure.fitted_law import with_law_of  # noqa: E402
from compgen.pipelines.measure.identification_files import MeasurementFiles, identified_texts, read_measurements  # noqa: E402
from compgen.pipelines.measure.teach_frame import frame_text, teach_frame  # noqa: E402
from compgen.pipelines.planned.generate import find_correction  # noqa: E402
from compgen.pipelines.planned.job_results import plan_of  # noqa: E402
from compgen.pipelines.uncertainty.band_columns import band_along  # noqa: E402

WITHIN = np.array([[x, y, 0.02 * ((x > 0) + (y > 0))] for x in (-0.45, 0, 0.45) for y in (-0.45, 0, 0.45)])
TOUCHED = {"6 x 3, edge": (flown_arms.SPHERES, 3), "4 x 2, edge": (flown_arms.SPHERES[:4], 2), "9 x 4": (WITHIN, 4)}
LAWS = ("play", "play", "dahl")  # run through linearly, or ever less
#: hours at which a day's program runs, and of work before
DAYS = {"cold": (FLOWN_AT, 0.0), "5 h": (FLOWN_AT, 6.0), "cooling": (4.5, 3.0)}
SENSORS, AIR = 0.5, 0.25  # [K] as robots/m710ic50.toml says


def robot_of(site, seed, folder):
    """The robot file that identify writes of cold poses and a warm-up."""
    if not (folder / "mine.toml").exists():
        nominal = load_arm(arms.robot_file(folder))
        cold, warm, log = arms.campaign_files(site, seed, folder, NODES)
        nominal = with_law_of(nominal, log, "start")
        data, _ = read_measurements(nominal, MeasurementFiles(poses=[cold], warm_up=[warm], log=log), force=False)
        result = arms.identify_arm(nominal, data, True)
        text, posterior = identified_texts(nominal, result, [cold, warm, log], f"mine{POSTERIOR}")
        (folder / f"mine{POSTERIOR}").write_text(posterior)
        (folder / "mine.toml").write_text(text)
    return str(folder / "mine.toml")


def trial(seed, kept=None):
    """One arm."""
    if kept is None:
        with tempfile.TemporaryDirectory() as name:
            return trial(seed, Path(name))
    folder = kept / str(seed)
    folder.mkdir(parents=True, exist_ok=True)
    robot = load_arm(arms.robot_file(folder)).robot
    site = arms.Site(seed, robot)
    site.arm = arm = TrueArm(seed)
    arm.law = LAWS[(seed + 2 * (seed // 9)) % 3]  # of 27 seeds in a row each play has each law by each way to touch
    file, rng = robot_of(site, seed, folder), np.random.default_rng([seed, 41])
    place, way = part_place(np.random.default_rng([seed, 33])), list(TOUCHED)[(seed // 3 + seed + seed // 9) % 3]
    flown_arms.SPHERES, flown_arms.ORIENTATIONS = TOUCHED[way]
    touches, artefact = flown_arms.touches_file(arm, robot, place, folder, rng)
    off, air = np.random.default_rng([seed, 43]).normal(0, [SENSORS, AIR])
    log = log_file(arm, folder, "taught.csv", TAUGHT_AT, rng, off)
    taught = teach_frame(load_arm(file), touches, artefact, 1, log, "start", {}, nominal=False)
    (folder / "frame.toml").write_text(frame_text(taught))
    for state, (hours, worked) in list(DAYS.items())[1:]:
        log_file(arm, folder, f"{state}.csv", hours, rng, off, worked)
    row = {"seed": seed, "sensors_K": off, "air_K": air}
    row |= {"play": arm.play_law, "law": arm.law, "touches": way, "wrong": [], "jobs": {}, "refused": []}
    row["sigma_um"] = (taught.fit.sigma[3:6] / UM).tolist()
    for name in ("circle_1300", "spiral_1300"):
        for state in DAYS:
            try:
                path = job_file(name, folder, state != "cold", state)
                job = load_job(path, robot=file, overrides=["process.chord_um=30"])
            except InputError as refused:
                row["refused"].append(str(refused))
                continue
            row["jobs"][f"{name.split('_')[0]} {state}"] = judged(job, arm, place, taught.fit.frame, state, air, rng)
    return row


def judged(job, arm, place, frame, state, air, rng):
    """Errors on the part against the band, a coordinate each, alone and with the repeatability of one run."""
    plan = plan_of(job, plan_motion(job.plan, job.cell, job.feed, quiet, pages=False))
    planned, problem, solution, _ = find_correction(plan, quiet)
    path, theta, motion = planned.path, solution.theta, problem.direction_state
    hours, worked = DAYS[state]
    band, clock = band_along(planned.driven(theta, motion)), hours * 3600 + planned.trajectory.time
    rise = arm.rises(clock, worked) if worked else np.full((len(clock), len(NODES)), air)
    side = arm.sides(theta, rng.uniform(-1, 1, 6))
    true, _ = arm.tool_pose(theta, rise, side, PROBE + PROBE_ERROR)
    predicted = planned.model.actual_pose(theta, planned.rise, motion).position
    error = (place.inverse().act(true) - frame.inverse().act(predicted)) @ frame.rotation.T
    error = error[path.contact] / UM
    run = error + rng.normal(0, REPEATABILITY / UM, error.shape)
    half = np.column_stack([np.interp(path.arc, path.arc[band.rows], column) for column in band.world().T])
    half = half[path.contact] / UM
    return {
        "hits": float((np.abs(error) <= half).mean()), "hits_run": float((np.abs(run) <= half).mean()),
        "error_um": float(np.sqrt((error**2).mean())), "half_um": float(np.sqrt((half**2).mean())),
        "q95_um": float(np.quantile(np.abs(error), 0.95)), "q95_run_um": float(np.quantile(np.abs(run), 0.95)),
        "mean_um": error.mean(axis=0).round(2).tolist(), "largest_um": band.largest / UM, "p99_um": band.p99 / UM,
        "budget_um": {share.source: round(share.rms / UM, 2) for share in band.budget},
    }  # fmt: skip


def line(name, cells):
    """Coverage and widths of some jobs."""

    def pooled(key):
        return float(np.sqrt(np.mean([c[key] ** 2 for _, c in cells])))

    hits, run = (100 * np.mean([c[key] for _, c in cells]) for key in ("hits", "hits_run"))
    half = pooled("half_um")
    return (f"| {name} | {len({seed for seed, _ in cells})} | {hits:.1f} % | {run:.1f} % | {pooled('error_um'):.1f} | "
            f"{half:.0f} | {half / pooled('q95_um'):.2f} | {half / pooled('q95_run_um'):.2f} |")  # fmt: skip


def table(rows):
    """Pooled, by group, and the frame's own sigma against what the part is off by as a whole."""
    jobs = [(r, name, c) for r in rows for name, c in r["jobs"].items()]
    lines = [f"{len(rows)} arms, logs refused {sum(bool(r['refused']) for r in rows)}",
             "| | arms | in the band | with repeatability | rms um | half width um | ratio | with repeatability |",
             "|---|---|---|---|---|---|---|---|", line("all", [(r["seed"], c) for r, _, c in jobs])]  # fmt: skip
    groups: dict[str, list] = {}
    for r, name, c in jobs:
        state = name.split(" ", 1)[1]
        for key in (state, r["touches"], r["play"], r["law"], f"{r['play']}, {state}, {r['touches']}"):
            groups.setdefault(key, []).append((r["seed"], c))
    lines += [line(key, groups[key]) for key in sorted(groups, key=lambda key: (key.count(","), key))]
    for state in DAYS:
        z = [np.array(c["mean_um"]) / r["sigma_um"] for r, name, c in jobs if name.endswith(state)]
        if z:
            lines.append(f"part as a whole over sigma_um, {state}: rms {np.sqrt(np.mean(np.square(z))):.2f}, "
                         f"within 2: {100 * np.mean(np.abs(z) <= 2):.0f} %")  # fmt: skip
    return "\n".join(lines)


def main():
    options = seed_journal.parser("taught_coverage", __doc__, "0:60").parse_args()
    if not options.table:
        for seed in options.journal.left(options.seeds, options.budget):
            row = trial(seed, options.keep)
            options.journal.add(row)
            print(seed, {k: [round(v[n], 2) for n in ("hits", "error_um", "half_um")] for k, v in row["jobs"].items()},
                  flush=True)  # fmt: skip
    print(table(options.journal.rows(options.seeds)))


if __name__ == "__main__":
    main()
