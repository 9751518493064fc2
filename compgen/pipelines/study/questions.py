"""The questions people ask of a path's warmth: each answered by one sentence, a curve and its numbers.

All of them look at the uncorrected text executed by the controller (its joints and times) and ask what other rises
would do to the tool: a file that is right for one state is off, in another, by the difference of their displacements.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations
from pathlib import Path

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import CompgenError, InputError
from compgen.core.units import HOUR, MINUTE, MM, UM
from compgen.error_model.sources.thermal_growth import ThermalGrowth
from compgen.job.job import Job
from compgen.job.start_window import late_rise
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.study.geometry import displacement, execute_with, plan_geometry, rows_on_part, some_samples
from compgen.thermal import Duty, rise_history, rises_during, state_after

MOST_PASSES = 6


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Answer:
    """A sentence, and the table behind it: one column of x, others of y."""

    key: str
    sentence: str
    columns: tuple[str, ...]  # names with units; the first is the abscissa
    table: Array  # (R, C)
    labels: tuple[str, ...] = ()  # of rows, where they are no numbers
    limit: float | None = None  # [m] that the question is about; None where it is about none


def warmup(job: Job, limit: float) -> Answer:
    """How long to warm up until the drift within one program stays below a limit [m].

    The drift is how far the error at a sample moves between the program's start and its end, as a file made for the
    state at the start would see it.
    """
    geometry, moving, before = plan_geometry(job), _moving(job), job.history.before
    given = before[: job.history.given]
    last = max((n for n, duty in enumerate(given) if duty.state == "moving"), default=len(given))
    steps = [step for step in job.inputs["path"]["before"] if step["state"] == "moving"]
    if last < len(given) and steps and (steps[-1]["dwell_s"] or steps[-1]["shifts"]):  # a state stands in their place
        runs, shifts = "runs with dwells have no one length; say them", "a stretch in shifts has no one length; say it"
        raise InputError(f"{job.source}: before: {runs if steps[-1]['dwell_s'] else shifts} as duration_h with a duty")

    def drift(duration: float) -> float:
        duties = (*before[:last], replace(moving, duration=duration), *before[last + 1 :])
        rises = rises_during(
            job.heat,
            state_after(job.heat, duties, air=job.history.air),
            geometry.motion,
            job.history.air,
            sum(duty.duration for duty in duties),
        ).rise
        return _largest(displacement(job, geometry, rises[-1]) - displacement(job, geometry, rises[0]))

    hours = np.concatenate([np.linspace(0, 4, 17), np.arange(5.0, 49.0)])
    table = np.array([[h, drift(h * HOUR) / UM] for h in hours])
    needed = first_below(lambda h: drift(h * HOUR), hours, table[:, 1] * UM, limit)
    below = hours[table[:, 1] * UM <= limit]
    begin, drifts = _warm_up_words(needed, below, float(hours[-1]))
    sentence = f"{begin} at {_pace(moving)}{drifts.format(f'{limit / UM:g} um')}"
    return Answer(key="warmup", sentence=sentence, columns=("warmup_h", "drift_um"), table=table, limit=limit)


def _warm_up_words(needed: float | None, below: Array, longest: float) -> tuple[str, str]:
    """What comes before and behind the pace: of hours from which on it is enough, or of those that are for a while."""
    if needed is None and not len(below):
        return f"no warm-up up to {longest:g} h", " keeps the drift within one program below {}"
    hours = float(below[0]) if needed is None else needed
    begin = f"warm up {hours:.2f} h" if hours else "no warm-up is needed"
    if needed is None:
        rest = f": drift within one program is then below {{}}, but not after every longer one up to {longest:g} h"
    else:
        rest = f": drift within one program {'then stays' if needed else 'stays'} below {{}}"
    return begin, rest


def validity(job: Job, limit: float) -> Answer:
    """How long one corrected file is valid: residual that a late start or another ambient adds."""
    if job.ensemble is not None:
        raise InputError(
            f"{job.source}: compensation.average_over: a file for many starts is valid for no one start; leave it out "
            "for this question, or see what cgen generate says of its starts"
        )
    thin = plan_geometry(job).thinned(400)
    rise = thin.rises(job)
    base = displacement(job, thin, rise)

    def late(delay: float) -> float:
        later = late_rise(job, delay, thin.now, job.state(), job.history.clock)
        return _largest(displacement(job, thin, rise + later) - base)

    def warmer(kelvin: float) -> float:
        air = replace(job.history.air, rise=job.history.air.rise + kelvin)
        warmed = replace(job, history=replace(job.history, air=air))
        return _largest(displacement(job, thin, thin.rises(warmed)) - base)

    minutes = np.concatenate([np.arange(0.0, 60.0, 5.0), np.arange(60.0, 961.0, 20.0)])
    delays = np.array([late(m * MINUTE) for m in minutes])
    valid = first_above(lambda m: late(m * MINUTE), minutes, delays, limit)
    kelvins = np.linspace(-5, 5, 21)
    offs = np.array([warmer(k) for k in kelvins])
    above = warmer(1.0)
    span = limit / above if above > 0 else np.inf  # the models are linear in the air, the error nearly so
    when = f"up to {int(valid)} min late" if valid is not None else f"even {minutes[-1] * MINUTE / HOUR:g} h late"
    air = f"an ambient within +-{span:.2f} K of the planned" if span < np.inf else "any ambient"
    sentence = f"one corrected file errs at most {limit / UM:g} um more for a start {when}, or {air}; regenerate beyond"
    rows = [[m, off / UM, np.nan, np.nan] for m, off in zip(minutes, delays, strict=True)]
    rows += [[np.nan, np.nan, k, off / UM] for k, off in zip(kelvins, offs, strict=True)]
    return Answer(
        key="validity",
        sentence=sentence,
        columns=("delay_min", "late_um", "ambient_K", "ambient_um"),
        table=np.array(rows),
        limit=limit,
    )


def contributions(job: Job, limit: float) -> Answer:
    """Which node, which length, and what the arm errs cold, contributes how much to the largest error on the part."""
    everywhere = plan_geometry(job)
    touching = rows_on_part(everywhere)
    geometry, rise = everywhere.at(touching), execute_with(job, everywhere).rise[touching]
    whole = displacement(job, geometry, rise)
    worst = int(np.argmax(np.linalg.norm(whole, axis=1)))
    toward = whole[worst] / max(float(np.linalg.norm(whole[worst])), 1e-30)
    cold = displacement(job, geometry, np.zeros_like(rise))
    labels, rows = [], []
    for k, name in enumerate(job.heat.names):
        alone = np.zeros_like(rise)
        alone[:, k] = rise[:, k]
        moved = displacement(job, geometry, alone) - cold
        labels.append(f"node {name}")
        rows.append([float(moved[worst] @ toward) / UM, _largest(moved) / UM])
    for profile in job.cell.profiles:
        held = tuple(s.without(profile.length) if isinstance(s, ThermalGrowth) else s for s in job.sources)
        moved = whole - displacement(replace(job, cell=replace(job.cell, sources=held)), geometry, rise)
        labels.append(f"length {profile.length}")
        rows.append([float(moved[worst] @ toward) / UM, _largest(moved) / UM])
    if _largest(cold) >= 0.005 * UM:
        labels.append("cold arm")
        rows.append([float(cold[worst] @ toward) / UM, _largest(cold) / UM])
    table = np.array([[float(n), *row] for n, row in enumerate(rows)])
    total = float(np.linalg.norm(whole[worst])) / UM
    order = [
        k for k in np.argsort(-np.abs(table[:, 1]), kind="stable") if abs(table[k, 1]) >= max(0.005 * total, 0.005)
    ]
    nodes = [f"{labels[k][5:]} {table[k, 1]:.1f}" for k in order if labels[k].startswith("node")]
    lengths = [f"{labels[k][7:]} {table[k, 1]:.1f}" for k in order if labels[k].startswith("length")]
    warmth = f", comes from {', '.join(nodes)} um; by lengths {', '.join(lengths)} um" if nodes else ""
    rest = f"; the cold arm errs {rows[-1][0]:.1f} um of it" if labels[-1:] == ["cold arm"] else ""
    sentence = f"the largest error on the part, {total:.1f} um{warmth}{rest}"
    return Answer(
        key="contributions",
        sentence=sentence,
        columns=("row", "of_largest_um", "own_largest_um"),
        table=table,
        labels=tuple(labels),
    )


def steady(job: Job, limit: float) -> Answer:
    """When a steady duty's error on the part stops changing: within a limit [m] of its end, and 95 % of it."""
    geometry, moving = plan_geometry(job), _moving(job)
    thin = geometry.at(some_samples(geometry))
    hours = np.concatenate([np.linspace(0, 12, 49), np.linspace(13, 96, 84)])
    air = replace(job.history.air, amplitude=0.0)  # what a wave adds never settles
    rises = rise_history(job.heat, [replace(moving, duration=1e9)], np.append(hours, 2000.0) * HOUR, air=air)
    final = displacement(job, thin, rises[-1])
    errors = np.array([_largest(displacement(job, thin, r)) for r in rises[:-1]])
    gaps = np.array([_largest(displacement(job, thin, r) - final) for r in rises[:-1]])
    end = _largest(final)
    near, most = (when_settled(hours, gaps, g) for g in (limit, 0.05 * end))
    within = f"within {limit / UM:g} um of the final {end / UM:.1f} um on the part {near}"
    sentence = f"steady {most} at {_pace(moving)} (95 %); {within}"
    table = np.column_stack([hours, errors / UM, gaps / UM])
    return Answer(key="steady", sentence=sentence, columns=("hours", "error_um", "to_go_um"), table=table, limit=limit)


@dataclass(frozen=True, slots=True)
class Candidate:
    """Passes in one order at one feed."""

    names: tuple[str, ...]
    feed: float  # [m/s]
    worst: float  # [m] largest error without correction
    time: float  # [s]


def _orders_at(jobs: list[Job], feed: float) -> Iterator[Candidate]:
    """Passes at a feed in each order, one warming the robot for the next."""
    laid = [plan_geometry(job) for job in jobs]
    some = [geometry.at(some_samples(geometry)) for geometry in laid]
    heat, history = jobs[0].heat, jobs[0].history
    for order in permutations(range(len(jobs))):
        state, worst, spent = history.state(heat), 0.0, 0.0
        for n in order:
            motion = laid[n].motion
            rises, end = rises_during(heat, state, motion, history.air, history.clock + spent)
            at = np.array([np.interp(some[n].now, motion.time, c) for c in rises.T]).T
            worst = max(worst, _largest(displacement(jobs[n], some[n], at)))
            state, spent = end, spent + float(motion.time[-1])
        yield Candidate(tuple(jobs[n].name for n in order), feed, worst, spent)


def passes(jobs: list[Job], feeds: list[float], plan: Callable[[Job, float], Job], limit: float) -> Answer:
    """The best order and feed of passes: the quickest whose error stays within a limit [m], else the smallest error.

    Args:
        jobs: One for each pass; the first one's ``before`` comes before all.
        feeds: To choose from, one for all passes [m/s].
        plan: A pass at a feed.
        limit: Of the uncorrected error.
    """
    if len(jobs) > MOST_PASSES:
        raise InputError(f"--pass: {len(jobs)} passes have too many orders; give at most {MOST_PASSES}")
    candidates = [candidate for feed in feeds for candidate in _orders_at([plan(job, feed) for job in jobs], feed)]
    inside = [c for c in candidates if c.worst <= limit]
    if inside:
        best = min(inside, key=lambda c: (c.time, c.worst))
        kept = f"(stays within {limit / UM:g} um)"
    else:
        best = min(candidates, key=lambda c: (c.worst, c.time))
        kept = f"is the least (no order and feed keeps {limit / UM:g} um)"
    sentence = (
        f"{' then '.join(best.names)} at {best.feed / MM:g} mm/s: {best.time / MINUTE:.1f} min, largest error "
        f"{best.worst / UM:.1f} um {kept}"
    )
    labels = tuple(" > ".join(c.names) for c in candidates)
    table = np.array([[c.feed / MM, c.time / MINUTE, c.worst / UM] for c in candidates])
    return Answer(
        key="passes",
        sentence=sentence,
        columns=("feed_mm_s", "minutes", "error_um"),
        table=table,
        labels=labels,
        limit=limit,
    )


ASKS: dict[str, Callable[[Job, float], Answer]] = {
    "warmup": warmup,
    "validity": validity,
    "contributions": contributions,
    "steady": steady,
}
QUESTIONS = (*ASKS, "passes")


def check_study(questions: Sequence[str], within_um: float, *, varied: bool) -> None:
    """Raises InputError for a study of nothing, an unknown question, or a limit [um] that is none."""
    for question in questions:
        if question not in QUESTIONS:
            raise InputError(f"--ask {question}: unknown; known: {', '.join(QUESTIONS)}")
    if not 0 < within_um < 1e6:
        raise InputError(f"--within-um {within_um:g}: must be above 0; give micrometres")
    if not (questions or varied):
        raise InputError("nothing to study; give --vary KEY=V1,V2, --list FILE.csv or --ask QUESTION")


def base_job(path: str, robot: str | None, overrides: Sequence[str]) -> Job | None:
    """The job that all scenarios share; None where only scenarios can be read."""
    try:
        return load_job(path, robot, overrides)
    except CompgenError:
        return None


def answer_questions(
    path: str,
    robot: str | None,
    overrides: Sequence[str],
    questions: Sequence[str],
    limit: float,
    pass_paths: Sequence[str],
    feeds: str | None,
) -> list[Answer]:
    """The answer to each question, asked once.

    Args:
        path: The path file in question.
        robot: Robot name or file; None for what the path file says.
        overrides: ``key=value`` for the path in question.
        questions: Their names.
        limit: The X of the questions [m].
        pass_paths: Path files of the passes; the path in question when empty.
        feeds: Feeds for the passes, as typed [mm/s].
    """
    if (pass_paths or feeds) and "passes" not in questions:
        raise InputError("--pass, --feeds: they are of the question passes; give --ask passes, or leave them out")
    answers = []
    for question in dict.fromkeys(questions):
        if question == "passes":
            answers.append(_answer_passes(path, robot, overrides, limit, pass_paths or [path], feeds))
        else:
            answers.append(ASKS[question](load_job(path, robot, overrides), limit))
    return answers


def _answer_passes(
    path: str, robot: str | None, overrides: Sequence[str], limit: float, pass_paths: Sequence[str], feeds: str | None
) -> Answer:
    everywhere = [change for change in overrides if change.startswith("robot.")]
    own = Path(path).resolve()
    if len(everywhere) < len(overrides) and own not in [Path(file).resolve() for file in pass_paths]:
        key = next(change for change in overrides if change not in everywhere)
        raise InputError(f"--set {key:.80}: it is of {path}, which is no --pass; give it as one, or leave this out")

    def overrides_of(file: str) -> Sequence[str]:
        return overrides if Path(file).resolve() == own else everywhere

    def at_feed(job: Job, feed: float) -> Job:
        file = files[job.source]
        return load_job(file, robot, [*overrides_of(file), f"process.feed_mm_s={feed / MM!r}"])

    jobs = [load_job(file, robot, overrides_of(file)) for file in pass_paths]
    if other := next((job for job in jobs if job.inputs["robot"] != jobs[0].inputs["robot"]), None):
        raise InputError(f"--pass: {jobs[0].source} and {other.source} have two robots; name the one with --robot")
    files = {job.source: file for job, file in zip(jobs, pass_paths, strict=True)}
    try:
        speeds = [float(feed) * MM for feed in feeds.split(",")] if feeds else []
    except ValueError:
        raise InputError(f"--feeds {feeds}: not numbers; give mm/s as in 20,100,200") from None
    return passes(jobs, speeds or [jobs[0].feed * share for share in (0.25, 0.5, 1)], at_feed, limit)


def _moving(job: Job) -> Duty:
    """The last stretch of motion before the program; without one the program itself, at its own feed."""
    moving = [d for d in job.history.before[: job.history.given] if d.state == "moving"]
    if moving:
        return moving[-1]
    if job.history.standing.loss:
        raise InputError(f"{job.source}: before: no motion to ask about; give a [[before]] with state = 'moving'")
    return Duty("moving", job.feed, HOUR)


def _pace(moving: Duty) -> str:
    share = f" with a duty of {100 * moving.share:g} %" if moving.share != 1 else ""
    return f"{moving.feed / MM:g} mm/s{share}"


def when_settled(hours: Array, gaps: Array, limit: float) -> str:
    """When a gap is below a limit and stays there, in words."""
    over = np.flatnonzero(gaps > limit)
    first = int(over[-1]) + 1 if len(over) else 0
    return f"after {hours[first]:.1f} h" if first < len(hours) else f"after more than {hours[-1]:g} h"


def _largest(vectors: Array) -> float:
    return float(np.linalg.norm(vectors, axis=1).max())


def first_below(f: Callable[[float], float], x: Array, y: Array, limit: float) -> float | None:
    """Where a curve falls below a limit and stays there; None where it ends above it."""
    over = np.flatnonzero(y > limit)
    if not len(over):
        return float(x[0])
    k = int(over[-1])
    return None if k == len(x) - 1 else _last_inside(f, float(x[k + 1]), float(x[k]), limit)


def first_above(f: Callable[[float], float], x: Array, y: Array, limit: float) -> float | None:
    """Where a curve that begins below a limit first crosses it; None where it never does."""
    over = np.flatnonzero(y > limit)
    if not len(over):
        return None
    k = int(over[0])
    return float(x[0]) if k == 0 else _last_inside(f, float(x[k - 1]), float(x[k]), limit)


def _last_inside(f: Callable[[float], float], inside: float, outside: float, limit: float) -> float:
    """Where a curve crosses a limit, by bisection from a place where it is inside to one where it is not."""
    for _ in range(30):
        middle = (inside + outside) / 2
        inside, outside = (inside, middle) if f(middle) > limit else (middle, outside)
    return inside
