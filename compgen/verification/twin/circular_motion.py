r"""The twin's own circular motion, and a program with arcs as a row of short chords for its clock, its heat and joints.

In the plane of the three positions, the start at the origin, the end at (L, 0) and the via at (x, h), h > 0, the centre
and the radius are

    m = (L / 2, (h^2 + x^2 - L x) / (2 h)),        r = |m|

The tool goes round m clockwise, from the radius s = -m to the one at the via, by the angle atan2(cross, dot) between
both. From any point of the circle, with n the unit vector to the centre and t the direction of travel there,

    p(phi) = p0 + r (sin(phi) t + (1 - cos(phi)) n)

The tool's speed along the arc is constant; its orientation turns evenly about one axis from the start to the via and
about another from the via to the end. That the controller drives a circle through the three places is documented; how
it turns the tool on the way is not, and assumed.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, IntArray, norm
from compgen.core.rotations import interpolate_rotation
from compgen.program.program import Program

CHORD_LENGTH = 3e-3  # [m] of the short chords, at most


class Sweeps(NamedTuple):
    """How each of S segments is driven: p(f) = start + f straight + sin(f angle) along + (1 - cos(f angle)) inwards."""

    length: Array  # (S,) [m]
    angle: Array  # (S,) [rad] 0 on a straight line
    straight: Array  # (S, 3) [m] 0 on an arc
    along: Array  # (S, 3) [m]
    inwards: Array  # (S, 3) [m]

    def rows(self, first: int, last: int) -> Array:
        """Straight, angle, along and inwards of the segments first to before last in one row each, (S, 10)."""
        k = slice(first, last)
        return np.column_stack([self.straight[k], self.angle[k], self.along[k], self.inwards[k]])

    def places(self, position: Array, segment: IntArray, fraction: Array) -> Array:
        """Places (M, 3) [m] of a program with positions (N, 3) at fractions (M,) of segments (M,)."""
        f, k = fraction[:, None], segment
        part = f * self.angle[k, None]
        bow = np.sin(part) * self.along[k] + 2 * np.sin(part / 2) ** 2 * self.inwards[k]
        return np.asarray(position[k] + f * self.straight[k] + bow)


def sweeps(program: Program) -> Sweeps:
    """Of each segment of a program of N positions, (N - 1,)."""
    p, via = program.position, np.flatnonzero(program.via)
    straight = np.diff(p, axis=0)
    length, angle = norm(straight), np.zeros(len(straight))
    along = inwards = np.broadcast_to(0.0, straight.shape)  # takes no memory, for a program of lines is long
    if len(via):
        along, inwards = np.zeros_like(straight), np.zeros_like(straight)
        chord, to_via = p[via + 1] - p[via - 1], p[via] - p[via - 1]
        L = norm(chord)
        x_axis = chord / L[:, None]
        x = np.einsum("ni,ni->n", to_via, x_axis)
        beside = to_via - x[:, None] * x_axis
        h = norm(beside)
        y_axis = beside / h[:, None]
        mx, my = L / 2, (h * h + x * x - L * x) / (2 * h)
        r = np.hypot(mx, my)
        for segment, (sx, sy), (ex, ey) in (
            (via - 1, (-mx, -my), (x - mx, h - my)),
            (via, (x - mx, h - my), (L - mx, -my)),
        ):
            swept = np.arctan2(sy * ex - sx * ey, sx * ex + sy * ey) % (2 * np.pi)
            angle[segment], length[segment] = swept, r * swept
            along[segment] = sy[:, None] * x_axis - sx[:, None] * y_axis
            inwards[segment] = -sx[:, None] * x_axis - sy[:, None] * y_axis
        straight[np.concatenate([via - 1, via])] = 0.0
    return Sweeps(length, angle, straight, along, inwards)


@dataclass(frozen=True, eq=False, slots=True)
class Chords:
    """A program whose arcs are rows of short chords: F positions, F - 1 chords, each with its share of the length."""

    program: Program  # without a via
    length: Array  # (F - 1,) [m] of the arcs and lines that the chords stand for
    rows: IntArray  # (N,) which of the F positions are those of the program with arcs
    segment: IntArray  # (F - 1,) that a chord belongs to
    fraction: Array  # (F - 1,) of the segment at a chord's start

    def times(self, time: Array) -> Array:
        """When the F positions are passed, from when the program's own are, (N,) to (F,) [s]."""
        if len(self.fraction) == len(time) - 1:
            return time
        return np.append(time[self.segment] + self.fraction * np.diff(time)[self.segment], time[-1])


def as_chords(program: Program, sweep: Sweeps) -> Chords:
    """A program by chords; CONFIG's turns on an arc are those of its positions, which are all the same."""
    S = len(sweep.length)
    if not program.via.any():
        number = np.arange(S + 1)
        return Chords(program, sweep.length, number, number[:-1], np.broadcast_to(0.0, S))
    pieces = np.where(sweep.angle > 0, np.maximum(np.ceil(sweep.length / CHORD_LENGTH), 1), 1).astype(np.int64)
    rows = np.concatenate([[0], np.cumsum(pieces)])
    segment = np.repeat(np.arange(S), pieces)
    fraction = (np.arange(len(segment)) - rows[segment]) / pieces[segment]
    at, share = np.append(segment, S - 1), np.append(fraction, 1.0)
    position = sweep.places(program.position, at, share)
    rotation = interpolate_rotation(program.rotation[at], program.rotation[at + 1], share)
    fine, turns = np.zeros(len(at), dtype=bool), program.turns[at]
    position[rows], rotation[rows] = program.position, program.rotation
    fine[rows], turns[rows] = program.fine, program.turns
    chords = replace(
        program,
        position=position,
        rotation=rotation,
        turns=turns,
        speed=program.speed[segment],
        fine=fine,
        via=np.zeros(len(at), dtype=bool),
    )
    return Chords(chords, (sweep.length / pieces)[segment], rows, segment, fraction)
