"""Artefacts with planes, places that the robot taught, and touches in another unit."""

import pytest

from compgen.core.exceptions import InputError
from compgen.identification.touches import read_artefact, read_touches
from compgen.pipelines.files.robot_file import load_any_robot

ARTEFACT = """
[artefact]
taught = { rise_K = { j2 = 1.5 } }
[[sphere]]
name = "a"
x_mm = 1200
y_mm = 100
z_mm = 200
[[plane]]
name = "table"
x_mm = 1200
y_mm = 0
z_mm = 100
normal = [0, 0, 1]
sigma_um = 5
[probe]
z_mm = 150
"""


def artefact(folder, text=ARTEFACT):
    file = folder / "artefact.toml"
    file.write_text(text)
    return read_artefact(str(file))


def touches(folder, *rows, planes=True):
    file = folder / "touches.csv"
    file.write_text("\n".join(["time_s,target,x_mm,y_mm,z_mm,w_deg,p_deg,r_deg", *rows]) + "\n")
    return read_touches(str(file), load_any_robot("m710ic50"), artefact(folder), {}, planes=planes)


def test_planes_come_after_the_spheres(tmp_path):
    known = artefact(tmp_path)
    assert known.targets == ("a", "table")
    assert known.point.tolist() == [[1.2, 0, 0.1]]
    assert known.taught == {"j2": 1.5}
    rows = touches(tmp_path, "0,table,1200,0,100,180,0,0", "1,a,1200,100,200,180,0,0")
    assert rows.target.tolist() == [1, 0]


def test_identification_is_told_that_a_plane_is_none_of_its_spheres(tmp_path):
    with pytest.raises(InputError, match=r"touches.csv: line 2, column target: 'table' is a plane"):
        touches(tmp_path, "0,table,1200,0,100,180,0,0", planes=False)


def test_joints_of_which_one_is_missing_are_not_left_out_in_silence(tmp_path):
    """Five columns of joints beside a pose were taken for no joints: the arm's posture was another."""
    file = tmp_path / "touches.csv"
    file.write_text(
        "Name;J1 [deg];J2 [deg];J3 [deg];J4 [deg];J5 [deg];X [mm];Y [mm];Z [mm];W [deg];P [deg];R [deg]\n"
        + "a;1;2;3;4;5;1200;100;200;180;0;0\na;1;2;3;4;5;1200;100;201;180;0;0\n"
    )
    with pytest.raises(InputError, match=r"touches.csv: column j6_deg: missing; give all of j1_deg to j6_deg or none"):
        read_touches(str(file), load_any_robot("m710ic50"), artefact(tmp_path), {})


DIRECTED = "Name;X [mm];Y [mm];Z [mm];W [deg];P [deg];R [deg];{};{};{}\na;1200;100;200;180;0;0;0;0;-1\n"


@pytest.mark.parametrize(
    "names", [("I", "J", "K"), ("MEAS_I", "MEAS_J", "MEAS_K"), ("Vector X", "Vector Y", "Vector Z")]
)
def test_a_direction_by_another_name_is_asked_for(tmp_path, names):
    """The centres were taken for the sphere's, and were off by its radius: all to one side where all touches were."""
    file = tmp_path / "touches.csv"
    file.write_text(DIRECTED.format(*names))
    (tmp_path / "artefact.toml").write_text(ARTEFACT.replace("z_mm = 200\n", "z_mm = 200\ndiameter_mm = 20\n", 1))
    known = read_artefact(str(tmp_path / "artefact.toml"))
    with pytest.raises(InputError) as refusal:
        read_touches(str(file), load_any_robot("m710ic50"), known, {})
    message = str(refusal.value).replace(str(tmp_path), "")
    assert len(message) <= 300
    assert "turn the signs" in message
    line = message[message.index("columns = {") : message.index("}") + 1]
    (tmp_path / "touches.csv.toml").write_text(line + "\n")
    assert read_touches(str(file), load_any_robot("m710ic50"), known, {}).normal.tolist() == [[0, 0, -1]]


@pytest.mark.parametrize(
    ("row", "unit"),
    [("0,a,1.2,0.1,0.2,180,0,0", "metres"), ("0,a,47.24,3.94,7.87,180,0,0", "inches")],
)
def test_touches_in_another_unit_are_named(tmp_path, row, unit):
    with pytest.raises(InputError, match=f"are {unit}, as the artefact's places say; give mm"):
        touches(tmp_path, row)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("normal = [0, 0, 1]", "normal = [0, 0, 0.5]", r"plane.0.normal: its length is 0.5, not 1"),
        ('name = "table"', 'name = "a"', "'a' stands twice"),
    ],
)
def test_a_wrong_plane_is_refused(tmp_path, old, new, words):
    with pytest.raises(InputError, match=words):
        artefact(tmp_path, ARTEFACT.replace(old, new))


def test_an_artefact_of_nothing_is_refused(tmp_path):
    with pytest.raises(InputError, match="say what was touched"):
        artefact(tmp_path, "[artefact]\n")


def test_turns_in_radians_are_named(tmp_path):
    upright, tilted = "0,a,1200,100,200,3.14159,0,0", "1,a,1200,100,200,-2.25073,0.42199,2.9379"
    with pytest.raises(InputError, match=r"w_deg, p_deg, r_deg: at most 3.142, .* they are radians; give W, P, R"):
        touches(tmp_path, upright, tilted)
    assert len(touches(tmp_path, "0,a,1200,100,200,180,0,0").target) == 1


def test_a_touch_that_stands_twice_is_refused_and_a_repeated_one_is_not(tmp_path):
    row = "7,a,1200,100,200,180,0,0"
    assert len(touches(tmp_path, row, row.replace("7", "8", 1)).target) == 2
    with pytest.raises(InputError, match="line 4: the same touch at the same time_s as in line 2; keep one"):
        touches(tmp_path, row, "9,a,1200,100,200,180,0,0", row)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("cte_um_m_K = 1.15e-5", "1.15e-05 is below 0.1: is it in 1/K"),
        ("cte_um_m_K = 0.0115", "0.0115 is below 0.1"),
        ("temperature_degC = 25", "cte_um_m_K: missing, so that temperature_degC moves nothing"),
    ],
)
def test_an_artefact_that_would_not_grow_is_refused(tmp_path, lines, words):
    """41 um on the path of a robot that touched a steel artefact at 25 degC."""
    with pytest.raises(InputError, match=f"artefact.toml: artefact.cte_um_m_K: .*{words}|{words}"):
        artefact(tmp_path, ARTEFACT.replace("[artefact]", f"[artefact]\n{lines}"))
    grown = artefact(tmp_path, ARTEFACT.replace("[artefact]", "[artefact]\ncte_um_m_K = 0\ntemperature_degC = 25"))
    assert grown.place.tolist() == [[1.2, 0.1, 0.2]]


def test_joints_beyond_their_limits_that_a_place_asks_for_are_said_to_be_of_the_place(tmp_path):
    """*The joints are those of the pendant* was all that was said of a file that has none."""
    with pytest.raises(InputError, match=r"line 2: by x_mm to r_deg and config: J5 at -\d+\.\d+ deg is outside"):
        touches(tmp_path, "0,a,1200,100,200,3.14,0,0", "1,a,1200,100,200,170,0,0")


def test_a_deflection_without_a_direction_in_its_row_is_refused(tmp_path):
    """The column stood there for other rows: 0.5 mm of a plane's touches were passed over, and *the base moved*."""
    rows = ("0,a,1200,100,200,180,0,0,0,0,-1,0", "1,table,1200,0,102.5,180,0,0,,,,0.5")
    file = tmp_path / "touches.csv"
    file.write_text("\n".join(["time_s,target,x_mm,y_mm,z_mm,w_deg,p_deg,r_deg,nx,ny,nz,value_mm", *rows, ""]))
    known = artefact(tmp_path, ARTEFACT.replace("z_mm = 200", "z_mm = 200\ndiameter_mm = 20"))
    with pytest.raises(InputError, match=r"line 3, column value_mm: 0\.5: a deflection has a direction; give nx"):
        read_touches(str(file), load_any_robot("m710ic50"), known, {}, planes=True)
    file.write_text(file.read_text().replace(",,,,0.5", ",,,,0").replace("102.5", "103"))
    assert read_touches(str(file), load_any_robot("m710ic50"), known, {}, planes=True).deflection.tolist() == [0, 0]
