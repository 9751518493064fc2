"""The page on CI: its examples are YAML, and its commands do what it says with the shipped paths."""

import re
import subprocess
from xml.etree import ElementTree

import pytest
from command_line import SHELL, refused, run
from shipped import ROOT

PAGE = (ROOT / "docs" / "ci.md").read_text()
*YAML, HOOKS = re.findall(r"^```yaml\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
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


@pytest.fixture(scope="module")
def hooks():
    """What pre-commit finds in the root, by its id."""
    yaml = pytest.importorskip("yaml", reason="PyYAML reads them")
    named = yaml.safe_load(HOOKS)["repos"][0]["hooks"]
    every = {hook["id"]: hook for hook in yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text())}
    assert {hook["id"] for hook in named} == set(every)
    return every


def test_a_hook_has_what_pre_commit_asks_for(hooks):
    for hook in hooks.values():
        assert {"id", "name", "entry", "language", "files"} <= set(hook)
        assert hook["language"] == "python"  # pre-commit installs the package of this repository
        assert hook["entry"].startswith("cgen ")


@pytest.mark.parametrize(
    ("hook", "good", "bad", "code"),
    [
        ("cgen-check", {"paths/line_y.toml": "paths/line_y.toml"}, ("paths/none.toml", "[path]\n"), 2),
        ("cgen-inspect", {"a/MOVES.ls": "tests/golden/MOVES.LS"}, ("b/OTHER.LS", "/PROG OTHER\n"), 2),
    ],
)
def test_a_hook_passes_what_is_good_and_names_what_is_not(hooks, tmp_path, hook, good, bad, code):
    for name, source in good.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes((ROOT / source).read_bytes())
    (tmp_path / bad[0]).parent.mkdir(exist_ok=True)
    (tmp_path / bad[0]).write_text(bad[1])
    every = sorted(str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file())
    taken = [name for name in every if re.search(hooks[hook]["files"], name)]
    assert taken == every
    assert not re.search(hooks[hook]["files"], "robots/m20ia.toml")
    words = hooks[hook]["entry"].split()[1:]
    done = run(*words, *good, cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    refused(run(*words, *taken, cwd=tmp_path), code, bad[0])
