"""What the flight of a corrected text is judged by: its starts, and joints that turn more than the correction explains.

As for a planned program (``pipelines.planned.many_starts``) the best file for all starts is that of the mean of their
rises. An override stretches the ways; what a program waits for, it waits for as long.

Arcs of an existing program that a controller may not drive: in one line, or too wide once corrected.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, norm, rms
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.pose import Pose
from compgen.core.rotations import rotation_vector
from compgen.core.units import DEG, MDEG, counted
from compgen.pipelines.correct.station_corrections import LARGEST_TURN, explained_turns
from compgen.program.driven import NONE, DrivenProgram
from compgen.program.ways import arcs_in_line, swept_angles
from compgen.thermal.ensemble import Ensemble, Start, starts_to_fly, weighted_starts
from compgen.verification.flight import Flight, pose_errors

SLACK = 1 * MDEG  # the last digits of a half circle


@dataclass(frozen=True, slots=True)
class Residue:
    """What the twin found at and between corrected stations."""

    largest: float  # [m]
    rms: float  # [m] over the path


@dataclass(frozen=True, slots=True)
class ServedStarts:
    """What one corrected file leaves over its starts."""

    ensemble: Ensemble
    at_mean: Residue  # with the mean of the rises
    flown: tuple[tuple[Start, Residue], ...]
    planned: tuple[Residue, ...] = ()  # of the planned program at each of them

    @property
    def worst(self) -> tuple[Start, Residue]:
        """The start with the largest error."""
        return max(self.flown, key=lambda one: one[1].largest)


def worst_of_starts(
    ensemble: Ensemble, fly: Callable[..., Flight], residue_of: Callable[[Flight], Residue]
) -> tuple[Flight, ServedStarts]:
    """The flight with the largest error of corners and middle, and what stays at each of them and at the mean.

    Args:
        ensemble: The starts.
        fly: A text, with the keyword ``starts``.
        residue_of: What a flight leaves.

    Raises:
        TwinError: The controller's inverse and pinocchio disagree.
    """
    starts, weights = weighted_starts(ensemble)
    weighted = [(weight, start) for weight, start in zip(weights.tolist(), starts, strict=True) if weight > 0]
    at_mean = residue_of(fly(starts=weighted))
    flights = {start: fly(starts=((1.0, start),)) for start in starts_to_fly(ensemble)}
    served = ServedStarts(ensemble, at_mean, tuple((start, residue_of(flight)) for start, flight in flights.items()))
    return flights[served.worst[0]], served


def residue_of(flight: Flight, target: Pose, judged: BoolArray, length: Array) -> Residue:
    """What a flight leaves of M samples.

    Args:
        flight: Of a text.
        target: M poses.
        judged: Samples at or between corrected stations, (M,).
        length: Of path that each stands for, (M,) [m].
    """
    distance = pose_errors(flight, target).distance[judged]
    if not len(distance):
        return Residue(0.0, 0.0)
    return Residue(float(distance.max()), rms(distance, length[judged]))


def unexplained_turns(planned: Flight, corrected: Flight) -> Array:
    """How far joints turn from the planned to the corrected text beyond what a correction explains, (M, 6) [rad].

    At stations that is what the tool's own move explains; on the way to one that lies near a singularity joints follow
    the correction of the other end, so there it is what any correction does.
    """
    moved = norm(corrected.commanded.position - planned.commanded.position)
    turned = norm(rotation_vector((planned.commanded.inverse() @ corrected.commanded).rotation))
    explained = np.where(corrected.fraction < 1, LARGEST_TURN, explained_turns(moved, turned))
    return np.asarray(np.abs(corrected.theta - planned.theta) - explained[:, None])


def as_both_can(drive: DrivenProgram, new: DrivenProgram) -> tuple[DrivenProgram, DrivenProgram]:
    """The planned and the written program, of which a way that one cannot execute is executed in neither."""
    beyond, arcs = np.maximum(drive.beyond, new.beyond), drive.circular & new.circular
    return replace(drive, beyond=beyond, circular=arcs), replace(new, beyond=beyond, circular=arcs)


def wide_arcs(planned: DrivenProgram, corrected: DrivenProgram) -> Iterator[Finding]:
    """That arcs sweep more than half a turn in the corrected text, and did not in the planned one."""
    via = np.flatnonzero(corrected.circular & corrected.via)
    swept = swept_angles(corrected, via)
    over = (swept > np.pi + SLACK) & (swept_angles(planned, via) <= np.pi + SLACK)
    if over.any():
        worst = int(np.argmax(np.where(over, swept, 0.0)))
        number = int(corrected.at.number[corrected.pose[via[worst]]])
        yield Finding.of(
            Code.CORRECTION_ARC,
            f"{counted(int(over.sum()), 'arc sweeps', 'arcs sweep')} more than 180 deg once corrected, by P[{number}] "
            f"{swept[worst] / DEG:.4f}: a controller may refuse that (circle angle too large); part each in two",
        )


def flat_arcs(planned: DrivenProgram, corrected: DrivenProgram) -> Iterator[Finding]:
    """That the three places of arcs lie in one line, in the planned or in the corrected text."""
    drive = planned
    via = np.flatnonzero(drive.via & ~drive.line & ~drive.joint & (drive.origin != NONE))
    via = via[(drive.pose[via] != NONE) & (drive.pose[via + 1] != NONE)]  # an end follows each via
    flat = via[arcs_in_line(drive, via) | arcs_in_line(replace(drive, at=corrected.at), via)]
    if len(flat):
        names = ", ".join(f"P[{n}]" for n in corrected.at.number[drive.pose[flat[:8]]].tolist())
        yield Finding.of(
            Code.CORRECTION_FLAT_ARC,
            f"{counted(len(flat), 'arc has its', 'arcs have their')} three places in one line (by {names}): a "
            "controller may refuse that; the places are judged, not the way between them",
        )
