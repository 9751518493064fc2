"""What ``compare`` prints: what changed in the inputs, errors and times of both, positions, findings."""

from collections.abc import Iterator

from rich.table import Table

from compgen.cli.screen.messages import table_of, titled
from compgen.pipelines.comparison.comparison import Comparison, Pair
from compgen.report.compare_words import (
    MOST_ROWS,
    NOT_KNOWN,
    SAME,
    cell,
    change_of,
    input_cells,
    label_of,
    printed_unit,
    ranked,
    what_changed,
)
from compgen.report.key_words import ascii_units, unit_of


def comparison_shown(comparison: Comparison, files: str = "") -> Iterator[object]:
    """A comparison; ``files`` says what was written where."""
    for letter, output in (("A", comparison.a), ("B", comparison.b)):
        yield f"{letter}: {output.subject} in {output.name}, cgen {output.kind}, compgen {output.version}"
    yield from (f"warning: {note}" for note in comparison.notes)
    if comparison.inputs:
        yield from titled("inputs that changed", _inputs(comparison.inputs[:MOST_ROWS]))
        if len(comparison.inputs) > MOST_ROWS:
            yield f"and {len(comparison.inputs) - MOST_ROWS} more: --json has all"
    else:
        yield NOT_KNOWN if comparison.inputs is None else "inputs: no key changed"
    findings = comparison.findings
    groups = ("gone", findings.gone), ("new", findings.new), ("with other numbers", findings.changed)
    yield from (
        *titled("error", _number_table(comparison.error)),
        *titled("time and size", _number_table((*comparison.time, *comparison.program))),
        f"no change: {SAME}",
        *(f"finding {words}: {level} {code}: {message}" for words, group in groups for level, code, message in group),
        what_changed(comparison),
        *([files] if files else []),
    )


def _inputs(pairs: tuple[Pair, ...]) -> Table:
    rows = [(pair.key, *map(ascii_units, (*input_cells(pair), unit_of(pair.key)))) for pair in pairs]
    return table_of(("key", "A", "B", "unit"), rows, slice(1, -1), names=True)


def _number_table(pairs: tuple[Pair, ...]) -> Table:
    rows = [
        (label_of(p.key), cell(p.a, p.key), cell(p.b, p.key), change_of(p), printed_unit(p.key)) for p in ranked(pairs)
    ]
    head = ("", "A", "B", "change", "unit")
    return table_of(head, (map(ascii_units, row) for row in rows), slice(1, -1), names=True)
