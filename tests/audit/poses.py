"""Poses as pairs, position (M, 3) [mm] and rotation (M, 3, 3): frames and tools of a path file, World and flange."""

import naive_arm
import numpy as np


def of_table(table):
    """X Y Z W P R of a path file's table as position (3,) [mm] and rotation (3, 3)."""
    matrix = naive_arm.frame_of(table)
    return matrix[:3, 3], matrix[:3, :3]


def of_matrices(matrices):
    """Of (M, 4, 4)."""
    return matrices[:, :3, 3], matrices[:, :3, :3]


def in_world(frame, position, rotation):
    """Poses given in a frame."""
    return frame[0] + position @ frame[1].T, frame[1] @ rotation


def flange(pose, tool):
    """Where the flange is when the tool centre point is at poses: T tool^-1."""
    rotation = pose[1] @ tool[1].T
    return pose[0] - rotation @ tool[0], rotation


def tool_centre(pose, tool):
    """Where the tool centre point is when the flange is at poses: T tool."""
    return pose[0] + pose[1] @ tool[0], pose[1] @ tool[1]


def halfway(pose):
    """Between each pose and the next, (M - 1): the mean rotation, made orthonormal."""
    position, rotation = ((x[:-1] + x[1:]) / 2 for x in pose)
    return position, rotation @ (3 * np.eye(3) - np.swapaxes(rotation, 1, 2) @ rotation) / 2


def angle(a, b, axis):
    """Between one axis of rotations (M, 3, 3), (M,) [rad]."""
    sine = np.linalg.norm(np.cross(a[:, :, axis], b[:, :, axis]), axis=1)
    return np.arctan2(sine, (a[:, :, axis] * b[:, :, axis]).sum(axis=1))
