"""Where the arm's base is at each position of a program, as far as its extended axes tell it."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.pose import IDENTITY, Pose
from compgen.fanuc.extended_axes import NAMES, ExtendedAxis
from compgen.fanuc.frames import Frames
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import AXES

E1 = AXES.index("E1")
NONE = -1


@dataclass(frozen=True, eq=False, slots=True)
class Stands:
    """The arm's World in the cell's, for K positions."""

    stand: IntArray  # (K,) in ``poses``, NONE where it is not known
    poses: Pose  # one a row; the first: no axis carries the arm
    axes: Array  # (K, 3) values of E1 to E3 [mm] or [deg], NaN for none
    reason: tuple[str, ...]  # why some are not known
    which: IntArray  # (K,) in ``reason``, NONE where it is known


def read_stands(program: LsProgram, row: IntArray, frames: Frames) -> Stands:
    """Where the arm stands at positions.

    Args:
        program: Any program.
        row: Positions, rows of the program's table, (K,).
        frames: What extended axes carry.
    """
    given = program.positions.span[row, E1:, 1] > 0
    axes = np.where(given, program.positions.value[row, E1:], np.nan)
    stand, which = np.zeros(len(row), dtype=np.int64), np.full(len(row), NONE)
    rails = [name for name, axis in frames.extended.items() if axis.kind == "rail"]
    if not given.any():
        return Stands(stand, Pose.stack([IDENTITY]), axes, (), which)
    unit = _units(program, row, given)
    concerned = np.flatnonzero(given.any(axis=1) | bool(rails))
    places: dict[int, int] = {}  # of each base told
    table = [IDENTITY]
    reasons: dict[str, int] = {}
    for k in concerned.tolist():
        reason = ""
        for name, has, value, u in zip(NAMES, given[k].tolist(), axes[k].tolist(), unit[k].tolist(), strict=True):
            axis = frames.extended.get(name)
            if axis is None:
                reason = reason or (_unknown(name) if has else "")
            elif axis.kind == "rail":
                pose = axis.base_at(value, u) if has else None
                if pose is None:
                    reason = reason or _no_base(name, axis, value, u, has)
                else:
                    if id(pose) not in places:
                        places[id(pose)] = len(table)
                        table.append(pose)
                    stand[k] = places[id(pose)]
        if reason:
            stand[k], which[k] = NONE, reasons.setdefault(reason, len(reasons))
    return Stands(stand, Pose.stack(table), axes, tuple(reasons), which)


def _unknown(name: str) -> str:
    return f"extended axis {name} moves the base or the part: say which with [extended.{name}] in --frames"


def _no_base(name: str, axis: ExtendedAxis, value: float, unit: str, has: bool) -> str:
    if not has:
        return f"the arm stands on extended axis {name}, and the position does not say where"
    if np.isnan(value):
        return f"extended axis {name} is not taught (****)"
    axis_value = f"{value:g} {unit or '(no unit)'}"
    return (
        f"the arm stands on extended axis {name} at {axis_value}, where its base is not told: "
        f"give [[extended.{name}.base]] with at_{axis.unit} in --frames"
    )


def _units(program: LsProgram, row: IntArray, given: np.ndarray) -> np.ndarray:
    """The unit behind each value, (K, 3): "mm", "deg", or "" where there is none."""
    units = np.full(given.shape, "", dtype="U3")
    end = program.positions.span[row, E1:, 1]
    for k, column in zip(*np.nonzero(given), strict=True):
        at = int(end[k, column])
        text = program.data[at : at + 16].lstrip(b" \t")[:3].lower()
        units[k, column] = "mm" if text[:2] == b"mm" else ("deg" if text == b"deg" else "")
    return units
