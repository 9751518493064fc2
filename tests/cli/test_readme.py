"""README's commands, run in bash as a reader types them."""

import re
import subprocess

import pytest
from command_line import SHELL
from shipped import ROOT

README = (ROOT / "README.md").read_text()
BLOCKS = re.findall(r"^```sh\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
#: commands of all lines, by name or by the path of a fresh environment
COMMANDS = [
    command.strip().removeprefix(".venv/bin/")
    for line in "".join(BLOCKS).splitlines()
    for command in line.split("&&")
    if re.match(r"(\.venv/bin/)?cgen ", command.strip())
]


def test_readme_has_commands_and_calls_none_by_the_name_that_bash_hides():
    assert len(COMMANDS) >= 3
    assert not re.search(r"^(\S*/)?compgen |&& *(\S*/)?compgen ", "".join(BLOCKS), re.MULTILINE)
    assert not re.search(r"`compgen [a-z]", README)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_readme_does_its_work_in_bash(command, tmp_path):
    for folder in ("paths", "robots"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    done = subprocess.run(
        ["bash", "--norc", "-c", command], cwd=tmp_path, env=SHELL, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "wrote " in done.stdout
    assert list(tmp_path.rglob("report.json"))
