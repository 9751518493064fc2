"""Draws of an arm and a day, each flown by the twin on a corrected text: bounds with a probability of such a program.

As for a planned program (``pipelines.uncertainty.draws``): a draw changes sources, heat and air, takes one of the
starts that the file serves, and flies the text that was written, displaced by what no quantity explains. It is judged
at the samples that the correction is judged at. Ramps stay as the robot file assumes them: tenths of a second at stops.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from compgen.core.arrays import Array, rms, row_norms
from compgen.core.pose import Pose
from compgen.error_model.quantities import Cause
from compgen.job.job import Cell
from compgen.job.uncertainty import changed_cell
from compgen.pipelines.correct.result import Correction
from compgen.pipelines.correct.station_band import station_columns, uncertainty_of_plan
from compgen.pipelines.files.twin_of_job import twin_of_cell
from compgen.pipelines.uncertainty.draws import CONFIRMED, FlownDraw, FlownDraws, draw, some_start, unexplained
from compgen.program.driven import DrivenProgram
from compgen.thermal.ensemble import Start
from compgen.verification.deviation import COMPONENTS, Extent, percentile99
from compgen.verification.flight import fly, subdivisions_for


def fly_draws(
    result: Correction, driven: DrivenProgram, target: Pose, progress: Callable[[float], None]
) -> FlownDraws | None:
    """Fly as many draws as were asked for; None where none were, and where nothing is corrected.

    Args:
        result: The correction.
        driven: Its written text.
        target: Where its samples should be.
        progress: Called with the share done.
    """
    guarantee, ensemble, judged = result.options.guaranteed, result.options.ensemble, result.judged
    if guarantee is None or not judged.any():
        return None
    uncertainty = uncertainty_of_plan(result.cell, result.plan, result.around.frames)
    at_stations = station_columns(result.cell, result.plan, uncertainty, result.before)
    if at_stations is None:
        return None
    rows, columns = at_stations.rows, at_stations.columns
    flight = result.execution
    reached = np.flatnonzero(flight.fraction == 1)
    samples = reached[np.searchsorted(flight.station[reached], rows)]
    place, length = target.position[samples], result.length[judged]
    arc = np.concatenate([[0.0], np.cumsum(row_norms(np.diff(place, axis=0)))])
    at, pieces = flight.station - 1 + flight.fraction, subdivisions_for(twin_of_cell(result.cell))

    def error(cell: Cell, start: Start, air: float = 0.0) -> Array:
        twin = replace(twin_of_cell(cell), confirmed=CONFIRMED)
        flown = fly(twin, driven, result.before, starts=((1.0, start),), air=air, subdivisions=pieces)
        return flown.actual.position - target.position

    def fly_one(cause: Cause, rng: np.random.Generator) -> FlownDraw:
        field = unexplained(columns, result.cell.fit.scale, place, arc, rng)
        start, known = Start(), flight.actual.position - target.position
        if ensemble is not None:
            start = some_start(ensemble, rng)
            known = error(result.cell, start)
        off = error(changed_cell(result.cell, uncertainty.parameters, cause), start, cause.heat.air)
        beside = np.column_stack([np.interp(at, rows, column) for column in field.T])
        size = row_norms(off + beside)[judged]
        # of the components a program that exists has the size alone; no other is promised
        extent = Extent(float(size.max()), percentile99(size, length), rms(size, length), 0.0)
        return FlownDraw(dict.fromkeys(COMPONENTS, extent), (off - known)[samples])

    return draw(guarantee, uncertainty, columns, judged[samples], result.cell.fit.scale, fly_one, progress)
