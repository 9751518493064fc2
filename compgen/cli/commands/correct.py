"""The command that corrects a program that exists."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.options.completion import one_of
from compgen.cli.options.page_options import Labels, PageChoice, PageDate, PagePlace, page_place
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import REPORT, Headed, check_folder, check_restored
from compgen.cli.output_files.publish import publish
from compgen.cli.screen.messages import (
    MOST_UNSAFE,
    finding_rows,
    outside_words,
    sizes_table,
    titled,
    unsafe_lines,
)
from compgen.core import stages
from compgen.core.commands import Command
from compgen.core.exceptions import InputError, naming_file
from compgen.core.files import PROVENANCE, read_regular
from compgen.core.json_text import read_record
from compgen.core.units import counted

if TYPE_CHECKING:
    from compgen.pipelines.correct import Correction
    from compgen.pipelines.correct.result import Options

FEW_UNSAFE = 5  # statements that are printed, where no more are asked for

REPORTS = ("report.html", "positions.csv")

_PROGRAM_LINE = re.compile(rb"^/PROG[ \t]+([A-Za-z0-9_-]+)", re.MULTILINE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Wishes:
    """What is done to the program."""

    split: Annotated[bool, typer.Option("--split", help="Part positions whose uses need different corrections.")] = (
        False
    )
    insert: Annotated[
        float | None, typer.Option("--insert", help="Put points into straight lines that stray by more [um].")
    ] = None
    max_um: opt.MaxUm = None
    average_over: Annotated[
        str | None,
        typer.Option("--average-over", help="One file for many starts: 'delay_s=[0, 1200]', override_percent."),
    ] = None
    guaranteed: Annotated[
        str | None,
        typer.Option("--guaranteed", help="Bounds with a probability: 'max_um=60, share=0.95', draws, seed."),
    ] = None
    strict: Annotated[bool, typer.Option("--strict", help="Refuse a program with unsafe statements.")] = False
    again: Annotated[bool, typer.Option("--again", help="Take a program that is corrected already.")] = False
    mark: Annotated[
        str,
        typer.Option(
            "--mark",
            autocompletion=one_of("digits", "remark"),
            help="digits, or remark: a remark line where the digits cannot carry the mark.",
        ),
    ] = "digits"
    restore: Annotated[bool, typer.Option("--restore", help="Give the planned program back instead.")] = False
    force: opt.ForceProgram = False
    lift_all: Annotated[
        float | None, typer.Option("--lift-all", help="Correct a dry run instead: NAME_DRY.LS, lifted by so much [mm].")
    ] = None

    def options(self) -> "Options":
        """The same as the correction takes it."""
        from compgen.pipelines.correct.result import options_of

        return options_of(
            split=self.split,
            insert_um=self.insert,
            strict=self.strict,
            again=self.again,
            mark=self.mark,
            max_um=self.max_um,
            average_over=self.average_over,
            lift_all=self.lift_all,
            guaranteed=self.guaranteed,
        )


def correct(
    program: opt.ProgramFile,
    *,
    tables: opt.ProgramTables,
    choice: opt.ProgramChoice,
    output: opt.ProgramFolder = None,
    wishes: Wishes,
    page: PageChoice,
    labels: Labels,
    date: PageDate = None,
    screen: opt.FindingScreen,
    cores: opt.Cores,
) -> Outcome:
    """Correct an existing program in place: only the numbers of its positions change.

    Examples:
        cgen correct JOB.LS --robot m710ic50 --before 'moving 200mm/s 5h' --max-um 20
        cgen correct out/JOB.LS --restore -o planned
    """
    from compgen.cli.screen.progress_bar import CORRECT, show_progress
    from compgen.pipelines import correct as pipeline
    from compgen.pipelines.correct.program_file import programs_beside, read_program, refuse_corrected
    from compgen.program.program import DRY

    options, source = wishes.options(), Path(program)
    folder = opt.output_folder(program, output, "_dry" if options.raised else "")
    content = read_program(program)
    opt.check_elsewhere(program, folder / source.name, "the result")
    place = page_place(folder, page, date, labels)
    if wishes.restore:
        return _restore(source, content, folder)
    file = f"{source.stem}{DRY}{source.suffix}" if options.raised else source.name
    if not options.raised:
        _check(folder, content, file)
    if not wishes.again:
        refuse_corrected(source, content)
    (cell, history, air, reference), (frames, registers) = choice.begin(program, content), tables.read()
    options = replace(options, air=air, reference=reference)
    # a dry run is known by the name that it gets on this controller
    run = _check(folder, content, file, cell.robot.controller.capacity.name_length if options.raised else None)
    with show_progress(CORRECT, quiet=screen.is_silent) as progress:
        with naming_file(program):
            correction = pipeline.correct(
                content, cell, frames, history, options, progress, programs_beside(source), registers=registers
            )
        progress(stages.REPORT, 0.0)
        return _publish(correction, place, file, run, force=wishes.force, verbose=screen.verbose)


def _publish(correction: "Correction", place: PagePlace, file: str, run: Run, *, force: bool, verbose: bool) -> Outcome:
    """Put the program, where it may be loaded, and its reports into their folder."""
    from compgen.report.correction import correction_files

    written = correction.is_usable or force
    files = correction_files(correction, file, place.options, with_program=written)
    own = (Path(file).stem + PROVENANCE, file)
    programs = {name: files[name] for name in own if name in files}
    reports = {name: files[name] for name in (REPORT, *REPORTS)}
    publish(place.folder, programs, place.files(reports), own, run=run)
    errors = []
    if not correction.inside:
        ending = "written all the same" + ("" if correction.is_usable else " (--force)")
        ending = ending if written else f"{file} not written; --force writes it"
        errors.append(f"{outside_words(correction.findings)}; {ending}")
    shown = correction_shown(correction, place.folder, files, verbose=verbose)
    return Outcome(record=files[REPORT], shown=shown, errors=errors)


def _check(folder: Path, content: bytes, file: str, dry_length: int | None = None) -> Run:
    """What ``correct`` of a program writes about; raises InputError where it would replace what is not its own.

    Args:
        folder: Where results go.
        content: Of the planned program.
        file: Of the corrected one, which its provenance beside it vouches for.
        dry_length: Of names on the controller, where it is of a dry run.
    """
    from compgen.program.program import dry_name

    match = _PROGRAM_LINE.search(content, 0, 4000)
    name = match[1].decode("ascii") if match else Path(file).stem
    run = Run(Command.CORRECT, name if dry_length is None else dry_name(name, dry_length))
    provenance = Path(file).stem + PROVENANCE
    is_own = "planned_sha256" in read_record(folder / provenance)
    unvouched = [] if is_own else [Headed(program=file), Headed(program=provenance)]
    check_folder(folder, run, record=REPORT, others=REPORTS, headed=unvouched)
    return run


def _restore(source: Path, content: bytes, folder: Path) -> Outcome:
    """Write the planned program that a corrected one was made from."""
    from compgen.report.provenance import restore_planned

    provenance = source.with_name(source.stem + PROVENANCE)
    try:
        record = read_regular(provenance)
    except OSError:
        raise InputError(
            f"{source}: {provenance.name} is not beside it; put it back, it holds the planned program"
        ) from None
    planned = restore_planned(record, content, str(provenance))
    check_restored(folder, source.name, planned)
    publish(folder, {source.name: planned}, {})
    digest = sha256(planned).hexdigest()
    return Outcome(
        record={"command": Command.CORRECT, "restored": source.name, "folder": str(folder), "sha256": digest},
        lines=[f"wrote the planned {source.name} to {folder}"],
    )


def correction_shown(
    correction: "Correction", folder: Path, files: Iterable[str], *, verbose: bool
) -> Iterator[object]:
    """The errors, then: before and after, what is not known, what to read, what was written."""
    from compgen.report.band_words import before_and_after, gain_words, guaranteed_text, not_known_words
    from compgen.report.correction import correction_summary

    summary = correction_summary(correction)
    if summary["before"]:
        rows = [
            [label, *(f"{v:.2f}" for side in ("before", "after") for v in summary[side][key].values())]
            for key, label in (("total", "position, um"), ("turn", "orientation, mdeg"))
        ]
        table = sizes_table("error", ("before", "after"), rows)
        yield from titled(f"{summary['name']} on {summary['provenance']['robot']}", table)
    if "guaranteed" in summary:
        yield guaranteed_text(summary["guaranteed"])
    if summary["before"]:
        yield f"{before_and_after(summary)}{gain_words(summary)}"
    yield f"verdict: {summary['verdict']}"
    count, heat = summary["positions"], summary["thermal"]
    yield (
        f"{counted(count['corrected'], 'position', 'positions')} corrected, {count['new']} new, {count['unchanged']} "
        f"unchanged; {summary['duration_s']:.1f} s"
    )
    if verbose:
        rises = (f"{n} {v:.2f} to {heat['end_K'][n]:.2f}" for n, v in heat["start_K"].items())
        yield f"rise [K]: {', '.join(rises)}"
    if summary["before"] and summary["band"]:
        yield not_known_words(summary["band"], verbose=verbose)
    yield from finding_rows(summary["findings"], verbose=verbose)
    yield from unsafe_lines(summary["unsafe"], MOST_UNSAFE if verbose else FEW_UNSAFE, f"in {REPORT}")
    yield f"wrote {', '.join(sorted(files))} to {folder}"
