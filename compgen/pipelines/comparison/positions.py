r"""How far the commanded positions of two programs are apart, in World, by the texts that were written.

With the same planned points, P[n] of one against P[n] of the other. Else, on the same path, along it: at the length s
of each planned point of A

    movement(s) = correction_B(s) - correction_A(s),        correction = commanded - planned

where B's correction is linear between its positions: it is smooth, whatever the spacing. Their orientations are those
of the programs themselves, turned evenly between two positions, as a controller does. On another path, or one that is
said in other statements, each position of one against the nearest place on the path that the other commands.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, IntArray, interpolated, lengths_along, row_norms
from compgen.core.commands import Command
from compgen.core.rotations import interpolate_rotation, relative_rotation
from compgen.core.units import DEG, MM
from compgen.pipelines.comparison.outputs import Output, naming_damage
from compgen.pipelines.comparison.texts import TextPositions, commanded_positions, distance_to_path, drawn

SAME_POINT = 1e-7  # [m] two planned points of one place
SAME_PATH = 1e-4  # [m] two planned paths that are one but for where their points are: above a chord, below a move
UNCHANGED = 1e-9  # [m] or [rad] two numbers that are printed alike
DECIMALS = 3  # of the numbers in a text, unless the robot's controller has more


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Movement:
    """How far the commanded positions of B are from those of A, at N positions of A."""

    matched: str  # "number", "length" or "nearest"
    number: IntArray  # (N,) of the positions
    distance: Array  # (N,) [m]
    angle: Array | None  # (N,) [rad]; None at nearest places
    back: Array | None = None  # (M,) [m] at nearest places: of B's positions from the path of A
    in_joints: int = 0  # positions in joint form, of which no distance is told
    in_joints_moved: int = 0  # of these: that read otherwise
    same_within: float = UNCHANGED  # [m] what the digits of the texts leave open
    same_angle: float = UNCHANGED  # [rad]

    @property
    def moved(self) -> int:
        """Positions of A that are elsewhere in B."""
        moved = self.distance > self.same_within
        return int(np.count_nonzero(moved if self.angle is None else moved | (self.angle > self.same_angle)))

    @property
    def is_same(self) -> bool:
        """Whether nothing moved, seen from either."""
        return not (self.moved or self.in_joints_moved) and (
            self.back is None or not np.any(self.back > self.same_within)
        )


def movement(a: Output, b: Output) -> Movement | str:
    """How the positions moved, or in words why nobody can say.

    Raises:
        InputError: A program or a table beside a report is missing, damaged, or another than the report is of.
    """
    if a.kind not in (Command.GENERATE, Command.CORRECT):
        return f"cgen {a.kind} corrects no program"
    one, other = commanded_positions(a), commanded_positions(b)
    if one is None or other is None:
        return f"{(a if one is None else b).name} has no program beside its report: not written, or taken elsewhere"
    if a.kind == Command.CORRECT:
        return _of_corrections(a, b, one, other)
    first, second = _planned(a), _planned(b)
    if first is None or second is None:
        return "no waypoints.csv beside a report that was given alone"
    return _of_jobs((a, b), (one, other), (first, second))


def _of_corrections(a: Output, b: Output, one: TextPositions, other: TextPositions) -> Movement | str:
    with naming_damage(a):
        planned = a.record["provenance"]["planned_sha256"]
    with naming_damage(b):
        if b.record["provenance"]["planned_sha256"] != planned:
            return "the planned programs differ, so that P[n] of one is not P[n] of the other"
    return _by_number(one, other)


def _of_jobs(
    outputs: tuple[Output, Output], texts: tuple[TextPositions, TextPositions], planned: tuple[Array, Array]
) -> Movement | str:
    for output, text, points in zip(outputs, texts, planned, strict=True):
        if len(text.number) != len(points):
            return f"{output.name}: {len(text.number)} positions in the program, {len(points)} rows in waypoints.csv"
    one, other = (_in_world(output, text) for output, text in zip(outputs, texts, strict=True))
    if planned[0].shape == planned[1].shape and row_norms(planned[0] - planned[1]).max() <= SAME_POINT:
        movement = _by_number(one, other)
        is_printed_alike = texts[0].position is one.position and texts[1].position is other.position
        return movement if isinstance(movement, str) or is_printed_alike else _to_the_digits(movement, outputs)
    movement = _by_length((one, other), planned) or _by_nearest(one, other)
    return _to_the_digits(movement, outputs)


def _to_the_digits(movement: Movement, outputs: tuple[Output, Output]) -> Movement:
    """With what the rounding of three coordinates in both texts leaves open: sqrt(3), say 2, of the last digit."""
    left_open = 2 * 10.0 ** -min(map(_decimals, outputs))
    return replace(movement, same_within=left_open * MM, same_angle=left_open * DEG)


def _decimals(output: Output) -> int:
    with naming_damage(output):
        inputs = output.record.get("inputs")
        return int(inputs["robot"]["controller"]["decimals"]) if inputs else DECIMALS


def _by_number(one: TextPositions, other: TextPositions) -> Movement | str:
    """At all positions that both programs have; joint angles are none."""
    number, i, j = np.intersect1d(one.number, other.number, return_indices=True)
    distance = row_norms(other.position[j] - one.position[i])
    known = np.isfinite(distance)
    if not known.any():
        return "the positions are joint angles"
    turn = relative_rotation(one.rotation[i][known], other.rotation[j][known])
    joints = np.abs(other.joints[j] - one.joints[i])
    return Movement(
        matched="number",
        number=number[known],
        distance=distance[known],
        angle=row_norms(turn),
        in_joints=int(np.isfinite(joints).all(axis=1).sum()),
        in_joints_moved=int((joints > UNCHANGED).any(axis=1).sum()),
    )


def _by_length(texts: tuple[TextPositions, TextPositions], planned: tuple[Array, Array]) -> Movement | None:
    """At the planned points of A, on the path that both follow; None where they follow two."""
    length = [lengths_along(points) for points in planned]
    if not (length[0][-1] and length[1][-1]):
        return None
    at = length[0] * (length[1][-1] / length[0][-1])  # the lengths of one path differ by what chords cut off
    if row_norms(interpolated(at, length[1], planned[1]) - planned[0]).max() > SAME_PATH:
        return None
    corrections = [text.position - points for text, points in zip(texts, planned, strict=True)]
    moved = interpolated(at, length[1], corrections[1]) - corrections[0]
    segment = np.clip(np.searchsorted(length[1], at, side="right") - 1, 0, len(length[1]) - 2)
    share = (at - length[1][segment]) / np.maximum(np.diff(length[1])[segment], np.finfo(float).tiny)
    rotation = texts[1].rotation
    turned = interpolate_rotation(rotation[segment], rotation[segment + 1], np.clip(share, 0.0, 1.0))
    angle = row_norms(relative_rotation(texts[0].rotation, turned))
    return Movement(matched="length", number=texts[0].number, distance=row_norms(moved), angle=angle)


def _by_nearest(one: TextPositions, other: TextPositions) -> Movement:
    """From each position to the nearest place on the other's path."""
    there = distance_to_path(one.position, drawn(other))
    return Movement(
        matched="nearest",
        number=one.number,
        distance=there,
        angle=None,
        back=distance_to_path(other.position, drawn(one)),
    )


def _in_world(output: Output, text: TextPositions) -> TextPositions:
    """Positions of a program in World; itself where it is in World."""
    with naming_damage(output):
        frame = output.record["provenance"].get("frame")
        if frame is None:
            return text
        rotation = np.array(frame["rotation"], dtype=float).reshape(3, 3)
        position = text.position @ rotation.T + np.array(frame["position_mm"], dtype=float) * MM
        return replace(text, position=position, rotation=rotation @ text.rotation)


def _planned(output: Output) -> Array | None:
    """The planned points in World, (N, 3) [m]; None where the report was given alone."""
    table = output.table("waypoints.csv")
    if table is None:
        return None
    with naming_damage(output):
        return np.column_stack([table.numbers(f"{axis}_mm") for axis in "xyz"]) * MM
