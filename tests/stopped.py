"""Runs of the command line that send themselves a signal when something happens, however long they take."""

import os
import signal
import subprocess
import sys

from shipped import ROOT

HANGS_S = 900  # a run that hangs, on however busy a machine
SIGNALLED = """
import os, signal, sys
sys.path.insert(0, {root!r})
left = {nth}
def watch(event, args):
    global left
    if event == {event!r} and {word!r} in str(args[:1]):
        left -= 1
        if left == 0:
            os.kill(os.getpid(), {number})
sys.addaudithook(watch)
sys.argv = ["cgen", *{arguments!r}]
from compgen.__main__ import main
main()
"""


def script(arguments, at=None, number=signal.SIGINT):
    """Python that runs the command line and sends itself a signal at the nth audit event with a word in it."""
    event, word, nth = at or ("never", "", 1)
    return SIGNALLED.format(
        root=str(ROOT), event=event, word=word, nth=nth, number=int(number), arguments=list(map(str, arguments))
    )


def run_stopped(arguments, at=None, number=signal.SIGINT, **environment):
    """Run it in a process of its own."""
    return subprocess.run(
        [sys.executable, "-c", script(arguments, at, number)], capture_output=True, text=True, check=False,
        timeout=HANGS_S, cwd=ROOT, env={**os.environ, **environment},
    )  # fmt: skip
