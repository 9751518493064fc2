"""What ``compare`` prints: what changed in the inputs, errors and times of both, positions, findings."""

from rich.table import Table

from compgen.cli.screen.messages import print_table, stdout_console
from compgen.pipelines.comparison.comparison import Comparison, Pair
from compgen.report.compare_words import (
    MOST_ROWS,
    NOT_KNOWN,
    SAME,
    cell,
    change_of,
    headline,
    input_cells,
    label_of,
    printed_unit,
    ranked,
)
from compgen.report.key_words import ascii_units, unit_of


def show_comparison(comparison: Comparison, files: str = "") -> None:
    """Print a comparison; ``files`` says what was written where."""
    console = stdout_console()
    for letter, output in (("A", comparison.a), ("B", comparison.b)):
        console.print(f"{letter}: {output.subject} in {output.name}, cgen {output.kind}, compgen {output.version}")
    for note in comparison.notes:
        console.print(f"warning: {note}")
    if comparison.inputs:
        print_table(console, "inputs that changed", _inputs(comparison.inputs[:MOST_ROWS]))
        if len(comparison.inputs) > MOST_ROWS:
            console.print(f"and {len(comparison.inputs) - MOST_ROWS} more: --json has all")
    else:
        console.print(NOT_KNOWN if comparison.inputs is None else "inputs: no key changed")
    print_table(console, "error", _number_table(comparison.error))
    print_table(console, "time and size", _number_table((*comparison.time, *comparison.program)))
    console.print(f"no change: {SAME}")
    findings = comparison.findings
    for words, group in (("gone", findings.gone), ("new", findings.new), ("with other numbers", findings.changed)):
        for level, code, message in group:
            console.print(f"finding {words}: {level} {code}: {message}")
    console.print(headline(comparison))
    if files:
        console.print(files)


def _inputs(pairs: tuple[Pair, ...]) -> Table:
    table = _table("key")
    table.add_column("unit")
    for pair in pairs:
        table.add_row(pair.key, *map(ascii_units, input_cells(pair)), ascii_units(unit_of(pair.key)))
    return table


def _number_table(pairs: tuple[Pair, ...]) -> Table:
    table = _table("")
    table.add_column("change", justify="right")
    table.add_column("unit")
    for pair in ranked(pairs):
        row = (
            label_of(pair.key),
            cell(pair.a, pair.key),
            cell(pair.b, pair.key),
            change_of(pair),
            printed_unit(pair.key),
        )
        table.add_row(*map(ascii_units, row))
    return table


def _table(first: str) -> Table:
    table = Table()
    table.add_column(first, no_wrap=True)
    for letter in ("A", "B"):
        table.add_column(letter, justify="right")
    return table
