"""Pages joined to the program that they are of, what keeps two apart, and what a program takes of a controller."""

import json
import re
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen import fanuc
from compgen.core.rotations import rotation_matrix
from compgen.core.units import MM
from compgen.planning.toolpath import ToolPath
from compgen.program.page_stops import add_stops, canonical_size, place_page_stops
from compgen.program.pages import JoinError, excerpt, is_as_written, join_programs, with_checksum
from compgen.program.program import Program
from compgen.robot.inverse_kinematics import Posture
from compgen.robot.robot import Capacity, Robot

N = 12
RNG = np.random.default_rng(6)
WHOLE = Program(
    name="WHOLE",
    comment="",
    date="26-01-01",
    remarks=("one", "two"),
    uframe=1,
    utool=2,
    position=RNG.normal(size=(N, 3)),
    rotation=rotation_matrix(0.3 * RNG.normal(size=(N, 3))),
    posture=Posture(),
    turns=np.arange(3 * N).reshape(N, 3) // 20,
    speed=RNG.uniform(0.1, 0.3, N - 1),
    fine=np.isin(np.arange(N), [0, 4, 7, N - 1]),
)
PAGES = [excerpt(WHOLE, first, last) for first, last in ((0, 4), (4, 7), (7, N - 1))]


def test_pages_joined_are_the_program_and_each_begins_where_the_one_before_stopped():
    whole, starts = join_programs(PAGES)
    assert starts.tolist() == [0, 4, 7]
    for name in ("position", "rotation", "turns", "speed", "fine", "via"):
        assert np.array_equal(getattr(whole, name), getattr(WHOLE, name))


def moved(page, mm=0.0, mrad=0.0, axis=(0, 0, 1)):
    """A page that begins elsewhere."""
    position, rotation = page.position.copy(), page.rotation.copy()
    position[0] += np.array([0, mm, 0]) * MM
    rotation[0] = rotation[0] @ rotation_matrix(mrad * 1e-3 * np.array([axis]) / np.linalg.norm(axis))[0]
    return replace(page, name="SECOND", position=position, rotation=rotation)


@pytest.mark.parametrize(
    ("second", "why"),
    [
        (moved(PAGES[1], mm=0.25), "page SECOND: it starts 0.250 mm from where WHOLE stopped"),
        (moved(PAGES[1], mrad=0.1), "page SECOND: it starts turned by 0.0057 deg against where WHOLE stopped"),
        (moved(PAGES[1], mrad=1000 * np.pi / 2), "turned by 90.0000 deg"),
        (moved(PAGES[1], mrad=1000 * np.pi), "turned by 180.0000 deg"),
        (moved(PAGES[1], mrad=1000 * np.pi / 180, axis=(1, 1, 1)), "turned by 1.0000 deg"),
        (replace(PAGES[1], turns=PAGES[1].turns + 1), "its turns differ"),
        (replace(PAGES[1], utool=3), "its utool differ"),
    ],
)
def test_a_page_that_does_not_begin_where_the_one_before_stopped_is_refused(second, why):
    with pytest.raises(JoinError, match=why):
        join_programs([PAGES[0], second])


def test_a_page_written_anew_may_begin_as_far_off_as_it_was_told():
    """The joined program then has the place of the stop; a turn of a degree is too much all the same."""
    steps = {"SECOND": 0.25 * MM}
    whole, _ = join_programs([PAGES[0], moved(PAGES[1], mm=0.25, mrad=15)], steps)
    assert_allclose(whole.position, WHOLE.position[:8], atol=0)
    for mm, mrad, axis in ((0.26, 0, (0, 0, 1)), (0.1, 21, (0, 0, 1)), (0.1, 21, (1, 1, 1))):
        with pytest.raises(JoinError, match="page SECOND"):
            join_programs([PAGES[0], moved(PAGES[1], mm=mm, mrad=mrad, axis=axis)], steps)


def test_a_page_that_runs_through_at_its_end_is_refused():
    rolling = replace(PAGES[0], fine=np.zeros(5, dtype=bool))
    with pytest.raises(JoinError, match="page WHOLE: it does not stop"):
        join_programs([rolling, PAGES[1]])


def test_a_programs_size_has_the_lines_that_its_text_counts():
    (count,) = re.findall(rb"LINE_COUNT\t= (\d+)", fanuc.compose(WHOLE))
    size = canonical_size(N, len(WHOLE.remarks))
    assert (size.lines, size.positions) == (int(count), N)


def test_a_controller_without_room_for_a_page_is_told():
    """One whose memory holds less than two positions beside the main program."""
    controller = SimpleNamespace(capacity=Capacity(9999, 9999, 500.0, 8))
    path = SimpleNamespace(arc=np.arange(100.0), stop=np.isin(np.arange(100), [0, 99]))
    robot, tool_path = cast(Robot, SimpleNamespace(controller=controller)), cast(ToolPath, path)
    stops = place_page_stops(robot, tool_path, np.zeros((100, 6)), 3, on_the_part=True, payload=False)
    assert stops is not None
    assert "no room for a page" in stops.obstacle
    assert np.array_equal(stops.stop, path.stop)
    assert not stops.added.any()


def test_a_path_on_the_part_that_may_not_stop_there_gets_no_stop_and_is_told():
    on_part, stop = np.ones(30, dtype=bool), np.isin(np.arange(30), [0, 29])
    stops = add_stops(np.ones(30), stop, on_part, 10, on_the_part=False)
    assert "between waypoints 2 and 10" in stops.obstacle
    assert np.array_equal(stops.stop, stop)
    assert not stops.added.any()
    assert stops.on_the_part == 0


@pytest.mark.parametrize(("at", "added"), [(5, 0), (9, 0), (4, 1)])
def test_a_stop_of_the_path_from_half_a_page_on_is_taken_before_one_is_added(at, added):
    """Of pages of ten positions, on a path of 14 beside the part."""
    stop, nowhere = np.isin(np.arange(14), [0, at, 13]), np.zeros(14, dtype=bool)
    stops = add_stops(np.ones(14), stop, nowhere, 10, on_the_part=False)
    assert (stops.added.sum(), stops.obstacle) == (added, "")


@pytest.mark.parametrize(("still", "at"), [([6], 6), ([5, 8], 8), ([3], 9), ([], 9)])
def test_a_stop_is_added_where_the_joints_move_least_the_last_of_such(still, at):
    """From half a page of ten positions on: elsewhere they move a tenth more."""
    rate = np.where(np.isin(np.arange(14), still), 1.0, 1.1)
    stops = add_stops(rate, np.isin(np.arange(14), [0, 13]), np.zeros(14, dtype=bool), 10, on_the_part=False)
    assert np.flatnonzero(stops.added).tolist() == [at]


def test_a_manifest_is_as_it_was_written_whatever_its_layout_until_it_says_something_else():
    written = json.loads(with_checksum({"name": "PART", "pages": [{"order": 1, "start_h": 2.5}]}))
    assert is_as_written(json.loads(json.dumps(written, indent=7)))
    assert not is_as_written({**written, "name": "OTHER"})
    assert not is_as_written({key: value for key, value in written.items() if key != "pages"})
    assert not is_as_written({key: written[key] for key in ("name", "pages")})
