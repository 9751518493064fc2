"""The page on CI: its examples are YAML, and its commands do what it says with the shipped paths."""

import re
import subprocess
from xml.etree import ElementTree

import pytest
from command_line import SHELL
from shipped import ROOT

PAGE = (ROOT / "docs" / "ci.md").read_text()
YAML = re.findall(r"^```yaml\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
SHORT = "paths/line_*.toml"  # in place of all paths: what a command does is seen on these
COMMANDS = sorted(
    {c.strip("` ") for c in re.findall(r"(?:`|- run: |    - |^)(cgen [^`\n]*--[^`\n]*)", PAGE, re.MULTILINE)}
)


@pytest.fixture(params=YAML, ids=["github", "gitlab"])
def example(request):
    return pytest.importorskip("yaml", reason="PyYAML reads the examples").safe_load(request.param)


def test_the_examples_are_yaml_that_runs_the_check_and_keeps_its_file(example):
    if "jobs" in example:
        steps = example["jobs"]["check"]["steps"]
        commands = [step["run"] for step in steps if "run" in step]
        assert steps[-1] == {
            "if": "always()", "uses": "actions/upload-artifact@v4", "with": {"name": "results", "path": "results.xml"},
        }  # fmt: skip
    else:
        commands = example["check"]["script"]
        assert example["check"]["artifacts"] == {"when": "always", "reports": {"junit": "results.xml"}}
    assert commands[-1] == "cgen check paths/*.toml --junit results.xml"
    assert commands[-1] in COMMANDS


def test_the_page_has_all_its_commands():
    assert len(COMMANDS) >= 6
    assert {command.split()[1] for command in COMMANDS} == {"check", "predict", "heat", "whatif"}


@pytest.mark.parametrize("command", [c for c in COMMANDS if "..." not in c])
def test_a_command_of_the_page_ends_well_in_bash(command, tmp_path):
    for folder in ("paths", "robots"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    short = command.replace("paths/*.toml", SHORT)
    done = subprocess.run(
        ["bash", "--norc", "-ec", short], cwd=tmp_path, env=SHELL, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    if "--junit" in command:
        root = ElementTree.parse(tmp_path / "results.xml").getroot()
        assert [root.get(key) for key in ("tests", "failures", "errors")] == ["3", "0", "0"]
