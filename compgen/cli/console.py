"""The console that tables and sentences go to: as wide as the terminal; into a pipe or a file nothing is wrapped."""

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

UNWRAPPED = 100_000  # columns


def stdout_console() -> "Console":
    """Of the output stream, without markup or colours of its own in texts."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else UNWRAPPED, highlight=False, markup=False)
