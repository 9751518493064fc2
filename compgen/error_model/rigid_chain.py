r"""An arm as six turns about fixed lines: what other software can take of an identified robot, hot or cold.

Of joints q counted from pendant zero, with line i along w_i through p_i in World at zero (Brockett 1984),

    flange(q) = E_1(q_1) ... E_6(q_6) flange(0),        E_i(q): the turn by q about line i

Lengths, zeros, frames and heat at given rises leave an arm such a chain, and the lines are exact: a quarter turn of
joint i alone is E_i. What depends on loads, on directions or on other joints' angles does not, and is left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from compgen.core.arrays import Array, owns
from compgen.core.pose import IDENTITY, Pose
from compgen.core.rotations import rotation_matrix
from compgen.error_model.direction_memory import NO_DIRECTION, DirectionState
from compgen.error_model.model import build_error_model
from compgen.error_model.source import Source
from compgen.robot.arm_geometry import axes_of_poses, spread_joints
from compgen.robot.robot import Robot

QUARTER = np.pi / 2
POSES = 1000  # at which the chain is compared with the model
SAME = 1e-9  # m and rad
#: the sides that six joints may come from, and the tool along World's axes
SIDES = [DirectionState(np.array([side]), np.array([side[:3]])) for side in product((1.0, -1.0), repeat=6)]


@dataclass(frozen=True, eq=False, slots=True)
@owns(line=(6, 3), point=(6, 3))
class RigidChain:
    """Six lines at pendant zero in World, and the flange there."""

    line: Array  # (6, 3) unit vectors w
    point: Array  # (6, 3) [m] p
    flange: Pose
    left_out: tuple[str, ...]  # sources that are no fixed lines
    off: float  # [m] by which the model leaves the chain at most, at poses over the joints' ranges, from any side

    def flange_pose(self, q: Array) -> Pose:
        """Flange poses in World of joints counted from pendant zero as theta counts, (N, 6) [rad]."""
        N = len(q)
        position = np.tile(self.flange.position, (N, 1))
        rotation = np.tile(self.flange.rotation, (N, 1, 1))
        for w, p, angle in zip(self.line[::-1], self.point[::-1], q.T[::-1], strict=True):
            turn = rotation_matrix(angle[:, None] * w)
            position = np.einsum("nij,nj->ni", turn, position - p) + p
            rotation = turn @ rotation
        return Pose(position, rotation)


def rigid_chain(robot: Robot, sources: Sequence[Source], rise: Array) -> RigidChain:
    """The chain of an arm whose parts are so warm.

    Args:
        robot: The nominal arm.
        sources: Of its error.
        rise: Of its nodes, (K,) [K]; none: cold.
    """
    zero = robot.to_theta(np.zeros(6))
    low, high = robot.lower - zero, robot.upper - zero
    q = low + (high - low) * spread_joints(POSES)

    def flange_with(parts: Sequence[Source], q: Array, side: DirectionState = NO_DIRECTION) -> Pose:
        model = build_error_model(robot, parts, len(rise), IDENTITY)
        return model.actual_pose(zero + q, np.tile(rise if len(rise) else np.zeros(1), (len(q), 1)), side)

    def chain_with(parts: Sequence[Source]) -> tuple[RigidChain, float]:
        axes = axes_of_poses(flange_with(parts, np.vstack([np.zeros(6), QUARTER * np.eye(6)])))
        chain = RigidChain(axes.line, axes.point, axes.flange, (), 0.0)
        ours, its = chain.flange_pose(q), flange_with(parts, q, SIDES[0])
        off = float(np.abs(ours.position - its.position).max())
        return chain, max(off, float(np.abs(ours.rotation - its.rotation).max()))

    kept = [source for source in sources if chain_with([source])[1] < SAME]
    chain, off = chain_with(kept)
    if off > SAME:
        raise ValueError("sources that are fixed lines alone are none together")
    left = tuple(source.NAME for source in sources if source not in kept)
    if not left:
        return chain
    ours = chain.flange_pose(q).position
    gaps = [np.linalg.norm(flange_with(sources, q, side).position - ours, axis=1).max() for side in SIDES]
    return RigidChain(chain.line, chain.point, chain.flange, left, float(max(gaps)))
