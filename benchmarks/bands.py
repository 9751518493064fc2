"""What uncertainty adds to a run: the linear band with its six columns of waypoints, and draws that the twin flies."""

import time
from pathlib import Path
from typing import NamedTuple

from benchmarks import cases
from benchmarks.measure import seconds
from compgen.core import evaluation
from compgen.core.evaluation import BLOCK
from compgen.core.units import UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.pipelines.uncertainty.band_columns import WaypointProgram, band_along
from compgen.pipelines.uncertainty.draws import fly_program_draws
from compgen.report.waypoints_csv import csv_lines
from compgen.verification.twin import prepare


class FlownDraws(NamedTuple):
    """What draws of a program take."""

    waypoints: int
    draws: int
    elapsed: float  # [s]
    processor: float  # [s]


def seconds_of_draws(cache: Path, points: int, workers: int) -> FlownDraws:
    """59 flights of the shipped spiral with about so many waypoints, from its written text."""
    compiler = evaluation.find_compiler(cache)
    chord = 1.5 * (8045 / points) ** 2  # um; 8045 waypoints as shipped
    with evaluation.configured(compiler, workers):
        job = load_job(
            "paths/spiral_1300.toml", None, ["bounds.guaranteed.max_um=100", f"process.chord_um={chord:.6g}"]
        )
        planned, corrected = generate.generate(job, cases.quiet)
        prepared = prepare(corrected.twin, corrected.program, corrected.before, corrected.air)
        program = planned.driven(corrected.solution.theta, planned.motion)
        begin, spent = time.perf_counter(), time.process_time()
        flown = fly_program_draws(program, prepared, corrected.deviation, corrected.start_window)
        draws = 0 if flown is None else len(flown.total)
        return FlownDraws(len(planned.path.arc), draws, time.perf_counter() - begin, time.process_time() - spent)


def seconds_of_band(points: int) -> float:
    """Processor time of a corrected program's band, about so many waypoints long, and of its columns [s]."""
    planned, corrected = generate.generate(cases.job_of(points), cases.quiet)
    path, band = planned.path, corrected.band
    program = WaypointProgram(
        job=planned.job,
        model=planned.model,
        path=path,
        theta=corrected.solution.theta,
        time=planned.trajectory.time,
        rise=planned.rise,
        motion=planned.motion,
    )

    def columns() -> None:
        for first in range(0, len(path.arc), BLOCK):
            rows = slice(first, min(first + BLOCK, len(path.arc)))
            csv_lines(rows.start + 1, rows.stop + 1, [(band.half_widths(path, rows) / UM, 2)])

    return seconds(lambda: band_along(program, corrected.start_window), 3) + seconds(columns, 3)
