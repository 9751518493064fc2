"""What a program means: poses in SI, the motion that leads to each, and CONFIG."""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, own
from compgen.core.evaluation import by_rows
from compgen.robot.inverse_kinematics import Posture
from compgen.robot.robot import Robot

#: Fitted over real exports: a store's bytes for a program, a single-group position and a motion line.
MEMORY_PROGRAM, MEMORY_POSITION, MEMORY_MOTION = 400, 35, 28
REMARK = 40.0  # bytes that a remark at a page's head takes at most
CALL = 50.0  # bytes of a call in the main program besides the name, its message and its pause included
HAIR = 1e-8  # rad: so near below 180 deg an angle counts as 180


@dataclass(frozen=True, eq=False, slots=True)
class Program:
    """N positions in user frame ``uframe`` and tool ``utool``, driven in order.

    The first is reached by a joint motion, the others by straight lines.
    """

    name: str
    comment: str
    date: str  # "YY-MM-DD"
    remarks: tuple[str, ...]
    uframe: int
    utool: int
    position: Array  # (N, 3) [m]
    rotation: Array  # (N, 3, 3)
    posture: Posture
    turns: IntArray  # (N, 3) the three digits of CONFIG
    speed: Array  # (N - 1,) [m/s] of the line that ends at position n + 1
    fine: BoolArray  # (N,) stops there
    decimals: int = 3  # of each number, 3 to 6

    def __post_init__(self) -> None:
        own(self, position=("N", 3), rotation=("N", 3, 3), turns=("N", 3), speed=("S",), fine=("N",))


def program_name(text: str, length: int) -> str:
    """A name the controller takes: capitals, digits and _, a letter first, no longer than ``length``."""
    name = re.sub(r"[^A-Z0-9_]", "_", text.upper())
    return (name if name[:1].isalpha() else f"P{name}")[:length].rstrip("_") or "P"


def turn_digits(robot: Robot, theta: Array) -> IntArray:
    """CONFIG's digits: 0 for -179..179 deg, 1 for 180..539, -1 for -180..-539, (N, 3)."""

    def digits(theta: Array) -> Any:
        angle = robot.to_pendant(theta)[:, np.array(robot.controller.turn_joints) - 1]
        if np.abs(angle).max(initial=0.0) < np.pi - 2 * HAIR:
            return np.zeros(angle.shape, dtype=np.int64)
        return (np.sign(angle) * np.floor((np.abs(angle) + np.pi + HAIR) / (2 * np.pi))).astype(np.int64)

    found: Any = by_rows(digits, theta)
    return np.asarray(found, dtype=np.int64)


def apply_turns(robot: Robot, theta: Array, turns: IntArray) -> Array:
    """The joint angles that CONFIG's digits mean, from angles of any turn, (N, 6) [rad]."""
    return by_rows(lambda theta, turns: _apply_turns(robot, theta, turns), theta, turns)  # type: ignore[arg-type]


def _apply_turns(robot: Robot, theta: Array, turns: IntArray) -> Array:
    pendant = robot.to_pendant(theta)
    for column, joint in enumerate(robot.controller.turn_joints):
        a, n = pendant[:, joint - 1], turns[:, column]
        # into [-180, 180) for n > 0 and (-180, 180] for the others, then n whole turns
        angle = np.pi - _within_a_turn(np.pi - a)
        if n.any():
            up = _within_a_turn(a + np.pi + HAIR) - np.pi - HAIR
            down = np.pi + HAIR - _within_a_turn(np.pi + HAIR - a)
            angle = np.where(n == 0, angle, np.where(n > 0, up, down)) + 2 * np.pi * n
        pendant[:, joint - 1] = angle
    return robot.to_theta(pendant)


def _within_a_turn(angle: Array) -> Array:
    """Into [0, 2 pi), (N,) [rad]; mostly there already, and then as it is."""
    inside = angle.size and angle.min() >= 0 and angle.max() < 2 * np.pi
    return angle if inside else np.asarray(np.mod(angle, 2 * np.pi))


def posture_of(robot: Robot, theta: Array) -> list[Posture]:
    """CONFIG's letters from joint angles, by FANUC's rules, (N,).

    Flip when J5 > 0; up when cos(theta_3 + g) > 0 with g = atan2(a3, d4); front when the wrist centre lies before
    axis 1.
    """
    return [Posture(bool(f), bool(u), bool(w)) for f, u, w in zip(*_letters(robot, theta))]


def posture_numbers(robot: Robot, theta: Array) -> IntArray:
    """CONFIG's letters from joint angles, as numbers in ``ALL_POSTURES``, (N,)."""
    front, up, flip = (letter.astype(np.int64) for letter in _letters(robot, theta))
    return np.asarray(4 * (1 - front) + 2 * (1 - up) + flip)


def in_posture(robot: Robot, theta: Array, posture: Posture) -> BoolArray:
    """Whether joint angles have the letters of a posture, (N,)."""
    front, up, flip = _letters(robot, theta)
    return np.asarray((front == posture.front) & (up == posture.up) & (flip == posture.flip))


def _letters(robot: Robot, theta: Array) -> tuple[BoolArray, BoolArray, BoolArray]:
    """Front, up and flip, (N,) each."""
    found: Any = by_rows(lambda theta: _bits(robot, theta), theta)
    front, up, flip = found.T
    return front, up, flip


def _bits(robot: Robot, theta: Array) -> Any:
    a, d = robot.a, robot.d
    beta = -theta[:, 1]
    forearm = beta + theta[:, 2] - np.pi / 2
    reach = a[0] + a[1] * np.cos(beta) - d[3] * np.cos(forearm) - a[2] * np.sin(forearm)
    up = np.cos(theta[:, 2] + np.arctan2(a[2], -d[3])) > 0
    return np.column_stack([reach > 0, up, theta[:, 4] - robot.pendant_zero[4] > 0])


def estimated_memory(program: Program) -> float:
    """Bytes of the controller's program store."""
    return MEMORY_PROGRAM + len(program.position) * (MEMORY_POSITION + MEMORY_MOTION)
