"""Arguments and options that several commands share, and the checks of their values."""

from pathlib import Path
from typing import Annotated

import typer

from compgen.cli.options.completion import (
    complete_keys,
    complete_paths,
    complete_programs,
    complete_references,
    complete_robots,
)
from compgen.cli.output_files import publish
from compgen.core.exceptions import InputError
from compgen.core.units import UM

PathFile = Annotated[
    str,
    typer.Argument(autocompletion=complete_paths, help="A path file, e.g. paths/spiral_1300.toml", show_default=False),
]
PathFiles = Annotated[
    list[str],
    typer.Argument(
        autocompletion=complete_paths, metavar="PATH...", help="Path files, e.g. paths/*.toml", show_default=False
    ),
]
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
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set", autocompletion=complete_keys, help="Override a key of the path or robot file, key=value; repeatable."
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
Workers = Annotated[
    int,
    typer.Option("--workers", min=0, max=256, help="Cores to use; 0: all. The results are the same for any number."),
]
MaxUm = Annotated[
    float | None,
    typer.Option("--max-um", help="Largest error allowed on the part [um], in place of the files' bound; else exit 1."),
]
LEAST_UM, MOST_UM = 0.001, 1e6  # of --max-um

Strict = Annotated[
    bool, typer.Option("--strict", help="Refuse where assumed accelerations decide whether the bounds are kept.")
]
ForceProgram = Annotated[bool, typer.Option("--force", help="Write the program even outside its bounds.")]
Date = Annotated[str, typer.Option("--date", help="Date in the program's header, YY-MM-DD.")]

ProgramFile = Annotated[
    str, typer.Argument(autocompletion=complete_programs, help="A FANUC program, NAME.LS", show_default=False)
]
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
        autocompletion=complete_references,
        help="What rises in --log count from: start, ambient, or degC.",
    ),
]
PositionLog = Annotated[
    str | None, typer.Option("--log", help="CSV of positions: time_s and x_mm ... r_deg, or j1_deg ... j6_deg.")
]
InWorld = Annotated[
    bool, typer.Option("--in-world", help="The log's X to R are in World, not in the program's user frame.")
]


def with_bound(overrides: list[str] | None, max_um: float | None) -> list[str]:
    """The overrides of a path file, with the bound of ``--max-um`` in place of the file's own; raises InputError."""
    bound = [] if checked_bound(max_um) is None else [f"bounds.max_um={max_um!r}"]
    return [*(overrides or ()), *bound]


def checked_bound(max_um: float | None) -> float | None:
    """What ``--max-um`` gives [m]; raises InputError for what is no bound."""
    if max_um is None:
        return None
    if not LEAST_UM <= max_um <= MOST_UM:
        raise InputError(f"--max-um {max_um:g}: must be {LEAST_UM:g} to {MOST_UM:g} um")
    return max_um * UM


def position_log(log: str | None) -> str:
    """The file of a log of positions; raises InputError where none is named."""
    if log is None:
        raise InputError("--log: missing; give the CSV of positions that was logged while the program ran")
    return log


def with_state(path: str, overrides: list[str] | None, state: str | None, age: str | None) -> list[str]:
    """The overrides of a path file, with those that a state comes to."""
    from compgen.job.anchored_start import seconds_of_age, state_overrides

    return [*(overrides or ()), *state_overrides(path, state, seconds_of_age(age) if age is not None else 0.0)]


def output_folder(path: str, output: str | None, suffix: str = "") -> Path:
    """Where results go, by default outputs/<name><suffix>; refused before any work when they cannot go there."""
    if output == "":
        raise InputError("-o: an empty name; give a folder")
    folder = Path(output) if output is not None else Path("outputs") / f"{Path(path).stem}{suffix}"
    publish.check_writable(folder.absolute())
    return folder


def toml_file(output: str | None, default: Path, whose: str) -> Path:
    """The one TOML file that a command writes; refused before any work when it cannot go there."""
    target = default if output is None else Path(output)
    if target.suffix != ".toml" or target.is_dir():
        raise InputError(f"-o {target}: not the name of a {whose} file; give one that ends in .toml")
    publish.check_writable(target.absolute().parent)
    return target
