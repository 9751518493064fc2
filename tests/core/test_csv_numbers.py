"""Bodies of numbers that are read at once: gaps, remarks, lines in messages; what is not plain is left to the rows."""

import numpy as np
import pytest

from compgen.core import csv_table
from compgen.core.csv_numbers import numbers_at_once
from compgen.core.csv_table import read_csv
from compgen.core.exceptions import InputError

SPELLINGS = [
    "# by KAREL\ntime_s, a\n0,1\n\n# later\n0.1,\n ,3\n,,\n0.3,4e0\n",
    "time_s,a\n0,1\n0.1,\n,3\n0.3,4e0",
    "time_s,a\r\n0, 1\r\n0.1, \r\n,3\r\n\r\n  # x, y, 1\r\n0.3,+4.\r\n",
]


def log(tmp_path, text):
    (tmp_path / "log.csv").write_bytes(text.encode())
    return tmp_path / "log.csv"


@pytest.fixture(params=[0, 10**9], ids=["at once", "by rows"])
def way(request, monkeypatch):
    """Both ways of reading, whatever the length."""
    monkeypatch.setattr(csv_table, "LONG", request.param - 1)
    return request.param


@pytest.mark.parametrize("text", [s.replace("\n,,\n", "\n,\n") for s in SPELLINGS])
def test_both_ways_read_the_same(tmp_path, way, text):
    read = read_csv(log(tmp_path, text), ("time_s",))
    assert (read.values is not None) == (way == 0)
    np.testing.assert_array_equal(read.numbers("time_s", gaps=True), [0, 0.1, np.nan, 0.3])
    np.testing.assert_array_equal(read.numbers("a", gaps=True), [1, np.nan, 3, 4])
    lines = [n for n, line in enumerate(text.splitlines(), 1) if line.strip(" ,") and line.strip()[0] not in "#t"]
    assert list(read.line) == lines
    with pytest.raises(InputError, match=f"line {lines[1]}, column a: empty"):
        read.numbers("a")
    with pytest.raises(InputError, match=f"line {lines[2]}, column time_s: empty"):
        read.words("time_s")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"), ("time_s,a\n", "no rows"), ("time,a\n0,1\n", "time_s"), ("time_s,time_s\n0,1\n", "twice"),
        ("time_s,a\n0,1\n1\n", "line 3: 1 cells"), ("time_s,a\n0,1\n1,x\n", "line 3, column a"),
        ("time_s,a\n0,1\n1,inf\n", "line 3, column a"), ("time_s,a\n0,1\n1,1_0\n", "line 3, column a"),
        ("time_s,a\n0,1\n1,1e30\n", "beyond"), ("time_s,a\n0,1\n1,1e999\n", "line 3, column a"),
        ("time_s;a\n0;1\n", "semicolons"), ("time_s,a\n# x\n0,1,\n", "line 3: 3 cells"),
        ("time_s,a\n0,1 # x\n", "line 2, column a"), ("# x\n# y\n", "empty"), ("time_s,a\n# x\n\n", "no rows"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_with_its_line(tmp_path, way, text, words):
    with pytest.raises(InputError, match=words):
        [t.numbers(c, gaps=True) for t in [read_csv(log(tmp_path, text), ("time_s",))] for c in t.header]


@pytest.mark.parametrize(
    "body", ["1,nan\n", "1,x\n", "1 2,3\n", "0x1,2\n", "1\n", "1,2,3\n", "\u0661,2\n", '"1",2\n', "\n"]
)
def test_what_is_not_plain_is_left_to_the_rows(body):
    assert numbers_at_once(f"1,2\n{body}" if body.strip() else body, 2) is None


def test_a_file_has_no_more_rows_than_it_may(tmp_path, way):
    with pytest.raises(InputError, match="4 rows are over 3"):
        read_csv(log(tmp_path, "a\n1\n2\n3\n4\n"), most_rows=3)
