"""The twin on arcs: where the tool goes, its clock and its joints, against a circle by linear algebra."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import EXACT, path_file

import compgen.verification.twin.execution
from compgen.core.rotations import rotation_matrix, rotation_vector
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.program.program import Program
from compgen.robot.inverse_kinematics import Posture
from compgen.robot.kinematics import flange_pose
from compgen.verification.twin import TwinError, prepare
from compgen.verification.twin.circular_motion import as_chords, sweeps
from compgen.verification.twin.controller.command import sample_command, statement_times
from compgen.verification.written_motion import read_motion

DOWN = np.diag([1.0, -1.0, -1.0])
PLACE = np.array([1.3, 0.05, 0.2])


@pytest.fixture(scope="module")
def twin():
    return twin_of(load_job(path_file("line_y"), None, [EXACT]))


def on_circle(radius, angles, normal, turn):
    """A stop, then arcs from it through places on a circle, every second a via; the tool turns a little on the way."""
    z = np.array(normal, dtype=float) / np.linalg.norm(normal)
    x = np.cross(z, [0.3, 0.5, -0.2])
    x /= np.linalg.norm(x)
    places = radius * (np.outer(np.sin(angles), x) + np.outer(1 - np.cos(angles), np.cross(z, x))) + PLACE
    N = len(angles)
    fine, via = np.zeros(N, dtype=bool), np.arange(N) % 2 == 1
    fine[[0, -1]] = True
    axes = rotation_matrix(np.outer(np.linspace(0, 1, N) ** 2, turn)) @ DOWN
    return Program(
        name="ARCS", comment="", date="26-01-01", remarks=(), uframe=0, utool=1, position=places, rotation=axes,
        posture=Posture(), turns=np.zeros((N, 3), dtype=np.int64), speed=np.full(N - 1, 0.1), fine=fine, via=via,
    )  # fmt: skip


def centre_of(a, b, c):
    """In the plane of three places, equally far from all: three linear equations."""
    normal = np.cross(b - a, c - a)
    rows = np.array([b - a, c - a, normal])
    return np.linalg.solve(rows, [(b - a) @ (b + a) / 2, (c - a) @ (c + a) / 2, normal @ a])


CASES = [(0.05, (0, 0, 1)), (0.3, (0.2, -0.4, 1)), (0.02, (1, 2, 0.5)), (40.0, (0.1, 0.1, 1))]


@pytest.mark.parametrize(("radius", "normal"), CASES)
def test_the_tool_stays_on_the_circle_and_runs_along_it_evenly(twin, radius, normal):
    span = min(1.4, 0.06 / radius)
    program = on_circle(radius, np.array([0, 0.45, 1.0, 1.6, 2.0]) * span, normal, (0.02, -0.03, 0.05))
    prepared = prepare(twin, program, [])
    execution = prepared.execute()
    tool = flange_pose(twin.robot, execution.theta) @ twin.tool
    gaps = np.linalg.norm(np.diff(tool.position, axis=0), axis=1)
    assert gaps.max() <= 1e-3
    for via in (1, 3):
        a, b, c = program.position[via - 1 : via + 2]
        centre = centre_of(a, b, c)
        for segment, start, end in ((via - 1, a, b), (via, b, c)):
            rows = execution.segment == segment
            r = tool.position[rows] - centre
            assert_allclose(np.linalg.norm(r, axis=1), radius, atol=1e-9)
            assert_allclose(r @ np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a)), 0, atol=1e-9)
            first, last = start - centre, end - centre
            whole = np.arctan2(np.linalg.norm(np.cross(first, last)), first @ last)
            swept = np.arctan2(np.linalg.norm(np.cross(first, r), axis=1), r @ first)
            assert_allclose(swept, whole * execution.fraction[rows], atol=1e-9 / radius)
            assert prepared.sweep.length[segment] == pytest.approx(radius * whole, rel=1e-9)
            # the orientation turns about one axis, evenly: as much of the way as of the turn
            turn = rotation_vector(program.rotation[segment].T @ program.rotation[segment + 1])
            share = execution.fraction[rows][:, None] * turn
            assert_allclose(tool.rotation[rows], program.rotation[segment] @ rotation_matrix(share), atol=1e-9)


def test_a_longer_way_round_is_driven_the_longer_way(twin):
    program = on_circle(0.03, np.array([0, 0.8, 3.1]), (0, 0, 1), (0, 0, 0))
    assert sweeps(program).length.sum() == pytest.approx(0.03 * 3.1)
    short = replace(program, via=np.zeros(3, dtype=bool))
    assert prepare(twin, program, []).timing.time[-1] > prepare(twin, short, []).timing.time[-1]


def test_an_arc_takes_its_length_over_its_speed(twin):
    angles = np.arange(9) * 0.2
    program = on_circle(0.3, angles, (0, 0, 1), (0, 0, 0))
    prepared = prepare(twin, program, [])
    inner = np.diff(prepared.timing.time)[2:-2]
    assert_allclose(inner / inner[0], 1, rtol=1e-12)
    motion = read_motion(prepared, np.full(8, 0.06), 0.1)
    assert motion.at_feed > 0.9


def test_joints_on_an_arc_are_those_of_many_short_lines(twin):
    """Heat, and the share of joint limits that is used, do not depend on how few positions say the circle."""
    program = on_circle(0.25, np.arange(5) * 0.35, (0, 0, 1), (0, 0, 0))
    many = on_circle(0.25, np.linspace(0, 1.4, 401), (0, 0, 1), (0, 0, 0))
    many = replace(many, via=np.zeros(401, dtype=bool))
    arcs, lines = prepare(twin, program, []), prepare(twin, many, [])
    # a line of 1 mm has its own speed on the ramp, an arc of 90 mm the mean; the warmth is not in proportion to speed
    assert_allclose(arcs.rise[-1], lines.rise[-1], rtol=0.02)
    use = [read_motion(p, p.sweep.length, 0.1).use for p in (arcs, lines)]
    assert_allclose(use[0][0], use[1][0], rtol=0.02)
    assert_allclose(use[0][1], use[1][1], rtol=0.1)


def test_chords_of_lines_are_the_lines(twin):
    program = on_circle(0.25, np.arange(5) * 0.35, (0, 0, 1), (0, 0, 0))
    lines = replace(program, via=np.zeros(5, dtype=bool))
    chords = as_chords(lines, sweeps(lines))
    assert chords.program is lines
    assert chords.times(np.arange(5.0)).tolist() == [0, 1, 2, 3, 4]


def test_a_place_out_of_reach_on_an_arc_is_named(twin):
    program = on_circle(0.9, np.array([0, 1.2, 2.4]), (0, 0, 1), (0, 0, 0))
    with pytest.raises(TwinError, match=r"P\[[12]\]"):
        prepare(twin, program, []).execute()


def test_a_commanded_motion_follows_the_arc_and_rounds_up_whole_statements(twin):
    program = on_circle(0.3, np.arange(9) * 0.05, (0.1, 0, 1), (0, 0, 0.1))
    prepared = prepare(twin, program, [])
    command = sample_command(twin.robot, prepared.written_path())
    centre = centre_of(*program.position[:3])
    assert_allclose(np.linalg.norm(command.position - centre, axis=1), 0.3, atol=1e-9)
    assert command.arc[-1] == pytest.approx(0.3 * 0.4, rel=1e-9)
    length = prepared.sweep.length * np.array([0.99, 1.01] * 4)
    halves = statement_times(length, program.speed, 0.008, rounds_up=True, via=program.via)
    assert_allclose((halves[::2] + halves[1::2]) / 0.008, np.ceil((length[::2] + length[1::2]) / 0.1 / 0.008 - 1e-9))
    assert_allclose(halves[::2] / halves[1::2], length[::2] / length[1::2])


@pytest.mark.parametrize("segments", [1, 3])
def test_a_program_flown_a_few_segments_at_a_time_is_the_same(twin, segments, monkeypatch):
    program = on_circle(0.05, np.array([0, 0.45, 1.0, 1.6, 2.0]), (0, 0.2, 1), (0.02, -0.03, 0.05))
    prepared = prepare(twin, program, [])
    at_once = prepared.execute()
    monkeypatch.setattr(compgen.verification.twin.execution, "CHUNK", segments)
    parted = prepared.execute()
    assert np.array_equal(parted.segment, at_once.segment)
    for name in ("fraction", "time", "rise", "theta"):
        assert_allclose(getattr(parted, name), getattr(at_once, name), atol=1e-13)
    assert_allclose(parted.actual.position, at_once.actual.position, atol=1e-13)
    assert len(set(at_once.segment.tolist())) == 4
