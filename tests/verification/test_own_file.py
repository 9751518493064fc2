"""The user's own file, read a second time, and how far a flown path is from it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError
from compgen.planning.own_points.csv_points import points_table, read_points
from compgen.planning.own_points.tables import PointsTable
from compgen.verification.own_file.distance import distance_from_file
from compgen.verification.own_file.second_reading import SAG, read_own_file

NO_SHIFT = np.zeros(3)


def read(folder, text, pattern="gcode", shift=NO_SHIFT, joined=True):
    file = folder / "own.txt"
    file.write_text(text)
    return read_own_file(file, pattern, shift, joined=joined)


def test_it_shares_nothing_with_the_plan():
    package = Path(__file__).parents[2] / "compgen/verification/own_file"
    for module in package.glob("*.py"):
        text = module.read_text().replace("from compgen.job.bounds import OwnFile\n", "")  # the record that it fills
        rooms = {
            line.split(".")[1] for line in text.splitlines() if line.startswith(("from compgen", "import compgen"))
        }
        assert rooms <= {"core", "verification"}


def test_gcode_of_lines_and_modes(tmp_path):
    file = read(tmp_path, "%\nN1 g21 G90 (G91 X9)\nG0X0Y0Z5;X9\nG1 Z-0.5 F600\nx1.5y-.5\nG91\nX+1. Z.25\nM30\nX400\n")
    assert_allclose(file.corner * 1e3, np.array([[0, 0, 5], [0, 0, -0.5], [1.5, -0.5, -0.5], [2.5, -0.5, -0.25]]))
    assert file.line.tolist() == [3, 4, 5, 7]
    assert file.given.all()


@pytest.mark.parametrize(
    ("block", "centre", "radius", "swept"),
    [
        ("G3 X20 Y10 I0 J10", (10, 10), 10, np.pi / 2),
        ("G2 X20 Y10 I10 J0", (20, 0), 10, -np.pi / 2),
        ("G3 X20 Y10 R10", (10, 10), 10, np.pi / 2),
        ("G2 X20 Y10 R10", (20, 0), 10, -np.pi / 2),
        ("G3 X20 Y10 R-10", (20, 0), 10, 3 * np.pi / 2),
        ("G2 I5", (15, 0), 5, -2 * np.pi),
    ],
)
def test_arcs_have_their_centre_and_their_sense(tmp_path, block, centre, radius, swept):
    file = read(tmp_path, f"G0 X10 Y0 Z1\n{block} Z3\n")
    arc = file.corner * 1e3 - [*centre, 0]
    assert_allclose(np.hypot(arc[:, 0], arc[:, 1]), radius, atol=1e-9)
    angle = np.unwrap(np.arctan2(arc[:, 1], arc[:, 0]))
    assert angle[-1] - angle[0] == pytest.approx(swept)
    assert_allclose(arc[:, 2], 1 + 2 * (angle - angle[0]) / swept, atol=1e-9)
    step = np.abs(np.diff(angle)).max()
    assert radius * (1 - np.cos(step / 2)) <= SAG * 1.0001
    assert file.given.sum() == 2


def test_apt_goes_on_over_lines_and_ends_at_fini(tmp_path):
    text = "UNITS/MM $$ GOTO/9,9,9\nGOTO/1,2,$\n 3,0,0,1\nGODLTA/1,0,-.5D0\nFINI\nGOTO/400,0,0\n"
    file = read(tmp_path, text, "apt", shift=np.array([0.1, 0, 0]))
    assert_allclose(file.corner * 1e3, np.array([[101, 2, 3], [102, 2, 2.5]]))
    assert file.line.tolist() == [2, 4]


def test_godlta_counts_from_where_the_tool_stood(tmp_path):
    file = read(tmp_path, "FROM/10,20,30\nGODLTA/1,2,-3\nGOTO/0,0,0\n", "apt")
    assert_allclose(file.corner * 1e3, [[11, 22, 27], [0, 0, 0]])


def test_csv_by_the_names_of_its_columns(tmp_path):
    file = read(tmp_path, "# a remark\nstop,z_mm,y_mm,x_mm\n0,1,2,3\n\n1,4,5,6\n", "points", joined=False)
    assert_allclose(file.corner * 1e3, [[3, 2, 1], [6, 5, 4]])
    assert file.line.tolist() == [3, 5]


@pytest.mark.parametrize(
    ("text", "pattern", "words"),
    [
        ("G1 X1 Y1 Z1\nG68 X5\n", "gcode", "line 2: .* G68"),
        ("UNITS/INCHES\nGOTO/1,2,3\n", "apt", "line 1: .* UNITS/INCHES"),
    ],
)
def test_what_it_does_not_know_it_refuses(tmp_path, text, pattern, words):
    with pytest.raises(InputError, match=words):
        read(tmp_path, text, pattern)


SQUARE = "G0 X0 Y0 Z0\nG1 X100\nY80\nX0\nY0.5\nX90\nX0\n"


def flown(corner, step=1e-3):
    count = np.maximum(np.ceil(np.linalg.norm(np.diff(corner, axis=0), axis=1) / step), 1).astype(int)
    ways = zip(corner, corner[1:], count, strict=False)
    return np.vstack([*(np.linspace(a, b, n, endpoint=False) for a, b, n in ways), corner[-1:]])


def test_what_was_flown_as_it_is_told_is_no_distance_off(tmp_path):
    file = read(tmp_path, SQUARE)
    distance = distance_from_file(file, flown(file.corner))
    assert max(distance.off, distance.missed) < 1e-15


@pytest.mark.parametrize("size", [30e-6, 5e-3])
def test_a_detour_is_seen_with_its_size_and_line(tmp_path, size):
    file = read(tmp_path, SQUARE)
    place = flown(file.corner)
    place[130, 0] += size  # on the way up, line 3
    distance = distance_from_file(file, place)
    assert distance.off == pytest.approx(size, rel=1e-6)
    assert distance.off_line in (2, 3)
    assert distance.missed < 1e-6


def test_a_plunge_and_retract_are_walked_in_their_order(tmp_path):
    file = read(tmp_path, "G0 X0 Y0 Z5\nG1 X60\nZ-3\nZ5\nX0\nZ-3\nZ5\n")
    assert distance_from_file(file, flown(file.corner)).missed < 1e-15


def test_a_cut_corner_misses_its_place(tmp_path):
    file = read(tmp_path, SQUARE)
    corner = file.corner.copy()
    corner[1] -= [0.002, 0, 0]
    distance = distance_from_file(file, flown(corner))
    assert distance.missed_line == 2
    assert distance.missed == pytest.approx(0.002, rel=0.01)


def test_a_pass_left_out_is_not_taken_for_the_one_beside_it(tmp_path):
    file = read(tmp_path, SQUARE)
    distance = distance_from_file(file, flown(np.delete(file.corner, 5, axis=0)))  # to and fro at Y 0.5 is left out
    assert distance.missed > 0.08


def test_the_order_counts(tmp_path):
    file = read(tmp_path, "G0 X0 Y0 Z0\nG1 X100\nY80\nX0\nY0\n")
    distance = distance_from_file(file, flown(file.corner[::-1]))
    assert distance.off > 0.05


@pytest.mark.parametrize("radius", [0.3, 0.5, 1.0, 2.0])
def test_laps_of_a_small_circle_are_told_apart(tmp_path, radius):
    file = read(tmp_path, f"G0 X0 Y0 Z10\nG1 Z0\n{f'G2 I{radius} J0{chr(10)}' * 30}G0 Z10\n")
    turn = np.linspace(0, 60 * np.pi, 6001)
    circles = np.column_stack([radius * (1 - np.cos(turn)), radius * np.sin(turn), 0 * turn])
    down = np.column_stack([np.zeros((101, 2)), np.linspace(10, 0, 101)])
    flown = np.concatenate([down[:-1], circles, down[-2::-1]]) + np.random.default_rng(6).normal(0, 2e-4, (6201, 3))
    assert max(distance_from_file(file, flown / 1e3)[::2]) < 3e-6
    inside = (0.12 / radius) * (np.array([radius, 0, 0]) - flown) * [1, 1, 0]  # as far as a rounding may lead
    assert (
        max(distance_from_file(file, (flown + inside * (1 + np.sin(np.arange(6201) / 37))[:, None] / 2) / 1e3)[::2])
        < 2e-4
    )


def test_of_a_curve_only_the_places_count(tmp_path):
    file = read(tmp_path, "x_mm,y_mm,z_mm\n0,0,0\n100,0,0\n100,100,0\n", "points", joined=False)
    t = np.linspace(0, np.pi / 2, 400)
    first = flown(np.array([[0, 0, 0], [0.05, 0.02, 0], [0.1, 0, 0]]))
    second = 0.1 * np.column_stack([1 + 0.2 * np.sin(2 * t), t / t[-1], 0 * t])
    distance = distance_from_file(file, np.vstack([first, second]))
    assert distance.off == 0
    assert distance.missed < 1e-6


@pytest.mark.parametrize(
    ("text", "code", "dialect"),
    [
        ("// AXES = X, Y, Z (mm)\n{}", "utf-8",
         {"columns": {"x_mm": "#3", "y_mm": "#4", "z_mm": "#5"}, "row": "A, P{n}, {}, {}, {}, x"}),
        ("Nr;X [mm];Y [m];Z [inch]\n{}", "cp1252", {"row": "P{n};{};{};{}", "comma": True}),
        ("Gerät\tX\n\nName\tX\tY\tZ\n{}", "utf-16", {"unit": "m", "row": "P{n}\t{}\t{}\t{}"}),
    ],
)  # fmt: skip
def test_points_of_an_instrument_are_read_alike_by_both_readers(tmp_path, text, code, dialect):
    rng, row, comma = np.random.default_rng(4), dialect.pop("row"), dialect.pop("comma", False)
    values = rng.uniform(0.1, 5, (20, 3)).round(4)
    rows = "\n".join(row.format(*(repr(v) for v in xyz), n=n) for n, xyz in enumerate(values.tolist()))
    file = tmp_path / "given.txt"
    file.write_bytes(text.format(rows.replace(".", ",") if comma else rows).encode(code))
    table = PointsTable(pattern="points", file=file.name, **dialect)
    read = read_own_file(file, "points", np.zeros(3), points_table(file, table), joined=False)
    factor = np.array([1e-3, 1.0, 25.4e-3]) if comma else 1.0 if "unit" in dialect else 1e-3
    assert_allclose(read.corner, values * factor, rtol=1e-12)
    assert_allclose(read_points(file, table).position, read.corner, rtol=1e-12)
    assert read.line[0] == len(text.format("").split("\n"))


@pytest.mark.parametrize(
    ("head", "row", "end", "code"),
    [
        ("X [ft],Y [ft],Z [ft]", "{:.7f},{:.7f},{:.7f}", "\n", "utf-8"),
        ("Name,X [mm],Y [mm],Z [mm]", '"P, upper",{:.4f},{:.4f},{:.4f}', "\n", "utf-8"),
        ("X [mm],Y [mm],Z [mm]", '"{:,.4f}","{:,.4f}","{:,.4f}"', "\n", "utf-8"),
        ("X [mm];Y [mm];Z [mm]", "{:_.4f};{:_.4f};{:_.4f}", "\r\n", "utf-8"),
        ("X [mm];Y [mm];Z [mm]", "{:_.4f};{:_.4f};{:_.4f}", "\n", "cp1252"),
        ("X [mm];Y [mm];Z [mm]", "{:.4f};{:.4f};{:.4f}", "\r", "utf-8"),
        ("X [mm]\tY [mm]\tZ [mm]", "{:.4f}\t{:.4f}\t{:.4f}", "\n", "utf-16-le"),
        ("X Y Z", '"{:.4f}" {:.4f}   {:.4f}', "\n", "utf-8"),
    ],
)
def test_quotes_thousands_and_line_ends_are_read_alike_by_both_readers(tmp_path, head, row, end, code):
    values = np.random.default_rng(5).uniform(1000, 2000, (20, 3)).round(4)
    size = 304.8 if "ft" in head else 1.0
    rows = [row.format(*xyz).replace("_", "\N{NO-BREAK SPACE}") for xyz in values / size]
    file, table = (
        tmp_path / "given.txt",
        PointsTable(pattern="points", file="given.txt", unit="mm" if head == "X Y Z" else None),
    )
    file.write_bytes(end.join([head, *rows]).encode(code))
    read = read_own_file(file, "points", np.zeros(3), points_table(file, table), joined=False)
    assert_allclose(read.corner, values / 1e3, atol=1e-7)
    assert_allclose(read_points(file, table).position, read.corner, rtol=1e-12)


def test_rows_without_a_filled_cell_are_none_to_both_readers(tmp_path):
    file = read(tmp_path, "x_mm,y_mm,z_mm\n1,2,3\n,,\n , ,\n4,5,6\n", "points", joined=False)
    assert file.line.tolist() == [2, 5]
    assert_allclose(read_points(tmp_path / "own.txt").position, file.corner)


def test_points_that_the_first_reader_takes_for_others_are_seen(tmp_path):
    file = tmp_path / "given.txt"
    file.write_text("Name;X;Y;Z\nP1;1,5;2,5;3,5\nP2;2,5;2,5;3,5\n")
    table = points_table(file, PointsTable(pattern="points", file=file.name, unit="mm"))
    assert table is not None
    assert table.recorded is not None
    other = replace(table, recorded=table.recorded._replace(columns={**table.recorded.columns, "x_mm": (2, "mm")}))
    assert_allclose(read_own_file(file, "points", np.zeros(3), table, joined=False).corner[0], [1.5e-3, 2.5e-3, 3.5e-3])
    assert read_own_file(file, "points", np.zeros(3), other, joined=False).corner[0][0] == 2.5e-3
