"""Days that nobody tuned to: what anchoring by touches leaves of the drift along the shipped spiral.

python tests/campaigns/days.py --seeds 0:200                a row for each day, then the table; again goes on
python tests/campaigns/days.py --seeds 0:200 --table        only the table of what is in days.jsonl
python tests/campaigns/days.py --seeds 0:200 --touches 4    fewer or more touches

Breaks, doors, laws and sensors of each day: ``tests/simulated_days.py``; every second one has a log. Eight touches,
each locating one of four spheres around the spiral with 12 um a coordinate, on the twin's arm. Kinds of days:
``plain``, ``base`` (it has moved by 0.2 mm), ``knocked`` (a sphere by 0.5 mm), ``shipped`` (the robot file as it is
shipped, never identified), ``geometry`` (the cold arm is off by its sigmas, and places are an instrument's),
``taught`` (the same arm, but it has taught the places itself).
"""

import argparse
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).resolve().parents[2]), str(Path(__file__).resolve().parents[1])]
sys.path[:0] = [str(Path(__file__).resolve().parent)]

import compgen.cli.blas_threads  # noqa: E402, F401, I001  one thread a matrix product; before numpy

import numpy as np  # noqa: E402
from seed_journal import Journal  # noqa: E402
from simulated_days import IDENTIFIED, NOISE, drawn_day, outcome, share_of_shift  # noqa: E402

from compgen.core.exceptions import CompgenError  # noqa: E402

UM = 1e-6
JOURNAL = Path(__file__).with_name("days.jsonl")
KINDS = ("plain", "base", "knocked", "shipped", "geometry", "taught")


def run(seed, kind, touches):
    """One day."""
    rng = np.random.default_rng([seed, 29])
    way = rng.normal(size=3)
    way /= np.linalg.norm(way)
    changes: dict[str, Any] = {}  # what is changed in the day, each of its own kind
    if kind == "base":
        changes["base"] = np.concatenate([200 * UM * way, np.zeros(3)])
    if kind == "knocked":
        changes["knocked"] = (str(rng.choice(list("abcd"))), 500 * UM * way)
    if kind in ("geometry", "taught"):
        changes["geometry"] = 1.0
    overrides = () if kind == "shipped" else IDENTIFIED
    row = {"seed": seed, "kind": kind, "touches": touches}
    with tempfile.TemporaryDirectory() as folder:
        day = drawn_day(seed, folder, count=touches, overrides=overrides, taught=kind == "taught", **changes)
        try:
            result, sizes = outcome(day)
        except CompgenError as failure:
            return {**row, "verdict": "refused", "reason": str(failure).replace(folder, "")}
    row |= {"verdict": result.verdict, "reason": result.reason, "moved": [m.what for m in result.moved if m.is_sure]}
    row |= {name: [round(v / UM, 2) for v in size] for name, size in sizes.items()}
    if kind == "base":
        row["shift_um"] = share_of_shift(day, result) / UM
    if kind == "knocked":
        row["right"] = row["moved"] == [f"sphere {changes['knocked'][0]}"]
    return row


def table(rows):
    """A line for each kind."""
    print("kind       days  anchored  leave it  cannot tell  moved  refused | rms p99 before | after | worse by")
    for kind in KINDS:
        of_kind = [r for r in rows if r["kind"] == kind]
        if not of_kind:
            continue
        verdicts = [sum(r["verdict"] == v for r in of_kind) for v in
                    ("anchored", "leave it", "cannot tell", "something moved", "refused")]  # fmt: skip
        judged = [r for r in of_kind if "after" in r]
        key = " total" if kind == "geometry" else ""
        before, after = (np.array([r[f"{side}{key}"] for r in judged]) for side in ("before", "after"))
        rms = [np.sqrt(np.mean(side[:, 0] ** 2)) for side in (before, after)]
        p99 = [np.percentile(side[:, 1], 99) for side in (before, after)]
        worse = (after[:, 0] - before[:, 0]).max()
        print(f"{kind:9} {len(of_kind):5} {verdicts[0]:9} {verdicts[1]:9} {verdicts[2]:12} {verdicts[3]:6} "
              f"{verdicts[4]:8} | {rms[0]:6.1f} {p99[0]:6.1f} | {rms[1]:6.1f} {p99[1]:6.1f} largest rms "
              f"{after[:, 0].max():.1f} | "
              f"{worse:5.1f} (noise {NOISE / UM:g})")  # fmt: skip
        if kind == "base":
            off = np.array([r["shift_um"] for r in judged])
            named = sum("the base" in r["moved"] for r in judged)
            print(f"          base named on {named}; displacement of the part found to {off.max():.1f} um at most")
        if kind == "knocked":
            print(f"          sphere named on {sum(r['right'] for r in judged)} of {len(of_kind)}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="0:200")
    parser.add_argument("--kinds", default="plain")
    parser.add_argument("--touches", type=int, default=8)
    parser.add_argument("--table", action="store_true")
    asked = parser.parse_args()
    for kind in asked.kinds.split(","):
        journal = Journal(JOURNAL.with_name(f"days_{kind}_{asked.touches}.jsonl"))
        seeds = range(*map(int, asked.seeds.split(":")))
        for seed in () if asked.table else journal.left(seeds):
            row = run(seed, kind, asked.touches)
            journal.add(row)
            print(seed, kind, row["verdict"], row["reason"][:90], row.get("before"), row.get("after"), flush=True)
        table(journal.rows(seeds))


if __name__ == "__main__":
    main()
