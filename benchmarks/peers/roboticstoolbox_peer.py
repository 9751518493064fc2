"""Hot and cold inverse kinematics of the arm, pose by pose; answers seconds a pose."""

import json
import sys

import numpy as np
import roboticstoolbox as rtb
from chain import flange, off
from clock import median
from spatialmath import SE3

TOLERANCE = 1e-16  # its own error is half a square: some 1e-9 m
question = json.load(sys.stdin)
hot, cold, theta = (np.array(question[name]) for name in ("hot", "cold", "theta"))


def arm(rows):
    """The arm of rows of d, a, alpha."""
    return rtb.DHRobot([rtb.RevoluteDH(d=d, a=a, alpha=alpha) for d, a, alpha in rows])


warm, ets = arm(hot), arm(cold).ets()
poses = [flange(cold, q) for q in theta]
some = [SE3(T, check=False) for T in poses[:20]]


def slow():
    """The hot arm's joints."""
    return [warm.ikine_LM(T, q0=q, tol=TOLERANCE).q for T, q in zip(some, theta, strict=False)]


def fast():
    """The cold arm's joints, by its fastest way."""
    return [ets.ik_LM(T, q0=q, tol=TOLERANCE)[0] for T, q in zip(poses, theta + 1e-3, strict=False)]


answer = {
    "ikine_LM": median(slow) / len(some),
    "ikine_LM off": off(hot, slow(), poses),
    "ik_LM": median(fast) / len(poses),
    "ik_LM off": off(cold, fast(), poses),
}
print(json.dumps(answer))
