"""What the optimiser is asked: targets, joints and warmth of a program, and what a correction may look like."""

from dataclasses import dataclass, replace

import numpy as np

from compgen.arrays import Array, BoolArray
from compgen.ik import Posture, flange_of, nearest_turns, solve
from compgen.predict import ErrorModel
from compgen.robot import Robot
from compgen.rotations import matrix_of


@dataclass(frozen=True, slots=True)
class Settings:
    """What a correction may look like."""

    clamp_position: float = 3e-3  # [m]
    clamp_rotation: float = 8.726646259971648e-3  # [rad] 0.5 deg
    rate: float = 0.01  # [m/m] change of the correction along the path
    rate_period: float = 1e-3  # [m] L1
    curvature_period: float = 10e-3  # [m] L2
    lever: float = 0.25  # [m]
    free_spin: bool = False


@dataclass(frozen=True, eq=False, slots=True)
class Problem:
    """Everything known before the correction is chosen."""

    robot: Robot
    model: ErrorModel
    posture: Posture
    tool_position: Array  # (3,) [m] TCP in the flange
    tool_rotation: Array  # (3, 3)
    position: Array  # (N, 3) [m] targets
    rotation: Array  # (N, 3, 3)
    theta: Array  # (N, 6) [rad] joints at the targets
    rise: Array  # (N, K) [K]
    arc: Array  # (N,) [m]
    stop: BoolArray  # (N,)

    def commanded(self, correction: Array) -> tuple[Array, Array]:
        """Poses that the program names, (N, 3) [m] and (N, 3, 3)."""
        return self.position + correction[:, :3], self.rotation @ matrix_of(correction[:, 3:])

    def joints(self, correction: Array) -> tuple[Array, Array]:
        """Joints of the commanded poses on the program's branch (N, 6) [rad], and the reach margin (N,) [m]."""
        position, rotation = self.commanded(correction)
        flange = flange_of(position, rotation, self.tool_position, self.tool_rotation)
        theta, margin = solve(self.robot, *flange, self.posture)
        return nearest_turns(theta, self.theta), margin

    def error(self, correction: Array) -> Array:
        """e_n, (N, 6)."""
        return self.model.error(self.joints(correction)[0], self.rise, self.position, self.rotation)

    def window(self, rows: slice) -> "Problem":
        """The same problem on a stretch of waypoints."""
        return replace(
            self,
            **{f: getattr(self, f)[rows] for f in ("position", "rotation", "theta", "rise", "arc", "stop")},
        )


def weights(settings: Settings) -> Array:
    """W, (6,) [-] for position and [m/rad] for rotation; a free spin keeps a trace, so that it stays determined."""
    w = np.array([1.0, 1.0, 1.0, *3 * [settings.lever]])
    w[5] *= 1e-4 if settings.free_spin else 1.0
    return w


def measure(arc: Array) -> Array:
    """ds_n: the length of path that a waypoint stands for, (N,) [m]."""
    h = np.maximum(np.diff(arc), 1e-12)
    return np.asarray(np.concatenate([[h[0] / 2], (h[:-1] + h[1:]) / 2, [h[-1] / 2]]))
