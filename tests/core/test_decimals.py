"""Columns of decimal text: what Python writes, one number after the other."""

import numpy as np
import pytest

from compgen.core.decimals import (
    consecutive,
    digit_counts,
    fixed_columns,
    join_columns,
    parse_fixed,
    short_columns,
    text_column,
)


def test_fixed_columns_are_written_and_read_as_python_does():
    """Every whole number and every fraction, both signs, at each number of decimals."""
    rng = np.random.default_rng(0)
    for decimals in (3, 4, 5, 6):
        scale = 10**decimals
        whole = np.concatenate([np.arange(100_000), -np.arange(10_000)]) * scale
        numbers = whole + np.where(whole < 0, -1, 1) * rng.integers(0, scale, len(whole))
        numbers = np.concatenate(
            [numbers, np.arange(1000), -np.arange(1000), [scale * 100_000 - 1, 1 - scale * 10_000]]
        )
        texts = [f"{n / scale:{6 + decimals}.{decimals}f}" for n in numbers.tolist()]
        texts = [text.replace("-", " ") if n == 0 else text for n, text in zip(numbers.tolist(), texts, strict=True)]
        written = bytes(join_columns(len(numbers), [*fixed_columns(numbers[None], decimals), b" deg\r\n};\r\n"]))
        assert written == "".join([f"{text} deg\r\n}};\r\n" for text in texts]).encode()
        rows = np.frombuffer(written, dtype=np.uint8).reshape(len(numbers), -1)
        assert np.array_equal(parse_fixed(rows, [0], decimals)[0], numbers)


def test_consecutive_numbers_are_those_of_python():
    for first, last, pad in (
        (1, 12, 0),
        (1, 12, 4),
        (995, 1005, 4),
        (9990, 10_010, 4),
        (4000, 5000, 0),
        (10**6, 10**6 + 9, 4),
        (123_456_789, 123_456_799, 0),
    ):
        expected = "".join([f"{n:{pad}d};" for n in range(first, last)]).encode()
        assert bytes(join_columns(last - first, [consecutive(first, last, pad), b";"])) == expected
        assert (digit_counts(first, last) == [len(str(n)) for n in range(first, last)]).all()


@pytest.mark.parametrize("decimals", [4, 5, 6])
@pytest.mark.parametrize("size", [0.4, 9.0, 999.0, 99_000.0])
def test_short_columns_are_those_of_python(decimals, size):
    """Random numbers, whole ones and halves of the last digit's neighbours; the zero has no sign."""
    rng = np.random.default_rng(7)
    table = np.concatenate([rng.uniform(-size, size, (3000, 2)), np.rint(rng.uniform(-size, size, (50, 2))) / 2])
    table[:3] = [[0.0, -0.0], [1e-9, -1e-9], [size, -size]]
    rounded = np.rint(table * 10.0**decimals) / 10.0**decimals + 0.0
    expected = "".join([f"{a:.{decimals}f},;{b:.{decimals}f}\n" for a, b in rounded.tolist()]).encode()
    columns = short_columns(table, decimals)
    assert columns is not None
    left, right = columns
    assert bytes(join_columns(len(table), [left, b",;", right, b"\n"])) == expected
    columns, marks = short_columns(table, decimals, before=b"<"), text_column([b",;", b">"], np.arange(3050) % 2)
    assert columns is not None
    left, right = columns
    expected = "".join(
        [f"<{a:.{decimals}f}{',;>'[2 * (n % 2) :][:2]}<{b:.{decimals}f}" for n, (a, b) in enumerate(rounded.tolist())]
    ).encode()
    assert bytes(join_columns(len(table), [left, marks, right])) == expected


@pytest.mark.parametrize("number", [1e5, np.nan, np.inf, -np.inf])
def test_numbers_without_room_have_no_columns(number):
    assert short_columns(np.array([[1.0], [number]]), 4) is None


def test_one_text_in_all_rows_is_that_text():
    assert text_column([b"a", b"bc"], np.array([1, 1, 1])) == b"bc"
