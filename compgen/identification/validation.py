"""A robot file on measurements that it has not seen: no fitting, but of frames when asked."""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.error_model.sources.frames import BaseFrame, ToolFrame
from compgen.error_model.sources.measured_map import AxisMap
from compgen.error_model.uncertainty import UncertainSource
from compgen.identification.fit import fit
from compgen.identification.frames import InstrumentFrames
from compgen.identification.measurements import Measurements
from compgen.identification.model import SymbolicSource, build_model
from compgen.identification.parameters import without_force
from compgen.identification.plausibility import check_plausible, check_row_count
from compgen.robot.robot import Robot


@dataclass(frozen=True, eq=False, slots=True)
class Validation:
    """Distances of measured from predicted places."""

    data: Measurements
    frames: InstrumentFrames
    before: Array  # (N,) [m] by the nominal arm, with its own frames where they are fitted
    after: Array  # (N,) [m] by the identified one


def statistics(distance: Array) -> dict[str, float]:
    """Mean, rms, 99th percentile, max [m] and count of some distances."""
    return {
        "mean": float(distance.mean()),
        "rms": float(np.sqrt((distance**2).mean())),
        "p99": float(np.quantile(distance, 0.99)),
        "max": float(distance.max()),
        "count": len(distance),
    }


def validate(
    robot: Robot, known: Sequence[UncertainSource], data: Measurements, nodes: int, frames: InstrumentFrames | None
) -> Validation:
    """Compare a robot's sources with measurements.

    Args:
        robot: The nominal arm.
        known: Its sources.
        data: Measurements it has not seen.
        nodes: Of the heat model.
        frames: Where instrument and reflectors are; None fits them, and nothing else.

    Raises:
        InputError: Too few numbers to fit frames, or measurements that cannot be of this arm.
    """
    parts = [
        SymbolicSource(k.source, k.source, ca.SX.zeros(0, 1), (), {})
        for k in map(without_force, known)
        if not isinstance(k.source, (AxisMap, BaseFrame, ToolFrame)) or frames is not None
    ]
    nominal, real = build_model(robot, [], nodes), build_model(robot, parts, nodes)
    free = np.zeros(0, dtype=bool)
    if frames is None:
        check_row_count(data)
        check_plausible(robot, nominal, data)
        plain, good = (fit(m, data, free, robust=False) for m in (nominal, real))
        frames = good.frames
        return Validation(data, frames, *(np.linalg.norm(f.residual, axis=1) for f in (plain, good)))
    if len(frames.reflector) != len(data.reflectors):
        raise InputError(
            f"{data.instruments[0]}: {len(data.reflectors)} reflectors; refit their places: --refit-frames"
        )
    missed = []
    for model in (nominal, real):
        position, rotation = model.pose(data, np.zeros(0))
        missed.append(np.linalg.norm(data.position - frames.predict(data, position, rotation), axis=1))
    return Validation(data, frames, missed[0], missed[1])
