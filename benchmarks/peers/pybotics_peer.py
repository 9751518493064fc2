"""Inverse kinematics of the hot arm, pose by pose; answers seconds a pose."""

import json
import sys

import numpy as np
from chain import flange, off
from clock import median
from pybotics.robot import Robot

question = json.load(sys.stdin)
hot, cold, theta = (np.array(question[name]) for name in ("hot", "cold", "theta"))
theta = theta[:10]
poses = [flange(cold, q) for q in theta]
# modified rows: alpha and a of the link before; the last link's are a tool
table = np.column_stack([np.append(0, hot[:-1, 2]), np.append(0, hot[:-1, 1]), np.zeros(6), hot[:, 0]])
robot = Robot.from_parameters(table)
robot.joint_limits = np.array([np.full(6, -2 * np.pi), np.full(6, 2 * np.pi)])
tool = np.array([[1, 0, 0, hot[5, 1]], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 1.0]])
c, s = np.cos(hot[5, 2]), np.sin(hot[5, 2])
tool[1:3, 1:3] = [[c, -s], [s, c]]
robot.tool.matrix = tool


def every():
    """Joints of every pose."""
    return [robot.ik(T, q=q) for T, q in zip(poses, theta, strict=False)]


seconds = median(every) / len(theta)
found = every()
if any(q is None for q in found):
    raise SystemExit("found no joints for some poses")
print(json.dumps({"ik": seconds, "ik off": off(hot, found, poses)}))
