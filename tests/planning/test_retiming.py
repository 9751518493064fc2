"""Timing against an oracle: s(t) put onto the exact path, through inverse kinematics, differenced in time."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from shipped import EXACT
from toolpaths import laid

from compgen.core.exceptions import ImpossibleError
from compgen.core.pose import Pose
from compgen.pipelines.files.path_file import load_job
from compgen.planning import boundaries, curves, patterns, retiming, surfaces
from compgen.planning.retiming.trajectory import SAME_FEED
from compgen.robot import inverse_kinematics, joint_path

PATHS = Path(__file__).parents[2] / "paths"
STUDY = load_job(str(PATHS / "circle_1300.toml"), None, [EXACT])
ROBOT, POSTURE = STUDY.robot, STUDY.posture
PERIOD = 0.008  # s
LIMITS = (ROBOT.speed, ROBOT.acceleration, ROBOT.jerk)
ATOL_S, ATOL_M = 1e-9, 1e-12

CENTRE = np.array([1.2, -0.03, 0.203])
TOOL = Pose(np.array([0.05, 0.1, 0.25]), np.eye(3))  # m, so that the tool's turning moves the flange
HEXAGON = boundaries.hexagon(0.3, 0.2)


def square(side):
    h = side / 2
    corners = [(-h, -h), (h, -h), (h, h), (-h, h), (-h, -h)]
    return curves.join(*(curves.line(a, b, stop=True) for a, b in zip(corners, corners[1:], strict=False)))


PATTERNS = {
    "circle": (patterns.circle(0.3), surfaces.plane(CENTRE)),
    "square": (square(0.06), surfaces.plane(CENTRE)),
    "spiral": (patterns.spiral(0.3, 5), surfaces.conic(CENTRE, 2.0, -0.9, 0.3)),
    "smooth raster": (patterns.raster(HEXAGON, 0.03, 0.01, smooth=True), surfaces.conic(CENTRE, 0.6, 0.0, 0.2)),
    "iso9283": (patterns.iso9283(0.3), surfaces.plane(CENTRE)),
    "study circle": (STUDY.plan.path.pattern, surfaces.plane(CENTRE)),
}
# feed [m/s]: the study's; one that the limits cut on every curve and every short side
DRIVES = [(name, feed) for name in PATTERNS for feed in (0.2, 1.5)]


@cache
def planned(name):
    """Tool path and joint angles at its waypoints."""
    tool = laid(*PATTERNS[name], HEXAGON, spin=0.3, chord=1.5e-6, lift=0.02)
    return tool, joint_path.follow_branch(ROBOT, inverse_kinematics.flange_from_tool(tool.target, TOOL), POSTURE)


@cache
def driven(name, feed):
    """Tool path and motion."""
    tool, theta = planned(name)
    return tool, retiming.retime(ROBOT, tool.arc, theta, tool.stop, feed)


def joints(tool, s):
    """Joint angles on the exact path at arc lengths, (M, 6) [rad]."""
    segment = np.clip(np.searchsorted(tool.arc, s, side="right") - 1, 0, len(tool.span) - 1)
    fraction = (s - tool.arc[segment]) / np.diff(tool.arc)[segment]
    target, _ = tool.at(segment, fraction)
    theta, margin = inverse_kinematics.solve_flange(ROBOT, inverse_kinematics.flange_from_tool(target, TOOL), POSTURE)
    assert margin.min() > 0
    return np.unwrap(theta, axis=0)


def shares(tool, motion, step=1e-3):
    """Largest share of each joint's speed, acceleration and jerk limit, (3, 6), from differences in time.

    A difference of order k over a grid is the mean of the k-th derivative under a positive bump: it never exceeds the
    true maximum, jumps of the jerk included, and it reaches it wherever the maximum lasts a few steps.
    """
    theta = joints(tool, motion.phases.at(np.arange(0, motion.time[-1], step))[0])
    return np.array([np.abs(np.diff(theta, k, axis=0)).max(axis=0) / step**k / LIMITS[k - 1] for k in (1, 2, 3)])


def ends(count):
    stop = np.zeros(count, dtype=bool)
    stop[[0, -1]] = True
    return stop


def straight(arc, slope=0.5):
    """Joints in proportion to the arc length: nothing but the feed and the ramps to limit it."""
    return np.outer(arc, slope * np.linspace(0.2, 1.0, 6))


def drive_straight(arc, feed, stop=None):
    arc = np.asarray(arc, dtype=float)
    return retiming.retime(ROBOT, arc, straight(arc), ends(len(arc)) if stop is None else stop, feed)


@pytest.mark.parametrize(("name", "feed"), DRIVES)
def test_joint_speed_acceleration_and_jerk_stay_inside_their_limits(name, feed):
    tool, motion = driven(name, feed)
    share = shares(tool, motion)
    assert share.max() <= 1.0
    assert share[2].max() > 0.4  # the set-up bites: jerk is asked for
    assert_allclose(share, motion.utilisation, rtol=0.02, atol=0.01)


@pytest.mark.parametrize(("name", "feed"), DRIVES)
def test_speed_and_acceleration_are_zero_at_every_stop_and_nowhere_else(name, feed):
    tool, motion = driven(name, feed)
    _, v, a, _ = motion.phases.at(motion.time)
    assert_allclose(v[tool.stop], 0, atol=1e-10)  # m/s
    assert_allclose(a[tool.stop], 0, atol=1e-9)  # m/s2
    assert v[~tool.stop].min() > 1e-4
    # exactly zero where a run begins, and at its end to what the last phase rounds
    first = np.searchsorted(motion.phases.s0, tool.arc[tool.stop][:-1] - 1e-12)
    assert not motion.phases.v0[first].any()
    assert not motion.phases.a0[first].any()
    last = np.append(first[1:], len(motion.phases.start)) - 1
    p, t = motion.phases, motion.phases.duration[last]
    assert_allclose(p.v0[last] + p.a0[last] * t + p.j[last] * t**2 / 2, 0, atol=1e-10)


@pytest.mark.parametrize(("name", "feed"), DRIVES)
def test_feed_is_never_exceeded(name, feed):
    _, motion = driven(name, feed)
    v = motion.phases.at(np.linspace(0, motion.time[-1], 200_001))[1]
    assert v.max() <= feed * (1 + 1e-12)
    assert v.min() >= -1e-12  # m/s, what the last phase of a run rounds
    assert motion.speed.max() <= feed


@pytest.mark.parametrize(("name", "feed"), DRIVES)
def test_no_segment_is_driven_faster_than_its_programmed_speed_or_its_neighbours(name, feed):
    """A block's edge may lie inside a segment, and the motion change there."""
    tool, motion = driven(name, feed)
    mean = np.diff(tool.arc) / np.diff(motion.time)
    beside = np.max([motion.speed, np.append(motion.speed[1:], 0), np.append(0, motion.speed[:-1])], axis=0)
    assert np.all(mean <= beside * (1 + 1e-9))
    if name in ("circle", "spiral", "study circle"):
        cruising = np.abs(mean / motion.speed - 1) < 1e-6
        assert np.diff(tool.arc)[cruising].sum() > 0.7 * tool.arc[-1]


@pytest.mark.parametrize(("name", "feed"), DRIVES)
def test_time_rises_at_every_waypoint(name, feed):
    _, motion = driven(name, feed)
    assert motion.time[0] == 0
    assert np.diff(motion.time).min() > 1e-4  # s
    assert_allclose(motion.time[-1], motion.phases.duration.sum(), atol=ATOL_S)


@pytest.mark.parametrize(("name", "feed"), DRIVES)
def test_speed_integrated_is_the_arc_length(name, feed):
    tool, motion = driven(name, feed)
    t = np.linspace(0, motion.time[-1], 400_001)
    v = motion.phases.at(t)[1]
    assert_allclose(np.trapezoid(v, t), tool.arc[-1], atol=1e-8)  # m
    at = np.cumsum((v[1:] + v[:-1]) / 2 * np.diff(t))
    assert_allclose(np.interp(motion.time[1:], t[1:], at), tool.arc[1:], atol=1e-6)  # m, between the grid's points


@pytest.mark.parametrize(("name", "feed"), DRIVES)
def test_the_robot_is_at_each_waypoint_at_its_time(name, feed):
    tool, motion = driven(name, feed)
    assert_allclose(motion.phases.at(motion.time)[0], tool.arc, atol=ATOL_M)


@pytest.mark.parametrize(("name", "feed"), DRIVES)
def test_phases_join_in_place_speed_and_acceleration(name, feed):
    p = driven(name, feed)[1].phases
    t = p.duration
    assert_allclose((p.s0 + p.v0 * t + p.a0 * t**2 / 2 + p.j * t**3 / 6)[:-1], p.s0[1:], atol=ATOL_M)
    assert_allclose((p.v0 + p.a0 * t + p.j * t**2 / 2)[:-1], p.v0[1:], atol=1e-10)  # m/s
    assert_allclose((p.a0 + p.j * t)[:-1], p.a0[1:], atol=1e-9)  # m/s2
    assert_allclose((p.start + t)[:-1], p.start[1:], atol=ATOL_S)


def test_phases_at_are_the_polynomial_and_its_derivatives():
    phases = driven("circle", 0.2)[1].phases
    t, h = np.linspace(0.05, 1.0, 40), 1e-5
    s, v, a, _ = phases.at(t)
    (s1, v1, _, _), (s0, v0, _, _) = phases.at(t + h), phases.at(t - h)
    assert_allclose((s1 - s0) / (2 * h), v, atol=1e-8)
    assert_allclose((v1 - v0) / (2 * h), a, atol=1e-3)  # the jerk jumps inside a step
    assert np.ptp(s) > 0.01


def test_outside_the_motion_the_robot_stands_at_the_nearest_end():
    tool, motion = driven("circle", 0.2)
    s, v, _, _ = motion.phases.at(np.array([-5.0, motion.time[-1] + 5.0]))
    assert_allclose(s, [0, tool.arc[-1]], atol=ATOL_M)
    assert_allclose(v, 0, atol=1e-10)


def test_a_motion_of_some_waypoints_passes_them_at_their_times():
    """A line has the speed of the last of those that it stands for."""
    _, motion = driven("square", 0.2)
    N = len(motion.time)
    rows = np.array([0, 1, 4, N - 3, N - 1])
    some = motion.at(rows)
    assert_allclose(some.time, motion.time[rows], atol=0)
    assert_allclose(some.speed, motion.speed[[0, 3, N - 4, N - 2]], atol=0)
    assert_allclose(some.driven_speed, motion.driven_speed[[0, 3, N - 4, N - 2]], atol=0)


def test_when_inverts_where():
    _, motion = driven("spiral", 1.5)
    t = np.sort(np.random.default_rng(8).uniform(0, motion.time[-1], 5000))
    again = motion.phases.time(motion.phases.locate(motion.phases.at(t)[0]))
    assert_allclose(again, t, atol=1e-6)  # s, flat at the stops


def share_at_feed(motion, feed):
    """How much of the way is driven at feed."""
    edge = np.linspace(0, motion.time[-1], 200_001)
    s, v, _, _ = motion.phases.at((edge[1:] + edge[:-1]) / 2)
    return np.diff(edge)[v > feed * (1 - 1e-9)].sum() * feed / s[-1]


def test_study_circle_runs_at_feed_but_for_its_ramps():
    assert share_at_feed(driven("study circle", 0.2)[1], 0.2) > 0.97


def test_long_straight_line_at_low_feed_is_driven_at_feed():
    arc = np.arange(0, 1.0001, 0.01)
    motion = drive_straight(arc, 0.02)
    assert share_at_feed(motion, 0.02) > 0.99
    assert np.all(motion.speed == 0.02)
    assert 50.0 < motion.time[-1] < 50.2  # 1 m at 20 mm/s, and two ramps of 20 mm/s
    assert_allclose(np.diff(motion.time)[5:-5], 0.5, atol=ATOL_S)


def test_segments_shorter_than_feed_times_8_ms_are_slower():
    """0.5 mm segments in the middle of 2 mm ones: 62.5 mm/s is what 8 ms can follow, in whole mm/s 62."""
    arc = np.concatenate([np.arange(0, 0.2, 2e-3), 0.2 + np.arange(0, 0.05, 5e-4), np.arange(0.25, 0.4501, 2e-3)])
    motion = drive_straight(arc, 0.2)
    length = np.diff(arc)
    short = length < 1e-3
    assert short.sum() == 100
    assert_allclose(motion.speed[short], 0.062, atol=1e-12)
    assert np.all(motion.speed[np.r_[:80, -80:0]] == 0.2)
    assert np.all(length[short] / np.diff(motion.time)[short] <= 0.0625)
    assert 0.5 < share_at_feed(motion, 0.2) < 0.9


@pytest.mark.parametrize("segment_um", [1000.0, 100.0, 10.0, 5.0, 1.0])
def test_every_segment_takes_at_least_an_interpolation_period(segment_um):
    arc = np.arange(0, 300) * segment_um * 1e-6
    motion = drive_straight(arc, 0.2)
    assert np.diff(motion.time).min() >= PERIOD * (1 - 1e-9)


def test_one_short_segment_takes_an_interpolation_period_wherever_it_lies():
    """Also across the edge of a block, where the motion may change."""
    for before in np.linspace(0.0990, 0.1012, 45):  # m, past a fifth of the path in steps of 50 um
        arc = np.concatenate([np.linspace(0, before, 51), np.linspace(before + 4e-4, 0.5, 201)])
        motion = drive_straight(arc, 0.2)
        assert np.diff(motion.time)[50] >= PERIOD * (1 - 1e-9)
        assert share_at_feed(motion, 0.2) > 0.5


@pytest.mark.parametrize("segment_um", [16, 100, 700])
@pytest.mark.parametrize("rounds_up", [False, True])
def test_lines_of_less_than_a_period_last_as_long_in_the_plan_as_in_the_text(segment_um, rounds_up):
    """The text is its own clock: length over word, and a whole number of periods where the controller rounds up."""
    arc = np.arange(0, 0.2, segment_um * 1e-6)
    controller = replace(ROBOT.controller, rounds_up_to_period=rounds_up)
    motion = retiming.retime(replace(ROBOT, controller=controller), arc, straight(arc), ends(len(arc)), 0.2, lines=True)
    length, taken = np.diff(arc), np.diff(motion.time)
    written = length / motion.speed
    if rounds_up:
        written = 0.008 * np.ceil(written / 0.008 - 1e-9)
    inner = slice(len(length) // 4, -len(length) // 4)
    assert_allclose(taken[inner], written[inner], rtol=1e-9)
    assert (taken[inner] < 0.008 * (1 + 1e-9)).all()


@pytest.mark.parametrize("feed_mm_s", [0.1, 0.5, 0.9])
def test_feeds_below_a_millimetre_a_second_are_not_exceeded_either(feed_mm_s):
    feed = feed_mm_s * 1e-3
    arc = np.concatenate([np.arange(0, 4e-3, 1e-4), 4e-3 + np.arange(0, 500) * (feed * PERIOD / 2)])
    motion = drive_straight(arc, feed)
    v = motion.phases.at(np.linspace(0, motion.time[-1], 20_001))[1]
    assert v.max() <= feed * (1 + 1e-12)
    assert motion.speed.max() <= feed


def test_speeds_that_are_held_are_whole_millimetres_a_second():
    for name, share in (("circle", 1.0), ("spiral", 0.9)):
        _, motion = driven(name, 1.5)
        reduced = motion.speed[motion.speed < 1.5] * 1e3
        assert len(reduced) > 100
        assert np.mean(np.abs(reduced - np.round(reduced)) < 1e-9) >= share


@pytest.mark.parametrize("feed_mm_s", [0.3, 2.95, 7.95, 20.0, 100.0])
def test_a_line_laid_for_one_period_slows_nothing(feed_mm_s):
    """What digits and a correction add to it is left out of its length: (v T - r) / (1 + e)."""
    feed = feed_mm_s * 1e-3
    one = (feed * PERIOD - np.sqrt(3) * 1e-6) / (1 + 5e-4)
    arc = np.concatenate([np.linspace(0, 0.1, 11), 0.1 + one + np.linspace(0, 0.1, 11)])
    assert np.all(drive_straight(arc, feed).speed == feed)


@pytest.mark.parametrize("feed_mm_s", [2.95, 3.9, 7.95, 19.9])
def test_a_slow_block_loses_little_to_the_step_of_its_speed(feed_mm_s):
    """Lines of 0.6 periods hold it back: whole millimetres a second would cost up to 40 %."""
    feed = feed_mm_s * 1e-3
    arc = np.arange(0, 1000) * (0.6 * feed * PERIOD)
    speed = drive_straight(arc, feed).speed[300:700]
    assert np.all(speed <= 0.6 * feed * (1 + 1e-9))
    assert np.all(speed >= 0.98 * 0.6 * feed)


def test_driven_speed_takes_the_planned_time_of_each_run():
    for name in ("circle", "spiral"):
        path, motion = driven(name, 0.2)
        ends = np.flatnonzero(path.stop)
        assert_allclose(np.add.reduceat(np.diff(path.arc) / motion.driven_speed, ends[:-1]), np.diff(motion.time[ends]))
        assert np.all(motion.driven_speed <= motion.speed * (1 + 1e-6))


def test_length_over_programmed_speed_is_the_planned_time_away_from_stops():
    """What the program says takes as long as what was planned, also where the speed changes on the way."""
    path, motion = driven("spiral", 1.5)
    middle = slice(200, -200)
    programmed = (np.diff(path.arc) / motion.speed)[middle].sum()
    assert_allclose(programmed, np.diff(motion.time)[middle].sum(), rtol=2e-3)


def test_a_stop_between_costs_time_and_no_stop_costs_none():
    arc = np.arange(0, 0.5001, 0.01)
    stop = ends(len(arc))
    free = drive_straight(arc, 0.2)
    stop[25] = True
    halted = drive_straight(arc, 0.2, stop)
    assert_allclose(halted.phases.at(halted.time[25:26])[1], 0, atol=1e-10)
    assert free.phases.at(free.time[25:26])[1] == 0.2
    # both halves alike, and each as the whole is at its own end
    assert_allclose(halted.time[25], halted.time[-1] / 2, atol=ATOL_S)
    assert halted.time[-1] > free.time[-1] + 0.1


@pytest.mark.parametrize("feed", [0.05, 0.2, 1.5])
def test_the_way_back_takes_as_long(feed):
    arc = np.linspace(0, 1.2, 241)
    theta = 0.4 * np.sin(np.outer(arc, [3, 5, 7, 9, 4, 6]) + np.arange(6))
    forth = retiming.retime(ROBOT, arc, theta, ends(241), feed)
    back = retiming.retime(ROBOT, 1.2 - arc[::-1], theta[::-1], ends(241), feed)
    assert_allclose(back.time[-1], forth.time[-1], rtol=2e-3)


def test_lower_joint_limits_never_make_the_robot_faster():
    arc = np.linspace(0, 1.2, 241)
    theta = 0.4 * np.sin(np.outer(arc, [3, 5, 7, 9, 4, 6]) + np.arange(6))
    times = []
    for share in (1.0, 0.5, 0.1):
        slow = replace(
            ROBOT, speed=share * ROBOT.speed, acceleration=share * ROBOT.acceleration, jerk=share * ROBOT.jerk
        )
        motion = retiming.retime(slow, arc, theta, ends(241), 1.0)
        assert motion.utilisation.max() <= 1.0
        times.append(motion.time[-1])
    assert times[0] < times[1] < times[2]


def test_joints_that_stand_still_limit_nothing():
    arc = np.linspace(0, 1, 101)
    motion = retiming.retime(ROBOT, arc, np.ones((101, 6)), ends(101), 0.2)
    assert motion.utilisation.max() < 1e-9
    assert_allclose(motion.time[-1], 5.0, atol=0.1)


def test_progress_runs_to_one():
    shares_done: list[float] = []
    tool, theta = planned("square")
    retiming.retime(ROBOT, tool.arc, theta, tool.stop, 0.2, shares_done.append)
    assert shares_done == sorted(shares_done)
    assert len(shares_done) > 2
    assert shares_done[-1] == 1.0


def test_same_input_gives_the_same_motion():
    tool, theta = planned("spiral")
    motion = driven("spiral", 0.2)[1]
    again = retiming.retime(ROBOT, tool.arc, theta, tool.stop, 0.2)
    assert np.array_equal(again.time, motion.time)
    assert np.array_equal(again.speed, motion.speed)


@pytest.mark.parametrize("limit", ["speed", "acceleration", "jerk"])
def test_a_limit_of_zero_is_impossible(limit):
    arc = np.linspace(0, 1, 101)
    stuck = replace(ROBOT, **{limit: getattr(ROBOT, limit) * [1, 1, 0, 1, 1, 1]})
    with pytest.raises(ImpossibleError):
        retiming.retime(stuck, arc, straight(arc), ends(101), 0.2)


def test_coincident_waypoints_are_impossible():
    arc = np.array([0.0, 0.1, 0.1, 0.2])
    with pytest.raises(ImpossibleError):
        drive_straight(arc, 0.2)


def test_a_path_that_only_a_crawl_can_follow_is_crawled_or_refused():
    """Joint 1 swings by half a radian every 2 mm: its jerk allows well below 1 mm/s."""
    arc = np.linspace(0, 0.05, 2001)
    theta = np.zeros((2001, 6))
    theta[:, 0] = 0.5 * np.sin(2 * np.pi * arc / 0.002)
    try:
        motion = retiming.retime(ROBOT, arc, theta, ends(2001), 0.2)
    except ImpossibleError:
        return
    assert motion.utilisation.max() <= 1.0


@st.composite
def smooth_joint_paths(draw):
    """Sums of sines, longer than twelve waypoints each, on unevenly spaced waypoints, with stops between."""
    count = draw(st.integers(20, 300))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    arc = np.concatenate([[0], np.cumsum(rng.uniform(0.4, 1, count - 1))])
    arc *= draw(st.floats(0.05, 2.0)) / arc[-1]
    theta = np.zeros((count, 6))
    for _ in range(draw(st.integers(1, 3))):
        wave = max(12 * arc[-1] / count, 0.05) * draw(st.floats(1, 15))
        size = draw(st.floats(1e-3, 1)) * wave * rng.normal(size=6)
        theta += size * np.sin(2 * np.pi * arc[:, None] / wave + rng.uniform(0, 2 * np.pi, 6))
    stop = ends(count)
    for n in draw(st.lists(st.integers(1, count - 2), max_size=2)):
        stop[n] = True
    # arms that are quick to speed up and slow to do so, and the other way round
    quick, sudden = (10 ** draw(st.floats(-1, 1.5)) for _ in range(2))
    arm = replace(ROBOT, acceleration=quick * ROBOT.acceleration, jerk=sudden * ROBOT.jerk)
    return arm, arc, theta, stop, draw(st.floats(0.003, 2.0))


@settings(max_examples=150, deadline=None, derandomize=True, database=None)
@given(smooth_joint_paths())
def test_any_smooth_joint_path_is_driven_inside_its_limits(drawn):
    arm, arc, theta, stop, feed = drawn
    motion = retiming.retime(arm, arc, theta, stop, feed)
    assert motion.utilisation.max() <= 1.0
    # a line of a period that is shorter by so little, or by what its digits and a correction add, names the feed
    assert np.diff(motion.time).min() >= (PERIOD * (1 - SAME_FEED) - np.sqrt(3) * 1e-6 / feed) / (1 + 1e-3)
    t = np.linspace(0, motion.time[-1], 2001)
    s, v, _, _ = motion.phases.at(t)
    assert v.max() <= feed * (1 + 1e-12)
    assert np.all(np.diff(s) >= -ATOL_M)
    assert_allclose([s[0], s[-1]], arc[[0, -1]], atol=ATOL_M)
    assert_allclose(motion.phases.at(motion.time[stop])[1], 0, atol=1e-10)
    assert_allclose(motion.phases.at(motion.time)[0], arc, atol=ATOL_M)


def test_a_few_short_segments_slow_only_themselves():
    """A rounded corner of two lines of 30 um, in the middle of half a metre."""
    arc = np.concatenate([np.linspace(0, 0.25, 26), [0.25003, 0.25006], 0.25006 + np.linspace(0.01, 0.25, 25)])
    theta = np.zeros((len(arc), 6))
    theta[:, 0] = arc
    motion = retiming.retime(ROBOT, arc, theta, ends(len(arc)), 0.1)
    assert motion.time[-1] < 1.25 * 0.5 / 0.1 + 0.5  # with blocks of 20 mm it took 5 s more
    assert motion.time[27] - motion.time[25] > 2 * PERIOD * (1 - 1e-3)
