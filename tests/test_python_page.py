"""The examples of docs/python.md, run in their order in a folder that ``cgen init`` lays down."""

import contextlib
import importlib.util
import io
import re
from typing import Any

import numpy as np
import pytest
from command_line import run
from shipped import ROOT
from synthetic import made_up, measured, random_theta

import compgen
from compgen.core.units import DEG, MM

PAGE = (ROOT / "docs" / "python.md").read_text()
BLOCKS = re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
HAS_PANDAS = importlib.util.find_spec("pandas") is not None


def poses():
    """Measurements of a made-up robot, as a file has them."""
    truth, rng = made_up(str(ROOT / "robots" / "m710ic50.toml"), 7), np.random.default_rng(70)
    data = measured(truth, random_theta(truth.arm.robot, rng, 60), rng)
    pendant = truth.arm.robot.to_pendant(data.theta)[data.pose] / DEG
    rows = ["order,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm"]
    for n, (q, p) in enumerate(zip(pendant, data.position / MM, strict=True)):
        numbers = [*(f"{v:.6f}" for v in q), *(f"{v:.4f}" for v in p)]
        rows.append(",".join([str(data.pose[n]), data.reflectors[data.reflector[n]], *numbers]))
    return "\n".join(rows) + "\n"


def test_the_examples_run_and_print_what_they_say(tmp_path, monkeypatch):
    assert run("init", tmp_path).returncode == 0
    (tmp_path / "poses.csv").write_text(poses())
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        for block in BLOCKS:
            if "to_dataframe" in block and not HAS_PANDAS:
                with pytest.raises(compgen.InputError, match="pandas"):
                    exec(block, names)
                continue
            exec(block, names)
    promised = re.findall(r"print\(.*\)  # (.*)", "".join(BLOCKS))
    assert len(promised) == 3
    for line in promised:
        assert line in printed.getvalue().splitlines()
    assert (tmp_path / "LINE_Y.LS").read_bytes() == names["result"].text
    assert (tmp_path / "results" / "report.json").is_file()


def test_the_page_names_the_commands_that_are_functions():
    said = re.search(r"^Six commands are functions: (.*?)\. ", PAGE, re.MULTILINE)
    assert said is not None
    commands = re.findall(r"^### cgen (\S+)$", (ROOT / "docs" / "commands.md").read_text(), re.MULTILINE)
    functions = {"whatif" if name == "study" else name for name in compgen.__all__} & set(commands)
    assert set(re.findall(r"`(\S+)`", said[1])) - {"study"} == functions
    assert len(functions) == 6


def test_every_public_function_and_exception_is_on_the_page():
    for name in compgen.__all__[:10]:
        assert f"compgen.{name}(" in "".join(BLOCKS) or name == "load_robot"
    for name in ("InputError", "ShapeError", "FrozenError", "ImpossibleError", "CompgenError"):
        assert issubclass(getattr(compgen, name), compgen.CompgenError)
        assert f"| `{name}` |" in PAGE


def test_every_public_name_is_in_the_reference():
    """And no name that is gone."""
    listed = set(re.findall(r"^::: compgen\.(\w+)$", (ROOT / "docs" / "api.md").read_text(), re.MULTILINE))
    assert listed == {name for name in dir(compgen) if not name.startswith("_")}
