"""What every command has in common: wrong use is one line, and the help needs no arguments."""

import json
import os
import subprocess
import sys

import pytest
from command_line import ENVIRONMENT, refused, run, typed_commands
from shipped import ROOT

COMMANDS = typed_commands()


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
    assert run("pages").stderr == "cgen: Missing argument 'program': A FANUC program, NAME.LS; see cgen pages --help\n"


@pytest.mark.parametrize("command", COMMANDS)
def test_an_argument_that_is_missing_is_said_with_what_it_is(command):
    needed = [p for p in COMMANDS[command].params if p.required]
    if not needed:
        pytest.skip("it needs none")
    refused(run(command), 2, "Missing ", f": {needed[0].help.rstrip('.')}; see cgen {command} --help")


@pytest.mark.parametrize("command", COMMANDS)
def test_an_option_without_its_value_names_the_command_s_help(command):
    for option in ("--robot", "-o", "--set"):
        if any(option in p.opts for p in COMMANDS[command].params):
            refused(run(command, option), 2, f"'{option}' requires an argument; see cgen {command} --help")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["chek", "paths/line_y.toml"], "No such command 'chek'. Did you mean 'check'"),
        (["check", "--wokers", "2", "paths/line_y.toml"], "did you mean --workers?; see cgen check --help"),
        (["--json", "check", "paths/line_y.toml"], "behind it: cgen check ... --json"),
        (["generate", "paths/line_y.toml", "--junit", "x"], "--junit; cgen check has it"),
        (["paths/line_y.toml", "generate"], "the command comes first: cgen generate paths/line_y.toml"),
        (["PART.LS"], "the command comes first: cgen inspect PART.LS"),
        (["check", "paths/lin_y.toml"], "no such file; did you mean paths/line_y.toml?"),
        (["check", "paths/line_y.tml"], "no such file; did you mean paths/line_y.toml?"),
        (["check", "line_y"], "no such file; did you mean paths/line_y.toml?"),
        (["check", "paths/quite_another.toml"], "no such file; 'cgen init' lays down"),
        (["check", "nowhere/quite_another.toml"], "no such file; 'cgen init' lays down"),
        (["inspect", "tests/golden/MOVS.LS"], "No such file or directory; did you mean tests/golden/MOVES.LS?"),
        (["correct", "paths/line_y.toml"], "cgen generate, predict and check take path files"),
        (["check", "tests/golden/MOVES.LS"], "cgen correct and cgen inspect take it"),
        (["check", "paths/line_y.toml", "--set"], "'--set' requires an argument"),
        (["check", "paths/line_y.toml", "--workers", "-1"], "'--workers'"),
        (["check", "paths/line_y.toml", "--workers", "two"], "'--workers'"),
        (["heat", "paths/line_y.toml", "--figures", "gif"], "'--figures': 'gif' is not one of 'svg', 'png', 'pdf'"),
        (["check", "paths/line_y.toml", "--max-um", "nan"], "--max-um nan: must be 0.001 to 1000000 um"),
    ],
)
def test_wrong_use_names_what_is_near(arguments, words):
    done = run(*arguments)
    refused(done, 2, words)
    assert len(done.stderr) <= 301
    assert done.stdout == "" or json.loads(done.stdout)["exit_code"] == 2


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


@pytest.mark.parametrize("value", ["x", "", "-1"])
def test_variables_that_only_libraries_read_end_no_command(value):
    """Numpy reads SOURCE_DATE_EPOCH as a number, OpenMP says what it thinks of OMP_NUM_THREADS."""
    variables = {"SOURCE_DATE_EPOCH": value, "OMP_NUM_THREADS": value}
    command = [sys.executable, "-m", "compgen", "check", "paths/line_y.toml", "-q"]
    result = subprocess.run(command, env={**ENVIRONMENT, **variables}, cwd=ROOT, capture_output=True, text=True)
    assert (result.returncode, result.stderr) == (0, "")
