"""Runs of the command line that send themselves a signal when something happens, however long they take."""

import os
import signal
import subprocess
import sys

from forked import HANGS_S, code_of, run_forked
from shipped import ROOT

SIGNALLED = """
import os, signal, sys
left = {nth}
def watch(event, args):
    global left
    if event == {event!r} and {word!r} in str(args[:1]):
        left -= 1
        if left == 0:
            os.kill(os.getpid(), {number})
sys.addaudithook(watch)
"""


def script(arguments, at=None, number=signal.SIGINT):
    """Python that runs the command line and sends itself a signal at the nth audit event with a word in it."""
    event, word, nth = at or ("never", "", 1)
    return SIGNALLED.format(event=event, word=word, nth=nth, number=int(number)) + code_of(arguments)


def run_stopped(arguments, at=None, number=signal.SIGINT, **environment):
    """Run it in a process of its own, which imports for itself where that is the moment."""
    code = script(arguments, at, number)
    if at is None or at[0] != "import":
        return run_forked(code, **environment)
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False,
        timeout=HANGS_S, cwd=ROOT, env={**os.environ, **environment},
    )  # fmt: skip
