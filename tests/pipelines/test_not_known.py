"""What stands beside a band: each row with its size or why there is none, until its number is declared."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import path_file

from compgen.core.units import UM
from compgen.error_model.unmeasured import NOT_KNOWN
from compgen.job.uncertainty import quantities_of
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.uncertainty.band_columns import by_source
from compgen.pipelines.uncertainty.not_known import WorkSetting, not_known, setting_of
from compgen.verification.band import Band, BudgetShare

SETTING = WorkSetting(reach=2.0, tool=0.3, warmest=13.0, flange=2.3)
OF_FILE = ["cold geometry", "play", "repeatability", "the controller's motion", "the first lap"]
OF_JOB = [
    "part's frame", "tool length", "payload and sag", "process force", "floor and base tilt", "growth of the spindle",
    "growth of fixture and sphere plate", "gradient across a link",
]  # fmt: skip
LOADS = ["sources.loads.payload_kg=34", "sources.loads.payload_centre_mm=[0, 0, 150]"]


def band_with(*sources):
    """A band whose budget has some sources."""
    budget = tuple(BudgetShare(source, UM, UM) for source in sources)
    moment, rows = np.zeros((1, 6)), np.zeros(1, int)
    return Band(rows=rows, moment=moment, radius=np.zeros(1), largest=UM, p99=UM, budget=budget)


def rows_of(*overrides, sources=(), robot="m710ic50"):
    """The rows by name."""
    return {row.what: row for row in not_known(load_cell(robot, overrides), band_with(*sources), SETTING)}


def test_the_shipped_robot_has_every_row_and_each_has_a_figure_or_says_why_not():
    rows = rows_of()
    assert list(rows) == OF_FILE + OF_JOB
    for name in OF_JOB:
        assert (rows[name].size is None) == rows[name].origin.startswith("no figure: "), name
    assert all(rows[name].size for name in OF_FILE)


def test_sizes_are_those_of_a_hand():
    rows = rows_of()
    # 11.5 um/m/K; the spindle 300 mm at 2.3 K; from the base 2 m at twice 0.25 K; 28.8 arcsec / 12 K at 13 K and 2 m
    assert_allclose(np.array(rows["growth of the spindle"].size), [2e-6, 5e-6 + 11.5e-6 * 0.3 * 2.3])
    assert_allclose(np.array(rows["growth of fixture and sphere plate"].size), [0, 11.5e-6 * 2 * 0.5])
    assert_allclose(np.array(rows["gradient across a link"].size), [0, np.radians(28.8 / 3600) / 12 * 13 * 2])
    assert "each mdeg is 35 um" in rows["floor and base tilt"].origin  # 2 m x 17.45 urad
    assert "the 300 mm count as exact" in rows["tool length"].origin


def test_a_tool_that_taught_the_frame_is_known_with_it():
    cell, taught = load_cell("m710ic50"), replace(SETTING, is_tool_taught=True)
    left = {row.what for row in not_known(cell, band_with("part's frame"), taught)}
    assert set(rows_of()) - left == {"part's frame", "tool length"}


def test_a_cold_arm_has_no_figure_for_a_gradient_and_a_kelvin_of_air():
    rows = rows_of(robot="m20ia")
    cold = {row.what: row for row in not_known(load_cell("m20ia"), band_with(), setting_of(*COLD))}
    assert rows["the first lap"].origin.startswith("no figure")
    assert cold["gradient across a link"].size is None
    assert_allclose(np.array(cold["growth of fixture and sphere plate"].size), [0, 11.5e-6 * 1.5 * 2])


COLD = np.array([[0.9, 1.2, 5.0], [0.1, 0.2, 9.0]]), np.zeros((1, 3)), np.zeros((4, 5))


@pytest.mark.parametrize(
    ("ended", "overrides", "sources"),
    [
        ("part's frame", [], ["part's frame"]),
        ("tool length", [], ["tool"]),
        ("floor and base tilt", [], ["anchored state"]),
        ("floor and base tilt", ["sources.base_frame.sigma.rotation_mdeg=2"], []),
        ("payload and sag", [*LOADS, "sources.compliance.compliance_urad_Nm=[0, 0.3, 0.4, 0, 0, 0]"], []),
        (
            "process force",
            [*LOADS, "sources.loads.force_N=[0, 0, 20]", "sources.compliance.sigma.compliance_urad_Nm=0.1"],
            [],
        ),
        (
            "growth of the spindle",
            ["sources.thermal_shift.of=['tool']", "sources.thermal_shift.node=['face']",
             "sources.thermal_shift.rate_um_K=[3]", "sources.thermal_shift.sigma.rate_um_K=[1]"],
            [],
        ),
        (
            "growth of fixture and sphere plate",
            ["sources.thermal_shift.of=['fixture z']", "sources.thermal_shift.node=['face']",
             "sources.thermal_shift.rate_um_K=[3]", "sources.thermal_shift.sigma.rate_um_K=[1]"],
            [],
        ),
        (
            "gradient across a link",
            ["sources.thermal_bend.link=['column']", "sources.thermal_bend.plane=['x']",
             "sources.thermal_bend.node=['j2']", "sources.thermal_bend.rate_arcsec_K=[0.2]"],
            [],
        ),
        ("cold geometry", ["sources.joint_zeros.sigma.offset_mdeg=1"], ["geometry"]),
        ("play", [], ["lost motion"]),
        ("repeatability", [], ["repeatability"]),
    ],
)  # fmt: skip
def test_a_declared_number_ends_its_row_and_no_other(ended, overrides, sources):
    left = set(rows_of(*overrides, sources=sources))
    also = {"payload and sag"} if ended == "process force" else set()
    assert set(rows_of()) - left == {ended} | also


@pytest.mark.parametrize(
    "overrides",
    [
        ["sources.compliance.compliance_urad_Nm=[0, 0.3, 0.4, 0, 0, 0]"],  # of no mass
        ["sources.thermal_shift.of=['tool']", "sources.thermal_shift.node=['face']",
         "sources.thermal_shift.rate_um_K=[3]"],  # which nobody says how well it is known
    ],
)  # fmt: skip
def test_what_is_in_no_band_ends_no_row(overrides):
    assert set(rows_of(*overrides)) >= set(rows_of())


def test_what_a_path_file_declares_is_a_source_of_its_budget():
    declared = ["frame.x_mm=10", "frame.taught.through='model'", "frame.taught.sigma_um=[5, 5, 5]", "tool.z_mm=300"]
    job = load_job(path_file("line_y"), None, [*declared, "tool.sigma_um=[0, 0, 50]"])
    assert {"part's frame", "tool"} <= {q.source for q in by_source(quantities_of(job))}


def test_a_silent_file_names_what_it_does_not_know_without_figures():
    cell = load_cell("m20ia")
    rows = [row.what for row in not_known(cell, band_with(), SETTING)]
    assert rows[: len(NOT_KNOWN)] == [row.what for row in NOT_KNOWN]
    assert set(OF_JOB) < set(rows)
