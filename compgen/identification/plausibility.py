"""Whether measurements can be of this arm at all: units, angles, enough of them. One line for what is wrong."""

from dataclasses import replace

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.core.units import DEG, MM
from compgen.identification.frames import initial_frames
from compgen.identification.measurements import Measurements
from compgen.identification.model import ArmModel
from compgen.robot.robot import Robot

FAR = 0.05  # of the arm's reach: a median miss beyond this is no calibration error
NEAR = 0.2  # of the spread of the places
BETTER = 5.0  # times smaller: a reading of the file that explains it so much better is the right one


def check_row_count(data: Measurements) -> None:
    """Raises InputError when rows are fewer than the frames alone need."""
    need = 6 * len(data.instruments) + 3 * len(data.reflectors)
    have = int(np.isfinite(data.position).sum()) + 3 * int(np.isfinite(data.rotation[:, 0, 0]).sum())
    if have <= need:
        more = int(np.ceil((need + 1 - have) / 3))
        raise InputError(
            f"{data.instruments[0]}: {have} measured numbers, and the {need} unknowns of {len(data.instruments)} "
            f"instrument frame(s) and {len(data.reflectors)} reflector place(s) need more; measure {more} "
            f"or more rows more"
        )


def check_plausible(robot: Robot, model: ArmModel, data: Measurements) -> None:
    """Raises InputError when nominal kinematics misses by more than any calibration error, and says why if it can."""
    reach = float(np.abs(robot.a).sum() + np.abs(robot.d).sum())
    for i, name in enumerate(data.instruments):
        if data.aligned[i]:
            continue
        part = data.subset(data.instrument == i)
        miss = _median_distance(model, part, data.theta, 1.0)
        if miss <= FAR * reach:
            continue
        turned = robot.to_theta(robot.to_pendant(data.theta) / DEG)
        small = np.abs(robot.to_pendant(data.theta)).max() / DEG <= 7
        if small and _explains(model, part, turned, 1.0, miss):
            raise InputError(
                f"{name}: columns j1_deg to j6_deg: the values are radians, not degrees; multiply them by 57.29578"
            )
        for factor, told in (
            (1000.0, "metres instead of mm"),
            (1e-3, "um instead of mm"),
            (25.4, "inches instead of mm"),
        ):
            if _explains(model, part, data.theta, factor, miss):
                raise InputError(_unit_message(name, factor, told))
        raise InputError(
            f"{name}: the nominal arm misses the places by {miss / MM:.0f} mm (median); check joint order, "
            f"signs and J3 "
            f"of the pendant's convention (pendant table of robot '{robot.name}'), and that x y z are of one instrument"
        )


def _explains(model: ArmModel, part: Measurements, theta: Array, factor: float, miss: float) -> bool:
    """Whether another reading explains the places: far nearer, and near against how far they are apart."""
    spread = float(np.median(np.linalg.norm(part.position - np.median(part.position, axis=0), axis=1))) * factor
    left = _median_distance(model, part, theta, factor)
    return left < NEAR * spread and (left < miss / BETTER or factor > 1)


def _unit_message(name: str, factor: float, told: str) -> str:
    return (
        f"{name}: columns x_mm y_mm z_mm: the values look like {told} (off by {factor:g}); multiply them by {factor:g}"
    )


def _median_distance(model: ArmModel, part: Measurements, theta: Array, factor: float) -> float:
    """Median distance of the best frames on the nominal arm [m]."""
    tried = replace(part, theta=theta, position=part.position * factor)
    position, rotation = model.pose(tried, np.zeros(len(model.parameters)))
    frames = initial_frames(tried, position, rotation)
    return float(np.median(np.linalg.norm(frames.predict(tried, position, rotation) - tried.position, axis=1)))
