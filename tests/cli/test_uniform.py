"""Four options mean the same in every command that has them; where one is missing there is a reason."""

import re

import pytest
from shipped import ROOT
from typer.main import get_command

from compgen.cli.app import app
from compgen.cli.options import options

COMMANDS = get_command(app).commands
NO_ROWS = "it reads and writes files; there is nothing to share out over cores"
NO_ERROR = "it computes no error on the part"
#: option, and the commands that do without it, each with its reason
WITHOUT = {
    "--json": {},
    "--quiet": {},
    "--workers": {
        name: NO_ROWS
        for name in (
            "inspect", "compare", "pages", "verify-backup", "inspect-robot", "export-robot", "init", "schema",
            "teach-frame",
        )
    },
    "--max-um": {
        **{name: NO_ERROR for name in ("inspect", "pages", "inspect-robot", "export-robot", "init", "schema")},
        "verify-backup": "every digit counts",
        "anchor": "it judges a state, not a path: its verdict says whether the state can be used",
        "identify": "it judges a fit by what it was not fitted to; validate has a bound",
        "identify-motion": "it judges a fit by what it was not fitted to; executed has a bound",
        "plan-poses": "nothing is measured yet",
        "plan-touches": "nothing is measured yet",
        "teach-frame": "it judges a frame by the touches' own noise",
    },
}  # fmt: skip
ANNOTATIONS = dict(zip(WITHOUT, (options.Json, options.Quiet, options.Workers, options.MaxUm), strict=True))


def option_of(command, name):
    return next((p for p in COMMANDS[command].params if name in p.opts), None)


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("name", WITHOUT)
def test_every_command_has_the_option_or_a_reason(command, name):
    option = option_of(command, name)
    assert (option is None) == (command in WITHOUT[name])
    if option is None:
        return
    (declared,) = ANNOTATIONS[name].__metadata__
    assert option.help == declared.help
    assert set(option.opts) == {declared.default, *declared.param_decls}
    assert option.default in (None, False, 0)


def test_the_exceptions_are_commands():
    assert all(set(reasons) <= set(COMMANDS) for reasons in WITHOUT.values())


def test_the_page_has_a_row_for_every_command():
    page = (ROOT / "docs" / "cli.md").read_text()
    rows = re.findall(r"^\| `([a-z-]+)` \|(.*)\|$", page, re.MULTILINE)
    table = {command: [cell.strip() for cell in cells.split("|")] for command, cells in rows}
    assert list(table) == list(COMMANDS)
    for command, cells in table.items():
        for name, cell in zip(("--json", "--workers", "--max-um"), cells[:3], strict=True):
            assert (cell == "-") == (option_of(command, name) is None), (command, name)
