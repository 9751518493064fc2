"""Findings on a correction: what the user must know of it."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from compgen.core.arrays import Array
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding, beyond_text
from compgen.core.unique_rows import grouped
from compgen.core.units import DEG, KB, MM, UM, counted
from compgen.error_model.beyond_measured import DrivenPoses, joint_box_findings, map_findings, unknown_start_findings
from compgen.error_model.direction_memory import reversal_widths
from compgen.fanuc.analysis.contradictions import contradictions
from compgen.fanuc.analysis.inspection import other_models, unattainable
from compgen.fanuc.analysis.poses import untold_tools
from compgen.fanuc.analysis.watermark import Mark, decimals_of
from compgen.fanuc.editing.insertion import allowed_pieces
from compgen.fanuc.editing.shared_positions import SAME_POSITION
from compgen.fanuc.paging.capacity import program_size
from compgen.fanuc.vocabulary import ARC_LETTERS
from compgen.job.part_frame import frame_findings
from compgen.pipelines.correct.motion_command import motion_command_findings
from compgen.pipelines.correct.result import Correction, off_by_digits, straight_ways, ways_past_limits
from compgen.pipelines.correct.station_band import part_frame_of
from compgen.pipelines.correct.station_corrections import error_models
from compgen.pipelines.findings import job_findings
from compgen.pipelines.planned.many_starts import WIDE, spread_finding, start_words
from compgen.planning.retiming.trajectory import SAME_FEED
from compgen.program.directions import station_directions
from compgen.program.driven import NONE
from compgen.program.ways import chains
from compgen.thermal.model import extrapolations

ROUNDING = 3 * UM  # what rounding to three decimals may add to a corrected station, with all else that is small
THREE_DECIMALS = 0.87 * UM  # of it, in Cartesian form
MAX_DEVIATION = 2 * UM  # of a straight line between corrected ends, above which it is a finding
NAMED = 8  # lines or positions that a message names before it counts the rest


def correction_findings(result: Correction, deviation: Array) -> tuple[Finding, ...]:
    """All findings on a correction, those that break a bound first; that none is given comes last.

    Args:
        result: The correction.
        deviation: Of each straight way between corrected ends, midway from where it should be, (n,) [m].
    """
    return tuple(
        [
            *_robot_findings(result),
            *_placement_findings(result),
            *_bound_findings(result),
            *(result.draws.findings() if result.draws is not None else ()),
            *_scope_findings(result),
            *_shared_findings(result),
            *_served_findings(result),
            *_line_findings(result, deviation),
            *_way_findings(result),
            *_text_findings(result),
            *_heat_findings(result),
            *_frame_findings(result),
            *_source_findings(result),
            *_timing_findings(result),
            *_controller_findings(result),
            *_missing_bound(result),
        ]
    )


def _robot_findings(result: Correction) -> Iterator[Finding]:
    """What speaks against the program being this robot's."""
    plan, robot = result.plan, result.cell.robot
    none = unattainable(plan.program, plan.poses, plan.drive, robot)
    if none.positions:
        count = f"{len(none.positions)} of {none.driven} positions that it drives to"
        message = f"{robot.name} cannot take {count} ({_first_of([f'P[{n}]' for n in none.positions])})"
        message += ": is it another robot's program? say which with --robot, or other frames with --frames"
        level = Level.OUTSIDE if 2 * len(none.positions) >= none.driven else Level.WARNING
        yield Finding(level, Code.ROBOT_UNATTAINABLE, message)
    others = other_models(plan.program, robot)
    if others:
        message = f"its remarks name {', '.join(others)[:60]}, it is corrected for {robot.name}"
        yield Finding.of(Code.ROBOT_NAMED, f"{message}: is that the robot that runs it?")
    groups = sorted(set(plan.program.positions.group[plan.program.positions.group > 1].tolist()))
    if groups:
        message = f"positions hold group {', '.join(map(str, groups))} as well: group 1 is taken for {robot.name}"
        yield Finding.of(Code.ROBOT_GROUPS, message)


def _placement_findings(result: Correction) -> Iterator[Finding]:
    """What is taken for where the arm stands, and for the form of registers."""
    poses = result.plan.poses
    rows = result.plan.drive.pose[result.plan.free]
    if len(rows) and (bases := np.unique(poses.arm_bases.base[rows][poses.arm_bases.base[rows] > 0])).size:
        message = f"an extended axis carries the arm: {counted(len(bases), 'place', 'places')} of its base taken from "
        message += "the frames table; errors told in World, maps among them, are taken to move along with it"
        yield Finding.of(Code.ROBOT_CARRIED, message)
    if poses.placements.assumed:
        names = _first_of([f"PR[{n}]" for n in poses.placements.assumed])
        message = f"{names}: taken for Cartesian, for the program writes six numbers and does not say in which form"
        yield Finding.of(Code.REGISTERS_FORM, message)


def _bound_findings(result: Correction) -> Iterator[Finding]:
    judged = result.judged
    if not judged.any():
        message = "no position of this program can be corrected: it is unchanged; cgen inspect says what keeps them"
        yield Finding.of(Code.CORRECTION_NONE, message)
        return
    yield from job_findings.nothing_to_correct(result.cell)
    before, after = result.error.distance[judged], result.residual.distance[judged]
    worse = np.flatnonzero(after > before + ROUNDING)
    off = off_by_digits(result, np.flatnonzero(judged)[worse])
    coarse = (after - before)[worse] <= ROUNDING - THREE_DECIMALS + off
    for some, level in ((worse[~coarse], Level.OUTSIDE), (worse[coarse], Level.WARNING)):
        if not len(some):
            continue
        k = int(some[np.argmax((after - before)[some])])
        place = _place_of(result, np.flatnonzero(judged)[k])
        message = f"{place}: {before[k] / UM:.1f} um before, {after[k] / UM:.1f} um after: it would become worse"
        message += ", in digits that are coarse" if level is Level.WARNING else ""
        yield Finding(level, Code.CORRECTION_WORSE, message)
    if (result.turn > 0).any():
        k, i = (int(index) for index in np.unravel_index(np.argmax(result.turn), result.turn.shape))
        line, way = _line_of(result, int(result.execution.station[k])), result.execution.fraction[k] < 1
        yield Finding.of(
            Code.CORRECTION_TURN,
            f"line {line}: {'on the way there, ' if way else ''}joint {result.cell.robot.joint_names[i]} turns by "
            f"{result.turn[k, i] / DEG:.2f} deg more from the planned to the corrected text than the correction "
            "explains: a singularity is near; teach it elsewhere",
        )
    bound = result.options.bound
    if bound is not None and after.max() > bound:
        place = _place_of(result, np.flatnonzero(judged)[np.argmax(after)])
        size = beyond_text(float(after.max()) / UM, bound / UM)
        message = f"{place}: {size} um after correction, above the {bound / UM:g} um of --max-um"
        yield Finding.of(Code.BOUNDS_MAX, message)


def _missing_bound(result: Correction) -> Iterator[Finding]:
    given = result.options.bound is not None or result.options.guaranteed is not None
    if not given and result.judged.any():
        after = result.residual.distance[result.judged].max() / UM
        message = f"nothing says whether {after:.2f} um after correction is good enough; give --max-um"
        yield Finding.of(Code.BOUNDS_NONE, message)


def _source_findings(result: Correction) -> Iterator[Finding]:
    """Where the program leaves the range of the measured errors, or starts from an unknown state."""
    plan, cell = result.plan, result.cell
    rows = plan.drive.pose[plan.free]
    if not len(rows):
        return
    poses = plan.poses
    yield from [
        *map_findings(cell.sources, poses.tcp.position[rows]),
        *joint_box_findings(cell.robot, cell.joint_box, poses.theta[rows]),
    ]
    known = np.flatnonzero(plan.drive.pose >= 0)
    known = known[np.isfinite(poses.theta[plan.drive.pose[known]]).all(axis=1)]
    parts = [known[part] for part in chains(plan.drive, known)]
    begin, *others = [part for part in parts if plan.free[part].any()]
    at = plan.drive.pose[begin]
    first = plan.drive.pose[plan.free][:1]
    model = error_models(cell, plan.drive.at, first)[int(poses.tool[first[0]])]
    motion = station_directions(cell.robot, cell.sources, plan.drive)[0].at(begin)
    start = DrivenPoses(
        theta=poses.theta[at],
        position=poses.tcp.position[at],
        rise=plan.stations.rise[begin],
        directions=motion,
        contact=plan.free[begin],
    )
    yield from unknown_start_findings(cell.robot, cell.sources, model, start)
    if others and reversal_widths(cell.sources) is not None:
        begins = [int(part[plan.free[part]][0]) for part in others]
        message = f"{_lines_at(result, begins)}: from where the robot comes is not sure: the side that joints come from"
        yield Finding.of(Code.SOURCES_ORDER, f"{message} is as unknown there as where the program begins")


def _scope_findings(result: Correction) -> Iterator[Finding]:
    unsafe = result.plan.scope.unsafe
    if unsafe:
        lines = sorted({u.line for u in unsafe})
        what = "statements or positions that stay as they are, or put the correction in doubt"
        message = f"{what}: {len(unsafe)}, in {_lines(lines)}"
        yield Finding.of(Code.CORRECTION_UNSAFE, f"{message}; first: {unsafe[0].text}: {unsafe[0].reason}")
    contradicted = contradictions(result.plan.program, result.plan.drive, result.around.called)
    if contradicted:
        lines = sorted({u.line for u in contradicted})
        first = contradicted[0]
        message = f"the program contradicts itself at {_lines(lines)}; first: {first.text}: {first.reason}"
        yield Finding.of(Code.PROGRAM_CONTRADICTION, message)
    if missing := sorted(result.around.called.missing):
        message = f"called programs not beside it are taken to write no user frame and no tool: {_first_of(missing)}"
        yield Finding.of(Code.PROGRAM_CALLED, f"{message}; put their .LS there, or make sure that none does")
    for reason, stations in grouped((reason, station) for station, reason in result.plan.stations.held).items():
        at = np.isin(result.execution.station, stations) & (result.execution.fraction == 1)
        left = result.residual.distance[at].max(initial=0.0) / UM
        message = f"{_lines_at(result, stations)} left as it is, up to {left:.0f} um off: {reason}"
        yield Finding.of(Code.CORRECTION_HELD, message)
    for limit, stations in grouped((limit, station) for station, limit in result.plan.stations.limited).items():
        yield Finding.of(Code.CORRECTION_LIMITED, f"{limit} binds at {_lines_at(result, stations)}")


def _shared_findings(result: Correction) -> Iterator[Finding]:
    poses, shared = result.plan.poses, result.shared
    spread = np.flatnonzero(shared.changed & (shared.spread > SAME_POSITION))
    if len(spread):
        names = _positions(poses.number[spread].tolist())
        message = (
            f"{names} used more than once with corrections up to {shared.spread.max() / UM:.1f} um from their mean"
        )
        yield Finding.of(Code.CORRECTION_SHARED, f"{message}, which is written; --split parts them")
    mixed = np.flatnonzero(shared.mixed)
    if len(mixed):
        names = _positions(poses.number[mixed].tolist())
        message = f"{names} also used where nothing may change: left as it is; --split parts them"
        yield Finding.of(Code.CORRECTION_MIXED, message)


def _served_findings(result: Correction) -> Iterator[Finding]:
    """What one file leaves over the starts that it serves."""
    if result.served is None:
        return
    mean, (start, worst) = result.served.at_mean.largest, result.served.worst
    yield spread_finding(result.served.ensemble, mean, f"{worst.largest / UM:.2f}", start)
    if mean > 0 and worst.largest / mean >= WIDE:
        yield Finding.of(
            Code.AVERAGE_WIDE,
            f"a file for each start alone would be about {worst.largest / mean:.1f} times better: --before with the "
            "standing makes one",
        )
    both = zip(result.served.flown, result.served.planned, strict=True)
    (start, left), planned = max(both, key=lambda one: one[0][1].largest - one[1].largest)
    if left.largest > planned.largest + ROUNDING:
        yield Finding.of(
            Code.AVERAGE_WIDE,
            f"{start_words(start)}: up to {left.largest / UM:.1f} um are left, and the planned program is "
            f"{planned.largest / UM:.1f} um off: it would become worse there; serve fewer starts",
        )


def _line_findings(result: Correction, deviation: Array) -> Iterator[Finding]:
    plan, drive = result.plan, result.plan.drive
    if deviation.max(initial=0.0) > MAX_DEVIATION:
        stray = straight_ways(plan)[deviation > MAX_DEVIATION]
        halves = np.where(np.isin(np.arange(len(plan.free)), stray), 2, 1)
        closed = np.setdiff1d(stray, np.flatnonzero(allowed_pieces(plan.program, plan.poses, drive, halves) > 1))
        finer = len(closed) < len(stray) and deviation.max() <= (result.options.insert or np.inf)
        mend = "--insert UM puts points into them" if finer else "teach points between"
        mend += f"; --insert puts none into {_lines_at(result, closed)}" if len(closed) else ""
        message = f"straight lines between corrected ends stray by up to {deviation.max() / UM:.1f} um midway"
        yield Finding.of(Code.CORRECTION_STRAIGHT, f"{message}; {mend}")
    short = drive.line & (drive.origin != NONE) & ~drive.stop & (drive.length > 0)
    short &= drive.written < (1 - SAME_FEED) * result.cell.robot.controller.period
    if short.any():
        message = f"{counted(int(short.sum()), 'straight line is', 'straight lines are')} shorter than speed x the "
        yield Finding.of(Code.TIMING_SHORT, f"{message}interpolation period: the robot will be slower there")


def _way_findings(result: Correction) -> Iterator[Finding]:
    """Ways of which only the ends are judged: they leave the reach, or the robot may come from elsewhere."""
    drive, robot = result.plan.drive, result.cell.robot.name
    for stations, level, words in (
        (np.flatnonzero(drive.beyond > 0), Level.WARNING, "the straight way there leaves the reach of"),
        (result.new_beyond, Level.OUTSIDE, "corrected, the straight way there would leave the reach of"),
    ):
        if len(stations):
            message = f"{_lines_at(result, stations)}: {words} {robot} between its ends: only the ends are judged"
            yield Finding(level, Code.CORRECTION_REACH, message)
    for words, of_way in ways_past_limits(result).items():
        message = f"{_lines_at(result, of_way)}: on the way there, between ends that keep it, {words}"
        yield Finding(Level.WARNING, Code.CORRECTION_REACH, f"{message}; teach a position between")
    unsure = np.flatnonzero(result.plan.free & drive.line & (drive.origin == NONE))
    unsure = unsure[unsure > 0]
    if len(unsure):
        message = f"{_lines_at(result, unsure)}: from where the robot comes is not sure (a jump, a call, a macro, an"
        yield Finding.of(Code.CORRECTION_ORDER, f"{message} unknown place): the end is judged, not the way there")
    letters = np.array(result.plan.program.motions.letter)[drive.motion]
    curved = np.flatnonzero(result.plan.free & np.isin(letters, ARC_LETTERS))
    if len(curved):
        message = f"{_lines_at(result, curved)}: a chain of A or S: its ends are judged, not the curve between them"
        yield Finding.of(Code.CORRECTION_ORDER, message)


def _text_findings(result: Correction) -> Iterator[Finding]:
    changed = np.flatnonzero(result.shared.changed)[:1000]
    decimals = decimals_of(result.plan.program, result.plan.poses.row[changed])
    if decimals.min(initial=3) < 3:
        message = f"positions are written with {decimals.min()} decimals: rounding alone moves them by up to"
        yield Finding.of(Code.TEXT_DECIMALS, f"{message} {0.87 * 10.0 ** -decimals.min() * MM / UM:.0f} um")
    joint = result.plan.poses.joint_form & result.shared.changed
    if joint.any():
        message = f"{int(joint.sum())} corrected positions are in joint form, whose digits say a place less exactly"
        if tools := untold_tools(result.plan.program, result.plan.poses, joint):
            message += f"; judged at the flange: give the tool, utool {_first_of(list(map(str, tools)))}, with --frames"
        yield Finding(Level.WARNING if tools else Level.NOTE, Code.TEXT_JOINT_FORM, message)
    if result.changed and result.mark is Mark.NONE:
        message = "its positions cannot carry compgen's mark: keep the provenance file beside the program"
        yield Finding.of(Code.CORRECTION_MARK, f"{message}, or let a remark carry it with --mark remark")


def _frame_findings(result: Correction) -> Iterator[Finding]:
    """How the frame of the corrected positions was taught, where the frames table says it."""
    frames, frame = result.around.frames, part_frame_of(result.plan, result.around.frames)
    if frame is None and frames.taught:
        names = ", ".join(map(str, sorted(frames.taught)))
        yield Finding.of(
            Code.FRAME_TAUGHT,
            f"frame {names} of the frames table was taught; the corrected positions do not all stand in it, Cartesian, "
            "with one tool, on an arm that nothing carries: how it was taught does not count",
        )
    yield from frame_findings(frame, result.cell.robot_file_hash, result.cell.heat.names)


def _heat_findings(result: Correction) -> Iterator[Finding]:
    drive, stations, heat = result.plan.drive, result.plan.stations, result.cell.heat
    yield from result.cell.input_findings
    if not result.before and result.cell.heat.start is None:
        yield Finding.of(Code.THERMAL_COLD, "no --before: the cell starts cold")
    motion = drive.joint_motion()
    moving = np.where(motion.driven > 0, np.diff(motion.time), 0.0)
    if moving.any():
        feed = float(motion.driven @ moving / moving.sum())
        duration = float(moving.sum())
        messages = extrapolations(heat, result.before, round(feed, 4), duration, stations.rise)
        yield from [Finding.of(Code.THERMAL_BOX, message) for message in messages]


def _timing_findings(result: Correction) -> Iterator[Finding]:
    drive = result.plan.drive
    if where := _lines_and_programs(drive.untimed, drive.untold):
        message = (
            f"{where}: how fast or how long is only known at run time "
            "(a register, a wait, an override, a moving extended axis or group): a speed is assumed; a wait, the axis, "
            "the group or a way between places that are not told takes no time in the heat"
        )
        yield Finding.of(Code.TIMING_ASSUMED, message)
    if drive.flow:
        where = _lines_and_programs(drive.flow, sorted(result.around.called.branching))
        message = f"{where}: jumps, calls and loops: the heat is that of one pass in the order listed"
        if silent := drive.uncounted or sorted(result.around.called.missing):
            message += (
                f", without all that {_first_of(silent)} may do: behind what lasts, the arm is not as warm as "
                "said; make what follows a program of its own, with --before"
            )
        yield Finding(Level.WARNING if drive.uncounted else Level.NOTE, Code.TIMING_ORDER, message)


def _controller_findings(result: Correction) -> Iterator[Finding]:
    controller = result.cell.robot.controller
    yield from motion_command_findings(result)
    if controller.compensation == "signature":
        message = f"the controller's calibration '{controller.signature}' is active, as when the errors were identified"
        yield Finding.of(Code.CONTROLLER_SIGNATURE, message)
    size = program_size(result.plan.program)
    message = f"{size.lines} lines, {size.positions} positions, about {size.memory / KB:.0f} kB on the controller"
    if not size.within(result.cell.robot.controller.capacity):
        message = f"{message}: more than it holds in one file, it cannot be loaded; cgen pages parts it at FINE"
        yield Finding(Level.OUTSIDE, Code.CONTROLLER_SIZE, message)
    elif result.added:
        yield Finding(
            Level.NOTE, Code.CONTROLLER_SIZE, f"{counted(result.added, 'position is', 'positions are')} new: {message}"
        )


def _line_of(result: Correction, station: int) -> int:
    return int(result.plan.program.motions.line[result.plan.drive.motion[station]])


def _place_of(result: Correction, sample: int) -> str:
    """The line of a sample, and that it is where the way there begins, behind a wait."""
    line = f"line {_line_of(result, int(result.execution.station[sample]))}"
    return line if result.execution.fraction[sample] > 0 else f"{line}, as it sets off after standing"


def _lines_at(result: Correction, stations: Iterable[int]) -> str:
    """The lines of stations, as ``_lines`` has them."""
    return _lines(sorted({_line_of(result, station) for station in stations}))


def _lines_and_programs(lines: Sequence[int], called: Sequence[str]) -> str:
    """Lines of a program, and others that it calls: ``line 3 and in REST``."""
    return " and ".join(([_lines(lines)] if lines else []) + ([f"in {_first_of(called)}"] if called else []))


def _lines(numbers: Sequence[int]) -> str:
    """Lines by number: ``line 3``, or ``lines 1, 2 and 5 more``."""
    return f"{'line' if len(numbers) == 1 else 'lines'} {_first_of(list(map(str, numbers)))}"


def _positions(numbers: Sequence[int]) -> str:
    """Positions by number, with their verb: ``P[1] is``, or ``P[1], P[2] and 5 more are``."""
    return f"{_first_of([f'P[{n}]' for n in numbers])} {'is' if len(numbers) == 1 else 'are'}"


def _first_of(names: Sequence[str]) -> str:
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return f"{', '.join(names[:NAMED])}{more}"
