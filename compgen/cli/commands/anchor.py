"""The command that says what a robot is now, from touches and a log against its forecast."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compgen.cli.frame import Outcome
from compgen.cli.machine import use_cores
from compgen.cli.options import options as opt
from compgen.cli.options.page_options import PageChoice, PageDate, page_files, page_options
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import check_folder, check_own_file
from compgen.cli.output_files.publish import publish
from compgen.cli.screen.messages import finding_lines, print_lines
from compgen.core.commands import Command
from compgen.core.exceptions import InputError
from compgen.core.json_text import json_text

if TYPE_CHECKING:
    from compgen.pipelines.anchor import Anchored

PAGE, RECORD = "anchor.html", "anchor.json"


def anchor(
    path: opt.PathFile,
    *,
    touches: opt.TouchesFile = None,
    artefact: opt.ArtefactFile = None,
    log: Annotated[
        str | None, typer.Option("--log", help="Temperature log on the touches' clock, in place of [[before]].")
    ] = None,
    reference: opt.LogReference = None,
    output: Annotated[
        str | None,
        typer.Option("-o", "--output", help="The state's file; default outputs/<path name>_anchor/state.toml."),
    ] = None,
    html: Annotated[str | None, typer.Option("--html", help="Folder for a page and its record.")] = None,
    frames: opt.FramesFile = None,
    robot: opt.JobRobot = None,
    overrides: opt.Overrides = None,
    page: PageChoice,
    date: PageDate = None,
    screen: opt.Screen,
    workers: opt.Workers = 0,
) -> Outcome:
    """Say what the robot is now, from a few touches: a state for --state, with a verdict.

    Examples:
        cgen anchor paths/spiral_1300.toml --touches touches.csv --artefact artefact.toml -o state.toml
        cgen anchor paths/spiral_1300.toml --touches touches.csv --log temperatures.csv --json
    """
    from compgen.error_model.anchored_state import ACCEPTED, state_text
    from compgen.pipelines.anchor.files import anchor_files
    from compgen.report.anchor import anchor_html, anchor_record

    if touches is None:
        raise InputError("--touches: missing; give the CSV of touches")
    target = opt.toml_file(output, Path("outputs") / f"{Path(path).stem}_anchor" / "state.toml", "state's")
    check_own_file("-o", str(target), "as cgen anchor wrote it", Command.ANCHOR)
    folder = None if html is None else opt.output_folder(path, html)
    options = page_options(folder or target.parent, page if folder else PageChoice(), date)
    if folder is not None:
        check_folder(folder, Run(Command.ANCHOR), record=RECORD, others=[PAGE], option="--html")
    use_cores(workers)
    result = anchor_files(
        path, robot, overrides or (), touches=touches, artefact=artefact, log=log, reference=reference, frames=frames
    )
    is_written = result.verdict in ACCEPTED
    files = [str(target)] if is_written else []
    if is_written:
        publish(target.parent, {target.name: state_text(result.state).encode()}, {})
    record = json_text(anchor_record(result))
    if folder is not None:
        reports = page_files(folder, {RECORD: record, PAGE: anchor_html(result, options)}, page, options)
        publish(folder, {}, reports, run=Run(Command.ANCHOR))
        files.append(str(folder / PAGE))
    errors = []
    if result.verdict in ("cannot tell", "something moved"):
        ending = f"{target} written" if is_written else f"{target.name} not written"
        errors.append(f"{result.findings[0].message}; {ending}")
    return Outcome(record=record, show=partial(_show, result, files), errors=errors)


def _show(result: "Anchored", files: list[str]) -> None:
    """Print the verdict, the state, and what a user must know."""
    from compgen.core.units import MINUTE, UM

    state, (before, after) = result.state, result.rms
    K, sigma = len(state.nodes), state.sigma
    rises = ", ".join(
        f"{name} {rise:.1f} +- {2 * s:.1f} (forecast {was:.1f})"
        for name, rise, s, was in zip(
            state.nodes, state.rise.tolist(), sigma[:K].tolist(), result.forecast.rise.tolist(), strict=True
        )
    )
    base = ", ".join(f"{a} {v / UM:.0f}" for a, v in zip("xyz", state.base[:3].tolist(), strict=True))
    print_lines(
        [
            f"{state.verdict}: {result.reason}",
            f"the path's place is open by {before / UM:.1f} um rms before the touches, {after / UM:.1f} um after",
            f"rise [K], k = 2: {rises}",
            f"base moved in World by {base} um; the state holds {state.window / MINUTE:.0f} min, standing",
            *finding_lines(result.findings[1:]),
            *([f"wrote {', '.join(files)}"] if files else []),
        ]
    )
