"""The curve through joint angles against a polynomial written out."""

from types import SimpleNamespace
from typing import cast

import numpy as np
from numpy.testing import assert_allclose

from compgen.planning.joint_curve import AVERAGED, fit_joint_curve, joint_bend, last_before
from compgen.robot.robot import Robot


def test_last_before_is_what_a_search_finds():
    rng = np.random.default_rng(6)
    few, many = (np.sort(np.round(rng.uniform(0, 1, n), 2)) for n in (20, 500))  # many are met exactly, some twice
    for edges, values in ((few, many), (many, few), (few, many[:0]), (few, few)):
        expected = [np.flatnonzero(edges <= s).max(initial=-1) for s in values]
        assert last_before(edges, values).tolist() == expected


def test_derivatives_of_a_quintic_are_exact():
    """Six knots determine it: the ratios to unit limits are its derivatives."""
    rng = np.random.default_rng(7)
    arc, coefficients = np.linspace(0, 1, 41), rng.normal(size=(6, 6))
    theta = np.polynomial.polynomial.polyval(arc, coefficients).T
    stop = np.zeros(41, dtype=bool)
    stop[[0, -1]] = True
    curve = fit_joint_curve(arc, theta.astype(np.float64), stop)
    s, run = np.linspace(0.01, 0.99, 50), np.zeros(50, dtype=int)
    robot = SimpleNamespace(speed=np.ones(6), acceleration=np.ones(6), jerk=np.ones(6))
    ratios = curve.limit_ratios(cast(Robot, robot), s, curve.interval(s, run))
    for order in (1, 2, 3):
        derivative = np.polynomial.polynomial.polyval(s, np.polynomial.polynomial.polyder(coefficients, order))
        assert_allclose(ratios[:, order - 1], np.abs(derivative).max(axis=0), rtol=1e-6, atol=1e-6)


def test_the_bend_of_a_parabola_is_its_second_derivative():
    """At any spacing; at the stops it is not counted, and single waypoints are averaged with their neighbours."""
    rng = np.random.default_rng(8)
    arc = 3 + np.cumsum(rng.uniform(0.5, 1.5, 30))
    theta = np.outer(arc**2, [0.5, -1.5, 0, 1, 0, 0.1])
    bend = joint_bend(arc, theta, np.array([0, 29]))
    assert_allclose(bend[AVERAGED + 1 : -AVERAGED - 1], 3.0, rtol=1e-9)
    assert (bend[[0, -1]] < 3).all()
