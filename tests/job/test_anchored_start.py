"""A state in place of history: what begins with it, what it moves, what it leaves open, and what is refused."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import refused, run
from flawed import flawed_file
from ls_text import at, program
from numpy.testing import assert_allclose
from shipped import path_file, quiet
from states import state_of, written

import compgen
from compgen.core.exceptions import InputError
from compgen.core.units import MDEG, MINUTE, UM
from compgen.error_model.anchored_state import read_state, state_text
from compgen.job.anchored_start import Before, begin, made_from_robot, seconds_of_age
from compgen.job.uncertainty import quantities_of_cell
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.planned import generate

ATOL_M = 1e-9
SPIRAL = path_file("spiral_1300")


def error_of(job):
    planned = generate.predict(job, quiet)
    return planned.error()[:, :3]


def with_state(state, folder, *overrides, path=SPIRAL, robot=None):
    return load_job(path, robot, [*overrides, f"state.file='{written(state, folder)}'"])


@pytest.fixture(scope="module")
def hot():
    return load_job(SPIRAL)


def test_a_state_reads_as_it_was_written(hot, tmp_path):
    rng = np.random.default_rng(1)
    size = np.array([0.3] * 5 + [10 * UM] * 3 + [1 * MDEG] * 3 + [0.2])
    mixed = rng.normal(size=(12, 12))
    covariance = mixed @ mixed.T
    covariance *= np.outer(size, size) / np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    state = state_of(
        hot, covariance=covariance, drifting=("joint_zeros.offset_mdeg[2]",), drift=np.array([1.5]),
        base=np.arange(6) * 1e-5, made_from={"robot_file": "0" * 64, "a b.csv": "1" * 64},
    )  # fmt: skip
    read = read_state(written(state, tmp_path))
    assert state_text(read) == state_text(state)
    assert_allclose(read.covariance, covariance, atol=1e-6 * np.abs(covariance).max())
    assert_allclose(read.base, state.base, rtol=1e-8)
    assert_allclose(read.factor @ read.factor.T, read.covariance, atol=1e-12)


@pytest.mark.parametrize("model", ["nodes", "network"])
def test_the_state_that_history_ends_with_predicts_what_history_does(model, tmp_path):
    override = f"robot.thermal.model={model}"
    job = load_job(SPIRAL, overrides=[override])
    begun = with_state(state_of(job), tmp_path, override)
    assert begun.history.before == ()
    assert_allclose(error_of(begun), error_of(job), atol=ATOL_M)


def test_a_network_without_modal_state_shows_the_rises_of_the_nodes(hot, tmp_path):
    job = with_state(state_of(hot), tmp_path, "robot.thermal.model=network")
    rises = dict(zip(job.heat.names, job.start_rise().tolist(), strict=True))
    assert_allclose([rises[n] for n in hot.heat.names], hot.start_rise(), atol=1e-9)
    assert min(rises.values()) > -1  # between the named places it is as warm as they are
    assert max(rises.values()) < 20


def test_modes_that_show_other_rises_than_the_state_says_are_refused(tmp_path):
    """A file in which somebody has typed rises went on with its modes, without a word."""
    job = load_job(SPIRAL, overrides=["robot.thermal.model=network"])
    typed = state_of(job, rise=job.start_rise() + 2.0 * (np.array(job.heat.names) == "j3"))
    with pytest.raises(InputError, match=r"rise\.modal: shows j3 2 K from what rise\.K has"):
        with_state(typed, tmp_path, "robot.thermal.model=network")
    without = with_state(replace(typed, modal=None), tmp_path, "robot.thermal.model=network")
    assert_allclose(without.start_rise(), typed.rise, atol=1e-6)


def test_modes_of_a_network_with_other_values_give_way_to_its_rises(tmp_path):
    """A state as it was written was refused where the file's floor is given otherwise: *take the file as written*."""
    job = load_job(SPIRAL, overrides=["robot.thermal.model=network"])
    colder = with_state(state_of(job), tmp_path, "robot.thermal.model=network", "robot.thermal.network.floor_W_K=3")
    assert_allclose(colder.start_rise(), job.start_rise(), atol=1e-6)
    assert any("found with other values of the robot file" in f.message for f in colder.input_findings)


def test_an_aged_state_has_stood(hot, tmp_path):
    aged = with_state(state_of(hot), tmp_path, "state.age_min=20")
    stood = load_job(SPIRAL, overrides=["before.1.state=idle", f"before.1.duration_h={1 / 3!r}"])
    assert_allclose(aged.start_rise(), stood.start_rise(), atol=1e-9)


def test_which_air_goes_on_behind_a_state_is_said(hot, tmp_path):
    """A ramp of 6 K over 12 h, 20 min before the planned start after 6 h: 6 (6 h - 20 min) / 12 h; nothing said so."""
    ramp = ("ambient.kind=ramp", "ambient.from_degC=20", "ambient.to_degC=26", "ambient.over_h=12")
    state = state_of(hot, air=-1.0)

    def note(*overrides):
        return next(f.message for f in with_state(state, tmp_path, *overrides).input_findings if f.code == "state")

    then = 6 * (6 - 1 / 3) / 12
    words = f"goes on as [ambient] has it at the planned start, {then:+.1f} K from the reference at the state's time ("
    assert f"{words}-1.0 by the state)" in note(*ramp, "state.age_min=20")
    assert "+3.0 K from the reference at the state's time (-1.0 by" in note("ambient.value_degC=23")
    assert "air" not in note()
    assert "air" not in note("ambient.value_degC=19")


def test_the_base_moves_every_place(hot, tmp_path):
    shift, turn = np.array([200, -50, 30]) * UM, np.array([0, 0, 3]) * MDEG
    job = with_state(state_of(hot, base=np.concatenate([shift, turn])), tmp_path)
    planned = generate.predict(hot, quiet)
    moved = error_of(job) - planned.error()[:, :3]
    assert_allclose(moved, shift + np.cross(turn, planned.path.target.position), atol=0.05 * UM)


def test_what_drifts_is_changed_in_its_source(tmp_path):
    robot = flawed_file(tmp_path)
    job = load_job(SPIRAL, robot)
    state = state_of(
        job, drifting=("joint_zeros.offset_mdeg[1]",), drift=np.array([4.0]), covariance=np.zeros((12, 12))
    )
    moved = error_of(with_state(state, tmp_path, robot=robot))
    other = error_of(load_job(SPIRAL, robot, ["robot.sources.joint_zeros.offset_mdeg=[8, -12, 15, -20, 25, -10]"]))
    assert_allclose(moved, other, atol=ATOL_M)


def test_the_written_program_is_right_for_the_state_and_says_so(hot, tmp_path):
    state = state_of(hot, base=np.array([2e-4, 0, 0, 0, 0, 0]))
    job = with_state(state, tmp_path)
    _, corrected = generate.generate(job, quiet)
    assert corrected.inside
    remark = f"state {job.cell.state.digest[:8]} holds 1800 s"
    assert remark in corrected.text.decode()
    assert len(remark) <= 32
    assert any(f.code == "state" and "in place of [[before]]" in f.message for f in corrected.findings)


def test_a_state_leaves_its_covariance_open_in_place_of_the_sensors_start(hot, tmp_path):
    covariance = np.zeros((11, 11))
    covariance[2, 2] = 0.8**2
    covariance[5, 5] = (30 * UM) ** 2
    job = with_state(state_of(hot, covariance=covariance), tmp_path)
    quantities = [q for q in quantities_of_cell(job.cell).quantities if q.source == "anchored state"]
    assert len(quantities) == 2
    assert_allclose(sorted(q.cause.heat.start[2] for q in quantities)[-1], 0.8, rtol=1e-6)
    planned = generate.predict(job, quiet)
    known = with_state(state_of(hot), tmp_path)
    exact = generate.predict(known, quiet)
    assert planned.band is not None
    assert exact.band is not None
    rows = planned.band.rows
    more = planned.band.moment[:, [0, 3, 5]] - exact.band.moment[:, [0, 3, 5]]
    warmer = error_of(with_state(state_of(hot, rise=hot.start_rise() + 0.8 * np.eye(5)[2]), tmp_path))
    expected = (warmer - exact.error()[:, :3])[rows] ** 2
    expected[:, 0] += (30 * UM) ** 2
    assert_allclose(more, expected, atol=0.03 * expected.max())
    assert any(share.source == "anchored state" for share in planned.band.budget)


def test_the_thermocouples_count_once(hot, tmp_path):
    job = with_state(state_of(hot), tmp_path)
    sensors = next(q for q in quantities_of_cell(job.cell).quantities if q.source == "thermocouples")
    assert not sensors.cause.heat.start.any()


def test_correct_begins_with_a_state(hot, tmp_path):
    joints = [[0, 20, -20, 0, -70, 0], [10, 25, -25, 0, -65, 0], [-10, 30, -25, 0, -65, 10]]
    source = tmp_path / "T.LS"
    source.write_bytes(
        program([f"L P[{n}] 100mm/sec FINE" for n in (1, 2, 3)], [at(n + 1, j) for n, j in enumerate(joints)])
    )
    file = written(
        state_of(
            hot, rise=load_job(SPIRAL, overrides=["before=[{state='moving',feed_mm_s=200,duration_h=6}]"]).start_rise()
        ),
        tmp_path,
    )
    by_state = compgen.correct(source, robot="m710ic50", state=file)
    by_words = compgen.correct(source, robot="m710ic50", before="moving 200mm/s 6h")
    assert_allclose(by_state.result.shared.correction, by_words.result.shared.correction, atol=1e-8)
    with pytest.raises(InputError, match="leave one of them out"):
        compgen.correct(source, robot="m710ic50", state=file, before="idle 30min")


def test_commands_and_python_take_a_state(hot, tmp_path):
    file = written(state_of(hot), tmp_path)
    job = compgen.load_job(SPIRAL, state=file, state_age="10min")
    assert job.history.clock == 10 * MINUTE
    result = run("predict", SPIRAL, "--state", file, "--state-age", "10min", "-o", tmp_path / "out", "-q")
    assert result.returncode == 0, result.stderr
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["provenance"]["state"]["age_s"] == 600
    assert report["provenance"]["inputs_sha256"] == job.inputs_hash


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"made_from": {"robot_file": "f" * 64}}, "of another robot file"),
        ({"verdict": "cannot tell"}, "touch what cgen anchor names"),
        ({"nodes": ("a", "b", "c", "d", "e")}, "anchor again with this heat model"),
        ({"drifting": ("joint_zeros.offset_mdeg[2]",), "drift": np.ones(1), "covariance": np.zeros((12, 12))},
         "no number of"),
    ],
)  # fmt: skip
def test_a_state_of_something_else_is_refused(hot, tmp_path, changes, words):
    file = written(state_of(hot, **changes), tmp_path)
    refused(run("predict", SPIRAL, "--state", file, "-o", tmp_path / "out"), 2, words)
    assert not (tmp_path / "out").exists()


def test_an_old_state_is_refused(hot, tmp_path):
    file = written(state_of(hot), tmp_path)
    refused(run("generate", SPIRAL, "--state", file, "--state-age", "31min"), 2, "holds 30 minutes", "31 min old")
    refused(run("generate", SPIRAL, "--state", file, "--state-age", "31"), 2, "with its unit")
    refused(run("generate", SPIRAL, "--state-age", "31min"), 2, "--state")
    refused(run("generate", SPIRAL, "--state", tmp_path / "none.toml"), 2, "no such file")


@pytest.mark.parametrize(("planned", "starts"), [(31, ()), (0, (0, 1860)), (16, (0, 900))])
def test_a_start_that_outlives_a_state_is_refused(hot, tmp_path, planned, starts):
    """It is the same standing robot as with an age of 31 minutes, which was refused alone."""
    file = written(state_of(hot), tmp_path)

    def late(minutes):
        average = ("--set", f"compensation.average_over={{delay_s={[*starts]}}}") if starts else ()
        return ("--set", f"start.delay_min={minutes}", *average)

    refused(run("predict", SPIRAL, "--state", file, *late(planned)), 2, "holds 30 minutes", "31 min old (at its latest")
    if planned:
        aged = ("--state", file, "--state-age", "2min", *late(planned - 2))
        refused(run("predict", SPIRAL, *aged), 2, "31 min old (at its latest start)")


def test_a_program_s_starts_that_outlive_a_state_are_refused(hot, tmp_path):
    file = written(state_of(hot), tmp_path)
    (tmp_path / "P.LS").write_bytes(compgen.generate(compgen.load_job(path_file("line_y"))).text)
    starts = ("--again", "--robot", "m710ic50", "--average-over", "delay_s=[0, 1860]")
    refused(run("correct", tmp_path / "P.LS", "--state", file, *starts), 2, "holds 30 minutes", "31 min old")


def test_a_damaged_state_is_refused(hot, tmp_path):
    text = Path(written(state_of(hot), tmp_path)).read_text()
    for old, new, words in (
        ("K = [", "K = [1.0, ", "of 5 nodes"),
        ("  [0, 1],\n", "  [1.5, 1],\n", "must be -1 to 1"),
        ("window_s = ", "window_min = ", "unknown key"),
        ("sigma_um = [", "sigma_um = [-", "below zero"),
        ('"j3"', '"j2"', "rise.node: 'j2' stands twice"),
        ("K = [", "K = [99", "must be less than or equal to 80"),
    ):
        file = tmp_path / "damaged.toml"
        file.write_text(text.replace(old, new, 1).replace("-0.0", "-1.0", 1))
        with pytest.raises(InputError, match=words):
            read_state(str(file))


def test_where_the_file_lies_is_no_input(hot, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    state = state_of(hot)
    assert with_state(state, tmp_path).inputs_hash == with_state(state, other).inputs_hash
    assert with_state(state, tmp_path).inputs_hash != with_state(replace(state, time=1.0), other).inputs_hash


def test_ages_have_units():
    assert [seconds_of_age(a) for a in ("20min", "90s", "1.5h", " .5 h")] == [1200, 90, 5400, 1800]


def test_a_program_that_exists_is_corrected_for_the_air_of_its_state(hot, tmp_path):
    state = written(state_of(hot, air=-6.0), tmp_path)
    assert begin(hot.cell, Before(), state, "20min").air == -6.0
    assert begin(hot.cell, Before(air=2.5), state, "20min").air == 2.5
    assert begin(hot.cell, Before(), None, None).air == 0.0
    assert begin(hot.cell, Before(air=2.5), None, None).air == 2.5


@pytest.mark.parametrize("said", ["ambient.reference_degC=20", "ambient.value_degC=24"])
def test_a_state_that_counts_from_another_temperature_is_refused(hot, said, tmp_path):
    """Its air, 4 K above 20 degC, was taken for 4 K above whatever the path file counts from."""
    state = state_of(hot, air=4.0, reference=20.0)
    assert with_state(state, tmp_path, said).history.air is not None
    other = replace(state, reference=24.0)
    with pytest.raises(InputError, match=r"counts from 24 degC, here rises and air count from 20 .*calibrated"):
        with_state(other, tmp_path, said)
    assert with_state(other, tmp_path).history.air.at(np.zeros(1)) == 4.0  # nobody says: as the state has it
    assert with_state(replace(state, reference=None), tmp_path, said).cell.state.reference is None  # an older file


def test_a_program_that_exists_counts_from_what_its_state_counts_from(hot, tmp_path):
    state = written(state_of(hot, reference=24.0), tmp_path)
    assert begin(hot.cell, Before(), state, None).reference == 24.0
    assert begin(hot.cell, Before(reference=24.0), state, None).reference == 24.0
    assert begin(hot.cell, Before(), None, None).reference == 20.0
    with pytest.raises(InputError, match="counts from 24 degC"):
        begin(hot.cell, Before(reference=20.0), state, None)


def test_values_of_the_robot_file_are_the_same_however_they_are_typed(hot, tmp_path):
    length = load_job(SPIRAL, None, ["robot.thermal.cte_um_m_K=12"])
    state = written(state_of(length, made_from=made_from_robot(length.cell)), tmp_path)

    def is_warned(*overrides):
        cell = load_cell("m710ic50", overrides)
        (note,) = [f for f in begin(cell, Before(), state, None).cell.input_findings if f.code == "state"]
        return "found with other values" in note.message

    for typed in ("thermal.cte_um_m_K=12", "robot.thermal.cte_um_m_K=12.0", "robot.thermal.cte_um_m_K = 1.2e1"):
        assert not is_warned(typed)
    assert not is_warned("thermal.cte_um_m_K=15", "thermal.cte_um_m_K=12")  # the last one counts
    assert not is_warned("thermal.cte_um_m_K=12", "controller.max_positions=200")  # of which no state knows
    assert is_warned("thermal.cte_um_m_K=15")
    assert is_warned()
