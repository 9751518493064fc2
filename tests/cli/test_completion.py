"""Values that a shell completes, asked for as bash, zsh and fish ask."""

import json
import os
import shutil
import subprocess
import sys

import pytest
from command_line import ENVIRONMENT
from forked import COMMAND_LINE, run_forked
from shipped import ROOT

#: libraries that a key press must not wait for
SLOW = {"casadi", "pinocchio", "scipy", "numpy", "plotly", "ruckig"}
ASKED = """
import json, os, sys
os._exit = sys.exit
sys.argv[:] = ["cgen"]
from compgen.__main__ import main
try:
    main()
finally:
    sys.stderr.write(json.dumps(sorted({name.partition(".")[0] for name in sys.modules})))
"""


def complete(line, shell="bash", cwd=ROOT):
    """The words that a shell is offered at the end of a line."""
    count = len(line.split()) - (not line.endswith(" "))
    protocol = {
        "bash": {"COMP_WORDS": line, "COMP_CWORD": str(count)},
        "zsh": {"_TYPER_COMPLETE_ARGS": line},
        "fish": {
            "_TYPER_COMPLETE_ARGS": line,
            "_TYPER_COMPLETE_FISH_ACTION": "get-args",
            "_TYPER_COMPLETE_WORD_TO_COMPLETE": "" if line.endswith(" ") else line.split()[-1],
        },
    }[shell]
    asked = {**ENVIRONMENT, "_CGEN_COMPLETE": f"complete_{shell}", **protocol}
    done = run_forked(ASKED, cwd, loading=COMMAND_LINE, **asked)
    assert not SLOW & set(json.loads(done.stderr.splitlines()[-1]))
    return done.stdout


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    folder = tmp_path_factory.mktemp("project")
    for name in (
        "paths/mirror.toml", "paths/lens.toml", "robots/my_arm.toml", "PART.LS", "notes.txt", "deep/er/other.toml",
        "outputs/mirror/MIRROR.LS", "outputs/mirror/MIRROR.pages.json", "outputs/lens/LENS.LS",
    ):  # fmt: skip
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("")
    return folder


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("cgen check ", ["paths/lens.toml", "paths/mirror.toml"]),
        ("cgen generate paths/m", ["paths/mirror.toml"]),
        ("cgen check paths/lens.toml paths/m", ["paths/mirror.toml"]),
        ("cgen predict deep/er/", ["deep/er/other.toml"]),
        ("cgen inspect ", ["PART.LS", "outputs/lens/LENS.LS", "outputs/mirror/MIRROR.LS"]),
        ("cgen correct P", ["PART.LS"]),
        ("cgen offsets paths/l", ["paths/lens.toml"]),
        ("cgen resume ", ["outputs/mirror"]),
        ("cgen generate x --robot my", ["my_arm"]),
        ("cgen inspect-robot m710ic5", ["m710ic50"]),
        ("cgen identify robots/", ["robots/my_arm.toml"]),
        ("cgen predict x --set process.feed", ["process.feed_mm_s="]),
        ("cgen predict x --set robot.thermal.cte", ["robot.thermal.cte_um_m_K="]),
        ("cgen whatif x --vary before.0.duration", ["before.0.duration_h="]),
        ("cgen whatif x --ask war", ["warmup"]),
        ("cgen correct X.LS --mark r", ["remark"]),
        ("cgen anchor x --reference a", ["ambient"]),
        ("cgen schema ", ["path", "robot"]),
        ("cgen generate x --assets s", ["shared"]),
        ("cgen identi", ["identify", "identify-motion"]),
        ("cgen generate x --max", ["--max-um"]),
        ("cgen check nowhere/", []),  # the shell's own files
    ],
)
def test_bash_is_offered(project, line, words):
    assert complete(line, cwd=project).split() == words


@pytest.mark.parametrize("shell", ["zsh", "fish"])
@pytest.mark.parametrize("line", ["cgen check paths/m", "cgen predict x --set process.feed"])
def test_zsh_and_fish_are_offered_the_same(project, shell, line):
    (word,) = complete(line, cwd=project).split()
    offered = complete(line, shell, cwd=project)
    assert word.rstrip("=") in offered
    if "--set" in line:
        assert "Speed of the tool centre point" in offered  # what a key means


def test_a_folder_that_cannot_be_read_is_no_failure(tmp_path):
    (tmp_path / "paths").write_text("a file")
    assert complete("cgen check p", cwd=tmp_path).split() == []
    (tmp_path / "outputs").mkdir(mode=0o000)
    assert os.path.isdir(tmp_path / "outputs")
    assert complete("cgen resume o", cwd=tmp_path).split() == []


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
def test_the_script_works_in_a_bash(project, tmp_path):
    """Sourced, its function called as bash calls it: command, word at work, word before."""
    command = tmp_path / "cgen"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m compgen "$@"\n')
    command.chmod(0o755)
    script = """
source <(_CGEN_COMPLETE=source_bash cgen)
function=$(complete -p cgen | sed -E 's/.* -F ([^ ]+).*/\\1/')
ask() { COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); "$function" cgen "${!#}" "${@: -2:1}"; echo "${COMPREPLY[@]}"; }
ask cgen gen
ask cgen check paths/m
ask cgen check x --wor
"""
    environment = {**ENVIRONMENT, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "--norc", "-c", script], cwd=project, env=environment, capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    assert done.stdout.splitlines() == ["generate", "paths/mirror.toml", "--workers"]
