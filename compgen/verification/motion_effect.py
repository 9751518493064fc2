r"""How far a controller's motion leads the tool off a written program's path, on the part: known, or as it could be.

What is not known is flown as ``TYPICAL``: two moving means of 0.2 and 0.1 s, sigma^2 = (0.2^2 + 0.1^2) / 12 s^2, which
pull a bend of radius R at speed v by v^2 sigma^2 / (2 R). That some controllers smooth so is an assumption; it gives a
size, between nothing and about that.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, frozen, owns, row_norms
from compgen.robot.motion import ControllerMotion
from compgen.verification.twin import PreparedProgram
from compgen.verification.twin.controller.deviation import MotionDeviation, motion_deviation

TYPICAL = ControllerMotion(moving_averages=(0.2, 0.1))
HALF = 0.5  # the override whose effect is told beside


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(off=("S",))
class MotionEffect:
    """Of a program at its written speeds, on the part."""

    motion: ControllerMotion  # known, or typical
    known: bool
    largest: float  # [m] off the path, across it
    where: float  # [m] arc length there
    speed: float  # [m/s] written there
    along: float  # [m] farthest from the nearest place along the way: what a way out and back is cut short by
    lag: float  # [m] behind the command at the highest speed
    off: Array  # (S,) [m] off each segment, on the part or not


def motion_effect(prepared: PreparedProgram, touching: BoolArray) -> MotionEffect:
    """What the controller's motion does to a program, or could do where it is not known.

    Args:
        prepared: The program, of N positions.
        touching: The segments on the part, (N - 1,); of none all count.
    """
    known = prepared.twin.robot.motion is not None
    led = prepared.led if known else _led(prepared, TYPICAL)
    motion = prepared.twin.robot.motion or TYPICAL
    if led is None:
        none = np.zeros(len(prepared.program.speed))
        return MotionEffect(
            motion=motion,
            known=known,
            largest=0.0,
            where=0.0,
            speed=float(prepared.program.speed[0]),
            along=0.0,
            lag=0.0,
            off=frozen(none),
        )
    counts = prepared.samples_per_segment
    segment = np.append(np.repeat(np.arange(len(counts)), counts), len(counts) - 1)
    on_part = touching[segment] if touching.any() else np.ones(len(segment), dtype=bool)
    anywhere = row_norms(led.across)
    off = np.where(on_part, anywhere, 0.0)
    worst = int(np.argmax(off))
    k = int(segment[worst])
    length = prepared.sweep.length
    where = length[:k].sum() + length[k] * (worst - int(counts[:k].sum())) / counts[k]
    along = float(np.abs(np.where(on_part, led.along, 0.0)).max())
    return MotionEffect(
        motion=motion,
        known=known,
        largest=float(off[worst]),
        where=float(where),
        speed=float(prepared.program.speed[k]),
        along=along,
        lag=led.lag,
        off=frozen(np.maximum.reduceat(anywhere, prepared.first_samples()[:-1])),
    )


def error_at_half_override(prepared: PreparedProgram, error: Array, touching: BoolArray) -> float:
    """Largest error [m] on the part at half the override, of errors (M, 3) [m] of all samples at the full one.

    The arm's own error is that of the full override; only the controller's motion is another one.
    """
    half = prepared.at_override(HALF).led
    if prepared.led is None or half is None:
        return 0.0
    on_part = np.append(np.repeat(touching, prepared.samples_per_segment), touching[-1]) | ~touching.any()
    return float(row_norms((error + half.across - prepared.led.across)[on_part]).max())


def _led(prepared: PreparedProgram, motion: ControllerMotion) -> MotionDeviation | None:
    twin = prepared.twin
    return motion_deviation(
        replace(twin.robot, motion=motion), twin.tool, prepared.written_path(), prepared.samples_per_segment,
        prepared.override, places_only=True,
    )  # fmt: skip
