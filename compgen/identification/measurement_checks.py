r"""Whether measurements can be of this arm at all: their number, units and angles. One line for what is wrong.

Where places contradict the joints, the reading of the joint columns that explains them is named: a sign, the convention
of J3, an order, an offset. The pendant's angles p become theta = M p + theta_0 by the robot file. A file of another
convention is read as

    p' = C p + c,     C: the sign of one joint, J3 against link 2 or against the horizontal (J3 -/+ J2), two joints
                      exchanged;  c: a quarter turn or a half of one joint

and each is judged by how near the nominal arm then comes to the places, with the frames that fit it best. What is 5
times nearer than the reading as it stands is what is wrong; two such readings together are found one after the other.
Mirrored places are tried beside them.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from compgen.core.arrays import Array, BoolArray, exchanged
from compgen.core.exceptions import InputError
from compgen.core.units import DEG, MM
from compgen.identification.instrument_frames import InstrumentFrames, initial_frames, measured_distance
from compgen.identification.measured_turns import check_known_turns
from compgen.identification.measurements import DISTANCE, NONE, PLACE, TOUCH, Measurements
from compgen.identification.model import ArmModel
from compgen.robot.robot import Robot, coupling_of

FAR = 0.05  # of the arm's reach: a larger median distance is no calibration error
NEAR = 0.2  # of the spread of the positions
FEWEST = 8  # poses from which a reading of the joints can be told from frames
BETTER = 5.0  # times nearer: a reading of the file that explains it so much better is the right one
NEAR_LENGTH = 0.05  # share by which a length in another unit may differ from what the arm says
UNITS = ((1000.0, "metres instead of mm"), (1e-3, "um instead of mm"), (25.4, "inches instead of mm"))
SUSPECT = 4e-3  # [m] mean distance above which readings are tried; no arm is so far off its nominal figures
HELPS = 1.5  # times nearer that the first of two must come
ALIKE, EXACT = 1.1, 1e-6  # times, and [m], by which readings are equally near
#: by what theta_3 counts of J2
COUPLED = {
    0: "J3 fits the convention of the angle against link 2 (theta_3 = J3), not of the horizontal",
    1: "J3 fits the pendant's convention of the horizontal (theta_3 = J2 + J3)",
    -1: "J3 fits the convention of the horizontal with J2 of the opposite sign (theta_3 = J3 - J2)",
}
MIRROR = np.array([1.0, 1.0, -1.0])
COPIES = 3  # rows; fewer may agree by chance
DIGITS = 9  # of rad and m, that a file may tell
KEPT = 0.95  # share of rows, the nearest, whose mean distance counts


@dataclass(frozen=True, slots=True, kw_only=True)
class _Measured:
    """Words for what the rows of a kind hold."""

    words: str
    joints: str
    values: str
    check: str
    moved: str
    copied: str


_MEASURED = {
    PLACE: _Measured(
        words="places",
        joints="j1_deg to j6_deg",
        values="columns x_mm y_mm z_mm",
        check="that x y z are of one instrument",
        moved="has the instrument moved, or are these other reflectors?",
        copied="the joints and the place",
    ),
    TOUCH: _Measured(
        words="spheres",
        joints="j1_deg to j6_deg",
        values="x_mm y_mm z_mm of the spheres in the artefact's file",
        check="the spheres' names and places, and the probe",
        moved="has the artefact moved, or is it another probe?",
        copied="the joints, target, direction and value",
    ),
    DISTANCE: _Measured(
        words="distances",
        joints="a_j1_deg to b_j6_deg",
        values="column distance_mm",
        check="that each target is one reflector",
        moved="has a socket moved, or are these other reflectors?",
        copied="the ends and the distance",
    ),
}


def check_row_count(data: Measurements) -> None:
    """Raises InputError when the measured numbers are fewer than frames, reflectors and places have unknowns."""
    places = int(np.isnan(data.fixed.place[:, 0]).sum())
    unknowns = 6 * len(data.instruments) + 3 * (len(data.reflectors) + places) - len(data.fixed.length)
    of_places = np.isfinite(data.position[data.kind == PLACE]).sum() + 3 * np.isfinite(data.rotation[:, 0, 0]).sum()
    measured = int(of_places + data.numbers[data.kind != PLACE].sum())
    if measured <= unknowns:
        missing = int(np.ceil((unknowns + 1 - measured) / int(data.numbers.max())))
        raise InputError(
            f"{data.file()}: {measured} measured numbers, and the {unknowns} unknowns of "
            f"{len(data.instruments)} instrument frame(s) and {len(data.reflectors)} reflector place(s)"
            f"{f', {places} fixed place(s)' if places else ''} need more; measure {missing} or more rows more"
        )


def check_copies(data: Measurements) -> None:
    """Raises InputError where most of what was measured again repeats an earlier row of its kind to the last digit."""
    of_lines = np.append(data.aligned, False)[data.instrument]  # of a row without an instrument: -1
    ends = data.ends
    other = np.where(ends.pose[:, None] == NONE, 0.0, data.theta[ends.pose])
    between = np.column_stack([data.theta[data.pose], data.reflector, ends.place, other, ends.reflector, ends.toward])
    own_time = data.time[data.pose] * data.timed * (data.kind != PLACE)  # one number may come again at another time
    value = np.column_stack([data.position, ends.shift, ends.distance, own_time])
    for kind, measured in _MEASURED.items():
        rows = np.flatnonzero((data.kind == kind) & ~of_lines)
        at, values = (np.round(np.nan_to_num(of[rows]), DIGITS).tolist() for of in (between, value))
        again = len(rows) - len(set(map(tuple, at)))
        first: dict[tuple[float, ...], int] = {}
        earlier = np.array([first.setdefault((*a, *v), n) for n, a, v in zip(rows.tolist(), at, values, strict=True)])
        copies = np.flatnonzero(earlier != rows)
        if len(copies) >= COPIES and 2 * len(copies) > again:
            n = copies[0]
            raise InputError(
                f"{data.label[rows[n]]}: {measured.copied} of {data.label[earlier[n]]} to the last digit, and so for "
                f"{len(copies)} rows: a copy is no second measurement; remove them, or --force takes them"
            )


def check_scale(data: Measurements) -> None:
    """Raises InputError when nothing tells how long anything is: touches of spheres without a certified length.

    If the arm, the probe and the places of the spheres grow by one factor, every touch stays as it is.
    """
    if (data.kind == TOUCH).all() and not data.fixed.certified:
        raise InputError(
            f"{data.file()}: no row tells the scale: all lengths of the arm and between the spheres may grow together; "
            "give the certified length between two touched spheres ([[length]] in the artefact's file), or certified "
            "places (certified = true), or --distances"
        )


def check_plausible(robot: Robot, model: ArmModel, data: Measurements, frames: InstrumentFrames | None = None) -> None:
    """Raises InputError when the arm is off by more than any calibration error, and says why if it can.

    Args:
        robot: The nominal arm.
        model: The arm whose places are compared; its parameters are at zero.
        data: Measurements.
        frames: Of instruments and reflectors, places; None: those that fit best.
    """
    for part in _parts(data):
        _check_part(robot, model, data.subset(part), frames)


def _parts(data: Measurements) -> Iterator[BoolArray]:
    """Rows that are judged together: of each instrument, of each file of touches or distances."""
    for i in range(len(data.instruments)):
        of_instrument = (data.instrument == i) & (data.kind == PLACE)
        if not data.aligned[i] and of_instrument.any():
            yield of_instrument
    others, files = data.kind != PLACE, np.array([data.file(n) for n in range(len(data.pose))])
    for file in dict.fromkeys(files[others].tolist()):
        yield others & (files == file)


def _check_part(robot: Robot, model: ArmModel, rows: Measurements, frames: InstrumentFrames | None) -> None:
    reach = float(np.abs(robot.a).sum() + np.abs(robot.d).sum())
    measured = _MEASURED[int(rows.kind[0])]
    far = FAR * reach if _is_of_places(rows) else 2 * SUSPECT
    name = rows.file()
    distance = _median_distance(model, rows, rows.theta, 1.0, frames)
    if distance <= far:
        _check_conventions(robot, model, rows, frames)
        _check_lengths(model, rows, frames)
        if frames is not None:
            check_known_turns(model, rows, frames)
        return
    _check_units(robot, model, rows, frames, distance, far)
    _check_exchanged(model, rows, frames, distance)
    _check_conventions(robot, model, rows, frames)
    if frames is not None:
        raise InputError(
            f"{name}: the {measured.words} are {distance / MM:.0f} mm (median) from where the robot file has them; "
            f"{measured.moved} --refit-frames fits both"
        )
    raise InputError(
        f"{name}: the nominal arm misses the {measured.words} by {distance / MM:.0f} mm (median); check joint order, "
        f"signs and J3 of the pendant's convention (pendant table of robot '{robot.name}'), "
        f"and {measured.check}"
    )


def _is_of_places(rows: Measurements) -> bool:
    """Whether rows of one kind are places that an instrument measured."""
    return int(rows.kind[0]) == PLACE


def _check_units(
    robot: Robot, model: ArmModel, rows: Measurements, frames: InstrumentFrames | None, distance: float, far: float
) -> None:
    """Raises InputError when other units explain what was measured: much nearer, and near against its spread."""
    measured = _MEASURED[int(rows.kind[0])]
    spread = np.linalg.norm(rows.position - np.median(rows.position, axis=0), axis=1)
    by_spread = frames is None and _is_of_places(rows)

    def explains(theta: Array, factor: float) -> bool:
        explained = _median_distance(model, rows, theta, factor, frames)
        limit = NEAR * float(np.median(spread)) * factor if by_spread else far
        return explained < limit and (explained < distance / BETTER or factor > 1)

    where = f"{rows.file()}: columns {measured.joints}"
    refuse_radians(where, robot.to_pendant(rows.theta), lambda pendant: explains(robot.to_theta(pendant), 1.0))
    for factor, unit in UNITS:
        if explains(rows.theta, factor):
            raise InputError(
                f"{rows.file()}: {measured.values}: the values look like {unit} (off by {factor:g}); multiply them "
                f"by {factor:g}"
            )


def refuse_radians(where: str, pendant: Array, explains: Callable[[Array], bool]) -> None:
    """Raises InputError for the pendant's angles (M, 6) [rad], read as degrees, that explain more as radians."""
    if np.abs(pendant).max() / DEG <= 7 and explains(pendant / DEG):
        raise InputError(f"{where}: the values are radians, not degrees; multiply them by 57.29578")


def _check_lengths(model: ArmModel, rows: Measurements, frames: InstrumentFrames | None) -> None:
    """Raises InputError where the nominal arm has two spheres at another distance than their certified length."""
    if frames is not None or not len(rows.fixed.length):
        return
    position, rotation = model.pose(rows, np.zeros(len(model.parameters)))
    place = initial_frames(rows, position, rotation).place
    touched = np.zeros(len(place), dtype=bool)
    touched[rows.ends.place] = True
    for (a, b), length in zip(rows.fixed.between.tolist(), rows.fixed.length.tolist(), strict=True):
        by_arm = float(np.linalg.norm(place[a] - place[b]))
        if touched[a] and touched[b] and abs(by_arm - length) > 2 * SUSPECT:
            unit = next((u for f, u in UNITS if abs(length * f / by_arm - 1) < NEAR_LENGTH), "")
            raise InputError(
                f"{rows.file()}: the length of {length / MM:.4g} mm between '{rows.fixed.names[a]}' and "
                f"'{rows.fixed.names[b]}', which the arm has {by_arm / MM:.4g} mm apart"
                f"{f': is it {unit}?' if unit else ''}; mend [[length]] in the artefact's file"
            )


def _check_exchanged(model: ArmModel, rows: Measurements, frames: InstrumentFrames | None, distance: float) -> None:
    """Raises InputError where touches fit once the names of two spheres are exchanged."""
    if int(rows.kind[0]) != TOUCH:
        return
    names = rows.fixed.names
    for a, b in combinations(range(len(names)), 2):
        renamed = replace(rows, ends=replace(rows.ends, place=exchanged(len(names), a, b)[rows.ends.place]))
        if _median_distance(model, renamed, rows.theta, 1.0, frames) < distance / BETTER:
            raise InputError(
                f"{rows.file()}: the touches fit where '{names[a]}' and '{names[b]}' are exchanged; mend them"
            )


def _check_conventions(robot: Robot, model: ArmModel, rows: Measurements, frames: InstrumentFrames | None) -> None:
    """Raises InputError when another reading of the joint columns explains the places much better: says which."""
    if len(np.unique(rows.pose)) < FEWEST and frames is None:
        return

    def distance_of(pendant: Array) -> Array:
        return _distances(model, rows, robot.to_theta(pendant), 1.0, frames)

    as_given = nearest_mean(_distances(model, rows, rows.theta, 1.0, frames))
    if as_given <= SUSPECT:
        return
    pendant, coupling = robot.to_pendant(rows.theta), coupling_of(robot.pendant_map)
    better = better_reading(pendant, distance_of, as_given, coupling)
    limit = as_given / BETTER if better is None else better[1]
    if frames is None and int(rows.kind[0]) != DISTANCE:
        _check_mirrored(model, rows, as_given, min(limit, 2 * SUSPECT))
    if better is not None:
        words, explained = better
        raise InputError(
            f"{rows.file()}: the nominal arm misses the {_MEASURED[int(rows.kind[0])].words} by "
            f"{as_given / MM:.0f} mm, and by {explained / MM:.1f} "
            f"mm where {words}; mend the columns, or the pendant table of robot '{robot.name}' (joint order, signs, J3)"
        )


def _check_mirrored(model: ArmModel, rows: Measurements, as_given: float, limit: float) -> None:
    """Raises InputError where mirrored places explain the joints to less than a limit [m], better than as given."""
    mirrored = nearest_mean(_distances(model, rows, rows.theta, MIRROR, None))
    if mirrored < limit:
        words = _MEASURED[int(rows.kind[0])].words
        raise InputError(
            f"{rows.file()}: the nominal arm misses the {words} by {as_given / MM:.0f} mm, and by {mirrored / MM:.1f} "
            "mm where they are mirrored: two of x y z are exchanged, one has the opposite sign, or J1, J4 and J6 all "
            "have; mend the columns"
        )


def _median_distance(
    model: ArmModel, rows: Measurements, theta: Array, factor: float, frames: InstrumentFrames | None
) -> float:
    """Median distance of measured positions from the arm, with the best frames unless they are given [m]."""
    return float(np.median(_distances(model, rows, theta, factor, frames)))


def _distances(
    model: ArmModel, rows: Measurements, theta: Array, factor: float | Array, frames: InstrumentFrames | None
) -> Array:
    """Distance of each measured position from the arm, with the best frames unless they are given, (N,) [m]."""
    scaled = replace(rows, theta=theta, position=rows.position * factor)
    if int(scaled.kind[0]) == DISTANCE:
        scaled = replace(scaled, ends=replace(scaled.ends, distance=scaled.ends.distance * factor))
    else:
        scaled = replace(scaled, fixed=replace(scaled.fixed, place=scaled.fixed.place * factor))
    position, rotation = model.pose(scaled, np.zeros(len(model.parameters)))
    return measured_distance(frames or initial_frames(scaled, position, rotation), scaled, position, rotation)


@dataclass(frozen=True, eq=False, slots=True)
class JointReading:
    """A way to read the columns of joints."""

    words: str  # what fits
    matrix: Array  # (6, 6) C
    offset: Array  # (6,) [rad] c

    def of(self, pendant: Array) -> Array:
        """The angles that the pendant would show, (N, 6) [rad]."""
        return np.asarray(pendant @ self.matrix.T + self.offset)


def readings(coupling: int) -> list[JointReading]:
    """All that are tried.

    Args:
        coupling: Of J2 in theta_3 by the robot file, 1 or -1 where J3 counts against the horizontal, 0 where alone.
    """
    still, unit = np.zeros(6), np.eye(6)
    of_j2 = np.outer(unit[2], unit[1])  # in theta_3
    signs = [
        JointReading(f"J{k + 1} fits with the opposite sign", unit - 2 * np.diag(unit[k]), still) for k in range(6)
    ]
    twice = f"{COUPLED[coupling]}, which the robot file has already" if coupling else ""
    coupled = [
        JointReading(COUPLED.get(coupling + more, twice), unit + more * of_j2, still)
        for more in ((-coupling, coupling, -2 * coupling) if coupling else (-1, 1))
    ]
    turned = [
        JointReading(f"J{k + 1} fits with its zero turned by {turn:+d} deg", unit, unit[k] * turn * DEG)
        for k in range(6)
        for turn in (-90, 90, 180)
    ]
    if coupling:  # the sign of theta_2 alone: theta_3 keeps its own
        alone = unit - 2 * np.diag(unit[1]) + 2 * coupling * of_j2
        signs.insert(2, JointReading(f"{signs[1].words}, and J3 as it is against the horizontal", alone, still))
    swapped = [
        JointReading(f"J{i + 1} and J{j + 1} fit exchanged", unit[exchanged(6, i, j)], still)
        for i, j in ((0, 1), (1, 2), (3, 4), (4, 5), (3, 5))
    ]
    return [*signs, *coupled, *turned, *swapped]


def better_reading(
    pendant: Array, distance_of: Callable[[Array], Array], as_given: float, coupling: int
) -> tuple[str, float] | None:
    """What explains measured places much better than the angles as they stand.

    Args:
        pendant: Angles of the poses, (M, 6) [rad].
        distance_of: Distances of the rows from the nominal arm at pendant angles, (M, 6) [rad] to (N,) [m].
        as_given: Their mean as the angles stand [m].
        coupling: Of J2 in theta_3 by the robot file (``readings``).

    Returns:
        In words, and the mean distance as it then is [m]; None where nothing is much better.
    """
    words: list[str] = []
    best, angles = as_given, pendant
    for _ in range(2):
        tried = [(nearest_mean(distance_of(reading.of(angles))), reading) for reading in readings(coupling)]
        least = min(mean for mean, _ in tried)
        # J5 reversed is J4 turned by 180 deg as well: the sign is named, which stands first
        nearest, reading = next(pair for pair in tried if pair[0] <= least * ALIKE + EXACT)
        if nearest * HELPS > best:
            break
        words.append(reading.words)
        best, angles = nearest, reading.of(angles)
        if best * BETTER < as_given and best < 2 * SUSPECT:
            break
    return ("; ".join(words), best) if words and best * BETTER < as_given else None


def nearest_mean(distance: Array) -> float:
    """Of the nearest rows: a few that were misread say nothing of the columns [m]."""
    nearest = np.sort(distance)[: max(1, int(KEPT * len(distance)))]
    return float(nearest.mean())
