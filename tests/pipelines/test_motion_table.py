"""The robot file's [motion]: what it comes to, and what is refused in one line with the mend."""

import pytest
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError
from compgen.pipelines.files.robot_file import load_cell

HASH = 64 * "a"
IDENTIFIED = f'motion.identified={{robot="m710ic50", verdict="accepted", log_sha256="{HASH}", override_percent=50}}'
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
    known = motion(MEANS, IDENTIFIED.replace("accepted", verdict), f"motion.enabled={enabled}")
    assert known.may_predistort is may
    assert known.evidence.override == 0.5


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
