"""The command that sets two outputs side by side."""

from typing import Annotated

import typer

from compgen.cli.options import options as opt
from compgen.cli.options.page_options import Assets, AssetsOption, PageDate, page_files, page_options
from compgen.cli.output_files.figure_files import FiguresOption
from compgen.cli.output_files.ownership import check_compare_folder
from compgen.cli.output_files.publish import publish
from compgen.cli.screen.messages import print_error, print_record


def compare(
    a: Annotated[
        str,
        typer.Argument(
            help="What generate, predict, correct, whatif or heat wrote: folder, or JSON report.", show_default=False
        ),
    ],
    b: Annotated[str, typer.Argument(help="Another one of the same command.", show_default=False)],
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder for compare.html and compare.json; default: none.")
    ] = None,
    max_um: opt.MaxUm = None,
    as_json: opt.Json = False,
    assets: AssetsOption = Assets.INLINE,
    figures: FiguresOption = None,
    date: PageDate = None,
    quiet: opt.Quiet = False,
) -> None:
    """Set two outputs side by side. Exit 0, equal or not; with --max-um 1 where B's largest error is beyond it."""
    from compgen.cli.screen.compare_table import show_comparison
    from compgen.pipelines.comparison.comparison import compare as pipeline
    from compgen.report.compare_page import comparison_files
    from compgen.report.compare_words import comparison_record

    opt.checked_bound(max_um)
    folder = None if output is None else opt.output_folder("", output)
    comparison = pipeline(a, b)
    written = ""
    if folder is not None:
        check_compare_folder(folder)
        options = page_options(folder, assets, date)
        files = comparison_files(comparison, max_um, options)
        reports = page_files(folder, files, figures, options)
        publish(folder, {}, reports)
        written = f"wrote {', '.join(sorted(files))} to {folder}"
    if as_json:
        print_record(comparison_record(comparison))
    elif not quiet:
        show_comparison(comparison, written)
    broken = None if max_um is None else comparison.broken_bound(max_um)
    if broken is not None:
        raise typer.Exit(print_error(f"outside bounds: {broken}", 1))
