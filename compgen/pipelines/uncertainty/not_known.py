"""What a band leaves out because nothing is known of it: what the robot file names, and what no file says of the job.

A row of the job stands here until the user declares its number, which is then in the band. Sizes are computed where a
rate is known: growth of steel, a tilt or a bend at the farthest place. The others say why there is none.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, row_norms
from compgen.core.units import MDEG, MM, UM
from compgen.error_model.source import LoadDependent
from compgen.error_model.sources.joint_zeros import JointZeros
from compgen.error_model.sources.link_offsets import LinkOffsets
from compgen.error_model.sources.thermal_bend import ARCSEC
from compgen.error_model.sources.thermal_shift import STEEL
from compgen.error_model.unmeasured import Unknown
from compgen.job.job import Cell
from compgen.verification.band import COVERAGE, Band

UNSEEN = "a temperature sensor that is off unseen"
BEND = 2.4 * ARCSEC  # [rad/K] that an arm's second axis turned: Heisel et al. (1997), 28.8 arcsec for 12 K
OF_GEOMETRY = {LinkOffsets.NAME, JointZeros.NAME}
SPINDLE = (2 * UM, 5 * UM)  # that a spindle moved for 0.5 and for 2 K of its own: Gim (1997)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkSetting:
    """How far out, with what tool and how warm a program works."""

    reach: float  # [m] of its farthest place from the axis of J1
    tool: float  # [m] from the flange to the TCP
    warmest: float  # [K] largest rise of any node
    flange: float  # [K] largest rise of the last node
    is_tool_taught: bool = False  # with the part's frame, in whose row of the budget it is


def setting_of(position: Array, tool: Array, rise: Array, *, is_tool_taught: bool = False) -> WorkSetting:
    """Of a program that takes TCPs (T, 3) [m] of the flange to places in World (N, 3) [m], at rises (M, K) [K]."""
    return WorkSetting(
        reach=float(row_norms(position[:, :2]).max()),
        tool=float(row_norms(tool).max()),
        warmest=float(np.abs(rise).max(initial=0.0)),
        flange=float(np.abs(rise[:, -1:]).max(initial=0.0)),
        is_tool_taught=is_tool_taught,
    )


def not_known(cell: Cell, band: Band, setting: WorkSetting) -> tuple[Unknown, ...]:
    """What a band leaves out because nothing is known of it: the robot file's rows, then those of the job.

    Args:
        cell: The robot.
        band: Of the program.
        setting: Of the program.
    """
    names = dict.fromkeys(k.source.NAME for k in cell.known if k.source.FITTING is None and not k.sigma)
    of_sources = [Unknown(f"error of the file's {name.replace('_', ' ')}", None, "") for name in names]
    of_job, named = _of_job(cell, setting), {row.what for row in cell.unknown}
    rows = [*cell.unknown, *of_sources, *(row for row in of_job if row.what not in named)]
    if band.hidden:
        origin = "the largest error of one sensor that nothing in the log contradicts"
        rows.append(Unknown(UNSEEN, (0.0, band.hidden), origin))
    known = _declared(cell, band) | ({"tool"} if setting.is_tool_taught else set())
    return tuple(row for row in rows if known.isdisjoint(row.until))


def _declared(cell: Cell, band: Band) -> set[str]:
    """Names that end a row: of the budget, of what was identified, and of what the robot file declares."""
    names = {share.source for share in band.budget}
    for known in cell.known:
        source = known.source
        loads = source.loads if isinstance(source, LoadDependent) else None
        if loads is None or loads.have_weight:
            names.add(source.NAME)
        if loads is not None and loads.force.any():
            names.add("force")
        if known.sigma:
            names |= {source.BUDGET, *(f"growth of {of.partition(' ')[0]}" for of in getattr(source, "of", ()))}
    # compliance and frames stand under geometry in a budget, and end no cold geometry
    return names if names & OF_GEOMETRY else names - {LinkOffsets.BUDGET}


def _of_job(cell: Cell, setting: WorkSetting) -> tuple[Unknown, ...]:
    """What no file says of the job, by what ends it."""
    reach, air = setting.reach, COVERAGE * (cell.warmth.air or 1.0)
    return (
        Unknown(
            "part's frame", None, "no figure: no frame.taught.sigma_um; cgen teach-frame gives it", ("part's frame",)
        ),
        Unknown(
            "tool length", None,
            f"no figure: no tool.sigma_um; the {setting.tool / MM:.4g} mm count as exact, and the part sees all that "
            "they are wrong by", ("tool",),
        ),
        Unknown(
            "payload and sag", None,
            "no figure: no [sources.compliance] with the masses of [sources.loads]; an IRB 120 was 240 um rms off "
            "without and 120 um with them", ("compliance",),
        ),
        Unknown("process force", None, "no figure: no sources.loads.force_N with [sources.compliance]", ("force",)),
        Unknown(
            "floor and base tilt", None,
            f"no figure: each mdeg is {reach * MDEG / UM:.0f} um at the farthest place; give [sources.base_frame], or "
            "cgen anchor finds it", ("base_frame", "anchored state"),
        ),
        Unknown(
            "growth of the spindle", (SPINDLE[0], SPINDLE[1] + STEEL * setting.tool * setting.flange),
            "Gim (1997), a spindle 0.5 and 2 K warmer, and steel of the tool's length as warm as the flange",
            ("growth of tool",),
        ),
        Unknown(
            "growth of fixture and sphere plate", (0.0, STEEL * reach * air),
            f"steel from the robot's base to the farthest place, {air:.2g} K of air (k = 2)", ("growth of fixture",),
        ),
        Unknown(
            "gradient across a link", (0.0, BEND * setting.warmest * reach) if setting.warmest else None,
            "Heisel et al. (1997): another arm's second axis turned by up to 2.4 arcsec/K", ("thermal_bend",),
        ),
        Unknown("the first lap", None, "no figure: nobody compared this robot's first lap with later ones"),
    )  # fmt: skip
