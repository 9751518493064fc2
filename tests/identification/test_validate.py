"""validate: outliers, one pose, warm poses, units, bounds; parameters sorted by what they move."""

import json
from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from campaign import SOURCES
from command_line import run
from flawed import flawed_file
from synthetic import made_up, measured, random_theta, warming

from compgen.core.rotations import rotation_vector
from compgen.core.units import DEG, MM, UM
from compgen.error_model.sources.link_offsets import LinkOffsets
from compgen.identification.fit import Fit, fit
from compgen.identification.identifiability import largest_moves
from compgen.identification.identified_robot_file import robot_text
from compgen.identification.identify import fitted_sources
from compgen.identification.instrument_frames import InstrumentFrames
from compgen.identification.model import active_in_groups
from compgen.identification.parameters import symbolic_sources
from compgen.identification.validation import validate

NOISE = 10 * UM


@pytest.fixture(scope="module")
def truth(tmp_path_factory):
    """An arm without a bend."""
    drop = tuple(s for s in SOURCES if s != "hysteresis")
    return made_up(flawed_file(tmp_path_factory.mktemp("arm"), "nominal", drop), 5)


def true_sources(truth):
    """The robot file's sources with the true values."""
    sources = symbolic_sources(truth.arm.robot, truth.arm.known, np.ones(6, bool), warm=True)

    class TrueFit:
        p, sigma, active, outlier = truth.p, np.abs(truth.p), np.ones(len(truth.p), bool), np.zeros(1, bool)

    return fitted_sources(truth.arm.known, sources, truth.model, cast(Fit, TrueFit))


@pytest.fixture(scope="module")
def identified(truth, tmp_path_factory):
    """A robot file of the true arm, with its instrument's frame."""
    folder = tmp_path_factory.mktemp("identified")
    box = np.column_stack([truth.arm.robot.lower, truth.arm.robot.upper])
    record = {
        "instrument": "tracker",
        "instrument_mm": (truth.frames.origin[0] / MM).tolist(),
        "instrument_deg": (rotation_vector(truth.frames.rotation[0]) / DEG).tolist(),
        "reflector_mm": {f"r{k + 1}": (place / MM).tolist() for k, place in enumerate(truth.frames.reflector)},
    }
    file = folder / "true.toml"
    file.write_text(robot_text(truth.arm.text, true_sources(truth), box, "made up", record))
    return file


def csv(truth, data, rows=None, instrument="tracker", unit=1.0):
    pendant = truth.arm.robot.to_pendant(data.theta)[data.pose] / DEG
    lines = ["time_s,instrument,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm"]
    for n in range(len(data.pose)) if rows is None else rows:
        numbers = [*pendant[n], *(data.position[n] / MM * unit)]
        reflector = data.reflectors[data.reflector[n]]
        lines.append(
            ",".join([f"{data.time[data.pose[n]]:.3f}", instrument, reflector, *(f"{v:.6f}" for v in numbers)])
        )
    return "\n".join(lines) + "\n"


def validated(tmp_path, identified, text, *options):
    (tmp_path / "poses.csv").write_text(text)
    result = run("check-robot", identified, "--poses", tmp_path / "poses.csv", "--json", *options)
    return result, json.loads(result.stdout) if result.stdout else None


@pytest.fixture(scope="module")
def cold(truth):
    rng = np.random.default_rng(4)
    return measured(truth, random_theta(truth.arm.robot, rng, 200), rng, noise=NOISE)


def test_half_a_percent_of_outliers_is_named_and_set_aside(truth, cold):
    rng = np.random.default_rng(8)
    wrong = rng.choice(len(cold.pose), 3, replace=False)
    position = cold.position.copy()
    position[wrong] += 2e-3 * np.array([1, 0, 0])
    one = InstrumentFrames(truth.frames.rotation, truth.frames.origin, truth.frames.reflector)
    for frames in (one, None):
        result = validate(
            truth.arm.robot, true_sources(truth), replace(cold, position=position), len(truth.arm.nodes), frames
        )
        assert np.flatnonzero(result.outlier).tolist() == sorted(wrong.tolist())
        rms = np.sqrt((result.identified[~result.outlier] ** 2).mean())
        assert rms == pytest.approx(NOISE * np.sqrt(3), rel=0.15)
        named = [f.message for f in result.findings if f.code == "outlier"]
        assert len(named) == 3
        assert all(cold.label[n] in " ".join(named) for n in wrong)


def test_what_a_model_leaves_at_all_reflectors_of_a_pose_is_no_outlier(truth, cold):
    position = cold.position.copy()
    position[cold.pose == 11] += 2e-3 * np.array([0, 1, 0])
    moved = replace(cold, position=position)
    result = validate(truth.arm.robot, true_sources(truth), moved, len(truth.arm.nodes), truth.frames)
    assert not result.outlier.any()


def test_one_pose_is_enough_where_the_frames_are_known(truth, cold, identified, tmp_path):
    result, summary = validated(tmp_path, identified, csv(truth, cold, range(1)))
    assert result.returncode == 0, result.stderr
    assert summary["overall"]["identified"]["count"] == 1
    assert summary["overall"]["identified"]["rms"] < 5 * NOISE / MM


def test_a_bound_ends_in_exit_1_with_the_row(truth, cold, identified, tmp_path):
    inside, summary = validated(tmp_path, identified, csv(truth, cold), "--max-um", "60")
    assert (inside.returncode, summary["verdict"]) == (0, "inside"), inside.stderr
    outside, summary = validated(tmp_path, identified, csv(truth, cold), "--max-um", "20")
    assert (outside.returncode, summary["verdict"]) == (1, "outside")
    assert outside.stderr.startswith("cgen: outside bounds: ")
    assert "exceeds --max-um 20" in outside.stderr
    assert "poses.csv: line" in outside.stderr


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"unit": 1e-3}, ("metres instead of mm", "multiply them by 1000")),
        ({"unit": 1e-3, "rows": range(1)}, ("metres instead of mm",)),
        ({"instrument": "camera"}, ("instrument 'camera'", "'tracker'", "--refit-frames")),
    ],
)
def test_other_units_and_instruments_are_refused_in_a_line(truth, cold, identified, tmp_path, options, words):
    result, _ = validated(tmp_path, identified, csv(truth, cold, **options))
    assert result.returncode == 2
    assert result.stderr.count("\n") == 1
    assert all(w in result.stderr for w in words), result.stderr


def test_an_instrument_that_moved_is_said(truth, cold, identified, tmp_path):
    moved = replace(cold, position=cold.position + np.array([0.8, 0, 0]))
    result, _ = validated(tmp_path, identified, csv(truth, moved))
    assert result.returncode == 2
    assert "--refit-frames" in result.stderr
    refitted, summary = validated(tmp_path, identified, csv(truth, moved), "--refit-frames")
    assert refitted.returncode == 0
    assert summary["overall"]["identified"]["rms"] < 1.3 * NOISE * np.sqrt(3) / MM


def test_an_instrument_that_moved_a_little_may_be_the_cause_of_what_is_left(truth, cold, identified, tmp_path):
    """Of a tracker pushed by 0.3 mm *the arm does what the model has not* was said, and that its masses are missing."""
    text = csv(truth, replace(cold, position=cold.position + np.array([3e-4, 0, 0])))
    for options, words in (
        ((), "explain 30: instrument or reflectors have moved (--refit-frames tells), or"),
        (("--refit-frames",), ""),
    ):
        _, report = validated(tmp_path, identified, text, *options)
        left = [f["message"] for f in report["findings"] if f["code"] == "left"]
        assert len(left) == bool(words)
        assert all(words in message for message in left)


def test_warm_poses_are_judged_with_the_states_of_a_log(truth, cold, identified, tmp_path):
    rng = np.random.default_rng(9)
    warm, rise = warming(truth, rng)
    warm = replace(warm, position=truth.noiseless(warm) + rng.normal(0, NOISE, warm.position.shape))
    (tmp_path / "hot.csv").write_text(csv(truth, warm))
    head = ",".join(["time_s", "ambient_degC", *(f"{n}_degC" for n in truth.arm.nodes)])
    rows = [
        ",".join([f"{t:.3f}", "20", *(f"{20 + r:.4f}" for r in rises)])
        for t, rises in zip(warm.time, rise, strict=True)
    ]
    (tmp_path / "log.csv").write_text("\n".join([head, *rows]) + "\n")
    log = ("--temperatures", tmp_path / "log.csv")
    result, summary = validated(tmp_path, identified, csv(truth, cold), "--hot", tmp_path / "hot.csv", *log)
    assert result.returncode == 0, result.stderr
    expected = NOISE * np.sqrt(3) / MM
    assert summary["states"]["hot"]["identified"]["rms"] == pytest.approx(expected, rel=0.15)
    assert summary["states"]["cold"]["identified"]["rms"] == pytest.approx(expected, rel=0.15)
    without = run("check-robot", identified, "--poses", tmp_path / "hot.csv", "--json")
    assert json.loads(without.stdout)["overall"]["identified"]["rms"] > 3 * expected
    refused = run("check-robot", identified, "--hot", tmp_path / "hot.csv")
    assert refused.returncode == 2
    assert "--temperatures" in refused.stderr


def test_parameters_are_sorted_by_what_they_move(truth, cold):
    """Against the move by a model without that parameter, frames aligned again."""
    active = active_in_groups(truth.model, ("joint_zeros.offset", "link_offsets.a"))
    fitted = fit(truth.model, cold, active)
    moves = largest_moves(truth.model, fitted)
    names = [t for t, flag in zip(truth.model.parameters, active, strict=True) if flag]
    k = int(np.argmax(moves))
    p = fitted.p.copy()
    p[np.flatnonzero(active)[k]] = 0
    here, there = (fitted.frames.predict(cold, *truth.model.pose(cold, q)) for q in (fitted.p, p))
    free = np.linalg.norm(here - there, axis=1).max()
    assert 0.1 * free < moves[k] <= 1.5 * free, names[k].name
    assert moves.shape == (int(active.sum()),)
    assert (moves >= 0).all()


def test_what_the_chosen_model_held_at_zero_is_written_as_zero(truth):
    """A file that was identified before, and now a model without some of its parameters: the fit had them at zero."""
    known = true_sources(truth)
    sources = symbolic_sources(truth.arm.robot, known, np.ones(6, bool), warm=True)

    class PartialFit:
        p, sigma, outlier = truth.p, np.abs(truth.p), np.zeros(1, bool)
        active = np.array([not (t.source == "link_offsets" and t.field == "alpha") for t in truth.model.parameters])

    before, after = (
        next(k.source for k in listed if k.source.NAME == "link_offsets")
        for listed in (known, fitted_sources(known, sources, truth.model, cast(Fit, PartialFit)))
    )
    assert isinstance(before, LinkOffsets)
    assert isinstance(after, LinkOffsets)
    fitted_alpha = [t.index for t in truth.model.parameters if t.source == "link_offsets" and t.field == "alpha"]
    assert all(before.alpha[i] != 0 for i in fitted_alpha)
    assert all(after.alpha[i] == 0 for i in fitted_alpha)
    assert np.array_equal(after.a, before.a)
