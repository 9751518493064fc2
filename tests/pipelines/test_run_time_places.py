"""Programs that write registers and frames at run time: a short, fixed part of the campaign."""

import pytest
import run_time_places
from shipped import ROOT

from compgen.pipelines.files.robot_file import load_cell


@pytest.fixture(scope="module")
def cell():
    return load_cell(str(ROOT / "robots" / "m710ic50.toml"))


def test_what_is_free_stands_where_every_run_leads(cell):
    compared = placed = 0
    for seed in range(80):
        wrong, _, stations, shifted = run_time_places.judge(seed, cell.robot)
        assert wrong == ""
        compared, placed = compared + stations, placed + shifted
    assert compared > 500
    assert placed > 100


def test_the_judge_sees_registers_that_are_believed_behind_an_unknown_program(cell, monkeypatch):
    unknown_call = "compgen.fanuc.analysis.register_flow.RegisterFlow._after_unknown_call"
    monkeypatch.setattr(unknown_call, lambda _, state: state)
    assert any(run_time_places.judge(seed, cell.robot)[0] for seed in range(200))


def test_corrected_programs_lead_the_warm_arm_to_the_planned_places(cell):
    stations = 0
    for seed in range(8):
        single, every = run_time_places.corrected(seed, cell)
        assert max(single, default=0.0) < 1.5  # um
        assert all(after <= max(before, 1.0) + 3.0 for before, after in every)
        stations += len(every)
    assert stations > 5
