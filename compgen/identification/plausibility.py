"""Whether measurements can be of this arm at all: their number, units and angles. One line for what is wrong."""

from dataclasses import replace

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.core.units import DEG, MM
from compgen.identification.conventions import better_reading
from compgen.identification.frames import InstrumentFrames, initial_frames
from compgen.identification.measurements import Measurements
from compgen.identification.model import ArmModel
from compgen.robot.robot import Robot

FAR = 0.05  # of the arm's reach: a larger median distance is no calibration error
NEAR = 0.2  # of the spread of the positions
FEWEST = 8  # poses from which a reading of the joints can be told from frames
BETTER = 5.0  # times nearer: a reading of the file that explains it so much better is the right one
UNITS = ((1000.0, "metres instead of mm"), (1e-3, "um instead of mm"), (25.4, "inches instead of mm"))


def check_row_count(data: Measurements) -> None:
    """Raises InputError when the measured numbers are fewer than the frames alone have unknowns."""
    unknowns = 6 * len(data.instruments) + 3 * len(data.reflectors)
    measured = int(np.isfinite(data.position).sum()) + 3 * int(np.isfinite(data.rotation[:, 0, 0]).sum())
    if measured <= unknowns:
        missing = int(np.ceil((unknowns + 1 - measured) / 3))
        raise InputError(
            f"{data.file()}: {measured} measured numbers, and the {unknowns} unknowns of "
            f"{len(data.instruments)} instrument frame(s) and {len(data.reflectors)} reflector place(s) need more; "
            f"measure {missing} or more rows more"
        )


def check_plausible(robot: Robot, model: ArmModel, data: Measurements, frames: InstrumentFrames | None = None) -> None:
    """Raises InputError when the arm is off by more than any calibration error, and says why if it can.

    Args:
        robot: The nominal arm.
        model: The arm whose places are compared; its parameters are at zero.
        data: Measurements.
        frames: Of instruments and reflectors; None: those that fit best.
    """
    reach = float(np.abs(robot.a).sum() + np.abs(robot.d).sum())
    for i in range(len(data.instruments)):
        of_instrument = data.instrument == i
        if data.aligned[i] or not of_instrument.any():
            continue
        rows = data.subset(of_instrument)
        name = rows.file()
        distance = _median_distance(model, rows, data.theta, 1.0, frames)
        if distance <= FAR * reach:
            _check_conventions(robot, model, rows, frames)
            continue
        spread = np.linalg.norm(rows.position - np.median(rows.position, axis=0), axis=1)
        near = FAR * reach if frames is not None else NEAR * float(np.median(spread))

        def explains(
            theta: Array, factor: float, rows: Measurements = rows, distance: float = distance, near: float = near
        ) -> bool:
            """Whether other angles or units explain the positions: much nearer, and near against their spread."""
            explained = _median_distance(model, rows, theta, factor, frames)
            limit = near if frames is not None else near * factor
            return explained < limit and (explained < distance / BETTER or factor > 1)

        radians = robot.to_theta(robot.to_pendant(data.theta) / DEG)
        small = np.abs(robot.to_pendant(data.theta)).max() / DEG <= 7
        if small and explains(radians, 1.0):
            raise InputError(
                f"{name}: columns j1_deg to j6_deg: the values are radians, not degrees; multiply them by 57.29578"
            )
        for factor, unit in UNITS:
            if explains(data.theta, factor):
                raise InputError(
                    f"{name}: columns x_mm y_mm z_mm: the values look like {unit} (off by {factor:g}); multiply them "
                    f"by {factor:g}"
                )
        _check_conventions(robot, model, rows, frames)
        if frames is not None:
            raise InputError(
                f"{name}: the places are {distance / MM:.0f} mm (median) from where the robot file has them; has the "
                "instrument moved, or are these other reflectors? --refit-frames fits both"
            )
        raise InputError(
            f"{name}: the nominal arm misses the places by {distance / MM:.0f} mm (median); check joint order, "
            f"signs and J3 of the pendant's convention (pendant table of robot '{robot.name}'), "
            "and that x y z are of one instrument"
        )


def _check_conventions(robot: Robot, model: ArmModel, rows: Measurements, frames: InstrumentFrames | None) -> None:
    """Raises InputError when another reading of the joint columns explains the places much better: says which."""
    if len(rows.theta) < FEWEST and frames is None:
        return

    def distance_of(pendant: Array) -> Array:
        return _distances(model, rows, robot.to_theta(pendant), 1.0, frames)

    better = better_reading(robot.to_pendant(rows.theta), bool(robot.pendant_map[2, 1]), distance_of)
    if better is not None:
        words, as_given, explained = better
        raise InputError(
            f"{rows.file()}: the nominal arm misses the places by {as_given / MM:.0f} mm, and by {explained / MM:.1f} "
            f"mm where {words}; mend the columns, or the pendant table of robot '{robot.name}' (joint order, signs, J3)"
        )


def _median_distance(
    model: ArmModel, rows: Measurements, theta: Array, factor: float, frames: InstrumentFrames | None = None
) -> float:
    """Median distance of measured positions from the arm, with the best frames unless they are given [m]."""
    return float(np.median(_distances(model, rows, theta, factor, frames)))


def _distances(
    model: ArmModel, rows: Measurements, theta: Array, factor: float, frames: InstrumentFrames | None
) -> Array:
    """Distance of each measured position from the arm, with the best frames unless they are given, (N,) [m]."""
    scaled = replace(rows, theta=theta, position=rows.position * factor)
    position, rotation = model.pose(scaled, np.zeros(len(model.parameters)))
    frames = frames or initial_frames(scaled, position, rotation)
    return np.asarray(np.linalg.norm(frames.predict(scaled, position, rotation) - scaled.position, axis=1))
