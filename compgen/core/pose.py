r"""A pose: where something is and how it is turned, seen from something else; one pose, or many, one a row.

With position p and rotation R a point x of the inner frame is at p + R x in the outer one, so

    (p, R) @ (q, S) = (p + R q, R S),      (p, R)^-1 = (-R^T p, R^T)

``pose_base_tcp = pose_base_flange @ pose_flange_tcp``: the outer frame comes first. One pose and many go together as
arrays do, the one serving every row.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, frozen, own
from compgen.core.rotations import rotation_matrix

#: of a pose as files and records have it: place [mm], and W, P, R [deg]
POSE_KEYS = ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg")
#: of an arm's joints likewise, as its pendant shows them [deg]
JOINT_KEYS = tuple(f"j{i}_deg" for i in range(1, 7))


@dataclass(frozen=True, eq=False, slots=True)
class Pose:
    """One pose, or N of them.

    Its arrays are copied unless they are ``frozen``, and cannot be written to.

    Raises:
        ValueError: An array has another shape.
    """

    position: Array  # (3,) or (N, 3) [m]
    rotation: Array  # (3, 3) or (N, 3, 3), the inner axes as columns

    def __post_init__(self) -> None:
        rows = ("N",) if np.ndim(self.position) > 1 else ()
        own(self, position=(*rows, 3), rotation=(*rows, 3, 3))

    @classmethod
    def from_rows(cls, position: Array, rotation: Array) -> "Pose":
        """Many poses as a CasADi function gives them, (N, 3) and row by row (N, 9), taken over without a copy."""
        return cls(frozen(position), frozen(rotation.reshape(-1, 3, 3)))

    @classmethod
    def stack(cls, poses: Sequence["Pose"]) -> "Pose":
        """Single poses as rows."""
        return cls(np.array([p.position for p in poses]), np.array([p.rotation for p in poses]))

    @classmethod
    def concatenate(cls, parts: Sequence["Pose"]) -> "Pose":
        """Many poses, part after part."""
        position, rotation = (np.concatenate([getattr(p, name) for p in parts]) for name in cls.__slots__)
        return cls(frozen(position), frozen(rotation))

    @property
    def content(self) -> bytes:
        """Its numbers, equal for equal poses."""
        return self.position.tobytes() + self.rotation.tobytes()

    @property
    def rotation_rows(self) -> Array:
        """The rotations row by row, as a CasADi function takes them, (N, 9)."""
        return self.rotation.reshape(-1, 9)

    def __len__(self) -> int:
        if self.position.ndim == 1:
            raise TypeError("one pose has no length")
        return len(self.position)

    def __getitem__(self, rows: int | slice | IntArray | BoolArray) -> "Pose":
        """Some of many poses."""
        if self.position.ndim == 1:
            raise TypeError("one pose has no rows")
        return Pose(self.position[rows], self.rotation[rows])

    def __eq__(self, other: object) -> bool:
        """Whether the numbers are the same, to the bit: a pose may name what was built for it."""
        return isinstance(other, Pose) and self.content == other.content

    def __hash__(self) -> int:
        return hash(self.content)

    __iter__ = None  # a pose is not a pair, and a million are not walked one by one
    __array_ufunc__ = None  # an array has no @ with a pose: ``act``

    def __matmul__(self, inner: "Pose") -> "Pose":
        """Of what is at ``inner`` in this frame, seen from the outer one."""
        return Pose(frozen(self.act(inner.position)), frozen(np.asarray(self.rotation @ inner.rotation)))

    def act(self, points: Array) -> Array:
        """Points (3,) or (N, 3) [m] of the inner frame, seen from the outer one."""
        return np.asarray(self.position + np.einsum("...ij,...j->...i", self.rotation, points))

    def inverse(self) -> "Pose":
        """Of the outer frame, seen from the inner one."""
        position = -np.einsum("...ji,...j->...i", self.rotation, self.position)
        return Pose(frozen(position), np.swapaxes(self.rotation, -1, -2))

    def moved(self, change: Array) -> "Pose":
        """Moved by (N, 6): three numbers along the outer axes [m], then a rotation vector in the inner axes [rad]."""
        return Pose(frozen(self.position + change[..., :3]), frozen(self.rotation @ rotation_matrix(change[..., 3:])))


IDENTITY = Pose(np.zeros(3), np.eye(3))
