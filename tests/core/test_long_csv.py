"""Files of numbers that are read at once: gaps, remarks, lines in messages."""

import numpy as np
import pytest

from compgen.core.exceptions import InputError
from compgen.core.long_csv import read_long_csv


def table(tmp_path, text):
    (tmp_path / "log.csv").write_text(text)
    return read_long_csv(tmp_path / "log.csv", ("time_s",))


def test_numbers_gaps_and_remarks(tmp_path):
    read = table(tmp_path, "# by KAREL\ntime_s, a\n0,1\n\n# later\n0.1,\n ,3\n,,\n0.3,4e0\n")
    np.testing.assert_array_equal(read.values, [[0, 1], [0.1, np.nan], [np.nan, 3], [0.3, 4]])
    assert [read.line(row) for row in range(4)] == [3, 6, 7, 9]
    assert read.location(1, "a").endswith("log.csv: line 6, column a")


def test_a_plain_file_is_the_same_by_numpy_and_by_rows(tmp_path):
    numbers = np.random.default_rng(0).normal(size=(500, 3)).round(6)
    rows = "\n".join(",".join(map(str, row)) for row in numbers.tolist())
    np.testing.assert_array_equal(table(tmp_path, f"time_s,a,b\n{rows}\n").values, numbers)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"), ("time_s,a\n", "no rows"), ("time,a\n0,1\n", "time_s"), ("time_s,time_s\n0,1\n", "twice"),
        ("time_s,a\n0,1\n1\n", "line 3: 1 cells"), ("time_s,a\n0,1\n1,x\n", "line 3, column a"),
        ("time_s,a\n0,1\n1,nan\n", "line 3, column a"), ("time_s,a\n0,1\n1,inf\n", "line 3, column a"),
        ("time_s,a\n0,1\n1,1_0\n", "line 3, column a"), ("time_s,a\n0,1\n1,1e30\n", "beyond"),
        ("time_s;a\n0;1\n", "semicolons"), ("time_s,a\n# x\n0,1,\n", "line 3: 3 cells"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_with_its_line(tmp_path, text, words):
    with pytest.raises(InputError, match=words):
        table(tmp_path, text)
