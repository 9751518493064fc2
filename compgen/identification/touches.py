"""Touches of an artefact's spheres and planes by a probe in the flange: both files, in SI."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from compgen.core.arrays import Array, IntArray, owns
from compgen.core.csv_table import CsvTable, quote_cell
from compgen.core.exceptions import InputError
from compgen.core.pose import JOINT_KEYS, POSE_KEYS, Pose
from compgen.core.recorded.table import read_table
from compgen.core.rotations import from_wpr, rotation_vector
from compgen.core.toml import check, read_toml, suggest
from compgen.core.units import DEG, MM, UM
from compgen.error_model.direction_memory import reversal_widths
from compgen.error_model.source import Source
from compgen.identification.measured_poses import (
    check_within_limits,
    columns_together,
    joints_given,
    numbers_or,
    refuse_doubled,
    row_labels,
    sigmas,
    words_or,
)
from compgen.identification.tables import ArtefactFile
from compgen.robot.configuration import apply_turns, parse_config
from compgen.robot.inverse_kinematics import solve_tool
from compgen.robot.kinematics import flange_pose
from compgen.robot.robot import Robot

NORMAL = ("nx", "ny", "nz")
KNOWN = ("time_s", "target", *POSE_KEYS, "config", *JOINT_KEYS, *NORMAL, "value_mm", "sigma_um")
_VECTOR = re.compile(r"(?i)(?:^|[^a-z])[ijk]$|^(?:norm|vec|dir)[a-z]*[ _]?[xyz]$")  # how others call a direction
CERTIFIED_AT = 20.0  # degC
LEAST_CTE = 0.1  # um/m/K: of no material but 0; glass ceramics have less and are given as 0
UNIT = 1e-3  # of the length of a direction
OTHER = 0.01  # share by which a length may differ from the distance of its spheres' places
UNITS = {"": 1.0, "metres": 1e3, "inches": 25.4}  # in millimetres
NEARBY = 0.05  # [m] of a place: meant is that one
STEP = 1e-6  # [rad] of the difference quotient


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(
    place=("S", 3),
    sigma=("S",),
    diameter=("S",),
    probe=(3,),
    between=("L", 2),
    length=("L",),
    length_sigma=("L",),
    point=("R", 3),
    normal=("R", 3),
    plane_sigma=("R",),
)
class Artefact:
    """S spheres and R planes in the artefact's own coordinates, and the probe."""

    source: str
    frame: str  # "world", or "uframe 1": that touches are commanded in
    names: tuple[str, ...]
    place: Array  # (S, 3) [m] at the temperature of touching; NaN: unknown
    sigma: Array  # (S,) [m]
    diameter: Array  # (S,) [m]; NaN: unknown
    probe: Array  # (3,) [m] its centre in the flange
    probe_diameter: float  # [m]
    between: IntArray  # (L, 2) spheres whose distance is given
    length: Array  # (L,) [m] at the temperature of touching
    length_sigma: Array  # (L,) [m]
    certified: bool | None  # whether places and lengths are; None: not said
    planes: tuple[str, ...] = ()
    point: Array = field(default_factory=lambda: np.zeros((0, 3)))  # (R, 3) [m] of each plane, as the places
    normal: Array = field(default_factory=lambda: np.zeros((0, 3)))  # (R, 3) out of the material
    plane_sigma: Array = field(default_factory=lambda: np.zeros(0))  # (R,) [m] along it
    taught: Mapping[str, float] | None = None  # [K] rises of the robot that taught the places; None: an instrument did

    @property
    def targets(self) -> tuple[str, ...]:
        """Names of what can be touched: the spheres, then the planes."""
        return *self.names, *self.planes


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(time=("N",), target=("N",), theta=("N", 6), normal=("N", 3), deflection=("N",), sigma=("N",))
class Touches:
    """N touches."""

    label: tuple[str, ...]  # file and line
    time: Array  # (N,) [s]
    timed: bool  # whether the file gives times
    target: IntArray  # (N,) which sphere; S and up: which plane
    theta: Array  # (N, 6) [rad] commanded
    normal: Array  # (N, 3) probing direction in World, unit; NaN: the sphere's centre was located
    deflection: Array  # (N,) [m] by which the probe's ball was pushed back along it
    sigma: Array  # (N,) [m] of one coordinate; NaN: not said
    notes: tuple[str, ...] = ()  # how a file of another writer's form was understood

    @property
    def file(self) -> str:
        """The file that they are from."""
        return self.label[0].rsplit(": line", 1)[0]


def read_artefact(source: str) -> Artefact:
    """An artefact's file.

    Raises:
        InputError: Anything wrong, naming file and key.
    """
    mend = "--artefact names the file that says what was touched"
    file = check(ArtefactFile, read_toml(Path(source), "paths", mend), source)
    _check_growth(source, file)
    grown = 1 + file.artefact.cte_um_m_K * UM * (file.artefact.temperature_degC - CERTIFIED_AT)
    place = _places(source, file) * MM * grown
    if not (file.sphere or file.plane):
        raise InputError(f"{source}: sphere: missing; say what was touched, in [[sphere]] or [[plane]]")
    names, planes = tuple(s.name for s in file.sphere), tuple(p.name for p in file.plane)
    doubled = next((n for n in (*names, *planes) if (*names, *planes).count(n) > 1), None)
    if doubled is not None:
        kind = "sphere" if doubled in names else "plane"
        raise InputError(f"{source}: {kind} '{doubled}' stands twice; give each a name of its own")
    normals = np.array([p.normal for p in file.plane]).reshape(-1, 3)
    _check_normals(source, normals)
    _check_lengths(source, file, names, place, grown)
    probe = file.probe
    return Artefact(
        source=source,
        frame=file.artefact.frame,
        names=names,
        place=place,
        sigma=np.array([s.sigma_um * UM for s in file.sphere]),
        diameter=np.array([s.diameter_mm for s in file.sphere], dtype=float) * MM,
        probe=np.array([probe.x_mm, probe.y_mm, probe.z_mm]) * MM,
        probe_diameter=probe.diameter_mm * MM,
        between=np.array([[names.index(n) for n in length.between] for length in file.length], dtype=int).reshape(
            -1, 2
        ),
        length=np.array([length.mm * MM * grown for length in file.length]),
        length_sigma=np.array([length.sigma_um * UM for length in file.length]),
        certified=file.artefact.certified,
        planes=planes,
        point=np.array([[p.x_mm, p.y_mm, p.z_mm] for p in file.plane]).reshape(-1, 3) * MM * grown,
        normal=normals,
        plane_sigma=np.array([p.sigma_um * UM for p in file.plane]),
        taught=None if file.artefact.taught is None else dict(file.artefact.taught.rise_K),
    )


def _places(source: str, file: ArtefactFile) -> Array:
    """The spheres' places as given, (S, 3) [mm]; NaN where a sphere has none."""
    place = np.array([[s.x_mm, s.y_mm, s.z_mm] for s in file.sphere], dtype=float).reshape(-1, 3)
    for i in np.flatnonzero(np.isnan(place).any(axis=1) & ~np.isnan(place).all(axis=1)).tolist():
        raise InputError(f"{source}: sphere.{i}: x_mm, y_mm and z_mm go together; give all three or none")
    return place


def _check_normals(source: str, normals: Array) -> None:
    """Raises InputError for a plane's normal that is no unit vector."""
    for i, length in enumerate(np.linalg.norm(normals, axis=1).tolist()):
        if abs(length - 1) > UNIT:
            raise InputError(
                f"{source}: plane.{i}.normal: its length is {length:.4g}, not 1; give a unit vector out of the material"
            )


def _check_growth(source: str, file: ArtefactFile) -> None:
    """Raises InputError where an expansion is missing, or of no material in um/m/K."""
    cte, given = file.artefact.cte_um_m_K, file.artefact.model_fields_set
    if 0 < cte < LEAST_CTE:
        raise InputError(
            f"{source}: artefact.cte_um_m_K: {cte:g} is below {LEAST_CTE:g}: is it in 1/K or mm/m/K? steel has 11.5; "
            "what does not grow has 0"
        )
    if "temperature_degC" in given and "cte_um_m_K" not in given and file.artefact.temperature_degC != CERTIFIED_AT:
        raise InputError(
            f"{source}: artefact.cte_um_m_K: missing, so that temperature_degC moves nothing; give the artefact's "
            "expansion, 0 if it has none"
        )


def _check_lengths(source: str, file: ArtefactFile, names: tuple[str, ...], place: Array, grown: float) -> None:
    """Raises InputError where a length is not between two spheres, or not what their places say."""
    for i, length in enumerate(file.length):
        unknown = next((n for n in length.between if n not in names), None)
        if unknown is not None:
            raise InputError(f"{source}: length.{i}.between: no sphere '{unknown}'{suggest(unknown, names)}")
        if length.between[0] == length.between[1]:
            raise InputError(
                f"{source}: length.{i}.between: '{length.between[0]}' twice; a length is between two spheres"
            )
    for i, length in enumerate(file.length):
        a, b = (names.index(n) for n in length.between)
        by_places = float(np.linalg.norm(place[a] - place[b])) / MM / grown
        if np.isfinite(by_places) and abs(by_places - length.mm) > OTHER * length.mm:
            raise InputError(
                f"{source}: length.{i}.mm: {length.mm:g} between '{names[a]}' and '{names[b]}', whose places are "
                f"{by_places:.4g} mm apart; mend one of them"
            )


def read_touches(
    source: str, robot: Robot, artefact: Artefact, uframes: Mapping[int, Pose], *, planes: bool = False
) -> Touches:
    """A file of touches.

    Columns: ``target`` (a sphere), where the probe's centre was commanded when it touched, as ``x_mm`` to ``r_deg`` in
    the artefact's frame with ``config`` (else 'N U T'), or as ``j1_deg`` to ``j6_deg``; where measured ``time_s``,
    ``nx ny nz`` (probing direction in World) with ``value_mm`` (by how much the ball was pushed back along it), and
    ``sigma_um``. A row without a direction has located the sphere's centre.

    Args:
        source: A CSV file.
        robot: Whose joints they are.
        artefact: What was touched.
        uframes: What numbers of user frames mean, with which touches are commanded in one.
        planes: Whether planes may be touched as well.

    Raises:
        InputError: Anything wrong, naming file, line and column.
    """
    table = read_table(source, ("target",), KNOWN)
    vector = [n for n in table.recorded.left_out if _VECTOR.search(n)] if table.recorded else []
    if len(vector) > 2 and not table.has("nx"):
        raise InputError(
            f"{source}: columns {', '.join(vector[:3])}: the way the probe went, into the material? say columns = {{ "
            + ", ".join(f'{c} = "{name}"' for c, name in zip(NORMAL, vector, strict=False))
            + f" }} in {Path(source).name}.toml (of normals out of it turn the signs); remove them if the spheres' "
            "centres were located"
        )
    names = table.words("target")
    table.refuse_first(
        np.isin(names, artefact.planes) & (not planes),
        "target",
        lambda n: (
            f"'{names[n]}' is a plane: cgen anchor takes planes, identification and frames need spheres; leave its "
            "touches out"
        ),
    )
    known = f"is no sphere of {artefact.source} (known: {', '.join(artefact.targets)})"
    table.refuse_first(~np.isin(names, artefact.targets), "target", lambda n: f"{quote_cell(names[n])} {known}")
    if table.has("time_s"):  # the same touch at another time counts
        same = "the same touch at the same time_s as in line"
        refuse_doubled(table, zip(*table.columns, strict=True), lambda n, line: f"{same} {line}; keep one")
    target = np.array([artefact.targets.index(name) for name in names])
    theta = _joints(table, robot, artefact, uframes)
    normal, deflection = _directions(table, artefact, target)
    return Touches(
        label=tuple(row_labels(table)),
        time=numbers_or(table, "time_s", np.arange(len(names), dtype=float)),
        timed=table.has("time_s"),
        target=target,
        theta=theta,
        normal=normal,
        deflection=deflection,
        sigma=sigmas(table, 0.1, 1e4, gaps=True) * UM,
        notes=table.notes,
    )


def check_directions(touches: Touches, inwards: Array) -> None:
    """Raises InputError where a probe would have moved away from what it touched.

    Args:
        touches: N of them; those without a direction are not judged.
        inwards: From the probe's centre into each target, (N, 3).
    """
    away = np.flatnonzero((touches.normal * inwards).sum(axis=1) < 0)
    if len(away):
        raise InputError(
            f"{touches.label[int(away[0])]}, columns nx, ny, nz: the direction points out of the target, at "
            f"{len(away)} of {len(inwards)} touches; give the one in which the probe moved, towards the material"
        )


def likely_unit(place: Array, known: Array) -> str:
    """The unit in which a place (3,) "in millimetres" is at one of some known ones, (S, 3) [m]; "" where it is none."""
    near = (u for u, f in UNITS.items() if (np.linalg.norm(f * place - known, axis=1) < NEARBY).any())
    return next(near, "")


def probing_directions(robot: Robot, theta: Array, normal: Array, least: float = 1e-6) -> Array:
    """Signs of the joints' speeds, from ``least`` [rad/m] up, while the flange moves along a direction, (M, 6)."""
    J = np.zeros((len(theta), 6, 6))
    flange = flange_pose(robot, theta)
    for k in range(6):
        moved = flange_pose(robot, theta + STEP * np.eye(6)[k])
        J[:, :3, k] = (moved.position - flange.position) / STEP
        J[:, 3:, k] = rotation_vector(moved.rotation @ np.swapaxes(flange.rotation, 1, 2)) / STEP
    wanted = np.concatenate([normal, np.zeros((len(theta), 3))], axis=1)
    speed = np.einsum("nij,nj->ni", np.linalg.pinv(J), wanted)
    return np.asarray(np.where(np.abs(speed) > least, np.sign(speed), 0.0))


def probed_motion(robot: Robot, sources: Sequence[Source], touches: Touches, least: float = 1e-6) -> Array:
    """The direction that each joint came with, (N, 6), where an arm has play and the probing direction says it."""
    sided = np.isfinite(touches.normal[:, 0])
    direction = np.zeros((len(touches.theta), 6))
    if reversal_widths(sources) is not None and sided.any():
        direction[sided] = probing_directions(robot, touches.theta[sided], touches.normal[sided], least)
    return direction


def _joints(table: CsvTable, robot: Robot, artefact: Artefact, uframes: Mapping[int, Pose]) -> Array:
    """Joints of each touch, (N, 6) [rad]: as given, or by the closed form."""
    given = joints_given(table, robot, "touches")
    theta = _inverse(table, robot, artefact, uframes) if given is None else given
    by = ": by x_mm to r_deg and config" if given is None else ""
    check_within_limits(robot, theta, lambda n, k: table.location(n) + by)
    return theta


def _inverse(table: CsvTable, robot: Robot, artefact: Artefact, uframes: Mapping[int, Pose]) -> Array:
    missing = next((c for c in POSE_KEYS if not table.has(c)), None)
    if missing is not None:
        raise InputError(
            f"{table.source}: column {missing}: missing; give where the probe was commanded: {', '.join(POSE_KEYS)}, "
            f"or {JOINT_KEYS[0]} to {JOINT_KEYS[-1]}"
        )
    values = np.column_stack([table.numbers(c) for c in POSE_KEYS])
    pose, tool = Pose(values[:, :3] * MM, from_wpr(*(values[:, 3:].T * DEG))), Pose(artefact.probe, np.eye(3))
    if artefact.frame != "world":
        number = int(artefact.frame.split()[1])
        if number not in uframes:
            raise InputError(
                f"{artefact.source}: artefact.frame: touches are commanded in user frame {number}; say where it is "
                "with --frames FILE, or give the joints"
            )
        pose = uframes[number] @ pose
    _check_units(table, artefact, values, pose)
    configs = words_or(table, "config", "N U T")
    theta = np.empty((len(values), 6))
    for n, text in enumerate(configs):
        posture, turns = parse_config(text)
        if posture is None:
            raise InputError(f'{table.location(n, "config")}: no CONFIG; give one as in "N U T, 0, 0, 0", in quotes')
        solved, margin = solve_tool(robot, pose[n : n + 1], tool, posture)
        if margin[0] < 0:
            raise InputError(
                f"{table.location(n)}: out of the arm's reach by {-margin[0] / MM:.0f} mm; are x_mm to r_deg of the "
                f"probe's centre, in {artefact.frame}?"
            )
        theta[n] = apply_turns(robot, solved, np.array([turns]))[0]
    return theta


def _check_units(table: CsvTable, artefact: Artefact, values: Array, pose: Pose) -> None:
    """Raises InputError where x_mm to r_deg (N, 6) as typed, poses in World, are of other units."""
    units = np.array([likely_unit(place, artefact.place) for place in values[:, :3] * MM])
    table.refuse_first(
        units != "", "", lambda n: f"x_mm, y_mm, z_mm are {units[n]}, as the artefact's places say; give mm"
    )
    largest = float(np.abs(values[:, 3:]).max())
    if 0 < largest < 3.15 and bool((pose.rotation[:, 2, 2] > 0.99).all()):  # 180 typed as 3.14 points up
        raise InputError(
            f"{table.source}: columns w_deg, p_deg, r_deg: at most {largest:.4g}, with the probe pointing up: they are "
            "radians; give W, P, R in degrees"
        )


def _directions(table: CsvTable, artefact: Artefact, target: IntArray) -> tuple[Array, Array]:
    """Probing directions (N, 3), and deflections (N,) [m]."""
    if table.has("value_mm") and not any(table.has(c) for c in NORMAL):
        raise InputError(f"{table.source}: column value_mm: a deflection has a direction; add nx, ny and nz")
    normal = columns_together(table, NORMAL, "a direction needs nx, ny and nz", "give all three or none")
    length = np.linalg.norm(normal, axis=1)
    table.refuse_first(
        np.abs(length - 1) > UNIT,
        "nx",
        lambda n: f"the direction's length is {length[n]:.4g}, not 1; give the unit vector in which the probe moved",
    )
    for n in np.flatnonzero(np.isfinite(length)).tolist():
        if target[n] < len(artefact.names) and np.isnan(artefact.diameter[target[n]]):
            raise InputError(
                f"{artefact.source}: sphere '{artefact.names[target[n]]}': diameter_mm: missing; a touch from one side "
                f"({table.location(n)}) needs it"
            )
    deflection = table.numbers("value_mm", gaps=True, largest=100.0) if table.has("value_mm") else np.zeros(len(target))
    table.refuse_first(
        np.isnan(length) & (np.nan_to_num(deflection) != 0),
        "value_mm",
        lambda n: f"{deflection[n]:g}: a deflection has a direction; give nx, ny and nz of this touch",
    )
    return normal, np.nan_to_num(deflection) * MM
