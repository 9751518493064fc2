"""docs/commands.md says what the application's help says. To renew it: python docs/command_tables.py."""

import re
import shlex
import sys

import pytest
import typer
from command_line import run
from shipped import ROOT

from compgen.cli.app import NAMES, PAGES

sys.path.insert(0, str(ROOT / "docs"))
import command_tables

COMMANDS = [name for names in NAMES.values() for name in names]
PAGE = (ROOT / "docs" / "commands.md").read_text()


def test_the_page_has_every_command_with_where_it_is_explained():
    names = [line.removeprefix("### cgen ") for line in PAGE.splitlines() if line.startswith("### ")]
    assert names == COMMANDS
    assert sorted(name for names in PAGES.values() for name in names) == sorted(COMMANDS)


@pytest.mark.skipif(
    tuple(map(int, typer.__version__.split(".")[:2])) < (0, 29), reason="older typer words types otherwise"
)
def test_the_page_of_commands_is_current():
    assert command_tables.page() == PAGE


@pytest.mark.parametrize("call", re.findall(r"^cgen (generate .*)$", PAGE, re.MULTILINE))
def test_what_is_shown_of_generate_writes_its_program(call, tmp_path):
    """50 mm higher the study's spiral is out of reach: it was the example of a dry run."""
    done = run(*shlex.split(call), "-o", tmp_path / "out", cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert list((tmp_path / "out").glob("*.LS"))
