"""Widths of lost motion: found from small steps either side of a turn, with the law that made them; held where not."""

import csv
import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from command_line import run
from numpy.testing import assert_allclose
from scipy.linalg import null_space
from shipped import ROOT

from compgen.core.units import DEG, MDEG, UM
from compgen.error_model.source import ReversalWidths
from compgen.identification.instrument_frames import initial_frames
from compgen.identification.linearisation import linearise
from compgen.identification.measured_poses import motion_directions, read_poses
from compgen.identification.measurements import Measurements, plain_ends
from compgen.identification.model import build_model
from compgen.identification.parameters import symbolic_sources
from compgen.identification.reversals import (
    LostMotion,
    fit_lost_motion,
    lost_motion_findings,
    with_lost_motion,
    with_runs_as_poses,
)
from compgen.pipelines.files.robot_file import load_arm
from compgen.robot.kinematics import flange_pose

PLAY = "hysteresis"
BACKLASH = np.array([2.5, 2.0, 2.5, 6.0, 7.0, 8.0]) * MDEG
WIDTH = np.array([0.12, 0.2, 0.15, 0.25, 0.1, 0.18]) * DEG
REFLECTORS = np.array([[0.06, 0.2, 0.1], [-0.1, 0.1, 0.15]])
ASSUMED = ReversalWidths(np.full(6, 0.2 * DEG), np.full(3, np.inf))


def side(theta, width, law):
    """The memory of one joint's motion, walked in steps of a thousandth of the width."""
    u, sides = 0.0, [0.0]
    for begin, end in zip(theta[:-1], theta[1:], strict=True):
        count = max(1, int(np.ceil(abs(end - begin) / width * 1000)))
        if count > 20_000:  # far beyond the width
            u = float(np.sign(end - begin))
        else:
            step = (end - begin) / width / count
            for _ in range(count):
                u = min(max(u + step, -1.0), 1.0) if law == "play" else u + (np.sign(step) - u) * abs(step)
        sides.append(u)
    return np.array(sides)


def measured(robot, theta, law, noise, seed, backlash=BACKLASH, width=WIDTH):
    """Places of the reflectors on an arm whose joints lag, (M, R, 3) [m]."""
    sides = np.column_stack([side(theta[:, i], width[i], law) for i in range(6)])
    flange = flange_pose(robot, theta - sides * backlash)
    places = flange.position[:, None] + np.einsum("nij,rj->nri", flange.rotation, REFLECTORS)
    return places + np.random.default_rng(seed).normal(0, noise, places.shape)


def measurements(theta, places):
    M, R = places.shape[:2]
    N = M * R
    return Measurements(
        theta=theta, rise=np.zeros((M, 0)), lag=np.zeros((M, 0)), direction=motion_directions(theta),
        time=np.arange(M) * 10.0, warm=np.zeros(M), pose=np.repeat(np.arange(M), R),
        instrument=np.zeros(N, dtype=int), reflector=np.tile(np.arange(R), M), ends=plain_ends(N),
        position=places.reshape(-1, 3), rotation=np.full((N, 3, 3), np.nan), sigma=np.ones(N), label=("",) * N,
        reflectors=("a", "b"), instruments=("tracker",), aligned=np.array([False]),
    )  # fmt: skip


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plan")
    words = ["--reflector", "60 200 100", "--reflector", "-100 100 150", "-n", "30", "-q"]
    assert run("plan-poses", "m710ic50", *words, "-o", folder).returncode == 0
    return folder


def joints_of(robot, file):
    rows = list(csv.DictReader(file.read_text().splitlines()))
    order = [int(row["order"]) for row in rows]
    _, first = np.unique(order, return_index=True)
    pendant = np.array([[float(rows[i][f"j{k}_deg"]) for k in range(1, 7)] for i in first])
    return robot.to_theta(pendant * DEG), rows


def test_a_run_goes_either_side_of_a_turn_in_small_steps(plan):
    robot = load_arm("m710ic50").robot
    theta, rows = joints_of(robot, plan / "reversals.csv")
    assert len(theta) == 6 * 18
    turn = np.diff(theta, axis=0)
    assert (np.abs(turn) < 2.5 * DEG).all(axis=1).sum() == 6 * 17
    assert {row["target"] for row in rows} <= {"r1", "r2"}
    program = (plan / "M710IC50_REVERSALS.LS").read_text()
    assert program.count("FINE") == len(theta)


@pytest.mark.parametrize("law", ["dahl", "play"])
@pytest.mark.parametrize("seed", range(3))
def test_width_half_width_and_law_are_found(plan, law, seed):
    robot = load_arm("m710ic50").robot
    theta, _ = joints_of(robot, plan / "reversals.csv")
    motion = fit_lost_motion(measurements(theta, measured(robot, theta, law, 10 * UM, seed)), ASSUMED)
    assert motion is not None
    assert motion.law == law
    known = np.flatnonzero(motion.measured)
    assert len(known) >= 3
    assert {0, 1} & set(known.tolist())
    off = np.log(motion.width / WIDTH) / motion.width_sigma  # of all: a run that tells little says how little
    assert np.abs(off).max() < 3.5
    assert motion.width_sigma.max() < 1.2
    assert np.abs((motion.half_width - BACKLASH)[known] / motion.half_sigma[known]).max() < 3.5
    assert (motion.half_sigma / motion.half_width)[known].max() < 0.36


def test_a_pose_that_is_missing_within_a_run_leaves_its_joint_on_its_side(plan, tmp_path):
    """Where it was taken for the middle of its play, a width of 140 mdeg had twice the half-width."""
    robot = load_arm("m710ic50").robot
    theta, rows = joints_of(robot, plan / "reversals.csv")
    half, width = np.full(6, 12 * MDEG), np.full(6, 0.15 * DEG)
    places = measured(robot, theta, "dahl", 8 * UM, 1, half, width)
    columns = ("order", *(f"j{k}_deg" for k in range(1, 7)))
    first = {int(row["order"]): [row[c] for c in columns] for row in rows}
    lines = [",".join((*columns, "target", "x_mm", "y_mm", "z_mm"))]
    for n in (n for n in range(len(theta)) if n != 7):
        lines += [",".join((*first[n], f"r{r}", *(f"{1e3 * v:.6f}" for v in places[n, r]))) for r in range(2)]
    file = tmp_path / "reversals.csv"
    file.write_text("\n".join(lines) + "\n")
    motion = fit_lost_motion(read_poses(str(file), robot, 0), ASSUMED)
    assert motion is not None
    assert motion.half_width[0] / MDEG == pytest.approx(12, abs=1)
    assert motion.width[0] / width[0] == pytest.approx(1, abs=0.2)


def test_without_play_no_width_is_known(plan):
    robot = load_arm("m710ic50").robot
    theta, _ = joints_of(robot, plan / "reversals.csv")
    motion = fit_lost_motion(measurements(theta, measured(robot, theta, "dahl", 10 * UM, 1, 0 * BACKLASH)), ASSUMED)
    assert motion is not None
    assert motion.measured.sum() <= 1


def test_poses_far_apart_are_no_run(plan):
    robot = load_arm("m710ic50").robot
    theta, _ = joints_of(robot, plan / "poses.csv")
    assert fit_lost_motion(measurements(theta, measured(robot, theta, "dahl", 10 * UM, 1)), ASSUMED) is None


def test_of_a_run_only_the_poses_at_its_ends_count_as_poses(plan):
    robot = load_arm("m710ic50").robot
    theta, _ = joints_of(robot, plan / "reversals.csv")
    data = measurements(theta, measured(robot, theta, "dahl", 10 * UM, 1))
    motion = fit_lost_motion(data, ASSUMED)
    assert motion is not None
    kept = with_runs_as_poses(data, motion)
    assert len(kept.pose) == 6 * 2 * 2


def play(angle, width):
    """The side that a joint with play is on: between two places that monotonous ways move it to, in one step each."""
    sides = [0.0]
    for step in np.diff(angle):
        sides.append(min(max(sides[-1] + step / width, -1.0), 1.0))
    return np.array(sides)


def run_of_one_joint(half, width, noise, seed):
    """A run of J2 over 14 degrees: angles, and places of two reflectors on curves of their own that play lags behind.

    The curves are cubics of the angle whose slopes change by much over the run.
    """
    steps = np.array([0.004, 0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6, 1.2, 2.0, 2.4, 2.4, 2.4, 2.4]) * DEG
    angle = np.cumsum(np.concatenate([[-0.2, 2.0 * DEG], steps, -steps]))
    theta = np.zeros((len(angle), 6))
    theta[:, 1] = angle
    rng = np.random.default_rng(seed)
    curves = rng.normal(0, [[[0.5], [2.0], [8.0], [30.0]]] * 2, (2, 4, 3))
    powers = angle[:, None] ** np.arange(4)
    slopes = np.column_stack([0 * angle, powers[:, 0], 2 * angle, 3 * angle**2])
    lag = half * play(angle, width)[:, None, None]
    places = np.moveaxis(powers @ curves - np.moveaxis(lag, 0, 1) * (slopes @ curves), 0, 1)
    return theta, places + rng.normal(0, noise, places.shape)


def test_play_is_told_from_the_slope_of_the_curve_where_a_place_is():
    """Without noise to speak of, the half-width comes back to 0.5 % although the slopes change on the way."""
    theta, places = run_of_one_joint(6 * MDEG, 0.05 * DEG, 0.01 * UM, 1)
    motion = fit_lost_motion(measurements(theta, places), ASSUMED)
    assert motion is not None
    assert motion.law == "play"
    assert motion.half_width[1] == pytest.approx(6 * MDEG, rel=5e-3)
    assert motion.width[1] == pytest.approx(0.05 * DEG, rel=0.06)  # of a grid of 10 %
    assert np.isnan(motion.half_width[[0, 2, 3, 4, 5]]).all()
    assert (motion.width[[0, 2, 3, 4, 5]] == ASSUMED.joint[0]).all()


@pytest.mark.parametrize(("noise", "seed"), [(60 * UM, 5), (1500 * UM, 5)])  # of which play is more, and less
def test_what_a_run_tells_is_bayes_rule_over_all_widths(noise, seed):
    """Numbers of full covariances: N(0, s^2 + HALF^2 m m') of what no cubic follows, at each width by itself."""
    theta, places = run_of_one_joint(4 * MDEG, 0.2 * DEG, noise, seed)
    motion = fit_lost_motion(measurements(theta, places), ASSUMED)
    assert motion is not None
    assert motion.law == "play"

    angle, widths = theta[:, 1], np.exp(np.linspace(np.log(0.003), np.log(1.0), 59)) * DEG
    fits = [np.polyfit(angle, places[:, r, x], 3) for r in range(2) for x in range(3)]
    beside = null_space((angle[:, None] ** np.arange(4)).T)  # numbers of which no cubic tells
    left = np.concatenate([beside.T @ places[:, r, x] for r in range(2) for x in range(3)])
    moved = np.array([
        np.concatenate([beside.T @ (-play(angle, w) * np.polyval(np.polyder(fit), angle)) for fit in fits])
        for w in widths
    ])  # fmt: skip
    squares = [left @ left - (left @ m) ** 2 / (m @ m) for m in moved]
    s2, half2 = min(squares) / (len(left) - 2), (8 * MDEG) ** 2
    log, halves, spreads = [], [], []
    for w, m in zip(widths, moved, strict=True):
        C = s2 * np.eye(len(left)) + half2 * np.outer(m, m)
        prior = -0.5 * ((np.log(w) - np.log(0.2 * DEG)) / 1.2) ** 2
        log.append(-0.5 * left @ np.linalg.solve(C, left) - 0.5 * np.linalg.slogdet(C)[1] + prior)
        gain = half2 * np.linalg.solve(C, m)
        halves.append(gain @ left)
        spreads.append(half2 - half2 * gain @ m)
    share = np.exp(np.array(log) - max(log))
    share /= share.sum()
    middle, half = share @ np.log(widths), share @ halves
    assert motion.width[1] == pytest.approx(np.exp(middle), rel=1e-6)
    assert motion.width_sigma[1] == pytest.approx(np.sqrt(share @ (np.log(widths) - middle) ** 2), rel=1e-6)
    assert motion.half_width[1] == pytest.approx(half, rel=1e-6)
    spread = np.sqrt(share @ (np.array(spreads) + (np.array(halves) - half) ** 2))
    assert motion.half_sigma[1] == pytest.approx(spread, rel=1e-6)


@pytest.mark.parametrize("law", ["dahl", "play"])
def test_identify_writes_the_widths_and_the_law(plan, tmp_path, law):
    arm = load_arm("m710ic50")
    for file, seed in (("poses.csv", 5), ("reversals.csv", 6)):
        theta, rows = joints_of(arm.robot, plan / file)
        places = measured(arm.robot, theta, law, 10 * UM, seed) * 1000
        first = int(rows[0]["order"])
        for row in rows:
            place = places[int(row["order"]) - first, int(row["target"][1:]) - 1]
            row.update(zip(("x_mm", "y_mm", "z_mm"), (f"{v:.4f}" for v in place), strict=True))
        with (tmp_path / file).open("w", newline="") as out:
            writer = csv.DictWriter(out, rows[0])
            writer.writeheader()
            writer.writerows(rows)
    target = tmp_path / "robot.toml"
    words = ["--poses", tmp_path / "poses.csv", "--poses", tmp_path / "reversals.csv", "-o", target, "--json"]
    result = run("identify", ROOT / "robots" / "m710ic50.toml", *words)
    assert result.returncode == 0, result.stderr + result.stdout[-3000:]
    table = tomllib.loads(target.read_text())["sources"]["hysteresis"]
    assert table["law"] == law
    assert abs(np.log(table["width_mdeg"][0] * MDEG / WIDTH[0])) < 0.8
    assert table["backlash_mdeg"][:3] == pytest.approx((BACKLASH[:3] / MDEG).tolist(), rel=0.35)
    codes = {f["code"] for f in json.loads(result.stdout)["findings"]}
    assert "reversals.width" in codes
    assert (
        run("inspect", ROOT / "nothing.LS", "--robot", target).returncode == 2
    )  # the file loads: the program is missing
    only = run("identify", ROOT / "robots" / "m710ic50.toml", *words[:2], "-o", tmp_path / "held.toml", "--json")
    assert "reversals.held" in {f["code"] for f in json.loads(only.stdout)["findings"]}


def test_a_width_that_a_run_leaves_likely_is_told_apart_from_one_that_is_held():
    """J1 is known, J2 and J4 have no run, the runs of the others leave their widths open: all were *held*."""
    arm = load_arm("m710ic50")
    half = np.array([2.0, np.nan, 0.1, np.nan, 0.1, 0.1]) * MDEG
    sigma = np.array([0.1, np.inf, 0.9, np.inf, 0.9, 0.9])
    width = np.array([120, 200, 150, 200, 89, 280]) * MDEG
    motion = LostMotion(law="play", width=width, width_sigma=sigma, half_width=half, half_sigma=np.full(6, 0.1 * MDEG))
    played = [
        s for s in symbolic_sources(arm.robot, arm.known, np.ones(6, bool), warm=False) if s.original.NAME == PLAY
    ]
    known, held, likely = (f.message for f in lost_motion_findings(arm.robot, motion, with_lost_motion(played, motion)))
    assert known.endswith("law play: J1 2 over 120")
    assert "J2 200, J4 200: held, for want of reversals" in held
    assert "J2+J3" in held  # J2 alone on the pendant turns it, too
    assert "J2+J3 150, J5 89, J6 280: likely" in likely


@pytest.mark.parametrize("law", ["dahl", "play"])
def test_wild_places_on_runs_change_nothing_by_themselves(plan, law):
    """One reading in each run, a millimetre off: width and half-width stay within what noise moves them by."""
    robot = load_arm("m710ic50").robot
    theta, _ = joints_of(robot, plan / "reversals.csv")
    places = measured(robot, theta, law, 10 * UM, 4)
    clean = fit_lost_motion(measurements(theta, places), ASSUMED)
    wild = places.copy()
    wild[18 * np.arange(6) + [3, 17, 9, 2, 12, 6], [0, 1, 0, 1, 0, 1]] += 0.6e-3 * np.array([1, -1, 1])
    motion = fit_lost_motion(measurements(theta, wild), ASSUMED)
    assert motion is not None
    assert clean is not None
    assert motion.law == clean.law == law
    off = (motion.half_width - clean.half_width) / clean.half_sigma
    assert np.abs(off).max() < 1
    known = clean.measured
    assert np.abs(np.log(motion.width / clean.width))[known].max() < 0.15


def test_play_of_a_joint_that_stands_ahead_is_known_as_well(plan):
    """Overdone compensation of backlash in the drive: the sign is another one, the runs tell as much."""
    robot = load_arm("m710ic50").robot
    theta, _ = joints_of(robot, plan / "reversals.csv")
    motion = fit_lost_motion(measurements(theta, measured(robot, theta, "play", 10 * UM, 1, -BACKLASH)), ASSUMED)
    assert motion is not None
    known = np.flatnonzero(motion.measured)
    assert len(known) >= 3
    assert np.abs((motion.half_width + BACKLASH)[known] / motion.half_sigma[known]).max() < 3.5


def test_what_runs_say_of_half_widths_are_rows_of_the_fit(plan):
    """(b_run - b) / sigma, sigma^2 = sigma_run^2 + (0.1 b_run)^2, and its slope by finite differences."""
    arm = load_arm("m710ic50")
    theta, _ = joints_of(arm.robot, plan / "reversals.csv")
    data = measurements(theta, measured(arm.robot, theta, "play", 10 * UM, 1))
    cold = np.zeros((len(theta), len(arm.nodes)))
    data = replace(data, rise=cold, lag=cold)
    motion = fit_lost_motion(data, ASSUMED)
    assert motion is not None
    kept = with_runs_as_poses(data, motion)
    model = build_model(arm.robot, symbolic_sources(arm.robot, (), np.ones(6, bool), warm=False), len(arm.nodes))
    backlash = np.array([(t.source, t.field) == ("hysteresis", "backlash") for t in model.parameters])
    p = np.where(backlash, 1 * MDEG, 0.0)
    frames = initial_frames(kept, *model.pose(kept, 0 * p))

    def known(p):
        linear = linearise(model, kept, backlash, p, frames, np.tile(np.eye(3), (2, 1, 1)))
        return linear.known, linear.C[:, :6]

    rows, slopes = known(p)
    sigma = np.hypot(motion.half_sigma, 0.1 * motion.half_width)
    assert_allclose(rows, (motion.half_width - 1 * MDEG) / sigma, rtol=1e-12)
    step = 1e-6
    for column, k in enumerate(np.flatnonzero(backlash).tolist()):
        moved, _ = known(p + step * model.prior[k] * np.eye(len(p))[k])
        assert_allclose(-(moved - rows) / step, slopes[:, column], rtol=1e-6, atol=1e-9)
