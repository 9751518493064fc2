"""``python -m compgen`` and the command ``cgen``: signals are listened to before anything else is loaded."""

import os
import sys
import threading

from compgen.cli.screen.streams import let_readers_leave
from compgen.core.version import __version__


def main() -> None:
    """Run the command line."""
    if sys.argv[1:] == ["--version"]:  # at once: nothing else is loaded
        let_readers_leave()
        sys.stdout.write(f"compgen {__version__}\n")
        sys.exit(0)
    from compgen.core import interrupts

    interrupts.install_handlers(as_json="--json" in sys.argv[1:])
    from compgen.cli.main import main as run_command_line

    try:
        run_command_line()
    except SystemExit as exit_request:
        interrupts.remove_temporary_folders()
        if any(thread.name == "background" for thread in threading.enumerate()):
            # A task in the background (core/evaluation/threads.py) goes on when the run is stopped or refused in the
            # middle. It writes into arrays, so the interpreter must not be taken apart under it; nobody waits for it.
            os._exit(int(exit_request.code or 0))
        raise


if __name__ == "__main__":
    main()
