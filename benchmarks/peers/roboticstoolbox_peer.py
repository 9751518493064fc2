"""Hot and cold inverse kinematics of the arm, pose by pose; answers seconds a pose."""

import json
import sys
import time

import numpy as np
import roboticstoolbox as rtb
from spatialmath import SE3

question = json.load(sys.stdin)


def arm(rows):
    """The arm of rows of d, a, alpha."""
    return rtb.DHRobot([rtb.RevoluteDH(d=d, a=a, alpha=alpha) for d, a, alpha in rows])


def median(work, rounds=5):
    """Median processor seconds of a call."""
    work()
    found = []
    for _ in range(rounds):
        begin = time.process_time()
        work()
        found.append(time.process_time() - begin)
    return float(np.median(found))


hot, cold = arm(question["hot"]), arm(question["cold"])
theta = np.array(question["theta"])
poses = [SE3(cold.fkine(q)) for q in theta]
near = theta + 1e-3
answer = {
    "ikine_LM": median(lambda: [hot.ikine_LM(T, q0=q) for T, q in zip(poses[:20], near[:20])]) / 20,
}
ets = cold.ets()
matrices = [T.A for T in poses]
answer["ik_LM"] = median(lambda: [ets.ik_LM(T, q0=q) for T, q in zip(matrices, near)]) / len(matrices)
print(json.dumps(answer))
