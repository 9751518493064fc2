"""What the user must know of a run beside its bounds: limits that bind, speeds below feed, clocks that differ.

What is not sure of arcs, what a text comes to on a controller that takes whole interpolation periods for every line,
and how far the flown tool is from the user's own file as the judge reads it, with whether that is explained.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from compgen.compensation.problem import Settings, Solution, Solver, Status
from compgen.core.arrays import Array, IntArray, interpolated, norm, numbered, row_norms
from compgen.core.exceptions import ImpossibleError
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.rotations import interpolate_rotation, rotation_vector
from compgen.core.unique_rows import grouped
from compgen.core.units import MDEG, MM, MS, UM
from compgen.error_model.source import RiseDependent
from compgen.error_model.unmeasured import OF_WARMTH
from compgen.job.job import Cell, Job
from compgen.planning.retiming import Trajectory, shorter_than_period
from compgen.planning.toolpath import ToolPath
from compgen.program.program import Program
from compgen.program.speeds import feed_errors
from compgen.robot.robot import SAME_PERIOD, Controller
from compgen.verification.deviation import Deviation
from compgen.verification.own_file.distance import distance_from_file
from compgen.verification.written_motion import WrittenMotion

SAME_USE = 1e-4  # of a joint's limit: what the digits of a written speed come to
CLOCK_ERROR = 0.01  # difference of plan's and twin's duration, above which it is a finding
SAME_FEED = 1e-3  # difference of the wanted feed and the written one, above which it is a finding
FEED_ERROR = 0.01  # of a written speed, above which it is a finding
SAME_TURN = 1 * MDEG  # a digit of W, P and R
AT_FEED = 1e-9  # relative
TIMES_APART = 0.005  # relative: from where the two clocks' times are told
ALLOWED = 1 * UM  # of the chords that stand for arcs here, and of a program's digits
ROUNDING = 1e-9  # m of arc length
PARTS = 10  # of the way between two samples of an arc


@contextmanager
def asking_units(job: Job) -> Iterator[None]:
    """What the robot cannot do may be due to a value in another unit: its question follows the message."""
    try:
        yield
    except ImpossibleError as failure:
        questions = [finding.message for finding in job.input_findings if finding.code == Code.UNITS_UNLIKELY]
        if questions:
            failure.args = (f"{failure}; {questions[0]}",)
        raise


def limited(solution: Solution) -> Iterator[Finding]:
    """Limits that hold waypoints off their targets."""
    if solution.status is not Status.LIMITED:
        return
    kinds = grouped((limit, number) for number, limit in solution.active_limits)
    off = row_norms(solution.residual[:, :3])
    worst = int(np.argmax(off))
    text = "; ".join(f"{limit} at waypoints {min(w)} to {max(w)} ({len(w)})" for limit, w in kinds.items())
    farthest = f"farthest from its target: waypoint {worst + 1}, {off[worst] / UM:.1f} um"
    mends = {"position clamp": "clamp_mm", "rotation clamp": "clamp_deg", "rate limit": "rate_um_mm"}
    keys = " or ".join(f"compensation.{key}" for name, key in mends.items() if name in kinds)
    message = f"{text}; {farthest}" if text else farthest
    message += f"; raise {keys} to let the correction go farther" if keys else ""
    yield Finding.of(Code.COMPENSATION_LIMITED, message)


def nothing_to_correct(cell: Cell) -> list[Finding]:
    """That a robot file knows of nothing that makes its arm err: a program stays as it was planned."""
    if OF_WARMTH not in cell.unknown or not all(isinstance(source, RiseDependent) for source in cell.sources):
        return []
    message = (
        "the robot file says nothing that makes this arm err; it needs [thermal] with temperatures of the warm arm, or "
        "an identification (cgen plan-poses, then cgen identify)"
    )
    return [Finding.of(Code.CORRECTION_NONE, message)]


def of_knowledge(job: Job) -> list[Finding]:
    """That a bound is below what the robot file itself knows: the arithmetic can keep it, the part will not see it.

    And that it knows nothing to correct: the program is the planned one.
    """
    bounds, held_out = job.bounds, job.cell.held_out
    nothing = nothing_to_correct(job.cell)
    if nothing:
        return nothing
    if held_out is None or bounds.least >= held_out:
        return []
    message = (
        f"bounds of {bounds.least / UM:g} um are judged on the robot that its file describes; the file itself was "
        f"{held_out / UM:.0f} um off (mean) at poses that its identification had not seen: on the part some "
        f"{held_out / UM:.0f} um can be kept"
    )
    return [Finding.of(Code.BOUNDS_KNOWLEDGE, message)]


def solver(solution: Solution, settings: Settings) -> Iterator[Finding]:
    """That another solver than compgen's own found the correction."""
    if settings.solver is not Solver.STRUCTURED:
        message = f"the correction is {settings.solver.value}'s, after {solution.iterations} iterations"
        yield Finding.of(Code.COMPENSATION_SOLVER, message)


def why_uncorrected(solution: Solution) -> str:
    """Why there is no correction, and what to try."""
    if solution.status is Status.STOPPED and solution.unsolved is not None:
        return f"waypoints {solution.unsolved[0]} to {solution.unsolved[1]}: {solution.status.value}"
    if solution.active_limits:
        n, limit = solution.active_limits[0]
        return f"waypoint {n}: {solution.status.value}: {limit} cannot be kept there; relax it"
    n = int(np.argmax(row_norms(solution.residual[:, :3])))
    return (
        f"waypoint {n + 1}: {solution.status.value}: it does not settle; waypoints stand too close for its smoothness, "
        "raise process.chord_um or lower compensation.curvature_period_mm"
    )


def below_feed(job: Job, feed: float, path: ToolPath, trajectory: Trajectory) -> Iterator[Finding]:
    """Joint limits passed, and speeds that are not the wanted one."""
    if trajectory.utilisation.max() > 1:
        kind, joint = np.unravel_index(int(np.argmax(trajectory.utilisation)), trajectory.utilisation.shape)
        yield Finding.of(
            Code.TIMING_LIMIT,
            f"{('speed', 'acceleration', 'jerk')[int(kind)]} of joint {job.robot.joint_names[int(joint)]} reaches "
            f"{100 * trajectory.utilisation.max():.0f} % of its limit; lower process.feed_mm_s",
        )
    gaps, feeds = np.diff(path.arc), feed * path.pace
    slow = trajectory.speed < feeds * (1 - AT_FEED)
    share = float(gaps[slow].sum() / path.arc[-1])
    if share > 0.001:
        short = shorter_than_period(gaps, feeds, job.robot.controller)
        why = (
            "segments there are shorter than feed x the interpolation period, or joint limits bind"
            if np.any(slow & short)
            else "joint limits bind there"
        )
        yield Finding.of(
            Code.TIMING_BELOW_FEED, f"{100 * share:.1f} % of the path length is programmed below feed: {why}"
        )
    if abs(feed - job.feed) > SAME_FEED * job.feed:
        yield Finding.of(
            Code.TIMING_FEED,
            f"process.feed_mm_s = {job.feed / MM:g} is written as {feed / MM:.4g} mm/s, the next lower that a program "
            "can say",
        )


def words_off(trajectory: Trajectory, program: Program) -> Iterator[Finding]:
    """Speeds that the text's words say otherwise than they were planned."""
    error, late = feed_errors(trajectory.speed, program.speed, program.lengths())
    if error > FEED_ERROR:
        yield Finding.of(
            Code.TIMING_FEED_ERROR,
            f"written speeds are up to {100 * error:.1f} % off the wanted where the speed is low, the time of any "
            f"stretch by {late / MS:.0f} ms at most",
        )


def clocks_apart(trajectory: Trajectory, written: WrittenMotion) -> Iterator[Finding]:
    """Where the text takes another time than the plan, by the twin's clock."""
    planned, driven = float(trajectory.time[-1]), float(written.time[-1])
    if abs(driven / planned - 1) > CLOCK_ERROR:
        yield Finding.of(
            Code.TIMING_CLOCK,
            f"the written program takes {driven:.2f} s, {planned:.2f} s were planned "
            f"({100 * (driven / planned - 1):+.1f} %), by its stops and slow stretches; all numbers here are of the "
            "written program",
        )


def joints_asked(job: Job, program: Program, written: WrittenMotion) -> Iterator[Finding]:
    """Where the written speeds ask more of a joint than its limits."""
    if written.use.max() <= 1 + SAME_USE:
        return
    kind, joint = np.unravel_index(int(np.argmax(written.use)), written.use.shape)
    n = written.hardest
    place = f" at P[{n}], {program.speed[n - 2] / MM:.4g} to {program.speed[n - 1] / MM:.4g} mm/s" if kind else ""
    limit = f"{('speed', 'acceleration')[int(kind)]} limit of joint {job.robot.joint_names[int(joint)]}"
    yield Finding.of(
        Code.TIMING_JOINT_USE,
        f"the written speeds ask {written.use.max():.5g} times the {limit}{place}: the controller is slower there; "
        "lower process.feed_mm_s",
    )


def orientation_on_arcs(job: Job, program: Program) -> Iterator[Finding]:
    """How far the tool is turned at vias if the controller turns it evenly from start to end and ignores the via's."""
    via = np.flatnonzero(program.via)
    if not len(via):
        return
    length, rotation = program.lengths(), program.rotation
    share = length[via - 1] / (length[via - 1] + length[via])
    even = interpolate_rotation(rotation[via - 1], rotation[via + 1], share)
    off = norm(rotation_vector(np.swapaxes(even, 1, 2) @ rotation[via]))
    if off.max() <= SAME_TURN:
        return
    bound = job.bounds.axis
    message = (
        f"at P[{int(via[np.argmax(off)]) + 1}] the tool is {off.max() / MDEG:.1f} mdeg off if the controller "
        "ignores the orientation of an arc's via, which is not published; here it turns through it"
    )
    level = Level.WARNING if bound is not None and off.max() > bound else Level.NOTE
    yield Finding(level, Code.PATH_ARCS_ORIENTATION, message)


def times_apart(controller: Controller, written: WrittenMotion) -> Iterator[Finding]:
    """The duration as written and on a controller that rounds up, where they differ."""
    longer = written.rounded_up / written.as_written - 1
    if longer > TIMES_APART:
        yield Finding.of(
            Code.TIMING_WHOLE_PERIODS,
            f"the text takes {written.as_written:.2f} s as written, and {written.rounded_up:.2f} s "
            f"({100 * longer:+.1f} %) on a controller that rounds every line up to whole periods of "
            f"{controller.period / MS:g} ms; times and heat here are "
            f"{'the second' if controller.rounds_up_to_period else 'the first'}: controller.rounds_up_to_period",
        )


def over_periods(controller: Controller, path: ToolPath, program: Program, feed: float) -> Iterator[Finding]:
    """Lines of a text that last longer at feed than the whole periods that they were laid out for.

    Args:
        controller: Its period.
        path: As planned, N waypoints.
        program: As its text says it, N positions.
        feed: Wanted along the path [m/s].
    """
    feeds = feed * path.pace
    lines = ~(path.via[:-1] | path.via[1:]) & (program.speed >= feeds * (1 - AT_FEED))
    planned = controller.whole_periods(np.diff(path.arc) / feeds)
    lasts = program.lengths() / program.speed / controller.period
    over = np.flatnonzero(lines & (lasts > planned * (1 + SAME_PERIOD)))
    if len(over):
        worst = over[int(np.argmax(lasts[over] - planned[over]))]
        share = program.lengths()[over].sum() / program.lengths().sum()
        yield Finding.of(
            Code.TIMING_OVER_PERIODS,
            f"{len(over)} lines at feed ({100 * share:.1f} % of the length) last longer than the whole interpolation "
            f"periods that they were laid out for: that to P[{worst + 2}] {lasts[worst]:.4f}, not "
            f"{planned[worst]:.0f}; a controller that rounds up takes one more for each",
        )


def own_file_findings(job: Job, path: ToolPath, deviation: Deviation) -> list[Finding]:
    """One finding of a path of own points: the distance from its file, and that it is beyond what explains it.

    The tool may leave the file by the path's own tolerance and the error that is left. More says: it is another path.
    """
    file = job.own_file
    if file is None:
        return []
    arc, place = _flown_places(path, deviation)
    # approach and retract, the first and the last piece, are not the file's
    led = 1 if job.plan.process.lift > 0 else 0
    own = np.flatnonzero((path.piece >= led) & (path.piece < len(path.exact.curve.poly) - led))
    begin, end = path.arc[own[0]], path.arc[own[-1] + 1]
    rows = (arc >= begin - ROUNDING) & (arc <= end + ROUNDING)
    distance = distance_from_file(file, place[rows])
    allowed = job.plan.path.tolerance + deviation.extents["total"].max + ALLOWED
    off, line = max((distance.off, distance.off_line), (distance.missed, distance.missed_line))
    lines = f"its lines are kept to {distance.off / UM:.2g} um, " if file.joined else ""
    if off <= allowed:
        message = (
            f"compared with {file.source}, read a second time: {lines}its places are met to "
            f"{distance.missed / UM:.2g} um"
        )
        return [Finding(Level.NOTE, Code.PATH_FILE, message)]
    message = (
        f"{file.source}: line {line}: read a second time, the tool is {off / UM:.0f} um off it, where the path's "
        f"tolerance and the error that is left explain {allowed / UM:.3g}: the path is not this file's"
    )
    return [Finding(Level.OUTSIDE, Code.PATH_FILE, message)]


def _flown_places(path: ToolPath, deviation: Deviation) -> tuple[Array, Array]:
    """How far along the tool is, (M,) [m], and where in the part's frame, (M, 3) [m], joined by lines as it goes.

    Samples of an arc are parted, the error between them even: their own chords are 13 um off on a radius of 10 mm.
    """
    last = len(path.piece) - 1

    def segments(arc: Array) -> IntArray:
        return np.clip(np.searchsorted(path.arc, arc, side="right") - 1, 0, last)

    of_gap = segments(deviation.arc[:-1])
    parts = np.where(path.via[of_gap] | path.via[of_gap + 1], PARTS, 1)
    gap, part = numbered(parts)
    at = np.append(gap + part / parts[gap], len(parts))
    number = np.arange(len(parts) + 1)
    arc = np.interp(at, number, deviation.arc)
    error = interpolated(at, number, deviation.error)
    segment = segments(arc)
    fraction = (arc - path.arc[segment]) / np.diff(path.arc)[segment]
    place = path.exact.in_frame(path.at(segment, np.clip(fraction, 0, 1)).pose).position
    return arc, place + (error if path.exact.frame is None else error @ path.exact.frame.rotation)
