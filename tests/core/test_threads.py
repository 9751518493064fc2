"""A task in the background: its result, its end when nobody wants it, and its pickle."""

import pickle
import threading
import weakref

import numpy as np
import pytest

from compgen.core import evaluation
from compgen.core.evaluation import (
    BLOCK,
    failed,
    map_blocks,
    map_rows,
    parallel_for,
    run_in_background,
    stop_background,
)
from compgen.core.evaluation.threads import MAX_ROWS_PER_CALL, MIN_BACKGROUND_ROWS, Cancelled


@pytest.fixture
def two_workers():
    evaluation.configure(None, 2)
    yield
    evaluation.configure(None)


def in_background():
    return [thread for thread in threading.enumerate() if thread.name == "background"]


def endless(loop, started):
    def task():
        while True:
            started.set()
            loop()

    return task


LOOPS = [
    lambda: parallel_for(2 * MAX_ROWS_PER_CALL, lambda start, stop: None),
    lambda: list(map_blocks(4 * BLOCK, lambda start, stop: None)),
]


@pytest.mark.parametrize("loop", LOOPS)
def test_a_task_that_nobody_wants_ends_at_the_next_block(two_workers, loop):
    started = threading.Event()
    task = run_in_background(endless(loop, started), MIN_BACKGROUND_ROWS)
    started.wait()
    assert len(in_background()) == 1
    stop_background()
    assert not in_background()
    with pytest.raises(Cancelled):
        task.result()


@pytest.mark.parametrize("count", [0, 1, 2 * BLOCK, 2 * BLOCK + 1, 5 * BLOCK, 8 * BLOCK, 33 * BLOCK + 5])
def test_several_workers_do_every_row_once_and_in_order(two_workers, count):
    rows, times = np.arange(count), np.zeros(count, dtype=int)

    def note(start, stop):
        times[start:stop] += 1

    parallel_for(count, note)
    assert np.all(times == 1)
    parts = list(map_blocks(count, lambda start, stop: rows[start:stop]))
    assert np.array_equal(np.concatenate([rows[:0], *parts]), rows)
    assert np.array_equal(map_rows(lambda x: 2 * x + 1, rows), 2 * rows + 1)


def test_stopping_one_task_leaves_the_next_alone(two_workers):
    started = threading.Event()
    run_in_background(endless(LOOPS[0], started), MIN_BACKGROUND_ROWS)
    stop_background()
    assert run_in_background(lambda: parallel_for(5, lambda start, stop: None), MIN_BACKGROUND_ROWS).result() is None
    parallel_for(5, lambda start, stop: None)


@pytest.mark.parametrize("rows", [1, MIN_BACKGROUND_ROWS])
def test_a_task_pickles_as_its_result(two_workers, rows):
    task = run_in_background(lambda: np.arange(3.0), rows)
    again = pickle.loads(pickle.dumps(task))
    assert np.array_equal(again.result(), [0.0, 1.0, 2.0])


@pytest.mark.parametrize("rows", [1, MIN_BACKGROUND_ROWS])
def test_what_a_task_raises_is_raised_where_its_result_is_wanted(two_workers, rows):
    def fail():
        raise ValueError("no")

    task = run_in_background(fail, rows)
    with pytest.raises(ValueError, match="no"):
        task.result()


def test_a_task_that_nobody_asks_for_keeps_nothing_of_its_caller():
    class Large:
        pass

    def caller():
        large = Large()
        return failed(ValueError("no")), weakref.ref(large)

    task, large = caller()
    assert large() is None
    with pytest.raises(ValueError, match="no"):
        task.result()
