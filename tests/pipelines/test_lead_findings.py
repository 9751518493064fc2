"""Bends off the part that the controller's smoothing carries onto it, and how long a way keeps them off."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import path_file, quiet

from compgen.core.finding_codes import Level
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.findings.motion_findings import LEAST, SmoothingReach, reach_of, short_leads
from compgen.pipelines.planned import generate
from compgen.robot.motion import ControllerMotion
from compgen.verification.twin.controller.smoothing import smooth

SMALL = ("path.diameter_mm=400", "path.stepover_mm=40")
SMOOTH = 'path.turn="smooth"'
KNOWN = "robot.motion.moving_average_ms=[200, 100]"


def run(*overrides, name="raster_1300", size=SMALL):
    job = load_job(str(name) if isinstance(name, Path) else path_file(name), None, (*size, *overrides))
    planned, corrected = generate.generate(job, quiet)
    return planned, corrected, [f for f in corrected.findings if f.code == "motion.lead"]


def lengths(finding):
    """The way there is and the one that is needed [mm]."""
    words = re.search(r"([\d.]+) mm lie between it and the edge, (\d+) are needed", finding.message)
    assert words is not None
    return float(words[1]), float(words[2])


def test_a_smooth_turn_close_to_the_part_is_named_with_the_length_that_keeps_it_off():
    planned, corrected, (finding,) = run(SMOOTH, "path.lead_mm=2", KNOWN)
    assert finding.level is Level.WARNING
    assert not corrected.inside
    there, needed = lengths(finding)
    assert there == 2.0
    assert needed == 30  # 200 mm/s for half of 0.2 + 0.1 s
    words = re.search(r"bend ([\d.]+) m along", finding.message)
    assert words is not None
    bend = float(words[1])
    assert_allclose(np.abs(planned.path.arc[planned.path.contact] - bend).min(), 2e-3, atol=0.5e-3)
    assert "path.lead_mm" in finding.message
    _, corrected, left = run(SMOOTH, f"path.lead_mm={needed:g}", KNOWN)
    assert corrected.inside
    assert not left
    assert corrected.deviation.on_part["total"].max < 2.5e-6


def test_commands_against_a_turn_off_the_part_stay_off_it():
    identified = 'robot.motion.identified={robot="m710ic50", verdict="accepted", runs_began="both"}'
    _, corrected, findings = run(SMOOTH, "path.lead_mm=32", KNOWN, identified, "robot.motion.enabled=true")
    assert corrected.inside
    assert not findings
    assert corrected.deviation.on_part["total"].max < 1.5e-6  # rounding; a filter over the turns left 500


def test_what_is_not_known_is_a_note_and_changes_no_verdict():
    _, corrected, (finding,) = run(SMOOTH, "path.lead_mm=2")
    assert finding.level is Level.NOTE
    assert "the controller is expected to lead the tool off its path on the part by" in finding.message
    assert "..." not in finding.message  # nothing of it is cut away
    assert corrected.inside


def test_a_plan_alone_says_it_too():
    job = load_job(path_file("raster_1300"), None, (*SMALL, SMOOTH, "path.lead_mm=2", KNOWN))
    assert "motion.lead" in [f.code for f in generate.predict(job, quiet).findings]


@pytest.mark.parametrize("motion", [(), (KNOWN,), ("robot.motion.first_order_ms=[60]",)])
def test_stops_at_square_turns_hold_the_smoothing_back(motion):
    _, _, findings = run("path.lead_mm=2", *motion)
    assert not findings


def test_a_slower_feed_needs_a_shorter_way():
    _, _, (finding,) = run(SMOOTH, "path.lead_mm=2", "process.feed_mm_s=100", KNOWN)
    assert lengths(finding)[1] == 15


def test_where_no_lead_is_long_enough_a_slower_feed_is_named():
    _, _, (finding,) = run(SMOOTH, "path.lead_mm=2", "robot.motion.first_order_ms=[60]")
    assert "lower process.feed_mm_s" in finding.message
    assert "path.lead_mm" not in finding.message


def test_arcs_have_the_same_edge():
    _, _, (finding,) = run(SMOOTH, "path.lead_mm=2", KNOWN, "process.moves=arcs")
    assert lengths(finding) == (2.0, 30)


@pytest.mark.parametrize("name", ["circle_1300", "spiral_1300", "iso9283"])
def test_bends_on_the_part_are_not_told_as_bends_beside_it(name):
    _, _, findings = run(KNOWN, name=name, size=())
    assert not findings


def led_off_near_edges(name, *overrides):
    """Too short ways of a path that is led off by 50 um within 15 mm of its part, whatever the cause."""
    path = generate.predict(load_job(path_file(name), None, overrides), quiet).path
    inside = path.contact[:-1] & path.contact[1:]
    edges = path.arc[np.flatnonzero(np.diff(path.contact))]
    middle = (path.arc[1:] + path.arc[:-1]) / 2
    off = np.where(inside & (np.abs(middle[:, None] - edges).min(axis=1) < 15e-3), 50e-6, 0.0)
    assert off.any()
    return list(short_leads(path, off, np.full(len(off), 0.2), SmoothingReach(0.15, 0.15)))


def test_whatever_lies_beyond_a_stop_is_no_bend():
    assert led_off_near_edges("raster_1300", *SMALL, SMOOTH, "path.lead_mm=2")
    assert not led_off_near_edges("raster_1300", *SMALL, "path.lead_mm=2")


def test_a_path_that_bends_on_past_the_edge_as_on_the_part_has_no_bend_there():
    small = ('boundary.shape="circle"', "boundary.diameter_mm=400")
    assert not led_off_near_edges("spiral_1300", *small)


@pytest.mark.parametrize("stop", [0, 1])
def test_own_points_that_come_to_the_part_round_a_bend_want_way_or_a_stop(tmp_path, stop):
    angle = np.deg2rad(np.arange(0, 90.1, 5))
    bend = np.column_stack([1300 - 15 * np.cos(angle), -15 + 15 * np.sin(angle)])
    rows = [f"{x:.6f},{y:.6f},203,0,0" for x, y in bend[:-1]] + [f"1300,0,203,0,{stop}", "1304,0,203,0,0"]
    rows += [f"{x},0,203,1,0" for x in range(1306, 1400, 2)]
    (tmp_path / "own.csv").write_text("\n".join(["x_mm,y_mm,z_mm,contact,stop", *rows, ""]))
    (tmp_path / "own.toml").write_text(
        'robot = "m710ic50"\n[path]\npattern = "points"\nfile = "own.csv"\n[process]\nfeed_mm_s = 100\n'
        "[bounds]\nmax_um = 2.5\n"
    )
    _, _, findings = run(KNOWN, name=tmp_path / "own.toml", size=())
    assert len(findings) == 1 - stop
    for finding in findings:
        assert lengths(finding) == (
            pytest.approx(3, abs=1.1),
            15,
        )  # the curve through points ends its bend within the straight way
        assert "stop = 1" in finding.message


@pytest.mark.parametrize(
    "motion",
    [
        ControllerMotion(moving_averages=(0.2, 0.1)),
        ControllerMotion(moving_averages=(0.16,), first_orders=(0.03,)),
        ControllerMotion(first_orders=(0.05,), lag=0.04),
    ],
)
def test_a_corner_is_led_off_no_farther_from_it_than_the_reach(motion):
    step, speed = 0.004, 0.2
    along = np.clip(speed * step * (np.arange(2000) - 1000.0), None, 0)
    across = np.clip(speed * step * (np.arange(2000) - 1000.0), 0, None)
    drawn = smooth(np.column_stack([along, across]), step, motion)
    reach = reach_of(motion)
    assert_allclose(np.abs(drawn[drawn[:, 0] < -speed * (reach.ahead + step), 1]), 0, atol=LEAST)
    assert_allclose(np.abs(drawn[drawn[:, 1] > speed * (reach.behind + step), 0]), 0, atol=LEAST)
    assert np.abs(drawn[drawn[:, 0] < -0.5 * speed * reach.ahead, 1]).max() > LEAST
