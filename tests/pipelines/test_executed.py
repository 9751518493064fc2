"""Runs of every kind of program, driven by the twin's controller and by time steps, judged by their logs."""

from dataclasses import replace

import executed_logs as logs
import ls_text
import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.finding_codes import Code
from compgen.pipelines.executed.executed import Situation, judge_log, read_program_text
from compgen.pipelines.executed.simulated_log import Logger, simulated_log
from compgen.pipelines.files.program_course import course_of_text
from compgen.program.frames import default_frames
from compgen.robot.motion import ControllerMotion
from compgen.verification.executed.position_log import read_position_log

MEANS = ControllerMotion(moving_averages=(0.2, 0.1))


def situation(robot, programs=None):
    return Situation(robot, default_frames(), {}, lambda name: (programs or {}).get(name))


def judged(tmp_path, robot, content, log, programs=None, **more):
    (tmp_path / "log.csv").write_bytes(log if isinstance(log, bytes) else log.encode())
    text = read_program_text(str(tmp_path / "PART.LS"), content)
    around = situation(robot, programs)
    return judge_log(text, around.course(content), read_position_log(tmp_path / "log.csv"), around, **more)


def by_steps(course, run=None, logger=None):
    """A log by the second generator."""
    return logs.csv(*logs.log_rows(course, run or logs.Run(ramp=0.25), logger or logs.Logger(noise=1e-6))[:3])


@pytest.mark.parametrize("override", [1.0, 0.73, 0.05])
@pytest.mark.parametrize("motion", [None, MEANS, replace(MEANS, space="joint")], ids=["bare", "means", "joint"])
def test_override_and_time_of_the_twin_s_controller_come_back(tmp_path, robot, motion, override):
    logger = Logger(offset=-77.0, joints=motion is not None and motion.space == "joint", digits=4)
    log = simulated_log(logs.part(), situation(robot), motion, override, logger)
    run = judged(tmp_path, replace(robot, motion=motion), logs.part(), log)
    assert [s.override for s in run.clock.stretches] == [override]
    assert run.clock.stretches[0].rate == pytest.approx(override, rel=1e-3)
    assert run.clock.took == pytest.approx(run.clock.expected, rel=5e-4)
    assert run.clock.start == pytest.approx(-77.0, abs=max(0.25, 0.04 / override))
    assert run.inside


@pytest.mark.parametrize("run", [logs.Run(ramp=0.25), logs.Run(ramp=0.25, means=(0.2, 0.1))], ids=["bare", "means"])
def test_a_logger_that_lags_is_named_where_it_shows_no_stop(tmp_path, robot, run):
    course = course_of_text(logs.part(), robot, default_frames())
    log = by_steps(course, run, logs.Logger(noise=2e-6, lag=0.05))
    (message,) = [f.message for f in judged(tmp_path, robot, logs.part(), log).findings if "stood" in f.message]
    assert "Where it began and ended it was right: the log lags" in message
    assert "it was 0 um off" not in message


def test_a_clock_that_is_fast_is_a_rate_near_whole_percent(tmp_path, robot):
    log = simulated_log(logs.part(), situation(robot), None, 0.5, Logger(rate=3e-4, jitter=1e-3, dropped=0.1))
    (stretch,) = judged(tmp_path, robot, logs.part(), log).clock.stretches
    assert stretch.override == 0.5
    assert stretch.rate == pytest.approx(0.5 / (1 + 3e-4), abs=5e-5)


def test_lines_in_whole_periods_are_told_from_an_override(tmp_path, robot):
    counting = replace(robot, controller=replace(robot.controller, rounds_up_to_period=True))
    log = simulated_log(logs.circle(), Situation(counting, default_frames(), {}, lambda name: None))
    run = judged(tmp_path, robot, logs.circle(), log)
    assert run.clock.rounded
    assert [s.override for s in run.clock.stretches] == [1.0]
    assert not judged(tmp_path, counting, logs.circle(), log).clock.stretches[0].rate < 0.999


def test_a_circle_s_pull_comes_back_as_the_deviation(tmp_path, robot):
    """v^2 sigma^2 / (2 R), sigma^2 = (0.2^2 + 0.1^2) / 12."""
    log = simulated_log(logs.circle(), situation(robot), MEANS, 1.0, Logger(digits=5, noise=0.0))
    run = judged(tmp_path, robot, logs.circle(), log)
    steady = run.deviation.judged & (np.abs(run.deviation.arc / run.course.length - 0.5) < 0.3)
    pull = 0.1**2 * (0.2**2 + 0.1**2) / 12 / 2 / 0.15
    chords = 0.15 * (1 - np.cos(np.radians(1)))  # the text's lines lie inside of the circle by up to that
    assert_allclose(run.deviation.distance[steady], pull, atol=chords)
    assert run.deviation.distance[steady].mean() == pytest.approx(pull, rel=0.02)
    assert_allclose(np.abs(run.deviation.across[steady]), run.deviation.distance[steady], rtol=1e-3)
    assert np.abs(run.deviation.normal[steady]).max() < 1e-7


def test_a_main_program_with_its_pages_is_one_run_and_a_page_alone_is_another(tmp_path, robot):
    main, programs = logs.pages(logs.part())
    log = simulated_log(logs.part(), situation(robot), MEANS)
    run = judged(tmp_path, robot, main, log, programs)
    assert run.inside
    assert run.covered[1] == pytest.approx(run.course.length, abs=1e-4)
    alone = judged(tmp_path, robot, programs["PARTB"], simulated_log(programs["PARTB"], situation(robot), MEANS))
    assert alone.inside
    assert alone.course.length < run.course.length
    with_rest = judged(tmp_path, robot, programs["PARTB"], log)
    assert with_rest.covered[1] == pytest.approx(alone.course.length, abs=1e-3)


def shop():
    """A program as shops have it: joint moves, a wait between lines, an output, an arc, a position twice."""
    down = (180.0, 0.0, 0.0)
    places = [(1000, -100, 200), (1000, -100, 100), (1200, -100, 100), (1250, -50, 100), (1200, 0, 100), (1000, 0, 100)]
    points = [ls_text.cartesian(n, (*place, *down)) for n, place in enumerate(places, 1)]
    moves = [
        "UFRAME_NUM=0", "UTOOL_NUM=0", "J P[1] 20% FINE", "L P[2] 100mm/sec FINE", "L P[3] 120mm/sec CNT100",
        "C P[4]\n    :  P[5] 80mm/sec CNT100", "DO[1]=ON", "L P[6] 100mm/sec FINE", "WAIT   1.50(sec)",
        "L P[2] 200mm/sec FINE", "L P[1] 250mm/sec FINE",
    ]  # fmt: skip
    return ls_text.program(moves, points, name="SHOP")


def test_a_program_of_others_is_judged_on_its_lines_and_arcs(tmp_path, robot):
    course = course_of_text(shop(), robot, default_frames())
    assert course.length == pytest.approx(0.1 + 0.2 + np.pi * 0.05 + 0.2 + 0.1 + 0.1, rel=1e-6)
    assert course.wait.sum() == pytest.approx(1.5)
    at = int(np.flatnonzero(course.wait)[0])
    run = judged(tmp_path, robot, shop(), by_steps(course, logs.Run(ramp=0.25, override=0.8, wait={at: 1.5})))
    assert [s.override for s in run.clock.stretches] == [0.8]
    assert run.deviation.extents["total"].max < 8e-6
    (stand,) = [s for s in run.clock.stands if s.planned]
    assert stand.planned == pytest.approx(1.5)
    assert stand.beyond == pytest.approx(0.0, abs=0.15)


@pytest.mark.parametrize("noise", [0.0, 3e-6])
@pytest.mark.parametrize("ramp", [0.04, 0.6])
def test_a_stand_is_as_long_as_rows_rest_whatever_ramps_were_assumed(tmp_path, robot, ramp, noise):
    """Of rows that rest for 1.52 and 0.90 s 1.11 and 0.50 were said: the stop's cost beyond the assumed ramps."""
    places = np.array([(1000, 0, 100), (1300, 0, 100), (1300, 250, 100), (1000, 250, 150), (1000, 0, 100)])
    points = [ls_text.cartesian(n, (*place, 180.0, 0.0, 0.0)) for n, place in enumerate(places, 1)]
    moves = [f"L P[{n}] {speed}mm/sec FINE" for n, speed in enumerate((100, 100, 50, 120, 80), 1)]
    content = ls_text.program([*moves[:2], "WAIT   1.50(sec)", *moves[2:]], points)
    course = course_of_text(content, robot, default_frames())
    run = logs.Run(ramp=ramp, override=0.7, wait={1: 1.5, 3: 0.9})
    time, place, turn, _ = logs.log_rows(course, run, logs.Logger(noise=noise, offset=37.5))
    stands = judged(tmp_path, robot, content, logs.csv(time, place, turn)).clock.stands
    assert [(stand.planned, stand.at_stop) for stand in stands] == [(1.5, True), (0.0, True)]
    for stand, stop in zip(stands, places[[1, 3]], strict=True):
        rest = time[np.linalg.norm(place * 1e3 - stop, axis=1) < 0.02]
        assert stand.time == pytest.approx(rest[0], abs=0.03)
        assert stand.stood == pytest.approx(np.ptp(rest), abs=0.06)


@pytest.mark.parametrize("override", [1.0, 0.7])
@pytest.mark.parametrize(
    ("planned", "stood", "held"),
    [
        ({2: 2.0}, {1: 0.9, 2: 2.0}, {}),
        ({1: 0.5, 2: 2.0}, {1: 0.5, 2: 2.0}, {}),
        ({1: 0.5, 2: 2.0}, {2: 2.0}, {}),
        ({1: 2.0}, {1: 2.0}, {305: 0.9}),
        ({1: 2.0}, {1: 2.0}, {280: 0.9}),
        ({1: 0.5, 2: 2.0}, {1: 1.2, 2: 2.0}, {285: 0.9, 310: 0.6}),
    ],
    ids=["unplanned", "waits", "wait left out", "hold behind", "hold before", "holds between"],
)
def test_each_place_of_several_between_steady_rows_has_its_own_stand(tmp_path, robot, planned, stood, held, override):
    """P[2] and P[3] are 20 mm apart; what is held, at [mm] of the way, settles for as long as the means last."""
    places = [(1000, 0, 100), (1300, 0, 100), (1300, 20, 100), (1000, 20, 150), (1000, 300, 150)]
    points = [ls_text.cartesian(n, (*place, 180.0, 0.0, 0.0)) for n, place in enumerate(places, 1)]
    moves = [f"L P[{n}] 100mm/sec FINE" for n in range(1, 6)]
    for n in sorted(planned, reverse=True):
        moves.insert(n + 1, f"WAIT   {planned[n]:.2f}(sec)")
    content, known = ls_text.program(moves, points), replace(robot, motion=MEANS)
    course, settling = course_of_text(content, known, default_frames()), sum(MEANS.moving_averages)
    hold = tuple((mm / 100, rest + settling) for mm, rest in held.items())
    run = logs.Run(ramp=0.0, means=MEANS.moving_averages, override=override, wait=stood, hold=hold)
    clock = judged(tmp_path, known, content, by_steps(course, run)).clock
    stops = [(300 + 20 * (n - 1), stood.get(n, 0.0), planned.get(n, 0.0), True) for n in {**planned, **stood}]
    made = sorted([*stops, *[(mm, rest, 0.0, False) for mm, rest in held.items()]])
    assert [(s.planned, s.at_stop) for s in clock.stands] == [(wait, at_stop) for _, _, wait, at_stop in made]
    for stand, (mm, rest, wait, at_stop) in zip(clock.stands, made, strict=True):
        assert stand.arc == pytest.approx(mm * 1e-3, abs=3e-4)  # 0.2 mm a tick
        assert stand.stood == pytest.approx(rest, abs=0.06)  # means end slowly
        assert stand.beyond == pytest.approx(rest - wait + (0 if at_stop else settling), abs=0.06)
    beyond = sum(stood.values()) - sum(planned.values()) + sum(seconds for _, seconds in hold)
    assert sum(s.beyond for s in clock.stands) == pytest.approx(beyond, abs=logs.Logger.step)
    assert clock.took == pytest.approx(clock.expected, abs=logs.Logger.step)


def test_rows_of_a_stand_that_noise_parts_count_once(tmp_path, robot):
    """Of rows that rest for 2.1 s 3.0 were said."""
    places = [(1000, 0, 100), (1060, 0, 100), (1060, 60, 100)]
    points = [ls_text.cartesian(n, (*place, 180.0, 0.0, 0.0)) for n, place in enumerate(places, 1)]
    moves = ["L P[1] 20mm/sec FINE", "L P[2] 20mm/sec FINE", "WAIT   2.00(sec)", "L P[3] 20mm/sec FINE"]
    content = ls_text.program(moves, points)
    course = course_of_text(content, robot, default_frames())
    log = by_steps(course, logs.Run(wait={1: 2.0}), logs.Logger(noise=1e-5))
    (stand,) = judged(tmp_path, robot, content, log).clock.stands
    assert stand.stood == pytest.approx(2.0, abs=0.15)  # 80 um beside the stop, at ramps of 0.3 s


@pytest.mark.parametrize("override", [1.0, 0.5])
def test_a_wait_behind_cnt_is_planned_once_and_no_hold(tmp_path, robot, override):
    """A second too much was planned of two, and *the robot stood where the program does not stop* was said."""
    places = [(1000, -300, -100), (1300, -300, -100), (1300, 200, -100), (1000, 200, -80), (1000, -250, -80)]
    points = [ls_text.cartesian(n, (*place, 180.0, 0.0, 0.0)) for n, place in enumerate(places, 1)]
    ways = ["100mm/sec FINE", "100mm/sec FINE", "150mm/sec CNT100", "150mm/sec CNT100", "60mm/sec FINE"]
    moves = [f"L P[{n}] {way}" for n, way in enumerate(ways, 1)]
    content = ls_text.program([*moves[:3], "WAIT   2.00(sec)", *moves[3:]], points)
    course = course_of_text(content, robot, default_frames())
    driven = replace(course, stop=course.stop | (np.arange(5) == 2))
    run = judged(tmp_path, robot, content, by_steps(driven, logs.Run(ramp=0.25, override=override, wait={2: 2.0})))
    assert [(s.planned, s.at_stop) for s in run.held] == [(2.0, True)]
    assert run.held == list(run.clock.stands)
    assert run.clock.took == pytest.approx(run.clock.expected, abs=0.3)


@pytest.mark.parametrize(("statement", "at_stop"), [("WAIT DI[3]=ON", True), ("PAUSE", True), ("DO[3]=ON", False)])
def test_a_stand_where_the_program_waits_for_a_signal_is_no_hold(tmp_path, robot, statement, at_stop):
    """*The robot stood where the program does not stop* was said of a handshake behind CNT."""
    places = [(1000, -300, -100), (1300, -300, -100), (1300, 200, -100), (1000, 200, -80)]
    points = [ls_text.cartesian(n, (*place, 180.0, 0.0, 0.0)) for n, place in enumerate(places, 1)]
    ways = ["100mm/sec FINE", "100mm/sec CNT100", "150mm/sec CNT100", "60mm/sec FINE"]
    moves = [f"L P[{n}] {way}" for n, way in enumerate(ways, 1)]
    content = ls_text.program([*moves[:3], statement, *moves[3:]], points)
    course = course_of_text(content, robot, default_frames())
    driven = replace(course, stop=course.stop | (np.arange(4) == 2))
    run = judged(tmp_path, robot, content, by_steps(driven, logs.Run(ramp=0.25, wait={2: 3.1})))
    (stand,) = run.clock.stands
    assert (stand.planned, stand.at_stop) == (0.0, at_stop)
    assert run.held == [stand]  # no smoothing is fitted across it
    assert stand.stood == pytest.approx(3.1, abs=0.2)
    through = judged(tmp_path, robot, content, by_steps(course, logs.Run(ramp=0.25)))
    assert not through.clock.stands
    assert [s.override for s in through.clock.stretches] == [1.0]


@pytest.mark.parametrize("override", [0.5, 0.1])
def test_what_a_smoothed_stop_takes_no_override_stretches(tmp_path, robot, override):
    """Means settle as long at any override: at 50 % stops were planned to take twice as long, and a warning said so."""
    places = [(1000.0, -200.0 + 20 * (n // 2), 100.0 + 400 * (n % 2), 180.0, 0.0, 0.0) for n in range(8)]
    points = [ls_text.cartesian(n, place) for n, place in enumerate(places, 1)]
    moves = ["UFRAME_NUM=0", "UTOOL_NUM=0", "J P[1] 20% FINE", *(f"L P[{n}] 100mm/sec FINE" for n in range(2, 9))]
    content, known = ls_text.program(moves, points), replace(robot, motion=MEANS)
    course = course_of_text(content, known, default_frames())
    smoothed = logs.Run(ramp=0.0, means=(0.2, 0.1), override=override)
    run = judged(tmp_path, known, content, by_steps(course, smoothed))
    assert run.clock.took > 6 * 4 / override
    assert run.clock.took == pytest.approx(run.clock.expected, rel=1e-3)
    assert run.clock.start == pytest.approx(0.0, abs=0.1)
    begun = judged(tmp_path, known, content, by_steps(course, smoothed, logs.Logger(noise=1e-6, start=0.02)))
    assert begun.clock.start == pytest.approx(run.clock.start, abs=0.05)  # it was 0.6 s too early at 10 %


def test_a_log_that_begins_late_ends_early_and_has_strange_motion_before(tmp_path, robot):
    course = course_of_text(logs.part(), robot, default_frames())
    t, p, w, _ = logs.log_rows(course, logs.Run(ramp=0.25), logs.Logger(noise=1e-6, start=0.3, end=0.8))
    jog = p[0] + np.linspace([0.2, 0.1, 0.3], [0.0, 0.0, 0.0], 300)
    t, p, w = (
        np.append(t[0] - 2.4 + 0.008 * np.arange(300), t),
        np.vstack([jog, p]),
        np.vstack([np.tile(w[:1], (300, 1)), w]),
    )
    run = judged(tmp_path, robot, logs.part(), logs.csv(t, p, w))
    first, last = run.covered
    assert 0.2 < first / course.length < 0.45
    assert 0.6 < last / course.length < 0.9
    assert "executed.part" in {f.code for f in run.findings}


def test_another_path_beside_is_named(tmp_path, robot):
    log = simulated_log(logs.part(), situation(robot))
    run = judged(tmp_path, robot, logs.part(), log, also=[("CIRCLE.LS", situation(robot).course(logs.circle()))])
    assert "executed.unlike" in {f.code for f in run.findings}


def test_a_corner_that_is_cut_by_more_than_corrections_are_clamped_to_is_no_other_program(tmp_path, robot):
    """Two moving means of 0.2 and 0.15 s at 150 mm/s cut a right angle by v E|t - mean| / sqrt(2), some 6 mm."""
    text = logs.part(speed=0.2)
    run = judged(
        tmp_path, robot, text, simulated_log(text, situation(robot), ControllerMotion(moving_averages=(0.25, 0.2)))
    )
    assert run.inside
    assert run.deviation.away == 0
    assert 5e-3 < run.deviation.extents["total"].max < 10e-3


def test_a_line_that_ends_at_speed_before_a_place_that_is_not_told_bends_as_it_may(tmp_path, robot):
    """Smoothed by two means from stop to stop; where the program goes on from its last line only the log shows."""
    means, statements, points = (0.176, 0.168), list[str](), list[str]()
    rows, run = list[np.ndarray](), [np.array([1200.0, -100, 300])]
    for n in range(1, 21):
        end = np.array([1200 + 14 * (n // 2), 100 if n % 2 else -100, 300])
        is_stop = n % 3 == 0
        points.append(ls_text.cartesian(n, (*end, 180, 0, 0)))
        statements.append(f"L P[{n}] 100mm/sec {'FINE' if is_stop else 'CNT100'}")
        run += list(np.linspace(run[-1], end, round(np.linalg.norm(end - run[-1]) / 100 / 0.008) * 4 + 1)[1:])
        if is_stop or n == 20:
            after = np.linspace(end, end + np.array([0, 0, 0 if is_stop else 60]), 301)[1:]
            way = np.concatenate([np.repeat(run[:1], 300, axis=0), run, after])
            for mean in means:
                way = logs.moving_mean(way, round(mean / 0.002))
            rows, run = [*rows, way[::4]], [end]
    place = np.concatenate(rows)
    content = ls_text.program([*statements, "L PR[1] 100mm/sec FINE"], points, name="PART")
    log = logs.csv(0.008 * np.arange(len(place)), place * 1e-3, np.tile([np.pi, 0, 0], (len(place), 1)))
    codes = [f.code for f in judged(tmp_path, robot, content, log).findings]
    assert Code.EXECUTED_ANOTHER not in codes


def test_a_last_line_with_cnt_rests_at_the_programs_end_and_not_before_a_place_that_is_not_told(robot):
    points = [ls_text.cartesian(n, (1200, 100 * n, 300, 180, 0, 0)) for n in (1, 2)]
    lines = ["L P[1] 100mm/sec FINE", "L P[2] 100mm/sec CNT100"]
    for more, kept in (([], 0.0), (["DO[1]=OFF"], 0.0), (["L PR[1] 100mm/sec FINE"], 1.0)):
        text = ls_text.program([*lines, *more], points, name="PART")
        assert course_of_text(text, robot, default_frames()).kept[-1] == kept


@pytest.mark.parametrize(("letter", "sure"), [("L", True), ("A", False), ("S", False)])
def test_no_straight_line_joins_the_points_of_a_chain(robot, letter, sure):
    """The corners of a square: A drives its circle, on which nothing bends; it was said to be led 3.7 mm off there."""
    corners = [(1100.0, -100, 300), (1100, 100, 300), (1300, 100, 300), (1300, -100, 300)]
    points = [ls_text.cartesian(n, (*corner, 180, 0, 0)) for n, corner in enumerate(corners, 1)]
    ends = [f"{letter} P[{n}] 100mm/sec {'FINE' if n == 4 else 'CNT100'}" for n in (2, 3, 4)]
    text = ls_text.program(["J P[1] 10% FINE", *ends], points)
    assert course_of_text(text, robot, default_frames()).judged.tolist() == [sure] * 3


def test_a_row_stands_for_no_way_that_is_not_judged(tmp_path, robot):
    """Two lines of 100 mm with a fast joint motion of 500 mm between; the first 8 mm of the last are 0.1 mm off."""
    ends = np.array([[1200.0, -300, 300], [1200, -200, 300], [1200, 300, 300], [1200, 400, 300]])
    points = [ls_text.cartesian(n, (*end, 180, 0, 0)) for n, end in enumerate(ends, 1)]
    lines = ["J P[1] 10% FINE", "L P[2] 100mm/sec FINE", "J P[3] 10% FINE", "L P[4] 100mm/sec FINE"]
    share = np.arange(0, 1.0001, 0.008)[:, None]  # of a line: rows of 0.8 mm
    first, between, last = (a + share * (b - a) for a, b in zip(ends[:-1], ends[1:], strict=True))
    last[:11, 2] += 0.1
    between[:, 0] -= 60 * np.sin(np.pi * share[:, 0])
    between = between[::12]
    place = np.vstack([way[[0] * 60 + list(range(len(way)))] for way in (first, between, last)])
    log = logs.csv(0.008 * np.arange(len(place)), place * 1e-3, np.tile([np.pi, 0, 0], (len(place), 1)))
    run = judged(tmp_path, robot, ls_text.program(lines, points, name="PART"), log)
    assert run.deviation.extents["total"].rms == pytest.approx(0.1e-3 * np.sqrt(8 / 200), rel=0.1)
