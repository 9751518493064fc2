"""What the user must know of a correction."""

import numpy as np

from compgen.core.arrays import Array
from compgen.core.findings import Finding, Level
from compgen.core.units import KB, MM, UM
from compgen.error_model.validity import outside_joints, outside_map, unknown_start
from compgen.fanuc.editing.numbers import decimals_of
from compgen.fanuc.editing.shared_positions import SAME
from compgen.fanuc.paging.capacity import program_size
from compgen.fanuc.paging.stops import controller_capacity
from compgen.pipelines.correct.directions import course
from compgen.pipelines.correct.result import Correction
from compgen.pipelines.correct.station_corrections import error_models

ROUNDING = 3 * UM  # what rounding alone may add to a corrected station
STRAY = 2 * UM  # of a straight line between corrected ends, above which it is a finding
NAMED = 8  # lines or positions that a message names before it counts the rest


def findings(result: Correction, stray: Array) -> tuple[Finding, ...]:
    """All of them, the worst first.

    Args:
        result: The correction.
        stray: How far each straight way between corrected ends strays from what it should be, (n,) [m].
    """
    return tuple(
        [
            *_verdict(result),
            *_scope(result),
            *_shared(result),
            *_lines(result, stray),
            *_text(result),
            *_heat(result),
            *_sources(result),
            *_time(result),
            *_controller(result),
        ]
    )


def _verdict(result: Correction) -> list[Finding]:
    judged = result.judged
    if not judged.any():
        return [Finding(Level.WARNING, "correction.none", "no position of this program can be corrected")]
    found = []
    before, after = result.error[0][judged], result.residual[0][judged]
    worse = np.flatnonzero(after > before + ROUNDING)
    coarse = _decimals(result).min(initial=3) < 3 or result.plan.poses.joint_form.any()
    if len(worse) and not coarse:
        k = int(worse[np.argmax((after - before)[worse])])
        line = _line(result, int(result.flight.station[judged][k]))
        told = f"line {line}: {before[k] / UM:.1f} um before, {after[k] / UM:.1f} um after: it would become worse"
        found.append(Finding(Level.OUTSIDE, "correction.worse", told))
    bound = result.options.bound
    if bound is not None and after.max() > bound:
        line = _line(result, int(result.flight.station[judged][int(np.argmax(after))]))
        told = f"line {line}: {after.max() / UM:.2f} um after correction, above the {bound / UM:g} um of --max-um"
        found.append(Finding(Level.OUTSIDE, "bounds.max", told))
    return found


def _sources(result: Correction) -> list[Finding]:
    """Where the program leaves what the errors were measured in, or starts from what is not known."""
    plan, cell = result.plan, result.cell
    rows = plan.drive.pose[plan.free]
    if not len(rows):
        return []
    poses = plan.poses
    found = [
        *outside_map(cell.sources, poses.position[rows]),
        *outside_joints(cell.robot, cell.joint_box, poses.theta[rows]),
    ]
    known = np.flatnonzero(plan.drive.pose >= 0)
    known = known[np.isfinite(poses.theta[plan.drive.pose[known]]).all(axis=1)]
    at = plan.drive.pose[known]
    first = plan.drive.pose[plan.free][:1]
    model = error_models(cell, poses, first)[int(poses.tool[first[0]])]
    motion = course(cell, poses, plan.drive)[0].at(known)
    start = (poses.theta[at], poses.position[at], plan.solved.rise[known], motion, plan.free[known])
    return [*found, *unknown_start(cell.robot, cell.sources, model, *start)]


def _scope(result: Correction) -> list[Finding]:
    found = []
    unsafe = result.plan.scope.unsafe
    if unsafe:
        lines = sorted({u.line for u in unsafe})
        told = (
            f"{len(unsafe)} statements or positions are passed through untouched or cast doubt: {_some('line', lines)}"
        )
        found.append(
            Finding(Level.WARNING, "correction.unsafe", f"{told}; first: {unsafe[0].text}: {unsafe[0].reason}")
        )
    reasons: dict[str, list[int]] = {}
    for station, why in result.plan.solved.held:
        reasons.setdefault(why, []).append(_line(result, station))
    for why, lines in reasons.items():
        found.append(Finding(Level.WARNING, "correction.held", f"{_some('line', lines)} left as it is: {why}"))
    limits: dict[str, list[int]] = {}
    for station, limit in result.plan.solved.limited:
        limits.setdefault(limit, []).append(_line(result, station))
    for limit, lines in limits.items():
        found.append(Finding(Level.WARNING, "correction.limited", f"{limit} binds at {_some('line', lines)}"))
    return found


def _shared(result: Correction) -> list[Finding]:
    found = []
    poses, each = result.plan.poses, result.shared
    apart = np.flatnonzero(each.changed & (each.spread > SAME))
    if len(apart):
        names = _some("P", poses.number[apart].tolist())
        told = f"{names} used more than once with corrections up to {each.spread.max() / UM:.1f} um from their mean"
        found.append(Finding(Level.WARNING, "correction.shared", f"{told}, which is written; --split parts them"))
    mixed = np.flatnonzero(each.mixed)
    if len(mixed):
        names = _some("P", poses.number[mixed].tolist())
        told = f"{names} also used where nothing may change: left as it is; --split parts them"
        found.append(Finding(Level.WARNING, "correction.mixed", told))
    return found


def _lines(result: Correction, stray: Array) -> list[Finding]:
    found = []
    if stray.max(initial=0.0) > STRAY:
        told = f"straight lines between corrected ends stray by up to {stray.max() / UM:.1f} um midway"
        found.append(Finding(Level.NOTE, "correction.straight", f"{told}; --insert UM puts points into them"))
    drive = result.plan.drive
    with np.errstate(invalid="ignore", divide="ignore"):
        pace = drive.length / drive.duration
        short = drive.line & ~drive.stop & (drive.length < pace * result.cell.robot.controller.period)
    if short.any():
        told = f"{int(short.sum())} straight lines are shorter than speed x the interpolation period"
        found.append(Finding(Level.NOTE, "timing.short", f"{told}: the robot will be slower there"))
    return found


def _text(result: Correction) -> list[Finding]:
    found = []
    decimals = _decimals(result)
    if decimals.min(initial=3) < 3:
        told = f"positions are written with {decimals.min()} decimals: rounding alone moves them by up to"
        found.append(Finding(Level.NOTE, "text.decimals", f"{told} {0.87 * 10.0 ** -decimals.min() * MM / UM:.0f} um"))
    joint = result.plan.poses.joint_form & result.shared.changed
    if joint.any():
        told = f"{int(joint.sum())} corrected positions are in joint form, whose digits say a place less exactly"
        found.append(Finding(Level.NOTE, "text.joint_form", told))
    if result.changed and not result.marked:
        told = "too few positions to carry compgen's mark: keep the provenance file beside the program"
        found.append(Finding(Level.NOTE, "correction.mark", told))
    return found


def _heat(result: Correction) -> list[Finding]:
    drive, solved, heat = result.plan.drive, result.plan.solved, result.cell.heat
    found = []
    if not result.before:
        found.append(Finding(Level.NOTE, "thermal.cold", "no --before: the cell starts cold"))
    run = drive.duration > 0
    if run.any() and np.nansum(drive.length) > 0:
        feed = float(np.nansum(drive.length[run]) / drive.duration[run].sum())
        told = heat.strays(result.before, round(feed, 4), float(solved.time[-1]), solved.rise)
        found += [Finding(Level.WARNING, "thermal.box", text) for text in told]
    return found


def _time(result: Correction) -> list[Finding]:
    drive = result.plan.drive
    found = []
    if drive.untimed:
        told = f"{_some('line', drive.untimed)}: speed or way is only known at run time; an assumed one warms the model"
        found.append(Finding(Level.NOTE, "timing.assumed", told))
    if drive.flow:
        told = f"{_some('line', drive.flow)}: jumps, calls and loops are not followed; the heat is that of one pass"
        found.append(Finding(Level.NOTE, "timing.order", told))
    return found


def _controller(result: Correction) -> list[Finding]:
    controller = result.cell.robot.controller
    found = []
    if controller.compensation == "signature":
        text = f"the controller's calibration '{controller.signature}' is active, as when the errors were identified"
        found.append(Finding(Level.NOTE, "controller.signature", text))
    asked = program_size(result.plan.program)
    told = f"{asked.lines} lines, {asked.positions} positions, about {asked.memory / KB:.0f} kB on the controller"
    if not asked.within(controller_capacity(result.cell.robot)):
        told = f"{told}: more than it holds in one file; cgen pages parts what was written"
        found.append(Finding(Level.WARNING, "controller.size", told))
    elif result.added:
        found.append(Finding(Level.NOTE, "controller.size", f"{result.added} positions are new: {told}"))
    return found


def _decimals(result: Correction) -> Array:
    changed = np.flatnonzero(result.shared.changed)
    return np.asarray(decimals_of(result.plan.program, result.plan.poses, changed[:1000]), dtype=float).astype(int)


def _line(result: Correction, station: int) -> int:
    return int(result.plan.program.motions.line[result.plan.drive.motion[station]])


def _some(what: str, numbers: tuple[int, ...] | list[int]) -> str:
    form = "P[{}]" if what == "P" else "{}"
    named = ", ".join(form.format(n) for n in numbers[:NAMED])
    more = f" and {len(numbers) - NAMED} more" if len(numbers) > NAMED else ""
    head = "" if what == "P" else ("line " if len(numbers) == 1 else "lines ")
    return f"{head}{named}{more}" + ((" is" if len(numbers) == 1 else " are") if what == "P" else "")
