"""The audit in ``tests/audit`` agrees with every shipped path, and sees errors that planner and twin share."""

import ast
import sys

import pytest
from command_line import run
from shipped import ROOT

from tests.audit.judge import audit

PATHS = sorted(p.stem for p in (ROOT / "paths").glob("*.toml"))
FILES = sorted((ROOT / "tests" / "audit").glob("*.py"))


def project(folder, robot_change=None, path="optic_raster"):
    """A project of its own with a robot file that says something else, and coarse sweeps that run at once."""
    text = (ROOT / "robots" / "m710ic50.toml").read_text()
    if robot_change:
        old, new = robot_change
        assert old in text
        text = text.replace(old, new)
    for name in ("robots", "paths"):
        (folder / name).mkdir()
    (folder / "robots" / "m710ic50.toml").write_text(text)
    wanted = (ROOT / "paths" / f"{path}.toml").read_text()
    file = folder / "paths" / f"{path}.toml"
    file.write_text(wanted.replace("stepover_mm = 20", "stepover_mm = 200"))
    return file


def generated(file, folder):
    """The output folder of a path file."""
    result = run("generate", file, "-o", folder, cwd=file.parents[1])
    assert (folder / "report.json").is_file(), result.stderr
    return result.returncode, folder


def outside(checks):
    return {c.what for c in checks if not c.kept}


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_it_imports_numpy_and_nothing_of_the_package(path):
    for node in ast.walk(ast.parse(path.read_text())):
        names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
        names += [node.module] if isinstance(node, ast.ImportFrom) else []
        for name in names:
            assert name == "numpy" or name.startswith("tests.audit") or name.split(".")[0] in sys.stdlib_module_names


@pytest.mark.parametrize("name", PATHS)
def test_it_agrees_with_every_shipped_path(name, tmp_path):
    code, folder = generated(ROOT / "paths" / f"{name}.toml", tmp_path / "out")
    assert code == 0
    title, checks = audit(folder)
    assert title == name
    assert not outside(checks), [c for c in checks if not c.kept]


#: a change of the robot file, on which planner and twin agree, and the rows that see it
SHARED = {
    "cte doubled": (("cte_um_m_K = 11.25", "cte_um_m_K = 22.5"), "errors after, um"),
    "rise of j3 doubled": (("rise_K = 13", "rise_K = 26"), "rises at the start, K"),
    "J2/J3 coupling removed": (("[0, 1, 1, 0, 0, 0]", "[0, 0, 1, 0, 0, 0]"), "pendant angles, deg"),
}


@pytest.mark.parametrize("what", SHARED)
def test_it_sees_what_the_robot_file_says_wrongly(what, tmp_path):
    change, row = SHARED[what]
    code, folder = generated(project(tmp_path, change), tmp_path / "out")
    assert code == 0, "the package notices nothing"
    assert row in outside(audit(folder, tmp_path / "paths" / "optic_raster.toml")[1])
