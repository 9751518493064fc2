"""Tables as loggers and instruments write them: read as a plain reader reads them that is told how, or refused."""

import zipfile

import naive_logger
import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError
from compgen.core.recorded.cells import name_and_unit, number_text
from compgen.core.recorded.layout import DialectTable
from compgen.core.recorded.table import read_recorded, read_table
from compgen.core.recorded.times import time_of

NODES = ("j2", "j3", "link1", "wrist")
LOG = ("time_s", "ambient_degC", *(f"{node}_degC" for node in NODES), "part_3_degC")
PLACE = ("x_mm", "y_mm", "z_mm")
POINTS = (*PLACE, "i", "j", "k", "feed_mm_s")


def written(folder, content, name="log.csv"):
    file = folder / name
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


def read(file, required=("time_s",), known=LOG, table="[log]", **dialect):
    return read_recorded(file, required, known, DialectTable(**dialect), table)


def refusal(file, *arguments, **dialect):
    with pytest.raises(InputError) as caught:
        read(file, *arguments, **dialect)
    message = str(caught.value).replace(str(file), "log.csv")
    assert "\n" not in message
    assert len(message) <= 300
    return message


def column(table, name):
    return np.array([float(cell or "nan") for cell in table.columns[table.header.index(name)]])


@pytest.mark.parametrize("seed", range(60))
def test_a_drawn_file_is_read_as_by_who_is_told_how_it_is_written(tmp_path, seed):
    data, drawn = naive_logger.draw(seed)
    table = read(written(tmp_path, data), **drawn.dialect)
    seconds, readings = naive_logger.read(data, drawn)
    time = column(table, "time_s")
    assert_allclose(time - time[0], seconds, atol=1e-6)
    for node, values in readings.items():
        assert_allclose(column(table, f"{node}_degC"), values, rtol=0, atol=1e-9)
    assert np.isfinite(np.concatenate(list(readings.values()))).any()
    assert f"decimal {'comma' if drawn.comma else 'point'}" in table.recorded.words
    assert "No." in table.recorded.left_out


@pytest.mark.parametrize("head", ["Time [d]", "Zeit (Tage)", "t in days"])
def test_days_are_no_seconds(tmp_path, head):
    """They were asked for as ``columns = { time_s = "Time [d]" }``, and then read as seconds."""
    text = f"{head};temp_d;temp_c\n0,5;20,5;21\n0,75;20,5;21\n"
    table = read(written(tmp_path, text), columns={"j2": "temp_d", "j3": "temp_c"}, unit="degC")
    assert_allclose(column(table, "time_s"), [43200, 64800])
    assert_allclose(column(table, "j2_degC"), 20.5)


def test_a_clock_without_seconds_is_said_to_count_hours(tmp_path):
    for time, words in (("08:10", "clock times in hours and minutes"), ("00:10:00", "clock times without")):
        assert words in read(written(tmp_path, f"time;j2 [°C]\n{time};20,5\n")).recorded.words


def test_dates_are_seconds_since_2000_and_zones_are_of_utc(tmp_path):
    text = "time;j2 [°C]\n2000-01-02T00:00:10+01:00;20,5\n2000-01-02T00:00:20+01:00;20,5\n"
    assert_allclose(column(read(written(tmp_path, text)), "time_s"), [86410 - 3600, 86420 - 3600])
    assert "with a zone, in UTC" in read(written(tmp_path, text)).recorded.words
    text = "time;j2 [°C]\n08:15;20,5\n08:16:30;20,5\n26:00:00.25;20\n"
    assert_allclose(column(read(written(tmp_path, text)), "time_s"), [29700, 29790, 93600.25])


@pytest.mark.parametrize(
    ("cell", "kind", "seconds"),
    [
        ("08:15", "c", 29700), ("8:15:00", "c", 29700), ("08:15:00,250", "c", 29700.25), ("12:00:05 AM", "c", 5),
        ("12:00:00 p.m.", "c", 43200), ("2026-11-22", "d", 0), ("22.11.2026 08:15:00", "dc", 29700),
        ("11/22/2026 08:15:00:123", "dc", 29700.123), ("2026-11-22T08:15:00Z", "dcz", 29700), ("Nov 22, 2026", "d", 0),
        ("'26-11-22 08:15:00.0", "dc", 29700), ("08:61", "", 0), ("13:00 PM", "", 0), ("2026-11-22 24:10", "", 0),
        ("21.5", "", 0), ("-5", "", 0), ("SN-12", "", 0),
    ],
)  # fmt: skip
def test_what_is_a_time(cell, kind, seconds):
    assert time_of(cell)[0] == kind
    assert time_of(cell)[2] == pytest.approx(seconds)


@pytest.mark.parametrize(
    ("text", "name", "unit"),
    [
        ("TC 03 [°C]", "tc 03", "degC"), ("101 <J2> (C)", "101 <j2>", "degC"), ("Temp_1/°F", "temp 1", "degF"),
        ("j2_degC", "j2", "degC"), ("X [mm]", "x", "mm"), ("feed_mm_s", "feed", "mm_s"), ("Zeit in s", "zeit", "s"),
        ("Kanal C", "kanal c", ""), ("t/s", "t", "s"), ("T (ºC)", "t", "degC"), ("T \u2103", "t", "degC"),
        ("TÂ°C [Â°C]", "tâ°c", "degC"), ("Y (in)", "y", "inch"), ("Alarm 102", "alarm 102", ""),
        ("part_3", "part 3", ""), ("time_in_min", "time in", "min"), ("t_in_s", "t in", "s"),
    ],
)  # fmt: skip
def test_a_name_and_its_unit(text, name, unit):
    assert name_and_unit(text) == (name, unit)


@pytest.mark.parametrize(
    ("cell", "point", "comma"),
    [
        ("21.5", "21.5", None), ("21,5", None, "21.5"), ("1,234.5", "1234.5", None), ("1.234,5", None, "1234.5"),
        ("1,234", "1234", "1.234"), ("1 234,5", None, "1234.5"), ("+  21.5", "+21.5", None), ("-3", "-3", "-3"),
        ("1,234,567", "1234567", None), ("1.2E+01", "1.2E+01", None), ("OL", "", ""), ("9.90000000E+37", "", None),
        ("21x", None, None), (".", "", ""), ("1,23,4", None, None), ("١", None, None),
    ],
)  # fmt: skip
def test_a_number_by_either_decimal_sign(cell, point, comma):
    assert (number_text(cell, "."), number_text(cell, ",")) == (point, comma)


@pytest.mark.parametrize(
    "line",
    [
        *("// Units: Inches", "Units;inch", "Length unit: in", "Coordinates in inches", "Einheit : Zoll"),
        "Coordinate System: Cartesian; Units: Inches, Degrees",
    ],
)
def test_a_unit_that_a_line_above_the_header_says_is_read_and_contradicts_another(tmp_path, line):
    file = written(tmp_path, f"Survey of a dish\n{line}\nName;X;Y;Z\nP1;1,5;0,25;3\nP2;1,75;0,25;3\n")
    assert_allclose(column(read(file, PLACE, POINTS), "x_mm"), np.array([1.5, 1.75]) * 25.4)
    assert "has the units inch, mm; keep one" in refusal(file, PLACE, POINTS, unit="mm")
    assert "has the units inch, mm; keep one" in refusal(file, PLACE, POINTS, columns={"x_mm": "X"})
    text = file.read_text()
    own = written(tmp_path, text.replace(line, "Units: see the drawing in inches"))
    assert "names no unit" in refusal(own, PLACE, POINTS)  # a sentence says no unit
    own = written(tmp_path, text.replace("X;Y;Z", "X [mm];Y [mm];Z [mm]"))
    assert "has the units inch, mm; keep one" in refusal(own, PLACE, POINTS)
    own = written(tmp_path, f"# {line}\nx_mm,y_mm,z_mm\n1.5,0.25,3\n")
    assert "has the units inch, mm; keep one" in refusal(own, PLACE, POINTS)
    bare = written(tmp_path, text.replace(line, "Unit 7 of the hall"))
    assert "names no unit" in refusal(bare, PLACE, POINTS)
    below = written(tmp_path, text.replace(f"{line}\n", "") + f"{line}\n")
    assert_allclose(column(read(below, PLACE, POINTS), "x_mm"), np.array([1.5, 1.75]) * 25.4)


HEAD = "time;j2 [°C];TC 04\n"


@pytest.mark.parametrize(
    ("text", "dialect", "words"),
    [
        ("time;j2 [°C]\n23:59;20,5\n00:01;20,5\n", {}, ("line 3, column 1 'time'", "runs back", "write dates")),
        ("time;j2 [C]\n00:10;20,5\n00:20;20,5\n", {}, ("line 2, column 1 'time'", "may be minutes and seconds")),
        ("time;j2 [C]\n08:10;20,5\n90:20;20,5\n", {}, ("line 2, column 1 'time'", "may be minutes and seconds")),
        ("Datum;Zeit;j2 [C]\n22. Dez;08:10:00;20,5\n23. Dez;09:20:00;20,5\n", {}, ("column 2 'Zeit'", "a day")),
        ("time;j2 [C];j3 [C]\n22.11.2026 08.15.00;20,5;20\n", {}, ("column 1 'time'", "no time as 2026-11-22")),
        ("time;event;j2 [C];j3 [C]\n08:15:00;;20,5;21\n08:16:00;20,5;21\n", {}, ("line 3: 3 cells", "has 4", "give")),
        ("time;j2 [C]\n2026-11-22 08:15;20\n2026-11-22 08:14;20\n", {}, ("line 3, column 1", "runs back", "sort")),
        ("time;j2 [C]\n03/04/2026 08:15;20,5\n", {}, ("line 2, column 1", '"dmy" or "mdy"', "dates =", "[log]")),
        ("time;j2 [C]\n03/04/2026;20,5\n13/04/2026;20,5\n04/13/2026;21,5\n", {}, ("line 2, column 1", "write all")),
        ("time;j2 [C]\n08:15;20,5\nlater 3;20,5\n08:17;20,5\n",
         {}, ("line 3, column 1", "no time like '08:15'", "mend")),
        ("time;j2 [C]\n2026-01-01 08:15Z;20\n2026-01-01 08:16;2\n", {}, ("line 3, column 1", "no time like")),
        ("time;j2\n08:15;20,5\n", {}, ("line 1, column 2 'j2'", "names no unit", 'unit = "degC"', "[log]")),
        ("time;j2 [C]\n08:15;20,5\n", {"unit": "degF"}, ("line 1, column 2", "units degC, degF", "keep one")),
        ("time;j2 [mm]\n08:15;20,5\n", {"columns": {"j2": "j2"}}, ("column 2", "units mm", "temperature")),
        ("time;j2 [C]\n08:15;20,500\n08:16;21,125\n",
         {}, ("line 2, column 2", "thousands or a decimal comma", "decimal =")),
        ("time;j2 [C]\n08:15;20,5\n08:16;2o,5\n",
         {}, ("line 3, column 2 'j2 [C]'", "no number with a decimal comma", "mend")),
        ("time;j2 [C]\n08:15;20,5\n08:16;20.5\n08:17;1,5\n",
         {}, ("line 3, column 2", "no number with a decimal comma")),
        (HEAD + "08:15;20,5;3\n",
         {"columns": {"j3": "TC 05"}}, ("line 1", "'TC 05'", "there are: time, j2 [°C], TC 04")),
        (HEAD + "08:15;20,5;3\n", {"columns": {"j9": "TC 04"}}, ("columns: j9: unknown", "known: ambient, j2")),
        (HEAD + "08:15;20,5;3;4\n08:16;20,5;3;4\n" * 30 + "08:17;1;2;3;4;5\n",
         {}, ("line 2: 4 cells", "has 3", "give each")),
        ("t;j2 [C];\nt;x\n0;20,5;3\n1;20,5;3;4\n", {}, ("line 4: 4 cells", "has 3", "give each")),
        ("time_s;j2 [C]\n1;0;20,5\n2;60;20,5\n", {}, ("line 2: 3 cells", "has 2", "give each")),  # names one off
        ("date;clock;j2 [C]\n01.02.2026;08:15;20,5\n;08:14;20,5\n", {}, ("line 3", "runs back from '01.02.2026")),
        ("No,X,j2 [C]\n1,0,20.5\n2,1,20.5\n", {"columns": {"j2": "j2"}}, ("columns = { time_s =",)),
        ("No,Time,j2 [C]\n1,0,20.5\n2,1,20.5\n", {}, ('columns = { time_s = "Time" }', "or time_ms, or time_min")),
        ("a;j2 [C]\n1;20,5\n2;20,5\n", {}, ("line 1", "column time_s: missing", "columns = {", "there are: a, j2 [C]")),
        ("t1;t2;j2 [C]\n08:15;08:16;20\n",
         {}, ("line 1", "columns 1 and 2 both hold times", 'columns = { time = "#1" }')),
        ("time;j2 [C];J2 (C)\n08:15;20;20\n", {}, ("line 1", "columns 2 and 3 both may be j2_degC", "columns = {")),
        ("time;x;x\n08:15;20;20\n", {"columns": {"j2": "x"}}, ("line 1", "2 columns are 'x'", '"#2"')),
        ("time,j2 [C],j3 [C]\n08:15,20,5,21,5\n08:16,20,5,21,5\n", {}, ("line 2: 5 cells", "has 3", "use others")),
        ("No j2 [C] time\n1 20 08:15\n2 21 08:16\n", {}, ("line 2: 3 cells", "has 4", "give each column")),
        ("only words\nand more\n", {}, ("no rows of readings", "give CSV in UTF-8")),
        ("t [s];j2 [C]\n0;20 C\n10;20 C\n", {}, ("no rows of readings", "numbers without units")),
        ("1;2\n", {}, ("no header above it", "column time_s: missing")),
        (b"PK\x03\x04 torn", {}, ("no workbook", "save it as CSV")),
        # no line is said that is none, and of long names both ends: those of one maker's loggers differ at the last
        ("1;08:15;20\n2;08:16;20\n", {"columns": {"j2": "#3"}}, ("line 1, column 3 '#3'", "names no unit")),
        ('"Temp, °C (LGR S/N: 10234567, SEN 1)","Temp, °C (LGR S/N: 10234567, SEN 2)"\n20.5,21\n20.5,21\n',
         {}, ("Temp, °C (L..567, SEN 1), Temp, °C (L..567, SEN 2)", 'columns = { time_s = "#1" }')),
    ],
)  # fmt: skip
def test_what_a_file_leaves_open_is_refused_with_the_mend(tmp_path, text, dialect, words):
    message = refusal(written(tmp_path, text), **dialect)
    for word in words:
        assert word in message, message


TREND = (("Temp_J2", "20,5"), ("Temp_air", "19,25"))


@pytest.mark.parametrize(
    ("text", "dialect"),
    [
        ("time;j2 [C]\n03/04/2026 08:15;20,5\n03/04/2026 08:16;20,5\n", {"dates": "dmy"}),
        ("time;j2 [C]\n03/04/2026 08:15;20,5\n13/04/2026 08:16;20,5\n", {}),  # another row decides
        ("time;j2\n08:15;20,5\n08:16;20,5\n", {"unit": "degC"}),
        ("time;j2\n08:15;68,9\n08:16;68,9\n", {"unit": "degF"}),
        ("time;j2\n08:15;20,500\n08:16;20,500\n", {"unit": "degC", "decimal": "comma"}),
        ("time;j2 [C]\n08:15;20,500\n08:16;20,50\n", {}),  # another row decides
        ("time_s;j2_degC\n0;20,5\n1;20,5\n", {}),
        ('time;TC 01;Unit\n08:15;68,9;F\n08:16;68,9;F\nEnd of file\n', {"columns": {"j2": "TC 01"}}),
        ("# remark\nNo\tTime [min]\tj2 [K]\n1\t0\t293.65\n2\t1\t293.65\n", {}),
        ("Time;101;102;103;104\n08:15;1;20,5;1;1\n08:16;1;20,5;1;1\n", {"columns": {"j2": "102"}, "unit": "degC"}),
        ("VarName;TimeString;VarValue;Validity;Time_ms\n" + "".join(
            f"{name};22.11.2026 08:{m}:00;{value};1;46348343750,0\n" for m in (15, 16) for name, value in TREND)
         + "$RT_OFF$;22.11.2026 08:17:00;0;2;1,0\n", {"columns": {"j2": "Temp_J2"}, "unit": "degC"}),
        ("# start 8 h\n#time;TC 03\n08:15;20,5\n08:16;20,5\n", {"columns": {"j2": "TC 03"}, "unit": "degC"}),
        ("1 08:15:00 20,5\n2 08:16:00 20,5\n", {"columns": {"j2_degC": "#3"}}),
        # as makers write: a row number named "#", a last count without a name, a date once, statistics behind
        ('"Plot Title: R3"\n"#","Time","Temp, °C (LBL: J2)"\n1,08:15:00,20.5\n2,08:16:00,20.5\n',
         {"columns": {"j2": "Temp, °C (LBL: J2)"}, "unit": "degC"}),
        ("YREC\nCh\t0001\t0002\tMessage\nTag\tJ2\tJ3\nUnit\t°C\t°C\nSampling Data\n2026/11/23 08:15:00\t20.5\t1\t0\n"
         "2026/11/23 08:16:00\t20.5\t1\t0\n", {"columns": {"j2": "J2"}}),
        # a row of units and one of how each was taken
        ('"TOA5","CR1000","4.2"\n"TIMESTAMP","RECORD","J2","J3"\n"TS","RN","Deg C","Deg C"\n"","","Avg","Avg"\n'
         '"2026-11-23 06:00:00",0,20.5,1\n"2026-11-23 06:01:00",1,20.5,1\n', {}),
        ("Units: s\n,,CH0001,CH0002\n,,J2,Hall\nDate,Time,Min,Min\n,,degF,degF\n2026/11/23,08:15:00,68.9,70\n"
         "2026/11/23,08:16:00,68.9,70\n", {"columns": {"j2": "J2"}}),
        ('DATUM:;ZEIT:;M00: °C\n23.11.26;08:15:00;20,5\n;08:16:00;20,5\n', {"columns": {"j2": "M00"}}),
        # LabVIEW's units stand above the header, Hioki's in it, below people's names; thermocouples are of kind K
        ("Type\tK\tK\nY_Unit_Label\tDeg F\tVolts\nX_Dimension\tTime\tTime\n***End_of_Header***\t\t\n"
         "X_Value\tTemp_0\tHall\n0.0\t68.9\t1\n60.0\t68.9\t1\n", {"columns": {"time_s": "X_Value", "j2": "Temp_0"}}),
        ('"HIOKI LR8450","V1"\n"Comment","J2 gear","hall"\n"Range","100 C f.s.","100 C f.s."\n"Time","U1-1[°C]",'
         '"U1-2[°C]"\n0,20.5,1\n60,20.5,1\n', {"columns": {"time_s": "#1", "j2": "J2 gear"}}),
        ("Id;Datum/Uhrzeit;[1] Temp [°C];\n1;23.11.2026 08:15:00;20,5;\n2;23.11.2026 08:16:00;20,5;\n;Minimum;20,5;\n"
         ";Mittelwert;20,5;\n", {"columns": {"j2": "[1] Temp"}}),
    ],
)  # fmt: skip
def test_what_is_said_or_decided_by_another_row_is_read(tmp_path, text, dialect):
    table = read(written(tmp_path, text), **dialect)
    assert_allclose(column(table, "j2_degC"), [20.5, 20.5], atol=1e-9)
    assert table.recorded.words
    assert len(table.columns[table.header.index("time_s")]) == 2


def test_a_reading_that_the_logger_calls_invalid_is_missing(tmp_path):
    rows = "".join(f"J2;22.11.2026 08:{m}:00;{value};{valid};0\n" for m, value, valid in ((15, 20, 1), (16, 99, 0)))
    table = read(written(tmp_path, f"VarName;TimeString;VarValue;Validity;Time_ms\n{rows}"), unit="degC")
    assert table.columns[table.header.index("j2_degC")] == ("20", "")


def test_a_file_without_a_header_is_told_how_to_number_its_columns(tmp_path):
    message = refusal(written(tmp_path, "P1 1200.1 0.2 500.0\nP2 1300.1 0.2 500.0\n"), PLACE, POINTS)
    assert 'say columns = { x_mm = "#2", ... } in [log]' in message  # P1 is a name


def test_of_several_clocks_the_mend_names_one_with_its_date(tmp_path):
    text = "Date,Time,Elapsed,J2 [C]\n11/23/2026,11:59:30 PM,0:00:00,20\n11/24/2026,12:00:30 AM,0:01:00,20\n"
    file = written(tmp_path, text)
    assert 'columns 2 and 3 both hold times; say columns = { date = "#1", time = "#2" }' in refusal(file)
    table = read(file, columns={"date": "#1", "time": "#2"})
    assert np.diff(column(table, "time_s")) == 60


def test_a_log_without_times_is_not_told_to_name_an_empty_column(tmp_path):
    file = written(tmp_path, "X_Value\tT0 [C]\tT1 [C]\n\t20.5\t1\n\t20.6\t1\n")
    assert "time_s: missing; no other column has numbers" in refusal(file, columns={"j2": "T0", "j3": "T1"})


def test_of_two_columns_of_one_name_the_mend_gives_a_number(tmp_path):
    file = written(tmp_path, "X_Value\tT0 [C]\tX_Value\tT1 [C]\n0\t20.5\t0\t1\n60\t20.5\t60\t1\n")
    assert 'columns = { time_s = "#1" }' in refusal(file, columns={"j2": "T0"})
    assert 'its number as "#1"' in refusal(file, columns={"j2": "T0", "time_s": "X_Value"})
    assert column(read(file, columns={"j2": "T0", "time_s": "#1"}), "time_s").tolist() == [0, 60]


def test_degrees_of_a_japanese_logger_are_read(tmp_path):
    text = "Tag\tJ2\nUnit\t\u2103\n2026/11/23 08:15:00\t20.5\n2026/11/23 08:16:00\t20.5\n"
    table = read(written(tmp_path, text.encode("shift_jis")), columns={"j2": "J2"})
    assert_allclose(column(table, "j2_degC"), 20.5)
    assert "degC" in table.recorded.words


def test_a_file_of_our_own_form_is_left_to_its_own_reader(tmp_path):
    for text in ("time_s,j2_degC\n0,1\n", "\ufeff# remark\n\n time_s , x\n0,1\n", '"time_s","j2_degC"\n0,1\n'):
        assert read(written(tmp_path, text)) is None


def workbook(file, **sheets):
    """A workbook as its standard says (ECMA-376), by hand: numbers, and texts in line."""

    def cell(value):
        if isinstance(value, str):
            return f'<c t="inlineStr"><is><t>{value}</t></is></c>'
        return f"<c><v>{value!r}</v></c>"

    names = dict(enumerate(sheets, 1))
    main, office = "http://schemas.openxmlformats.org/spreadsheetml/2006/main", "http://schemas.openxmlformats.org"
    kind = "application/vnd.openxmlformats-officedocument.spreadsheetml"
    relations = f"{office}/officeDocument/2006/relationships"
    with zipfile.ZipFile(file, "w") as book:
        book.writestr(
            "[Content_Types].xml",
            f'<Types xmlns="{office}/package/2006/content-types"><Default Extension="rels" ContentType="application/'
            f'vnd.openxmlformats-package.relationships+xml"/><Override PartName="/xl/workbook.xml" ContentType="{kind}'
            f'.sheet.main+xml"/>'
            + "".join(
                f'<Override PartName="/xl/worksheets/sheet{k}.xml" ContentType="{kind}.worksheet+xml"/>' for k in names
            )
            + "</Types>",
        )
        book.writestr(
            "_rels/.rels",
            f'<Relationships xmlns="{office}/package/2006/relationships"><Relationship Id="rId1" '
            f'Type="{relations}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        )
        book.writestr(
            "xl/workbook.xml",
            f'<workbook xmlns="{main}" xmlns:r="{relations}"><sheets>'
            + "".join(f'<sheet name="{name}" sheetId="{k}" r:id="rId{k}"/>' for k, name in names.items())
            + "</sheets></workbook>",
        )
        book.writestr(
            "xl/_rels/workbook.xml.rels",
            f'<Relationships xmlns="{office}/package/2006/relationships">'
            + "".join(
                f'<Relationship Id="rId{k}" Type="{relations}/worksheet" Target="worksheets/sheet{k}.xml"/>'
                for k in names
            )
            + "</Relationships>",
        )
        for k, name in names.items():
            body = "".join(f'<row r="{n}">{"".join(map(cell, row))}</row>' for n, row in enumerate(sheets[name], 1))
            text = f'<worksheet xmlns="{main}"><sheetData>{body}</sheetData></worksheet>'
            book.writestr(f"xl/worksheets/sheet{k}.xml", text)
    return file


def test_a_workbook_is_read_without_being_saved_as_text(tmp_path):
    rows: list[list[object]] = [["Logger 5"], ["Zeit", "TC 01 [°C]", "TC 03 [°C]"]]
    rows += [[f"2026-11-22 08:{n:02}:00", 20.0 + n, 21.25 + n] for n in range(9)]
    file = workbook(tmp_path / "log.xlsx", Info=[["Channels", 3.0]], Data=rows)
    table = read(file, columns={"j2": "TC 03", "ambient": "TC 01"})
    assert_allclose(column(table, "j2_degC"), 21.25 + np.arange(9))
    assert_allclose(np.diff(column(table, "time_s")), 60)
    assert table.line[0] == 3
    assert "sheet 'Data'" in table.recorded.words
    sums = [["", "TC 01 [°C]", "TC 03 [°C]"], ["Mean", 24.0, 25.25], ["Max", 28.0, 29.25]]
    assert "sheet 'Data'" in read(workbook(file, Data=rows, Sums=sums), columns={"j2": "TC 03"}).recorded.words
    workbook(file, Monday=rows, Tuesday=rows[:6])
    assert "sheet 'Tuesday' and sheet 'Monday' both hold" in refusal(file, columns={"j2": "TC 03", "ambient": "TC 01"})


def test_merged_cells_above_a_workbooks_header_say_which_set_is_which(tmp_path):
    axes = [f"{axis} [mm]" for axis in "XYZ"]
    rows: list[list[object]] = [["Report"], ["Name", "Soll", "", "", "Ist", "", ""], ["", *axes, *axes]]
    rows += [[f"P{n}", 1.5, 2.0, n + 0.25, 1.75, 2.0, n + 0.5] for n in range(5)]
    file = workbook(tmp_path / "log.xlsx", Data=rows)
    assert "columns 2 and 5 both may be x_mm (Soll X [mm], Ist X [mm])" in refusal(file, PLACE, (*PLACE, "target"))
    table = read(file, PLACE, (*PLACE, "target"), columns={"x": "#5", "y": "#6", "z": "#7"})
    assert_allclose(column(table, "z_mm"), np.arange(5) + 0.5)
    assert table.words("target")[0] == "P0"


TRACKER = "".join(
    f"Path, G1, {n}, {2255.5 + n / 7:.6f}, -2602.986613, {-275.1 - n:.6f}, 02/12/25 16:56:08\n" for n in range(5)
)


@pytest.mark.parametrize(
    ("text", "dialect"),
    [
        ("// SpatialAnalyzer\n// AXES = CARTESIAN: X,  Y,  Z (mm)\n" + TRACKER,
         {"columns": {"x_mm": "#4", "y_mm": "#5", "z_mm": "#6"}}),
        ("// Units: Millimeters, Degrees\n// Group  Point  X  Y  Z\n" + TRACKER.replace("Path, ", "").replace(
            ", 02/12/25 16:56:08", "").replace(",", " "), {}),
        ("// Coordinates in mm\n" + TRACKER.replace("Path, G1, ", "P").replace(", 02/12/25 16:56:08", "").replace(
            ",", ""), {"columns": {"x": "#2", "y": "#3", "z": "#4"}}),  # as many words as columns are no header
        ("Name\tX [mm]\tY [mm]\tZ [mm]\tDev\n" + TRACKER.replace("Path, G1, ", "P").replace(", ", "\t"), {}),
        ("Part: dish\nUnits: mm\n\nPOINT\tX\tY\tZ\tI\tJ\tK\n" + TRACKER.replace("Path, G1, ", "P").replace(
            ", 02/12/25 16:56:08", ", 0, 0, 1").replace(", ", "\t"), {"unit": "mm"}),  # K is no unit there
        ("Id;X;Y;Z;T\n" + TRACKER.replace("Path, G1, ", "P").replace(", ", ";").replace(".", ","), {"unit": "mm"}),
    ],
)  # fmt: skip
def test_an_instruments_points_are_read_with_their_names_in_a_column(tmp_path, text, dialect):
    table = read(written(tmp_path, text), PLACE, POINTS, "[path]", **dialect)
    assert_allclose(column(table, "x_mm"), np.round(2255.5 + np.arange(5) / 7, 6), atol=1e-9)
    assert_allclose(column(table, "z_mm"), -275.1 - np.arange(5), atol=1e-9)


def test_what_others_call_a_measured_column_stands_in_a_file_beside_it(tmp_path):
    file = written(tmp_path, "Point ID,East [m],North [m],Height,Axis 1\nA1,1.5,2,3,90\nA2,1,2,3,45\n", "tracker.csv")
    wanted, known = (*PLACE, "j1_deg"), (*PLACE, "j1_deg", "target")
    with pytest.raises(
        InputError, match=r'columns x_mm.*"its name here", \.\.\. } in tracker.csv.toml; there are: Point ID, East'
    ):
        read_table(file, wanted, known)
    beside = 'columns = { x = "East", y = "North", z_mm = "Height", j1 = "Axis 1" }\n'
    written(tmp_path, beside, "tracker.csv.toml")
    with pytest.raises(InputError, match=r'names no unit; say columns = { j1_deg = "Axis 1" }, or j1_rad, in '):
        read_table(file, wanted, known)
    written(tmp_path, beside.replace("j1 =", "j1_deg ="), "tracker.csv.toml")
    table = read_table(file, wanted, known)
    assert table.words("target") == ["A1", "A2"]
    assert_allclose([column(table, name)[0] for name in wanted], [1500, 2000, 3, 90])
    written(tmp_path, beside.replace("x =", "x_mm ="), "tracker.csv.toml")
    with pytest.raises(InputError, match="has the units m, mm; keep one of length, here or in its key"):
        read_table(file, wanted, known)
    written(tmp_path, "column = {}\n", "tracker.csv.toml")
    with pytest.raises(InputError, match=r"tracker\.csv\.toml: column: unknown key; did you mean 'columns'"):
        read_table(file, wanted, known)


@pytest.mark.parametrize(("unit", "size"), [("m", 1000.0), ("inch", 25.4), ("mm", 1.0), ("cm", 10.0), ("ft", 304.8)])
def test_lengths_are_read_in_the_unit_that_the_header_says(tmp_path, unit, size):
    text = f"Name;X [{unit}];Y [{unit}];Z [{unit}]\nP1;1,5;0,25;3\nP2;1,75;0,25;3\n"
    assert_allclose(column(read(written(tmp_path, text), PLACE, POINTS), "x_mm"), np.array([1.5, 1.75]) * size)
    bare = written(tmp_path, text.replace(f" [{unit}]", ""))
    assert 'names no unit; say unit = "mm"' in refusal(bare, PLACE, POINTS, "[path]")
    assert "names no unit; write it in the header, as 'X [mm]'" in refusal(bare, PLACE, POINTS, "")
    assert_allclose(column(read(bare, PLACE, POINTS, unit=unit), "x_mm"), np.array([1.5, 1.75]) * size)


@pytest.mark.parametrize(("names", "value"), [("j2_K,ambient_K", 295.65), ("j2 [°F],ambient [°F]", 72.5)])
def test_a_column_of_our_own_in_another_unit_is_turned_into_ours(tmp_path, names, value):
    """Beside ``time_s`` it was *an unknown sensor; did you mean 'ambient_degC'*, under which kelvin stood."""
    table = read(written(tmp_path, f"time_s,{names}\n0,{value},{value}\n60,{value},{value}\n"))
    assert_allclose(column(table, "ambient_degC"), 22.5, atol=1e-9)
    assert_allclose(column(table, "j2_degC"), 22.5, atol=1e-9)
    assert read(written(tmp_path, "time_s,ambient_degC\n0,22\n60,22\n")) is None


@pytest.mark.parametrize(
    ("names", "moment"), [("time", "2026-11-22T08:15:0{}Z"), ("Date,Clock", "22.11.2026,08:15:0{}")]
)
def test_moments_beside_columns_of_our_own_are_the_times(tmp_path, names, moment):
    """*time: unknown; did you mean 'time_s'?* was said, and of that name that a moment is no number."""
    rows = [f"{moment.format(n)},{n},2,3" for n in (1, 2)]
    table = read(written(tmp_path, "\n".join([f"{names},x_mm,y_mm,z_mm", *rows])), PLACE, (*PLACE, "time_s"), "")
    assert_allclose(np.diff(column(table, "time_s")), 1.0)
    assert_allclose(column(table, "x_mm"), [1, 2])
    assert read(written(tmp_path, "day,x_mm,y_mm,z_mm\n1,1,2,3\n"), PLACE, (*PLACE, "time_s")) is None
