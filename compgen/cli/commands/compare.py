"""The command that sets two outputs side by side."""

from typing import Annotated

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.options.page_options import PageChoice, PageDate, page_place
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import check_folder
from compgen.cli.output_files.publish import publish
from compgen.core.commands import Command


def compare(
    a: Annotated[
        str,
        typer.Argument(
            help="What generate, predict, correct, whatif or heat wrote: folder, or JSON report.", show_default=False
        ),
    ],
    b: Annotated[str, typer.Argument(help="Another one of the same command.", show_default=False)],
    *,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder for compare.html and compare.json; default: none.")
    ] = None,
    max_um: opt.MaxUm = None,
    page: PageChoice,
    date: PageDate = None,
    screen: opt.Screen,
) -> Outcome:
    """Set the outputs of two runs side by side. Exit 0, equal or not; with --max-um 1 where B's error is beyond it.

    Examples:
        cgen compare out/before out/after --max-um 20
    """
    from compgen.cli.screen.compare_table import comparison_shown
    from compgen.pipelines.comparison.comparison import compare as pipeline
    from compgen.report.compare_page import comparison_files
    from compgen.report.compare_words import comparison_record

    folder = None if output is None else opt.output_folder("", output)
    comparison = pipeline(a, b)
    written = ""
    if folder is not None:
        run = Run(Command.COMPARE)
        check_folder(folder, run, record="compare.json", others=["compare.html"])
        place = page_place(folder, page, date)
        files = comparison_files(comparison, max_um, place.options)
        publish(folder, {}, place.files(files), run=run)
        written = f"wrote {', '.join(sorted(files))} to {folder}"
    broken = None if max_um is None else comparison.broken_bound(max_um)
    return Outcome(
        record=comparison_record(comparison) if screen.as_json else None,
        shown=comparison_shown(comparison, written),
        errors=[f"outside bounds: {broken}"] if broken is not None else [],
    )
