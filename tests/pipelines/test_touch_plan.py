"""Touches planned for a path: what they are expected to leave, judged by an arm that drifts and is then touched."""

from dataclasses import replace

import naive_ls
import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import path_file, quiet
from states import state_of, written

from compgen.core.exceptions import ImpossibleError
from compgen.core.pose import IDENTITY, Pose
from compgen.core.rotations import from_wpr
from compgen.error_model.direction_memory import NO_DIRECTION
from compgen.error_model.model import build_error_model
from compgen.error_model.sources.frames import BaseFrame
from compgen.identification.touch_candidates import Search
from compgen.identification.touches import Touches, read_artefact, read_touches
from compgen.job.anchored_start import cell_with_state
from compgen.pipelines.anchor import anchor
from compgen.pipelines.anchor.estimate import path_places
from compgen.pipelines.anchor.touch_model import left_by_anchoring
from compgen.pipelines.anchor.touch_plan import plan_path_touches, positions_of, prove_touches, write_touches
from compgen.pipelines.files.path_file import load_job
from compgen.program.program import Signal
from compgen.report.touch_plan import touches_csv

SIGMA = 12e-6
PLACES = {"a": (700, -680), "b": (2000, -680), "c": (700, 620), "d": (1900, 500)}
PROBE = "[probe]\ndiameter_mm = 6\nz_mm = 150\n"


def artefact_text(
    head="certified = true", places=PLACES, z=203, sphere="diameter_mm = 30\nsigma_um = 2\n", probe=PROBE
):
    spheres = [
        f'[[sphere]]\nname = "{n}"\n' + (f"x_mm = {xy[0]}\ny_mm = {xy[1]}\nz_mm = {z}\n" if xy else "") + sphere
        for n, xy in places.items()
    ]
    return f"[artefact]\n{head}\n" + "".join(spheres) + probe


@pytest.fixture(scope="module")
def day():
    return load_job(path_file("spiral_1300"))


@pytest.fixture(scope="module")
def artefact(tmp_path_factory):
    file = tmp_path_factory.mktemp("artefact") / "artefact.toml"
    file.write_text(artefact_text())
    return read_artefact(str(file))


def plan(day, artefact, count=8, centres=False):
    return plan_path_touches(day, artefact, (0, IDENTITY), count, SIGMA, Search(0.02, 0.003, centres), quiet)


def actual(job, tool, theta, rise, base):
    """Where the tool really is: the sources of the robot file on a base that has moved."""
    sources = (BaseFrame(base[:3], base[3:]), *job.sources)
    return build_error_model(job.robot, sources, rise.shape[1], tool).actual_pose(theta, rise, NO_DIRECTION).position


def place_of(cell, tool, theta, rise):
    """Where a cell's tool really is at rises (K,)."""
    model = build_error_model(cell.robot, cell.sources, len(rise), tool)
    return model.actual_pose(theta, np.tile(rise, (len(theta), 1)), NO_DIRECTION).position


def touches_of(cell, artefact, ways, rise, noise):
    """One-sided touches that an arm makes: pushed back along the direction by where it really is."""
    n, theta = len(ways.target), ways.theta[:, 2]
    there = place_of(cell, Pose(artefact.probe, np.eye(3)), theta, rise)
    off = np.einsum("ni,ni->n", there - ways.position[:, 2], ways.normal) + noise
    sigma = np.full(n, SIGMA)
    return Touches(
        label=("x",) * n,
        time=np.zeros(n),
        timed=False,
        target=ways.target,
        theta=theta,
        normal=ways.normal,
        deflection=off,
        sigma=sigma,
    )


def test_arms_that_drift_are_known_as_well_as_the_plan_says(day, artefact):
    """24 arms drawn from what the forecast leaves open are touched, with noise, and anchored: what is left of the path.

    The plan counts what the thermal physics leaves out as well, which these arms do not have.
    """
    planned, path, rng = plan(day, artefact), path_places(day), np.random.default_rng(5)
    K = len(day.heat.names)
    expected = anchor(day, artefact, touches_of(day.cell, artefact, planned.ways, day.start_rise(), 0.0), IDENTITY)
    unknowns = expected.unknowns
    values, vectors = np.linalg.eigh(unknowns.prior.forecast)
    draws = rng.normal(size=(24, len(values))) * np.sqrt(np.maximum(values, 0)) @ vectors.T
    square: dict[str, list[float]] = {"before": [], "after": []}
    for x in draws:
        base, drift = x[K : K + 6], x[K + 6 :] / unknowns.unit
        rise = day.start_rise() + x[:K]
        state = state_of(
            day, rise=rise, base=base, drifting=unknowns.named, drift=drift, covariance=np.zeros((len(x),) * 2)
        )
        truth = cell_with_state(day.cell, state, "truth")
        touches = touches_of(truth, artefact, planned.ways, rise, SIGMA * rng.normal(size=8))
        believed_state = anchor(day, artefact, touches, IDENTITY).state
        believed = cell_with_state(day.cell, believed_state, "state")
        models = (truth, rise), (believed, believed_state.rise), (day.cell, day.start_rise())
        places = [place_of(cell, day.tool.pose, path.theta, warm) for cell, warm in models]
        square["after"].append(((places[0] - places[1]) ** 2).sum(axis=1).mean())
        square["before"].append(((places[0] - places[2]) ** 2).sum(axis=1).mean())
    before, after = (np.sqrt(np.mean(square[k])) for k in ("before", "after"))
    assert 0.7 * planned.rms[0] < before < 1.1 * planned.rms[0]
    assert 0.6 * planned.by_anchoring < after < 1.1 * planned.by_anchoring
    assert planned.rms[-1] < planned.by_anchoring < 1.1 * planned.rms[-1]


def test_chosen_touches_leave_less_to_anchoring_than_touches_from_above(day, artefact):
    """Eight from above, two on each sphere, as a shop would touch; and eight at random, ten times."""
    planned = plan(day, artefact)
    after = left_by_anchoring(day, artefact, IDENTITY, planned.ways, SIGMA, path_places(day))
    rng, all_ways = np.random.default_rng(2), planned.all_ways
    from_above = np.flatnonzero(all_ways.normal[:, 2] < -0.99)
    shop = [from_above[all_ways.target[from_above] == s][k] for s in range(4) for k in (0, 5)]
    others = [shop, *(rng.choice(len(all_ways.target), 8, replace=False) for _ in range(10))]
    for other in others:
        ways = all_ways.subset(np.array(other))
        assert after < left_by_anchoring(day, artefact, IDENTITY, ways, SIGMA, path_places(day))


def test_rows_are_what_a_warmer_arm_on_a_moved_base_does(day, artefact):
    planned = plan(day, artefact)
    K, rows = len(day.heat.names), planned.model.rows[planned.plan.chosen]
    theta, tool = planned.ways.theta[:, 2], Pose(artefact.probe, np.eye(3))
    rise, zero = np.tile(day.start_rise(), (8, 1)), np.zeros(6)
    for q in range(K):
        warmer = actual(day, tool, theta, rise + 0.01 * np.eye(K)[q], zero) - actual(day, tool, theta, rise, zero)
        assert_allclose(rows[:, :, q], warmer / 0.01, atol=2e-11)
    for i in range(6):
        step = 1e-6 * np.eye(6)[i]
        there = actual(day, tool, theta, rise, step) - actual(day, tool, theta, rise, -step)
        assert_allclose(rows[:, :, K + i], there / 2e-6, atol=1e-8)


def test_a_target_s_own_error_is_the_same_in_all_its_touches(day, artefact):
    """Certified to 200 um, spheres say little of the base; to 2 um much."""
    vague = replace(artefact, sigma=np.full(4, 200e-6))
    assert plan(day, vague).rms[-1] > 1.4 * plan(day, artefact).rms[-1]


def test_the_program_reads_back_as_the_planned_poses_and_the_table_as_touches(day, artefact, tmp_path):
    """The second reader and the second arm say where the ball goes; filled in, the table is a file of touches."""
    planned = plan(day, artefact)
    signal = Signal("DI[1]=ON", 11)
    text = write_touches(planned, "TOUCH", "26-01-01", 9, signal)
    places, moves = naive_ls.read(text)
    assert len(moves) == 1 + 5 * 8
    for n in range(8):
        turn, before, search, back, away = moves[1 + 5 * n : 6 + 5 * n]
        assert (turn.letter, before.letter, search.letter) == ("J", "L", "L")
        assert search.rest.strip() == f"Skip,LBL[99],PR[{11 + n}]=LPOS"
        assert (back.targets, away.targets) == (before.targets, turn.targets)
        x0, x1 = (
            np.array([places[int(m.targets[0][2:-1])].groups[1].axes[a] for a in "XYZ"]) for m in (before, search)
        )
        way = planned.ways.normal[n]
        assert_allclose(x1 - x0, 23 * way, atol=2e-3)
        sphere = np.array([*PLACES[planned.targets.name[planned.ways.target[n]]], 203])
        assert_allclose(x0 + 20 * way + 18 * way, sphere, atol=2e-3)
    for stops in (True, False):
        table = touches_csv(planned, positions_of(planned, 9, stops=stops), stops=stops).decode().splitlines()
        rows = [row.split(",") for row in table[1:]]
        for n, row in enumerate(rows):
            row[0] = str(60 * n)
            numbers = planned.ways.position[n, 2] * 1e3
            if stops:
                assert_allclose([float(v) for v in row[2:5]], numbers, atol=1e-3)
            else:
                assert row[2:5] == ["", "", ""]
                row[2:5] = [f"{v:.3f}" for v in numbers]
        file = tmp_path / "touches.csv"
        file.write_text("\n".join([table[0], *(",".join(row) for row in rows)]) + "\n")
        touches = read_touches(str(file), day.robot, artefact, {})
        assert_allclose(touches.theta, planned.ways.theta[:, 2], atol=5e-4)
        assert_allclose(touches.normal, planned.ways.normal, atol=1e-8)
        assert [artefact.names[s] for s in touches.target] == [row[1] for row in rows]
        assert_allclose(touches.sigma, SIGMA)


@pytest.mark.parametrize("centres", [True, False])
def test_play_at_the_first_touch_comes_from_the_program_alone(day, artefact, centres):
    """Wherever the arm was: the play operator of 0.2 deg, driven through the written positions from both ends of it."""
    planned = plan(day, artefact, centres=centres)
    places, moves = naive_ls.read(write_touches(planned, "TOUCH", "26-01-01", 9, Signal("DI[1]=ON", 11)))
    numbers = [int(m.targets[0][2:-1]) - 1 for m in moves[:4]]
    assert numbers[0] % 3 == 0
    assert numbers[1:] == [0, 1, 2]
    assert len(places) == 3 * 8
    theta = planned.ways.theta[:, [0, 1, 3]].reshape(-1, 6)[numbers]
    ends = []
    for u in (np.ones(6), -np.ones(6)):
        for step in np.diff(theta, axis=0):
            u = np.clip(u + step / np.radians(0.2), -1, 1)
        ends.append(u)
    assert_allclose(ends[0], ends[1], atol=1e-9)


def test_a_program_that_says_other_poses_is_refused(day, artefact):
    """The proof notices a position that is 5 um elsewhere."""
    planned = plan(day, artefact, 2)
    moved = np.array(planned.ways.position)
    moved[1, 0, 0] += 5e-6
    other = replace(planned, ways=replace(planned.ways, position=moved))
    text = write_touches(planned, "TOUCH", "26-01-01", 9, None)
    assert b"PAUSE" in text
    with pytest.raises(ImpossibleError, match="touch 2"):
        prove_touches(other, text, 9, [0, 1, 2])


def test_more_touches_never_leave_more(day, artefact):
    assert (np.diff(plan(day, artefact, 20).rms) < 0).all()


def test_touches_in_the_part_s_frame_are_written_in_it(day, artefact):
    frame = Pose(np.array([1.3, -0.1, 0.2]), from_wpr(*np.radians([[0.5], [-0.3], [20.0]]))[0])
    there = replace(artefact, place=frame.inverse().act(artefact.place), frame="uframe 1")
    planned = plan_path_touches(day, there, (1, frame), 4, SIGMA, Search(0.02, 0.003), quiet)
    in_world = plan(day, artefact, 4)
    assert_allclose(planned.rms, in_world.rms, rtol=1e-9)
    assert b"UFRAME_NUM=1" in write_touches(planned, "TOUCH", "26-01-01", 9, None)


@pytest.mark.parametrize("model", ["nodes", "network"])
def test_with_a_state_what_it_knows_is_known_beforehand(model, day, artefact, tmp_path):
    """Rises to 0.01 K and the base to 1 um: next to nothing is left to touch for but what drifts afterwards."""
    override = f"robot.thermal.model={model}"
    job = load_job(path_file("spiral_1300"), overrides=[override])
    K = len(job.heat.names)
    known = np.diag([0.01**2] * K + [1e-6**2] * 3 + [1e-8**2] * 3)
    before = []
    for factor in (1, 1e4):
        state = written(state_of(job, covariance=factor * known), tmp_path)
        begun = load_job(path_file("spiral_1300"), overrides=[override, f"state.file='{state}'"])
        before.append(plan(begun, artefact, 6).rms[0])
    assert before[1] > 2 * before[0]
