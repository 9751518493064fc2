"""What is said of a correction when its flight is worse, turns joints, is above a bound or strays: number by number."""

from dataclasses import replace

import naive_arm as arm
import naive_ls
import numpy as np
import pytest
from corrected import HOME, corrected, joints, pose
from ls_text import at, cartesian, joint_form, program
from shipped import ROOT

from compgen.compensation.problem import Settings
from compgen.core import stages
from compgen.core.finding_codes import Level
from compgen.core.pose import IDENTITY, Pose
from compgen.core.units import DEG, UM
from compgen.pipelines.correct import Options, correct
from compgen.pipelines.correct.correction_findings import correction_findings
from compgen.pipelines.files.robot_file import load_cell
from compgen.program.frames import Frames, default_frames
from compgen.verification.flight import PoseErrors

MOVES = ["J P[1] 10% FINE", "L P[2] 50mm/sec FINE", "L P[3] 50mm/sec FINE"]
ENDS = [arm.joints_at(arm.frame(0, y, 0, 0, 0, 0) @ arm.flange(HOME), HOME) for y in (-100, -200)]


@pytest.fixture(scope="module")
def result():
    """Of two lines in a row: samples at each station and between them."""
    cell = load_cell(str(ROOT / "robots" / "m710ic50.toml"))
    return corrected(program(MOVES, [at(1, HOME), *(at(n, q) for n, q in enumerate(ENDS, 2))]), cell)


def messages_of(result, code, **how):
    return [f.message for f in findings_of(result, code, **how)]


def findings_of(result, code, *, deviation=(), before=5.0, after=0.0, **fields):
    """Findings of a code, with errors [um] in place of those that were flown, one for all or for each sample."""
    M = len(result.execution.station)
    error, residual = (
        PoseErrors(np.broadcast_to(np.array(um, dtype=float), M) * UM, np.zeros(M)) for um in (before, after)
    )
    changed = replace(result, error=error, residual=residual, **fields)
    return [f for f in correction_findings(changed, np.array(deviation)) if f.code == code]


def line_of(sample, result):
    """The motions stand in lines 4 to 6 of the file, one station each."""
    return f"line {4 + int(result.execution.station[sample])}: "


def test_all_samples_of_two_lines_are_judged(result):
    assert result.judged.all()
    assert (np.bincount(result.execution.station)[1:] > 2).all()
    assert (np.bincount(result.execution.station)[0], len(result.plan.free)) == (1, 3)


def test_a_sample_that_becomes_worse_by_more_than_rounding_is_named_the_worst_of_them(result):
    M = len(result.execution.station)
    after = np.full(M, 7.9)
    assert not messages_of(result, "correction.worse", after=after)  # by 2.9 um
    after[M - 2], after[1] = 9.5, 8.5
    (message,) = messages_of(result, "correction.worse", after=after)
    assert message.startswith(line_of(M - 2, result))
    assert "5.0 um before, 9.5 um after" in message
    before = np.full(M, 5.0)
    before[M - 2] = 6.2  # now the other grows by more
    (message,) = messages_of(result, "correction.worse", before=before, after=after)
    assert message.startswith(line_of(1, result))


def off_by_digits(result, texts):
    """um between what each position is meant to say and what the second reader and arm find written."""
    meant = result.plan.poses.tcp.position + result.shared.correction[:, :3]
    places = naive_ls.read(result.text)[0]
    written = [arm.flange(joints(places[n])) if "J1" in text else pose(places[n]) for n, text in enumerate(texts, 1)]
    return 1e6 * np.linalg.norm(meant - 1e-3 * np.array([w[:3, 3] for w in written]), axis=1)


@pytest.mark.parametrize("coarse", ["{:.3f} joints", "{:.2f}", "{:.1f}"])
@pytest.mark.parametrize("others", ["{:.3f}", "same"])
def test_coarse_digits_are_said_of_a_worse_sample_where_they_alone_make_it_worse(result, coarse, others):
    """P[2] is written so, or all are; what three decimals explain (3 um, of which they are 0.87) is never said."""
    q = [HOME, *ENDS]
    texts = [at(n, q[n - 1]) for n in (1, 2, 3)]
    for n in (1, 2, 3) if others == "same" else (2,):
        form = coarse.split()[0]
        texts[n - 1] = joint_form(n, q[n - 1], form=form) if "joints" in coarse else at(n, q[n - 1], form=form)
    real = corrected(program(MOVES, texts), result.cell)
    off = off_by_digits(real, texts)
    assert off.max() > 1.5
    flight = real.execution
    for k in np.flatnonzero(flight.station > 0)[::2]:
        ends = [flight.station[k]] if flight.fraction[k] == 1 else [flight.station[k], flight.station[k] - 1]
        explained = 3.0 - 0.87 + off[ends].max()
        after = np.full(len(flight.station), 5.0)
        after[k] = 5.0 + max(explained, 3.0) + 0.03
        (worse,) = findings_of(real, "correction.worse", after=after)
        assert worse.level is Level.OUTSIDE
        assert "coarse" not in worse.message
        if explained > 3.1:
            after[k] -= 0.06
            (worse,) = findings_of(real, "correction.worse", after=after)
            assert worse.level is Level.WARNING
            assert worse.message.endswith("it would become worse, in digits that are coarse")


def test_a_sample_that_is_not_judged_becomes_neither_worse_nor_too_far_off(result):
    M = len(result.execution.station)
    after = np.zeros(M)
    after[0], after[M - 1] = 99.0, 12.0
    judged = np.arange(M) > 0
    near = replace(result.options, bound=11.997 * UM)
    assert ": 12.00 um after" in messages_of(result, "bounds.max", after=after, judged=judged, options=near)[0]
    finely = messages_of(result, "bounds.max", after=12.0004, options=replace(near, bound=12 * UM))
    assert ": 12.0004 um after" in finely[0]
    options = replace(result.options, bound=11 * UM)
    (worse,) = messages_of(result, "correction.worse", after=after, judged=judged)
    (above,) = messages_of(result, "bounds.max", after=after, judged=judged, options=options)
    assert worse.startswith(line_of(M - 1, result))
    assert above.startswith(f"{line_of(M - 1, result)}12.0")
    assert not messages_of(result, "bounds.max", after=after, judged=judged, options=replace(options, bound=12.1 * UM))
    (missing,) = messages_of(result, "bounds.none", after=after, judged=judged)
    assert "whether 12.00 um after" in missing
    assert not messages_of(result, "bounds.none", after=after, judged=judged, options=options)
    (nothing,) = messages_of(result, "correction.none", judged=judged & False)
    assert "no position" in nothing
    assert not messages_of(result, "bounds.none", judged=judged & False)


def test_the_joint_that_turns_farthest_beyond_what_is_explained_is_named_with_where(result):
    turn = np.full((len(result.execution.station), 6), -0.1)
    assert not messages_of(result, "correction.turn", turn=turn)
    way = int(np.flatnonzero(result.execution.fraction < 1)[0])
    turn[0, 2], turn[way, 4] = 0.2 * DEG, 0.3 * DEG
    (message,) = messages_of(result, "correction.turn", turn=turn)
    assert message.startswith(f"{line_of(way, result)}on the way there, joint J5 turns by 0.30 deg more")
    turn[0, 2] = 0.4 * DEG
    (message,) = messages_of(result, "correction.turn", turn=turn)
    assert message.startswith(f"{line_of(0, result)}joint J2+J3 turns by 0.40 deg more")


def test_lines_that_stray_by_more_than_two_micrometres_midway_are_a_note(result):
    assert not messages_of(result, "correction.straight", deviation=[1.9 * UM, 0.0])
    (message,) = messages_of(result, "correction.straight", deviation=[0.0, 2.1 * UM])
    assert "up to 2.1 um midway" in message


def test_lines_shorter_than_a_period_at_their_speed_are_counted_but_for_those_that_stop(result):
    drive, period = result.plan.drive, result.cell.robot.controller.period
    lines = np.array([False, True, True])

    def counted(**columns):
        plan = replace(result.plan, drive=replace(drive, **{"stop": ~lines} | columns))
        return messages_of(result, "timing.short", plan=plan)

    assert not counted(written=np.full(3, 0.998 * period))  # as digits round it
    (message,) = counted(written=np.array([1.0, 0.99, 1.01]) * period, duration=np.full(3, period))
    assert message.startswith("1 straight line is")
    assert not counted(written=np.full(3, 0.5 * period), stop=lines)
    assert counted(written=np.full(3, 0.5 * period))[0].startswith("2 straight lines")
    assert not counted(written=np.full(3, 0.5 * period), line=~lines)


def test_a_station_that_is_held_has_no_correction_and_stays_at_its_joints(result):
    """With a clamp of a micrometre no correction is taken."""
    ends = [arm.joints_at(arm.frame(0, y, 0, 0, 0, 0) @ arm.flange(HOME), HOME) for y in (-100, -200)]
    data = program(MOVES, [at(1, HOME), *(at(n, q) for n, q in enumerate(ends, 2))])
    held = corrected(data, result.cell, settings=replace(result.options.settings, clamp_position=1 * UM))
    stations, drive = held.plan.stations, held.plan.drive
    assert [station for station, _ in stations.held] == [0, 1, 2]
    assert all("beyond the clamp" in why for _, why in stations.held)
    assert not stations.correction.any()
    assert (stations.theta == held.plan.poses.theta[drive.pose]).all()
    assert not held.plan.free.any()
    assert held.text == held.planned
    assert not held.judged.any()
    assert held.verdict == "nothing corrected"
    assert np.abs(result.plan.stations.correction[:, :3]).max(axis=1).min() > 1 * UM


def test_a_run_of_short_lines_keeps_a_limit_that_is_named_at_its_lines_and_tells_how_far_it_is(result):
    """Two runs, of six and of three lines of 5 mm: the warm arm asks for 6e-5 of correction a length of line."""
    places = [*[(0.0, -5.0 * n) for n in range(7)], *[(100.0, -5.0 * n) for n in range(4)]]
    q = [arm.joints_at(arm.frame(x, y, 0, 0, 0, 0) @ arm.flange(HOME), HOME) for x, y in places]
    begins = (1, 8)
    moves = [f"{'J' if n in begins else 'L'} P[{n}] {'10%' if n in begins else '50mm/sec'} FINE" for n in range(1, 12)]
    data, shares = program(["J P[12] 10% FINE", *moves], [at(n, j) for n, j in enumerate([*q, ENDS[1]], 1)]), []
    options = Options(settings=Settings(rate=5e-5))
    said = correct(data, result.cell, default_frames(), result.before, options, lambda *how: shares.append(how))
    correction, length = said.plan.stations.correction[:, :3], said.plan.drive.length
    slope = np.linalg.norm(np.diff(correction, axis=0), axis=1) / length[1:]
    lines = [*range(2, 8), *range(9, 12)]  # by the station that each leads to
    assert slope[np.array(lines) - 1] == pytest.approx(np.full(9, 5e-5), rel=1e-3)
    assert [station for station, _ in said.plan.stations.limited] == [n - 1 for n in lines]
    (finding,) = [f for f in said.findings if f.code == "correction.limited"]
    assert finding.message == "rate limit binds at lines 5, 6, 7, 8, 9, 10, 12, 13 and 1 more"
    assert said.plan.stations.held == ()
    assert [share for stage, share in shares if stage == stages.CORRECTION] == [0.5, 1.0]
    for stage in (stages.READING, stages.TWIN_BEFORE, stages.TWIN_AFTER):
        assert next(share for name, share in shares if name == stage) == 0.0


def test_moves_and_turns_are_clamped_each_for_itself():
    """The zero of J6 is 100 mdeg off: 1.7 mrad about the x of a tool that looks along J6, and nothing moves."""
    cell = load_cell(str(ROOT / "robots" / "m710ic50.toml"), ["sources.joint_zeros.offset_mdeg=[0, 0, 0, 0, 0, 100]"])
    along = Frames({0: IDENTITY}, {1: Pose(np.zeros(3), np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]]))})
    data = program(MOVES[:1], [at(1, HOME, ut=arm.frame(0, 0, 0, 0, -90, 0), numbered=(0, 1))])

    def held(**clamps):
        return corrected(data, cell, along, before=(), settings=Settings(**clamps)).plan.stations.held

    assert held(clamp_position=1e-3) == ()
    assert held(clamp_rotation=1.8e-3) == ()
    ((_, reason),) = held(clamp_rotation=1.7e-3)
    assert reason.startswith("its correction is beyond the clamp")


@pytest.mark.parametrize(("each", "held"), [(2.1, False), (2.2, True)])
def test_the_clamp_is_of_the_whole_move(each, held):
    """The base stands off in x and y: 2.97 and 3.11 mm of the 3 mm that are allowed; each axis alone was looked at."""
    off = [f"sources.base_frame.position_um=[{1000 * each}, {1000 * each}, 0]"]
    cell = load_cell(str(ROOT / "robots" / "m710ic50.toml"), [*off, "sources.base_frame.rotation_mdeg=[0, 0, 0]"])
    data = program(MOVES[:1], [at(1, HOME)])
    stations = corrected(data, cell, before=()).plan.stations
    assert bool(stations.held) is held


def test_of_a_corner_half_is_left_at_half_the_speed():
    """Its rounding by means is v f(t): it halves with v, where a bend longer than the means keeps a quarter."""
    cell, led = load_cell(str(ROOT / "robots" / "m710ic50.toml")), []
    places = [(1100, -200, -100, 180, 0, 0), (1100, 100, -100, 180, 0, 0), (1300, 100, -100, 180, 0, 0)]
    points = [cartesian(n, place) for n, place in enumerate(places, 1)]
    for speed in (103.0, 51.5):
        moves = ["J P[1] 10% FINE", f"L P[2] {speed}mm/sec CNT100", f"L P[3] {speed}mm/sec FINE"]
        (message,) = (f.message for f in corrected(program(moves, points), cell).findings if f.code == "motion.unknown")
        led.append(float(message.partition("off this path by ")[2].partition(" um")[0]))
        assert "at 50 % override a quarter of it is left, at corners half; log" in message
    assert led[0] / led[1] == pytest.approx(2.0, rel=1e-3)


def test_of_a_plain_program_without_a_bound_nothing_else_is_said(result):
    """It has too few places for the mark, and its robot file has no [motion]."""
    assert [f.code for f in result.findings] == ["correction.mark", "motion.unknown", "bounds.none"]


def test_a_cell_of_which_nothing_was_before_starts_cold_unless_it_was_left_warm(result):
    def messages(cell):
        findings = correction_findings(replace(result, before=(), cell=cell), np.zeros(0))
        return [f.message for f in findings if f.code == "thermal.cold"]

    heat = result.cell.heat
    assert messages(result.cell) == ["no --before: the cell starts cold"]
    assert not messages(replace(result.cell, heat=replace(heat, start=np.ones(len(heat.names)))))


def test_eight_lines_are_named_and_the_others_counted(result):
    def said(count):
        drive = replace(result.plan.drive, untimed=tuple(range(11, 11 + count)))
        (message,) = messages_of(result, "timing.assumed", plan=replace(result.plan, drive=drive))
        return message.split(":")[0]

    assert said(1) == "line 11"
    assert said(8) == "lines 11, 12, 13, 14, 15, 16, 17, 18"
    assert said(10) == "lines 11, 12, 13, 14, 15, 16, 17, 18 and 2 more"


@pytest.mark.parametrize(("count", "level"), [(3, Level.WARNING), (4, Level.OUTSIDE)])
def test_half_of_the_places_out_of_reach_are_another_robots_program(result, count, level):
    """Of eight; what breaks a bound keeps the program from being written."""
    near = [at(n, np.array(HOME) + n) for n in range(1, 9 - count)]
    far = [joint_form(n, (0, 0, 0, 0, 126, n)) for n in range(9 - count, 9)]
    moves = [f"J P[{n}] 10% FINE" for n in range(1, 9)]
    (finding,) = [f for f in corrected(program(moves, [*near, *far]), result.cell).findings
                  if f.code == "robot.unattainable"]  # fmt: skip
    assert finding.level is level
    assert f"cannot take {count} of 8 positions" in finding.message


def test_how_far_a_held_position_stays_off_is_measured_at_it_and_not_on_the_way(result):
    """By what is left at its end; nothing is left of one that no sample stands at."""
    flight = result.execution
    after = np.where(flight.fraction == 1, 40.0, 90.0)
    after[flight.station == 1] += 7.0
    after[0] = 99.0
    stations = replace(result.plan.stations, held=((1, "it is so"),))
    held = replace(result.plan, stations=stations)
    (message,) = messages_of(result, "correction.held", after=after, plan=held)
    assert message == "line 5 left as it is, up to 47 um off: it is so"
    nowhere = replace(flight, fraction=np.full(len(flight.station), 0.5))
    (message,) = messages_of(result, "correction.held", after=after, plan=held, execution=nowhere)
    assert "up to 0 um off" in message


def test_a_limit_that_binds_is_named_with_its_lines(result):
    stations = replace(result.plan.stations, limited=((2, "rate"), (1, "rate"), (2, "clamp")))
    messages = messages_of(result, "correction.limited", plan=replace(result.plan, stations=stations))
    assert sorted(messages) == ["clamp binds at line 6", "rate binds at lines 5, 6"]


def test_a_place_that_is_used_at_several_warmths_is_named_where_its_mean_is_written(result):
    """One that keeps its numbers has no mean."""
    spread, changed = np.array([0.0, 7.0, 9.0]) * UM, np.array([True, True, False])
    shared = replace(result.shared, spread=spread, changed=changed, mixed=~changed)
    (message,) = messages_of(result, "correction.shared", shared=shared)
    assert message.startswith("P[2] is used more than once")
    (message,) = messages_of(result, "correction.mixed", shared=shared)
    assert message.startswith("P[3] is also used where nothing may change")


def test_from_where_the_robot_comes_is_asked_of_corrected_lines_behind_the_first(result):
    """A joint motion and a line whose end stays are not judged on the way; the first line has no way."""
    free, drive = result.plan.free, result.plan.drive

    def named(line, free=free):
        nowhere = replace(drive, origin=np.full(3, -1), line=np.array(line))
        return messages_of(result, "correction.order", plan=replace(result.plan, drive=nowhere, free=free))

    (message,) = named([False, True, False])
    assert message.startswith("line 5: from where the robot comes is not sure")
    assert not named([True, False, False])
    assert not named([False, True, False], free=np.array([True, False, True]))


def test_a_calibration_of_the_controller_that_is_active_is_said(result):
    controller = replace(result.cell.robot.controller, compensation="signature", signature="S-7")
    robot = replace(result.cell.robot, controller=controller)
    (message,) = messages_of(result, "controller.signature", cell=replace(result.cell, robot=robot))
    assert "'S-7' is active" in message


def test_waits_do_not_count_to_the_feed_that_the_heat_was_measured_at(result):
    """It was measured up to 200 mm/s: 500 mm/s are beyond it, whatever the robot waits between its moves."""
    there = arm.joints_at(arm.frame(0, -800, 0, 0, 0, 0) @ arm.flange(HOME), HOME)
    lines = ["L P[1] 500mm/sec FINE", "L P[2] 500mm/sec FINE"]
    for waits in (0, 20):
        data = program([lines[0], *["WAIT 1.00(sec)"] * waits, lines[1]], [at(1, HOME), at(2, there)])
        findings = corrected(data, result.cell).findings
        assert any("process feed" in f.message for f in findings if f.code == "thermal.box")
    assert not messages_of(result, "thermal.box")
