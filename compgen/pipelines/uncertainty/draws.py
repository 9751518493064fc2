r"""Draws of an arm and a day, each flown by the twin on the whole path from the text, for bounds with a probability.

A draw takes an amount of every quantity that the job does not know, and a field of what no quantity explains. The job
that they make has other sources, another warmth, other widths and another start; its twin is flown with the text that
was written for the job as its files say. None of it uses the slopes of the linear band, so the two check each other:
the band's columns times the amounts must come to what the flight adds to the error,

    rms over d and n of |e_d(n) - e(n) - sum_q a_dq c_q(n)|  <=  10 % of the band
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, BoolArray, frozen, interpolated, owns, rms, row_norms
from compgen.core.evaluation import map_blocks
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.pose import Pose
from compgen.error_model.uncertain_sources import DrawnCause, combined
from compgen.job.bounds import Guarantee
from compgen.job.job import Job
from compgen.job.uncertainty import JobUncertainty, amounts, changed_job
from compgen.pipelines.files.twin_of_job import at_start, deviation_of, twin_of
from compgen.pipelines.uncertainty.band_columns import WaypointProgram, columns_along, job_uncertainty, rows_of_band
from compgen.planning.toolpath import ToolPath
from compgen.thermal.ensemble import Ensemble, Start
from compgen.verification.band import LENGTH, Columns, directed_moment, radius_of, random_field
from compgen.verification.deviation import Deviation, Extent, deviation_from_path
from compgen.verification.twin import Execution, PreparedProgram, Twin
from compgen.verification.verdict import DrawnBound, drawn_bounds, judge_draws

CONFIRMED = 20  # samples of a draw that pinocchio repeats
FIELD_STEP = LENGTH / 8  # of the path, between which a field is a straight line
COMPARED = 4096  # waypoints at which the linear band is compared with the flights, at most
NO_BAND = 1e-12  # m: below it nothing is open
RAMPS = 0.2  # standard deviation of the logarithm of a ramp's acceleration, which nobody publishes: assumed
AGREEMENT = 0.1  # of the band, rms: how far the linear prediction of a draw may be from its flight


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(total=("D",), moved=("D",), disagreement=("D",))
class FlownDraws:
    """What D draws come to."""

    guarantee: Guarantee
    bounds: tuple[DrawnBound, ...]
    total: Array  # (D,) [m] largest error on the part
    moved: Array  # (D,) [m] how far the draw's quantities alone move the tool, rms along the part
    disagreement: Array  # (D,) rms of what the linear band predicts otherwise, over the band's
    disagrees_in: str  # the quantity in which the two differ most

    @property
    def linearity(self) -> float:
        """The disagreement of all draws, rms."""
        return rms(self.disagreement)

    def findings(self) -> list[Finding]:
        """Bounds that are not kept, and a linear band that the flights contradict."""
        findings = judge_draws(self.bounds, self.guarantee)
        if self.linearity > AGREEMENT:
            worst = int(np.argmax(self.disagreement))
            message = (
                f"the linear band predicts other errors than the twin flies, by {100 * self.linearity:.0f} % of the "
                f"band (rms; {100 * AGREEMENT:g} % are allowed; {100 * self.disagreement[worst]:.0f} % in draw "
                f"{worst + 1}), most in '{self.disagrees_in}': trust the guaranteed bounds, which are flown"
            )
            findings.append(Finding.of(Code.BAND_LINEAR, message))
        return findings


class FlownDraw(NamedTuple):
    """One draw, flown."""

    on_part: dict[str, Extent]
    moved: Array  # (M, 3) [m] by its quantities, at the places of the columns


def fly_program_draws(
    program: WaypointProgram,
    prepared: PreparedProgram,
    deviation: Deviation,
    window: float,
    progress: Callable[[float], None] = lambda share: None,
    guarantee: Guarantee | None = None,
) -> FlownDraws | None:
    """Fly as many draws as a guarantee says; None where there is none.

    Args:
        program: That was written, as it is driven.
        prepared: Its text.
        deviation: Of the text on the arm that the files describe.
        window: How late the program may start [s]; zero for a file that serves many starts, of which each draw has one.
        progress: Called with the share done.
        guarantee: Bounds, and how many draws of which seed; default the job's own.
    """
    guarantee = guarantee or program.job.bounds.guaranteed
    if guarantee is None:
        return None
    uncertainty, rows = job_uncertainty(program, window), rows_of_band(program)
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, COMPARED).astype(int))]
    columns, samples = columns_along(program, uncertainty, rows), prepared.first_samples()[rows]
    own, path, scale = program.job, program.path, program.job.cell.fit.scale
    place, arc, on_part = path.target.position[rows], path.arc[rows], path.contact[rows]

    def fly(cause: DrawnCause, rng: np.random.Generator) -> FlownDraw:
        field = unexplained(columns, scale, place, arc, rng)
        start, known = Start(), deviation.error[samples]
        if own.ensemble is not None:
            start = some_start(own.ensemble, rng)
            known = deviation_of(path, at_start(own, prepared, start, _sampled_twin(own))).error[samples]
        job = changed_job(own, uncertainty.parameters, replace(cause, delay=0.0))
        late = replace(start, delay=start.delay + cause.delay)
        timed = prepared.with_ramps(float(np.exp(RAMPS * rng.standard_normal())))  # it changes times, thus the warmth
        flown = at_start(job, timed, late, _sampled_twin(job))
        off = deviation_from_path(path, _displaced(path, flown.chunks(), arc, field), flown.sample_count)
        return FlownDraw(off.on_part, off.error[samples] - known - field)

    return draw(guarantee, uncertainty, columns, on_part if on_part.any() else ~on_part, scale, fly, progress)


def _sampled_twin(job: Job) -> Twin:
    """The real arm of a job, of whose poses pinocchio repeats some."""
    return replace(twin_of(job), confirmed=CONFIRMED)


def draw(
    guarantee: Guarantee,
    uncertainty: JobUncertainty,
    columns: Columns,
    on_part: BoolArray,
    scale: float,
    fly: Callable[[DrawnCause, np.random.Generator], FlownDraw],
    progress: Callable[[float], None],
) -> FlownDraws:
    """Draw what is not known, have each draw flown, and compare the flights with the linear band.

    Args:
        guarantee: Bounds, and how many draws of which seed.
        uncertainty: What may differ.
        columns: What one unit of each quantity does at M places.
        on_part: Places that are compared, (M,).
        scale: Of all that has no limits.
        fly: One draw on the whole way; each with random numbers of its own.
        progress: Called with the share done.
    """
    D, Q = guarantee.draws, len(uncertainty.quantities)
    z = np.random.default_rng(guarantee.seed).standard_normal((D, Q))
    drawn = np.array([amounts(uncertainty.quantities, row) for row in z]).reshape(D, Q)
    drawn[:, [q.limits is None for q in uncertainty.quantities]] *= scale
    linear = columns.column[on_part]
    band = rms(radius_of(directed_moment(columns))[on_part])

    def fly_one(first: int, last: int) -> FlownDraw:
        cause = combined(uncertainty.quantities, drawn[first].tolist())
        return fly(cause, np.random.default_rng([guarantee.seed, first]))

    flights, moved, difference, along = [], np.empty(D), np.empty(D), np.empty((D, Q))
    for k, flight in enumerate(map_blocks(D, fly_one, rows=1)):
        flights.append(flight.on_part)
        off = flight.moved[on_part] - linear @ drawn[k]
        moved[k] = rms(row_norms(flight.moved[on_part]))
        difference[k] = rms(row_norms(off)) / max(band, NO_BAND)
        along[k] = np.einsum("miq,mi->q", linear, off)
        progress((k + 1) / D)
    size = _surplus(linear, drawn, along)
    return FlownDraws(
        guarantee=guarantee,
        bounds=drawn_bounds(flights, guarantee),
        total=frozen(np.array([f["total"].max for f in flights])),
        moved=frozen(moved),
        disagreement=frozen(difference),
        disagrees_in=uncertainty.quantities[int(np.argmax(size))].name if Q else "",
    )


def _surplus(column: Array, drawn: Array, along: Array) -> Array:
    """How much of each column the flights have more than the band says, by least squares over the draws, (Q,) [m].

    Args:
        column: What one unit of each quantity does, (M, 3, Q) [m].
        drawn: The amounts of each draw, (D, Q).
        along: What each flight has beyond the band along each column, (D, Q) [m^2].
    """
    squares = np.einsum("miq,miq->q", column, column)
    surplus = (drawn * along).sum(axis=0) / np.maximum((drawn**2).sum(axis=0) * squares, NO_BAND**2)
    return np.asarray(np.abs(surplus) * np.sqrt((drawn**2).mean(axis=0) * squares))


def some_start(ensemble: Ensemble, rng: np.random.Generator) -> Start:
    """One of the starts that a file serves, each as likely."""
    run, override = rng.choice(ensemble.run_numbers), rng.choice(ensemble.overrides)
    return Start(int(run), float(rng.uniform(*ensemble.delay)), float(override))


def unexplained(columns: Columns, scale: float, place: Array, arc: Array, rng: np.random.Generator) -> Array:
    """One draw of what has a size and no direction, at the places of the columns and their arc, (M, 3) [m]."""
    few = np.unique(np.searchsorted(arc, np.arange(arc[0], arc[-1] + FIELD_STEP, FIELD_STEP)).clip(max=len(arc) - 1))
    field = random_field(rng, place[few])
    size = scale * np.sqrt(sum((deviation**2 for deviation in columns.undirected.values()), np.zeros(len(arc))))
    return np.column_stack([size * np.interp(arc, arc[few], column) for column in field.T])


def _displaced(path: ToolPath, executions: Iterator[Execution], arc: Array, field: Array) -> Iterator[Execution]:
    """Executions whose tool is displaced by a field (M, 3) [m] that is known at arc lengths (M,) [m]."""
    gaps = np.diff(path.arc)
    for execution in executions:
        at = path.arc[execution.segment] + execution.fraction * gaps[execution.segment]
        displacement = interpolated(at, arc, field)
        actual = execution.actual
        yield replace(execution, actual=Pose(frozen(actual.position + displacement), actual.rotation))
