"""Values that look like another unit's: a warning with what was probably meant, and none for what is shipped."""

import tomllib

import pytest
from command_line import refused, run
from ls_text import at, program
from shipped import ROOT

from compgen.core.finding_codes import Level
from compgen.core.other_units import lengths_in_other_units, values_in_other_units
from compgen.core.toml import override
from compgen.program.frames import load_frames

ROBOT = (ROOT / "robots/m710ic50.toml").read_text()
PATH = (ROOT / "paths/line_y.toml").read_text()


@pytest.mark.parametrize(
    ("text", "assignment", "meant"),
    [
        (PATH, "tool.z_mm=0.25", "did you mean 250? it looks like metres, the key is in mm"),
        (PATH, "tool={x_mm=-0.3,z_mm=0.01}", "tool.x_mm = -0.3: did you mean -300?"),
        (PATH, "tool.z_mm=8", "did you mean 203.2? it looks like inches, the key is in mm"),
        (PATH, "tool={length_mm=8.5,tilt_deg=30}", "did you mean 215.9? it looks like inches"),
        (
            PATH,
            "tool={z_mm=40,length_mm=0.22,tilt_deg=30}",
            "tool.length_mm = 0.22: did you mean 220? it looks like metres",
        ),
        (PATH, "tool={length_mm=220,tilt_deg=0.5236}", "did you mean 30? it looks like radians"),
        (PATH, "frame={x_mm=1000,r_deg=1.5708}", "did you mean 90? it looks like radians"),
        (PATH, "process.lead_deg=0.1396", "did you mean 7.998? it looks like radians"),
        (PATH, "path.angle_deg=1.5708", "did you mean 90? it looks like radians"),
        (PATH, "boundary={holes=[{diameter_mm=40},{size_mm=[0.16,0.11]}]}", "did you mean 160? it looks like metres"),
        (PATH, "boundary={holes=[{rotation_deg=0.5236}]}", "did you mean 30? it looks like radians"),
        (PATH, "boundary={corners_mm=[[-0.5,0],[0.5,0],[0,1.2]]}", "boundary.corners_mm.2.1 = 1.2: did you mean 1200?"),
        (PATH, "boundary={holes=[{corners_mm=[[0,0],[0.1,0],[0,0.1]]}]}", "did you mean 100? it looks like metres"),
        (PATH, "tool.w_deg=3.1416", "did you mean 180? it looks like radians, the key is in deg"),
        (PATH, "tool.spin_deg=-1.571", "did you mean -90"),
        (PATH, "path.length_mm=1.3", "did you mean 1300?"),
        (PATH, "path.x_mm=1.35", "path.x_mm = 1.35: did you mean 1350? it looks like metres, the key is in mm"),
        (PATH, "process.lift_mm=0.02", "did you mean 20?"),
        (PATH, "surface.radius_of_curvature_m=84000", "did you mean 84? it looks like mm, the key is in m"),
        (PATH, "surface={radius_of_curvature_m=84,off_axis_m=1400}", "surface.off_axis_m = 1400: did you mean 1.4?"),
        (PATH, "process.feed_mm_s=0.2", "did you mean 200? it looks like m/s, the key is in mm/s"),
        (PATH, "before.0.feed_mm_s=0.2", "before.0.feed_mm_s = 0.2: did you mean 200?"),
        (ROBOT, "thermal.cte_um_m_K=12e-6", "did you mean 12? it looks like 1/K, the key is in um/m/K"),
        (ROBOT, "thermal.cte_um_m_K=0.012", "did you mean 12? it looks like mm/m/K"),
        (ROBOT, "thermal.uncertainty.cte_um_m_K=[10e-6,15]", "did you mean 10? it looks like 1/K"),
        (ROBOT, "limits.j1_deg=[-3.14,3.15]", "limits.j1_deg.1 = 3.15: did you mean 180.5? it looks like radians"),
        (ROBOT, "limits.j2_plus_j3_deg=[-2.8,4.89]", "did you mean 280.2? it looks like radians"),
        (ROBOT, "dh.a_mm=[0.15,0.87,0.17,0,0,0]", "dh.a_mm.1 = 0.87: did you mean 870?"),
        (ROBOT, "dh.alpha_deg=[-90,180,-1.5708,90,-90,180]", "dh.alpha_deg.2 = -1.5708: did you mean -90?"),
        (
            ROBOT,
            "motion={moving_average_ms=[0.2,0.1]}",
            "moving_average_ms.0 = 0.2: did you mean 200?",
        ),
        (ROBOT, "sources.loads.payload_centre_mm=[0,0.02,0.15]", "did you mean 150? it looks like metres"),
        (
            ROBOT,
            "sources.compliance.compliance_urad_Nm=[0,3e-7,4e-7,8e-7,1e-6,0]",
            "did you mean 1? it looks like rad/(N m)",
        ),
        (ROBOT, "limits.speed_deg_s=[3,3,3,4.4,4.4,6.2]", "did you mean 355.2? it looks like rad/s"),
    ],
)
def test_what_looks_like_another_unit_is_asked_about(text, assignment, meant):
    data = tomllib.loads(text)
    assert values_in_other_units(data, "a.toml") == ()
    override(data, assignment, assignment)
    (finding,) = values_in_other_units(data, "a.toml")
    assert (finding.level, finding.code) == (Level.WARNING, "units.unlikely")
    assert finding.message.startswith(f"a.toml: {assignment.partition('=')[0].partition('{')[0]}")
    assert meant in finding.message


@pytest.mark.parametrize(
    "assignment",
    ["tool={x_mm=0.12,z_mm=250}", "tool={z_mm=0}", "tool={w_deg=3}", "tool={p_deg=0.02}", "process.feed_mm_s=1",
     "path.stepover_mm=0.5", "path.x_mm=0", "process.lean_deg=0.5", "boundary={holes=[{width_mm=0.8,length_mm=20}]}",
     "boundary={holes=[{diameter_mm=2.5,x_mm=0.5}]}", "frame={w_deg=0.26}", "process={lead_deg=1.05,lean_deg=0.2}",
     "boundary={corners_mm=[[-500,1],[500,0],[0,2]],holes=[{corners_mm=[[0.5,0.5],[30,0],[0,40]]}]}",
     "path={x_mm=2,y_mm=1200,z_mm=1}", "process.lift_mm=0"],
)  # fmt: skip
def test_small_values_that_are_meant_are_not(assignment):
    data = tomllib.loads(PATH)
    override(data, assignment, assignment)
    assert values_in_other_units(data, "a.toml") == ()


FRAMES = """\
[uframe.1]
x_mm = 1.2
y_mm = 0
z_mm = -0.3
w_deg = 0
p_deg = 0
r_deg = 1.5708
[utool.1]
x_mm = 0
y_mm = 0
z_mm = 250
w_deg = 0
p_deg = 0
r_deg = 90
"""


def test_frames_in_metres_and_radians_are_asked_about(tmp_path):
    source = tmp_path / "frames.toml"
    source.write_text(FRAMES)
    length, angle = (finding.message for finding in load_frames(str(source)).input_findings)
    assert "uframe.1.x_mm = 1.2: did you mean 1200?" in length
    assert "uframe.1.r_deg = 1.5708: did you mean 90?" in angle
    source.write_text(FRAMES.replace("x_mm = 1.2", "x_mm = 1200").replace("1.5708", "90"))
    assert load_frames(str(source)).input_findings == ()


def test_a_correction_reports_it(tmp_path):
    (tmp_path / "f.toml").write_text(FRAMES.replace("1.5708", "90"))
    (tmp_path / "T.LS").write_bytes(program(["J P[1] 10% FINE"], [at(1, (10, 20, -15, 30, -60, 45))]))
    frames = ("--frames", tmp_path / "f.toml")
    told = run("correct", tmp_path / "T.LS", "--robot", "m710ic50", *frames, "-o", tmp_path / "o")
    assert "uframe.1.x_mm = 1.2: did you mean 1200?" in " ".join(told.stdout.split())
    assert "units.unlikely" in (tmp_path / "o" / "report.json").read_text()


@pytest.mark.parametrize(
    ("option", "text"),
    [
        ("--reflector", "0.06 0 0.1"),
        ("--instrument", "2.5 0 1"),
        ("--instrument", "4 -12 0.5"),
        ("--box", "0.5 -1 -1 1.5 1 1"),
    ],
)
def test_lengths_of_options_in_metres_are_asked_about(option, text):
    lengths = [float(v) for v in text.split()]
    (finding,) = lengths_in_other_units(option, text, lengths)
    assert finding.message.startswith(f"{option} '{text}': did you mean '{1e3 * lengths[0]:g} ")
    assert lengths_in_other_units(option, text, [1e3 * v for v in lengths]) == ()


def test_poses_to_measure_report_it(tmp_path):
    told = run("plan-poses", "m710ic50", "-n", "12", "--reflector", "0.06 0 0.1", "-o", tmp_path)
    assert "--reflector '0.06 0 0.1': did you mean '60 0 100'?" in " ".join(told.stdout.split())


def test_what_the_robot_cannot_do_is_explained_by_it(tmp_path):
    result = run("predict", "paths/line_y.toml", "--set", "path.x_mm=1.35", "-q", "-o", tmp_path / "o")
    refused(result, 3, "waypoint", "path.x_mm = 1.35: did you mean 1350?")


def test_the_day_and_a_study_report_it(tmp_path):
    for command in (("heat",), ("whatif", "--ask", "contributions")):
        told = run(*command, "paths/line_y.toml", "--set", "tool.z_mm=0.25", "-o", tmp_path / command[0])
        assert "warning: " in told.stdout
        assert "tool.z_mm = 0.25: did you mean 250?" in told.stdout


def test_nothing_that_is_shipped_is_asked_about():
    files = [f for kind in ("paths", "robots") for f in (ROOT / kind).glob("*.toml")]
    assert len(files) > 10
    assert [values_in_other_units(tomllib.loads(f.read_text()), f.name) for f in files] == len(files) * [()]


def test_the_commands_report_it(tmp_path):
    """Of the path file's keys and of the robot file's."""
    sets = ["--set", "tool.z_mm=0.25", "--set", "robot.thermal.cte_um_m_K=12e-6"]
    told = run("predict", "paths/line_y.toml", *sets, "-o", tmp_path / "out")
    assert told.returncode == 0, told.stderr
    report = (tmp_path / "out" / "report.json").read_text()
    for place in (" ".join(told.stdout.split()), report):
        assert "tool.z_mm = 0.25: did you mean 250?" in place
        assert "thermal.cte_um_m_K = 1.2e-05: did you mean 12?" in place
