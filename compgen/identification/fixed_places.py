r"""Places that stand in the cell: spheres of an artefact, sockets of a ballbar; unknown, and fitted along.

What is known of them beforehand are rows of their own, each with its own sigma,

    z = (s_0 - s) / sigma              a sphere's place s in the artefact's frame, near s_0
    z = (l - |s_a - s_b|) / sigma      a certified length l between two

A place that is known exactly is no unknown: what touches it is a row as of an instrument whose frame is the artefact's.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from compgen.core.arrays import Array, IntArray, own

WORLD = -1  # in place of an instrument: no frame of its own
EXACT = 1e-7  # [m] smallest sigma: nothing is known better


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class FixedPlaces:
    """S places that are fitted along, and what is known of them."""

    names: tuple[str, ...] = ()
    frame: IntArray = field(default_factory=lambda: np.zeros(0, dtype=int))  # (S,) of an instrument, or WORLD
    place: Array = field(default_factory=lambda: np.zeros((0, 3)))  # (S, 3) [m]; NaN: unknown
    sigma: Array = field(default_factory=lambda: np.zeros(0))  # (S,) [m] of a coordinate of the places known
    between: IntArray = field(default_factory=lambda: np.zeros((0, 2), dtype=int))  # (L, 2) with a certified length
    length: Array = field(default_factory=lambda: np.zeros(0))  # (L,) [m]
    length_sigma: Array = field(default_factory=lambda: np.zeros(0))  # (L,) [m]
    certified: bool = False  # whether a certificate tells the scale: of places, or of a length

    def __post_init__(self) -> None:
        own(self, frame=("S",), place=("S", 3), sigma=("S",), between=("L", 2), length=("L",), length_sigma=("L",))

    def prior_rows(self, current: Array) -> tuple[Array, Array]:
        """What is known beforehand, at some places (S, 3) [m]: z (H,), and -dz by the places' coordinates (H, 3 S)."""
        S = len(self.names)
        known = np.flatnonzero(np.isfinite(self.place[:, 0]))
        sigma = np.maximum(self.sigma[known], EXACT)
        z = ((self.place[known] - current[known]) / sigma[:, None]).ravel()
        A = np.zeros((3 * len(known) + len(self.length), 3 * S))
        for h, s in enumerate(known.tolist()):
            A[3 * h : 3 * h + 3, 3 * s : 3 * s + 3] = np.eye(3) / sigma[h]
        difference = current[self.between[:, 0]] - current[self.between[:, 1]]
        distance = np.linalg.norm(difference, axis=1)
        length_sigma = np.maximum(self.length_sigma, EXACT)
        toward = difference / np.maximum(distance, EXACT)[:, None] / length_sigma[:, None]
        for h, (a, b) in enumerate(self.between.tolist(), 3 * len(known)):
            A[h, 3 * a : 3 * a + 3] += toward[h - 3 * len(known)]
            A[h, 3 * b : 3 * b + 3] -= toward[h - 3 * len(known)]
        return np.concatenate([z, (self.length - distance) / length_sigma]), A


NO_PLACES = FixedPlaces()


def merged_places(parts: Sequence[FixedPlaces], first_frame: Sequence[int]) -> tuple[FixedPlaces, list[IntArray]]:
    """Places of several files as one, told apart by name, and the number that each place of each file has there.

    Args:
        parts: Of each file.
        first_frame: The number that each file's first instrument has among all.
    """
    names = list(dict.fromkeys(name for part in parts for name in part.names))
    numbers = [np.array([names.index(name) for name in part.names], dtype=int) for part in parts]
    frame, place, sigma = np.full(len(names), WORLD), np.full((len(names), 3), np.nan), np.zeros(len(names))
    lengths: dict[tuple[int, int], tuple[float, float]] = {}
    for part, number, first in zip(parts, numbers, first_frame, strict=False):
        frame[number] = np.where(part.frame == WORLD, WORLD, part.frame + first)
        place[number], sigma[number] = part.place, part.sigma
        for (a, b), length, of_length in zip(
            part.between.tolist(), part.length.tolist(), part.length_sigma.tolist(), strict=True
        ):
            lengths[int(number[a]), int(number[b])] = (length, of_length)
    values = np.array(list(lengths.values())).reshape(-1, 2)
    between = np.array(list(lengths), dtype=int).reshape(-1, 2)
    certified = any(part.certified for part in parts)
    merged = FixedPlaces(
        names=tuple(names),
        frame=frame,
        place=place,
        sigma=sigma,
        between=between,
        length=values[:, 0],
        length_sigma=values[:, 1],
        certified=certified,
    )
    return merged, numbers
