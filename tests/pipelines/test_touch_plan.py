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
from compgen.fanuc.touch_program import Signal
from compgen.identification.touch_candidates import Search
from compgen.identification.touches import read_artefact, read_touches
from compgen.pipelines.drift_model import drift_columns, forecast_prior
from compgen.pipelines.path_file import load_job
from compgen.pipelines.touch_plan import plan_path_touches
from compgen.pipelines.touch_text import positions_of, prove_touches, write_touches
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
    return plan_path_touches(day, artefact, (0, IDENTITY), count, SIGMA, Search(0.02, 0.003), centres, quiet)


def actual(job, tool, theta, rise, base):
    """Where the tool really is: the sources of the robot file on a base that has moved."""
    sources = (BaseFrame(base[:3], base[3:]), *job.sources)
    return build_error_model(job.robot, sources, rise.shape[1], tool).actual_pose(theta, rise, NO_DIRECTION).position


def test_columns_are_what_a_warmer_arm_on_a_moved_base_does(day):
    rng = np.random.default_rng(0)
    theta = day.robot.to_theta(np.radians(rng.uniform(-40, 40, (6, 6)) + np.array([0, 20, -20, 0, -70, 0])))
    start, later = day.start_rise(), rng.uniform(0, 2e4, 6)
    rise = np.tile(start, (6, 1))
    column = drift_columns(day.cell, theta, rise, later, day.tool.pose)
    zero = np.zeros(6)
    for q in range(len(start)):  # a node that is 0.01 K warmer cools as the heat model says
        other = rise.copy()
        other[:, q] += 0.01 * np.exp(-later * day.cell.heat.rate[q])
        moved = actual(day, day.tool.pose, theta, other, zero) - actual(day, day.tool.pose, theta, rise, zero)
        assert_allclose(column[:, :, q], moved / 0.01, atol=2e-11)
    for i in range(6):
        step = 1e-6 * np.eye(6)[i]
        moved = actual(day, day.tool.pose, theta, rise, step) - actual(day, day.tool.pose, theta, rise, -step)
        assert_allclose(column[:, :, len(start) + i], moved / 2e-6, atol=1e-8)


@pytest.mark.parametrize("centres", [False, True])
def test_arms_that_drift_are_known_as_well_as_the_plan_says(day, artefact, centres):
    """400 arms drawn from the prior are touched, with noise, through the whole model; the best estimate is taken."""
    planned = plan(day, artefact, centres=centres)
    prior, K = forecast_prior(day).covariance, len(day.cell.heat.names)
    rng, N = np.random.default_rng(4), 400
    probe = Pose(artefact.probe, np.eye(3))
    theta = planned.ways.theta[:, 2]
    rise = np.tile(day.start_rise(), (len(theta), 1))
    H = drift_columns(day.cell, theta, rise, np.zeros(len(theta)), probe)
    n = planned.ways.normal[:, None] if not centres else np.tile(np.eye(3), (len(theta), 1, 1))
    H = np.einsum("kri,kiq->krq", n, H).reshape(-1, prior.shape[0])
    R = np.zeros((len(H), len(H)))  # a sphere's place is off by the same in all its touches
    sphere = np.repeat(planned.ways.target, n.shape[1])
    flat = n.reshape(-1, 3)
    R[:] = (sphere[:, None] == sphere) * (flat @ flat.T) * 2e-6**2 + SIGMA**2 * np.eye(len(H))
    gain = prior @ H.T @ np.linalg.inv(H @ prior @ H.T + R)
    draws = np.linalg.cholesky(prior + 1e-18 * np.eye(len(prior))) @ rng.normal(size=(len(prior), N))
    places = actual(day, probe, theta, rise, np.zeros(6))
    error = []
    for x in draws.T:
        moved = actual(day, probe, theta, rise + x[:K], x[K:]) - places
        y = np.einsum("kri,ki->kr", n, moved).ravel()
        y += np.linalg.cholesky(R) @ rng.normal(size=len(y))
        error.append(x - gain @ y)
    off = np.einsum("miq,nq->nmi", planned.column, np.array(error))
    share = planned.length / planned.length.sum()
    assert_allclose(np.sqrt(((off**2).sum(axis=2) @ share).mean()), planned.rms[-1], rtol=0.06)


def test_the_program_reads_back_as_the_planned_poses_and_the_table_as_touches(day, artefact, tmp_path):
    """The second reader and the second arm say where the ball goes; filled in, the table is a file of touches."""
    planned = plan(day, artefact)
    signal = Signal("DI[1]=ON", 11)
    text = write_touches(planned, "TOUCH", "26-01-01", 9, signal)
    places, moves = naive_ls.read(text)
    assert len(moves) == 5 * 8
    for n in range(8):
        turn, before, search, back, away = moves[5 * n : 5 * n + 5]
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
        table = touches_csv(planned, positions_of(planned, 9, stops), stops).decode().splitlines()
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
    planned = plan_path_touches(day, there, (1, frame), 4, SIGMA, Search(0.02, 0.003), False, quiet)
    in_world = plan(day, artefact, 4)
    assert_allclose(planned.rms, in_world.rms, rtol=1e-9)
    assert b"UFRAME_NUM=1" in write_touches(planned, "TOUCH", "26-01-01", 9, None)


@pytest.mark.parametrize("model", ["nodes", "network"])
def test_with_a_state_its_covariance_is_what_is_known_beforehand(model, day, artefact, tmp_path):
    override = f"robot.thermal.model={model}"
    K = len(load_job(path_file("spiral_1300"), overrides=[override]).heat.names)
    root = np.random.default_rng(7).normal(size=(K + 6, K + 6)) * np.array([0.2] * K + [1e-5] * 3 + [1e-5] * 3)[:, None]
    state = state_of(load_job(path_file("spiral_1300"), overrides=[override]), covariance=root @ root.T)
    overrides = [override, f"state.file='{written(state, tmp_path)}'"]
    begun = load_job(path_file("spiral_1300"), overrides=overrides)
    size = np.sqrt(np.outer(np.diag(state.covariance), np.diag(state.covariance)))
    assert_allclose(forecast_prior(begun).covariance / size, state.covariance / size, atol=1e-5)
    assert plan(begun, artefact, 2).rms[-1] < plan(begun, artefact, 2).rms[0]
