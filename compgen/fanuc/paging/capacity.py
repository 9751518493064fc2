"""How much of what a controller holds a program takes."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, owns
from compgen.fanuc.analysis.control_flow import Flow, read_flow
from compgen.fanuc.listing.lines import line_ends
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.program.pages import MEMORY_MOTION, MEMORY_POSITION, MEMORY_PROGRAM, ProgramSize

USUAL_MOTION = 64  # [bytes] of text; what is longer has options, which take memory of their own


@dataclass(frozen=True, eq=False, slots=True)
@owns(lines=("S",), memory=("S",))
class UnitSizes:
    """Size of each of the S units of a program, without positions."""

    lines: IntArray  # (S,) physical lines
    memory: Array  # (S,) [bytes] estimated


def unit_sizes(program: LsProgram, flow: Flow) -> UnitSizes:
    """Lines and estimated memory of each unit."""
    if not len(flow.line):
        return UnitSizes(np.zeros(0, dtype=np.int64), np.zeros(0))
    last = max(1, line_ends(program.data, *flow.span[-1].tolist()))
    text = np.diff(flow.span, axis=1)[:, 0].astype(float)
    return UnitSizes(np.append(np.diff(flow.line), last), units_memory(text, flow.motion != NO_NUMBER))


def units_memory(text: Array, is_motion: BoolArray) -> Array:
    """Estimated memory of units [bytes], from the lengths of their texts [bytes], (S,).

    Fitted to real exports: 400 bytes a program, 35 a single-group position, 28 a motion. Any other unit counts
    as long as its text, an upper estimate.
    """
    return np.asarray(np.where(is_motion, MEMORY_MOTION + np.maximum(text - USUAL_MOTION, 0.0), text))


def program_size(program: LsProgram) -> ProgramSize:
    """Lines, positions and estimated memory of a program."""
    units = unit_sizes(program, read_flow(program))
    positions = len(np.unique(program.positions.number))
    memory = MEMORY_PROGRAM + positions * MEMORY_POSITION + float(units.memory.sum())
    return ProgramSize(int(units.lines.sum()), positions, memory)
