"""What every command has in common: wrong use is one line, and the help needs no arguments."""

import os
import subprocess
import sys

import pytest
from command_line import ENVIRONMENT, refused, run
from shipped import ROOT


@pytest.mark.parametrize(
    "arguments", [["nonsense"], ["generate"], ["generate", "--bogus"], ["check", "x.toml", "--junit", ""]]
)
def test_wrong_use_is_one_line_and_exit_2(arguments):
    result = run(*arguments)
    refused(result, 2)
    assert result.stderr.startswith("cgen: ")


def test_no_arguments_show_the_help():
    result = run()
    assert result.returncode == 0
    assert "generate" in result.stdout


def test_wrong_use_names_the_help():
    assert run("pages").stderr == "cgen: Missing argument 'program'; see cgen --help\n"


@pytest.mark.parametrize("arguments", [["--version"], ["--help"], ["inspect", "tests/golden/MOVES.LS", "--json"]])
def test_a_reader_that_has_seen_enough_is_no_failure(arguments):
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-m", "compgen", *arguments],
        cwd=ROOT, env=ENVIRONMENT, stdout=writing, stderr=subprocess.PIPE, text=True, check=False,
    )  # fmt: skip
    os.close(writing)
    assert (done.returncode, done.stderr) == (0, "")
