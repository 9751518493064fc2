"""What is said of a correction when its flight is worse, turns joints, is above a bound or strays: number by number."""

from dataclasses import replace

import naive_arm as arm
import naive_ls
import numpy as np
import pytest
from corrected import HOME, corrected, joints, pose
from ls_text import at, joint_form, program
from shipped import ROOT

from compgen.core.finding_codes import Level
from compgen.core.units import DEG, UM
from compgen.pipelines.correct.correction_findings import correction_findings
from compgen.pipelines.files.robot_file import load_cell
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

    assert not counted(duration=np.full(3, 1.01 * period))
    (message,) = counted(duration=np.array([1.0, 0.99, 1.01]) * period)
    assert message.startswith("1 straight lines")
    assert not counted(duration=np.full(3, 0.5 * period), stop=lines)
    assert counted(duration=np.full(3, 0.5 * period))[0].startswith("2 straight lines")
    assert not counted(duration=np.full(3, 0.5 * period), line=~lines)


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
    assert np.abs(result.plan.stations.correction[:, :3]).max(axis=1).min() > 1 * UM
