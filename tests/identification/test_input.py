"""What measurements are refused, each with one line that names file, line or column, and the mend."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from synthetic import random_theta

from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.units import DEG, MM
from compgen.identification.axis_tests import read_axis_tests
from compgen.identification.distances import read_distances
from compgen.identification.instrument_frames import initial_frames
from compgen.identification.measured_poses import read_poses
from compgen.identification.measurement_checks import check_copies, check_plausible, check_row_count
from compgen.identification.measurements import Measurements, concatenate, with_one_frame_a_name
from compgen.identification.model import build_model
from compgen.identification.touch_rows import touch_rows
from compgen.identification.touches import read_artefact, read_touches
from compgen.identification.warm_up import as_warm_up, read_log, with_temperatures
from compgen.pipelines.files.robot_file import load_any_robot, load_arm
from compgen.program.frames import default_frames
from compgen.robot.inverse_kinematics import Posture, solve_tool
from compgen.robot.kinematics import flange_pose

HEAD = "order,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm"


@pytest.fixture(scope="module")
def arm():
    return load_any_robot("m710ic50")


@pytest.fixture(scope="module")
def rows(arm):
    """Twelve poses of two reflectors, exact, in World."""
    theta = random_theta(arm, np.random.default_rng(5), 12)
    flange = flange_pose(arm, theta)
    table = []
    for n, pendant in enumerate(arm.to_pendant(theta) / DEG):
        for name, place in (("a", [0.06, 0, 0.1]), ("b", [-0.04, 0.05, 0.12])):
            p = flange[n].act(np.array(place)) / MM
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
    "column in metres": (lambda r: text(r, HEAD.replace("x_mm", "x_m")), ("misses the places",)),
    "column unknown": (lambda r: text([[*x, "1"] for x in r], HEAD + ",colour"), ("column colour", "unknown")),
    "column twice": (lambda r: text([[*x, "1"] for x in r], HEAD + ",x_mm"), ("x_mm", "twice")),
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
    "names of shots": (
        lambda r: text([[x[0], f"p{n}", *x[2:]] for n, x in enumerate(r)]),
        ("'p0' is seen once", "so are all: if they are names of shots, remove the column"),
    ),
    "constant joint": (
        lambda r: text([[v if k != 5 else "12" for k, v in enumerate(x)] for x in r]),
        ("column j4_deg", "constant at 12", "--force"),
    ),
    "metres": (lambda r: text(scaled(r, XYZ, 1e-3)), ("metres instead of mm", "multiply them by 1000")),
    "micrometres": (lambda r: text(scaled(r, XYZ, 1e3)), ("um instead of mm", "multiply them by 0.001")),
    "radians": (lambda r: text(scaled(r, JOINTS, DEG)), ("radians", "57.29578")),
    "too few": (lambda r: text(r[:4]), ("12 measured numbers", "12 unknowns", "measure")),
    "wrong sign": (lambda r: text(scaled(r, ("j2_deg",), -1.0)), ("misses", "J2 fits with the opposite sign")),
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


def noisy_rows(arm, extent, away, about=(20.0, 10.0, -20.0, 30.0, -60.0, 40.0)):
    """Twelve poses of two reflectors within so many degrees, to 0.1 mm, by a tracker so far off [m]."""
    rng = np.random.default_rng(8)
    pendant = about + rng.uniform(-extent, extent, (12, 6))
    flange = flange_pose(arm, arm.to_theta(pendant * DEG))
    return [
        [str(n), name, *(f"{v:.6f}" for v in pendant[n]), *(f"{v:.6f}" for v in p / MM)]
        for n in range(12)
        for name, place in (("a", [0.06, 0, 0.1]), ("b", [-0.04, 0.05, 0.12]))
        for p in [flange[n].act(np.array(place)) + away + 1e-4 * rng.standard_normal(3)]
    ]


def of_other_poses(rows):
    """The joints of each pose beside the places of the next one."""
    return [[*r[:2], *later[2:8], *r[8:]] for r, later in zip(rows, rows[2:] + rows[:2], strict=True)]


@pytest.mark.parametrize(("extent", "away"), [(60.0, 0.0), (15.0, 0.0), (60.0, 20.0), (15.0, 20.0)])
@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda r: scaled(r, XYZ, 1e-3), "look like metres instead of mm"),
        (lambda r: scaled(r, XYZ, 1e3), "look like um instead of mm"),
        (lambda r: scaled(r, XYZ, 1 / 25.4), "look like inches instead of mm"),
        (lambda r: scaled(r, JOINTS, DEG), "the values are radians"),
        (of_other_poses, "the nominal arm misses the places by"),
    ],
)
def test_units_are_told_of_a_small_volume_and_from_afar_and_of_nothing_else(tmp_path, arm, spoil, words, extent, away):
    with pytest.raises(InputError, match=words):
        read(tmp_path, arm, text(spoil(noisy_rows(arm, extent, away))))


def test_small_angles_are_not_said_to_be_radians_for_that_alone(tmp_path, arm):
    rows = noisy_rows(arm, 6.0, 0.0, about=np.zeros(6))
    assert len(read(tmp_path, arm, text(rows)).theta) == 12
    with pytest.raises(InputError, match="look like um instead of mm"):
        read(tmp_path, arm, text(scaled(rows, XYZ, 1e3)))


def test_a_single_row_is_judged_by_frames_that_are_known(tmp_path, arm, rows):
    data, model = read(tmp_path, arm, text(rows)), build_model(arm, [], 0)
    frames = initial_frames(data, *model.pose(data, np.zeros(len(model.parameters))))
    one = data.subset(np.arange(len(data.pose)) == 3)
    check_plausible(arm, model, one, frames)
    with pytest.raises(InputError, match="has the instrument moved"):
        check_plausible(arm, model, replace(one, position=one.position + 0.5), frames)


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


@pytest.mark.parametrize("column", ["time_s", "order"])
def test_reflectors_of_a_pose_that_say_their_own_times_are_of_one_pose(tmp_path, arm, rows, column):
    head = HEAD.replace("order", column)
    own = [[str(12 * k if column == "time_s" else k), *r[1:]] for k, r in enumerate(rows)]
    by_pose, by_row = read(tmp_path, arm, text(rows, head)), read(tmp_path, arm, text(own, head))
    for name in ("theta", "pose", "direction"):
        assert np.array_equal(getattr(by_row, name), getattr(by_pose, name))
    assert by_row.time.tolist() == [float(r[0]) for r in own[::2]]
    lost = read(tmp_path, arm, text([r for k, r in enumerate(own) if k not in (6, 7)], head))
    assert (lost.direction[3] == 0).all() == (column == "order")


def test_a_reflector_that_comes_again_at_the_same_joints_is_a_new_visit(tmp_path, arm, rows):
    head, pair = HEAD.replace("order", "time_s"), rows[:2]
    again = [["0", *pair[0][1:]], ["12", *pair[1][1:]], ["24", *pair[0][1:]], ["36", *pair[1][1:]]]
    others = [[str(100 * int(r[0])), *r[1:]] for r in rows[2:]]
    assert read(tmp_path, arm, text(again + others, head)).pose[:4].tolist() == [0, 0, 1, 1]
    late = [["0", *pair[0][1:]], ["320", *pair[1][1:]], *([str(1000 * int(r[0])), *r[1:]] for r in rows[2:])]
    assert read(tmp_path, arm, text(late, head)).pose[:2].tolist() == [0, 0]
    assert read(tmp_path, arm, text(late, head), timed=True).pose[:2].tolist() == [0, 1]


def test_lines_need_both_senses_and_a_deviation(tmp_path, arm):
    file = tmp_path / "lines.csv"
    file.write_text("direction,x_mm,y_mm,z_mm\n1,1200,0,0\n")
    with pytest.raises(InputError, match="column dx_um: missing"):
        read_axis_tests(str(file), arm, 5)
    file.write_text("direction,x_mm,y_mm,z_mm,dx_um\n2,1200,0,0,5\n")
    with pytest.raises(InputError, match=r"line 2, column direction: 2 must be 1 or -1"):
        read_axis_tests(str(file), arm, 5)
    body = "".join(f"{d},{x},0,0,{x / 100}\n" for d in (1, -1) for x in (1100, 1200, 1300, 1400))
    file.write_text("direction,x_mm,y_mm,z_mm,dx_um\n" + body)
    data = read_axis_tests(str(file), arm, 5)
    assert data.aligned.all()
    assert np.isnan(data.position[:, 1:]).all()
    assert np.array_equal(data.direction[:4], -data.direction[4:])
    assert (data.direction[:, 1] != 0).all()


def test_sigmas_weigh_rows_across_the_files_that_give_them(tmp_path, arm, rows):
    """Of a gauge of 3 um, a tracker of 10 and 20 um, another of 200 um: each over the median of all, 20 um."""
    files = list[Measurements]()
    for name, of_row in (("a.csv", [10, 20]), ("b.csv", [200, 200])):
        body = [[*r, str(of_row[k % 2])] for k, r in enumerate(rows)]
        files.append(read(tmp_path, arm, text(body, HEAD + ",sigma_um"), name))
    file = tmp_path / "lines.csv"
    lines = "".join(f"{d},{x},0,0,{x / 100},3\n" for d in (1, -1) for x in (1100, 1200, 1300, 1400))
    file.write_text("direction,x_mm,y_mm,z_mm,dx_um,sigma_um\n" + lines)
    files.append(read_axis_tests(str(file), arm, 0))
    values = np.array(12 * [10, 20] + 24 * [200] + 8 * [3])
    assert_allclose(concatenate(files).sigma, values / np.median(values), rtol=1e-12)
    unsaid = read(tmp_path, arm, text(rows), "c.csv")
    own = np.array(12 * [10 / 15, 20 / 15] + 56 * [1.0])
    assert_allclose(concatenate([*files, unsaid]).sigma, own, rtol=1e-12)


def test_noises_that_touches_say_weigh_them_across_files(tmp_path, arm):
    """Two probes, of 5 and of 100 um: each was taken over its own median, and they counted alike."""
    of = "[artefact]\n[[sphere]]\nname = 'a'\ndiameter_mm = 25\n"
    of += "[probe]\ndiameter_mm = 5\nx_mm = 0\ny_mm = 0\nz_mm = 90\n"
    (tmp_path / "artefact.toml").write_text(of)
    head, files = f"target,{','.join(f'j{k}_deg' for k in range(1, 7))},sigma_um\n", list[Measurements]()
    for name, sigma in (("fine.csv", 5), ("rough.csv", 100)):
        body = "".join(f"a,{k},{k},0,{10 * k},-60,{20 * k},{sigma}\n" for k in range(6))
        (tmp_path / name).write_text(head + body)
        artefact = read_artefact(str(tmp_path / "artefact.toml"))
        rows = read_touches(str(tmp_path / name), arm, artefact, default_frames().uframe)
        files.append(touch_rows(rows, artefact, arm, 0, force=True))
    weighed = concatenate(files).sigma
    assert_allclose(weighed[6:] / weighed[:6], 20.0)


def test_three_stations_of_a_line_are_enough_to_see_a_joint_turn_back(tmp_path, arm):
    """J2 rises and falls along the line, by a parabola; the way back has the opposite signs, the rest stands."""
    file = tmp_path / "lines.csv"
    stations = [(1100, 0), (1200, 10), (1300, 4)]
    body = "".join(f"{d},{x},0,0,5,0,{j2},0,0,-90,0\n" for d in (1, -1) for x, j2 in stations)
    file.write_text("direction,x_mm,y_mm,z_mm,dx_um,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\n" + body)
    data = read_axis_tests(str(file), arm, 5)
    assert data.direction[:, 1].tolist() == [1, 1, -1, -1, -1, 1]
    assert not data.direction[:, [0, 3, 4, 5]].any()


@pytest.mark.parametrize(
    ("joints", "words"),
    [
        (lambda q: q + np.eye(6)[1] * 360, r"line 2, column j2_deg: J2 at 3\d\d\.\d+ deg is outside its limits"),
        (lambda q: q * DEG, "columns j1_deg to j6_deg: the values are radians, not degrees"),
        (
            lambda q: q * [-1, 1, 1, 1, 1, 1],
            r"the joints have the tool \d+ mm from .*, 0.0 mm where J1 fits with the opp",
        ),
    ],
    ids=["limit", "radians", "sign"],
)
def test_joints_of_lines_are_refused_where_they_are_not_those_of_the_places(tmp_path, arm, joints, words):
    tool = Pose(np.array([0.0, 0.0, 0.1]), np.eye(3))
    steps = np.linspace(-0.3, 0.3, 6)
    along_x = np.column_stack([1.2 + steps, np.full(6, 0.1), np.zeros(6)])
    along_y = np.column_stack([np.full(6, 1.2), steps, np.zeros(6)])
    place = np.concatenate([along_x, along_x[::-1], along_y, along_y[::-1]])
    down = np.tile(np.diag([1.0, -1.0, -1.0]), (len(place), 1, 1))
    pendant = arm.to_pendant(solve_tool(arm, Pose(place, down), tool, Posture())[0]) / DEG

    def write(degrees):
        numbers = np.column_stack([np.tile(np.repeat([1, -1], 6), 2), place * 1e3, np.zeros(len(place)), degrees])
        lines = [f"{'XY'[n // 12]}," + ",".join(f"{v:.4f}" for v in row) for n, row in enumerate(numbers)]
        head = "line,direction,x_mm,y_mm,z_mm,dx_um," + ",".join(f"j{k}_deg" for k in range(1, 7))
        (tmp_path / "lines.csv").write_text("\n".join([head, *lines]) + "\n")
        return read_axis_tests(str(tmp_path / "lines.csv"), arm, 0)

    assert_allclose(arm.to_pendant(write(pendant).theta) / DEG, pendant, atol=1e-4)
    with pytest.raises(InputError, match=f"lines.csv.*{words}"):
        write(joints(pendant))


def test_lines_of_an_arm_without_closed_form_need_joints(tmp_path):
    file = tmp_path / "lines.csv"
    file.write_text("direction,x_mm,y_mm,z_mm,dx_um\n1,500,0,0,5\n")
    with pytest.raises(InputError, match="need their joints"):
        read_axis_tests(str(file), load_any_robot("ur5"), 0)


TIMED = HEAD.replace("order", "time_s")


def timed(rows, step=600.0):
    """Poses with a pose each ``step`` seconds."""
    return [[f"{float(r[0]) * step:g}", *r[1:]] for r in rows]


@pytest.fixture(scope="module")
def thermal():
    return load_arm("m710ic50")


def log_file(tmp_path, header, rows):
    file = tmp_path / "log.csv"
    file.write_text("\n".join([header, *(",".join(f"{v:g}" if v == v else "" for v in r) for r in rows)]) + "\n")
    return str(file)


def logged(tmp_path, arm, thermal, rows, header, log, step=600.0, reference="start"):
    data = read(tmp_path, arm, text(timed(rows, step), TIMED), timed=True)
    cold = np.zeros((len(data.theta), len(thermal.nodes)))
    data = replace(data, rise=cold, lag=cold)
    readings, heat = read_log(log_file(tmp_path, header, log), thermal.heat, thermal.sensors)
    return with_temperatures(data, readings, heat, reference)


FIVE = "time_s,ambient_degC,j2_degC,link1_degC,part_6_degC,wrist_degC"
HOUR = 3600.0


def warming_log(step=60.0, until=2 * HOUR, start=0.0):
    """Ambient, j2, link1, j3, wrist in degC, which begin cold unless ``start`` is given in hours."""
    t = np.arange(0, until + 1, step)
    rise = (1 - np.exp(-(t[:, None] / HOUR + start) / 2.0)) * [0, 11, 4, 13, 3]
    return np.column_stack([t, 20 + rise])


def test_rises_are_those_of_the_log_and_a_node_without_a_sensor_is_modelled(tmp_path, arm, thermal, rows):
    data, findings = logged(tmp_path, arm, thermal, rows, FIVE, warming_log())
    expected = (1 - np.exp(-data.time[:, None] / HOUR / 2)) * [11, 4, 13, 3]
    assert np.allclose(data.rise[:, :4], expected, atol=0.06)
    assert data.modelled == (4,)
    assert np.allclose(data.rise[:, 4], expected[:, 3] * 2.3 / 3, atol=0.1)  # the face follows the wrist
    assert not data.lag[:, :4].any()
    assert (data.lag[1:, 4] < 0).all()  # a slower node has risen less
    assert [f.code for f in findings] == ["log.modelled"]
    assert "face" in findings[0].message


def test_a_log_of_one_sensor_with_gaps_and_a_loose_contact_is_enough(tmp_path, arm, thermal, rows):
    log = warming_log()[:, [0, 4]]
    log[20:30, 1] = np.nan
    log[40, 1] += 35
    data, findings = logged(tmp_path, arm, thermal, rows, "time_s,j3_degC", log)
    assert np.allclose(data.rise[:, 2], 13 * (1 - np.exp(-data.time / HOUR / 2)), atol=0.15)
    assert data.modelled == (0, 1, 3, 4)
    assert {f.code for f in findings} == {"log.modelled", "log.loose"}


def test_a_long_gap_is_modelled_and_named(tmp_path, arm, thermal, rows):
    log = warming_log()
    log[60:, 2] = np.nan
    data, findings = logged(tmp_path, arm, thermal, rows, FIVE, log)
    assert np.allclose(data.rise[:, 0], 11 * (1 - np.exp(-data.time / HOUR / 2)), atol=0.8)
    gap = next(f for f in findings if f.code == "log.gap")
    assert "j2_degC" in gap.message


def test_a_pose_at_the_second_of_a_reading_is_in_no_gap(tmp_path, arm, thermal, rows):
    """J2 is silent from 600 to 3000 s, between two readings at the seconds of poses; three poses are in between."""
    log = warming_log()
    log[11:50, 2] = np.nan
    _, findings = logged(tmp_path, arm, thermal, rows, FIVE, log)
    assert [f.message.split("around ")[1][:7] for f in findings if f.code == "log.gap"] == ["3 poses"]


LATE = np.array([9000, 0, 0, 0, 0, 0])
WARM_START = np.array([0, 0, 6, 2, 7, 1])
WRONG_LOGS = {
    "another clock": (
        FIVE,
        lambda log: log + LATE,
        ("column time_s", "outside the log", "one clock"),
    ),
    "log in hours": (FIVE, lambda log: log / [HOUR, 1, 1, 1, 1, 1], ("log's times hours? multiply them by 3600",)),
    "begins warm": (FIVE, lambda log: log + WARM_START, ("line 2", "does not begin cold", "--reference")),
    "begins warm, without air": (
        "time_s,j2_degC,link1_degC",
        lambda log: (log + WARM_START)[:, [0, 2, 3]],
        ("does not begin cold", "j2_degC = 26", "link1_degC = 22"),
    ),
    "cools, without air": (
        "time_s,j2_degC,part_6_degC",
        lambda log: np.column_stack([log[:, 0], 60 - log[:, [2, 4]]]),
        ("line 2", "does not begin cold (part_6_degC falls by 8.1 K from there)", "--reference"),
    ),
    "unknown sensor": ("time_s,elbow_degC", lambda log: log[:, :2], ("column elbow_degC", "unknown", "wrist_degC")),
    "one rise twice": ("time_s,j3_degC,part_6_degC", lambda log: log[:, :3], ("both show the rise of 'j3'",)),
    "infinite": (FIVE, lambda log: log * [1, 1, np.inf, 1, 1, 1], ("line 2, column j2_degC", "not a finite number")),
    "no sensor": ("time_s,ambient_degC", lambda log: log[:, :2], ("no sensor", "j2_degC")),
}


@pytest.mark.parametrize("name", WRONG_LOGS)
def test_wrong_logs_are_refused_in_one_line(tmp_path, arm, thermal, rows, name):
    header, change, needles = WRONG_LOGS[name]
    with pytest.raises(InputError) as caught:
        logged(tmp_path, arm, thermal, rows, header, change(warming_log()))
    message = str(caught.value)
    assert "\n" not in message
    assert "log.csv" in message
    for needle in needles:
        assert needle in message, message


def test_a_log_that_begins_warm_counts_from_the_air_when_told(tmp_path, arm, thermal, rows):
    log = warming_log(start=1.0)
    data, _ = logged(tmp_path, arm, thermal, rows, FIVE, log, reference="ambient")
    assert data.rise[0, 0] == pytest.approx(11 * (1 - np.exp(-0.5)), abs=0.05)
    from_zero, _ = logged(tmp_path, arm, thermal, rows, FIVE, log, reference=20.0)
    assert np.allclose(from_zero.rise[:, :4], data.rise[:, :4])


def test_swapped_sensors_are_a_finding(tmp_path, arm, thermal, rows):
    log = warming_log()
    _, findings = logged(tmp_path, arm, thermal, rows, FIVE, log[:, [0, 1, 5, 3, 4, 2]])
    swapped = [f.message for f in findings if f.code == "log.swapped"]
    assert len(swapped) == 1
    assert "j2_degC and wrist_degC swapped" in swapped[0]
    _, findings = logged(tmp_path, arm, thermal, rows, FIVE, log[:, [0, 4, 2, 3, 1, 5]])
    assert any("part_6_degC and ambient_degC swapped" in f.message for f in findings)


@pytest.mark.parametrize(
    ("header", "step", "words"),
    [
        (HEAD, None, ("column time_s: missing", "seconds")),
        (TIMED, 1.0, ("column time_s", "row numbers")),
        (TIMED, 0.05, ("column time_s", "joints need", "hours? multiply them by 3600")),
        (TIMED, 10.0, ("column time_s", "110 s from first to last", "minutes? multiply them by 60")),
        (TIMED, 1e7, ("column time_s", "milliseconds? multiply them by 0.001")),
    ],
)
def test_times_of_a_warm_up_are_seconds(tmp_path, arm, rows, header, step, words):
    with pytest.raises(InputError) as caught:
        as_warm_up(read(tmp_path, arm, text(rows if step is None else timed(rows, step), header), timed=True))
    assert all(w in str(caught.value) for w in ("poses.csv", *words)), caught.value


@pytest.mark.parametrize("cell", ["inf", "-inf", "1e999", "nan", ""])
def test_infinite_times_are_refused(tmp_path, arm, rows, cell):
    wrong = timed(rows)
    wrong[4][0] = cell
    with pytest.raises(InputError, match="line 6, column time_s"):
        read(tmp_path, arm, text(wrong, TIMED), timed=True)


def test_one_name_of_an_instrument_is_one_frame_in_all_files(tmp_path, arm, rows):
    named = [[*r, "tracker"] for r in rows]
    one = read(tmp_path, arm, text(named[:12], HEAD + ",instrument"), "one.csv")
    two = read(tmp_path, arm, text(named[12:], HEAD + ",instrument"), "two.csv")
    other = read(tmp_path, arm, text(rows[12:]), "three.csv")
    both = with_one_frame_a_name(concatenate([one, two, other]))
    assert both.instruments == ("tracker", str(tmp_path / "three.csv"))
    assert both.instrument.tolist() == [0] * 24 + [1] * 12
    assert both.named_instrument(0) == "tracker"
    assert both.named_instrument(1) == ""


@pytest.mark.parametrize("joint", range(1, 7))
def test_a_joint_of_the_opposite_sign_is_named(tmp_path, arm, rows, joint):
    with pytest.raises(InputError) as caught:
        read(tmp_path, arm, text(scaled(rows, (f"j{joint}_deg",), -1.0)))
    message = str(caught.value)
    if "outside its limits" not in message:
        assert f"where J{joint} fits with the opposite sign;" in message
    assert "poses.csv" in message


@pytest.mark.parametrize(("axes", "signs"), [((1, 0, 2), (1, 1, 1)), ((0, 1, 2), (1, 1, -1)), ((2, 1, 0), (1, 1, 1))])
def test_mirrored_places_are_named_and_no_joint(tmp_path, arm, rows, axes, signs):
    mirrored = [[*r[:8], *(f"{s * float(r[8 + k]):.4f}" for k, s in zip(axes, signs, strict=True))] for r in rows]
    with pytest.raises(InputError, match=r"by 0.0 mm where they are mirrored: two of x y z are exchanged"):
        read(tmp_path, arm, text(mirrored))


def test_copies_are_no_second_measurement(tmp_path, arm, rows):
    """A file given twice; visits that repeat a place within noise, one of them by chance to the last digit, are."""
    once = read(tmp_path, arm, text(rows), "one.csv")
    twice = concatenate([once, read(tmp_path, arm, text(rows), "copy.csv")])
    with pytest.raises(InputError, match=r"copy.csv: line 2: .*one.csv: line 2 .* 24 rows: a copy is no"):
        check_copies(twice)
    moved = [changed([r], 0, "x_mm", f"{float(r[8]) + 0.0012 * (n > 0):.4f}")[0] for n, r in enumerate(rows)]
    check_copies(concatenate([once, read(tmp_path, arm, text(moved), "again.csv")]))
    check_copies(once)
    check_copies(replace(once, instrument=np.full(24, -1), aligned=np.zeros(0, dtype=bool), instruments=()))


def test_targets_of_distances_are_read_in_another_writers_form(tmp_path, arm):
    """With semicolons and decimal commas, in metres: ``a_target`` is no side of a column ``a``."""
    ends = [f"{end}_j{k}_deg" for end in "ab" for k in range(1, 7)]
    head = ["a_target", "b_target", *ends, "distance_m"]
    rows = [
        [*names, *(str(10.0 + n + k) for k in range(12)), str(0.8 + 0.01 * n)]
        for n, names in enumerate(("pq", "qr", "rp") * 4)
    ]
    file = tmp_path / "distances.csv"
    file.write_text("\n".join(";".join(row).replace(".", ",") for row in [head, *rows]))
    assert read_distances(str(file), arm, 0).reflectors == ("p", "q", "r")


def test_the_sign_of_theta_2_alone_is_named(tmp_path, arm, rows):
    """As a pendant table with -1 for J2 in its own row reads it: theta_3 = J2 + J3 keeps its sign."""
    turned = scaled(rows, ("j2_deg",), -1.0)
    for row, right in zip(turned, rows, strict=True):
        row[4] = f"{float(right[4]) + 2 * float(right[3]):.9g}"
    with pytest.raises(InputError, match="where J2 fits with the opposite sign, and J3 as it is"):
        read(tmp_path, arm, text(turned))


def of_link_2(rows):
    """The same poses with J3 against link 2, as robots count it that do not hold the forearm's angle to the floor."""
    at2, at3 = HEAD.split(",").index("j2_deg"), HEAD.split(",").index("j3_deg")
    return [[f"{float(v) + float(r[at2]):.6f}" if k == at3 else v for k, v in enumerate(r)] for r in rows]


def test_the_convention_of_j3_is_named_whichever_of_file_and_columns_is_wrong(tmp_path, arm, rows):
    with pytest.raises(InputError, match="J3 fits the convention of the angle against link 2"):
        read(tmp_path, arm, text(of_link_2(rows)))
    uncoupled = replace(arm, pendant_map=np.eye(6), lower=arm.lower - 3, upper=arm.upper + 3)
    assert len(read(tmp_path, uncoupled, text(of_link_2(rows))).theta) == 12
    with pytest.raises(InputError, match=r"J3 fits the pendant's convention of the horizontal \(theta_3 = J2 \+ J3\);"):
        read(tmp_path, uncoupled, text(rows))


def test_a_missing_coupling_is_named_where_only_the_series_of_j2_shows_it(tmp_path, arm):
    """Each joint in a series of its own: 17 % of the rows, which a robust fit would set aside."""
    home = arm.to_theta(np.array([[5.0, 0.0, -20.0, 10.0, -60.0, 15.0]]) * DEG)[0]
    pendant = np.repeat(arm.to_pendant(home[None]), 60, axis=0)
    for k in range(6):
        pendant[10 * k : 10 * k + 10, k] += np.linspace(-25, 25, 10) * DEG
    position, rotation = flange_pose_of(arm, arm.to_theta(pendant))
    table = []
    for n, q in enumerate(pendant / DEG):
        for name, place in (("a", [0.06, 0, 0.1]), ("b", [-0.04, 0.05, 0.12])):
            p = (position[n] + rotation[n] @ place) / MM
            table.append([str(n), name, *(f"{v:.6f}" for v in q), *(f"{v:.4f}" for v in p)])
    assert len(read(tmp_path, arm, text(table)).theta) == 60
    uncoupled = replace(arm, pendant_map=np.eye(6), lower=arm.lower - 3, upper=arm.upper + 3)
    with pytest.raises(InputError, match="J3 fits the pendant's convention of the horizontal"):
        read(tmp_path, uncoupled, text(table))


def test_two_wrong_columns_are_both_named(tmp_path, arm, rows):
    with pytest.raises(InputError) as caught:
        read(tmp_path, arm, text(scaled(rows, ("j1_deg", "j4_deg"), -1.0)))
    assert "J1 fits with the opposite sign" in str(caught.value)
    assert "J4 fits with the opposite sign" in str(caught.value)


def test_an_arm_millimetres_off_its_nominal_figures_is_not_taken_for_another_convention(tmp_path, arm, rows):
    rng = np.random.default_rng(3)
    at = [HEAD.split(",").index(c) for c in XYZ]
    off = [[f"{float(v) + rng.normal(0, 3):.4f}" if k in at else v for k, v in enumerate(r)] for r in rows]
    assert len(read(tmp_path, arm, text(off)).theta) == 12


def flange_pose_of(arm, theta):
    pose = flange_pose(arm, theta)
    return pose.position, pose.rotation


def test_poses_of_a_spreadsheet_are_read_as_those_of_a_script(tmp_path, arm, rows):
    plain = read(tmp_path, arm, text(rows))
    heads = (
        HEAD.replace("x_mm", "X [mm]").replace("y_mm", "Y (mm)").replace("z_mm", "z in mm").replace("j1_deg", "J1 [°]")
    )
    german = read(tmp_path, arm, text(rows, heads).replace(",", ";").replace(".", ","))
    np.testing.assert_array_equal(german.position, plain.position)
    np.testing.assert_array_equal(german.theta, plain.theta)
    assert "read as: semicolon, decimal comma, deg, mm" in german.notes[0]
    assert plain.notes == ()
