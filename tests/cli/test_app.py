"""The application: its help, its version, its name in a shell, and shell completion."""

import json
import re
import shlex
import subprocess
import sys
import tomllib

import pytest
from command_line import ENVIRONMENT, SCRIPTS, SHELL, refused, run, typed_commands
from forked import COMMAND_LINE, run_forked
from shipped import ROOT
from typer.testing import CliRunner

from compgen.cli.app import app

COMMANDS = (
    "init", "inspect", "correct", "predict", "generate", "check",
    "pages", "check-backup", "executed",
    "resume", "follow", "anchor", "offsets",
    "heat", "whatif", "compare",
    "plan-poses", "identify", "check-robot", "plan-touches", "teach-frame", "plan-motion-log", "identify-motion",
    "inspect-robot", "export-robot", "schema", "explain",
)  # fmt: skip
SLOW = {"casadi", "pinocchio", "scipy", "numpy", "plotly", "ruckig"}
MODULES = """
import json, os, sys
os._exit = sys.exit
sys.argv[:] = ["cgen", *{arguments!r}]
from compgen.__main__ import main
try:
    main()
finally:
    sys.stderr.write(json.dumps(sorted({{name.partition(".")[0] for name in sys.modules}})))
"""


def bash(script, **variables):
    return subprocess.run(
        ["bash", "--norc", "-c", script],
        cwd=ROOT, env={**SHELL, **variables}, capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.mark.parametrize("arguments", [["--version"], ["--help"], [], *([name, "--help"] for name in COMMANDS)])
def test_version_and_help_load_no_slow_library(arguments):
    done = run_forked(MODULES.format(arguments=arguments), loading=COMMAND_LINE, **ENVIRONMENT)
    assert done.returncode == 0
    assert done.stdout
    assert not SLOW & set(json.loads(done.stderr))


def test_the_check_for_slow_libraries_bites():
    call = ["inspect", "tests/golden/MOVES.LS"]
    done = run_forked(MODULES.format(arguments=call), loading=COMMAND_LINE, **ENVIRONMENT)
    assert {"casadi", "numpy"} <= set(json.loads(done.stderr))


def test_the_help_lists_every_command_in_the_order_of_work():
    text = run("--help").stdout
    assert text.startswith("Usage: cgen ")
    sections = text.partition("Start here:\n")[2].partition("cgen help")[0]
    listed = [line.split()[0] for line in sections.splitlines() if line[:2] == "  " and line[2:3].isalpha()]
    assert tuple(section.split("\n")[0] for section in sections.split("\n\n")[1:-1]) == (
        "Programs:", "While a job runs:", "What if:", "Measurements:", "Files and words:",
    )  # fmt: skip
    assert sections.split("\n\n")[0].count("\n") + 1 == 6  # to start with
    assert tuple(listed) == COMMANDS


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_examples_that_it_takes(name):
    text = run(name, "-h").stdout
    assert text == run(name, "--help").stdout
    lines = re.split(r"^ *Examples?:\n", text, flags=re.MULTILINE)[1].splitlines()
    assert lines
    for line in lines:
        program, called, *arguments = shlex.split(line)
        assert (program, called) == ("cgen", name)
        command = typed_commands()[name]
        command.make_context(name, list(arguments), resilient_parsing=False)  # refuses what it does not know


@pytest.mark.parametrize("name", COMMANDS)
def test_every_help_names_a_page_that_is_there(name):
    page = re.search(r"^ *Explained in (\S+)$", run(name, "-h").stdout, re.MULTILINE)
    assert page
    assert (ROOT / page[1]).is_file()


def test_help_of_a_command_may_be_asked_for_in_either_way():
    assert run("help").stdout == run("--help").stdout
    assert run("help", "check").stdout == run("check", "--help").stdout
    refused(run("help", "chek"), 2, "No such command 'chek'. Did you mean 'check'")


@pytest.mark.parametrize(("old", "new"), [("validate", "check-robot"), ("verify-backup", "check-backup")])
def test_a_command_that_was_called_otherwise_says_so_and_runs(old, new):
    assert f"  {old} " not in run("--help").stdout
    first, *rest = run(old).stderr.splitlines()
    assert first == f"cgen: note: cgen {old} is called cgen {new} now"
    assert len(rest) == 1
    assert "Missing argument" in rest[0]
    assert run(old, "--help").stdout.replace(f"Usage: cgen {old} ", f"Usage: cgen {new} ") == run(new, "-h").stdout


def test_both_scripts_run_the_same_command():
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]
    assert scripts == {"cgen": "compgen.__main__:main", "compgen": "compgen.__main__:main"}


def test_bash_finds_the_command_and_nothing_of_its_own_by_that_name():
    assert bash("type -t cgen").stdout == "file\n"
    assert bash("type -P cgen").stdout.startswith(SCRIPTS)
    assert bash("type -t compgen").stdout == "builtin\n"  # why there is a second name


def test_the_command_works_in_bash():
    done = bash("cgen --version")
    assert (done.returncode, done.stdout, done.stderr) == (0, "compgen 0.1.0\n", "")
    done = bash("cgen generate paths/no_such_path.toml")
    assert done.returncode == 2
    assert done.stderr.startswith("cgen: ")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_completion_of_each_shell_is_shown(shell, monkeypatch):
    monkeypatch.setattr("shellingham.detect_shell", lambda: (shell, f"/bin/{shell}"))
    result = CliRunner().invoke(app, ["--show-completion"], prog_name="cgen")
    assert result.exit_code == 0
    assert "_CGEN_COMPLETE" in result.stdout


def test_completion_is_installed_for_the_shell_one_is_in(tmp_path):
    done = bash("cgen --install-completion || exit 1", HOME=str(tmp_path))  # bash stays its parent
    assert done.returncode == 0, done.stderr
    assert "bash completion installed in" in done.stdout
    script = tmp_path / ".bash_completions" / "cgen.sh"
    assert str(script) in (tmp_path / ".bashrc").read_text()
    complete = """
source "$HOME/.bashrc"
COMP_WORDS=({words}) COMP_CWORD={at}
_cgen_completion cgen
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    words = bash(complete.format(words="cgen plan-p", at=1), HOME=str(tmp_path)).stdout.split()
    assert words == ["plan-poses"]
    words = bash(complete.format(words="cgen generate --wo", at=2), HOME=str(tmp_path)).stdout.split()
    assert words == ["--workers"]


def test_a_completion_loads_no_slow_library():
    done = subprocess.run(
        [sys.executable, "-c", MODULES.format(arguments=[])],
        cwd=ROOT, capture_output=True, text=True, check=False,
        env={**ENVIRONMENT, "_CGEN_COMPLETE": "complete_bash", "COMP_WORDS": "cgen ge", "COMP_CWORD": "1"},
    )  # fmt: skip
    assert done.stdout.split() == ["generate"]
    assert not SLOW & set(json.loads(done.stderr))


def test_a_compiler_that_cannot_be_parsed_is_refused(monkeypatch):
    monkeypatch.setenv("CC", 'gcc "')
    refused(run("check", "paths/line_y.toml", "-q"), 2, "CC: 'gcc \"' is no command: No closing quotation")
