"""What the flight of a corrected text is judged by, and which stations are one run: by hand and by a naive reader."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.pose import Pose
from compgen.core.rotations import rotation_matrix
from compgen.core.units import DEG, MM, UM
from compgen.pipelines.correct.proof import (
    Residue,
    as_both_can,
    flat_arcs,
    residue_of,
    unexplained_turns,
    wide_arcs,
    worst_of_starts,
)
from compgen.pipelines.correct.station_corrections import dense_runs, explained_turns
from compgen.program.driven import NONE, DrivenProgram, Positions
from compgen.thermal.ensemble import Ensemble, Start
from compgen.verification.flight import Flight

PERIOD = 5 * MM


def driven(pose, position=None, **columns):
    """A program that drives to positions in the order given, each way a line from the station before."""
    S, K = len(pose), 1 + max(pose)
    places = np.zeros((K, 3)) if position is None else np.array(position, dtype=float)
    nothing, no = np.zeros(S), np.zeros(S, dtype=bool)
    at = Positions(
        number=10 + np.arange(K), tcp=Pose(places, np.tile(np.eye(3), (K, 1, 1))), theta=np.zeros((K, 6)),
        margin=np.ones(K), posture=np.zeros(K, dtype=int), tool=np.zeros(K, dtype=int),
        tools=Pose(np.zeros((1, 3)), np.eye(3)[None]), first=np.arange(K),
    )  # fmt: skip
    given: dict[str, Any] = {
        "at": at, "motion": np.arange(S), "pose": np.array(pose), "joint": no, "line": ~no, "via": no, "stop": no,
        "length": nothing + 1 * MM, "written": nothing, "duration": nothing, "pause": nothing, "untimed": (),
        "flow": (), "origin": np.arange(S) - 1, "carried": no, "circular": no, "beyond": nothing,
    }  # fmt: skip
    return DrivenProgram(**given | columns)


def arc(*positions, circular=True):
    """A plane arc from the first place by the second to the third [mm]."""
    via, ends = np.array([False, True, False]), np.array([False, True, True])
    places = [[x * MM, y * MM, 0.5] for x, y in positions]
    return driven([0, 1, 2], places, via=via, line=~ends, circular=ends & circular)


def on_circle(*degrees, radius=80.0):
    return [(radius * np.cos(a * DEG), radius * np.sin(a * DEG)) for a in degrees]


def test_an_arc_that_comes_to_sweep_more_than_half_a_turn_is_said():
    planned, wider = arc(*on_circle(0, 90, 179.99)), arc(*on_circle(0, 90, 190))
    (finding,) = wide_arcs(planned, wider)
    assert "1 arc sweeps" in finding.message
    assert "P[11] 190.0000" in finding.message
    assert not [*wide_arcs(wider, wider)]  # a controller took it before
    assert not [*wide_arcs(planned, arc(*on_circle(0, 90, 180.0005)))]  # the last digits of a half circle
    assert [*wide_arcs(arc(*on_circle(0, 90, 180.0005)), wider)]
    assert not [*wide_arcs(wider, planned)]
    assert not [*wide_arcs(planned, arc(*on_circle(0, 90, 190), circular=False))]


def test_arcs_in_one_line_are_said_whichever_text_has_them():
    bent, flat = arc((0, 0), (50, 1), (100, 0)), arc((0, 0), (50, 0), (100, 0))
    for pair in ((bent, flat), (flat, bent), (flat, flat)):
        (finding,) = flat_arcs(*pair)
        assert "1 arc has" in finding.message
        assert "P[11]" in finding.message
    assert not [*flat_arcs(bent, bent)]


def test_of_many_flat_arcs_eight_are_named():
    """Nine, one behind the other on a line, each from the end of the one before."""
    S = 18
    places = np.column_stack([np.arange(S + 1) * 10 * MM, np.zeros((S + 1, 2))])
    via = np.arange(S + 1) % 2 == 1
    flat = driven(list(range(S + 1)), places, via=via, line=np.arange(S + 1) < 1)
    (finding,) = flat_arcs(flat, flat)
    assert finding.message.startswith("9 arcs have")
    assert "P[25]" in finding.message
    assert "P[27]" not in finding.message


@pytest.mark.parametrize("unknown", [0, 1, 2])
def test_an_arc_of_which_a_place_is_not_known_is_not_called_flat(unknown):
    flat = arc((0, 0), (50, 0), (100, 0))
    if unknown:
        hidden = replace(flat, pose=np.where(np.arange(3) == unknown, NONE, flat.pose))
    else:
        hidden = replace(flat, origin=np.full(3, NONE))
    assert not [*flat_arcs(hidden, hidden)]


def flight(position, *, turn=0.0, theta=0.0, fraction=1.0, actual=0.0):
    """Samples along x [m], turned about x, at joint angles that are all alike."""
    N = len(np.atleast_1d(position))
    place = np.zeros((N, 3))
    place[:, 0] = position
    turned = rotation_matrix(np.broadcast_to(turn, N)[:, None] * np.eye(3)[0])
    return Flight(
        station=np.arange(N), fraction=np.broadcast_to(fraction, N),
        time=np.arange(N, dtype=np.float64), rise=np.zeros((N, 1)),
        actual=Pose(place + np.broadcast_to(actual, N)[:, None] * np.eye(3)[1], turned),
        commanded=Pose(place, turned), theta=np.tile(np.broadcast_to(theta, N)[:, None], 6),
    )  # fmt: skip


def test_what_a_flight_leaves_is_the_largest_and_the_mean_square_by_length():
    """Errors of 3, 4 and 9 um, the last not judged, that stand for 1 and 3 m."""
    flown = flight([0.0, 0.1, 0.2], actual=np.array([3.0, -4.0, 9.0]) * UM)
    judged, length = np.array([True, True, False]), np.array([1.0, 3.0, 1.0])
    left = residue_of(flown, flown.commanded, judged, length)
    assert_allclose([left.largest, left.rms], [4 * UM, np.sqrt((9 + 3 * 16) / 4) * UM])
    assert residue_of(flown, flown.commanded, judged & False, length) == Residue(0.0, 0.0)


def test_a_joint_may_turn_as_far_as_the_move_of_the_tool_explains():
    """1 / 20 mm and twice: 0.1 rad for a move of a metre, 100 for each radian or metre of a small one."""
    moved, turned = np.array([1.0, 0.2e-3, 0.0, 0.0]), np.array([0.0, 0.3e-3, 0.3e-3, 0.0])
    assert_allclose(explained_turns(moved, turned), np.array([0.1, 0.05, 0.03, 0.0]) + 1e-6)


def test_turns_beyond_what_the_move_explains_are_told_at_stations_and_on_ways():
    """0.1 mm and 0.2 mrad explain 0.03 rad at a station; on a way to one any correction may be, and explains 0.1."""
    planned = flight([0.5, 0.5, 0.5], theta=[0.3, 0.3, 0.3], fraction=[1.0, 0.5, 1.0])
    corrected = flight([0.5001] * 3, turn=0.2e-3, theta=[0.35, 0.35, 0.29], fraction=[1.0, 0.5, 1.0])
    beyond = unexplained_turns(planned, corrected)
    assert_allclose(beyond, np.tile([[0.02], [-0.05], [-0.02]], 6), atol=2e-6)


def test_the_worst_of_corners_and_middle_is_what_is_judged():
    """Of starts 0 to 100 s late the error is the delay [um], of the mean of all the half."""
    ensemble = Ensemble((0.0, 100.0))
    asked = []

    def fly(starts) -> Any:
        asked.append(starts)
        return sum(weight * start.delay for weight, start in starts)

    left: Any = lambda delay: Residue(delay * UM, 0.0)  # noqa: E731
    worst: Any
    worst, served = worst_of_starts(ensemble, fly, left)
    assert_allclose([worst, served.at_mean.largest / UM], [100.0, 50.0])
    assert {start: residue.largest / UM for start, residue in served.flown} == pytest.approx(
        {Start(): 0.0, Start(0, 50.0): 50.0, Start(0, 100.0): 100.0}
    )
    assert served.worst[0] == Start(0, 100.0)
    assert all(weight > 0 for weight, _ in asked[0])  # a start that counts nothing need not be heated for


def test_a_way_is_executed_in_both_texts_or_in_neither():
    one = driven([0, 1, 2], beyond=np.array([0, 0.1, 0]), circular=np.array([True, True, False]))
    other = driven([0, 1, 2], beyond=np.array([0.2, 0, 0]), circular=np.array([True, False, True]))
    for both in as_both_can(one, other):
        assert both.beyond.tolist() == [0.2, 0.1, 0.0]
        assert both.circular.tolist() == [True, False, False]


def runs_one_by_one(drive, free):
    """Stations one after the other; a run ends where the next line is not joined to it."""

    def joined(n):
        a, b = drive.pose[n - 1], drive.pose[n]
        alike = drive.at.tool[a] == drive.at.tool[b] and drive.at.posture[a] == drive.at.posture[b]
        sure = drive.line[n] and drive.origin[n] == n - 1 and not drive.beyond[n] > 0
        return alike and sure and free[n] and free[n - 1] and drive.length[n] > 1e-6

    runs, first = [], 0
    for n in range(1, len(free) + 1):
        if n == len(free) or not joined(n):
            if n - first >= 3 and min(drive.length[first + 1 : n]) < PERIOD:
                runs.append((first, n - 1))
            first = n
    return runs


def test_runs_of_short_lines_are_those_that_a_reader_of_one_station_at_a_time_finds():
    rng = np.random.default_rng(1)
    found = 0
    for _ in range(300):
        S = int(rng.integers(1, 14))
        rare = rng.random((6, S)) < 0.06
        drive = driven(
            rng.integers(0, 4, S).tolist(),
            line=~rare[0], beyond=np.where(rare[1], 0.1, 0.0), origin=np.where(rare[2], NONE, np.arange(S) - 1),
            length=np.where(rare[3], [[np.nan, 0.0, 1e-6][int(rng.integers(3))]] * S, rng.choice([1, 5, 6, 7], S) * MM),
        )  # fmt: skip
        at = drive.at
        at.tool[0], at.posture[1:2] = rng.random() < 0.3, rng.random() < 0.3
        free = ~rare[4]
        runs = dense_runs(drive, free, PERIOD)
        assert runs == runs_one_by_one(drive, free)
        found += len(runs)
    assert found > 100
