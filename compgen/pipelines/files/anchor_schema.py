"""What a robot file says may drift from day to day: the table [anchor]."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field, FiniteFloat

from compgen.core.arrays import Array
from compgen.core.toml import Table
from compgen.core.units import MDEG, UM

Sigma = Annotated[FiniteFloat, Field(ge=0, le=1e5)]
Three = Annotated[list[Sigma], Field(min_length=3, max_length=3)]


class AnchorTable(Table):
    """What may drift from day to day, for cgen anchor: standard deviations before any touch."""

    base_um: Three | None = None
    """Of the base's shift along World x, y, z; left out: 10 um and what the thermal physics may miss."""
    base_mdeg: Three | None = None
    """Of the base's turn about World x, y, z; left out: what moves the part's edge by as much."""
    drifting: Annotated[dict[Annotated[str, Field(max_length=120)], Sigma], Field(max_length=50)] = {}
    """Of numbers of this file by their names, as { "joint_zeros.offset_mdeg[2]" = 0.5 }, in the unit that each says."""


@dataclass(frozen=True, eq=False, slots=True)
class Drifting:
    """What may drift."""

    shift: Array | None = None  # (3,) [m] of the base; None: not said
    turn: Array | None = None  # (3,) [rad]
    numbers: tuple[str, ...] = ()
    sigma: tuple[float, ...] = ()  # in the unit of each


def drifting_of(table: AnchorTable | None) -> Drifting:
    """The table in SI."""
    if table is None:
        return Drifting()
    shift = None if table.base_um is None else np.array(table.base_um) * UM
    turn = None if table.base_mdeg is None else np.array(table.base_mdeg) * MDEG
    return Drifting(shift, turn, tuple(table.drifting), tuple(table.drifting.values()))
