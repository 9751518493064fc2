"""Lines of whole interpolation periods: the layout by itself, and read back from the text of drawn programs."""

import re
from dataclasses import replace
from math import ceil

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from shipped import path_file, quiet

from compgen import fanuc
from compgen.job.motion_plan import plan_motion
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.findings.job_findings import over_periods
from compgen.pipelines.planned import generate
from compgen.planning import curves, patterns, surfaces, toolpath
from compgen.planning.boundaries import unbounded
from compgen.planning.exact_path import ExactPath
from compgen.planning.whole_periods import STRETCH, Cells, Periods, lay_out

ONE, ROUNDING = 1.6e-3, 1.8e-6  # m
C = 16


def laid(limits, length, first=(0,), pace=None):
    """The layout of pieces as long as each other, (K, C) limits [m]."""
    limit = np.asarray(limits, dtype=float)
    K = len(limit)
    cells = Cells(np.full((K, C), length / (K * C)), limit, np.full((K, C), STRETCH))
    layout = lay_out(cells, limit, np.ones(K) if pace is None else pace, np.array(first), Periods(ONE, ROUNDING))
    return layout.length, layout.per_chain


def periods_taken(lengths):
    """By a controller that rounds up, when digits and correction have made each line as long as they may."""
    return [ceil((L * (1 + STRETCH) + ROUNDING) / ONE - 1e-6) for L in lengths.tolist()]


@given(
    spacing=st.lists(st.floats(0.2e-3, 12e-3), min_size=1, max_size=5),
    length=st.floats(1e-4, 0.6),
    chains=st.booleans(),
)
def test_no_line_outlasts_its_periods_and_few_periods_are_lost(spacing, length, chains):
    limits = np.repeat(spacing, C).reshape(-1, C)
    first = np.arange(len(spacing)) if chains else np.array([0])
    lengths, per_chain = laid(limits, length, first)
    assert_allclose(lengths.sum(), length, rtol=1e-9)
    assert np.all(lengths > 0)
    assert per_chain.sum() == len(lengths)
    chain, long = np.repeat(np.arange(len(per_chain)), per_chain), lengths > ONE * 0.999
    # a chain's only long line is as long as the path leaves it: exactly whole periods, if it happens to be
    shared = long & (np.bincount(chain, long, minlength=len(per_chain))[chain] > 1)
    for L in lengths[shared].tolist():  # with all that may be added it is still what it was without
        assert ceil((L * (1 + STRETCH) + ROUNDING) / ONE - 1e-6) == ceil(L / ONE - 1e-6)
    if min(spacing) > 2 * ONE:
        lost = sum(periods_taken(lengths)) - length / ONE
        # for each end of a chain and each change of n less than a period, and what rounding and stretch take
        changes = len(first) + sum(a != b for a, b in zip(spacing, spacing[1:], strict=False))
        assert lost <= 2 * changes + len(lengths) * (2 * STRETCH * 8 + 2 * ROUNDING / ONE)
        assert lengths.max() <= max(spacing) * (1 + 1e-9)


def test_lines_of_one_period_keep_their_length_where_others_can_give():
    limits = np.repeat([2.5e-3, 8e-3], C).reshape(2, C)
    lengths, _ = laid(limits, 0.3)
    one = (ONE - ROUNDING) / (1 + STRETCH)
    assert_allclose(lengths[:60], one, rtol=1e-12)
    assert len(set(np.round(lengths[100:110], 12))) == 1


def test_a_circle_of_four_pieces_has_one_rest_in_all():
    """As many lines of two periods as go round, the last of them shared out."""
    plane = surfaces.plane(np.array([1.2, 0.0, 0.2]))
    circle = ExactPath(curve=patterns.circle(0.1), surface=plane, boundary=unbounded(), spin=0.0)
    assert len(circle.curve.poly) == 4
    period = Periods(0.4e-3, ROUNDING)
    path = toolpath.plan_tool_path(circle, toolpath.LayoutSettings(1.5e-6, periods=period))
    of_two_periods = (2 * period.length - period.rounding) / (1 + STRETCH)
    assert len(path.arc) - 1 == ceil(path.arc[-1] / of_two_periods) == 394
    assert np.ptp(np.diff(path.arc)) < 1e-3 * of_two_periods


def test_a_line_that_goes_on_is_laid_out_as_one_up_to_a_stop_and_anew_from_there():
    def laid_out(*pieces):
        line = [curves.line((a, 0.0), (b, 0.0), stop=stop) for a, b, stop in pieces]
        plane = surfaces.plane(np.array([1.2, 0.0, 0.2]))
        exact = ExactPath(curve=curves.join(*line), surface=plane, boundary=unbounded(), spin=0.0)
        settings = toolpath.LayoutSettings(1.5e-6, spacing=5e-3, periods=Periods(ONE, ROUNDING))
        return toolpath.plan_tool_path(exact, settings)

    long, short = laid_out((0.0, 0.2, True)), laid_out((0.0, 0.1, True))
    path = laid_out((0.0, 0.1, False), (0.1, 0.2, True), (0.2, 0.3, True), (0.3, 0.4, False), (0.4, 0.5, True))
    assert_allclose(path.arc[path.stop], [0.0, 0.2, 0.3, 0.5], atol=1e-12)
    assert_allclose(np.diff(path.arc), np.diff([*long.arc, *(0.2 + short.arc[1:]), *(0.3 + long.arc[1:])]), atol=1e-12)


def test_a_share_of_the_feed_is_counted_in_its_slowest_word():
    lengths, _ = laid(np.full((1, C), 8e-3), 0.3, pace=np.array([0.5]))
    assert np.all(np.ceil(lengths * (1 + STRETCH) / (0.5 * 0.995 * ONE) - 1e-9) * 0.5 * 0.995 * ONE >= lengths)
    assert lengths[0] < 10 * 0.5 * 0.995 * ONE


@given(
    pieces=st.lists(
        st.tuples(st.sampled_from([1.0, 0.5, 5e-4, 1e-3, 1.12e-3, 1.2e-3, 2e-2]), st.floats(0.2e-3, 12e-3)),
        min_size=1,
        max_size=5,
    ),
    length=st.floats(1e-3, 0.6),
)
def test_a_pace_at_which_digits_hide_a_period_leaves_lines_on_the_way(pieces, length):
    pace, spacing = np.array(pieces).T
    lengths, per_chain = laid(np.repeat(spacing, C).reshape(-1, C), length, np.arange(len(pieces)), pace)
    ends = np.cumsum(lengths)[np.cumsum(per_chain) - 1]
    assert_allclose(ends, length * np.arange(1, len(pieces) + 1) / len(pieces), rtol=1e-9)
    assert np.all(lengths > 0)
    assert lengths.max() <= spacing.max() * (1 + 1e-9)
    for slow, limit, lines in zip(pace * ONE <= ROUNDING, spacing, per_chain.tolist(), strict=True):
        assert not slow or lines == ceil(length / len(pieces) / limit - 1e-6)  # as the spacing asks


def speed_and_length(corrected):
    """Of the lines of the text, by a reader of our own [m/s], [m]."""
    text = fanuc.compose(corrected.program).decode()
    units = {"mm/sec": 1e-3, "cm/min": 1e-2 / 60, "inch/min": 25.4e-3 / 60}
    words = re.findall(r"L P\[\d+\] ([\d.]+)(mm/sec|cm/min|inch/min)", text)
    xyz = np.array(re.findall(r"X =\s*(\S+)\s+mm,\s+Y =\s*(\S+)\s+mm,\s+Z =\s*(\S+)\s+mm", text), dtype=float)
    speed = np.array([float(number) * units[unit] for number, unit in words])
    return speed, np.linalg.norm(np.diff(xyz, axis=0), axis=1) * 1e-3


DRAWN = [
    ("circle_1300", 200, 8, ["path.diameter_mm=700"]),
    ("circle_1300", 100, 12, []),
    ("spiral_1300", 200, 4, ["path.turns=3"]),
    ("spiral_1300", 90, 8, ["path.turns=3"]),
    ("raster_1300", 120, 8, ["path.diameter_mm=500", "path.turn=smooth", "path.stepover_mm=80"]),
    ("iso9283", 150, 12, []),
    ("line_y", 180, 4, []),
    ("optic_spiral", 50, 8, ["path.stepover_mm=120", "boundary.corner_to_corner_mm=800"]),
]


@pytest.mark.parametrize(("name", "feed", "period", "overrides"), DRAWN)
def test_lines_at_feed_last_whole_periods_in_the_text(name, feed, period, overrides):
    sets = [f"process.feed_mm_s={feed}", f"robot.controller.interpolation_ms={period}", *overrides]
    planned, corrected = generate.generate(load_job(path_file(name), None, sets), quiet)
    speed, length = speed_and_length(corrected)
    assert corrected.deviation.on_part["total"].max < 2.5e-6
    at_feed = speed >= feed * 1e-3 * (1 - 1e-9)
    lasts = length / speed / (period * 1e-3)
    meant = np.ceil(np.diff(planned.path.arc) / (feed * period * 1e-6) - 1e-9)
    assert np.all(lasts[at_feed] <= meant[at_feed] + 1e-9)
    taken = np.ceil(lasts[at_feed] - 1e-6)
    pieces = planned.path.exact.curve
    assert taken.sum() - lasts[at_feed].sum() < 0.012 * taken.sum() + 2 * len(pieces.poly)
    assert not [f for f in corrected.findings if f.code == "timing.over_periods"]


def test_a_text_whose_lines_last_too_long_is_a_finding():
    job = load_job(path_file("circle_1300"), None, ["path.diameter_mm=700"])
    planned, corrected = generate.generate(job, quiet)
    program, controller = corrected.program, job.robot.controller
    position = np.array(program.position)
    position[100:200, 0] += 8e-6 * (np.arange(100) % 2)  # m, as a correction that nobody reckoned with
    (finding,) = over_periods(controller, planned.path, replace(program, position=position), planned.feed)
    assert "rounds up" in finding.message
    assert len(finding.message) < 300


@pytest.mark.parametrize("name", ["circle_1300", "spiral_1300", "optic_spiral"])
def test_lines_leave_the_path_by_no_more_than_the_chord_to_either_side(name):
    """Of the planned lines, without an arm: at eleven places of each line, to the path there."""
    job = load_job(path_file(name))
    path = plan_motion(job.plan, job.cell, job.feed, quiet, pages=False).path
    ends = path.target.position + path.balance
    segment = np.linspace(0, len(path.arc) - 2, 400).astype(int)
    worst = 0.0
    for share in np.linspace(0, 1, 11):
        true = path.at(segment, np.full(len(segment), share)).pose.position
        line = (1 - share) * ends[segment] + share * ends[segment + 1]
        along = ends[segment + 1] - ends[segment]
        off = true - line
        off -= along * (np.einsum("ij,ij->i", off, along) / np.einsum("ij,ij->i", along, along))[:, None]
        worst = max(worst, np.linalg.norm(off, axis=1).max())
    chord = job.plan.process.chord
    assert 0.6 * chord < worst <= chord * 1.001
