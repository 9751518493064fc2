"""The command that says which spheres to touch, and from where, to know best where a path will be."""

import re
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import check_folder, check_unfilled
from compgen.cli.output_files.publish import publish
from compgen.cli.screen.messages import print_findings, stdout_console
from compgen.core.commands import Command
from compgen.core.dates import DEFAULT_DATE, checked_date
from compgen.core.exceptions import InputError
from compgen.core.json_text import json_text
from compgen.core.units import MM, UM

if TYPE_CHECKING:
    from compgen.identification.touch_candidates import Search
    from compgen.program.touches import Signal

CONDITION = re.compile(r"(?:DI|RI|UI|SI|WI|F|M)\[[1-9][0-9]{0,4}\]=(?:ON|OFF)")
RECORD, TABLE = "plan.json", "touches.csv"

TouchesFolder = Annotated[
    str | None, typer.Option("-o", "--output", help="Folder; default outputs/<path name>_touches.")
]


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchChoice:
    """How the program touches."""

    centres: Annotated[
        bool, typer.Option("--centres", help="Each touch locates a sphere's centre (a nest, a centring probe).")
    ] = False
    stops: Annotated[bool, typer.Option("--stops", help="The program pauses at each touch, for reading by hand.")] = (
        False
    )
    skip: Annotated[str, typer.Option("--skip", help="Signal that ends a search, as SKIP CONDITION has it.")] = (
        "DI[1]=ON"
    )
    register: Annotated[
        int, typer.Option("--pr", callback=opt.in_range(1, 9999), help="First position register that keeps a touch.")
    ] = 1
    utool: Annotated[
        int, typer.Option("--utool", callback=opt.in_range(1, 29), help="Number of the probe's tool on the controller.")
    ] = 9
    sigma: Annotated[
        float, typer.Option("--sigma", callback=opt.in_range(0.1, 1e4), help="Of one coordinate of a touch, um.")
    ] = 12.0
    clearance: Annotated[
        float,
        typer.Option("--clearance", callback=opt.in_range(1, 500), help="From where a search begins, mm before it."),
    ] = 20.0
    beyond: Annotated[
        float,
        typer.Option(
            "--beyond", callback=opt.in_range(0.1, 50), help="How far a search may go behind the planned touch, mm."
        ),
    ] = 3.0

    def signal(self) -> "Signal | None":
        """What ends a search, None where the program stops instead; raises InputError for a condition that is none."""
        from compgen.program.touches import Signal

        return None if self.stops or self.centres else Signal(_condition(self.skip), self.register)

    def search(self) -> "Search":
        """How the probe comes to a sphere."""
        from compgen.identification.touch_candidates import Search

        return Search(self.clearance * MM, self.beyond * MM, centres=self.centres)


def plan_touches(
    path: opt.PathFile,
    *,
    artefact: Annotated[str | None, typer.Option("--artefact", help="TOML of spheres and probe.")] = None,
    count: Annotated[int, typer.Option("-n", help="How many touches.")] = 8,
    choice: SearchChoice,
    job: opt.JobChoice,
    log: Annotated[str | None, typer.Option("--log", help="Temperature log in place of [[before]].")] = None,
    reference: opt.LogReference = None,
    frames: opt.FramesFile = None,
    output: TouchesFolder = None,
    date: opt.Date = DEFAULT_DATE,
    screen: opt.FindingScreen,
    cores: opt.Cores,
) -> Outcome:
    """Choose the touches that tell most of where a path will be: a CSV to fill in, and a program that touches.

    Examples:
        cgen plan-touches paths/spiral_1300.toml --artefact artefact.toml -n 8 -o touches
    """
    from compgen.cli.screen.progress_bar import show_progress
    from compgen.identification.touches import read_artefact
    from compgen.pipelines.anchor.touch_model import frame_of_artefact
    from compgen.pipelines.anchor.touch_plan import plan_path_touches, positions_of, write_touches
    from compgen.program.program import program_name
    from compgen.report.touch_plan import touch_record, touches_csv

    artefact, signal = opt.given("--artefact", artefact, "the TOML of spheres and probe"), choice.signal()
    folder, run = opt.output_folder(path, output, "_touches"), Run(Command.PLAN_TOUCHES)
    chosen = job.load_with_log(path, log, reference)
    name = program_name(f"{chosen.name}_touches", chosen.robot.controller.name_length)
    check_folder(folder, run, record=RECORD, others=[f"{name}.LS", TABLE])
    check_unfilled(folder, TABLE, "touches that were made", lambda row: row.startswith(b","))
    spheres, sigma, search = read_artefact(artefact), choice.sigma * UM, choice.search()
    frame = frame_of_artefact(spheres, chosen.frame, frames)
    with show_progress(quiet=screen.is_silent) as progress:
        planned = plan_path_touches(chosen, spheres, frame, count=count, sigma=sigma, search=search, progress=progress)
    touches = positions_of(planned, choice.utool, stops=signal is None)
    record = touch_record(planned, touches, signal)
    reports = {RECORD: json_text(record), TABLE: touches_csv(planned, touches, stops=signal is None)}
    program = {f"{name}.LS": write_touches(planned, name, checked_date(date), choice.utool, signal)}
    publish(folder, program, reports, run=run)
    show = partial(_show, record, folder, [*program, *reports], verbose=screen.verbose)
    return Outcome(record=reports[RECORD], show=show)


def _condition(text: str) -> str:
    plain = text.replace(" ", "").upper()
    if not CONDITION.fullmatch(plain):
        raise InputError(f"--skip {text[:40]!r}: no condition of a signal; give one such as 'DI[1]=ON' or 'RI[2]=OFF'")
    return plain


def _show(record: dict[str, Any], folder: Path, files: list[str], *, verbose: bool) -> None:
    """Print the touches, what each gains, and the files."""
    from rich.table import Table

    console = stdout_console()
    table = Table("touch", "target", "probe moves along (World)", "leaves rms, um", "gain")
    for n, touch in enumerate(record["touches"], 1):
        normal = touch["normal"]
        along = "to its centre" if normal is None else "  ".join(f"{round(v, 2) + 0.0:5.2f}" for v in normal)
        table.add_row(str(n), touch["target"], along, f"{touch['rms_um']:.1f}", f"{100 * touch['gain']:.0f} %")
    console.print(table)
    before, after, n = record["before"], record["after"], record["planned_touches"]
    by_anchoring = record["by_anchoring_rms_um"]
    expected = "" if by_anchoring is None else f" (cgen anchor will leave {by_anchoring:.1f} um rms)"
    console.print(
        f"what is not known of the path's place (standard deviation): {before['rms_um']:.1f} um rms, "
        f"{before['p99_um']:.1f} um p99; after {n} touches {after['rms_um']:.1f} and {after['p99_um']:.1f} um"
        f"{expected}; one more gains {100 * record['one_more']['gain']:.0f} %"
    )
    print_findings(console, record["findings"], verbose=verbose)
    console.print(f"wrote {', '.join(files)} to {folder}")
