"""Findings where a program leaves what is known of the errors."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from compgen.core.pose import Pose
from compgen.error_model.beyond_measured import (
    DrivenPoses,
    joint_box_findings,
    joint_halves,
    map_findings,
    settling,
    unknown_start_findings,
)
from compgen.error_model.direction_memory import DirectionState
from compgen.error_model.model import ErrorModel
from compgen.error_model.source import ReversalWidths, Source
from compgen.error_model.sources.measured_map import AxisMap
from compgen.robot.robot import Robot


class CurvedError:
    """Displacement along x that grows with the square of J1's direction, and of the travel along y: 1 mm at 1."""

    actual = SimpleNamespace(size1_in=lambda input: 5)

    def __init__(self, size=1e-3):
        self.size = size

    def actual_pose(self, theta, rise, directions):
        x = directions.direction[:, 0] ** 2 + directions.travel[:, 1] ** 2
        position = self.size * np.column_stack([x, 0 * x, 0 * x]) * np.ones((len(theta), 1))
        return Pose(position, np.tile(np.eye(3), (len(theta), 1, 1)))


class Lash:
    """A source with widths of its own."""

    def __init__(self, widths):
        self.reversal_widths = lambda: widths
        self.with_widths = lambda factor: self


def test_what_is_unknown_of_a_direction_is_added_to_what_is_assumed():
    """Where no motion fades it: from direction 0.5 the joint may be at 1.5, (1.5^2 - 0.5^2) mm = 2 mm; less were 0."""
    robot = SimpleNamespace(joint_names=tuple(f"J{i}" for i in range(1, 7)))
    directions = DirectionState(np.full((2, 6), 0.5), np.full((2, 3), 0.25))
    still = np.zeros((2, 6))
    driven = DrivenPoses(
        theta=still,
        position=still[:, :3],
        rise=still[:, :5],
        directions=directions,
        contact=np.array([True, True]),
    )
    lash = cast(Source, Lash(ReversalWidths(np.full(6, 1e3), np.full(3, 1e3))))
    (finding,) = unknown_start_findings(cast(Robot, robot), (lash,), cast(ErrorModel, CurvedError()), driven)
    assert "begins, J1 2000.0 um, y 1500.0 um of half-width" in finding.message


@pytest.mark.parametrize(("um", "is_told"), [(0.45, False), (0.55, True)])
def test_less_than_a_micrometre_of_what_is_unknown_is_not_told(um, is_told):
    """Of a joint and an axis together."""
    still = np.zeros((1, 6))
    driven = DrivenPoses(
        theta=still,
        position=still[:, :3],
        rise=still[:, :5],
        directions=DirectionState(still, still[:, :3]),
        contact=np.array([True]),
    )
    robot = cast(Robot, SimpleNamespace(joint_names=("J1", "J2", "J3", "J4", "J5", "J6")))
    lash = cast(Source, Lash(ReversalWidths(np.full(6, 1e3), np.full(3, 1e3))))
    findings = [*unknown_start_findings(robot, (lash,), cast(ErrorModel, CurvedError(um * 1e-6)), driven)]
    assert [f.code.value for f in findings] == ["sources.start"] * is_told
    assert not [*unknown_start_findings(robot, (), cast(ErrorModel, CurvedError()), driven)]


def measured_line(axis, first, last, place):
    zero = np.zeros((2, 3))
    station = np.array([first, last])
    return AxisMap(forward=zero, reverse=zero, axis=axis, station=station, place=np.array(place), width=0.01)


def test_positions_beyond_the_box_of_the_measured_lines_are_counted_and_measured():
    """The entry of a line's place along it says nothing; what lies on the box's faces is within."""
    lines = [measured_line(0, 1.0, 1.5, (9, -0.2, 0.3)), measured_line(1, -0.5, 0.4, (1.2, 9, 0.1))]
    low, high = np.array([1.0, -0.5, 0.1]), np.array([1.5, 0.4, 0.3])
    places = np.array([low, high, (low + high) / 2, low, high])
    assert not [*map_findings(lines, places)]
    assert not [*map_findings([], places + 1)]
    places[2, 0], places[4, 1] = 1.507, -0.512
    (finding,) = map_findings(lines, places)
    ranges = "x by up to 7.0 mm (1000 to 1500 measured), y by up to 12.0 mm (-500 to 400 measured)"
    assert finding.message.startswith(f"2 of 5 positions, first 3, leave the measured map's hull in {ranges}; ")
    (finding,) = map_findings(lines, places, np.arange(20, 25))
    assert finding.message.startswith("2 of 5 positions, first 23, ")


def test_joints_beyond_those_of_the_identification_are_named_by_how_far():
    robot = cast(Robot, SimpleNamespace(to_pendant=lambda theta: theta))
    box = np.array(6 * [[-1.0, 2.0]])
    theta = np.vstack([box[:, 0], box[:, 1]])
    assert not [*joint_box_findings(robot, box, theta)]
    assert not [*joint_box_findings(robot, None, 9 * theta)]
    theta[0, 1], theta[1, 4] = -1.0 - np.radians(3.0), 2.0 + np.radians(0.4)
    (finding,) = joint_box_findings(robot, box, theta)
    assert (
        "in: J2 by up to 3.0 deg (-57.2958 to 114.592), J5 by up to 0.4 deg (-57.2958 to 114.592); " in finding.message
    )


def test_joints_and_tool_settle_where_a_tenth_of_a_micrometre_is_left_of_what_they_move():
    """Of 1 mm of J1 and of the way along y; of what moves nothing after three widths, of play after 2.2."""
    model, theta = cast(ErrorModel, CurvedError()), np.zeros(6)
    assert joint_halves(model, np.zeros((2, 6))) == pytest.approx(np.tile([1e-3, 0, 0, 0, 0, 0], (2, 1)))
    joint = np.array([0.01, 0.02, np.inf, np.inf, np.inf, 0.03])
    lash = cast(Source, Lash(ReversalWidths(joint, np.array([0.005, 0.004, np.inf]))))
    turn, travel = settling((lash,), model, theta)
    assert 1e-3 * np.exp(-turn[0] / 0.01) == pytest.approx(1e-7)
    assert 1e-3 * np.exp(-travel / 0.004) == pytest.approx(1e-7)
    assert turn[1:] == pytest.approx([0.06, 0, 0, 0, 0.09])
    slow = cast(Source, Lash(ReversalWidths(joint, np.array([0.02, 0.004, np.inf]), "play")))
    turn, travel = settling((slow,), model, theta)
    assert turn == pytest.approx(2.2 * np.where(np.isfinite(joint), joint, 0.0))
    assert travel == pytest.approx(0.06)
    assert settling((), model, theta)[1] == 0.0
