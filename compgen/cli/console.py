"""The console that tables and sentences go to: as wide as the terminal; into a pipe or a file nothing is wrapped."""

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

UNWRAPPED = 100_000  # columns


def stdout_console() -> "Console":
    """Of the output stream, without markup or colours of its own in texts."""
    from rich.console import Console

    terminal = sys.stdout.isatty()
    width = None if terminal else UNWRAPPED
    return Console(width=width, highlight=False, markup=False, force_terminal=terminal)  # whatever FORCE_COLOR says
