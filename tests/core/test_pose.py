"""Poses against products of 4 by 4 matrices and against pinocchio's placements."""

import operator

import numpy as np
import pinocchio as pin
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from compgen.core.arrays import frozen
from compgen.core.pose import IDENTITY, Pose

ATOL = 1e-14  # [m], and of a matrix entry [-]


def poses(count, seed):
    rng = np.random.default_rng(seed)
    return Pose(rng.uniform(-2, 2, (count, 3)), Rotation.random(count, random_state=seed).as_matrix())


def matrices(pose):
    """4 by 4, of one pose or of each row."""
    matrix = np.zeros((*pose.position.shape[:-1], 4, 4))
    matrix[..., :3, :3], matrix[..., :3, 3], matrix[..., 3, 3] = pose.rotation, pose.position, 1
    return matrix


def test_poses_compose_as_their_matrices_do():
    outer, inner = poses(50, 1), poses(50, 2)
    assert_allclose(matrices(outer @ inner), matrices(outer) @ matrices(inner), atol=ATOL)


def test_one_pose_serves_every_row():
    many, one = poses(20, 3), poses(1, 4)[0]
    assert_allclose(matrices(many @ one), matrices(many) @ matrices(one), atol=ATOL)
    assert_allclose(matrices(one @ many), matrices(one) @ matrices(many), atol=ATOL)
    assert_allclose(matrices(one @ one), matrices(one) @ matrices(one), atol=ATOL)


def test_poses_are_pinocchios_placements():
    outer, inner = poses(1, 5)[0], poses(1, 6)[0]
    a, b = pin.SE3(outer.rotation, outer.position), pin.SE3(inner.rotation, inner.position)
    for ours, theirs in ((outer @ inner, a * b), (outer.inverse(), a.inverse())):
        assert_allclose(ours.position, theirs.translation, atol=ATOL)
        assert_allclose(ours.rotation, theirs.rotation, atol=ATOL)
    assert_allclose(outer.act(inner.position), a.act(inner.position), atol=ATOL)


def test_a_pose_and_its_inverse_are_none():
    many = poses(30, 7)
    for nothing in (many @ many.inverse(), many.inverse() @ many):
        assert_allclose(nothing.position, 0, atol=ATOL)
        assert_allclose(nothing.rotation - IDENTITY.rotation, 0, atol=ATOL)


def test_points_of_the_inner_frame_are_seen_from_the_outer_one():
    many = poses(10, 8)
    point = np.array([0.1, -0.2, 0.3])
    assert_allclose(many.act(point), (matrices(many) @ [*point, 1])[:, :3], atol=ATOL)


def test_rows_are_picked_as_of_an_array():
    many = poses(10, 9)
    for rows in (3, slice(2, 7), np.array([4, 4, 0]), np.arange(10) % 2 == 0):
        assert np.array_equal(many[rows].position, many.position[rows])
        assert np.array_equal(many[rows].rotation, many.rotation[rows])
    assert (len(many), len(many[2:7])) == (10, 5)


def test_stacked_poses_are_the_rows():
    many = poses(4, 10)
    assert np.array_equal(matrices(Pose.stack([many[k] for k in range(4)])), matrices(many))


def test_a_pose_is_moved_along_outer_axes_and_turned_about_its_own():
    """A quarter turn about its own x, which points along the outer y, takes its z from -x to where -y was."""
    pose = Pose(np.array([1.0, 2.0, 3.0]), np.array([[0, 0, -1.0], [1, 0, 0], [0, -1, 0]]))
    moved = pose.moved(np.array([0.1, 0, 0, np.pi / 2, 0, 0]))
    assert_allclose(moved.position, [1.1, 2, 3], atol=ATOL)
    assert_allclose(moved.rotation[:, 0], pose.rotation[:, 0], atol=ATOL)
    assert_allclose(moved.rotation[:, 2], -pose.rotation[:, 1], atol=ATOL)


@pytest.mark.parametrize(
    ("position", "rotation"),
    [((3,), (2, 3, 3)), ((2, 3), (3, 3)), ((2, 3), (1, 3, 3)), ((2,), (2, 2)), ((3,), (9,)), ((4, 2, 3), (4, 2, 3, 3))],
)
def test_other_shapes_are_refused(position, rotation):
    with pytest.raises(ValueError, match="Pose"):
        Pose(np.zeros(position), np.zeros(rotation))


def test_nobody_writes_to_a_pose():
    position = np.zeros((2, 3))
    pose = Pose(position, np.zeros((2, 3, 3)))
    position[0] = 1.0
    assert not pose.position.any()
    with pytest.raises(ValueError, match="read-only"):
        pose.position[0] = 1.0


def test_frozen_arrays_are_taken_over_without_a_copy():
    position, rotation = np.zeros((5, 3)), np.zeros((5, 9))
    pose = Pose.from_rows(position, rotation)
    assert pose.position is frozen(position)
    assert np.shares_memory(pose.rotation, rotation)
    assert np.shares_memory(pose.rotation_rows, rotation)


def test_a_pose_is_no_pair_and_no_operand_of_an_array():
    with pytest.raises(TypeError):
        _, _ = poses(2, 11)
    with pytest.raises(TypeError):
        operator.matmul(np.eye(3), IDENTITY)
    for wrong in (lambda: len(IDENTITY), lambda: IDENTITY[0]):
        with pytest.raises(TypeError, match="one pose"):
            wrong()
