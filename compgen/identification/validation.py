"""An identified robot on measurements it was not fitted to; at most the frames are fitted anew.

Rows far from what the others say are set aside and named: one tracker reading of 2 mm among 200 of 10 um would be all
that the rms tells. Too many, and none is set aside: then it is the model that is wrong.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, rms
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.units import UM
from compgen.error_model.direction_memory import reversal_widths
from compgen.error_model.sources.frames import BaseFrame, ToolFrame
from compgen.error_model.sources.measured_map import AxisMap
from compgen.error_model.uncertain_sources import UncertainSource
from compgen.identification.fit import fit
from compgen.identification.instrument_frames import InstrumentFrames
from compgen.identification.measured_turns import turned_findings
from compgen.identification.measurement_checks import check_plausible, check_row_count
from compgen.identification.measurements import Measurements
from compgen.identification.model import ArmModel, SymbolicSource, build_model, fixed_source
from compgen.identification.outliers import explained_by_play, outlier_threshold, reach_of_play, unknown_sides_finding
from compgen.identification.parameters import without_force
from compgen.identification.reversals import has_runs, with_directions
from compgen.identification.verdict import left_findings, set_aside_findings
from compgen.robot.robot import Robot

FEWEST = 10  # rows from which one can be told to be far from the others
MOST = 0.05  # share of rows that may be set aside
MEDIAN = {1: 0.6745, 3: 1.538}  # of the length of one and of three standard normal numbers
MOVED = "instrument or reflectors have moved (--refit-frames tells), or "


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Validation:
    """Distances of measured from predicted positions."""

    data: Measurements
    nominal: Array  # (N,) [m] by the nominal arm, with its own frames where they are fitted
    identified: Array  # (N,) [m] by the identified one
    outlier: BoolArray  # (N,) rows set aside
    findings: tuple[Finding, ...]


def distance_statistics(distance: Array) -> dict[str, float]:
    """Mean, rms, 99th percentile, max [m] and count of some distances; none: all zero."""
    if not len(distance):
        return {"mean": 0.0, "rms": 0.0, "p99": 0.0, "max": 0.0, "count": 0}
    return {
        "mean": float(distance.mean()),
        "rms": rms(distance),
        "p99": float(np.quantile(distance, 0.99)),
        "max": float(distance.max()),
        "count": len(distance),
    }


def validate(
    robot: Robot,
    known: Sequence[UncertainSource],
    data: Measurements,
    nodes: int,
    frames: InstrumentFrames | None,
    bound: float | None = None,
) -> Validation:
    """Compare a robot's sources with measurements.

    Args:
        robot: The nominal arm.
        known: Its sources.
        data: Measurements it was not fitted to.
        nodes: Of the heat model.
        frames: Of instruments and reflectors; None fits them, and nothing else.
        bound: Of the largest error that is not set aside [m].

    Raises:
        InputError: Too few numbers to fit frames, or measurements that cannot be of this arm.
    """
    sources = _fixed_sources(known, with_frames=frames is not None)
    if has_runs(data) and (widths := reversal_widths([s.source for s in sources])):
        data = with_directions(data, widths)
    nominal, identified = build_model(robot, [], nodes), build_model(robot, sources, nodes)
    check_plausible(robot, nominal if frames is None else identified, data, frames)
    of_nominal, otherwise = frames, "" if frames is None else MOVED
    if frames is None:
        check_row_count(data)
        of_nominal, frames = _frames_of_each(nominal, identified, data)
    residual = _residual(identified, data, frames)
    distances = [np.linalg.norm(r, axis=1) for r in (_residual(nominal, data, of_nominal or frames), residual)]
    reach = reach_of_few(data, reach_of_play(identified, data, np.zeros(0), frames))
    outlier, of_rows = _judged_rows(data, far_rows(data, residual), distances[1], reach, bound)
    of_three = np.maximum(distances[1] - reach, 0.0) * np.sqrt(3 / data.numbers)
    return Validation(
        data=data,
        nominal=distances[0],
        identified=distances[1],
        outlier=outlier,
        findings=(
            *turned_findings(identified, data, frames),
            *of_rows,
            *left_findings(data, of_three, outlier, None, [k.source for k in known], otherwise),
        ),
    )


def reach_of_few(data: Measurements, reach: Array) -> Array:
    """How far play from an unknown side may have moved rows, (N,) [m]: zero where that is more than a few poses.

    Of one pose, or of as many as may be set aside; a joint that stands all along is on one side in all rows.
    """
    poses, unsure = len(np.unique(data.pose)), len(np.unique(data.pose[reach > 0]))
    return reach if unsure <= max(1, MOST * poses) else np.zeros_like(reach)


def _judged_rows(
    data: Measurements, far: BoolArray, distance: Array, reach: Array, bound: float | None
) -> tuple[BoolArray, list[Finding]]:
    """Which rows are set aside, (N,), and what is to say of single rows.

    Args:
        data: N rows.
        far: Which lie far from the others.
        distance: How far each is off, (N,) [m].
        reach: How far play from an unknown side may have moved each, (N,) [m].
        bound: Of the largest error that is not set aside [m].
    """
    explained, findings = explained_by_play(data, far, distance, reach), list[Finding]()
    outlier, beyond = far & ~explained, np.maximum(distance - reach, 0.0)
    if outlier.mean() > MOST:
        message = f"{int(outlier.sum())} of {len(outlier)} rows lie far from the others: too many to set aside"
        findings.append(Finding.of(Code.OUTLIERS, message))
        outlier = np.zeros_like(outlier)
    farthest, usual = np.argsort(-distance), np.full(len(outlier), np.median(distance))
    findings += set_aside_findings(data.label, farthest[outlier[farthest]], distance, usual)
    kept = np.where(outlier, 0.0, beyond)
    worst = int(np.argmax(kept))
    if bound is not None:
        explained |= ~outlier & (distance > bound) & (beyond <= bound)
    if explained.any():
        findings.append(unknown_sides_finding(data, np.flatnonzero(explained), distance))
    if bound is not None and kept[worst] > bound:
        message = f"{data.label[worst]}: error of {distance[worst] / UM:.1f} um exceeds --max-um {bound / UM:g}"
        findings.append(Finding.of(Code.BOUNDS_MAX_UM, message))
    return outlier, findings


def _frames_of_each(
    nominal: ArmModel, identified: ArmModel, data: Measurements
) -> tuple[InstrumentFrames, InstrumentFrames]:
    """Frames fitted to the nominal arm and to the identified one; what the latter sets aside counts for neither."""
    nothing = np.zeros(0, dtype=bool)
    robust = fit(identified, data, nothing)
    rows = data.subset(~robust.outlier) if robust.outlier.mean() <= MOST else data
    return fit(nominal, rows, nothing, robust=False).frames, robust.frames


def far_rows(data: Measurements, residual: Array) -> BoolArray:
    """Rows too far off to be noise, beside most rows and beside the others of their own pose, (N,).

    What the model leaves is shared by the reflectors of a pose, what an instrument misreads is not. The scale is that
    of the median; noise alone reaches the threshold with a chance of 1 % anywhere in the data.
    """
    distance = np.linalg.norm(residual, axis=1)
    far: BoolArray = np.zeros(len(distance), dtype=bool)
    threshold = np.full(len(distance), np.inf)
    for kind, numbers in np.unique(np.column_stack([data.kind, data.numbers]), axis=0).tolist():
        rows = (data.kind == kind) & (data.numbers == numbers)
        scale = float(np.median(distance[rows])) / MEDIAN[numbers]
        if rows.sum() >= FEWEST and scale > 0:
            threshold[rows] = scale * np.sqrt(outlier_threshold(len(distance), numbers))
            far |= rows & (distance > threshold)
    for n in np.flatnonzero(far).tolist():
        others = np.flatnonzero((data.pose == data.pose[n]) & (data.numbers == 3))
        others = others[others != n]
        if data.numbers[n] == 3 and len(others) >= 2:
            shared = np.median(residual[others], axis=0)
            far[n] = np.linalg.norm(residual[n] - shared) > threshold[n]
    return far


def _residual(model: ArmModel, data: Measurements, frames: InstrumentFrames) -> Array:
    """What each row measured less what is predicted, (N, 3) [m]."""
    position, rotation = model.pose(data, np.zeros(0))
    return np.nan_to_num(frames.residual(data, position, rotation))


def _fixed_sources(known: Sequence[UncertainSource], *, with_frames: bool) -> list[SymbolicSource]:
    """The sources that a robot file tells, with nothing free; frames and maps of its own only where they are given."""
    return [
        fixed_source(k.source)
        for k in map(without_force, known)
        if with_frames or not isinstance(k.source, (AxisMap, BaseFrame, ToolFrame))
    ]
