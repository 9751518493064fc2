"""The command line as a user meets it, in this process: starting Python is what takes time."""

import io
import os
import pty
import sys
import sysconfig
from contextlib import chdir, redirect_stderr, redirect_stdout
from types import SimpleNamespace

import pytest
from shipped import ROOT

from compgen.cli import main
from compgen.cli.app import command_group
from compgen.core import evaluation

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "100"}
SCRIPTS = sysconfig.get_path("scripts")
#: a shell that finds what this Python's environment has installed
SHELL = {**ENVIRONMENT, "PATH": os.pathsep.join([SCRIPTS, os.environ["PATH"]])}


def run(*arguments, cwd=ROOT):
    """The command line in this process, from its arguments to its exit code: starting Python is what takes time."""
    out, err, before = io.StringIO(), io.StringIO(), sys.argv
    sys.argv = ["cgen", *map(str, arguments)]
    try:
        with chdir(cwd), redirect_stdout(out), redirect_stderr(err), pytest.raises(SystemExit) as left_with:
            main.main()
    finally:
        sys.argv = before
        evaluation.configure(None)  # as every other test finds it
    return SimpleNamespace(returncode=left_with.value.code, stdout=out.getvalue(), stderr=err.getvalue())


def typed_commands():
    """What can be typed behind ``cgen``, by its name."""
    return command_group().commands


def terminal_output(start):
    """What a terminal sees of a process that ends well; ``start`` takes the terminal's end and gives the process."""
    parent, child = pty.openpty()
    process = start(child)
    os.close(child)
    output = b""
    while True:
        try:
            output += os.read(parent, 65536)
        except OSError:  # nobody holds the other end
            break
    os.close(parent)
    assert process.wait() == 0
    return output


def refused(result, code, *words):
    assert result.returncode == code, result.stderr
    assert result.stderr.count("\n") == 1, result.stderr
    assert "Traceback" not in result.stderr
    for word in words:
        assert word in result.stderr, result.stderr
