"""The study's six measured curves: what is predicted for them, by a second arm too, and what explains the rest."""

import sys

import naive_arm
import naive_heat
import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import ROOT

sys.path.insert(0, str(ROOT / "robots"))
import m710ic50_bend_fit as bend_fit


def naive_errors(line):
    """Thermal error at the stations by 4 x 4 matrices and Newton's method, (11, 3) [um]."""
    hot, joints, rows = naive_heat.warm_lengths(), [0.0, 0.0, -40.0, 0.0, -50.0, 0.0], []
    for place in np.linspace(*bend_fit.STATIONS[line]):
        x, y, z = (bend_fit.CENTRE[a] if a != line else place for a in "xyz")
        joints = naive_arm.joints_at(naive_arm.frame(x, y, z, 180, 0, 0), joints)
        rows.append((naive_arm.flange(joints, hot) - naive_arm.flange(joints))[:3, 3] * 1000)
    return np.array(rows)


@pytest.mark.parametrize("line", ["x", "y"])
def test_errors_at_the_stations_are_a_second_arms(line):
    assert_allclose(bend_fit.station_errors(line), naive_errors(line), atol=2e-3)  # um


def test_predicted_sizes_of_the_six_curves():
    """Of the nodes; the study measured 90, 33, 40, -90, 20 and 30 um."""
    assert_allclose(bend_fit.sizes(bend_fit.curves()), [77.15, 0.16, 6.61, 75.7, 0.44, 0.83], atol=0.02)  # um
    assert_allclose(bend_fit.goal(turned=False), [90, 33, 40, -90, 20, 30])
    assert_allclose(bend_fit.goal(turned=True)[3], 90)
    assert_allclose(bend_fit.station_errors("y")[[0, -1], 1], [-39.6, 36.1], atol=0.05)


@pytest.mark.parametrize("cause", bend_fit.RIGID)
def test_what_moves_a_whole_line_changes_no_curve(cause):
    """But it does move the tool: the interferometer's alignment takes it out."""
    assert np.abs(10 * bend_fit.slope(cause)).max() < 0.005  # um of 10 arcsec or 10 um
    hot = [f"robot.sources.{bend_fit.SOURCES[cause][0]}"]
    moved = bend_fit.station_errors("x", hot) - bend_fit.station_errors("x")
    assert np.abs(moved).max() > 0.9  # um


@pytest.mark.parametrize("cause", ["a2 twist", "d4 arm", "a1 side", "a3"])
def test_slopes_are_those_of_the_model(cause):
    size = 25.0
    keys = bend_fit.SOURCES[cause][0].replace(repr(1 / bend_fit.HOT_K), repr(size / bend_fit.HOT_K))
    full = bend_fit.curves(f"robot.sources.{keys}") - bend_fit.curves()
    assert_allclose(size * bend_fit.slope(cause), full, atol=0.02)  # um


def test_a_tenth_more_expansion_is_a_tenth_of_the_curves():
    more = bend_fit.curves("robot.thermal.cte_um_m_K=12.375")
    assert_allclose(more, bend_fit.curves() + 0.1 * bend_fit.slope("cte"), atol=0.01)  # um


def test_no_cause_earns_a_place_in_the_robot_file():
    """Left out, no curve is foretold better with a cause than without by more than noise of six numbers makes."""
    for turned, without, least in ((False, 76.2, 60.0), (True, 4.7, 3.7)):
        assert bend_fit.scores((), turned)[2] == pytest.approx(without, abs=0.1)
        assert min(bend_fit.scores((cause,), turned)[2] for cause in bend_fit.CAUSES) > least
    assert not (ROOT / "robots" / "m710ic50_bent.toml").exists()


def test_a_twist_that_is_there_would_be_found():
    """The set-up bites: six sizes made by a known twist give it back, and it earns its place by far."""
    true = bend_fit.sizes(bend_fit.curves() + 20 * bend_fit.slope("a2 twist"))
    size, off = bend_fit.fit(("a2 twist",), true, np.ones(6, dtype=bool))
    assert abs(size[0]) == pytest.approx(20, abs=1.5)  # arcsec; its prior pulls a little
    assert (off**2).sum() < 0.1
