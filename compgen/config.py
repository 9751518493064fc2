"""Files to domain objects: TOML with overrides, checked against ``schema``, turned into SI."""

import json
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path

import numpy as np

from compgen import __version__, boundaries, patterns, surfaces
from compgen import schema as sc
from compgen.boundaries import Boundary
from compgen.exceptions import InputError
from compgen.ik import Posture, check_arm_class
from compgen.job import Job
from compgen.pieces import Pieces
from compgen.problem import Settings
from compgen.reading import check, find_robot, override, path_model, read_toml, suggest
from compgen.robot import Controller, Robot
from compgen.rotations import from_wpr
from compgen.sources import ThermalGrowth
from compgen.thermal import Duty, NodeModel, Profile, Section, growth_weights
from compgen.units import DEG, HOUR, KB, MDEG, MM, MS, UM
from compgen.verify import Bounds

MAX_SWEEPS = 1e4
LENGTHS = {"a1": ("a", 0), "a2": ("a", 1), "a3": ("a", 2), "d4": ("d", 3), "d6": ("d", 5)}


def load_robot(name: str) -> Robot:
    """A robot's nominal facts, by name or file.

    Raises:
        InputError: Unknown, or anything wrong in its file.
    """
    source = find_robot(name, Path("."))
    return _robot(check(sc.RobotFile, read_toml(source, "robots"), str(source)), str(source))


def load_job(path_file: str, robot: str | None = None, overrides: Sequence[str] = ()) -> Job:
    """Read a path file, its robot's file, and the overrides on both.

    Args:
        path_file: A TOML file.
        robot: Name or file of a robot; default what the path file says.
        overrides: ``key=value``, dotted; ``robot.`` leads into the robot file.

    Returns:
        The job in SI.

    Raises:
        InputError: Anything wrong, naming file and key.
    """
    source = Path(path_file)
    if robot == "":
        raise InputError("--robot: an empty name; give a robot's name or file")
    for item in overrides:
        if not item.isprintable():
            raise InputError(f"--set {item!r}: it holds what is not printable text; mend it")
    path_data = read_toml(source, "paths")
    for_robot = [o for o in overrides if o.startswith("robot.")]
    for item in overrides:
        if item not in for_robot:
            override(path_data, item, item)
    path = path_model(path_data, str(source))
    robot_source = find_robot(robot or path.robot, source)
    robot_data = read_toml(robot_source, "robots")
    for item in for_robot:
        override(robot_data, item.removeprefix("robot."), item)
    facts = check(sc.RobotFile, robot_data, str(robot_source))
    where = str(robot_source)
    if facts.controller.compensation == "unknown":
        raise InputError(
            f"{where}: controller.compensation: 'unknown' is refused, a correction could be applied twice; "
            "find out whether the controller corrects its own geometry and set 'none' or 'signature'"
        )
    arm = _robot(facts, where)
    heat = _heat(facts.thermal, where)
    profiles = _profiles(facts, arm, where)
    inputs = json.dumps([__version__, source.stem, path_data, robot_data], sort_keys=True, default=str)
    tool = path.tool
    angles = (np.array([a * DEG]) for a in (tool.w_deg, tool.p_deg, tool.r_deg))
    offset = any((tool.x_mm, tool.y_mm, tool.z_mm, tool.w_deg, tool.p_deg, tool.r_deg))
    if offset and tool.number == 0:
        raise InputError(f"{source}: tool.number: 0 is the flange itself; give the tool a number from 1 to 10")
    if not source.stem.isprintable():
        raise InputError(f"{source.stem!r}: a path file's name must be printable text; rename it")
    boundary = _boundary(path, str(source))
    pattern, edge = _pattern(path, boundary, str(source))
    return Job(
        name=source.stem,
        source=str(source),
        title=path.title,
        pattern=pattern,
        surface=_surface(path, str(source)),
        boundary=edge,
        chord=path.process.chord_um * UM,
        lift=path.process.lift_mm * MM,
        feed=path.process.feed_mm_s * MM,
        spin=tool.spin_deg * DEG,
        tool_number=tool.number if tool.number is not None else int(offset),
        tool_position=np.array([tool.x_mm, tool.y_mm, tool.z_mm]) * MM,
        tool_rotation=from_wpr(*angles)[0],
        posture=Posture(path.posture.arm == "front", path.posture.elbow == "up", path.posture.wrist == "flip"),
        settings=_settings(path),
        start_drift=path.compensation.start_drift_um * UM,
        before=_duties(path, str(source)),
        bounds=_bounds(path.bounds),
        robot=arm,
        heat=heat,
        profiles=profiles,
        sources=(_growth(arm, heat, profiles),),
        overrides=tuple(overrides),
        inputs_hash=sha256(inputs.encode()).hexdigest(),
    )


def _boundary(path: sc.PathFile, where: str) -> Boundary | None:
    table = path.boundary
    if table is None:
        return None
    round_ = table.shape == "circle"
    need, other = ("diameter_mm", "corner_to_corner_mm") if round_ else ("corner_to_corner_mm", "diameter_mm")
    if getattr(table, other) is not None or (round_ and table.rotation_deg is not None):
        extra = other if getattr(table, other) is not None else "rotation_deg"
        raise InputError(f"{where}: boundary.{extra}: conflicts with shape = '{table.shape}'; remove one of them")
    size = getattr(table, need)
    if size is None:
        raise InputError(f"{where}: boundary.{need}: missing; add it, a {table.shape} needs it")
    if round_:
        return boundaries.circle(size * MM)
    return boundaries.hexagon(size * MM, (table.rotation_deg or 0.0) * DEG)


def _pattern(path: sc.PathFile, boundary: Boundary | None, where: str) -> tuple[Pieces, Boundary]:
    """The pattern's pieces and the edge that marks contact."""
    edge = boundary or boundaries.unbounded()
    match path.path:
        case sc.LineTable(axis=axis, length_mm=length):
            return patterns.line(axis, length * MM), edge
        case sc.CircleTable(diameter_mm=diameter):
            return patterns.circle(diameter * MM), edge
        case sc.Iso9283Table(size_mm=size):
            return patterns.iso9283(size * MM), edge
        case sc.SpiralTable() as table:
            return _spiral(table, boundary, where), edge
        case sc.RasterTable() as table:
            if (table.diameter_mm is None) == (boundary is None):
                raise InputError(
                    f"{where}: path.diameter_mm: "
                    + (
                        "missing; give it, or a [boundary]"
                        if boundary is None
                        else "conflicts with [boundary]; remove one"
                    )
                )
            clip = boundary or boundaries.circle((table.diameter_mm or 0.0) * MM)
            smooth = table.turn == "smooth"
            if clip.half_height() * 2 / (table.stepover_mm * MM) > MAX_SWEEPS:
                raise InputError(f"{where}: path.stepover_mm: over {MAX_SWEEPS:.0f} sweeps; make it larger")
            try:
                return patterns.raster(clip, table.stepover_mm * MM, table.lead_mm * MM, smooth), clip
            except InputError as failure:
                raise InputError(f"{where}: {failure}") from failure
    raise InputError(f"{where}: path.pattern: not known to the reader")


def _spiral(table: sc.SpiralTable, boundary: Boundary | None, where: str) -> Pieces:
    if (table.turns is None) == (table.stepover_mm is None):
        raise InputError(f"{where}: path.turns: give turns or stepover_mm, one of them")
    whole = 2 * boundary.circumradius() if boundary else None
    diameter = table.diameter_mm * MM if table.diameter_mm is not None else whole
    if diameter is None:
        raise InputError(f"{where}: path.diameter_mm: missing; give it, or a [boundary]")
    if whole is not None and diameter < whole * (1 - 1e-9):
        raise InputError(
            f"{where}: path.diameter_mm: {diameter / MM:g} conflicts with [boundary], whose circumscribed circle is "
            f"{whole / MM:g} mm; remove one or make the spiral larger"
        )
    turns = table.turns if table.turns is not None else diameter / 2 / ((table.stepover_mm or 1.0) * MM)
    return patterns.spiral(diameter, turns)


def _surface(path: sc.PathFile, where: str) -> surfaces.Quadric:
    table = path.surface
    origin = np.array([path.path.x_mm, path.path.y_mm, path.path.z_mm]) * MM
    numbers = {k: getattr(table, k) for k in ("radius_of_curvature_m", "conic_constant", "off_axis_m")}
    if table.kind == "plane":
        for key, value in numbers.items():
            if value is not None:
                raise InputError(f"{where}: surface.{key}: a plane has none; set surface.kind = 'conic' or remove it")
        return surfaces.plane(origin)
    for key, value in numbers.items():
        if value is None:
            raise InputError(f"{where}: surface.{key}: missing; a conic needs it")
    try:
        return surfaces.conic(origin, *(float(v or 0.0) for v in numbers.values()))
    except InputError as failure:
        raise InputError(f"{where}: {failure}") from failure


def _duties(path: sc.PathFile, where: str) -> tuple[Duty, ...]:
    for i, b in enumerate(path.before):
        if b.state == "moving" and b.feed_mm_s is None:
            raise InputError(f"{where}: before.{i}.feed_mm_s: missing; state 'moving' needs it")
    return tuple(
        Duty(b.state, (b.feed_mm_s or 0.0) * MM if b.state == "moving" else 0.0, b.duration_h * HOUR)
        for b in path.before
    )


def _settings(path: sc.PathFile) -> Settings:
    c = path.compensation
    return Settings(
        clamp_position=c.clamp_mm * MM,
        clamp_rotation=c.clamp_deg * DEG,
        rate=c.rate_um_mm * UM / MM,
        rate_period=c.rate_period_mm * MM,
        curvature_period=c.curvature_period_mm * MM,
        free_spin=path.tool.axisymmetric,
    )


def _bounds(table: sc.BoundsTable) -> Bounds:
    def um(value: float | None) -> float | None:
        return None if value is None else value * UM

    axis = None if table.axis_mdeg is None else table.axis_mdeg * MDEG
    return Bounds(
        um(table.max_um), um(table.p99_um), um(table.rms_um), um(table.feed_um), um(table.cross_um),
        um(table.normal_um), axis,
    )  # fmt: skip


def _robot(facts: sc.RobotFile, where: str) -> Robot:
    limits = facts.limits
    ranges = [limits.j1_deg, limits.j2_deg, limits.j2_plus_j3_deg, limits.j4_deg, limits.j5_deg, limits.j6_deg]
    names = ["j1_deg", "j2_deg", "j2_plus_j3_deg", "j4_deg", "j5_deg", "j6_deg"]
    for name, pair in zip(names, ranges):
        if pair[0] >= pair[1]:
            raise InputError(f"{where}: limits.{name}: {pair} must rise; give the lower limit first")
    bounds = np.array(ranges) * DEG
    zero = np.array(facts.pendant.offset_deg) * DEG
    matrix = np.array(facts.pendant.matrix)
    if abs(np.linalg.det(matrix)) < 1e-9:
        raise InputError(f"{where}: pendant.matrix: it cannot be inverted; each joint needs its row")
    controller = facts.controller
    if len(set(controller.turn_joints)) != 3:
        raise InputError(f"{where}: controller.turn_joints: {controller.turn_joints} names a joint twice; name three")
    robot = Robot(
        name=facts.name,
        d=np.array(facts.dh.d_mm) * MM,
        a=np.array(facts.dh.a_mm) * MM,
        alpha=np.array(facts.dh.alpha_deg) * DEG,
        pendant_map=matrix,
        pendant_zero=zero,
        lower=bounds[:, 0] + zero,
        upper=bounds[:, 1] + zero,
        joint_names=("J1", "J2", "J2+J3", "J4", "J5", "J6"),
        speed=np.array(limits.speed_deg_s) * DEG,
        acceleration=np.array(limits.acceleration_deg_s2) * DEG,
        jerk=np.array(limits.jerk_deg_s3) * DEG,
        shoulder_margin=facts.singularity.shoulder_mm * MM,
        elbow_margin=facts.singularity.elbow_mm * MM,
        wrist_margin=facts.singularity.wrist_deg * DEG,
        controller=Controller(
            compensation="signature" if controller.compensation == "signature" else "none",
            period=controller.interpolation_ms * MS,
            max_lines=controller.max_lines,
            max_positions=controller.max_positions,
            memory=controller.memory_kB * KB,
            name_length=controller.name_length,
            turn_joints=(controller.turn_joints[0], controller.turn_joints[1], controller.turn_joints[2]),
        ),
    )
    check_arm_class(robot)
    return robot


def _heat(table: sc.ThermalTable, where: str) -> NodeModel:
    names = [n.name for n in table.node]
    if twice := next((n for n in names if names.count(n) > 1), None):
        raise InputError(f"{where}: thermal.node: the name '{twice}' stands twice; give each node its own")
    if table.box.feed_mm_s[0] >= table.box.feed_mm_s[1]:
        raise InputError(f"{where}: thermal.box.feed_mm_s: {table.box.feed_mm_s} must rise; give the lower feed first")
    return NodeModel(
        names=tuple(n.name for n in table.node),
        reference_rise=np.array([n.rise_K for n in table.node]),
        exponent=np.array([n.exponent for n in table.node]),
        tau=np.array([n.tau_h for n in table.node]) * HOUR,
        idle=table.idle_fraction,
        reference_feed=table.reference_feed_mm_s * MM,
        reference_time=table.reference_h * HOUR,
        box_feed=np.array(table.box.feed_mm_s) * MM,
        box_time=table.box.hours * HOUR,
        box_rise=table.box.rise_K,
    )


def _profiles(facts: sc.RobotFile, robot: Robot, where: str) -> tuple[Profile, ...]:
    thermal = facts.thermal
    rises = {n.name: n.rise_K for n in thermal.node}
    found = []
    for i, profile in enumerate(thermal.profile):
        key = f"{where}: thermal.profile.{i}"
        cte = thermal.cte_um_m_K
        if isinstance(cte, dict):
            if unknown := sorted(set(cte) - {p.length for p in thermal.profile}):
                raise InputError(f"{where}: thermal.cte_um_m_K.{unknown[0]}: no profile has this length")
            if profile.length not in cte:
                raise InputError(f"{where}: thermal.cte_um_m_K.{profile.length}: missing; add it")
            cte = cte[profile.length]
        start, sections = 0.0, []
        for s in profile.sections:
            for node in (s.from_, s.to):
                if node not in rises:
                    raise InputError(f"{key}: node '{node}' is unknown{suggest(node, list(rises))}")
            if s.to_mm * MM <= start:
                raise InputError(f"{key}: to_mm {s.to_mm:g} must be above the section before it")
            if s.shape == "exponential" and not (rises[s.from_] > 0 and rises[s.to] > 0):
                raise InputError(f"{key}: an exponential shape needs rises above zero at '{s.from_}' and '{s.to}'")
            sections.append(Section(start, s.to_mm * MM, s.from_, s.to, s.shape))
            start = s.to_mm * MM
        kind, axis = LENGTHS[profile.length]
        length = abs(float(getattr(robot, kind)[axis]))
        if abs(start - length) > 1e-9:
            raise InputError(f"{key}: sections end at {start / MM:g} mm, {profile.length} is {length / MM:g} mm long")
        found.append(Profile(profile.length, cte * UM, tuple(sections)))
    return tuple(found)


def _growth(robot: Robot, heat: NodeModel, profiles: Sequence[Profile]) -> ThermalGrowth:
    """Growth of each DH length; a length against its axis grows away from zero."""
    reference = dict(zip(heat.names, heat.reference_rise.tolist()))
    grown = {"a": np.zeros((6, len(heat.names))), "d": np.zeros((6, len(heat.names)))}
    for profile in profiles:
        kind, row = LENGTHS[profile.length]
        sign = np.sign(getattr(robot, kind)[row])
        grown[kind][row] += sign * growth_weights(profile, reference, heat.names)
    return ThermalGrowth(grown["a"], grown["d"])
