"""Stages of a run: text for who prints it, parts as data; each is named in one place."""

import ast

from shipped import ROOT

from compgen.core import stages
from compgen.core.stages import RunStage


def test_a_stage_is_its_text_and_has_its_parts():
    counted, named = RunStage(stages.PATH, waypoints=12), RunStage(stages.FIT, "gears")
    assert (counted, counted.name, counted.waypoints) == ("path: 12 waypoints", "path", 12)
    assert (named, named.name, named.detail, named.waypoints) == ("fit: gears", "fit", "gears", 0)
    assert (stages.PATH, stages.PATH.name, stages.PATH.detail) == ("path", "path", "")


def test_no_stage_is_named_a_second_time():
    own = [stage for stage in vars(stages).values() if isinstance(stage, RunStage)]
    assert len({stage.name for stage in own}) == len(own) > 20
    for path in sorted((ROOT / "compgen").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.Call):
                continue
            name = getattr(node.func, "id", "")
            if name in ("RunStage", "progress", "report_progress") and path.name != "stages.py":
                text = node.args[0].value if isinstance(node.args[0], ast.Constant) else None
                assert not isinstance(text, str), f"{path}:{node.lineno}"
                assert not isinstance(node.args[0], ast.JoinedStr), f"{path}:{node.lineno}"
