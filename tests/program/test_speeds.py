"""Speeds that a program can say, and the time they take."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError
from compgen.program.speeds import diffuse_errors, feed_errors, parse_speed, speed_text, written_feeds

STEPS = {"mm/sec": 1e-3, "cm/min": 0.01 / 60, "inch/min": 0.00254 / 60}


def rounded(speed):
    """Naively: step of the unit, speed rounded down in it, and whether that is the speed."""
    for step in STEPS.values():
        n = round(speed / step)
        if n >= 1 and abs(n * step - speed) <= 1e-6 * speed:
            return step, n * step, True
    step = next((s for s in STEPS.values() if s <= 0.005 * speed), STEPS["inch/min"])
    return step, int(speed / step) * step, False


def table(speed):
    rows = [rounded(v) for v in speed.tolist()]
    return tuple(np.array(column) for column in zip(*rows, strict=True))


def one_by_one(speed, length):
    """The rule, segment after segment: faster when that leaves the smaller error."""
    error, said = 0.0, []
    for L, v, (step, low, exact) in zip(length.tolist(), speed.tolist(), map(rounded, speed.tolist()), strict=True):
        late = error + L / low - L / v
        early = error + L / (low + step) - L / v
        faster = not exact and abs(early) < abs(late)
        said.append(low + step if faster else low)
        error = early if faster else late
    return np.array(said)


def stretch_error(speed, said, length):
    """Largest difference of the time that any stretch takes [s]."""
    late = np.concatenate([[0.0], np.cumsum(length / said - length / speed)])
    return late.max() - late.min()


def one_rounding(speed, length):
    """The largest that one step of the unit changes a segment's time [s]."""
    step, low, exact = table(speed)
    return np.where(exact, 0.0, length / low - length / (low + step)).max()


@settings(max_examples=200, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 400),
    st.sampled_from([(0.1e-3, 2e-3), (2e-3, 30e-3), (20e-3, 300e-3), (0.5, 1.999)]),
    st.sampled_from(["even", "alternating", "wild"]),
)
def test_the_time_of_any_stretch_is_right_to_about_one_rounding(seed, count, band, kind):
    rng = np.random.default_rng(seed)
    speed = rng.uniform(band[0], band[1], count if seed % 2 else 1) * np.ones(count)
    length = {
        "even": np.full(count, 1e-3),
        "alternating": 1e-3 * (1 + np.arange(count) % 2),
        "wild": 10.0 ** rng.uniform(-5, -2, count),
    }[kind]
    said = written_feeds(speed, length)
    step, low, exact = table(speed)
    slack = 1e-6 * (length[exact] / speed[exact]).sum() + 1e-12
    assert stretch_error(speed, said, length) <= 1.13 * one_rounding(speed, length) + slack
    plain = one_by_one(speed, length)
    assert stretch_error(speed, plain, length) <= 1.01 * one_rounding(speed, length) + slack
    up = np.rint((said - low) / step)
    assert set(up.tolist()) <= {0.0, 1.0}
    assert np.abs(said - (low + up * step)).max() < 1e-12
    assert not up[exact].any()
    assert np.abs(said / speed - 1).max() <= max(0.005, STEPS["inch/min"] / speed.min()) + 1e-9


def test_rounding_down_alone_would_be_late():
    """The set-up bites: 3.34 mm/s over a kilometre of path."""
    speed, length = np.full(200_000, 3.34e-3), np.full(200_000, 5e-3)
    low = np.full(200_000, rounded(3.34e-3)[1])
    assert stretch_error(speed, low, length) > 500
    said = written_feeds(speed, length)
    assert stretch_error(speed, said, length) < 1.13 * one_rounding(speed[:1], length[:1])
    feed, time = feed_errors(speed, said, length)
    assert time == pytest.approx(stretch_error(speed, said, length))
    assert feed == pytest.approx(np.abs(said / speed - 1).max())


def test_lengths_in_step_with_the_rounding_do_not_drift():
    """Every second segment twice as long and a rounding of one half: counting segments alone would always pick one."""
    late, win = np.tile([1.0, 2.0], 5000) / 2, np.tile([1.0, 2.0], 5000)
    error = np.cumsum(late - np.where(diffuse_errors(late, win), win, 0.0))
    assert np.abs(error).max() <= 1.125


@given(st.lists(st.sampled_from([0.2, 0.02, 125 * 0.01 / 60, 0.00254 / 60 * 7, 1.27e-3, 2.0]), max_size=30))
def test_speeds_that_can_be_said_are_left_as_they_are(speeds):
    speed = np.array(speeds)
    said = written_feeds(speed, np.linspace(1e-3, 2e-3, len(speed)))
    assert [speed_text(v) for v in said.tolist()] == [speed_text(v) for v in speeds]
    assert np.abs(said - speed).max(initial=0.0) <= 1e-6 * 2.0
    assert_allclose(written_feeds(said, np.ones(len(said))), said, rtol=1e-12)


@given(st.lists(st.floats(0.05e-3, 2.0), min_size=1, max_size=50))
def test_what_was_diffused_reads_back_and_stays(speeds):
    speed = np.array(speeds)
    length = np.linspace(1e-3, 5e-3, len(speed))
    said = written_feeds(speed, length)
    read = np.array([parse_speed(speed_text(v)) for v in said.tolist()])
    assert np.abs(read / said - 1).max() < 1e-12
    assert_allclose(written_feeds(read, length), read, rtol=1e-12)


@pytest.mark.parametrize("speed", [1e-6, 5.0])
def test_speeds_no_unit_says_are_refused(speed):
    with pytest.raises(InputError, match="mm/s cannot be written"):
        written_feeds(np.array([0.2, speed]), np.ones(2))


def test_no_segments_are_no_speeds():
    assert len(written_feeds(np.zeros(0), np.zeros(0))) == 0
    assert feed_errors(np.zeros(0), np.zeros(0), np.zeros(0)) == (0.0, 0.0)
