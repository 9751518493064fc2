"""CONFIG: which solution a Cartesian position names: posture and turns of joint angles, as the controller counts them.

CONFIG : 'N U T, 0, 0, 0'         wrist No flip / Flip, elbow Up / Down, arm fronT / Back; turns of three joints
"""

import re
from typing import Any

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.evaluation import map_rows
from compgen.robot.inverse_kinematics import Posture
from compgen.robot.joint_path import legal_turns, wrist_centre
from compgen.robot.robot import Robot

#: The text between the quotes: wrist, elbow, arm, and the three turns where they are given.
CONFIG = re.compile(r"\s*([NF])\s*([UD])\s*([TB])\s*(?:,\s*(-?\d{1,4})\s*,\s*(-?\d{1,4})\s*,\s*(-?\d{1,4}))?\s*$")
TOLERANCE = 1e-8  # rad: so near below 180 deg an angle counts as 180


def parse_config(text: str) -> tuple[Posture | None, tuple[int, ...]]:
    """Posture and turns of CONFIG's text; no posture and no turns where it names none of this arm."""
    match = CONFIG.match(text)
    if match is None:
        return None, (0, 0, 0)
    wrist, elbow, arm, *turns = match.groups()
    return Posture(arm == "T", elbow == "U", wrist == "F"), tuple(int(turn or 0) for turn in turns)


def config_letters(posture: Posture) -> str:
    """CONFIG's letters: wrist, elbow, arm."""
    return f"{'F' if posture.flip else 'N'} {'U' if posture.up else 'D'} {'T' if posture.front else 'B'}"


def turn_digits(robot: Robot, theta: Array) -> IntArray:
    """CONFIG's turns: 0 for -179..179 deg, 1 for 180..539, -1 for -180..-539, (N, 3)."""

    def turns(theta: Array) -> Any:
        angle = robot.to_pendant(theta)[:, np.array(robot.controller.turn_joints) - 1]
        if np.abs(angle).max(initial=0.0) < np.pi - 2 * TOLERANCE:
            return np.zeros(angle.shape, dtype=np.int64)
        return (np.sign(angle) * np.floor((np.abs(angle) + np.pi + TOLERANCE) / (2 * np.pi))).astype(np.int64)

    digits: Any = map_rows(turns, theta)
    return np.asarray(digits, dtype=np.int64)


def apply_turns(robot: Robot, theta: Array, turns: IntArray) -> Array:
    """The joint angles that CONFIG's turns mean, from angles of any turn, (N, 6) [rad]."""
    return map_rows(lambda theta, turns: _apply_turns(robot, theta, turns), theta, turns)  # type: ignore[arg-type]


def _apply_turns(robot: Robot, theta: Array, turns: IntArray) -> Array:
    pendant = robot.to_pendant(theta)
    for column, joint in enumerate(robot.controller.turn_joints):
        a, n = pendant[:, joint - 1], turns[:, column]
        # into [-180, 180) for n > 0 and (-180, 180] for the others, then n whole turns
        angle = np.pi - _within_a_turn(np.pi - a)
        if n.any():
            up = _within_a_turn(a + np.pi + TOLERANCE) - np.pi - TOLERANCE
            down = np.pi + TOLERANCE - _within_a_turn(np.pi + TOLERANCE - a)
            angle = np.where(n == 0, angle, np.where(n > 0, up, down)) + 2 * np.pi * n
        pendant[:, joint - 1] = angle
    named = robot.to_theta(pendant)
    free = np.setdiff1d(np.arange(6), np.array(robot.controller.turn_joints) - 1)
    named[:, free] = legal_turns(robot, named)[:, free]  # CONFIG has no turns for the others: the legal one is meant
    return named


def _within_a_turn(angle: Array) -> Array:
    """Into [0, 2 pi), (N,) [rad]; mostly it is there already, and then returned as it is."""
    inside = angle.size and angle.min() >= 0 and angle.max() < 2 * np.pi
    return angle if inside else np.asarray(np.mod(angle, 2 * np.pi))


def postures_of(robot: Robot, theta: Array) -> list[Posture]:
    """Postures of joint angles by FANUC's rules, (N,).

    Flip when J5 > 0; up when cos(theta_3 + g) > 0 with g = atan2(a3, d4); front when the wrist centre lies before
    axis 1.
    """
    return [Posture(bool(f), bool(u), bool(w)) for f, u, w in zip(*_front_up_flip(robot, theta), strict=True)]


def posture_indices(robot: Robot, theta: Array) -> IntArray:
    """Postures of joint angles as indices of ``ALL_POSTURES``, (N,)."""
    front, up, flip = (letter.astype(np.int64) for letter in _front_up_flip(robot, theta))
    return np.asarray(4 * (1 - front) + 2 * (1 - up) + flip)


def has_posture(robot: Robot, theta: Array, posture: Posture) -> BoolArray:
    """Whether joint angles are in a posture, (N,)."""
    front, up, flip = _front_up_flip(robot, theta)
    return np.asarray((front == posture.front) & (up == posture.up) & (flip == posture.flip))


def _front_up_flip(robot: Robot, theta: Array) -> tuple[BoolArray, BoolArray, BoolArray]:
    """Each (N,)."""

    def bits(theta: Array) -> Any:
        up = np.cos(theta[:, 2] + np.arctan2(robot.a[2], -robot.d[3])) > 0
        front = wrist_centre(robot, theta)[:, 0] > 0
        return np.column_stack([front, up, theta[:, 4] > 0])

    columns: Any = map_rows(bits, theta)
    front, up, flip = columns.T
    return front, up, flip
