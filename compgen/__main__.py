"""``python -m compgen`` and the command ``cgen``: Ctrl-C is minded before anything else is loaded."""

import os
import sys

from compgen.core import interrupts


def main() -> None:
    """Run the command line."""
    interrupts.install_handlers()
    from compgen.cli.main import main as command_line

    try:
        command_line()
    except SystemExit as leaving:  # at once: a thread that is still at work must not meet an interpreter taken apart
        interrupts.remove_temporary_folders()
        if "multiprocessing.synchronize" in sys.modules:  # its processes are told by what runs at the end
            raise
        os._exit(int(leaving.code or 0))


if __name__ == "__main__":
    main()
