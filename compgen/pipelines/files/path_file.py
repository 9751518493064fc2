"""Path files to jobs: TOML with overrides, checked against ``schema``, turned into SI."""

import json
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from compgen.compensation.problem import Settings
from compgen.compensation.tables import settings_of
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.other_units import values_in_other_units
from compgen.core.recorded.table import read_findings
from compgen.core.toml import TomlText, check, input_keys, override, read_toml, read_toml_text, shipped
from compgen.core.units import DEG, HOUR, MINUTE, MM, UM
from compgen.core.version import __version__
from compgen.error_model.direction_memory import reversal_widths
from compgen.job.anchored_start import cell_with_state, history_from_state, load_state, refuse_outlived, state_note
from compgen.job.bounds import OwnFile
from compgen.job.day_before import Programs, plan_history
from compgen.job.job import Cell, Job, PathPlan, Process, ProgramPlan, Tool
from compgen.job.motion_plan import coarse_motion, leads_in, run_in_length
from compgen.job.part_frame import frame_of
from compgen.job.tables import bounds_of
from compgen.job.uncertainty import refuse_without_uncertainty
from compgen.pipelines.files.project_file import Project, find_project
from compgen.pipelines.files.robot_file import cell_of, find_robot, refuse_unprintable, with_other_heat_model
from compgen.pipelines.files.schema import HISTORY, PathFile
from compgen.planning.boundaries import Boundary, unbounded
from compgen.planning.boundary_schema import boundary_from_table
from compgen.planning.curves import PiecewiseCurve
from compgen.planning.exact_path import ExactPath
from compgen.planning.own_points.csv_points import points_table
from compgen.planning.own_points.tables import (
    OwnPoints,
    PointsTable,
    mesh_of,
    own_points_path,
    pattern_on_mesh,
    through,
)
from compgen.planning.tables import (
    MAX_LEAD,
    AnyPattern,
    ProcessTable,
    RasterTable,
    Shape,
    leaning_pattern,
    pattern_findings,
    pattern_from_table,
    surface_from_table,
)
from compgen.robot.inverse_kinematics import Posture
from compgen.robot.tables import TOOL_POSE, ToolTable, tool_pose
from compgen.thermal import Ambient, JointMotion, still_air, tables
from compgen.thermal.ensemble import Ensemble, started
from compgen.thermal.log_end import end_of
from compgen.thermal.schedule import History
from compgen.verification.own_file.second_reading import read_own_file

RUN_IN_STEP = 5.0  # mm by which a lead is shortened where the arm cannot reach its end


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
    return job_of(read_job_files(path_file, robot, overrides))


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class JobFiles:
    """The files of a job as they were read, overrides put in."""

    source: Path
    path_data: dict[str, Any]
    robot_source: Path
    robot_text: TomlText
    overrides: tuple[str, ...]
    project: Project | None = None
    may_start_late: bool = True  # False: unless its tables say so, the robot never stands before the start

    def __call__(self, driven: JointMotion | None) -> Job:
        """The job that they describe; unlike a function, two of the same files compare as the same."""
        return job_of(self, driven)


def read_job_files(path_file: str, robot: str | None, overrides: Sequence[str]) -> JobFiles:
    """A path file and its robot's file with the overrides on both.

    Raises:
        InputError: A file, or an override, that cannot be read.
    """
    source = Path(path_file)
    refuse_unprintable(overrides)
    for_robot = [o for o in overrides if o.startswith("robot.")]
    data = read_toml(source, "paths")
    if "dh" in data:
        raise InputError(f"{source}: a robot file, and a path file is wanted; name the robot there, or with --robot")
    project = find_project(source.resolve().parent, Path.cwd())
    typed = [*(["robot"] if robot else []), *(item.partition("=")[0].strip() for item in overrides)]
    project = project and project.filling(data, typed)
    for item in (o for o in overrides if o not in for_robot):
        override(data, item, item)
    path = check(PathFile, data, str(source))
    named_in = project.source if project and project.gives_robot else source
    arm_file = find_robot(path.robot if robot is None else robot, source, named_in)
    text = read_toml_text(arm_file, "robots")
    for item in for_robot:
        override(text.tables, item.removeprefix("robot."), item)
    return JobFiles(
        source=source, path_data=data, robot_source=arm_file, robot_text=text, overrides=(*overrides,), project=project
    )


def job_of(files: JobFiles, driven: JointMotion | None = None) -> Job:
    """The job that its files describe; ``driven`` is its program's motion as written, where that is known.

    Raises:
        InputError: Anything wrong, naming file and key.
    """
    source, path = files.source, check(PathFile, files.path_data, str(files.source))
    cell = cell_of(files.robot_text, files.robot_source, [o for o in files.overrides if o.startswith("robot.")])
    air, is_air_given = tables.ambient_of(path.ambient, str(source)), path.ambient.is_given
    log, read = None, tables.notes_of_air(path.ambient, str(source))
    if path.log is not None and path.state is None:
        log = tables.log_of(path.log, cell.heat, cell.warmth, cell.sensors, path.ambient, str(source))
        read += log.notes
        if not is_air_given:
            air = still_air(log.last_air)  # the file does not say how warm the air is: as the log left it
    settings = _settings(path, cell)
    program, notes = _program(path, str(source), cell, settings.rate)
    notes = (*(files.project.notes if files.project else ()), *notes, *read_findings(read))
    programs = programs_of(program, cell, driven)
    state_file = "" if path.state is None else os.path.normpath(source.parent / path.state.file)
    age = 0.0 if path.state is None else path.state.age_min * MINUTE
    state = load_state(state_file, cell, age, path.ambient.counts_from) if state_file else None  # before hashes
    others = files_read(path, str(source)) | (files.project.record(source) if files.project else {})
    history = _planned_day(path, programs, air)
    notes = (*notes, *read_findings(tables.held_air(path.ambient, air, history)))
    if files.may_start_late or path.state or path.start or path.compensation.average_over:
        history = replace(history, standing=programs.standing())
    if log is not None:
        end = end_of(log, cell.heat, cell.warmth, partial(programs.motion, "", program.process.feed))
        cell = replace(cell, heat=end.heat, warmth=end.warmth)
    if state is not None:
        latest = age + tables.latest_delay(path.start, path.compensation.average_over)
        refuse_outlived(state, state_file, latest, "at its latest start")
        cell = cell_with_state(cell, state, state_file)
        history = history_from_state(history, state, age, air if is_air_given else None)
        replaced = " and ".join(n for n, given in (("[[before]]", path.before), ("[log]", path.log)) if given)
        notes = (*notes, state_note(state, age, replaced, cell, history.air if is_air_given else None))
    if path.start or not path.compensation.average_over:
        history = started(history, tables.start_of(path.start, len(history.runs), str(source)))
    job = Job(
        name=source.stem,
        title=path.title,
        plan=program,
        cell=cell,
        history=history,
        settings=settings,
        start_drift=path.compensation.start_drift_um * UM,
        bounds=bounds_of(path.bounds, str(source)),
        overrides=files.overrides,
        inputs_hash=_inputs_hash(files, others),
        inputs={"path": {**input_keys(path), "robot": files.robot_source.stem}, "files": others, "robot": cell.inputs},
        input_findings=(*values_in_other_units(files.path_data, str(source)), *cell.input_findings, *notes),
        on_other_heat_model=_on_other_heat_model(files),
        log=log,
        own_file=_own_file(path, source),
        ensemble=_ensemble(path, len(history.runs), program),
    )
    refuse_without_uncertainty(job)
    return job


def _planned_day(path: PathFile, programs: Programs, air: Ambient) -> History:
    """What a path file says that the cell does before, between and after runs of its program."""
    source, feed = programs.plan("").source, programs.plan("").process.feed
    stretches = (("before", path.before), ("cycle", path.cycle), ("after", path.after))
    parts = [tables.steps_of(rows, name, source, feed) for name, rows in stretches]
    shifts = tables.shifts_of(path.shift, [row for _, rows in stretches for row in rows], source)
    return plan_history(programs, air, parts, shifts, path.ambient.clock_h * HOUR)


def _ensemble(path: PathFile, runs: int, program: ProgramPlan) -> Ensemble | None:
    """The starts that one file shall serve; None: the planned one alone."""
    table, where = path.compensation.average_over, f"{program.source}: compensation.average_over"
    return None if table is None else tables.ensemble_of(table, runs, program.process.feed, where)


def _on_other_heat_model(files: JobFiles) -> JobFiles | None:
    """The same files with the robot's other model of heat in use, for a flight on time; None where it has one only."""
    other = with_other_heat_model(files.robot_text)
    return None if other is None else replace(files, robot_text=other, may_start_late=False)


def _inputs_hash(files: JobFiles, others: Mapping[str, Mapping[str, Any]]) -> str:
    """Of everything that a job's result follows from: its tables, those of its robot, and the files that they name."""
    data = [_without_state_file(files.path_data), files.robot_text.tables]
    hashes = [other["sha256"] for other in others.values()]
    inputs = json.dumps([__version__, files.source.stem, *data, *hashes], sort_keys=True, default=str)
    return sha256(inputs.encode()).hexdigest()


def _own_file(path: PathFile, source: Path) -> OwnFile | None:
    """The user's own path as the judge reads it."""
    table = path.path
    if not isinstance(table, OwnPoints):
        return None
    shift = np.array([table.x_mm, table.y_mm, table.z_mm]) * MM
    file, joined = source.parent / table.file, through(table) == "lines"
    recorded = points_table(file, table) if isinstance(table, PointsTable) else None
    return read_own_file(file, table.pattern, shift, recorded, joined=joined)


def _without_state_file(data: dict[str, Any]) -> dict[str, Any]:
    """A path file's tables without where a state's file lies: its contents are an input, not its place."""
    state = data.get("state")
    return {**data, "state": {k: v for k, v in state.items() if k != "file"}} if isinstance(state, dict) else data


def programs_of(plan: ProgramPlan, cell: Cell, driven: JointMotion | None = None) -> Programs:
    """Motions of a program and, by their names, of those that its path file's day names, at any feed."""
    return Programs(plan, cell, lambda name: _other_program(find_program(name, plan.source), cell), driven)


def _other_program(path_file: str, cell: Cell) -> ProgramPlan:
    """What the program of another path file does in a cell; its own robot and history are not looked at."""
    path = _without_history(path_file)
    return _program(path, path_file, cell, _settings(path, cell).rate)[0]


def _without_history(path_file: str) -> PathFile:
    data = {"bounds": {}} | {k: v for k, v in read_toml(Path(path_file), "paths").items() if k not in HISTORY}
    return check(PathFile, data, path_file)


def _settings(path: PathFile, cell: Cell) -> Settings:
    return settings_of(
        path.compensation,
        axisymmetric=path.tool.axisymmetric,
        has_play=reversal_widths(cell.sources) is not None,
        is_identified=cell.held_out is not None,
    )


def _process(table: ProcessTable, acc: int | None) -> Process:
    """How a path is driven; ``acc`` is the controller's [%]."""
    return Process(
        feed=table.feed_mm_s * MM,
        chord=table.chord_um * UM,
        spacing=table.spacing_mm * MM,
        arcs=table.moves == "arcs",
        thin=None if table.thin_um is None else table.thin_um * UM,
        lift=table.lift_mm * MM,
        lead_in=table.lead_in,
        stop_on_the_part=table.page_stops == "anywhere",
        acc=table.acc_percent if table.acc_percent is not None else acc,
    )


def _program(path: PathFile, source: str, cell: Cell, rate: float) -> tuple[ProgramPlan, tuple[Finding, ...]]:
    """What a path file's program does, and what was changed in it for the play of a cell's robot."""
    frame = frame_of(path.frame, cell.robot.controller.decimals, source)
    process, controller = path.process, cell.robot.controller
    tool = _tool(path.tool, controller.payload, source)
    _check_name(source)
    if process.lead_in and process.lift_mm == 0:
        raise InputError(f"{source}: process.lead_in: it begins above the part, and lift_mm = 0; raise process.lift_mm")
    boundary = boundary_from_table(path.boundary, source)
    surface = surface_from_table(path.surface, path.path, source)
    mesh = mesh_of(path.surface, source) if path.surface.kind == "stl" else None

    def patterned(table: Shape) -> tuple[PiecewiseCurve, Boundary, tuple[Finding, ...]]:
        pattern, edge = pattern_from_table(table, boundary, source, process.lift_mm * MM)
        notes = pattern_findings(table, edge, path.boundary)
        if mesh is not None:
            shift = np.array([table.x_mm, table.y_mm, table.z_mm]) * MM
            on_mesh = pattern_on_mesh(path.surface, mesh, pattern, edge, shift, tool.spin, source)
            pattern, edge, notes = on_mesh.curve, unbounded(), (*notes, *on_mesh.notes)
        laid = ExactPath(curve=pattern, surface=surface, boundary=edge, spin=tool.spin)
        return leaning_pattern(process, laid, source), edge, notes

    tolerance = 0.0
    if isinstance(path.path, OwnPoints):
        placed = own_points_path(path.path, surface, tool.spin, process.feed_mm_s * MM, source, mesh)
        surface, edge, notes = placed.surface, boundary or unbounded(), placed.findings
        laid = ExactPath(curve=placed.curve, surface=surface, boundary=edge, spin=tool.spin)
        pattern = leaning_pattern(process, laid, source, standing=placed.standing)
        tolerance = path.path.tolerance_um * UM
    else:
        pattern, edge, notes = patterned(path.path)
    program = ProgramPlan(
        source=source,
        path=PathPlan(pattern=pattern, surface=surface, boundary=edge, frame=frame, tolerance=tolerance),
        process=_process(process, controller.acc),
        tool=tool,
        posture=Posture(path.posture.arm == "front", path.posture.elbow == "up", path.posture.wrist == "flip"),
    )
    program, longer = _with_run_in(program, cell, rate, path.path, patterned)
    return program, (*notes, *longer)


def _check_name(source: str) -> None:
    """Raises InputError where a path file's name gives no program a name."""
    name = Path(source).stem
    if not name.isprintable():
        raise InputError(f"{name!r}: a path file's name must be printable text; rename it")
    if not re.search("[A-Z0-9]", name.upper()):
        raise InputError(f"{source}: its name gives the program's, which has only A to Z, 0 to 9, _; rename the file")


def _tool(table: ToolTable, payload: int | None, source: str) -> Tool:
    """The tool of a path file; the controller's payload schedule holds where the file gives none."""
    offset = any(getattr(table, key) for key in TOOL_POSE)
    if offset and table.number == 0:
        raise InputError(f"{source}: tool.number: 0 is the flange itself; give the tool a number from 1 to 10")
    return Tool(
        number=table.number if table.number is not None else int(offset),
        pose=tool_pose(table, source),
        spin=table.spin_deg * DEG,
        sigma=tuple(value * UM for value in table.sigma_um),
        payload=table.payload if table.payload is not None else payload,
    )


def _with_run_in(
    program: ProgramPlan,
    cell: Cell,
    rate: float,
    table: AnyPattern,
    patterned: Callable[[Shape], tuple[PiecewiseCurve, Boundary, tuple[Finding, ...]]],
) -> tuple[ProgramPlan, tuple[Finding, ...]]:
    """The program with its sweeps begun so early that play is run through off the part, and a note that says so."""
    if not (isinstance(table, RasterTable) and leads_in(program.process, cell)):
        return program, ()
    wanted = min(run_in_length(program, cell, rate) / MM, MAX_LEAD)
    for lead in np.ceil(np.arange(wanted, table.lead_mm, -RUN_IN_STEP)):  # as far as the arm reaches
        longer_sweeps = table.model_copy(update={"lead_mm": lead})
        pattern, _, _ = patterned(longer_sweeps)
        longer = replace(program, path=replace(program.path, pattern=pattern))
        if coarse_motion(longer, cell.robot) is None:
            continue
        message = (
            f"sweeps run {lead:.0f} mm past the edge, not {table.lead_mm:g} (path.lead_mm), to run play through there"
        )
        finding = Finding.of(Code.PATH_LEAD_IN, f"{message}; process.lead_in = false keeps them short")
        return longer, (finding,)
    return program, ()


def find_program(name: str, path_file: str) -> str:
    """A path file by name: beside the path file that names it, in its project's ``paths/``, or shipped.

    Raises:
        InputError: It is nowhere.
    """
    file = name if name.endswith(".toml") else f"{name}.toml"
    beside = Path(path_file).resolve().parent
    for place in (beside, beside.parent / "paths", shipped() / "paths"):
        if os.path.isfile(place / file):  # no exception for a name that is too long
            return str(place / file)
    raise InputError(f"{path_file}: program '{name}' is unknown: no {file} beside this file; give a path file")


def files_read(path: PathFile, where: str) -> dict[str, dict[str, str]]:
    """Name and sha256 of each other file that a path file or a program of its day reads, by its key: inputs as well."""
    tables = {f"{key}.file": getattr(path, key) for key in ("ambient", "log", "state", "frame", "path", "surface")}
    named = {key: table.file for key, table in tables.items() if getattr(table, "file", None)}
    files = {key: {"file": name, "sha256": _hash_of(Path(where).parent / name)} for key, name in named.items()}
    for table, rows in (("before", path.before), ("cycle", path.cycle), ("after", path.after)):
        for key, name in ((f"{table}.{n}.program", row.program) for n, row in enumerate(rows) if row.program):
            file = find_program(name, where)
            files[key] = {"file": name, "sha256": _hash_of(Path(file))}
            files |= {f"{key}.{k}": record for k, record in files_read(_without_history(file), file).items()}
    return files


def _hash_of(source: Path) -> str:
    """Of a file's bytes without a first line that is for editors alone."""
    return sha256(re.sub(rb"\A#:schema [^\n]*\n", b"", source.read_bytes())).hexdigest()
