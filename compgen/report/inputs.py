"""What a page was made from, in words that a customer can read: files, robot, tool, frame, feed, history, overrides."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from compgen.core.pose import Pose
from compgen.core.rotations import to_wpr
from compgen.core.units import DEG, HOUR, MINUTE, MM, UM
from compgen.job.job import Cell, Job
from compgen.pipelines.planned.many_starts import ensemble_words
from compgen.thermal import Duty
from compgen.thermal.ambient import Ambient

if TYPE_CHECKING:
    from compgen.pipelines.correct import Correction

SHORT = 12  # characters of a hash that tell two files apart
STRETCHES = 4  # of duty that are named one by one
COLD = "none given: the robot starts cold"


@dataclass(frozen=True, slots=True)
class Inputs:
    """What a page was made from: rows of a name and words, and the whole hash of each file."""

    rows: tuple[tuple[str, str], ...] = ()
    hashes: tuple[tuple[str, str], ...] = ()

    def with_rows(self, *rows: tuple[str, str]) -> "Inputs":
        """The same with further rows."""
        return Inputs((*self.rows, *rows), self.hashes)


def job_inputs(job: Job) -> Inputs:
    """Of a planned program: its files, and what they say in short."""
    frame = job.frame
    rows = [
        ("path file", job.source),
        _robot(job.cell),
        ("tool", f"UTOOL {job.tool.number}: {pose_words(job.tool.pose)}"),
        ("part frame", "World" if frame is None else f"UFRAME {frame.number}: {pose_words(frame.register)}"),
        ("feed", f"{job.feed / MM:g} mm/s"),
        ("history", history_words(job)),
        *([] if job.history.air.is_still else [("air", air_words(job.history.air))]),
        *([] if job.ensemble is None else [("serves", ensemble_words(job.ensemble))]),
        overrides_row(job.overrides),
    ]
    return Inputs(tuple(rows), (("path, robot and overrides", job.inputs_hash), _robot_hash(job.cell)))


def made_from(job: Job) -> dict[str, Any]:
    """The same for a record: the hash of all that a job was read from, its robot, and the robot's file."""
    robot_file = {"path": job.cell.robot_file, "sha256": job.cell.robot_file_hash}
    return {"inputs_sha256": job.inputs_hash, "robot": job.robot.name, "robot_file": robot_file}


def day_inputs(job: Job) -> Inputs:
    """Of a job's day: with what the cell does around its runs."""
    history = job.history
    around = [(name, d) for name, d in (("cycle", history.cycle), ("after", history.after)) if d]
    day = [(name, duties_words(duties)) for name, duties in around]
    return job_inputs(job).with_rows(("runs of the program", str(len(history.runs))), *day)


def correction_inputs(result: "Correction", planned_sha256: str, corrected_sha256: str | None) -> Inputs:
    """Of a program that existed: itself, robot, frames, history, options; None: the corrected one is not written."""
    frames, options = result.around.frames, result.options
    given = [
        f"{kind} {number}: {pose_words(pose)}"
        for kind, poses in (("UTOOL", frames.utool), ("UFRAME", frames.uframe))
        for number, pose in sorted(poses.items())
        if number
    ]
    wishes = [
        *(["split positions"] if options.split else []),
        *([] if options.insert is None else [f"points inserted beyond {options.insert / UM:g} µm"]),
        *([] if options.bound is None else [f"bound {options.bound / UM:g} µm"]),
        *([] if options.ensemble is None else [f"serves {ensemble_words(options.ensemble)}"]),
    ]
    warmer = f"; air {options.air:+.1f} K off the reference" if options.air else ""
    rows = [
        ("program", f"{result.name}, sha256 {planned_sha256[:SHORT]}"),
        _robot(result.cell),
        ("frames and tools", "; ".join(given) or "none given: World and flange"),
        ("history", _with_state(result.cell, duties_words(result.before)) + warmer),
        ("asked for", ", ".join(wishes) or "nothing beyond the correction"),
        overrides_row(result.cell.overrides),
        *([("corrected program", "not written")] if corrected_sha256 is None else []),
    ]
    written = [] if corrected_sha256 is None else [("corrected program", corrected_sha256)]
    return Inputs(tuple(rows), (("planned program", planned_sha256), *written, _robot_hash(result.cell)))


def measured_inputs(robot: str, robot_file: tuple[str, str], files: Sequence[tuple[str, str, str]]) -> Inputs:
    """Of measurements of a robot: name and sha256 of its file; what each other file is, its name and sha256."""
    rows = [robot_row(robot, *robot_file), *((kind, f"{name}, sha256 {h[:SHORT]}") for kind, name, h in files)]
    hashes = [(f"{kind} {name}", digest) for kind, name, digest in (("robot file", *robot_file), *files)]
    return Inputs(tuple(rows), tuple(hashes))


def robot_row(name: str, file: str, sha256: str) -> tuple[str, str]:
    """A robot and its file."""
    return "robot", f"{name}, {file}, sha256 {sha256[:SHORT]}"


def overrides_row(overrides: Sequence[str]) -> tuple[str, str]:
    """What was set in place of the files' values."""
    return "overrides", ", ".join(overrides) or "none"


def pose_words(pose: Pose) -> str:
    """X, Y, Z [mm] and W, P, R [deg]: what a pendant shows."""
    xyz = " ".join(f"{name} {_number(v, 3)}" for name, v in zip("XYZ", (pose.position / MM).tolist(), strict=True))
    wpr = " ".join(f"{name} {_number(float(a) / DEG, 3)}" for name, a in zip("WPR", to_wpr(pose.rotation), strict=True))
    return f"{xyz} mm, {wpr}°"


def history_words(job: Job) -> str:
    """What the cell does before the program."""
    if job.log is not None:
        return f"temperature log of {time_words(float(job.log.time[-1] - job.log.time[0]))}, in place of a history"
    return _with_state(job.cell, duties_words(job.history.before), job.history.clock)


def air_words(air: Ambient) -> str:
    """How far the air is from the temperature at which the robot counts as cold."""
    low, high = (f"{_number(value, 1)}" for value in (air.rise.min(), air.rise.max()))
    level = f"{low} K" if low == high else f"{low} to {high} K"
    wave = (
        f", in a wave of {_number(air.amplitude, 1)} K either way over {time_words(air.period)}"
        if air.amplitude
        else ""
    )
    return f"{level} from the temperature of the cold robot{wave}"


def duties_words(duties: Sequence[Duty]) -> str:
    """Stretches of duty one by one, or of many how long the robot was in each state."""
    if not duties:
        return COLD
    if len(duties) <= STRETCHES:
        return ", then ".join(_duty(d) for d in duties)
    total = {state: sum(d.duration for d in duties if d.state == state) for state in ("moving", "idle", "off")}
    parts = ", ".join(f"{state} {time_words(time)}" for state, time in total.items() if time)
    return f"{len(duties)} stretches over {time_words(sum(total.values()))}: {parts}; at last {_duty(duties[-1])}"


def _robot(cell: Cell) -> tuple[str, str]:
    return robot_row(cell.robot.name, cell.robot_file, cell.robot_file_hash)


def _robot_hash(cell: Cell) -> tuple[str, str]:
    return f"robot file {cell.robot_file}", cell.robot_file_hash


def _with_state(cell: Cell, history: str, age: float = 0.0) -> str:
    state = cell.state
    if state is None:
        return history
    later = f", {time_words(age)} ago" if age else ""
    return f"the state that was anchored{later} ({state.verdict}), sha256 {state.digest[:SHORT]}"


def _duty(duty: Duty) -> str:
    share = f" at a duty of {100 * duty.share:g} %" if duty.share != 1 else ""
    feed = f" at {duty.feed / MM:g} mm/s" if duty.state == "moving" else ""
    return f"{duty.state}{feed}{share} for {time_words(duty.duration)}"


def time_words(seconds: float) -> str:
    """A duration in hours, minutes or seconds."""
    if seconds >= HOUR:
        return f"{_number(seconds / HOUR, 2)} h"
    return f"{_number(seconds / MINUTE, 1)} min" if seconds >= MINUTE else f"{_number(seconds, 1)} s"


def _number(value: float, decimals: int) -> str:
    return f"{round(value, decimals) + 0.0:.{decimals}f}".rstrip("0").rstrip(".")
