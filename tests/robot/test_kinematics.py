import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.rotations import to_wpr
from compgen.core.units import DEG, MM
from compgen.robot.kinematics import BLOCK, evaluate, nominal_chain

# pendant J1..J6 [deg], flange X Y Z [mm], W P R [deg]: published and recomputed pairs of this arm
CHECK_VALUES = [
    ((0, 0, 0, 0, -90, 0), (1166, 0, 865), (180, 0, 0)),
    ((10, 20, -15, 30, -60, 45), (1513.4993, 189.9246, 569.3554), (150.7201, 11.7854, 63.7208)),
    ((10, 20, -15, -150, 60, -135), (1513.4993, 189.9246, 569.3554), (150.7201, 11.7854, 63.7208)),
    ((10, 20, -15, 210, 60, 225), (1513.4993, 189.9246, 569.3554), (150.7201, 11.7854, 63.7208)),
    ((-170, -40, 60, -200, 30, 190), (-91.841, -46.583, 1721.479), (-2.5082, -58.9644, 24.4350)),
    ((20, -80, -150, 10, 40, 0), (-1474.831, -516.008, -667.117), (-170.8266, 19.3867, 28.1068)),
    ((0, 0, 80, 0, -30, 0), (271.497, 0, 2034.143), (0, -40, 180)),
    ((0, 0, 81, 0, -30, 0), (251.161, 0, 2036.086), (0, -39, 180)),
]


@pytest.fixture(scope="module")
def forward(robot):
    theta = ca.SX.sym("theta", 6)
    position, rotation = nominal_chain(robot, theta).pose_expr()
    return ca.Function("forward", [theta], [position, ca.densify(rotation)])


@pytest.mark.parametrize(("pendant", "position", "wpr"), CHECK_VALUES)
def test_flange_stands_where_the_check_values_say(robot, forward, pendant, position, wpr):
    p, r = evaluate(forward, robot.to_theta(np.array([pendant]) * DEG))
    assert_allclose(p[0] / MM, position, atol=6e-4)  # mm, as printed
    rotation = r.reshape(-1, 3, 3).transpose(0, 2, 1)
    off = np.array([a[0] for a in to_wpr(rotation)]) / DEG - wpr
    assert_allclose((off + 180) % 360 - 180, 0, atol=6e-5)  # deg, as printed


def test_all_zero_joints_give_the_mastering_pose(robot, forward):
    p, r = evaluate(forward, robot.to_theta(np.zeros((1, 6))))
    assert_allclose(p[0] / MM, (1341, 0, 1040), atol=1e-9)
    assert_allclose(r.reshape(3, 3).T, [[0, 0, 1], [0, -1, 0], [1, 0, 0]], atol=1e-12)  # tool z along +x


def test_a_chain_with_alpha6_zero_points_the_tool_backwards(robot, forward):
    """The study's Table 2 has alpha6 = 0: same positions, orientation off by Rx(180)."""
    from dataclasses import replace

    alpha = robot.alpha.copy()
    alpha[5] = 0.0
    theta = ca.SX.sym("theta", 6)
    position, rotation = nominal_chain(replace(robot, alpha=alpha), theta).pose_expr()
    other = ca.Function("other", [theta], [position, ca.densify(rotation)])
    q = np.random.default_rng(1).uniform(-2, 2, (50, 6))
    (p0, r0), (p1, r1) = evaluate(forward, q), evaluate(other, q)
    assert_allclose(p0, p1, atol=1e-14)
    turned = r1.reshape(-1, 3, 3).transpose(0, 2, 1) @ np.diag([1.0, -1.0, -1.0])
    assert_allclose(r0.reshape(-1, 3, 3).transpose(0, 2, 1), turned, atol=1e-14)


def test_evaluate_agrees_with_casadi_across_blocks(forward):
    q = np.random.default_rng(2).uniform(-3, 3, (BLOCK + 7, 6))
    p, r = evaluate(forward, q)
    for row in (0, 1, BLOCK - 1, BLOCK, BLOCK + 6):
        exact_p, exact_r = forward(q[row])
        assert_allclose(p[row], np.asarray(exact_p).ravel(), atol=1e-14)
        assert_allclose(r[row], np.asarray(exact_r).ravel(order="F"), atol=1e-14)


def test_evaluate_knows_every_operation_it_offers():
    x = ca.SX.sym("x", 2)
    a, b = x[0], x[1]
    outputs = [a + b, a - b, a * b, a / b, -a, a**2, 2 * a, ca.sqrt(a), ca.sin(a), ca.cos(a), ca.atan2(a, b)]
    outputs += [1 / a, ca.fabs(-a), ca.exp(a), a**b, a**3.5]
    f = ca.Function("f", [x], [ca.vertcat(*outputs), ca.SX(3.0)])
    rows = np.random.default_rng(3).uniform(0.5, 2, (20, 2))
    values, constant = evaluate(f, rows)
    for row, value in zip(rows, values):
        assert_allclose(value, np.asarray(f(row)[0]).ravel(), rtol=1e-14)
    assert_allclose(constant, 3.0)


def test_one_row_serves_all_points():
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    f = ca.Function("f", [x, y], [x * y])
    (out,) = evaluate(f, np.arange(5.0)[:, None], np.array([[3.0]]))
    assert_allclose(out.ravel(), 3 * np.arange(5.0))
