"""Files of points: what is read, and one line with file, line and mend for what is not."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError
from compgen.core.recorded.layout import DialectTable
from compgen.planning.own_points.apt import read_apt
from compgen.planning.own_points.csv_points import read_points
from compgen.planning.own_points.gcode import read_gcode
from compgen.planning.own_points.given_points import check_points
from compgen.verification.own_file.second_reading import read_own_file

HEAD = "x_mm,y_mm,z_mm"


def written(folder, text, name="given.txt"):
    file = folder / name
    file.write_text(text)
    return file


def test_csv_with_everything(tmp_path):
    text = f"{HEAD},i,j,k,feed_mm_s,contact,stop\n1,2,3,0,0,1,,1,0\n# a remark\n2,2,3,0,0.6,0.8,50,0,1\n"
    points = read_points(written(tmp_path, text))
    assert_allclose(points.position, [[0.001, 0.002, 0.003], [0.002, 0.002, 0.003]])
    assert points.normal is not None
    assert_allclose(points.normal, np.array([[0, 0, 1], [0, 0.6, 0.8]]))
    assert np.isnan(points.feed[0])
    assert points.feed[1] == pytest.approx(0.05)
    assert points.contact.tolist() == [True, False]
    assert points.stop.tolist() == [False, True]
    assert points.line.tolist() == [2, 4]


def test_a_row_that_repeats_the_one_before_is_the_same_point(tmp_path):
    """A file of two curves that meet was refused, and the mend was to take out hundreds of rows by hand."""
    rows = ["1,2,3,0,0,1,1,0", "2,2,3,0,0,1,1,0", "2,2,3,0,0,1,0,1", "2,2,3,0,0,1,1,0", "3,2,3,0,0,1,0,0"]
    points = read_points(written(tmp_path, "\n".join([f"{HEAD},i,j,k,contact,stop", *rows, ""])))
    assert_allclose(points.position[:, 0], [0.001, 0.002, 0.003])
    assert points.line.tolist() == [2, 3, 6]
    assert points.contact.tolist() == [True, True, False]
    assert points.stop.tolist() == [False, True, False]
    turned = read_points(written(tmp_path, f"{HEAD},w_deg,p_deg,r_deg\n1,2,3,0,0,0\n1,2,3,0,1,0\n2,2,3,0,1,0\n"))
    with pytest.raises(InputError, match="line 3: the same place as line 2"):
        check_points(turned, 0.1)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (f"{HEAD}\n1,2\n", "line 2: 2 cells"),
        (f"{HEAD}\n1,2,nan\n", "line 2, column z_mm: 'nan' is not a finite number"),
        (f"{HEAD}\n1,2,\n", "line 2, column z_mm: empty"),
        ("x,y,z\n1,2,3\n", "line 1, column 1 'x': names no unit; say unit = \"mm\""),
        (
            "East;North;Up\n1,5;2;3\n",
            'columns x_mm, y_mm, z_mm: missing; say columns = { x_mm = "its name here", ',
        ),
        (f"{HEAD},i,j\n1,2,3,0,0\n", "column k: missing"),
        (f"{HEAD},i,j,k,w_deg,p_deg,r_deg\n1,2,3,0,0,1,0,0,0\n", "both say how the tool stands"),
        (f"{HEAD},i,j,k\n1,2,3,0,0,1\n1,2,4,0,0,2\n", "line 3: the normal i, j, k has length 2, not 1"),
        (f"{HEAD},feed_mm_s\n1,2,3,0\n", "line 2, column feed_mm_s: 0 mm/s is outside 0.05 to 2000"),
        (f"{HEAD},contact\n1,2,3,2\n", "line 2, column contact: 2 is neither 0 nor 1"),
        (f"{HEAD}\n1,2,20000\n", "beyond 10000"),
        ("X [mm],Y [mm],Z [mm],Qw,Qx,Qy,Qz\n1,2,3,0,1,0,0\n", "columns Qw, Qx, Qy, Qz may say how the tool stands"),
        (
            "X [mm],Y [mm],Z [mm],F\n1,2,3,900\n",
            r'column F may be the feed.* feed_mm_s = "F" } in .path., or feed_mm_min,',
        ),
        (
            "X [mm],Y [mm],Z [mm],i,j,k,Speed [m/min]\n1,2,3,0,0,1,9\n",
            r'column Speed .m/min. may be the feed.* feed = "Speed .m/min." } in .path. or take',
        ),
        ("X [mm];Y [mm];Z [mm];A [deg];B [deg];C [deg]\n1;2;3;0;9;180\n", "B .deg., C .deg. may say how the tool"),
    ],
)
def test_bad_csv(tmp_path, text, words):
    with pytest.raises(InputError, match=words) as refusal:
        read_points(written(tmp_path, text))
    assert "given.txt" in str(refusal.value)
    assert len(str(refusal.value)) < 300 + len(str(tmp_path))


def test_the_feed_of_another_writer_is_the_column_that_the_path_file_names_and_a_spindles_speed_is_none(tmp_path):
    text = "X [mm],Y [mm],Z [mm],{},Spindle Speed [1/min]\n1,2,3,9,9000\n2,2,3,6,9000\n"
    for name, key, factor in (("F", "feed_mm_min", 60), ("F", "feed_mm_s", 1), ("Speed [m/min]", "feed", 0.06)):
        named = DialectTable(columns={key: name})
        points = read_points(written(tmp_path, text.format(name)), named)
        assert_allclose(points.feed, np.array([0.009, 0.006]) / factor)


def test_normals_of_another_writer_are_those_that_the_path_file_names_and_offsets_are_none(tmp_path):
    text = "X [mm],Y [mm],Z [mm],Nx,Ny,Nz,dX [mm],dY [mm],dZ [mm]\n1,2,3,0,0.6,0.8,9,9,9\n2,2,3,0,0,1,9,9,9\n"
    named = DialectTable(columns={"i": "Nx", "j": "Ny", "k": "Nz"})
    normal = read_points(written(tmp_path, text), named).normal
    assert normal is not None
    assert_allclose(normal, np.array([[0, 0.6, 0.8], [0, 0, 1]]))
    with pytest.raises(InputError, match="Nx, Ny, Nz may say how the tool stands"):
        read_points(written(tmp_path, text))
    for names in (
        "Normal.X,Normal.Y,Normal.Z",
        "Vec I,Vec J,Vec K",
        "Norm_X,Norm_Y,Norm_Z",
        "Quat X,Quat Y,Quat Z",
        "n_x,n_y,n_z",
        "NormalX,NormalY,NormalZ",
        "Tool Axis X,Tool Axis Y,Tool Axis Z",
    ):
        with pytest.raises(InputError, match=f"{names.split(',')[0]}, .* may say how the tool stands"):
            read_points(written(tmp_path, text.replace("Nx,Ny,Nz", names)))
    offsets = "X [mm],Y [mm],Z [mm],dX [mm],dY [mm],dZ [mm]\n1,2,3,9,9,9\n2,2,3,9,9,9\n"
    assert read_points(written(tmp_path, offsets)).normal is None


@pytest.mark.parametrize("name", ["feed [m/min]", "Feed [in/min]", "FEED (ipm)"])
def test_feeds_are_read_in_the_units_of_machines(tmp_path, name):
    cell = 1.8 if "[m/" in name else 1800 / 25.4
    text = f"X [mm],Y [mm],Z [mm],{name}\n1,2,3,{cell}\n2,2,3,{cell}\n"
    assert_allclose(read_points(written(tmp_path, text)).feed, 0.03, rtol=1e-8)


@pytest.mark.parametrize("first", ["1", "P1"])
@pytest.mark.parametrize(
    "behind", ["Mean,1.5,2,3\nStd. Dev.,0.5,0,0\n", "MITTELWERT,2,2,3\n", "max,2,2,3\nMin,1,2,3\n"]
)
def test_statistics_behind_the_points_are_no_points(tmp_path, first, behind):
    """The tool was driven there."""
    points = f"No.,X [mm],Y [mm],Z [mm]\n{first},1,2,3\n{first}2,2,2,3\n"
    assert read_points(written(tmp_path, points + behind)).line.tolist() == [2, 3]


def test_a_word_of_statistics_that_all_points_have_is_a_name(tmp_path):
    points = "Name,X [mm],Y [mm],Z [mm]\nmax,1,2,3\nmax,2,2,3\n"
    assert read_points(written(tmp_path, points)).line.tolist() == [2, 3]


APT = """PARTNO/DISH, 400.0
UNITS/MM
MULTAX/ON
$$ a remark
LOADTL/1
FROM/0.,0.,500.
RAPID
GOTO/  10.0,   0.0, 50.0, 0.,0.,1.
FEDRAT/600.0,MMPM
GOTO/10.0,0.0,0.5,$
 0.0,0.6,0.8
GOTO/ 12.5D0,1.,.5
GODLTA/1.0,0,-.25
STOP
FINI
"""


def test_apt(tmp_path):
    points = read_apt(written(tmp_path, APT))
    assert_allclose(points.position * 1e3, np.array([[10, 0, 50], [10, 0, 0.5], [12.5, 1, 0.5], [13.5, 1, 0.25]]))
    assert points.normal is not None
    assert_allclose(points.normal, np.array([[0, 0, 1], *[[0, 0.6, 0.8]] * 3]))
    assert points.contact.tolist() == [False, True, True, True]
    assert_allclose(points.feed, [np.nan, 0.01, 0.01, 0.01])
    assert points.stop.tolist() == [False, False, False, True]
    assert points.line.tolist() == [8, 10, 12, 13]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("UNITS/INCHES\n", "line 1: UNITS/INCHES: points are read in mm"),
        ("GOTO/1,2\n", "line 1: GOTO with 2 numbers"),
        ("GOTO/1,2,x\n", "line 1: 'X' is no number"),
        ("GOTO/1,2,3\nCIRCLE/0,0,0,0,0,1,5\n", "line 2: CIRCLE: circles are not read"),
        ("GOTO/1,2,3\nGOTO/1,2,4,0,0,1\n", "line 2: i, j, k here and not at the first point"),
        ("GOTO/1,2,3,0,0,2\n", "has length 2, not 1"),
        ("FEDRAT/10,IPM\n", "FEDRAT in IPM"),
        ("FEDRAT/50,MMPS\n", "FEDRAT in MMPS: feeds are read in mm/min"),
        ("FEDRAT/IPM\n", "FEDRAT in IPM"),
        ("FEDRAT/0\n", "a feed of 0 mm/min is outside"),
        ("GODLTA/1,2,3\n", "GODLTA before any GOTO"),
        ("GOTO/1,2,3 $\n", "which goes on in a line that is not there"),
        ("CUTCOM/LEFT\n", "cutter compensation is not read"),
    ],
)
def test_bad_apt(tmp_path, text, words):
    with pytest.raises(InputError, match=words):
        read_apt(written(tmp_path, text))


GCODE = """%
O1234 (DISH)
N10 G21 G17 G90 G94 G54
G0 X0 Y0
Z5.
G1 Z0 F600
X10 ; a line
G3 X20 Y10 I0 J10
N20 G2 X30 Y20 R10.
G91
G1 X1.5 Y-.5
G4 P500
M30
"""


def test_gcode(tmp_path):
    read = read_gcode(written(tmp_path, GCODE))
    assert read.arcs is not None
    assert_allclose(np.degrees(read.arcs.swept), [0, 0, 0, 90, -90, 0], atol=1e-9)
    assert_allclose(read.arcs.centre[3:5] * 1e3, [[10, 10], [30, 10]])
    points = read.as_points()
    p = points.position * 1e3
    assert_allclose(p[:3], [[0, 0, 5], [0, 0, 0], [10, 0, 0]])
    assert points.contact[:3].tolist() == [False, True, True]
    assert_allclose(p[-1], [31.5, 19.5, 0])
    assert points.stop[-1]
    assert_allclose(points.feed[1:], 0.01)
    first, second = (points.line == n for n in (8, 9))
    assert_allclose(np.linalg.norm(p[first][:, :2] - [10, 10], axis=1), 10, atol=1e-9)
    assert_allclose(np.linalg.norm(p[second][:, :2] - [30, 10], axis=1), 10, atol=1e-9)
    assert_allclose(p[first][-1], [20, 10, 0], atol=1e-12)
    assert first.sum() >= 16
    steps = np.diff(np.arctan2(p[first][:, 1] - 10, p[first][:, 0] - 10))
    assert (steps > 0).all()


def test_a_full_turn_and_the_long_way_round(tmp_path):
    points = read_gcode(written(tmp_path, "G0 X10 Y0 Z0\nG2 I-10 Z-4 F600\nG3 X0 Y10 R-10\n")).as_points()
    p = points.position * 1e3
    turn = points.line == 2
    assert_allclose(np.linalg.norm(p[turn][:, :2], axis=1), 10, atol=1e-9)
    assert p[turn][-1].tolist() == [10, 0, -4]
    swept = np.unwrap(np.arctan2(p[turn][:, 1], p[turn][:, 0]))
    assert (np.diff(swept) < 0).all()
    assert_allclose(np.diff(p[turn][:, 2]), np.diff(p[turn][:, 2])[0], atol=1e-9)
    long = p[points.line == 3]
    assert_allclose(np.linalg.norm(long[:, :2] - [10, 10], axis=1), 10, atol=1e-9)
    length = np.linalg.norm(np.diff(long, axis=0), axis=1).sum()
    assert length > 1.4 * np.pi * 10


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("G20\n", "line 1: G20: points are read in mm"),
        ("G70\n", "line 1: G70: an older word for inches"),
        ("G68 R45\n", "G68: not read: write the moves themselves, .*; remove it only if it changes nothing"),
        ("G18\n", "arcs in the ZX plane"),
        ("G0 X1 Y1 Z1\n#100=5\n", "line 2: macros are not read"),
        ("G65 P9000\n", "macros are not read"),
        ("G0 X1 Y1 Z1 A90\n", "rotary or second axis A"),
        ("G41 D1\n", "cutter compensation"),
        ("G81 X1\n", "G81: cycles are not read"),
        ("X1 Y1\n", "a place without G0, G1, G2 or G3"),
        ("G1 X1 Y1 F100\n", "Z is not known yet"),
        ("G0 X0 Y0 Z0\nG2 X10 F100\n", "an arc without I, J or R"),
        ("G0 X0 Y0 Z0\nG2 X10 I3 F100\n", "the arc's ends are 3.000 and 7.000 mm from its centre"),
        ("G0 X0 Y0 Z0\nG2 X10 R4 F100\n", "makes no arc"),
        ("G0 X0 Y0 Z0\nG3 X10 K5 F100\n", "K belongs to arcs in other planes"),
        ("G0 X0 Y0 Z0\n/G1 X1\n", "a block that may be skipped"),
        ("M98 P1\n", "sub-programs are not read"),
        ("G0 X0 Y0 Z0 ?\n", "not words of a letter and a number"),
        ("G0 X0 Y0 Z0\nG1 X1 X2 F100\n", "line 2: X stands twice in a block; keep one"),
        ("G0 X0 Y0 Z0\nG1 X1e5 F100\n", "line 2: E is no word that is read; write plain numbers"),
        ("G1 F0\n", "a feed of 0 mm/min is outside"),
        ("G0 X0 Y0 Z99999\n", "beyond 10000 mm"),
    ],
)
def test_bad_gcode(tmp_path, text, words):
    with pytest.raises(InputError, match=words):
        read_gcode(written(tmp_path, text))


def test_a_remark_about_an_inch_of_something_else_is_a_remark(tmp_path):
    """A tool is called by its inches in files of millimetres."""
    remarks = "(TOOL 3: 1/2 INCH BALL)\n(NO INCHES HERE, MILLIMETRES)\n; inch per minute is not used\n"
    assert len(read_gcode(written(tmp_path, f"{remarks}{START}")).position) == 3


@pytest.mark.parametrize("reader", [read_points, read_apt, read_gcode])
def test_files_that_are_none(tmp_path, reader):
    (tmp_path / "zero").write_bytes(b"GOTO/1\0")
    for name in ("missing", ".", "zero"):
        with pytest.raises(InputError):
            reader(tmp_path / name)


START = "G21 G90\nG0 X0 Y0 Z5\nG1 Z0 F600\nX10\n"


@pytest.mark.parametrize(
    ("block", "words"),
    [
        ("G55\nX20", "line 5: G55: another work offset in mid-file"),
        ("G2 X10 Y0 I5 J0 P3", "P3 is read with G4 alone"),
        ("G2 X20 Y0 R5 I5", "R and a centre"),
        ("G1 X20 R2", "R with G1: a corner's radius"),
        ("G1 X20 I2", "I with G1"),
        ("G1 X20 L3", "L with G1: repeats"),
        ("G0 G1 X20", "G0 and G1 in one block"),
        ("G90 G91 X20", "G90 and G91 in one block"),
        ("G4 Y20", "G4 waits, and the block says more"),
        ("G4 X3 P1", "G4 waits, and the block says more"),
        ("O2", "O2: a second program"),
        ("M6 T2\nX20", "M6: another tool in mid-file"),
        ("M99", "sub-programs"),
        ("G54 P2\nX20", "P2 is read with G4 alone"),
        ("G90.1", "not read"),
        ("(UNITS: INCHES)", "line 6: a remark says inches"),
        ("G0 Z5 ( Program is in INCH )", "line 6: a remark says inches"),
        ("; inches", "line 6: a remark says inches"),
    ],
)
def test_what_would_move_the_tool_otherwise_is_refused(tmp_path, block, words):
    file = written(tmp_path, f"O1\n{START}{block}\n")
    with pytest.raises(InputError, match=words.replace("line 5", "line 6")) as refusal:
        read_gcode(file)
    assert "given.txt: line " in str(refusal.value)


@pytest.mark.parametrize("end", ["M2", "M30", "M02", "%"])
def test_words_behind_the_end_are_not_driven_and_said(tmp_path, end):
    points = read_gcode(written(tmp_path, f"%\n{START}{end}\n(a remark)\nG1 X400 Z-40\nG55\n"))
    assert points.position.max() == pytest.approx(0.01)
    assert points.notes == (
        f"{end.replace('M02', 'M2')} in line 6 ends the program: lines 8 to 9 behind it are not driven",
    )
    assert read_gcode(written(tmp_path, f"%\n{START}M30\n%\n")).notes == ()


def test_a_stop_in_a_block_with_a_move_comes_behind_it(tmp_path):
    points = read_gcode(written(tmp_path, START + "X20 M0\nX30 M30\n"))
    assert_allclose(points.position[-2:, 0], [0.02, 0.03])
    assert points.stop.tolist() == [False, False, False, True, False]


@pytest.mark.parametrize(
    "g", [*range(100), *(n + d / 10 for n in (5, 43, 54, 59, 61, 90, 91, 92) for d in range(1, 6))]
)
def test_every_g_code_is_read_refused_or_moves_nothing(tmp_path, g):
    """Codes that change where words lead are refused; whatever is taken leaves the next place where its words say."""
    text = f"{START}G{g:g} X12 Y0\nG1 X20 Y3\n"
    moves = {0, 1, 17, 21, 40, 43, 49, 54, 61, 64, 80, 90, 91, 91.1, 94, 98, 99}
    if g not in moves:
        with pytest.raises(InputError, match="line 5"):
            read_gcode(written(tmp_path, text))
        return
    points = read_gcode(written(tmp_path, text))
    assert_allclose(points.position[-1, :2] * 1e3, [20, 3] if g != 91 else [42, 3])


APT_START = "UNITS/MM\nGOTO/0,0,0,0,0,1\nGOTO/100,0,0,0,0,1\n"
#: major words of ISO 4343 and of what CAM systems write, beside those of motions that are read
APT_WORDS = """
AIR ARC ARCSLP ARM ASLOPE AUTOPS AUXFUN BCD BREAK CALL CAMERA CHUCK CIRCLE CLAMP CLDIST CLEARP CLRSRF CONE COOLNT
COPY COUPLE CUT CUTCOM CUTTER CYCLE CYLNDR DASH DELETE DISPLY DNTCUT DRAFT DRESS ELLIPS FEEDRATE GCONIC GO GOBACK
GODOWN GOFWD GOHOME GOLFT GORGT GOUP HEAD HYPERB INCLUD INDEX INDIRP INDIRV INSERT INTCOD INTOL LCONIC LEADER LETTER
LINE LINTOL LOADTL LOFT LOOPND LOOPST MACHIN MACRO MATRIX MCHFIN MCHTOL MIRROR MODE MOVARC MSYS NEUTRL NOPOST NURBS
OFFSET OFSTNO OPSKIP ORIGIN OUTTOL OVPLOT PARAB PATERN PENDWN PENUP PITCH PIVOTZ PLANE PLABEL PLUNGE POCKET POD
POINT POLYGN POSTN PREFUN PSIS QADRIC RATTLE REFSYS RESERV RESET RETRCT REVERS REWIND ROTABL ROTATE ROTHED SADDLE
SAFPOS SCALE SELCTL SELECT SEQNO SPHERE SPINDL SPLINE SPMIL SRFVCT SYN TABCYL TABPRT TERMAC THICK THREAD TLAXIS
TLLFT TLON TLRGT TMARK TOLER TOOLNO TRACUT TRANS TRANTO TURRET VECTOR VTLAXS WEIGHT ZSURF
"""
QUIET = """
AIR AUXFUN CLAMP CLDIST CLEARP COOLNT CUTTER DISPLY HEAD INTOL LEADER LINTOL MACHIN OPSKIP OUTTOL PLABEL
REWIND SELCTL SEQNO SPINDL SYN TMARK TOLER TOOLNO
"""


@pytest.mark.parametrize("word", APT_WORDS.split())
def test_every_apt_word_is_read_refused_or_known_to_move_nothing(tmp_path, word):
    file = written(tmp_path, f"{APT_START}{word}/10,20,30\nGOTO/50,60,0\n")
    if word in QUIET.split():
        assert_allclose(read_apt(file).position[-1] * 1e3, [50, 60, 0])
    else:
        with pytest.raises(InputError, match=f"line 4: {word}"):
            read_apt(file)


@pytest.mark.parametrize(
    "word", ["CUTCOM/OFF", "CYCLE/OFF", "TRACUT/NOMORE", "REFSYS/NOMORE", "MODE/ABSOL", "SELECT/TOOL,3"]
)
def test_apt_words_that_only_end_something_are_taken(tmp_path, word):
    assert len(read_apt(written(tmp_path, f"{APT_START}{word}\nGOTO/50,60,0\n")).position) == 3


@pytest.mark.parametrize("end", ["FINI", "END"])
def test_goto_behind_the_end_is_not_driven_and_said(tmp_path, end):
    points = read_apt(written(tmp_path, f"{APT_START}{end}\nGOTO/400,300,0\nFINI\n"))
    assert len(points.position) == 2
    assert points.notes == (f"{end} in line 4 ends the program: line 5 behind it is not driven",)


def test_godlta_counts_from_where_the_tool_stood(tmp_path):
    points = read_apt(written(tmp_path, "FROM/10,20,30\nGODLTA/1,2,-3\nGOTO/0,0,0\n"))
    assert_allclose(points.position * 1e3, [[11, 22, 27], [0, 0, 0]])


def test_the_axis_of_where_the_machine_stood_holds_until_another_one(tmp_path):
    points = read_apt(written(tmp_path, "FROM/0,0,9,0.6,0,0.8\nGOTO/0,0,0\nGOTO/1,0,0,0,0,1\n"))
    assert points.normal is not None
    assert_allclose(points.normal, np.array([[0.6, 0.0, 0.8], [0.0, 0.0, 1.0]]))
    for others in ("0,0,1", "0,0,0", "FEDRAT,200,MMPM"):  # upright, what posts write for none, and other words
        text = f"FROM/0,0,9,{others}\nGOTO/0,0,0\nGOTO/1,0,0\n"
        assert read_apt(written(tmp_path, text)).normal is None
    twice = "FROM/0,0,9,1,0,0\nFROM/0,0,9,0,0,1\nGOTO/0,0,0\nGOTO/1,0,0\n"
    assert read_apt(written(tmp_path, twice)).normal is None


def test_a_machine_that_stands_elsewhere_in_mid_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="line 4: FROM after a point"):
        read_apt(written(tmp_path, f"{APT_START}FROM/40,40,40\nGOTO/50,60,0\n"))


def test_a_tool_that_turns_where_it_stands_is_refused(tmp_path):
    with pytest.raises(InputError, match="line 4: the tool turns where it stands"):
        read_apt(written(tmp_path, f"{APT_START}GOTO/100,0,0,0,0.6,0.8\n"))


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_a_remark_in_any_language_is_no_statement(tmp_path, ending, mark):
    """As Latin letters the second byte of х and Å ends a line; a byte order mark is no word."""
    file = tmp_path / "given.txt"
    moves = "G1 X0 Y0 Z0;вверх X9\nG1 X5 ; til KÅ Y9\nY7\n"
    file.write_bytes((mark + moves).replace("\n", ending).encode())
    points = read_gcode(file)
    assert_allclose(points.position * 1e3, [[0, 0, 0], [5, 0, 0], [5, 7, 0]])
    assert points.line.tolist() == [1, 2, 3]
    assert_allclose(read_own_file(file, "gcode", np.zeros(3), joined=True).corner, points.position)


def test_text_that_ends_with_a_dollar_swallows_no_point(tmp_path):
    file = written(tmp_path, "PPRINT/COST 5 $\nGOTO/0,0,0\nGOTO/1,2,$\n3\n$$ х GOTO/9,9,9\nGOTO/4,5,6\nFINI\n")
    points = read_apt(file)
    assert_allclose(points.position * 1e3, [[0, 0, 0], [1, 2, 3], [4, 5, 6]])
    assert_allclose(read_own_file(file, "apt", np.zeros(3), joined=True).corner, points.position)
