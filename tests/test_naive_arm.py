"""The second arm is the arm as it was published, and its inverses are inverses."""

import naive_arm
import numpy as np
import pytest
from naive_arm import config, flange, joints_at, joints_by_config, shifted, turned


def as_published(joints):
    """The flange link by link: rz(J1) tx150 ry(J2) tz870 ry(-(J2+J3)) tz170 rx(-J4) tx1016 ry(-J5) tx175 rx(-J6)."""
    j1, j2, j3, j4, j5, j6 = np.radians(joints)
    arm = turned("z", j1) @ shifted(150) @ turned("y", j2) @ shifted(z=870) @ turned("y", -(j2 + j3)) @ shifted(z=170)
    arm = arm @ turned("x", -j4) @ shifted(1016) @ turned("y", -j5) @ shifted(175) @ turned("x", -j6)
    return (arm @ turned("y", -np.pi / 2) @ turned("x", np.pi))[0]


@pytest.fixture(scope="module")
def pendant():
    """Angles of many postures; one is where a turn begins, as 180 deg with the digit -1."""
    drawn = np.random.default_rng(5).uniform([-170, -40, -40, -170, 10, -170], [170, 80, 60, 170, 110, 170], (50, 6))
    drawn[::2, 4] *= -1
    drawn[0, 3] = -180
    return drawn


def test_the_chain_is_the_arm_link_by_link(pendant):
    np.testing.assert_allclose([flange(q) for q in pendant], [as_published(q) for q in pendant], atol=1e-9)


def test_the_closed_form_by_config_finds_the_joints(pendant):
    letters = [config(q) for q in pendant]
    assert len({c.split(",")[0] for c in letters}) > 3
    joints = joints_by_config(np.array([as_published(q) for q in pendant]), letters)
    np.testing.assert_allclose(np.degrees(joints), pendant, atol=1e-6)


def test_newtons_method_finds_the_joints_from_a_guess(pendant):
    for q in pendant[1:]:
        np.testing.assert_allclose(joints_at(as_published(q), q + 1.0), q, atol=1e-6)


def test_what_is_out_of_reach_is_not_found():
    with pytest.raises(naive_arm.UnreachableError, match=r"P\[1\]"):
        joints_at(naive_arm.frame(3000, 0, 0, 180, 0, 0), [0, 0, 0, 0, -90, 0])
