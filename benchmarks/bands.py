"""What the linear band adds to a run: its columns and their fold, and six columns of the table of waypoints."""

from benchmarks import cases
from benchmarks.measure import seconds
from compgen.core.evaluation import BLOCK
from compgen.core.units import UM
from compgen.pipelines import generate
from compgen.pipelines.band import DrivenProgram, band_along
from compgen.report.waypoints_csv import csv_lines


def seconds_of_band(points: int) -> float:
    """Processor time of a corrected program's band, about so many waypoints long, and of its columns [s]."""
    planned, corrected = generate.generate(cases.job_of(points), cases.quiet)
    path, band = planned.path, corrected.band
    program = DrivenProgram(
        planned.job, planned.model, path, corrected.solution.theta, planned.trajectory.time, planned.rise,
        planned.motion,
    )  # fmt: skip

    def columns() -> None:
        for first in range(0, len(path.arc), BLOCK):
            rows = slice(first, min(first + BLOCK, len(path.arc)))
            csv_lines(rows.start + 1, rows.stop + 1, [(band.half_widths(path, rows) / UM, 2)])

    return seconds(lambda: band_along(program, corrected.start_window), 3) + seconds(columns, 3)
