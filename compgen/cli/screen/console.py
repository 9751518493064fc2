"""The console that tables and sentences go to: as wide as the terminal; into a pipe or a file nothing is wrapped."""

import sys
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from compgen.core.findings import Finding

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

UNWRAPPED = 100_000  # columns


def stdout_console() -> "Console":
    """Of the output stream, without markup or colours of its own in texts."""
    from rich.console import Console

    terminal = sys.stdout.isatty()
    width = None if terminal else UNWRAPPED
    return Console(width=width, highlight=False, markup=False, force_terminal=terminal)  # whatever FORCE_COLOR says


def finding_lines(findings: Iterable[Finding | Mapping[str, str]]) -> list[str]:
    """Findings, or their records, as a reader sees them: how much each weighs, and what it says."""
    records = (finding.record() if isinstance(finding, Finding) else finding for finding in findings)
    return [f"{record['level']}: {record['message']}" for record in records]


def print_findings(console: "Console", findings: Iterable[Finding | Mapping[str, str]]) -> None:
    """Print findings, a line each."""
    for line in finding_lines(findings):
        console.print(line)


def sizes_table(first: str, sides: Iterable[str], *more: str) -> "Table":
    """A table whose columns are largest, 99th percentile and rms of each side of an error, and more to their right."""
    from rich.table import Table

    from compgen.report.page import statistics_head

    table = Table()
    table.add_column(first, no_wrap=True)
    for name in (*statistics_head(sides), *more):
        table.add_column(name, justify="right")
    return table


def print_table(console: "Console", title: str, table: "Table") -> None:
    """Print a table under its title, which may be wider: rich would wrap a title of the table's own, and fill it up."""
    from rich.text import Text

    console.print(Text(" ".join(title.split()), style="bold"))
    console.print(table)
