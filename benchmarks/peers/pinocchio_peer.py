"""Closed-loop inverse kinematics of the hot arm in Python, as pinocchio's example does it, and with whole steps."""

import json
import sys

import numpy as np
import pinocchio as pin
from chain import flange, off
from clock import median

question = json.load(sys.stdin)
hot, cold, theta = (np.array(question[name]) for name in ("hot", "cold", "theta"))
theta = theta[:10]
poses = [flange(cold, q) for q in theta]

model, parent = pin.Model(), 0
before = pin.SE3.Identity()  # of the link before: along x by a, about x by alpha
for k, (d, a, alpha) in enumerate(hot):
    place = before * pin.SE3(np.eye(3), np.array([0.0, 0.0, d]))
    parent = model.addJoint(parent, pin.JointModelRZ(), place, f"J{k + 1}")
    before = pin.SE3(pin.utils.rotate("x", alpha), np.array([a, 0.0, 0.0]))
last = before
data = model.createData()


def solved(T, start, step, damp):
    """The joints that bring the flange to a pose, by steps of a share of Newton's."""
    goal = pin.SE3(T[:3, :3], T[:3, 3]) * last.inverse()
    q = start.copy()
    for _ in range(2000):
        pin.forwardKinematics(model, data, q)
        apart = data.oMi[6].actInv(goal)
        error = pin.log(apart).vector
        if np.linalg.norm(error) < 1e-9:
            break
        J = -pin.Jlog6(apart.inverse()) @ pin.computeJointJacobian(model, data, q, 6)
        v = -J.T @ np.linalg.solve(J @ J.T + damp * np.eye(6), error)
        q = pin.integrate(model, q, v * step)
    return q


answer = {}
for name, step, damp in (("example", 0.1, 1e-12), ("whole steps", 1.0, 1e-12)):

    def every(step=step, damp=damp):
        """Joints of every pose."""
        return [solved(T, q, step, damp) for T, q in zip(poses, theta, strict=False)]

    answer[name] = median(every) / len(theta)
    answer[f"{name} off"] = off(hot, every(), poses)
print(json.dumps(answer))
