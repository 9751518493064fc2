"""``python -m compgen`` and the command ``cgen``: signals are listened to before anything else is loaded."""

import gc
import os
import sys

from compgen.cli.screen.streams import let_readers_leave
from compgen.core.version import __version__

NEW_OBJECTS = 500_000  # between two searches for cycles: loading makes half as many, and leaves no cycles


def main() -> None:
    """Run the command line."""
    if sys.argv[1:] == ["--version"]:  # at once: nothing else is loaded
        let_readers_leave()
        sys.stdout.write(f"compgen {__version__}\n")
        sys.exit(0)
    gc.set_threshold(NEW_OBJECTS)
    from compgen.core import interrupts

    interrupts.install_handlers(as_json="--json" in sys.argv[1:])
    from compgen.cli.main import main as run_command_line

    try:
        run_command_line()
    except SystemExit as exit_request:
        interrupts.remove_temporary_folders()
        # The interpreter is not taken apart: that is a seventh of a short run, and a task in the background
        # (core/evaluation/threads.py) of a run that is stopped in the middle still writes into arrays.
        os._exit(int(exit_request.code or 0))


if __name__ == "__main__":
    main()
