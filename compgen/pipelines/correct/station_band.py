"""The band of a program that exists: what the robot file leaves open at the stations that are corrected.

Draws of an arm and a day, each flown by the twin on a corrected text: bounds with a probability of such a program.

As for a planned program (``pipelines.uncertainty.draws``): a draw changes sources, heat and air, takes one of the
starts that the file serves, and flies the text that was written, displaced by what no quantity explains. It is judged
at the samples that the correction is judged at. Ramps stay as the robot file assumes them: tenths of a second at stops.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, IntArray, interpolated, lengths_along, rms, row_norms
from compgen.core.pose import IDENTITY, Pose
from compgen.error_model.uncertain_sources import DrawnCause
from compgen.job.job import Cell
from compgen.job.part_frame import PartFrame
from compgen.job.uncertainty import JobUncertainty, changed_cell, is_identified, is_taught_with, quantities_in_frame
from compgen.pipelines.correct.result import Correction, CorrectionPlan
from compgen.pipelines.files.twin_of_job import twin_of_cell
from compgen.pipelines.uncertainty.band_columns import Places, columns_at
from compgen.pipelines.uncertainty.draws import CONFIRMED, FlownDraw, FlownDraws, draw, some_start, unexplained
from compgen.program.directions import station_directions
from compgen.program.driven import DrivenProgram
from compgen.program.frames import Frames
from compgen.thermal import Duty, still_air
from compgen.thermal.ensemble import Start
from compgen.thermal.model import with_losses
from compgen.thermal.schedule import History
from compgen.verification.band import Band, Columns, band_of, parted_by_teaching
from compgen.verification.deviation import COMPONENTS, Extent, percentile99
from compgen.verification.flight import fly, subdivisions_for

MOST = 20_000  # stations at which a band is evaluated; of more, so many along the program


def part_frame_of(plan: CorrectionPlan, frames: Frames) -> PartFrame | None:
    """The user frame that all free stations stand in, where the frames table says how it was taught; else None.

    They are Cartesian, of one tool, and the arm stands where it taught: no extended axis and no register moves it.
    """
    poses = plan.poses
    rows = np.unique(plan.drive.pose[plan.free])
    numbers = np.unique(plan.program.positions.uframe[poses.row[rows]]).tolist()
    if len(numbers) != 1 or numbers[0] not in frames.taught:
        return None
    place = frames.uframe[numbers[0]]
    is_there = all(poses.bases[base] == place for base in np.unique(poses.base[rows]).tolist())
    if not is_there or poses.joint_form[rows].any() or len(np.unique(poses.tool[rows])) > 1:
        return None
    return PartFrame(numbers[0], place, place, frames.taught[numbers[0]])


def uncertainty_of_plan(cell: Cell, plan: CorrectionPlan, frames: Frames) -> JobUncertainty:
    """What the cell does not know at the free stations, less what their taught frame has taken up of it."""
    frame = part_frame_of(plan, frames)
    if frame is None:
        return quantities_in_frame(cell, None, IDENTITY)
    poses, pose = plan.poses, plan.drive.pose[plan.free]
    place = poses.tcp.position[pose]
    middle = (place.min(axis=0) + place.max(axis=0)) / 2
    return quantities_in_frame(cell, frame.taught, _one_tool(plan), middle)


def is_tool_taught(result: Correction) -> bool:
    """Whether this robot taught the frame of the free stations with their tool."""
    frame = part_frame_of(result.plan, result.around.frames)
    return frame is not None and is_taught_with(_one_tool(result.plan), frame, result.cell)


def _one_tool(plan: CorrectionPlan) -> Pose:
    """Of the free stations, which have one."""
    return plan.poses.tools[plan.poses.tool[plan.drive.pose[plan.free][0]]]


def station_band(cell: Cell, plan: CorrectionPlan, frames: Frames, before: Sequence[Duty], air: float) -> Band | None:
    """What the robot file leaves open at the free stations; None where there are none.

    Args:
        cell: The robot.
        plan: The program, its stations and their corrections.
        frames: Of the controller, with how they were taught.
        before: What the cell did.
        air: How much warmer than the reference it is [K].
    """
    uncertainty = uncertainty_of_plan(cell, plan, frames)
    at = station_columns(cell, plan, uncertainty, before, air)
    if at is None:
        return None
    weight, scale = np.zeros(len(at.rows)), cell.fit.scale
    band = band_of([at.columns], at.rows, weight, scale)
    if uncertainty.taken is not None or not is_identified(cell):
        return band
    return replace(band, parted=parted_by_teaching(at.columns, at.place, weight, scale))


@dataclass(frozen=True, eq=False, slots=True)
class StationColumns:
    """What one unit of each quantity does at M free stations."""

    rows: IntArray  # (M,) rising
    columns: Columns
    place: Array  # (M, 3) [m] World, as the controller believes


def station_columns(
    cell: Cell, plan: CorrectionPlan, uncertainty: JobUncertainty, before: Sequence[Duty], air: float
) -> StationColumns | None:
    """What one unit of each quantity does at the free stations; None where there are none."""
    stations, poses = plan.stations, plan.drive.at
    rows = np.flatnonzero(plan.free & np.isfinite(stations.theta).all(axis=1))
    if not len(rows):
        return None
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, min(len(rows), MOST)).astype(int))]
    motion = plan.drive.joint_motion()
    history = History(before=tuple(with_losses(cell.heat, before, motion)), air=still_air(air))
    directions = station_directions(cell.robot, cell.sources, plan.drive)[0]
    tools = poses.tool[plan.drive.pose[rows]]
    parts: list[tuple[Array, Columns]] = []
    place = np.empty((len(rows), 3))
    for tool in np.unique(tools).tolist():
        with_tool = rows[tools == tool]
        places = Places(
            theta=stations.theta[with_tool],
            time=stations.time[with_tool],
            rise=stations.rise[with_tool],
            motion=directions.at(with_tool),
            tool=poses.tools[tool],
        )
        model = cell.error_model(poses.tools[tool])
        place[tools == tool] = model.nominal_pose(places.theta).position
        parts.append((with_tool, columns_at(cell, history, motion.mean_feed, uncertainty, places, model)))
    order = np.argsort(np.concatenate([with_tool for with_tool, _ in parts]), kind="stable")
    first = parts[0][1]
    columns = Columns(
        column=np.concatenate([c.column for _, c in parts])[order],
        mean=first.mean,
        deviation=first.deviation,
        source=first.source,
        undirected={name: np.concatenate([c.undirected[name] for _, c in parts])[order] for name in first.undirected},
        hidden=np.concatenate([c.hidden for _, c in parts])[order],
    )
    return StationColumns(rows, columns, place)


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
    options, judged = result.options, result.judged
    guarantee, ensemble = options.guaranteed, options.ensemble
    if guarantee is None or not judged.any():
        return None
    uncertainty = uncertainty_of_plan(result.cell, result.plan, result.around.frames)
    at_stations = station_columns(result.cell, result.plan, uncertainty, result.before, options.air)
    if at_stations is None:
        return None
    rows, columns = at_stations.rows, at_stations.columns
    flight = result.execution
    reached = np.flatnonzero(flight.fraction == 1)
    samples = reached[np.searchsorted(flight.station[reached], rows)]
    place, length = target.position[samples], result.length[judged]
    arc = lengths_along(place)
    at, pieces = flight.station - 1 + flight.fraction, subdivisions_for(twin_of_cell(result.cell))

    def error(cell: Cell, start: Start, air: float = 0.0) -> Array:
        twin = replace(twin_of_cell(cell), confirmed=CONFIRMED)
        flown = fly(twin, driven, result.before, starts=((1.0, start),), air=options.air + air, subdivisions=pieces)
        return flown.actual.position - target.position

    def fly_one(cause: DrawnCause, rng: np.random.Generator) -> FlownDraw:
        field = unexplained(columns, result.cell.fit.scale, place, arc, rng)
        start, known = Start(), flight.actual.position - target.position
        if ensemble is not None:
            start = some_start(ensemble, rng)
            known = error(result.cell, start)
        off = error(changed_cell(result.cell, uncertainty.parameters, cause), start, cause.heat.air)
        beside = interpolated(at, rows, field)
        size = row_norms(off + beside)[judged]
        # of the components a program that exists has the size alone; no other is promised
        extent = Extent(float(size.max()), percentile99(size, length), rms(size, length), 0.0)
        return FlownDraw(dict.fromkeys(COMPONENTS, extent), (off - known)[samples])

    return draw(guarantee, uncertainty, columns, judged[samples], result.cell.fit.scale, fly_one, progress)
