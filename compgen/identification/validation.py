"""An identified robot on measurements it was not fitted to; at most the frames are fitted anew.

Rows far from what the others say are set aside and named: one tracker reading of 2 mm among 200 of 10 um would be all
that the rms tells. Too many, and none is set aside: then it is the model that is wrong.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray
from compgen.core.findings import Finding, Level
from compgen.core.units import UM
from compgen.error_model.sources.frames import BaseFrame, ToolFrame
from compgen.error_model.sources.measured_map import AxisMap
from compgen.error_model.uncertainty import UncertainSource
from compgen.identification.fit import fit, outlier_threshold
from compgen.identification.frames import InstrumentFrames
from compgen.identification.measurements import Measurements
from compgen.identification.model import ArmModel, SymbolicSource, build_model
from compgen.identification.parameters import without_force
from compgen.identification.plausibility import check_plausible, check_row_count
from compgen.robot.robot import Robot

FEWEST = 10  # rows from which one can be told to be far from the others
MOST = 0.05  # share of rows that may be set aside
MEDIAN = 1.538  # of the length of three standard normal numbers
NAMED = 20  # rows set aside that are named one by one


@dataclass(frozen=True, eq=False, slots=True)
class Validation:
    """Distances of measured from predicted positions."""

    data: Measurements
    frames: InstrumentFrames
    nominal: Array  # (N,) [m] by the nominal arm, with its own frames where they are fitted
    identified: Array  # (N,) [m] by the identified one
    outlier: BoolArray  # (N,) rows set aside
    findings: tuple[Finding, ...]


def statistics(distance: Array) -> dict[str, float]:
    """Mean, rms, 99th percentile, max [m] and count of some distances; none: all zero."""
    if not len(distance):
        return {"mean": 0.0, "rms": 0.0, "p99": 0.0, "max": 0.0, "count": 0}
    return {
        "mean": float(distance.mean()),
        "rms": float(np.sqrt((distance**2).mean())),
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
    sources = [
        SymbolicSource(k.source, k.source, ca.SX.zeros(0, 1), (), {})
        for k in map(without_force, known)
        if not isinstance(k.source, (AxisMap, BaseFrame, ToolFrame)) or frames is not None
    ]
    nominal, identified = build_model(robot, [], nodes), build_model(robot, sources, nodes)
    check_plausible(robot, nominal if frames is None else identified, data, frames)
    if frames is None:
        check_row_count(data)
        frames, distances, outlier = _with_fitted_frames(nominal, identified, data)
    else:
        distances = [_distances(model, data, frames) for model in (nominal, identified)]
        scale = float(np.median(distances[1])) / MEDIAN
        outlier = (distances[1] / scale) ** 2 > outlier_threshold(len(data.pose)) if scale > 0 else distances[1] > 0
    findings = []
    if len(outlier) < FEWEST or outlier.mean() > MOST:
        if outlier.any() and len(outlier) >= FEWEST:
            message = f"{int(outlier.sum())} of {len(outlier)} rows lie far from the others: too many to set aside"
            findings.append(Finding(Level.WARNING, "outliers", message))
        outlier = np.zeros_like(outlier)
    findings += _named(data, distances[1], outlier)
    kept = np.where(outlier, 0.0, distances[1])
    worst = int(np.argmax(kept))
    if bound is not None and kept[worst] > bound:
        message = f"{data.label[worst]}: error of {kept[worst] / UM:.1f} um exceeds --max-um {bound / UM:g}"
        findings.append(Finding(Level.OUTSIDE, "bounds.max_um", message))
    return Validation(data, frames, distances[0], distances[1], outlier, tuple(findings))


def _with_fitted_frames(
    nominal: ArmModel, identified: ArmModel, data: Measurements
) -> tuple[InstrumentFrames, list[Array], BoolArray]:
    """Frames that fit best without the rows set aside, distances by both arms, and those rows."""
    nothing = np.zeros(0, dtype=bool)
    robust = fit(identified, data, nothing)
    if len(data.pose) < FEWEST or robust.outlier.mean() > MOST:
        identified_fit, nominal_fit = (fit(model, data, nothing, robust=False) for model in (identified, nominal))
        return identified_fit.frames, [_distances(nominal, data, nominal_fit.frames),
                                       _distances(identified, data, identified_fit.frames)], robust.outlier  # fmt: skip
    kept = data.subset(~robust.outlier)
    nominal_fit = fit(nominal, kept, nothing, robust=False)
    distances = [_distances(nominal, data, nominal_fit.frames), _distances(identified, data, robust.frames)]
    return robust.frames, distances, robust.outlier


def _distances(model: ArmModel, data: Measurements, frames: InstrumentFrames) -> Array:
    """Distance of each row from where the arm is predicted, (N,) [m]."""
    position, rotation = model.pose(data, np.zeros(0))
    return np.asarray(np.linalg.norm(data.position - frames.predict(data, position, rotation), axis=1))


def _named(data: Measurements, distance: Array, outlier: BoolArray) -> list[Finding]:
    """A finding for each row set aside, the farthest first."""
    rows = [n for n in np.argsort(-distance).tolist() if outlier[n]]
    usual = float(np.median(distance)) / UM
    findings = [
        Finding(Level.WARNING, "outlier", f"{data.label[n]}: set aside: {distance[n] / UM:.0f} um off, where "
                f"{usual:.0f} um is usual")
        for n in rows[:NAMED]
    ]  # fmt: skip
    if len(rows) > NAMED:
        findings.append(Finding(Level.WARNING, "outlier", f"{len(rows) - NAMED} more rows were set aside"))
    return findings
