import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.evaluation import evaluate
from compgen.error_model.source import State
from compgen.error_model.sources.joint_waves import JointRipple
from compgen.robot.kinematics import Chain, nominal_chain

ORDER = np.array([3, 14, 26])


def ripple(seed=1):
    wave = np.random.default_rng(seed).normal(0, 4e-5, (2, 6, 3))
    return JointRipple(wave[0], wave[1], ORDER)


def angles(robot, source, theta):
    q = ca.SX.sym("q", 6)
    chain = nominal_chain(robot, q)
    state = State(chain, ca.SX.zeros(1), ca.SX.zeros(6), ca.SX.zeros(3))
    bent: Chain = source.distort(chain, state)
    return evaluate(ca.Function("f", [q], [ca.densify(ca.vertcat(*bent.theta))]), theta)[0]


def test_no_waves_change_nothing(robot):
    theta = np.random.default_rng(0).uniform(-1, 1, (5, 6))
    none = JointRipple(np.zeros((6, 3)), np.zeros((6, 3)), ORDER)
    assert_allclose(angles(robot, none, theta), theta, atol=0)


def test_waves_add_up_by_hand(robot):
    theta, source = np.random.default_rng(0).uniform(-1, 1, (5, 6)), ripple()
    by_hand = theta.copy()
    for n, i in np.ndindex(5, 6):
        for h, order in enumerate(ORDER):
            by_hand[n, i] += source.sine[i, h] * np.sin(order * theta[n, i])
            by_hand[n, i] += source.cosine[i, h] * np.cos(order * theta[n, i])
    assert_allclose(angles(robot, source, theta), by_hand, atol=1e-15)
    assert np.abs(by_hand - theta).max() > 3e-5  # it bites


def test_slope_against_a_parameter_is_the_difference_quotient(robot):
    theta, step = np.random.default_rng(2).uniform(-1, 1, (4, 6)), 1e-6
    base = JointRipple(np.zeros((6, 3)), np.zeros((6, 3)), ORDER)
    sine = np.zeros((6, 3))
    sine[2, 1] = step
    slope = (angles(robot, JointRipple(sine, base.cosine, ORDER), theta) - angles(robot, base, theta)) / step
    assert_allclose(slope[:, 2], np.sin(14 * theta[:, 2]), atol=1e-9)


def test_orders_and_columns_must_agree():
    with pytest.raises(ValueError, match=r"order: shape \(3,\), expected \(2,\)"):
        JointRipple(np.zeros((6, 2)), np.zeros((6, 2)), ORDER)
