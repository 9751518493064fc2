"""How a path is looked at: which box of space is shown, from where, and where a point then lies in the picture.

The projection is orthographic and all axes have one scale: a length is as long wherever it is, and the same picture
can be drawn by plotly and by ourselves.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, column_extremes, owns

THIN = 0.22  # of the longest side: what every other side has at least, so that its axis can be read
NEAR = 0.5  # of the longest side: what is no part but so near is shown too
CLOSE, FAR = 60, 4  # percentile of the distances from the middle, and how many times that is far away
SHORT = 0.35  # of the longest side
SMALLEST = 20.0  # a box's longest side [mm]
AZIMUTHS = (-60.0, -30.0, 30.0, 60.0, -120.0, -150.0, -75.0, -15.0)  # of the eye [deg]; the first of equals
ELEVATIONS = (35.0, 60.0, 20.0)


@dataclass(frozen=True, eq=False, slots=True)
@owns(low=(3,), high=(3,), right=(3,), up=(3,), eye=(3,))
class View:
    """A box of space in World, and a picture of it."""

    low: Array  # (3,) [mm]
    high: Array  # (3,) [mm]
    right: Array  # (3,) unit vector to the picture's right
    up: Array  # (3,)
    eye: Array  # (3,) towards who looks

    @property
    def size(self) -> Array:
        """Sides of the box, (3,) [mm]."""
        return np.asarray(self.high - self.low)

    @property
    def short(self) -> BoolArray:
        """Which axes are too short for several numbers and a name beside them, (3,)."""
        return np.asarray(self.size < SHORT * self.size.max())

    @property
    def extent(self) -> tuple[float, float]:
        """How far the box reaches from its middle to the right and up, where its longest side is 1."""
        half = self.size / (2 * self.size.max())
        return float(np.abs(self.right) @ half), float(np.abs(self.up) @ half)

    def project(self, places: Array) -> Array:
        """Right and up of the middle, (N, 2), where the box's longest side is 1; ``places`` (N, 3) [mm]."""
        centred = (places - (self.low + self.high) / 2) / self.size.max()
        return np.asarray(centred @ np.column_stack([self.right, self.up]))

    def shows(self, places: Array) -> BoolArray:
        """Which places lie in the box, (N,)."""
        slack = 1e-7 * self.size.max()
        return _within(places, self.low - slack, self.high + slack)


def view_of(places: Array, part: BoolArray) -> View:
    """The view of a path: ranges by the part and what lies near it, the side from which most of it is seen.

    Args:
        places: (N, 3) [mm].
        part: Which of them are on the part, (N,); all where none is.
    """
    core = places[part] if part.any() else places
    low, high = column_extremes(core)
    reach = NEAR * max(float((high - low).max()), SMALLEST)
    low, high = column_extremes(places[_within(places, low - reach, high + reach)])
    longest = max(float((high - low).max()), SMALLEST)
    half = np.maximum(1.04 * (high - low), THIN * longest) / 2
    half[np.argmax(half)] = max(half.max(), longest / 2)
    middle = (low + high) / 2
    right, up, eye = _side(core)
    return View(middle - half, middle + half, right, up, eye)


def _within(places: Array, low: Array, high: Array) -> BoolArray:
    """Which places (N, 3) lie in a box, (N,): column by column, for a path has many."""
    inside = np.ones(len(places), dtype=bool)
    for column, least, most in zip(places.T, low, high, strict=True):
        inside &= (column >= least) & (column <= most)
    return inside


def close_together(places: Array) -> BoolArray:
    """Places without those that lie far from where most are, (N,); none of none."""
    if len(places) == 0:
        return np.zeros(0, dtype=np.bool_)
    distance = np.linalg.norm(places - np.median(places, axis=0), axis=1)
    return np.asarray(distance <= FAR * np.percentile(distance, CLOSE) + 1e-9)


def _side(places: Array) -> tuple[Array, Array, Array]:
    """Right, up and towards the eye, from where the places spread most over the picture."""
    centred = places - places.mean(axis=0)
    spread = centred.T @ centred / len(places)
    best, chosen = -1.0, None
    for elevation in np.deg2rad(ELEVATIONS):
        for azimuth in np.deg2rad(AZIMUTHS):
            right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
            level = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
            eye = np.cos(elevation) * level + np.sin(elevation) * np.array([0.0, 0.0, 1.0])
            up = np.cross(eye, right)
            axes = np.column_stack([right, up])
            small, large = np.sqrt(np.maximum(np.linalg.eigvalsh(axes.T @ spread @ axes), 0.0))
            score = float(large * (small + 0.1 * large))
            if chosen is None or score > best * 1.02:
                best, chosen = score, (right, up, eye)
    return chosen if chosen is not None else (np.eye(3)[0], np.eye(3)[2], -np.eye(3)[1])


def ticks(low: float, high: float, most: int) -> Array:
    """Round numbers from low to high, at most so many but at least one where the range has room for it."""
    for step in (base * 10.0**power for power in range(-4, 6) for base in (1, 2, 5)):
        first = np.ceil(low / step - 1e-9)
        count = int(np.floor(high / step + 1e-9) - first) + 1
        if count <= most:
            return np.asarray(step * (first + np.arange(max(count, 0)))) + 0.0
    return np.zeros(0)


def middle_tick(low: float, high: float) -> float:
    """A round number near the middle of a range, for an axis that is too short for more."""
    numbers = ticks(low, high, 3)
    return float(numbers[np.argmin(np.abs(numbers - (low + high) / 2))]) if len(numbers) else (low + high) / 2
