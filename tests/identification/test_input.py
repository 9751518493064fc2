"""What measurements are refused, each with one line that names file, line or column, and the mend."""

import numpy as np
import pytest
from synthetic import random_theta

from compgen.core.exceptions import InputError
from compgen.core.units import DEG, MM
from compgen.identification.axis_tests import read_lines
from compgen.identification.measurements import concatenate
from compgen.identification.model import build_model
from compgen.identification.plausibility import check_plausible, check_row_count
from compgen.identification.pose_files import read_poses
from compgen.identification.warm_up import with_temperatures
from compgen.pipelines.robot_file import load_any_robot
from compgen.robot.kinematics import flange_pose

HEAD = "order,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm"


@pytest.fixture(scope="module")
def arm():
    return load_any_robot("m710ic50")


@pytest.fixture(scope="module")
def rows(arm):
    """Twelve poses of two reflectors, exact, in World."""
    theta = random_theta(arm, np.random.default_rng(5), 12)
    position, rotation = flange_pose(arm, theta)
    table = []
    for n, pendant in enumerate(arm.to_pendant(theta) / DEG):
        for name, place in (("a", [0.06, 0, 0.1]), ("b", [-0.04, 0.05, 0.12])):
            p = (position[n] + rotation[n] @ place) / MM
            table.append([str(n), name, *(f"{v:.6f}" for v in pendant), *(f"{v:.4f}" for v in p)])
    return table


def text(rows, head=HEAD):
    return "\n".join([head, *(",".join(r) for r in rows)]) + "\n"


def read(tmp_path, arm, content, name="poses.csv", **options):
    file = tmp_path / name
    file.write_text(content)
    data = read_poses(str(file), arm, 0, **options)
    check_row_count(data)
    check_plausible(arm, build_model(arm, [], 0), data)
    return data


def changed(rows, n, column, value):
    new = [list(r) for r in rows]
    new[n][HEAD.split(",").index(column)] = value
    return new


def scaled(rows, columns, factor):
    at = [HEAD.split(",").index(c) for c in columns]
    return [[f"{float(v) * factor:.8f}" if k in at else v for k, v in enumerate(r)] for r in rows]


XYZ = ("x_mm", "y_mm", "z_mm")
JOINTS = tuple(f"j{i}_deg" for i in range(1, 7))
BAD = {
    "far away": (lambda r: text(changed(r, 3, "y_mm", "1e308")), ("line 5, column y_mm", "is beyond 1e+08")),
    "nothing in it": (lambda r: "", ("empty",)),
    "no rows": (lambda r: HEAD + "\n", ("no rows",)),
    "column missing": (lambda r: text([x[:-1] for x in r], HEAD[: -len(",z_mm")]), ("column z_mm", "missing")),
    "column in metres": (lambda r: text(r, HEAD.replace("x_mm", "x_m")), ("x_mm", "missing", "is it 'x_m'")),
    "column unknown": (lambda r: text([[*x, "1"] for x in r], HEAD + ",colour"), ("column colour", "unknown")),
    "column twice": (lambda r: text([[*x, "1"] for x in r], HEAD + ",x_mm"), ("x_mm", "twice")),
    "semicolons": (lambda r: text(r).replace(",", ";"), ("semicolons",)),
    "short row": (lambda r: text([*r, ["99", "a", "1"]]), ("line 26", "3 cells")),
    "NaN": (lambda r: text(changed(r, 3, "y_mm", "nan")), ("line 5, column y_mm", "remove")),
    "empty cell": (lambda r: text(changed(r, 3, "y_mm", "")), ("line 5, column y_mm", "empty")),
    "word": (lambda r: text(changed(r, 0, "j2_deg", "12,5".replace(",", "x"))), ("line 2, column j2_deg", "12x5")),
    "duplicate": (lambda r: text([*r, r[4]]), ("line 26", "duplicate of line 6")),
    "same time": (lambda r: text(changed(r, 2, "order", "0")), ("line 4", "other joints at the time of line")),
    "beyond a limit": (
        lambda r: text(changed(changed(r, 0, "j5_deg", "126"), 1, "j5_deg", "126")),
        ("J5", "126", "125"),
    ),
    "seen once": (lambda r: text(changed(r, 0, "target", "lonely")), ("line 2", "lonely", "seen once")),
    "constant joint": (
        lambda r: text([[v if k != 5 else "12" for k, v in enumerate(x)] for x in r]),
        ("column j4_deg", "constant at 12", "--force"),
    ),
    "metres": (lambda r: text(scaled(r, XYZ, 1e-3)), ("metres instead of mm", "multiply them by 1000")),
    "micrometres": (lambda r: text(scaled(r, XYZ, 1e3)), ("um instead of mm", "multiply them by 0.001")),
    "radians": (lambda r: text(scaled(r, JOINTS, DEG)), ("radians", "57.29578")),
    "too few": (lambda r: text(r[:4]), ("12 measured numbers", "12 unknowns", "measure")),
    "wrong sign": (lambda r: text(scaled(r, ("j2_deg",), -1.0)), ("misses", "signs", "J3")),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_poses_are_refused_in_one_line(tmp_path, arm, rows, name):
    make, needles = BAD[name]
    with pytest.raises(InputError) as caught:
        read(tmp_path, arm, make(rows))
    message = str(caught.value)
    assert "\n" not in message
    assert "poses.csv" in message
    for needle in needles:
        assert needle in message, message


def test_good_poses_are_read(tmp_path, arm, rows):
    data = read(tmp_path, arm, text(rows))
    assert len(data.theta) == 12
    assert data.reflectors == ("a", "b")
    assert data.pose.tolist() == np.repeat(np.arange(12), 2).tolist()


def test_mixed_instruments_are_refused_in_a_file_and_welcome_in_two(tmp_path, arm, rows):
    mixed = [[*r, "tracker" if k < 10 else "camera"] for k, r in enumerate(rows)]
    with pytest.raises(InputError, match=r"line 12, column instrument: 'camera' after 'tracker'.*own file"):
        read(tmp_path, arm, text(mixed, HEAD + ",instrument"))
    one = read(tmp_path, arm, text(rows[:12]), "one.csv")
    two = read(tmp_path, arm, text(rows[12:]), "two.csv")
    both = concatenate([one, two])
    assert len(both.instruments) == 2
    assert both.reflectors == ("a", "b")


def test_a_joint_that_stands_still_is_held_when_forced(tmp_path, arm, rows):
    still = [[v if k != 5 else "12" for k, v in enumerate(x)] for x in rows]
    file = tmp_path / "still.csv"
    file.write_text(text(still))
    assert len(read_poses(str(file), arm, 0, force=True).theta) == 12


def test_directions_come_from_the_pose_before_and_are_unknown_across_a_gap(tmp_path, arm, rows):
    data = read(tmp_path, arm, text(rows))
    assert (data.direction[0] == 0).all()
    assert np.array_equal(data.direction[1:], np.sign(np.diff(data.theta, axis=0)))
    late = [[str(int(r[0]) + (10 if k >= 12 else 0)), *r[1:]] for k, r in enumerate(rows)]
    gap = read(tmp_path, arm, text(late))
    assert (gap.direction[6] == 0).all()


def test_lines_need_both_senses_and_a_deviation(tmp_path, arm):
    file = tmp_path / "lines.csv"
    file.write_text("direction,x_mm,y_mm,z_mm\n1,1200,0,0\n")
    with pytest.raises(InputError, match="column dx_um: missing"):
        read_lines(str(file), arm, 5)
    file.write_text("direction,x_mm,y_mm,z_mm,dx_um\n2,1200,0,0,5\n")
    with pytest.raises(InputError, match=r"line 2, column direction: 2 must be 1 or -1"):
        read_lines(str(file), arm, 5)
    body = "".join(f"{d},{x},0,0,{x / 100}\n" for d in (1, -1) for x in (1100, 1200, 1300, 1400))
    file.write_text("direction,x_mm,y_mm,z_mm,dx_um\n" + body)
    data = read_lines(str(file), arm, 5)
    assert data.aligned.all()
    assert np.isnan(data.position[:, 1:]).all()
    assert np.array_equal(data.direction[:4], -data.direction[4:])
    assert (data.direction[:, 1] != 0).all()


def test_three_stations_of_a_line_are_enough_to_see_a_joint_turn_back(tmp_path, arm):
    """J2 rises and falls along the line, by a parabola; the way back has the opposite signs, the rest stands."""
    file = tmp_path / "lines.csv"
    stations = [(1100, 0), (1200, 10), (1300, 4)]
    body = "".join(f"{d},{x},0,0,5,0,{j2},0,0,-90,0\n" for d in (1, -1) for x, j2 in stations)
    file.write_text("direction,x_mm,y_mm,z_mm,dx_um,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\n" + body)
    data = read_lines(str(file), arm, 5)
    assert data.direction[:, 1].tolist() == [1, 1, -1, -1, -1, 1]
    assert not data.direction[:, [0, 3, 4, 5]].any()


def test_lines_of_an_arm_without_closed_form_need_joints(tmp_path):
    file = tmp_path / "lines.csv"
    file.write_text("direction,x_mm,y_mm,z_mm,dx_um\n1,500,0,0,5\n")
    with pytest.raises(InputError, match="need their joints"):
        read_lines(str(file), load_any_robot("ur5"), 0)


def test_temperatures_must_cover_the_poses(tmp_path, arm, rows):
    data = read(tmp_path, arm, text(rows))
    log = tmp_path / "log.csv"
    log.write_text("time_s,j2_degC\n0,20\n5,25\n")
    with pytest.raises(InputError, match="outside the log"):
        with_temperatures(data, str(log), ("j2",))
    log.write_text("time_s,j2_degC\n0,20\n22,31\n")
    warm = with_temperatures(data, str(log), ("j2",))
    assert np.allclose(warm.rise[:, 0], 0.5 * data.time)
