"""Arguments and options that several commands share, alone and in groups, and the checks of their values."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from glob import escape, glob, has_magic
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compgen.cli.options.completion import (
    complete_keys,
    complete_paths,
    complete_programs,
    complete_robots,
    one_of,
)
from compgen.cli.output_files import marker, publish
from compgen.core.exceptions import InputError
from compgen.core.files import PROJECT
from compgen.core.findings import beyond_text
from compgen.core.units import UM

if TYPE_CHECKING:
    from compgen.core.arrays import Array
    from compgen.job.anchored_start import Beginning
    from compgen.job.job import Job
    from compgen.program.frames import Frames
    from compgen.program.registers import Register


def in_range(least: float, most: float, unit: str = "") -> Callable[[typer.CallbackParam, float | None], float | None]:
    """What refuses a number out of its range as soon as the option is read; None is an option that is not given."""

    def checked(param: typer.CallbackParam, value: float | None) -> float | None:
        if value is not None and not least <= value <= most:
            raise InputError(f"{param.opts[0]} {value:.10g}: must be {least:.10g} to {most:.10g} {unit}".rstrip())
        return value

    return checked


def every_file(ending: str, what: str) -> Callable[[typer.CallbackParam, list[str]], list[str]]:
    """What puts files in the place of a folder, or of a pattern that no shell has read, in the order of their names.

    Args:
        ending: Of the files that are taken from either, small letters.
        what: They are, with their ending.
    """

    def expanded(param: typer.CallbackParam, values: list[str]) -> list[str]:
        if len(values) == 1 and not matching(values[0]):
            raise InputError(
                f"{values[0]}: no {what} {'in this folder' if os.path.isdir(values[0]) else 'matches'}; give a file, a "
                "folder that holds some, or a pattern in quotes"
            )
        return [file for value in values for file in matching(value) or [value]]  # of several a bad one stops no other

    def matching(name: str) -> list[str]:
        if os.path.isdir(name):
            name = os.path.join(escape(name), "*")
        elif os.path.lexists(name) or not has_magic(name):
            return [name]
        files = [f for f in glob(name, recursive=True) if f.lower().endswith(ending) and os.path.basename(f) != PROJECT]
        return sorted(filter(os.path.isfile, files))

    return expanded


PathFile = Annotated[
    str,
    typer.Argument(autocompletion=complete_paths, help="A path file, e.g. paths/spiral_1300.toml", show_default=False),
]
PathFiles = Annotated[
    list[str],
    typer.Argument(
        autocompletion=complete_paths, callback=every_file(".toml", "path file (.toml)"),
        metavar="PATH", help="Path files, their folder, or a pattern, e.g. paths/*.toml", show_default=False,
    ),
]  # fmt: skip
RobotArgument = Annotated[
    str, typer.Argument(autocompletion=complete_robots, help="Robot name or file, e.g. m710ic50", show_default=False)
]
JobRobot = Annotated[
    str | None,
    typer.Option(
        "--robot", autocompletion=complete_robots, help="Robot name or file; default: what the path file says."
    ),
]
ProgramRobot = Annotated[
    str | None,
    typer.Option(
        "--robot", autocompletion=complete_robots,
        help="Robot name or file; needed unless the program names its robot.",
    ),
]  # fmt: skip
OutputFolder = Annotated[
    str | None, typer.Option("-o", "--output", help="Folder for the results; default outputs/<path name>.")
]
ProgramFolder = Annotated[
    str | None, typer.Option("-o", "--output", help="Folder for the results; default outputs/<program>.")
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set", autocompletion=complete_keys, help="Override a key of the path or robot file, key=value; repeatable."
    ),
]
Before = Annotated[
    list[str] | None,
    typer.Option(
        "--before",
        help="What went before: 'moving 200mm/s 5h', 'idle 30min', or a .toml, also with [ambient]; repeatable.",
    ),
]
StateFile = Annotated[
    str | None, typer.Option("--state", help="What cgen anchor wrote: the robot's state, in place of history.")
]
StateAge = Annotated[
    str | None, typer.Option("--state-age", help="How long before the start that was, standing: 20min, 90s, 1.5h.")
]

# These four mean the same wherever they are; docs/cli.md says where each one is, and why not elsewhere.
Json = Annotated[
    bool, typer.Option("--json", help="Print the record as JSON, and nothing else on stdout; a refusal as well.")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress, no table; errors only.")]
Verbose = Annotated[bool, typer.Option("--verbose", help="Print every note, every code, and all that is not known.")]
Workers = Annotated[
    int,
    typer.Option("--workers", min=0, max=256, help="Cores to use; 0: all. The results are the same for any number."),
]
MaxUm = Annotated[
    float | None,
    typer.Option(
        "--max-um",
        callback=in_range(0.001, 1e6, "um"),
        help="Largest error allowed [um], in place of a path file's bound; else exit 1.",
    ),
]

Strict = Annotated[
    bool, typer.Option("--strict", help="Refuse where assumed accelerations decide whether the bounds are kept.")
]
ForceProgram = Annotated[bool, typer.Option("--force", help="Write the program even outside its bounds.")]
Date = Annotated[str, typer.Option("--date", help="Date in the program's header, YY-MM-DD.")]

ProgramFile = Annotated[
    str, typer.Argument(autocompletion=complete_programs, help="A FANUC program, NAME.LS", show_default=False)
]
ProgramFiles = Annotated[
    list[str],
    typer.Argument(
        autocompletion=complete_programs, callback=every_file(".ls", "program (.LS)"),
        metavar="PROGRAM", help="FANUC programs NAME.LS, their folder, or a pattern", show_default=False,
    ),
]  # fmt: skip
Sarif = Annotated[str | None, typer.Option("--sarif", help="Write what is found as SARIF 2.1.0, whatever the outcome.")]
FramesFile = Annotated[str | None, typer.Option("--frames", help="Frames table (.toml) or SYSFRAME.VA.")]
RegistersFile = Annotated[
    str | None, typer.Option("--registers", help="Position registers PR[n] at the start (.toml) or POSREG.VA.")
]
TouchesFile = Annotated[str | None, typer.Option("--touches", help="CSV of touches.")]
ArtefactFile = Annotated[
    str | None, typer.Option("--artefact", help="TOML of spheres and probe; default artefact.toml beside the CSV.")
]
LogReference = Annotated[
    str | None,
    typer.Option(
        "--reference",
        autocompletion=one_of("start", "ambient"),
        help="What rises in --log count from: start, ambient, or degC.",
    ),
]
PositionLog = Annotated[
    str | None, typer.Option("--log", help="CSV of positions: time_s and x_mm ... r_deg, or j1_deg ... j6_deg.")
]


class J3(StrEnum):
    """Against what a log counts the third joint."""

    HORIZONTAL = "horizontal"  # as the pendant has it
    LINK2 = "link2"  # as a DH angle


JointThree = Annotated[
    J3,
    typer.Option("--j3", help="Against what the log counts J3: the horizontal, as the pendant does, or link2."),
]
InWorld = Annotated[
    bool, typer.Option("--in-world", help="The log's X to R are in World, not in the program's user frame.")
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Screen:
    """What a command prints: its record alone, errors only, or what a reader wants."""

    as_json: Json = False
    quiet: Quiet = False

    @property
    def is_silent(self) -> bool:
        """Whether no progress is shown."""
        return self.as_json or self.quiet


@dataclass(frozen=True, slots=True, kw_only=True)
class FindingScreen(Screen):
    """What a command prints that has findings."""

    verbose: Verbose = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Cores:
    """Over how many cores rows are shared out; the frame sees to it before the command runs."""

    workers: Workers = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class CompiledCores:
    """Cores of a command that evaluates so many rows that compiling pays; the frame sees to it."""

    workers: Workers = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class JobChoice:
    """What a path file's job is made with in place of what the file says: robot, keys, state."""

    robot: JobRobot = None
    overrides: Overrides = None
    state: StateFile = None
    state_age: StateAge = None

    def changes(self, path: str, max_um: float | None = None) -> list[str]:
        """The overrides of a path file, with the bound of ``--max-um`` and those that a state comes to."""
        from compgen.job.anchored_start import seconds_of_age, state_overrides

        bound = [] if max_um is None else [f"bounds.max_um={max_um!r}"]
        return [*(self.overrides or ()), *bound, *state_overrides(path, self.state, seconds_of_age(self.state_age))]

    def load(self, path: str, max_um: float | None = None) -> "Job":
        """The job of a path file."""
        from compgen.pipelines.files.path_file import load_job

        return load_job(path, self.robot, self.changes(path, max_um))

    def load_with_log(self, path: str, log: str | None, reference: str | None) -> "Job":
        """The job of a path file, with a temperature log in place of its history."""
        from compgen.pipelines.anchor.anchor import load_with_log

        if log is not None and self.state is not None:
            raise InputError("--log: a state stands in place of history and log; leave --log or --state out")
        return load_with_log(path, self.robot, self.changes(path), log, reference)


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgramChoice:
    """The robot that a program which exists is run on, and what that robot did before."""

    robot: ProgramRobot = None
    before: Before = None
    state: StateFile = None
    state_age: StateAge = None
    overrides: Overrides = None

    def begin(self, program: str, content: bytes) -> "Beginning":
        """The cell of a program that exists, by default with the robot that it names, and what went before."""
        from compgen.pipelines.correct.program_file import cell_of_program

        overrides, before = self.overrides or (), self.before or ()
        return cell_of_program(content, program, self.robot, overrides, before, self.state, self.state_age)


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgramTables:
    """What the numbers in a program mean on its controller."""

    frames: FramesFile = None
    registers: RegistersFile = None

    def read(self) -> "tuple[Frames, dict[int, Register]]":
        """Frames, and position registers when the program starts."""
        from compgen.pipelines.correct.program_file import read_frames, read_registers

        return read_frames(self.frames), read_registers(self.registers)


def bound_of(max_um: float | None) -> float | None:
    """What ``--max-um`` gives [m]."""
    return None if max_um is None else max_um * UM


def beyond_bound(words: str, error: float, max_um: float | None, place: str = "") -> list[str]:
    """Why a run whose largest error [m] is beyond ``--max-um`` is not inside; nothing where it is not beyond.

    Args:
        words: What has the error, "{}" in its place.
        error: The largest one [m].
        max_um: As typed [um].
        place: Where it is.
    """
    if max_um is None or error <= max_um * UM:
        return []
    return [f"{words.format(beyond_text(error / UM, max_um))} um{place}, --max-um {max_um:g}"]


def given(option: str, value: str | None, what: str) -> str:
    """The value of an option that a command cannot do without; raises InputError where it is missing."""
    if value is None:
        raise InputError(f"{option}: missing; give {what}")
    return value


def typed_numbers(option: str, text: str, count: int, most: float) -> "Array":
    """So many numbers of an option's text, in mm, (count,); raises InputError."""
    import numpy as np

    try:
        numbers = [float(v) for v in text.replace(",", " ").split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(abs(v) <= most for v in numbers):
        raise InputError(f"{option} '{text}': expected {count} numbers in mm, none beyond {most:g}")
    return np.array(numbers)


def output_folder(path: str, output: str | None, suffix: str = "") -> Path:
    """Where results go, by default outputs/<name><suffix>; refused before any work when they cannot go there."""
    if output == "":
        raise InputError("-o: an empty name; give a folder")
    folder = Path(output) if output is not None else Path("outputs") / f"{Path(path).stem}{suffix}"
    publish.check_writable(folder.absolute())
    marker.runs_in(folder)
    return folder


def check_elsewhere(program: str, target: Path, what: str) -> None:
    """Raises InputError where what is written, named in words, would replace the program that it is made from."""
    if target.exists() and Path(program).exists() and target.samefile(program):
        raise InputError(f"{program}: {what} would replace it; give another folder with -o")


def toml_file(output: str | None, default: Path, whose: str) -> Path:
    """The one TOML file that a command writes; refused before any work when it cannot go there."""
    target = default if output is None else Path(output)
    if target.suffix != ".toml" or target.is_dir():
        raise InputError(f"-o {target}: not the name of a {whose} file; give one that ends in .toml")
    publish.check_writable(target.absolute().parent)
    return target
