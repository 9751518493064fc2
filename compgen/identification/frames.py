r"""Frames of instruments and artefacts, reflectors, fixed places: unknown, and fitted with the parameters.

    y = F_i (P + R t_r + v) + c_i

for instrument i and reflector r at flange (P, R), moved by v; y is measured, or a fixed place.
"""

from dataclasses import dataclass, field

import numpy as np

from compgen.core.arrays import Array, IntArray, own
from compgen.identification.measurements import NONE, Measurements


@dataclass(frozen=True, eq=False, slots=True)
class InstrumentFrames:
    """World in each instrument's frame, each reflector in the flange, each fixed place in its frame."""

    rotation: Array  # (V, 3, 3)
    origin: Array  # (V, 3) [m]
    reflector: Array  # (R, 3) [m]
    place: Array = field(default_factory=lambda: np.zeros((0, 3)))  # (S, 3) [m]

    def __post_init__(self) -> None:
        own(self, rotation=("V", 3, 3), origin=("V", 3), reflector=("R", 3), place=("S", 3))

    def rotation_of(self, instrument: IntArray) -> Array:
        """F of each row, (N, 3, 3); none for WORLD, which is -1."""
        return np.concatenate([self.rotation, np.eye(3)[None]])[instrument]

    def origin_of(self, instrument: IntArray) -> Array:
        """c of each row, (N, 3) [m]."""
        return np.concatenate([self.origin, np.zeros((1, 3))])[instrument]

    def near_ends(self, data: Measurements, position: Array, rotation: Array) -> Array:
        """Each row's reflector in World, moved by its shift, (N, 3) [m], for the flange at each pose."""
        P, R = position[data.pose], rotation[data.pose]
        reflector = P + np.einsum("nij,nj->ni", R, self.reflector[data.reflector])
        return np.asarray(reflector if data.ends is None else reflector + data.ends.shift)

    def predict(self, data: Measurements, position: Array, rotation: Array) -> Array:
        """The near end of each row in its instrument's frame, (N, 3) [m]."""
        near = self.near_ends(data, position, rotation)
        F = self.rotation_of(data.instrument)
        return np.asarray(np.einsum("nij,nj->ni", F, near) + self.origin_of(data.instrument))

    def far_ends(self, data: Measurements, position: Array, rotation: Array) -> Array:
        """What each row is compared with, in its instrument's frame, (N, 3) [m]; NaN where not measured."""
        if data.ends is None:
            return data.position
        ends, far = data.ends, data.position.copy()
        at_place, at_pose = ends.place != NONE, ends.pose != NONE
        far[at_place] = self.place[ends.place[at_place]]
        P, R = position[ends.pose[at_pose]], rotation[ends.pose[at_pose]]
        far[at_pose] = P + np.einsum("nij,nj->ni", R, self.reflector[ends.reflector[at_pose]])
        return far

    def difference(self, data: Measurements, position: Array, rotation: Array) -> Array:
        """delta, the far end of each row less its near end, (N, 3) [m]; NaN where not measured."""
        return np.asarray(
            self.far_ends(data, position, rotation) - self.predict(data, position, rotation), dtype=np.float64
        )

    def residual(self, data: Measurements, position: Array, rotation: Array) -> Array:
        """What is measured less what is predicted, (N, 3) [m]: coordinates, or a distance in the first; NaN: none."""
        difference = self.difference(data, position, rotation)
        if data.ends is None:
            return difference
        distances = np.isfinite(data.ends.distance)
        misfit = data.ends.distance - np.linalg.norm(difference, axis=1)
        difference[distances] = misfit[distances, None] * np.array([1.0, np.nan, np.nan])
        return difference


def measured_distance(frames: InstrumentFrames, data: Measurements, position: Array, rotation: Array) -> Array:
    """How far each row was measured from what is predicted, along the coordinates that were measured, (N,) [m]."""
    return np.asarray(np.linalg.norm(np.nan_to_num(frames.residual(data, position, rotation)), axis=1))
