"""Findings where a program leaves what is known of the errors."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from compgen.core.pose import Pose
from compgen.error_model.direction_memory import DirectionState
from compgen.error_model.model import ErrorModel
from compgen.error_model.source import ReversalWidths
from compgen.error_model.validity import DrivenPoses, unknown_start_findings
from compgen.robot.robot import Robot


class CurvedError:
    """Displacement along x that grows with the square of J1's direction, and of the travel along y: 1 mm at 1."""

    def actual_pose(self, theta, rise, directions):
        x = directions.direction[:, 0] ** 2 + directions.travel[:, 1] ** 2
        position = 1e-3 * np.column_stack([x, 0 * x, 0 * x]) * np.ones((len(theta), 1))
        return Pose(position, np.tile(np.eye(3), (len(theta), 1, 1)))


@pytest.fixture
def lash(monkeypatch):
    """A source that asks for widths that no motion fades within."""
    widths = ReversalWidths(np.full(6, 1e3), np.full(3, 1e3))
    monkeypatch.setattr("compgen.error_model.validity.reversal_widths", lambda sources: widths)


def test_what_is_unknown_of_a_direction_is_added_to_what_is_assumed(lash):
    """From direction 0.5 the joint may be at 1.5: (1.5^2 - 0.5^2) mm = 2 mm; less would be 0."""
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
    (finding,) = unknown_start_findings(cast(Robot, robot), (), cast(ErrorModel, CurvedError()), driven)
    assert "begins, J1 2000.0 um, y 1500.0 um of half-width" in finding.message
