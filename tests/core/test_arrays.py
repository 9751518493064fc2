"""Arrays that own their data, and norms of many rows."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.arrays import (
    Array,
    BoolArray,
    IntArray,
    column_extremes,
    cumulated,
    dot,
    frozen,
    interpolated,
    lengths_along,
    own,
    row_norms,
    step_lengths,
    unit,
)


@dataclass(frozen=True, eq=False, slots=True)
class Owner:
    p: Array  # (N, 3)
    flag: BoolArray  # (N,)
    index: IntArray  # (S,)

    def __post_init__(self) -> None:
        own(self, p=("N", 3), flag=("N",), index=("S",))


def owner(p=((1, 2, 3), (4, 5, 6)), flag=(True, False), index=(7,)):
    return Owner(np.array(p, dtype=float), np.array(flag), np.array(index))


def test_owned_arrays_are_copies():
    p, flag, index = np.zeros((2, 3)), np.array([True, False]), np.array([1])
    one = Owner(p, flag, index)
    p[0, 0], flag[0], index[0] = 99, False, 99  # the caller's stay writeable, and alter nothing
    assert (one.p[0, 0], one.flag[0], one.index[0]) == (0, True, 1)


def test_owned_arrays_are_read_only():
    one = owner()
    for array in (one.p, one.flag, one.index):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_what_is_handed_over_is_kept_also_in_another_shape_and_a_part_of_something_is_copied():
    flat = np.arange(6.0)
    one = Owner(frozen(flat.reshape(2, 3)), np.array([True, False]), np.array([1]))
    assert np.shares_memory(one.p, flat)
    with pytest.raises(ValueError, match="read-only"):
        flat[0] = 9
    whole = np.arange(12.0).reshape(4, 3)
    part = whole[:2]
    part.flags.writeable = False
    two = Owner(part, np.array([True, False]), np.array([1]))
    three = frozen(whole[:2])
    whole[0, 0] = 9
    assert (two.p[0, 0], three[0, 0]) == (0, 0)


def test_truth_and_counts_keep_their_kind_and_the_rest_becomes_float():
    one = Owner(np.zeros((2, 3), dtype=np.float32), np.array([True, False]), np.array([1]))
    assert one.p.dtype == np.float64
    assert one.flag.dtype == np.bool_
    assert one.index.dtype.kind == "i"


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"p": np.zeros((2, 4))}, "p"),  # a number must be met
        ({"p": np.zeros(3)}, "p"),  # and the number of axes
        ({"p": np.zeros((2, 3, 1))}, "p"),
        ({"flag": [True, False, True]}, "flag"),  # a letter is one length wherever it stands
    ],
)
def test_wrong_shape_is_refused_with_owner_and_field(change, field):
    with pytest.raises(ValueError, match=rf"Owner\.{field}: shape .* expected"):
        owner(**change)


def test_different_letters_may_differ():
    assert len(owner(index=range(9)).index) == 9


def test_empty_arrays_are_arrays():
    assert owner(p=np.zeros((0, 3)), flag=np.zeros(0, dtype=bool)).p.shape == (0, 3)


def test_dot_is_the_inner_product_of_each_row():
    assert_allclose(dot(np.array([[1.0, 2, 3], [0, 1, 0]]), np.array([[4.0, 5, 6], [9, -2, 9]])), [32, -2], atol=0)


def test_unit_keeps_the_direction_and_takes_the_length():
    a = np.random.default_rng(1).normal(size=(50, 3))
    assert_allclose(np.linalg.norm(unit(a), axis=1), 1, rtol=1e-15)
    assert_allclose(unit(a) * np.linalg.norm(a, axis=1)[:, None], a, rtol=1e-14)
    assert_allclose(unit(np.array([[3.0, 0, 4]])), [[0.6, 0, 0.8]], rtol=1e-15)


def test_steps_add_up_from_nothing_on():
    assert np.array_equal(cumulated(np.array([2.0, 0.5, -1.0])), [0.0, 2.0, 2.5, 1.5])
    assert np.array_equal(cumulated(np.zeros(0)), [0.0])
    assert np.array_equal(lengths_along(np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 5.0]])), [0.0, 5.0, 6.0])


@pytest.mark.parametrize(("count", "width"), [(1, 3), (7, 6), (8, 1), (20, 3), (21, 3)])
def test_rows_in_blocks_are_measured_as_all_at_once(count, width):
    rows = np.random.default_rng(4).normal(size=(count, width + 1))[:, 1:]
    assert np.array_equal(row_norms(rows, 4), np.linalg.norm(rows, axis=1))
    assert np.array_equal(step_lengths(rows, 4), np.linalg.norm(np.diff(rows, axis=0), axis=1))
    assert np.array_equal(column_extremes(rows), (rows.min(axis=0), rows.max(axis=0)))


def test_rows_between_others_lie_straight_between_them():
    rows = np.array([[0.0, 1.0], [2.0, 5.0]])
    assert_allclose(interpolated(np.array([0.5, 9.0, -1.0]), np.array([0.0, 1.0]), rows), [[1, 3], [2, 5], [0, 1]])
