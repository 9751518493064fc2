"""What ``compare`` prints: what changed in the inputs, errors and times of both, positions, findings."""

from rich.table import Table
from rich.text import Text

from compgen.cli.console import stdout_console
from compgen.pipelines.comparison.comparison import Comparison, Pair
from compgen.report.compare_record import cell, change_of, headline, label_of, printed_unit
from compgen.report.key_words import ascii_units, unit_of


def show_comparison(comparison: Comparison, files: str = "") -> None:
    """Print a comparison; ``files`` says what was written where."""
    console = stdout_console()
    for letter, output in (("A", comparison.a), ("B", comparison.b)):
        console.print(f"{letter}: {output.subject} in {output.name}, cgen {output.kind}, compgen {output.version}")
    for note in comparison.notes:
        console.print(f"warning: {note}")
    if comparison.inputs:
        console.print(_inputs(comparison.inputs))
    else:
        console.print("inputs: no key changed")
    console.print(_numbers("error", comparison.error))
    console.print(_numbers("time and size", (*comparison.time, *comparison.program)))
    findings = comparison.findings
    for words, group in (("gone", findings.gone), ("new", findings.new), ("with other numbers", findings.changed)):
        for level, code, message in group:
            console.print(f"finding {words}: {level} {code}: {message}")
    console.print(headline(comparison))
    if files:
        console.print(files)


def _inputs(pairs: tuple[Pair, ...]) -> Table:
    table = _table("inputs that changed", "key")
    table.add_column("unit")
    for pair in pairs:
        table.add_row(pair.key, cell(pair.a, pair.key), cell(pair.b, pair.key), ascii_units(unit_of(pair.key)))
    return table


def _numbers(title: str, pairs: tuple[Pair, ...]) -> Table:
    table = _table(title, "")
    table.add_column("change", justify="right")
    table.add_column("unit")
    for pair in pairs:
        row = (
            label_of(pair.key),
            cell(pair.a, pair.key),
            cell(pair.b, pair.key),
            change_of(pair),
            printed_unit(pair.key),
        )
        table.add_row(*map(ascii_units, row))
    return table


def _table(title: str, first: str) -> Table:
    table = Table(title=Text(title), title_justify="left", title_style="bold")
    table.add_column(first, no_wrap=True)
    for letter in ("A", "B"):
        table.add_column(letter, justify="right")
    return table
