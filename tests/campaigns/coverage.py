"""Does the band hold? Arms that nobody tuned to, identified, and their errors along the shipped circle and spiral.

python tests/campaigns/coverage.py --seeds 0:60             a row for each arm, then the table; again goes on
python tests/campaigns/coverage.py --seeds 0:60 --table     only the table of what is in coverage.jsonl

Each arm of ``arms.py`` is measured and identified; the robot file with its posterior is read as a user's is. Along the
circle and the spiral of 1.3 m, tool down, cold, after 2 h and 6 h of another program and 2 h of cooling, the true place
of the tool (with its repeatability) is compared with the predicted one: that is what a corrected program leaves. The
band is the package's own (``pipelines/uncertainty/band_columns.py``), of what was identified: the rises are given, as
sensors give them. Whole paths: the largest of 59 drawn paths is what 95 % of arms stay within with 95 % confidence.
"""

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[2]), str(Path(__file__).resolve().parent)]

import numpy as np  # noqa: E402
from arms import (  # noqa: E402
    Site,
    campaign_files,
    identify_arm,
    robot_file,
)
from wider_arm import NODES  # noqa: E402

from compgen.core.files import POSTERIOR  # noqa: E402
from compgen.core.pose import Pose  # noqa: E402
from compgen.error_model.direction_memory import DirectionState  # noqa: E402
from compgen.error_model.model import build_error_model  # noqa: E402
from compgen.job.uncertainty import JobUncertainty, quantities_of_cell  # noqa: E402
from compgen.pipelines.files.robot_file import load_arm, load_cell  # noqa: E402
from compgen.pipelines.measure.fitted_law import with_law_of  # noqa: E402
from compgen.pipelines.measure.identification_files import MeasurementFiles, identified_texts, read_measurements  # noqa: E402
from compgen.pipelines.uncertainty.band_columns import Places, columns_at  # noqa: E402
from compgen.robot.inverse_kinematics import Posture  # noqa: E402
from compgen.robot.joint_path import follow_branch  # noqa: E402
from compgen.thermal.schedule import History  # noqa: E402
from compgen.verification.band import COVERAGE, band_of, random_field  # noqa: E402

JOURNAL = Path(__file__).with_name("coverage.jsonl")
STATES = (("cold", 0, 0), ("2h", 6, 2), ("6h", 6, 6), ("cooled", 6, 8))  # hours of warming, and when
TOOL = Pose(np.array([0, 0, 0.15]), np.eye(3))
DRAWS = 59  # whose largest is kept by 95 % of arms with 95 % confidence
IDENTIFIED = "identified "  # how quantities of a posterior are called


def shipped_paths(robot):
    """Joints along the circle and the spiral of 1.3 m as they are shipped, tool pointing down."""
    paths = {}
    for name, count, turns in (("circle", 160, 1), ("spiral", 300, 8)):
        turn = np.linspace(0, 2 * np.pi * turns, count)
        r = 0.65 * np.linspace(0 if turns > 1 else 1, 1, count)
        place = np.column_stack([1.35 + r * np.cos(turn), -0.03 + r * np.sin(turn), np.full(count, 0.203)])
        down = np.tile(np.diag([1.0, -1, -1]), (count, 1, 1))
        paths[name] = follow_branch(robot, Pose(place, down), Posture())
    return paths


def run(seed):
    """One arm: what its robot file leaves open along the paths, and where the arm really is."""
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        nominal = load_arm(robot_file(folder))
        site = Site(seed, nominal.robot)
        cold, warm, log = campaign_files(site, seed, folder, NODES)
        nominal = with_law_of(nominal, log, "start")
        data, _ = read_measurements(nominal, MeasurementFiles(poses=[cold], warm_up=[warm], log=log), force=False)
        result = identify_arm(nominal, data, True)
        text, posterior = identified_texts(nominal, result, [cold, warm, log], f"mine{POSTERIOR}")
        (Path(folder) / "mine.toml").write_text(text)
        (Path(folder) / f"mine{POSTERIOR}").write_text(posterior)
        cell = load_cell(str(Path(folder) / "mine.toml"))
    row = {"seed": seed, "refused": result.refused, "model": result.selected.candidate.name,
           "play": site.arm.play_law, "noise_um": cell.fit.noise * 1e6, "missing": cell.fit.missing,
           "scale": cell.fit.scale, "blocks": cell.fit.blocks, "cells": {}}  # fmt: skip
    for path, q in shipped_paths(nominal.robot).items():
        row["cells"] |= {f"{path} {state}": cell_row for state, cell_row in along(site, cell, seed, q).items()}
    return row | {"seconds": round(time.perf_counter() - start, 1)}


def along(site, cell, seed, q):
    """Of each state: squared errors, squared bands and hits along World x, y, z, and whether the whole path is kept."""
    level = np.random.default_rng([seed, 11]).uniform(0.85, 1.15, 5)
    rng = np.random.default_rng([seed, 23])
    side = np.sign(np.gradient(q, axis=0))
    known = quantities_of_cell(cell)
    own = JobUncertainty(known.parameters, tuple(k for k in known.quantities if k.name.startswith(IDENTIFIED)))
    model = build_error_model(cell.robot, cell.sources, len(cell.heat.names), TOOL)
    motion = DirectionState(side, np.zeros((len(q), 3)))
    rows = {}
    for name, hours, at in STATES:
        rise = np.repeat(site.arm.rises(np.array([at * 3600.0]), hours, level), len(q), axis=0) * bool(hours)
        T = site.arm.flange(q, rise, side, rng)
        true = T[:, :3, 3] + T[:, :3, :3] @ TOOL.position
        error = model.actual_pose(q, rise, motion).position - true
        columns = columns_at(
            cell,
            History(),
            0.1,
            own,
            Places(theta=q, time=np.zeros(len(q)), rise=rise, motion=motion, tool=TOOL),
            model,
        )
        moment = band_of([columns], np.arange(len(q)), np.zeros(len(q)), cell.fit.scale).moment[:, [0, 3, 5]]
        half = COVERAGE * np.sqrt(moment)
        size = np.sqrt(sum(v**2 for v in columns.undirected.values()))[:, None]
        drawn = []
        for _ in range(DRAWS):
            z = rng.normal(size=len(columns.deviation)) * columns.deviation
            field = size * random_field(rng, true)
            drawn.append(np.linalg.norm(cell.fit.scale * (columns.column @ z + field), axis=1).max())
        largest = float(np.linalg.norm(error, axis=1).max())
        rows[name] = {
            "hits": (np.abs(error) <= half).sum(axis=0).tolist(), "count": len(q),
            "error_um2": (1e12 * (error**2).sum(axis=0)).tolist(),
            "half_um2": (1e12 * (half**2).sum(axis=0)).tolist(),
            "largest_um": 1e6 * largest, "guaranteed_um": 1e6 * max(drawn), "kept": bool(largest <= max(drawn)),
        }  # fmt: skip
    return rows


def pooled(rows, names):
    """Coverage of arms, (A,), and the band over the true rms."""
    hits = np.array([[np.sum(r["cells"][n]["hits"]) for n in names] for r in rows]).sum(axis=1)
    count = sum(3 * rows[0]["cells"][n]["count"] for n in names)
    error = np.array([[np.sum(r["cells"][n]["error_um2"]) for n in names] for r in rows]).sum()
    half = np.array([[np.sum(r["cells"][n]["half_um2"]) for n in names] for r in rows]).sum()
    return hits / count, float(np.sqrt(half / error))


def interval(values):
    """95 % bootstrap interval of the mean over arms."""
    rng = np.random.default_rng(0)
    means = values[rng.integers(0, len(values), (4000, len(values)))].mean(axis=1)
    return np.quantile(means, [0.025, 0.975])


def table(rows):
    """What was covered: pooled, each cell, each axis, whole paths, and the worst arm."""
    names = list(rows[0]["cells"])
    every, ratio = pooled(rows, names)
    low, high = interval(every)
    kept = np.array([[r["cells"][n]["kept"] for n in names] for r in rows])
    lines = [f"{len(rows)} arms, accepted {sum(not r['refused'] for r in rows)}",
             f"pooled {100 * every.mean():.1f} % ({100 * low:.1f} to {100 * high:.1f}); band {ratio:.2f} x true rms; "
             f"whole paths kept {100 * kept.mean():.1f} %"]  # fmt: skip
    for n in names:
        share, ratio = pooled(rows, [n])
        rms = np.sqrt(np.mean([np.sum(r["cells"][n]["error_um2"]) / r["cells"][n]["count"] / 3 for r in rows]))
        lines.append(f"{n}: {100 * share.mean():.1f} %, rms {rms:.0f} um, band {ratio:.2f} x, "
                     f"whole path {100 * np.mean([r['cells'][n]['kept'] for r in rows]):.0f} %")  # fmt: skip
    for k, axis in enumerate("xyz"):
        hits = sum(r["cells"][n]["hits"][k] for r in rows for n in names)
        lines.append(f"World {axis}: {100 * hits / sum(r['cells'][n]['count'] for r in rows for n in names):.1f} %")
    worst = int(np.argmin(every))
    lines.append(f"worst arm: seed {rows[worst]['seed']} {100 * every[worst]:.0f} % ({rows[worst]['play']})")
    scale = [r["scale"] for r in rows]
    lines.append(f"scale: median {np.median(scale):.2f}, largest {max(scale):.2f}")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", default="0:60")
    parser.add_argument("--journal", default=str(JOURNAL))
    parser.add_argument("--table", action="store_true")
    options = parser.parse_args()
    first, last = map(int, options.seeds.split(":"))
    journal = Path(options.journal)
    rows = [json.loads(line) for line in journal.read_text().splitlines()] if journal.exists() else []
    rows = [r for r in rows if first <= r["seed"] < last]
    for seed in range(first, last) if not options.table else ():
        if seed not in {r["seed"] for r in rows}:
            rows.append(run(seed))
            with journal.open("a") as file:
                file.write(json.dumps(rows[-1]) + "\n")
            print({k: v for k, v in rows[-1].items() if k != "cells"}, flush=True)
    print(table(sorted(rows, key=lambda r: r["seed"])))


if __name__ == "__main__":
    main()
