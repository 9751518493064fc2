r"""Whether a run passed a corner elsewhere than its text has it, by what no smoothing explains.

Two moving means leave a few micrometres of a run of the maker's motion code, so a corner 1 mm elsewhere shows:

    on lines that are straight about a row for longer than any smoothing reaches: there a run is on its line
    in chains of short lines: there one place is off, and the motion that the rest of the log tells does not lead there

A controller of another kind is off at all bends alike. So a bend is told only against others of the same log.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, norm, rms
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.pose import Pose
from compgen.core.units import UM
from compgen.identification.motion.fit import Kind, Residuals, fit_kind
from compgen.identification.motion.timed_windows import FIRST, FittedWindows, fitted_windows, timed_windows
from compgen.identification.motion.windows import residuals
from compgen.robot.motion import ControllerMotion
from compgen.robot.robot import Robot
from compgen.verification.executed.clock_fit import chords
from compgen.verification.executed.judgement import ExecutedRun

KINDS = (FIRST, Kind("joint", "means", 2), Kind("cartesian", "lags", 2), Kind("joint", "lags", 2))
STRAIGHT = 1e-7  # [m] that a chord about a row is shorter than its way, up to which no smoothing pulls
OFF_LINE = 0.1e-3  # [m] from a line that is straight
OFF_BEND = 50e-6  # [m] from what the log's own motion makes of a bend
NOISES = 3.0  # times the log's noise beside
SEEN = 20e-6  # [m] that a bend is led off by at least, to be compared with others
BESIDE = 0.7  # [s] about a place, in which a corner that is elsewhere shows
FEWEST = 4  # blocks of bends away from there, that tell the log's own motion
STANDS_OUT = 5.0  # times what the others leave of what they are led off by


@dataclass(frozen=True, eq=False, slots=True)
class _Rows:
    """Rows of windows, in B blocks."""

    block: IntArray  # (R,)
    straight: BoolArray  # (R,)
    shown: Array  # (R,) [s]
    off: Array  # (R,) [m] from the text


@dataclass(frozen=True, slots=True)
class _Stray:
    """Where a motion does not lead."""

    size: float  # m
    row: int


def stray_corner(run: ExecutedRun, robot: Robot) -> tuple[Finding | None, FittedWindows | None]:
    """Where a run passed elsewhere than its text and every motion that is tried; None where it did nowhere.

    With it the windows as far as they were fitted; None of too short a run.
    """
    tool, noise = run.course.tool, NOISES * run.deviation.noise
    try:
        fitted = fitted_windows(run, robot)
    except InputError:  # too short a run to say
        return None, None
    if not fitted.windows or _left(fitted, robot, tool).max() <= OFF_BEND + noise:
        return None, fitted
    fitted = timed_windows(run, robot, fitted)
    if _left(fitted, robot, tool).max() <= OFF_BEND + noise:
        return None, fitted
    windows = fitted.windows
    arc = np.concatenate([w.row_arc for w in windows])
    way, chord = chords(run.course, arc)
    _, block = np.unique(np.concatenate([w.block for w in windows]), return_inverse=True)
    shown, off = np.concatenate([w.shown for w in windows]), norm(np.concatenate([w.off for w in windows]))
    rows, left = _Rows(block, way - chord < STRAIGHT, shown, off), partial(residuals, windows, robot, tool)
    kinds = KINDS if windows[0].theta is not None else KINDS[::2]
    stray = _off_a_line(rows, left, kinds, noise) or _off_a_bend(rows, left, kinds, noise, fitted.motion)
    if stray is None:
        return None, fitted
    return Finding.of(
        Code.EXECUTED_ANOTHER,
        f"near {run.course.point_name(float(arc[stray.row]))} the robot passed {stray.size / UM:.0f} um from where "
        "this program leads it, smoothed as in the rest of the log: a position there is another, or another program "
        "ran along the same way; give the program that ran",
    ), fitted


def _left(fitted: FittedWindows, robot: Robot, tool: Pose) -> Array:
    """How far rows are off the fitted motion, (R,) [m]."""
    return norm(residuals(fitted.windows, robot, tool, fitted.motion)[:, :3])


def _off_a_line(rows: _Rows, left: Residuals, kinds: Sequence[Kind], noise: float) -> _Stray | None:
    """Where a run is off a line that smoothing of no kind leads it off."""
    size = _per_block(rows, rows.off, rows.straight)
    if size.max() <= OFF_LINE + noise:
        return None
    everything = np.ones(len(rows.block), dtype=bool)
    for kind in kinds:
        away = norm(left(fit_kind(kind, left, everything, rows.block).motion)[:, :3])
        size = np.minimum(size, _per_block(rows, away, rows.straight))
    return _Stray(float(size.max()), _row_of(rows, size)) if size.max() > OFF_LINE + noise else None


def _off_a_bend(
    rows: _Rows, left: Residuals, kinds: Sequence[Kind], noise: float, motion: ControllerMotion
) -> _Stray | None:
    """Where a run is off what the kind that explains its other bends best makes of the one a motion leaves most of."""
    first = _per_block(rows, norm(left(motion)[:, :3]))
    row, led = _row_of(rows, first), _per_block(rows, rows.off)
    others, worst = np.abs(rows.shown - rows.shown[row]) > BESIDE, rows.block[row]
    bends = np.unique(rows.block[others & ~rows.straight & (led[rows.block] > SEEN)])
    if len(bends) < FEWEST:
        return None
    fits = (fit_kind(kind, left, others, rows.block).motion for kind in kinds)
    own = min((_per_block(rows, norm(left(motion)[:, :3])) for motion in fits), key=lambda size: rms(size[bends]))
    share = rms(own[bends]) / rms(led[bends])
    limit = max(OFF_BEND + noise, STANDS_OUT * share * led[worst])
    return _Stray(float(own[worst]), row) if own[worst] > limit else None


def _per_block(rows: _Rows, distance: Array, of: BoolArray | None = None) -> Array:
    """Root mean squares of distances (R,) over each block, or some of its rows, (B,) [m]."""
    weight = np.ones(len(distance)) if of is None else of
    return np.asarray(
        np.sqrt(np.bincount(rows.block, weight * distance**2) / np.maximum(np.bincount(rows.block, weight), 1))
    )


def _row_of(rows: _Rows, size: Array) -> int:
    """The middle row of the block of which most is left."""
    inside = np.flatnonzero(rows.block == np.argmax(size))
    return int(inside[len(inside) // 2])
