"""A program that exists: its file, what lies beside it, the robot it names, and the frames and registers it needs.

What the cell did before, in words or in a file of its own: for a program that exists already.
"""

import base64
import re
import zlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from hashlib import sha256
from pathlib import Path
from typing import Any

from compgen.core.exceptions import InputError, naming_file
from compgen.core.files import PROVENANCE, near_file, read_regular
from compgen.core.json_text import read_record
from compgen.core.toml import check, read_toml
from compgen.core.units import HOUR, MINUTE
from compgen.fanuc import LsProgram, loads
from compgen.fanuc.analysis.inspection import inspect, robots_named
from compgen.fanuc.analysis.watermark import Mark, carries_mark, planned_source
from compgen.job.anchored_start import Before, Beginning, begin
from compgen.pipelines.files.robot_file import known_robots, load_cell, load_robot
from compgen.pipelines.files.schema import HISTORY, BeforeFile, PathFile
from compgen.program.frames import Frames, default_frames, load_frames
from compgen.program.registers import Register, load_registers
from compgen.robot.robot import Robot
from compgen.thermal import Duty, tables
from compgen.thermal.tables.schema import StepTable

LARGEST = 10_000_000  # bytes


def read_program(program: str) -> bytes:
    """A program file's bytes."""
    try:
        content = read_regular(program)
    except (OSError, ValueError) as failure:
        reason = getattr(failure, "strerror", None) or str(failure)
        near = near_file(Path(program)) if isinstance(failure, FileNotFoundError) else None
        mend = f"did you mean {near}?" if near else "give a program listing (.LS)"
        raise InputError(f"{program}: cannot be read: {reason}; {mend}") from None
    if program.lower().endswith(".toml"):
        raise InputError(f"{program}: not a program listing (.LS); cgen generate, predict and check take path files")
    return content


def cell_of_program(
    content: bytes,
    file: str | None,
    robot: str | None,
    overrides: Sequence[str],
    before: Sequence[str],
    state: str | None,
    state_age: str | None,
) -> Beginning:
    """The cell of a program that exists, by default with the robot that it names, and what went before.

    Args:
        content: Of the program.
        file: Where it is from, if it has a file.
        robot: Name or file of a robot in place of the one that it names.
        overrides: Keys of the robot file and their values.
        before: What went before, in words or files.
        state: What ``cgen anchor`` wrote, in place of that.
        state_age: How long before the start that was.
    """
    with nullcontext() if file is None else naming_file(file):
        chosen = robot_of_program(content) if robot is None else robot
    return begin(load_cell(chosen, overrides), load_before(before), state, state_age)


def read_frames(path: str | None) -> Frames:
    """What UF and UT numbers mean."""
    return load_frames(path) if path is not None else default_frames()


def read_registers(path: str | None) -> dict[int, Register]:
    """Position registers when a program starts, by number."""
    return load_registers(path) if path is not None else {}


def provenance_beside(source: Path, content: bytes) -> Path | None:
    """The provenance file beside a program that says that it is a corrected one, or None."""
    checksum = sha256(content).hexdigest()
    for provenance in sorted(source.parent.glob(f"*{PROVENANCE}")):
        record = read_record(provenance)
        if record.get("corrected_sha256") == checksum != record.get("planned_sha256", checksum):
            return provenance
    return None


def why_unknown(source: Path, program: LsProgram, robot: Robot) -> str:
    """Why nothing says what a corrected program was made from, no provenance being its own; empty of a planned one."""
    beside = source.with_name(f"{source.stem}{PROVENANCE}")
    record = read_record(beside)
    if sha256(program.source).hexdigest() == record.get("planned_sha256"):
        return ""
    if "corrected_sha256" in record:
        return f"{source.name} is not what {beside.name} says that cgen correct wrote: it was touched up since"
    absent = f"no {beside.name} beside {source.name} says what this corrected program was made from"
    return absent if carries_mark(program, robot) else ""


def packed_program(listing: bytes) -> str:
    """A program as a provenance record holds it."""
    return base64.b85encode(zlib.compress(listing, 9)).decode("ascii")


def unpacked_program(text: str) -> bytes:
    """The same back; raises ValueError where it is damaged."""
    try:
        return zlib.decompress(base64.b85decode(text))
    except zlib.error as failure:
        raise ValueError(str(failure)) from None


def planned_in(record: Mapping[str, Any]) -> bytes | None:
    """The planned program that a provenance record holds; None where it is damaged."""
    try:
        planned = unpacked_program(record["planned_zlib_b85"])
    except (KeyError, ValueError, TypeError):
        return None
    return planned if sha256(planned).hexdigest() == record.get("planned_sha256") else None


def refuse_corrected(source: Path, content: bytes) -> None:
    """Raises InputError when a provenance file beside a program says that it is a corrected one."""
    provenance = provenance_beside(source, content)
    if provenance is not None:
        raise InputError(
            f"{source}: it carries compgen's mark ({provenance.name} says so): it would be corrected twice; "
            "start from the planned program, get it back with --restore, or say --again"
        )


def refuse_any_corrected(source: Path, content: bytes, robot: Robot) -> None:
    """Raises InputError for a corrected program, where nothing may be done to one: an offset would correct it twice."""
    beside, program = provenance_beside(source, content), loads(content)
    if beside is not None or carries_mark(program, robot):
        where = f"{beside.name} beside it says so" if beside is not None else "its remark or its digits say so"
        raise InputError(
            f"it is corrected already ({where}): an offset on top would correct it twice; take the planned program "
            f"({planned_source(program)})"
        )


def programs_beside(path: Path) -> Callable[[str], bytes | None]:
    """The listing of a program by its name, whatever its case, in the folder of a program file; None when not there."""
    files: dict[str, list[Path]] = {}
    try:
        for file in sorted(path.resolve().parent.iterdir()):
            if file.suffix.upper() == ".LS" and file.is_file() and file.stat().st_size <= LARGEST:
                files.setdefault(file.stem.upper(), []).append(file)
    except OSError:
        files = {}

    def find(name: str) -> bytes | None:
        candidates = files.get(name.upper(), [])
        if len(candidates) != 1:
            return None
        try:
            return candidates[0].read_bytes()
        except OSError:
            return None

    return find


def robot_of_program(data: bytes) -> str:
    """The known robot that a program's remarks or comment name.

    Raises:
        InputError: Not a program, or it names no known robot, or several.
    """
    program, known = loads(data), known_robots()
    named = robots_named(program, known)
    if len(named) != 1:
        says = f"it names {' and '.join(named)}" if named else "it names none that is known"
        raise InputError(
            f"program {program.name}: which robot is it for? {says}; say --robot NAME, known: {', '.join(known)[:120]}"
        )
    return named[0]


def inspect_file(file: str, robot: str | None, frames: Frames, registers: Mapping[int, Register]) -> dict[str, Any]:
    """What a program is, in plain types; without a robot, for the one that it names.

    Raises:
        InputError: Not a program; names the file.
    """
    content = read_program(file)
    with naming_file(file):
        program = loads(content)
        named = [robot] if robot is not None else robots_named(program, known_robots())
        arm = load_robot(named[0]) if len(named) == 1 else None
        report = inspect(program, arm, frames, registers, programs_beside(Path(file)))
    if report["mark"] == Mark.NONE and provenance_beside(Path(file), content):
        report["mark"] = Mark.RECORD.value
    return report


def load_before(items: Sequence[str]) -> Before:
    """What the cell did before, from the command line; how warm the air is, by the last item that says it.

    Args:
        items: In order; each a TOML file with [[before]] and [ambient], or a stretch in words: state, feed and
            duration, as in ``moving 200mm/s 5h``, ``idle 30min``, ``off 16h``, or as a table has it,
            ``feed_mm_s=200 duration_h=5``.

    Raises:
        InputError: Not understood, or air that changes with time; says which and how it is written.
    """
    duties: list[Duty] = []
    air, reference = None, None
    for item in items:
        where = item if item.endswith(".toml") else f"--before '{item}'"
        day = _day_file(item) if where == item else check(BeforeFile, {"before": [stretch(item)]}, where)
        duties += _plain_duties(day.before, where)
        table = day.ambient
        reference = reference if table.counts_from is None else table.counts_from
        if table.is_given:
            if table.kind != "constant":
                raise InputError(f"{item}: ambient.kind: a program that exists takes air that stays; give 'constant'")
            air = float(tables.ambient_of(table, item).rise[0])
    return Before(tuple(duties), air, reference)


def _day_file(item: str) -> BeforeFile:
    """A file's [[before]] and [ambient]; of a path file all that is no history is passed over."""
    data = read_toml(Path(item), "paths", "give a file with [[before]], or words: 'moving 200mm/s 5h'")
    for key in data:
        if key not in PathFile.model_fields or key in set(HISTORY) - {*BeforeFile.model_fields, "after"}:
            raise InputError(f"{item}: {key:.40}: here [[before]] and [ambient] count alone; remove it, or mend it")
    return check(BeforeFile, {key: data[key] for key in BeforeFile.model_fields if key in data}, item)


def _plain_duties(rows: Sequence[StepTable], where: str) -> list[Duty]:
    """Stretches of a duration each, as a program that exists already needs them."""
    steps = tables.steps_of(rows, "before", where, 0.0)
    for step in steps:
        if step.repeat is not None or step.program or step.shifts:
            raise InputError(f"{step.key}: here only state, feed, duration and duty count; remove the rest")
    return [Duty(s.state, s.feed, s.duration or 0.0, s.share) for s in steps]


def stretch(item: str) -> dict[str, str | float]:
    """A stretch in words as a table."""
    table: dict[str, str | float] = {}
    value: str | float
    for word in re.split(r"[\s,;:@]+", item.strip()):
        if word in ("moving", "idle", "off"):
            key, value = "state", word
        elif feed := re.fullmatch(r"(?:feed_mm_s=)?(\d*\.?\d+)(?:mm/s(?:ec)?)?", word):
            if not (word.startswith("feed") or word.endswith(("s", "c"))):
                raise InputError(f"--before '{item}': {word} has no unit; write it as in 'moving 200mm/s 5h'")
            key, value = "feed_mm_s", float(feed[1])
        elif time := re.fullmatch(r"(\d*\.?\d+)(h|min|s)", word):
            key, value = "duration_h", float(time[1]) * {"h": HOUR, "min": MINUTE, "s": 1.0}[time[2]] / HOUR
        elif pair := re.fullmatch(r"(state|duration_h)=(\S+)", word):
            key, value = pair[1], pair[2] if pair[1] == "state" else _plain(pair[2], item)
        else:
            raise InputError(f"--before '{item}': {word!r} is not understood; write it as in 'moving 200mm/s 5h'")
        if key in table:
            mend = "give each stretch its own --before, and its time as one number, as 5.5h"
            raise InputError(f"--before '{item}': {word} says {key.partition('_')[0]} a second time; {mend}")
        table[key] = value
    if not table.keys() & {"state", "feed_mm_s"}:
        raise InputError(f"--before '{item}': moving, idle or off? write it as in 'moving 200mm/s 5h'")
    if "feed_mm_s" in table and (state := table.get("state")) in ("idle", "off"):
        raise InputError(f"--before '{item}': an arm that is {state} has no feed; write it as in 'moving 200mm/s 5h'")
    return {"state": "moving", **table}


def _plain(text: str, item: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"--before '{item}': {text!r} is not a number") from None
