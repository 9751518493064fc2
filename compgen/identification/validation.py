"""An identified robot on measurements it was not fitted to; at most the frames are fitted anew."""

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
    """Distances of measured from predicted positions."""

    data: Measurements
    frames: InstrumentFrames
    nominal: Array  # (N,) [m] by the nominal arm, with its own frames where they are fitted
    identified: Array  # (N,) [m] by the identified one


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
        data: Measurements it was not fitted to.
        nodes: Of the heat model.
        frames: Of instruments and reflectors; None fits them, and nothing else.

    Raises:
        InputError: Too few numbers to fit frames, or measurements that cannot be of this arm.
    """
    sources = [
        SymbolicSource(k.source, k.source, ca.SX.zeros(0, 1), (), {})
        for k in map(without_force, known)
        if not isinstance(k.source, (AxisMap, BaseFrame, ToolFrame)) or frames is not None
    ]
    nominal, identified = build_model(robot, [], nodes), build_model(robot, sources, nodes)
    no_parameters = np.zeros(0, dtype=bool)
    if frames is None:
        check_row_count(data)
        check_plausible(robot, nominal, data)
        nominal_fit, identified_fit = (fit(m, data, no_parameters, robust=False) for m in (nominal, identified))
        frames = identified_fit.frames
        return Validation(data, frames, *(np.linalg.norm(f.residual, axis=1) for f in (nominal_fit, identified_fit)))
    if len(frames.reflector) != len(data.reflectors):
        raise InputError(
            f"{data.instruments[0]}: {len(data.reflectors)} reflectors; refit their places: --refit-frames"
        )
    distances = []
    for model in (nominal, identified):
        position, rotation = model.pose(data, np.zeros(0))
        distances.append(np.linalg.norm(data.position - frames.predict(data, position, rotation), axis=1))
    return Validation(data, frames, distances[0], distances[1])
