"""Logs as the maker's motion code writes them: rect(T) smoothed by two means, with held and missing rows.

``motion_code`` writes them by the formula, with nothing of the package.
"""

import json
import tomllib

import numpy as np
import pytest
from command_line import refused, run
from motion_code import DOWN, PERIOD, driven, program, spread
from shipped import ROOT


def write(folder, time, place, text, digits=3, pairs=False, lost=16, turned=DOWN):
    """Every 16th row is missing; with pairs the row behind it shows the position of the next one."""
    place = np.column_stack([place, np.broadcast_to(turned, place.shape)])
    if pairs:
        at = np.arange(1, len(time) - 1) % lost == 0
        place = place.copy()
        place[1:-1][at] = place[2:][at]
    keep = np.ones(len(time), dtype=bool)
    keep[lost - 1 :: lost] = False
    rows = [
        f"{1e3 * t:.0f},{','.join(f'{v:.{digits}f}' for v in p)}" for t, p in zip(time[keep], place[keep], strict=True)
    ]
    (folder / "log.csv").write_text("\n".join(["time_ms,x_mm,y_mm,z_mm,w_deg,p_deg,r_deg", *rows, ""]))
    (folder / "RUN.LS").write_bytes(text)
    (folder / "mine.toml").write_text((ROOT / "robots" / "m710ic50.toml").read_text())


def counts_no_periods(folder):
    """The robot file says that lines last as long as length over speed, which the log contradicts."""
    text = (folder / "mine.toml").read_text()
    assert text.count("rounds_up_to_period = true") == 1
    (folder / "mine.toml").write_text(text.replace("rounds_up_to_period = true", "rounds_up_to_period = false"))


def executed(folder, *more):
    result = run("executed", "RUN.LS", "--log", "log.csv", "--robot", "mine.toml", "-o", "out", *more, cwd=folder)
    return result, json.loads((folder / "out" / "executed.json").read_text())


SQUARE = [(1000, -100, 100), (1300, -100, 100), (1300, 100, 100), (1000, 100, 100), (1000, -100, 100)]
ROUND = [True, False, False, False, True]


def identify(folder):
    result = run("identify-motion", "RUN.LS", "--log", "log.csv", "--robot", "mine.toml", "-o", "new.toml", cwd=folder)
    motion = tomllib.loads((folder / "new.toml").read_text())["motion"] if (folder / "new.toml").exists() else {}
    return result, motion


TO_AND_FRO = [(1300, 0, 100), (900, 0, 100), (1300, 0, 100), (900, 0, 100), (1300, 0, 100)]


def test_a_run_to_and_fro_on_one_line_after_standing_tells_override_time_and_means(tmp_path):
    """Nothing but its ramps shows the smoothing: 200 mm/s between stops, 8 s of standing before."""
    fine = [True] * 5
    time, place = driven(TO_AND_FRO, 200, fine, before=8.4, after=2.0)
    write(tmp_path, time, place, program(TO_AND_FRO, 200, fine))
    result, report = executed(tmp_path)
    assert [s["percent"] for s in report["override"]] == [100]
    assert report["verdict"] == "inside"
    assert not {"executed.held", "executed.waited"} & {f["code"] for f in report["findings"]}
    result, motion = identify(tmp_path)
    assert result.returncode == 0
    assert sum(motion["moving_average_ms"]) == pytest.approx(208, abs=1)
    assert motion["identified"]["verdict"] == "foretells"  # no bend was seen
    assert not {"held_out_um", "held_out_rms_um"} & set(motion["identified"])  # nor is one a row of the band


ANGLE = np.radians(np.arange(0, 361, 6))
CURVE = [
    (1100 + 200 * np.cos(a), 200 * np.sin(a), 100 + 40 * np.sin(2 * a)) for a in ANGLE
]  # lines of 21 to 23 mm, some 13 to 15 periods at 200 mm/s
SMOOTH = [True] + [False] * (len(CURVE) - 2) + [True]


def test_a_curve_of_lines_in_whole_periods_with_rows_in_pairs_may_be_commanded_against(tmp_path):
    """176 + 168 ms; the last seven lines are a period slower than their words, as a controller near its limits is."""
    slower = [0] * (len(CURVE) - 8) + [1] * 7
    time, place = driven(CURVE, 200, SMOOTH, means=(0.176, 0.168), slower=slower)
    write(tmp_path, time, place, program(CURVE, 200, SMOOTH), pairs=True)
    counts_no_periods(tmp_path)
    result, report = executed(tmp_path)
    assert [s["percent"] for s in report["override"]] == [100]
    assert "executed.periods" in {f["code"] for f in report["findings"]}
    result, motion = identify(tmp_path)
    assert result.returncode == 0
    assert motion["identified"]["verdict"] == "may be commanded against"
    assert sum(motion["moving_average_ms"]) == pytest.approx(176 + 168, abs=2)
    assert np.linalg.norm(motion["moving_average_ms"]) == pytest.approx(np.hypot(176, 168), rel=0.003)
    held = json.loads((tmp_path / "new.json").read_text())["held_out"]
    assert held["rms_um"] < 0.02 * held["plain_um"]
    assert held["plain_um"] > 100
    assert held["slowed_share"] == 0  # those seven lines are taken as long as they took


@pytest.mark.parametrize("means", [(216, 208), (176, 168), (104, 104)])
@pytest.mark.parametrize("waves", [0, 40])
def test_means_are_whole_periods_and_lie_in_their_intervals(tmp_path, means, waves):
    """A circle shows the sum of squares, and how it is shared out in its first and last blocks alone."""
    circle = [(1100 + 200 * np.cos(a), 200 * np.sin(a), 100 + waves * np.sin(3 * a)) for a in ANGLE]
    time, place = driven(circle, 200, SMOOTH, means=np.array(means) / 1e3)
    write(tmp_path, time, place, program(circle, 200, SMOOTH))
    result, motion = identify(tmp_path)
    assert result.returncode == 0, result.stderr
    assert motion["moving_average_ms"] == pytest.approx(means, abs=0.01)
    intervals = json.loads((tmp_path / "new.json").read_text())["motion"]["interval_ms"]
    for mean, (low, high) in zip(means, intervals, strict=True):
        assert low - 0.05 <= mean <= high + 0.05


@pytest.mark.parametrize(("end", "cnt", "speed"), [
    ((1750, -250, 100), 100, 400), ((1750, -250, 100), 50, 400), ((1750, -250, 100), 50, 200),
    ((1350, -520, 100), 100, 400),
])  # fmt: skip
def test_two_lines_of_which_the_farther_out_has_longer_means_tell_both(tmp_path, end, cnt, speed):
    """As an M-900iA/350 has them: whole periods, 8 % more for each m2 of the most that the arm is spread on a line."""
    lines, fine = [(900, 500, 100), (1200, 50, 100), end], [True, False, True]
    widest = np.maximum(spread(lines)[:-1], spread(lines)[1:])
    periods = np.round(60 * (1 + 0.08 * (widest - 2)))
    assert periods[1] - periods[0] > 3
    waits = PERIOD * np.floor((periods - 1) * (1 - np.sqrt(cnt / 100))) * [1, 0]
    means = PERIOD * np.column_stack([(periods + 1) // 2, periods // 2])
    time, place = driven(lines, speed, fine, means, waits=waits)
    write(tmp_path, time, place, program(lines, speed, fine, cnt))
    result, motion = identify(tmp_path)
    assert result.returncode == 0
    assert motion["identified"]["verdict"] == "foretells"
    assert "differ from line to line" in result.stdout
    longer = 1 + motion["reach_percent_m2"] / 100 * (widest - motion["reach_at_m2"])
    np.testing.assert_allclose(sum(motion["moving_average_ms"]) * longer / (1e3 * PERIOD), periods, atol=0.3)
    left = motion["identified"].get("held_out_rms_um")
    assert left is None if (cnt, speed) == (50, 400) else left < 5  # none: no stretch held out had the bend


def test_a_robot_file_that_counts_whole_periods_is_not_told_to_and_the_copy_of_another_does(tmp_path):
    time, place = driven(CURVE, 200, SMOOTH)
    write(tmp_path, time, place, program(CURVE, 200, SMOOTH))
    _, report = executed(tmp_path)
    assert "executed.periods" not in {f["code"] for f in report["findings"]}  # as it is shipped
    counts_no_periods(tmp_path)
    identify(tmp_path)
    copy = (tmp_path / "new.toml").read_text()
    assert tomllib.loads(copy)["controller"]["rounds_up_to_period"] is True
    (tmp_path / "mine.toml").write_text(copy)
    _, report = executed(tmp_path)
    assert "executed.periods" not in {f["code"] for f in report["findings"]}


@pytest.mark.parametrize("part", [slice(0, 700), slice(600, None)])
def test_a_part_of_a_log_is_refused_in_one_line(tmp_path, part):
    time, place = driven(CURVE, 200, SMOOTH)
    write(tmp_path, time[part] - time[part][0], place[part], program(CURVE, 200, SMOOTH))
    result, motion = identify(tmp_path)
    refused(result, 2, "log.csv", "a part of the program's path only", "log a whole run")
    assert not motion


def test_a_log_whose_rows_are_in_another_order_is_refused_in_one_line(tmp_path):
    half = CURVE[:40], 200, [True] + [False] * 38 + [True]
    time, place = driven(*half)
    write(tmp_path, time, np.roll(place, len(place) // 3, axis=0), program(*half))
    refused(identify(tmp_path)[0], 2, "log.csv", "another program", "not in the order of the program")


def test_strokes_too_short_for_their_speed_are_told_to_be_logged_slower_and_are_taken_then(tmp_path):
    """20 mm at 200 mm/s are 100 ms, half of what is smoothed over: the robot turns before it was there."""
    places = [(1000 + 20 * (k // 2 % 2 != k % 2), 3 * (k // 2), 100) for k in range(24)]
    run = places, 200, [True] + [False] * 22 + [True]
    time, place = driven(*run)
    write(tmp_path, time, place, program(*run))
    refused(identify(tmp_path)[0], 2, "log.csv", "the robot travels 52 % less than the program", "at a lower override")
    time, place = driven(*run, override=0.3)
    write(tmp_path, time, place, program(*run))
    assert identify(tmp_path)[0].returncode == 0


def test_the_same_at_half_override_is_one_override(tmp_path):
    time, place = driven(CURVE, 100, SMOOTH)
    write(tmp_path, time, place, program(CURVE, 200, SMOOTH))
    _, report = executed(tmp_path)
    assert [s["percent"] for s in report["override"]] == [50]


def test_a_run_that_is_faster_than_its_text_is_another_program(tmp_path):
    time, place = driven(TO_AND_FRO, 300, [True] * 5)
    write(tmp_path, time, place, program(TO_AND_FRO, 200, [True] * 5))
    result, report = executed(tmp_path)
    refused(result, 1, "150 % of the written speeds", "no override is above 100 %")
    assert "drove faster than planned" in next(f["message"] for f in report["findings"] if f["code"] == "executed.time")
    refused(identify(tmp_path)[0], 2, "log.csv", "150 % of the written speeds")


def test_a_curve_whose_every_corner_waits_is_not_taken_for_a_run_at_a_lower_override(tmp_path):
    """CNT80 holds each line of a tenth of a second up by 24 ms: no row is away from corners."""
    waits = PERIOD * np.floor(35 * (1 - np.sqrt(0.8))) * ~np.array(SMOOTH[1:])
    time, place = driven(CURVE, 200, SMOOTH, means=(0.152, 0.136), waits=waits)
    write(tmp_path, time, place, program(CURVE, 200, SMOOTH, cnt=80))
    _, report = executed(tmp_path)
    assert [(s["percent"], s["words"]) for s in report["override"]] == [
        (100, "100 % (82 to 100 % drive these lines alike)")
    ]
    result, motion = identify(tmp_path)
    assert result.returncode == 0, result.stderr
    np.testing.assert_allclose(motion["moving_average_ms"], [152, 136], atol=2)


def test_strokes_shorter_than_what_is_smoothed_over_are_no_other_program(tmp_path):
    """A raster of 200 mm at steps of 25 mm through 320 + 320 ms: its corners are cut by 19 mm, its strokes are true."""
    raster = [(1000 + 200 * (k // 2 % 2 != k % 2), 25 * (k // 2), 100) for k in range(16)]
    fine = [True] + [False] * 14 + [True]
    time, place = driven(raster, 200, fine, means=(0.32, 0.32))
    write(tmp_path, time, place, program(raster, 200, fine))
    result, report = executed(tmp_path)
    assert (result.returncode, report["verdict"]) == (0, "inside")
    place[np.abs(place[:, 0] - 1100) < 99] += [0, 0, 1.5]  # another program, but for its stops
    write(tmp_path, time, place, program(raster, 200, fine))
    refused(executed(tmp_path)[0], 1, "another program ran along the same way")


@pytest.mark.parametrize("dwell", [0.0, 1.0])
def test_a_stop_whose_ramps_are_longer_than_planned_is_none_where_it_stood(tmp_path, dwell):
    """FINE waits until 320 + 320 ms have run out: longer by 0.4 s than the robot file's accelerations say."""
    path, fine = [*SQUARE, *SQUARE[1:]], [*ROUND, *ROUND[1:]]
    waits = dwell * np.array([0, 0, 0, 1, 0, 0, 0, 0])
    time, place = driven(path, 200, fine, means=(0.32, 0.32), waits=waits)
    write(tmp_path, time, place, program(path, 200, fine))
    _, report = executed(tmp_path)
    stood = [s["at"] for s in report["stands"]]
    assert stood == (["P[5]"] if dwell else [])


def test_a_corner_cut_by_eighteen_millimetres_is_no_other_program(tmp_path):
    square = [(1000, -100, 100), (1300, -100, 100), (1300, 100, 100), (1000, 100, 100), (1000, -100, 100)]
    fine = [True, False, False, False, True]
    time, place = driven(square, 500, fine, means=(0.3, 0.3))
    write(tmp_path, time, place, program(square, 500, fine))
    result, motion = identify(tmp_path)
    assert result.returncode == 0
    np.testing.assert_allclose(motion["moving_average_ms"], [300, 300], atol=5)


def along_a_square_with_rounded_corners(distance, speed, ramp):
    """Time and places of a motion at one speed along SQUARE, corners parabolas that begin a distance before."""
    parts = [np.array(SQUARE[:1], dtype=float)]
    share = np.linspace(0, 1, 400)[:, None]
    for before, corner, after in np.array(list(zip(SQUARE, SQUARE[1:], SQUARE[2:], strict=False)), dtype=float):
        begin, end = (corner + distance * (p - corner) / np.linalg.norm(p - corner) for p in (before, after))
        parts.append((1 - share) ** 2 * begin + 2 * share * (1 - share) * corner + share**2 * end)
    way = np.vstack([*parts, SQUARE[-1:]])
    arc = np.append(0, np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1)))
    lasts = arc[-1] / speed
    time = PERIOD * np.arange(round((lasts + ramp + 2) / PERIOD))
    done = (np.clip(time - 1, 0, None) ** 2 - np.clip(time - 1 - ramp, 0, None) ** 2) / 2
    done -= (np.clip(time - 1 - lasts, 0, None) ** 2 - np.clip(time - 1 - lasts - ramp, 0, None) ** 2) / 2
    place = np.column_stack([np.interp(speed / ramp * done, arc, c) for c in way.T])
    return time, place


@pytest.mark.parametrize(("distance", "speed"), [(10, 200), (5, 100), (6, 200)])
def test_corners_that_are_rounded_by_a_distance_and_not_slowed_are_of_no_controller_that_is_tried(
    tmp_path, distance, speed
):
    """Their ramps may be those of a mean: what it makes of a bend this log does not show."""
    time, place = along_a_square_with_rounded_corners(distance, speed, 0.1)
    write(tmp_path, time, place, program(SQUARE, speed, ROUND), digits=4)
    result, _ = identify(tmp_path)
    refused(result, 1, "not its speed in bends", "new.toml not written")


@pytest.mark.parametrize(("head", "words"), [
    ("timestamp,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg", ["no column time_s", "timestamp", "give seconds as"]),
    ("time_ms,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg", ["--j3 link2"]),
])  # fmt: skip
def test_a_clock_without_unit_and_joints_with_the_other_j3_are_refused_in_one_line(tmp_path, robot, head, words):
    from compgen.core.pose import Pose
    from compgen.core.rotations import from_wpr
    from compgen.robot.inverse_kinematics import Posture, solve_flange

    time, place = driven(CURVE, 200, SMOOTH)
    write(tmp_path, time, place, program(CURVE, 200, SMOOTH))
    rotation = np.tile(from_wpr(*np.radians(DOWN)), (len(place), 1, 1))
    joints = np.degrees(robot.to_pendant(solve_flange(robot, Pose(place * 1e-3, rotation), Posture()).theta))
    joints[:, 2] += joints[:, 1]  # against link 2
    rows = [",".join(f"{v:.4f}" for v in row) for row in np.column_stack([1e3 * time, joints]).tolist()]
    (tmp_path / "log.csv").write_text("\n".join([head, *rows, ""]))
    result = run("executed", "RUN.LS", "--log", "log.csv", "--robot", "mine.toml", "-o", "out", cwd=tmp_path)
    refused(result, 2, *words)
    if "--j3 link2" in words:
        result, report = executed(tmp_path, "--j3", "link2")
        assert report["verdict"] == "inside"
        joints[:, 5] += 3  # the same places by a tool that is turned
        rows = [",".join(f"{v:.4f}" for v in row) for row in np.column_stack([1e3 * time, joints]).tolist()]
        (tmp_path / "log.csv").write_text("\n".join([head, *rows, ""]))
        words = ["executed", "RUN.LS", "--log", "log.csv", "--robot", "mine.toml", "--j3", "link2"]
        refused(run(*words, cwd=tmp_path), 2, "j1_deg to j6_deg", "turned by 3.0 deg", "another tool")


@pytest.mark.parametrize("moved", [(0.2, 0, 0), (0.12, -0.12, 0)])
def test_a_run_of_another_tool_or_program_is_seen_where_it_stood_though_a_line_leads_through_there(tmp_path, moved):
    """Corners are cut by millimetres: 0.2 mm are seen at stops alone, and along the line that begins there."""
    time, place = driven(np.add(SQUARE, moved), 200, ROUND, means=(0.152, 0.136))
    write(tmp_path, time, place, program(SQUARE, 200, ROUND))
    result, _ = executed(tmp_path)
    refused(result, 1, f"(up to {1e3 * np.linalg.norm(moved):.0f} at P[", "another frame or tool")
    refused(identify(tmp_path)[0], 2, "log.csv", "another frame or tool")


def test_one_stop_of_several_that_is_elsewhere_is_another_program(tmp_path):
    path, fine = [*SQUARE, *SQUARE[1:], *SQUARE[1:]], [*ROUND, *ROUND[1:], *ROUND[1:]]
    driven_path = [*path[:4], (1000.3, -100, 100), *path[5:]]
    time, place = driven(driven_path, 200, fine, means=(0.152, 0.136))
    write(tmp_path, time, place, program(path, 200, fine))
    refused(executed(tmp_path)[0], 1, "up to 300 at P[5]")


@pytest.mark.parametrize("off", [0, 3])
def test_a_tool_that_turns_on_its_lines_is_the_programs_own_and_one_that_is_turn_errors_is_not(tmp_path, off):
    """By 30 deg on a line of 500 mm: what the text has at its ends is not what it has between."""
    lines, angles, fine = [(1000, -300, 100), (1000, 200, 100), (1300, 200, 100)], [0, 30, -20], [True, False, True]
    turned = [(180, angle, 0) for angle in angles]
    time, place = driven(lines, 200, fine, means=(0.152, 0.136))
    _, angle = driven(turned, [2.5, 1.5], fine, means=(0.152, 0.136))
    write(tmp_path, time, place, program(lines, 200, fine, turned=turned), turned=np.add(angle, [off, 0, 0]))
    if off:
        result = run("executed", "RUN.LS", "--log", "log.csv", "--robot", "mine.toml", cwd=tmp_path)
        refused(result, 2, "w_deg to r_deg", "turned by 3.0 deg", "another tool")
    else:
        result, motion = identify(tmp_path)
        assert result.returncode == 0, result.stderr
        np.testing.assert_allclose(motion["moving_average_ms"], [152, 136], atol=1)


@pytest.mark.parametrize(("override", "reserve"), [(1, ""), (0.6, "60 % override, and programs are made for 100")])
def test_what_corners_wait_at_cnt50_is_not_taken_for_an_override(tmp_path, override, reserve):
    """120 ms at each of six corners a second apart, and the means are those that it was driven with."""
    path, fine = [*SQUARE, *SQUARE[1:]], [*ROUND, *ROUND[1:]]
    waits = PERIOD * np.floor(52 * (1 - np.sqrt(0.5))) * ~np.array(fine[1:])
    time, place = driven(path, 200, fine, means=(0.216, 0.208), waits=waits, override=override)
    write(tmp_path, time, place, program(path, 200, fine, cnt=50))
    _, report = executed(tmp_path)
    assert [s["percent"] for s in report["override"]] == [100 * override]
    result, motion = identify(tmp_path)
    assert result.returncode == 0, result.stderr
    np.testing.assert_allclose(motion["moving_average_ms"], [216, 208], atol=1)
    assert motion["identified"]["verdict"] == ("foretells" if reserve else "may be commanded against")
    assert reserve in result.stdout + result.stderr


def test_a_run_whose_waits_are_not_told_from_its_override_is_refused(tmp_path):
    """120 ms at each of sixty corners, at 60 % override: a mean of 90 ms leaves 8 um of 48, and takes half the time."""
    waits = PERIOD * np.floor(52 * (1 - np.sqrt(0.5))) * ~np.array(SMOOTH[1:])
    time, place = driven(CURVE, 200, SMOOTH, means=(0.216, 0.208), waits=waits, override=0.6)
    write(tmp_path, time, place, program(CURVE, 200, SMOOTH, cnt=50))
    result, motion = identify(tmp_path)
    assert result.returncode == 1
    assert not motion
    assert "how long its corners wait, or its override, is not known" in " ".join(result.stdout.split())


def test_corners_below_cnt50_are_not_commanded_against(tmp_path):
    """No log of the motion code shows what they wait: how two means share their sum is not told right."""
    path, fine = [*SQUARE, *SQUARE[1:]], [*ROUND, *ROUND[1:]]
    waits = PERIOD * np.floor(52 * (1 - np.sqrt(0.25))) * ~np.array(fine[1:])
    time, place = driven(path, 200, fine, means=(0.216, 0.208), waits=waits)
    write(tmp_path, time, place, program(path, 200, fine, cnt=25))
    result, motion = identify(tmp_path)
    assert result.returncode == 0, result.stderr
    assert motion["identified"]["verdict"] == "foretells"
    assert "corners below CNT50" in " ".join((result.stdout + result.stderr).split())
