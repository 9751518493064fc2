r"""What the optimiser is given: targets, joints, temperatures and limits; and what it answers.

A correction c_n moves the commanded pose of waypoint n: three numbers of position in base axes [m], three of rotation
in tool axes [rad]. What it leaves, and what it does to the joints, is

    commanded_n = target_n (+) c_n,      e_n(c) = actual(theta(commanded_n), rise_n) (-) target_n
"""

from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

import numpy as np

from compgen.compensation.expressions import CorrectionFunctions, build_commanded_pose, build_correction_functions
from compgen.core.arrays import Array, BoolArray, IntArray, owns
from compgen.core.evaluation import evaluate
from compgen.core.pose import Pose
from compgen.error_model.direction_memory import NO_DIRECTION, DirectionState
from compgen.error_model.model import ErrorModel
from compgen.robot.inverse_kinematics import Posture
from compgen.robot.robot import Robot

NEAR_EDGE = 0.02  # [rad] from an edge of the J2/J3 polygon, at the planned joints, within which it is held


class Solver(Enum):
    """Who finds the optimum."""

    STRUCTURED = "structured"
    IPOPT = "ipopt"


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Smoothness and limits of a correction, and the solver."""

    clamp_position: float = 3e-3  # [m]
    clamp_rotation: float = 8.726646259971648e-3  # [rad] 0.5 deg
    rate: float = 0.01  # [m/m] change of the correction along the path
    rate_period: float = 1e-3  # [m] L1
    curvature_period: float = 10e-3  # [m] L2
    lever: float = 0.25  # [m]
    free_spin: bool = False
    solver: Solver = Solver.STRUCTURED
    margin: float = 0.0  # standard deviations of the band that joints keep from their limits


class Joints(NamedTuple):
    """Joints of N commanded poses."""

    theta: Array  # (N, 6) [rad]
    margin: Array  # (N,) [m] how far inside the reach


class Residual(NamedTuple):
    """What a correction leaves at N waypoints."""

    e: Array  # (N, 6) [m] and [rad]
    theta: Array  # (N, 6) [rad]
    margin: Array  # (N,) [m] how far inside the reach


class LocalError(NamedTuple):
    """Error and joints of N waypoints about a correction."""

    e: Array  # (N, 6)
    error_jacobian: Array  # (N, 6, 6) de/dc
    theta: Array  # (N, 6)
    theta_jacobian: Array  # (N, 6, 6) dtheta/dc


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Problem:
    """Everything known before the correction is chosen."""

    robot: Robot
    model: ErrorModel
    posture: Posture
    tool: Pose  # TCP in the flange
    target: Pose  # N of the TCP
    theta: Array  # (N, 6) [rad] joints at the targets
    rise: Array  # (N, K) [K]
    arc: Array  # (N,) [m]
    stop: BoolArray  # (N,)
    direction_state: DirectionState = NO_DIRECTION  # where the planned joints and the TCP come from

    def commanded(self, correction: Array) -> Pose:
        """Poses that the program names: ``target.moved(correction)``, some times as fast for many."""
        target = self.target.position, self.target.rotation_rows
        return Pose.from_rows(*evaluate(build_commanded_pose(), *target, correction))

    def joints(self, correction: Array) -> Joints:
        """Joints of the commanded poses on the program's branch."""
        theta, margin = evaluate(self._functions().joints, *self._targets(), correction)
        return Joints(theta, margin[:, 0])

    def residual(self, correction: Array) -> Array:
        """The error that a correction leaves: e_n, (N, 6)."""
        return self.evaluate_residual(correction).e

    def evaluate_residual(self, correction: Array) -> Residual:
        """The error that a correction leaves, and the joints it leads to."""
        e, theta, margin = evaluate(self._functions().residual, *self._targets(), correction, *self._arm_state())
        return Residual(e, theta, margin[:, 0])

    def linearise(self, correction: Array) -> LocalError:
        """Error and joints about a correction."""
        e, E, theta, G = evaluate(self._functions().linearised, *self._targets(), correction, *self._arm_state())
        E, G = (np.swapaxes(rows.reshape(-1, 6, 6), 1, 2) for rows in (E, G))
        return LocalError(e, E, theta, G)

    def pointwise_correction(self) -> Array:
        """The correction that leaves no error, each waypoint for itself, (N, 6)."""
        return evaluate(self._functions().pointwise, *self._targets(), *self._arm_state())[0]

    def window(self, rows: slice | IntArray) -> "Problem":
        """The problem of some of its waypoints."""
        return replace(
            self,
            direction_state=self.direction_state.at(rows),
            **{f: getattr(self, f)[rows] for f in ("target", "theta", "rise", "arc", "stop")},
        )

    def _functions(self) -> CorrectionFunctions:
        return build_correction_functions(self.robot, self.model, self.posture, self.tool)

    def _targets(self) -> tuple[Array, Array, Array]:
        return self.target.position, self.target.rotation_rows, self.theta

    def _arm_state(self) -> tuple[Array, Array, Array]:
        return self.rise, self.direction_state.direction, self.direction_state.travel


class Status(Enum):
    """How it ended, in the user's words."""

    CONVERGED = "every waypoint reaches its target within the smoothness asked for"
    LIMITED = "limits hold some waypoints off their targets; the best legal correction is taken there"
    FAILED = "the optimiser found no legal correction"
    UNSETTLED = "the optimiser did not converge"
    STOPPED = 'ipopt stopped before the optimum; compensation.solver = "structured" solves the same problem'

    @property
    def is_legal(self) -> bool:
        """Whether there is a correction to command."""
        return self in (Status.CONVERGED, Status.LIMITED)


ActiveLimits = tuple[tuple[int, str], ...]  # waypoint, from 1, and name of each


@dataclass(frozen=True, eq=False, slots=True)
class Optimum:
    """What a solver says of a stretch, or of a whole program."""

    correction: Array  # (N, 6)
    status: Status
    iterations: int = 0
    last_step: float = 0.0  # [m] what a further iteration would change, about

    @property
    def converged(self) -> bool:
        """Whether it is the optimum."""
        return self.status is Status.CONVERGED


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(correction=("N", 6), theta=("N", 6), residual=("N", 6))
class Solution(Optimum):
    """The correction of a program and how it was found."""

    theta: Array  # (N, 6) [rad] joints of the commanded poses
    residual: Array  # (N, 6) predicted error that stays
    active_limits: ActiveLimits  # that bind
    unsolved: tuple[int, int] | None = None  # first and last waypoint, from 1, of a stretch without an optimum
