"""Path files to jobs: TOML with overrides, checked against ``schema``, turned into SI."""

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from compgen import __version__, boundaries, heating, patterns, surfaces
from compgen import schema as sc
from compgen.agenda import plan
from compgen.boundaries import Boundary
from compgen.cells import cell_of, load_cell, load_robot, refuse_unprintable
from compgen.exceptions import InputError
from compgen.ik import Posture
from compgen.job import Job
from compgen.pieces import Pieces
from compgen.problem import Settings
from compgen.reading import check, find_robot, override, path_model, read_toml
from compgen.rehearsal import rehearse
from compgen.rotations import from_wpr
from compgen.tables import told
from compgen.thermal import Ambient, Duty
from compgen.thermal.losses import mean_losses
from compgen.thermal.measured import explain
from compgen.thermal.network import Network
from compgen.units import DEG, HOUR, MDEG, MINUTE, MM, UM
from compgen.verify import Bounds

__all__ = ["load_before", "load_cell", "load_job", "load_robot"]

MAX_SWEEPS = 1e4
HISTORY = ("before", "cycle", "after", "shift", "ambient", "log")


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
    return _read(path_file, robot, overrides, alone=False)


def _read(path_file: str, robot: str | None, overrides: Sequence[str], alone: bool) -> Job:
    """``load_job``; a program that only warms the robot stands alone, without a history of its own."""
    source = Path(path_file)
    if robot == "":
        raise InputError("--robot: an empty name; give a robot's name or file")
    refuse_unprintable(overrides)
    path_data = read_toml(source, "paths")
    for_robot = [o for o in overrides if o.startswith("robot.")]
    for item in overrides:
        if item not in for_robot:
            override(path_data, item, item)
    if alone:
        path_data = {k: v for k, v in path_data.items() if k not in HISTORY}
    path = path_model(path_data, str(source))
    robot_source = find_robot(robot or path.robot, source)
    robot_data = read_toml(robot_source, "robots")
    for item in for_robot:
        override(robot_data, item.removeprefix("robot."), item)
    cell = cell_of(robot_data, str(robot_source), for_robot)
    air = heating.ambient(path.ambient, str(source))
    read = None
    if path.log is not None:
        read = heating.log(path.log, cell.sensors, path.ambient.reference_degC, str(source))
        if not told(path.ambient) - {"reference_degC", "clock_h"}:
            air = Ambient(np.zeros(1), read.air[-1:])  # nothing said of the air: as the log left it
    others = heating.files_read(path, str(source))
    inputs = json.dumps([__version__, source.stem, path_data, robot_data, *others], sort_keys=True, default=str)
    tool = path.tool
    angles = (np.array([a * DEG]) for a in (tool.w_deg, tool.p_deg, tool.r_deg))
    offset = any((tool.x_mm, tool.y_mm, tool.z_mm, tool.w_deg, tool.p_deg, tool.r_deg))
    if offset and tool.number == 0:
        raise InputError(f"{source}: tool.number: 0 is the flange itself; give the tool a number from 1 to 10")
    if not source.stem.isprintable():
        raise InputError(f"{source.stem!r}: a path file's name must be printable text; rename it")
    boundary = _boundary(path, str(source))
    pattern, edge = _pattern(path, boundary, str(source))
    job = Job(
        air=air,
        cycle=(),
        after=(),
        runs=(0.0,),
        standing=Duty("idle", 0.0, 1.0),
        name=source.stem,
        source=str(source),
        title=path.title,
        pattern=pattern,
        surface=_surface(path, str(source)),
        boundary=edge,
        chord=path.process.chord_um * UM,
        spacing=path.process.spacing_mm * MM,
        thin=None if path.process.thin_um is None else path.process.thin_um * UM,
        lift=path.process.lift_mm * MM,
        feed=path.process.feed_mm_s * MM,
        stop_on_the_part=path.process.page_stops == "anywhere",
        spin=tool.spin_deg * DEG,
        tool_number=tool.number if tool.number is not None else int(offset),
        tool_position=np.array([tool.x_mm, tool.y_mm, tool.z_mm]) * MM,
        tool_rotation=from_wpr(*angles)[0],
        posture=Posture(path.posture.arm == "front", path.posture.elbow == "up", path.posture.wrist == "flip"),
        settings=_settings(path),
        start_drift=path.compensation.start_drift_um * UM,
        before=(),
        bounds=_bounds(path.bounds),
        robot=cell.robot,
        heat=cell.heat,
        profiles=cell.profiles,
        sources=cell.sources,
        joint_box=cell.joint_box,
        overrides=tuple(overrides),
        inputs_hash=sha256(inputs.encode()).hexdigest(),
    )
    parts = [
        heating.steps(rows, name, str(source), job.feed)
        for name, rows in (("before", path.before), ("cycle", path.cycle), ("after", path.after))
    ]

    def load(name: str) -> Job:
        return _read(heating.find_program(name, str(source)), str(robot_source), for_robot, alone=True)

    job = plan(job, parts, heating.shifts(path.shift, str(source)), path.ambient.clock_h * HOUR, load)
    if read is None:
        return job
    loss: tuple[float, ...] = ()
    if isinstance(job.heat, Network):
        loss, _ = mean_losses(job.robot, job.heat.drives, rehearse(job, job.feed)[1])
    return replace(job, heat=explain(read, job.heat, loss).heat)


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
    if turns > MAX_SWEEPS:
        raise InputError(f"{where}: path.stepover_mm: over {MAX_SWEEPS:.0f} turns; make it larger")
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


def load_before(items: Sequence[str]) -> tuple[Duty, ...]:
    """What the cell did before, from the command line.

    Args:
        items: In order; each a TOML file with [[before]] tables, or a stretch in words: state, feed and duration, as in
            ``moving 200mm/s 5h``, ``idle 30min``, ``off 16h``, or as a table has it, ``feed_mm_s=200 duration_h=5``.

    Raises:
        InputError: Not understood; says which and how it is written.
    """
    found: list[Duty] = []
    for item in items:
        if item.endswith(".toml"):
            data = read_toml(Path(item), "paths")
            found += _plain_duties({"before": data.get("before", [])}, item)
        else:
            found += _plain_duties({"before": [stretch(item)]}, f"--before '{item}'")
    return tuple(found)


def _plain_duties(data: dict[str, Any], where: str) -> list[Duty]:
    """Stretches of a duration each, as a program that exists already needs them."""
    rows = check(sc.BeforeFile, data, where).before
    steps = heating.steps(rows, "before", where, 0.0)
    for step in steps:
        if step.repeat is not None or step.program or step.shifts:
            raise InputError(f"{step.key}: here only state, feed, duration and duty count; remove the rest")
    return [Duty(s.state, s.feed, s.duration or 0.0, s.share) for s in steps]


def stretch(item: str) -> dict[str, str | float]:
    """A stretch in words as a table."""
    table: dict[str, str | float] = {}
    for word in re.split(r"[\s,;:@]+", item.strip()):
        if word in ("moving", "idle", "off"):
            table["state"] = word
        elif feed := re.fullmatch(r"(?:feed_mm_s=)?(\d*\.?\d+)(?:mm/s(?:ec)?)?", word):
            if not (word.startswith("feed") or word.endswith(("s", "c"))):
                raise InputError(f"--before '{item}': {word} has no unit; write it as in 'moving 200mm/s 5h'")
            table["feed_mm_s"] = float(feed[1])
        elif time := re.fullmatch(r"(\d*\.?\d+)(h|min|s)", word):
            table["duration_h"] = float(time[1]) * {"h": HOUR, "min": MINUTE, "s": 1.0}[time[2]] / HOUR
        elif pair := re.fullmatch(r"(state|duration_h)=(\S+)", word):
            table[pair[1]] = pair[2] if pair[1] == "state" else _plain(pair[2], item)
        else:
            raise InputError(f"--before '{item}': {word!r} is not understood; write it as in 'moving 200mm/s 5h'")
    return {"state": "moving" if "feed_mm_s" in table else "idle", **table}


def _plain(text: str, item: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"--before '{item}': {text!r} is not a number") from None


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
