"""The CSV reader: what it takes, and what it refuses in one line that names file, line, column and mend."""

import os
import threading

import numpy as np
import pytest
from forked import HANGS_S
from numpy.testing import assert_array_equal

from compgen.core import csv_table
from compgen.core.csv_table import LONG, MAX_CELL, numbers_at_once, quote_cell, read_csv, text_cell
from compgen.core.exceptions import InputError

SECRET = "root:x:0:0:root:/root:/bin/bash"


def written(folder, content, name="a.csv"):
    file = folder / name
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


def refusal(function, *arguments, **options):
    """The message of a refusal, which is one line of at most 300 characters."""
    with pytest.raises(InputError) as caught:
        function(*arguments, **options)
    message = str(caught.value)
    assert "\n" not in message
    assert "\r" not in message
    assert len(message) <= 300 + len(os.sep.join(message.split(":")[0].split(os.sep)[:-1]))  # the folder apart
    return message


@pytest.mark.parametrize(
    "content",
    [
        "x_mm,y_mm\n1,2\n3,4\n",
        "\ufeffx_mm,y_mm\n1,2\n3,4\n",
        "x_mm,y_mm\r\n1,2\r\n3,4",
        "# a remark\n x_mm , y_mm \n\n1, 2\n # another, with a comma\n,\n3,4\n",
        '"x_mm","y_mm"\n"1","2"\n3,4\n',
    ],
)
def test_spellings_of_the_same_table_are_read_alike(tmp_path, content):
    table = read_csv(written(tmp_path, content), ("x_mm",), ("x_mm", "y_mm"))
    assert table.header == ("x_mm", "y_mm")
    assert_array_equal(table.numbers("x_mm"), [1, 3])
    assert_array_equal(table.numbers("y_mm"), [2, 4])


def test_lines_are_those_of_the_file(tmp_path):
    table = read_csv(written(tmp_path, '# remark\nname,x\n\n"two\nlines",1\n# remark\nb,word\n'))
    assert table.line == (5, 7)
    assert table.location(1, "x").endswith("a.csv: line 7, column x")
    assert refusal(table.numbers, "x").endswith(
        "line 7, column x: 'word' is not a number; give a number with a decimal point, or remove the row"
    )


def test_gaps_are_nan_where_they_may_be(tmp_path):
    table = read_csv(written(tmp_path, "t,x\n0,\n1,nan\n2,5\n"))
    assert_array_equal(table.numbers("x", gaps=True), [np.nan, np.nan, 5])
    assert "line 2, column x: empty; " in refusal(table.numbers, "x")
    assert "line 2, column x: empty; " in refusal(table.words, "x")


@pytest.mark.parametrize("cell", ["inf", "-inf", "1e400", "Infinity"])
@pytest.mark.parametrize("gaps", [True, False])
def test_infinities_are_refused(tmp_path, cell, gaps):
    table = read_csv(written(tmp_path, f"x\n1\n{cell}\n"))
    assert f"line 3, column x: '{cell}' is not a finite number; remove the row" in refusal(
        table.numbers, "x", gaps=gaps
    )


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", ("a.csv: empty; the first line names the columns: x_mm",)),
        ("# only a remark\n", ("empty",)),
        ("x_mm\n", ("no rows",)),
        ("x_mm,y_mm\n1,2\n1,2,3\n", ("line 3: 3 cells where the header has 2", "give each column a cell")),
        ("x_mm,x_mm\n1,2\n", ("column x_mm", "twice", "keep one")),
        ("x_mm,\n1,2\n", ("line 1, column 2: has no name",)),
        ("x_m,y_mm\n1,2\n", ("column x_mm: missing; is it 'x_m'",)),
        ("x_mm,z_mm\n1,2\n", ("column z_mm: unknown; did you mean",)),
        ("x_mm,Point\n1,2\n", ("column Point: unknown; remove it; known: x_mm, y_mm",)),
        ("x_mm;y_mm\n1;2\n", ("line 1", "semicolons", "commas")),
        ("x_mm\ty_mm\n1\t2\n", ("line 1", "tabs", "commas")),
        ("0.000,1.000,0.000\n0.008,1.000,0.000\n", ("line 1", "no header")),
        ("x_mm\r1\r2\r", ("line 1: its lines end in carriage returns alone", "LF")),
        ("x_mm\n1\n2\r3\n", ("line 3: its lines end in carriage returns alone",)),
        ("x_mm\n1\n\0\n", ("line 3: holds zero bytes",)),
        ("x_mm\n1\n" + "2" * (MAX_CELL + 1) + "\n", ("line 3: a cell is over 131,072 characters",)),
        ('x_mm\n1\n"2\n', ("line 3: not CSV",)),
        ('x_mm\n"1"2\n', ("line 2: not CSV",)),
        (b"x_mm\n\xff\xfe1\n", ("not UTF-8 text",)),
    ],
)
def test_what_is_no_table_is_refused(tmp_path, content, words):
    message = refusal(read_csv, written(tmp_path, content), ("x_mm",), ("x_mm", "y_mm"))
    for word in words:
        assert word in message, message


def test_files_that_are_none_are_refused_at_once(tmp_path):
    assert "a folder" in refusal(read_csv, tmp_path)
    assert "cannot be read: No such file" in refusal(read_csv, tmp_path / "none.csv")
    assert "no file has such a name" in refusal(read_csv, "a\0b")
    assert "pipe or a device" in refusal(read_csv, "/dev/zero")


def test_a_pipe_is_refused_without_waiting_for_it(tmp_path):
    pipe, messages = tmp_path / "pipe.csv", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: messages.append(refusal(read_csv, pipe)), daemon=True)
    reader.start()
    reader.join(HANGS_S)
    assert len(messages) == 1
    assert "a pipe or a device; give a CSV file" in messages[0]


def test_only_plain_cells_are_repeated_in_messages():
    assert quote_cell("12,5") == "the cell"
    assert quote_cell("12.5e-3") == "'12.5e-3'"
    assert quote_cell("a" * 32) == f"'{'a' * 32}'"
    for cell in ("a" * 33, "", "two words", "a\nb", SECRET, "é", "\x1b[31m", "12\n"):
        assert quote_cell(cell, "it") == "it"


@pytest.mark.parametrize("content", [f"{SECRET}\n1\n", f"x,{SECRET}\n1,2\n", f"x,{SECRET},{SECRET}\n1,2,3\n"])
@pytest.mark.parametrize("known", [None, ("time_s", "x")])
def test_a_header_that_is_no_header_is_not_repeated(tmp_path, content, known):
    message = refusal(read_csv, written(tmp_path, content), ("time_s",), known)
    assert "bash" not in message
    assert "column" in message


def test_a_cell_that_is_no_number_is_not_repeated(tmp_path):
    table = read_csv(written(tmp_path, f"x,two words\n{SECRET},word\n"))
    message = refusal(table.numbers, "x")
    assert message.endswith(
        "line 2, column x: the cell is not a number; give a number with a decimal point, or remove the row"
    )
    assert "line 2, column 2: 'word' is not a number" in refusal(table.numbers, "two words")


@pytest.mark.parametrize("cell", ["1_0", "\uff11\uff12", "\u0661", "0x10", "1e", "--1", "1 0"])
def test_what_only_looks_like_a_number_is_none(tmp_path, cell):
    table = read_csv(written(tmp_path, f"t,x\n0,{cell}\n"))
    assert "line 2, column x: " in refusal(table.numbers, "x")
    assert "is not a number" in refusal(table.numbers, "x")


@pytest.mark.parametrize("number", ["1e308", "-1e308", "1e13"])
def test_numbers_that_no_unit_makes_plausible_are_refused(tmp_path, number):
    table = read_csv(written(tmp_path, f"t,x\n0,1\n1,{number}\n"))
    assert "line 3, column x: " in refusal(table.numbers, "x")
    assert "is beyond 5; mend it" in refusal(table.numbers, "x", largest=5)


@pytest.mark.parametrize("text", ["=cmd|' /C calc'!A0", "@SUM(A1)", "+cmd", "-2+3", "\t=1", "\r=1", "-", "\n=1", "＝1"])
def test_a_text_is_no_formula(text):
    assert text_cell(text) == f"'{text}"


@pytest.mark.parametrize("text", ["-5", "+1.5e-3", "-.5", "plain", "a=b", "", "1:2"])
def test_other_texts_and_numbers_stay(text):
    assert text_cell(text) == text


def many(row, rows=9000, header="x_mm,y_mm,n"):
    return "\n".join([header, *([row] * rows), ""])


@pytest.mark.parametrize(
    "content",
    [many("1.5, -2e-3,7"), many("1.5,-2e-3,7").rstrip("\n"), "\ufeff" + many("1.5,-.002,7").replace("\n", "\r\n")],
)
def test_a_long_file_of_numbers_is_read_as_a_short_one(tmp_path, content):
    assert len(content) > LONG
    table = read_csv(written(tmp_path, content), ("x_mm",), ("x_mm", "y_mm", "n"))
    assert table.values is not None
    assert_array_equal(table.numbers("y_mm"), np.full(9000, -2e-3))
    assert table.words("n") == ["7"] * 9000
    assert table.location(8999, "n").endswith("line 9001, column n")
    assert "1.5 is beyond 1" in refusal(table.numbers, "x_mm", largest=1.0)
    table.numbers("x_mm")[0] = 9
    assert table.numbers("x_mm")[0] == 1.5


@pytest.mark.parametrize("bad", ["nan,1,1", "1,inf,1", "1,1_0,1", "1,,1", "1,1e999,1", "1,\u0661,1", "1,x,1"])
@pytest.mark.parametrize("where", [0, 4000, 9000])
def test_a_long_file_with_one_other_cell_is_refused_where_it_is(tmp_path, bad, where):
    lines = many("1,2,3").splitlines()
    lines.insert(where + 1, bad)
    table = read_csv(written(tmp_path, "\n".join(lines)), ("x_mm",))
    with pytest.raises(InputError, match=f"line {where + 2}, column [xy]_mm"):
        [table.numbers(c) for c in ("x_mm", "y_mm", "n")]


def test_a_long_file_with_remarks_and_gaps_keeps_its_lines(tmp_path):
    lines = many("1,2,3").splitlines()
    lines[5:5] = ["# a remark", "", ","]
    table = read_csv(written(tmp_path, "\n".join([*lines, "1,2,x"]).replace("\n,\n", "\n,,\n")))
    assert table.location(9000).endswith("line 9005")


@pytest.mark.parametrize("header", ["x_mm,y_mm,y_mm", "x_mm,y,n", "y_mm,n,m", "x_mm;y_mm;n"])
def test_a_long_file_has_its_header_looked_at(tmp_path, header):
    refusal(read_csv, written(tmp_path, many("1,2,3", header=header)), ("x_mm",), ("x_mm", "y_mm", "n"))


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
