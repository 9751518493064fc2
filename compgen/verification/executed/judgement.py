"""What a log says of a run, in findings: whose text it was, how much of it, how fast, and how true."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, norm, thinned
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding, beyond_text
from compgen.core.units import MM, MS, PERCENT, UM, counted
from compgen.verification.executed.clock_fit import NEAR_STOP, ClockFit, chords, fit_clock, nearest_rows
from compgen.verification.executed.clock_rates import Stand
from compgen.verification.executed.course import ProgramCourse
from compgen.verification.executed.followed_log import FollowedLog, constant_offset, offset_words
from compgen.verification.executed.path_deviation import RESTING, Likeness, PathDeviation, log_deviation

WHOLE = 0.998  # of the course that a whole run covers
FASTEST = 1.05  # of the written speeds, that a run takes: corners are cut and clocks are off
TIME_BOUND = 0.5 * PERCENT  # of the planned time
CLAMP = 3e-3  # [m] that corrections are clamped to
MOST = 0.75  # of the rows on straight ways: those beside corners are fewer
STRAIGHT = 1e-4  # [m] that a chord is shorter by: smoothing of any length that is known pulls by less than 1 mm there
ROWS = 50_000  # of a log that are looked at
LEAST_ROWS = 50
STOPPED_OFF = 15e-6  # [m] from its stop, where no smoothing is left
SHORTEST_STAND = 0.05  # [s] that is named
NAMED = 5  # changes and stands that are named one by one
STEP_ROWS = 12  # beside a gap, from which speeds are taken
STEP_SHARE = 0.3  # of the way that the speed beside a gap would have led through it
CONSTANT = 0.95  # of the square of all deviation that a constant offset explains
LEAST_OFFSET = 0.1e-3  # m
REFUSED_OFFSET = 0.5e-3  # m


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class ExecutedRun:
    """A log judged against a program's text."""

    course: ProgramCourse
    followed: FollowedLog
    deviation: PathDeviation
    clock: ClockFit
    likeness: tuple[Likeness, ...]
    findings: tuple[Finding, ...]

    @property
    def covered(self) -> tuple[float, float]:
        """Arc lengths from which to which the log follows the course [m]."""
        return float(self.deviation.arc.min()), float(self.deviation.arc.max())

    @property
    def steady(self) -> tuple[float, float] | None:
        """The log's clock at the first and the last row by which the time is judged [s]; None where there is none."""
        return _steady(self.deviation, self.clock)

    @property
    def held(self) -> list[Stand]:
        """Where the robot stood between two stops: held, or as the program waits behind CNT."""
        stops = self.course.arc[self.course.stop]
        return [stand for stand in self.clock.stands if np.abs(stops - stand.arc).min() > NEAR_STOP]

    @property
    def inside(self) -> bool:
        """Whether nothing is outside: this program was run whole, at one override, within the bound if there is one."""
        return not any(f.level is Level.OUTSIDE for f in self.findings)


def measure(course: ProgramCourse, followed: FollowedLog) -> tuple[PathDeviation, ClockFit]:
    """Deviation and clock of a log.

    Raises:
        InputError: The clock steps, or all of the log is at a constant offset that no controller makes.
    """
    deviation = log_deviation(course, followed)
    refuse_clock_steps(followed, deviation)
    return deviation, fit_clock(course, deviation.time, deviation.arc, max(deviation.noise, 1e-6))


def refuse_clock_steps(followed: FollowedLog, deviation: PathDeviation) -> None:
    """Raises InputError where time passes between two rows, at speed on both sides, and the robot has not moved on."""
    time, arc = deviation.time, deviation.arc
    if len(time) < 4 * STEP_ROWS:
        return
    usual = followed.log.period
    gap = np.diff(time)
    for k in np.flatnonzero(gap > max(5 * usual, 0.1)).tolist():
        if not STEP_ROWS <= k < len(time) - STEP_ROWS - 1:
            continue
        before = (arc[k] - arc[k - STEP_ROWS]) / max(time[k] - time[k - STEP_ROWS], 1e-9)
        after = (arc[k + 1 + STEP_ROWS] - arc[k + 1]) / max(time[k + 1 + STEP_ROWS] - time[k + 1], 1e-9)
        slower = min(before, after)
        if slower > 1e-4 and arc[k + 1] - arc[k] < STEP_SHARE * slower * gap[k] and slower * gap[k] > 2e-3:
            step = gap[k] - (arc[k + 1] - arc[k]) / max((before + after) / 2, 1e-9)
            where = followed.log.location(int(deviation.row[k + 1]), "time_s")
            raise InputError(
                f"{where}: {gap[k]:.3g} s after the row before, and the robot, at speed, moved "
                f"{(arc[k + 1] - arc[k]) / MM:.2f} mm: the clock steps forwards by "
                f"{step:.3g} s; take the step out of the later times, or cut the log there"
            )


def findings_of_run(
    course: ProgramCourse,
    followed: FollowedLog,
    deviation: PathDeviation,
    clock: ClockFit,
    likenesses: Sequence[Likeness],
    bound: float | None,
) -> Iterator[Finding]:
    """The findings of a run.

    Args:
        course: Of the program.
        followed: The log.
        deviation: Of it.
        clock: Of it.
        likenesses: To other texts.
        bound: Largest deviation allowed [m].

    Raises:
        InputError: The log is at a constant offset that no controller makes.
    """
    yield from _of_identity(course, followed, deviation, likenesses)
    yield from _of_extent(course, deviation)
    yield from _of_override(clock, counted=course.counted)
    yield from _of_time(deviation, clock)
    yield from _of_stands(course, clock)
    yield from _of_bound(course, deviation, bound)
    yield from _of_log(followed, deviation)


def _of_identity(
    course: ProgramCourse, followed: FollowedLog, deviation: PathDeviation, likenesses: Sequence[Likeness]
) -> Iterator[Finding]:
    for like in likenesses:
        differs = f"the two differ by {like.differs / UM:.1f} um rms"
        if like.is_other:
            words = f"{differs}, and the log shows {100 * like.beta:.0f} % of that"
            message = f"the robot ran {like.name}, not this program ({words}); load the program that you meant"
            yield Finding.of(Code.EXECUTED_OTHER, message)
        elif like.is_sure:
            yield Finding.of(Code.EXECUTED_THIS, f"the robot ran this program, not {like.name} ({differs})")
        else:
            yield Finding.of(
                Code.EXECUTED_UNSURE, f"the log does not show whether this program or {like.name} ran: {differs}"
            )
    largest = deviation.extents["total"].max if deviation.extents else 0.0
    offset = None if any(like.is_other for like in likenesses) else _offset_or_older(course, followed, deviation)
    if offset is not None:
        yield offset
    elif largest > CLAMP and _straight_deviation(course, deviation) > CLAMP / 3:
        yield Finding.of(
            Code.EXECUTED_ANOTHER,
            f"the robot left the path by up to {largest / MM:.2f} mm, near "
            f"{course.point_name(deviation.extents['total'].where)}. No correction is larger than {CLAMP / MM:g} mm: "
            "another program ran along the same way",
        )


def _straight_deviation(course: ProgramCourse, deviation: PathDeviation) -> float:
    """How far most rows are off the path where smoothing pulls nowhere [m]; 0 where there are too few to say."""
    rows = thinned(np.flatnonzero(deviation.judged), ROWS)
    way, chord = chords(course, deviation.arc[rows])
    straight = rows[way - chord < STRAIGHT]
    return float(np.quantile(deviation.distance[straight], MOST)) if len(straight) >= LEAST_ROWS else 0.0


def _offset_or_older(course: ProgramCourse, followed: FollowedLog, deviation: PathDeviation) -> Finding | None:
    """A constant offset, or stops that are not those of the text; None of a log that has neither."""
    rows = thinned(np.flatnonzero(deviation.judged), ROWS)
    if len(rows) < 20:
        return None
    of_log = deviation.row[rows]
    offset = constant_offset(course, followed.projection.way[of_log], followed.projection.off[of_log])
    size = 0.0 if offset is None else float(np.linalg.norm(offset.vector))
    if offset is not None and offset.explained > CONSTANT and size > LEAST_OFFSET:
        words = offset_words(offset, course)
        if size > REFUSED_OFFSET:
            source = followed.log.table.source
            raise InputError(f"{source}: its positions lie at {words}; log with the program's own, or give --frames")
        return Finding.of(Code.EXECUTED_OFFSET, f"{100 * offset.explained:.0f} % of the deviation is {words}")
    stops, away = _rests(course, followed, deviation)
    if not len(away) or (
        np.median(away) <= STOPPED_OFF + 3 * deviation.noise and away.max() <= LEAST_OFFSET + 3 * deviation.noise
    ):
        return None
    cause, standing = "No controller smooths there: it had another frame or tool, or an older correction ran", "stood"
    ends = np.isin(stops, course.arc[[0, -1]])
    if ends.sum() == 2 and away[ends].max() <= STOPPED_OFF + 3 * deviation.noise:
        stops, away, standing = stops[~ends], away[~ends], "should have stood"
        cause = "Where it began and ended it was right: the log lags (log without a filter), or an older correction ran"
    where = course.point_name(float(stops[int(np.argmax(away))]))
    return Finding.of(
        Code.EXECUTED_OLDER,
        f"where the robot {standing} it was {np.median(away) / UM:.0f} um off the program (up to "
        f"{away.max() / UM:.0f} at {where}). {cause}: give that with --also",
    )


def _rests(course: ProgramCourse, followed: FollowedLog, deviation: PathDeviation) -> tuple[Array, Array]:
    """Stops that the robot came to rest near, (S,) [m] along the course, and how near it came to them there, (S,) [m].

    Beside a line and ahead on it alike: a line that goes on hides what a stop shows.
    """
    resting = deviation.judged & (deviation.speed < RESTING * max(float(np.median(deviation.speed)), 1e-4))
    stops, arc = course.arc[course.stop], deviation.arc[resting]
    nearest = nearest_rows(stops, arc)
    beside = np.abs(arc - stops[nearest]) <= CLAMP
    place, away = followed.position[deviation.row[resting]], np.full(len(stops), np.inf)
    np.minimum.at(away, nearest[beside], norm(place - course.place(stops)[nearest])[beside])
    return stops[np.isfinite(away)], away[np.isfinite(away)]


def _of_extent(course: ProgramCourse, deviation: PathDeviation) -> Iterator[Finding]:
    first, last = float(deviation.arc.min()), float(deviation.arc.max())
    share = course.share(first, last)
    if share < WHOLE:
        ends = ((course.point_name(s), 100 * course.share(course.elsewhere[0], s)) for s in (first, last))
        begin, end = (f"{name} ({percent:.1f} %)" for name, percent in ends)
        message = f"the log has {100 * share:.1f} % of the path, from {begin} to {end}; the rest is not judged"
        yield Finding.of(Code.EXECUTED_PART, message + course.places_hint)


def _of_override(clock: ClockFit, *, counted: bool) -> Iterator[Finding]:
    if not clock.stretches:
        message = "no steady motion in the log is long enough: override and time are not known; log a longer run"
        yield Finding.of(Code.EXECUTED_NO_CLOCK, message)
        return
    if clock.rounded != counted:
        rounds, explain, other = (
            ("rounds", "that explains", "the written speeds do")
            if clock.rounded
            else ("does not round", "the written speeds explain", "whole periods do")
        )
        yield Finding.of(
            Code.EXECUTED_PERIODS,
            f"the controller {rounds} the time of each line up to whole interpolation periods: {explain} the logged "
            f"speeds, {other} not; set controller.rounds_up_to_period = {str(clock.rounded).lower()} in the robot file",
        )
    first, *later = clock.stretches
    fastest = max(s.rate for s in clock.stretches)
    if fastest > FASTEST:
        yield Finding.of(
            Code.EXECUTED_ANOTHER,
            f"the robot drove at {100 * fastest:.0f} % of the written speeds, and no override is above 100 %: another "
            "program ran along the same way, or the log's clock is slow; give the program that ran",
        )
    if later:
        turns = [f"{s.words} from {s.begin:.2f} s" for s in later]
        message = f"the override changed during the run: {first.words} at first, {_named(turns, 'changes')}"
        yield Finding.of(Code.EXECUTED_OVERRIDE_CHANGED, message)
    elif first.override != 1:
        yield Finding.of(Code.EXECUTED_OVERRIDE, f"the program ran at {first.words} override; its speeds are for 100 %")


def _named(items: list[str], what: str) -> str:
    """The first of some items by name, and how many more there are."""
    more = len(items) - NAMED
    return ", ".join(items[:NAMED]) + (f" and {more} {what} more" if more > 0 else "")


def _steady(deviation: PathDeviation, clock: ClockFit) -> tuple[float, float] | None:
    rows = np.flatnonzero(np.isfinite(clock.late))
    return (float(deviation.time[rows[0]]), float(deviation.time[rows[-1]])) if len(rows) else None


def _of_time(deviation: PathDeviation, clock: ClockFit) -> Iterator[Finding]:
    steady = _steady(deviation, clock)
    if not clock.stretches or clock.expected <= 0 or steady is None:
        return
    off = clock.took / clock.expected - 1
    if abs(off) > TIME_BOUND:
        rate = max(abs(s.rate / s.override - 1) for s in clock.stretches)
        reason = (
            "away from stops and corners it kept its speeds: stops and corners take another time than planned"
            if rate <= TIME_BOUND
            else f"away from stops it drove {'slower' if off > 0 else 'faster'} than planned, or the log's clock is off"
        )
        span = f"from {steady[0]:.2f} to {steady[1]:.2f} s of the log, where it drove steadily,"
        took = f"{clock.took:.2f} s, planned were {clock.expected:.2f} s ({100 * off:+.2f} %)"
        yield Finding.of(Code.EXECUTED_TIME, f"{span} the run took {took}; {reason}")


def _of_stands(course: ProgramCourse, clock: ClockFit) -> Iterator[Finding]:
    held, waited = (_stood(course, clock, at_stop=at_stop) for at_stop in (False, True))
    if held:
        yield Finding(Level.WARNING, Code.EXECUTED_HELD, f"the robot stood where the program does not stop: {held}")
    if waited:
        yield Finding.of(Code.EXECUTED_WAITED, f"the robot stood at the program's stops: {waited}")


def _stood(course: ProgramCourse, clock: ClockFit, *, at_stop: bool) -> str:
    """How long and where the robot stood, at stops of the program or elsewhere; empty where it did not."""
    stands = [s for s in clock.stands if s.at_stop is at_stop and s.stood > SHORTEST_STAND]
    beside = "at" if at_stop else "near"
    places = [f"{s.stood:.2f} s {beside} {course.point_name(s.arc)}" for s in stands]
    return _named(places, "times") if places else ""


def _of_bound(course: ProgramCourse, deviation: PathDeviation, bound: float | None) -> Iterator[Finding]:
    if not deviation.extents:
        message = "no row lies on a line or an arc that the program drives for certain: nothing is judged"
        yield Finding.of(Code.EXECUTED_NOTHING, message)
    elif bound is not None and (total := deviation.extents["total"]).max > bound:
        size = beyond_text(total.max / UM, bound / UM, 1)
        yield Finding.of(
            Code.EXECUTED_MAX,
            f"{size} um off the path near {course.point_name(total.where)}, {total.where:.3f} m from its start: more "
            f"than --max-um {bound / UM:g}; 99 % of the rows below {total.p99 / UM:.1f}, rms {total.rms / UM:.1f} um",
        )


def _of_log(followed: FollowedLog, deviation: PathDeviation) -> Iterator[Finding]:
    step = np.diff(followed.time)
    missing = step > 2.5 * followed.log.period
    gaps = counted(followed.log.gaps, "row has", "rows have")
    if missing.any() or followed.log.gaps:
        yield Finding.of(
            Code.EXECUTED_GAPS,
            f"rows are missing at {counted(int(missing.sum()), 'place', 'places')} of the log, for "
            f"{step.max() / MS:.0f} ms at most{f', and {gaps} no position' * bool(followed.log.gaps)}: what happened "
            "there is not seen",
        )
    if deviation.away:
        away = counted(deviation.away, "row", "rows")
        yield Finding.of(
            Code.EXECUTED_AWAY, f"{away} between the first and the last, over 20 mm off the path, not judged"
        )
    unjudged = 1 - float(np.mean(deviation.judged))
    if unjudged > 0.01:
        message = f"{100 * unjudged:.0f} % of the rows are not judged: there the joints move, or the way is not certain"
        yield Finding.of(Code.EXECUTED_UNJUDGED, message)
    yield Finding.of(
        Code.EXECUTED_NOT_THE_TOOL,
        "the log has positions as the controller believes them. Heat, wrong lengths of the arm, compliance (how far it "
        "gives under load) and play are not in them: only measuring tells where the tool was",
    )
