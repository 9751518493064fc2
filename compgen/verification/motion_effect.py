"""How far a controller's motion leads the tool off a written program's path, on the part: known, or as is expected.

Where it is not known, the program is flown with what is expected of such an arm, and with the lowest and the highest of
what was seen. Each is flown: a bend's pull goes with sigma^2 alone only where the bend is longer than the smoothing.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, frozen, owns, row_norms
from compgen.robot.motion import ControllerMotion, ExpectedMotion
from compgen.robot.robot import Robot
from compgen.verification.twin import PreparedProgram
from compgen.verification.twin.controller.command import WrittenPath, first_statements
from compgen.verification.twin.controller.deviation import MotionDeviation, most_in_blocks, motion_deviation

HALF = 0.5  # the override whose effect is told beside
FEW_BLOCKS = 3  # of time: fewer are all looked at


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(off=("S",))
class MotionEffect:
    """Of a program at its written speeds, on the part."""

    motion: ControllerMotion  # known, or expected
    expected: ExpectedMotion | None  # None: it is known
    largest: float  # [m] off the path, across it
    lowest: float  # [m] with the lowest of what was seen; of a known motion the largest itself
    highest: float  # [m] with the highest of it
    where: float  # [m] arc length there
    speed: float  # [m/s] written there
    along: float  # [m] farthest from the nearest place along the way: what a way out and back is cut short by
    lag: float  # [m] behind the command at the highest speed
    off: Array  # (S,) [m] off each segment, on the part or not
    near: str = ""  # the position there, of a program that exists

    @property
    def known(self) -> bool:
        """Whether the robot file has the motion."""
        return self.expected is None


def motion_effect(prepared: PreparedProgram, touching: BoolArray) -> MotionEffect:
    """What the controller's motion does to a program, or is expected to do where it is not known.

    Args:
        prepared: The program, of N positions.
        touching: The segments on the part, (N - 1,); of none all count.
    """
    flight = _flight(prepared, touching)
    return expected_effect(prepared.twin.robot, partial(_effect, flight), partial(_largest, flight))


def expected_effect(
    robot: Robot,
    effect_of: Callable[[ControllerMotion], MotionEffect],
    largest_of: Callable[[ControllerMotion], float],
) -> MotionEffect:
    """The effect of a robot's motion where it is known, else of what is expected of such an arm, with its spread."""
    if robot.motion is not None:
        return effect_of(robot.motion)
    seen = robot.expected_motion
    effect = effect_of(seen.expected)
    sizes = largest_of(seen.lowest), effect.largest, largest_of(seen.highest)
    return replace(effect, expected=seen, lowest=min(sizes), highest=max(sizes))


class _Flight(NamedTuple):
    """A program that is flown with one motion after another, at S samples."""

    prepared: PreparedProgram
    path: WrittenPath
    segment: IntArray  # (S,) of each sample
    on_part: BoolArray  # (S,) all, where no segment is
    first: Array  # (R,) [s] of the statement that each run from a stop to the next begins with


def _flight(prepared: PreparedProgram, touching: BoolArray) -> _Flight:
    segment = prepared.segments(touching)
    on_part = touching[segment] if touching.any() else np.ones(len(segment), dtype=bool)
    path = prepared.written_path()
    return _Flight(prepared, path, segment, on_part, first_statements(prepared.twin.robot, path, prepared.override))


def _effect(flight: _Flight, motion: ControllerMotion) -> MotionEffect:
    """Of one motion."""
    prepared, _, segment, on_part, first = flight
    led = prepared.led if motion is prepared.twin.robot.motion else _flown(flight, motion)
    counts = prepared.samples_per_segment
    anywhere = np.zeros(len(segment)) if led is None else row_norms(led.across)
    off = np.where(on_part, anywhere, 0.0)
    worst = int(np.argmax(off))
    k = int(segment[worst])
    length = prepared.sweep.length
    where = length[:k].sum() + length[k] * (worst - int(counts[:k].sum())) / counts[k]
    along = 0.0 if led is None else float(np.abs(np.where(on_part, led.along, 0.0)).max())
    largest = float(off[worst])
    run = int(np.searchsorted(np.flatnonzero(prepared.program.fine), k, side="right")) - 1
    return MotionEffect(
        motion=motion.in_run(float(first[run])),
        expected=None,
        largest=largest,
        lowest=largest,
        highest=largest,
        where=float(where),
        speed=float(prepared.program.speed[k]),
        along=along,
        lag=0.0 if led is None else led.lag,
        off=frozen(prepared.most_on_segments(anywhere)),
    )


def error_at_half_override(prepared: PreparedProgram, error: Array, touching: BoolArray) -> float:
    """Largest error [m] on the part at half the override, of errors (M, 3) [m] of all samples at the full one.

    The arm's own error is that of the full override; only the controller's motion is another one.
    """
    half = prepared.at_override(HALF).led
    if prepared.led is None or half is None:
        return 0.0
    on_part = prepared.touching_samples(touching)
    return float(row_norms((error + half.across - prepared.led.across)[on_part]).max())


def _largest(flight: _Flight, motion: ControllerMotion) -> float:
    """How far a motion leads the tool off on the part [m]: first where it may be most, then where it may be more."""
    most = most_in_blocks(flight.prepared.twin.robot, flight.path, motion, flight.prepared.override)
    if len(most) < FEW_BLOCKS:
        return _largest_in(flight, motion, None)
    likeliest = np.arange(len(most)) == np.argmax(most)
    largest = _largest_in(flight, motion, likeliest)
    others = (most >= largest) & ~likeliest
    return max(largest, _largest_in(flight, motion, others)) if others.any() else largest


def _largest_in(flight: _Flight, motion: ControllerMotion, blocks: BoolArray | None) -> float:
    """In some blocks of time [m]."""
    led = _flown(flight, motion, blocks)
    return 0.0 if led is None else float(row_norms(led.across)[flight.on_part].max())


def _flown(flight: _Flight, motion: ControllerMotion, blocks: BoolArray | None = None) -> MotionDeviation | None:
    prepared = flight.prepared
    return motion_deviation(
        replace(prepared.twin.robot, motion=motion), prepared.twin.tool, flight.path, prepared.samples_per_segment,
        prepared.override, places_only=True, blocks=blocks,
    )  # fmt: skip
