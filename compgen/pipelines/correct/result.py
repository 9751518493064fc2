"""What a correction starts from and what it ends with."""

from dataclasses import dataclass, field

from compgen.compensation.problem import Settings
from compgen.core.arrays import Array, BoolArray
from compgen.core.findings import Finding, Level
from compgen.fanuc import LsProgram
from compgen.fanuc.analysis.correctable import Scope
from compgen.fanuc.analysis.poses import Poses
from compgen.fanuc.analysis.traversal import Drive
from compgen.fanuc.editing.shared_positions import Shared
from compgen.pipelines.correct.proof import Flight
from compgen.pipelines.correct.station_corrections import Solved
from compgen.pipelines.job import Cell
from compgen.thermal import Duty


@dataclass(frozen=True, slots=True)
class Options:
    """What may be done to a program beyond moving its positions, and what is promised."""

    split: bool = False  # shared positions that need different corrections get numbers of their own
    insert: float | None = None  # [m] points go into straight lines that stray farther than this
    strict: bool = False  # refuse a program with statements that would be passed through
    again: bool = False  # take a program that carries the mark
    bound: float | None = None  # [m] largest error allowed after correction
    settings: Settings = field(default_factory=Settings)


@dataclass(frozen=True, eq=False, slots=True)
class CorrectionPlan:
    """A program with what is known of it before its numbers change."""

    program: LsProgram
    poses: Poses
    drive: Drive
    scope: Scope
    solved: Solved
    free: BoolArray  # (S,) stations that take a correction


@dataclass(frozen=True, eq=False, slots=True)
class Correction:
    """A corrected program and its proof."""

    name: str  # of the program
    cell: Cell
    before: tuple[Duty, ...]
    options: Options
    planned: bytes
    text: bytes
    plan: CorrectionPlan
    shared: Shared
    changed: int  # positions that read differently
    added: int  # positions that are new
    flight: Flight  # of the written text
    error: tuple[Array, Array]  # (M,) [m], (M,) [rad] of the planned and unchanged program, at the same samples
    residual: tuple[Array, Array]  # (M,) [m], (M,) [rad] of the written text
    judged: BoolArray  # (M,) samples at or between corrected stations
    marked: bool
    findings: tuple[Finding, ...]

    @property
    def inside(self) -> bool:
        """Whether every bound is kept."""
        return not any(f.level is Level.OUTSIDE for f in self.findings)
