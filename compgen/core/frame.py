r"""A frame in World, and what stands in it.

World <- frame:  P = o + R p,   S = R s          frame <- World:  p = R^T (P - o),   s = R^T S
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, own


@dataclass(frozen=True, eq=False, slots=True)
class Frame:
    """A place and an orientation in World."""

    position: Array  # (3,) [m]
    rotation: Array  # (3, 3) its axes as columns

    def __post_init__(self) -> None:
        own(self, position=(3,), rotation=(3, 3))

    def to_world(self, position: Array, rotation: Array) -> tuple[Array, Array]:
        """Poses given in the frame, (N, 3) [m] and (N, 3, 3), in World."""
        return self.position + position @ self.rotation.T, np.asarray(self.rotation @ rotation)

    def from_world(self, position: Array, rotation: Array) -> tuple[Array, Array]:
        """Poses given in World, (N, 3) [m] and (N, 3, 3), in the frame."""
        return (position - self.position) @ self.rotation, np.asarray(self.rotation.T @ rotation)
