"""What is built for a model ends with it: a study of any length keeps as many functions as one of a few scenarios."""

import gc
import os
import shutil
import weakref
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from shipped import path_file

from compgen.core import evaluation
from compgen.core.evaluation import MIN_COMPILED_ROWS, evaluate, kept_with
from compgen.core.evaluation.compiler import find_compiler, load_function
from compgen.core.evaluation.lifetime import KEPT
from compgen.core.pose import Pose
from compgen.error_model.model import build_error_model
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.pipelines.study.scenarios import build
from compgen.pipelines.study.workers import Shared
from compgen.pipelines.study.workers import evaluate as evaluate_scenario


class Owner:
    """Anything that can be referred to weakly."""


def live_functions():
    gc.collect()
    return sum(isinstance(thing, ca.Function) for thing in gc.get_objects())


def loaded_libraries(folder):
    with open("/proc/self/maps") as maps:
        return len({line.split()[-1] for line in maps if str(folder) in line})


def test_a_result_is_built_once_while_its_owner_lives_and_ends_with_it():
    built = []

    @kept_with("owner")
    def function_of(number, owner):
        built.append(number)
        return ca.Function(f"f{number}", [ca.SX.sym("x")], [ca.SX(number)])

    one, other = Owner(), Owner()
    first = function_of(1, one)
    assert function_of(1, one) is first
    assert function_of(1, other) is not first
    assert function_of(2, one) is not first
    assert built == [1, 1, 2]
    end = weakref.ref(first)
    del first
    gc.collect()
    assert end() is not None
    del one
    gc.collect()
    assert end() is None


def test_nothing_is_built_again_because_it_is_none():
    built = []

    @kept_with("owner")
    def nothing_of(owner):
        built.append(owner)

    owner = Owner()
    assert nothing_of(owner) is nothing_of(owner) is None
    assert len(built) == 1


def test_an_owner_that_lives_on_keeps_the_last_results_only():
    built = []

    @kept_with("owner")
    def result_of(owner, number):
        built.append(number)
        return [number]

    owner = Owner()
    for number in range(KEPT + 1):
        result_of(owner, number)
    del built[:]
    assert result_of(owner, KEPT) == [KEPT]
    assert result_of(owner, 1) == [1]
    assert built == []
    assert result_of(owner, 0) == [0]
    assert built == [0]


def test_an_arm_has_one_model_for_its_sources_and_a_tool_wherever_they_are_read():
    job = load_job(path_file("line_y"))
    tools = [job.tool.pose, Pose(job.tool.pose.position, job.tool.pose.rotation), Pose(np.zeros(3), np.eye(3))]
    one, same, other = (build_error_model(job.robot, list(job.sources), 5, tool) for tool in tools)
    assert one is same is not other
    assert build_error_model(job.robot, job.sources[:-1], 5, job.tool.pose) is not one


def test_three_hundred_models_leave_no_function_behind():
    job = load_job(path_file("line_y"))
    theta, rise = np.zeros((3, 6)), np.ones((3, 5))

    def use_model():
        model = build_error_model(replace(job.robot), job.sources, 5, job.tool.pose)
        model.error(theta, rise, Pose(np.zeros((3, 3)), np.tile(np.eye(3), (3, 1, 1))))
        model.actual_pose(theta, rise)
        return weakref.ref(model), weakref.ref(model.actual), weakref.ref(model.error_function)

    use_model()
    before = live_functions()
    ends = [end for _ in range(300) for end in use_model()]
    assert live_functions() == before
    assert not any(end() for end in ends)


def test_scenarios_leave_no_function_behind():
    """Each has a robot of its own, and with it inverse kinematics, a twin and an error model."""
    study = build(path_file("line_y"), None, (), ["robot.thermal.cte_um_m_K=10:12:24"], None, correct=False)
    shared = Shared()
    counts = []
    for scenario in study.scenarios:
        assert evaluate_scenario(study, scenario, shared)["state"] == "done"
        counts.append(live_functions())
    # the last geometries stay (pipelines/study/workers.py): each has a robot, whose functions are as many as these
    assert counts[-1] <= counts[5]


def test_a_corrected_job_leaves_no_function_behind():
    def correct():
        _, corrected = generate.generate(load_job(path_file("line_y")), lambda stage, share: None)
        assert corrected.program

    correct()
    before = live_functions()
    for _ in range(3):
        correct()
    assert live_functions() == before


@pytest.mark.skipif(not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="no C compiler")
@pytest.mark.skipif(not hasattr(evaluation.compiler, "_ctypes"), reason="libraries cannot be unloaded")
def test_a_library_is_loaded_once_for_its_function_and_unloaded_with_it(tmp_path, monkeypatch):
    loads: list[str] = []

    def counted(compiler, identity, generate):
        loads.append(identity)
        return load_function(compiler, identity, generate)

    monkeypatch.setattr(evaluation, "load_function", counted)
    evaluation.configure(find_compiler(tmp_path))
    try:
        rows = np.linspace(0, 1, MIN_COMPILED_ROWS)[:, None]
        x = ca.SX.sym("x")
        functions = [ca.Function("f", [x], [x + k]) for k in range(3)]
        for _ in range(2):
            for k, f in enumerate(functions):
                assert np.array_equal(evaluate(f, rows)[0], rows + k)
        assert len(loads) == 3
        if os.path.exists("/proc/self/maps"):
            assert loaded_libraries(tmp_path) == 3
            del f, functions[1:]
            gc.collect()
            assert loaded_libraries(tmp_path) == 1
            assert np.array_equal(evaluate(functions[0], rows)[0], rows)
    finally:
        evaluation.configure(None)
