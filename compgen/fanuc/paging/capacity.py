"""What a controller holds, and what a program asks of it."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray, own
from compgen.fanuc.analysis.control_flow import Flow, read_flow
from compgen.fanuc.listing.lines import line_ends
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.memory import MEMORY_MOTION, MEMORY_POSITION, MEMORY_PROGRAM

USUAL_MOTION = 64  # bytes of text; what is longer has options that take room of their own


@dataclass(frozen=True, slots=True)
class Store:
    """What a controller holds."""

    max_lines: int  # of one program
    max_positions: int  # of one program
    memory: float  # [bytes] of all programs together
    name_length: int


@dataclass(frozen=True, slots=True)
class Size:
    """What a program asks for."""

    lines: int
    positions: int
    memory: float  # [bytes] estimated

    def within(self, store: Store) -> bool:
        """Whether one program of that size fits."""
        return self.lines <= store.max_lines and self.positions <= store.max_positions and self.memory <= store.memory


@dataclass(frozen=True, eq=False, slots=True)
class Costs:
    """What each unit of a program asks for, its positions left out."""

    lines: IntArray  # (S,) physical lines
    memory: Array  # (S,) [bytes] estimated

    def __post_init__(self) -> None:
        own(self, lines=("S",), memory=("S",))


def costs(program: LsProgram, flow: Flow) -> Costs:
    """Lines and estimated memory of each unit.

    Fitted over real exports: 400 bytes a program, 35 a single-group position, 28 a motion. What is no motion counts as
    long as its text, an upper estimate.
    """
    if not len(flow.line):
        return Costs(np.zeros(0, dtype=np.int64), np.zeros(0))
    last = max(1, line_ends(program.data, *flow.span[-1].tolist()))
    text = np.diff(flow.span, axis=1)[:, 0].astype(float)
    motion = MEMORY_MOTION + np.maximum(text - USUAL_MOTION, 0.0)
    memory = np.where(flow.motion != NO_NUMBER, motion, text)
    return Costs(np.append(np.diff(flow.line), last), np.asarray(memory))


def size(program: LsProgram) -> Size:
    """Lines, positions and estimated memory of a program."""
    each = costs(program, read_flow(program))
    positions = len(np.unique(program.positions.number))
    memory = MEMORY_PROGRAM + positions * MEMORY_POSITION + float(each.memory.sum())
    return Size(int(each.lines.sum()), positions, memory)
