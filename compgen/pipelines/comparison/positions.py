r"""How far the commanded positions of two programs are apart, by the texts that were written.

With the same planned points, P[n] of one against P[n] of the other, as both texts print them. Else along the path: at
the length s of each planned point of A

    movement(s) = correction_B(s) - correction_A(s),        correction = commanded - planned, in World

where B's correction is linear between its positions: it is smooth, whatever the spacing. Both need the same path.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, row_norms, step_lengths
from compgen.core.rotations import relative_rotation
from compgen.core.units import MM
from compgen.pipelines.comparison.outputs import Output, naming_damage
from compgen.pipelines.comparison.texts import Commanded, commanded_positions

SAME_POINT = 1e-7  # [m] two planned points of one place
SAME_PATH = 1e-4  # [m] two planned paths that are one but for where their points are: above a chord, below a move
UNCHANGED = 1e-9  # [m] or [rad] two numbers that are printed alike


@dataclass(frozen=True, eq=False, slots=True)
class Movement:
    """How far the commanded positions of B are from those of A, at N positions."""

    matched: str  # "number" or "length"
    distance: Array  # (N,) [m]
    angle: Array | None  # (N,) [rad]; None where they are matched by length

    @property
    def moved(self) -> int:
        """Positions that are printed otherwise."""
        moved = self.distance > UNCHANGED
        return int(np.count_nonzero(moved if self.angle is None else moved | (self.angle > UNCHANGED)))


def movement(a: Output, b: Output) -> Movement | str:
    """How the positions moved, or in words why nobody can say.

    Raises:
        InputError: A program or a table beside a report is missing, damaged, or another than the report is of.
    """
    if a.kind not in ("generate", "correct"):
        return f"cgen {a.kind} corrects no program"
    one, other = commanded_positions(a), commanded_positions(b)
    if one is None or other is None:
        return f"{(a if one is None else b).name} has no program beside its report"
    if a.kind == "correct":
        return _of_corrections(a, b, one, other)
    first, second = _planned(a), _planned(b)
    if first is None or second is None:
        return "no waypoints.csv beside a report that was given alone"
    return _of_jobs((a, b), (one, other), (first, second))


def _of_corrections(a: Output, b: Output, one: Commanded, other: Commanded) -> Movement | str:
    with naming_damage(a):
        planned = a.record["provenance"]["planned_sha256"]
    with naming_damage(b):
        if b.record["provenance"]["planned_sha256"] != planned:
            return "the planned programs differ, so that P[n] of one is not P[n] of the other"
    return _by_number(one, other)


def _of_jobs(
    outputs: tuple[Output, Output], texts: tuple[Commanded, Commanded], planned: tuple[Array, Array]
) -> Movement | str:
    for output, text, points in zip(outputs, texts, planned):
        if len(text.number) != len(points):
            return f"{output.name}: {len(text.number)} positions in the program, {len(points)} rows in waypoints.csv"
    if planned[0].shape == planned[1].shape and row_norms(planned[0] - planned[1]).max() <= SAME_POINT:
        return _by_number(*texts)
    return _by_length(outputs, texts, planned)


def _by_number(one: Commanded, other: Commanded) -> Movement | str:
    """At all positions that both programs have; joint angles are none."""
    _, i, j = np.intersect1d(one.number, other.number, return_indices=True)
    distance = row_norms(other.position[j] - one.position[i])
    known = np.isfinite(distance)
    if not known.any():
        return "the positions are joint angles"
    turn = relative_rotation(one.rotation[i][known], other.rotation[j][known])
    return Movement("number", distance[known], row_norms(turn))


def _by_length(
    outputs: tuple[Output, Output], texts: tuple[Commanded, Commanded], planned: tuple[Array, Array]
) -> Movement | str:
    """At the planned points of A, on the path that both follow."""
    length = [np.concatenate([[0.0], np.cumsum(step_lengths(points))]) for points in planned]
    at = length[0] * (length[1][-1] / length[0][-1])  # the lengths of one path differ by what chords cut off
    gap = row_norms(_interpolated(at, length[1], planned[1]) - planned[0])
    if gap.max() > SAME_PATH:
        worst = int(gap.argmax())
        return f"the planned paths are up to {gap[worst] / MM:.3g} mm apart (at P[{worst + 1}] of the first)"
    corrections = [_in_world(o, text) - points for o, text, points in zip(outputs, texts, planned)]
    return Movement("length", row_norms(_interpolated(at, length[1], corrections[1]) - corrections[0]), None)


def _interpolated(at: Array, length: Array, rows: Array) -> Array:
    return np.column_stack([np.interp(at, length, column) for column in rows.T])


def _in_world(output: Output, text: Commanded) -> Array:
    """The commanded positions in World, (N, 3) [m]."""
    with naming_damage(output):
        frame = output.record["provenance"].get("frame")
        if frame is None:
            return text.position
        rotation = np.array(frame["rotation"], dtype=float).reshape(3, 3)
        position: Array = text.position @ rotation.T + np.array(frame["position_mm"], dtype=float) * MM
        return position


def _planned(output: Output) -> Array | None:
    """The planned points in World, (N, 3) [m]; None where the report was given alone."""
    table = output.table("waypoints.csv")
    if table is None:
        return None
    with naming_damage(output):
        return np.column_stack([table.numbers(f"{axis}_mm") for axis in "xyz"]) * MM
