"""``python -m compgen`` and the command ``cgen``: signals are listened to before anything else is loaded."""

import os
import threading

from compgen.core import interrupts


def main() -> None:
    """Run the command line."""
    interrupts.install_handlers()
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
