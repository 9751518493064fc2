r"""One file for many starts: what it is made for, and what the twin finds that it leaves at each of them.

The error is linear in the rises, e_s(c) = e(c) + B (rise_s - mean rise), B the same for every correction c. Over the
starts s the expected square is therefore

    E |e_s(c)|^2 = |e(c)|^2 + tr(B Cov(rise) B^T)

whose second term no correction changes: the best file for all starts is the file for the mean of their rises, and what
stays beyond that file's own residual is how far each start's rises lie from the mean. The written text is flown by the
twin with its own heat at every corner of the ensemble, in its middle, and where the error model foretells the most.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from compgen.compensation import optimise
from compgen.compensation.problem import Problem
from compgen.core.arrays import Array, IntArray, owns
from compgen.core.dates import DEFAULT_DATE
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.units import UM
from compgen.job.job import Job
from compgen.pipelines.files.twin_of_job import at_start, deviation_of, prepared_for
from compgen.pipelines.planned.program_text import compose_program
from compgen.pipelines.uncertainty.band_columns import WaypointProgram
from compgen.planning.retiming import Trajectory
from compgen.planning.toolpath import ToolPath
from compgen.program.digits import as_written
from compgen.thermal import JointMotion, rises_during
from compgen.thermal.ensemble import (
    Ensemble,
    Start,
    mean_rises,
    rises_at,
    rises_of,
    starts_to_fly,
    weighted_starts,
)
from compgen.verification.deviation import Deviation, Extent
from compgen.verification.twin import PreparedProgram

WAYPOINTS = 200  # that the error model foretells the starts at
WIDE = 2.0  # times better from which files for each start are worth a warning
APART = 0.1  # of the spread, by which twin and error model may differ
SAME = 0.1 * UM  # below which they agree


@dataclass(frozen=True, slots=True)
class FlownStart:
    """What the twin found at one start, on the part."""

    start: Start
    total: Extent
    remade: Extent | None  # of the file made anew for this start alone; None: no legal correction


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(largest=("G",), added=("G",))
class Averaged:
    """What one file leaves over its starts."""

    ensemble: Ensemble
    at_mean: Extent  # flown with the mean of the rises, on the part
    worst: Deviation  # of the flown start with the largest error; its extents are the largest of all that were flown
    flown: tuple[FlownStart, ...]
    starts: tuple[Start, ...]  # G that the error model foretells
    largest: Array  # (G,) [m] foretold largest error on the part
    added: Array  # (G,) [m] how far the tool is at most from where it is at the mean
    rms: float  # [m] over all starts and the path: root of the sum of the squares of what stays at the mean and
    spread: float  # [m] how far the starts lie from their mean, rms over them and the path
    disagreement: float  # [m] rms of what the twin flew and what the model foretold, at the flown starts
    files: int  # that would keep each start within ``tolerance`` of a file's own
    tolerance: float  # [m]

    @property
    def worst_flown(self) -> FlownStart:
        """The start with the largest error."""
        return max(self.flown, key=lambda f: f.total.max)

    @property
    def remade(self) -> float | None:
        """Largest error with a file made anew for each start that was flown [m]; None: for one there is none."""
        each = [f.remade for f in self.flown]
        return max((one.max for one in each if one is not None), default=None) if None not in each else None

    @property
    def times(self) -> float | None:
        """How many times smaller the largest error is with a file made anew for each start."""
        return self.worst_flown.total.max / self.remade if self.remade else None


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class WrittenFile:
    """One file, as far as its starts ask for it."""

    program: WaypointProgram  # with the mean of the rises, and where the planned joints come from
    motion: JointMotion  # as planned
    prepared: PreparedProgram  # the text, read back
    problem: Problem  # of its correction
    trajectory: Trajectory  # for the speeds


def planned_rises(job: Job, motion: JointMotion) -> Array:
    """Rises that a job's correction is made for: those of its one start, or the mean over all, (N, K) [K]."""
    if job.ensemble is None:
        return rises_during(job.heat, job.state(), motion, job.history.air, job.history.clock).rise
    return mean_rises(job.heat, job.history, job.ensemble, motion)


def fly_starts(file: WrittenFile, progress: Callable[[float], None] = lambda share: None) -> Averaged:
    """Fly a written file at its starts, and the files made anew for each of them.

    Args:
        file: Its text was made for the mean of the rises.
        progress: Called with the share done.

    Raises:
        TwinError: The twin cannot fly a text.
    """
    job, path, prepared = file.program.job, file.program.path, file.prepared
    ensemble = job.ensemble or Ensemble()
    at_mean = deviation_of(path, prepared.with_rise(file.program.rise))
    starts, weight = weighted_starts(ensemble)
    which = _some_waypoints(path)
    moved = _displacements(file, starts, which)
    waypoints = prepared.first_samples()[which]
    left = at_mean.error[waypoints]
    largest = largest_after_each(file, at_mean, moved, waypoints)
    flown: list[FlownStart] = []
    worst, envelope, differences = at_mean, at_mean, []
    chosen = starts_to_fly(ensemble, starts[int(np.argmax(largest))])
    for k, start in enumerate(chosen):
        deviation = deviation_of(path, at_start(job, prepared, start))
        foretold = left + _displacements(file, [start], which)[0]
        differences.append(deviation.error[waypoints] - foretold)
        if not flown or deviation.on_part["total"].max > worst.on_part["total"].max:
            worst = deviation
        envelope = deviation if not flown else _envelope(envelope, deviation)
        flown.append(FlownStart(start, deviation.on_part["total"], _remade(file, start)))
        progress((k + 1) / len(chosen))
    worst = replace(worst, extents=envelope.extents, on_part=envelope.on_part)
    spread = float(np.sqrt(weight @ (moved**2).sum(axis=2).mean(axis=1)))
    return Averaged(
        ensemble=ensemble,
        at_mean=at_mean.on_part["total"],
        worst=worst,
        flown=tuple(flown),
        starts=tuple(starts),
        largest=largest,
        added=np.linalg.norm(moved, axis=2).max(axis=1),
        rms=float(np.hypot(at_mean.on_part["total"].rms, spread)),
        spread=spread,
        disagreement=float(np.sqrt((np.array(differences) ** 2).sum(axis=2).mean())),
        files=_files_needed(moved, job.start_drift),
        tolerance=job.start_drift,
    )


def _remade(file: WrittenFile, start: Start) -> Extent | None:
    """What a file made anew for one start leaves at it; None: no legal correction."""
    job, path, problem = file.program.job, file.program.path, file.problem
    rise = rises_of(job.heat, job.history, start, file.motion)
    solution = optimise.optimise(replace(problem, rise=rise), job.settings)
    if not solution.status.is_legal:
        return None
    commanded, trajectory = problem.commanded(solution.correction), file.trajectory
    program, printed = compose_program(job, commanded, solution.theta, trajectory, path, DEFAULT_DATE, None)
    prepared = prepared_for(job, as_written(program, printed))
    return deviation_of(path, at_start(job, prepared, start)).on_part["total"]


def _some_waypoints(path: ToolPath) -> IntArray:
    """On the part, evenly."""
    rows = path.rows_on_part()
    return np.asarray(rows[np.unique(np.linspace(0, len(rows) - 1, WAYPOINTS).astype(int))])


def _displacements(file: WrittenFile, starts: list[Start], which: IntArray) -> Array:
    """How far the tool is from where it is at the mean, (G, P, 3) [m], by the error model."""
    program, job = file.program, file.program.job
    theta, directions = program.theta[which], program.motion.at(which)
    now = program.model.actual_pose(theta, program.rise[which], directions).position
    rises = rises_at(job.heat, job.history, starts, file.motion, which)
    return np.asarray([program.model.actual_pose(theta, rise, directions).position - now for rise in rises])


def largest_after_each(file: WrittenFile, at_mean: Deviation, moved: Array, waypoints: IntArray) -> Array:
    """Largest error after each start, (G,) [m].

    Between two of the waypoints (samples (P,)) the displacement is a straight line; what stays at the mean is not:
    there the samples count that lie farthest to either side along World.
    """
    path = file.program.path
    off_part = ~file.prepared.touching_samples(path.touching_segments())
    error = np.where(off_part[:, None], 0.0, at_mean.error)
    largest = np.zeros(len(moved))
    for j, (a, b) in enumerate(zip(waypoints.tolist(), waypoints[1:].tolist(), strict=False)):
        rows = a + np.unique(np.concatenate([error[a : b + 1].argmin(axis=0), error[a : b + 1].argmax(axis=0)]))
        rows = rows[~off_part[rows]]
        share = ((at_mean.arc[rows] - at_mean.arc[a]) / (at_mean.arc[b] - at_mean.arc[a]))[:, None]
        between = moved[:, j, None] * (1 - share) + moved[:, j + 1, None] * share
        largest = np.maximum(largest, np.linalg.norm(error[rows] + between, axis=2).max(axis=1, initial=0.0))
    return largest


def _envelope(one: Deviation, other: Deviation) -> Deviation:
    """The larger of each statistic."""

    def larger(a: dict[str, Extent], b: dict[str, Extent]) -> dict[str, Extent]:
        return {
            name: Extent(
                max(a[name].max, b[name].max), max(a[name].p99, b[name].p99), max(a[name].rms, b[name].rms),
                a[name].where if a[name].max >= b[name].max else b[name].where,
            )
            for name in a
        }  # fmt: skip

    return replace(one, extents=larger(one.extents, other.extents), on_part=larger(one.on_part, other.on_part))


def _files_needed(moved: Array, tolerance: float) -> int:
    """How many files keep every start within a tolerance of one of them.

    Each is the one that takes in the first start that is left, and as many others as any does: along delays alone
    these are as few as can be.
    """
    G = len(moved)
    near = np.array([np.linalg.norm(moved - one, axis=2).max(axis=1) <= tolerance for one in moved])
    waiting, count = np.ones(G, dtype=bool), 0
    while waiting.any():
        first = int(np.argmax(waiting))
        waiting &= ~near[int(np.argmax(near[first] * (near & waiting).sum(axis=1)))]
        count += 1
    return count


def averaging_findings(averaged: Averaged) -> Iterator[Finding]:
    """The spread over the starts, whether several files would be much better, and whether the twin saw the same."""
    worst = averaged.worst_flown
    over = f"{averaged.rms / UM:.2f} rms and {worst.total.max / UM:.2f}"
    yield spread_finding(averaged.ensemble, averaged.at_mean.max, over, worst.start)
    remade = averaged.remade
    if remade and worst.total.max / remade >= WIDE and averaged.added.max() > averaged.tolerance:
        yield Finding.of(
            Code.AVERAGE_WIDE,
            f"a file re-made for each start would be {worst.total.max / remade:.1f} times better: {remade / UM:.2f} um "
            f"instead of {worst.total.max / UM:.2f}; {averaged.files} files keep each start within "
            f"{averaged.tolerance / UM:g} um of its own (compensation.start_drift_um)",
        )
    if averaged.disagreement > max(APART * averaged.spread, SAME):
        yield Finding.of(
            Code.AVERAGE_MODEL,
            f"over the starts the twin differs from the error model by {averaged.disagreement / UM:.2f} um rms, the "
            f"starts from their mean by {averaged.spread / UM:.2f}: trust what was flown, not what lies between",
        )


def spread_finding(ensemble: Ensemble, at_mean: float, over: str, worst: Start) -> Finding:
    """What one file leaves over its starts: at most with the mean of the rises [m], and in words ``over`` them [um]."""
    return Finding.of(
        Code.AVERAGE_SPREAD,
        f"one file for {ensemble_words(ensemble)}: at most {at_mean / UM:.2f} um with the mean of the rises, {over} "
        f"at most over the starts ({start_words(worst)})",
    )


def ensemble_words(ensemble: Ensemble) -> str:
    """The starts in words."""
    low, high = ensemble.delay
    words = [f"starts {low:g} to {high:g} s late"] if high > low else []
    if not words and high > 0:
        words = [f"a start {high:g} s late"]
    first, last = (run + 1 for run in ensemble.runs)
    words += [f"runs {first} to {last}"] if last > first else [f"run {first}"] if first > 1 else []
    if ensemble.overrides != (1.0,):
        words.append(f"overrides {', '.join(f'{100 * share:.4g}' for share in ensemble.overrides)} %")
    return ", ".join(words) or "the planned start"


def start_words(start: Start) -> str:
    """One start in words."""
    late = f"{start.delay:.0f} s late" if start.delay else "at once"
    speed = f", override {100 * start.override:.4g} %" if start.override != 1 else ""
    return f"run {start.run + 1}, {late}{speed}"
