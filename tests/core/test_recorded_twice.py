"""Places and joints that a file has twice, as they shall be and as they were measured, and rows that sum others up."""

import re
import tomllib

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.csv_table import read_csv
from compgen.core.exceptions import InputError
from compgen.core.recorded.layout import DialectTable
from compgen.core.recorded.table import read_recorded

PLACE = ("x_mm", "y_mm", "z_mm")
JOINTS = tuple(f"j{k}_deg" for k in range(1, 7))
KNOWN = ("time_s", "target", *JOINTS, *PLACE)
WANTED = np.array([[800.25, -1200.5, 300.125], [810.5, 1200.25, -301.5]])
MEASURED = WANTED + np.array([0.125, -0.25, 0.5])


def read(folder, text, required=PLACE, known=KNOWN, **dialect):
    file = folder / "points.csv"
    file.write_bytes(text.encode())
    return read_recorded(file, required, known, DialectTable(**dialect), "points.csv.toml")


def refusal(*arguments, **dialect):
    with pytest.raises(InputError) as caught:
        read(*arguments, **dialect)
    message = str(caught.value)
    assert len(message.partition("points.csv: ")[2]) < 280
    return message.partition("points.csv: ")[2]


def lines_to_write(message):
    """The lines that a refusal would have in the file beside, as a reader of TOML has them."""
    return [tomllib.loads(line) for line in re.findall(r"columns = \{[^}]*\}", message)]


def places(table):
    return np.array([[float(cell) for cell in table.columns[table.header.index(name)]] for name in PLACE]).T


HEADS = [
    ("Punkt;X Soll [mm];Y Soll [mm];Z Soll [mm];X Ist [mm];Y Ist [mm];Z Ist [mm]", "columns 2 and 5 both may be x_mm"),
    ("Point;Nominal X;Nominal Y;Nominal Z;Actual X;Actual Y;Actual Z", "(Nominal X, Actual X)"),
    ("Name;X;Y;Z;X_meas;Y_meas;Z_meas", "(X, X_meas)"),  # it was read as the nominal one, and nothing was said
    ("Nom;Xnom (mm);Ynom (mm);Znom (mm);Xact (mm);Yact (mm);Zact (mm)", "(Xnom (mm), Xact (mm))"),
    ("Id;Cmd X [mm];Cmd Y [mm];Cmd Z [mm];X [mm];Y [mm];Z [mm]", "(Cmd X [mm], X [mm])"),
    ("Id;X [mm];Y [mm];Z [mm];X [mm];Y [mm];Z [mm]", "columns 2 and 5 both may be x_mm"),
]


@pytest.mark.parametrize(("head", "words"), HEADS)
def test_of_two_sets_of_places_both_lines_are_said_and_each_reads_its_own(tmp_path, head, words):
    rows = (np.hstack([WANTED, MEASURED])).tolist()
    text = "\n".join([head, *(f"P{n};" + ";".join(map(str, row)) for n, row in enumerate(rows))]) + "\n"
    message = refusal(tmp_path, text)
    assert words in message
    lines = lines_to_write(message)
    assert len(lines) == 2
    for line, truth in zip(lines, (WANTED, MEASURED), strict=True):
        assert_allclose(places(read(tmp_path, text, **line)), truth)


ROWS = "".join(
    f"P{n};" + ";".join(f"{v:.4f}" for v in [*wanted, *measured]) + ";9;\n"
    for n, (wanted, measured) in enumerate(zip(WANTED.tolist(), MEASURED.tolist(), strict=True))
)
AXES = "Name;X [mm];Y [mm];Z [mm];X [mm];Y [mm];Z [mm];RMS;\n"


@pytest.mark.parametrize(
    ("above", "words"),
    [
        (";Nominal;;;Actual;;;;\n", "(Nominal X [mm], Actual X [mm])"),
        (";Soll;Soll;Soll;Ist;Ist;Ist;;\n", "(Soll X [mm], Ist X [mm])"),  # the row above was taken for the names
        ("Report;;;;;;;;\n;Sollwerte;;;Messwerte;;;;\n", "(Sollwerte X [mm], Messwerte X [mm])"),
        (";Nominal values;;;Measured values;;;;\n", "(Nominal values X [mm], Measured values X [mm])"),
    ],
)
def test_a_row_above_the_header_says_which_set_is_which(tmp_path, above, words):
    message = refusal(tmp_path, above + AXES + ROWS)
    assert words in message
    for line, truth in zip(lines_to_write(message), (WANTED, MEASURED), strict=True):
        assert_allclose(places(read(tmp_path, above + AXES + ROWS, **line)), truth)


@pytest.mark.parametrize("columns", [{}, {"target": "Punkt"}])  # a name that stands in the row above is one of both
def test_a_group_says_the_unit_of_its_columns(tmp_path, columns):
    text = "Punkt;Achsen [°];;;;;;Position [mm];;\n;J1;J2;J3;J4;J5;J6;X;Y;Z\n" + "".join(
        f"P{n};{n},5;2,1;3,2;4,3;5,4;6,5;1000,1;200,{n};300,3\n" for n in range(3)
    )
    table = read(tmp_path, text, columns=columns)
    assert places(table)[1].tolist() == [1000.1, 200.1, 300.3]
    second = [table.columns[table.header.index(joint)][1] for joint in JOINTS]
    assert second == ["1.5", "2.1", "3.2", "4.3", "5.4", "6.5"]


def test_a_group_of_another_unit_is_none_of_its_columns(tmp_path):
    text = "Point,Axes (deg),,,Place,,\n,J1,J2,J3,X,Y,Z\n" + "".join(f"P{n},1,2,3,{n},5,6\n" for n in range(3))
    assert "column 5 'X': names no unit" in refusal(tmp_path, text)


def test_places_below_the_word_nominal_need_the_users_word(tmp_path):
    """They were taken for measured ones, and nothing was said."""
    text = ";Nominal [mm];;;;\nName;X;Y;Z;RMS\n" + "".join(f"P{n};1;{n};3;9\n" for n in range(3))
    message = refusal(tmp_path, text)
    assert "column 2 may be x_mm (Nominal [mm] X)" in message
    assert places(read(tmp_path, text, **lines_to_write(message)[0]))[2].tolist() == [1, 2, 3]


def test_a_unit_of_its_own_keeps_a_column_out_of_a_set(tmp_path):
    head = "Name;X;Y;Z;" + ";".join(f"J{n} [deg]" for n in range(1, 7))
    text = f";Nominal [mm]{9 * ';'}\n{head}\n" + "".join(f"P{n};1;{n};3;4;5;6;7;8;9.5\n" for n in range(3))
    (line,) = lines_to_write(refusal(tmp_path, text, (*JOINTS, *PLACE)))
    assert read(tmp_path, text, (*JOINTS, *PLACE), **line).numbers("j6_deg").tolist() == [9.5] * 3


def test_deviations_in_a_second_set_are_no_places(tmp_path):
    text = ";Deviation;;;Actual;;;;\n" + AXES + ROWS
    message = refusal(tmp_path, text)
    assert "column 5 may be x_mm (Actual X [mm])" in message
    assert_allclose(places(read(tmp_path, text, **lines_to_write(message)[0])), MEASURED)


@pytest.mark.parametrize("title", ["Actual", "Actual points of 22.11.", "Deviation report"])
def test_a_title_names_no_set(tmp_path, title):
    text = f"{title};;;;\nName;X [mm];Y [mm];Z [mm];RMS\n" + "".join(f"P{n};1;{n};3;9\n" for n in range(3))
    assert places(read(tmp_path, text))[2].tolist() == [1, 2, 3]


def test_a_name_that_stands_a_row_higher_is_the_columns(tmp_path):
    text = "Punkt;Soll;;;Ist;;;;\n" + AXES.replace("Name", "") + ROWS
    assert read(tmp_path, text, columns={"x": "#2", "y": "#3", "z": "#4"}).words("target") == ["P0", "P1"]


def test_a_row_for_each_axis_is_told_so(tmp_path):
    text = "Name,Control,Nom,Meas\n" + "".join(f"P{n},{axis},1.5,1.25\n" for n in range(3) for axis in "XYZ")
    assert "line 1, column 2 'Control': a row for each of X, Y and Z; export one row a point" in refusal(tmp_path, text)


def test_a_file_with_too_few_columns_is_told_to_add_some(tmp_path):
    message = refusal(tmp_path, "Point  X(mm)  Y(mm)  Z(mm)  RMS\nP1  1.5  2  3  0.1\nP2  1  2  3  0.1\n", JOINTS)
    assert "missing; beside them, numbers stand only in RMS; add columns" in message


def test_a_nought_before_a_comma_parts_no_thousands(tmp_path):
    text = "Name;X [mm];Y [mm];Z [mm]\nP1;1,500;2,250;0,125\nP2;1,500;2,250;3,125\n"
    assert places(read(tmp_path, text)).tolist() == [[1.5, 2.25, 0.125], [1.5, 2.25, 3.125]]
    assert "may be thousands or a decimal comma" in refusal(tmp_path, text.replace("0,125", "9,125"))


def test_a_wide_text_without_a_mark_is_read(tmp_path):
    text = "Name;X [mm];Y [mm];Z [mm]\n" + "".join(f"P{n};1;{n};3\n" for n in range(3))
    file = tmp_path / "points.csv"
    file.write_bytes(text.encode("utf-16-le"))
    table = read_recorded(file, PLACE, KNOWN)
    assert table is not None
    assert places(table)[2].tolist() == [1, 2, 3]


def test_a_cell_of_anothers_table_is_named_by_its_column_there(tmp_path):
    table = read(tmp_path, "Name;X [mm];Y [mm];Z [mm]\nP1;1;;3\nP2;1;2;3\n")
    with pytest.raises(InputError, match=r"line 2, column 3 \(y_mm\): empty"):
        table.numbers("y_mm")


def test_a_set_that_says_what_it_is_needs_the_users_word(tmp_path):
    text = "Nom;X mesuré (mm);Y mesuré (mm);Z mesuré (mm)\nP1;800,25;-1200,5;300,125\nP2;810,5;1200,25;-301,5\n"
    message = refusal(tmp_path, text)
    assert "column 2 may be x_mm (X mesuré (mm)); say columns" in message
    assert_allclose(places(read(tmp_path, text, **lines_to_write(message)[0])), WANTED)


def test_deviations_are_no_places(tmp_path):
    text = "Id;dX [mm];dY [mm];dZ [mm];X [mm];Y [mm];Z [mm]\n" + "".join(
        f"P{n};0.1;0.2;0.3;{x};{y};{z}\n" for n, (x, y, z) in enumerate(MEASURED.tolist())
    )
    assert_allclose(places(read(tmp_path, text)), MEASURED)


def test_joints_without_a_unit_are_settled_by_one_line(tmp_path):
    text = "Name;A1;A2;A3;A4;A5;A6\nP1;1,5;2,5;3,5;4,5;5,5;6,5\nP2;1,5;2,5;3,5;4,5;5,5;6,5\n"
    bare = text.replace("A", "J")
    message = refusal(tmp_path, bare, JOINTS)
    assert "or j1_rad" in message
    table = read(tmp_path, bare, JOINTS, **lines_to_write(message)[0])
    assert [table.columns[table.header.index(name)][0] for name in JOINTS] == ["1.5", "2.5", "3.5", "4.5", "5.5", "6.5"]


SHOTS = "No;X [mm];Y [mm];Z [mm]\n" + "".join(f"{n};1,5;{n},25;3,5\n" for n in range(1, 7))


@pytest.mark.parametrize(
    "row", ["Moyenne;1,5;3,75;3,5\n", "Media;1,5;3,75;3,5\nSpannweite;0;5;0\n", "Std.Dev.;0;1,7;0\n"]
)
def test_a_row_that_is_named_a_sum_is_no_reading_and_the_note_has_its_line(tmp_path, row):
    table = read(tmp_path, SHOTS + row)
    assert len(table.line) == 6
    assert table.notes[0].endswith(f"no readings in line {', '.join(str(8 + n) for n in range(row.count(chr(10))))}")


def test_a_remark_like_a_reading_is_none_and_the_note_has_its_line(tmp_path):
    table = read(tmp_path, "# a remark\n" + SHOTS.replace("\n3;", "\n#3;"))
    assert table.line == [3, 4, 6, 7, 8]
    assert table.notes[0].endswith("no readings in line 5")
    assert "no readings" not in read(tmp_path, "# a remark; of 4; cells; 0\n" + SHOTS).notes[0]
    many = SHOTS + "".join(f"#{n};1,5;{n},25;3,5\n" for n in range(7, 20))
    assert read(tmp_path, many).notes[0].endswith("no readings in line 8, 9, 10, 11, 12, 13, 14, 15, 16 and 4 more")


@pytest.mark.parametrize("row", ["\n;1,5;3,75;3,5\n", "all shots;1,5;3,75;3,5\n", ";1,5;3,75;3,5\n;0;1,7;0\n"])
def test_a_row_that_may_be_a_sum_is_refused(tmp_path, row):
    assert f"line {SHOTS.count(chr(10)) + 1 + (row[0] == chr(10))}, column 1 'No': another kind" in refusal(
        tmp_path, SHOTS + row
    )


def test_remarks_in_a_first_column_are_no_sums(tmp_path):
    text = SHOTS.replace("No", "Remark").replace("\n1;", "\n;").replace("\n3;", "\nx;")
    assert len(read(tmp_path, text).line) == 6


def test_a_counter_is_not_called_seconds(tmp_path):
    known = ("time_s", "j2_degC")
    message = refusal(tmp_path, "Sample;J2 [C]\n1;20,5\n2;20,5\n", known[:1], known)
    assert 'columns = { time_s = "Sample" } if it counts seconds (or time_min, time_h, time_d) in' in message


def test_no_column_is_called_as_one_that_is_there(tmp_path):
    file = tmp_path / "own.csv"
    file.write_text("x_mm,y_mm,z_mm,x_act_mm\n1,2,3,4\n")
    with pytest.raises(InputError, match="column x_act_mm: unknown; remove it; known: "):
        read_csv(file, PLACE, PLACE)


@pytest.mark.parametrize("name", ["wrist_degC", "Wrist [C]", "wrist", "Wrist Ist [C]", "wrist actual"])
def test_a_sensor_whose_name_ends_in_a_word_for_measured_is_read(tmp_path, name):
    """The wrist's column was left out: it ends in *ist*."""
    known = ("time_s", "j2_degC", "wrist_degC")
    table = read(tmp_path, f"t_s;j2_degC;{name}\n0;20,5;21,25\n60;20,5;22\n", known[:1], known, unit="degC")
    assert table.columns[table.header.index("wrist_degC")] == ("21.25", "22")
