"""The robot file's [motion]: what it comes to, and what is refused in one line with the mend."""

import tomllib

import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import ROOT

from compgen.core.exceptions import InputError
from compgen.pipelines.files.robot_file import known_robots, load_any_robot, load_cell
from compgen.robot.motion import ANY_ARM

HASH = 64 * "a"
IDENTIFIED = f'motion.identified={{robot="m710ic50", verdict="accepted", log_sha256="{HASH}", override_percent=100}}'
MEANS = "motion.moving_average_ms=[200, 100]"


def motion(*overrides):
    return load_cell("m710ic50", overrides).robot.motion


def test_a_file_without_the_table_knows_nothing_of_the_motion():
    assert motion() is None


def test_numbers_come_in_seconds():
    known = motion(MEANS, "motion.first_order_ms=[20]", "motion.lag_ms=16", 'motion.space="joint"')
    assert known.space == "joint"
    assert_allclose(known.moving_averages, [0.2, 0.1])
    assert_allclose(known.first_orders, [0.02])
    assert known.lag == pytest.approx(0.016)
    assert known.is_smooth
    assert not known.enabled
    assert known.evidence is None


def test_a_lag_alone_smooths_nothing():
    assert not motion("motion.lag_ms=30").is_smooth
    assert not motion("motion.moving_average_ms=[0, 0]").is_smooth


@pytest.mark.parametrize(("verdict", "enabled", "may"), [
    ("accepted", "true", True), ("accepted", "false", False), ("rejected", "true", False),
])  # fmt: skip
def test_programs_are_pre_distorted_only_by_accepted_numbers_that_are_enabled(verdict, enabled, may):
    identified = IDENTIFIED.replace("accepted", verdict)
    assert motion(MEANS, identified, f"motion.enabled={enabled}").may_predistort is may
    at_half = motion(MEANS, identified.replace("percent=100", "percent=50"), f"motion.enabled={enabled}")
    assert not at_half.may_predistort  # programs are made for 100 %
    assert at_half.evidence.override == 0.5


@pytest.mark.parametrize(("overrides", "words"), [
    (["motion.moving_average_ms=[200, -5]"], ["motion.moving_average_ms", "-5", "0 to 2000 ms"]),
    (["motion.first_order_ms=[-0.1]"], ["motion.first_order_ms", "-0.1", "give"]),
    (["motion.lag_ms=-8"], ["motion.lag_ms", "-8", "give"]),
    (["motion.moving_average_ms=[200, 100, 50]"], ["motion.moving_average_ms", "at most 2", "give the longest"]),
    (["motion.moving_average_ms=[20000]"], ["motion.moving_average_ms", "20000", "2000"]),
    ([MEANS, "motion.enabled=true"], ["motion.enabled", "[motion.identified]", "cgen identify-motion"]),
    ([MEANS, IDENTIFIED.replace("m710ic50", "twin_b")], ["twin_b", "m710ic50", "cgen identify-motion"]),
    (["motion.moving_averages=[200]"], ["motion.moving_averages", "moving_average_ms"]),
    (['motion.space="axis"'], ["motion.space", "cartesian"]),
])  # fmt: skip
def test_bad_numbers_are_refused_in_one_line(overrides, words):
    with pytest.raises(InputError) as failure:
        motion(*overrides)
    message = str(failure.value)
    assert len(message) <= 300
    assert "\n" not in message
    assert all(word in message for word in words), message


EXPECTED = 'evidence="simulated", source="a test"'


def expected(lowest, middle, highest, after_long=None):
    more = f"after_long_ms={after_long}, " if after_long else ""
    return f"expected_motion={{lowest_ms={lowest}, moving_average_ms={middle}, highest_ms={highest}, {more}{EXPECTED}}}"


def test_what_is_expected_is_not_what_is_known():
    robot = load_cell("m710ic50", (expected([100, 50], [200, 100], [200, 200]),)).robot
    assert robot.motion is None
    seen = robot.expected_motion
    assert [m.moving_averages for m in (seen.lowest, seen.expected, seen.highest)] == [
        pytest.approx(windows) for windows in ((0.1, 0.05), (0.2, 0.1), (0.2, 0.2))
    ]
    assert seen.expected.variance == pytest.approx((0.2**2 + 0.1**2) / 12)
    assert not seen.expected.may_predistort


def test_a_run_has_other_windows_from_a_first_statement_on_that_lasts_as_long_as_they_do():
    seen = load_cell("m710ic50", (expected([176, 168], [176, 168], [256, 168], [256, 168]),)).robot.expected_motion
    windows = {first: seen.expected.in_run(first).moving_averages for first in (0.016, 0.416, 0.424, 2.5)}
    short, long = pytest.approx((0.176, 0.168)), pytest.approx((0.256, 0.168))
    assert windows == {0.016: short, 0.416: short, 0.424: long, 2.5: long}
    assert seen.lowest.in_run(2.5) == seen.lowest


@pytest.mark.parametrize(("windows", "words"), [
    (([200, 100], [100, 50], [200, 200]), ["moving_average_ms", "between lowest_ms"]),
    (([100, 50], [300, 200], [200, 200]), ["moving_average_ms", "between lowest_ms"]),
    (([100, 50], [200, -1], [200, 200]), ["expected_motion.moving_average_ms"]),
    (([100, 50], [200], [200, 200]), ["expected_motion.moving_average_ms"]),
    (([100, 50], [200, 100], [200, 2001]), ["expected_motion.highest_ms"]),
    (([100, 50], [200, 100], [200, 200], [300, 200]), ["after_long_ms", "[300.0, 200.0]", "between lowest_ms"]),
])  # fmt: skip
def test_what_cannot_be_expected_is_refused_in_one_line(windows, words):
    with pytest.raises(InputError) as failure:
        load_cell("m710ic50", (expected(*windows),))
    assert all(word in str(failure.value) for word in words)
    assert "\n" not in str(failure.value)


@pytest.mark.parametrize("name", known_robots())
def test_shipped_files_expect_what_their_makers_controllers_were_seen_to_do(name):
    robot = load_any_robot(name)
    maker = tomllib.loads((ROOT / "robots" / f"{name}.toml").read_text())["maker"]
    assert robot.motion is None
    assert (robot.expected_motion is ANY_ARM) == (maker != "FANUC")
    lengths = [sum(m.moving_averages) for m in (robot.expected_motion.lowest, robot.expected_motion.highest)]
    assert 0.208 - 1e-9 <= lengths[0] < lengths[1] <= 0.648 + 1e-9  # s: the shortest and the longest of all logs


@pytest.mark.parametrize(
    ("began", "logged", "short", "long"),
    [("short", (176, 168), (176, 168), (256, 168)), ("long", (250, 170), (170, 170), (250, 170))],
)
def test_runs_that_begin_as_no_logged_one_did_are_foretold_by_what_those_of_the_class_differ_by(
    began, logged, short, long
):
    """The shipped file has 176 + 168 ms, and 256 + 168 after a long line: 80 ms more."""
    means, identified = (
        f"motion.moving_average_ms={list(logged)}",
        IDENTIFIED.replace("{", "{{").replace("}", ", runs_began={}}}"),
    )
    known = motion(means, identified.format(f'"{began}"'), "motion.enabled=true")
    for first, windows in ((0.0, short), (2.0, long)):
        of_run = known.in_run(first)
        assert_allclose(of_run.moving_averages, np.array(windows) / 1000)
        assert of_run.may_predistort is ((first > 0) == (began == "long"))
    between = (sum(short) + sum(long)) / 2000  # [s] neither surely short nor surely long
    assert not known.in_run(between).may_predistort
    both = motion(means, identified.format('"both"'), "motion.enabled=true")
    assert both.in_run(2.0).moving_averages == both.in_run(0.0).moving_averages
