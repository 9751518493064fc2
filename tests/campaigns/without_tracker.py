"""Arms calibrated without a tracker: distances and touched spheres against poses, on the same arms of the wider family.

python tests/campaigns/without_tracker.py --seeds 0:10      a row for each arm, then the table

The tracker has 60 poses x 3 reflectors, the others three times as many rows: 540 distances between reflectors at pairs
of poses, 540 sphere centres located (12 spheres that stand anywhere and one certified length, or 12 of certified
places), 540 touches from one side, 180 of each of the three. 25 um of noise on each coordinate or distance, 1 % wild.
What each robot file predicts is judged on 120 cold poses x 3 never seen, the frames fitted anew.
"""

import argparse
import sys
import tempfile
import tomllib
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[1])]

import numpy as np  # noqa: E402
from arms import HIGH, LOW, NOISE, Site, drawn_poses, identify_arm, pose_csv, robot_file, wild  # noqa: E402

from compgen.identification.touches import probing_directions  # noqa: E402
from compgen.identification.validation import validate  # noqa: E402
from compgen.pipelines.files.robot_file import arm_of, load_arm  # noqa: E402
from compgen.pipelines.measure.identification_files import (  # noqa: E402
    MeasurementFiles,
    identified_robot_text,
    read_measurements,
)
from compgen.robot.kinematics import flange_pose  # noqa: E402

ROWS = 540
PROBE = np.array([20, -10, 180]) * 1e-3
SPHERES = 12
DIAMETER, BALL = 25e-3, 6e-3
NAMES = "abcdefghijkl"
JOINTS = ",".join(f"j{k}_deg" for k in range(1, 7))


def distances_csv(site, rng, rows=ROWS):
    """Distances between reflectors at pairs of poses, driven one after the other."""
    pendant = drawn_poses(site.robot, rng, 2 * rows)
    places = site.places(pendant, np.zeros((len(pendant), 5)), rng)
    first, second = rng.integers(0, 3, (2, rows))
    ends = places[0::2][np.arange(rows), first], places[1::2][np.arange(rows), second]
    distance = np.linalg.norm(ends[0] - ends[1], axis=1) + rng.normal(0, NOISE, rows)
    distance += pushed(rng, rows)
    a, b = (",".join(f"{end}_{j}" for j in JOINTS.split(",")) for end in "ab")
    lines = [f"a_target,{a},b_target,{b},distance_mm"]
    for n in range(rows):
        qa, qb = (",".join(f"{v:.6f}" for v in np.degrees(pendant[2 * n + k])) for k in (0, 1))
        lines.append(f"r{first[n] + 1},{qa},r{second[n] + 1},{qb},{distance[n] * 1e3:.4f}")
    return "\n".join(lines) + "\n"


def pushed(rng, rows):
    """Some of so many numbers far off [m]."""
    wrong = rng.permutation(rows)[: max(1, rows // 100)]
    push = np.zeros(rows)
    push[wrong] = rng.uniform(5e-4, 5e-3, len(wrong)) * rng.choice([-1, 1], len(wrong))
    return push


def sphere_centres(site, rng):
    """Where spheres stand, well inside the range of the arm, (12, 3) [m]; the first two are the farthest apart."""
    inside = drawn_poses(site.robot, rng, 40 * SPHERES)
    share = np.abs(inside[:, :3] - (LOW + HIGH)[:3] / 2) / ((HIGH - LOW)[:3] / 2)
    centres = probe_centre(site, inside[(share < 0.6).all(axis=1)])[:SPHERES]
    apart = np.linalg.norm(centres[:, None] - centres, axis=2)
    a, b = np.unravel_index(int(np.argmax(apart)), apart.shape)
    order = [int(a), int(b), *(n for n in range(SPHERES) if n not in (a, b))]
    return centres[order]


def probe_centre(site, pendant):
    """Of the nominal arm in World, (M, 3) [m]."""
    flange = flange_pose(site.robot, site.robot.to_theta(pendant))
    return flange.position + flange.rotation @ PROBE


def touching_poses(site, rng, goal):
    """Drawn pendant angles, moved in J1 to J3 until the nominal probe is at its goals (M, 3) [m]."""
    poses, todo = np.empty((len(goal), 6)), np.arange(len(goal))
    while len(todo):
        q = drawn_poses(site.robot, rng, len(todo))
        for _ in range(12):
            gap = goal[todo] - probe_centre(site, q)
            ahead = [probe_centre(site, q + 1e-6 * np.eye(6)[k]) for k in range(3)]
            J = np.stack([(a - goal[todo] + gap) / 1e-6 for a in ahead], axis=2)
            q[:, :3] += np.clip(np.einsum("nij,nj->ni", np.linalg.pinv(J), gap), -0.5, 0.5)
        theta = site.robot.to_theta(q)
        done = np.linalg.norm(goal[todo] - probe_centre(site, q), axis=1) < 1e-6
        done &= ((theta > site.robot.lower) & (theta < site.robot.upper) & (q > LOW) & (q < HIGH)).all(axis=1)
        poses[todo[done]] = q[done]
        todo = todo[~done]
    return poses


def touches_csv(site, rng, centres, rows, sided):
    """Touches of spheres by the probe, centres located or from one side."""
    target = np.arange(rows) % SPHERES
    normal = rng.normal(size=(rows, 3)) * [1, 1, 0.5] - [0, 0, 0.6]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    radius = (DIAMETER + BALL) / 2
    pendant = touching_poses(site, rng, centres[target] - sided * normal * radius)
    q = site.robot.to_theta(pendant)
    side = probing_directions(site.robot, q, normal) if sided else np.sign(np.vstack([q[0] * 0, np.diff(q, axis=0)]))
    T = site.arm.flange(q, np.zeros((rows, 5)), side, rng)
    away = centres[target] - T[:, :3, 3] - T[:, :3, :3] @ PROBE
    noise = rng.normal(0, NOISE, (rows, 3)) + rng.normal(size=(rows, 3)) * pushed(rng, rows)[:, None]
    along = (away * normal).sum(axis=1)
    across = np.linalg.norm(away - along[:, None] * normal, axis=1)
    # how far the ball is pushed back where the sphere is met; a centre is found by an arm that follows the probe
    value = np.sqrt(radius**2 - across**2) - along + noise[:, 0]
    pendant = pendant if sided else settled(site, q, away + noise)
    lines = [f"target,{JOINTS},nx,ny,nz,value_mm" if sided else f"target,{JOINTS}"]
    for n in range(rows):
        cells = [NAMES[target[n]], *(f"{v:.6f}" for v in np.degrees(pendant[n]))]
        cells += [*(f"{v:.9f}" for v in normal[n]), f"{value[n] * 1e3:.4f}"] if sided else []
        lines.append(",".join(cells))
    return "\n".join(lines) + "\n"


def settled(site, q, away):
    """Pendant angles after the arm has followed its probe, pushed aside by ``away`` (M, 3) [m] at theta ``q``."""
    still = np.zeros_like(q)

    def probe(theta):
        T = site.arm.flange(theta, np.zeros((len(q), 5)), still)
        return T[:, :3, 3] + T[:, :3, :3] @ PROBE

    J = np.stack([(probe(q + 1e-6 * np.eye(6)[k]) - probe(q)) / 1e-6 for k in range(3)], axis=2)
    step = np.zeros_like(q)
    step[:, :3] = np.einsum("nij,nj->ni", np.linalg.inv(J), away)
    return site.robot.to_pendant(q + step)


def artefact_toml(centres, known):
    """What was touched: spheres of certified places, or anywhere with one length that is certified."""
    lines = ["[artefact]", "certified = true", "[probe]", f"diameter_mm = {BALL * 1e3}"]
    lines += [f"{k}_mm = {v}" for k, v in zip("xyz", PROBE * 1e3, strict=False)]
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    for name, place in zip(NAMES, centres @ (turn * np.sign(np.linalg.det(turn))) * 1e3, strict=False):
        lines += ["[[sphere]]", f'name = "{name}"', f"diameter_mm = {DIAMETER * 1e3}"]
        lines += [f"{k}_mm = {v:.6f}" for k, v in zip("xyz", place, strict=False)] if known else []
    if not known:
        lines += ["[[length]]", 'between = ["a", "b"]', f"mm = {np.linalg.norm(centres[0] - centres[1]) * 1e3:.6f}"]
    return "\n".join(lines) + "\n"


def campaign(site, seed, kind, folder):
    """The files of a way to calibrate."""
    rng = np.random.default_rng([seed, 9])
    folder = Path(folder) / kind.replace(" ", "_")
    folder.mkdir()
    if kind == "tracker":
        cold = drawn_poses(site.robot, rng, 60)
        text = pose_csv(cold, wild(site.measured(cold, np.zeros((60, 5)), rng), rng), np.arange(60.0) * 30)
        (folder / "cold.csv").write_text(text)
        return MeasurementFiles(poses=[str(folder / "cold.csv")])
    third = ROWS // 3
    if kind in ("distances", "all three"):
        (folder / "distances.csv").write_text(distances_csv(site, rng, ROWS if kind == "distances" else third))
    if kind == "distances":
        return MeasurementFiles(distances=[str(folder / "distances.csv")])
    centres = sphere_centres(site, rng)
    (folder / "artefact.toml").write_text(artefact_toml(centres, "places" in kind))
    rows = third if kind == "all three" else ROWS
    touches: list[str] = []
    for sided in (False, True):
        if kind == "all three" or ("sides" in kind) == sided:
            touches.append(str(folder / f"touches_{len(touches)}.csv"))
            Path(touches[-1]).write_text(touches_csv(site, rng, centres, rows, sided))
    return MeasurementFiles(distances=[str(folder / "distances.csv")] if kind == "all three" else [], touches=touches)


KINDS = ("tracker", "distances", "centres and a length", "centres of places", "sides and a length", "all three")


def run(seed, kinds=KINDS):
    """Rms on poses never seen, of each way [um a coordinate], and the held-out error that it says of itself."""
    row = {"seed": seed}
    with tempfile.TemporaryDirectory() as folder:
        nominal = load_arm(robot_file(folder))
        site = Site(seed, nominal.robot)
        rng = np.random.default_rng([seed, 11])
        pendant = drawn_poses(site.robot, rng, 120)
        fresh = Path(folder) / "fresh.csv"
        fresh.write_text(pose_csv(pendant, site.measured(pendant, np.zeros((120, 5)), rng), np.arange(120.0)))
        for kind in kinds:
            files = campaign(site, seed, kind, folder)
            data, _ = read_measurements(nominal, files, force=False)
            result = identify_arm(nominal, data, False)
            text = identified_robot_text(nominal, result, files.names)
            arm = arm_of(tomllib.loads(text), text, "identified.toml")
            unseen, _ = read_measurements(arm, MeasurementFiles(poses=[str(fresh)]), force=True)
            left = validate(arm.robot, arm.known, unseen, len(arm.nodes), None)
            row[kind] = float(np.sqrt((left.identified[~left.outlier] ** 2).mean() / 3) * 1e6)
            row[f"{kind}: held out"] = result.selected.cross_validation.mean * 1e6
            row[f"{kind}: refused"] = result.refused
            row[f"{kind}: nominal"] = float(np.sqrt((left.nominal**2).mean() / 3) * 1e6)
            print({k: round(v, 1) for k, v in row.items() if kind in k or k == "seed"}, flush=True)
    return row


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", default="0:10")
    parser.add_argument("--kinds", default="; ".join(KINDS), help="some of the ways; the tracker is always one")
    options = parser.parse_args()
    first, last = map(int, options.seeds.split(":"))
    kinds = list(dict.fromkeys(["tracker", *options.kinds.split("; ")]))
    rows = [run(seed, kinds) for seed in range(first, last)]
    for kind in kinds:
        left = np.array([r[kind] for r in rows])
        share = left / np.array([r["tracker"] for r in rows])
        k = int(np.argmax(share))
        print(f"{kind}: median {np.median(left):.1f} um, over the tracker's {np.median(share):.2f}, "
              f"worst {share[k]:.2f} (seed {rows[k]['seed']})")  # fmt: skip


if __name__ == "__main__":
    main()
