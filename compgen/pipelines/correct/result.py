"""The options of a correction, its plan, and the corrected program with its proof."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from compgen.compensation.problem import Settings
from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.exceptions import InputError
from compgen.core.unique_rows import grouped
from compgen.core.units import DEG, MM, UM
from compgen.fanuc import LsProgram
from compgen.fanuc.analysis.correctable import Scope
from compgen.fanuc.analysis.poses import Poses
from compgen.fanuc.analysis.program_context import ProgramContext
from compgen.fanuc.analysis.watermark import Mark
from compgen.fanuc.editing.shared_positions import SharedCorrections
from compgen.job.anchored_start import refuse_outlived
from compgen.job.bounds import Guarantee
from compgen.job.job import Cell
from compgen.job.tables import guarantee_of_words
from compgen.job.uncertainty import quantities_of_cell, refuse_silent_file
from compgen.pipelines.correct.proof import Residue, ServedStarts
from compgen.pipelines.correct.station_corrections import StationCorrections
from compgen.pipelines.planned.dry_run import check_height
from compgen.pipelines.uncertainty.draws import FlownDraws
from compgen.program.driven import NONE, DrivenProgram
from compgen.program.ways import straight_lines
from compgen.robot.joint_path import LIMIT_TOLERANCE
from compgen.thermal import Duty, tables
from compgen.thermal.ensemble import Ensemble
from compgen.thermal.tables.schema import AmbientTable
from compgen.verification.band import Band
from compgen.verification.flight import Flight, PoseErrors
from compgen.verification.motion_effect import MotionEffect
from compgen.verification.verdict import JudgedResult, Verdict


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What may be done to a program beyond moving its positions, and the bound that it must keep."""

    split: bool = False  # uses of a position that need different corrections get positions of their own
    insert: float | None = None  # [m] points go into straight lines that deviate by more than this
    strict: bool = False  # refuse a program with statements that cannot be corrected
    again: bool = False  # take a program that carries the mark
    remark: bool = False  # carries the mark where the positions cannot
    bound: float | None = None  # [m] largest error allowed after correction
    settings: Settings = field(default_factory=Settings)
    ensemble: Ensemble | None = None  # the starts that the one file shall serve; None: the planned one alone
    raised: float = 0.0  # [m] a dry run, so much higher
    guaranteed: Guarantee | None = None  # bounds with a probability, verified by draws
    air: float = 0.0  # [K] how much warmer than the reference it is, before the program and while it runs
    reference: float = AmbientTable().reference_degC  # at which it was calibrated: logs of its pages count from there
    judged_from: int = 0  # the first station that is judged: of the rest of a program, what has run is not


def options_of(  # noqa: PLR0913  the options of a command, each by its name
    *,
    split: bool,
    insert_um: float | None,
    strict: bool,
    again: bool,
    mark: str,
    max_um: float | None,
    average_over: str | None = None,
    lift_all: float | None = None,
    guaranteed: str | None = None,
) -> Options:
    """The options as they are typed, lengths in micrometres.

    Raises:
        InputError: A length out of its range, a mark of another kind, starts that are none, or a promise that is none.
    """
    if lift_all is not None:
        check_height(lift_all * MM)
    for name, value, least, most in (("--insert", insert_um, 0.1, 1e4), ("--max-um", max_um, 0.001, 1e6)):
        if value is not None and not least <= value <= most:
            raise InputError(f"{name} {value:.10g}: must be {least:.10g} to {most:.10g} um")
    if mark not in ("digits", "remark"):
        raise InputError(f"--mark {mark!r:.40}: must be digits or remark")
    return Options(
        split=split,
        insert=None if insert_um is None else insert_um * UM,
        strict=strict,
        again=again,
        remark=mark == "remark",
        bound=None if max_um is None else max_um * UM,
        raised=0.0 if lift_all is None else lift_all * MM,
        ensemble=None if average_over is None else tables.ensemble_of_words(average_over, "--average-over"),
        guaranteed=None if guaranteed is None else guarantee_of_words(guaranteed, "--guaranteed"),
    )


def check_known(options: Options, cell: Cell, before: Sequence[Duty]) -> None:
    """Raises InputError for what is asked of a robot that nobody knows so well: a promise, starts that outlive a state.

    Args:
        options: As given.
        cell: The robot.
        before: What it did until the planned start.
    """
    if options.guaranteed is not None:
        refuse_silent_file(cell, quantities_of_cell(cell), "--guaranteed")
    if cell.state is not None and options.ensemble is not None:
        latest = sum(duty.duration for duty in before) + options.ensemble.delay[1]
        refuse_outlived(cell.state, "--state", latest, "at the last start of --average-over")


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class CorrectionPlan:
    """A program with what is known of it before its numbers change."""

    program: LsProgram
    poses: Poses
    drive: DrivenProgram
    scope: Scope
    stations: StationCorrections
    free: BoolArray  # (S,) stations that take a correction


def corrected_stations(plan: CorrectionPlan, shared: SharedCorrections) -> BoolArray:
    """Stations whose positions are written anew, (S,)."""
    first = plan.poses.first
    return plan.free & shared.changed[first[plan.drive.pose]] if len(first) else plan.free


def between_corrected(plan: CorrectionPlan, shared: SharedCorrections, station: IntArray, fraction: Array) -> BoolArray:
    """Which samples, stations and fractions of the ways to them (M,), lie at or between corrected stations."""
    moved = corrected_stations(plan, shared)
    return np.asarray(moved[station] & ((fraction >= 1) | moved[plan.drive.origin[station]]), dtype=bool)


def changed_positions(planned: LsProgram, written: LsProgram) -> int:
    """How many of a program's own positions read differently."""
    own = np.isin(written.positions.number, planned.positions.number)
    differs = (written.positions.value[own] != planned.positions.value) & np.isfinite(planned.positions.value)
    return int(differs.any(axis=1).sum())


def straight_ways(plan: CorrectionPlan) -> IntArray:
    """Stations reached by straight lines between corrected ends."""
    drive, free = plan.drive, plan.free
    ways = np.flatnonzero(straight_lines(drive) & free)
    return ways[free[drive.origin[ways]]]


class MotionCommand(NamedTuple):
    """What S stations are commanded off their targets, over the runs that are flown better for it."""

    shift: Array  # (S, 6) [m], no rotation
    runs: tuple[tuple[int, int], ...]  # first and last station of each commanded run
    plain: Residue  # how far the tool is led off on them without it
    left: Residue  # with it
    kept: tuple[str, ...]  # why other runs with bends are left as they are


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Correction(JudgedResult):
    """A corrected program and its proof."""

    name: str  # of the program
    cell: Cell
    around: ProgramContext  # what the program was read with
    before: tuple[Duty, ...]
    options: Options
    planned: bytes
    written: LsProgram
    plan: CorrectionPlan
    shared: SharedCorrections
    changed: int  # positions of the planned program that read differently
    added: int  # positions that are new
    execution: Flight  # of the written text
    error: PoseErrors  # of the planned and unchanged program, at the same samples
    residual: PoseErrors  # of the written text
    turn: Array  # (M, 6) [rad] of joints from the planned to the written text, beyond what the correction explains
    new_beyond: IntArray  # stations to which the straight way leaves the reach in the written text only
    judged: BoolArray  # (M,) samples at or between corrected stations
    length: Array  # (M,) [m] of path that each of them stands for, 0 for the others
    mark: Mark  # where the written text carries it
    served: ServedStarts | None  # what it leaves over its starts, where these are several
    meant: DrivenProgram  # the planned program, off its targets as it is commanded against the controller's motion
    command: MotionCommand | None  # against the controller's motion; None: nothing is commanded against
    band: Band | None = None  # what the robot file leaves open at corrected stations; None: there are none
    motion: MotionEffect | None = None  # of the controller on the written text; None: not looked at
    draws: FlownDraws | None = None  # what the bounds with a probability are judged by; None: there are none

    @property
    def text(self) -> bytes:
        """The corrected program's file."""
        return self.written.source

    @property
    def is_usable(self) -> bool:
        """Whether the program is written unasked: it is nowhere worse, and breaks no bound that is given."""
        return self.verdict in (Verdict.INSIDE, Verdict.NO_BOUNDS, Verdict.NOT_LOADABLE)


def ways_past_limits(result: Correction) -> dict[str, list[int]]:
    """What ways do that leave a joint's limit or the polygon of J2 and J3 between ends that do not; their stations.

    Looked at are the places that the written text is judged at.
    """
    flight, robot, drive = result.execution, result.cell.robot, result.plan.drive

    def excess(theta: Array) -> Array:
        return np.maximum(robot.lower - theta, theta - robot.upper)

    def is_past(theta: Array) -> BoolArray:
        return np.asarray((excess(theta) > LIMIT_TOLERANCE).any(axis=1) | ~robot.is_clear(theta))

    def words(joint: int) -> str:
        if joint == NONE:
            return f"J2 and J3 of {robot.name} leave limits.interference.j2_j3_deg, where the arm hits itself"
        lower, upper = robot.quoted_limits[:, joint] / DEG
        return f"{robot.joint_names[joint]} goes beyond {lower:g} to {upper:g} deg"

    past = np.flatnonzero((flight.fraction < 1) & is_past(flight.theta))
    station = flight.station[past]
    ends = is_past(drive.at.theta)[drive.pose[[station, drive.origin[station]]]]
    past, station = past[~ends.any(axis=0)], station[~ends.any(axis=0)]
    over = excess(flight.theta[past])
    joint = np.where(over.max(axis=1, initial=0.0) > LIMIT_TOLERANCE, over.argmax(axis=1), NONE)
    pairs = np.unique(np.column_stack([joint, station]), axis=0).tolist()
    return grouped((words(k), n) for k, n in pairs)


def off_by_digits(result: Correction, samples: IntArray) -> Array:
    """How far the digits of positions, at samples or at the ends of their ways, are from what they shall say (n,) [m].

    As they are written: the farther of two ends.
    """
    if not len(samples):
        return np.zeros(0)
    drive, poses, flight = result.plan.drive, result.plan.poses, result.execution
    station = flight.station[samples]
    ends = np.stack([station, np.where(flight.fraction[samples] < 1, drive.origin[station], station)])
    rows = poses.first[drive.pose[ends]]
    meant = poses.tcp.position[rows] + result.shared.correction[rows, :3]
    written = result.around.poses(result.written, result.cell.robot).tcp.position[rows]
    return np.asarray(np.linalg.norm(written - meant, axis=2).max(axis=0))
