"""Compiled or not, alone or shared out: the same numbers; and a cache that nothing half-written gets into."""

import multiprocessing
import os
import shutil
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import path_file

from compgen.core import evaluation
from compgen.core.evaluation import BLOCK, MIN_COMPILED_ROWS, IndexedRows, codegen, evaluate
from compgen.core.evaluation.codegen import c_source, identity
from compgen.core.evaluation.compiler import Compiler, find_compiler, load_function
from compgen.core.evaluation.interpreter import OPERATIONS, instructions_of
from compgen.core.exceptions import InputError
from compgen.error_model.model import build_error_model
from compgen.pipelines.files.path_file import load_job
from compgen.robot.kinematics import nominal_chain

needs_compiler = pytest.mark.skipif(not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="no C compiler")


@pytest.fixture
def compiled(tmp_path):
    evaluation.configure(find_compiler(tmp_path / "cache"))
    yield tmp_path / "cache"
    evaluation.configure(None)


def everything():
    """A function of every operation that is offered."""
    x = ca.SX.sym("x", 3)
    a, b, c = x[0], x[1], x[2]
    out = [
        a + b,
        a - b,
        a * b,
        a / b,
        -a,
        a**2,
        2 * a,
        ca.sqrt(a),
        ca.sin(c),
        ca.cos(c),
        ca.tan(c),
        ca.asin(b),
        ca.acos(b),
    ]
    out += [ca.atan(c), ca.atan2(c, a), ca.hypot(a, c), ca.tanh(c), 1 / a, ca.fabs(c), ca.sign(c), ca.copysign(a, c)]
    out += [ca.floor(c), ca.ceil(c), ca.fmin(a, c), ca.fmax(a, c), ca.exp(c), ca.expm1(c), ca.log(a), ca.log1p(a)]
    out += [a**b, a**3.5, c < 0, c <= 0, ca.eq(a, b), ca.ne(a, b), ca.logic_not(c), ca.if_else(c > 0, a, b)]
    out += [ca.logic_and(c > 0, a > b), ca.logic_or(c > 0, a > b)]
    return ca.Function("everything", [x], [ca.vertcat(*out), 3.0 * a])


def source_of_everything() -> str:
    source = c_source(instructions_of(everything()))
    assert source is not None
    return source


def compiler_in(folder: Path) -> Compiler:
    """The system's compiler, with its work in a folder."""
    compiler = find_compiler(folder)
    assert compiler is not None
    return compiler


def places(count, seed=0):
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(0.2, 3, count), rng.uniform(0.01, 0.99, count), rng.uniform(-4, 4, count)])


@needs_compiler
def test_every_operation_gives_the_same_numbers_compiled(compiled):
    f, x = everything(), places(MIN_COMPILED_ROWS + 3)
    values = evaluate(f, x)
    assert len(list(compiled.glob("*.so"))) == 1  # it was compiled
    evaluation.configure(None)
    for a, b in zip(values, evaluate(f, x), strict=True):
        assert_allclose(a, b, rtol=1e-13, atol=1e-13)
    assert_allclose(values[0][7], np.asarray(f(x[7])[0]).ravel(), rtol=1e-13, atol=1e-13)


def test_every_operation_that_numpy_knows_has_its_c():
    assert set(OPERATIONS) == set(codegen.C_OPERATIONS)


@needs_compiler
def test_least_and_greatest_prefer_a_number_compiled_or_not(compiled):
    x = ca.SX.sym("x", 2)
    f = ca.Function("ends", [x], [ca.vertcat(ca.fmin(x[0], x[1]), ca.fmax(x[0], x[1]))])
    rows = np.tile([[np.nan, 1.0], [1.0, np.nan], [np.nan, np.nan], [-np.inf, 2.0]], (MIN_COMPILED_ROWS, 1))
    want = [[1.0, 1.0], [1.0, 1.0], [np.nan, np.nan], [-np.inf, 2.0]]
    assert np.array_equal(evaluate(f, rows)[0][:4], want, equal_nan=True)
    evaluation.configure(None)
    assert np.array_equal(evaluate(f, rows)[0][:4], want, equal_nan=True)


@needs_compiler
def test_the_error_model_agrees_to_1e_12(compiled):
    job = load_job(path_file("circle_1300"))
    model = build_error_model(job.robot, job.sources, 5, job.tool.pose)
    rng = np.random.default_rng(1)
    theta, rise = rng.uniform(-3, 3, (5000, 6)), rng.uniform(-5, 15, (5000, 5))
    one = model.actual_pose(theta, rise)
    evaluation.configure(None)
    other = model.actual_pose(theta, rise)
    assert np.abs(one.position - other.position).max() < 1e-12
    assert np.abs(one.rotation - other.rotation).max() < 1e-12


def test_where_folders_have_no_posix_owners_nothing_is_compiled(tmp_path, monkeypatch):
    monkeypatch.delattr(os, "getuid")
    assert find_compiler(tmp_path) is None


@needs_compiler
def test_a_row_does_not_depend_on_its_neighbours_or_on_the_workers(compiled):
    f, x = everything(), places(5 * BLOCK + 13)
    whole = evaluate(f, x)[0]
    order = np.random.default_rng(2).permutation(len(x))
    assert np.array_equal(evaluate(f, x[order])[0], whole[order])
    assert np.array_equal(evaluate(f, x[77 : 77 + MIN_COMPILED_ROWS])[0], whole[77 : 77 + MIN_COMPILED_ROWS])
    compiler = find_compiler(compiled)
    for workers in (2, 3, 7):
        evaluation.configure(compiler, workers)
        assert np.array_equal(evaluate(f, x)[0], whole)


@needs_compiler
def test_picked_rows_and_single_rows(compiled):
    x, y = ca.SX.sym("x", 2), ca.SX.sym("y")
    f = ca.Function("f", [x, y], [x * y])
    table, index = np.arange(20.0).reshape(10, 2), np.random.default_rng(3).integers(0, 10, 4000)
    for _ in range(2):
        (values,) = evaluate(f, IndexedRows(table, index), np.array([[2.0]]))
        assert np.array_equal(values, 2 * table[index])
        evaluation.configure(None)
    evaluation.configure(find_compiler(compiled))
    with pytest.raises(IndexError):
        evaluate(f, IndexedRows(table, index + 10), np.array([[2.0]]))


@needs_compiler
def test_the_smaller_and_larger_of_what_is_no_number_is_the_other(compiled):
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    f = ca.Function("f", [x, y], [ca.fmin(x, y), ca.fmax(x, y)])
    special = np.array([1.0, 2.0, np.nan, np.inf, -np.inf, -3.0])
    a, b = (np.tile(v.ravel(), MIN_COMPILED_ROWS)[:, None] for v in np.meshgrid(special, special))
    values = evaluate(f, a, b)
    assert len(list(compiled.glob("*.so"))) == 1
    assert np.array_equal(values[0], np.fmin(a, b), equal_nan=True)
    assert np.array_equal(values[1], np.fmax(a, b), equal_nan=True)


@needs_compiler
def test_rows_may_lie_apart_and_overlap(compiled):
    x = ca.SX.sym("x", 3)
    f = ca.Function("f", [x], [2 * x])
    wide, line = np.arange(8.0 * MIN_COMPILED_ROWS).reshape(MIN_COMPILED_ROWS, 8), np.arange(MIN_COMPILED_ROWS + 2.0)
    three = np.lib.stride_tricks.sliding_window_view(line, 3)
    back, index = np.arange(MIN_COMPILED_ROWS)[::-1], np.arange(MIN_COMPILED_ROWS)
    tables: list[np.ndarray] = [wide[:, 2:5], wide[:, 6:0:-2], wide[::-1, :3], three, wide.astype(np.float32)[:, :3]]
    for _ in range(2):
        for rows in tables:
            assert np.array_equal(evaluate(f, rows)[0], 2 * rows)
            assert np.array_equal(evaluate(f, IndexedRows(rows, back))[0], 2 * rows[::-1])
            assert np.array_equal(evaluate(f, IndexedRows(rows[:1], 0 * index))[0], 2 * rows[0] + 0 * rows)
        evaluation.configure(None)


def _load_in_another_process(folder, source, answers):
    answers.put(load_function(compiler_in(folder), source, lambda: source) is not None)


@needs_compiler
def test_runs_at_the_same_time_may_build_the_same_function(tmp_path):
    source = c_source(instructions_of(everything()))
    context = multiprocessing.get_context("spawn")
    answers = context.Queue()
    runs = [context.Process(target=_load_in_another_process, args=(tmp_path, source, answers)) for _ in range(3)]
    for run in runs:
        run.start()
    for run in runs:
        run.join()
    assert [answers.get() for _ in runs] == [True] * 3
    assert [p.suffix for p in tmp_path.iterdir()] == [".so"]  # one library, nothing left over


@needs_compiler
@pytest.mark.parametrize("damage", [lambda b: b[: len(b) // 2], lambda b: b"", lambda b: b[:-1] + bytes([b[-1] ^ 1])])
def test_a_damaged_library_is_built_anew(tmp_path, damage):
    compiler, source = compiler_in(tmp_path), source_of_everything()
    assert load_function(compiler, source, lambda: source) is not None
    (place,) = tmp_path.glob("*.so")
    good = place.read_bytes()
    place.unlink()
    place.write_bytes(damage(good))
    assert load_function(compiler, source, lambda: source) is not None
    assert place.read_bytes() == good


@needs_compiler
def test_a_damaged_library_is_not_loaded_where_none_can_be_built(tmp_path, monkeypatch):
    compiler, source = compiler_in(tmp_path), source_of_everything()
    assert load_function(compiler, source, lambda: source) is not None
    (place,) = tmp_path.glob("*.so")
    damaged = place.read_bytes()[:-1] + b"\0\0"
    place.unlink()
    place.write_bytes(damaged)  # it could still be loaded
    monkeypatch.setattr("compgen.core.evaluation.compiler.compile_library", lambda *arguments: False)
    assert load_function(compiler, source, lambda: source) is None


def test_without_a_compiler_numpy_says_so_once_and_goes_on(tmp_path):
    assert find_compiler(tmp_path, "no-such-compiler") is None
    notes: list[str] = []
    evaluation.configure(None, 1, notes.append)
    assert len(evaluate(everything(), places(MIN_COMPILED_ROWS))[0]) == MIN_COMPILED_ROWS
    evaluation.configure(Compiler(("false",), tmp_path, ""), 1, notes.append)
    assert len(evaluate(everything(), places(MIN_COMPILED_ROWS))[0]) == MIN_COMPILED_ROWS
    evaluation.configure(None)
    assert len(notes) == 2
    assert all("numpy evaluates instead" in note for note in notes)
    assert not list(tmp_path.iterdir())


def test_a_cache_that_cannot_be_written_is_no_compiler(tmp_path):
    (tmp_path / "file").write_text("")
    assert find_compiler(tmp_path / "file" / "cache") is None


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o707])
def test_a_cache_that_others_can_write_is_refused(tmp_path, mode):
    (tmp_path / "cache").mkdir()
    (tmp_path / "cache").chmod(mode)
    with pytest.raises(InputError, match=r"others can write into it.*chmod go-w"):
        find_compiler(tmp_path / "cache")


def test_a_cache_that_others_can_exchange_is_refused(tmp_path):
    (tmp_path / "shared").mkdir()
    (tmp_path / "shared").chmod(0o777)
    with pytest.raises(InputError, match="chmod o-w"):
        find_compiler(tmp_path / "shared" / "cache")
    (tmp_path / "shared").chmod(0o1777)  # as /tmp is
    assert find_compiler(tmp_path / "shared" / "cache") is not None


@needs_compiler
@pytest.mark.parametrize("how", ["mode", "link"])
def test_a_library_that_others_can_write_is_refused(tmp_path, how):
    compiler, source = compiler_in(tmp_path / "cache"), source_of_everything()
    assert load_function(compiler, source, lambda: source) is not None
    (library,) = compiler.folder.iterdir()
    assert library.stat().st_mode & 0o077 == 0
    if how == "mode":
        library.chmod(0o777)
    else:
        library.rename(tmp_path / "elsewhere.so")
        library.symlink_to(tmp_path / "elsewhere.so")
    with pytest.raises(InputError, match=r"\.so: others can write it.*remove it"):
        load_function(compiler, source, lambda: source)


def test_a_function_is_known_by_what_it_does():
    def made(factor):
        x = ca.SX.sym("x", 2)
        return ca.Function("f", [x], [factor * ca.sin(x)])

    assert identity(made(0.1)) == identity(made(0.1))
    assert identity(made(0.1)) != identity(made(0.1 + 2e-17))
    assert "def c_source" in identity(made(0.1))  # another way of writing C makes another library


@needs_compiler
def test_a_library_that_is_there_needs_no_source(tmp_path):
    compiler, source = compiler_in(tmp_path), source_of_everything()
    assert load_function(compiler, "name", lambda: source) is not None
    assert load_function(compiler, "name", lambda: pytest.fail("asked for its source")) is not None
    assert load_function(compiler, "other", lambda: None) is None


def test_evaluate_agrees_with_casadi_across_blocks(robot):
    theta = ca.SX.sym("theta", 6)
    position, rotation = nominal_chain(robot, theta).pose_expr()
    forward = ca.Function("forward", [theta], [position, ca.densify(rotation)])
    q = np.random.default_rng(2).uniform(-3, 3, (BLOCK + 7, 6))
    p, r = evaluate(forward, q)
    for row in (0, 1, BLOCK - 1, BLOCK, BLOCK + 6):
        exact_p, exact_r = forward(q[row])
        assert_allclose(p[row], np.asarray(exact_p).ravel(), atol=1e-14)
        assert_allclose(r[row], np.asarray(exact_r).ravel(order="F"), atol=1e-14)


def test_evaluate_knows_every_operation_it_offers():
    x = ca.SX.sym("x", 2)
    a, b = x[0], x[1]
    outputs = [a + b, a - b, a * b, a / b, -a, a**2, 2 * a, ca.sqrt(a), ca.sin(a), ca.cos(a), ca.atan2(a, b)]
    outputs += [1 / a, ca.fabs(-a), ca.exp(a), a**b, a**3.5]
    f = ca.Function("f", [x], [ca.vertcat(*outputs), ca.SX(3.0)])
    rows = np.random.default_rng(3).uniform(0.5, 2, (20, 2))
    values, constant = evaluate(f, rows)
    for row, value in zip(rows, values, strict=True):
        assert_allclose(value, np.asarray(f(row)[0]).ravel(), rtol=1e-14)
    assert_allclose(constant, 3.0)


def test_one_row_serves_all_points():
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    f = ca.Function("f", [x, y], [x * y])
    (out,) = evaluate(f, np.arange(5.0)[:, None], np.array([[3.0]]))
    assert_allclose(out.ravel(), 3 * np.arange(5.0))
