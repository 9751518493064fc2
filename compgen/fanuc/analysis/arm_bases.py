"""Where the arm's base is at each position of a program, as far as its extended axes tell it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.pose import IDENTITY, Pose
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import AXES, NO_NUMBER
from compgen.fanuc.listing.positions import units
from compgen.program.extended_axes import NAMES, ExtendedAxis

E1 = AXES.index("E1")


@dataclass(frozen=True, eq=False, slots=True)
class ArmBases:
    """The arm's World in the cell's, for K positions."""

    base: IntArray  # (K,) in ``poses``, NO_NUMBER where it is not known
    poses: Pose  # one a row; the first: no axis carries the arm
    axes: Array  # (K, 3) values of E1 to E3 [mm] or [deg], NaN for none
    reason: tuple[str, ...]  # why some are not known
    which: IntArray  # (K,) in ``reason``, NO_NUMBER where it is known


def read_arm_bases(program: LsProgram, row: IntArray, extended: Mapping[str, ExtendedAxis]) -> ArmBases:
    """Where the arm stands at positions.

    Args:
        program: Any program.
        row: Positions, rows of the program's table, (K,).
        extended: What extended axes carry, by name.
    """
    written = program.positions.span[row, E1:, 1] > 0
    axes = np.where(written, program.positions.value[row, E1:], np.nan)
    base, which = np.zeros(len(row), dtype=np.int64), np.full(len(row), NO_NUMBER)
    carried = any(axis.kind == "rail" for axis in extended.values())
    if not written.any():
        return ArmBases(base, Pose.stack([IDENTITY]), axes, (), which)
    unit = units(program.data, program.positions.span[row, E1:])
    concerned = np.flatnonzero(written.any(axis=1) | carried)
    places: dict[int, int] = {}  # of each base told
    table = [IDENTITY]
    reasons: dict[str, int] = {}
    for k in concerned.tolist():
        reason = ""
        for name, has, value, u in zip(NAMES, written[k].tolist(), axes[k].tolist(), unit[k].tolist(), strict=True):
            axis = extended.get(name)
            if axis is None:
                reason = reason or (_unknown(name) if has else "")
            elif axis.kind == "rail":
                pose = axis.base_at(value, u) if has else None
                if pose is None:
                    reason = reason or _no_base(name, axis, value, u, has=has)
                else:
                    if id(pose) not in places:
                        places[id(pose)] = len(table)
                        table.append(pose)
                    base[k] = places[id(pose)]
        if reason:
            base[k], which[k] = NO_NUMBER, reasons.setdefault(reason, len(reasons))
    return ArmBases(base, Pose.stack(table), axes, tuple(reasons), which)


def _unknown(name: str) -> str:
    return f"extended axis {name} moves the base or the part: say which with [extended.{name}] in --frames"


def _no_base(name: str, axis: ExtendedAxis, value: float, unit: str, *, has: bool) -> str:
    if not has:
        return f"the arm stands on extended axis {name}, and the position does not say where"
    if np.isnan(value):
        return f"extended axis {name} is not taught (****)"
    axis_value = f"{value:g} {unit or '(no unit)'}"
    return (
        f"the arm stands on extended axis {name} at {axis_value}, where its base is not told: "
        f"give [[extended.{name}.base]] with at_{axis.unit} in --frames"
    )
