r"""Circles through three points, as a controller's circular motion drives them, and the lengths of what is driven.

With u = b - a, v = c - a and w = u x v, which points along the circle's axis,

    r n = (|v|^2 w x u + |u|^2 v x w) / (2 |w|^2),      t = n x w / |w|

n leads from a to the centre, t is the direction of travel at a, r the radius, and the point swept by an angle phi is

    p(phi) = a + r (sin(phi) t + (1 - cos(phi)) n)

so that the chord to a point of the circle has half its angle: phi = 2 atan2(chord . n, chord . t).
"""

from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, dot, frozen, norm, step_lengths

IN_LINE = 1e-9  # height of three points over their longest side, and of it: below only rounding tells their plane


class Arcs(NamedTuple):
    """M arcs from a through b to c."""

    start: Array  # (M, 3) [m]
    tangent: Array  # (M, 3) unit vectors
    normal: Array  # (M, 3) unit vectors to the centre
    radius: Array  # (M,) [m]
    angle: Array  # (M, 2) [rad] swept at b and at c; 0 to 2 pi, NaN where the three points are in line (``IN_LINE``)

    def at(self, angle: Array) -> Array:
        """The points that angles (M, K) [rad] sweep to, (M, K, 3) [m]."""
        along, inwards = np.sin(angle), 2 * np.sin(angle / 2) ** 2
        offset = along[..., None] * self.tangent[:, None] + inwards[..., None] * self.normal[:, None]
        return np.asarray(self.start[:, None] + self.radius[:, None, None] * offset)

    def on_halves(self, arc: IntArray, second: BoolArray, fraction: Array) -> Array:
        """Places (K, 3) [m] on K halves of arcs, from a to b or the second from b to c, at fractions of each."""
        begin = np.where(second, self.angle[arc, 0], 0.0)
        end = self.angle[arc, second.astype(np.int64)]
        on = Arcs(*(column[arc] for column in self))
        return on.at((begin + fraction * (end - begin))[:, None])[:, 0]

    @property
    def lengths(self) -> Array:
        """Of both parts, from a to b and from b to c, (M, 2) [m]."""
        return np.asarray(self.radius[:, None] * np.diff(self.angle, prepend=0.0, axis=1))

    @property
    def sagitta(self) -> Array:
        """How far the arc bulges from its chord, (M,) [m]."""
        return np.asarray(2 * self.radius * np.sin(self.angle[:, 1] / 4) ** 2)


def arcs_through(a: Array, b: Array, c: Array) -> Arcs:
    """The arcs from a through b to c, (M, 3) [m] each."""
    u, v = b - a, c - a
    w = np.cross(u, v)
    size = dot(w, w)
    size = np.where(size > (IN_LINE * np.stack([dot(u, u), dot(v, v), dot(v - u, v - u)]).max(axis=0)) ** 2, size, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        to_centre = dot(v, v)[:, None] * np.cross(w, u) + dot(u, u)[:, None] * np.cross(v, w)
        to_centre /= 2 * size[:, None]
        radius = norm(to_centre)
        normal = to_centre / radius[:, None]
        tangent = np.cross(normal, w) / np.sqrt(size)[:, None]
        halves = np.stack([np.arctan2(dot(chord, normal), dot(chord, tangent)) for chord in (u, v)], axis=1)
    return Arcs(a, tangent, normal, radius, 2 * halves)


def arc_heights(a: Array, b: Array, c: Array) -> Array:
    """How far three points (M, 3) [m] are from one line: the height over the longest side, (M,) [m]."""
    sides = np.stack([norm(b - a), norm(c - a), norm(c - b)])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.nan_to_num(norm(np.cross(b - a, c - a)) / sides.max(axis=0)))


def segment_lengths(position: Array, via: BoolArray) -> Array:
    """Length of the way between neighbouring positions (N, 3), straight or on the arc through a via, (N - 1,) [m].

    Args:
        position: Of the motions' ends and vias in the order in which they are passed [m].
        via: The middle position of a circular motion, (N,).
    """
    length = step_lengths(position)
    middle = np.flatnonzero(via)
    if len(middle):
        length[np.stack([middle - 1, middle], axis=1)] = arcs_through(
            position[middle - 1], position[middle], position[middle + 1]
        ).lengths
    return frozen(length)


def statement_starts(via: BoolArray) -> BoolArray:
    """Which segments begin a statement: all but the second half of an arc, (N,) to (N - 1,)."""
    return np.asarray(~via[:-1])
