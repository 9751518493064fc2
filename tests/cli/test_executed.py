"""``cgen executed`` as a user meets it: a run as planned, and every log that must be named in one line."""

import json
import re

import executed_logs as logs
import ls_text
import naive_arm as arm
import numpy as np
import pytest
from command_line import refused, run
from numpy.linalg import norm

from compgen.pipelines.files.program_course import course_of_text
from compgen.program.frames import default_frames, load_frames

RUN = logs.Run(ramp=0.25)


@pytest.fixture(scope="module")
def course(robot):
    return course_of_text(logs.part(), robot, default_frames())


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "PART.LS").write_bytes(logs.part())
    return tmp_path


def write(folder, course, logger=None, run_of=RUN, change=lambda t, p, w: (t, p, w), name="log.csv"):
    """A log of a run in a folder; ``change`` spoils it."""
    time, places, turn, _ = logs.log_rows(course, run_of, logger or logs.Logger(noise=1e-6))
    (folder / name).write_text(logs.csv(*change(time, places, turn)))


def executed(folder, *more):
    return run("executed", "PART.LS", "--log", "log.csv", "--robot", "m710ic50", *more, cwd=folder)


def report(folder, name="PART"):
    return json.loads((folder / "outputs" / f"{name}_executed" / "executed.json").read_text())


def codes(folder):
    return {f["code"] for f in report(folder)["findings"]}


def test_a_run_as_planned_is_inside_and_has_a_page(folder, course):
    write(folder, course, logs.Logger(noise=2e-6, offset=1234.5, jitter=1e-3, drop=0.05))
    result = executed(folder, "--max-um", 20)
    assert result.returncode == 0, result.stderr
    assert "verdict: inside\n" in result.stdout
    assert "the program began at 1234.5" in result.stdout
    data = report(folder)
    assert data["verdict"] == "inside"
    assert [s["percent"] for s in data["override"]] == [100]
    assert data["covered"]["share"] == pytest.approx(1, abs=1e-4)
    assert data["time"]["start_s"] == pytest.approx(1234.5, abs=0.05)
    assert data["deviation"]["total"]["rms_um"] == pytest.approx(2 * np.sqrt(2), rel=0.1)
    page = (folder / "outputs" / "PART_executed" / "executed.html").read_text()
    assert "not where the tool was" in page
    assert page.count("cgenFigures.draw(") >= 3
    assert (folder / "outputs" / "PART_executed" / "executed.csv").read_text().startswith("time_s,along_mm,off_um")


def test_the_same_log_gives_the_same_bytes_and_json_is_what_is_written(folder, course):
    write(folder, course)
    first = executed(folder, "--json")
    before = {f.name: f.read_bytes() for f in (folder / "outputs" / "PART_executed").iterdir()}
    assert executed(folder, "--json").stdout == first.stdout == before["executed.json"].decode()
    assert {f.name: f.read_bytes() for f in (folder / "outputs" / "PART_executed").iterdir()} == before


def test_a_deviation_beyond_the_bound_is_outside(folder, course):
    write(folder, course, run_of=logs.Run(ramp=0.25, means=(0.2, 0.1)))
    result = executed(folder, "--max-um", 100)
    refused(result, 1, "outside bounds: ", "um off the path near P[", "--max-um 100")


def test_the_time_says_of_what_part_of_the_log_it_is_and_speeds_are_the_tools(folder, course):
    """The way in sweeps is steady and straight, the circle behind it is not: the run lasts twice as long as its time.

    Where corners are cut the nearest point of the path runs at 250 mm/s, the tool at no more than its 100.
    """
    write(folder, course, run_of=logs.Run(ramp=0, means=(0.2, 0.16)))
    assert executed(folder).returncode == 0
    data, time = report(folder), report(folder)["time"]
    assert time["to_s"] - time["from_s"] == pytest.approx(time["took_s"], abs=1e-6)
    rows = np.genfromtxt(folder / "outputs" / "PART_executed" / "executed.csv", delimiter=",", names=True)
    assert rows["speed_mm_s"].max() < 103
    assert np.median(rows["speed_mm_s"]) == pytest.approx(100, abs=2)
    page = (folder / "outputs" / "PART_executed" / "executed.html").read_text()
    span = f"from {time['from_s']:.2f} to {time['to_s']:.2f} s of the log"
    assert f"{time['took_s']:.2f} s, planned {time['expected_s']:.2f} s" in page
    assert span in page
    assert all(span in f["message"] for f in data["findings"] if f["code"] == "executed.time")


def test_the_override_is_named_and_a_change_midway_is_outside(folder, course):
    write(folder, course, run_of=logs.Run(ramp=0.25, override=0.37))
    result = executed(folder)
    assert result.returncode == 0
    assert "verdict: inside: no bound was given; give --max-um\n" in result.stdout
    assert report(folder)["override"][0]["percent"] == 37
    assert "executed.override" in codes(folder)
    write(folder, course, run_of=logs.Run(ramp=0.25, later=((9.0, 0.5),)))
    refused(executed(folder), 1, "override changed during the run", "100 % at first, 50 % from")
    turn = report(folder)["override"][1]["from_s"]
    assert turn == pytest.approx(9.0 + 1.5 * 0.25, abs=0.1)


def test_half_a_run_is_named_with_where_it_ends(folder, course):
    write(folder, course, logs.Logger(noise=1e-6, end=0.5))
    refused(executed(folder), 1, "of the path, from P[1] (0.0 %) to P[", "the rest is not judged")
    assert 0.3 < report(folder)["covered"]["share"] < 0.7


def test_a_log_of_another_program_is_refused(folder, course, robot):
    moved = logs.part(name="OTHER", shift=np.array([0.0, 0.0, 0.0]), speed=0.1)
    other = course_of_text(moved, robot, default_frames())
    turned = lambda t, p, w: (t, np.column_stack([p[:, 0] + 0.3 * p[:, 1], p[:, 1], p[:, 2] + 0.2 * p[:, 0]]), w)  # noqa: E731
    write(folder, other, change=turned)
    refused(executed(folder), 2, "log.csv", "another program")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t, p, w: (t, p / 1000, w), ["metres, not millimetres"]),
        (lambda t, p, w: (t, p, np.radians(w)), ["w_deg to r_deg", "radians"]),
        (lambda t, p, w: (t * 1000, p, w), ["time_s", "milliseconds"]),
        (lambda t, p, w: (np.where(t > 6, t - 3.0, t), p, w), ["line", "clock steps back by 2.99"]),
        (lambda t, p, w: (np.where(t > 6, t + 60.0, t), p, w), ["line", "clock steps forwards by 60 s"]),
        (lambda t, p, w: (t[:8], p[:8], w[:8]), ["8 rows", "10"]),
        (lambda t, p, w: (t[::20], p[::20], w[::20]), ["0.16 s apart", "0.1 s"]),
        (lambda t, p, w: (t, np.repeat(p[:1], len(t), axis=0), np.repeat(w[:1], len(t), axis=0)), ["same position"]),
    ],
    ids=["metres", "radians", "ms", "back", "forwards", "few", "coarse", "still"],
)  # fmt: skip
def test_a_log_that_is_wrong_is_named_in_one_line(folder, course, change, words):
    write(folder, course, change=change)
    refused(executed(folder), 2, "log.csv", *words)
    assert not (folder / "outputs").exists()


@pytest.mark.parametrize("offset", [(50.0, 0.0, -12.0), (0.6, 0.0, -0.8), (0.0, 800.0, 0.0)], ids=str)
def test_a_log_in_another_frame_is_named_by_how_much(folder, course, offset):
    write(folder, course, change=lambda t, p, w: (t, p + np.array(offset) / 1000, w))
    result = executed(folder)
    refused(result, 2, "log.csv", "constant offset of X", "UFRAME 0")
    named = re.search(r"X (\S+) Y (\S+) Z (\S+) mm", result.stderr)
    assert named is not None
    np.testing.assert_allclose([float(v) for v in named.groups()], offset, atol=0.004)


def spoilt(change):
    """A change of the 71st row."""
    return lambda rows: [*rows[:70], change(rows[70]), *rows[71:]]


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda rows: [r.rsplit(",", 1)[0] + "," for r in rows], ["column r_deg", "no number at all"]),
        (spoilt(lambda r: r.replace(",", ",nan,", 1).rsplit(",", 1)[0]), ["line 72", "nan"]),
        (spoilt(lambda r: r + ",1"), ["line 72", "8 cells"]),
        (spoilt(lambda r: r.rsplit(",", 1)[0] + ","), ["line 72", "r_deg", "empty"]),
        (spoilt(lambda r: r.replace(".", "x", 1)), ["line 72", "column time_s", "not a number"]),
    ],
    ids=["empty column", "nan", "cells", "empty cell", "letters"],
)  # fmt: skip
def test_a_cell_that_is_wrong_is_named_by_line_and_column(folder, course, spoil, words):
    write(folder, course)
    head, *rows = (folder / "log.csv").read_text().splitlines()
    (folder / "log.csv").write_text("\n".join([head, *spoil(rows)]) + "\n")
    refused(executed(folder), 2, "log.csv", *words)


def test_rows_without_a_position_are_gaps(folder, course):
    write(folder, course)
    head, *rows = (folder / "log.csv").read_text().splitlines()
    rows[300:340] = [r.split(",")[0] + ",,,,,," for r in rows[300:340]]
    (folder / "log.csv").write_text("\n".join([head, *rows]) + "\n")
    assert executed(folder).returncode == 0
    assert report(folder)["log"]["rows_without_position"] == 40
    assert "executed.gaps" in codes(folder)


def test_joints_are_read_as_the_pendant_shows_them_and_radians_are_named(folder, course, robot):
    time, _, _, along = logs.log_rows(course, RUN, logs.Logger())
    theta = np.column_stack([np.interp(along, course.arc, c) for c in course.theta.T])
    pendant = np.degrees(robot.to_pendant(theta))
    for factor, code in ((1.0, 0), (np.pi / 180, 2)):
        rows = "\n".join(",".join(f"{v:.5f}" for v in r) for r in np.column_stack([time, factor * pendant]).tolist())
        (folder / "log.csv").write_text(f"time_s,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\n{rows}\n")
        result = executed(folder)
        assert result.returncode == code, result.stderr
    refused(result, 2, "j1_deg to j6_deg", "radians")


def test_a_program_in_a_user_frame_takes_a_log_in_it_and_names_one_in_world(folder, robot):
    (folder / "frames.toml").write_text(logs.FRAMES)
    frames = load_frames(str(folder / "frames.toml"))
    (folder / "PART.LS").write_bytes(logs.part(numbers=(1, 1)))
    course = course_of_text(logs.part(numbers=(1, 1)), robot, frames)
    refused(executed(folder), 2, "uframe 1", "--frames")
    in_frame = lambda t, p, w: (t, course.frame.inverse().act(p), np.tile([np.pi, 0, 0], (len(t), 1)))  # noqa: E731
    write(folder, course, change=in_frame)
    result = executed(folder, "--frames", "frames.toml")
    assert result.returncode == 0, result.stderr
    write(folder, course)
    refused(executed(folder, "--frames", "frames.toml"), 2, "World", "--in-world")
    assert executed(folder, "--frames", "frames.toml", "--in-world").returncode == 0


CORNERS = np.array([[0, -200, 0], [0, 200, 0], [100, 200, 0], [100, -200, 0], [0, -200, 0]])  # in UFRAME 1
SECOND = np.array([50, 20, 50])  # UFRAME 2 in UFRAME 1


def lines(folder, home, numbers=(1, 1, 1, 1, 1), log=lambda p: p):
    """A program from home along lines between corners in user frames, and a log in the frame that is active there."""
    frames = {1: np.array([1200, 0, -50])} | {2: np.array([1200, 0, -50]) + SECOND}
    table = "".join(
        f"[uframe.{n}]\nx_mm={x}\ny_mm={y}\nz_mm={z}\nw_deg=0\np_deg=0\nr_deg=0\n" for n, (x, y, z) in frames.items()
    )
    (folder / "frames.toml").write_text(table)
    numbered = list(enumerate(zip(CORNERS, numbers, strict=True), 2))
    points = [ls_text.cartesian(n, (*c - SECOND * (uf - 1), 180, 0, 0), uf=uf) for n, (c, uf) in numbered]
    moves = ["UFRAME_NUM=1", "UTOOL_NUM=0", "J P[1] 20% FINE", *(f"L P[{n}] 100mm/sec FINE" for n, _ in numbered)]
    (folder / "PART.LS").write_bytes(ls_text.program(moves, [home, *points]))
    share = (1 - np.cos(np.linspace(0, np.pi, 500)))[:, None] / 2
    way = np.vstack([a + (b - a) * share for a, b in zip(CORNERS[:-1], CORNERS[1:], strict=True)])
    active = np.repeat(numbers[1:], len(share))[:, None]
    place, turn = log(way - SECOND * (active - 1)), np.tile([np.pi, 0, 0], (len(way), 1))
    (folder / "log.csv").write_text(logs.csv(np.arange(len(way)) * 0.008, place / 1000, turn))
    return executed(folder, "--frames", "frames.toml")


HOMES = {
    "joints": ls_text.joint_form(1, (0, 0, 0, 0, -90, 0)),
    "joints with another tool": ls_text.joint_form(1, (0, 0, 0, 0, -90, 0), ut=3),
    "Cartesian": ls_text.cartesian(1, (1200, 0, 300, 180, 0, 0)),
}


@pytest.mark.parametrize("home", HOMES.values(), ids=list(HOMES))
def test_a_home_in_another_frame_does_not_say_in_which_frame_the_log_is(folder, home):
    """The right log of such a program was refused as another program's."""
    lines(folder, home)
    covered = report(folder)["covered"]
    assert (covered["from"], covered["to"]) == ("P[2]", "P[6]")
    assert report(folder)["deviation"]["total"]["max_um"] < 1


def test_a_log_of_several_user_frames_is_told_what_to_log(folder):
    result = lines(folder, HOMES["Cartesian"], (1, 1, 2, 2, 2))
    assert result.returncode == 1
    assert "several user frames: log joints, or positions in World with --in-world" in result.stderr


def test_a_log_of_several_tools_is_told_to_be_cut_to_one(folder):
    """A right log of joints was another program's, and *log joints, or positions in World* was the mend."""
    tools, tables = [arm.frame(0, 0, z, 0, 0, 0) for z in (250, 100)], {"uframe.1": 0, "utool.1": 250, "utool.2": 100}
    zeros = "x_mm=0\ny_mm=0\nw_deg=0\np_deg=0\nr_deg=0\n"
    (folder / "frames.toml").write_text("".join(f"[{name}]\nz_mm={z}\n{zeros}" for name, z in tables.items()))
    corners = [np.array(corner) for corner in ((1300, -150, 0), (1300, 150, 0), (1200, 150, 150), (1200, -150, 150))]
    frame_and_tool = ((1, 1), (1, 1), (0, 2), (0, 2))
    points, moves = [], []
    rows: list[tuple[float, ...]] = []
    for n, (corner, (uf, ut)) in enumerate(zip(corners, frame_and_tool, strict=True)):
        points.append(ls_text.cartesian(n + 1, (*corner, 180, 0, 0), uf=uf, ut=ut))
        moves += [
            f"UFRAME_NUM={uf}",
            f"UTOOL_NUM={ut}",
            f"{'L' if n else 'J'} P[{n + 1}] {'100mm/sec' if n else '20%'} FINE",
        ]
    for begin, ut in ((0, 1), (1, 2), (2, 2)):  # where the tool changes, its point starts elsewhere
        start = corners[begin] + (np.array([0, 0, 150]) if begin == 1 else 0)
        for share in (1 - np.cos(np.linspace(0, np.pi, 300))) / 2:
            x, y, z = start + share * (corners[begin + 1] - start)
            pose = arm.frame(x, y, z, 180, 0, 0) @ np.linalg.inv(tools[ut - 1])
            rows.append(arm.joints_at(pose, rows[-1] if rows else (-6, 20, -30, 0, -60, 6)))
    (folder / "PART.LS").write_bytes(ls_text.program(moves, points))
    lines = (",".join(f"{v:.5f}" for v in (0.008 * k, *row)) for k, row in enumerate(rows))
    (folder / "log.csv").write_text("\n".join(["time_s,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg", *lines, ""]))
    result = executed(folder, "--frames", "frames.toml")
    assert "several tools: cut the log to a run of motions with UTOOL" in result.stderr
    assert "log joints" not in result.stderr


def test_a_whole_run_from_and_to_a_home_in_another_tool_is_whole(folder):
    """*The log has 45 % of the path* was said, and *outside*: no log of one tool comes to home's place."""
    zeros = "x_mm=0\ny_mm=0\nw_deg=0\np_deg=0\nr_deg=0\n"
    (folder / "frames.toml").write_text(f"[utool.1]\nz_mm=250\n{zeros}[utool.2]\nz_mm=100\n{zeros}")
    places = [(1200, -300, 400), (1300, -150, 0), (1300, 150, 0), (1200, -300, 400)]
    tools, letters = (2, 1, 1, 2), ("J P[1] 20%", "L P[2] 100mm/sec", "L P[3] 100mm/sec", "J P[4] 20%")
    points = [
        ls_text.cartesian(n, (*p, 180, 0, 0), ut=t) for n, (p, t) in enumerate(zip(places, tools, strict=True), 1)
    ]
    moves = [w for t, word in zip(tools, letters, strict=True) for w in (f"UTOOL_NUM={t}", f"{word} FINE")]
    (folder / "PART.LS").write_bytes(ls_text.program(["UFRAME_NUM=0", *moves], points))
    rows: list[tuple[float, ...]] = []
    ways = [np.array(p) - (0, 0, 150 if t == 2 else 0) for p, t in zip(places, tools, strict=True)]  # of tool 1's point
    for begin, end in zip(ways[:-1], ways[1:], strict=True):
        for share in (1 - np.cos(np.linspace(0, np.pi, 300))) / 2:
            x, y, z = begin + share * (end - begin)
            pose = arm.frame(x, y, z, 180, 0, 0) @ np.linalg.inv(arm.frame(0, 0, 250, 0, 0, 0))
            rows.append(arm.joints_at(pose, rows[-1] if rows else (-14, 0, -30, 0, -60, 14)))
    for last, is_whole in ((900, True), (500, False)):
        lines = (",".join(f"{v:.5f}" for v in (0.008 * k, *row)) for k, row in enumerate(rows[:last]))
        (folder / "log.csv").write_text("\n".join(["time_s,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg", *lines, ""]))
        result = executed(folder, "--frames", "frames.toml")
        assert "the program began at" not in result.stdout  # the log has not where it did
        assert ("executed.part" not in codes(folder)) == is_whole
        covered = report(folder)["covered"]
        assert (covered["share"] > 0.998, covered["from"]) == (is_whole, "P[2]")


@pytest.mark.parametrize(
    ("pace", "percents", "size"),
    [(0.6, [100], 1), (1.0, [100], 1), (2.0, [100], 1), (2.0, [100, 50], 1), (1.0, [100], 0.4)],
)
def test_a_joint_motion_of_any_duration_tells_no_override(folder, pace, percents, size):
    """Every line at 100 %: *the override changed, 88 % from 4.97 s* was said, and *at 44 %* of slow joint motions.

    Of lines as short as their ramps nothing was told: the rows of joint motions were steadier.
    """
    corners = [
        (1100, -200, 200),
        (1500, -200, 200),
        (1500, -60, 200),
        (1300, -60, 200),
        (1300, -60, 450),
        (1700, -60, 450),
    ]
    corners = [(1100 + size * (x - 1100), y, z) for x, y, z in corners]
    points = [ls_text.cartesian(n, (*corner, 180, 0, 0)) for n, corner in enumerate(corners, 1)]
    moves = [f"L P[{n}] 200mm/sec FINE" if n % 2 == 0 else f"J P[{n}] 3% FINE" for n in range(2, 7)]
    text = ls_text.program(["UFRAME_NUM=0", "UTOOL_NUM=0", "J P[1] 20% FINE", *moves], points)
    (folder / "PART.LS").write_bytes(text)
    at = [arm.joints_at(arm.frame(*corners[0], 180, 0, 0), (-10, 0, -30, 0, -60, 10))] * 60
    for n, (begin, end) in enumerate(zip(corners[:-1], corners[1:], strict=True)):
        a, b, start = np.array(begin), np.array(end), np.array(at[-1])
        goal = np.array(arm.joints_at(arm.frame(*end, 180, 0, 0), at[-1]))
        lasts = (
            pace * np.abs((goal - start) / [175, 175, 175, 250, 250, 355]).max() / 0.03
            if n % 2
            else norm(b - a) / (2 * percents[-1 if n == 4 else 0])
        )
        t = np.arange(0.016, lasts + 0.344, 0.016)
        ramped = [np.clip((t - late) / lasts, 0, 1) for late in np.linspace(0, 0.344, 50)]
        for share in [*np.mean(ramped, axis=0), *[1.0] * 12]:
            x, y, z = a + share * (b - a)
            at.append(
                tuple(start + share * (goal - start)) if n % 2 else arm.joints_at(arm.frame(x, y, z, 180, 0, 0), at[-1])
            )
    rows = (",".join(f"{v:.5f}" for v in (0.016 * k, *row)) for k, row in enumerate([*at, *[at[-1]] * 60]))
    (folder / "log.csv").write_text("\n".join(["time_s,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg", *rows, ""]))
    executed(folder)
    assert [stretch["percent"] for stretch in report(folder)["override"]] == percents
    assert codes(folder) - {"executed.override_changed"} == {"executed.not_the_tool", "executed.unjudged"}
    assert report(folder)["time"]["took_s"] == pytest.approx(report(folder)["time"]["expected_s"], rel=0.005)


def test_a_log_of_a_program_that_loops_is_told_to_be_cut_to_one_pass(folder):
    """Three rounds of a loop were another program, and *give the log of one run of this program* was the mend."""
    corners = [np.array([x, y, 300.0]) for x, y in ((1200, 0), (1300, 0), (1300, 80), (1200, 80))]
    points = [ls_text.cartesian(n, (*c, 180, 0, 0)) for n, c in enumerate(corners, 1)]
    moves = ["J P[1] 20% FINE", "FOR R[1]=1 TO 3", *(f"L P[{n}] 100mm/sec FINE" for n in (2, 3, 4, 1)), "ENDFOR"]
    (folder / "PART.LS").write_bytes(ls_text.program(["UFRAME_NUM=0", "UTOOL_NUM=0", *moves], points))
    share = (1 - np.cos(np.linspace(0, np.pi, 150)))[:, None] / 2
    one = np.vstack([a + (b - a) * share for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)])
    for rounds, is_refused in ((3, True), (1, False)):
        place = np.vstack([one] * rounds) / 1000
        text = logs.csv(np.arange(len(place)) * 0.008, place, np.tile([np.pi, 0, 0], (len(place), 1)))
        (folder / "log.csv").write_text(text)
        result = executed(folder)
        assert (
            "it jumps, calls or loops (line 7): cut the log to one pass of its motions" in result.stderr
        ) == is_refused
        assert (result.returncode == 2) == is_refused


def test_inches_are_not_taken_for_metres(folder):
    refused(lines(folder, HOMES["Cartesian"], log=lambda p: p / 25.4), 2, "inches, not millimetres")


def test_an_older_correction_is_told_from_the_text_that_was_given(folder, course, robot):
    N = int(course.number.max())
    shift = 40e-6 * np.column_stack([np.sin(np.arange(N) / 30), np.cos(np.arange(N) / 25), np.ones(N)])
    (folder / "OLD.LS").write_bytes(logs.part(name="OLD", shift=shift))
    older = course_of_text(logs.part(name="OLD", shift=shift), robot, default_frames())
    smoothed = logs.Run(ramp=0.25, means=(0.2, 0.1))
    write(folder, older, logs.Logger(noise=2e-6), smoothed)
    refused(executed(folder, "--also", "OLD.LS"), 1, "the robot ran OLD.LS, not this program")
    assert report(folder)["also"][0]["share"] == pytest.approx(1, abs=0.1)
    refused(executed(folder), 1, "older correction")
    write(folder, course, logs.Logger(noise=2e-6), smoothed)
    assert executed(folder, "--also", "OLD.LS").returncode == 0
    assert report(folder)["also"][0]["share"] == pytest.approx(0, abs=0.1)
    assert "executed.this" in codes(folder)


@pytest.mark.parametrize("name", ["PART", "OTHER"])
def test_pages_of_another_program_are_those_beside_it(folder, course, robot, name):
    """The pages beside the judged program were read for both: the two differed by 0.0 um, or had no motions."""
    shift = 40e-6 * np.column_stack([np.sin(np.arange(course.number.max()) / k) for k in (30, 25, 20)])
    texts = {"": (logs.part(), "PART"), "new": (logs.part(shift=shift), name)}
    for place, (content, main) in texts.items():
        text, pages = logs.pages(content, main)
        (folder / place).mkdir(exist_ok=True)
        for program, listing in {main: text, **pages}.items():
            (folder / place / f"{program}.LS").write_bytes(listing)
    write(folder, course_of_text(texts["new"][0], robot, default_frames()), logs.Logger(noise=2e-6))
    refused(executed(folder, "--also", f"new/{name}.LS"), 1, f"the robot ran new/{name}.LS, not this program")
    assert report(folder)["also"][0]["differs_um"] > 10


def test_a_broken_program_beside_is_refused_with_its_name(folder, course):
    write(folder, course)
    (folder / "BAD.LS").write_bytes(b"/PROG X\n")
    refused(executed(folder, "--also", "BAD.LS"), 2, "BAD.LS")


def test_waits_and_holds_are_named_with_their_place(folder, course):
    stop = int(np.flatnonzero(course.stop)[2])
    write(folder, course, run_of=logs.Run(ramp=0.25, wait={stop: 3.0}, hold=((12.0, 2.0),)))
    assert executed(folder).returncode == 0
    held, waited = (next(s for s in report(folder)["stands"] if s["program_stops"] is at) for at in (False, True))
    assert held["stood_s"] == pytest.approx(2.0, abs=0.05)
    assert waited["stood_s"] == pytest.approx(3.0, abs=0.15)
    assert waited["at"] == f"P[{course.number[stop]}]"
    said = {f["code"]: f["message"] for f in report(folder)["findings"]}
    assert f"{held['stood_s']:.2f} s near {held['at']}" in said["executed.held"]  # between two positions
    assert f"{waited['stood_s']:.2f} s at {waited['at']}" in said["executed.waited"]


def test_a_missing_log_and_a_folder_of_another_program_are_refused(folder, course):
    refused(run("executed", "PART.LS", cwd=folder), 2, "--log", "missing")
    write(folder, course)
    assert executed(folder, "-o", "out").returncode == 0
    (folder / "PART.LS").write_bytes(logs.part(name="TWO"))
    refused(executed(folder, "-o", "out"), 2, "PART")
    refused(executed(folder, "--max-um", "0"), 2, "--max-um")
